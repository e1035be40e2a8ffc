#![no_main]
//! A glTF file, of text or binary: how it begins tells them apart.

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| camlux_fuzz::load_gltf(bytes));
