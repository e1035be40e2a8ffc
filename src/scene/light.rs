//! The lights of a scene.

use glam::DVec3;

use super::{AreaShape, Bands, EmissiveSurfaces, PatternAxes, Profile, Shared, SpotCone};

/// A light source L.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// Emits P_L from a point or an area.
    Lamp(Lamp),
    /// Parallel light: irradiance E_L on a surface that faces it.
    Directional {
        /// Direction in which the light travels; any length but zero.
        direction: DVec3,
        irradiance_w_m2: Bands,
    },
}

/// A light with a position. The constructors of [`Light`] make the common ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Lamp {
    /// The middle of an area.
    pub position_m: DVec3,
    /// Axis of the profile, or to the front of an area; any length but zero. Unused by a uniform point.
    pub direction: DVec3,
    /// Towards the plane C = 0 of a pattern, up in a projector's image, or along the height of an area; of any length, not parallel to the
    /// direction. Unused by other lamps.
    pub up: DVec3,
    /// With an area, each of its points emits the profile times the cosine to the front. Only a uniform profile is allowed then.
    pub profile: Profile,
    /// `None`: a point.
    pub area: Option<AreaShape>,
    /// P_L
    pub power_w: Bands,
    /// The surfaces that emit, if the light stands for these. The engine makes it of a scene's materials.
    pub(crate) surfaces: Option<Shared<EmissiveSurfaces>>,
}

/// Every point of a uniform area emits to its front with the cosine: s(θ) = cos θ is the falloff of this cone.
static COSINE: Profile = Profile::Cone(SpotCone {
    inner_half_angle_deg: 0.0,
    outer_half_angle_deg: 90.0,
});

impl Lamp {
    /// What each point of the lamp emits, relative to its peak.
    pub fn profile_of_points(&self) -> &Profile {
        match (self.area, &self.surfaces) {
            (None, None) => &self.profile,
            _ => &COSINE,
        }
    }

    /// Whether the direction is used.
    fn has_direction(&self) -> bool {
        self.area.is_some() || self.profile.has_axis()
    }

    /// Whether the up vector is used.
    fn has_up(&self) -> bool {
        self.area.is_some() || self.profile.has_up()
    }

    /// The axes of the lamp. Where `up` is not used, their rotation about the direction is arbitrary.
    pub fn axes(&self) -> PatternAxes {
        let up = match self.has_up() {
            true => self.up,
            false => any_up(self.direction),
        };
        PatternAxes::new(self.direction, up)
    }

    /// Unit vectors along the width and the height of an area.
    pub(crate) fn area_axes(&self) -> [DVec3; 2] {
        let axes = self.axes();
        [axes.plane_0.cross(axes.direction), axes.plane_0]
    }

    /// A point of the lamp. `place` is in the unit square, which maps evenly to the area.
    pub fn point_m(&self, place: [f64; 2]) -> DVec3 {
        let Some(shape) = self.area else {
            return self.position_m;
        };
        let [right, up] = self.area_axes();
        let [half_width_m, half_height_m] = shape.half_extents_m();
        let [x, y] = shape.across(place);
        self.position_m + x * half_width_m * right + y * half_height_m * up
    }
}

/// An up vector for what looks the same when turned about the direction.
fn any_up(direction: DVec3) -> DVec3 {
    direction.normalize_or(DVec3::Z).any_orthonormal_vector()
}

/// Constructors. Powers are P_L in W, directions have any length but zero.
impl Light {
    /// A point that emits equally in all directions.
    pub fn point(position_m: DVec3, power_w: Bands) -> Light {
        Light::spot(position_m, DVec3::Z, Profile::Uniform, power_w)
    }

    /// A point that emits into a cone about the direction, or with another profile that does not change with a rotation about it.
    pub fn spot(
        position_m: DVec3,
        direction: DVec3,
        profile: impl Into<Profile>,
        power_w: Bands,
    ) -> Light {
        Light::with_profile(position_m, direction, DVec3::Y, profile, power_w)
    }

    /// A measured lamp or a projector. `up` is not parallel to the direction.
    pub fn with_profile(
        position_m: DVec3,
        direction: DVec3,
        up: DVec3,
        profile: impl Into<Profile>,
        power_w: Bands,
    ) -> Light {
        Light::Lamp(Lamp {
            position_m,
            direction,
            up,
            profile: profile.into(),
            area: None,
            power_w,
            surfaces: None,
        })
    }

