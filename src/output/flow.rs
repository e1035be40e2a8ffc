//! Flow: how far the surface that a pixel shows moves until the next frame of a sequence.

use glam::{DMat4, DVec2, DVec3};

use super::{Frame, Layer, LayerData};
use crate::scene::Camera;

/// The next frame of a sequence.
pub struct NextFrame<'n> {
    pub camera: &'n Camera,
    /// How each mesh moves in the world until then; `None`: not at all. NaN for one that moves in another way.
    pub mesh_moves: &'n [Option<DMat4>],
}

impl Frame {
    /// Adds the layers of optical flow and scene flow. `camera`: that of this frame. `next` is `None` in the last frame of a sequence. Without
    /// the layers of ids and ranges it adds nothing.
    pub fn add_flow(&mut self, camera: &Camera, next: Option<&NextFrame>) {
        let (Some(ranges_m), Some(ids)) = (self.values(Layer::Range), self.ids(Layer::InstanceId))
        else {
            return;
        };
        let width = self.resolution_px[0] as usize;
        let nowhere = (DVec2::NAN, DVec3::NAN);
        let pixels = ranges_m.iter().zip(ids).enumerate();
        let moved = pixels.map(|(i, (&range_m, &id))| {
            let (Some(next), 1..) = (next, id) else {
                return nowhere;
            };
            let centre = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            // The layer P is not used, because it loses digits far from the origin.
            let direction = camera.ray_direction(centre.x, centre.y).normalize();
            let point_m = camera.position_m + direction * f64::from(range_m);
            // Meshes that do not move get a scene flow of exactly 0.
            let step_m = match next.mesh_moves.get(id as usize - 1).copied().flatten() {
                Some(of_mesh) => of_mesh.transform_point3(point_m) - point_m,
                None => DVec3::ZERO,
            };
            let is_still = step_m == DVec3::ZERO && next.camera == camera;
            let flow_px = match next.camera.project(point_m + step_m) {
                _ if is_still => DVec2::ZERO,
                Some(shown) => shown - centre,
                None => DVec2::NAN,
            };
            (flow_px, step_m)
        });
        let (flow, scene_flow): (Vec<DVec2>, Vec<DVec3>) = moved.unzip();
        let flow = flow.iter().flat_map(|px| px.as_vec2().to_array());
        let scene_flow = scene_flow.iter().flat_map(|m| m.as_vec3().to_array());
        let layers = [
            (Layer::Flow, LayerData::Float(flow.collect())),
            (Layer::SceneFlow, LayerData::Float(scene_flow.collect())),
        ];
        self.layers.extend(layers);
    }
}
