//! Whether a scene can be rendered at all. What passes here makes no pass divide by zero or read out of bounds.

use glam::DVec3;

use super::validate_surface;
use super::{Bands, Camera, Intrinsics, Lens, Light, Scene, Sensor, SpotCone};
use crate::{Error, Result};

/// Farther from 0 than this, f64 positions no longer hold a tenth of a millimetre.
const FARTHEST_M: f64 = 1e12;
/// Power or irradiance beyond which the device's f32 overflows.
const STRONGEST: f64 = 1e24;
/// A narrower cone is nearer to a ray than f32 can tell.
const NARROWEST_DEG: f64 = 1e-4;

/// Below this angle between view and `up`, the turn of the image about its axis is rounding noise.
const SMALLEST_UP_ANGLE_RAD: f64 = 1e-6;

impl Scene {
    /// Checks everything that the renderer relies on. [`Scene::load`] has done so already; call it for a scene from slices.
    ///
    /// Meshes without triangles, and a scene without meshes, are fine: they render black. Numbers in messages count from
    /// 0, as the slices do.
    ///
    /// # Errors
    /// [`Error::Scene`] naming the part and the value: an image without pixels, a camera without a direction, numbers that
    /// are not finite or out of their range, no light, indices out of range, lists of unequal length.
    pub fn validate(&self) -> Result<()> {
        check(self).map_err(|fault| fault.into_error(self, None))
    }
}

/// A part of a scene that can be at fault.
#[derive(Debug, Clone, Copy)]
pub(super) enum ScenePart {
    Scene,
    Camera,
    Sensor,
    Indirect,
    Light(usize),
    Mesh(usize),
    Material(usize),
    Texture(usize),
}

/// What is wrong with a part; its place is known to the caller only.
pub(super) struct Violation {
    pub part: ScenePart,
    problem: String,
    hint: String,
}

pub(super) type Check = std::result::Result<(), Violation>;

impl Violation {
    /// `place`: file and line, where there is a file.
    pub fn into_error(self, scene: &Scene, place: Option<&str>) -> Error {
        let part = match self.part {
            ScenePart::Scene => "scene".into(),
            ScenePart::Camera => "camera".into(),
            ScenePart::Sensor => "sensor".into(),
            ScenePart::Indirect => "indirect".into(),
            ScenePart::Light(i) => format!("light {i} ({})", scene.lights[i].kind()),
            ScenePart::Mesh(i) => format!("mesh {i} (\"{}\")", scene.meshes[i].name),
            ScenePart::Material(i) => format!("material {i} (\"{}\")", scene.materials[i].name),
            ScenePart::Texture(i) => format!("texture {i} (\"{}\")", scene.textures[i].name),
        };
        self.at(place.map_or(part.clone(), |place| format!("{place}, {part}")))
    }

    /// The error for a fault at this place.
    pub fn at(self, place: String) -> Error {
        Error::scene(place, self.problem, self.hint)
    }
}

impl ScenePart {
    /// Fails with this part's problem unless `fine`. The problem is only put into words when there is one.
    pub fn require(
        self,
        fine: bool,
        problem: impl FnOnce() -> String,
        hint: impl Into<String>,
    ) -> Check {
        if fine {
            return Ok(());
        }
        Err(Violation {
            part: self,
            problem: problem(),
            hint: hint.into(),
        })
    }

    /// Fails at the first value that is not fine, with the problem of its index and itself.
    pub fn require_each<T>(
        self,
        values: &[T],
        is_fine: impl Fn(&T) -> bool,
        problem: impl FnOnce(usize, &T) -> String,
        hint: &str,
    ) -> Check {
        match values.iter().position(|value| !is_fine(value)) {
            Some(index) => self.require(false, || problem(index, &values[index]), hint),
            None => Ok(()),
        }
    }

    pub fn require_position(self, what: &str, position_m: DVec3) -> Check {
        self.require(
            is_near(position_m),
            || format!("{what} is {position_m}"),
            "give finite coordinates within 1e12 m of 0",
        )
    }

    pub fn require_direction(self, what: &str, direction: DVec3) -> Check {
        self.require(
            has_direction(direction),
            || format!("{what} is {direction}, which has no direction"),
            "give a finite vector of any length but zero",
        )
    }

    fn require_emission(self, what: &str, bands: Bands) -> Check {
        self.require(
            bands.iter().all(|value| (0.0..=STRONGEST).contains(value)),
            || format!("{what} is {bands:?}"),
            "give finite values of 0 or more, up to 1e24",
        )
    }

