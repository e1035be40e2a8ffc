//! Normal maps, against a closed form and against the reference, which turns normals with its own formula.

use crate::common::gpu::{Gpu, demo_scene};
use crate::common::reference_frame::{error_off_edges, reference_frame, values};
use crate::common::rooms::{quad, scene_of};
use camlux::{
    Scene,
    output::{Frame, Layer},
    scene::{Encoding, IndirectLight, Light, Shadow, Texels, Texture},
};
use glam::{DVec3, Vec3};

fn texel(normal: Vec3) -> [f32; 3] {
    (0.5 * normal.normalize() + 0.5).to_array()
}

/// A map of one normal tilts a whole floor, with plain, mirrored and rotated texture coordinates, and seen from below.
#[test]
fn an_even_map_turns_the_floor() {
    let mut gpu = Gpu::open();
    let tilted = Vec3::new(0.3, -0.2, 0.9).normalize();
    let light_m = DVec3::new(0.4, 1.5, -0.3);
    // Texture coordinates of the corners, and the directions in which u and v grow. The floor's edges are along x and -z.
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let [plain, mirrored, turned] = [
        corners,
        corners.map(|[u, v]: [f64; 2]| [-2.0 * u, v]),
        corners.map(|[u, v]| [v, -u]),
    ];
    for (texcoords, right, up, from_below) in [
        (plain, DVec3::X, DVec3::NEG_Z, false),
        (mirrored, DVec3::NEG_X, DVec3::NEG_Z, false),
        (turned, DVec3::NEG_Z, DVec3::NEG_X, false),
        (plain, DVec3::X, DVec3::NEG_Z, true),
    ] {
        let mut floor = quad(
            "floor",
            DVec3::new(-1.0, 0.0, 1.0),
            2.0 * DVec3::X,
            -2.0 * DVec3::Z,
            0,
        );
        floor.texcoords = texcoords.into();
        let side = if from_below { -1.0 } else { 1.0 };
        let light = Light::point(
            DVec3::new(light_m.x, side * light_m.y, light_m.z),
            [10.0; 3],
        );
        let mut scene = scene_of(
            vec![floor],
            light.clone(),
            DVec3::new(0.1, side * 2.0, 1.0),
            DVec3::ZERO,
        );
        scene.textures = vec![
            Texture {
                name: "tilted".into(),
                size_px: [1, 1],
                texels: Texels::F32(vec![texel(tilted)]),
            }
            .into(),
        ];
        scene.materials[0].normal_texture = Some(0.into());
        let frame = gpu.render(&scene);
        let due = side
            * (f64::from(tilted.x) * right
                + f64::from(tilted.y) * up
                + f64::from(tilted.z) * DVec3::Y);
        let ids = frame.ids(Layer::InstanceId).expect("every frame has it");
        let (normals, positions) = (
            values(&frame, Layer::Normal),
            values(&frame, Layer::Position),
        );
        let direct = values(&frame, Layer::Direct);
        let mut seen = 0;
        for pixel in (0..ids.len()).filter(|&pixel| ids[pixel] != 0) {
            seen += 1;
            let vector =
                |of: &[f32]| DVec3::from_slice(&[0, 1, 2].map(|i| of[3 * pixel + i].into()));
            assert!(
                vector(normals).distance(due) < 1e-6,
                "{} for {due}",
                vector(normals)
            );
            let to_light_m = light.position_m().expect("it has one") - vector(positions);
            let cosine = to_light_m.normalize().dot(due).max(0.0);
            let intensity = 10.0 / (4.0 * std::f64::consts::PI);
            let irradiance = intensity * cosine / to_light_m.length_squared();
            let radiance = scene.materials[0].kd[0] / std::f64::consts::PI * irradiance;
            assert!((f64::from(direct[3 * pixel]) - radiance).abs() < 1e-6 * radiance.max(0.01));
        }
        assert!(seen > 500);
    }
}

/// The textured room with bumps on all its surfaces, which have smooth or flat normals.
fn bumpy(is_smooth: bool) -> Scene {
    let mut scene = demo_scene("textured", [40, 40]);
    let normals = (0..64).map(|i| {
        let (x, y) = (f32::from(i as u8 % 8), f32::from(i as u8 / 8));
        texel(Vec3::new(0.5 * (0.8 * x).sin(), 0.5 * (0.8 * y).cos(), 1.0))
    });
    let index = scene.textures.len();
    let texels = normals.map(|texel| texel.map(|value| (value * 65_535.0).round() as u16));
    scene.textures.push(
        Texture {
            name: "bumps".into(),
            size_px: [8, 8],
            texels: Texels::U16(texels.collect(), Encoding::Linear),
        }
        .into(),
    );
    for material in &mut scene.materials {
        material.normal_texture = Some(index.into());
    }
    for mesh in scene.meshes.iter_mut().filter(|_| is_smooth) {
        let outwards = |&p: &DVec3| (p - DVec3::new(0.1, 0.9, 0.2)).normalize();
        mesh.normals = mesh.positions_m.iter().map(outwards).collect();
    }
    scene.direct.shadow = Some(Shadow::Rays);
    scene
}

/// Both on rasterised surfaces and on surfaces that rays find.
#[test]
fn the_reference_has_the_same_normals_and_light() {
    let mut gpu = Gpu::open();
    for is_smooth in [false, true] {
        let mut scene = bumpy(is_smooth);
        scene.indirect = Some(IndirectLight::final_gather(0.03));
        let plain = {
            let mut scene = scene.clone();
            for material in &mut scene.materials {
                material.normal_texture = None;
            }
            gpu.render(&scene)
        };
        let truth = reference_frame(&scene, 512, 8);
        let error = |frame: &Frame, layer| error_off_edges(frame, &truth, layer);
        for frame in gpu.render_by_each_tracer(&scene) {
            let [normal, direct, indirect] =
                [Layer::Normal, Layer::Direct, Layer::Indirect].map(|layer| error(&frame, layer));
            println!(
                "smooth {is_smooth}: N {normal:.1e}, direct {direct:.1e}, indirect {indirect:.1e}"
            );
            // The texture coordinates of k_d are rounded to 1e-4 of a texel.
            assert!(normal < 1e-5 && direct < 3e-5, "{normal} {direct}");
            assert!(indirect < 0.04, "{indirect}");
        }
        // The bumps are visible.
        assert!(error(&plain, Layer::Normal) > 0.1 && error(&plain, Layer::Direct) > 0.05);
    }
}
