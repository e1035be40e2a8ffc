#![no_main]
//! A material library, beside a mesh that names one of its materials.

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| camlux_fuzz::load_with("mesh.mtl", bytes));
