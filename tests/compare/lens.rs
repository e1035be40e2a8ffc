//! What a camera with a lens sees by rays, against rays in f64. The lens's formulas must project each point back onto its pixel.

use crate::common::calibrations;
use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene, distort, rational, scale_lens};
use crate::common::rooms;
use crate::geometry::{camera_errors, render};
use camlux::{
    Scene,
    output::{Frame, Layer},
    reference::Reference,
    scene::{Distortion, Intrinsics, Lens, PixelFilter, PixelSampling, Shadow},
};
use glam::{DVec2, DVec3};

/// A scene of the repository through a lens.
fn through(name: &str, resolution_px: [u32; 2], distortion: Distortion) -> Scene {
    let mut scene = demo_scene(name, resolution_px);
    scene.indirect = None;
    distort(&mut scene, distortion);
    scene
}

#[test]
fn lenses_show_what_rays_hit() {
    let mut gpu = Gpu::open();
    let barrel = rational([-0.3, 0.1, 0.002, -0.001, 0.0, 0.0, 0.0, 0.0]);
    let fisheye = Distortion::Fisheye([0.05, -0.01, 0.0, 0.0]);
    for name in DEMO_SCENES {
        let skipped = if name == "knot" { 0.3 } else { 0.05 };
        for distortion in [Distortion::Rational([0.0; 14]), barrel, fisheye] {
            let scene = through(name, [64, 64], distortion);
            let (frame, kept) = render(&mut gpu, &scene);
            let what = format!("{name}, {distortion:?}");
            camera_errors(&scene, &frame, &kept).check(&what, skipped);
        }
    }
}

/// The rasteriser draws a pinhole whose columns are not at a right angle to its rows.
#[test]
fn a_skewed_pinhole_shows_what_rays_hit() {
    let mut gpu = Gpu::open();
    for skew in [-9.0, 20.0] {
        let mut scene = demo_scene("cornell", [64, 64]);
        scene.indirect = None;
        scene.camera.lens = Lens::Intrinsics(Intrinsics {
            skew,
            ..scene.camera.intrinsics_px()
        });
        let (frame, kept) = render(&mut gpu, &scene);
        camera_errors(&scene, &frame, &kept).check(&format!("skew {skew}"), 0.05);
        let truth = Reference::new(&scene, 1).expect("a valid scene").frame();
        let positions = |frame: &Frame| -> Vec<f32> {
            let values = frame.values(Layer::Position).expect("every frame has it");
            values.to_vec()
        };
        let edges = truth.ids(Layer::Edge).expect("a reference has it");
        let pairs = positions(&frame).into_iter().zip(positions(&truth));
        let inside = pairs.enumerate().filter(|(i, _)| edges[i / 3] == 0);
        // Rounding decides which of two walls a pixel on their edge shows.
        let differing = inside.filter(|(_, (found, due))| (found - due).abs() > 1e-5);
        let count = differing.count();
        assert!(count <= 3, "skew {skew}: {count} coordinates differ");
    }
}

/// It also sees what is behind the camera.
#[test]
fn a_fisheye_sees_more_than_half_of_all_directions() {
    let mut scene = rooms::marked_room();
    scene.camera.resolution_px = [128, 128];
    // 40 pixels a radian: the middles of the edges are 92 degrees off the axis, the corners 130.
    scene.camera.lens = Lens::Distorted {
        intrinsics: Intrinsics {
            fx: 40.0,
            fy: 40.0,
            cx: 64.0,
            cy: 64.0,
            skew: 0.0,
        },
        distortion: Distortion::Fisheye([0.0; 4]),
    };
    let (frame, kept) = render(&mut Gpu::open(), &scene);
    camera_errors(&scene, &frame, &kept).check("marked room", 0.06);
    let depth = frame.values(Layer::Depth).expect("every frame has it");
    assert!(depth[0] < 0.0, "the corner shows what is behind the camera");
}