    fn require_above_zero(self, what: &str, value: f64) -> Check {
        self.require(
            value > 0.0 && value.is_finite(),
            || format!("{what} is {value}"),
            "give a finite value above 0",
        )
    }
}

/// Whether a position is finite and not too far out.
pub(super) fn is_near(position_m: DVec3) -> bool {
    let near = |coordinate_m: f64| coordinate_m.abs() <= FARTHEST_M;
    position_m.to_array().into_iter().all(near)
}

/// Whether a vector can be normalised: the square of its length neither vanishes nor overflows.
pub(super) fn has_direction(vector: DVec3) -> bool {
    vector.length_squared().is_normal()
}

pub(super) fn check(scene: &Scene) -> Check {
    camera(&scene.camera)?;
    if let Some(sensor) = &scene.sensor {
        check_sensor(sensor)?;
    }
    if let Some(indirect) = &scene.indirect {
        indirect.check()?;
    }
    ScenePart::Scene.require(
        !scene.lights.is_empty(),
        || "there is no light".into(),
        "add a light",
    )?;
    for (i, light) in scene.lights.iter().enumerate() {
        check_light(ScenePart::Light(i), light)?;
    }
    validate_surface::check(scene)
}

pub(super) fn camera(camera: &Camera) -> Check {
    let part = ScenePart::Camera;
    let Camera {
        resolution_px: [width, height],
        position_m,
        look_at_m,
        up,
        lens,
    } = *camera;
    part.require(
        width > 0 && height > 0,
        || format!("resolution is {width} x {height} pixels"),
        "give at least 1 x 1",
    )?;
    part.require_position("position", position_m)?;
    part.require_position("look_at", look_at_m)?;
    let view = look_at_m - position_m;
    part.require(
        has_direction(view),
        || format!("position and look_at are both {position_m}"),
        "move look_at to a point in front of the camera",
    )?;
    part.require_direction("up", up)?;
    let sine = view.normalize().cross(up.normalize()).length();
    part.require(
        sine > SMALLEST_UP_ANGLE_RAD,
        || format!("up {up} is parallel to the view from {position_m} to {look_at_m}"),
        "give an up that is at an angle to the view",
    )?;
    match lens {
        Lens::FovY { fov_y_deg } => part.require(
            fov_y_deg > 0.0 && fov_y_deg < 180.0,
            || format!("fov_y_deg is {fov_y_deg}"),
            "give degrees between 0 and 180, both excluded",
        ),
        Lens::Intrinsics(Intrinsics { fx, fy, cx, cy }) => {
            part.require_above_zero("fx", fx)?;
            part.require_above_zero("fy", fy)?;
            part.require(
                cx.is_finite() && cy.is_finite(),
                || format!("cx, cy are {cx}, {cy}"),
                "give the finite pixel coordinates of the principal point",
            )
        }
    }
}

pub(super) fn check_sensor(sensor: &Sensor) -> Check {
    let part = ScenePart::Sensor;
    let Sensor {
        pixel_pitch_um,
        exposure_time_s,
        duty_cycle,
    } = *sensor;
    part.require_above_zero("pixel_pitch_um width", pixel_pitch_um[0])?;
    part.require_above_zero("pixel_pitch_um height", pixel_pitch_um[1])?;
    part.require_above_zero("exposure_time_s", exposure_time_s)?;
    part.require(
        (0.0..=1.0).contains(&duty_cycle),
        || format!("duty_cycle is {duty_cycle}"),
        "give a share from 0 to 1",
    )
}

pub(super) fn check_light(part: ScenePart, light: &Light) -> Check {
    if let Some(position_m) = light.position_m() {
        part.require_position("position", position_m)?;
    }
    if let Some(direction) = light.direction() {
        part.require_direction("direction", direction)?;
    }
    if let Light::Spot { cone, .. } = *light {
        check_cone(part, cone)?;
    }
    part.require_emission(light.emission_name(), light.emission())
}

fn check_cone(part: ScenePart, cone: SpotCone) -> Check {
    let (inner, outer) = (cone.inner_half_angle_deg, cone.outer_half_angle_deg);
    part.require(
        (NARROWEST_DEG..=180.0).contains(&outer),
        || format!("outer_half_angle_deg is {outer}"),
        "give degrees above 0 (1e-4 at least), up to 180",
    )?;
    part.require(
        inner >= 0.0,
        || format!("inner_half_angle_deg is {inner}"),
        "give degrees from 0 up to outer_half_angle_deg",
    )?;
    part.require(
        inner <= outer,
        || format!("inner_half_angle_deg {inner} is larger than outer_half_angle_deg {outer}"),
        "make the inner cone no wider than the outer",
    )
}
