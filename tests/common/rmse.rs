//! The error of an image with three bands against a reference without noise.

use camlux::metrics::{Comparison, Pixels};
use camlux::scene::Bands;

/// sqrt(Σ(x−t)²/Σt²) over all pixels and bands. Fails for a black reference and for values that are not finite.
pub fn relative_rmse(image: &[f32], truth: &[Bands]) -> f64 {
    let comparison = Comparison::new(&Pixels {
        image,
        reference: truth.as_flattened(),
        image_standard_error: None,
        reference_standard_error: None,
        valid: &vec![true; truth.len()],
        edges: None,
        channels: 3,
    });
    let comparison = comparison.expect("images of one size");
    assert_eq!(comparison.value_count, 3 * truth.len(), "all are finite");
    comparison.errors.expect("the truth is not black").rmse
}

/// The same over the pixels that `counts` selects.
pub fn relative_rmse_where(image: &[f32], truth: &[f32], counts: impl Fn(usize) -> bool) -> f64 {
    let pixels = image.chunks(3).zip(truth.chunks(3)).enumerate();
    let (image, truth): (Vec<&[f32]>, Vec<Bands>) = pixels
        .filter(|&(pixel, _)| counts(pixel))
        .map(|(_, (x, t))| (x, [0, 1, 2].map(|band| t[band].into())))
        .unzip();
    relative_rmse(&image.concat(), &truth)
}
