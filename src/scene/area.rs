//! Area lights.

use std::f64::consts::TAU;

use super::validate::Part;
use crate::Result;

/// The shape of an area light, seen from its front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AreaShape {
    /// Its width, and its height along `up`.
    Rectangle {
        size_m: [f64; 2],
    },
    Disc {
        radius_m: f64,
    },
}

impl AreaShape {
    /// The name in scene files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            AreaShape::Rectangle { .. } => "size",
            AreaShape::Disc { .. } => "radius",
        }
    }

    /// Its extent, by its name in headers and manifests.
    pub(super) fn parameter(self) -> (&'static str, Vec<f64>) {
        match self {
            AreaShape::Rectangle { size_m } => ("size_m", size_m.into()),
            AreaShape::Disc { radius_m } => ("radius_m", vec![radius_m]),
        }
    }

    pub(super) fn validate(self, part: &Part) -> Result<()> {
        let (name, lengths_m) = self.parameter();
        lengths_m
            .into_iter()
            .try_for_each(|length_m| part.require_above_zero(name, length_m))
    }

    /// Half the width and half the height, metres.
    pub(crate) fn half_extents_m(self) -> [f64; 2] {
        match self {
            AreaShape::Rectangle { size_m } => size_m.map(|size_m| 0.5 * size_m),
            AreaShape::Disc { radius_m } => [radius_m; 2],
        }
    }

    /// Maps a place in the unit square evenly to the shape, in half extents from the middle.
    pub(super) fn across(self, [x, y]: [f64; 2]) -> [f64; 2] {
        match self {
            AreaShape::Rectangle { .. } => [2.0 * x - 1.0, 2.0 * y - 1.0],
            AreaShape::Disc { .. } => {
                let (sin, cos) = (TAU * y).sin_cos();
                [x.sqrt() * cos, x.sqrt() * sin]
            }
        }
    }
}
