//! The light that reaches a point, and rays sampled from the emission. Lengths are local units.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::{brdf::around, emissive::EmissiveSides, rays::Ray, surface::Surfaces};
use crate::scene::{AreaShape, Lamp, Light, Pattern, Profile, ProjectedImage, SpotCone};

/// Radius of a sphere around the local space.
const SCENE_RADIUS: f64 = 1.733;

/// Rounding error of the point where a ray meets the surface that contains a lamp, relative to the lamp's distance from the origin plus
/// the scene's size. Rays keep this distance from the lamp, so its own surface does not block it and it lights both sides.
const LAMP_ROUNDING: f64 = 1e-13;

/// Its falloff is the cosine, with which an area emits.
const COSINE: SpotCone = SpotCone {
    inner_half_angle_deg: 0.0,
    outer_half_angle_deg: 90.0,
};

/// A light, ready for sampling.
#[derive(Debug, Clone)]
pub enum Emitter {
    Lamp {
        position: DVec3,
        beam: Beam,
        /// I where the beam's shape is 1, over the square of the local unit: I/d² is W/m².
        intensity: DVec3,
        area: Option<Area>,
    },
    Parallel {
        travel: DVec3,
        irradiance: DVec3,
    },
    /// Those of the scene.
    Surfaces(EmissiveSides),
}

/// The area of a lamp, centred at its position. A sample picks a point uniformly, and this point then sends all of the lamp's light.
#[derive(Debug, Clone, Copy)]
pub struct Area {
    /// Vectors to the middles of two edges, or to two points of the rim.
    half_axes: [DVec3; 2],
    is_round: bool,
}

impl Area {
    fn new(lamp: &Lamp, shape: AreaShape, metres_per_unit: f64) -> Area {
        let axis = lamp.direction.normalize();
        let height = lamp.up.reject_from(axis).normalize();
        let width = height.cross(axis);
        let (extents_m, is_round) = match shape {
            AreaShape::Rectangle { size_m } => (size_m.map(|size_m| size_m / 2.0), false),
            AreaShape::Disc { radius_m } => ([radius_m; 2], true),
        };
        let [across, along] = extents_m.map(|extent_m| extent_m / metres_per_unit);
        Area {
            half_axes: [across * width, along * height],
            is_round,
        }
    }
}

/// The directions in which each point of a lamp shines.
#[derive(Debug, Clone)]
pub struct Beam {
    /// C = 0, C = 90°, γ = 0. Only the last one is used where the first two make no difference.
    axes: [DVec3; 3],
    profile: Profile,
    /// The angle to the axis beyond which there is no light.
    widest_rad: f64,
}

impl Beam {
    /// Of a point of an area with this normal: the cosine to it.
    pub fn of_area(normal: DVec3, widest_rad: f64) -> Beam {
        let (first, second) = normal.any_orthonormal_pair();
        Beam {
            axes: [first, second, normal],
            profile: Profile::Cone(COSINE),
            widest_rad,
        }
    }

    fn new(lamp: &Lamp) -> Beam {
        let axis = lamp.direction.normalize();
        let first = (lamp.up - lamp.up.dot(axis) * axis).normalize();
        let profile = match lamp.area {
            None => lamp.profile.clone(),
            Some(_) => Profile::Cone(COSINE),
        };
        Beam {
            // Counterclockwise when looking along the direction.
            axes: [first, first.cross(axis), axis],
            widest_rad: widest_rad(&profile),
            profile,
        }
    }

    /// The share of the intensity in a direction (unit vector).
    fn shape(&self, direction: DVec3) -> f64 {
        match &self.profile {
            Profile::Uniform => 1.0,
            Profile::Cone(cone) => falloff(angle(self.axes[2], direction), half_angles_rad(cone)),
            Profile::Measured(pattern) => measured_intensity(pattern, self.along(direction)),
            Profile::Projected(image) => projected_intensity(image, self.along(direction)),
        }
    }

    /// The components of a direction.
    fn along(&self, direction: DVec3) -> [f64; 3] {
        self.axes.map(|axis| direction.dot(axis))
    }

