//! Options for indirect light.

use std::ops::RangeInclusive;

use super::validate::Part;
use crate::Result;

/// How the single bounce is computed. See `docs/model.md`.
///
/// `rsm_size` is the number of texels along one edge of a face of the reflective shadow map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IndirectLight {
    /// The equation of the CamSim document: the mean over the RSM, without distance falloff and without visibility.
    RsmAverage {
        rsm_size: u32,
        /// Target relRMSE of the interpolation between pixels, against the sum over all VPLs, within [`TARGET_ERRORS`]. `None`: camlux
        /// evaluates the sum at every pixel. It does not limit the error of that sum against the true bounce.
        interpolation_error: Option<f64>,
    },
    /// The sum over all VPLs with the measure of the integral (Keller 1997), without visibility. camlux evaluates it at every pixel: the
    /// 1/d² of a near VPL makes spikes of one or two pixels, which a grid or a sample of pixels misses.
    InstantRadiosity { rsm_size: u32 },
    /// Final gathering by multiple importance sampling from P and from the lights. It converges to the true single bounce.
    FinalGather {
        /// Target relRMSE against the true single bounce, sqrt(Σ(x−t)²/Σt²), within [`TARGET_ERRORS`].
        target_error: f64,
        /// The norm of that error.
        error_norm: ErrorNorm,
        /// With time of flight, the target for each frequency, millimetres, within [`TARGET_RANGE_ERRORS_MM`]: the root mean square of the range
        /// errors that the error of the bounce causes. Pixels whose |Z| is below
        /// [`LEAST_RANGE_SIGNAL`](crate::metrics::LEAST_RANGE_SIGNAL) of its root mean square do not count. `target_error` is then for the light
        /// alone. `None`: `target_error` is also for Z of each frequency.
        target_range_error_mm: Option<f64>,
        /// `None`: camlux chooses.
        rsm_size: Option<u32>,
        /// Limit on the wall time of a frame from the call on, milliseconds, above 0, without compiling. If it expires before the target error is
        /// met, the result is the best image so far. The least image and its estimate are always made. The image then depends on the speed of
        /// the device. `None`: no limit.
        max_ms: Option<f64>,
        /// Limit on the rays for the indirect light of a frame, above 0. The image does not depend on the speed of the device. `None`: no
        /// limit.
        max_rays: Option<u64>,
        /// Whether frames have the layer [`StandardError`](crate::output::Layer::StandardError).
        stderr_layer: bool,
    },
}

/// The norm of the target error of [`IndirectLight::FinalGather`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ErrorNorm {
    /// Over all pixels at once: bright pixels count most.
    #[default]
    Image,
    /// Over tiles of the image. All tiles with light count equally, so no dark part stays noisy.
    Local,
}

/// The formula of a plain sum over virtual point lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VplSum {
    /// The formula of [`IndirectLight::RsmAverage`].
    RsmAverage,
    /// The formula of [`IndirectLight::InstantRadiosity`].
    InstantRadiosity,
}

/// The default target error of [`IndirectLight::FinalGather`] in scene files.
pub const DEFAULT_TARGET_ERROR: f64 = 0.02;
/// The size of the RSM of a sum if none is given.
pub const DEFAULT_RSM_SIZE: u32 = 64;
/// Least and largest target for the error of the measured distance, millimetres.
pub const TARGET_RANGE_ERRORS_MM: RangeInclusive<f64> = 0.1..=1000.0;
/// The range of errors that can be requested.
pub const TARGET_ERRORS: RangeInclusive<f64> = 0.002..=0.5;

const FINAL_GATHER: &str = "final-gather";

