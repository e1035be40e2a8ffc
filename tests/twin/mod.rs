//! The frame's f64 twin of the library, and the error against it.

#![allow(dead_code, unused_imports, reason = "each test uses its own part")]

use camlux::scene::Bands;
pub use camlux::twin::{indirect, unshadowed_direct, vpls};

/// sqrt(Σ(x−t)²/Σt²) over all pixels and bands.
pub fn relative_rmse(image: &[f32], truth: &[Bands]) -> f64 {
    let truth = truth.as_flattened();
    assert_eq!(image.len(), truth.len());
    let error: f64 = image
        .iter()
        .zip(truth)
        .map(|(&x, t)| (f64::from(x) - t).powi(2))
        .sum();
    let scale: f64 = truth.iter().map(|t| t * t).sum();
    assert!(scale > 0.0, "the truth is black");
    (error / scale).sqrt()
}
