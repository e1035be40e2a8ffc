#![no_main]
//! A text or binary glTF file; its beginning tells which.

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| camlux_fuzz::load_gltf(bytes));
