//! The engine's settings that trade speed for accuracy, in series.

use camlux::scene::{Estimator, Indirect, Visibility};

/// RSM sizes of the plain sums: pairs, and so time, grow fourfold from each to the next.
const SIZES: [u32; 6] = [8, 16, 32, 64, 128, 256];
/// Target errors of what casts rays, from the fastest to the slowest.
const TARGET_ERRORS: [f64; 6] = [0.1, 0.05, 0.03, 0.02, 0.01, 0.005];

/// One point of a series.
pub struct Setting {
    pub series: &'static str,
    pub label: String,
    pub indirect: Indirect,
}

/// The series, each from its fastest setting to its slowest.
pub fn series(is_quick: bool) -> [Vec<Setting>; 3] {
    let (sizes, target_errors) = if is_quick {
        (&SIZES[..4], &TARGET_ERRORS[..2])
    } else {
        (&SIZES[..], &TARGET_ERRORS[..])
    };
    let sums = |series, estimator| {
        sizes
            .iter()
            .map(|&size| Setting {
                series,
                label: format!("{size}²"),
                indirect: Indirect::plain_sum(estimator, size),
            })
            .collect()
    };
    let by_rays = target_errors.iter().map(|&asked| Setting {
        series: "instant-radiosity",
        // Not the bare number: it stands beside an error that may be another.
        label: format!("asked {} %", (1e4 * asked).round() / 1e2),
        indirect: Indirect {
            estimator: Estimator::InstantRadiosity,
            rsm_size: None,
            visibility: Visibility::Rays,
            target_error: Some(asked),
        },
    });
    [
        sums("rsm-average", Estimator::RsmAverage),
        sums(
            "instant-radiosity, no visibility",
            Estimator::InstantRadiosity,
        ),
        by_rays.collect(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_has_every_estimator_and_every_visibility() {
        let names = |is_quick| {
            series(is_quick).map(|settings| {
                let labels = settings.iter().map(|setting| setting.label.as_str());
                let labels: Vec<&str> = labels.collect();
                format!("{}: {}", settings[0].series, labels.join(", "))
            })
        };
        assert_eq!(
            names(false),
            [
                "rsm-average: 8², 16², 32², 64², 128², 256²",
                "instant-radiosity, no visibility: 8², 16², 32², 64², 128², 256²",
                "instant-radiosity: asked 10 %, asked 5 %, asked 3 %, asked 2 %, asked 1 %, asked 0.5 %",
            ]
        );
        assert_eq!(
            names(true),
            [
                "rsm-average: 8², 16², 32², 64²",
                "instant-radiosity, no visibility: 8², 16², 32², 64²",
                "instant-radiosity: asked 10 %, asked 5 %",
            ]
        );
    }
}