    /// Emits equally from every point of an area, to its front, with the cosine. A rectangle needs an `up`, which is not parallel to the
    /// direction.
    pub fn area(
        position_m: DVec3,
        direction: DVec3,
        up: impl Into<Option<DVec3>>,
        shape: AreaShape,
        power_w: Bands,
    ) -> Light {
        Light::Lamp(Lamp {
            position_m,
            direction,
            up: up.into().unwrap_or_else(|| any_up(direction)),
            profile: Profile::Uniform,
            area: Some(shape),
            power_w,
            surfaces: None,
        })
    }

    /// Parallel light with irradiance E_L in W/m².
    pub fn directional(direction: DVec3, irradiance_w_m2: Bands) -> Light {
        Light::Directional {
            direction,
            irradiance_w_m2,
        }
    }
}

impl Light {
    /// The lamp; `None` for parallel light.
    pub fn lamp(&self) -> Option<&Lamp> {
        match self {
            Light::Lamp(lamp) => Some(lamp),
            Light::Directional { .. } => None,
        }
    }

    /// The lamp as a mutable reference.
    pub fn lamp_mut(&mut self) -> Option<&mut Lamp> {
        match self {
            Light::Lamp(lamp) => Some(lamp),
            Light::Directional { .. } => None,
        }
    }

    /// Whether the light has an area.
    pub fn has_area(&self) -> bool {
        self.lamp().is_some_and(|lamp| lamp.area.is_some())
    }

    /// The surfaces that emit, if the light stands for these.
    pub(crate) fn surfaces(&self) -> Option<&EmissiveSurfaces> {
        self.lamp()?.surfaces.as_deref()
    }

    /// The light's parameters, by their names in headers and manifests: a number, a position, a direction, or a value per band.
    pub fn parameters(&self) -> Vec<(&'static str, Vec<f64>)> {
        let vectors = [
            ("position_m", self.position_m()),
            ("direction", self.direction()),
            ("up", self.up()),
        ];
        let given = vectors.into_iter();
        let given = given.filter_map(|(name, vector)| Some((name, vector?.to_array().to_vec())));
        let mut parameters: Vec<_> = given.collect();
        if let Some(lamp) = self.lamp() {
            let numbers = lamp.profile.numbers().into_iter();
            let numbers = numbers.flat_map(|numbers| numbers.named_values());
            parameters.extend(
                numbers.filter_map(|(row, value)| Some((row.name, vec![value?.number()?]))),
            );
            parameters.extend(lamp.area.map(AreaShape::parameter));
        }
        parameters.push((self.emission_name(), self.emission().to_vec()));
        parameters
    }

    /// L, metres; `None` for a directional light.
    pub fn position_m(&self) -> Option<DVec3> {
        self.lamp().map(|lamp| lamp.position_m)
    }

    /// The position as a mutable reference.
    pub fn position_m_mut(&mut self) -> Option<&mut DVec3> {
        self.lamp_mut().map(|lamp| &mut lamp.position_m)
    }

    /// Axis of the cone or pattern, front of an area, or direction of parallel light, of any length but zero; `None` for a point light.
    pub fn direction(&self) -> Option<DVec3> {
        match self {
            Light::Lamp(lamp) => lamp.has_direction().then_some(lamp.direction),
            Light::Directional { direction, .. } => Some(*direction),
        }
    }

    /// The direction as a mutable reference.
    pub fn direction_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Light::Lamp(lamp) => lamp.has_direction().then_some(&mut lamp.direction),
            Light::Directional { direction, .. } => Some(direction),
        }
    }

    /// The up vector of a pattern or an area, of any length; `None` for other lights.
    pub fn up(&self) -> Option<DVec3> {
        let lamp = self.lamp().filter(|lamp| lamp.has_up());
        lamp.map(|lamp| lamp.up)
    }

    /// The up vector as a mutable reference.
    pub fn up_mut(&mut self) -> Option<&mut DVec3> {
        let lamp = self.lamp_mut().filter(|lamp| lamp.has_up());
        lamp.map(|lamp| &mut lamp.up)
    }

    /// The emission of the light: P_L in W, or E_L in W/m² for a directional light.
    pub fn emission(&self) -> Bands {
        match self {
            Light::Lamp(lamp) => lamp.power_w,
            Light::Directional {
                irradiance_w_m2, ..
            } => *irradiance_w_m2,
        }
    }

    /// The name of the emission parameter.
    pub fn emission_name(&self) -> &'static str {
        match self {
            Light::Lamp(_) => "power_w",
            Light::Directional { .. } => "irradiance_w_m2",
        }
    }

    /// The same light with another emission: P_L in W, or E_L in W/m² for a directional light.
    pub fn with_emission(&self, emission: Bands) -> Light {
        let mut light = self.clone();
        match &mut light {
            Light::Lamp(lamp) => lamp.power_w = emission,
            Light::Directional {
                irradiance_w_m2, ..
            } => *irradiance_w_m2 = emission,
        }
        light
    }
}
