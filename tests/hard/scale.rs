//! Hard cases: `src/hard_cases/scale.rs`.
#![cfg(feature = "reference")]

hard_cases! {
    camlux::hard_cases::scale::CASES;
    scene_of_a_millimetre,
    scene_of_ten_kilometres,
    scene_a_hundred_kilometres_away,
    scene_ten_thousand_kilometres_away,
    tunnel_of_a_kilometre,
    near_and_far_a_millionfold_apart,
    known_issue_near_and_far_off_the_middle_of_the_scene,
    known_issue_shadows_of_a_millimetre_in_two_kilometres,
}
