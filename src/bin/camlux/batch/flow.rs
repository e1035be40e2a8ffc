//! Flow: how far the surface that a pixel shows moves to the next or the previous frame of the sequence.

use camlux::glam::DMat4;
use camlux::output::{Frame, Layer, OtherFrame};

use super::frames::Moment;

/// Another frame of the sequence, and what it shows if occlusion needs that.
pub struct Other<'m> {
    pub moment: &'m Moment,
    pub shown: Option<Frame>,
}

/// Adds layers of flow. `others`: the next and the previous frame.
pub fn add(frame: &mut Frame, begin: &Moment, layers: &[Layer], others: &[Option<Other>; 2]) {
    let others = others.each_ref().map(Option::as_ref);
    let moves = others.map(|other| other.map(|other| mesh_moves(begin, other.moment)));
    let others = [0, 1].map(|i| {
        let (other, mesh_moves) = others[i].zip(moves[i].as_deref())?;
        Some(OtherFrame {
            camera: other.moment.camera(),
            mesh_moves,
            shown: other.shown.as_ref(),
        })
    });
    frame.add_flow(begin.camera(), layers, others);
}

/// The transform of each mesh from one pose in the world to another; `None` if it does not move.
fn mesh_moves(begin: &Moment, other: &Moment) -> Vec<Option<DMat4>> {
    let mut moves = vec![None; begin.mesh_count()];
    for (&(mesh, position_m, rotation), &(_, other_position_m, other_rotation)) in
        begin.mesh_poses().iter().zip(other.mesh_poses())
    {
        if (position_m, rotation) != (other_position_m, other_rotation) {
            let from_file = DMat4::from_rotation_translation(rotation, position_m);
            let to_other = DMat4::from_rotation_translation(other_rotation, other_position_m);
            moves[mesh] = Some(to_other * from_file.inverse());
        }
    }
    moves
}
