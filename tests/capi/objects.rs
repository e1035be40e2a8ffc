//! Objects of the C interface: each is released at the end of its scope, and has its calls as methods.

use std::{
    ffi::{CStr, CString},
    path::Path,
    ptr::{null, null_mut},
};

use crate::host::*;
use camlux::{
    capi::*,
    glam::{DQuat, DVec3},
};

/// A reference to an object of the library, which is released at the end of its scope.
pub struct Owned<T: Object>(*mut T);

// SAFETY: a handle is a number, and any thread may use it.
unsafe impl<T: Object> Sync for Owned<T> {}
// SAFETY: as above.
unsafe impl<T: Object> Send for Owned<T> {}

pub trait Object {
    fn release(handle: *mut Self) -> camlux_status;
}

macro_rules! objects {
    ($($object:ident: $release:ident),* $(,)?) => {$(
        impl Object for $object {
            fn release(handle: *mut Self) -> camlux_status {
                $release(handle)
            }
        }
    )*};
}
objects! {
    camlux_scene: camlux_scene_release,
    camlux_renderer: camlux_renderer_release,
    camlux_frame: camlux_frame_release,
    camlux_job: camlux_job_release,
    camlux_cancel_token: camlux_cancel_token_release,
    camlux_shared_memory: camlux_shared_memory_release,
}

impl<T: Object> Owned<T> {
    /// The object that a call makes, or the status of a call that makes none.
    pub fn try_new(make: impl FnOnce(*mut *mut T) -> camlux_status) -> Result<Self, camlux_status> {
        let mut handle = null_mut();
        let status = make(&mut handle);
        assert_eq!(handle.is_null(), status != CAMLUX_OK);
        match status {
            CAMLUX_OK => Ok(Owned(handle)),
            failed => Err(failed),
        }
    }

    pub fn raw(&self) -> *mut T {
        self.0
    }

    /// The handle, which its new owner must release.
    pub fn into_raw(self) -> *mut T {
        std::mem::ManuallyDrop::new(self).0
    }

    #[track_caller]
    pub fn new(make: impl FnOnce(*mut *mut T) -> camlux_status) -> Self {
        Self::try_new(make).unwrap_or_else(|status| panic!("{status}: {}", last_error()))
    }
}

impl<T: Object> std::fmt::Debug for Owned<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl<T: Object> Drop for Owned<T> {
    fn drop(&mut self) {
        let status = T::release(self.0);
        assert!(
            status == CAMLUX_OK || std::thread::panicking(),
            "{}",
            last_error()
        );
    }
}

pub type Scene = Owned<camlux_scene>;
pub type Renderer = Owned<camlux_renderer>;
pub type Frame = Owned<camlux_frame>;

/// A device with the validation layer. Dropping it asserts that the layer reported nothing.
pub struct Device(pub *mut camlux_device);

// SAFETY: a handle is a number, and any thread may use a device.
unsafe impl Sync for Device {}

impl Device {
    pub fn open() -> Device {
        let options = init!(camlux_device_options { validation: 1 });
        let mut device = null_mut();
        // SAFETY: both pointers are valid.
        ok(unsafe { camlux_device_create(&options, &mut device) });
        Device(device)
    }

    pub fn renderer(&self) -> Renderer {
        // SAFETY: it points to a pointer.
        Owned::new(|renderer| unsafe { camlux_renderer_create(self.0, renderer) })
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        let mut count = 0;
        // SAFETY: it points to a number.
        ok(unsafe { camlux_device_validation_count(self.0, &mut count) });
        ok(camlux_device_release(self.0));
        assert!(count == 0 || std::thread::panicking(), "{count} messages");
    }
}

pub fn new_scene() -> Scene {
    // SAFETY: it points to a pointer.
    Owned::new(|scene| unsafe { camlux_scene_create(scene) })
}

pub fn new_token() -> Owned<camlux_cancel_token> {
    // SAFETY: it points to a pointer.
    Owned::new(|token| unsafe { camlux_cancel_token_create(token) })
}

/// A struct of default values with a change.
pub fn with<T: Default>(change: fn(&mut T)) -> T {
    let mut value = T::default();
    change(&mut value);
    value
}

/// A file of the folder of scenes.
pub fn file(name: &str) -> CString {
    c_path(
        &Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("scenes")
            .join(name),
    )
}

pub fn c_path(path: &Path) -> CString {
    CString::new(path.to_str().expect("a UTF-8 path")).expect("no NUL")
}

pub fn load(name: &str) -> Scene {
    let path = file(&format!("{name}.toml"));
    // SAFETY: a string, and a pointer to a pointer.
    Owned::new(|scene| unsafe { camlux_scene_load_file(path.as_ptr(), scene) })
}

