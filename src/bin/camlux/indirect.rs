//! The options of the command line about indirect light.

use camlux::scene::{Estimator, Indirect, Visibility};

/// Filled in where a plain sum is asked for and neither the scene nor the command line has a size.
const RSM_SIZE: u32 = 64;

/// Any of them turns indirect light on where the scene has none.
#[derive(clap::Args, Clone, Copy, Default)]
pub struct IndirectArgs {
    /// How to compute indirect light: rsm-average or instant-radiosity; turns it on where the scene has none
    #[arg(long, value_name = "NAME", value_parser = parse_estimator)]
    pub estimator: Option<Estimator>,
    /// Texels along one edge of a face of the reflective shadow map; turns indirect light on where the scene has none
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(1..))]
    pub rsm_size: Option<u32>,
    /// Visibility between the points that light each other: rays or none; turns indirect light on where the scene has none
    #[arg(long, value_name = "NAME", value_parser = parse_visibility)]
    pub visibility: Option<Visibility>,
    /// relRMSE of the indirect light to aim at, 0.002 to 0.5: by rays against the true bounce, without against the exact sum; turns indirect light on where the scene has none
    #[arg(long, value_name = "SHARE")]
    pub target_error: Option<f64>,
}

fn parse_estimator(name: &str) -> Result<Estimator, String> {
    Estimator::from_name(name).ok_or_else(|| {
        let names = Estimator::ALL.map(Estimator::name);
        format!("the estimators are {}", names.join(" and "))
    })
}

fn parse_visibility(name: &str) -> Result<Visibility, String> {
    Visibility::from_name(name).ok_or_else(|| {
        let names = Visibility::ALL.map(Visibility::name);
        format!("it is {}", names.join(" or "))
    })
}

impl IndirectArgs {
    /// The indirect light that scene and command line ask for together, and a note where a value was filled in. What does
    /// not go together is left for the scene's validation to refuse.
    pub fn apply(&self, in_scene: Option<Indirect>) -> (Option<Indirect>, Option<String>) {
        let IndirectArgs {
            estimator,
            rsm_size,
            visibility,
            target_error,
        } = *self;
        let is_asked = estimator.is_some()
            || rsm_size.is_some()
            || visibility.is_some()
            || target_error.is_some();
        if !is_asked {
            return (in_scene, None);
        }
        let mut filled_in = Vec::new();
        let estimator = estimator.or(in_scene.map(|indirect| indirect.estimator));
        let estimator = estimator.unwrap_or_else(|| {
            let (taken, other) = self.fallback_estimator();
            let (name, other) = (taken.name(), other.name());
            filled_in.push(format!(
                "the estimator is {name} (--estimator {other} is the other one)"
            ));
            taken
        });
        let visibility = visibility.unwrap_or_else(|| self.visibility_of(estimator, in_scene));
        let has_rays = visibility == Visibility::Rays;

        // A size that the scene has for a plain sum does not bind rays that the command line turns on.
        let scene_size = in_scene
            .filter(|indirect| !has_rays || indirect.visibility == Visibility::Rays)
            .and_then(|indirect| indirect.rsm_size);
        let mut rsm_size = rsm_size.or(scene_size);
        if rsm_size.is_none() && !has_rays {
            rsm_size = Some(RSM_SIZE);
            filled_in.push(format!("rsm_size is {RSM_SIZE} (--rsm-size sets it)"));
        }
        // Against what an error counts depends on the visibility.
        let scene_error = in_scene
            .filter(|indirect| indirect.visibility == visibility)
            .and_then(|indirect| indirect.target_error);
        let indirect = Indirect {
            estimator,
            rsm_size,
            visibility,
            target_error: target_error.or(scene_error),
        };
        if let (None, None, Some(asked)) = (in_scene, target_error, indirect.asked_error()) {
            filled_in.push(format!(
                "the target error is {asked} (--target-error sets it)"
            ));
        }
        let lacks = in_scene.map_or("[indirect]", |_| "rsm_size");
        let note = format!("the scene has no {lacks}: {}", filled_in.join(", "));
        (Some(indirect), (!filled_in.is_empty()).then_some(note))
    }

    /// The estimator where neither scene nor command line names one, and the other: that of the document, unless rays are
    /// asked for. A note tells the user, for the two differ too much for a silent default.
    fn fallback_estimator(&self) -> (Estimator, Estimator) {
        let [document, radiosity] = [Estimator::RsmAverage, Estimator::InstantRadiosity];
        match (self.visibility, self.target_error) {
            (Some(Visibility::Rays), _) | (None, Some(_)) => (radiosity, document),
            _ => (document, radiosity),
        }
    }

