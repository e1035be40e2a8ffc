//! `final-gather` against the path-sampled reference: the requested, the estimated and the true error.

use crate::common::gather::gather;
use crate::common::gpu::{DEMO_SCENES, Gpu, assert_is_lit, demo_scene, sub_pixel_bits};
use crate::common::lamps::{measured, projector};
use crate::common::reference_frame::{add_rounds, values};
use crate::common::rooms::{quad, scene_of};
use camlux::{
    Scene,
    hard_cases::torture::visible_strip,
    metrics::{self, Comparison, Pixels},
    output::{Frame, Layer, StopReason},
    reference::Reference,
    scene::{ErrorNorm, IndirectLight, Light, SpotCone},
};
use glam::DVec3;

pub fn final_gather(mut scene: Scene, target_error: f64) -> Scene {
    scene.indirect = Some(IndirectLight::final_gather(target_error));
    scene
}

/// A reference of eight rounds.
pub fn reference_of(scene: &Scene, samples_per_round: u32) -> Frame {
    let reference = Reference::new(scene, samples_per_round).expect("the scene is valid");
    let mut reference = reference.with_sub_pixel_bits(sub_pixel_bits());
    add_rounds(&mut reference, 8);
    reference.frame()
}

/// relRMSE and bias of the indirect light, without pixels whose centre is on an edge.
pub fn error_and_bias(image: &Frame, truth: &Frame) -> (f64, f64) {
    let edges = truth.ids(Layer::Edge).expect("a reference marks edges");
    let seen = truth.ids(Layer::InstanceId).expect("it is there");
    let [edges, valid] = [edges, seen].map(|ids| ids.iter().map(|&id| id != 0).collect::<Vec<_>>());
    let comparison = Comparison::new(&Pixels {
        image: values(image, Layer::Indirect),
        reference: values(truth, Layer::Indirect),
        image_standard_error: None,
        reference_standard_error: truth.values(Layer::StandardError),
        valid: &valid,
        edges: Some(&edges),
        channels: 3,
    })
    .expect("images of one size");
    assert_eq!(comparison.non_finite_image, 0);
    let noise = comparison.noise.expect("there is light");
    let error = noise.rmse.value_or_bound().expect("the truth is not noise");
    (error, comparison.errors.expect("there is light").bias)
}

/// Renders, prints and checks: the true error is at most 1.3 times the requested one, the bias at most 1 %, the estimate close to the true error.
#[track_caller]
fn check(gpu: &mut Gpu, name: &str, scene: &Scene, truth: &Frame, asked: f64) -> Frame {
    let mut scene = scene.clone();
    scene.indirect = Some(gather!(asked, stderr_layer = true));
    let frame = gpu.render(&scene);
    let (error, bias) = error_and_bias(&frame, truth);
    let estimated = frame.stats.estimated_error.expect("it is estimated");
    println!(
        "{name}: asked {asked}, estimated {estimated:.4}, true {error:.4}, bias {bias:+.4}, {} k rays",
        frame.stats.ray_count / 1000
    );
    // Much less error than requested means wasted work.
    assert!(error >= asked / 3.0, "{name}: {error} for {asked}");
    assert!(error <= 1.3 * asked, "{name}: {error} for {asked}");
    // The mean of one image has noise too.
    let most = (0.15 * asked).max(0.01);
    assert!(bias.abs() <= most, "{name}: bias {bias}");
    assert!(
        estimated <= 1.5 * error + 0.005 && error <= 1.5 * estimated + 0.005,
        "{name}: {estimated} for {error}"
    );
    frame
}

/// Over the images of three of them, errors are also as large as the standard error layer says.
#[test]
fn the_requested_error_is_met_in_the_demo_scenes() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        // Noise of the reference hides errors of the standard errors, and those alone.
        let is_judged = ["cornell", "glossy", "knot"].contains(&name);
        let scene = demo_scene(name, [64, 64]);
        let truth = reference_of(&scene, if is_judged { 128 } else { 32 });
        let frame = check(&mut gpu, name, &scene, &truth, 0.05);
        if !is_judged {
            continue;
        }
        let deviation = deviation_of_errors(&frame, &truth);
        println!("{name}: errors over standard errors deviate by {deviation:.3}");
        // The knot has 0.798 on an H100: its errors are a fifth below their estimates.
        assert!((0.79..=1.25).contains(&deviation), "{name}: {deviation}");
    }
}

