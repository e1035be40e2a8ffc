//! Options for indirect light.

use std::collections::HashSet;

use super::{
    Limits, Parameter, ParameterKind, ParameterValue, Parameters,
    parameters::{ParameterType, check_limits, parameters},
    validate::Part,
};
use crate::Result;

/// How indirect light is computed. See `docs/model.md`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IndirectLight {
    /// The equation of the CamSim document: the mean over the RSM, without distance falloff and without visibility.
    RsmAverage(RsmAverage),
    /// The sum over all VPLs with the measure of the integral (Keller 1997), without visibility. camlux evaluates it at every pixel: the
    /// 1/d² of a near VPL makes spikes of one or two pixels, which a grid or a sample of pixels misses.
    InstantRadiosity(InstantRadiosity),
    /// Final gathering by multiple importance sampling from P and from the lights. It converges to the true bounces, of which there may be
    /// several.
    FinalGather(FinalGather),
}

/// What a target error may be.
pub const TARGET_ERRORS: Limits =
    Limits::between(0.002, 0.5, "give a relRMSE from 0.002 to 0.5, such as 0.02");
const RSM_SIZES: Limits = Limits::positive(
    u32::MAX as f64,
    "give the texels along one face's edge, such as 64",
);

pub(crate) const MAX_BOUNCES: u8 = 16;
const BOUNCES: Limits = Limits::between(
    1.0,
    MAX_BOUNCES as f64,
    "give a number of bounces from 1 to 16, such as 4",
);

parameters! {
    /// One bounce or more by rays, refined to the target error.
    pub struct FinalGather {
        /// Target error of the indirect light against the true bounces, relRMSE: sqrt(Σ(x−t)²/Σt²). 0.02 is 2 %.
        target_error: f64 = DEFAULT_TARGET_ERROR, TARGET_ERRORS;
        /// What the target error applies to. image: all pixels at once, so bright pixels count most; local: tiles of the image, of which
        /// each with light has the same weight.
        error_norm: ErrorNorm = ErrorNorm::Image;
        /// Texels along an edge of a face of the reflective shadow map (RSM). There is none: it sets the number of tiles through which a
        /// light sends rays. Without it, camlux chooses.
        rsm_size: Option<u32> = None, RSM_SIZES;
        /// Limit of the wall time of a frame from the call on, without compiling, ms. At a limit, the result is the best image so far; the
        /// least image with an estimate is always made. The image then depends on the speed of the device.
        max_ms: Option<f64> = None, Limits::positive(f64::MAX, "give finite milliseconds above 0, such as 500, or no limit");
        /// Limit of the number of rays, like `max_ms`. The image does not depend on the speed of the device.
        max_rays: Option<u64> = None, Limits::positive(f64::MAX, "give a number of rays above 0, such as 100000000, or no limit");
        /// Whether frames have the layer `stderr`.
        stderr_layer: bool = false;
        /// With time of flight: target of the range error that the error of the bounce causes, rms over pixels, of the worst frequency, mm.
        /// `target_error` is then for the light alone; without it, `target_error` is also for the phasors.
        target_range_error_mm: Option<f64> = None, Limits::between(0.1, 1000.0, "give millimetres from 0.1 to 1000, such as 5");
        /// Largest number of surfaces that reflect light on its way from a light to what the camera sees.
        bounces: u32 = 1, BOUNCES;
    }
}

parameters! {
    /// The average of the CamSim document over the texels of the reflective shadow map, without visibility.
    pub struct RsmAverage {
        /// Texels along an edge of a face of the reflective shadow map (RSM).
        rsm_size: u32 = DEFAULT_RSM_SIZE, RSM_SIZES;
        /// Target error of the interpolation between pixels against the sum at every pixel, relRMSE. It does not limit the error of that
        /// sum against the true bounce. Without it, the sum is computed at every pixel.
        interpolation_error: Option<f64> = None, TARGET_ERRORS;
    }
}

