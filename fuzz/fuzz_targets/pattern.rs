#![no_main]
//! The pattern of the only light: a EULUMDAT file after the prefix `LDT`, otherwise an IES file.

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let (name, bytes) = match bytes.strip_prefix(b"LDT") {
        Some(bytes) => ("lamp.ldt", bytes),
        None => ("lamp.ies", bytes),
    };
    let scene = camlux_fuzz::SCENE.replace(
        "kind = \"point\"",
        &format!(
            "kind = \"pattern\"\npattern = \"{name}\"\ndirection = [0, -1, 0]\nup = [1, 0, 0]"
        ),
    );
    camlux_fuzz::with_file("scene.toml", scene.as_bytes(), |_| ());
    camlux_fuzz::load_with(name, bytes);
});