/// The root mean square of errors over their standard errors, away from edges.
fn deviation_of_errors(frame: &Frame, truth: &Frame) -> f64 {
    let edges = truth.ids(Layer::Edge).expect("a reference marks edges");
    let [image, own, reference, noise] = [
        (frame, Layer::Indirect),
        (frame, Layer::StandardError),
        (truth, Layer::Indirect),
        (truth, Layer::StandardError),
    ]
    .map(|(of, layer)| values(of, layer));
    let (mut squares, mut count) = (0.0, 0.0);
    for index in (0..image.len()).filter(|index| edges[index / 3] == 0) {
        let variance = f64::from(own[index]).powi(2) + f64::from(noise[index]).powi(2);
        if variance > 0.0 {
            squares += f64::from(image[index] - reference[index]).powi(2) / variance;
            count += 1.0;
        }
    }
    f64::sqrt(squares / count)
}

/// The size of the RSM changes the noise, not the expected value.
#[test]
fn the_size_of_the_map_makes_no_error() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("slit", [32, 32]);
    let truth = reference_of(&scene, 256);
    for rsm_size in [8, 64, 512] {
        scene.indirect = Some(gather!(0.1, rsm_size = Some(rsm_size)));
        let frame = gpu.render(&scene);
        let (error, bias) = error_and_bias(&frame, &truth);
        println!("map of {rsm_size}²: true {error:.4}, bias {bias:+.4}");
        assert!(error <= 0.13, "{rsm_size}: {error}");
        assert!(bias.abs() <= 0.02, "{rsm_size}: {bias}");
    }
}

/// A pixel with many samples is as accurate as one with few. (lavapipe leaves a shader's loops after 65 535 iterations in total; rays then
/// hit nothing.)
#[test]
fn many_samples_of_a_pixel_are_as_right_as_few() {
    let mut scene = demo_scene("slit", [12, 12]);
    let truth = reference_of(&scene, 4096);
    scene.indirect = Some(gather!(0.02, rsm_size = Some(8)));
    let frame = Gpu::open().render(&scene);
    let (error, bias) = error_and_bias(&frame, &truth);
    let rays_of_a_pixel = frame.stats.ray_count / 144;
    println!("{rays_of_a_pixel} rays a pixel: true {error:.4}, bias {bias:+.4}");
    assert!(rays_of_a_pixel > 1 << 17);
    assert!(error <= 0.026, "{error}");
    assert!(bias.abs() <= 0.01, "{bias}");
}

/// Twenty lights in one place equal one light of their total power, even if one dispatch cannot take all of them.
#[test]
fn many_lights_on_a_mesh_are_their_sum() {
    let one = demo_scene("knot", [24, 24]);
    let mut many = one.clone();
    let twentieth = one.lights[0].emission().map(|watts| watts / 20.0);
    many.lights = vec![one.lights[0].with_emission(twentieth).into(); 20];
    let truth = reference_of(&one, 128);
    let mut gpu = Gpu::open();
    for (name, scene) in [("one", one), ("many", many)] {
        check(&mut gpu, name, &scene, &truth, 0.05);
    }
}

