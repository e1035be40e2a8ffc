//! Poses: where the camera, lights and instances are.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::*;
use crate::{
    Error,
    scene::{Camera, CameraBasis, Light, PlacedLight},
};

/// The camera; its index is 0.
pub const CAMLUX_PART_CAMERA: i32 = 0;
/// A light.
pub const CAMLUX_PART_LIGHT: i32 = 1;
/// An instance of a mesh.
pub const CAMLUX_PART_INSTANCE: i32 = 2;

/// The axes of a camera as camlux and OpenCV have them: x right, y down, z forward. Also for instances, whose axes are their mesh's, and
/// for lights, which shine along z.
pub const CAMLUX_AXES_OPENCV: i32 = 0;
/// The axes of a camera as OpenGL and Blender have them: x right, y up, z backward.
pub const CAMLUX_AXES_OPENGL: i32 = 1;

/// A pose: position, orientation and scale. It maps own space to world space: x_world = q * (scale * x_own) + position. Initialise
/// with CAMLUX_POSE_INIT: the identity.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_pose {
    /// Set by CAMLUX_POSE_INIT.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Origin of the own space in world space, m.
    pub position_m: [f64; 3],
    /// Unit quaternion x, y, z, w. A length within 0.001 of 1 is accepted as rounding, and normalised.
    pub orientation_xyzw: [f64; 4],
    /// Scale of an instance, above 0. It must be 1 for the camera and lights.
    pub scale: f64,
}

c_struct!(camlux_pose, 64, orientation_xyzw: [0.0, 0.0, 0.0, 1.0], scale: 1.0);

/// A checked pose.
///
/// cbindgen:ignore
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pose {
    pub position_m: DVec3,
    orientation: DQuat,
    scale: f64,
}

/// How far a quaternion's length may differ from 1.
const LENGTH_TOLERANCE: f64 = 1e-3;

/// How far the scale of a rotation matrix in f32 may differ from 1.
const ROUNDING: f64 = 1e-5;

impl Pose {
    pub const IDENTITY: Pose = Pose {
        position_m: DVec3::ZERO,
        orientation: DQuat::IDENTITY,
        scale: 1.0,
    };

    pub fn from_c(pose: camlux_pose) -> Outcome<Pose> {
        args::reserved(camlux_pose::NAME, pose.reserved)?;
        let orientation_xyzw = pose.orientation_xyzw;
        let orientation = DQuat::from_array(orientation_xyzw);
        let length = orientation.length();
        if length.is_nan() || (length - 1.0).abs() > LENGTH_TOLERANCE {
            let problem = format!("orientation_xyzw is {orientation_xyzw:?}, of length {length}");
            return Err(Error::scene("pose", problem, "give a unit quaternion, x y z w").into());
        }
        let scale = pose.scale;
        if !(scale > 0.0 && scale.is_finite()) {
            let problem = format!("scale is {scale}");
            return Err(Error::scene("pose", problem, "give a finite factor above 0").into());
        }
        Ok(Pose {
            position_m: DVec3::from(pose.position_m),
            orientation: orientation.normalize(),
            scale,
        })
    }

    /// The pose of a matrix with three rows of four numbers, from own space to world space.
    fn from_rows(rows: [[f64; 4]; 3], flip: DVec3) -> Outcome<Pose> {
        let wrong = |problem: String, hint: &str| Error::scene("matrix", problem, hint).into();
        let column = |i: usize| DVec3::new(rows[0][i], rows[1][i], rows[2][i]);
        let axes = [0, 1, 2].map(|i| column(i) * flip[i]);
        let lengths = axes.map(DVec3::length);
        let scale = DMat3::from_cols_array_2d(&axes.map(|axis| axis.to_array()));
        let scale = scale.determinant().cbrt();
        if !(scale.is_normal() && column(3).is_finite()) {
            let problem = format!("its rows are {rows:?}, which turn nothing into space");
            return Err(wrong(
                problem,
                "give finite numbers, three columns of a rotation and one of metres",
            ));
        }
        if scale < 0.0 {
            let hint = "give a rotation without a mirror; check the axes";
            return Err(wrong("it mirrors".into(), hint));
        }
        let [x, y, z] = axes.map(|axis| axis / scale);
        let is_rotation = lengths
            .iter()
            .all(|length| (length / scale - 1.0).abs() <= LENGTH_TOLERANCE)
            && [x.dot(y), y.dot(z), z.dot(x)]
                .iter()
                .all(|cosine| cosine.abs() <= LENGTH_TOLERANCE);
        if !is_rotation {
            let problem = format!(
                "its first three columns have the lengths {lengths:?}, or are not at right angles"
            );
            let hint = "give a rotation times one scale, row by row; a matrix that is stored by columns must be transposed";
            return Err(wrong(problem, hint));
        }
        Ok(Pose {
            position_m: column(3),
            orientation: DQuat::from_mat3(&DMat3::from_cols(x, y, z)).normalize(),
            // Of a rotation, the rest is rounding.
            scale: if (scale - 1.0).abs() < ROUNDING {
                1.0
            } else {
                scale
            },
        })
    }

