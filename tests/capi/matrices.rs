//! Poses from matrices.

use std::ptr::null;

use glam::{DMat3, DQuat, DVec3};

use crate::host::*;
use camlux::capi::*;

fn pose_of(rows: &[f64], axes: i32) -> (camlux_status, camlux_pose) {
    let mut pose = init!(camlux_pose {});
    // SAFETY: as many numbers, and a struct of that size.
    let status = unsafe { camlux_pose_from_matrix(rows.as_ptr(), rows.len(), axes, &mut pose) };
    (status, pose)
}

/// The rows of a matrix with these columns.
fn rows(columns: [DVec3; 4]) -> [f64; 12] {
    std::array::from_fn(|i| columns[i % 4][i / 4])
}

fn turn() -> DQuat {
    DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0)
}

#[test]
fn a_matrix_is_the_pose_with_its_columns() {
    let (turn, at) = (turn(), DVec3::new(1.0, -2.0, 3.0));
    let DMat3 {
        x_axis: x,
        y_axis: y,
        z_axis: z,
    } = DMat3::from_quat(turn);
    for scale in [1.0, 2.5] {
        let matrix = rows([x * scale, y * scale, z * scale, at]);
        let square: Vec<f64> = matrix.iter().copied().chain([0.0, 0.0, 0.0, 1.0]).collect();
        for numbers in [&matrix[..], &square] {
            let (status, pose) = pose_of(numbers, CAMLUX_AXES_OPENCV);
            ok(status);
            assert!((pose.scale - scale).abs() < 1e-12);
            assert_eq!(pose.position_m, at.to_array());
            let found = DQuat::from_array(pose.orientation_xyzw);
            assert!((found.dot(turn).abs() - 1.0).abs() < 1e-12, "{found}");
        }
    }
    // A rotation of a host in f32 has the scale 1, which a camera must have.
    let matrix = rows([x, y, z, at]).map(|value| f64::from(value as f32));
    let (status, pose) = pose_of(&matrix, CAMLUX_AXES_OPENCV);
    ok(status);
    assert_eq!(pose.scale, 1.0);
}

/// The camera of OpenGL looks along -z, with y up.
#[test]
fn a_camera_of_opengl_sees_what_it_saw() {
    let (turn, at) = (turn(), DVec3::new(1.0, -2.0, 3.0));
    let DMat3 {
        x_axis: x,
        y_axis: y,
        z_axis: z,
    } = DMat3::from_quat(turn);
    let (status, pose) = pose_of(&rows([x, y, z, at]), CAMLUX_AXES_OPENGL);
    ok(status);
    let scene = new_scene();
    ok(scene.set_pose(CAMLUX_PART_CAMERA, 0, &pose));
    let camera = scene.camera();
    assert!((DVec3::from(camera.look_at_m) - at).distance(-z) < 1e-12);
    assert!(DVec3::from(camera.up).distance(y) < 1e-12);
}

#[test]
fn what_is_no_pose_is_refused() {
    let [x, y, z, at] = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
    for (columns, words) in [
        ([x, y, -z, at], "mirrors"),
        ([x, 2.0 * y, z, at], "lengths [1.0, 2.0, 1.0]"),
        ([x, y, (z + 0.1 * x).normalize(), at], "right angles"),
        ([x, y, DVec3::ZERO, at], "finite numbers"),
        ([x, y, z, DVec3::NAN], "finite numbers"),
        ([x, y, z * f64::INFINITY, at], "finite numbers"),
    ] {
        let (status, _) = pose_of(&rows(columns), CAMLUX_AXES_OPENCV);
        fails(status, SCENE, words);
    }
    let mut square = [0.0; 16];
    square[..12].copy_from_slice(&rows([x, y, z, at]));
    // Stored by columns, the position is in the last row.
    square[12..].copy_from_slice(&[1.0, 2.0, 3.0, 1.0]);
    let (status, _) = pose_of(&square, CAMLUX_AXES_OPENCV);
    fails(status, SCENE, "must be transposed");
    let (status, _) = pose_of(&square[..9], CAMLUX_AXES_OPENCV);
    fails(status, ARGUMENT, "count is 9");
    let (status, _) = pose_of(&square, 2);
    fails(status, ARGUMENT, "CAMLUX_AXES_OPENGL (1)");
    let mut pose = init!(camlux_pose {});
    // SAFETY: a struct of that size.
    let status = unsafe { camlux_pose_from_matrix(null(), 12, 0, &mut pose) };
    fails(status, ARGUMENT, "rows is NULL");
}

/// The own space of a camera has y down; the picture of a camera without a rotation of its own has +y up, as in the other interfaces.
#[test]
fn up_is_plus_y_unless_it_is_said() {
    let scene = new_scene();
    let pose = scene.pose(CAMLUX_PART_CAMERA, 0);
    let turn = DQuat::from_array(pose.orientation_xyzw);
    assert!((turn * DVec3::Y).distance(DVec3::NEG_Y) < 1e-12);
    assert!((turn * DVec3::Z).distance(DVec3::Z) < 1e-12);
}
