//! Lights with an area, against closed forms and against the reference, which samples the area with its own code.

use std::f64::consts::PI;

use crate::common::gpu::{Gpu, demo_scene};
use crate::common::reference_frame::{error_off_edges, reference_frame, values};
use crate::common::rmse::relative_rmse_where;
use crate::common::rooms::{quad, scene_of};
use camlux::{
    output::{Frame, Layer, TofQuantity},
    scene::{AreaShape, IndirectLight, Light, Mesh, PixelFilter, PixelSampling},
};
use glam::DVec3;

const RECTANGLE: AreaShape = AreaShape::Rectangle {
    size_m: [0.6, 0.35],
};
const DISC: AreaShape = AreaShape::Disc { radius_m: 0.25 };

fn area(position_m: DVec3, direction: DVec3, shape: AreaShape) -> Light {
    Light::area(
        position_m,
        direction,
        DVec3::new(0.2, 0.1, -1.0),
        shape,
        [40.0, 30.0, 20.0],
    )
}

fn floor() -> Mesh {
    let corner = DVec3::new(-2.0, 0.0, 2.0);
    quad("floor", corner, 4.0 * DVec3::X, -4.0 * DVec3::Z, 0)
}

/// Irradiance per radiance of a parallel rectangle of size `x` by `y`, with a corner straight above at height 1 (Siegel & Howell).
fn of_corner(x: f64, y: f64) -> f64 {
    let edge = |a: f64, b: f64| a / a.hypot(1.0) * (b / a.hypot(1.0)).atan();
    0.5 * (edge(x, y) + edge(y, x))
}

/// Irradiance per radiance, over π, at a point of a plane parallel to a rectangle: adds four rectangles, one from the zenith of the point
/// to each corner, with signs. Lengths are over the height.
fn of_rectangle([x, z]: [f64; 2], [width, depth]: [f64; 2]) -> f64 {
    let signed = |x: f64, z: f64| of_corner(x.abs(), z.abs()) * x.signum() * z.signum();
    let (w, d) = (0.5 * width, 0.5 * depth);
    signed(x + w, z + d) - signed(x - w, z + d) - signed(x + w, z - d) + signed(x - w, z - d)
}

/// The same for a disc.
fn of_disc([x, z]: [f64; 2], radius: f64) -> f64 {
    let away = x * x + z * z;
    let root = ((1.0 + away + radius * radius).powi(2) - 4.0 * away * radius * radius).sqrt();
    0.5 * PI * (1.0 - (1.0 + away - radius * radius) / root)
}

/// Lamps above a floor, from afar to a two-hundredth of their size: without occluders the light is in closed form.
#[test]
fn lamps_light_a_floor_as_their_closed_form_has_it() {
    let mut gpu = Gpu::open();
    for height_m in [1.3, 0.1, 0.01, 0.004] {
        for shape in [RECTANGLE, DISC] {
            let light = Light::area(
                DVec3::new(0.1, height_m, -0.2),
                DVec3::NEG_Y,
                DVec3::NEG_Z,
                shape,
                [10.0; 3],
            );
            let scene = scene_of(vec![floor()], light, DVec3::new(0.3, 1.0, 2.2), DVec3::ZERO);
            let frame = gpu.render(&scene);
            let (positions, ids) = (
                values(&frame, Layer::Position),
                frame.ids(Layer::InstanceId),
            );
            let ids = ids.expect("every frame has it");
            let due: Vec<f32> = (0..ids.len())
                .flat_map(|pixel| {
                    let [x, _, z] = [0, 1, 2].map(|i| f64::from(positions[3 * pixel + i]));
                    let at = [x - 0.1, z + 0.2].map(|m| m / height_m);
                    let (form, area_m2) = match shape {
                        AreaShape::Rectangle { size_m } => {
                            let form = of_rectangle(at, size_m.map(|m| m / height_m));
                            (form, size_m[0] * size_m[1])
                        }
                        AreaShape::Disc { radius_m } => {
                            let form = of_disc(at, radius_m / height_m);
                            (form, PI * radius_m * radius_m)
                        }
                    };
                    let emitted = 10.0 / (PI * area_m2);
                    let is_seen = f64::from(u8::from(ids[pixel] != 0));
                    let kd = scene.materials[0].kd;
                    kd.map(|kd| (is_seen * kd / PI * emitted * form) as f32)
                })
                .collect();
            let error = relative_rmse_where(values(&frame, Layer::Direct), &due, |_| true);
            let estimated = frame.stats.estimated_area_light_error.expect("it has one");
            println!("{shape:?} at {height_m} m: {error:.1e}, estimated {estimated:.1e}");
            // A disc is a polygon of 32 edges.
            let most = match shape {
                AreaShape::Rectangle { .. } => 5e-6,
                AreaShape::Disc { .. } => 5e-3,
            };
            assert!(error < most && estimated <= 1e-5, "{error} {estimated}");
        }
    }
}

