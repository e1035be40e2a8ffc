//! Sums of many terms: in another order, in other pieces, and with bands of other sizes beside each other.

use std::time::Duration;

use glam::DVec3;

use super::{
    Case, Examiner, Measurement,
    examiner::{KERNEL_BOUND, bands_of, error_of, values},
    scenes::{GLOSSY, amplified, lit_by, point_light, room, spot_light, with_rays, with_sum},
};
use crate::{
    GatherKernel, RenderOptions, Renderer, Result, Scene,
    output::{ExrOptions, Frame, Layer, LayeredImage, OutputFile, write_exr},
    scene::{Bands, VplSum},
};

/// What the order of a sum may change: that was asked of the engine.
const SPREAD: f64 = 1e-6;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "vpls_shuffled",
        hazard: "f32 sums depend on the order of their terms, and RSMs bring large ones side by side",
        remedy: "sums of three levels: tile, dispatch, image",
        is_short: true,
        known_issue: None,
        run: vpls_shuffled,
    },
    Case {
        name: "lights_in_another_order",
        hazard: "f32 sums depend on the order of their terms, the more so the more terms",
        remedy: "sums of three levels: tile, dispatch, image",
        is_short: true,
        known_issue: None,
        run: lights_in_another_order,
    },
    Case {
        name: "one_light_as_sixteen",
        hazard: "sixteen small sums on top of each other in place of one",
        remedy: "the image's sum has few terms, and each is a sum of its own",
        is_short: true,
        known_issue: None,
        run: one_light_as_sixteen,
    },
    Case {
        name: "tiles_of_every_size",
        hazard: "kernels that fetch VPLs in fours, eights or sixty-fours add them in other groups",
        remedy: "tiles of 256 VPLs in all of them",
        is_short: true,
        known_issue: None,
        run: tiles_of_every_size,
    },
    Case {
        name: "submissions_of_every_length",
        hazard: "how fast the device is decides where the gather is cut, and so how sums round",
        remedy: "cuts fall between tiles, whose sums do not depend on them",
        is_short: true,
        known_issue: None,
        run: submissions_of_every_length,
    },
    Case {
        name: "dim_band_beside_a_bright_one",
        hazard: "a band of 1e-9 of another one loses its digits where both share a sum, a threshold or an error",
        remedy: "bands share weights and draws, and no sum",
        is_short: true,
        known_issue: None,
        run: dim_band,
    },
    Case {
        name: "half_floats_saturate_and_say_so",
        hazard: "radiance over 65 504 becomes infinite in 16 bits, and below 6e-8 it becomes 0, in silence",
        remedy: "what is over is stored as 65 504, and a warning counts what is lost",
        is_short: true,
        known_issue: None,
        run: half_floats,
    },
];

/// The room with a glossy box under three lights of different strength.
fn room_of_three_lights() -> Scene {
    let mut scene = room();
    let material = &mut scene.meshes[2].triangle_materials;
    material.fill(GLOSSY);
    let light = |x: f64, z: f64, strength: f64| {
        amplified(point_light(DVec3::new(x, 0.6, z)), [strength; 3])
    };
    let spot = spot_light(
        DVec3::new(-0.7, 0.8, 0.6),
        DVec3::new(0.6, -1.0, -0.5),
        [20.0, 40.0],
    );
    scene.lights = vec![light(0.3, 0.2, 1.0), spot, light(-0.4, -0.1, 1e-3)];
    scene
}

/// relRMSE between two images of one scene's indirect light.
fn apart(examiner: &mut Examiner, one: &Scene, other: &Scene) -> Result<f64> {
    let truth = examiner.render(one)?;
    let frame = examiner.render(other)?;
    let truth = bands_of(values(&truth, Layer::Indirect), 1.0);
    Ok(error_of(values(&frame, Layer::Indirect), &truth))
}

/// On the device, between the passes that list and that gather them.
fn vpls_shuffled(examiner: &mut Examiner) -> Result<Measurement> {
    let ways = [None, Some(1), Some(2), Some(3)];
    let render = |renderer: &mut Renderer, scene: &Scene, seed: &Option<u64>| {
        let options = &mut RenderOptions::default();
        match *seed {
            None => renderer.render(scene, options),
            Some(seed) => renderer.render_shuffled(scene, options, seed),
        }
    };
    let shuffled = spread(examiner, ways, render, SPREAD)?;
    // A sum of some ten thousand terms in another order never is the same in every pixel.
    let unchanged = shuffled
        .parts
        .iter()
        .skip(2)
        .filter(|part| part.error == 0.0);
    let unchanged = Measurement::new("sums that no order changes", unchanged.count() as f64, 0.0);
    Ok(Measurement::of([shuffled, unchanged]))
}

fn lights_in_another_order(examiner: &mut Examiner) -> Result<Measurement> {
    let scene = room_of_three_lights();
    let mut lights = scene.lights.clone();
    lights.reverse();
    let reversed = lit_by(&scene, lights);
    let mut parts = Vec::new();
    for estimator in VplSum::ALL {
        let [one, other] = [&scene, &reversed].map(|scene| with_sum(scene, estimator, 48));
        let error = apart(examiner, &one, &other)?;
        parts.push(Measurement::new(estimator.name(), error, SPREAD));
    }
    Ok(Measurement::of(parts))
}

