//! Scenes: what the host has put together, and the scene that is rendered.

use std::{
    ffi::c_char,
    path::Path,
    sync::{Mutex, MutexGuard, PoisonError},
};

use super::*;
use crate::{
    Scene,
    scene::{Direct, Light, Mesh, Shared},
};

/// How many parts a scene has. Begin with CAMLUX_SCENE_COUNTS_INIT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_scene_counts {
    /// sizeof(camlux_scene_counts)
    pub struct_size: u32,
    /// Textures: their indices are from 0 to below this number, and so on.
    pub textures: u32,
    /// Materials.
    pub materials: u32,
    /// Meshes.
    pub meshes: u32,
    /// Instances: meshes as they are placed.
    pub instances: u32,
    /// Lights.
    pub lights: u32,
}

/// How far the surfaces of a scene reach. Begin with CAMLUX_BOUNDS_INIT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_bounds {
    /// sizeof(camlux_bounds)
    pub struct_size: u32,
    /// 1: there are no triangles, and the box is 0.
    pub is_empty: i32,
    /// The least x, y, z of a vertex that a triangle uses, in world space, m.
    pub min_m: [f64; 3],
    /// The greatest, m.
    pub max_m: [f64; 3],
}

c_struct!(camlux_scene_counts, 24);

c_struct!(camlux_bounds, 56);

/// A scene that its host changes as it likes.
pub(super) struct SceneObject {
    state: Mutex<SceneState>,
}

/// What the host has put together.
pub(super) struct SceneState {
    /// Without meshes, which come from the instances when they are needed.
    pub scene: Scene,
    pub meshes: Vec<UnplacedMesh>,
    pub instances: Vec<Instance>,
    pub absent_instances: Absent,
    pub absent_lights: Absent,
    /// What is in the place of an instance that is not there.
    nothing: Shared<Mesh>,
    /// Whether the log has had the warnings.
    is_warned: bool,
}

impl SceneObject {
    /// A scene whose meshes lie where they are.
    pub fn new(mut scene: Scene) -> SceneObject {
        let loaded = std::mem::take(&mut scene.meshes);
        let instances = loaded.iter().enumerate().map(|(mesh, instance)| Instance {
            before_pose: instance.to_world,
            ..Instance::new(mesh, Pose::IDENTITY)
        });
        let meshes = loaded.iter();
        let meshes = meshes.map(|instance| UnplacedMesh::new(instance.mesh.clone()));
        SceneObject {
            state: Mutex::new(SceneState {
                instances: instances.collect(),
                scene,
                meshes: meshes.collect(),
                absent_instances: Absent::default(),
                absent_lights: Absent::default(),
                nothing: Shared::default(),
                is_warned: false,
            }),
        }
    }

    /// A panic while the lock was held leaves nothing half done: every change is one assignment or one push.
    pub fn lock(&self) -> MutexGuard<'_, SceneState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// For a change, after which warnings are due again.
    pub fn lock_to_change(&self) -> MutexGuard<'_, SceneState> {
        let mut state = self.lock();
        state.is_warned = false;
        state
    }

    /// Adds a part, and writes its index where the host wants it.
    ///
    /// # Safety
    /// `index` is null, or misaligned, or writable.
    pub unsafe fn add(
        &self,
        index: *mut u32,
        add: impl FnOnce(&mut SceneState) -> Outcome<usize>,
    ) -> Outcome {
        let add = || Ok(add(&mut self.lock_to_change())? as u32);
        if index.is_null() {
            return add().map(drop);
        }
        // SAFETY: the caller's word.
        unsafe { args::write_result(index, "index", add) }
    }

    /// The scene as it is now, to render.
    pub fn snapshot(&self) -> Scene {
        self.lock().snapshot()
    }

    /// Tells the log once what is probably not meant in a scene that has been found fine.
    pub fn log_warnings(&self, snapshot: &Scene) {
        if !log::is_wanted(CAMLUX_LOG_WARNING) {
            return;
        }
        let nothing = {
            let mut state = self.lock();
            if std::mem::replace(&mut state.is_warned, true) {
                return;
            }
            state.nothing.clone()
        };
        let mut present = snapshot.clone();
        present.meshes.retain(|mesh| !mesh.ptr_eq(&nothing));
        for warning in present.warnings() {
            log::write(CAMLUX_LOG_WARNING, || warning);
        }
    }
}

