//! How far off the range is that phasors tell.

use camlux::model::{Phasor, multipath_error_m};

/// The median and what 99 % are within, metres, of those pixels that count and have a range in both images, without unwrapping. `None`
/// where there are none. Pixels are re and im of Z.
pub fn range_errors_m(
    image: &[f32],
    reference: &[f32],
    frequency_hz: f64,
    counts: impl Fn(usize) -> bool,
) -> Option<[f64; 2]> {
    let ((image, _), (reference, _)) = (image.as_chunks::<2>(), reference.as_chunks::<2>());
    let phasor = |&[re, im]: &[f32; 2]| Phasor {
        re: re.into(),
        im: im.into(),
    };
    let pixels = image.iter().zip(reference).enumerate();
    let mut errors_m: Vec<f64> = pixels
        .filter(|(pixel, _)| counts(*pixel))
        .filter_map(|(_, (found, due))| {
            multipath_error_m(phasor(found), phasor(due), frequency_hz).map(f64::abs)
        })
        .collect();
    errors_m.sort_by(f64::total_cmp);
    let rank = |share: f64| ((errors_m.len() as f64 * share).ceil() as usize).max(1) - 1;
    Some([*errors_m.get(rank(0.5))?, *errors_m.get(rank(0.99))?])
}
