//! Randomly damaged files and hostile files. This is a separate program, because its allocator counts the memory of the whole process.

#[path = "../common/mod.rs"]
mod common;

mod damaged;
mod damaged_meshes;
mod hostile;
mod hostile_meshes;
mod judge;
mod mutate;
mod scene_text;
