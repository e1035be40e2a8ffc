//! What a camera with a lens sees by rays, against rays in f64. The lens's formulas must project each point back onto its pixel.

use crate::common::calibrations;
use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene, distort, rational, scale_lens};
use crate::common::rooms;
use crate::geometry::{camera_errors, render};
use camlux::{
    Scene,
    output::{Frame, Layer},
    reference::Reference,
    scene::{Distortion, Intrinsics, Lens, Shadow},
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
