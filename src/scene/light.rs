//! The lights of a scene.

use glam::DVec3;

use super::{AreaShape, Bands, PatternAxes, RadiationPattern};

/// A light source L.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// Emits P_L evenly over the sphere.
    Point { position_m: DVec3, power_w: Bands },
    /// Emits P_L into a cone.
    Spot {
        position_m: DVec3,
        /// Axis of the cone; any length but zero.
        direction: DVec3,
        cone: SpotCone,
        power_w: Bands,
    },
    /// Parallel light: irradiance E_L on a surface that faces it.
    Directional {
        /// Direction in which the light travels; any length but zero.
        direction: DVec3,
        irradiance_w_m2: Bands,
    },
    /// Emits P_L with the pattern of a measured lamp or a projector.
    Pattern {
        position_m: DVec3,
        /// γ = 0; any length but zero.
        direction: DVec3,
        /// Towards the plane C = 0; of any length, not parallel to the direction.
        up: DVec3,
        pattern: RadiationPattern,
        power_w: Bands,
    },
    /// Emits P_L equally from every point of an area, to its front, with the cosine.
    Area {
        /// The middle of the area.
        position_m: DVec3,
        /// To the front; any length but zero.
        direction: DVec3,
        /// Along the height of a rectangle; of any length, not parallel to the direction.
        up: DVec3,
        shape: AreaShape,
        power_w: Bands,
    },
}

/// Opening of a spot light: full intensity up to the inner half angle, falling to 0 at the outer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpotCone {
    /// θ_i
    pub inner_half_angle_deg: f64,
    /// θ_o
    pub outer_half_angle_deg: f64,
}

impl Light {
    /// The names of the kinds in scene files. Add new ones at the end: scene hashes use the index.
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
        match self {
            Light::Point { .. } => "point",
            Light::Spot { .. } => "spot",
            Light::Directional { .. } => "directional",
            Light::Area { .. } => "area",
            Light::Pattern { pattern, .. } => match pattern {
                RadiationPattern::Measured(_) => "pattern",
                RadiationPattern::Projected(_) => "projector",
            },
        }
    }

    /// The axes of a pattern; `None` for other lights.
    pub fn pattern_axes(&self) -> Option<PatternAxes> {
        match self {
            Light::Pattern { direction, up, .. } => Some(PatternAxes::new(*direction, *up)),
            _ => None,
        }
    }

    /// The light's parameters, by their names in headers and manifests: a number, a position, a direction, or a value per band.
    pub fn parameters(&self) -> Vec<(&'static str, Vec<f64>)> {
        match self {
            Light::Point {
                position_m,
                power_w,
            } => vec![
                ("position_m", position_m.to_array().into()),
                ("power_w", (*power_w).into()),
            ],
            Light::Spot {
                position_m,
                direction,
                cone,
                power_w,
            } => vec![
                ("position_m", position_m.to_array().into()),
                ("direction", direction.to_array().into()),
                ("inner_half_angle_deg", vec![cone.inner_half_angle_deg]),
                ("outer_half_angle_deg", vec![cone.outer_half_angle_deg]),
                ("power_w", (*power_w).into()),
            ],
            Light::Directional {
                direction,
                irradiance_w_m2,
            } => vec![
                ("direction", direction.to_array().into()),
                ("irradiance_w_m2", (*irradiance_w_m2).into()),
            ],
            Light::Pattern {
                position_m,
                direction,
                up,
                pattern: _,
                power_w,
            } => vec![
                ("position_m", position_m.to_array().into()),
                ("direction", direction.to_array().into()),
                ("up", up.to_array().into()),
                ("power_w", (*power_w).into()),
            ],
            Light::Area {
                position_m,
                direction,
                up,
                shape,
                power_w,
            } => vec![
                ("position_m", position_m.to_array().into()),
                ("direction", direction.to_array().into()),
                ("up", up.to_array().into()),
                match *shape {
                    AreaShape::Rectangle { size_m } => ("size_m", size_m.into()),
                    AreaShape::Disc { radius_m } => ("radius_m", vec![radius_m]),
                },
                ("power_w", (*power_w).into()),
            ],
        }
    }

    /// L, metres; `None` for a directional light.
    pub fn position_m(&self) -> Option<DVec3> {
        match *self {
            Light::Point { position_m, .. }
            | Light::Spot { position_m, .. }
            | Light::Pattern { position_m, .. }
            | Light::Area { position_m, .. } => Some(position_m),
            Light::Directional { .. } => None,
        }
    }

    /// The position as a mutable reference.
    pub fn position_m_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Light::Point { position_m, .. }
            | Light::Spot { position_m, .. }
            | Light::Pattern { position_m, .. }
            | Light::Area { position_m, .. } => Some(position_m),
            Light::Directional { .. } => None,
        }
    }

    /// Axis of the cone or pattern, front of an area, or direction of parallel light, of any length but zero; `None` for a point light.
    pub fn direction(&self) -> Option<DVec3> {
        match *self {
            Light::Spot { direction, .. }
            | Light::Directional { direction, .. }
            | Light::Pattern { direction, .. }
            | Light::Area { direction, .. } => Some(direction),
            Light::Point { .. } => None,
        }
    }

    /// The direction as a mutable reference.
    pub fn direction_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Light::Spot { direction, .. }
            | Light::Directional { direction, .. }
            | Light::Pattern { direction, .. }
            | Light::Area { direction, .. } => Some(direction),
            Light::Point { .. } => None,
        }
    }

    /// The up vector of a pattern or an area, of any length; `None` for other lights.
    pub fn up(&self) -> Option<DVec3> {
        match *self {
            Light::Pattern { up, .. } | Light::Area { up, .. } => Some(up),
            _ => None,
        }
    }

    /// The up vector as a mutable reference.
    pub fn up_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Light::Pattern { up, .. } | Light::Area { up, .. } => Some(up),
            _ => None,
        }
    }

    /// The emission of the light: P_L in W, or E_L in W/m² for a directional light.
    pub fn emission(&self) -> Bands {
        match *self {
            Light::Point { power_w, .. }
            | Light::Spot { power_w, .. }
            | Light::Pattern { power_w, .. }
            | Light::Area { power_w, .. } => power_w,
            Light::Directional {
                irradiance_w_m2, ..
            } => irradiance_w_m2,
        }
    }

    /// The name of the emission parameter.
    pub fn emission_name(&self) -> &'static str {
        match self {
            Light::Directional { .. } => "irradiance_w_m2",
            _ => "power_w",
        }
    }

    /// The same light with another emission: P_L in W, or E_L in W/m² for a directional light.
    pub fn with_emission(&self, emission: Bands) -> Light {
        let mut light = self.clone();
        match &mut light {
            Light::Point { power_w, .. }
            | Light::Spot { power_w, .. }
            | Light::Pattern { power_w, .. }
            | Light::Area { power_w, .. } => *power_w = emission,
            Light::Directional {
                irradiance_w_m2, ..
            } => *irradiance_w_m2 = emission,
        }
        light
    }
}
