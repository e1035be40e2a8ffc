//! Hard cases: `src/hard_cases/material.rs`.
#![cfg(feature = "reference")]

hard_cases! {
    camlux::hard_cases::material::CASES;
    diffuse_reflectance_of_zero_and_one,
    mirror_like_reflectance_of_one,
    shininess_of_zero,
    shininess_of_one,
    shininess_of_ten_thousand,
    shininess_of_a_million,
    glossy_seen_in_glossy,
    facets_almost_smooth,
    facets_of_every_kind,
    light_that_grazes_facets,
    texture_of_black_and_white,
    reflects_more_than_it_receives,
}
