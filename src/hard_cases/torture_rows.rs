//! The images of the torture set: how they are rendered, and what is measured of them.

use std::path::PathBuf;

/// Limit of |bias| divided by the upper bound. (The true error is no measure here: errors that the light rays of a set have in common move
/// the mean of an image, also where the noise of each pixel is small.)
pub const BIAS_SHARE: f64 = 0.5;

/// How the cases of this set are rendered.
#[derive(Debug, Clone)]
pub struct Settings {
    pub target_errors: Vec<f64>,
    /// Edge of the images, pixels.
    pub size_px: u32,
    /// Number of images of each scene. Each is turned by a degree or two, so that maps and samples fall elsewhere. At least 1.
    pub variations: u32,
    /// Folder that stores sampled references; `None`: they are not stored.
    pub truths: Option<PathBuf>,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            target_errors: vec![0.1, 0.05],
            size_px: 32,
            variations: 1,
            truths: None,
        }
    }
}

/// One image compared with the ground truth. Errors are relRMSEs of the indirect light, 1 = 100 %.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    pub requested: f64,
    /// The engine's estimated error; `None`: it has found no light.
    pub estimated: Option<f64>,
    /// The engine's upper bound with a confidence of 95 %.
    pub upper_bound: Option<f64>,
    /// Infinite if the image holds a value that is not finite.
    pub true_error: f64,
    /// Standard error of `true_error`, because the ground truth may have noise. Infinite if the noise hides the error; `true_error` is then
    /// an upper bound.
    pub uncertainty: f64,
    /// Σx/Σt − 1, and its standard error.
    pub bias: f64,
    pub bias_uncertainty: f64,
    /// |bias| beyond the noise of the ground truth, divided by the upper bound; infinite if the engine states no bound. If the image exceeds
    /// [`BIAS_SHARE`], this is the mean over sixteen turned images, unless the settings request variations.
    pub bias_share: f64,
    pub ray_count: u64,
    pub milliseconds: f64,
}

impl Row {
    /// The true error minus twice its uncertainty, divided by the upper bound; infinite if the engine states no bound. (If an image is much
    /// better than requested, the noise of the ground truth alone must not count against the bound.)
    pub fn over_upper_bound(&self) -> f64 {
        let at_least = match self.uncertainty {
            f64::INFINITY if self.true_error.is_finite() => 0.0,
            f64::INFINITY => f64::INFINITY,
            uncertainty => self.true_error - 2.0 * uncertainty,
        };
        self.upper_bound
            .map_or(f64::INFINITY, |bound| at_least.max(0.0) / bound)
    }

    pub fn over_requested(&self) -> f64 {
        self.true_error / self.requested
    }
}
