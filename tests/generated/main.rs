//! The generated files that are checked in are up to date.

mod header;
mod layers;
mod layouts;
mod names;
mod parameters;
mod spirv;
