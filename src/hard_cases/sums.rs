//! Sums of many terms: in another order, split into other pieces, and with bands of very different size.

use std::time::Duration;

use glam::dvec3;

use super::{
    Case, Examiner,
    examiner::{KERNEL_BOUND, error_of, largest, values},
    scenes::{
        GLOSSY, amplified, lit_by, point_light, room, spot_light, with_each_estimator, with_sum,
    },
};
use crate::{
    GatherKernel, RenderOptions, Renderer, Result, Scene,
    output::{ExrOptions, Frame, Layer, LayeredImage, OutputFile, write_exr},
    scene::VplSum,
};

/// The difference that the order of a sum may cause: a requirement on the engine.
const SPREAD: f64 = 1e-6;

pub const CASES: &[Case] = &[
    Case::new(
        "vpls_shuffled",
        "f32 sums depend on the order of their terms, and RSMs put large ones side by side",
        "sums of three levels: tile, dispatch, image",
        vpls_shuffled,
    ),
    Case::new(
        "lights_in_another_order",
        "f32 sums depend on the order of their terms, more so with more terms",
        "sums of three levels: tile, dispatch, image",
        lights_in_another_order,
    ),
    Case::new(
        "one_light_as_sixteen",
        "sixteen small sums are added in place of one",
        "the image's sum has few terms, and each is a sum of its own",
        one_light_as_sixteen,
    ),
    Case::new(
        "tiles_of_every_size",
        "kernels that fetch VPLs in fours, eights or sixty-fours add them in other groups",
        "all kernels use tiles of 256 VPLs",
        tiles_of_every_size,
    ),
    Case::new(
        "submissions_of_every_length",
        "the device's speed decides where the gather is cut, and so how sums round",
        "cuts are between tiles, whose sums do not depend on them",
        submissions_of_every_length,
    ),
    Case::new(
        "dim_band_beside_a_bright_one",
        "a band of 1e-9 of another loses its digits where both share a sum, a threshold or an error",
        "bands share weights and samples, but no sum",
        dim_band,
    ),
    Case::new(
        "half_floats_saturate_and_say_so",
        "in 16 bits, radiance over 65 504 becomes infinite and radiance below 6e-8 becomes 0, without notice",
        "larger values are stored as 65 504, and a warning counts the losses",
        half_floats,
    ),
];

/// The room with a glossy box under three lights of different strength.
fn room_of_three_lights() -> Scene {
    let mut scene = room();
    scene.meshes[2].triangle_materials.fill(GLOSSY);
    let light =
        |x: f64, z: f64, strength: f64| amplified(&point_light(dvec3(x, 0.6, z)), [strength; 3]);
    let (at, direction) = (dvec3(-0.7, 0.8, 0.6), dvec3(0.6, -1.0, -0.5));
    let spot = spot_light(at, direction, [20.0, 40.0]);
    lit_by(
        &scene,
        vec![light(0.3, 0.2, 1.0), spot, light(-0.4, -0.1, 1e-3)],
    )
}

/// Shuffles the VPLs on the device, after the pass that lists them and before the pass that gathers them.
fn vpls_shuffled(exam: &mut Examiner) -> Result<()> {
    let render = |renderer: &mut Renderer, scene: &Scene, seed: &Option<u64>| {
        let options = &mut RenderOptions::default();
        match *seed {
            None => renderer.render(scene, options),
            Some(seed) => renderer.render_shuffled(scene, options, seed),
        }
    };
    let name = |seed: &Option<_>| seed.map_or("in order".into(), |seed| format!("shuffle {seed}"));
    let seeds = [None, Some(1), Some(2), Some(3)];
    let errors = spread(exam, seeds, name, render, SPREAD)?;
    // A sum of some ten thousand terms in another order is never the same in every pixel.
    let unchanged = errors.iter().skip(2).filter(|&&error| error == 0.0).count();
    exam.record("", "sums unchanged by the order", unchanged as f64, 0.0);
    Ok(())
}

fn lights_in_another_order(exam: &mut Examiner) -> Result<()> {
    let scene = room_of_three_lights();
    let reversed: Vec<_> = scene.lights.iter().rev().cloned().collect();
    same_sums(exam, &scene, &lit_by(&scene, reversed), 48)
}

fn one_light_as_sixteen(exam: &mut Examiner) -> Result<()> {
    let mut scene = room_of_three_lights();
    scene.lights.truncate(1);
    let part = amplified(&scene.lights[0], [1.0 / 16.0; 3]);
    same_sums(exam, &scene, &lit_by(&scene, vec![part; 16]), 24)
}

/// Compares the sums of two scenes that differ only in the order of terms.
fn same_sums(exam: &mut Examiner, one: &Scene, other: &Scene, rsm_size: u32) -> Result<()> {
    for sum in VplSum::ALL {
        let [one, other] = [one, other].map(|scene| with_sum(scene, sum, rsm_size));
        let error = exam.apart([&one, &other])?;
        exam.record("", sum.name(), error, SPREAD);
    }
    Ok(())
}

