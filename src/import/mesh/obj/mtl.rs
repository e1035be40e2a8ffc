//! MTL material libraries.
//!
//! The MTL format defines no defaults. Here Ks and Ke are 0 if absent, and Kd is 1 if there is only a map_Kd. A material that has neither Kd nor
//! map_Kd, or has Ks without Ns, is refused: any number would be a guess.
//!
//! The crate `tobj` is not used: it knows neither lines nor options, and panics on a Kd of one number.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::map::Map;
use crate::import::lines::{Line, Lines, named_file, open, place, resolved};
use crate::import::unused::Unused;
use crate::scene::Bands;
use crate::{Error, Result};

/// The keys of the format and of its extension for physically based materials. [`Record::read`] takes those that camlux uses.
const KEYS: [&str; 42] = [
    "newmtl",
    "Kd",
    "Ks",
    "Ns",
    "illum",
    "map_Kd",
    "map_Ks",
    "map_Ns",
    "norm",
    "map_Bump",
    "bump",
    "map_d",
    "Pr",
    "Pm",
    "map_Pr",
    "map_Pm",
    "Ke",
    "map_Ke",
    "Ka",
    "Tf",
    "Tr",
    "d",
    "Ni",
    "sharpness",
    "Ps",
    "Pc",
    "Pcr",
    "aniso",
    "anisor",
    "map_Ka",
    "map_Tr",
    "map_Ps",
    "map_Pc",
    "map_Pcr",
    "map_aniso",
    "map_anisor",
    "map_aat",
    "disp",
    "decal",
    "refl",
    "map_refl",
    "Kt",
];

/// Values that mean nothing more than that the key is absent.
const WITHOUT_EFFECT: [(&str, &str); 14] = [
    ("Ka", "0"),
    ("Kt", "0"),
    ("Tf", "1"),
    ("Tr", "0"),
    ("d", "1"),
    ("Ni", "1"),
    ("Pm", "0"),
    ("Ps", "0"),
    ("Pc", "0"),
    ("Pcr", "0"),
    ("aniso", "0"),
    ("anisor", "0"),
    ("map_aat", "off"),
    ("illum", "2"),
];

/// The materials that the MTL files of one OBJ file define.
#[derive(Default)]
pub(super) struct Library {
    entries: HashMap<String, LibraryMaterial>,
    files_read: HashSet<PathBuf>,
    /// The files, and what they hold that camlux does not use.
    pub files: Vec<(PathBuf, Unused)>,
}

/// A material as its file gives it.
pub(super) struct LibraryMaterial {
    pub name: String,
    /// The place of `newmtl`.
    pub at: String,
    pub kd: Option<Bands>,
    /// Zero where `illum` says that there is no highlight.
    pub ks: Option<Bands>,
    pub shininess: Option<f64>,
    pub kd_map: Option<Box<Map>>,
    pub ks_map: Option<Box<Map>>,
    pub shininess_map: Option<Box<Map>>,
    /// `Pr`; without it and without `map_Pr`, the material is one of Phong.
    pub roughness: Option<f64>,
    pub metallic: Option<f64>,
    pub roughness_map: Option<Box<Map>>,
    pub metallic_map: Option<Box<Map>>,
    /// `Ke`.
    pub emission: Option<Bands>,
    pub emission_map: Option<Box<Map>>,
    /// `norm` or `map_Bump`.
    pub normal_map: Option<Box<Map>>,
    pub alpha_map: Option<Box<Map>>,
}

