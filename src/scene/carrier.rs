//! Lights that move with the camera or a mesh.

use glam::{DMat3, DVec3};

use super::{Camera, CameraBasis, Light, Scene};

/// What a light moves with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carrier {
    Camera,
    /// The mesh with this index.
    Mesh(usize),
}

impl Scene {
    /// Replaces the scene's camera, and moves the lights that it carries.
    pub fn set_camera(&mut self, camera: Camera) {
        let before = std::mem::replace(&mut self.camera, camera);
        let pose = |camera: &Camera| (camera.position_m, camera.look_at_m, camera.up);
        // If the camera does not move, its lights keep every digit.
        if pose(&before) == pose(&self.camera) {
            return;
        }
        let rotation = axes(&self.camera) * axes(&before).transpose();
        let translation_m = self.camera.position_m - rotation * before.position_m;
        self.carry_lights(Carrier::Camera, rotation, translation_m);
    }

    /// Rotates the lights of a carrier about the world's origin, and then translates them.
    pub fn carry_lights(&mut self, by: Carrier, rotation: DMat3, translation_m: DVec3) {
        for &(light, carrier) in &self.carried_lights {
            if carrier == by
                && let Some(light) = self.lights.get_mut(light)
            {
                light.carry(rotation, translation_m);
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

    /// Transforms the light from the camera's axes (x right, y down, z forward) to the world.
    pub(crate) fn place_by_camera(&mut self, camera: &Camera) {
        self.carry(axes(camera), camera.position_m);
    }

    /// Transforms the light from a mesh file's coordinates to the world.
    pub(crate) fn place_by_mesh(&mut self, scale: f64, rotation: DMat3, translation_m: DVec3) {
        if let Some(position_m) = self.position_m_mut() {
            *position_m *= scale;
        }
        self.carry(rotation, translation_m);
    }
}

fn axes(camera: &Camera) -> DMat3 {
    let CameraBasis {
        right,
        down,
        forward,
    } = camera.basis();
    DMat3::from_cols(right, down, forward)
}
