//! Renders a scene built from arrays, without files: a red wall beside a white floor, lit by a point light.
//!
//!     cargo run --release --example from_slices

use camlux::{
    Device, DeviceOptions, RenderOptions, Renderer, Scene,
    output::Layer,
    scene::{Camera, Direct, IndirectLight, Lens, Light, Material, Mesh, VplSum},
};

fn main() -> Result<(), camlux::Error> {
    let quad = [[0, 1, 2], [0, 2, 3]];
    let floor = [
        [-1.0, 0.0, -1.0],
        [-1.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 0.0, -1.0],
    ];
    let wall = [
        [-1.0, 0.0, -1.0],
        [-1.0, 0.0, 1.0],
        [-1.0, 2.0, 1.0],
        [-1.0, 2.0, -1.0],
    ];
    let scene = Scene {
        camera: Camera {
            resolution_px: [64, 48],
            position_m: [0.0, 1.0, 4.0].into(),
            look_at_m: [0.0, 0.5, 0.0].into(),
            up: [0.0, 1.0, 0.0].into(),
            lens: Lens::FovY { fov_y_deg: 40.0 },
            pixel_sampling: None,
        },
        sensor: None,
        tof: None,
        lights: vec![Light::point([0.0, 1.5, 0.0].into(), [10.0; 3]).into()],
        meshes: vec![
            Mesh::from_slices("floor", &floor, &quad, 0).into(),
            Mesh::from_slices("wall", &wall, &quad, 1).into(),
        ],
        materials: vec![
            Material::lambert("white", [0.8; 3]),
            Material::lambert("red", [0.8, 0.1, 0.1]),
        ],
        textures: Vec::new(),
        direct: Direct::default(),
        indirect: Some(IndirectLight::vpl_sum(VplSum::InstantRadiosity, 32)),
        vignetting_map: None,
        left_out: Vec::new(),
    };

    let device = Device::open(&DeviceOptions::default())?;
    let frame = Renderer::new(&device)?.render(&scene, &mut RenderOptions::default())?;

    // The middle of the floor. It is lit by the light and, with a red tint, by the wall.
    let pixel = 3 * (64 * 30 + 32);
    for layer in [Layer::Direct, Layer::Indirect] {
        let values = frame.values(layer).unwrap_or_default();
        let name = layer.name();
        println!("{name:9} {:.4?} W/sr/m²", &values[pixel..pixel + 3]);
    }
    Ok(())
}
