//! What a report found: `report.json` is these structures, and the page shows them.

use serde::{Deserialize, Serialize};

use super::growth::GrowthRow;
use super::machine::Machine;
use super::measured::Counts;
use super::picture::Pictures;
use super::torture::TortureRow;
use crate::numbers::{percent, with_uncertainty};

/// A whole report.
#[derive(Serialize)]
pub struct Report {
    pub machine: Machine,
    pub quick: bool,
    pub measurements: Counts,
    pub scenes: Vec<SceneReport>,
    /// Empty where it was not asked for.
    pub torture: Vec<TortureRow>,
    /// Likewise.
    pub growth: Vec<GrowthRow>,
}

/// What was found for one scene.
#[derive(Serialize)]
pub struct SceneReport {
    pub name: String,
    pub file: String,
    pub resolution_px: [u32; 2],
    pub triangles: usize,
    pub lights: Vec<&'static str>,
    pub truth: Truth,
    /// The frame without indirect light, for the scale of the times.
    pub direct_only: Seconds,
    /// camlux's settings, then its reference, then the peers.
    pub entries: Vec<Entry>,
    /// Settings that were not run, and why.
    pub skipped: Vec<String>,
    pub peers: Peers,
    #[serde(skip)]
    pub truth_pictures: Pictures,
}

/// What the errors are measured against.
#[derive(Serialize)]
pub struct Truth {
    /// Path within the report's folder.
    pub file: String,
    pub scene_hash: String,
    pub samples_per_pixel: u32,
    /// Pixels that show one of two surfaces by chance, and in no figure count; and their share of those with a surface.
    pub edge_pixels: usize,
    pub edge_share: f64,
    /// Whether an earlier report's image was used.
    pub was_there: bool,
    /// relRMSE of the truth's own indirect light, from its own spread; `None` where its light is black.
    pub noise_floor: Option<f64>,
    /// Metres that the range of half of the truth's pixels is within by its own noise, of each modulation frequency.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub range_noise_m: Vec<f64>,
    /// Seconds spent on it in this report.
    pub seconds: f64,
}

/// Whose point it is.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Eq, Debug, Default)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A setting of the engine.
    #[default]
    Engine,
    /// The engine's path-sampled reference.
    Reference,
    /// Another program.
    Peer,
}

/// One point: a setting of a contender, its time and its error.
#[derive(Serialize, Deserialize, Default)]
pub struct Entry {
    pub kind: Kind,
    /// Points of one series are joined in the plot.
    pub series: String,
    /// Which of the series: `64²`, `128 spp`.
    pub label: String,
    /// Where the contender says more of itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    pub seconds: Seconds,
    pub indirect: Option<ModelError>,
    pub total: Option<ModelError>,
    /// Of each modulation frequency of a scene with time of flight.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub time_of_flight: Vec<PhasorError>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub engine: Option<EngineFigures>,
    /// On the Pareto front of time and indirect error among the engine's settings.
    pub is_on_engine_front: bool,
    /// On that among all.
    pub is_on_front: bool,
    /// Not in `report.json`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pictures: Option<Pictures>,
}

impl Entry {
    /// The series and which of it.
    pub fn name(&self) -> String {
        format!("{} {}", self.series, self.label)
    }
}

/// What only the engine's settings have.
#[derive(Serialize, Deserialize)]
pub struct EngineFigures {
    pub estimator: String,
    /// `None`: the engine chose.
    pub rsm_size: Option<u32>,
    /// relRMSE of the indirect light that was requested; `None` for plain sums, as is the next.
    pub target_error: Option<f64>,
    /// The same as the engine estimates it, without the truth.
    pub estimated_error: Option<f64>,
    /// What that is below with a confidence of 95 %.
    pub estimated_error_upper: Option<f64>,
    /// Why final gathering went no further.
    pub stop: Option<String>,
    /// Standard deviation of the indirect light's errors over what the engine says of them pixel by pixel (layer `stderr`).
    pub stderr_deviation: Option<f64>,
    pub vpl_count: u64,
    pub pixel_vpl_pairs: u64,
    pub ray_count: u64,
    pub pairs_per_second: Option<f64>,
    /// Medians over the timed runs, in the order of execution.
    pub gpu_passes: Vec<PassMedian>,
    /// relRMSE of the indirect light against the same formulas and VPLs in f64; `None` where that is black, and with rays,
    /// which take more than sums.
    pub kernel_error: Option<f64>,
    /// Pixels that the kernel error was measured on.
    pub kernel_error_pixels: usize,
}