pub fn load_at(name: &str, size_px: [u32; 2]) -> Scene {
    let scene = load(name);
    scene.resize(size_px[0], size_px[1]);
    scene
}

/// The Cornell box, whose bounce is a sum over few VPLs: a small frame of it is fast.
pub fn fast_scene(size_px: u32) -> Scene {
    let scene = load_at("cornell", [size_px; 2]);
    scene.plain_sum(8);
    scene
}

/// The same scene file without the C interface.
pub fn engine_scene(name: &str, resolution_px: [u32; 2]) -> camlux::Scene {
    let path = file(&format!("{name}.toml"));
    let path = Path::new(path.to_str().expect("a UTF-8 path"));
    let mut scene = camlux::Scene::load(path).expect("a demo scene loads");
    scene.camera.resolution_px = resolution_px;
    scene
}

/// The layers of a frame that is rendered without the C interface.
pub fn engine_frame(scene: &camlux::Scene) -> Vec<(i32, Vec<u32>)> {
    let device = camlux::Device::open(&Default::default()).expect("a device");
    let mut renderer = camlux::Renderer::new(&device).expect("a renderer");
    let frame = renderer.render(scene, &mut Default::default());
    layers_of(&frame.expect("the scene renders"))
}

impl Scene {
    pub fn camera(&self) -> camlux_camera {
        let mut camera = init!(camlux_camera {});
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_scene_get_camera(self.raw(), &mut camera) });
        camera
    }

    pub fn light(&self, index: u32) -> camlux_light {
        let mut light = init!(camlux_light {});
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_scene_get_light(self.raw(), index, &mut light) });
        light
    }

    pub fn material(&self, index: u32) -> camlux_material {
        let mut material = init!(camlux_material {});
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_scene_get_material(self.raw(), index, &mut material) });
        material
    }

    pub fn pose(&self, part: i32, index: u32) -> camlux_pose {
        let mut pose = init!(camlux_pose {});
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_scene_get_pose(self.raw(), part, index, &mut pose) });
        pose
    }

    pub fn counts(&self) -> camlux_scene_counts {
        let mut counts = init!(camlux_scene_counts {});
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_scene_get_counts(self.raw(), &mut counts) });
        counts
    }

    /// Moves a part and turns it.
    pub fn place(&self, part: i32, index: u32, position_m: DVec3, turn: DQuat) {
        let pose = init!(camlux_pose {
            position_m: position_m.to_array(),
            orientation_xyzw: turn.to_array(),
        });
        ok(self.set_pose(part, index, &pose));
    }

    pub fn validate(&self) -> camlux_status {
        camlux_scene_validate(self.raw())
    }

    pub fn resize(&self, width_px: u32, height_px: u32) {
        let camera = self.camera();
        ok(self.set_camera(&camlux_camera {
            width_px,
            height_px,
            ..camera
        }));
    }

    pub fn plain_sum(&self, rsm_size: u32) {
        ok(self.set_indirect(&init!(camlux_indirect {
            estimator: CAMLUX_ESTIMATOR_INSTANT_RADIOSITY,
            rsm_size: rsm_size
        })));
    }
}

/// Setters, each with a struct of its size, whose pointers are valid or will be refused.
macro_rules! setters {
    ($($name:ident[$($index:ident: $number:ty),*]($value:ident) = $call:ident;)*) => {
        impl Scene {$(
            pub fn $name(&self, $($index: $number,)* value: &$value) -> camlux_status {
                // SAFETY: see above.
                unsafe { $call(self.raw(), $($index,)* value) }
            }
        )*}
    };
}
setters! {
    set_camera[](camlux_camera) = camlux_scene_set_camera;
    set_sensor[](camlux_sensor) = camlux_scene_set_sensor;
    set_indirect[](camlux_indirect) = camlux_scene_set_indirect;
    set_direct[](camlux_direct) = camlux_scene_set_direct;
    set_tof[](camlux_tof) = camlux_scene_set_tof;
    set_light[index: u32](camlux_light) = camlux_scene_set_light;
    set_material[index: u32](camlux_material) = camlux_scene_set_material;
    set_mesh[index: u32](camlux_mesh) = camlux_scene_set_mesh;
    set_texture[index: u32](camlux_texture) = camlux_scene_set_texture;
    set_pose[part: i32, index: u32](camlux_pose) = camlux_scene_set_pose;
}

/// The same with NULL, which asks for none.
macro_rules! unsetters {
    ($($name:ident = $call:ident;)*) => {
        impl Scene {$(
            pub fn $name(&self) {
                // SAFETY: NULL is allowed.
                ok(unsafe { $call(self.raw(), null()) });
            }
        )*}
    };
}
unsetters! {
    unset_sensor = camlux_scene_set_sensor;
    unset_indirect = camlux_scene_set_indirect;
    unset_direct = camlux_scene_set_direct;
    unset_tof = camlux_scene_set_tof;
}

