//! Metrics against values worked out by hand, and the noise correction against known noise.

use crate::common::rows::assert_says;
use camlux::metrics::{Comparison, CorrectedRmse, Pixels, RelativeErrors, range_error_m};
use camlux::model::{Phasor, SPEED_OF_LIGHT_M_S};

/// Pixels of one channel, without noise or edges.
fn plain<'a>(image: &'a [f32], reference: &'a [f32], valid: &'a [bool]) -> Pixels<'a> {
    Pixels {
        image,
        reference,
        image_standard_error: None,
        reference_standard_error: None,
        valid,
        edges: None,
        channels: 1,
    }
}

/// The four pixels below, whose reference has these standard errors.
fn noisy(sigma: &[f32]) -> Pixels<'_> {
    Pixels {
        reference_standard_error: Some(sigma),
        ..plain(&IMAGE, &REFERENCE, &ALL)
    }
}

fn compare(pixels: &Pixels) -> Comparison {
    Comparison::new(pixels).expect("the slices fit")
}

/// Inputs are exact in f32 or have a relative rounding error of 2^-24; expected values have 7 digits.
#[track_caller]
fn assert_near(actual: f64, expected: f64) {
    assert!(
        (actual - expected).abs() <= 1e-6 * expected.abs().max(1e-3),
        "{actual} is not {expected}"
    );
}

// d = x − t = 0.5, 0, −1, 1; Σd² = 2.25, Σt² = 25, Σx = 9.5, Σt = 9.
const IMAGE: [f32; 4] = [1.5, 2.0, 1.0, 5.0];
const REFERENCE: [f32; 4] = [1.0, 2.0, 2.0, 4.0];
const ALL: [bool; 4] = [true; 4];

#[test]
fn errors_of_four_pixels() {
    let comparison = compare(&plain(&IMAGE, &REFERENCE, &ALL));
    assert_eq!(comparison.value_count, 4);
    assert_eq!(comparison.image_mean, 9.5 / 4.0);
    assert_eq!(comparison.reference_mean, 2.25);
    let errors = comparison.errors.unwrap();
    // sqrt(2.25/25), 9.5/9 − 1, 2.5/9.
    assert_near(errors.rmse, 0.3);
    assert_near(errors.bias, 0.5 / 9.0);
    assert_near(errors.mean_absolute, 2.5 / 9.0);
    // |d|/(t + 0.01·2.25) = 0.489, 0, 0.4944, 0.2486: 99 % of 4 values are all of them.
    assert_near(errors.percentile_99, 1.0 / 2.0225);
    assert_eq!(comparison.noise, None);
    assert_eq!(comparison.z_scores, None);
}

/// Edge pixels are only counted, whatever their values.
#[test]
fn edges_count_for_nothing_but_their_number() {
    let image = [1.5, 2.0, f32::NAN, 1.0, 5.0, 7.0];
    let reference = [1.0, 2.0, 9.0, 2.0, 4.0, f32::INFINITY];
    let sigma = [0.1, 0.2, 3.0, 0.2, 0.4, f32::NAN];
    let valid = [true, true, true, true, true, false];
    let edges = [false, false, true, false, false, true];
    let masked = Pixels {
        reference_standard_error: Some(&sigma),
        edges: Some(&edges),
        ..plain(&image, &reference, &valid)
    };
    let without = [0.1, 0.2, 0.2, 0.4];
    let expected = compare(&noisy(&without));
    assert_eq!(expected.edge_pixels, 0);
    let found = compare(&masked);
    assert_eq!(found.edge_pixels, 1, "the other shows no surface");
    let comparison = Comparison {
        edge_pixels: 0,
        ..found
    };
    assert_eq!(comparison, expected);

    // With the edge pixels.
    let comparison = compare(&Pixels {
        edges: None,
        ..masked
    });
    assert_eq!(
        [comparison.non_finite_image, comparison.edge_pixels],
        [1, 0]
    );

    let short = Pixels {
        edges: Some(&edges[..5]),
        ..masked
    };
    let refused = Comparison::new(&short).expect_err("there are six pixels");
    assert_says(&refused.to_string(), &["5 pixels instead of 6"]);
}