/// A lit strip is in view, beside a room lit only by its bounce. With the local norm the room is as accurate as the strip.
#[test]
fn the_local_norm_counts_dark_parts() {
    let scene = visible_strip().resized(64).scene;
    let truth = reference_of(&scene, 256);
    let size_px = scene.camera.resolution_px;
    let [reference, sigma] =
        [Layer::Indirect, Layer::StandardError].map(|layer| values(&truth, layer));
    let mut gpu = Gpu::open();
    let mut errors = [ErrorNorm::Image, ErrorNorm::Local].map(|norm| {
        let mut scene = scene.clone();
        scene.indirect = Some(gather!(0.1, error_norm = norm));
        let frame = gpu.render(&scene);
        let image = values(&frame, Layer::Indirect);
        let dark = image
            .iter()
            .zip(reference)
            .filter(|(x, t)| **x == 0.0 && **t > 0.0);
        println!(
            "{norm:?}: {} values are 0 that are not",
            dark.clone().count()
        );
        (
            metrics::local_error(image, reference, sigma, size_px),
            dark.count(),
            frame.stats,
        )
    });
    let (image_error, ..) = &mut errors[0];
    println!("image norm: local error {image_error:.4}");
    let (local_error, dark, stats) = &errors[1];
    let estimated = stats.estimated_error.expect("it is estimated");
    println!("local norm: local error {local_error:.4}, estimated {estimated:.4}");
    assert!(*local_error <= 0.13, "{local_error}");
    // The estimate's gathers are for an error of a tenth. It cannot tell what is far below, and then errs to the safe side.
    let most = f64::max(2.0 * local_error, 0.04);
    assert!(
        (0.5 * local_error..most).contains(&estimated),
        "{estimated} for {local_error}"
    );
    assert!((*dark as f64) < 0.002 * reference.len() as f64, "{dark}");
}

/// The image is large enough for a coarse grid: most pixels are interpolated, and the error is still the requested one.
#[test]
fn most_pixels_are_interpolated() {
    let mut gpu = Gpu::open();
    for name in ["cornell", "cornell_spot"] {
        let scene = demo_scene(name, [224, 224]);
        let truth = reference_of(&scene, 8);
        let frame = check(&mut gpu, name, &scene, &truth, 0.04);
        // A gathered pixel takes at least 192 rays.
        let rays_per_pixel = frame.stats.ray_count as f64 / (224.0 * 224.0);
        println!("{name}: {rays_per_pixel:.0} rays a pixel");
        assert!(rays_per_pixel < 192.0, "{name}");
        assert!(!sums_unoccluded(&frame), "{name}");
    }
}

/// Whether smoothing was tried by the ratio to the light of VPLs without occlusion.
fn sums_unoccluded(frame: &Frame) -> bool {
    let mut passes = frame.stats.passes.iter();
    passes.any(|pass| pass.name == "unoccluded")
}

/// On a floor of facets as small as pixels, no pixel predicts another, and every pixel is gathered.
#[test]
fn facets_as_small_as_pixels() {
    const EDGE: usize = 55;
    let mut gpu = Gpu::open();
    let mut scene = room();
    let mut random = fastrand::Rng::with_seed(3);
    let floor = &mut scene.meshes[0];
    floor.positions_m = (0..EDGE * EDGE)
        .map(|vertex| {
            let [x, z] = [vertex % EDGE, vertex / EDGE].map(|n| n as f64 / (EDGE - 1) as f64);
            DVec3::new(2.0 * x - 1.0, -0.9 + 0.02 * random.f64(), 2.0 * z - 1.0)
        })
        .collect();
    let cells = (0..EDGE - 1).flat_map(|row| (0..EDGE - 1).map(move |column| row * EDGE + column));
    let facets = cells.flat_map(|corner| {
        let [a, b, c, d] = [corner, corner + 1, corner + EDGE, corner + EDGE + 1];
        [[a, c, b], [b, c, d]].map(|facet| facet.map(|vertex| vertex as u32))
    });
    floor.triangles = facets.collect();
    floor.triangle_materials = vec![0; floor.triangles.len()];
    let truth = reference_of(&scene, 256);
    let frame = check(&mut gpu, "facets", &scene, &truth, 0.01);
    assert!(sums_unoccluded(&frame));
}

