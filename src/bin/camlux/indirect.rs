//! The command-line options for indirect light.

use camlux::scene::{DEFAULT_RSM_SIZE, ErrorNorm, IndirectLight, ParameterValue};

#[derive(clap::Args)]
pub struct IndirectArgs {
    /// final-gather, instant-radiosity or rsm-average
    #[arg(long, value_name = "NAME", value_parser = IndirectLight::NAMES, hide_possible_values = true)]
    pub estimator: Option<String>,
    /// RSM texels along an edge
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(1..))]
    pub rsm_size: Option<u32>,
    /// Target relRMSE of final-gather, 0.002 to 0.5
    #[arg(long, value_name = "ERROR")]
    pub target_error: Option<f64>,
    /// Target error over the whole image, or over each part of it
    #[arg(long, value_name = "image|local", value_parser = parse_norm)]
    pub error_norm: Option<ErrorNorm>,
    /// Target error of the range of [tof], rms, mm: 0.1 to 1000
    #[arg(long, value_name = "MM")]
    pub target_range_error_mm: Option<f64>,
    /// Bounces of final-gather, 1 to 16
    #[arg(long, value_name = "NUMBER")]
    pub bounces: Option<u32>,
    /// Time limit of final-gather, milliseconds
    #[arg(long, value_name = "MS")]
    pub max_ms: Option<f64>,
    /// Ray limit of final-gather
    #[arg(long, value_name = "RAYS")]
    pub max_rays: Option<u64>,
    /// Add layer stderr: standard errors of final-gather
    #[arg(long)]
    pub stderr_layer: bool,
    /// Interpolation error of rsm-average, 0.002 to 0.5
    #[arg(long, value_name = "ERROR")]
    pub interpolation_error: Option<f64>,
}

fn parse_norm(name: &str) -> Result<ErrorNorm, String> {
    let found = ErrorNorm::ALL.into_iter().find(|norm| norm.name() == name);
    found.ok_or_else(|| {
        let names = ErrorNorm::ALL.map(ErrorNorm::name);
        format!("the norms are {}", names.join(" and "))
    })
}

impl IndirectArgs {
    /// The indirect light that scene and command line request together, and a note if a default value was used.
    ///
    /// # Errors
    /// If an option does not belong to the estimator, or no estimator is named.
    pub fn apply(
        &self,
        in_scene: Option<IndirectLight>,
    ) -> Result<(Option<IndirectLight>, Option<String>), String> {
        let Some(estimator) = self.estimator_name(in_scene)? else {
            return Ok((None, None));
        };
        if let Some((option, owner)) = self.owned().find(|(_, owner)| estimator != *owner) {
            return Err(format!(
                "{option} belongs to {owner}, but the estimator is {estimator}; leave it out, or add --estimator {owner}"
            ));
        }
        let same = in_scene.filter(|indirect| indirect.name() == estimator);
        let mut indirect = same
            .or_else(|| IndirectLight::from_name(estimator))
            .ok_or_else(|| format!("there is no estimator {estimator}"))?;
        let is_sum = indirect.sum().is_some();
        // The sums share a size; the size of final gathering has another meaning.
        let sum_in_scene = in_scene.filter(|in_scene| is_sum && in_scene.sum().is_some());
        let size_in_scene = sum_in_scene.and_then(|sum| sum.value("rsm_size"));
        let given = self.given();
        let note = (is_sum && self.rsm_size.is_none() && size_in_scene.is_none()).then(|| {
            format!("no rsm_size for {estimator}: using {DEFAULT_RSM_SIZE} (--rsm-size sets it)")
        });
        let value_of = |name| given.iter().find(|(given, _)| *given == name);
        indirect.parameters_mut().read(|parameter| {
            let in_scene = (parameter.name == "rsm_size").then_some(size_in_scene);
            let given = value_of(parameter.name).map(|(_, value)| *value);
            Ok::<_, String>(given.or(in_scene.flatten()))
        })?;
        Ok((Some(indirect), note))
    }

    /// The parameters that options give.
    fn given(&self) -> Vec<(&'static str, ParameterValue)> {
        let number = |value: Option<f64>| value.map(ParameterValue::Number);
        let norm = self.error_norm.map(ErrorNorm::name);
        let rsm_size = self.rsm_size.map(u64::from);
        let options = [
            ("target_error", number(self.target_error)),
            ("error_norm", norm.map(ParameterValue::Name)),
            ("target_range_error_mm", number(self.target_range_error_mm)),
            ("max_ms", number(self.max_ms)),
            ("max_rays", self.max_rays.map(ParameterValue::Count)),
            (
                "stderr_layer",
                self.stderr_layer.then_some(ParameterValue::Flag(true)),
            ),
            ("interpolation_error", number(self.interpolation_error)),
            ("rsm_size", rsm_size.map(ParameterValue::Count)),
            (
                "bounces",
                self.bounces.map(|n| ParameterValue::Count(n.into())),
            ),
        ];
        let given = options.into_iter();
        given
            .filter_map(|(name, value)| Some((name, value?)))
            .collect()
    }

