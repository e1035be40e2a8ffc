//! The C interface, called as a C program calls it.

mod cameras;
mod changes;
mod frames;
mod fuzz;
mod handles;
mod host;
mod jobs;
mod lamps;
mod lights;
mod log;
mod matrices;
mod meshes;
mod moves;
mod objects;
mod panics;
mod prepared;
mod progress;
mod sequence;
mod settings;
mod targets;
mod textures;
mod threads;
mod time_of_flight;
mod values;
mod vulkan;
mod words;
