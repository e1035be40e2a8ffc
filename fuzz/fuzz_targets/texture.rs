#![no_main]
//! A PNG or JPEG file, the texture of the only material.

use std::sync::Once;

use libfuzzer_sys::fuzz_target;

static TEXTURED: Once = Once::new();

fuzz_target!(|bytes: &[u8]| {
    // The scene is refused until the texture exists.
    TEXTURED.call_once(|| camlux_fuzz::load_with("mesh.mtl", b"newmtl white\nmap_Kd texture"));
    camlux_fuzz::load_with("texture", bytes);
});