#[test]
fn percentile_leaves_out_one_in_a_hundred() {
    // 200 pixels of 1: two are far off and one is off by half. The 198th of 200 errors is the third largest.
    let reference = [1.0; 200];
    let mut image = reference;
    image[3] = 9.0;
    image[77] = 5.0;
    image[199] = 1.5;
    let errors = compare(&plain(&image, &reference, &[true; 200]))
        .errors
        .unwrap();
    assert_near(errors.percentile_99, 0.5 / 1.01);
}

#[test]
fn the_noise_hides_an_error() {
    let sigma = [0.1, 0.2, 0.2, 0.4];
    let comparison = compare(&noisy(&sigma));
    let noise = comparison.noise.unwrap();
    // Σσ² = 0.25, Σσ = 0.9.
    assert_near(noise.floor, 0.1);
    assert_near(noise.bias_standard_error, 9.5 / 9.0 * 0.5 / 9.0);
    assert_near(
        noise.mean_absolute_floor,
        (2.0 / std::f64::consts::PI).sqrt() * 0.1,
    );
    // R² = (2.25 − 0.25)/(25 − 0.25) = 0.0808081. σu = 0.0580808, 0.0323232, −0.1676768, 0.5292929, squared and summed
    // 0.3126847; variance (4·0.3126847 − 2·0.9191919²·Σσ⁴)/24.75² with Σσ⁴ = 0.0289, its root 0.0442955: R² is less than
    // twice that.
    let CorrectedRmse::Below(bound) = noise.rmse else {
        panic!("{:?}", noise.rmse);
    };
    assert_near(bound, (0.080_808_08_f64 + 2.0 * 0.044_295_48).sqrt());
    // z = 5, 0, −5, 2.5: mean 0.625, squares about it 19.140625 + 0.390625 + 31.640625 + 3.515625.
    let scores = comparison.z_scores.unwrap();
    assert_near(scores.mean, 0.625);
    assert_near(scores.variance, 54.6875 / 3.0);
    // About 0: the squares of 5, 0, −5 and 2.5.
    assert_near(scores.deviation(), (56.25_f64 / 4.0).sqrt());
}

#[test]
fn an_error_over_the_noise_is_an_estimate() {
    let sigma = [0.01, 0.02, 0.02, 0.04];
    // As above with Σσ² = 0.0025: R² = 2.2475/24.9975, variance (4·0.0032745884 − 2·0.9100910²·2.89e-6)/24.9975².
    let CorrectedRmse::Estimate {
        value,
        standard_error,
    } = compare(&noisy(&sigma)).noise.unwrap().rmse
    else {
        panic!("over the noise");
    };
    assert_near(value, (2.2475_f64 / 24.9975).sqrt());
    assert_near(standard_error, 0.007_633_098_042);
}

#[test]
fn both_images_have_noise_and_bands_share_it() {
    // Two pixels of two bands. d = 2, 1, −3, 4: Σd² = 30; Σt² = 3000; Σσ² = Στ² = 0.3.
    let reference = [10.0, 20.0, 30.0, 40.0];
    let image = [12.0, 21.0, 27.0, 44.0];
    let sigma = [0.1, 0.2, 0.3, 0.4];
    let tau = [0.2, 0.1, 0.4, 0.3];
    let pixels = Pixels {
        image: &image,
        reference: &reference,
        image_standard_error: Some(&tau),
        reference_standard_error: Some(&sigma),
        valid: &[true, true],
        edges: None,
        channels: 2,
    };
    let comparison = compare(&pixels);
    let noise = comparison.noise.unwrap();
    assert_near(noise.floor, (0.6_f64 / 3000.0).sqrt());
    // Στ = 0.3, 0.7 and Σσ = 0.3, 0.7 in the two pixels; Σx/Σt = 104/100.
    let bias_variance: f64 = (0.09 + 0.49) * (1.0 + 1.04 * 1.04);
    assert_near(noise.bias_standard_error, bias_variance.sqrt() / 100.0);
    // R² = 29.4/2999.7.
    let CorrectedRmse::Estimate {
        value,
        standard_error,
    } = noise.rmse
    else {
        panic!("{:?}", noise.rmse);
    };
    assert_near(value, (29.4_f64 / 2999.7).sqrt());
    // Pixel 1: Σσu = 0.4 + R²·5, Στd = 0.5; pixel 2: 0.7 + R²·25, 0; Σσ² = Στ² = 0.05, 0.25, Σστ = 0.04, 0.24.
    let share = 29.4 / 2999.7;
    let linear: f64 =
        4.0 * ((0.4_f64 + share * 5.0).powi(2) + (0.7_f64 + share * 25.0).powi(2) + 0.25);
    let quadratic = 2.0 * ((1.0_f64 - share).powi(2) + 1.0) * (0.05 * 0.05 + 0.25 * 0.25)
        + 4.0 * (0.04 * 0.04 + 0.24 * 0.24);
    assert_near(
        standard_error,
        (linear - quadratic).sqrt() / 2999.7 / (2.0 * value),
    );
    // d/sqrt(σ²+τ²) = 2/sqrt(0.05), 1/sqrt(0.05), −3/0.5, 4/0.5.
    assert_near(
        comparison.z_scores.unwrap().mean,
        (3.0 / 0.05_f64.sqrt() + 2.0) / 4.0,
    );
}

