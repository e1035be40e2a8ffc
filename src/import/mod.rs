//! Reads scenes from files: scene files (TOML), meshes with their materials and textures, and measured lamps.

mod assets;
mod colors;
mod corners;
mod eulumdat;
mod gltf;
mod grey_image;
mod ies;
mod indirect;
mod lines;
mod mtl;
mod mtl_map;
mod obj;
mod obj_material;
mod pattern;
mod ply;
mod polygons;
mod scene_file;
mod scene_parts;
mod split;
mod stl;
mod texture;
mod tof;
mod types_a_b;
mod unused;
mod words;