/// Beside the lit block is a strip of wall, two points of the grid wide, on which light varies nonlinearly from side to side and
/// hardly from top to bottom. Predictions along the strip are right, but say nothing about those across it. Interpolated, the strip's
/// pixels had an error that no number of samples removes, and the estimate requested more samples.
#[test]
fn a_strip_as_narrow_as_the_grid_is_gathered() {
    let mut gpu = Gpu::open();
    let scene = final_gather(demo_scene("cornell_spot", [400, 400]), 0.01);
    let stats = gpu.render(&scene).stats;
    println!("{} rays", stats.ray_count);
    assert_eq!(stats.stop, Some(StopReason::TargetMet));
    // Measured 23 million; with the strip interpolated, 294 million.
    assert!(stats.ray_count < 30_000_000, "{}", stats.ray_count);
}

/// The lamp is in the next room. The light through the slit is hard to find from either side.
#[test]
fn light_through_a_slit() {
    let scene = demo_scene("slit", [48, 48]);
    let truth = reference_of(&scene, 128);
    check(&mut Gpu::open(), "slit", &scene, &truth, 0.15);
}

/// The image may be smaller than a cell of the grid, and the pixels sampled for the error estimate may show no surface.
#[test]
fn images_of_few_pixels_and_of_none_with_a_surface() {
    let mut gpu = Gpu::open();
    for resolution_px in [[1, 1], [2, 3], [1, 70], [33, 1]] {
        let mut scene = final_gather(room(), 0.1);
        scene.camera.resolution_px = resolution_px;
        let frame = gpu.render(&scene);
        let indirect = values(&frame, Layer::Indirect);
        let meshes = frame.ids(Layer::InstanceId).expect("it is there");
        assert!(meshes.iter().any(|&mesh| mesh != 0), "{resolution_px:?}");
        for (pixel, mesh) in indirect.chunks_exact(3).zip(meshes) {
            assert!(
                pixel.iter().all(|&value| (value > 0.0) == (*mesh != 0)),
                "{pixel:?} on {mesh}"
            );
        }
    }
    let mut scene = final_gather(room(), 0.1);
    scene.camera.look_at_m = 2.0 * scene.camera.position_m;
    let frame = gpu.render(&scene);
    let indirect = values(&frame, Layer::Indirect);
    assert!(indirect.iter().all(|&value| value == 0.0));
    assert_eq!(frame.stats.estimated_error, None);
}

/// A room with five walls, open at the front, 2 m on a side, with a screen in it.
fn room() -> Scene {
    let corner = DVec3::splat(-1.0);
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| 2.0 * axis);
    let meshes = vec![
        quad("floor", corner, z, x, 0),
        quad("ceiling", corner + y, x, z, 1),
        quad("left", corner, y, z, 1),
        quad("right", corner + x, z, y, 0),
        quad("back", corner, x, y, 0),
        quad(
            "screen",
            DVec3::new(-0.3, -1.0, -0.4),
            0.9 * DVec3::X,
            1.1 * DVec3::Y,
            1,
        ),
    ];
    let light = Light::point(DVec3::new(0.4, 0.6, 0.3), [30.0, 20.0, 10.0]);
    let mut scene = scene_of(meshes, light, DVec3::new(0.1, 0.0, 2.9), DVec3::ZERO);
    scene.camera.resolution_px = [64, 64];
    scene
}

/// Every kind of light alone, and all of them together. Together they share the draws in proportion to the light that they send.
#[test]
fn lights_of_every_kind_and_together() {
    let lights = [
        room().lights[0].clone(),
        Light::spot(
            DVec3::new(-0.5, 0.7, 0.5),
            DVec3::new(0.5, -1.0, -0.6),
            SpotCone {
                inner_half_angle_deg: 15.0,
                outer_half_angle_deg: 30.0,
            },
            [5.0, 10.0, 20.0],
        )
        .into(),
        Light::directional(DVec3::new(-0.5, -0.4, -1.0), [6.0, 4.0, 2.0]).into(),
        measured(
            DVec3::new(-0.2, 0.6, 0.4),
            DVec3::new(0.2, -1.0, -0.4),
            [20.0, 10.0, 5.0],
        )
        .into(),
        projector(
            DVec3::new(-0.3, 0.5, 0.5),
            DVec3::new(0.3, -0.9, -0.4),
            [20.0, 10.0, 5.0],
        )
        .into(),
    ];
    let mut gpu = Gpu::open();
    let mut scene = room();
    for (name, lights) in [
        ("point", vec![lights[0].clone()]),
        ("spot", vec![lights[1].clone()]),
        ("directional", vec![lights[2].clone()]),
        ("pattern", vec![lights[3].clone()]),
        ("projector", vec![lights[4].clone()]),
        ("all", lights.to_vec()),
    ] {
        scene.lights = lights;
        let truth = reference_of(&scene, 32);
        check(&mut gpu, name, &scene, &truth, 0.03);
    }
}

