//! Surfaces that emit light, against closed forms and against the reference, which samples them with its own code.

use std::f64::consts::PI;

use crate::common::gpu::{Gpu, demo_scene};
use crate::common::reference_frame::{error_of_indirect, reference_frame, values};
use crate::common::rmse::relative_rmse_where;
use crate::common::rooms::{floor, quad, scene_of};
use camlux::{
    Scene,
    output::{Layer, TofQuantity},
    scene::{
        Encoding, IndirectLight, Instance, Light, Material, Mesh, MetallicRoughness, PixelFilter,
        PixelSampling, Shared, Texels, Texture,
    },
};
use glam::{DAffine3, DMat3, DVec3};

const BANDS: [f64; 3] = [30.0, 20.0, 12.0];

/// A material that emits, and its index in the scene.
fn add_emissive(scene: &mut Scene, emission_w_sr_m2: [f64; 3], is_one_sided: bool) -> u32 {
    scene.materials.push(Material {
        emission_w_sr_m2,
        is_one_sided,
        ..Material::lambert("lamp", [0.3; 3])
    });
    scene.materials.len() as u32 - 1
}

/// A sphere of 1 m around 0: its facets, counterclockwise from outside.
fn sphere(rings: u32, material: u32) -> Mesh {
    let columns = 2 * rings;
    let at = |ring: u32, column: u32| {
        let polar = PI * f64::from(ring) / f64::from(rings);
        let turn = 2.0 * PI * f64::from(column) / f64::from(columns);
        let (sin, cos) = turn.sin_cos();
        DVec3::new(polar.sin() * cos, polar.cos(), -polar.sin() * sin)
    };
    let positions_m = (0..=rings).flat_map(|ring| (0..columns).map(move |column| at(ring, column)));
    let index = |ring: u32, column: u32| ring * columns + column % columns;
    let triangles = (0..rings).flat_map(|ring| {
        (0..columns).flat_map(move |column| {
            let [a, b] = [0, 1].map(|next| index(ring, column + next));
            let [c, d] = [0, 1].map(|next| index(ring + 1, column + next));
            [[a, c, d], [a, d, b]]
        })
    });
    let triangles: Vec<[u32; 3]> = triangles.collect();
    Mesh {
        name: "sphere".into(),
        positions_m: positions_m.collect(),
        triangle_materials: vec![material; triangles.len()],
        triangles,
        ..Mesh::default()
    }
}

fn placed(mesh: &Shared<Mesh>, radius_m: f64, at_m: DVec3, mirror: f64) -> Instance {
    let linear = DMat3::from_diagonal(radius_m * DVec3::new(mirror, 1.0, 1.0));
    Instance {
        to_world: DAffine3::from_mat3_translation(linear, at_m),
        ..Instance::from(mesh.clone())
    }
}

/// A box lit by a part of its ceiling.
fn ceiling() -> Scene {
    let mut scene = demo_scene("cornell", [24, 24]);
    let material = add_emissive(&mut scene, BANDS, true);
    let corner_m = DVec3::new(-0.3, 1.98, -0.2);
    let lamp = quad("lamp", corner_m, 0.6 * DVec3::X, 0.4 * DVec3::Z, material);
    scene.meshes.push(lamp.into());
    scene.lights.clear();
    scene
}

/// Two bulbs that share a mesh, one mirrored, and a point light, between glossy things.
fn bulbs() -> Scene {
    let mut scene = demo_scene("glossy", [20, 20]);
    let material = add_emissive(&mut scene, BANDS, true);
    let bulb = Shared::from(sphere(9, material));
    let light_m = scene.lights[0].position_m().expect("it has one");
    for (side, mirror) in [(-0.35, 1.0), (0.3, -1.0)] {
        let at_m = light_m + DVec3::new(side, -0.4, 0.2);
        scene.meshes.push(placed(&bulb, 0.08, at_m, mirror));
    }
    scene
}

