//! How a lamp distributes its power over the directions.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::hash::{digest_of_image, digest_of_pattern};
use super::validate::Part;
use super::{
    ConeIntegral, Lamp, Light, Pattern, PatternAxes, PatternIntegral, ProjectedImage, Shared,
    SpotCone,
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
    /// The names of the kinds in scene files. Add new ones at the end: the C interface uses the index.
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
            Some(Lamp { area: Some(_), .. }) => "area",
            Some(lamp) => match lamp.profile {
                Profile::Uniform => "point",
                Profile::Cone(_) => "spot",
                Profile::Measured(_) => "pattern",
                Profile::Projected(_) => "projector",
            },
        }
    }
}

impl Profile {
    /// Whether it differs between directions.
    pub(super) fn has_axis(&self) -> bool {
        !matches!(self, Profile::Uniform)
    }

    /// Whether it changes with a rotation about its axis.
    pub(super) fn has_up(&self) -> bool {
        matches!(self, Profile::Measured(_) | Profile::Projected(_))
    }

    /// The numbers that describe it, by their names in headers and manifests.
    pub(super) fn parameters(&self) -> Vec<(&'static str, Vec<f64>)> {
        match self {
            Profile::Cone(cone) => vec![
                ("inner_half_angle_deg", vec![cone.inner_half_angle_deg]),
                ("outer_half_angle_deg", vec![cone.outer_half_angle_deg]),
            ],
            Profile::Uniform | Profile::Measured(_) | Profile::Projected(_) => Vec::new(),
        }
    }

    /// The digest of what its parameters do not tell.
    pub(super) fn digest(&self) -> Option<[u8; 32]> {
        match self {
            Profile::Uniform | Profile::Cone(_) => None,
            Profile::Measured(pattern) => Some(pattern.digest(digest_of_pattern)),
            Profile::Projected(image) => Some(image.digest(digest_of_image)),
        }
    }

    pub(super) fn validate(&self, part: &Part) -> Result<()> {
        let checked = match self {
            Profile::Uniform => Ok(()),
            Profile::Cone(cone) => return cone.validate(part),
            Profile::Measured(pattern) => pattern.check(),
            Profile::Projected(image) => image.check(),
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
            Profile::Uniform | Profile::Cone(_) => 0,
            Profile::Measured(pattern) => pattern.number_count(),
            Profile::Projected(image) => 4 + image.values.len() as u32,
        }
    }
}
