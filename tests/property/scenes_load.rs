//! Every scene under `scenes/` loads, and none of its materials reflects more than it receives.

use std::path::Path;

use camlux::scene::Scene;

#[test]
fn every_scene_loads_and_conserves_energy() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut loaded = 0;
    for entry in std::fs::read_dir(folder).expect("scenes/ is there") {
        let path = entry.expect("scenes/ can be listed").path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let scene = Scene::load(&path).unwrap_or_else(|error| panic!("{error}"));
        for material in &scene.materials {
            for (kd, ks) in material.kd.iter().zip(material.ks) {
                assert!(
                    kd + ks <= 1.0,
                    "{}: {}: k_d + k_s > 1",
                    path.display(),
                    material.name
                );
            }
        }
        loaded += 1;
    }
    // Guards against a folder that was moved: an empty loop would pass.
    assert!(loaded >= 5, "only {loaded} scenes were found");
}