#[test]
fn what_is_no_number_is_counted_and_left_out() {
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let image = [nan, 2.0, 1.0, 5.0, inf, 1.0];
    let reference = [1.0, 2.0, 2.0, 4.0, nan, -inf];
    let mut sigma = [0.0; 6];
    let valid = [true, true, true, true, true, true];
    let mut pixels = plain(&image, &reference, &valid);
    let comparison = compare(&pixels);
    assert_eq!(comparison.value_count, 3);
    assert_eq!(
        (comparison.non_finite_image, comparison.non_finite_reference),
        (2, 2)
    );
    // d = 0, −1, 1 and t = 2, 2, 4.
    assert_near(comparison.errors.unwrap().rmse, (2.0_f64 / 24.0).sqrt());

    // An invalid standard error excludes its value, too.
    sigma[1] = nan;
    sigma[2] = -0.1;
    pixels.reference_standard_error = Some(&sigma);
    let comparison = compare(&pixels);
    assert_eq!(comparison.value_count, 1);
    assert_eq!(
        (comparison.non_finite_image, comparison.non_finite_reference),
        (2, 4)
    );

    // A NaN in an invalid pixel is not counted.
    let valid = [false, true, true, true, false, false];
    let comparison = compare(&plain(&image, &reference, &valid));
    assert_eq!(comparison.value_count, 3);
    assert_eq!(
        (comparison.non_finite_image, comparison.non_finite_reference),
        (0, 0)
    );
}

#[test]
fn nothing_to_be_relative_to_is_no_number() {
    let black = [0.0; 4];
    let sigma = [0.1; 4];
    for (image, reference, valid) in [
        (IMAGE, black, ALL),
        (IMAGE, REFERENCE, [false; 4]),
        (black, black, ALL),
    ] {
        let pixels = Pixels {
            reference_standard_error: Some(&sigma),
            ..plain(&image, &reference, &valid)
        };
        let comparison = compare(&pixels);
        assert_eq!(comparison.errors, None);
        assert_eq!(comparison.noise, None);
        assert!(comparison.image_mean.is_finite() && comparison.reference_mean.is_finite());
    }
    let comparison = compare(&plain(&IMAGE, &black, &ALL));
    assert_eq!(
        comparison.image_mean,
        9.5 / 4.0,
        "what is said of a black reference"
    );
    assert_eq!(compare(&plain(&[], &[], &[])).value_count, 0);
}

#[test]
fn black_pixels_of_a_reference_count() {
    // t = 0, 2: d = 1, 0. |d|/(t + 0.01·1) = 100.
    let errors = compare(&plain(&[1.0, 2.0], &[0.0, 2.0], &[true; 2]))
        .errors
        .unwrap();
    assert_eq!(
        errors,
        RelativeErrors {
            rmse: 0.5,
            bias: 0.5,
            mean_absolute: 0.5,
            percentile_99: 100.0,
        }
    );
}

#[test]
fn equal_images_have_no_error_and_no_noise_where_none_is_given() {
    let zero = [0.0; 4];
    let pixels = Pixels {
        reference_standard_error: Some(&zero),
        ..plain(&REFERENCE, &REFERENCE, &ALL)
    };
    let comparison = compare(&pixels);
    assert_eq!(comparison.errors.unwrap().rmse, 0.0);
    let none = CorrectedRmse::Estimate {
        value: 0.0,
        standard_error: 0.0,
    };
    assert_eq!(comparison.noise.unwrap().rmse, none);
    assert_eq!(comparison.z_scores, None);
}

#[test]
fn a_reference_of_noise_supports_no_claim() {
    let sigma = [3.0; 4];
    // Σt² − Σσ² = 25 − 36.
    assert_eq!(
        compare(&noisy(&sigma)).noise.unwrap().rmse,
        CorrectedRmse::ReferenceIsNoise
    );
}