#[derive(Serialize, Deserialize)]
pub struct PassMedian {
    pub name: String,
    pub milliseconds: f64,
}

/// Time of a frame from call to file: scene, device and pipelines are there.
#[derive(Serialize, Deserialize, Default)]
pub struct Seconds {
    pub median: f64,
    pub min: f64,
    pub max: f64,
    pub runs: Vec<f64>,
    /// Median of each part.
    pub parts: Vec<TimePart>,
}

#[derive(Serialize, Deserialize)]
pub struct TimePart {
    pub name: String,
    pub seconds: f64,
}

impl Seconds {
    /// Sums up timed runs and the medians of their parts; `None` without any.
    pub fn from_runs<Name: Into<String>>(
        runs: Vec<f64>,
        parts: impl IntoIterator<Item = (Name, f64)>,
    ) -> Option<Seconds> {
        let parts = parts.into_iter().map(|(name, seconds)| TimePart {
            name: name.into(),
            seconds,
        });
        Some(Seconds {
            median: median(&runs)?,
            min: runs.iter().copied().reduce(f64::min)?,
            max: runs.iter().copied().reduce(f64::max)?,
            runs,
            parts: parts.collect(),
        })
    }
}

/// The middle value, or the mean of the middle two.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let upper = *sorted.get(middle)?;
    if sorted.len().is_multiple_of(2) {
        Some(0.5 * (sorted[middle - 1] + upper))
    } else {
        Some(upper)
    }
}

/// Distance from the truth, over the pixels where it shows a surface, but for those on edges, all bands together.
#[derive(Serialize, Deserialize, Clone, Copy, Default)]
pub struct ModelError {
    /// sqrt(Σ(x−t)²/Σt²), the truth's noise subtracted. Where the noise hides it, a bound: it is at most that.
    pub relative_rmse: f64,
    pub is_upper_bound: bool,
    /// One standard error of `relative_rmse`, from the truth's noise.
    pub relative_rmse_uncertainty: Option<f64>,
    /// With the noise.
    pub relative_rmse_uncorrected: Option<f64>,
    /// `relative_rmse` with the pixels on edges.
    pub relative_rmse_with_edges: Option<f64>,
    /// Σx/Σt − 1
    pub bias: Option<f64>,
    pub bias_uncertainty: Option<f64>,
    /// Σ|x−t|/Σt
    pub mean_relative_error: Option<f64>,
    /// 99th percentile of |x−t|/(t + 0.01·mean t)
    pub p99: Option<f64>,
    /// Values that are no numbers or infinite, and in no sum; also on edges.
    pub non_finite: u64,
}

impl ModelError {
    /// The relRMSE, with its uncertainty where that is known, or as a bound.
    pub fn text(&self) -> String {
        let uncertainty = self.relative_rmse_uncertainty.unwrap_or(0.0);
        if self.is_upper_bound {
            format!("≤ {}", percent(self.relative_rmse))
        } else {
            with_uncertainty(self.relative_rmse, uncertainty)
        }
    }
}

/// How far off the phasors Z of one modulation frequency are.
#[derive(Serialize, Deserialize, Clone, Copy)]
pub struct PhasorError {
    pub frequency_hz: f64,
    /// Of the indirect light's Z.
    pub indirect: Option<ModelError>,
    /// Of the range by all light, the truth's noise included: metres that half of the pixels are within, and 99 % of them.
    pub range_median_m: Option<f64>,
    pub range_p99_m: Option<f64>,
}

/// What the peers' program said.
#[derive(Serialize, Deserialize, Default)]
pub struct Peers {
    /// In one sentence: whether it ran.
    pub status: String,
    pub about: Option<String>,
    pub notes: Vec<String>,
    pub unsupported: Vec<Unsupported>,
}

/// A peer that cannot render the scene.
#[derive(Serialize, Deserialize)]
pub struct Unsupported {
    pub peer: String,
    pub reason: String,
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn median_is_the_middle() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&[]), None);
    }
}