impl SceneState {
    fn snapshot(&self) -> Scene {
        let SceneState {
            scene,
            meshes,
            instances,
            absent_instances,
            nothing,
            ..
        } = self;
        let placed = instances.iter().enumerate().map(|(index, instance)| {
            match absent_instances.contains(index) {
                // It keeps its place, for the ids of the others.
                true => nothing.clone().into(),
                false => meshes[instance.mesh].placed(instance),
            }
        });
        let mut snapshot = Scene {
            meshes: placed.collect(),
            ..scene.clone()
        };
        self.leave_out_lights(&mut snapshot);
        snapshot
    }

    /// Takes the lights that are not there out of a copy of the scene.
    fn leave_out_lights(&self, snapshot: &mut Scene) {
        let all = 0..snapshot.lights.len();
        let there: Vec<usize> = all.filter(|&i| !self.absent_lights.contains(i)).collect();
        if there.len() == snapshot.lights.len() {
            return;
        }
        let new_index = |old: usize| there.iter().position(|&index| index == old);
        let lights = there.iter().map(|&index| snapshot.lights[index].clone());
        snapshot.lights = lights.collect();
        let carried = snapshot.carried_lights.iter();
        let carried = carried.filter_map(|&(light, by)| Some((new_index(light)?, by)));
        snapshot.carried_lights = carried.collect();
        if let Some(tof) = &mut snapshot.tof {
            let ambient = tof.ambient_lights.iter();
            tof.ambient_lights = ambient.filter_map(|&light| new_index(light)).collect();
        }
    }

    /// The light of an index, unless it was removed.
    pub fn light(&self, index: u32) -> Outcome<&Light> {
        self.absent_lights.check(index, "light")?;
        let lights = &self.scene.lights;
        let found = lights.get(index as usize);
        found.ok_or_else(|| no_part(index, lights.len(), "light"))
    }

    /// The instance of an index, unless it was removed.
    pub fn instance(&self, index: u32) -> Outcome<&Instance> {
        self.absent_instances.check(index, "instance")?;
        let found = self.instances.get(index as usize);
        found.ok_or_else(|| no_part(index, self.instances.len(), "instance"))
    }

    /// What was said of a light that is gone is not said of the one that takes its index.
    pub fn forget_light(&mut self, index: usize) {
        self.scene
            .carried_lights
            .retain(|&(light, _)| light != index);
        if let Some(tof) = &mut self.scene.tof {
            tof.ambient_lights.retain(|&light| light != index);
        }
    }

    /// Puts a checked part where it goes.
    pub fn put(&mut self, index: usize, moved: Moved) {
        match moved {
            Moved::Light(light) => self.scene.lights[index] = light,
            Moved::Instance(pose) => {
                let instance = &mut self.instances[index];
                instance.pose = pose;
            }
        }
    }
}

/// Puts a part in a free place of a list, or behind it, and says where it is.
pub(super) fn put<T>(
    list: &mut Vec<T>,
    free: Option<usize>,
    part: T,
    what: &str,
) -> Outcome<usize> {
    match free {
        Some(index) => {
            list[index] = part;
            Ok(index)
        }
        None => push(list, part, what),
    }
}

/// Adds a part to a list of the scene, and says which it is.
pub(super) fn push<T>(list: &mut Vec<T>, part: T, what: &str) -> Outcome<usize> {
    if list.len() >= args::CAMLUX_NONE as usize || list.try_reserve(1).is_err() {
        let problem = format!("there is no room for another {what} after {}", list.len());
        return Err(Failure::new(CAMLUX_ERROR_OUT_OF_MEMORY, problem));
    }
    list.push(part);
    Ok(list.len() - 1)
}

/// The part of an index.
pub(super) fn part<'l, T>(list: &'l mut [T], index: u32, what: &str) -> Outcome<&'l mut T> {
    let count = list.len();
    let found = list.get_mut(index as usize);
    found.ok_or_else(|| no_part(index, count, what))
}

