//! The comparison as JSON, for programs.

use camlux::metrics::{Comparison, CorrectedRmse, NoiseCorrection};
use serde_json::{Value, json};

use super::Report;
use crate::range_error::RangeErrors;

/// One JSON object. Undefined values are null.
pub fn text(report: &Report) -> String {
    let layers: Vec<Value> = report
        .layers
        .iter()
        .map(|layer| {
            let mut object = comparison(&layer.comparison);
            object["name"] = json!(layer.pair.name());
            object["unit"] = json!(layer.pair.unit);
            object["stated_error"] = json!(layer.stated.map(|scores| json!({
                "value_count": scores.value_count,
                "mean": scores.mean,
                "deviation": scores.deviation(),
            })));
            object["range_error"] = json!(layer.range_errors_m.map(range));
            object["range_error_of_noise"] = json!(layer.range_noise_m.map(range));
            object["with_edges"] = json!(layer.with_edges.as_ref().map(comparison));
            object
        })
        .collect();
    let object = json!({
        "camlux_version": env!("CARGO_PKG_VERSION"),
        "image": report.args.image.to_string_lossy(),
        "reference": report.args.reference.to_string_lossy(),
        "resolution_px": report.resolution_px,
        "valid_pixels": report.valid_pixels,
        "edge_pixels": report.edge_pixels,
        "edge_share": report.edge_share(),
        "layers": layers,
    });
    format!("{object:#}\n")
}

fn range([median_m, percentile_99_m]: RangeErrors) -> Value {
    json!({ "median_m": median_m, "percentile_99_m": percentile_99_m })
}

fn comparison(comparison: &Comparison) -> Value {
    json!({
        "value_count": comparison.value_count,
        "non_finite_image": comparison.non_finite_image,
        "non_finite_reference": comparison.non_finite_reference,
        "image_mean": comparison.image_mean,
        "reference_mean": comparison.reference_mean,
        "errors": comparison.errors.map(|errors| json!({
            "relative_rmse": errors.rmse,
            "bias": errors.bias,
            "mean_relative_error": errors.mean_absolute,
            "percentile_99": errors.percentile_99,
        })),
        "noise": comparison.noise.map(noise),
        "z_scores": comparison.z_scores.map(|scores| json!({
            "value_count": scores.value_count,
            "mean": scores.mean,
            "variance": scores.variance,
        })),
    })
}

fn noise(noise: NoiseCorrection) -> Value {
    let (value, standard_error, below) = match noise.rmse {
        CorrectedRmse::Estimate {
            value,
            standard_error,
        } => (Some(value), Some(standard_error), None),
        CorrectedRmse::Below(bound) => (None, None, Some(bound)),
        CorrectedRmse::ReferenceIsNoise => (None, None, None),
    };
    json!({
        "relative_rmse": value,
        "relative_rmse_standard_error": standard_error,
        "relative_rmse_below": below,
        "relative_rmse_of_noise": noise.floor,
        "bias_standard_error": noise.bias_standard_error,
        "mean_relative_error_of_noise": noise.mean_absolute_floor,
    })
}
