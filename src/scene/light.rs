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
    /// Emits P_L as a lamp was measured to do, or as a projector.
    Pattern {
        position_m: DVec3,
        /// γ = 0; any length but zero.
        direction: DVec3,
        /// Towards the plane C = 0; of any length, at an angle to the direction.
        up: DVec3,
        pattern: RadiationPattern,
        power_w: Bands,
    },
    /// Emits P_L from every point of an area alike, to its front and there with the cosine.
    Area {
        /// The middle.
        position_m: DVec3,
        /// To the front; any length but zero.
        direction: DVec3,
        /// Along the height of a rectangle; of any length, at an angle to the direction.
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
    /// The words that name kinds in scene files. A new one comes last: scene hashes count them.
    pub const KINDS: [&str; 6] = [
        "point",
        "spot",
        "directional",
        "pattern",
        "projector",
        "area",
    ];

    /// The word that names this kind in scene files.
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

    /// The axes of a pattern.
    pub fn pattern_axes(&self) -> Option<PatternAxes> {
        match self {
            Light::Pattern { direction, up, .. } => Some(PatternAxes::new(*direction, *up)),
            _ => None,
        }
    }

    /// What the light is, by the names that headers and manifests have: a number; or a position, a direction, or a value per band.
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

    /// The same, to be changed.
    pub fn position_m_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Light::Point { position_m, .. }
            | Light::Spot { position_m, .. }
            | Light::Pattern { position_m, .. }
            | Light::Area { position_m, .. } => Some(position_m),
            Light::Directional { .. } => None,
        }
    }

    /// Axis of the cone or pattern, the front of an area, or direction in which parallel light travels, of any length but zero; `None` for a point light.
    pub fn direction(&self) -> Option<DVec3> {
        match *self {
            Light::Spot { direction, .. }
            | Light::Directional { direction, .. }
            | Light::Pattern { direction, .. }
            | Light::Area { direction, .. } => Some(direction),
            Light::Point { .. } => None,
        }
    }

    /// The same, to be changed.
    pub fn direction_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Light::Spot { direction, .. }
            | Light::Directional { direction, .. }
            | Light::Pattern { direction, .. }
            | Light::Area { direction, .. } => Some(direction),
            Light::Point { .. } => None,
        }
    }

    /// Which way up a pattern or an area is, of any length; `None` for others.
    pub fn up(&self) -> Option<DVec3> {
        match *self {
            Light::Pattern { up, .. } | Light::Area { up, .. } => Some(up),
            _ => None,
        }
    }

    /// The same, to be changed.
    pub fn up_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Light::Pattern { up, .. } | Light::Area { up, .. } => Some(up),
            _ => None,
        }
    }

    /// What the light emits: P_L in W, or E_L in W/m² of a directional light.
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

    /// The name of that value.
    pub fn emission_name(&self) -> &'static str {
        match self {
            Light::Directional { .. } => "irradiance_w_m2",
            _ => "power_w",
        }
    }

    /// The same light, emitting this: P_L in W, or E_L in W/m² of a directional light.
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
