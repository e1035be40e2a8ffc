//! Box and sphere around the surfaces.

use crate::common::instances::crowd;
use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE};
use camlux::scene::Scene;
use glam::{DMat3, DVec3};

/// Rotated positions of a few metres: a handful of roundings of 1e-16 each.
const ROUNDING: f64 = 1e-14;

const SOLID: &str =
    "mtllib mesh.mtl\nusemtl white\nv 9 9 9\nv 0 0 0\nv 4 0 0\nv 4 2 0\nv 0 2 0\nv 1 1 3
f 2 3 4 5\nf 2 3 6\nf 4 5 6\n";

fn load_obj(obj: &str) -> Scene {
    SceneFolder::new().load_obj(obj).unwrap()
}

#[track_caller]
fn assert_near(actual: DVec3, expected: DVec3, tolerance: f64) {
    let distance = actual.distance(expected);
    assert!(
        distance <= tolerance,
        "{actual} is {distance:e} from {expected}"
    );
}

#[test]
fn bounding_box_holds_used_vertices_only() {
    let mut scene = load_obj(SOLID);
    scene.meshes[0].positions_m.push(DVec3::splat(99.0));
    let bounds = scene.bounding_box().unwrap();
    assert_eq!(bounds.min_m, DVec3::ZERO);
    assert_eq!(bounds.max_m, DVec3::new(4.0, 2.0, 3.0));
    assert_eq!(bounds.centre_m(), DVec3::new(2.0, 1.0, 1.5));
}

#[test]
fn bounding_sphere_turns_with_the_scene_and_ignores_order_and_tessellation() {
    let folder = SceneFolder::new();
    folder.write("mesh.obj", SOLID);
    folder.write("other.obj", TRIANGLE);
    let other = "[[mesh]]\npath = \"other.obj\"\n";
    let load = |toml: String| folder.load(&format!("{CAMERA}{LIGHT}{toml}")).unwrap();
    let sphere = load(format!("{MESH}{other}")).bounding_sphere().unwrap();

    let swapped = load(format!("{other}{MESH}")).bounding_sphere().unwrap();
    assert_near(swapped.centre_m, sphere.centre_m, ROUNDING);
    assert!((swapped.radius_m - sphere.radius_m).abs() < ROUNDING);

    let turn = "rotate_deg = [17, 29, -71]\n";
    let turned = load(format!("{MESH}{turn}{other}{turn}"));
    let turned = turned.bounding_sphere().unwrap();
    let [x, y, z] = [17.0_f64, 29.0, -71.0].map(f64::to_radians);
    let rotation =
        DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
    assert_near(turned.centre_m, rotation * sphere.centre_m, ROUNDING);
    assert!((turned.radius_m - sphere.radius_m).abs() < ROUNDING);

    // At 10⁷ m, positions and the centre are rounded to 2e-9 m.
    let far = "translate = [1e7, 1e7, 0]\n";
    let moved = load(format!("{MESH}{far}{other}{far}"));
    let moved = moved.bounding_sphere().unwrap();
    let expected = sphere.centre_m + DVec3::new(1e7, 1e7, 0.0);
    assert_near(moved.centre_m, expected, 4e-9);
    assert!((moved.radius_m - sphere.radius_m).abs() < 8e-9);

    folder.write(
        "other.obj",
        TRIANGLE.replace("f 1 2 3", "v 0.25 0.25 0\nf 1 2 4\nf 2 3 4\nf 3 1 4"),
    );
    let cut = load(format!("{MESH}{other}")).bounding_sphere().unwrap();
    assert_near(cut.centre_m, sphere.centre_m, ROUNDING);
}

#[test]
fn bounding_sphere_of_a_quad_and_of_no_area() {
    let quad = "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4\n";
    let sphere = load_obj(quad).bounding_sphere().unwrap();
    assert_near(sphere.centre_m, DVec3::new(1.0, 1.0, 0.0), ROUNDING);
    assert!((sphere.radius_m - 2.0_f64.sqrt()).abs() < ROUNDING);

    let line = TRIANGLE.replace("v 0 1 0", "v 2 0 0");
    let sphere = load_obj(&line).bounding_sphere().unwrap();
    assert_near(sphere.centre_m, DVec3::X, ROUNDING);
    assert!((sphere.radius_m - 1.0).abs() < ROUNDING);
}

/// The bounds come from the mesh's bounds where an instance is rotated and scaled uniformly, and from its triangles where it is stretched.
#[test]
fn instances_have_the_bounds_of_their_copies() {
    let scene = crowd([8, 8]);
    let copies = scene.flattened();
    let [bounds, expected] = [&scene, &copies].map(|scene| scene.bounding_box().unwrap());
    assert_near(bounds.min_m, expected.min_m, ROUNDING);
    assert_near(bounds.max_m, expected.max_m, ROUNDING);
    let [sphere, expected] = [&scene, &copies].map(|scene| scene.bounding_sphere().unwrap());
    assert_near(sphere.centre_m, expected.centre_m, 10.0 * ROUNDING);
    assert!((sphere.radius_m - expected.radius_m).abs() < 10.0 * ROUNDING);
}