/// In a box and on glossy surfaces, with each ray kernel: the target error is met, and the estimated error is right.
#[test]
fn soft_shadows_and_their_bounce_are_those_of_the_reference() {
    let mut gpu = Gpu::open();
    for (name, shape, target) in [("cornell", RECTANGLE, 0.02), ("glossy", DISC, 0.03)] {
        let mut scene = demo_scene(name, [32, 32]);
        let position_m = scene.lights[0].position_m().expect("it has one");
        scene.lights = vec![area(position_m, DVec3::new(0.1, -1.0, 0.05), shape).into()];
        scene.indirect = Some(IndirectLight::final_gather(target));
        let truth = reference_frame(&scene, 256, 12);
        for frame in gpu.render_by_each_tracer(&scene) {
            let [direct, indirect] = [Layer::Direct, Layer::Indirect]
                .map(|layer| error_off_edges(&frame, &truth, layer));
            let estimated = frame.stats.estimated_area_light_error.expect("it has one");
            println!(
                "{name}: direct {direct:.4}, estimated {estimated:.4}, indirect {indirect:.4}"
            );
            assert!(direct < target && direct < 1.3 * estimated, "{direct}");
            assert!(estimated <= target && indirect < 1.3 * target, "{indirect}");
        }
    }
}

/// Slats of several spacings, the finest like the spacing of the area's points: the target error is met where shadows repeat, too.
#[test]
fn slats_do_not_fool_the_estimate() {
    let mut gpu = Gpu::open();
    for slats in [9, 16, 32, 60, 120] {
        let step_m = 1.6 / f64::from(slats);
        let mut meshes = vec![floor()];
        meshes.extend((0..slats).map(|i| {
            let corner = DVec3::new(-0.8 + step_m * f64::from(i), 0.5, 0.8);
            let (across, along) = (0.5 * step_m * DVec3::X, -1.6 * DVec3::Z);
            quad(&format!("slat {i}"), corner, across, along, i + 1)
        }));
        let light = Light::area(
            DVec3::new(0.0, 1.4, 0.0),
            DVec3::NEG_Y,
            DVec3::NEG_Z,
            RECTANGLE,
            [40.0; 3],
        );
        let scene = scene_of(meshes, light, DVec3::new(0.3, 0.4, 2.4), DVec3::ZERO);
        let truth = reference_frame(&scene, 256, 0);
        let frame = gpu.render(&scene);
        let direct = error_off_edges(&frame, &truth, Layer::Direct);
        let estimated = frame.stats.estimated_area_light_error.expect("it has one");
        println!("{slats} slats: direct {direct:.4}, estimated {estimated:.4}");
        assert!(direct < 0.02 && estimated <= 0.02, "{direct} {estimated}");
    }
}

/// A lamp in the middle of a room, where the error is the same everywhere: the estimated error covers the true one for most seeds.
#[test]
fn claims_hold_for_most_seeds() {
    let mut gpu = Gpu::open();
    for shape in [RECTANGLE, DISC] {
        let mut scene = demo_scene("cornell", [32, 32]);
        scene.lights = vec![
            area(
                DVec3::new(0.0, 1.6, 0.0),
                DVec3::new(0.4, -1.0, -0.2),
                shape,
            )
            .into(),
        ];
        scene.indirect = None;
        let truth = reference_frame(&scene, 256, 0);
        let ratios = (0..24).map(|seed| {
            let frame = gpu.render_seeded(&scene, seed);
            let estimated = frame.stats.estimated_area_light_error.expect("it has one");
            assert!(estimated <= 0.02);
            [
                error_off_edges(&frame, &truth, Layer::Direct) / estimated,
                error_off_edges(&frame, &truth, Layer::Direct),
            ]
        });
        let ratios: Vec<[f64; 2]> = ratios.collect();
        println!("true over claimed, and true: {ratios:.2?}");
        assert!(ratios.iter().filter(|[ratio, _]| *ratio > 1.0).count() <= 2);
        assert!(ratios.iter().all(|[_, error]| *error < 0.02));
    }
}

/// Each point of the area has its own path length, which phasors must include. Also tests pixel samples.
#[test]
fn phasors_and_pixel_samples_are_those_of_the_reference() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("tof_corner", [28, 28]).in_world().into_owned();
    let position_m = scene.lights[0].position_m().expect("it has one");
    let direction = scene.lights[0].direction().unwrap_or(-position_m);
    scene.lights.truncate(1);
    scene.lights[0] = area(position_m, direction, DISC).into();
    scene.indirect = Some(IndirectLight::final_gather(0.03));
    for samples in [None, Some(8)] {
        scene.camera.pixel_sampling = samples.map(|samples| PixelSampling {
            samples,
            filter: PixelFilter::Box,
        });
        let truth = reference_frame(&scene, 256, 12);
        let frame = gpu.render(&scene);
        let of_direct = error_off_edges(&frame, &truth, Layer::Direct);
        let of_bounce = error_off_edges(&frame, &truth, Layer::Indirect);
        let phasor = |frame: &Frame, quantity| {
            let values = values(frame, Layer::Tof(0, quantity));
            values.chunks(2).flat_map(|z| [z[0], z[1], 0.0]).collect()
        };
        let [direct, indirect] =
            [TofQuantity::PhasorDirect, TofQuantity::PhasorIndirect].map(|quantity| {
                let [found, due]: [Vec<f32>; 2] = [&frame, &truth].map(|f| phasor(f, quantity));
                let edges = truth.ids(Layer::Edge).expect("a reference has it");
                relative_rmse_where(&found, &due, |pixel| edges[pixel] == 0)
            });
        println!("{samples:?}: {of_direct:.4} {of_bounce:.4}, phasors {direct:.4} {indirect:.4}");
        let most = [of_direct, of_bounce, direct, indirect].into_iter();
        assert!(most.fold(0.0, f64::max) < 0.03);
    }
}
