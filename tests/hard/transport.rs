//! Hard cases: `src/hard_cases/transport.rs`.
#![cfg(feature = "reference")]

hard_cases! {
    camlux::hard_cases::transport::CASES;
    sphere_lit_from_its_centre,
    no_vpl_above_the_horizon,
    no_vpl_at_all,
    every_vpl_hidden,
    light_only_through_a_slit,
    single_convex_object,
    grazing_receivers_and_vpls,
    wedge_of_a_hundredth_of_a_degree,
    one_and_a_half_million_vpls,
}
