#![no_main]
//! The camera of a calibration: the first byte chooses the format.

use libfuzzer_sys::fuzz_target;

const NAMES: [&str; 7] = [
    "cam.yaml",
    "cam.json",
    "cam.xml",
    "images.txt",
    "images.bin",
    "cameras.txt",
    "cameras.bin",
];

fuzz_target!(|bytes: &[u8]| {
    let Some((&kind, bytes)) = bytes.split_first() else {
        return;
    };
    let name = NAMES[usize::from(kind) % NAMES.len()];
    // A pose of the scene file would be refused beside that of an image.
    let scene = match name {
        "images.txt" | "images.bin" | "cam.json" => camlux_fuzz::SCENE.replace(
            "position = [0, 1, 3]\nlook_at = [0.0, 1.0, 0.0]\nup = [0.0, 1.0, 0.0]\n",
            "",
        ),
        _ => camlux_fuzz::SCENE.to_owned(),
    };
    let scene = scene
        .replace("resolution = [8, 6]\n", "")
        .replace("fov_y_deg = 50.0", &format!("path = \"{name}\""));
    camlux_fuzz::with_file("cameras.txt", b"1 PINHOLE 8 6 8 8 4 3\n", |_| ());
    camlux_fuzz::with_file("scene.toml", scene.as_bytes(), |_| ());
    camlux_fuzz::load_with(name, bytes);
});
