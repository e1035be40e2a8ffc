//! Instances of meshes, and the poses of what can be moved.

use glam::{DQuat, DVec3};

use super::*;
use crate::{
    Error,
    scene::{BoundingBox, Mesh, Shared, validate_instance},
};

/// The camera; its index is 0.
pub const CAMLUX_PART_CAMERA: i32 = 0;
/// A light.
pub const CAMLUX_PART_LIGHT: i32 = 1;
/// An instance of a mesh.
pub const CAMLUX_PART_INSTANCE: i32 = 2;

/// Where something is and how it is turned: what takes its own space to world space, x_world = q * x_own + position. Begin
/// with CAMLUX_POSE_INIT: the identity.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_pose {
    /// sizeof(camlux_pose)
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Its origin in world space, m.
    pub position_m: [f64; 3],
    /// The unit quaternion x, y, z, w. A length within 0.001 of 1 is taken for rounding, and mended.
    pub orientation_xyzw: [f64; 4],
}

c_struct!(camlux_pose, 64, orientation_xyzw: [0.0, 0.0, 0.0, 1.0]);

/// A checked pose.
///
/// cbindgen:ignore
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pose {
    position_m: DVec3,
    orientation: DQuat,
}

/// What a quaternion's length may be off 1.
const LENGTH_TOLERANCE: f64 = 1e-3;

impl Pose {
    pub const IDENTITY: Pose = Pose {
        position_m: DVec3::ZERO,
        orientation: DQuat::IDENTITY,
    };

    fn from_c(pose: camlux_pose) -> Outcome<Pose> {
        args::reserved(camlux_pose::NAME, pose.reserved)?;
        let orientation_xyzw = pose.orientation_xyzw;
        let orientation = DQuat::from_array(orientation_xyzw);
        let length = orientation.length();
        if length.is_nan() || (length - 1.0).abs() > LENGTH_TOLERANCE {
            let problem = format!("orientation_xyzw is {orientation_xyzw:?}, of length {length}");
            return Err(Error::scene("pose", problem, "give a unit quaternion, x y z w").into());
        }
        Ok(Pose {
            position_m: DVec3::from(pose.position_m),
            orientation: orientation.normalize(),
        })
    }

    fn is_identity(&self) -> bool {
        // A quaternion and its negative are one rotation.
        self.position_m == DVec3::ZERO && self.orientation.xyz() == DVec3::ZERO
    }

    /// From the own space to world space.
    fn place(&self, position_m: DVec3) -> DVec3 {
        self.orientation * position_m + self.position_m
    }

    fn place_mesh(&self, mesh: &Mesh) -> Mesh {
        let positions_m = mesh.positions_m.iter().map(|&at_m| self.place(at_m));
        let normals = mesh.normals.iter().map(|&normal| self.orientation * normal);
        Mesh {
            positions_m: positions_m.collect(),
            normals: normals.collect(),
            ..mesh.clone()
        }
    }
}

/// A mesh in its own space.
pub(super) struct UnplacedMesh {
    pub mesh: Shared<Mesh>,
    bounds: Option<BoundingBox>,
}

impl UnplacedMesh {
    pub fn new(mesh: Shared<Mesh>) -> UnplacedMesh {
        UnplacedMesh {
            bounds: BoundingBox::around(mesh.positions_m.iter().copied()),
            mesh,
        }
    }

    fn validate_pose(&self, pose: &Pose, instance: usize) -> crate::Result<()> {
        let corners_m = self.bounds.iter().flat_map(BoundingBox::corners_m);
        let placed_m = corners_m.map(|corner_m| pose.place(corner_m));
        validate_instance(instance, pose.position_m, placed_m)
    }
}

/// A mesh as it is placed.
pub(super) struct Instance {
    mesh: usize,
    pose: Pose,
    /// In world space, once it was needed there.
    placed: Option<Shared<Mesh>>,
}

impl Instance {
    pub fn new(mesh: usize, pose: Pose) -> Instance {
        Instance {
            mesh,
            pose,
            placed: None,
        }
    }

