//! Shared by the benches: the scenes that one renders.

use std::path::{Path, PathBuf};

/// The scene files that arguments name. Without any, those of the repository with these names.
pub fn given_or(given: Vec<PathBuf>, names: &[&str]) -> Vec<PathBuf> {
    if !given.is_empty() {
        return given;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = names.iter().map(|name| folder.join(format!("{name}.toml")));
    files.collect()
}
