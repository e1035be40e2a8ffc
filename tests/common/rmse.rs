//! The error of an image with three bands against values without noise.

use camlux::metrics::{Comparison, Pixels};
use camlux::scene::Bands;

/// sqrt(Σ(x−t)²/Σt²) over all pixels and bands. Fails for a black truth and for values that are no finite numbers.
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
