//! Code that the fuzz targets share: a folder in memory with a valid scene, and checks of the results.

use std::cell::RefCell;
use std::path::Path;

use camlux::{DeviceInfo, DeviceKind, DeviceLimits, Error, Plan, Scene};

pub const SCENE: &str = "[camera]
resolution = [8, 6]
position = [0, 1, 3]
look_at = [0.0, 1.0, 0.0]
up = [0.0, 1.0, 0.0]
fov_y_deg = 50.0
[[light]]
kind = \"point\"
position = [0.0, 1.98, 0.0]
power_w = 50.0
[indirect]
estimator = \"final-gather\"
[[mesh]]
path = \"mesh.obj\"
";
const OBJ: &str = "mtllib mesh.mtl
usemtl white
v 0 0 0
v 1 0 0
v 0 1 0
vt 0 0
f 1/1 2/1 3/1
";
const MTL: &str = "newmtl white\nKd 0.7 0.6 0.5\n";

thread_local! {
    static FOLDER: RefCell<Option<tempfile::TempDir>> = const { RefCell::new(None) };
}

/// Loads the valid scene with one of its files replaced.
pub fn load_with(name: &str, content: &[u8]) {
    check(with_file(name, content, |file| {
        Scene::load(&file.with_file_name("scene.toml"))
    }));
}

/// Loads the valid scene with a text or binary glTF file instead of its mesh.
pub fn load_gltf(content: &[u8]) {
    check(with_file("mesh.glb", content, |file| {
        let scene = SCENE.replace("mesh.obj", "mesh.glb");
        Scene::parse(&scene, &file.with_file_name("scene.toml"))
    }));
}

/// Loads the valid scene with a mesh of a format without materials instead of its own.
pub fn load_mesh(name: &str, content: &[u8]) {
    check(with_file(name, content, |file| {
        let scene = SCENE.replace("mesh.obj", name);
        let scene = format!("{scene}material = \"clay\"\n[material.clay]\nkd = 0.5\n");
        Scene::parse(&scene, &file.with_file_name("scene.toml"))
    }));
}

/// Writes a file of this content beside those of the valid scene, and passes its path to `act`.
pub fn with_file<T>(name: &str, content: &[u8], act: impl FnOnce(&Path) -> T) -> T {
    FOLDER.with_borrow_mut(|folder| {
        let file = folder.get_or_insert_with(scene_folder).path().join(name);
        std::fs::write(&file, content).expect("a folder in memory");
        act(&file)
    })
}

fn scene_folder() -> tempfile::TempDir {
    let shared_memory = Path::new("/dev/shm");
    let folder = if shared_memory.is_dir() {
        tempfile::tempdir_in(shared_memory)
    } else {
        tempfile::tempdir()
    };
    let folder = folder.expect("a folder for temporary files");
    for (name, content) in [("scene.toml", SCENE), ("mesh.obj", OBJ), ("mesh.mtl", MTL)] {
        std::fs::write(folder.path().join(name), content).expect("a folder in memory");
    }
    folder
}

/// Asserts that a loaded scene is valid, and that each error is one line.
pub fn check(loaded: camlux::Result<Scene>) {
    match loaded {
        Ok(scene) => {
            scene.validate().expect("what loads is valid");
            scene.hash();
            scene.warnings();
            match Plan::new(&scene, &device()) {
                Ok(plan) => drop(plan.to_string()),
                Err(error) => check_message(&error),
            }
        }
        Err(error) => check_message(&error),
    }
}

pub fn check_message(error: &Error) {
    let message = error.to_string();
    assert!(!message.contains(char::is_control), "{message:?}");
    assert!(message.len() < 20_000, "{} bytes", message.len());
}

/// A device with lavapipe's limits.
fn device() -> DeviceInfo {
    DeviceInfo {
        index: 0,
        name: "none".into(),
        uuid: String::new(),
        pci: None,
        kind: DeviceKind::Cpu,
        driver: String::new(),
        api_version: "1.3".into(),
        has_ray_query: false,
        limits: DeviceLimits {
            max_image_px: 16_384,
            max_image_layers: 2048,
            max_storage_buffer_bytes: 128 << 20,
            max_allocation_bytes: 2 << 30,
            max_buffer_bytes: 2 << 30,
            memory_bytes: 16 << 30,
            max_storage_images: 8,
            shared_memory_bytes: 32 << 10,
            subgroup_lanes: 8,
            broadcast_lanes: Some(8),
            sub_pixel_bits: 8,
            timestamp_period_ns: Some(1.0),
        },
        quirks: Default::default(),
        unusable: None,
    }
}
