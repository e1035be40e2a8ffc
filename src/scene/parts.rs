//! The checks of [`Scene::validate`](super::Scene::validate) for single parts, for a caller that builds a scene part by part:
//! a fault is placed where it is made, and the scene stays as it was.

use glam::DVec3;

use super::validate::{self, Check, ScenePart};
use super::{Camera, IndirectLight, Light, Material, Mesh, Sensor, Texture, validate_surface};
use crate::Result;

/// The part's own number stands in `place`.
fn placed(check: Check, place: String) -> Result<()> {
    check.map_err(|fault| fault.at(place))
}

impl Camera {
    pub(crate) fn validate(&self) -> Result<()> {
        placed(validate::camera(self), "camera".into())
    }
}

impl Sensor {
    pub(crate) fn validate(&self) -> Result<()> {
        placed(validate::check_sensor(self), "sensor".into())
    }
}

impl IndirectLight {
    pub(crate) fn validate(&self) -> Result<()> {
        placed(self.check(), "indirect".into())
    }
}

impl Light {
    pub(crate) fn validate(&self, index: usize) -> Result<()> {
        let place = format!("light {index} ({})", self.kind());
        placed(validate::check_light(ScenePart::Light(index), self), place)
    }
}

impl Material {
    pub(crate) fn validate(&self, index: usize, texture_count: usize) -> Result<()> {
        let place = format!("material {index} (\"{}\")", self.name);
        let check =
            validate_surface::check_material(ScenePart::Material(index), self, texture_count);
        placed(check, place)
    }
}

impl Texture {
    pub(crate) fn validate(&self, index: usize) -> Result<()> {
        let place = format!("texture {index} (\"{}\")", self.name);
        placed(
            validate_surface::check_texture(ScenePart::Texture(index), self),
            place,
        )
    }
}

impl Mesh {
    pub(crate) fn validate(&self, index: usize, material_count: usize) -> Result<()> {
        let place = format!("mesh {index} (\"{}\")", self.name);
        let check = validate_surface::check_mesh(ScenePart::Mesh(index), self, material_count);
        placed(check, place)
    }
}

/// Where a mesh is placed, and the corners of its box there.
pub(crate) fn validate_instance(
    index: usize,
    position_m: DVec3,
    mut corners_m: impl Iterator<Item = DVec3>,
) -> Result<()> {
    let part = ScenePart::Mesh(index);
    let check = part
        .require_position("position", position_m)
        .and_then(|()| {
            corners_m
                .try_for_each(|corner_m| part.require_position("a corner of its box", corner_m))
        });
    placed(check, format!("instance {index}"))
}