/// The errors of the indirect light for several ways to render it, relative to the first way.
fn spread<W>(
    exam: &mut Examiner,
    ways: impl IntoIterator<Item = W>,
    name: impl Fn(&W) -> String,
    render: impl Fn(&mut Renderer, &Scene, &W) -> Result<Frame>,
    bound: f64,
) -> Result<Vec<f64>> {
    let scenes = VplSum::ALL.map(|sum| with_sum(&room_of_three_lights(), sum, 48));
    let mut first = VplSum::ALL.map(|_| None);
    let mut errors = Vec::new();
    for way in ways {
        for ((sum, scene), first) in VplSum::ALL.into_iter().zip(&scenes).zip(&mut first) {
            let frame = render(&mut exam.renderer, scene, &way)?;
            let image = values(&frame, Layer::Indirect);
            let error = error_of(image, first.get_or_insert_with(|| image.to_vec()));
            exam.record(&name(&way), sum.name(), error, bound);
            errors.push(error);
        }
    }
    Ok(errors)
}

fn tiles_of_every_size(exam: &mut Examiner) -> Result<()> {
    let info = exam.device.info().clone();
    let mut kernels = GatherKernel::ALL.to_vec();
    kernels.retain(|kernel| kernel.runs_on(&info));
    let render = |renderer: &mut Renderer, scene: &Scene, kernel: &GatherKernel| {
        let mut options = RenderOptions {
            gather_kernel: Some(*kernel),
            ..RenderOptions::default()
        };
        renderer.render(scene, &mut options)
    };
    let name = |kernel: &GatherKernel| kernel.name().into();
    spread(exam, kernels, name, render, SPREAD).map(drop)
}

/// The results must be equal bit for bit.
fn submissions_of_every_length(exam: &mut Examiner) -> Result<()> {
    let targets = [1, 10, 10_000].map(Duration::from_millis);
    let render = |renderer: &mut Renderer, scene: &Scene, target: &Duration| {
        let mut options = RenderOptions {
            submission_target: *target,
            ..RenderOptions::default()
        };
        renderer.render(scene, &mut options)
    };
    let name = |target: &Duration| format!("submissions of {} ms", target.as_millis());
    spread(exam, targets, name, render, 0.0).map(drop)
}

/// Grey surfaces under a light whose bands differ by factors of 1e9 up and down: every band must be the same image times its power.
fn dim_band(exam: &mut Examiner) -> Result<()> {
    let mut scene = room();
    for material in &mut scene.materials {
        material.kd = [0.5; 3];
    }
    let powers = [1.0, 1e-9, 1e9];
    scene.lights = vec![amplified(&scene.lights[0], powers).into()];
    for (estimator, scene) in with_each_estimator(&scene, 24, 0.1) {
        let frame = exam.render(&scene)?;
        let pixels = values(&frame, Layer::Radiance).as_chunks::<3>().0;
        for band in 1..3 {
            // Compares a band with the first band, each divided by its power. The power itself is rounded to f32, plus a few more
            // roundings.
            let (mut off, mut all) = (0.0, 0.0);
            for pixel in pixels {
                let [first, other] = [0, band].map(|band| f64::from(pixel[band]) / powers[band]);
                off += (first - other).powi(2);
                all += first.powi(2);
            }
            let quantity = format!("band of {:.0e} W", powers[band]);
            exam.record(estimator, &quantity, (off / all).sqrt(), KERNEL_BOUND);
        }
    }
    Ok(())
}

/// Bands above, within and below the range of 16-bit floats, written and read again.
fn half_floats(exam: &mut Examiner) -> Result<()> {
    let mut scene = room();
    scene.lights = vec![amplified(&scene.lights[0], [1e9, 1.0, 1e-9]).into()];
    let frame = exam.render(&scene)?;
    let options = ExrOptions {
        half: true,
        layers: Some(vec![Layer::Direct]),
        ..ExrOptions::default()
    };
    let is_told = options.warnings(&frame).len() == 1;
    exam.record("", "missing warnings", f64::from(!is_told), 0.0);
    let path = std::env::temp_dir().join(format!("camlux-half-{}.exr", std::process::id()));
    write_exr(OutputFile::create(&path)?, &frame, &options)?;
    let read = LayeredImage::read(&path);
    // A leftover file does no harm.
    let _ = std::fs::remove_file(&path);
    let read = read?;
    let stored = read.values(Layer::Direct).unwrap_or_default();
    let apart = stored
        .iter()
        .zip(values(&frame, Layer::Direct))
        .map(|(stored, value)| {
            let expected = value.min(65504.0);
            // Below 6e-5, 16-bit floats have a constant step of 6e-8.
            (stored - expected) / expected.max(6.2e-5)
        });
    let error = largest(&apart.collect::<Vec<_>>());
    // Eleven significant bits.
    exam.record("", "stored values", error, 1.0 / 2048.0);
    Ok(())
}
