//! `camlux doctor --torture`: checks the engine's estimates of its own error, image by image.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use camlux::hard_cases::torture::{
    BIAS_SHARE, CASES, FAR_OVER_REQUESTED, OVER_REQUESTED, OVER_UPPER_BOUND, Row, Settings,
};
use camlux::hard_cases::{Case, Examiner};

use crate::numbers::{count, duration, percent, with_uncertainty};
use crate::{Failure, print, tell};

/// Edge of the images, pixels.
const SIZE_PX: u32 = 96;
/// Share of the rows that may exceed [`OVER_REQUESTED`].
const MAY_BE_OVER_REQUESTED: f64 = 0.05;
/// With many variations: share of the images whose true error may exceed its upper bound.
const MAY_BE_OVER_BOUND: f64 = 0.08;

/// The columns of the table.
pub const HEADS: [&str; 9] = [
    "scene",
    "target",
    "estimated",
    "bound",
    "true",
    "bias",
    "rays",
    "time",
    "missed",
];

#[derive(clap::Args)]
pub struct Args {
    /// Check error estimates on scenes that fool them; keep references here
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["all", "markdown", "pictures"])]
    torture: Option<PathBuf>,
    /// Target error of the torture set, may be repeated [default: 0.1 0.05 0.02 0.01]
    #[arg(long = "target-error", value_name = "SHARE", requires = "torture", value_parser = crate::reference::parse_share)]
    target_errors: Vec<f64>,
    /// Slightly turned images of each torture scene
    #[arg(long, value_name = "N", requires = "torture", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    variations: u32,
}

impl Args {
    /// `None` if the other cases are requested.
    pub fn settings(&self) -> Option<Settings> {
        let settings = settings(self.torture.as_ref()?);
        Some(Settings {
            target_errors: if self.target_errors.is_empty() {
                settings.target_errors
            } else {
                self.target_errors.clone()
            },
            variations: self.variations,
            ..settings
        })
    }
}

/// Settings for one run of the whole set, with its references in that folder.
pub fn settings(truths: &Path) -> Settings {
    Settings {
        target_errors: vec![0.1, 0.05, 0.02, 0.01],
        size_px: SIZE_PX,
        variations: 1,
        truths: Some(truths.into()),
    }
}

/// Prints a table with one line per image, and a summary. Exit code 0 if all measurements are within their bounds.
pub fn run(
    mut examiner: Examiner,
    settings: Settings,
    is_picked: impl Fn(&Case) -> bool,
) -> Result<ExitCode, Failure> {
    let variations = settings.variations;
    examiner.set_torture(settings);
    print(&line(HEADS.map(String::from)))?;
    let mut rows = Vec::new();
    let mut others_are_met = true;
    for case in CASES.iter().filter(|case| is_picked(case)) {
        let measured = examiner.examine(case)?;
        let of_case = examiner.take_rows();
        for row in &of_case {
            print(&line(cells(case.name, row)))?;
        }
        if of_case.is_empty() {
            for part in &measured.parts {
                let (name, of, quantity) = (case.name, &part.of, &part.quantity);
                let (error, bound) = (part.error, part.bound);
                let verdict = if part.is_met() { "" } else { ": missed" };
                print(&format!(
                    "{name}, {of}: {quantity} {error:.2} (at most {bound}){verdict}\n"
                ))?;
            }
            others_are_met &= measured.is_met();
        }
        rows.extend(of_case);
    }
    let is_met = (rows.is_empty() || summarise(&rows, variations)?) && others_are_met;
    Ok(if is_met {
        ExitCode::SUCCESS
    } else {
        tell("camlux: the torture set failed on this device");
        ExitCode::FAILURE
    })
}

/// Counts the rows that miss each criterion, and returns whether the counts are within bounds. With many variations, only the share of
/// images within the upper bound is checked.
fn summarise(rows: &[Row], variations: u32) -> Result<bool, Failure> {
    let of_set = |share: f64| (variations == 1).then_some(share);
    let coverage = (variations > 1).then_some(MAY_BE_OVER_BOUND);
    let over_bound = |factor: f64| move |row: &Row| row.over_upper_bound() > factor;
    let over_requested = |factor: f64| move |row: &Row| row.over_requested() > factor;
    let counts = [
        (
            "true error over the bound".into(),
            share(rows, over_bound(1.0)),
            coverage,
        ),
        (
            format!("true error over {OVER_UPPER_BOUND} times the bound"),
            share(rows, over_bound(OVER_UPPER_BOUND)),
            of_set(0.0),
        ),
        (
            format!("true error over {OVER_REQUESTED} times the target error"),
            share(rows, over_requested(OVER_REQUESTED)),
            of_set(MAY_BE_OVER_REQUESTED),
        ),
        (
            format!("true error over {FAR_OVER_REQUESTED} times the target error"),
            share(rows, over_requested(FAR_OVER_REQUESTED)),
            of_set(0.0),
        ),
        (
            format!("bias over {BIAS_SHARE} of the bound"),
            share(rows, |row| row.bias_share > BIAS_SHARE),
            of_set(0.0),
        ),
    ];
    let mut text = format!("\nshare of {} images:\n", rows.len());
    let mut is_met = true;
    for (what, missed, most) in counts {
        text += &format!("{what:<50} {:>7}", percent(missed));
        if let Some(most) = most {
            is_met &= missed <= most;
            text += &format!(" (at most {})", percent(most));
        }
        text += "\n";
    }
    print(&text)?;
    Ok(is_met)
}

/// Share of the rows that satisfy the condition.
fn share(rows: &[Row], is_so: impl Fn(&Row) -> bool) -> f64 {
    let count = rows.iter().filter(|row| is_so(row)).count();
    count as f64 / rows.len().max(1) as f64
}

/// A row of the table.
pub fn cells(name: &str, row: &Row) -> [String; HEADS.len()] {
    let shown = |error: Option<f64>| error.map_or("-".into(), percent);
    let true_error = match row.uncertainty {
        f64::INFINITY => format!("< {}", percent(row.true_error)),
        uncertainty => with_uncertainty(row.true_error, uncertainty),
    };
    let mut missed = Vec::new();
    if row.over_upper_bound() > OVER_UPPER_BOUND {
        missed.push("bound");
    }
    if row.over_requested() > OVER_REQUESTED {
        missed.push("target");
    }
    if row.bias_share > BIAS_SHARE {
        missed.push("bias");
    }
    [
        name.into(),
        percent(row.requested),
        shown(row.estimated),
        shown(row.upper_bound),
        true_error,
        with_uncertainty(row.bias, row.bias_uncertainty),
        count(row.ray_count as f64),
        duration(1e-3 * row.milliseconds),
        missed.join(", "),
    ]
}

fn line(
    [
        scene,
        asked,
        estimated,
        bound,
        truth,
        bias,
        rays,
        time,
        missed,
    ]: [String; HEADS.len()],
) -> String {
    let line = format!(
        "{scene:<34} {asked:>7} {estimated:>9} {bound:>8} {truth:>18} {bias:>18} {rays:>8} {time:>8}  {missed}"
    );
    format!("{}\n", line.trim_end())
}
