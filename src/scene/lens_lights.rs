//! Light sources of a time-of-flight camera at its lens, and whether it leaves them behind.

use glam::DVec3;

use super::{Camera, PlacedLight, Scene};

/// A light at the lens is nearer to it than this. Light sources of cameras are; two devices are not.
const AT_LENS_M: f64 = 0.1;
/// The same, as a fraction of the scene's radius, for small scenes.
const AT_LENS_OF_RADIUS: f64 = 0.02;

impl Scene {
    /// Indices of the modulated lights that are at the lens of a time-of-flight camera, and do not move with it.
    pub fn fixed_lights_at_lens(&self) -> Vec<usize> {
        let Some(tof) = &self.tof else {
            return Vec::new();
        };
        let radius_m = self.bounding_sphere_or_unit().radius_m;
        let near_m = AT_LENS_M.min(AT_LENS_OF_RADIUS * radius_m);
        let is_there = |&(i, light): &(usize, &PlacedLight)| {
            let position_m = light.position_m().filter(|_| light.relative_to.is_none());
            tof.is_modulated(i)
                && position_m.is_some_and(|at_m| at_m.distance(self.camera.position_m) <= near_m)
        };
        let there = self.lights.iter().enumerate().filter(is_there);
        there.map(|(i, _)| i).collect()
    }
}

/// The lights at the lens in the scenes so far, to tell when the camera has left one behind.
#[derive(Debug, Clone, Default)]
pub struct LensLights {
    /// Positions of the camera and of a light at its lens, of the last scene that had one.
    last: Option<(DVec3, DVec3)>,
}

impl LensLights {
    /// Compares a valid scene with those before it. Warns if a light was at the lens and stayed where it was when the camera moved.
    pub fn warning(&mut self, scene: &Scene) -> Option<String> {
        // The same room without time of flight tells nothing.
        let tof = scene.tof.as_ref()?;
        let Camera { position_m, .. } = scene.camera;
        if let Some(&light) = scene.fixed_lights_at_lens().first() {
            let light_m = scene.lights[light].position_m();
            self.last = light_m.map(|light_m| (position_m, light_m));
            return None;
        }
        // Warns once.
        let (before_m, light_m) = self.last.take()?;
        let is_left = |&(i, light): &(usize, &PlacedLight)| {
            light.relative_to.is_none()
                && tof.is_modulated(i)
                && light.position_m() == Some(light_m)
        };
        let (i, _) = scene.lights.iter().enumerate().find(is_left)?;
        let moved_m = position_m.distance(before_m);
        Some(format!(
            "light {i} was at the lens of the time-of-flight camera, and stayed when the camera moved by {moved_m:.3} m; if it is part of the camera, make it relative to the camera, with its position in the camera's axes"
        ))
    }
}