parameters! {
    /// The sum over virtual point lights (VPLs), without visibility.
    pub struct InstantRadiosity {
        /// Texels along an edge of a face of the reflective shadow map (RSM).
        rsm_size: u32 = DEFAULT_RSM_SIZE, RSM_SIZES;
    }
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

const FINAL_GATHER: &str = "final-gather";

impl IndirectLight {
    /// The estimators' names in scene files, on the command line and in image headers.
    pub const NAMES: [&'static str; 3] = [FINAL_GATHER, "rsm-average", "instant-radiosity"];

    /// A plain sum over the VPLs of a reflective shadow map, at every pixel.
    pub const fn vpl_sum(sum: VplSum, rsm_size: u32) -> Self {
        match sum {
            VplSum::RsmAverage => IndirectLight::RsmAverage(RsmAverage {
                rsm_size,
                interpolation_error: None,
            }),
            VplSum::InstantRadiosity => {
                IndirectLight::InstantRadiosity(InstantRadiosity { rsm_size })
            }
        }
    }

    /// Final gathering with an RSM size that camlux chooses.
    pub const fn final_gather(target_error: f64) -> Self {
        IndirectLight::FinalGather(FinalGather::new(target_error))
    }

    /// Every estimator with the defaults of scene files, in the order of [`IndirectLight::NAMES`].
    pub const fn all() -> [Self; 3] {
        [
            IndirectLight::FinalGather(FinalGather::DEFAULT),
            IndirectLight::RsmAverage(RsmAverage::DEFAULT),
            IndirectLight::InstantRadiosity(InstantRadiosity::DEFAULT),
        ]
    }

    /// The estimator with this name, one of [`IndirectLight::NAMES`], with the defaults of scene files.
    pub fn from_name(name: &str) -> Option<Self> {
        let mut all = IndirectLight::all().into_iter();
        all.find(|indirect| indirect.name() == name)
    }

    /// The estimator's name, one of [`IndirectLight::NAMES`].
    pub fn name(&self) -> &'static str {
        self.sum().map_or(FINAL_GATHER, VplSum::name)
    }

    /// The formula of the sum over VPLs; `None` for final gathering.
    pub fn sum(&self) -> Option<VplSum> {
        match self {
            IndirectLight::FinalGather(_) => None,
            IndirectLight::RsmAverage(_) => Some(VplSum::RsmAverage),
            IndirectLight::InstantRadiosity(_) => Some(VplSum::InstantRadiosity),
        }
    }

    /// The parameters of final gathering; `None` for sums, which do not converge to the true bounce.
    pub fn gather(&self) -> Option<&FinalGather> {
        match self {
            IndirectLight::FinalGather(gather) => Some(gather),
            _ => None,
        }
    }

    /// The target error against the true bounce; `None` for sums.
    pub fn target_error(&self) -> Option<f64> {
        self.gather().map(|gather| gather.target_error)
    }

    /// Texels along one edge of a face of the RSM; `None`: camlux chooses.
    pub fn rsm_size(&self) -> Option<u32> {
        let size = self.value("rsm_size")?.number()?;
        Some(size as u32)
    }

    /// The target error of the interpolation, against the sum at every pixel; `None` if nothing is interpolated.
    pub fn interpolation_error(&self) -> Option<f64> {
        self.value("interpolation_error")?.number()
    }

    /// Every parameter of any estimator, each once.
    pub fn all_parameters() -> impl Iterator<Item = &'static Parameter> {
        let mut names = HashSet::new();
        let all = IndirectLight::all().into_iter();
        let rows = all.flat_map(|indirect| indirect.parameters().rows());
        rows.filter(move |row| names.insert(row.name))
    }

    pub fn parameters(&self) -> &dyn Parameters {
        match self {
            IndirectLight::FinalGather(gather) => gather,
            IndirectLight::RsmAverage(average) => average,
            IndirectLight::InstantRadiosity(radiosity) => radiosity,
        }
    }

    pub fn parameters_mut(&mut self) -> &mut dyn Parameters {
        match self {
            IndirectLight::FinalGather(gather) => gather,
            IndirectLight::RsmAverage(average) => average,
            IndirectLight::InstantRadiosity(radiosity) => radiosity,
        }
    }

    /// Whether the estimator has a parameter of this name.
    pub fn has(&self, name: &str) -> bool {
        let mut rows = self.parameters().rows().iter();
        rows.any(|parameter| parameter.name == name)
    }

    /// The value of the parameter of this name, if the estimator has it and it is set.
    pub fn value(&self, name: &str) -> Option<ParameterValue> {
        let mut parameters = self.parameters().named_values().into_iter();
        parameters.find(|(parameter, _)| parameter.name == name)?.1
    }

    pub(crate) fn validate(&self) -> Result<()> {
        check_limits(&Part("indirect".into()), self.parameters())
    }
}

impl FinalGather {
    /// All parameters but the target error have their defaults.
    pub const fn new(target_error: f64) -> Self {
        FinalGather {
            target_error,
            ..FinalGather::DEFAULT
        }
    }
}

impl From<FinalGather> for IndirectLight {
    fn from(gather: FinalGather) -> Self {
        IndirectLight::FinalGather(gather)
    }
}

impl ParameterType for ErrorNorm {
    const KIND: ParameterKind = ParameterKind::Name(&["image", "local"]);

    fn get(&self) -> Option<ParameterValue> {
        Some(ParameterValue::Name(self.name()))
    }

    fn set(&mut self, value: ParameterValue) {
        let mut norms = ErrorNorm::ALL.into_iter();
        let is_named = |norm: &ErrorNorm| value == ParameterValue::Name(norm.name());
        *self = norms.find(is_named).unwrap_or(*self);
    }
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
