//! The compiled shaders that are checked in agree with the source and are valid.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// What this build compiled.
const BUILT: &str = env!("CAMLUX_SPIRV");
const UPDATE: &str = "run `UPDATE_SPIRV=1 cargo test --test generated` and check in spirv/";

fn checked_in() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("spirv")
}

/// The generated files of a folder by name; the README is written by hand.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    let file = |entry: std::io::Result<fs::DirEntry>| {
        let entry = entry.expect("the folder is readable");
        let name = entry.file_name().into_string().expect("an ASCII name");
        (name, fs::read(entry.path()).expect("the file is readable"))
    };
    entries
        .map(file)
        .filter(|(name, _)| name != "README.md")
        .collect()
}

fn update(built: &BTreeMap<String, Vec<u8>>) {
    for name in files(&checked_in()).keys() {
        if !built.contains_key(name) {
            fs::remove_file(checked_in().join(name)).expect("spirv/ is writable");
        }
    }
    for (name, bytes) in built {
        fs::write(checked_in().join(name), bytes).expect("spirv/ is writable");
    }
}

#[test]
fn checked_in_modules_are_those_of_the_shaders() {
    let built = files(Path::new(BUILT));
    if std::env::var_os("UPDATE_SPIRV").is_some() {
        update(&built);
    }
    let checked_in = files(&checked_in());
    let mut faults = Vec::new();
    for (name, bytes) in &built {
        match checked_in.get(name) {
            None => faults.push(format!("{name} is missing")),
            Some(other) if other != bytes => faults.push(format!("{name} differs")),
            Some(_) => {}
        }
    }
    let surplus = checked_in.keys().filter(|name| !built.contains_key(*name));
    faults.extend(surplus.map(|name| format!("{name} is of no permutation")));
    assert!(faults.is_empty(), "{UPDATE}: {faults:#?}");
}

#[test]
fn every_module_is_valid_vulkan_1_3() {
    let modules: Vec<String> = files(Path::new(BUILT))
        .into_keys()
        .filter(|name| name.ends_with(".spv"))
        .collect();
    assert!(!modules.is_empty());
    for name in modules {
        let output = Command::new("spirv-val")
            .args(["--target-env", "vulkan1.3"])
            .arg(Path::new(BUILT).join(&name))
            .output()
            .expect("scripts/setup installs spirv-val");
        let says = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{name}: {says}");
    }
}
