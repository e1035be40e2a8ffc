//! The engine's settings that trade speed for accuracy, as series.

use camlux::scene::{FinalGather, IndirectLight, VplSum};

/// RSM sizes of the plain sums. From each size to the next, the number of pairs, and so the time, grows fourfold.
const SIZES: [u32; 6] = [8, 16, 32, 64, 128, 256];
/// Target errors of final gathering, from the fastest to the slowest.
const TARGET_ERRORS: [f64; 6] = [0.1, 0.05, 0.03, 0.02, 0.01, 0.005];
const QUICK_TARGET_ERRORS: [f64; 2] = [0.05, 0.02];

/// One point of a series.
pub struct Setting {
    pub series: &'static str,
    pub label: String,
    pub indirect: IndirectLight,
    /// `None`: not a plain sum.
    pub sum: Option<VplSum>,
}

/// The series for a scene of so many bounces, each ordered from its fastest setting to its slowest. The sums have a single bounce, so there
/// are none with more.
pub fn series(is_quick: bool, bounces: u32) -> Vec<Vec<Setting>> {
    let (sizes, target_errors) = if is_quick {
        (&SIZES[..4], &QUICK_TARGET_ERRORS[..])
    } else {
        (&SIZES[..], &TARGET_ERRORS[..])
    };
    let sums = |sum: VplSum| {
        sizes
            .iter()
            .map(|&size| Setting {
                series: sum.name(),
                label: format!("{size}²"),
                indirect: IndirectLight::vpl_sum(sum, size),
                sum: Some(sum),
            })
            .collect()
    };
    let final_gather = target_errors.iter().map(|&requested| Setting {
        series: "final-gather",
        // The word "requested" is needed, because the measured error beside it may differ.
        label: format!("requested {} %", (1e4 * requested).round() / 1e2),
        indirect: IndirectLight::FinalGather(FinalGather {
            bounces,
            ..FinalGather::new(requested)
        }),
        sum: None,
    });
    let sums = VplSum::ALL.map(sums).into_iter();
    let sums = sums.filter(|_| bounces == 1);
    sums.chain([final_gather.collect()]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_has_every_estimator() {
        let names = |is_quick, bounces| {
            let name = |settings: &Vec<Setting>| {
                let labels = settings.iter().map(|setting| setting.label.as_str());
                let labels: Vec<&str> = labels.collect();
                format!("{}: {}", settings[0].series, labels.join(", "))
            };
            series(is_quick, bounces)
                .iter()
                .map(name)
                .collect::<Vec<String>>()
        };
        assert_eq!(
            names(false, 1),
            [
                "rsm-average: 8², 16², 32², 64², 128², 256²",
                "instant-radiosity: 8², 16², 32², 64², 128², 256²",
                "final-gather: requested 10 %, requested 5 %, requested 3 %, requested 2 %, requested 1 %, requested 0.5 %",
            ]
        );
        assert_eq!(
            names(true, 1),
            [
                "rsm-average: 8², 16², 32², 64²",
                "instant-radiosity: 8², 16², 32², 64²",
                "final-gather: requested 5 %, requested 2 %",
            ]
        );
        assert_eq!(
            names(true, 3),
            ["final-gather: requested 5 %, requested 2 %"]
        );
        let settings = &series(true, 3)[0];
        assert_eq!(settings[1].indirect.gather().unwrap().bounces, 3);
    }
}
