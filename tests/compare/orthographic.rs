//! Cameras whose rays are parallel, against rays in f64, the reference, and what is known of a plane.

use std::f64::consts::FRAC_PI_4;

use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene};
use crate::common::reference_frame::{error_of_indirect, error_off_edges, reference_frame, values};
use crate::common::rooms::{moved, quad, scene_of};
use crate::geometry::{camera_errors, render};
use crate::tof::{modulated, modulated_demo_scene, phasors};
use crate::tof_bounce::kernel_error;
use camlux::{
    RenderOptions, Scene,
    output::{FLOW_LAYERS, Frame, Layer, OtherFrame, TofQuantity, describe_frame},
    reference::Reference,
    scene::{
        Camera, IndirectLight, Lens, Light, PixelFilter, PixelSampling, Shadow, Vignetting, VplSum,
    },
};
use glam::{DMat4, DQuat, DVec2, DVec3};

/// Parallel rays over the part of a scene that its own camera shows around the point it looks at.
fn made_parallel(mut scene: Scene) -> Scene {
    let Camera {
        position_m,
        look_at_m,
        resolution_px: [_, height],
        ..
    } = scene.camera;
    let focal_px = scene.camera.intrinsics_px().fy;
    scene.camera.lens = Lens::Orthographic {
        height_m: f64::from(height) / focal_px * position_m.distance(look_at_m),
    };
    scene
}

fn through_parallel(name: &str, size_px: u32) -> Scene {
    made_parallel(demo_scene(name, [size_px; 2]))
}

#[test]
fn parallel_rays_show_what_they_hit() {
    let mut gpu = Gpu::open();
    // The knot's floor is at 1.3° to the rays, where their rounding moves points 40 times as far.
    for name in DEMO_SCENES.into_iter().filter(|name| *name != "knot") {
        let mut scene = through_parallel(name, 64);
        scene.indirect = None;
        scene.direct.shadow = Some(Shadow::Rays);
        let (frame, kept) = render(&mut gpu, &scene);
        camera_errors(&scene, &frame, &kept).check(name, 0.06);
        let truth = reference_frame(&scene, 1, 0);
        for layer in [Layer::Direct, Layer::CameraPosition] {
            let error = error_off_edges(&frame, &truth, layer);
            println!("{name}, {layer:?}: {error:.1e}");
            // The radiance of textured surfaces is accurate to 1e-5.
            assert!(error < 2e-5, "{name}, {layer:?}: {error:e}");
        }
        assert_eq!(values(&frame, Layer::Depth), values(&frame, Layer::Range));
    }
    let scene = through_parallel("glossy", 64);
    for (scale, shift_m, away_m) in [
        (1.0, 1e5, 0.0),
        (1e-3, 10.0, 0.0),
        (1e4, 0.0, 0.0),
        (1.0, 0.0, 1e3),
    ] {
        let shift_m = shift_m * DVec3::new(1.0, -0.5, 0.3);
        let mut scene = moved(&scene, scale, shift_m);
        scene.camera.position_m -= away_m * scene.camera.basis().forward;
        scene.indirect = None;
        let (frame, kept) = render(&mut gpu, &scene);
        camera_errors(&scene, &frame, &kept).check(&format!("x {scale} + {shift_m}"), 0.06);
    }
}

/// Where surfaces emit light, rays find what the camera sees, and not the rasteriser.
#[test]
fn rays_and_the_rasteriser_see_the_same() {
    let mut gpu = Gpu::open();
    let mut scene = through_parallel("glossy", 64);
    scene.indirect = None;
    scene.direct.shadow = Some(Shadow::Rays);
    let rasterised = gpu.render(&scene);
    for material in &mut scene.materials {
        material.emission_w_sr_m2 = [0.5, 0.25, 1.0];
    }
    scene.camera.pixel_sampling = None;
    let (frame, kept) = render(&mut gpu, &scene);
    camera_errors(&scene, &frame, &kept).check("rays", 0.06);
    let truth = reference_frame(&scene, 1, 0);
    for layer in [Layer::Direct, Layer::Emission, Layer::Position] {
        let error = error_off_edges(&frame, &truth, layer);
        assert!(error < 3e-6, "{layer:?}: {error:e}");
    }
    let error = error_off_edges(&rasterised, &truth, Layer::Direct);
    assert!(error < 3e-6, "{error:e}");
}

