#![no_main]
//! An STL file, with a material of the scene.

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| camlux_fuzz::load_mesh("mesh.stl", bytes));
