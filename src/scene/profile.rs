//! How a lamp distributes its power over the directions.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::hash::{digest_of_image, digest_of_pattern};
use super::validate::Part;
use super::{
    ConeIntegral, Lamp, Light, Limits, Parameters, Pattern, PatternAxes, PatternIntegral,
    ProjectedImage, Shared,
    parameters::{check_limits, parameters},
};
use crate::Result;

/// The radiant intensity of a lamp over all directions, relative to its peak.
#[derive(Debug, Clone, PartialEq)]
pub enum Profile {
    /// Equal in all directions.
    Uniform,
    /// A spot light.
    Cone(SpotCone),
    /// A measured lamp.
    Measured(Shared<Pattern>),
    /// A projector. Right in its image points against the plane C = 90°, and down points against C = 0.
    Projected(Shared<ProjectedImage>),
}

/// The narrowest cone. f32 cannot tell a narrower one from a ray.
const NARROWEST_DEG: f64 = 1e-4;

parameters! {
    /// Emits its power into a cone: evenly inside the inner half angle, and nothing outside the outer one.
    pub struct SpotCone {
        /// θ_i, up to which the intensity is full, degrees from the axis; at most `outer_half_angle_deg`.
        inner_half_angle_deg: f64 = 0.0, Limits::between(0.0, f64::INFINITY, "give degrees from 0 up to outer_half_angle_deg"); needs "inner_half_angle_deg = 20.0";
        /// θ_o, beyond which there is no light, degrees from the axis.
        outer_half_angle_deg: f64 = 0.0, Limits::between(NARROWEST_DEG, 180.0, "give degrees above 0 (1e-4 at least), up to 180"); needs "outer_half_angle_deg = 30.0";
    }
}

impl From<SpotCone> for Profile {
    fn from(cone: SpotCone) -> Self {
        Profile::Cone(cone)
    }
}

impl From<Pattern> for Profile {
    fn from(pattern: Pattern) -> Self {
        Profile::Measured(pattern.into())
    }
}

impl From<ProjectedImage> for Profile {
    fn from(image: ProjectedImage) -> Self {
        Profile::Projected(image.into())
    }
}

impl Light {
    /// The names of the kinds in scene files.
    pub const KINDS: [&str; 6] = [
        "point",
        "spot",
        "directional",
        "pattern",
        "projector",
        "area",
    ];

    /// The name of this kind in scene files.
    pub fn kind(&self) -> &'static str {
        match self.lamp() {
            None => "directional",
            Some(Lamp {
                surfaces: Some(_), ..
            }) => "emission",
            Some(Lamp { area: Some(_), .. }) => "area",
            Some(lamp) => lamp.profile.kind(),
        }
    }
}

impl Profile {
    /// The profile of lights of this kind if numbers alone describe it, with the defaults of these.
    pub fn of_kind(kind: &str) -> Option<Profile> {
        let all = [Profile::Uniform, Profile::Cone(SpotCone::DEFAULT)];
        all.into_iter().find(|profile| profile.kind() == kind)
    }

    /// The kind of the lights that have it, without an area.
    pub fn kind(&self) -> &'static str {
        match self {
            Profile::Uniform => "point",
            Profile::Cone(_) => "spot",
            Profile::Measured(_) => "pattern",
            Profile::Projected(_) => "projector",
        }
    }

    /// The numbers that describe it.
    pub fn numbers(&self) -> Option<&dyn Parameters> {
        match self {
            Profile::Cone(cone) => Some(cone),
            _ => None,
        }
    }

    pub fn numbers_mut(&mut self) -> Option<&mut dyn Parameters> {
        match self {
            Profile::Cone(cone) => Some(cone),
            _ => None,
        }
    }

    /// Whether it differs between directions.
    pub fn has_axis(&self) -> bool {
        !matches!(self, Profile::Uniform)
    }

    /// Whether it changes with a rotation about its axis.
    pub(super) fn has_up(&self) -> bool {
        matches!(self, Profile::Measured(_) | Profile::Projected(_))
    }

    /// The digest of what its numbers do not tell.
    pub(super) fn digest(&self) -> Option<[u8; 32]> {
        match self {
            Profile::Measured(pattern) => Some(pattern.digest(digest_of_pattern)),
            Profile::Projected(image) => Some(image.digest(digest_of_image)),
            _ => None,
        }
    }

    pub(super) fn validate(&self, part: &Part) -> Result<()> {
        if let Some(numbers) = self.numbers() {
            check_limits(part, numbers)?;
        }
        let checked = match self {
            Profile::Cone(cone) => return cone.validate(part),
            Profile::Measured(pattern) => pattern.check(),
            Profile::Projected(image) => image.check(),
            _ => Ok(()),
        };
        checked.or_else(|problem| part.require(false, problem, "correct the pattern"))
    }

    /// The relative intensity in a direction of any length but zero. [`Profile::total`] is its integral.
    pub fn intensity(&self, axes: &PatternAxes, towards: DVec3) -> f64 {
        let [gamma_rad, plane_rad] = axes.angles_rad(towards);
        match self {
            Profile::Uniform => 1.0,
            Profile::Cone(cone) => cone.falloff(gamma_rad),
            Profile::Measured(pattern) => pattern.intensity(gamma_rad, plane_rad),
            Profile::Projected(image) => image.intensity(
                [-axes.plane_90, -axes.plane_0, axes.direction].map(|axis| towards.dot(axis)),
            ),
        }
    }

    /// Integral of the relative intensity over all directions, sr.
    pub fn total(&self) -> f64 {
        match self {
            Profile::Uniform => 4.0 * PI,
            Profile::Cone(cone) => TAU * ConeIntegral::new(*cone).falloff_within(PI),
            Profile::Measured(pattern) => PatternIntegral::new(pattern).total(),
            Profile::Projected(image) => image.total(),
        }
    }

    /// Count of the values that it takes on the device.
    pub(crate) fn number_count(&self) -> u32 {
        match self {
            Profile::Measured(pattern) => pattern.number_count(),
            Profile::Projected(image) => 4 + image.values.len() as u32,
            _ => 0,
        }
    }
}
