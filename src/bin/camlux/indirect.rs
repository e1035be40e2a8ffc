//! The options of the command line about indirect light.

use camlux::scene::{DEFAULT_TARGET_ERROR, IndirectLight};

/// Filled in where a sum is requested and neither the scene nor the command line has a size.
const RSM_SIZE: u32 = 64;

#[derive(clap::Args, Clone, Default)]
pub struct IndirectArgs {
    /// How to compute indirect light
    #[arg(long, value_name = "NAME", value_parser = IndirectLight::NAMES)]
    pub estimator: Option<String>,
    /// Texels along one edge of a face of the reflective shadow map
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(1..))]
    pub rsm_size: Option<u32>,
    /// For final-gather: relRMSE against the true bounce to aim at, 0.002 to 0.5
    #[arg(long, value_name = "ERROR")]
    pub target_error: Option<f64>,
    /// For rsm-average: relRMSE against the sum at every pixel that interpolation may cause, 0.002 to 0.5
    #[arg(long, value_name = "ERROR")]
    pub interpolation_error: Option<f64>,
}

impl IndirectArgs {
    /// The indirect light that scene and command line request together, and a note where a value was filled in.
    ///
    /// # Errors
    /// Where an option does not belong to the estimator, or none is named.
    pub fn apply(
        &self,
        in_scene: Option<IndirectLight>,
    ) -> Result<(Option<IndirectLight>, Option<String>), String> {
        let Some(estimator) = self.estimator_name(in_scene)? else {
            return Ok((None, None));
        };
        self.check_errors_belong_to(estimator)?;
        let same = in_scene.filter(|indirect| indirect.name() == estimator);
        let mut note = None;
        let mut size_of_sum = || {
            // Sums share a size, but one of final gathering means something else.
            let sum_in_scene = in_scene.filter(|indirect| indirect.target_error().is_none());
            let size = self
                .rsm_size
                .or(sum_in_scene.and_then(|sum| sum.rsm_size()));
            size.unwrap_or_else(|| {
                note = Some(format!(
                    "no rsm_size for {estimator}: it is {RSM_SIZE} (--rsm-size sets it)"
                ));
                RSM_SIZE
            })
        };
        let indirect = match estimator {
            "rsm-average" => IndirectLight::RsmAverage {
                rsm_size: size_of_sum(),
                interpolation_error: self
                    .interpolation_error
                    .or(same.and_then(|indirect| indirect.interpolation_error())),
            },
            "instant-radiosity" => IndirectLight::InstantRadiosity {
                rsm_size: size_of_sum(),
            },
            _ => IndirectLight::FinalGather {
                target_error: self
                    .target_error
                    .or(same.and_then(|indirect| indirect.target_error()))
                    .unwrap_or(DEFAULT_TARGET_ERROR),
                rsm_size: self
                    .rsm_size
                    .or(same.and_then(|indirect| indirect.rsm_size())),
            },
        };
        Ok((Some(indirect), note))
    }

    /// That of the command line, that of the scene, or the only one that has the error given. `None`: no indirect light.
    fn estimator_name(&self, in_scene: Option<IndirectLight>) -> Result<Option<&str>, String> {
        let named = self.estimator.as_deref();
        if let Some(name) = named.or(in_scene.as_ref().map(IndirectLight::name)) {
            return Ok(Some(name));
        }
        match (self.target_error, self.interpolation_error, self.rsm_size) {
            (Some(_), _, _) => Ok(Some("final-gather")),
            (None, Some(_), _) => Ok(Some("rsm-average")),
            (None, None, None) => Ok(None),
            (None, None, Some(_)) => Err(format!(
                "--rsm-size is given, but neither the scene nor the command line has an estimator; add --estimator {}",
                IndirectLight::NAMES.join(" or ")
            )),
        }
    }