#[test]
fn the_bounce_is_that_of_the_reference() {
    let mut gpu = Gpu::open();
    for (name, rounds) in [("cornell", 16), ("glossy", 64)] {
        let mut scene = through_parallel(name, 48);
        scene.indirect = Some(IndirectLight::final_gather(0.03));
        let frame = gpu.render(&scene);
        let truth = reference_frame(&scene, 64, rounds);
        let (error, noise) = error_of_indirect(&frame, &truth);
        println!("{name}: {error:.4}, noise of the reference {noise:.4}");
        assert!(noise < 0.03 && error < 0.039, "{name}: {error}");
    }
}

#[test]
fn sums_match_the_model() {
    let mut gpu = Gpu::open();
    let mut scene = made_parallel(modulated_demo_scene("glossy", [16, 16], &[100e6, 1e9]));
    for sum in VplSum::ALL {
        scene.indirect = Some(IndirectLight::vpl_sum(sum, 24));
        let error = kernel_error(&mut gpu, &scene, sum, &mut RenderOptions::default());
        assert!(error <= 1e-5, "{}: {error:e}", sum.name());
    }
}

/// Light, depths and phasors of pixels with one point each, and of pixels with samples.
#[test]
fn phasors_have_the_way_to_the_plane_of_the_camera() {
    let mut gpu = Gpu::open();
    for samples in [None, Some(64)] {
        for is_bounced in [false, true] {
            let mut scene =
                made_parallel(modulated_demo_scene("cornell", [40, 40], &[20e6, 100e6]));
            // Behind the scene's middle, which the plane of the camera is not.
            scene.camera.position_m += 0.25 * DVec3::X;
            scene.camera.look_at_m += 0.25 * DVec3::X;
            scene.camera.pixel_sampling = samples.map(|samples| PixelSampling {
                samples,
                filter: PixelFilter::Box,
            });
            scene.direct.shadow = Some(Shadow::Rays);
            scene.indirect = is_bounced.then(|| IndirectLight::final_gather(0.03));
            let frame = gpu.render(&scene);
            let truth = reference_frame(&scene, 64, if is_bounced { 16 } else { 0 });
            let quantity = match is_bounced {
                true => TofQuantity::PhasorIndirect,
                false => TofQuantity::PhasorDirect,
            };
            for frequency in 0..2 {
                let error = phasor_error(&frame, &truth, frequency, quantity);
                println!("{samples:?} samples, {quantity:?} {frequency}: {error:.1e}");
                let most = match (is_bounced, samples) {
                    (true, _) => 0.06,
                    (false, Some(_)) => 0.015,
                    (false, None) => 5e-6,
                };
                assert!(
                    error < most,
                    "{samples:?}, {quantity:?} {frequency}: {error}"
                );
            }
            if samples.is_some() {
                let finite = |frame: &Frame| -> Vec<f64> {
                    let depths = values(frame, Layer::MeanDepth).iter();
                    depths
                        .map(|&depth| depth.into())
                        .filter(|d: &f64| d.is_finite())
                        .collect()
                };
                let means = [&frame, &truth].map(|frame| {
                    let depths = finite(frame);
                    depths.iter().sum::<f64>() / depths.len() as f64
                });
                assert!((means[0] / means[1] - 1.0).abs() < 1e-3, "{means:?}");
            }
        }
    }
}

fn phasor_error(frame: &Frame, truth: &Frame, frequency: usize, quantity: TofQuantity) -> f64 {
    let edges = truth.ids(Layer::Edge).expect("a reference has it");
    let [found, due] = [frame, truth].map(|frame| phasors(frame, frequency, quantity));
    let (mut squares, mut all) = (0.0, 0.0);
    for i in (0..found.len()).filter(|&i| edges[i] == 0) {
        squares += (found[i] + due[i] * -1.0).magnitude().powi(2);
        all += due[i].magnitude().powi(2);
    }
    f64::sqrt(squares / all)
}