impl Library {
    /// Reads the files of a `mtllib` statement: one file whose name may contain spaces, or several.
    pub fn read(&mut self, names: &str, folder: &Path, named_at: &str) -> Result<()> {
        let whole = named_file(folder, names);
        if whole.exists() {
            return self.read_once(&whole, named_at);
        }
        for name in names.split_whitespace() {
            self.read_once(&named_file(folder, name), named_at)?;
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
        let (stream, _) = open(file, named_at, "material library")?;
        let mut lines = Lines::new(file, stream);
        let mut unused = Unused::default();
        let mut record = Record::default();
        while let Some(line) = lines.next_statement()? {
            let keyword = line.keyword();
            if keyword.eq_ignore_ascii_case("newmtl") {
                let next = Record::named(&line)?;
                self.add(std::mem::replace(&mut record, next), file, &mut unused)?;
            } else if record.name.is_none() && is_read(keyword) {
                return Err(line.error("stands before any material", "begin one with newmtl"));
            } else {
                record.add(&line, &mut unused);
            }
        }
        self.add(record, file, &mut unused)?;
        self.files.push((file.to_owned(), unused));
        Ok(())
    }

    fn add(&mut self, record: Record, file: &Path, unused: &mut Unused) -> Result<()> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let Some(material) = record.read(file, folder, unused)? else {
            return Ok(());
        };
        let name = material.name.clone();
        if let Some(earlier) = self.entries.get(&name) {
            let problem = format!("material \"{name}\" is already defined at {}", earlier.at);
            return Err(Error::scene(
                material.at,
                problem,
                "rename or remove one of them",
            ));
        }
        self.entries.insert(name, material);
        Ok(())
    }
}

/// Whether a key is one of those that [`Record::read`] takes.
fn is_read(keyword: &str) -> bool {
    KEYS[1..18]
        .iter()
        .any(|key| key.eq_ignore_ascii_case(keyword))
}

/// The statements of one material, which are taken one by one. What is left is not used.
#[derive(Default)]
struct Record {
    /// `None`: what stands before the first material.
    name: Option<String>,
    number: usize,
    statements: Vec<Statement>,
}

/// A statement of a known key.
struct Statement {
    key: &'static str,
    number: usize,
    text: String,
}

impl Record {
    fn named(line: &Line) -> Result<Self> {
        Ok(Record {
            name: Some(line.name()?.to_owned()),
            number: line.number(),
            statements: Vec::new(),
        })
    }

    fn add(&mut self, line: &Line, unused: &mut Unused) {
        let known = KEYS
            .into_iter()
            .find(|key| key.eq_ignore_ascii_case(line.keyword()));
        match known {
            Some(key) => self.statements.push(Statement {
                key,
                number: line.number(),
                text: format!("{} {}", line.keyword(), line.rest()),
            }),
            None => unused.add_unknown(line.keyword(), &KEYS),
        }
    }

    /// Takes the statements of these keys.
    fn take(&mut self, keys: &[&str]) -> Vec<Statement> {
        let is_one = |statement: &mut Statement| keys.contains(&statement.key);
        self.statements.extract_if(.., is_one).collect()
    }

    /// Reads the last statement of a key. Earlier ones are counted as not used.
    fn value<T>(
        &mut self,
        key: &'static str,
        file: &Path,
        unused: &mut Unused,
        read: impl FnOnce(&Line) -> Result<T>,
    ) -> Result<Option<T>> {
        let mut statements = self.take(&[key]);
        let Some(last) = statements.pop() else {
            return Ok(None);
        };
        let again = format!("\"{key}\" that a later one replaces");
        unused.add_many(&again, statements.len() as u64);
        read(&last.line(file)).map(Some)
    }