    fn check_errors_belong_to(&self, estimator: &str) -> Result<(), String> {
        for (option, is_given, owner) in [
            (
                "--target-error",
                self.target_error.is_some(),
                "final-gather",
            ),
            (
                "--interpolation-error",
                self.interpolation_error.is_some(),
                "rsm-average",
            ),
        ] {
            if is_given && estimator != owner {
                return Err(format!(
                    "{option} belongs to {owner}, but the estimator is {estimator}; leave it out, or add --estimator {owner}"
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use camlux::scene::VplSum::{InstantRadiosity, RsmAverage};

    fn args(estimator: Option<&str>) -> IndirectArgs {
        IndirectArgs {
            estimator: estimator.map(String::from),
            ..IndirectArgs::default()
        }
    }

    fn with_size(size: u32) -> IndirectArgs {
        IndirectArgs {
            rsm_size: Some(size),
            ..IndirectArgs::default()
        }
    }

    fn with_target(error: f64) -> IndirectArgs {
        IndirectArgs {
            target_error: Some(error),
            ..IndirectArgs::default()
        }
    }

    #[track_caller]
    fn assert_gives(args: &IndirectArgs, in_scene: IndirectLight, expected: IndirectLight) {
        assert_eq!(args.apply(Some(in_scene)), Ok((Some(expected), None)));
    }

    const GATHER: IndirectLight = IndirectLight::final_gather(0.02);

    #[test]
    fn command_line_wins_over_the_scene() {
        let sum = |sum, size| IndirectLight::vpl_sum(sum, size);
        assert_gives(&args(None), sum(RsmAverage, 32), sum(RsmAverage, 32));
        for formula in [RsmAverage, InstantRadiosity] {
            assert_gives(&with_size(8), sum(formula, 32), sum(formula, 8));
        }
        let gather_8 = IndirectLight::FinalGather {
            target_error: 0.02,
            rsm_size: Some(8),
        };
        assert_gives(&with_size(8), GATHER, gather_8);
        assert_gives(&with_target(0.1), GATHER, IndirectLight::final_gather(0.1));
    }

    #[test]
    fn another_estimator_takes_over_what_it_has_in_common() {
        let average = IndirectLight::RsmAverage {
            rsm_size: 32,
            interpolation_error: Some(0.1),
        };
        let radiosity = IndirectLight::vpl_sum(InstantRadiosity, 32);
        assert_gives(&args(Some("instant-radiosity")), average, radiosity);
        assert_gives(&args(Some("final-gather")), average, GATHER);
        let (indirect, note) = args(Some("rsm-average")).apply(Some(GATHER)).unwrap();
        assert_eq!(indirect, Some(IndirectLight::vpl_sum(RsmAverage, 64)));
        let note = note.unwrap();
        assert!(
            note.contains("rsm_size for rsm-average: it is 64"),
            "{note}"
        );
    }

    #[test]
    fn an_error_names_its_estimator_where_the_scene_has_none() {
        assert_eq!(args(None).apply(None), Ok((None, None)));
        let gather = IndirectLight::final_gather(0.1);
        assert_eq!(with_target(0.1).apply(None), Ok((Some(gather), None)));
        let interpolated = IndirectArgs {
            interpolation_error: Some(0.1),
            rsm_size: Some(16),
            ..IndirectArgs::default()
        };
        let average = IndirectLight::RsmAverage {
            rsm_size: 16,
            interpolation_error: Some(0.1),
        };
        assert_eq!(interpolated.apply(None), Ok((Some(average), None)));
        let message = with_size(16).apply(None).unwrap_err();
        assert!(message.contains("--estimator"), "{message}");
    }

    #[test]
    fn an_error_of_another_estimator_is_refused() {
        let average = IndirectLight::vpl_sum(RsmAverage, 32);
        let message = with_target(0.1).apply(Some(average)).unwrap_err();
        assert!(message.contains("belongs to final-gather"), "{message}");
        let interpolated = IndirectArgs {
            interpolation_error: Some(0.1),
            ..args(Some("instant-radiosity"))
        };
        let message = interpolated.apply(None).unwrap_err();
        assert!(message.contains("belongs to rsm-average"), "{message}");
    }
}
