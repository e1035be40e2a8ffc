//! Lambert corners, whose bounce quadrature gives: the mean of many frames has no bias, though each is smoothed and interpolated.

use std::f64::consts::{PI, TAU};

use crate::common::gpu::Gpu;
use crate::common::quadrature::{unit_interval, unit_square};
use crate::common::rooms::{quad, scene_of};
use crate::tof::phasors;
use camlux::{
    RenderOptions, Scene,
    doctor::scenes::with_tof,
    metrics::range_error_m,
    model::{Phasor, SPEED_OF_LIGHT_M_S},
    output::{Frame, Layer, StopReason, TofQuantity},
    scene::{FinalGather, IndirectLight, Light},
};
use glam::DVec3;

const FREQUENCY_HZ: f64 = 100e6;
/// A floor of 2 × 2 m, and a wall that rises from its edge, 1 m long.
const KD: [f64; 2] = [0.8, 0.6];

/// The wall leans by this from the floor. The corner is the z axis.
fn corner(angle_deg: f64, light: Light, camera_m: DVec3) -> Scene {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let up = DVec3::new(cos, sin, 0.0);
    let meshes = vec![
        quad("floor", DVec3::NEG_Z, 2.0 * DVec3::X, 2.0 * DVec3::Z, 0),
        quad("wall", DVec3::NEG_Z, up, 2.0 * DVec3::Z, 1),
    ];
    let mut scene = scene_of(meshes, light, camera_m, DVec3::new(0.4, 0.2, 0.0));
    for (material, kd) in scene.materials.iter_mut().zip(KD) {
        material.kd = [kd; 3];
    }
    scene.camera.resolution_px = [160, 120];
    scene.indirect = Some(IndirectLight::final_gather(0.02));
    with_tof(scene, &[FREQUENCY_HZ])
}

fn position(light: &Light) -> DVec3 {
    match light {
        Light::Point { position_m, .. } | Light::Spot { position_m, .. } => *position_m,
        _ => panic!("the lights of this test are points"),
    }
}

/// Radiant intensity of a light of 1 W in a direction, W/sr.
fn intensity(light: &Light) -> impl Fn(DVec3) -> f64 {
    let (axis, angles) = match light {
        Light::Spot {
            direction, cone, ..
        } => {
            let angles_deg = [cone.inner_half_angle_deg, cone.outer_half_angle_deg];
            (direction.normalize(), angles_deg.map(f64::to_radians))
        }
        _ => (DVec3::Z, [PI; 2]),
    };
    let [inner, outer] = angles;
    let falloff = move |off: f64| match off {
        off if off <= inner => 1.0,
        off if off < outer => (0.5 * PI * (off - inner) / (outer - inner)).cos(),
        _ => 0.0,
    };
    let over_angle = |t: f64| falloff(t * outer) * (t * outer).sin();
    let solid_angle = 2.0 * PI * outer * unit_interval(1e-9, over_angle);
    move |along| falloff(along.dot(axis).clamp(-1.0, 1.0).acos()) / solid_angle
}

/// The light of one bounce that P reflects, W/sr/m², and its Z.
fn bounce(scene: &Scene, p: DVec3, mesh: usize) -> (f64, Phasor) {
    let light = &scene.lights[0].light;
    let l = position(light);
    let intensity = intensity(light);
    let quad = |mesh: usize| {
        let positions_m = &scene.meshes[mesh].positions_m;
        let edges = [
            positions_m[1] - positions_m[0],
            positions_m[3] - positions_m[0],
        ];
        (positions_m[0], edges, edges[0].cross(edges[1]))
    };
    let (_, _, n_p) = quad(mesh);
    let (start, edges, across) = quad(1 - mesh);
    let (n_p, n_q) = (n_p.normalize(), across.normalize());
    let to_camera_m = p.distance(scene.camera.position_m);
    // Re and Im have both signs, and the quadrature needs one: it integrates f, f·(1 + cos φ) and f·(1 + sin φ).
    let integral = |part: fn(f64) -> f64| {
        unit_square(1e-4, |u, v| {
            // Denser towards the corner.
            let q = start + u * u * edges[0] + v * edges[1];
            let (pq, lq) = (q - p, q - l);
            let cosines = (n_p.dot(pq) * n_q.dot(pq) * n_q.dot(lq)).abs();
            let light =
                intensity(lq.normalize()) * cosines / (pq.length().powi(4) * lq.length().powi(3));
            let path_m = lq.length() + pq.length() + to_camera_m;
            let angle = TAU * FREQUENCY_HZ * path_m / SPEED_OF_LIGHT_M_S;
            2.0 * u * light * part(angle)
        }) * across.length()
            * KD[0]
            * KD[1]
            / (PI * PI)
    };
    let light = integral(|_| 1.0);
    let z = Phasor {
        re: integral(|angle| 1.0 + angle.cos()) - light,
        im: integral(|angle| 1.0 + angle.sin()) - light,
    };
    (light, z)
}

