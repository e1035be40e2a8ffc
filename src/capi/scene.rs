//! Scenes: the parts that the host has set, and the scene that is rendered.

use std::{
    ffi::c_char,
    path::Path,
    sync::{Mutex, MutexGuard, PoisonError},
};

use super::*;
use crate::{
    Scene,
    scene::{
        Carrier, Direct, LensLights, Mesh, PlacedLight, Shared, TextureSource, in_their_roles,
    },
};

/// Numbers of the parts of a scene. Initialise with CAMLUX_SCENE_COUNTS_INIT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_scene_counts {
    /// Set by CAMLUX_SCENE_COUNTS_INIT.
    pub struct_size: u32,
    /// Textures. They count from 1: the last one has this number.
    pub textures: u32,
    /// Materials. Their indices are from 0 to this number - 1; the same holds for the members below.
    pub materials: u32,
    /// Meshes.
    pub meshes: u32,
    /// Instances: placed meshes.
    pub instances: u32,
    /// Lights.
    pub lights: u32,
}

/// Bounding box of the surfaces of a scene. Initialise with CAMLUX_BOUNDS_INIT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_bounds {
    /// Set by CAMLUX_BOUNDS_INIT.
    pub struct_size: u32,
    /// 1: there are no triangles, and min_m and max_m are 0.
    pub is_empty: i32,
    /// Smallest x, y, z of the vertices that triangles use, in world space, m.
    pub min_m: [f64; 3],
    /// Largest x, y, z of these, m.
    pub max_m: [f64; 3],
}

c_struct!(camlux_scene_counts, 24);

c_struct!(camlux_bounds, 56);

/// A scene that the host can change at any time.
pub(super) struct SceneObject {
    state: Mutex<SceneState>,
}

/// The parts that the host has set.
pub(super) struct SceneState {
    /// The scene without textures and meshes. Its materials name `textures`. A snapshot reads these in their roles, and adds meshes from the
    /// instances.
    pub scene: Scene,
    pub textures: Vec<TextureSource>,
    pub meshes: Vec<UnplacedMesh>,
    pub instances: Vec<Instance>,
    pub absent_instances: Absent,
    pub absent_lights: Absent,
    /// An empty mesh in the place of an absent instance.
    nothing: Shared<Mesh>,
    /// Whether the warnings were logged.
    is_warned: bool,
    lens_lights: LensLights,
}

impl SceneObject {
    /// Turns each mesh of a loaded scene into a mesh and an instance with the identity as pose.
    pub fn new(mut scene: Scene) -> SceneObject {
        let textures = std::mem::take(&mut scene.textures);
        let loaded = std::mem::take(&mut scene.meshes);
        // A host moves the lights of meshes as all others.
        for light in &mut scene.lights {
            light.relative_to = light.relative_to.filter(|by| *by == Carrier::Camera);
        }
        let instances = loaded.iter().enumerate().map(|(mesh, instance)| Instance {
            before_pose: instance.to_world,
            ..Instance::new(mesh, Pose::IDENTITY)
        });
        let meshes = loaded.iter();
        let meshes = meshes.map(|instance| UnplacedMesh::new(instance.mesh.clone()));
        SceneObject {
            state: Mutex::new(SceneState {
                instances: instances.collect(),
                textures: textures.into_iter().map(TextureSource::from).collect(),
                scene,
                meshes: meshes.collect(),
                absent_instances: Absent::default(),
                absent_lights: Absent::default(),
                nothing: Shared::default(),
                is_warned: false,
                lens_lights: LensLights::default(),
            }),
        }
    }

    /// A panic while the lock is held leaves no partial change: every change is one assignment or one push.
    pub fn lock(&self) -> MutexGuard<'_, SceneState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Locks the scene for a change, after which warnings are logged again.
    pub fn lock_to_change(&self) -> MutexGuard<'_, SceneState> {
        let mut state = self.lock();
        state.is_warned = false;
        state
    }

    /// Adds a part, and writes its index to the host's memory, unless `index` is null.
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
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(index, "index", add) }
    }

    /// A snapshot of the scene, to render.
    pub fn snapshot(&self) -> Scene {
        self.lock().snapshot()
    }

    /// Logs that the time-of-flight camera of a valid scene has left a light behind that was at its lens.
    pub fn watch_lens(&self, snapshot: &Scene) {
        let warning = self.lock().lens_lights.warning(snapshot);
        if let Some(warning) = warning {
            log::write(CAMLUX_LOG_WARNING, || warning);
        }
    }

    /// Logs warnings about probable mistakes in a valid scene, once.
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
        for (index, instance) in present.meshes.iter_mut().enumerate() {
            if instance.name.is_empty() {
                // A mesh of C has another index than its instances.
                instance.name = format!("instance {index}");
            }
        }
        present.meshes.retain(|mesh| !mesh.ptr_eq(&nothing));
        for warning in present.warnings() {
            self.warn(&warning);
        }
    }

    /// Logs a warning of the library about a snapshot, to which hidden lights do not exist.
    pub fn warn(&self, warning: &str) {
        let has_hidden = self.lock().absent_lights.has_hidden();
        log::write(CAMLUX_LOG_WARNING, || match has_hidden {
            true => words::of_hidden_lights(&words::in_c(warning)),
            false => words::in_c(warning),
        });
    }
}