fn one_light_as_sixteen(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room_of_three_lights();
    scene.lights.truncate(1);
    let part = amplified(scene.lights[0], [1.0 / 16.0; 3]);
    let divided = lit_by(&scene, vec![part; 16]);
    let mut parts = Vec::new();
    for estimator in VplSum::ALL {
        let [one, other] = [&scene, &divided].map(|scene| with_sum(scene, estimator, 24));
        let error = apart(examiner, &one, &other)?;
        parts.push(Measurement::new(estimator.name(), error, SPREAD));
    }
    Ok(Measurement::of(parts))
}

/// The indirect light by each of some ways to render it, relative to the first.
fn spread<W: std::fmt::Debug>(
    examiner: &mut Examiner,
    ways: impl IntoIterator<Item = W>,
    render: impl Fn(&mut Renderer, &Scene, &W) -> Result<Frame>,
    bound: f64,
) -> Result<Measurement> {
    let scene = room_of_three_lights();
    let mut first: [Option<Vec<Bands>>; 2] = [None, None];
    let mut parts = Vec::new();
    for way in ways {
        for (estimator, first) in VplSum::ALL.into_iter().zip(&mut first) {
            let scene = with_sum(&scene, estimator, 48);
            let frame = render(&mut examiner.renderer, &scene, &way)?;
            let image = values(&frame, Layer::Indirect);
            let truth = first.get_or_insert_with(|| bands_of(image, 1.0));
            let what = format!("{way:?}, {}", estimator.name());
            parts.push(Measurement::new(what, error_of(image, truth), bound));
        }
    }
    Ok(Measurement::of(parts))
}

fn tiles_of_every_size(examiner: &mut Examiner) -> Result<Measurement> {
    let info = examiner.device.info().clone();
    let kernels = GatherKernel::ALL.into_iter();
    let kernels = kernels.filter(|kernel| kernel.runs_on(&info));
    let render = |renderer: &mut Renderer, scene: &Scene, kernel: &GatherKernel| {
        let mut options = RenderOptions {
            gather_kernel: Some(*kernel),
            ..RenderOptions::default()
        };
        renderer.render(scene, &mut options)
    };
    spread(examiner, kernels, render, SPREAD)
}

/// Bit for bit.
fn submissions_of_every_length(examiner: &mut Examiner) -> Result<Measurement> {
    let targets = [1, 10, 10_000].map(Duration::from_millis);
    let render = |renderer: &mut Renderer, scene: &Scene, target: &Duration| {
        let mut options = RenderOptions {
            submission_target: *target,
            ..RenderOptions::default()
        };
        renderer.render(scene, &mut options)
    };
    spread(examiner, targets, render, 0.0)
}

/// Grey surfaces under a light whose bands differ by 1e9 each way: every band is the same image, times its power.
fn dim_band(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    for material in &mut scene.materials {
        material.kd = [0.5; 3];
    }
    let powers = [1.0, 1e-9, 1e9];
    scene.lights = vec![amplified(scene.lights[0], powers)];
    let ways = [
        ("rsm-average", with_sum(&scene, VplSum::RsmAverage, 24)),
        (
            "instant-radiosity",
            with_sum(&scene, VplSum::InstantRadiosity, 24),
        ),
        ("final-gather", with_rays(&scene, 0.1)),
    ];
    let mut parts = Vec::new();
    for (what, scene) in ways {
        let frame = examiner.render(&scene)?;
        let pixels = bands_of(values(&frame, Layer::Radiance), 1.0);
        for band in 1..3 {
            // A band beside the first, both over their power: the power's own rounding to f32 and a few more.
            let of = |band: usize| pixels.iter().map(move |pixel| pixel[band] / powers[band]);
            let squares =
                |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>();
            let off = squares(&mut of(0).zip(of(band)).map(|(a, b)| a - b));
            let error = (off / squares(&mut of(0))).sqrt();
            let what = format!("{what}, band of {:.0e} W", powers[band]);
            parts.push(Measurement::new(what, error, KERNEL_BOUND));
        }
    }
    Ok(Measurement::of(parts))
}

/// Bands over, within and below what 16 bits hold, written and read again.
fn half_floats(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    scene.lights = vec![amplified(scene.lights[0], [1e9, 1.0, 1e-9])];
    let frame = examiner.render(&scene)?;
    let options = ExrOptions {
        half: true,
        layers: Some(vec![Layer::Direct]),
        ..ExrOptions::default()
    };
    let is_told = options.warnings(&frame).len() == 1;
    let path = std::env::temp_dir().join(format!("camlux-half-{}.exr", std::process::id()));
    write_exr(OutputFile::create(&path)?, &frame, &options)?;
    let read = LayeredImage::read(&path);
    // Nobody will miss it.
    let _ = std::fs::remove_file(&path);
    let read = read?;
    let stored = read.values(Layer::Direct).unwrap_or_default();
    let expected = values(&frame, Layer::Direct).iter().map(|v| v.min(65504.0));
    let off = stored.iter().zip(expected).map(|(&stored, expected)| {
        let apart = (f64::from(stored) - f64::from(expected)).abs();
        // Below 6e-5, 16 bits have steps of 6e-8 and no more.
        apart / f64::from(expected).max(6.2e-5)
    });
    let error = if stored.is_empty() {
        f64::INFINITY
    } else {
        off.fold(0.0, f64::max)
    };
    Ok(Measurement::of([
        Measurement::new("warnings that are missing", f64::from(!is_told), 0.0),
        // Eleven significant bits.
        Measurement::new("stored values", error, 1.0 / 2048.0),
    ]))
}
