//! MTL material libraries: Kd, Ks, Ns, map_Kd, norm, map_Bump, map_d. Everything else (ambient, emission, `d`, `illum`) is not part of the
//! model and is ignored.
//!
//! The MTL format defines no defaults. Here Ks is 0 if absent, and Kd is 1 if there is only a map_Kd. A material that has neither Kd nor
//! map_Kd, or has Ks without Ns, is refused: any number would be a guess.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::lines::{Line, lines, read_text, resolved};
use crate::{Error, Result};

/// The materials that the MTL files of one OBJ file define.
#[derive(Default)]
pub(super) struct Library {
    entries: HashMap<String, LibraryMaterial>,
    files_read: HashSet<PathBuf>,
}

pub(super) struct LibraryMaterial {
    pub properties: tobj::Material,
    pub places: Places,
    /// The folder for relative map paths.
    pub folder: PathBuf,
}

/// A map named by `norm` or `map_Bump`.
#[derive(Debug, Clone)]
pub(super) struct NormalMap {
    pub path: String,
    /// The factor for slopes.
    pub strength: f64,
    /// Whether grey values are heights.
    pub may_be_heights: bool,
    /// The line that names it.
    pub named_at: String,
}

/// Files and lines that define a material.
#[derive(Default)]
pub(super) struct Places {
    /// The place of `newmtl`.
    pub name: String,
    /// The place of `map_Kd`, if there is one.
    pub texture: String,
    pub normal_map: Option<NormalMap>,
    /// The file that `map_d` names, and its line.
    pub alpha_map: Option<(String, String)>,
}

impl Library {
    /// Reads the files of a `mtllib` statement: one file whose name may contain spaces, or several.
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
        if self.files_read.insert(resolved(file)) {
            self.read_file(file, named_at)
        } else {
            Ok(())
        }
    }

    pub fn get(&self, name: &str) -> Option<&LibraryMaterial> {
        self.entries.get(name)
    }

    /// Names in alphabetical order.
    pub fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.entries.keys().map(String::as_str).collect();
        names.sort_unstable();
        names
    }

    fn read_file(&mut self, file: &Path, named_at: &str) -> Result<()> {
        let (text, found) = check(&read_text(file, named_at, "material library")?, file)?;
        let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes()).map_err(|error| {
            let problem = format!("not a material library: {error}");
            Error::scene(file.display().to_string(), problem, "export it again")
        })?;
        let folder = file.parent().unwrap_or(Path::new(""));
        for (properties, places) in materials.into_iter().zip(found) {
            let name = properties.name.clone();
            if let Some(earlier) = self.entries.get(&name) {
                let earlier = &earlier.places.name;
                return Err(Error::scene(
                    places.name,
                    format!("material \"{name}\" is already defined at {earlier}"),
                    "rename or remove one of them",
                ));
            }
            let material = LibraryMaterial {
                properties,
                places,
                folder: folder.to_owned(),
            };
            self.entries.insert(name, material);
        }
        Ok(())
    }
}

/// Checks an MTL file line by line and keeps the supported statements, because `tobj` reports no lines and panics on a Kd of one number.
/// Also returns the places and the normal map of each material, because `tobj` does not read the options of a normal map.
fn check(text: &str, file: &Path) -> Result<(String, Vec<Places>)> {
    let mut checked = String::new();
    let mut places: Vec<Places> = Vec::new();
    for line in lines(text, file) {
        let keyword = line.keyword();
        let value = match keyword {
            "newmtl" => {
                places.push(Places {
                    name: line.at(),
                    ..Places::default()
                });
                line.name()?.to_owned()
            }
            "Kd" | "Ks" => match *line.numbers(1..=3)? {
                // One number stands for all three bands (MTL format, "Kd r g b": g and b are optional).
                [grey] => format!("{grey:?} {grey:?} {grey:?}"),
                [r, g, b] => format!("{r:?} {g:?} {b:?}"),
                _ => return Err(line.error("has two numbers", "write one or three")),
            },
            "Ns" => format!("{:?}", line.numbers(1..=1)?[0]),
            "map_Kd" => texture_path(line.name()?, &line)?,
            "norm" | "map_Bump" | "map_bump" | "bump" | "map_d" => String::new(),
            _ => continue,
        };
        let Some(places) = places.last_mut() else {
            return Err(line.error("stands before any material", "begin one with newmtl"));
        };
        if keyword == "map_d" {
            if places.alpha_map.is_some() {
                let hint = "keep one of them";
                return Err(line.error("is the second of its material", hint));
            }
            places.alpha_map = Some((texture_path(line.name()?, &line)?, line.at()));
            continue;
        }
        if value.is_empty() {
            if places.normal_map.is_some() {
                let hint = "keep one of norm and map_Bump";
                return Err(line.error("is the second map of normals of its material", hint));
            }
            places.normal_map = Some(named_normal_map(keyword, &line)?);
            continue;
        }
        if keyword == "map_Kd" {
            places.texture = line.at();
        }
        checked.push_str(&format!("{keyword} {value}\n"));
    }
    Ok((checked, places))
}

/// Reads a path, which may follow `-bm` and the strength of a bump map.
fn named_normal_map(keyword: &str, line: &Line) -> Result<NormalMap> {
    let text = line.name()?;
    let mut strength = 1.0;
    let mut path = text;
    if let Some(given) = text.strip_prefix("-bm ").filter(|_| keyword != "norm") {
        let given = given.trim_start();
        let (number, rest) = given.split_once(char::is_whitespace).unwrap_or((given, ""));
        strength = number
            .parse()
            .ok()
            .filter(|s: &f64| s.abs() <= 1e3)
            .ok_or_else(|| {
                line.error(
                    "has a -bm that is not a number from -1000 to 1000",
                    "write it as -bm 0.5 bumps.png",
                )
            })?;
        path = rest.trim_start();
    }
    Ok(NormalMap {
        path: texture_path(path, line)?,
        strength,
        may_be_heights: keyword != "norm",
        named_at: line.at(),
    })
}

fn texture_path(path: &str, line: &Line) -> Result<String> {
    if path.is_empty() {
        return Err(line.error(
            "names no file",
            "write the path of a PNG or JPEG file after it",
        ));
    }
    if path.starts_with('-') {
        return Err(line.error(
            "has options, which camlux does not read",
            "keep only the path, and bake the options into the image or the texture coordinates",
        ));
    }
    Ok(path.to_owned())
}