/// Calls that add a part. They give its index, or the status of a failure, which gives none.
macro_rules! adders {
    ($($name:ident($value:ident) = $call:ident;)*) => {
        impl Scene {$(
            pub fn $name(&self, value: &$value) -> Result<u32, camlux_status> {
                let mut index = u32::MAX;
                // SAFETY: a struct of that size, whose pointers are valid or will be refused, and a number.
                match unsafe { $call(self.raw(), value, &mut index) } {
                    CAMLUX_OK => Ok(index),
                    failed => {
                        assert_eq!(index, u32::MAX);
                        Err(failed)
                    }
                }
            }
        )*}
    };
}
adders! {
    add_light(camlux_light) = camlux_scene_add_light;
    add_material(camlux_material) = camlux_scene_add_material;
    add_mesh(camlux_mesh) = camlux_scene_add_mesh;
    add_texture(camlux_texture) = camlux_scene_add_texture;
}

impl Renderer {
    pub fn render(&self, scene: &Scene) -> Frame {
        self.try_render(scene, &Default::default())
            .unwrap_or_else(|status| panic!("{status}: {}", last_error()))
    }

    /// The options' pointers must be valid, or be refused.
    pub fn try_render(
        &self,
        scene: &Scene,
        options: &camlux_render_options,
    ) -> Result<Frame, camlux_status> {
        // SAFETY: a struct of that size, and a pointer to a pointer.
        Owned::try_new(|frame| unsafe {
            camlux_renderer_render(self.raw(), scene.raw(), options, frame)
        })
    }

    pub fn try_submit(
        &self,
        scene: &Scene,
        options: &camlux_render_options,
    ) -> Result<Owned<camlux_job>, camlux_status> {
        // SAFETY: a struct of that size, and a pointer to a pointer.
        Owned::try_new(|job| unsafe {
            camlux_renderer_submit(self.raw(), scene.raw(), options, job)
        })
    }

    /// The frames of all cameras. If one fails, there is none.
    pub fn render_cameras(
        &self,
        scene: &Scene,
        cameras: &[camlux_camera],
        options: &camlux_render_options,
    ) -> Result<Vec<Frame>, camlux_status> {
        let mut frames = vec![null_mut(); cameras.len()];
        // SAFETY: both arrays have that length.
        let status = unsafe {
            camlux_renderer_render_cameras(
                self.raw(),
                scene.raw(),
                cameras.as_ptr(),
                cameras.len(),
                size_of::<camlux_camera>(),
                options,
                frames.as_mut_ptr(),
            )
        };
        match status {
            CAMLUX_OK => Ok(frames.into_iter().map(Owned).collect()),
            failed => {
                assert!(frames.iter().all(|frame| frame.is_null()));
                Err(failed)
            }
        }
    }
}

impl Frame {
    pub fn view(&self, layer: i32) -> camlux_view {
        let mut view = init!(camlux_view {});
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_frame_view(self.raw(), layer, &mut view) });
        view
    }

    /// The values of a layer, as bits.
    pub fn words(&self, layer: i32) -> Vec<u32> {
        let view = self.view(layer);
        let length = view.size_bytes / 4;
        // SAFETY: a view is as large as it says; values of both formats have four bytes.
        unsafe { std::slice::from_raw_parts(view.data.cast(), length) }.to_vec()
    }

    pub fn layers(&self) -> Vec<(i32, Vec<u32>)> {
        let mut count = 0;
        // SAFETY: it points to a number.
        ok(unsafe { camlux_frame_layer_count(self.raw(), &mut count) });
        let layer = |index| {
            let mut layer = -1;
            // SAFETY: it points to a number.
            ok(unsafe { camlux_frame_get_layer(self.raw(), index, &mut layer) });
            (layer, self.words(layer))
        };
        (0..count).map(layer).collect()
    }

    pub fn stats(&self) -> camlux_frame_stats {
        let mut stats = init!(camlux_frame_stats {});
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_frame_get_stats(self.raw(), &mut stats) });
        stats
    }

    pub fn passes(&self) -> Vec<String> {
        let pass = |index| {
            let mut pass = init!(camlux_pass_time {});
            // SAFETY: it points to a struct of that size; the name lives as long as the frame.
            unsafe {
                ok(camlux_frame_get_pass(self.raw(), index, &mut pass));
                CStr::from_ptr(pass.name)
                    .to_str()
                    .expect("ASCII")
                    .to_owned()
            }
        };
        (0..self.stats().pass_count).map(pass).collect()
    }
}
