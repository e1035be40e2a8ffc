#![no_main]
//! Text of a scene file, beside the scenes of the repository.

use std::path::Path;

use camlux::Scene;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/scene.toml"));
    camlux_fuzz::check(Scene::parse(text, file));
});