/// A wall of 4 m that faces a camera of 24 × 16 pixels, each 0.05 m wide; and a card before it, 0.3 m wide and 0.2 m high.
fn wall_and_card(card_m: DVec3) -> Scene {
    let facing = |name: &str, corner_m: DVec3, width_m: f64, height_m: f64, material| {
        quad(
            name,
            corner_m,
            width_m * DVec3::X,
            height_m * DVec3::Y,
            material,
        )
    };
    let meshes = vec![
        facing("wall", DVec3::new(-2.0, -2.0, -1.0), 4.0, 4.0, 0),
        facing("card", card_m, 0.3, 0.2, 1),
    ];
    let camera_m = DVec3::new(0.0, 0.0, 1.5);
    let light = Light::point(DVec3::new(0.5, 1.0, 1.5), [3.0; 3]);
    let mut scene = scene_of(meshes, light, camera_m, DVec3::ZERO);
    scene.camera.resolution_px = [24, 16];
    scene.camera.lens = Lens::Orthographic { height_m: 0.8 };
    scene.indirect = None;
    scene
}

/// Off the grid of pixels, so that each edge is inside pixels.
const CARD_M: DVec3 = DVec3::new(-0.09, -0.11, 0.0);

/// The place of a pixel's centre in the plane of the camera: right and down from its middle, metres.
fn place_m(i: usize) -> DVec2 {
    0.05 * (DVec2::new((i % 24) as f64, (i / 24) as f64) + 0.5 - DVec2::new(12.0, 8.0))
}

#[test]
fn a_plane_that_faces_the_camera_has_one_depth() {
    let mut gpu = Gpu::open();
    for near_m in [0.0, 0.7, 1.2] {
        let scene = wall_and_card(CARD_M + near_m * DVec3::Z);
        let frame = gpu.render(&scene);
        let (points, _) = values(&frame, Layer::CameraPosition).as_chunks::<3>();
        let ids = frame.ids(Layer::InstanceId).expect("every frame has it");
        let (depth, range) = (values(&frame, Layer::Depth), values(&frame, Layer::Range));
        for (i, &id) in ids.iter().enumerate() {
            let due_m = if id == 1 { 2.5 } else { 1.5 - near_m };
            let point = DVec3::from(points[i].map(f64::from));
            assert!(point.distance(place_m(i).extend(due_m)) < 1e-6, "{point}");
            assert!((f64::from(depth[i]) - due_m).abs() < 1e-6 && range[i] == depth[i]);
        }
        // 0.3 m and 0.2 m are 6 and 4 pixels at any distance.
        assert_eq!(ids.iter().filter(|&&id| id == 2).count(), 24);
    }
}

/// A light at the middle of the camera measures (|LP| + depth)/2 in each pixel.
#[test]
fn measured_points_are_on_the_rays_of_their_pixels() {
    let mut scene = modulated(wall_and_card(CARD_M), &[20e6]);
    scene.direct.shadow = Some(Shadow::Rays);
    let point = Layer::Tof(0, TofQuantity::Point);
    let wanted = [point, Layer::Depth, Layer::CameraPosition, Layer::HalfPath];
    let frame = Gpu::open().render_with(&scene, |options| options.layers = Some(&wanted));
    let (points, _) = values(&frame, point).as_chunks::<3>();
    let light_m = scene.lights[0].position_m().expect("it has one");
    let positions = values(&frame, Layer::CameraPosition).as_chunks::<3>().0;
    let mut lit = 0;
    for (i, (point, seen)) in points.iter().zip(positions).enumerate() {
        let [point, seen] = [*point, *seen].map(|p| DVec3::from(p.map(f64::from)));
        if point.is_nan() {
            continue;
        }
        lit += 1;
        let seen_m = scene.camera.to_world().transform_point3(seen);
        let due_m = 0.5 * (seen_m.distance(light_m) + seen.z);
        assert!(
            point.distance(place_m(i).extend(due_m)) < 2e-6,
            "{point} {due_m}"
        );
        let half_path_m = f64::from(values(&frame, Layer::HalfPath)[i]);
        assert!((half_path_m - due_m).abs() < 1e-6);
    }
    assert!(lit > 300, "{lit}");
}

