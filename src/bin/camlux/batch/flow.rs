//! Flow: how far the surface that a pixel shows moves until the next frame of the sequence.

use camlux::glam::DMat4;
use camlux::output::{Frame, NextFrame};

use super::frames::Moment;

/// Adds the layers of optical flow and scene flow. `next` is `None` in the last frame of a sequence.
pub fn add(frame: &mut Frame, begin: &Moment, next: Option<&Moment>) {
    let moves = next.map(|next| mesh_moves(begin, next));
    let next = next
        .zip(moves.as_ref())
        .map(|(next, mesh_moves)| NextFrame {
            camera: next.camera(),
            mesh_moves,
        });
    frame.add_flow(begin.camera(), next.as_ref());
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
