//! Whether what is asked of the indirect light goes together.

use super::validate::{Check, Part};
use super::{Estimator, Indirect, TARGET_ERRORS, Visibility};

pub(super) fn check(indirect: &Indirect) -> Check {
    let part = Part::Indirect;
    let Indirect {
        estimator,
        rsm_size,
        visibility,
        target_error,
    } = *indirect;
    let has_rays = visibility == Visibility::Rays;
    let name = estimator.name();
    let radiosity = Estimator::InstantRadiosity.name();
    part.require(
        !has_rays || estimator != Estimator::RsmAverage,
        || format!("visibility is \"rays\", but the equation of {name} has no visibility"),
        format!("set visibility = \"none\", or estimator = \"{radiosity}\""),
    )?;
    if let Some(target_error) = target_error {
        let (least, most) = (TARGET_ERRORS.start(), TARGET_ERRORS.end());
        part.require(
            TARGET_ERRORS.contains(&target_error),
            || format!("target_error is {target_error}"),
            format!("give a relRMSE from {least} to {most}, such as 0.02"),
        )?;
    }
    part.require(
        rsm_size != Some(0),
        || "rsm_size is 0".into(),
        "give the texels along one face's edge, such as 64",
    )?;
    part.require(
        has_rays || rsm_size.is_some(),
        || format!("there is no rsm_size, which {name} without visibility needs"),
        "add rsm_size = 64, texels along one face's edge",
    )
}