#[test]
fn slices_that_do_not_fit_are_refused() {
    let three = [1.0; 3];
    for (pixels, name) in [
        (plain(&three, &REFERENCE, &ALL), "the image has 3"),
        (plain(&IMAGE, &three, &ALL), "the reference has 3"),
        (noisy(&three), "the reference's standard error has 3"),
        (
            Pixels {
                channels: usize::MAX,
                ..plain(&IMAGE, &REFERENCE, &ALL)
            },
            "the image has 4",
        ),
    ] {
        let message = Comparison::new(&pixels).unwrap_err().to_string();
        assert!(message.contains(name), "{message}");
    }
}

/// Normally distributed numbers (Box–Muller).
struct Normal(fastrand::Rng);

impl Normal {
    fn new(seed: u64) -> Self {
        Normal(fastrand::Rng::with_seed(seed))
    }

    fn draw(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.0.f64()).ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * self.0.f64()).cos()
    }
}

const BANDS: usize = 3;
const PIXELS: usize = 1200;

/// An experiment with known values: the true reference is 1 to 3, the true image `1 + error` times that on average, with more error in
/// the first half.
struct Experiment {
    error: f64,
    /// Relative standard errors.
    reference_noise: f64,
    image_noise: f64,
}

impl Experiment {
    fn truth(index: usize) -> f64 {
        1.0 + (index % 41) as f64 / 20.0
    }

    fn true_image(&self, index: usize) -> f64 {
        let weight = if index < PIXELS * BANDS / 2 { 1.5 } else { 0.5 };
        Self::truth(index) * (1.0 + weight * self.error)
    }

    /// sqrt(ΣE²/ΣT²) of the true values.
    fn true_rmse(&self) -> f64 {
        let indices = 0..PIXELS * BANDS;
        let error: f64 = indices
            .clone()
            .map(|i| (self.true_image(i) - Self::truth(i)).powi(2))
            .sum();
        (error / indices.map(|i| Self::truth(i).powi(2)).sum::<f64>()).sqrt()
    }

    /// One draw of the noise, which the bands of a pixel share.
    fn compare(&self, normal: &mut Normal) -> Comparison {
        let [mut image, mut reference, mut tau, mut sigma] = [const { Vec::<f32>::new() }; 4];
        for pixel in 0..PIXELS {
            let (z, w) = (normal.draw(), normal.draw());
            for index in pixel * BANDS..(pixel + 1) * BANDS {
                let (s, t) = (
                    self.reference_noise * Self::truth(index),
                    self.image_noise * self.true_image(index),
                );
                reference.push((Self::truth(index) + s * z) as f32);
                image.push((self.true_image(index) + t * w) as f32);
                sigma.push(s as f32);
                tau.push(t as f32);
            }
        }
        compare(&Pixels {
            image: &image,
            reference: &reference,
            image_standard_error: (self.image_noise > 0.0).then_some(&tau),
            reference_standard_error: Some(&sigma),
            valid: &[true; PIXELS],
            edges: None,
            channels: BANDS,
        })
    }
}

/// Errors are two thirds of the noise to many times the noise, with and without noise in the image. The corrected value is the true
/// error within its own standard error, and that standard error matches the actual scatter.
#[test]
fn correction_finds_the_error_under_the_noise() {
    const DRAWS: usize = 300;
    for (error, reference_noise, image_noise) in [
        (0.06, 0.1, 0.0),
        (0.05, 0.05, 0.05),
        (-0.8, 0.05, 0.0),
        (0.3, 0.02, 0.1),
    ] {
        let experiment = Experiment {
            error,
            reference_noise,
            image_noise,
        };
        let mut normal = Normal::new(1);
        let mut values = Vec::new();
        let mut claimed = 0.0;
        for _ in 0..DRAWS {
            let noise = experiment.compare(&mut normal).noise.unwrap();
            let CorrectedRmse::Estimate {
                value,
                standard_error,
            } = noise.rmse
            else {
                panic!("{error}: {:?}", noise.rmse);
            };
            values.push(value);
            claimed += standard_error / DRAWS as f64;
        }
        let mean = values.iter().sum::<f64>() / DRAWS as f64;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let scatter = (squares / (DRAWS - 1) as f64).sqrt();
        let truth = experiment.true_rmse();
        println!("true {truth:.5}, mean {mean:.5}, scatter {scatter:.6}, claimed {claimed:.6}");
        // The mean of 300 draws is off by four of its standard errors once in 16 000 such tests. The root of an unbiased
        // square is low by scatter²/(2·value).
        let slack = 4.0 * scatter / (DRAWS as f64).sqrt() + scatter.powi(2) / truth;
        assert!(
            (mean - truth).abs() < slack,
            "{mean} is not {truth} within {slack}"
        );
        // The scatter of 300 draws is known to 1/sqrt(600) = 4 %.
        assert!(
            (claimed / scatter - 1.0).abs() < 0.16,
            "claimed {claimed}, found {scatter}"
        );
    }
}