/// Behind an aperture all pixels get π/(4N²) of the radiance, or that times a measured vignetting; with samples, too.
#[test]
fn an_aperture_darkens_no_corner() {
    let mut gpu = Gpu::open();
    let mut scene = modulated(wall_and_card(CARD_M), &[20e6]);
    for samples in [None, Some(4)] {
        scene.camera.pixel_sampling = samples.map(|samples| PixelSampling {
            samples,
            filter: PixelFilter::Box,
        });
        for vignetting in [None, Some(Vignetting([-0.4, 0.0, 0.0]))] {
            let sensor = scene.sensor.as_mut().expect("time of flight has one");
            (sensor.f_number, sensor.vignetting) = (Some(2.0), vignetting);
            let joule = sensor.joule_per_irradiance();
            let frame = gpu.render(&scene);
            let pairs = values(&frame, Layer::Energy)
                .iter()
                .zip(values(&frame, Layer::Radiance));
            for (i, (energy, radiance)) in pairs.enumerate() {
                let squared_radius =
                    (place_m(i / 3) / 0.05).length_squared() / (12.0f64.powi(2) + 8.0f64.powi(2));
                let share = vignetting.map_or(1.0, |_| 1.0 - 0.4 * squared_radius);
                let due = f64::from(*radiance) * joule * FRAC_PI_4 / 4.0 * share;
                assert!(
                    (f64::from(*energy) - due).abs() <= 2e-6 * due,
                    "{energy} {due}"
                );
            }
        }
    }
}

/// A motion along the view has no flow; one across it has the same everywhere, at any depth.
#[test]
fn flow_is_the_motion_across_the_view() {
    let mut gpu = Gpu::open();
    let step_m = DVec3::new(0.1, -0.05, 0.4);
    let scene = wall_and_card(CARD_M);
    let mut frame = gpu.render(&scene);
    let next = gpu.render(&wall_and_card(CARD_M + step_m));
    let other = OtherFrame {
        camera: &scene.camera,
        mesh_moves: &[None, Some(DMat4::from_translation(step_m))],
        shown: Some(&next),
    };
    frame.add_flow(
        &scene.camera,
        FLOW_LAYERS.as_flattened(),
        [Some(other), None],
    );
    let (flow, _) = values(&frame, Layer::Flow).as_chunks::<2>();
    let hidden = frame.ids(Layer::FlowOcclusion).expect("it was asked for");
    let ids = frame.ids(Layer::InstanceId).expect("every frame has it");
    let next_ids = next.ids(Layer::InstanceId).expect("every frame has it");
    for (i, &id) in ids.iter().enumerate() {
        let found = DVec2::from(flow[i].map(f64::from));
        let due_px = if id == 2 {
            DVec2::new(2.0, 1.0)
        } else {
            DVec2::ZERO
        };
        assert!(found.distance(due_px) < 1e-5, "{found} {due_px}");
        // The card hides where it comes to, but for an edge of a pixel.
        let is_covered = [0, 1, 24, 25]
            .iter()
            .all(|step| next_ids.get(i + step) == Some(&2));
        assert_eq!(hidden[i] == 1, id == 1 && is_covered, "pixel {i}");
    }
}

#[test]
fn points_land_on_their_pixels() {
    let scene = through_parallel("cornell", 48);
    let truth = Reference::new(&scene, 1).expect("a valid scene").frame();
    let (positions, _) = values(&truth, Layer::Position).as_chunks::<3>();
    let ids = truth.ids(Layer::InstanceId).expect("every frame has it");
    for (i, position) in positions.iter().enumerate().filter(|(i, _)| ids[*i] > 0) {
        let centre = DVec2::new((i % 48) as f64, (i / 48) as f64) + 0.5;
        let point_m = DVec3::from(position.map(f64::from));
        let shown = scene.camera.project(point_m).expect("it is seen");
        assert!(shown.distance(centre) < 1e-4, "{shown} for {centre}");
    }
    // A batch describes it so.
    let line = describe_frame(&scene, &scene, DQuat::IDENTITY, &[]);
    let Lens::Orthographic { height_m } = scene.camera.lens else {
        panic!("{:?}", scene.camera.lens);
    };
    assert_eq!(line["camera"]["projection"], "orthographic");
    assert_eq!(line["camera"]["height_m"], height_m);
    assert!(line["camera"]["intrinsics_px"].is_null());
    let Camera {
        position_m,
        look_at_m,
        ..
    } = scene.camera;
    assert_eq!(scene.camera.project(2.0 * position_m - look_at_m), None);
}
