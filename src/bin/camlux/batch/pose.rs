//! Poses (position and orientation), and how they become a camera, a light or a mesh.

use camlux::glam::{DMat3, DQuat, DVec3};
use camlux::scene::{Camera, Light};

/// A pose from the job.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Metres, in the world.
    pub position_m: DVec3,
    /// `None`: the orientation of the scene.
    pub aim: Option<Aim>,
    /// Time stamp of a row in a trajectory.
    pub time_s: Option<f64>,
}

/// The orientation. The axes of the posed object are x right, y down, z forward, as in camera intrinsics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Aim {
    /// Rotation from those axes to the world; unit length.
    Rotation(DQuat),
    LookAt {
        target_m: DVec3,
        up: Option<DVec3>,
    },
}

impl Pose {
    /// Interpolates between two poses: positions on a straight line, rotations on the shortest arc at constant speed. If both poses look at
    /// a point, so do those between.
    pub fn between(self, next: Pose, share: f64) -> Pose {
        let mixed = |a: DVec3, b: DVec3| a + (b - a) * share;
        let aim = match (self.aim, next.aim) {
            (
                Some(Aim::LookAt { target_m, up }),
                Some(Aim::LookAt {
                    target_m: next_target_m,
                    up: next_up,
                }),
            ) => Some(Aim::LookAt {
                target_m: mixed(target_m, next_target_m),
                up: up.zip(next_up).map(|(a, b)| mixed(a, b)),
            }),
            (Some(_), Some(_)) => {
                let (from, to) = (self.rotation(), next.rotation());
                Some(Aim::Rotation(from.slerp(to, share)))
            }
            _ => None,
        };
        Pose {
            position_m: mixed(self.position_m, next.position_m),
            aim,
            time_s: None,
        }
    }

    /// Rotation from the posed axes to the world; none if the pose gives none. Up is y unless given.
    pub fn rotation(&self) -> DQuat {
        match self.aim {
            None => DQuat::IDENTITY,
            Some(Aim::Rotation(rotation)) => rotation,
            Some(Aim::LookAt { target_m, up }) => {
                let forward = (target_m - self.position_m).normalize();
                let right = forward.cross(up.unwrap_or(DVec3::Y)).normalize();
                DQuat::from_mat3(&DMat3::from_cols(right, forward.cross(right), forward))
            }
        }
    }

    /// The camera at this pose.
    pub fn camera(&self, camera: &Camera) -> Camera {
        let position_m = self.position_m;
        let view = camera.look_at_m - camera.position_m;
        let (look_at_m, up) = match self.aim {
            None => (position_m + view, camera.up),
            Some(Aim::LookAt { target_m, up }) => (target_m, up.unwrap_or(camera.up)),
            Some(Aim::Rotation(rotation)) => {
                let forward = rotation * DVec3::Z;
                return camera.facing(position_m, forward, rotation * DVec3::NEG_Y);
            }
        };
        Camera {
            position_m,
            look_at_m,
            up,
            ..*camera
        }
    }

    /// The light at this pose. Spots, patterns and parallel light shine along the z axis of the pose; the plane C = 0 of a pattern is on
    /// the side of the negative y axis.
    pub fn light(&self, light: &Light) -> Light {
        let aimed = |before: DVec3| match self.aim {
            None => before,
            Some(Aim::Rotation(rotation)) => rotation * DVec3::Z,
            Some(Aim::LookAt { target_m, .. }) => target_m - self.position_m,
        };
        let mut light = light.clone();
        if let Some(direction) = light.direction_mut() {
            *direction = aimed(*direction);
        }
        if let Some(up) = light.up_mut() {
            *up = match self.aim {
                None => *up,
                Some(Aim::Rotation(rotation)) => rotation * DVec3::NEG_Y,
                Some(Aim::LookAt { up: given, .. }) => given.unwrap_or(*up),
            };
        }
        if let Some(position_m) = light.position_m_mut() {
            *position_m = self.position_m;
        }
        light
    }
}

/// A camera's own axes as a rotation to the world.
pub fn rotation_of(camera: &Camera) -> DQuat {
    DQuat::from_mat3(&camera.basis().matrix())
}

#[cfg(test)]
mod tests {
    use super::*;
    use camlux::scene::Lens;

    fn at(position_m: DVec3, aim: Aim) -> Pose {
        Pose {
            position_m,
            aim: Some(aim),
            time_s: None,
        }
    }

    fn camera() -> Camera {
        Camera {
            resolution_px: [4, 4],
            position_m: DVec3::ZERO,
            look_at_m: DVec3::NEG_Z,
            up: DVec3::Y,
            lens: Lens::FovY { fov_y_deg: 50.0 },
            pixel_sampling: None,
        }
    }

    /// Turns rotations into cameras and back, near the origin and far from it.
    #[test]
    fn a_camera_has_the_axes_of_its_quaternion() {
        for size_m in [1e-3, 1.0, 37.0, 1e6] {
            for frame in 0..200 {
                let mut draws = crate::batch::draws::Draws::new(1, frame, "test");
                let rotation = draws.rotation();
                let position_m = draws.inside(DVec3::splat(-size_m), DVec3::splat(size_m));
                let posed = at(position_m, Aim::Rotation(rotation)).camera(&camera());
                let basis = posed.basis();
                for (axis, expected) in [
                    (basis.right, DVec3::X),
                    (basis.down, DVec3::Y),
                    (basis.forward, DVec3::Z),
                ] {
                    // Rounding of a few operations on numbers below 2.
                    assert!((axis - rotation * expected).length() < 4e-15);
                }
                let back = rotation_of(&posed);
                assert!(1.0 - back.dot(rotation).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn looking_at_a_point_is_a_rotation_too() {
        let aim = Aim::LookAt {
            target_m: DVec3::new(3.0, 0.5, -2.0),
            up: None,
        };
        let pose = at(DVec3::new(-1.0, 2.0, 0.3), aim);
        let by_rotation = at(pose.position_m, Aim::Rotation(pose.rotation()));
        let [a, b] = [pose, by_rotation].map(|pose| pose.camera(&camera()).basis());
        assert!((a.right - b.right).length() < 1e-15);
        assert!((a.forward - b.forward).length() < 1e-15);
    }

    #[test]
    fn halfway_is_half_the_way_and_half_the_turn() {
        let turn = |deg: f64| Aim::Rotation(DQuat::from_rotation_y(deg.to_radians()));
        let [from, to] = [
            at(DVec3::ZERO, turn(0.0)),
            at(DVec3::new(2.0, 4.0, 6.0), turn(90.0)),
        ];
        let middle = from.between(to, 0.5);
        assert_eq!(middle.position_m, DVec3::new(1.0, 2.0, 3.0));
        let expected = DQuat::from_rotation_y(45_f64.to_radians());
        assert!(middle.rotation().dot(expected) > 1.0 - 1e-15);
    }
}