/// A spot 300 m from a room of 2 m. Occluders are still resolved to micrometres.
#[test]
fn light_comes_from_afar() {
    let mut scene = room();
    let position_m = DVec3::new(20.0, 40.0, 295.0);
    scene.lights = vec![
        Light::spot(
            position_m,
            -position_m,
            SpotCone {
                inner_half_angle_deg: 0.3,
                outer_half_angle_deg: 0.4,
            },
            [20.0; 3],
        )
        .into(),
    ];
    let truth = reference_of(&scene, 128);
    check(&mut Gpu::open(), "from afar", &scene, &truth, 0.03);
}

/// All kernels find the same hits. But rounding may turn a ray at an edge, which changes the pilot's result and so every later draw.
/// Then the images differ by their noise.
#[test]
fn kernels_agree() {
    let mut gpu = Gpu::open();
    // No ray of the box differs. In the glossy room one may, and the bound is the requested noise.
    for (name, bound) in [("cornell", 1e-3), ("glossy", 0.1)] {
        let scene = final_gather(demo_scene(name, [48, 48]), 0.1);
        let frames = gpu.render_by_each_tracer(&scene);
        let images: Vec<_> = frames
            .iter()
            .map(|frame| values(frame, Layer::Indirect))
            .collect();
        for other in &images[1..] {
            let differences = images[0].iter().zip(*other);
            let difference: f64 = differences.map(|(a, b)| f64::from(a - b).powi(2)).sum();
            let square: f64 = other.iter().map(|a| f64::from(*a).powi(2)).sum();
            let apart = (difference / square).sqrt();
            println!("{name}: {apart:.1e} apart");
            assert!(apart < bound);
        }
    }
}

/// Behind a wall without thickness that is lit on its other side, the image is black: no light passes through or around.
#[test]
fn a_wall_of_no_thickness_does_not_leak() {
    let mut scene = room();
    let corner = DVec3::splat(-1.0);
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| 2.0 * axis);
    scene.meshes.push(quad("front", corner + z, y, x, 0).into());
    scene.meshes.retain(|mesh| mesh.name != "screen");
    scene.camera.position_m = DVec3::new(-0.9, 0.1, 0.9);
    scene.camera.look_at_m = DVec3::new(-0.2, -0.1, -1.0);
    let mut gpu = Gpu::open();
    // Without the wall there is light.
    assert_is_lit(
        &gpu.render(&final_gather(scene.clone(), 0.05)),
        Layer::Indirect,
    );
    // The wall divides the room. The camera and the dark half are on one side, the lamp is on the other.
    scene
        .meshes
        .push(quad("wall", DVec3::new(0.0, -1.0, -1.0), y, z, 1).into());
    let frame = gpu.render(&final_gather(scene, 0.05));
    let indirect = values(&frame, Layer::Indirect);
    let position = values(&frame, Layer::Position);
    for (i, (value, p)) in indirect
        .chunks_exact(3)
        .zip(position.chunks_exact(3))
        .enumerate()
    {
        // A pixel's centre on the seam may show the first micrometres of the lit side.
        let is_beyond = p[0] > 0.0 && p[0] < 1e-4;
        assert!(
            value == [0.0; 3] || is_beyond,
            "pixel {i} at {p:?} has {value:?}"
        );
    }
}
