#![no_main]
//! An OBJ file, beside a material library.

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| camlux_fuzz::load_with("mesh.obj", bytes));
