//! The `[indirect]` table of a scene file.

use crate::Result;
use crate::keys::Keys;
use crate::scene::IndirectLight;

use super::value_of;

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
    let of_estimators = IndirectLight::all_parameters().map(|parameter| parameter.name);
    let known = ["estimator"].into_iter().chain(of_estimators);
    keys.only(&Vec::from_iter(known))?;
    let names = IndirectLight::NAMES;
    let example = format!("estimator = \"{}\"", names.join("\" or \""));
    let estimator = keys.need("estimator", &example)?;
    let mut indirect = estimator.choice(&IndirectLight::all(), |indirect| indirect.name())?;

    let of_gathering = format!("remove it, or set {FINAL_GATHER}");
    for parameter in IndirectLight::all_parameters().filter(|row| !indirect.has(row.name)) {
        let name = indirect.name();
        let (problem, hint) = match (parameter.name, name) {
            ("interpolation_error", "final-gather") => (
                "is relative to a sum over VPLs, which final-gather does not compute".into(),
                "use target_error, which is relative to the true bounce",
            ),
            ("interpolation_error", _) => (
                format!("belongs to rsm-average: {name} is summed at every pixel"),
                "remove it",
            ),
            ("target_error", _) => (
                format!("is relative to the true bounce, to which {name} does not converge"),
                match indirect.has("interpolation_error") {
                    true => "use interpolation_error, which is relative to the sum at every pixel",
                    false => &*of_gathering,
                },
            ),
            _ => (
                format!("belongs to final-gather: {name} has no target_error"),
                &*of_gathering,
            ),
        };
        keys.refuse(parameter.name, &problem, hint)?;
    }
    let parameters = indirect.parameters_mut();
    parameters.read(|parameter| value_of(parameter, &mut keys))?;
    Ok(indirect)
}
