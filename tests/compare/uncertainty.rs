//! The uncertainty that a comparison states, tested with many references: a stated standard error must cover the true value at the
//! rate of a normal distribution.

use crate::common::gpu::demo_scene;
use crate::common::reference_frame::{add_rounds, values};
use camlux::{
    Scene,
    metrics::{Comparison, CorrectedRmse, Pixels, ZScores},
    output::{Frame, Layer},
    reference::Reference,
};

/// Seeds of the references that an image is compared with.
const SEEDS: std::ops::Range<u16> = 1..161;

fn sampled(scene: &Scene, samples_per_round: u32, rounds: u32, seed: u16) -> Frame {
    let reference = Reference::new(scene, samples_per_round).expect("the scene is valid");
    let mut reference = reference.with_seed(seed);
    add_rounds(&mut reference, rounds);
    reference.frame()
}

fn compare(image: &[f32], reference: &Frame) -> Comparison {
    let seen = reference.ids(Layer::InstanceId).expect("it is there");
    let valid: Vec<bool> = seen.iter().map(|&id| id != 0).collect();
    let pixels = Pixels {
        image,
        reference: values(reference, Layer::Indirect),
        image_standard_error: None,
        reference_standard_error: Some(values(reference, Layer::StandardError)),
        valid: &valid,
        edges: None,
        channels: 3,
    };
    Comparison::new(&pixels).expect("images of one size")
}

/// Results of the comparisons with all seeds, as shares of the seeds.
#[derive(Debug, Default)]
struct Coverage {
    /// The true error is within one and within two stated standard errors, as shares of the estimates.
    within_one: f64,
    within_two: f64,
    /// Comparisons that state a value and a standard error.
    estimates: f64,
    /// Comparisons that state an upper bound below the true error.
    over_bound: f64,
    /// The true bias is within two stated standard errors.
    bias_within_two: f64,
    /// Mean over the seeds of the z-scores' variance.
    z_variance: f64,
}

/// Compares an image with each reference. It differs from the ground truth by ±`share` in alternating pixels, plus a third of `share` everywhere.
fn coverage(references: &[Frame], truth: &Frame, share: f64) -> Coverage {
    let truth = values(truth, Layer::Indirect);
    let pixels = truth.chunks_exact(3).enumerate();
    let image: Vec<f32> = pixels
        .flat_map(|(index, bands)| {
            let sign = if index % 2 == 0 { 1.0 } else { -1.0 };
            let factor = 1.0 + share * (sign + 1.0 / 3.0);
            [bands[0], bands[1], bands[2]].map(|band| (f64::from(band) * factor) as f32)
        })
        .collect();
    let sum = |term: &dyn Fn(f64, f64) -> f64| -> f64 {
        let pairs = image.iter().zip(truth);
        pairs.map(|(&x, &t)| term(x.into(), t.into())).sum()
    };
    let true_error = (sum(&|x, t| (x - t).powi(2)) / sum(&|_, t| t * t)).sqrt();
    let true_bias = sum(&|x, _| x) / sum(&|_, t| t) - 1.0;
    let mut found = Coverage::default();
    for reference in references {
        let comparison = compare(&image, reference);
        let noise = comparison.noise.expect("there is light");
        match noise.rmse {
            CorrectedRmse::Estimate {
                value,
                standard_error,
            } => {
                let off = (value - true_error).abs() / standard_error;
                found.estimates += 1.0;
                found.within_one += f64::from(off <= 1.0);
                found.within_two += f64::from(off <= 2.0);
            }
            CorrectedRmse::Below(bound) => found.over_bound += f64::from(true_error > bound),
            CorrectedRmse::ReferenceIsNoise => panic!("there is light beyond the noise"),
        }
        let bias = comparison.errors.expect("there is light").bias;
        let off = (bias - true_bias).abs() / noise.bias_standard_error;
        found.bias_within_two += f64::from(off <= 2.0);
        let ZScores { variance, .. } = comparison.z_scores.expect("there is noise");
        found.z_variance += variance;
    }
    let count = references.len() as f64;
    found.within_one /= found.estimates;
    found.within_two /= found.estimates;
    for share in [
        &mut found.estimates,
        &mut found.over_bound,
        &mut found.bias_within_two,
        &mut found.z_variance,
    ] {
        *share /= count;
    }
    found
}

/// Where noise nearly hides the error, only seeds whose noise raises it state a value. If fewer than half of the seeds do, their values are not
/// checked. A normal distribution covers 68 % and 95 %; over 160 draws these shares scatter by 3.7 % and 1.7 %.
#[track_caller]
fn check(what: &str, found: &Coverage) {
    println!("{what}: {found:.3?}");
    assert!(found.over_bound <= 0.06, "{what}: bounds that do not hold");
    if found.estimates >= 0.5 {
        assert!((0.57..=0.80).contains(&found.within_one), "{what}");
        assert!(found.within_two >= 0.90, "{what}");
    }
    assert!(found.bias_within_two >= 0.90, "{what}: bias");
}

/// Noise of about 7 % per pixel, and errors from far above to below what 576 pixels can show.
#[test]
fn the_stated_uncertainty_covers_as_often_as_it_says() {
    let scene = demo_scene("cornell", [24, 24]);
    let truth = sampled(&scene, 1024, 16, 0);
    let references = SEEDS.map(|seed| sampled(&scene, 16, 8, seed));
    let references: Vec<Frame> = references.collect();
    for share in [0.3, 0.1, 0.03] {
        let found = coverage(&references, &truth, share);
        check(&format!("cornell, off by {share}"), &found);
    }
}

/// Few samples find the light, so most rounds of a pixel agree on a value that is too low.
#[test]
fn no_standard_error_is_nothing_by_chance() {
    let scene = demo_scene("slit", [16, 16]);
    let image = sampled(&scene, 64, 8, 1);
    let reference = sampled(&scene, 64, 8, 2);
    let pairs = values(&image, Layer::Indirect)
        .iter()
        .zip(values(&reference, Layer::Indirect));
    let errors = values(&image, Layer::StandardError)
        .iter()
        .zip(values(&reference, Layer::StandardError));
    let scores = pairs.zip(errors).map(|((&x, &t), (&tau, &sigma))| {
        let [x, t, tau, sigma] = [x, t, tau, sigma].map(f64::from);
        (x - t).abs() / tau.hypot(sigma)
    });
    let scores: Vec<f64> = scores.filter(|score| !score.is_nan()).collect();
    let largest = scores.iter().fold(0.0, |most: f64, &score| most.max(score));
    let variance = scores.iter().map(|score| score * score).sum::<f64>() / scores.len() as f64;
    println!("z-scores: variance {variance:.2}, largest {largest:.1}");
    assert!(scores.len() > 600);
    assert!((0.7..=1.6).contains(&variance), "{variance}");
    assert!(largest <= 8.0, "{largest}");
}