    /// Reads the only statement of these keys, a map.
    fn map(
        &mut self,
        keys: &[&'static str],
        file: &Path,
        folder: &Path,
        unused: &mut Unused,
    ) -> Result<Option<Box<Map>>> {
        let statements = self.take(keys);
        if let [_, second, ..] = &statements[..] {
            let line = second.line(file);
            let (problem, hint) = match keys {
                [_] => ("is the second of its material", "keep one of them"),
                _ => (
                    "is the second map of normals of its material",
                    "keep one of norm and map_Bump",
                ),
            };
            return Err(line.error(problem, hint));
        }
        let map = statements.first().map(|statement| {
            let line = statement.line(file);
            Map::read(statement.key, &line, folder, unused).map(Box::new)
        });
        map.transpose()
    }

    fn read(
        mut self,
        file: &Path,
        folder: &Path,
        unused: &mut Unused,
    ) -> Result<Option<LibraryMaterial>> {
        let Some(name) = self.name.take() else {
            self.report(unused);
            return Ok(None);
        };
        let kd = self.value("Kd", file, unused, bands)?;
        let emission = self.value("Ke", file, unused, bands)?;
        // Exporters write both kinds of lobe. The one of facets says more.
        let is_of_facets = |statement: &Statement| ["Pr", "map_Pr"].contains(&statement.key);
        let has_facets = self.statements.iter().any(is_of_facets);
        let mut ks = match has_facets {
            true => None,
            false => self.value("Ks", file, unused, bands)?,
        };
        let mut number = |key| self.value(key, file, unused, |line| Ok(line.numbers(1..=1)?[0]));
        let (shininess, roughness, metallic) = match has_facets {
            true => (None, number("Pr")?, number("Pm")?),
            false => (number("Ns")?, None, None),
        };
        let illum = self.value("illum", file, unused, |line| Ok(line.numbers(1..=1)?[0]))?;
        let mut map = |keys: &[&'static str]| self.map(keys, file, folder, unused);
        let kd_map = map(&["map_Kd"])?;
        let ([mut ks_map, mut shininess_map], [roughness_map, metallic_map]) = match has_facets {
            true => ([None, None], [map(&["map_Pr"])?, map(&["map_Pm"])?]),
            false => ([map(&["map_Ks"])?, map(&["map_Ns"])?], [None, None]),
        };
        let normal_map = map(&["norm", "map_Bump", "bump"])?;
        let alpha_map = map(&["map_d"])?;
        let emission_map = map(&["map_Ke"])?;
        match illum {
            // A constant colour, or the diffuse term alone.
            Some(0.0 | 1.0) => {
                (ks, ks_map, shininess_map) = (None, None, None);
            }
            None | Some(2.0) => {}
            Some(illum) => unused.add(&format!("\"illum\" {illum}, which is more than highlights")),
        }
        self.report(unused);
        Ok(Some(LibraryMaterial {
            name,
            at: place(file, self.number),
            kd,
            ks,
            shininess,
            kd_map,
            ks_map,
            shininess_map,
            roughness,
            metallic,
            roughness_map,
            metallic_map,
            emission,
            emission_map,
            normal_map,
            alpha_map,
        }))
    }

    /// Counts what was not taken.
    fn report(&self, unused: &mut Unused) {
        let left = self.statements.iter();
        for statement in left.filter(|statement| !statement.is_without_effect()) {
            unused.add(&format!("\"{}\"", statement.key));
        }
    }
}

impl Statement {
    fn line<'t>(&'t self, file: &'t Path) -> Line<'t> {
        Line::new(file, self.number, self.text.as_str().into())
    }

    fn is_without_effect(&self) -> bool {
        let line = self.line(Path::new(""));
        let values = WITHOUT_EFFECT.iter().filter(|(key, _)| *key == self.key);
        values.into_iter().any(|(_, value)| {
            let number = value.parse::<f64>().ok();
            let is_equal = |word: &str| match number {
                Some(_) => word.parse().ok() == number,
                None => word.eq_ignore_ascii_case(value),
            };
            line.words().all(is_equal)
        })
    }
}

fn bands(line: &Line) -> Result<Bands> {
    match line.numbers(1..=3)?[..] {
        // One number stands for all three bands (MTL format, "Kd r g b": g and b are optional).
        [grey] => Ok([grey; 3]),
        [r, g, b] => Ok([r, g, b]),
        _ => Err(line.error("has two numbers", "write one or three")),
    }
}
