//! Lights that move with the camera or a mesh.

use std::borrow::Cow;
use std::ops::{Deref, DerefMut};

use glam::{DMat3, DVec3};

use super::{Camera, Light, Scene};

/// What a light moves with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carrier {
    Camera,
    /// The mesh with this index.
    Mesh(usize),
}

/// A light of a scene, and what it moves with. It derefs to the light.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedLight {
    pub light: Light,
    /// With [`Carrier::Camera`], position and directions are in the camera's axes: x right, y down, z forward. Otherwise they are in the
    /// world. The light of a mesh is where it belongs if the mesh is where the scene file has it; [`Scene::carry_lights`] moves it.
    pub relative_to: Option<Carrier>,
}

impl From<Light> for PlacedLight {
    /// A light in the world.
    fn from(light: Light) -> Self {
        PlacedLight {
            light,
            relative_to: None,
        }
    }
}

impl Deref for PlacedLight {
    type Target = Light;

    fn deref(&self) -> &Light {
        &self.light
    }
}

impl DerefMut for PlacedLight {
    fn deref_mut(&mut self) -> &mut Light {
        &mut self.light
    }
}

impl PlacedLight {
    /// The light in the world, as this camera carries it. The camera must be validated.
    pub fn in_world(&self, camera: &Camera) -> Light {
        let mut light = self.light.clone();
        if self.relative_to == Some(Carrier::Camera) {
            light.carry(camera.basis().matrix(), camera.position_m);
        }
        light
    }
}

impl Scene {
    /// The same scene without lights relative to the camera: they are where the camera has them.
    pub fn in_world(&self) -> Cow<'_, Scene> {
        let is_carried = |light: &PlacedLight| light.relative_to == Some(Carrier::Camera);
        if !self.lights.iter().any(is_carried) {
            return Cow::Borrowed(self);
        }
        let lights = self.lights.iter().map(|placed| match is_carried(placed) {
            true => placed.in_world(&self.camera).into(),
            false => placed.clone(),
        });
        Cow::Owned(Scene {
            lights: lights.collect(),
            ..self.clone()
        })
    }

    /// Rotates the lights of a mesh about the world's origin, and then translates them.
    pub fn carry_lights(&mut self, mesh: usize, rotation: DMat3, translation_m: DVec3) {
        for placed in &mut self.lights {
            if placed.relative_to == Some(Carrier::Mesh(mesh)) {
                placed.light.carry(rotation, translation_m);
            }
        }
    }
}

impl Light {
    fn carry(&mut self, rotation: DMat3, translation_m: DVec3) {
        if let Some(position_m) = self.position_m_mut() {
            *position_m = rotation * *position_m + translation_m;
        }
        if let Some(direction) = self.direction_mut() {
            *direction = rotation * *direction;
        }
        if let Some(up) = self.up_mut() {
            *up = rotation * *up;
        }
    }

    /// Transforms the light from a mesh file's coordinates to the world.
    pub(crate) fn place_by_mesh(&mut self, scale: f64, rotation: DMat3, translation_m: DVec3) {
        if let Some(position_m) = self.position_m_mut() {
            *position_m *= scale;
        }
        self.carry(rotation, translation_m);
    }
}
