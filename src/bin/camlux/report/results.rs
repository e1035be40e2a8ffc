//! The results of a report. `report.json` holds these structures, and the page shows them.

use serde::{Deserialize, Serialize};

use super::growth::GrowthRow;
use super::machine::Machine;
use super::measured::Counts;
use super::picture::Pictures;
use super::stopwatch::{PassMedian, Seconds};
use super::torture::TortureRow;
use crate::numbers::{percent, with_uncertainty};

/// A whole report.
#[derive(Serialize)]
pub struct Report {
    pub machine: Machine,
    pub quick: bool,
    pub measurements: Counts,
    pub scenes: Vec<SceneReport>,
    /// Empty unless requested.
    pub torture: Vec<TortureRow>,
    /// Empty unless requested.
    pub growth: Vec<GrowthRow>,
}

/// The results of one scene.
#[derive(Serialize)]
pub struct SceneReport {
    pub name: String,
    pub file: String,
    pub resolution_px: [u32; 2],
    pub triangles: usize,
    pub lights: Vec<&'static str>,
    pub reference: ReferenceInfo,
    /// The frame without indirect light, to put the times into proportion.
    pub direct_only: Seconds,
    /// camlux's settings, then its reference, then the peers.
    pub entries: Vec<Entry>,
    /// Settings that were not run, and why.
    pub skipped: Vec<String>,
    pub peers: Peers,
    #[serde(skip)]
    pub reference_pictures: Pictures,
}

/// The reference that the errors are measured against.
#[derive(Serialize)]
pub struct ReferenceInfo {
    /// Path inside the report's folder.
    pub file: String,
    pub scene_hash: String,
    pub samples_per_pixel: u32,
    /// Most surfaces that reflect light before what the camera sees.
    pub bounces: u32,
    /// Pixels on an edge, where rounding decides which of two surfaces a pixel shows. No figure counts them. Also their share of the pixels
    /// that show a surface.
    pub edge_pixels: usize,
    pub edge_share: f64,
    /// Whether the image of an earlier report was used.
    pub was_there: bool,
    /// relRMSE of the reference's own indirect light, from its own spread; `None` if its light is black.
    pub noise_floor: Option<f64>,
    /// For each modulation frequency, the median range error that the noise of the reference alone causes, in metres.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub range_noise_m: Vec<f64>,
    /// Seconds spent on the reference in this report.
    pub seconds: f64,
}

/// The contender that a point belongs to.
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
    /// The plot joins the points of one series.
    pub series: String,
    /// The setting within the series: `64²`, `128 spp`.
    pub label: String,
    /// More details, if the contender gives any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    pub seconds: Seconds,
    pub indirect: Option<ModelError>,
    pub total: Option<ModelError>,
    /// One entry for each modulation frequency of a time-of-flight scene.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub time_of_flight: Vec<PhasorError>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub engine: Option<EngineFigures>,
    /// On the Pareto front of time and indirect error among the engine's settings.
    pub is_on_engine_front: bool,
    /// On the Pareto front among all entries.
    pub is_on_front: bool,
    /// Not stored in `report.json`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pictures: Option<Pictures>,
}

impl Entry {
    /// The series and the setting.
    pub fn name(&self) -> String {
        format!("{} {}", self.series, self.label)
    }
}

/// Figures that only the engine's settings have.
#[derive(Serialize, Deserialize)]
pub struct EngineFigures {
    pub estimator: String,
    /// `None`: the engine chose the size.
    pub rsm_size: Option<u32>,
    /// Target error: the requested relRMSE of the indirect light. `None` for plain sums, as is the next field.
    pub target_error: Option<f64>,
    /// The relRMSE that the engine estimates, without the reference.
    pub estimated_error: Option<f64>,
    /// Upper bound of that error with a confidence of 95 %.
    pub estimated_error_upper: Option<f64>,
    /// Why final gathering stopped.
    pub stop: Option<String>,
    /// Standard deviation of the indirect light's errors, divided by the standard errors that the engine states for each pixel (layer
    /// `stderr`).
    pub stderr_deviation: Option<f64>,
    pub vpl_count: u64,
    pub pixel_vpl_pairs: u64,
    pub ray_count: u64,
    pub pairs_per_second: Option<f64>,
    /// Medians over the timed runs, in the order of execution.
    pub gpu_passes: Vec<PassMedian>,
    /// relRMSE of the indirect light against the same formulas and VPLs in f64. `None` if that is black, and with rays, because they do
    /// more than sums.
    pub kernel_error: Option<f64>,
    /// Number of pixels that the kernel error was measured on.
    pub kernel_error_pixels: usize,
}

/// Error relative to the reference, over all bands of the pixels where it shows a surface, without pixels on edges.
#[derive(Serialize, Deserialize, Clone, Copy, Default)]
pub struct ModelError {
    /// sqrt(Σ(x−t)²/Σt²) with the reference's noise subtracted. If the noise hides the error, this is an upper bound.
    pub relative_rmse: f64,
    pub is_upper_bound: bool,
    /// One standard error of `relative_rmse`, from the noise of the reference.
    pub relative_rmse_uncertainty: Option<f64>,
    /// Includes the noise of the reference.
    pub relative_rmse_uncorrected: Option<f64>,
    /// `relative_rmse` including the pixels on edges.
    pub relative_rmse_with_edges: Option<f64>,
    /// Σx/Σt − 1
    pub bias: Option<f64>,
    pub bias_uncertainty: Option<f64>,
    /// Σ|x−t|/Σt
    pub mean_relative_error: Option<f64>,
    /// 99th percentile of |x−t|/(t + 0.01·mean t)
    pub p99: Option<f64>,
    /// Number of NaN or infinite values, which no sum includes; also counted on edges.
    pub non_finite: u64,
}

impl ModelError {
    /// The relRMSE with its uncertainty if that is known, or as an upper bound.
    pub fn text(&self) -> String {
        let uncertainty = self.relative_rmse_uncertainty.unwrap_or(0.0);
        if self.is_upper_bound {
            format!("≤ {}", percent(self.relative_rmse))
        } else {
            with_uncertainty(self.relative_rmse, uncertainty)
        }
    }
}

/// Errors of the phasors Z of one modulation frequency.
#[derive(Serialize, Deserialize, Clone, Copy)]
pub struct PhasorError {
    pub frequency_hz: f64,
    /// Error of the indirect light's Z.
    pub indirect: Option<ModelError>,
    /// Range error from all light, including the noise of the reference: median and 99th percentile, metres.
    pub range_median_m: Option<f64>,
    pub range_p99_m: Option<f64>,
}

/// What the peers' program reported.
#[derive(Serialize, Deserialize, Default)]
pub struct Peers {
    /// One sentence that says whether it ran.
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
