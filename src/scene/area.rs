//! Area lights.

use std::f64::consts::TAU;

use glam::DVec3;

use super::{Light, PatternAxes, SpotCone};

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

/// Every point of an area light emits to its front with the cosine: s(θ) = cos θ is the falloff of this cone.
const COSINE: SpotCone = SpotCone {
    inner_half_angle_deg: 0.0,
    outer_half_angle_deg: 90.0,
};

impl AreaShape {
    /// The name in scene files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            AreaShape::Rectangle { .. } => "size",
            AreaShape::Disc { .. } => "radius",
        }
    }

    /// Half the width and half the height, metres.
    pub(crate) fn half_extents_m(self) -> [f64; 2] {
        match self {
            AreaShape::Rectangle { size_m } => size_m.map(|size_m| 0.5 * size_m),
            AreaShape::Disc { radius_m } => [radius_m; 2],
        }
    }

    /// Maps a place in the unit square evenly to the shape, in half extents from the middle.
    fn across(self, [x, y]: [f64; 2]) -> [f64; 2] {
        match self {
            AreaShape::Rectangle { .. } => [2.0 * x - 1.0, 2.0 * y - 1.0],
            AreaShape::Disc { .. } => {
                let (sin, cos) = (TAU * y).sin_cos();
                [x.sqrt() * cos, x.sqrt() * sin]
            }
        }
    }
}

impl Light {
    /// Unit vectors along an area light's width and height; `None` for lights without an area.
    pub(crate) fn area_axes(&self) -> Option<[DVec3; 2]> {
        let Light::Area { direction, up, .. } = self else {
            return None;
        };
        let axes = PatternAxes::new(*direction, *up);
        Some([axes.plane_0.cross(axes.direction), axes.plane_0])
    }

    /// The spot light at a point of an area light, with all of its power. `place` is in the unit square, which maps evenly to the area.
    /// `None` for lights without an area.
    pub fn area_point(&self, place: [f64; 2]) -> Option<Light> {
        let Light::Area {
            position_m,
            direction,
            shape,
            power_w,
            ..
        } = *self
        else {
            return None;
        };
        let [right, up] = self.area_axes()?;
        let [half_width_m, half_height_m] = shape.half_extents_m();
        let [x, y] = shape.across(place);
        Some(Light::Spot {
            position_m: position_m + x * half_width_m * right + y * half_height_m * up,
            direction,
            cone: COSINE,
            power_w,
        })
    }

    /// The spot light in the middle of an area light; any other light unchanged.
    pub(crate) fn at_middle(&self) -> Light {
        let middle = match self {
            Light::Area {
                shape: AreaShape::Disc { .. },
                ..
            } => [0.0, 0.0],
            _ => [0.5, 0.5],
        };
        self.area_point(middle).unwrap_or_else(|| self.clone())
    }
}