#[test]
fn the_mean_of_many_frames_has_no_bias() {
    const SEEDS: u32 = 6;
    let mut gpu = Gpu::open();
    for (name, scene) in corners() {
        let mut paths_mm = Vec::new();
        let mut lights = Vec::new();
        let mut rays = 0;
        let mut due: Option<Vec<(usize, f64, Phasor)>> = None;
        for seed in 0..SEEDS {
            let mut options = RenderOptions {
                seed,
                ..RenderOptions::default()
            };
            let frame = gpu.renderer.render(&scene, &mut options);
            let frame = frame.expect("the scene renders");
            let due = due.get_or_insert_with(|| expected(&scene, &frame, 17));
            let found = frame.values(Layer::Indirect).expect("it is there");
            let z = phasors(&frame, 0, TofQuantity::PhasorIndirect);
            rays += frame.stats.ray_count;
            let of_light = due
                .iter()
                .fold([0.0; 2], |[found_sum, due_sum], (i, light, _)| {
                    [found_sum + f64::from(found[3 * i]), due_sum + light]
                });
            let turned: Phasor = due.iter().map(|(i, _, due)| z[*i] * due.conjugate()).sum();
            let path_m = turned.argument_rad().expect("there is light") * SPEED_OF_LIGHT_M_S
                / (TAU * FREQUENCY_HZ);
            lights.push(of_light[0] / of_light[1]);
            paths_mm.push(1e3 * path_m);
        }
        let mean = |values: &[f64]| {
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
            (mean, (squares / (count * (count - 1.0))).sqrt())
        };
        let (path_mm, path_noise_mm) = mean(&paths_mm);
        let (light, light_noise) = mean(&lights);
        println!(
            "{name}: path {path_mm:+.3} ± {path_noise_mm:.3} mm, light {light:.5} ± {light_noise:.5}, {:.2} M rays",
            rays as f64 * 1e-6 / f64::from(SEEDS)
        );
        // As an average over pixels; light that curves most, along the corner, keeps a bias.
        assert!(path_mm.abs() <= 1.2 + 2.0 * path_noise_mm, "{name}");
        assert!((light - 1.0).abs() <= 1e-3 + 2.0 * light_noise, "{name}");
    }
}

/// In the corner that a spot lights partly, most pixels have the bounce alone.
#[test]
fn the_range_is_within_its_target_error() {
    let mut gpu = Gpu::open();
    for (name, mut scene) in corners() {
        let mut due: Option<Vec<(usize, f64, Phasor)>> = None;
        for target_mm in [10.0, 1.0] {
            scene.indirect = Some(IndirectLight::FinalGather(FinalGather {
                target_range_error_mm: Some(target_mm),
                ..FinalGather::new(0.5)
            }));
            let frame = gpu.render(&scene);
            let due = due.get_or_insert_with(|| expected(&scene, &frame, 51));
            let direct = phasors(&frame, 0, TofQuantity::PhasorDirect);
            let total = phasors(&frame, 0, TofQuantity::Phasor);
            let values = |z: &dyn Fn(usize, Phasor) -> Phasor| -> Vec<f32> {
                let values = due.iter().map(|&(i, _, bounce)| z(i, bounce));
                values.flat_map(|z| [z.re as f32, z.im as f32]).collect()
            };
            let found = values(&|i, _| total[i]);
            let expected = values(&|i, bounce| direct[i] + bounce);
            let exact = vec![0.0; expected.len()];
            let error_m = range_error_m(&found, &expected, &exact, FREQUENCY_HZ, |_| true);
            let stats = &frame.stats;
            let [claimed_mm, upper_mm] = [
                stats.estimated_range_error_mm,
                stats.estimated_range_error_upper_mm,
            ]
            .map(|mm| mm.expect("it is estimated"));
            let error_mm = 1e3 * error_m;
            println!(
                "{name}: {target_mm} mm asked, {error_mm:.2} true, {claimed_mm:.2} claimed, at most {upper_mm:.2}, {:.2} M rays",
                stats.ray_count as f64 * 1e-6
            );
            assert_eq!(stats.stop, Some(StopReason::TargetMet));
            assert!(upper_mm <= target_mm && error_mm <= target_mm, "{name}");
            assert!(error_mm <= 1.3 * upper_mm && error_mm >= 0.3 * claimed_mm);
        }
    }
}

fn corners() -> [(&'static str, Scene); 3] {
    let point = |x: f64, y: f64, z: f64| Light::Point {
        position_m: DVec3::new(x, y, z),
        power_w: [1.0; 3],
    };
    let spot = Light::Spot {
        position_m: DVec3::new(1.4, 1.1, 0.4),
        direction: DVec3::new(-1.3, -0.8, -0.4),
        cone: camlux::scene::SpotCone {
            inner_half_angle_deg: 20.0,
            outer_half_angle_deg: 45.0,
        },
        power_w: [1.0; 3],
    };
    let camera_m = DVec3::new(1.8, 1.2, 0.6);
    [
        ("right angle, spot", corner(90.0, spot, camera_m)),
        (
            "blunt, point",
            corner(130.0, point(1.0, 0.9, -0.3), camera_m),
        ),
        ("sharp, point", corner(60.0, point(1.2, 0.5, 0.2), camera_m)),
    ]
}

/// Index, light and Z of one in so many pixels, by quadrature.
fn expected(scene: &Scene, frame: &Frame, one_in: usize) -> Vec<(usize, f64, Phasor)> {
    let [width, height] = frame.resolution_px.map(|px| px as usize);
    let ids = frame.ids(Layer::InstanceId).expect("they are there");
    let positions = frame.values(Layer::Position).expect("they are there");
    let is_chosen = |i: usize| (i % width * 7 + i / width * 3).is_multiple_of(one_in);
    let pixels = (0..width * height).filter(|&i| ids[i] > 0 && is_chosen(i));
    pixels
        .map(|i| {
            let p = DVec3::new(
                positions[3 * i].into(),
                positions[3 * i + 1].into(),
                positions[3 * i + 2].into(),
            );
            let (light, z) = bounce(scene, p, ids[i] as usize - 1);
            (i, light, z)
        })
        .collect()
}
