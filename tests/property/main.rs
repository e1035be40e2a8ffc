//! Properties that hold for any input, and closed forms.

#[path = "../common/mod.rs"]
mod common;

mod accumulation;
mod bounds;
mod brdf;
mod calibration_files;
#[cfg(feature = "reference")]
mod distortion;
mod edge;
mod emission;
mod frame;
mod frame_views;
mod gltf_file;
mod gltf_keys;
mod input;
mod kept;
mod lamp_files;
mod lattice;
mod layers;
mod local_space;
mod mesh_file;
mod mesh_formats;
mod mesh_keys;
mod metamorphic;
mod metamorphic_rays;
mod metrics;
#[cfg(feature = "reference")]
mod mirror;
mod model;
mod model_parts;
mod modules;
mod mtl_materials;
mod multipart_exr;
mod output;
mod output_file;
mod pattern;
#[cfg(feature = "reference")]
mod phasor;
mod plain_exr;
mod polygons;
mod projector;
mod readout;
mod reference;
#[cfg(feature = "reference")]
mod relations;
mod request_layers;
mod rotation;
mod saved_scene;
mod scene_file;
mod scene_hash;
mod scenes;
mod scenes_load;
mod sensor_noise;
mod texture;