    /// ∫ of the shape over all directions, sr.
    fn solid_angle(&self) -> f64 {
        match &self.profile {
            Profile::Uniform => 4.0 * PI,
            Profile::Cone(cone) => weighted_solid_angle(half_angles_rad(cone)),
            Profile::Measured(pattern) => measured_solid_angle(pattern),
            Profile::Projected(image) => {
                let pixel = 1.0 / image.intrinsics.fx / image.intrinsics.fy;
                let values = image.values.iter();
                values.map(|&value| f64::from(value) * pixel).sum()
            }
        }
    }
}

/// How a light illuminates a point.
#[derive(Debug, Clone, Copy)]
pub struct Illumination {
    /// Unit vector to the light.
    pub to_light: DVec3,
    /// Irradiance of a surface facing the light, W/m².
    pub facing: DVec3,
    /// Density of [`Emitter::sample`] over a surface facing the light, per square unit.
    pub density: f64,
    /// Distance to just before the light.
    pub distance: f64,
    /// Distance to the light; infinite for parallel light.
    pub length: f64,
}

impl Emitter {
    pub fn new(light: &Light, to_local: impl Fn(DVec3) -> DVec3, metres_per_unit: f64) -> Emitter {
        match light {
            Light::Lamp(lamp) => {
                let beam = Beam::new(lamp);
                let squared_unit = metres_per_unit.powi(2);
                Emitter::Lamp {
                    position: to_local(lamp.position_m),
                    intensity: DVec3::from(lamp.power_w) / (beam.solid_angle() * squared_unit),
                    beam,
                    area: lamp
                        .area
                        .map(|shape| Area::new(lamp, shape, metres_per_unit)),
                }
            }
            Light::Directional {
                direction,
                irradiance_w_m2,
            } => Emitter::Parallel {
                travel: direction.normalize(),
                irradiance: (*irradiance_w_m2).into(),
            },
        }
    }

    /// The lamp at a point of its area, uniformly sampled by two numbers in 0 to 1; `None` without an area.
    pub fn at_point(&self, [u, v]: [f64; 2], surfaces: &Surfaces) -> Option<Emitter> {
        if let Emitter::Surfaces(sides) = self {
            return sides.at_point([u, v], surfaces);
        }
        let Emitter::Lamp {
            position,
            beam,
            intensity,
            area: Some(area),
        } = self
        else {
            return None;
        };
        let [x, y] = if area.is_round {
            let (sin, cos) = (TAU * u).sin_cos();
            [v.sqrt() * cos, v.sqrt() * sin]
        } else {
            [2.0 * u - 1.0, 2.0 * v - 1.0]
        };
        Some(Emitter::Lamp {
            position: *position + x * area.half_axes[0] + y * area.half_axes[1],
            beam: beam.clone(),
            intensity: *intensity,
            area: None,
        })
    }

    pub fn has_area(&self) -> bool {
        matches!(
            self,
            Emitter::Lamp { area: Some(_), .. } | Emitter::Surfaces(_)
        )
    }

    /// Infinite for parallel light.
    pub fn distance_to(&self, point: DVec3) -> f64 {
        match self {
            Emitter::Parallel { .. } | Emitter::Surfaces(_) => f64::INFINITY,
            Emitter::Lamp { position, .. } => position.distance(point),
        }
    }

    /// `None` if the light sends nothing to the point, and for surfaces, whose points are lamps.
    pub fn illuminate(&self, point: DVec3) -> Option<Illumination> {
        match *self {
            Emitter::Surfaces(_) => None,
            Emitter::Parallel { travel, irradiance } => Some(Illumination {
                to_light: -travel,
                facing: irradiance,
                density: 1.0 / (PI * SCENE_RADIUS * SCENE_RADIUS),
                distance: f64::INFINITY,
                length: f64::INFINITY,
            }),
            Emitter::Lamp {
                position,
                ref beam,
                intensity,
                ..
            } => {
                let offset = position - point;
                let distance_squared = offset.length_squared();
                let distance = distance_squared.sqrt();
                let to_light = offset / distance;
                if !to_light.is_finite() {
                    return None;
                }
                let share = beam.shape(-to_light);
                (share > 0.0).then(|| Illumination {
                    to_light,
                    facing: intensity * share / distance_squared,
                    density: 1.0 / (cap_solid_angle(beam.widest_rad) * distance_squared),
                    distance: distance - clearance(position),
                    length: distance,
                })
            }
        }
    }

