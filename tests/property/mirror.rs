//! A room that is symmetric about x = 0 is lit symmetrically. The exception is a ray through the common edge of two walls: rounding
//! decides which wall it hits.

use camlux::{
    DeviceKind, RenderOptions, Scene,
    glam::DVec3,
    hard_cases::scenes::{point_light, quad},
    internals::{Intermediates, SurfacePoint},
    output::Layer,
    scene::{Camera, Direct, IndirectLight, Instance, Lens, Material, VplSum},
};

use crate::common::gpu::Gpu;

const SIZE_PX: usize = 64;
const RSM_SIZE: usize = 64;
/// Tolerance for rounding, in metres and for unit vectors.
const CLOSE: f64 = 1e-5;

/// Five walls of 2 m by 2 m, symmetric about x = 0. The camera is on that plane, in front of the open side.
fn room(light_m: DVec3) -> Scene {
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| 2.0 * axis);
    let low = DVec3::new(-1.0, 0.0, -1.0);
    let walls = [
        quad("floor", low, x, z, 0),
        quad("ceiling", low + y, x, z, 0),
        quad("back", low, x, y, 0),
        quad("left", low, y, z, 0),
        quad("right", low + x, y, z, 0),
    ];
    Scene {
        camera: Camera {
            resolution_px: [SIZE_PX as u32; 2],
            position_m: DVec3::new(0.0, 1.0, 3.2),
            look_at_m: DVec3::Y,
            up: DVec3::Y,
            lens: Lens::FovY { fov_y_deg: 50.0 },
            pixel_sampling: None,
        },
        sensor: None,
        tof: None,
        lights: vec![point_light(light_m).into()],
        materials: vec![Material::lambert("grey", [0.7; 3])],
        meshes: walls.map(Instance::from).to_vec(),
        textures: Vec::new(),
        direct: Direct::default(),
        vignetting_map: None,
        left_out: Vec::new(),
        indirect: Some(IndirectLight::vpl_sum(
            VplSum::InstantRadiosity,
            RSM_SIZE as u32,
        )),
    }
}

fn is_mirrored(one: Option<SurfacePoint>, other: Option<SurfacePoint>) -> bool {
    let mirror = DVec3::new(-1.0, 1.0, 1.0);
    match (one, other) {
        (None, None) => true,
        (Some(one), Some(other)) => {
            let position = one.position_m.distance(mirror * other.position_m);
            position < CLOSE && one.normal.distance(mirror * other.normal) < CLOSE
        }
        _ => false,
    }
}

/// Positions of RSM texels that differ from their mirror images.
fn asymmetric_texels(kept: &Intermediates) -> Vec<DVec3> {
    let rsm = &kept.lights[0].rsm;
    let point = |face: usize, y: usize, x: usize| {
        let texel = rsm[(face * RSM_SIZE + y) * RSM_SIZE + x];
        texel.map(|texel| texel.point)
    };
    let mut found = Vec::new();
    for face in 0..6 {
        // The faces along x swap; the columns of every face run backwards.
        let other_face = if face < 2 { 1 - face } else { face };
        for y in 0..RSM_SIZE {
            for x in 0..RSM_SIZE {
                let texel = point(face, y, x);
                if !is_mirrored(texel, point(other_face, y, RSM_SIZE - 1 - x)) {
                    found.extend(texel.map(|texel| texel.position_m));
                }
            }
        }
    }
    found
}

/// The largest difference of indirect light between a pixel and its mirror image, where both show the same surface, divided by the mean.
fn asymmetry(values: &[f32], kept: &Intermediates) -> f64 {
    let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
    assert!(mean > 0.0, "the room is dark");
    let mut largest = 0.0f64;
    let mut compared = 0;
    for y in 0..SIZE_PX {
        for x in 0..SIZE_PX / 2 {
            let [one, other] = [x, SIZE_PX - 1 - x].map(|x| y * SIZE_PX + x);
            if kept.gbuffer[one].is_some() && is_mirrored(kept.gbuffer[one], kept.gbuffer[other]) {
                compared += 1;
                let difference = f64::from(values[3 * one]) - f64::from(values[3 * other]);
                largest = largest.max(difference.abs() / mean);
            }
        }
    }
    assert!(
        compared > SIZE_PX * SIZE_PX / 4,
        "{compared} pairs of pixels"
    );
    largest
}

#[test]
fn a_mirror_symmetric_room_is_lit_symmetrically_but_for_rays_along_edges() {
    let mut gpu = Gpu::open();
    // At z = 0 the light is as far from the side walls as from the back wall, so whole diagonals of texels have rays to the walls' edges.
    let lights = [(-0.03, false), (0.0, true)];
    for (z, meets_edges) in lights {
        let scene = room(DVec3::new(0.0, 1.9, z));
        let (frame, kept) = gpu
            .renderer
            .render_with_intermediates(&scene, &mut RenderOptions::default())
            .expect("the scene renders");
        let texels = asymmetric_texels(&kept);
        for &place_m in &texels {
            let off_edge = (place_m.x.abs() - 1.0)
                .abs()
                .max((place_m.z.abs() - 1.0).abs());
            assert!(off_edge < CLOSE, "{place_m} is on no edge between walls");
        }
        // Rounding decides which of the two walls such a ray hits. On an H100 no texel differs.
        if !meets_edges || gpu.device.info().kind == DeviceKind::Cpu {
            assert_eq!(!texels.is_empty(), meets_edges, "{} texels", texels.len());
        }
        let values = frame
            .values(Layer::Indirect)
            .expect("it has indirect light");
        let largest = asymmetry(values, &kept);
        println!("z = {z}: {} texels, {largest:e} of the mean", texels.len());
        if !meets_edges {
            // Measured 1.1e-6: the rounding of positions.
            assert!(largest < 5e-6, "{largest}");
        }
    }
}