/// Outside the image circle a fisheye is black, with or without samples; inside, it shows what the reference does.
#[test]
fn a_fisheye_is_black_outside_its_image_circle() {
    let mut gpu = Gpu::open();
    // The radius in which the lens shows something: π, and the maximum of θ·(1 - θ²/12), which is 4/3 at θ = 2.
    for (k1, circle) in [(0.0, std::f64::consts::PI), (-1.0 / 12.0, 4.0 / 3.0)] {
        let mut scene = rooms::marked_room();
        scene.camera.resolution_px = [96, 96];
        let focal_px = 40.0 / circle;
        scene.camera.lens = Lens::Distorted {
            intrinsics: Intrinsics {
                fx: focal_px,
                fy: focal_px,
                cx: 48.0,
                cy: 48.0,
                skew: 0.0,
            },
            distortion: Distortion::Fisheye([k1, 0.0, 0.0, 0.0]),
        };
        let warnings = scene.warnings().join("\n");
        assert!(
            warnings.contains("100 % of the image's border are outside"),
            "{warnings}"
        );
        let frame = gpu.render(&scene);
        let truth = Reference::new(&scene, 1).expect("a valid scene").frame();
        let ids = frame.ids(Layer::InstanceId).expect("every frame has it");
        let due = truth.ids(Layer::InstanceId).expect("every frame has it");
        for (i, (id, due)) in ids.iter().zip(due).enumerate() {
            let place = DVec2::new((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5);
            let radius_px = place.distance(DVec2::splat(48.0));
            assert_eq!(*id > 0, radius_px < 40.0, "{place}");
            assert_eq!(*due > 0, radius_px < 40.0, "{place}");
        }
        let range = frame.values(Layer::Range).expect("every frame has it");
        let expected = truth.values(Layer::Range).expect("every frame has it");
        let edges = truth.ids(Layer::Edge).expect("a reference has it");
        let pairs = range.iter().zip(expected).zip(edges);
        let seen = pairs.filter(|((a, _), edge)| a.is_finite() && **edge == 0);
        for ((a, b), _) in seen {
            assert!((a - b).abs() < 1e-4 * b, "{a} for {b}");
        }
        scene.camera.pixel_sampling = Some(PixelSampling {
            samples: 4,
            filter: PixelFilter::Box,
        });
        let radiance = gpu.render(&scene);
        let radiance = radiance
            .values(Layer::Radiance)
            .expect("every frame has it");
        for (i, bands) in radiance.chunks(3).enumerate() {
            let place = DVec2::new((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5);
            if place.distance(DVec2::splat(48.0)) > 41.0 {
                assert_eq!(bands, [0.0; 3], "{place}");
            }
        }
    }
}

/// All directions, in a room of which each wall tells its place.
#[test]
fn a_panorama_sees_all_directions() {
    let mut scene = rooms::marked_room();
    scene.camera.resolution_px = [128, 64];
    scene.camera.lens = Lens::Equirectangular;
    let (frame, kept) = render(&mut Gpu::open(), &scene);
    camera_errors(&scene, &frame, &kept).check("marked room", 0.06);
    // The middle column looks ahead, the first and the last one back; the rows go from straight up to straight down.
    let positions = frame
        .values(Layer::CameraPosition)
        .expect("every frame has it");
    let (positions, _) = positions.as_chunks::<3>();
    let seen = |x: usize, y: usize| DVec3::from(positions[128 * y + x].map(f64::from)).normalize();
    for (x, y, due) in [
        (64, 32, DVec3::Z),
        (0, 32, DVec3::NEG_Z),
        (96, 32, DVec3::X),
        (32, 32, DVec3::NEG_X),
        (64, 0, DVec3::NEG_Y),
        (64, 63, DVec3::Y),
    ] {
        // Half a pixel is 0.025 radians.
        assert!(
            seen(x, y).distance(due) < 0.04,
            "({x}, {y}): {} for {due}",
            seen(x, y)
        );
    }
    let truth = Reference::new(&scene, 1).expect("a valid scene").frame();
    let due = truth.values(Layer::CameraPosition).expect("it has it");
    let edges = truth.ids(Layer::Edge).expect("a reference has it");
    let pairs = positions.as_flattened().iter().zip(due).enumerate();
    let differing = pairs.filter(|(i, (a, b))| edges[i / 3] == 0 && (*a - *b).abs() > 1e-5);
    assert_eq!(differing.count(), 0);
}

#[test]
fn every_tracer_sees_the_same() {
    let scene = through("knot", [64, 48], Distortion::Fisheye([0.05, 0.0, 0.0, 0.0]));
    let frames = Gpu::open().render_by_each_tracer(&scene);
    let truth = Reference::new(&scene, 1).expect("a valid scene").frame();
    let seen = |frame: &Frame| {
        let ids = frame.ids(Layer::MaterialId).expect("every frame has it");
        let positions = frame.values(Layer::Position).expect("every frame has it");
        let at = |i: usize| DVec3::from_slice(&[0, 1, 2].map(|c| positions[3 * i + c].into()));
        let pixels = (0..ids.len()).map(|i| (ids[i], at(i)));
        pixels.collect::<Vec<(u32, DVec3)>>()
    };
    for frame in &frames {
        let pixels = seen(&truth).into_iter().zip(seen(frame));
        let differing = pixels.filter(|(a, b)| a.0 != b.0 || a.1.distance(b.1) > 1e-4);
        // Rounding decides at edges.
        let count = differing.count();
        assert!(count <= 3, "{count} pixels differ");
    }
}

/// In images of a quarter of the edges: angles and rounding, as shares of the image, are the same.
#[test]
fn points_land_on_their_pixels() {
    const SMALLER: u32 = 4;
    let mut gpu = Gpu::open();
    for calibration in calibrations::all() {
        let mut scene = rooms::marked_room();
        scene.camera.resolution_px = calibration.resolution_px.map(|px| px / SMALLER);
        scene.camera.lens = calibration.lens;
        scale_lens(&mut scene.camera.lens, 1.0 / f64::from(SMALLER));
        let frame = gpu.render(&scene);
        let positions = frame.values(Layer::Position).expect("every frame has it");
        let mut largest_px: f64 = 0.0;
        let [width, _] = frame.resolution_px;
        for (i, point) in positions.chunks_exact(3).enumerate() {
            let centre = DVec2::new(f64::from(i as u32 % width), f64::from(i as u32 / width)) + 0.5;
            let point_m = DVec3::from_slice(&[0, 1, 2].map(|c| point[c].into()));
            let shown = scene.camera.project(point_m).expect("it is seen");
            largest_px = largest_px.max(f64::from(SMALLER) * shown.distance(centre));
        }
        println!("{}: {largest_px:.1e} px", calibration.name);
        assert!(largest_px < 1e-3, "{}: {largest_px} px", calibration.name);
    }
}

/// The reference inverts the lens with its own code.
#[test]
fn the_reference_sees_the_same() {
    let mut gpu = Gpu::open();
    let radial = [-0.3, 0.1, 0.002, -0.001, 0.01, 0.02, 0.0, 0.0];
    let prism = [-0.02, 0.01, 0.03, -0.01, 0.08, -0.05];
    for (distortion, skew) in [
        (rational(radial), 0.0),
        (Distortion::Fisheye([0.05, -0.01, 0.0, 0.0]), 2.0),
        (
            Distortion::from_opencv(&[&radial[..], &prism].concat()).expect("14 numbers"),
            -3.0,
        ),
    ] {
        let mut scene = through("cornell", [96, 96], distortion);
        if let Lens::Distorted { intrinsics, .. } = &mut scene.camera.lens {
            intrinsics.skew = skew;
        }
        scene.direct.shadow = Some(Shadow::Rays);
        let frame = gpu.render(&scene);
        let truth = Reference::new(&scene, 1).expect("a valid scene").frame();
        let values = |frame: &Frame, layer| -> Vec<f32> {
            frame.values(layer).expect("both have it").to_vec()
        };
        let ids = |frame: &Frame| frame.ids(Layer::InstanceId).expect("both have it").to_vec();
        assert_eq!(ids(&frame), ids(&truth));
        let edges = truth.ids(Layer::Edge).expect("a reference has it");
        let [found, due] = [&frame, &truth].map(|frame| values(frame, Layer::Direct));
        let bands = found.iter().zip(&due).enumerate();
        let inside = bands.filter(|(i, _)| edges[i / 3] == 0);
        let [mut squares, mut total] = [0.0; 2];
        for (_, (found, due)) in inside {
            squares += f64::from(found - due).powi(2);
            total += f64::from(*due).powi(2);
        }
        let error = (squares / total).sqrt();
        println!("{distortion:?}: {error:.1e}");
        assert!(error < 2e-6, "{distortion:?}: {error:e}");
    }
}