    /// The visibility where the command line names none: that of the scene unless the estimator is another one.
    fn visibility_of(&self, estimator: Estimator, in_scene: Option<Indirect>) -> Visibility {
        let default = estimator.default_visibility();
        match in_scene {
            Some(indirect) if indirect.estimator == estimator => indirect.visibility,
            _ => default,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Estimator::{InstantRadiosity, RsmAverage};

    const NOTHING: IndirectArgs = IndirectArgs {
        estimator: None,
        rsm_size: None,
        visibility: None,
        target_error: None,
    };
    const RAYS: Indirect = Indirect {
        estimator: InstantRadiosity,
        rsm_size: None,
        visibility: Visibility::Rays,
        target_error: None,
    };

    /// Without a note.
    #[track_caller]
    fn assert_gives(args: IndirectArgs, in_scene: Indirect, expected: Indirect) {
        assert_eq!(args.apply(Some(in_scene)), (Some(expected), None));
    }

    #[test]
    fn command_line_wins_over_the_scene() {
        let average = Indirect::plain_sum(RsmAverage, 32);
        let sum = Indirect::plain_sum(InstantRadiosity, 32);
        assert_gives(NOTHING, average, average);
        let args = IndirectArgs {
            rsm_size: Some(8),
            ..NOTHING
        };
        assert_gives(args, average, Indirect::plain_sum(RsmAverage, 8));
        assert_gives(args, sum, Indirect::plain_sum(InstantRadiosity, 8));
        let with_size = Indirect {
            rsm_size: Some(8),
            ..RAYS
        };
        assert_gives(args, RAYS, with_size);
        let args = IndirectArgs {
            visibility: Some(Visibility::None),
            ..NOTHING
        };
        let of_scene = Indirect {
            target_error: Some(0.1),
            ..with_size
        };
        assert_gives(args, of_scene, Indirect::plain_sum(InstantRadiosity, 8));
    }

    #[test]
    fn another_estimator_brings_its_visibility() {
        let args = IndirectArgs {
            estimator: Some(InstantRadiosity),
            ..NOTHING
        };
        assert_gives(args, Indirect::plain_sum(RsmAverage, 32), RAYS);
        // The one that the scene has anyway changes nothing.
        let sum = Indirect::plain_sum(InstantRadiosity, 32);
        assert_gives(args, sum, sum);

        let args = IndirectArgs {
            estimator: Some(RsmAverage),
            ..NOTHING
        };
        let (indirect, note) = args.apply(Some(RAYS));
        assert_eq!(indirect, Some(Indirect::plain_sum(RsmAverage, 64)));
        let note = note.unwrap();
        assert!(note.contains("no rsm_size: rsm_size is 64"), "{note}");
    }

    #[test]
    fn a_target_error_leaves_the_visibility_to_the_scene() {
        let args = IndirectArgs {
            target_error: Some(0.1),
            ..NOTHING
        };
        let asked = Indirect {
            target_error: Some(0.1),
            ..RAYS
        };
        assert_gives(args, RAYS, asked);
        for estimator in Estimator::ALL {
            let sum = Indirect::plain_sum(estimator, 32);
            let asked = Indirect {
                target_error: Some(0.1),
                ..sum
            };
            assert_gives(args, sum, asked);
            assert_gives(NOTHING, asked, asked);
        }
        // The error of a sum is none against the truth.
        let sum = Indirect {
            target_error: Some(0.1),
            ..Indirect::plain_sum(RsmAverage, 32)
        };
        let args = IndirectArgs {
            estimator: Some(InstantRadiosity),
            ..NOTHING
        };
        assert_gives(args, sum, RAYS);
    }

    #[test]
    fn every_option_turns_indirect_light_on_and_says_what_it_filled_in() {
        assert_eq!(NOTHING.apply(None), (None, None));

        let turns_on = |args: IndirectArgs, expected: Indirect, says: &[&str]| {
            let (indirect, note) = args.apply(None);
            assert_eq!(indirect, Some(expected));
            let note = note.unwrap();
            for part in says {
                assert!(note.contains(part), "{part:?} is missing in: {note}");
            }
        };
        let args = IndirectArgs {
            estimator: Some(InstantRadiosity),
            ..NOTHING
        };
        turns_on(
            args,
            RAYS,
            &["no [indirect]: the target error is 0.02 (--target-error"],
        );
        let args = IndirectArgs {
            estimator: Some(RsmAverage),
            ..NOTHING
        };
        let size_64 = Indirect::plain_sum(RsmAverage, 64);
        turns_on(args, size_64, &["no [indirect]: rsm_size is 64"]);
        let args = IndirectArgs {
            rsm_size: Some(16),
            ..NOTHING
        };
        let size_16 = Indirect::plain_sum(RsmAverage, 16);
        turns_on(args, size_16, &["the estimator is rsm-average"]);
        let args = IndirectArgs {
            target_error: Some(0.1),
            ..NOTHING
        };
        let asked = Indirect {
            target_error: Some(0.1),
            ..RAYS
        };
        turns_on(args, asked, &["the estimator is instant-radiosity"]);
        let args = IndirectArgs {
            visibility: Some(Visibility::None),
            ..NOTHING
        };
        turns_on(args, size_64, &["rsm-average", "rsm_size is 64"]);

        let args = IndirectArgs {
            estimator: Some(RsmAverage),
            rsm_size: Some(16),
            ..NOTHING
        };
        assert_eq!(args.apply(None), (Some(size_16), None));
    }
}
