//! The space in which the device computes.

use camlux::LocalSpace;
use camlux::scene::BoundingBox;
use glam::DVec3;

#[test]
fn far_positions_keep_their_detail() {
    let far = DVec3::new(1e7, -2e6, 3e5);
    let bounds = BoundingBox {
        min_m: far,
        max_m: far + DVec3::new(3.0, 1.0, 2.0),
    };
    let space = LocalSpace::of(Some(bounds));
    let point = far + DVec3::new(1.234567, 0.5, 1.999);
    let error_m = (space.to_world(space.to_local(point)) - point).length();
    // Half an ulp of f32 at 1 local unit (2 m) is 1.2e-7 m; half an ulp of f64 at 1e7 m is 1e-9 m.
    assert!(error_m < 2.5e-7, "{error_m}");
}

#[test]
fn a_scene_of_one_point_has_a_space() {
    let point = DVec3::splat(5.0);
    let bounds = BoundingBox {
        min_m: point,
        max_m: point,
    };
    assert_eq!(LocalSpace::of(Some(bounds)).metres_per_unit, 1.0);
}