    fn to_c(self) -> camlux_pose {
        camlux_pose {
            position_m: self.position_m.to_array(),
            orientation_xyzw: self.orientation.to_array(),
            scale: self.scale,
            ..Default::default()
        }
    }

    /// Checks that the scale is 1, for the camera and lights.
    fn unscaled(self) -> Outcome<Pose> {
        if self.scale == 1.0 {
            return Ok(self);
        }
        let problem = format!(
            "scale is {}, but cameras and lights cannot be scaled",
            self.scale
        );
        Err(Error::scene("pose", problem, "set it to 1").into())
    }

    /// The transform from own space to world space.
    pub fn to_world(self) -> DAffine3 {
        let scale = DVec3::splat(self.scale);
        DAffine3::from_scale_rotation_translation(scale, self.orientation, self.position_m)
    }
}

/// Moves the camera, a light or an instance. The next frame of a renderer recomputes only what this changes. After a camera
/// move it reuses the surfaces, reflective shadow maps and virtual point lights of the previous frame.
///
/// - CAMLUX_PART_CAMERA: the pose of the optical frame, x right, y down, z forward. Resolution and lens do not change. Lights with
///   CAMLUX_RELATIVE_TO_CAMERA move with it.
/// - CAMLUX_PART_LIGHT: a spot light shines along its +z from its position. A point light has no orientation. A directional
///   light travels along +z, and has no position. A light that was relative to the camera stays where the pose puts it: it is then
///   relative to the world.
/// - CAMLUX_PART_INSTANCE: maps the mesh's own space to world space. It replaces the previous pose.
///
/// \param part CAMLUX_PART_CAMERA, CAMLUX_PART_LIGHT or CAMLUX_PART_INSTANCE.
/// \param index of the light or instance; 0 for the camera.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for a pose that is invalid or too far
/// out.
/// \threads any; calls on the same scene are serialised. It only stores the pose.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_pose(
    scene: *mut camlux_scene,
    part: i32,
    index: u32,
    pose: *const camlux_pose,
) -> camlux_status {
    ffi_guard("camlux_scene_set_pose", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let pose = Pose::from_c(unsafe { args::read(pose) }?)?;
        let choices = args::choices![
            CAMLUX_PART_CAMERA => move_camera as fn(&mut SceneState, u32, Pose) -> Outcome,
            CAMLUX_PART_LIGHT => |state, index, pose| move_part(state, index, moved_light(state, index, pose)?),
            CAMLUX_PART_INSTANCE => |state, index, pose| move_part(state, index, moved_instance(state, index, pose)?),
        ];
        let move_it = args::one_of("part", part, &choices)?;
        move_it(&mut object.lock_to_change(), index, pose)
    })
}

