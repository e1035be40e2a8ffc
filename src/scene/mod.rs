//! What is lit: camera, sensor, lights, meshes, materials, and which indirect light is wanted.
//!
//! Lengths are metres, angles in the scene description are degrees, powers watts. Positions are f64 so that a scene far
//! from the origin keeps its detail. Build a [`Scene`] from slices, or load one with [`Scene::load`].

mod assets;
mod bounds;
mod camera;
mod file;
mod file_parts;
mod hash;
mod light;
mod lines;
mod material;
mod mesh;
mod mtl;
mod obj;
mod obj_check;
#[cfg(feature = "capi")]
mod parts;
mod shared;
mod texture;
mod validate;
mod validate_indirect;
mod validate_surface;

use std::ops::RangeInclusive;

pub use bounds::{BoundingBox, BoundingSphere};
pub use camera::{Camera, CameraBasis, Intrinsics, Lens};
pub use light::{Light, SpotCone};
pub use material::{Material, Texture};
pub use mesh::Mesh;
#[cfg(feature = "capi")]
pub(crate) use parts::validate_instance;
pub use shared::Shared;
#[cfg(feature = "capi")]
pub(crate) use texture::linear_from_srgb;

/// Radiometric value per band (R, G, B). A monochrome quantity has the same value three times.
pub type Bands = [f64; 3];

/// Everything a frame is computed from.
#[derive(Debug, Clone)]
pub struct Scene {
    pub camera: Camera,
    /// Without a sensor no energy layer is made.
    pub sensor: Option<Sensor>,
    pub lights: Vec<Light>,
    pub meshes: Vec<Shared<Mesh>>,
    /// Indexed by [`Mesh::triangle_materials`].
    pub materials: Vec<Material>,
    /// Indexed by [`Material::kd_texture`].
    pub textures: Vec<Shared<Texture>>,
    /// How direct light is computed.
    pub direct: Direct,
    /// Without it the frame holds direct light only.
    pub indirect: Option<Indirect>,
}

/// What turns the irradiance on a pixel into energy: Q_C = E_C · pixel area · duty cycle · exposure time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Width and height of a pixel, micrometres.
    pub pixel_pitch_um: [f64; 2],
    pub exposure_time_s: f64,
    /// Share of the exposure in which the signal is on, 0 to 1.
    pub duty_cycle: f64,
}

impl Sensor {
    /// SensorPixelArea, m².
    pub fn pixel_area_m2(&self) -> f64 {
        self.pixel_pitch_um[0] * self.pixel_pitch_um[1] * 1e-12
    }

    /// Q_C / E_C: joules per W/m² of irradiance on the pixel.
    pub fn joule_per_irradiance(&self) -> f64 {
        self.pixel_area_m2() * self.duty_cycle * self.exposure_time_s
    }
}

/// How direct light is computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Direct {
    /// `None`: by rays where indirect light casts rays anyway, else from maps.
    pub shadow: Option<Shadow>,
}

/// How V(L,P) of direct light is found. See `docs/model.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shadow {
    /// From a map of what the light sees: its RSM where that is fine enough, else a map of its own.
    Map,
    /// By a ray from P to L among all triangles: exact but for rounding.
    Rays,
}

impl Shadow {
    /// Both, in the order of the documentation.
    pub const ALL: [Shadow; 2] = [Shadow::Map, Shadow::Rays];

    /// The name used in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Shadow::Map => "map",
            Shadow::Rays => "rays",
        }
    }

    /// The way of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|shadow| shadow.name() == name)
    }
}

/// How the single bounce is computed. [`Scene::validate`] says what goes together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Indirect {
    pub estimator: Estimator,
    /// Texels along one edge of a face of the reflective shadow map. `None`: the engine chooses, which takes
    /// [`Visibility::Rays`].
    pub rsm_size: Option<u32>,
    pub visibility: Visibility,
    /// relRMSE of the indirect light that is asked for, sqrt(Σ(x−t)²/Σt²), within [`TARGET_ERRORS`]. With [`Visibility::Rays`]
    /// t is the true bounce, and `None` is [`DEFAULT_TARGET_ERROR`]; with [`Visibility::None`] t is the sum over all VPLs, and
    /// `None` is that sum itself at every pixel.
    pub target_error: Option<f64>,
}

/// The target error where rays are cast and none is given.
pub const DEFAULT_TARGET_ERROR: f64 = 0.02;
/// Target errors that can be asked for.
pub const TARGET_ERRORS: RangeInclusive<f64> = 0.002..=0.5;

impl Indirect {
    /// The estimator's sum over a reflective shadow map of this size at every pixel, without visibility.
    pub const fn plain_sum(estimator: Estimator, rsm_size: u32) -> Self {
        Indirect {
            estimator,
            rsm_size: Some(rsm_size),
            visibility: Visibility::None,
            target_error: None,
        }
    }

    /// The target error in force; `None` for a plain sum at every pixel.
    pub fn asked_error(&self) -> Option<f64> {
        match self.visibility {
            Visibility::None => self.target_error,
            Visibility::Rays => Some(self.target_error.unwrap_or(DEFAULT_TARGET_ERROR)),
        }
    }
}

/// How V(P,Q) of indirect light is found. See `docs/model.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Visibility {
    /// Not at all: V = 1, the plain sum over all virtual point lights.
    None,
    /// By rays among all triangles, as many as the target error takes.
    Rays,
}

impl Visibility {
    /// Both, in the order of the documentation.
    pub const ALL: [Visibility; 2] = [Visibility::None, Visibility::Rays];

    /// The name used in scene files, on the command line and in image headers.
    pub fn name(self) -> &'static str {
        match self {
            Visibility::None => "none",
            Visibility::Rays => "rays",
        }
    }

    /// The way of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|v| v.name() == name)
    }
}

/// The two named estimators of the indirect light. See `docs/model.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// The CamSim document's equation: the mean over the RSM, without distance falloff between Q and P.
    RsmAverage,
    /// The same integral with its measure kept (Keller 1997): converges to the true single bounce.
    InstantRadiosity,
}

impl Estimator {
    /// Every estimator, in the order of the documentation.
    pub const ALL: [Estimator; 2] = [Estimator::RsmAverage, Estimator::InstantRadiosity];

    /// The name used in scene files, on the command line and in image headers.
    pub fn name(self) -> &'static str {
        match self {
            Estimator::RsmAverage => "rsm-average",
            Estimator::InstantRadiosity => "instant-radiosity",
        }
    }

    /// The estimator of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|e| e.name() == name)
    }

    /// The visibility where none is named: rays, unless the estimator's equation has none.
    pub fn default_visibility(self) -> Visibility {
        match self {
            Estimator::RsmAverage => Visibility::None,
            Estimator::InstantRadiosity => Visibility::Rays,
        }
    }
}