/// Without an error, only the 2.3 % of draws beyond two standard errors claim one. The z-scores are normally distributed.
#[test]
fn noise_alone_is_no_error() {
    const DRAWS: usize = 400;
    let experiment = Experiment {
        error: 0.0,
        reference_noise: 0.1,
        image_noise: 0.05,
    };
    let mut normal = Normal::new(2);
    let mut claims = 0;
    for _ in 0..DRAWS {
        let comparison = experiment.compare(&mut normal);
        let noise = comparison.noise.unwrap();
        match noise.rmse {
            CorrectedRmse::Below(bound) => assert!(bound < noise.floor, "{bound}"),
            CorrectedRmse::Estimate { .. } => claims += 1,
            CorrectedRmse::ReferenceIsNoise => panic!("there is light"),
        }
        let errors = comparison.errors.unwrap();
        // Means of 1200 normally distributed numbers: 5 standard errors. |d| scatters by 0.76 of its mean.
        assert!((errors.mean_absolute / noise.mean_absolute_floor - 1.0).abs() < 5.0 * 0.76 / 34.6);
        assert!(
            errors.bias.abs() < 5.0 * noise.bias_standard_error,
            "{}",
            errors.bias
        );
        let scores = comparison.z_scores.unwrap();
        assert_eq!(scores.value_count, PIXELS * BANDS);
        assert!(scores.mean.abs() < 5.0 / 34.6, "{}", scores.mean);
        assert!(
            (scores.variance - 1.0).abs() < 5.0 * 2.0_f64.sqrt() / 34.6,
            "{}",
            scores.variance
        );
    }
    println!("{claims} claims of {DRAWS}");
    // 9 are expected; a binomial count of that mean is over 24 once in 10^5.
    assert!(claims < 24, "{claims}");
}

/// At c/(4π) Hz, a radian is a metre.
const METRE_PER_RADIAN_HZ: f64 = SPEED_OF_LIGHT_M_S / (4.0 * std::f64::consts::PI);

#[test]
fn range_errors_are_differences_of_phase() {
    let values = |phasors: &[(f64, f64)]| -> Vec<f32> {
        let phasors = phasors
            .iter()
            .map(|&(magnitude, angle)| Phasor::of_angle(angle) * magnitude);
        phasors.flat_map(|z| [z.re as f32, z.im as f32]).collect()
    };
    // The third is too weak to count, and the last is left out.
    let due = values(&[(3.0, 1.0), (4.0, 3.1), (0.01, 0.0), (5.0, 0.0)]);
    let found = values(&[(1.0, 1.3), (8.0, -3.1), (5.0, 2.0), (5.0, 1.0)]);
    let counts = |pixel| pixel != 3;
    let exact = [0.0; 8];
    let error_m = range_error_m(&found, &due, &exact, METRE_PER_RADIAN_HZ, counts);
    // The second wraps.
    let wrapped: f64 = std::f64::consts::TAU - 6.2;
    assert_near(error_m, ((0.09 + wrapped.powi(2)) / 2.0).sqrt());
    // Noise along Z turns nothing; noise across it by 0.1 of |Z| explains 0.1 m.
    let due = values(&[(2.0, 0.0); 2]);
    let found = values(&[(2.0, 0.2), (2.0, -0.2)]);
    let error_m = |noise: [f32; 2]| {
        let noise = [noise; 2].concat();
        range_error_m(&found, &due, &noise, METRE_PER_RADIAN_HZ, |_| true)
    };
    assert_near(error_m([0.2, 0.0]), 0.2);
    assert_near(error_m([0.0, 0.2]), 0.03_f64.sqrt());
    assert_eq!(error_m([0.0, 0.6]), 0.0);
}
