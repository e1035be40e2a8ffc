//! Checks whether a scene can be rendered. A valid scene makes no pass divide by zero or read out of bounds.

use std::collections::{HashMap, hash_map::Entry};
use std::fmt::Display;

use glam::{DVec2, DVec3, UVec2};

use super::{
    BoundingBox, Camera, Distortion, Intrinsics, Lens, Light, PixelSampling, Profile, Scene,
    Sensor, Shadow, Vignetting, VignettingMap, camera::halve,
};
use crate::{Error, Result, keys::Keys};

/// The largest distance from 0. Beyond it, f64 positions no longer resolve a tenth of a millimetre.
const FARTHEST_M: f64 = 1e12;
/// The largest power, irradiance or radiance. Beyond it, the device's f32 overflows.
pub(super) const STRONGEST: f64 = 1e24;

/// Below this angle between view and `up`, the rotation of the image about its axis is rounding noise.
const SMALLEST_UP_ANGLE_RAD: f64 = 1e-6;

/// Fields of a scene, and what scene files call them, where the names differ. Errors name the fields of a host, which has no file.
const KEYS: [(&str, &str); 7] = [
    ("resolution_px", "resolution"),
    ("position_m", "position"),
    ("look_at_m", "look_at"),
    ("size_m", "size"),
    ("radius_m", "radius"),
    ("phase_count", "phases"),
    ("list it in ambient_lights", "give it modulated = false"),
];

