//! Errors of the range that phasors give.

use std::f64::consts::PI;

use camlux::model::{Phasor, SPEED_OF_LIGHT_M_S, multipath_error_m};

/// Median and 99th percentile, metres.
pub type RangeErrors = [f64; 2];

/// Median and 99th percentile, metres, over the counted pixels that have a range in both images, without unwrapping. `None` if there are
/// none. Pixels are re and im of Z.
pub fn range_errors_m(
    image: &[f32],
    reference: &[f32],
    frequency_hz: f64,
    counts: impl Fn(usize) -> bool,
) -> Option<RangeErrors> {
    let ((image, _), (reference, _)) = (image.as_chunks::<2>(), reference.as_chunks::<2>());
    let phasor = |&[re, im]: &[f32; 2]| Phasor {
        re: re.into(),
        im: im.into(),
    };
    let pixels = image.iter().zip(reference).enumerate();
    let errors_m = pixels
        .filter(|(pixel, _)| counts(*pixel))
        .filter_map(|(_, (found, due))| {
            multipath_error_m(phasor(found), phasor(due), frequency_hz).map(f64::abs)
        });
    median_and_99(errors_m.collect())
}

/// [`range_errors_m`] of an image without error, caused by the reference's noise alone. Pixels are re and im of Z, and of its standard
/// error.
pub fn range_noise_m(
    reference: &[f32],
    standard_error: &[f32],
    frequency_hz: f64,
    counts: impl Fn(usize) -> bool,
) -> Option<RangeErrors> {
    let (reference, deviations) = (
        reference.as_chunks::<2>().0,
        standard_error.as_chunks::<2>().0,
    );
    let metres_per_rad = SPEED_OF_LIGHT_M_S / (4.0 * PI * frequency_hz);
    let pixels = reference.iter().zip(deviations).enumerate();
    let deviations_m =
        pixels
            .filter(|(pixel, _)| counts(*pixel))
            .filter_map(|(_, (z, deviation))| {
                let [re, im] = z.map(f64::from);
                let [of_re, of_im] = deviation.map(f64::from);
                let deviation_rad = (im * of_re).hypot(re * of_im) / (re * re + im * im);
                deviation_rad
                    .is_finite()
                    .then_some(deviation_rad * metres_per_rad)
            });
    let errors_m = deviations_m.enumerate().map(|(i, m)| normal(i).abs() * m);
    median_and_99(errors_m.collect())
}

/// Numbers of a normal distribution, spread evenly over it: the Box-Muller transform of the sequence R2.
fn normal(index: usize) -> f64 {
    let [u, v] = [0.754_877_666_246_693, 0.569_840_290_998_053]
        .map(|step| (0.5 + step * index as f64).fract());
    (-2.0 * (1.0 - u).ln()).sqrt() * (2.0 * PI * v).cos()
}

fn median_and_99(mut errors_m: Vec<f64>) -> Option<RangeErrors> {
    errors_m.sort_by(f64::total_cmp);
    let rank = |share: f64| ((errors_m.len() as f64 * share).ceil() as usize).max(1) - 1;
    Some([*errors_m.get(rank(0.5))?, *errors_m.get(rank(0.99))?])
}
