//! Scenes: what the host has put together, and the scene that is rendered.

use std::{
    ffi::c_char,
    path::Path,
    sync::{Mutex, PoisonError},
};

use super::{
    args::{self, CStruct},
    handle::{self, camlux_scene},
    instances::{Instance, Pose},
    log::{self, CAMLUX_LOG_WARNING},
    scene_options::first_camera,
    status::{CAMLUX_ERROR_OUT_OF_MEMORY, Failure, Outcome, camlux_status, entry},
};
use crate::{
    Scene,
    scene::{Direct, Mesh, Shared},
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

// SAFETY: repr(C), the size first, whole numbers without padding.
unsafe impl CStruct for camlux_scene_counts {
    const NAME: &'static str = "camlux_scene_counts";
    const VERSION_1_BYTES: usize = 24;
    const INIT: Self = camlux_scene_counts {
        struct_size: size_of::<Self>() as u32,
        textures: 0,
        materials: 0,
        meshes: 0,
        instances: 0,
        lights: 0,
    };
}

// SAFETY: repr(C), the size first, numbers without padding.
unsafe impl CStruct for camlux_bounds {
    const NAME: &'static str = "camlux_bounds";
    const VERSION_1_BYTES: usize = 56;
    const INIT: Self = camlux_bounds {
        struct_size: size_of::<Self>() as u32,
        is_empty: 0,
        min_m: [0.0; 3],
        max_m: [0.0; 3],
    };
}

/// A scene that its host changes as it likes.
pub(super) struct SceneObject {
    state: Mutex<SceneState>,
}

/// What the host has put together.
pub(super) struct SceneState {
    /// Its meshes are the instances, placed; they are made when they are needed.
    pub scene: Scene,
    /// In their own space.
    pub meshes: Vec<Shared<Mesh>>,
    pub instances: Vec<Instance>,
    /// Whether the log has had the warnings.
    is_warned: bool,
}

impl SceneObject {
    /// A scene whose meshes lie where they are.
    pub fn new(scene: Scene) -> SceneObject {
        let meshes = scene.meshes.clone();
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
    fn with<T>(&self, use_it: impl FnOnce(&mut SceneState) -> T) -> T {
        use_it(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }

    pub fn look<T>(&self, look: impl FnOnce(&SceneState) -> T) -> T {
        self.with(|state| look(state))
    }

    /// For what is checked and has only to be stored.
    pub fn change<T>(&self, change: impl FnOnce(&mut SceneState) -> T) -> T {
        self.with(|state| {
            state.is_warned = false;
            change(state)
        })
    }

    /// The scene as it is now, to render. Its meshes are the ones of the snapshot before, where they have not moved.
    pub fn snapshot(&self) -> Scene {
        self.with(|state| {
            for (instance, placed) in state.instances.iter_mut().zip(&mut state.scene.meshes) {
                if let Some(mesh) = instance.place(&state.meshes) {
                    *placed = mesh;
                }
            }
            state.scene.clone()
        })
    }

    /// Tells the log once what is probably not meant in a scene that has been found fine.
    pub fn log_warnings(&self, snapshot: &Scene) {
        if !log::is_wanted(CAMLUX_LOG_WARNING) {
            return;
        }
        if self.with(|state| std::mem::replace(&mut state.is_warned, true)) {
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
        return Err(Failure {
            status: CAMLUX_ERROR_OUT_OF_MEMORY,
            message: format!("there is no room for another {what} after {}", list.len()),
        });
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
///
/// # Safety
/// `scene` is NULL or points to a writable pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_create(scene: *mut *mut camlux_scene) -> camlux_status {
    entry("camlux_scene_create", || {
        let make = || {
            Ok(SceneObject::new(Scene {
                camera: first_camera(),
                sensor: None,
                lights: Vec::new(),
                meshes: Vec::new(),
                materials: Vec::new(),
                textures: Vec::new(),
                direct: Direct::default(),
                indirect: None,
            }))
        };
        // SAFETY: the caller's word.
        unsafe { handle::hand_out(make, scene, "scene") }
    })
}

/// Loads a scene file (docs/scene.md), with the meshes, materials and textures that it names. Each of its meshes becomes a
/// mesh and an instance of the same index, so that all of it can be moved and changed like a scene from arrays.
///
/// \param path of the TOML file, UTF-8. Paths in the file are relative to it.
/// \param scene receives the handle, with one reference: give it back by camlux_scene_release.
/// \errors CAMLUX_ERROR_SCENE with file and line; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
///
/// # Safety
/// `path` is NULL or a string that ends with a 0; `scene` is NULL or points to a writable pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_load_file(
    path: *const c_char,
    scene: *mut *mut camlux_scene,
) -> camlux_status {
    entry("camlux_scene_load_file", || {
        // SAFETY: the caller's word.
        let path = unsafe { args::path(path) }?;
        let load = || {
            let object = SceneObject::new(Scene::load(Path::new(&path))?);
            object.log_warnings(&object.snapshot());
            Ok(object)
        };
        // SAFETY: the caller's word.
        unsafe { handle::hand_out(load, scene, "scene") }
    })
}

/// Checks all that a render relies on, without a device. What is wrong with a part alone was told where it was set; what is
/// left is that there is a light, and that moved meshes are not too far out.
///
/// \errors CAMLUX_ERROR_SCENE; CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_scene_validate(scene: *mut camlux_scene) -> camlux_status {
    entry("camlux_scene_validate", || {
        let object = handle::get::<SceneObject>(scene)?;
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
///
/// # Safety
/// `counts` is NULL or points to as many writable bytes as its struct_size says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_counts(
    scene: *mut camlux_scene,
    counts: *mut camlux_scene_counts,
) -> camlux_status {
    entry("camlux_scene_get_counts", || {
        let object = handle::get::<SceneObject>(scene)?;
        let found = object.look(|state| camlux_scene_counts {
            textures: state.scene.textures.len() as u32,
            materials: state.scene.materials.len() as u32,
            meshes: state.meshes.len() as u32,
            instances: state.instances.len() as u32,
            lights: state.scene.lights.len() as u32,
            ..CStruct::INIT
        });
        // SAFETY: the caller's word.
        unsafe { args::write(counts, found) }
    })
}

/// How far the surfaces of a scene reach, with the poses that its instances have now.
///
/// \param bounds begin with CAMLUX_BOUNDS_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. It looks at every vertex.
///
/// # Safety
/// `bounds` is NULL or points to as many writable bytes as its struct_size says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_bounds(
    scene: *mut camlux_scene,
    bounds: *mut camlux_bounds,
) -> camlux_status {
    entry("camlux_scene_get_bounds", || {
        let object = handle::get::<SceneObject>(scene)?;
        // SAFETY: the caller's word.
        unsafe { args::check_struct(bounds) }?;
        let found = object.snapshot().bounding_box();
        let [min_m, max_m] = match found {
            Some(found) => [found.min_m, found.max_m].map(|corner| corner.to_array()),
            None => [[0.0; 3]; 2],
        };
        let found = camlux_bounds {
            is_empty: i32::from(found.is_none()),
            min_m,
            max_m,
            ..CStruct::INIT
        };
        // SAFETY: the caller's word.
        unsafe { args::write(bounds, found) }
    })
}
