//! The path-sampled reference against an image that another renderer has path-traced (`tests/data/README.md`), pixel by
//! pixel. Both state their standard errors, and their differences must scatter accordingly.

use crate::common::gpu::demo_scene;
use crate::common::ray_caster::{RayCaster, pixel::PixelRay};
use crate::common::reference_frame::add_rounds;
use crate::common::truth::Truth;
use camlux::{
    Scene,
    output::Layer,
    reference::Reference,
    scene::{Camera, Intrinsics, Lens},
};

const SIZE: u32 = 200;
/// Every fifth pixel, in both directions.
const STEP: u32 = 5;
const ROUNDS: u32 = 64;
const SAMPLES_PER_ROUND: u32 = 64;

/// The scene at the pixels (first + i·STEP) of the whole image.
fn some_pixels(scene: &Scene, first: [u32; 2]) -> Scene {
    let Intrinsics { fx, fy, cx, cy, .. } = scene.camera.intrinsics_px();
    let [step, x, y] = [STEP, first[0], first[1]].map(f64::from);
    // (first + i·STEP) + ½ in the large image is i + ½ in the small one.
    let place = |large: f64, first: f64| (large - first - 0.5) / step + 0.5;
    Scene {
        camera: Camera {
            resolution_px: [SIZE / STEP; 2],
            lens: Lens::Intrinsics(Intrinsics {
                fx: fx / step,
                fy: fy / step,
                cx: place(cx, x),
                cy: place(cy, y),
                skew: 0.0,
            }),
            ..scene.camera
        },
        ..scene.clone()
    }
}

#[test]
fn differences_scatter_as_the_standard_errors_say() {
    let truth = Truth::read();
    let scene = demo_scene("cornell", [SIZE, SIZE]);
    let caster = RayCaster::new(&scene);

    let mut scores = Vec::new();
    let mut direct_off: f64 = 0.0;
    let mut direct_square: f64 = 0.0;
    let mut pixels = 0;
    for first in [[2, 2], [0, 4], [4, 1]] {
        let part = some_pixels(&scene, first);
        let mut reference = Reference::new(&part, SAMPLES_PER_ROUND).expect("the scene is valid");
        add_rounds(&mut reference, ROUNDS);
        let frame = reference.frame();
        let values = |layer: Layer| frame.values(layer).expect("it is there");
        for (index, _) in values(Layer::Depth).iter().enumerate() {
            let [column, row] = [index as u32 % (SIZE / STEP), index as u32 / (SIZE / STEP)];
            let (x, y) = (first[0] + column * STEP, first[1] + row * STEP);
            let (hit, is_away_from_edges) = PixelRay::of_camera(&scene, x, y).cast(&caster);
            if hit.is_none() || !is_away_from_edges {
                continue;
            }
            pixels += 1;
            for band in 0..3 {
                let at = |layer: Layer| f64::from(values(layer)[3 * index + band]);
                let place = (y * SIZE + x) as usize;
                let variance =
                    at(Layer::StandardError).powi(2) + truth.standard_error[place][band].powi(2);
                let off = at(Layer::Indirect) - truth.indirect[place][band];
                scores.push(off / variance.sqrt());
                let expected = truth.direct[place][band];
                direct_off += (at(Layer::Direct) - expected).powi(2);
                direct_square += expected * expected;
            }
        }
    }
    let count = scores.len() as f64;
    let mean = scores.iter().sum::<f64>() / count;
    let variance = scores.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / count;
    let direct = (direct_off / direct_square).sqrt();
    println!(
        "{pixels} pixels: z has mean {mean:.3} and variance {variance:.3}; direct light is off by {direct:.1e}"
    );
    assert!(pixels > 3000);
    assert!(mean.abs() <= 0.05, "{mean}");
    assert!((variance - 1.0).abs() <= 0.1, "{variance}");
    // Includes shadow edges. The image's 16 bits round by 2e-4.
    assert!(direct <= 1e-3, "{direct:e}");
}