/// The failure where there is no part of an index.
pub(super) fn no_part(index: u32, count: usize, what: &str) -> Failure {
    Failure::argument(format!(
        "there is no {what} {index} among {count}; indices count from 0"
    ))
}

/// Makes an empty scene: the camera of CAMLUX_CAMERA_INIT, no light, no mesh, no sensor, direct light only.
///
/// \param scene receives the handle, with one reference: give it back by camlux_scene_release.
/// \errors CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. A scene belongs to no device, and several threads may change and render it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_create(scene: *mut *mut camlux_scene) -> camlux_status {
    ffi_guard("camlux_scene_create", || {
        let make = || {
            Ok(SceneObject::new(Scene {
                camera: camera_from_c(Default::default())?,
                sensor: None,
                tof: None,
                carried_lights: Vec::new(),
                lights: Vec::new(),
                meshes: Vec::new(),
                materials: Vec::new(),
                textures: Vec::new(),
                direct: Direct::default(),
                indirect: None,
                left_out: Vec::new(),
            }))
        };
        // SAFETY: the caller's word.
        unsafe { handle::return_handle(scene, "scene", make) }
    })
}

/// Loads a scene file (docs/scene.md), with the meshes, materials and textures that it names. Each of its meshes becomes a
/// mesh and an instance of the same index, so that all of it can be moved and changed like a scene from arrays.
///
/// \param path of the TOML file, UTF-8. Paths in the file are relative to it.
/// \param scene receives the handle, with one reference: give it back by camlux_scene_release.
/// \errors CAMLUX_ERROR_SCENE with file and line; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_load_file(
    path: *const c_char,
    scene: *mut *mut camlux_scene,
) -> camlux_status {
    ffi_guard("camlux_scene_load_file", || {
        // SAFETY: the caller's word.
        let path = unsafe { args::path(path) }?;
        let load = || {
            let object = SceneObject::new(Scene::load(Path::new(&path))?);
            object.log_warnings(&object.snapshot());
            Ok(object)
        };
        // SAFETY: the caller's word.
        unsafe { handle::return_handle(scene, "scene", load) }
    })
}

/// Checks all that a render relies on, without a device. What is wrong with a part was told where it was set; what is left is
/// that there is a light.
///
/// \errors CAMLUX_ERROR_SCENE; CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_scene_validate(scene: *mut camlux_scene) -> camlux_status {
    ffi_guard("camlux_scene_validate", || {
        let object = handle::get(scene)?;
        let snapshot = object.snapshot();
        snapshot.validate()?;
        object.log_warnings(&snapshot);
        Ok(())
    })
}

/// How many parts a scene has.
///
/// \param counts begin with CAMLUX_SCENE_COUNTS_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_counts(
    scene: *mut camlux_scene,
    counts: *mut camlux_scene_counts,
) -> camlux_status {
    ffi_guard("camlux_scene_get_counts", || {
        let object = handle::get(scene)?;
        let found = || {
            let state = object.lock();
            Ok(camlux_scene_counts {
                textures: state.scene.textures.len() as u32,
                materials: state.scene.materials.len() as u32,
                meshes: state.meshes.len() as u32,
                instances: state.instances.len() as u32,
                lights: state.scene.lights.len() as u32,
                ..Default::default()
            })
        };
        // SAFETY: the caller's word.
        unsafe { args::write(counts, found) }
    })
}

/// How far the surfaces of a scene reach, with the poses that its instances have now.
///
/// \param bounds begin with CAMLUX_BOUNDS_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. It looks at every vertex.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_bounds(
    scene: *mut camlux_scene,
    bounds: *mut camlux_bounds,
) -> camlux_status {
    ffi_guard("camlux_scene_get_bounds", || {
        let object = handle::get(scene)?;
        let found = || {
            let found = object.snapshot().bounding_box();
            let corners = found.map(|found| [found.min_m, found.max_m]);
            let [min_m, max_m] = corners.unwrap_or_default().map(|corner| corner.to_array());
            Ok(camlux_bounds {
                is_empty: i32::from(found.is_none()),
                min_m,
                max_m,
                ..Default::default()
            })
        };
        // SAFETY: the caller's word.
        unsafe { args::write(bounds, found) }
    })
}
