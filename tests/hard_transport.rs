//! Hard cases: `src/doctor/transport.rs`.
#![cfg(feature = "reference")]

mod gpu;
mod hard;

hard_cases! {
    camlux::doctor::Group::Transport;
    sphere_lit_from_its_centre,
    no_vpl_above_the_horizon,
    #[ignore = "known issue: by rays, what the pilot learned is looked up in a list that has no entries, and the library panics"]
    no_vpl_at_all,
    every_vpl_hidden,
    light_only_through_a_slit,
    single_convex_object,
    grazing_receivers_and_vpls,
    #[ignore = "known issue: by rays, a light whose map misses everything leaves a list without entries, and the library panics"]
    wedge_of_a_hundredth_of_a_degree,
    one_and_a_half_million_vpls,
}