/// A screen with an image and a hole, which shines to both sides.
fn screen() -> Scene {
    let mut scene = demo_scene("cornell", [24, 24]);
    let material = add_emissive(&mut scene, [80.0; 3], false);
    let dark = [0, 0, 0];
    let texels = vec![
        [255, 40, 20],
        dark,
        dark,
        [30, 220, 60],
        dark,
        [200, 180, 255],
    ];
    scene.textures.push(
        Texture {
            name: "image".into(),
            size_px: [3, 2],
            texels: Texels::U8(texels, Encoding::Srgb),
        }
        .into(),
    );
    scene.materials[material as usize].emission_texture = Some((scene.textures.len() - 1).into());
    let alpha = [255, 255, 0, 255, 255, 255].map(|alpha| [alpha; 3]);
    scene.textures.push(
        Texture {
            name: "alpha".into(),
            size_px: [3, 2],
            texels: Texels::U8(alpha.to_vec(), Encoding::Linear),
        }
        .into(),
    );
    scene.materials[material as usize].alpha_texture = Some((scene.textures.len() - 1).into());
    let mut screen = quad(
        "screen",
        DVec3::new(-0.5, 0.9, 0.6),
        DVec3::new(0.7, 0.0, -0.2),
        0.6 * DVec3::Y,
        material,
    );
    screen.texcoords = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    scene.meshes.push(screen.into());
    scene.lights.clear();
    scene
}

/// A glowing sphere on a floor, in a room of rough facets: it touches what it lights.
fn contact() -> Scene {
    let mut scene = demo_scene("cornell", [24, 24]);
    for material in &mut scene.materials {
        material.microfacets = Some(MetallicRoughness {
            roughness: 0.6,
            metallic: 0.5,
            ..MetallicRoughness::DEFAULT
        });
    }
    let material = add_emissive(&mut scene, BANDS, true);
    let bulb = Shared::from(sphere(6, material));
    scene
        .meshes
        .push(placed(&bulb, 0.25, DVec3::new(-0.1, 0.25, 0.7), 1.0));
    scene.lights.clear();
    scene
}

/// The target error is met; on surfaces without and with lobes, of Phong and of facets.
#[test]
fn emissive_surfaces_light_as_in_the_reference() {
    let mut gpu = Gpu::open();
    let target = 0.05;
    for (name, mut scene) in [
        ("ceiling", ceiling()),
        ("bulbs", bulbs()),
        ("screen", screen()),
        ("contact", contact()),
    ] {
        scene.indirect = Some(IndirectLight::final_gather(target));
        let truth = reference_frame(&scene, 256, 8);
        // Instances are where tracers differ.
        let frames = match name {
            "bulbs" => gpu.render_by_each_tracer(&scene),
            _ => vec![gpu.render(&scene)],
        };
        for frame in frames {
            let [direct, emission] = [Layer::Direct, Layer::Emission]
                .map(|layer| off(values(&frame, layer), values(&truth, layer)));
            let (error, noise) = error_of_indirect(&frame, &truth);
            let upper = frame.stats.estimated_error_upper.expect("it has one");
            println!(
                "{name}: {error:.4}, noise of the reference {noise:.4}, below {upper:.4}; direct {direct:.1e}, emission {emission:.1e}"
            );
            assert!(noise < 0.03 && error < 1.1 * target, "{error} {noise}");
            assert!(direct < 0.02 && emission < 1e-5, "{direct} {emission}");
            assert!(values(&frame, Layer::Emission).iter().any(|&e| e > 1.0));
        }
    }
}

/// relRMSE, also of two black images.
fn off(image: &[f32], truth: &[f32]) -> f64 {
    match truth.iter().all(|&value| value == 0.0) {
        true => f64::from(u8::from(image.iter().any(|&value| value != 0.0))),
        false => relative_rmse_where(image, truth, |_| true),
    }
}

/// Of more and more samples, the mean is that of the reference.
#[test]
fn emission_is_averaged_over_pixels() {
    let mut gpu = Gpu::open();
    let mut scene = ceiling();
    scene.indirect = None;
    scene.camera.resolution_px = [24, 24];
    let errors = [16, 256].map(|samples| {
        scene.camera.pixel_sampling = Some(PixelSampling {
            samples,
            filter: PixelFilter::Box,
        });
        let truth = reference_frame(&scene, 1, 0);
        let frame = gpu.render(&scene);
        [Layer::Emission, Layer::Radiance].map(|layer| {
            relative_rmse_where(values(&frame, layer), values(&truth, layer), |_| true)
        })
    });
    println!("{errors:.4?}");
    // The reference has 1024 points.
    assert!(errors[0][1] < 0.1 && errors[1][1] < 0.01);
    assert!(errors[1][0] < 0.5 * errors[0][0]);
}