    /// The mesh in world space: the same one as long as it has not moved, and with the identity the unplaced one.
    pub fn placed(&mut self, meshes: &[UnplacedMesh]) -> Shared<Mesh> {
        let mesh = &meshes[self.mesh].mesh;
        let place = || {
            if self.pose.is_identity() {
                mesh.clone()
            } else {
                self.pose.place_mesh(mesh).into()
            }
        };
        self.placed.get_or_insert_with(place).clone()
    }
}

/// Places a mesh in the scene. The layer CAMLUX_LAYER_INSTANCE_ID holds 1 + the instance's index.
///
/// \param mesh the index of a mesh. It may be placed any number of times; without an instance it is not there.
/// \param pose NULL: where it is.
/// \param index receives the instance's index; may be NULL.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for a pose that is none or takes the mesh
/// too far out; CAMLUX_ERROR_OUT_OF_MEMORY.
/// \threads any; calls for one scene take turns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_add_instance(
    scene: *mut camlux_scene,
    mesh: u32,
    pose: *const camlux_pose,
    index: *mut u32,
) -> camlux_status {
    ffi_guard("camlux_scene_add_instance", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller's word.
        let pose = Pose::from_c(unsafe { args::read_optional(pose) }?.unwrap_or_default())?;
        let add = |state: &mut SceneState| {
            let unplaced = part(&mut state.meshes, mesh, "mesh")?;
            unplaced.validate_pose(&pose, state.instances.len())?;
            let instance = Instance::new(mesh as usize, pose);
            push(&mut state.instances, instance, "instance")
        };
        // SAFETY: the caller's word.
        unsafe { object.add(index, add) }
    })
}

/// Moves the camera, a light or an instance. The next frame of a renderer makes anew what this changes, and nothing else:
/// a moved camera uses the surfaces, reflective shadow maps and virtual lights of the frame before.
///
/// - CAMLUX_PART_CAMERA: the pose of the optical frame, x right, y down, z forward. Resolution and lens stay.
/// - CAMLUX_PART_LIGHT: a spot light shines along its +z from its position; a point light has no orientation; a directional
///   light travels along +z, and has no position.
/// - CAMLUX_PART_INSTANCE: takes the mesh's own space to world space, whatever the pose before.
///
/// \param part CAMLUX_PART_CAMERA, CAMLUX_PART_LIGHT or CAMLUX_PART_INSTANCE.
/// \param index of the light or instance; 0 for the camera.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for a pose that is none or too far
/// out.
/// \threads any; calls for one scene take turns. It only stores: vertices are moved at the next render.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_pose(
    scene: *mut camlux_scene,
    part: i32,
    index: u32,
    pose: *const camlux_pose,
) -> camlux_status {
    ffi_guard("camlux_scene_set_pose", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller's word.
        let pose = Pose::from_c(unsafe { args::read(pose) }?)?;
        let choices = args::choices![
            CAMLUX_PART_CAMERA => move_camera as fn(&mut SceneState, u32, Pose) -> Outcome,
            CAMLUX_PART_LIGHT => move_light,
            CAMLUX_PART_INSTANCE => move_instance,
        ];
        let move_it = args::one_of("part", part, &choices)?;
        move_it(&mut object.lock_to_change(), index, pose)
    })
}

fn move_camera(state: &mut SceneState, index: u32, pose: Pose) -> Outcome {
    if index != 0 {
        return Err(Failure::argument(format!(
            "there is one camera, not a camera {index}; give index 0"
        )));
    }
    let mut camera = state.scene.camera;
    camera.position_m = pose.position_m;
    camera.look_at_m = pose.position_m + pose.orientation * DVec3::Z;
    camera.up = pose.orientation * DVec3::NEG_Y;
    camera.validate()?;
    state.scene.set_camera(camera);
    Ok(())
}

fn move_light(state: &mut SceneState, index: u32, pose: Pose) -> Outcome {
    let light = part(&mut state.scene.lights, index, "light")?;
    let mut moved = light.clone();
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
    *light = moved;
    Ok(())
}

fn move_instance(state: &mut SceneState, index: u32, pose: Pose) -> Outcome {
    let instance = part(&mut state.instances, index, "instance")?;
    state.meshes[instance.mesh].validate_pose(&pose, index as usize)?;
    if instance.pose != pose {
        instance.pose = pose;
        instance.placed = None;
    }
    Ok(())
}
