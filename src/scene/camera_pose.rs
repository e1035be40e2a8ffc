//! Poses of cameras as matrices.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::Camera;

/// Where the axes of a camera point whose pose is a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraAxes {
    /// x right, y down, z forward.
    OpenCv,
    /// x right, y up, z backward.
    OpenGl,
}

/// How far the product of a matrix with its transpose may be from the identity: rounding of a rotation in f32, and of text with seven digits.
const ROUNDING: f64 = 1e-6;

impl CameraAxes {
    pub const ALL: [CameraAxes; 2] = [CameraAxes::OpenCv, CameraAxes::OpenGl];

    /// The name in scene files.
    pub fn name(self) -> &'static str {
        match self {
            CameraAxes::OpenCv => "opencv",
            CameraAxes::OpenGl => "opengl",
        }
    }

    /// The rows of a matrix between a camera with these axes and the world, as a pose: a rotation and a translation. The error says what is
    /// wrong with it.
    ///
    /// `rows`: three, or four with 0, 0, 0, 1 as the last. `is_to_world`: they map the camera's space to the world, not the other way.
    pub fn pose(self, rows: &[[f64; 4]], is_to_world: bool) -> Result<DAffine3, String> {
        let (&[x, y, z], last) = rows
            .split_first_chunk::<3>()
            .ok_or_else(|| format!("has {} rows instead of 3 or 4", rows.len()))?;
        match last {
            [] | [[0.0, 0.0, 0.0, 1.0]] => {}
            [last] => return Err(format!("has the last row {last:?} instead of [0, 0, 0, 1]")),
            _ => return Err(format!("has {} rows instead of 3 or 4", rows.len())),
        }
        let column = |i: usize| DVec3::new(x[i], y[i], z[i]);
        let given = DMat3::from_cols(column(0), column(1), column(2));
        let off = given.transpose() * given - DMat3::IDENTITY;
        let largest = off.to_cols_array().map(f64::abs).into_iter();
        if given.determinant() < 0.0 {
            return Err("mirrors space".into());
        }
        if !largest.fold(0.0, f64::max).le(&ROUNDING) || !off.is_finite() {
            let lengths = [0, 1, 2].map(|i| column(i).length());
            return Err(format!(
                "does not begin with a rotation: its first three columns have the lengths {lengths:?}, or are not at right angles"
            ));
        }
        if !column(3).is_finite() {
            return Err("has a position that is not finite".into());
        }
        let rotation = DQuat::from_mat3(&given).normalize();
        let pose = DAffine3::from_rotation_translation(rotation, column(3));
        let mut to_world = match is_to_world {
            true => pose,
            false => {
                let back = rotation.conjugate();
                DAffine3::from_rotation_translation(back, -(back * column(3)))
            }
        };
        if self == CameraAxes::OpenGl {
            let axes = &mut to_world.matrix3;
            (axes.y_axis, axes.z_axis) = (-axes.y_axis, -axes.z_axis);
        }
        Ok(to_world)
    }
}

impl Camera {
    /// The camera at another place, with a view along `forward`; both directions have unit length.
    pub fn facing(&self, position_m: DVec3, forward: DVec3, up: DVec3) -> Camera {
        Camera {
            position_m,
            look_at_m: point_ahead(position_m, forward),
            up,
            ..*self
        }
    }

    /// The camera with this transform from its axes (x right, y down, z forward) to the world: a rotation and a translation.
    pub fn posed(&self, to_world: &DAffine3) -> Camera {
        let DMat3 { y_axis, z_axis, .. } = to_world.matrix3;
        self.facing(to_world.translation, z_axis, -y_axis)
    }
}

/// A point far enough away that the digits lost in the sum do not change the direction.
pub(crate) fn point_ahead(position_m: DVec3, forward: DVec3) -> DVec3 {
    let distance_m = position_m.abs().max_element().max(1.0).log2().ceil().exp2();
    position_m + forward * distance_m
}
