//! MTL material libraries: Kd, Ks, Ns, map_Kd. Everything else in them (ambient, emission, bump, opacity, `illum`) has no
//! place in the model and is left out.
//!
//! The MTL format states no defaults. Here Ks is 0 when absent, and Kd is 1 below a map_Kd. A material that has neither Kd
//! nor map_Kd, or has Ks without Ns, is refused: any number put there would be a guess.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::lines::{Line, lines, read_text};
use crate::{Error, Result};

/// The materials that the MTL files of one OBJ define.
#[derive(Default)]
pub(super) struct Library {
    entries: HashMap<String, Entry>,
    files_read: HashSet<PathBuf>,
}

/// What a library says of one material, and where: files and lines.
#[derive(Default)]
pub(super) struct Entry {
    pub name: String,
    pub diffuse: Option<[f64; 3]>,
    pub specular: Option<[f64; 3]>,
    pub shininess: Option<f64>,
    pub diffuse_texture: Option<String>,
    /// Of `newmtl`.
    pub at: String,
    /// Of `map_Kd`, where there is one.
    pub texture_at: String,
    /// The folder that map_Kd is relative to.
    pub folder: PathBuf,
}

impl Library {
    /// Reads what a `mtllib` statement names: one file whose name may hold spaces, or several.
    pub fn read(&mut self, names: &str, folder: &Path, named_at: &str) -> Result<()> {
        let whole = folder.join(names);
        if whole.exists() {
            return self.read_once(&whole, named_at);
        }
        for name in names.split_whitespace() {
            self.read_once(&folder.join(name), named_at)?;
        }
        Ok(())
    }

    /// Some exporters name the library again with every object.
    fn read_once(&mut self, file: &Path, named_at: &str) -> Result<()> {
        // A file that cannot be resolved cannot be read either, and reading it gives the better message.
        let key = file.canonicalize().unwrap_or_else(|_| file.to_owned());
        if !self.files_read.insert(key) {
            return Ok(());
        }
        self.read_file(file, named_at)
    }

    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.entries.get(name)
    }

    /// Names in alphabetical order.
    pub fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.entries.keys().map(String::as_str).collect();
        names.sort_unstable();
        names
    }

    fn read_file(&mut self, file: &Path, named_at: &str) -> Result<()> {
        let text = read_text(file, named_at, "material library")?;
        for entry in parse(&text, file)? {
            if let Some(earlier) = self.entries.get(&entry.name) {
                let Entry { name, at, .. } = entry;
                return Err(Error::scene(
                    at,
                    format!("material \"{name}\" is already defined at {}", earlier.at),
                    "rename or remove one of them",
                ));
            }
            self.entries.insert(entry.name.clone(), entry);
        }
        Ok(())
    }
}

fn parse(text: &str, file: &Path) -> Result<Vec<Entry>> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut entries: Vec<Entry> = Vec::new();
    for line in lines(text, file) {
        let keyword = line.keyword();
        if keyword == "newmtl" {
            entries.push(Entry {
                name: line.name()?.to_owned(),
                at: line.at(),
                folder: folder.to_owned(),
                ..Entry::default()
            });
            continue;
        }
        if !["Kd", "Ks", "Ns", "map_Kd"].contains(&keyword) {
            continue;
        }
        let Some(entry) = entries.last_mut() else {
            return Err(line.error("stands before any material", "begin one with newmtl"));
        };
        match keyword {
            "Kd" => entry.diffuse = Some(bands(&line)?),
            "Ks" => entry.specular = Some(bands(&line)?),
            "Ns" => entry.shininess = Some(line.numbers(1..=1)?[0]),
            _ => {
                entry.diffuse_texture = Some(texture_path(&line)?);
                entry.texture_at = line.at();
            }
        }
    }
    Ok(entries)
}

/// One number stands for all three bands (MTL format, "Kd r g b": g and b are optional).
fn bands(line: &Line) -> Result<[f64; 3]> {
    match *line.numbers(1..=3)? {
        [grey] => Ok([grey; 3]),
        [r, g, b] => Ok([r, g, b]),
        _ => Err(line.error("has two numbers", "write one or three")),
    }
}

fn texture_path(line: &Line) -> Result<String> {
    let path = line.name()?;
    if path.starts_with('-') {
        return Err(line.error(
            "has options, which are not read",
            "leave the path only, and bake the options into image or texture coordinates",
        ));
    }
    Ok(path.to_owned())
}