    /// A ray that the light emits, uniform over its directions (parallel light: over a disc across the scene). `u` is uniform in 0 to 1.
    pub fn sample(&self, u: [f64; 2]) -> Ray {
        let (origin, direction) = match *self {
            Emitter::Parallel { travel, .. } => {
                let (x, y) = travel.any_orthonormal_pair();
                let (sin_turn, cos_turn) = (TAU * u[1]).sin_cos();
                let across = SCENE_RADIUS * u[0].sqrt() * (x * cos_turn + y * sin_turn);
                (across - 2.0 * SCENE_RADIUS * travel, travel)
            }
            Emitter::Lamp {
                position, ref beam, ..
            } => in_cone(position, beam.axes[2], beam.widest_rad, u),
            // Its points are sampled instead.
            Emitter::Surfaces(_) => (DVec3::ZERO, DVec3::Z),
        };
        Ray::half_line(origin, direction)
    }
}

/// Origin and direction of a ray, uniformly sampled in a cone.
fn in_cone(position: DVec3, axis: DVec3, outer_rad: f64, u: [f64; 2]) -> (DVec3, DVec3) {
    // 1 − cos θ is uniform in the solid angle. The half angle keeps its digits for narrow cones.
    let half_sine = (0.5 * outer_rad).sin();
    let versine = 2.0 * half_sine * half_sine * u[0];
    let sine = (versine * (2.0 - versine)).max(0.0).sqrt();
    let across = around(axis, 0.0, u[1]);
    let direction = axis * (1.0 - versine) + across * sine;
    (position + clearance(position) * direction, direction)
}

/// The angle beyond which there is no light: the node after the last one at which any plane is lit.
fn widest_measured_rad(pattern: &Pattern) -> f64 {
    let rows = pattern.gammas_rad.len();
    let mut widest = 1;
    for (i, &value) in pattern.intensities.iter().enumerate() {
        if value > 0.0 {
            widest = widest.max((i % rows + 1).min(rows - 1));
        }
    }
    pattern.gammas_rad[widest].min(PI)
}

fn widest_rad(profile: &Profile) -> f64 {
    match profile {
        Profile::Uniform => PI,
        Profile::Cone(cone) => cone.outer_half_angle_deg.to_radians(),
        Profile::Measured(pattern) => widest_measured_rad(pattern),
        Profile::Projected(image) => {
            let [width, height] = image.size_px.map(f64::from);
            let lens = image.intrinsics;
            let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]];
            let tangents =
                corners.map(|[x, y]| ((x - lens.cx) / lens.fx).hypot((y - lens.cy) / lens.fy));
            tangents.into_iter().fold(0.0, f64::max).atan()
        }
    }
}

/// The projected image's intensity in a direction, given by its components along up, left and the axis: the pixel's value on a screen
/// across the axis, over cos³.
fn projected_intensity(image: &ProjectedImage, [up, left, ahead]: [f64; 3]) -> f64 {
    let lens = image.intrinsics;
    let column = lens.cx - lens.fx * left / ahead;
    let row = lens.cy - lens.fy * up / ahead;
    let [width, height] = image.size_px.map(f64::from);
    let is_inside = ahead > 0.0 && column >= 0.0 && row >= 0.0 && column < width && row < height;
    if !is_inside {
        return 0.0;
    }
    let index = row as usize * image.size_px[0] as usize + column as usize;
    let cosine = ahead / DVec3::new(up, left, ahead).length();
    f64::from(image.values[index]) / cosine.powi(3)
}