impl SceneState {
    fn snapshot(&self) -> Scene {
        let SceneState {
            scene,
            textures,
            meshes,
            instances,
            absent_instances,
            nothing,
            ..
        } = self;
        let placed = instances.iter().enumerate().map(|(index, instance)| {
            match absent_instances.contains(index) {
                // It keeps its place, so that the ids of the others do not change.
                true => nothing.clone().into(),
                false => meshes[instance.mesh].placed(instance),
            }
        });
        let mut snapshot = Scene {
            meshes: placed.collect(),
            ..scene.clone()
        };
        snapshot.textures = in_their_roles(textures, &mut snapshot.materials);
        self.leave_out_lights(&mut snapshot);
        snapshot
    }

    /// Removes the absent lights from a copy of the scene.
    fn leave_out_lights(&self, snapshot: &mut Scene) {
        let all = 0..snapshot.lights.len();
        let there: Vec<usize> = all.filter(|&i| !self.absent_lights.contains(i)).collect();
        if there.len() == snapshot.lights.len() {
            return;
        }
        let new_index = |old: usize| there.iter().position(|&index| index == old);
        let lights = there.iter().map(|&index| snapshot.lights[index].clone());
        snapshot.lights = lights.collect();
        if let Some(tof) = &mut snapshot.tof {
            let ambient = tof.ambient_lights.iter();
            tof.ambient_lights = ambient.filter_map(|&light| new_index(light)).collect();
        }
    }

    /// The light at an index, unless it was removed.
    pub fn light(&self, index: u32) -> Outcome<&PlacedLight> {
        self.absent_lights.check(index, "light")?;
        let lights = &self.scene.lights;
        let found = lights.get(index as usize);
        found.ok_or_else(|| no_part(index, lights.len(), "light"))
    }

    /// The instance at an index, unless it was removed.
    pub fn instance(&self, index: u32) -> Outcome<&Instance> {
        self.absent_instances.check(index, "instance")?;
        let found = self.instances.get(index as usize);
        found.ok_or_else(|| no_part(index, self.instances.len(), "instance"))
    }

    /// Removes the settings of a removed light, so that they do not apply to the light that takes its index.
    pub fn forget_light(&mut self, index: usize) {
        if let Some(tof) = &mut self.scene.tof {
            tof.ambient_lights.retain(|&light| light != index);
        }
    }

    /// Stores a checked part.
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

/// Puts a part in a free place of a list, or appends it, and returns its index.
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

/// Appends a part to a list of the scene, and returns its index.
pub(super) fn push<T>(list: &mut Vec<T>, part: T, what: &str) -> Outcome<usize> {
    if list.len() >= u32::MAX as usize || list.try_reserve(1).is_err() {
        let problem = format!(
            "the scene cannot hold another {what} after {}; use fewer",
            list.len()
        );
        return Err(Failure::new(CAMLUX_ERROR_OUT_OF_MEMORY, problem));
    }
    list.push(part);
    Ok(list.len() - 1)
}

/// The part at an index.
pub(super) fn part<'l, T>(list: &'l mut [T], index: u32, what: &str) -> Outcome<&'l mut T> {
    let count = list.len();
    let found = list.get_mut(index as usize);
    found.ok_or_else(|| no_part(index, count, what))
}

/// The failure for an index without a part.
pub(super) fn no_part(index: u32, count: usize, what: &str) -> Failure {
    Failure::argument(format!(
        "there is no {what} {index} among {count}; indices count from 0"
    ))
}

/// Creates an empty scene: the camera of CAMLUX_CAMERA_INIT, no light, no mesh, no sensor, direct light only.
///
/// \param scene receives the handle, with one reference; release it with camlux_scene_release.
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
                lights: Vec::new(),
                meshes: Vec::new(),
                materials: Vec::new(),
                textures: Vec::new(),
                direct: Direct::default(),
                indirect: None,
                vignetting_map: None,
                left_out: Vec::new(),
            }))
        };
        // SAFETY: the caller guarantees it.
        unsafe { handle::return_handle(scene, "scene", make) }
    })
}

/// Loads a scene file (docs/scene.md), with the meshes, materials and textures that it names. Each of its meshes becomes a
/// mesh and an instance with the same index. You can move and change everything as in a scene from arrays.
///
/// \param path of the TOML file, UTF-8. Paths in the file are relative to it.
/// \param scene receives the handle, with one reference; release it with camlux_scene_release.
/// \errors CAMLUX_ERROR_SCENE with file and line; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_load_file(
    path: *const c_char,
    scene: *mut *mut camlux_scene,
) -> camlux_status {
    ffi_guard("camlux_scene_load_file", || {
        // SAFETY: the caller guarantees it.
        let path = unsafe { args::path(path) }?;
        let load = || {
            let object =
                SceneObject::new(Scene::load(Path::new(&path)).map_err(Failure::as_it_is)?);
            let snapshot = object.snapshot();
            object.log_warnings(&snapshot);
            object.watch_lens(&snapshot);
            Ok(object)
        };
        // SAFETY: the caller guarantees it.
        unsafe { handle::return_handle(scene, "scene", load) }
    })
}

/// Checks everything that a render needs, without a device. Each part was already checked when it was set. This call also checks that
/// the parts go together.
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

/// Reads the numbers of the parts of a scene.
///
/// \param counts initialise with CAMLUX_SCENE_COUNTS_INIT.
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
                textures: state.textures.len() as u32,
                materials: state.scene.materials.len() as u32,
                meshes: state.meshes.len() as u32,
                instances: state.instances.len() as u32,
                lights: state.scene.lights.len() as u32,
                ..Default::default()
            })
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write(counts, found) }
    })
}

/// Computes the bounding box of the surfaces of a scene, with the current poses of its instances.
///
/// \param bounds initialise with CAMLUX_BOUNDS_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. It reads every vertex.
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
        // SAFETY: the caller guarantees it.
        unsafe { args::write(bounds, found) }
    })
}
