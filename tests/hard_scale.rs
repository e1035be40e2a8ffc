//! Hard cases: `src/doctor/scale.rs`.
#![cfg(feature = "reference")]

mod gpu;
mod hard;

hard_cases! {
    camlux::doctor::Group::Scale;
    scene_of_a_millimetre,
    scene_of_ten_kilometres,
    scene_a_hundred_kilometres_away,
    scene_ten_thousand_kilometres_away,
    tunnel_of_a_kilometre,
    near_and_far_a_millionfold_apart,
    #[ignore = "known issue: corners of triangles are kept in f32 about the middle of the whole scene, and not of what the camera is near to"]
    near_and_far_off_the_middle_of_the_scene,
    #[ignore = "known issue: what is nearer to a surface than 1.4e-6 of half the scene's size, here 1.4 mm, throws no shadow on it"]
    shadows_of_a_millimetre_in_two_kilometres,
}
