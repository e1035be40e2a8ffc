//! The options of the command line about indirect light.

use camlux::scene::IndirectLight;

/// Filled in where a sum is requested and neither the scene nor the command line has a size.
const RSM_SIZE: u32 = 64;

#[derive(clap::Args)]
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
        let &IndirectArgs {
            rsm_size,
            target_error,
            interpolation_error,
            ..
        } = self;
        for (option, error, owner) in [
            ("--target-error", target_error, "final-gather"),
            ("--interpolation-error", interpolation_error, "rsm-average"),
        ] {
            if error.is_some() && estimator != owner {
                return Err(format!(
                    "{option} belongs to {owner}, but the estimator is {estimator}; leave it out, or add --estimator {owner}"
                ));
            }
        }
        let same = in_scene.filter(|indirect| indirect.name() == estimator);
        let mut indirect = same
            .or_else(|| IndirectLight::from_name(estimator, RSM_SIZE))
            .ok_or_else(|| format!("there is no estimator {estimator}"))?;
        let is_sum = indirect.sum().is_some();
        // Sums share a size, but one of final gathering means something else.
        let sum_in_scene = in_scene.filter(|in_scene| is_sum && in_scene.sum().is_some());
        let size = rsm_size.or(sum_in_scene.and_then(|sum| sum.rsm_size()));
        let note = (is_sum && size.is_none())
            .then(|| format!("no rsm_size for {estimator}: it is {RSM_SIZE} (--rsm-size sets it)"));
        if let Some(size) = size {
            indirect.set_rsm_size(size);
        }
        if let IndirectLight::FinalGather {
            target_error: in_force,
            ..
        } = &mut indirect
        {
            *in_force = target_error.unwrap_or(*in_force);
        }
        if let IndirectLight::RsmAverage {
            interpolation_error: in_force,
            ..
        } = &mut indirect
        {
            *in_force = interpolation_error.or(*in_force);
        }
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
}

#[cfg(test)]
mod tests {
    use camlux::scene::VplSum::{InstantRadiosity, RsmAverage};
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct CommandLine {
        #[command(flatten)]
        indirect: IndirectArgs,
    }

    type Applied = Result<(Option<IndirectLight>, Option<String>), String>;

    /// What these options make of the scene's indirect light.
    fn apply(options: &str, in_scene: Option<IndirectLight>) -> Applied {
        let words = ["camlux"].into_iter().chain(options.split_whitespace());
        CommandLine::parse_from(words).indirect.apply(in_scene)
    }

    #[track_caller]
    fn assert_gives(options: &str, in_scene: IndirectLight, expected: IndirectLight) {
        assert_eq!(apply(options, Some(in_scene)), Ok((Some(expected), None)));
    }

    const GATHER: IndirectLight = IndirectLight::final_gather(0.02);
    const TENTH: IndirectLight = IndirectLight::final_gather(0.1);

    const fn average(rsm_size: u32) -> IndirectLight {
        IndirectLight::RsmAverage {
            rsm_size,
            interpolation_error: Some(0.1),
        }
    }

    #[test]
    fn command_line_wins_over_the_scene() {
        let sum = |sum, size| IndirectLight::vpl_sum(sum, size);
        assert_gives("", sum(RsmAverage, 32), sum(RsmAverage, 32));
        for formula in [RsmAverage, InstantRadiosity] {
            assert_gives("--rsm-size 8", sum(formula, 32), sum(formula, 8));
        }
        let gather_8 = IndirectLight::FinalGather {
            target_error: 0.02,
            rsm_size: Some(8),
        };
        assert_gives("--rsm-size 8", GATHER, gather_8);
        assert_gives("--target-error 0.1", GATHER, TENTH);
    }

    #[test]
    fn another_estimator_takes_over_what_it_has_in_common() {
        let radiosity = IndirectLight::vpl_sum(InstantRadiosity, 32);
        assert_gives("--estimator instant-radiosity", average(32), radiosity);
        assert_gives("--estimator final-gather", average(32), GATHER);
        let (indirect, note) = apply("--estimator rsm-average", Some(GATHER)).unwrap();
        assert_eq!(indirect, Some(IndirectLight::vpl_sum(RsmAverage, 64)));
        let note = note.unwrap();
        assert!(
            note.contains("rsm_size for rsm-average: it is 64"),
            "{note}"
        );
    }

    #[test]
    fn an_error_names_its_estimator_where_the_scene_has_none() {
        assert_eq!(apply("", None), Ok((None, None)));
        let gather = apply("--target-error 0.1", None);
        assert_eq!(gather, Ok((Some(TENTH), None)));
        let interpolated = apply("--interpolation-error 0.1 --rsm-size 16", None);
        assert_eq!(interpolated, Ok((Some(average(16)), None)));
        let message = apply("--rsm-size 16", None).unwrap_err();
        assert!(message.contains("--estimator"), "{message}");
    }

    #[test]
    fn an_error_of_another_estimator_is_refused() {
        for (options, says) in [
            ("--target-error 0.1", "belongs to final-gather"),
            (
                "--interpolation-error 0.1 --estimator instant-radiosity",
                "belongs to rsm-average",
            ),
        ] {
            let message = apply(options, Some(average(32))).unwrap_err();
            assert!(message.contains(says), "{message}");
        }
    }
}
