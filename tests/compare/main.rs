//! What the device computes, against the model in f64, against rays in f64 and against path-traced references.

#![cfg(feature = "reference")]

#[path = "../common/mod.rs"]
mod common;

mod adaptive_sum;
mod area_light;
mod bounces;
mod corners;
mod cutouts;
mod direct;
mod emission;
mod final_gather;
mod final_gather_ended;
mod fronts;
mod geometry;
mod gltf;
mod gltf_twins;
mod instances;
mod instant_radiosity;
mod kernels;
mod lens;
mod mesh_pixels;
mod normal_maps;
mod one_sided;
mod orthographic;
mod pixel_samples;
mod ply;
mod rays;
mod reference;
mod reference_bounces;
mod reference_mesh;
mod reference_tof;
mod reference_truth;
mod seen_triangles;
mod shadow_rays;
mod shadows;
mod smooth;
mod texture_lookups;
mod tof;
mod tof_bounce;
mod truth;
mod uncertainty;
mod vertex_colors;