/// Turns a matrix into a pose for camlux_scene_set_pose and camlux_scene_add_instance.
///
/// \param rows 12 or 16 numbers, row by row: each row has three numbers of the rotation (times a scale) and one of the position, m. The matrix
/// maps own space to world space, as camera-to-world does. The extrinsics of OpenCV map the other way: invert them first.
/// \param count 12 (3 x 4), or 16 (4 x 4, whose last row is 0, 0, 0, 1).
/// \param axes of the own space: CAMLUX_AXES_OPENCV or CAMLUX_AXES_OPENGL.
/// \param pose initialise with CAMLUX_POSE_INIT.
/// \errors CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for a matrix that is no rotation with one scale, within 0.001.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_pose_from_matrix(
    rows: *const f64,
    count: usize,
    axes: i32,
    pose: *mut camlux_pose,
) -> camlux_status {
    ffi_guard("camlux_pose_from_matrix", || {
        let choices = args::choices![
            CAMLUX_AXES_OPENCV => DVec3::ONE,
            CAMLUX_AXES_OPENGL => DVec3::new(1.0, -1.0, -1.0),
        ];
        let flip = args::one_of("axes", axes, &choices)?;
        if count != 12 && count != 16 {
            let problem = format!("count is {count}; give 12 numbers (3 x 4) or 16 (4 x 4)");
            return Err(Failure::argument(problem));
        }
        let numbers = args::Rows {
            name: "rows",
            count_name: "count",
            data: rows.cast(),
            stride_bytes: 0,
            count: count / 4,
            length: 4,
        };
        let row = |row: &[f64]| [row[0], row[1], row[2], row[3]];
        // SAFETY: the caller guarantees it.
        let rows = unsafe { numbers.read(row) }?;
        if let Some(last) = rows.get(3)
            && *last != [0.0, 0.0, 0.0, 1.0]
        {
            let problem = format!("its last row is {last:?}");
            let hint = "give 0, 0, 0, 1; a matrix that is stored by columns must be transposed";
            return Err(Error::scene("matrix", problem, hint).into());
        }
        let found = || Ok(Pose::from_rows([rows[0], rows[1], rows[2]], flip)?.to_c());
        // SAFETY: the caller guarantees it.
        unsafe { args::write(pose, found) }
    })
}

/// Moves many lights or instances at once. If one pose is refused, none is moved.
///
/// \param part CAMLUX_PART_LIGHT or CAMLUX_PART_INSTANCE.
/// \param indices of the parts, `count` of them; NULL: 0 to count - 1.
/// \param poses the first of `count`, each initialised with CAMLUX_POSE_INIT.
/// \param stride_bytes from one pose to the next: sizeof(camlux_pose), or the size of a struct whose first member is a pose.
/// \errors as camlux_scene_set_pose; the message says which pose is wrong.
/// \threads any; calls on the same scene are serialised. It only stores the poses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_poses(
    scene: *mut camlux_scene,
    part: i32,
    indices: *const u32,
    count: usize,
    poses: *const camlux_pose,
    stride_bytes: usize,
) -> camlux_status {
    ffi_guard("camlux_scene_set_poses", || {
        let object = handle::get(scene)?;
        let choices = args::choices![
            CAMLUX_PART_LIGHT => moved_light as fn(&SceneState, u32, Pose) -> Outcome<Moved>,
            CAMLUX_PART_INSTANCE => moved_instance,
        ];
        let moved = args::one_of("part", part, &choices)?;
        // SAFETY: the caller guarantees it.
        let poses = unsafe { args::read_many(poses, count, stride_bytes, Pose::from_c) }?;
        let indices = if indices.is_null() {
            (0..count as u32).collect()
        } else {
            let rows = args::Rows {
                name: "indices",
                count_name: "count",
                data: indices.cast(),
                stride_bytes: 0,
                count,
                length: 1,
            };
            // SAFETY: the caller guarantees it.
            unsafe { rows.read(|row: &[u32]| row[0]) }?
        };
        let mut state = object.lock_to_change();
        let mut all = args::room_for(count, "poses")?;
        for (place, (&index, &pose)) in indices.iter().zip(&poses).enumerate() {
            let one = moved(&state, index, pose);
            all.push((
                index as usize,
                one.map_err(|e| e.within(&format!("pose {place}")))?,
            ));
        }
        for (index, moved) in all {
            state.put(index, moved);
        }
        Ok(())
    })
}

