//! The image is finite even where a direction is undefined.

use crate::common::gpu::{Gpu, assert_is_lit};
use camlux::{
    Scene,
    output::{Frame, Layer},
    scene::{Camera, Lens, Light, Material, Mesh},
};
use glam::DVec3;

/// A square of 2 m in the plane z = 0, seen from 4 m. With an odd number of pixels, one is on its middle.
fn square(light_position_m: DVec3) -> Scene {
    let corners = [
        [-1.0, -1.0, 0.0],
        [1.0, -1.0, 0.0],
        [1.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
    ];
    Scene {
        camera: Camera {
            resolution_px: [33, 33],
            position_m: DVec3::new(0.0, 0.0, 4.0),
            look_at_m: DVec3::ZERO,
            up: DVec3::Y,
            lens: Lens::FovY { fov_y_deg: 40.0 },
            pixel_sampling: None,
        },
        sensor: None,
        tof: None,
        lights: vec![Light::point(light_position_m, [1e10; 3]).into()],
        meshes: vec![Mesh::from_slices("square", &corners, &[[0, 1, 2], [0, 2, 3]], 0).into()],
        materials: vec![Material::lambert("white", [0.8; 3])],
        textures: Vec::new(),
        direct: camlux::scene::Direct::default(),
        indirect: None,
        vignetting_map: None,
        left_out: Vec::new(),
    }
}

fn assert_finite(frame: &Frame) {
    for layer in [Layer::Direct, Layer::Normal, Layer::Position] {
        let values = frame.values(layer).expect("every frame has it");
        assert!(values.iter().all(|value| value.is_finite()), "{layer:?}");
    }
}

#[test]
fn a_light_in_a_surface() {
    assert_finite(&Gpu::open().render(&square(DVec3::ZERO)));
}

#[test]
fn normals_that_cancel() {
    let mut scene = square(DVec3::new(0.0, 0.0, 2.0));
    scene.meshes[0].normals = vec![DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y];
    let frame = Gpu::open().render(&scene);
    assert_finite(&frame);
    assert_is_lit(&frame, Layer::Direct);
    // In the middle of the triangles' shared diagonal, the normals of its ends cancel. The face's normal is used.
    let middle = 3 * (16 * 33 + 16);
    let normals = frame.values(Layer::Normal).expect("every frame has it");
    assert_eq!(normals[middle..middle + 3], [0.0, 0.0, 1.0]);
}
