//! Patterns as camlux itself writes them: the angles in radians, with every digit.

use std::path::Path;

use serde_json::Value;

use super::PatternFile;
use crate::import::unused::Unused;
use crate::scene::Pattern;
use crate::{Error, Result};

/// The pattern as text.
pub(crate) fn text(pattern: &Pattern) -> String {
    let Pattern {
        gammas_rad,
        planes_rad,
        intensities,
        peak,
    } = pattern;
    let value = serde_json::json!({
        "gammas_rad": gammas_rad,
        "planes_rad": planes_rad,
        "intensities": intensities,
        "peak": peak,
    });
    value.to_string()
}

pub(super) fn parse(text: &str, path: &Path) -> Result<PatternFile> {
    let wrong = |problem: String| {
        let hint = "write it again with Scene::save, or give an IES or EULUMDAT file";
        Error::scene(path.display().to_string(), problem, hint)
    };
    let value: Value = serde_json::from_str(text)
        .map_err(|error| wrong(format!("not a pattern in JSON: {error}")))?;
    let numbers = |key: &str| {
        let list = value.get(key).and_then(Value::as_array);
        let numbers = list.and_then(|list| list.iter().map(Value::as_f64).collect());
        numbers.ok_or_else(|| wrong(format!("it has no list of numbers \"{key}\"")))
    };
    let pattern = Pattern {
        gammas_rad: numbers("gammas_rad")?,
        planes_rad: numbers("planes_rad")?,
        intensities: numbers("intensities")?,
        peak: value.get("peak").and_then(Value::as_f64).unwrap_or(1.0),
    };
    pattern.check().map_err(wrong)?;
    Ok(PatternFile {
        pattern,
        unused: Unused::default(),
        without_unit: None,
    })
}
