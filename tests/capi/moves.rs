//! A scene whose camera, light or instance moves renders as one that was built that way.

use crate::host::*;
use camlux::{
    capi::*,
    glam::{DQuat, DVec3},
    scene::{IndirectLight, Mesh, VplSum},
};

const SIZE_PX: [u32; 2] = [24, 20];

#[test]
fn a_moved_camera_is_a_scene_built_that_way_and_draws_no_maps() {
    let device = Device::open();
    let scene = load_at("cornell", SIZE_PX);
    let renderer = device.renderer();
    let first = renderer.render(&scene);
    assert!(first.passes().iter().any(|pass| pass == "rsm"));
    // Half a turn about x: the optical frame's +z points along -z, and its +y (down) along -y.
    let position_m = DVec3::new(0.1, 1.1, 3.0);
    let turn = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);
    scene.place(CAMLUX_PART_CAMERA, 0, position_m, turn);
    let second = renderer.render(&scene);
    for pass in second.passes() {
        assert!(pass != "rsm" && pass != "vpl", "{pass}");
    }
    let mut expected = engine_scene("cornell", SIZE_PX);
    expected.camera.position_m = position_m;
    expected.camera.look_at_m = position_m - DVec3::Z;
    expected.camera.up = DVec3::Y;
    assert!(second.layers() == engine_frame(&expected));
    assert!(second.layers() != first.layers());
}

#[test]
fn a_moved_light_is_a_scene_built_that_way() {
    let device = Device::open();
    let scene = load_at("cornell_spot", SIZE_PX);
    let renderer = device.renderer();
    let first = renderer.render(&scene);
    // A quarter turn about x takes +z to -y.
    let turn = DQuat::from_xyzw(0.5_f64.sqrt(), 0.0, 0.0, 0.5_f64.sqrt());
    let moved_m = DVec3::new(0.2, 1.5, -0.1);
    scene.place(CAMLUX_PART_LIGHT, 0, moved_m, turn);
    let second = renderer.render(&scene);
    assert!(second.passes().iter().any(|pass| pass == "light_rays"));
    let mut expected = engine_scene("cornell_spot", SIZE_PX);
    let lamp = expected.lights[0].lamp_mut().expect("it is a spot light");
    lamp.position_m = moved_m;
    // The quaternion is rounded, so the expected axis is the one that the interface returns.
    lamp.direction = DVec3::from(scene.light(0).direction);
    let apart = lamp.direction.distance(DVec3::NEG_Y);
    assert!(apart < 1e-15, "{apart}");
    assert!(second.layers() == engine_frame(&expected));
    assert!(second.layers() != first.layers());
}

#[test]
fn a_moved_instance_is_a_scene_built_that_way() {
    let device = Device::open();
    let mut expected = engine_scene("glossy", SIZE_PX);
    expected.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 8));
    let scene = from_arrays(&expected);
    let renderer = device.renderer();
    let first = renderer.render(&scene);
    assert!(first.passes().iter().any(|pass| pass == "rsm"));
    // Half a turn about y: x and z change their signs, exactly.
    let by_m = DVec3::new(0.25, 0.5, -0.125);
    let last = expected.meshes.len() - 1;
    let turn = DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0);
    scene.place(CAMLUX_PART_INSTANCE, last as u32, by_m, turn);
    let second = renderer.render(&scene);
    let turned = |v: &DVec3| DVec3::new(-v.x, v.y, -v.z);
    let mesh = Mesh::clone(&expected.meshes[last]);
    expected.meshes[last] = Mesh {
        positions_m: mesh.positions_m.iter().map(|p| turned(p) + by_m).collect(),
        normals: mesh.normals.iter().map(turned).collect(),
        ..mesh
    }
    .into();
    assert!(second.layers() == engine_frame(&expected));
    assert!(second.layers() != first.layers());
    // With the instance moved back, the frame equals the first.
    let (back_m, turn) = (DVec3::ZERO, DQuat::IDENTITY);
    scene.place(CAMLUX_PART_INSTANCE, last as u32, back_m, turn);
    let third = renderer.render(&scene);
    assert!(third.layers() == first.layers());
    // Nothing has moved since, so the RSM is used again.
    let fourth = renderer.render(&scene);
    assert!(fourth.passes().iter().all(|pass| pass != "rsm"));
}