/// Reads the pose of the camera, a light or an instance in world space, in the form of camlux_scene_set_pose.
///
/// \param part CAMLUX_PART_CAMERA, CAMLUX_PART_LIGHT or CAMLUX_PART_INSTANCE.
/// \param index of the light or instance; 0 for the camera.
/// \param pose initialise with CAMLUX_POSE_INIT. A part without a position is at 0. A part without a direction is not rotated. A light that
/// is symmetric about its direction has an arbitrary rotation about it.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_pose(
    scene: *mut camlux_scene,
    part: i32,
    index: u32,
    pose: *mut camlux_pose,
) -> camlux_status {
    ffi_guard("camlux_scene_get_pose", || {
        let object = handle::get(scene)?;
        let choices = args::choices![
            CAMLUX_PART_CAMERA => pose_of_camera as fn(&SceneState, u32) -> Outcome<Pose>,
            CAMLUX_PART_LIGHT => |state, index| Ok(pose_of_light(&state.light(index)?.in_world(&state.scene.camera))),
            CAMLUX_PART_INSTANCE => |state, index| Ok(state.instance(index)?.pose),
        ];
        let pose_of = args::one_of("part", part, &choices)?;
        let found = || Ok(pose_of(&object.lock(), index)?.to_c());
        // SAFETY: the caller guarantees it.
        unsafe { args::write(pose, found) }
    })
}

fn pose_of_camera(state: &SceneState, index: u32) -> Outcome<Pose> {
    one_camera(index)?;
    let Camera { position_m, .. } = state.scene.camera;
    let CameraBasis {
        right,
        down,
        forward,
    } = state.scene.camera.basis();
    Ok(Pose {
        position_m,
        orientation: DQuat::from_mat3(&DMat3::from_cols(right, down, forward)),
        scale: 1.0,
    })
}

fn pose_of_light(light: &Light) -> Pose {
    let orientation = match (light.direction(), light.up()) {
        (None, _) => DQuat::IDENTITY,
        (Some(direction), None) => DQuat::from_rotation_arc(DVec3::Z, direction.normalize()),
        (Some(direction), Some(up)) => {
            let ahead = direction.normalize();
            let right = ahead.cross(up).normalize();
            DQuat::from_mat3(&DMat3::from_cols(right, ahead.cross(right), ahead))
        }
    };
    Pose {
        position_m: light.position_m().unwrap_or_default(),
        orientation,
        scale: 1.0,
    }
}

fn one_camera(index: u32) -> Outcome {
    if index == 0 {
        return Ok(());
    }
    Err(Failure::argument(format!(
        "there is no camera {index}: a scene has one camera; give index 0"
    )))
}

fn move_camera(state: &mut SceneState, index: u32, pose: Pose) -> Outcome {
    one_camera(index)?;
    let pose = pose.unscaled()?;
    let mut camera = state.scene.camera;
    camera.position_m = pose.position_m;
    camera.look_at_m = pose.position_m + pose.orientation * DVec3::Z;
    camera.up = pose.orientation * DVec3::NEG_Y;
    camera.validate()?;
    state.scene.camera = camera;
    Ok(())
}

fn move_part(state: &mut SceneState, index: u32, moved: Moved) -> Outcome {
    state.put(index as usize, moved);
    Ok(())
}

/// A part moved by a pose, already checked.
pub(super) enum Moved {
    Light(PlacedLight),
    Instance(Pose),
}

fn moved_light(state: &SceneState, index: u32, pose: Pose) -> Outcome<Moved> {
    let pose = pose.unscaled()?;
    let mut moved = Light::clone(state.light(index)?);
    let ahead = pose.orientation * DVec3::Z;
    if let Some(position_m) = moved.position_m_mut() {
        *position_m = pose.position_m;
    }
    if let Some(direction) = moved.direction_mut() {
        *direction = ahead;
    }
    if let Some(up) = moved.up_mut() {
        *up = pose.orientation * DVec3::NEG_Y;
    }
    moved.validate(index as usize)?;
    Ok(Moved::Light(moved.into()))
}

fn moved_instance(state: &SceneState, index: u32, pose: Pose) -> Outcome<Moved> {
    let instance = *state.instance(index)?;
    let moved = Instance { pose, ..instance };
    state.meshes[instance.mesh].validate(&moved, index as usize)?;
    Ok(Moved::Instance(pose))
}