/// The pattern in a direction, given by its components along C = 0, C = 90° and γ = 0. Between the nodes it is linear in both angles.
fn measured_intensity(pattern: &Pattern, [x, y, z]: [f64; 3]) -> f64 {
    let (gamma, plane) = (x.hypot(y).atan2(z), y.atan2(x).rem_euclid(TAU));
    let cell = |nodes: &[f64], value: f64| {
        let mut i = 0;
        while i + 2 < nodes.len() && nodes[i + 1] < value {
            i += 1;
        }
        let share = (value - nodes[i]) / (nodes[i + 1] - nodes[i]);
        (i, share.min(1.0))
    };
    let rows = pattern.gammas_rad.len();
    if gamma < pattern.gammas_rad[0] || gamma > pattern.gammas_rad[rows - 1] {
        return 0.0;
    }
    let (row, along) = cell(&pattern.gammas_rad, gamma);
    let (column, across) = cell(&pattern.planes_rad, plane);
    let corner = |column: usize, row: usize| pattern.intensities[column * rows + row];
    (1.0 - across) * ((1.0 - along) * corner(column, row) + along * corner(column, row + 1))
        + across * ((1.0 - along) * corner(column + 1, row) + along * corner(column + 1, row + 1))
}

/// ∫ p dω by Simpson's rule in each interval of γ, where the integrand is smooth; in C it is linear.
fn measured_solid_angle(pattern: &Pattern) -> f64 {
    const PARTS: u32 = 8;
    let rows = pattern.gammas_rad.len();
    let mut sum = 0.0;
    for (column, planes) in pattern.planes_rad.windows(2).enumerate() {
        for (row, gammas) in pattern.gammas_rad.windows(2).enumerate() {
            let corner = |c: usize, r: usize| pattern.intensities[(column + c) * rows + row + r];
            let [low, high] = [0, 1].map(|r| 0.5 * (corner(0, r) + corner(1, r)));
            let width = gammas[1] - gammas[0];
            let ring = |half_parts: u32| {
                let share = f64::from(half_parts) / f64::from(2 * PARTS);
                (low + share * (high - low)) * (gammas[0] + share * width).sin()
            };
            let parts = (0..PARTS).map(|i| ring(2 * i) + 4.0 * ring(2 * i + 1) + ring(2 * i + 2));
            let simpson = parts.sum::<f64>() * width / f64::from(6 * PARTS);
            sum += simpson * (planes[1] - planes[0]);
        }
    }
    sum
}

fn clearance(lamp: DVec3) -> f64 {
    LAMP_ROUNDING * (1.0 + lamp.length())
}

/// θ_i, θ_o
fn half_angles_rad(cone: &SpotCone) -> [f64; 2] {
    [cone.inner_half_angle_deg, cone.outer_half_angle_deg].map(f64::to_radians)
}

/// s(θ)
fn falloff(theta_rad: f64, [inner_rad, outer_rad]: [f64; 2]) -> f64 {
    if theta_rad <= inner_rad {
        1.0
    } else if theta_rad < outer_rad {
        (FRAC_PI_2 * (theta_rad - inner_rad) / (outer_rad - inner_rad)).cos()
    } else {
        0.0
    }
}

/// Solid angle within θ of an axis, sr.
fn cap_solid_angle(theta_rad: f64) -> f64 {
    let half_sine = (0.5 * theta_rad).sin();
    4.0 * PI * half_sine * half_sine
}

/// ∫ s(θ) dω: the cap within θ_i, and the rest by Simpson's rule. The integrand is smooth. The sum has terms of one sign, so it keeps its
/// digits for narrow cones.
fn weighted_solid_angle([inner_rad, outer_rad]: [f64; 2]) -> f64 {
    const PARTS: u32 = 1024;
    let half_part = 0.5 * (outer_rad - inner_rad) / f64::from(PARTS);
    let ring = |half_parts: u32| {
        let theta = inner_rad + half_part * f64::from(half_parts);
        falloff(theta, [inner_rad, outer_rad]) * theta.sin()
    };
    let parts = (0..PARTS).map(|i| ring(2 * i) + 4.0 * ring(2 * i + 1) + ring(2 * i + 2));
    cap_solid_angle(inner_rad) + TAU * half_part / 3.0 * parts.sum::<f64>()
}

/// Angle between unit vectors, rad; small angles keep their digits.
fn angle(a: DVec3, b: DVec3) -> f64 {
    2.0 * (a - b).length().atan2((a + b).length())
}
