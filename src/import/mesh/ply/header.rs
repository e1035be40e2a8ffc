//! The header of a PLY file: which elements follow, and which properties each has.

use std::collections::HashSet;
use std::path::Path;

use crate::import::lines::{Line, Lines, place};
use crate::import::unused::{Unused, shown};
use crate::keys::did_you_mean;
use crate::{Error, Result};

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Text,
    LittleEndian,
    BigEndian,
}

/// The type of a value.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    const NAMES: [(&str, Type); 16] = [
        ("char", Type::I8),
        ("int8", Type::I8),
        ("uchar", Type::U8),
        ("uint8", Type::U8),
        ("short", Type::I16),
        ("int16", Type::I16),
        ("ushort", Type::U16),
        ("uint16", Type::U16),
        ("int", Type::I32),
        ("int32", Type::I32),
        ("uint", Type::U32),
        ("uint32", Type::U32),
        ("float", Type::F32),
        ("float32", Type::F32),
        ("double", Type::F64),
        ("float64", Type::F64),
    ];

    pub fn bytes(self) -> usize {
        match self {
            Type::I8 | Type::U8 => 1,
            Type::I16 | Type::U16 => 2,
            Type::I32 | Type::U32 | Type::F32 => 4,
            Type::F64 => 8,
        }
    }

    pub fn is_whole(self) -> bool {
        !matches!(self, Type::F32 | Type::F64)
    }

    /// What an integer of this type divides by to become a colour from 0 to 1; 1 for other numbers.
    pub fn white(self) -> f64 {
        match self {
            Type::F32 | Type::F64 => 1.0,
            Type::U16 | Type::I16 => 65_535.0,
            _ => 255.0,
        }
    }
}

pub(super) struct Property {
    /// In small letters.
    pub name: String,
    pub kind: Type,
    /// The type of the length, for a list.
    pub length: Option<Type>,
}

pub(super) struct Element {
    /// In small letters.
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
    /// The line that names it.
    pub line: usize,
}

impl Element {
    /// The index of the property that has one of these names.
    pub fn find(&self, names: &[&str]) -> Option<usize> {
        let is_one = |property: &Property| names.contains(&property.name.as_str());
        self.properties.iter().position(is_one)
    }

    /// The least that one of these elements takes in the file.
    pub fn least_bytes(&self, format: Format) -> u64 {
        let bytes = |property: &Property| match format {
            Format::Text => 2,
            _ => property.length.unwrap_or(property.kind).bytes(),
        };
        self.properties.iter().map(bytes).sum::<usize>().max(1) as u64
    }
}

pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
    /// The files that comments name as textures, and their lines.
    pub texture_files: Vec<(String, String)>,
}

const HINT: &str = "export it again";

impl Header {
    /// Reads the lines up to `end_header`.
    pub fn read(lines: &mut Lines, file: &Path, unused: &mut Unused) -> Result<Header> {
        let not_ply = || {
            let problem = "not a PLY file: its first line is not \"ply\"";
            Error::scene(file.display().to_string(), problem, "give a PLY file")
        };
        let first = lines.next_line()?.ok_or_else(not_ply)?;
        if !first.keyword().eq_ignore_ascii_case("ply") {
            return Err(not_ply());
        }
        let mut format = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut texture_files = Vec::new();
        // A search in lists takes time quadratic in the length of the header.
        let (mut names, mut names_of_properties) = (HashSet::new(), HashSet::new());
        loop {
            let Some(line) = lines.next_line()? else {
                let problem = "not a whole PLY file: its header has no end_header";
                return Err(Error::scene(file.display().to_string(), problem, HINT));
            };
            let words: Vec<&str> = line.rest().split_whitespace().collect();
            match (line.keyword().to_ascii_lowercase().as_str(), &words[..]) {
                ("end_header", _) => break,
                // Free text, but for the name of a texture.
                ("comment", [key, _, ..]) if key.eq_ignore_ascii_case("TextureFile") => {
                    let name = line.rest()[key.len()..].trim();
                    texture_files.push((name.to_owned(), line.at()));
                }
                ("comment" | "obj_info" | "", _) => {}
                ("format", &[name, ..]) => format = Some(format_of(name, &line)?),
                ("element", &[name, count]) => {
                    let element = element(name, count, &line)?;
                    if !names.insert(element.name.clone()) {
                        return Err(line.error("names an element again", HINT));
                    }
                    names_of_properties.clear();
                    elements.push(element);
                }
                ("property", words) => {
                    let Some(element) = elements.last_mut() else {
                        return Err(line.error("stands before any element", HINT));
                    };
                    let property = property(words, &line)?;
                    if !names_of_properties.insert(property.name.clone()) {
                        return Err(line.error("names a property again", HINT));
                    }
                    element.properties.push(property);
                }
                ("format" | "element", _) => {
                    let hint = "write format NAME 1.0, or element NAME COUNT";
                    return Err(line.error("has too few or too many words", hint));
                }
                _ => {
                    let known = ["comment", "obj_info", "format", "element", "property"];
                    unused.add_unknown(line.keyword(), &known);
                }
            }
        }
        let Some(format) = format else {
            let problem = "its header has no line such as format ascii 1.0";
            return Err(Error::scene(file.display().to_string(), problem, HINT));
        };
        Ok(Header {
            format,
            elements,
            texture_files,
        })
    }

    pub fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }
}

impl Element {
    /// The error for this element as the header has it.
    pub fn error(&self, file: &Path, problem: &str, hint: &str) -> Error {
        Error::scene(place(file, self.line), problem, hint)
    }
}

fn format_of(name: &str, line: &Line) -> Result<Format> {
    match name.to_ascii_lowercase().as_str() {
        "ascii" => Ok(Format::Text),
        "binary_little_endian" => Ok(Format::LittleEndian),
        "binary_big_endian" => Ok(Format::BigEndian),
        _ => {
            let names = ["ascii", "binary_little_endian", "binary_big_endian"];
            let problem = format!("has the unknown format \"{}\"", shown(name));
            Err(line.error(problem, did_you_mean(name, &names)))
        }
    }
}

fn element(name: &str, count: &str, line: &Line) -> Result<Element> {
    let problem = || format!("has \"{}\" instead of a count", shown(count));
    let count = count.parse().map_err(|_| line.error(problem(), HINT))?;
    Ok(Element {
        name: name.to_ascii_lowercase(),
        count,
        properties: Vec::new(),
        line: line.number(),
    })
}

fn property(words: &[&str], line: &Line) -> Result<Property> {
    let kind = |word: &str| {
        let known = Type::NAMES.iter().find(|(name, _)| *name == word);
        known.map(|(_, kind)| *kind).ok_or_else(|| {
            let names = Type::NAMES.map(|(name, _)| name);
            let problem = format!("has the unknown type \"{}\"", shown(word));
            line.error(problem, did_you_mean(word, &names))
        })
    };
    let (length, of_values, name) = match *words {
        ["list", length, of_values, name] => (Some(kind(length)?), of_values, name),
        [of_value, name] => (None, of_value, name),
        _ => {
            let hint = "write property TYPE NAME, or property list TYPE TYPE NAME";
            return Err(line.error("has too few or too many words", hint));
        }
    };
    if length.is_some_and(|length| !length.is_whole()) {
        return Err(line.error("has a list whose length is no whole number", HINT));
    }
    Ok(Property {
        name: name.to_ascii_lowercase(),
        kind: kind(of_values)?,
        length,
    })
}