/// A sphere of radiance L lights a surface with π·L·(R/d)²·cosθ, however near it is.
#[test]
fn a_sphere_lights_a_floor_as_its_closed_form_has_it() {
    let (radius_m, height_m) = (0.3, 0.7);
    let at_m = DVec3::new(0.1, height_m, -0.2);
    let mut scene = scene_of(
        vec![floor(2.0)],
        Light::point(DVec3::Y, [0.0; 3]),
        DVec3::new(0.3, 1.0, 2.2),
        DVec3::ZERO,
    );
    scene.camera.resolution_px = [24, 24];
    scene.indirect = Some(IndirectLight::final_gather(0.02));
    let material = add_emissive(&mut scene, BANDS, true);
    scene.materials[material as usize].kd = [0.0; 3];
    // The facets' silhouettes have the area of the sphere's.
    let rings = 48;
    let facet = PI / f64::from(rings);
    let sphere = Shared::from(sphere(rings, material));
    let outer_m = radius_m * (facet / facet.sin()).sqrt();
    scene.meshes.push(placed(&sphere, outer_m, at_m, 1.0));
    let truth = reference_frame(&scene, 1024, 16);
    let rendered = Gpu::open().render(&scene);
    for (who, frame, most) in [("engine", &rendered, 0.02), ("reference", &truth, 0.01)] {
        let ids = frame.ids(Layer::InstanceId).expect("every frame has it");
        let positions = values(frame, Layer::Position).as_chunks::<3>().0;
        let of_pixel = |(position, &id): (&[f32; 3], &u32)| {
            let to_sphere = at_m - DVec3::from(position.map(f64::from));
            let cosine = to_sphere.normalize().y;
            let form = PI * radius_m.powi(2) / to_sphere.length_squared() * cosine;
            let kd = scene.materials[0].kd;
            let is_floor = f64::from(u8::from(id == 1));
            [0, 1, 2].map(|band| (is_floor * kd[band] / PI * BANDS[band] * form) as f32)
        };
        let due: Vec<f32> = positions.iter().zip(ids).flat_map(of_pixel).collect();
        let error = relative_rmse_where(values(frame, Layer::Indirect), &due, |i| ids[i] == 1);
        println!("{who}: {error:.1e}");
        assert!(error < most, "{who}: {error}");
    }
}

/// Emissive surfaces are not modulated: they add charge, and leave the phasors as they are.
#[test]
fn emission_is_ambient_light_to_a_time_of_flight_camera() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("tof_corner", [16, 16]);
    scene.indirect = None;
    let before = gpu.render(&scene);
    // The whole scene glows.
    for material in &mut scene.materials {
        material.emission_w_sr_m2 = [2.0; 3];
    }
    let frame = gpu.render(&scene);
    let phasors = |frame| values(frame, Layer::Tof(0, TofQuantity::PhasorDirect)).to_vec();
    let [found, due] = [&frame, &before].map(phasors);
    let largest = due.iter().fold(0.0_f32, |most, z| most.max(z.abs()));
    let most_off = found.iter().zip(&due).map(|(a, b)| (a - b).abs());
    let most_off = most_off.fold(0.0, f32::max);
    println!("{most_off:.1e} of {largest:.1e}");
    assert!(most_off < 1e-3 * largest);
    let sum = |frame| values(frame, Layer::Energy).iter().sum::<f32>();
    assert!(sum(&frame) > 1.5 * sum(&before));
    let warned = scene.warnings();
    assert!(
        warned.iter().any(|text| text.contains("light nothing")),
        "{warned:?}"
    );
    scene.indirect = Some(IndirectLight::final_gather(0.1));
    assert!(
        scene
            .warnings()
            .iter()
            .all(|text| !text.contains("light nothing"))
    );
    assert!(!Layer::Emission.is_made_for(&demo_scene("tof_corner", [16, 16])));
}
