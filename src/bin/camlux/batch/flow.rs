//! Flow: how far the surface that a pixel shows moves until the next frame of the sequence.

use camlux::glam::{DMat4, DVec2, DVec3};
use camlux::output::{Frame, Layer, LayerData};

use super::frames::Moment;

/// Adds the layers of optical flow and scene flow. `next` is `None` in the last frame of a sequence.
pub fn add(frame: &mut Frame, begin: &Moment, next: Option<&Moment>) {
    let (Some(ranges_m), Some(ids)) = (frame.values(Layer::Range), frame.ids(Layer::InstanceId))
    else {
        return;
    };
    let camera = begin.camera();
    let width = frame.resolution_px[0] as usize;
    let moves = next.map(|next| mesh_moves(begin, next));
    let nowhere = (DVec2::NAN, DVec3::NAN);
    let pixels = ranges_m.iter().zip(ids).enumerate();
    let moved = pixels.map(|(i, (&range_m, &id))| {
        let (Some(next), Some(moves), 1..) = (next, &moves, id) else {
            return nowhere;
        };
        let centre = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        // The layer P is not used, because it loses digits far from the origin.
        let direction = camera.ray_direction(centre.x, centre.y).normalize();
        let point_m = camera.position_m + direction * f64::from(range_m);
        // Meshes that do not move get a scene flow of exactly 0.
        let step_m = match moves.get(id as usize - 1).copied().flatten() {
            Some(of_mesh) => of_mesh.transform_point3(point_m) - point_m,
            None => DVec3::ZERO,
        };
        let is_still = step_m == DVec3::ZERO && next.camera() == camera;
        let flow_px = match next.camera().project(point_m + step_m) {
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
    frame.layers.extend(layers);
}

/// The transform of each mesh from one pose in the world to the next; `None` if it does not move.
fn mesh_moves(begin: &Moment, next: &Moment) -> Vec<Option<DMat4>> {
    let mut moves = vec![None; begin.mesh_count()];
    for (&(mesh, position_m, rotation), &(_, next_position_m, next_rotation)) in
        begin.mesh_poses().iter().zip(next.mesh_poses())
    {
        if (position_m, rotation) != (next_position_m, next_rotation) {
            let from_file = DMat4::from_rotation_translation(rotation, position_m);
            let to_next = DMat4::from_rotation_translation(next_rotation, next_position_m);
            moves[mesh] = Some(to_next * from_file.inverse());
        }
    }
    moves
}
