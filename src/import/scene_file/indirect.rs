//! The `[indirect]` table of a scene file.

use crate::Result;
use crate::keys::{Keys, Value};
use crate::scene::{DEFAULT_RSM_SIZE, DEFAULT_TARGET_ERROR, ErrorNorm, IndirectLight};

/// Reads the `[indirect]` table of a scene file.
pub(super) fn from_keys(mut keys: Keys) -> Result<IndirectLight> {
    const FINAL_GATHER: &str =
        "estimator = \"final-gather\", which finds visibility by rays and meets a target_error";

    // A key of earlier versions.
    if let Some(visibility) = keys.take("visibility") {
        let hint = match visibility.text() {
            Ok("none") => "remove it: rsm-average and instant-radiosity have none".into(),
            _ => format!("remove it, and set {FINAL_GATHER}"),
        };
        return Err(visibility.error("follows from the estimator", hint));
    }
    keys.only(&[
        "estimator",
        "rsm_size",
        "target_error",
        "error_norm",
        "target_range_error_mm",
        "max_ms",
        "max_rays",
        "stderr_layer",
        "interpolation_error",
    ])?;
    let names = IndirectLight::NAMES;
    let example = format!("estimator = \"{}\"", names.join("\" or \""));
    let estimator = keys.need("estimator", &example)?;
    let estimator = estimator.choice(&names, |name| name)?;
    if estimator != "final-gather" {
        for key in [
            "error_norm",
            "target_range_error_mm",
            "max_ms",
            "max_rays",
            "stderr_layer",
        ] {
            let problem = format!("belongs to final-gather: {estimator} has no target_error");
            keys.refuse(key, &problem, &format!("remove it, or set {FINAL_GATHER}"))?;
        }
    }
    match estimator {
        "final-gather" => {
            keys.refuse(
                "interpolation_error",
                "is relative to a sum over VPLs, which final-gather does not compute",
                "use target_error, which is relative to the true bounce",
            )?;
            let target_error = keys.optional("target_error", Value::number)?;
            let norm = |value: &Value| value.choice(&ErrorNorm::ALL, ErrorNorm::name);
            let error_norm = keys.optional("error_norm", norm)?;
            Ok(IndirectLight::FinalGather {
                target_error: target_error.unwrap_or(DEFAULT_TARGET_ERROR),
                error_norm: error_norm.unwrap_or_default(),
                target_range_error_mm: keys.optional("target_range_error_mm", Value::number)?,
                rsm_size: keys.optional("rsm_size", Value::count)?,
                max_ms: keys.optional("max_ms", Value::number)?,
                max_rays: keys.optional("max_rays", Value::large_count)?,
                stderr_layer: keys.optional("stderr_layer", Value::flag)?.unwrap_or(false),
            })
        }
        "rsm-average" => {
            keys.refuse(
                "target_error",
                "is relative to the true bounce, to which rsm-average does not converge",
                "use interpolation_error, which is relative to the sum at every pixel",
            )?;
            Ok(IndirectLight::RsmAverage {
                rsm_size: rsm_size(&mut keys)?,
                interpolation_error: keys.optional("interpolation_error", Value::number)?,
            })
        }
        _ => {
            keys.refuse(
                "target_error",
                "is relative to the true bounce, to which instant-radiosity does not converge",
                &format!("remove it, or set {FINAL_GATHER}"),
            )?;
            keys.refuse(
                "interpolation_error",
                "belongs to rsm-average: instant-radiosity is summed at every pixel",
                "remove it",
            )?;
            Ok(IndirectLight::InstantRadiosity {
                rsm_size: rsm_size(&mut keys)?,
            })
        }
    }
}

/// The size of the RSM of a sum.
fn rsm_size(keys: &mut Keys) -> Result<u32> {
    let given = keys.optional("rsm_size", Value::count)?;
    Ok(given.unwrap_or(DEFAULT_RSM_SIZE))
}
