//! Reads scenes from files: scene files (TOML), meshes with their materials and textures, and measured lamps.

mod calibration;
mod grey_image;
mod lamp;
mod lines;
mod mesh;
mod scene_file;
mod texture;
mod unused;
mod words;

pub use calibration::{ImagePoses, image_poses};
pub(crate) use lamp::pattern_text;