/// File and line of each part that was read, by its kind and index.
#[derive(Default)]
pub(crate) struct Places {
    /// For a part that has no line.
    file: Option<String>,
    parts: HashMap<(&'static str, usize), String>,
    /// Of a part's keys.
    keys: HashMap<(&'static str, usize, String), String>,
}

impl Places {
    pub fn new(file: String) -> Self {
        Places {
            file: Some(file),
            ..Places::default()
        }
    }

    pub fn insert(&mut self, kind: &'static str, index: usize, at: String) {
        self.parts.insert((kind, index), at);
    }

    /// Also keeps the lines of the table's keys.
    pub fn insert_table(&mut self, kind: &'static str, index: usize, table: &Keys) {
        self.insert(kind, index, table.at.clone());
        self.insert_keys(kind, index, table);
    }

    /// Keeps the lines of the keys of a table that belongs to the part.
    pub fn insert_keys(&mut self, kind: &'static str, index: usize, table: &Keys) {
        let lines = table.lines();
        self.keys
            .extend(lines.map(|(key, at)| ((kind, index, key), at)));
    }

    /// Names the keys of a scene file instead of the fields of a scene.
    fn in_keys(&self, text: String) -> String {
        if self.file.is_none() {
            return text;
        }
        let replaced = |text: String, (field, key): &(&str, &str)| text.replace(field, key);
        KEYS.iter().fold(text, replaced)
    }

    /// The line of the key with which the problem begins, or else that of the part.
    fn of(&self, kind: &'static str, index: usize, problem: &str) -> Option<&String> {
        let key = problem.split(' ').next().unwrap_or_default();
        let key = self.keys.get(&(kind, index, key.into()));
        key.or(self.parts.get(&(kind, index)))
            .or(self.file.as_ref())
    }
}

impl Scene {
    /// Checks everything that the renderer relies on. [`Scene::load`] calls it; call it yourself for a scene built from slices.
    ///
    /// Meshes without triangles and scenes without meshes or lights are valid: they render black. Numbers in messages count from 0, as the slices do.
    ///
    /// # Errors
    /// [`Error::Scene`] with the part and the value: an image without pixels, a camera without a direction, numbers that are not finite or
    /// out of range, indices out of range, lists of unequal length.
    pub fn validate(&self) -> Result<()> {
        self.validate_read(&Places::default())
    }

    /// Validates a scene that was read from these places.
    pub(crate) fn validate_read(&self, places: &Places) -> Result<()> {
        let placed = |kind, index, checked: Result<()>| {
            let Err(Error::Scene { at, problem, hint }) = checked else {
                return checked;
            };
            let [problem, hint] = [problem, hint].map(|text| places.in_keys(text));
            let place = places.of(kind, index, &problem);
            let at = place.map_or(at.clone(), |place| format!("{place}, {at}"));
            Err(Error::scene(at, problem, hint))
        };
        placed("camera", 0, self.camera.validate())?;
        if let Some(sensor) = &self.sensor {
            placed("sensor", 0, sensor.validate())?;
            let fitting = match (sensor.vignetting, &self.vignetting_map) {
                (None, None) => self.validate_cosine_falloff(sensor),
                (Some(vignetting), None) => self.validate_vignetting(vignetting),
                (_, Some(map)) => validate_vignetting_map(sensor, map),
            };
            placed("sensor", 0, fitting)?;
        }
        Part("vignetting map".into()).require(
            self.vignetting_map.is_none() || self.sensor.is_some(),
            "it is given without a sensor",
            "give a sensor with an f_number, or leave it out",
        )?;
        if let Some(indirect) = &self.indirect {
            placed("indirect", 0, indirect.validate())?;
            let fitting = self.validate_range_target(indirect);
            placed("indirect", 0, fitting)?;
        }
        for (i, light) in self.lights.iter().enumerate() {
            placed("light", i, light.validate(i))?;
        }
        if let Some(tof) = &self.tof {
            placed("tof", 0, tof.validate())?;
            let fitting = tof.validate_with(&self.lights, self.sensor.as_ref());
            placed("tof", 0, fitting)?;
        }
        for (i, texture) in self.textures.iter().enumerate() {
            placed("texture", i, texture.validate(i))?;
        }
        for (i, material) in self.materials.iter().enumerate() {
            placed("material", i, material.validate(i, self.textures.len()))?;
            let encodings = material.validate_encodings(i, |role, texture| {
                !role.may_be_srgb() && self.textures[texture].texels.is_srgb()
            });
            placed("material", i, encodings)?;
        }
        // Check a mesh once, however often it is placed.
        let mut bounds = HashMap::new();
        for (i, instance) in self.meshes.iter().enumerate() {
            let mesh = &instance.mesh;
            if let Entry::Vacant(new) = bounds.entry(mesh.id()) {
                placed("mesh", i, mesh.validate(i, self.materials.len()))?;
                new.insert(BoundingBox::around(mesh.positions_m.iter().copied()));
            }
            placed("mesh", i, instance.validate(i, bounds[&mesh.id()]))?;
        }
        let direct = Part("direct".into()).require(
            self.direct.shadow != Some(Shadow::Map) || !self.has_cutouts(),
            "a shadow map cannot find the shadows of surfaces with cut-outs",
            "set shadow to \"rays\", or leave it out",
        );
        placed("direct", 0, direct)?;
        if let Some(index) = self.lights.iter().position(|light| light.has_area()) {
            let part = Part(format!("light {index} (area)"));
            let fitting = part.require(
                self.direct.shadow != Some(Shadow::Map),
                "a shadow map cannot find the shadows of an area light",
                "set shadow to \"rays\", or leave it out",
            );
            placed("light", index, fitting)?;
            let fitting = part.require(
                self.indirect
                    .is_none_or(|indirect| indirect.sum().is_none()),
                "rsm-average and instant-radiosity do not support area lights",
                "choose final gathering, or a spot light",
            );
            placed("light", index, fitting)?;
        }
        Ok(())
    }
}

impl Scene {
    fn validate_cosine_falloff(&self, sensor: &Sensor) -> Result<()> {
        let distortion = self.camera.distortion();
        let sees_behind = distortion.is_some_and(|lens| lens.sees_behind());
        let has_aperture = sensor.f_number.is_some();
        Part("sensor".into()).require(
            !(sees_behind && has_aperture),
            match distortion {
                Some(Distortion::Equirectangular) => {
                    "f_number is given for a panorama, whose vignetting is not cos⁴"
                }
                _ => "f_number is given for a fisheye lens, whose vignetting is not cos⁴",
            },
            "add vignetting = [k1, k2, k3] or an image, as measured, or remove f_number: E_C is then numerically equal to the radiance",
        )
    }

    /// The polynomial must be above 0 wherever the lens sees.
    fn validate_vignetting(&self, vignetting: Vignetting) -> Result<()> {
        let camera = &self.camera;
        let Intrinsics { cx, cy, .. } = camera.intrinsics_px();
        let size_px = UVec2::from(camera.resolution_px).as_dvec2();
        let nearest_px = DVec2::new(cx, cy).clamp(DVec2::ZERO, size_px);
        let farthest_px = camera.farthest_seen_px();
        let [least, most] = [nearest_px, farthest_px].map(|place| camera.squared_radius(place));
        let darkest = vignetting.darkest(least, most);
        if vignetting.at(darkest) > 0.0 {
            return Ok(());
        }
        // On the line from the nearest point to the farthest, the distance from the principal point grows.
        let place_px = |share: f64| nearest_px.lerp(farthest_px, share);
        let share = halve(|share| camera.squared_radius(place_px(share)) < darkest);
        let pixel = place_px(share).floor().min(size_px - 1.0);
        Part("sensor".into()).require(
            false,
            format_args!("vignetting makes the factor {:.3} in pixel ({}, {})", vignetting.at(darkest), pixel.x, pixel.y),
            "give coefficients of a polynomial that is above 0 wherever the lens sees; r = 1 is half the image's diagonal",
        )
    }

    /// An error of range is one of the time of flight of single points.
    fn validate_range_target(&self, indirect: &super::IndirectLight) -> Result<()> {
        let part = Part("indirect".into());
        let gather = indirect.gather();
        let has_target = gather.is_some_and(|gather| gather.target_range_error_mm.is_some());
        part.require(
            !has_target || self.tof.is_some(),
            "target_range_error_mm is given, but the scene has no time of flight",
            "add [tof] with its frequencies, or use target_error alone",
        )?;
        part.require(
            !has_target || self.camera.pixel_sampling.is_none(),
            "target_range_error_mm is given, but pixels are averaged over several samples",
            "remove samples from the camera, or use target_error alone",
        )
    }
}

fn validate_vignetting_map(sensor: &Sensor, map: &VignettingMap) -> Result<()> {
    map.validate()?;
    let part = Part("sensor".into());
    part.require(
        sensor.vignetting.is_none(),
        "vignetting is given twice, by coefficients and by a map",
        "leave out one of them: a flat field has all of the vignetting",
    )?;
    part.require(
        sensor.f_number.is_some(),
        "vignetting is given without an f_number",
        "give f_number, too: vignetting only tells how much darker the corners are",
    )
}

/// A part of a scene, as messages name it.
pub(super) struct Part(pub String);

impl Part {
    /// Returns an error with this problem unless `fine`.
    pub fn require(
        &self,
        fine: bool,
        problem: impl Display,
        hint: impl Into<String>,
    ) -> Result<()> {
        if fine {
            Ok(())
        } else {
            Err(Error::scene(&self.0, problem.to_string(), hint))
        }
    }

    /// Returns an error at the first value that is not fine. `problem` describes it by its index and value.
    pub fn require_each<T>(
        &self,
        values: &[T],
        is_fine: impl Fn(&T) -> bool,
        problem: impl Fn(usize, &T) -> String,
        hint: &str,
    ) -> Result<()> {
        let at_fault = values.iter().position(|value| !is_fine(value));
        at_fault.map_or(Ok(()), |i| {
            self.require(false, problem(i, &values[i]), hint)
        })
    }

    pub fn require_position(&self, what: impl Display, position_m: DVec3) -> Result<()> {
        self.require(
            is_near(position_m),
            format_args!("{what} is {position_m}"),
            "give finite coordinates within 1e12 m of 0",
        )
    }

    pub fn require_direction(&self, what: impl Display, direction: DVec3) -> Result<()> {
        self.require(
            has_direction(direction),
            format_args!("{what} is {direction}, which has no direction"),
            "give a finite vector of any length but zero",
        )
    }

    pub fn require_above_zero(&self, what: &str, value: f64) -> Result<()> {
        self.require(
            value > 0.0 && value.is_finite(),
            format_args!("{what} is {value}"),
            "give a finite value above 0",
        )
    }
}

/// Whether a position is finite and not too far from 0.
pub(super) fn is_near(position_m: DVec3) -> bool {
    position_m.abs().cmple(DVec3::splat(FARTHEST_M)).all()
}

/// Whether a vector can be normalised: the square of its length neither vanishes nor overflows.
pub(super) fn has_direction(vector: DVec3) -> bool {
    vector.length_squared().is_normal()
}

impl Camera {
    pub(crate) fn validate(&self) -> Result<()> {
        let part = Part("camera".into());
        let [width, height] = self.resolution_px;
        part.require(
            width > 0 && height > 0,
            format_args!("resolution_px is {width} x {height}"),
            "give at least 1 x 1",
        )?;
        let (from, to, up) = (self.position_m, self.look_at_m, self.up);
        part.require_position("position_m", from)?;
        part.require_position("look_at_m", to)?;
        let view = to - from;
        part.require(
            has_direction(view),
            format_args!("position_m and look_at_m are both {from}"),
            "move look_at_m to a point in front of the camera",
        )?;
        part.require_direction("up", up)?;
        let sine = view.normalize().cross(up.normalize()).length();
        part.require(
            sine > SMALLEST_UP_ANGLE_RAD,
            format_args!("up {up} is parallel to the view from {from} to {to}"),
            "give an up that is at an angle to the view",
        )?;
        if let Some(PixelSampling { samples, .. }) = self.pixel_sampling {
            let most = PixelSampling::MAX_SAMPLES;
            part.require(
                (2..=most).contains(&samples),
                format_args!("samples is {samples}"),
                format!("give 1 for the pixels' centres, or up to {most}"),
            )?;
        }
        match self.lens {
            Lens::FovY { fov_y_deg } => part.require(
                fov_y_deg > 0.0 && fov_y_deg < 180.0,
                format_args!("fov_y_deg is {fov_y_deg}"),
                "give degrees between 0 and 180, both excluded",
            ),
            Lens::FovX { fov_x_deg } => part.require(
                fov_x_deg > 0.0 && fov_x_deg < 180.0,
                format_args!("fov_x_deg is {fov_x_deg}"),
                "give degrees between 0 and 180, both excluded",
            ),
            Lens::Equirectangular => Ok(()),
            Lens::Orthographic { height_m } => {
                part.require_above_zero("height_m of the image", height_m)
            }
            Lens::Intrinsics(intrinsics) => intrinsics.validate(&part),
            Lens::Distorted {
                intrinsics,
                distortion,
            } => {
                intrinsics.validate(&part)?;
                part.require(
                    distortion != Distortion::Equirectangular,
                    "a panorama has intrinsics",
                    "give Lens::Equirectangular, which needs none",
                )?;
                self.validate_distortion(&part)
            }
        }
    }

    /// The lens must see one direction at each point of the image. Each of these points is between the principal point and the border, so
    /// checking the border is enough.
    fn validate_distortion(&self, part: &Part) -> Result<()> {
        if let Some(Distortion::Fisheye(coefficients)) = self.distortion() {
            // What is outside its image circle is black.
            return part.require(
                coefficients.iter().all(|value| value.is_finite()),
                format_args!("the coefficients of the fisheye are {coefficients:?}"),
                "give finite numbers",
            );
        }
        let [width, height] = self.resolution_px;
        let along = |length: u32| (0..=length).map(f64::from);
        let (right, bottom) = (f64::from(width), f64::from(height));
        let rows = along(width).flat_map(|x| [[x, 0.0], [x, bottom]]);
        let columns = along(height).flat_map(|y| [[0.0, y], [right, y]]);
        let folded = rows
            .chain(columns)
            .find(|&[x_px, y_px]| self.unproject(x_px, y_px).is_none());
        let [x_px, y_px] = folded.unwrap_or_default();
        part.require(
            folded.is_none(),
            format_args!(
                "the distorted image folds over, or ends, between the principal point and pixel ({x_px}, {y_px})"
            ),
            "check the coefficients and fx, fy; if the calibration does not reach the image's corners, crop resolution_px",
        )
    }
}

impl Intrinsics {
    fn validate(&self, part: &Part) -> Result<()> {
        let Intrinsics {
            fx,
            fy,
            cx,
            cy,
            skew,
        } = *self;
        part.require_above_zero("fx", fx)?;
        part.require_above_zero("fy", fy)?;
        part.require(
            cx.is_finite() && cy.is_finite(),
            format_args!("cx, cy are {cx}, {cy}"),
            "give the finite pixel coordinates of the principal point",
        )?;
        part.require(
            skew.is_finite(),
            format_args!("skew is {skew}"),
            "give finite pixels, 0 for columns at a right angle to the rows",
        )
    }
}

impl Light {
    pub(crate) fn validate(&self, index: usize) -> Result<()> {
        let part = Part(format!("light {index} ({})", self.kind()));
        if let Some(position_m) = self.position_m() {
            part.require_position("position_m", position_m)?;
        }
        if let Some(direction) = self.direction() {
            part.require_direction("direction", direction)?;
        }
        if let Some(lamp) = self.lamp() {
            lamp.profile.validate(&part)?;
            lamp.area.map_or(Ok(()), |area| area.validate(&part))?;
            part.require(
                lamp.area.is_none() || lamp.profile == Profile::Uniform,
                "its profile is not uniform",
                "give Profile::Uniform: each point of an area emits with the cosine",
            )?;
        }
        if let (Some(direction), Some(up)) = (self.direction(), self.up()) {
            part.require_direction("up", up)?;
            let sine = direction.normalize().cross(up.normalize()).length();
            part.require(
                sine > SMALLEST_UP_ANGLE_RAD,
                format_args!("up {up} is parallel to direction {direction}"),
                "give an up that is at an angle to the direction: the plane C = 0, or the height of an area",
            )?;
        }
        let emission = self.emission();
        let name = self.emission_name();
        part.require(
            emission
                .iter()
                .all(|value| (0.0..=STRONGEST).contains(value)),
            format_args!("{name} is {emission:?}"),
            "give finite values of 0 or more, up to 1e24",
        )
    }
}