impl IndirectLight {
    /// The estimators' names in scene files, on the command line and in image headers.
    pub const NAMES: [&'static str; 3] = [FINAL_GATHER, "rsm-average", "instant-radiosity"];

    /// A plain sum over the VPLs of a reflective shadow map, at every pixel.
    pub const fn vpl_sum(sum: VplSum, rsm_size: u32) -> Self {
        match sum {
            VplSum::RsmAverage => IndirectLight::RsmAverage {
                rsm_size,
                interpolation_error: None,
            },
            VplSum::InstantRadiosity => IndirectLight::InstantRadiosity { rsm_size },
        }
    }

    /// Final gathering with an RSM size that camlux chooses.
    pub const fn final_gather(target_error: f64) -> Self {
        IndirectLight::FinalGather {
            target_error,
            error_norm: ErrorNorm::Image,
            target_range_error_mm: None,
            rsm_size: None,
            max_ms: None,
            max_rays: None,
            stderr_layer: false,
        }
    }

    /// The estimator with this name, one of [`IndirectLight::NAMES`]. A sum gets this RSM size; final gathering gets the defaults of scene
    /// files.
    pub fn from_name(name: &str, rsm_size_of_sum: u32) -> Option<Self> {
        if name == FINAL_GATHER {
            return Some(IndirectLight::final_gather(DEFAULT_TARGET_ERROR));
        }
        let sum = VplSum::ALL.into_iter().find(|sum| sum.name() == name)?;
        Some(IndirectLight::vpl_sum(sum, rsm_size_of_sum))
    }

    /// The estimator's name, one of [`IndirectLight::NAMES`].
    pub fn name(&self) -> &'static str {
        self.sum().map_or(FINAL_GATHER, VplSum::name)
    }

    /// The formula of the sum over VPLs; `None` for final gathering.
    pub fn sum(&self) -> Option<VplSum> {
        match self {
            IndirectLight::FinalGather { .. } => None,
            IndirectLight::RsmAverage { .. } => Some(VplSum::RsmAverage),
            IndirectLight::InstantRadiosity { .. } => Some(VplSum::InstantRadiosity),
        }
    }

    /// Texels along one edge of a face of the RSM; `None`: camlux chooses.
    pub fn rsm_size(&self) -> Option<u32> {
        match *self {
            IndirectLight::RsmAverage { rsm_size, .. }
            | IndirectLight::InstantRadiosity { rsm_size } => Some(rsm_size),
            IndirectLight::FinalGather { rsm_size, .. } => rsm_size,
        }
    }

    /// Sets the size of the RSM, texels along one edge of a face.
    pub const fn set_rsm_size(&mut self, size: u32) {
        match self {
            IndirectLight::RsmAverage { rsm_size, .. }
            | IndirectLight::InstantRadiosity { rsm_size } => *rsm_size = size,
            IndirectLight::FinalGather { rsm_size, .. } => *rsm_size = Some(size),
        }
    }

    /// The target error against the true bounce; `None` for sums, which do not converge to it.
    pub fn target_error(&self) -> Option<f64> {
        match *self {
            IndirectLight::FinalGather { target_error, .. } => Some(target_error),
            _ => None,
        }
    }

    /// The target error of the interpolation, against the sum at every pixel; `None` if nothing is interpolated.
    pub fn interpolation_error(&self) -> Option<f64> {
        match *self {
            IndirectLight::RsmAverage {
                interpolation_error,
                ..
            } => interpolation_error,
            _ => None,
        }
    }

    /// The target error of range, millimetres; `None` without one.
    pub fn target_range_error_mm(&self) -> Option<f64> {
        match *self {
            IndirectLight::FinalGather {
                target_range_error_mm,
                ..
            } => target_range_error_mm,
            _ => None,
        }
    }

    /// The norm of the target error; `None` for sums.
    pub fn error_norm(&self) -> Option<ErrorNorm> {
        match *self {
            IndirectLight::FinalGather { error_norm, .. } => Some(error_norm),
            _ => None,
        }
    }

    /// Time limit of final gathering, milliseconds; `None`: no limit.
    pub fn max_ms(&self) -> Option<f64> {
        match *self {
            IndirectLight::FinalGather { max_ms, .. } => max_ms,
            _ => None,
        }
    }

