//! Hard cases: `src/hard_cases/geometry.rs`.
#![cfg(feature = "reference")]

hard_cases! {
    camlux::hard_cases::geometry::CASES;
    corner_of_two_walls_down_to_a_millionth,
    light_that_follows_into_the_corner,
    receiver_inside_the_texel_of_its_own_vpl,
    receiver_and_vpl_in_one_plane,
    receiver_at_the_vpl,
    wall_of_a_millimetre,
    wall_without_thickness_lit_on_one_side,
    slats_thinner_than_a_texel,
    known_issue_shadow_map_of_slats_thinner_than_a_texel,
    meshes_that_pass_through_each_other,
    two_meshes_in_one_place,
    needles_and_triangles_without_area,
    one_triangle_fills_the_view,
    triangle_through_the_camera,
    camera_on_a_surface,
    views_of_a_thousandth_of_a_degree_and_of_179,
    shading_normals_against_the_geometry,
    two_million_triangles,
    two_materials_in_one_place,
    mesh_with_t_junctions,
    fan_of_three_thousand_needles,
    room_in_a_mirror,
    images_of_one_pixel_and_oblong_ones,
    shading_normals_across_the_geometry,
    no_triangle_in_view,
    closed_box_with_camera_and_light_inside,
}
