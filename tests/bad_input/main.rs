//! Bad files and values: each is refused with a message that states what is wrong, where, and how to mend it.

#[path = "../common/mod.rs"]
mod common;

mod calibration;
mod gltf_file;
mod image_file;
mod mesh_file;
mod ply_file;
mod saved_scene;
mod scene_file;
mod scene_values;
mod stl_file;
