//! The space in which the device computes.

use crate::common::gpu::{Gpu, demo_scene, plain_sum};
use camlux::LocalSpace;
use camlux::output::Layer;
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

/// A wall at y = 4 485 513 m: the layer P has steps of half a metre, and the layer in camera space has not.
#[test]
fn positions_in_the_cameras_axes_are_exact_far_from_the_origin() {
    let mut gpu = Gpu::open();
    let scene = || plain_sum(demo_scene("cornell", [24, 24]), 16);
    let near = gpu.render(&scene());
    assert_eq!(near.warnings(), [""; 0]);
    let offset_m = DVec3::new(396_213.0, 4_485_513.0, 87.0);
    let mut far = scene();
    far.camera.position_m += offset_m;
    far.camera.look_at_m += offset_m;
    for light in &mut far.lights {
        *light.position_m_mut().expect("it has one") += offset_m;
    }
    for instance in &mut far.meshes {
        instance.to_world.translation += offset_m;
    }
    let frame = gpu.render(&far);
    let warnings = frame.warnings();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(
        warnings[0].contains("the layer P is up to 0.25 m off; use the layer P_camera"),
        "{warnings:?}"
    );
    let size_m = 2.0;
    let [a, b] = [&near, &frame].map(|frame| {
        let values = frame
            .values(Layer::CameraPosition)
            .expect("every frame has it");
        values.as_chunks::<3>().0
    });
    let mut compared = 0;
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        let ids = [&near, &frame].map(|frame| frame.ids(Layer::InstanceId).unwrap()[i]);
        let depths = [&near, &frame].map(|frame| frame.values(Layer::Depth).unwrap()[i]);
        // At an edge the two may show different surfaces.
        if ids[0] == 0 || ids[0] != ids[1] || (depths[0] - depths[1]).abs() > 1e-3 {
            continue;
        }
        compared += 1;
        assert_eq!(b[2], depths[1]);
        let [a, b] = [a, b].map(|p| DVec3::from(p.map(f64::from)));
        assert!(a.distance(b) < 2e-6 * size_m, "{i}: {a} {b}");
    }
    // Of 576, without the edges.
    assert!(compared > 400, "{compared}");
    // In the world, it is the point that P rounds.
    let basis = far.camera.basis();
    let positions = near.values(Layer::Position).unwrap().as_chunks::<3>().0;
    let eye_m = far.camera.position_m - offset_m;
    for (position, &[x, y, z]) in positions.iter().zip(a).filter(|(_, p)| p[2] > 0.0) {
        let [x, y, z] = [x, y, z].map(f64::from);
        let world = eye_m + x * basis.right + y * basis.down + z * basis.forward;
        assert!(world.distance(DVec3::from(position.map(f64::from))) < 2e-6);
    }
}
