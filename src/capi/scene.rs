//! Scenes: what the host has put together, and the scene that is rendered.

use std::{
    ffi::c_char,
    path::Path,
    sync::{Mutex, MutexGuard, PoisonError},
};

use super::*;
use crate::{Scene, scene::Direct};

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
    /// Whether the log has had the warnings.
    is_warned: bool,
}

impl SceneObject {
    /// A scene whose meshes lie where they are.
    pub fn new(mut scene: Scene) -> SceneObject {
        let meshes = std::mem::take(&mut scene.meshes).into_iter();
        let meshes: Vec<UnplacedMesh> = meshes.map(UnplacedMesh::new).collect();
        let at_home = |mesh| Instance::new(mesh, Pose::IDENTITY);
        SceneObject {
            state: Mutex::new(SceneState {
                instances: (0..meshes.len()).map(at_home).collect(),
                scene,
                meshes,
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

    /// The scene as it is now, to render. Its meshes are the ones of the snapshot before, where they have not moved.
    pub fn snapshot(&self) -> Scene {
        let mut state = self.lock();
        let SceneState {
            scene,
            meshes,
            instances,
            ..
        } = &mut *state;
        let placed = instances.iter_mut().map(|instance| instance.placed(meshes));
        Scene {
            meshes: placed.collect(),
            ..scene.clone()
        }
    }

    /// Tells the log once what is probably not meant in a scene that has been found fine.
    pub fn log_warnings(&self, snapshot: &Scene) {
        if !log::is_wanted(CAMLUX_LOG_WARNING) {
            return;
        }
        if std::mem::replace(&mut self.lock().is_warned, true) {
            return;
        }
        for warning in snapshot.warnings() {
            log::write(CAMLUX_LOG_WARNING, || warning);
        }
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
