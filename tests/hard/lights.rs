//! Hard cases: `src/hard_cases/lights.rs`.
#![cfg(feature = "reference")]

hard_cases! {
    camlux::hard_cases::lights::CASES;
    light_a_millimetre_above_a_surface,
    light_on_a_surface_along_the_axes,
    light_on_a_tilted_surface,
    light_in_a_corner_of_a_mesh,
    spot_mounted_on_a_tilted_ceiling,
    light_inside_closed_geometry,
    light_at_the_camera,
    spot_of_half_a_degree,
    narrowest_spot,
    spot_of_179_degrees,
    spot_with_equal_cones,
    edge_of_the_cone_inside_one_texel,
    spot_axis_along_every_edge_of_the_cube,
    directional_light_at_89_99_degrees,
    point_light_a_hundred_thousand_kilometres_away,
    known_issue_shadow_map_of_a_light_far_away,
    power_from_a_trillionth_of_a_watt_to_a_trillion,
    light_without_power,
    sixty_four_lights,
}