    /// Limit on the rays of final gathering; `None`: no limit.
    pub fn max_rays(&self) -> Option<u64> {
        match *self {
            IndirectLight::FinalGather { max_rays, .. } => max_rays,
            _ => None,
        }
    }

    /// Whether frames have the layer of standard errors; `None` for sums.
    pub fn stderr_layer(&self) -> Option<bool> {
        match *self {
            IndirectLight::FinalGather { stderr_layer, .. } => Some(stderr_layer),
            _ => None,
        }
    }

    /// Its parameters in scene files besides the name and `rsm_size`: keys, and values if they are set.
    pub fn parameters(&self) -> Vec<(&'static str, Option<Parameter>)> {
        let number = |value: Option<f64>| value.map(Parameter::Number);
        let error_norm = self.error_norm().map(ErrorNorm::name);
        vec![
            ("target_error", number(self.target_error())),
            ("error_norm", error_norm.map(Parameter::Name)),
            (
                "target_range_error_mm",
                number(self.target_range_error_mm()),
            ),
            ("max_ms", number(self.max_ms())),
            ("max_rays", self.max_rays().map(Parameter::Count)),
            ("interpolation_error", number(self.interpolation_error())),
            ("stderr_layer", self.stderr_layer().map(Parameter::Flag)),
        ]
    }

    pub(crate) fn validate(&self) -> Result<()> {
        let part = Part("indirect".into());
        let (least, most) = (TARGET_ERRORS.start(), TARGET_ERRORS.end());
        for (key, error) in [
            ("target_error", self.target_error()),
            ("interpolation_error", self.interpolation_error()),
        ] {
            part.require(
                error.is_none_or(|error| TARGET_ERRORS.contains(&error)),
                format_args!("{key} is {}", error.unwrap_or_default()),
                format!("give a relRMSE from {least} to {most}, such as 0.02"),
            )?;
        }
        let range_mm = self.target_range_error_mm();
        let (least, most) = (TARGET_RANGE_ERRORS_MM.start(), TARGET_RANGE_ERRORS_MM.end());
        part.require(
            range_mm.is_none_or(|error| TARGET_RANGE_ERRORS_MM.contains(&error)),
            format_args!("target_range_error_mm is {}", range_mm.unwrap_or_default()),
            format!("give millimetres from {least} to {most}, such as 5"),
        )?;
        let max_ms = self.max_ms();
        part.require(
            max_ms.is_none_or(|ms| ms > 0.0 && ms.is_finite()),
            format_args!("max_ms is {}", max_ms.unwrap_or_default()),
            "give finite milliseconds above 0, such as 500, or no limit",
        )?;
        part.require(
            self.max_rays() != Some(0),
            "max_rays is 0",
            "give a number of rays above 0, such as 100000000, or no limit",
        )?;
        part.require(
            self.rsm_size() != Some(0),
            "rsm_size is 0",
            "give the texels along one face's edge, such as 64",
        )
    }
}

/// The value of a key of `[indirect]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Parameter {
    Number(f64),
    Count(u64),
    Name(&'static str),
    Flag(bool),
}

impl ErrorNorm {
    /// All norms, in the order of the documentation.
    pub const ALL: [ErrorNorm; 2] = [ErrorNorm::Image, ErrorNorm::Local];

    /// The name in scene files, on the command line and in image headers.
    pub fn name(self) -> &'static str {
        match self {
            ErrorNorm::Image => "image",
            ErrorNorm::Local => "local",
        }
    }
}

impl VplSum {
    /// All sums, in the order of the documentation.
    pub const ALL: [VplSum; 2] = [VplSum::RsmAverage, VplSum::InstantRadiosity];

    /// The name of the estimator that uses this sum.
    pub fn name(self) -> &'static str {
        match self {
            VplSum::RsmAverage => "rsm-average",
            VplSum::InstantRadiosity => "instant-radiosity",
        }
    }
}