    /// The given options that belong to one estimator, and its name.
    fn owned(&self) -> impl Iterator<Item = (String, &'static str)> {
        self.given().into_iter().filter_map(|(name, _)| {
            let all = IndirectLight::all();
            let mut owners = all.iter().filter(|indirect| indirect.has(name));
            match (owners.next(), owners.next()) {
                (Some(owner), None) => {
                    Some((format!("--{}", name.replace('_', "-")), owner.name()))
                }
                _ => None,
            }
        })
    }

    /// The estimator of the command line, else that of the scene, else the only one that has the given option. `None`: no indirect light.
    fn estimator_name(&self, in_scene: Option<IndirectLight>) -> Result<Option<&str>, String> {
        let named = self.estimator.as_deref();
        if let Some(name) = named.or(in_scene.as_ref().map(IndirectLight::name)) {
            return Ok(Some(name));
        }
        match (self.owned().next(), self.rsm_size) {
            (Some((_, owner)), _) => Ok(Some(owner)),
            (None, None) => Ok(None),
            (None, Some(_)) => Err(format!(
                "--rsm-size is given, but neither the scene nor the command line has an estimator; add --estimator {}",
                IndirectLight::NAMES.join(" or ")
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use camlux::scene::{
        FinalGather,
        VplSum::{InstantRadiosity, RsmAverage},
    };
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct CommandLine {
        #[command(flatten)]
        indirect: IndirectArgs,
    }

    type Applied = Result<(Option<IndirectLight>, Option<String>), String>;

    /// The result of applying these options to the scene's indirect light.
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
        IndirectLight::RsmAverage(camlux::scene::RsmAverage {
            rsm_size,
            interpolation_error: Some(0.1),
        })
    }

    #[test]
    fn each_parameter_has_an_option() {
        let command = <CommandLine as clap::CommandFactory>::command();
        for parameter in IndirectLight::all_parameters() {
            let name = parameter.name.replace('_', "-");
            let mut options = command
                .get_arguments()
                .filter_map(|option| option.get_long());
            assert!(options.any(|option| option == name), "{name}");
        }
    }

    #[test]
    fn command_line_wins_over_the_scene() {
        let sum = |sum, size| IndirectLight::vpl_sum(sum, size);
        assert_gives("", sum(RsmAverage, 32), sum(RsmAverage, 32));
        for formula in [RsmAverage, InstantRadiosity] {
            assert_gives("--rsm-size 8", sum(formula, 32), sum(formula, 8));
        }
        let gather_8 = IndirectLight::FinalGather(FinalGather {
            target_error: 0.02,
            error_norm: ErrorNorm::Local,
            rsm_size: Some(8),
            max_ms: Some(250.0),
            max_rays: Some(5_000_000_000),
            stderr_layer: true,
            target_range_error_mm: Some(2.5),
            bounces: 3,
        });
        let options = "--rsm-size 8 --error-norm local --max-ms 250 --max-rays 5000000000 --stderr-layer --target-range-error-mm 2.5 --bounces 3";
        assert_gives(options, GATHER, gather_8);
        assert_gives("", gather_8, gather_8);
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
            note.contains("rsm_size for rsm-average: using 64"),
            "{note}"
        );
    }

    #[test]
    fn an_error_names_its_estimator_where_the_scene_has_none() {
        assert_eq!(apply("", None), Ok((None, None)));
        let gather = apply("--target-error 0.1", None);
        assert_eq!(gather, Ok((Some(TENTH), None)));
        for options in [
            "--error-norm image",
            "--max-ms 9",
            "--max-rays 9",
            "--stderr-layer",
        ] {
            let (indirect, note) = apply(options, None).unwrap();
            assert_eq!(indirect.unwrap().name(), "final-gather", "{options}");
            assert_eq!(note, None);
        }
        let interpolated = apply("--interpolation-error 0.1 --rsm-size 16", None);
        assert_eq!(interpolated, Ok((Some(average(16)), None)));
        let message = apply("--rsm-size 16", None).unwrap_err();
        assert!(message.contains("--estimator"), "{message}");
    }

    #[test]
    fn an_option_of_another_estimator_is_refused() {
        for (options, says) in [
            ("--target-error 0.1", "belongs to final-gather"),
            ("--error-norm local", "--error-norm belongs to final-gather"),
            ("--max-ms 9", "--max-ms belongs to final-gather"),
            ("--max-rays 9", "--max-rays belongs to final-gather"),
            ("--stderr-layer", "--stderr-layer belongs to final-gather"),
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
