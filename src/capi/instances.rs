//! Instances of meshes; hidden and removed parts.

use std::collections::BTreeSet;

use glam::DAffine3;

use super::*;
use crate::scene::{self, BoundingBox, Mesh, Shared};

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

    /// The mesh placed as an instance.
    pub fn placed(&self, instance: &Instance) -> scene::Instance {
        scene::Instance {
            to_world: instance.pose.to_world() * instance.before_pose,
            ..scene::Instance::from(self.mesh.clone())
        }
    }

    pub fn validate(&self, instance: &Instance, index: usize) -> crate::Result<()> {
        self.placed(instance).validate(index, self.bounds)
    }
}

/// A placed mesh.
#[derive(Clone, Copy)]
pub(super) struct Instance {
    pub mesh: usize,
    /// The placement in the scene file, applied before the pose.
    pub before_pose: DAffine3,
    pub pose: Pose,
}

impl Instance {
    pub fn new(mesh: usize, pose: Pose) -> Instance {
        Instance {
            mesh,
            before_pose: DAffine3::IDENTITY,
            pose,
        }
    }
}

/// Places a mesh in the scene. The layer CAMLUX_LAYER_INSTANCE_ID holds 1 + the instance's index.
///
/// \param mesh the index of a mesh. You can place it any number of times; its instances share it in memory and on the device. A mesh
/// without an instance is not rendered.
/// \param pose NULL: the identity.
/// \param index receives the instance's index; may be NULL.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for an invalid pose or one that moves the
/// mesh too far out; CAMLUX_ERROR_OUT_OF_MEMORY.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_add_instance(
    scene: *mut camlux_scene,
    mesh: u32,
    pose: *const camlux_pose,
    index: *mut u32,
) -> camlux_status {
    ffi_guard("camlux_scene_add_instance", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let pose = Pose::from_c(unsafe { args::read_optional(pose) }?.unwrap_or_default())?;
        let add = |state: &mut SceneState| {
            let unplaced = part(&mut state.meshes, mesh, "mesh")?;
            let instance = Instance::new(mesh as usize, pose);
            unplaced.validate(&instance, state.instances.len())?;
            let free = state.absent_instances.take_free();
            put(&mut state.instances, free, instance, "instance")
        };
        // SAFETY: the caller guarantees it.
        unsafe { object.add(index, add) }
    })
}

/// Indices of hidden and removed lights or instances.
#[derive(Debug, Default)]
pub(super) struct Absent {
    hidden: BTreeSet<usize>,
    removed: BTreeSet<usize>,
}

impl Absent {
    pub fn contains(&self, index: usize) -> bool {
        self.hidden.contains(&index) || self.removed.contains(&index)
    }

    pub fn has_hidden(&self) -> bool {
        !self.hidden.is_empty()
    }

    /// Takes the lowest index of a removed part.
    pub fn take_free(&mut self) -> Option<usize> {
        self.removed.pop_first()
    }

    /// Refuses the index of a removed part.
    pub fn check(&self, index: u32, what: &str) -> Outcome {
        if self.removed.contains(&(index as usize)) {
            return Err(Failure::argument(format!(
                "{what} {index} was removed; give another index, or add a new one, which takes this index"
            )));
        }
        Ok(())
    }
}

/// Shows or hides a light or an instance. A hidden part keeps its index and its pose, and can be changed. Frames are rendered as if it did not
/// exist, and spend no time on it.
///
/// \param part CAMLUX_PART_LIGHT or CAMLUX_PART_INSTANCE.
/// \param is_visible 0 or 1.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_scene_set_visible(
    scene: *mut camlux_scene,
    part: i32,
    index: u32,
    is_visible: i32,
) -> camlux_status {
    ffi_guard("camlux_scene_set_visible", || {
        let object = handle::get(scene)?;
        let is_visible = args::flag("is_visible", is_visible)?;
        let mut state = object.lock_to_change();
        let absent = absent_part(&mut state, part, index)?;
        if is_visible {
            absent.hidden.remove(&(index as usize));
        } else {
            absent.hidden.insert(index as usize);
        }
        Ok(())
    })
}

/// Tells whether a light or an instance is shown.
///
/// \param part CAMLUX_PART_LIGHT or CAMLUX_PART_INSTANCE.
/// \param is_visible receives 1, or 0 if it is hidden.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT, also for a part that was removed.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_visible(
    scene: *mut camlux_scene,
    part: i32,
    index: u32,
    is_visible: *mut i32,
) -> camlux_status {
    ffi_guard("camlux_scene_get_visible", || {
        let object = handle::get(scene)?;
        let found = || {
            let mut state = object.lock();
            let absent = absent_part(&mut state, part, index)?;
            Ok((!absent.contains(index as usize)).into())
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(is_visible, "is_visible", found) }
    })
}

/// Removes a light or an instance. The indices of others do not change. The next part that is added takes the free index.
///
/// \param part CAMLUX_PART_LIGHT or CAMLUX_PART_INSTANCE.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_scene_remove(
    scene: *mut camlux_scene,
    part: i32,
    index: u32,
) -> camlux_status {
    ffi_guard("camlux_scene_remove", || {
        let object = handle::get(scene)?;
        let mut state = object.lock_to_change();
        let absent = absent_part(&mut state, part, index)?;
        absent.hidden.remove(&(index as usize));
        absent.removed.insert(index as usize);
        if part == CAMLUX_PART_LIGHT {
            state.forget_light(index as usize);
        }
        Ok(())
    })
}

/// The list of absent parts for a part, if it exists.
fn absent_part(state: &mut SceneState, part: i32, index: u32) -> Outcome<&mut Absent> {
    let choices = args::choices![CAMLUX_PART_LIGHT => true, CAMLUX_PART_INSTANCE => false];
    Ok(if args::one_of("part", part, &choices)? {
        state.light(index)?;
        &mut state.absent_lights
    } else {
        state.instance(index)?;
        &mut state.absent_instances
    })
}
