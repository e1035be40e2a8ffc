//! The generated files that are checked in are up to date.

mod header;
mod layouts;
mod names;
mod parameters;
mod spirv;
