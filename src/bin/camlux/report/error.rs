//! From the library's comparison to the figures of the report.

use camlux::metrics::{Comparison, CorrectedRmse, Pixels};

use super::results::ModelError;
use crate::Failure;

/// Distance of an image with three bands from the truth, whose standard error is `noise`, over the valid pixels but those on
/// edges. `None` where the truth is black, or nothing but noise.
///
/// # Errors
/// Where the image has another size.
pub fn model_error(
    image: &[f32],
    truth: &[f32],
    noise: &[f32],
    valid: &[bool],
    edges: &[bool],
) -> Result<Option<ModelError>, Failure> {
    let pixels = Pixels {
        image,
        reference: truth,
        image_standard_error: None,
        reference_standard_error: Some(noise),
        valid,
        edges: Some(edges),
        channels: 3,
    };
    let comparison = Comparison::new(&pixels)?;
    let with_edges = Comparison::new(&Pixels {
        edges: None,
        ..pixels
    })?;
    let (Some(errors), Some(corrected)) = (comparison.errors, comparison.noise) else {
        return Ok(None);
    };
    let (relative_rmse, uncertainty) = match corrected.rmse {
        CorrectedRmse::Estimate {
            value,
            standard_error,
        } => (value, Some(standard_error)),
        CorrectedRmse::Below(bound) => (bound, None),
        CorrectedRmse::ReferenceIsNoise => return Ok(None),
    };
    Ok(Some(ModelError {
        relative_rmse,
        is_upper_bound: uncertainty.is_none(),
        relative_rmse_uncertainty: uncertainty,
        relative_rmse_uncorrected: Some(errors.rmse),
        relative_rmse_with_edges: with_edges
            .noise
            .and_then(|noise| noise.rmse.value_or_bound()),
        bias: Some(errors.bias),
        bias_uncertainty: Some(corrected.bias_standard_error),
        mean_relative_error: Some(errors.mean_absolute),
        p99: Some(errors.percentile_99),
        non_finite: with_edges.non_finite_image as u64,
    }))
}

/// relRMSE of an image with three bands from values without noise; `None` where these are black.
///
/// # Errors
/// Where there are not as many of them.
pub fn relative_rmse(image: &[f32], exact: &[f64]) -> Result<Option<f64>, Failure> {
    let comparison = Comparison::new(&Pixels {
        image,
        reference: exact,
        image_standard_error: None,
        reference_standard_error: None,
        valid: &vec![true; image.len() / 3],
        edges: None,
        channels: 3,
    })?;
    Ok(comparison.errors.map(|errors| errors.rmse))
}
