//! Takes keys out of a TOML table one by one, so that each error names the file, the line and the key.

use std::ops::Range;
use std::path::Path;

use glam::DVec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::{Error, Result};

/// The text of a file and its name.
#[derive(Clone, Copy)]
pub struct TomlText<'t> {
    /// How messages call it: "the scene file".
    pub name: &'static str,
    pub text: &'t str,
    pub file: &'t Path,
    pub lines: &'t LineStarts,
}

/// Where the lines of a text begin but the first: to count them anew for each key would take the square of a file's size.
pub struct LineStarts(Vec<usize>);

impl LineStarts {
    pub fn new(text: &str) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        LineStarts(breaks.map(|(offset, _)| offset + 1).collect())
    }

    fn line_of(&self, offset: usize) -> usize {
        1 + self.0.partition_point(|&start| start <= offset)
    }
}

impl<'t> TomlText<'t> {
    /// The whole document as one table.
    pub fn parse(self) -> Result<Keys<'t>> {
        let root = DeTable::parse(self.text).map_err(|error| {
            Error::scene(
                self.at(error.span().unwrap_or_default()),
                format!("not valid TOML: {}", error.message()),
                "correct this line",
            )
        })?;
        Ok(Keys {
            source: self,
            name: self.name.into(),
            at: self.file.display().to_string(),
            table: root.into_inner(),
        })
    }

    /// `scene.toml:12`
    fn at(self, span: Range<usize>) -> String {
        format!("{}:{}", self.file.display(), self.lines.line_of(span.start))
    }
}

/// A table whose keys are taken one by one.
pub struct Keys<'t> {
    source: TomlText<'t>,
    /// How messages call the table: `[camera]`.
    name: String,
    /// Where the table begins: `scene.toml:3`.
    pub at: String,
    table: DeTable<'t>,
}

impl<'t> Keys<'t> {
    /// Refuses a key that is not in `known`, and names the nearest one that is and that the table does not have yet.
    pub fn only(&self, known: &[&str]) -> Result<()> {
        // The first unknown key of the text, not of the alphabet.
        let unknown = self
            .table
            .keys()
            .filter(|key| !known.contains(&key.get_ref().as_ref()))
            .min_by_key(|key| key.span().start);
        let Some(key) = unknown else { return Ok(()) };
        let is_absent = |known: &&&str| !self.table.contains_key(**known);
        let absent: Vec<&str> = known.iter().filter(is_absent).copied().collect();
        Err(Error::scene(
            self.source.at(key.span()),
            format!("unknown key \"{}\" in {}", key.get_ref(), self.name),
            did_you_mean(key.get_ref(), &absent),
        ))
    }

    pub fn take(&mut self, key: &str) -> Option<Value<'t>> {
        let value = self.table.remove(key)?;
        Some(Value::new(self.source, key, &self.name, value))
    }

    /// The value of one of these keys, and which it is; refuses two of them.
    pub fn take_one<'k>(&mut self, keys: &[&'k str]) -> Result<Option<(&'k str, Value<'t>)>> {
        let mut given = keys.iter().filter_map(|&key| Some((key, self.take(key)?)));
        let (first, second) = (given.next(), given.next());
        match (first, second) {
            (Some((key, _)), Some((_, other))) => {
                let problem = format!("stands beside \"{key}\"");
                Err(other.error(problem, "keep one of them"))
            }
            (first, _) => Ok(first),
        }
    }

    /// The value of a key that has to be there; `example` shows how to write it.
    pub fn need(&mut self, key: &str, example: &str) -> Result<Value<'t>> {
        self.take(key).ok_or_else(|| {
            Error::scene(
                &self.at,
                format!("{} has no \"{key}\"", self.name),
                format!("add {example}"),
            )
        })
    }

    /// Every key that is left with its value, in the order of the text.
    pub fn take_all(&mut self) -> Vec<(String, Value<'t>)> {
        let mut keys: Vec<_> = self
            .table
            .keys()
            .map(|key| (key.span().start, key.get_ref().to_string()))
            .collect();
        keys.sort();
        keys.into_iter()
            .filter_map(|(_, key)| self.take(&key).map(|value| (key, value)))
            .collect()
    }

    pub fn error(&self, problem: impl Into<String>, hint: impl Into<String>) -> Error {
        Error::scene(&self.at, problem, hint)
    }

    /// The message for a word that names none of the choices.
    pub fn unknown_word(&self, value: &Value, word: &str, choices: &[&str]) -> Error {
        Error::scene(
            &value.at,
            format!("unknown {} \"{word}\" in {}", value.key, self.name),
            did_you_mean(word, choices),
        )
    }
}

/// "did you mean "fov_y_deg"? possible are ..."
pub fn did_you_mean(word: &str, known: &[&str]) -> String {
    // Jaro-Winkler favours a common beginning: "fov" is nearer to "fov_y_deg" than to "up".
    let likeness = |known: &str| strsim::jaro_winkler(beginning(word), beginning(known));
    let nearest = known
        .iter()
        .max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    match nearest {
        Some(nearest) => format!(
            "did you mean \"{nearest}\"? possible are: {}",
            known.join(", ")
        ),
        None => "remove it".into(),
    }
}

/// As much of a word as is compared: the time goes with the product of both lengths.
fn beginning(word: &str) -> &str {
    const MOST_CHARACTERS: usize = 64;
    let end = word.char_indices().nth(MOST_CHARACTERS);
    end.map_or(word, |(end, _)| &word[..end])
}

/// The value of one key.
pub struct Value<'t> {
    source: TomlText<'t>,
    /// `scene.toml:12`
    pub at: String,
    key: String,
    parent: String,
    value: DeValue<'t>,
}

impl<'t> Value<'t> {
    fn new(source: TomlText<'t>, key: &str, parent: &str, value: Spanned<DeValue<'t>>) -> Self {
        Value {
            source,
            at: source.at(value.span()),
            key: key.into(),
            parent: parent.into(),
            value: value.into_inner(),
        }
    }

    pub fn number(&self) -> Result<f64> {
        finite_number(&self.value).ok_or_else(|| self.wrong("a finite number"))
    }

    /// A whole number that fits a `u32`.
    pub fn count(&self) -> Result<u32> {
        count(&self.value).ok_or_else(|| self.wrong("a whole number from 0 to 4294967295"))
    }

    pub fn counts<const N: usize>(&self) -> Result<[u32; N]> {
        self.array(count)
            .ok_or_else(|| self.wrong(&format!("an array of {N} whole numbers")))
    }

    pub fn numbers<const N: usize>(&self) -> Result<[f64; N]> {
        self.array(finite_number)
            .ok_or_else(|| self.wrong(&format!("an array of {N} finite numbers")))
    }

    pub fn vec3(&self) -> Result<DVec3> {
        self.numbers::<3>().map(DVec3::from)
    }

    /// One number for all bands, or one per band.
    pub fn bands(&self) -> Result<[f64; 3]> {
        finite_number(&self.value)
            .map(|value| [value; 3])
            .or_else(|| self.array(finite_number))
            .ok_or_else(|| self.wrong("one finite number or an array [r, g, b] of three"))
    }

    pub fn text(&self) -> Result<&str> {
        self.value
            .as_str()
            .ok_or_else(|| self.wrong("a string in quotes"))
    }

    pub fn flag(&self) -> Result<bool> {
        self.value
            .as_bool()
            .ok_or_else(|| self.wrong("true or false"))
    }

    /// The value as a table that messages call `name`.
    pub fn table(self, name: impl Into<String>) -> Result<Keys<'t>> {
        match self.value {
            DeValue::Table(table) => Ok(Keys {
                source: self.source,
                name: name.into(),
                at: self.at,
                table,
            }),
            _ => Err(self.wrong("a table")),
        }
    }

    /// The tables that are written `[[key]]`.
    pub fn tables(self) -> Result<Vec<Keys<'t>>> {
        let name = format!("[[{}]]", self.key);
        let expected = format!("a list of tables; each begins with {name}, in double brackets");
        let elements = match self.value {
            DeValue::Array(ref elements) if elements.iter().all(|e| e.get_ref().is_table()) => {
                elements.clone()
            }
            _ => return Err(self.wrong(&expected)),
        };
        let element_of = |element| Value::new(self.source, &self.key, &self.parent, element);
        let tables = elements.into_iter().map(element_of);
        tables.map(|value| value.table(name.clone())).collect()
    }

    /// The elements of an array, each with its own place.
    pub fn list(self) -> Result<Vec<Value<'t>>> {
        let DeValue::Array(elements) = self.value else {
            return Err(self.wrong("an array"));
        };
        let element_of = |element| Value::new(self.source, &self.key, &self.parent, element);
        Ok(elements.into_iter().map(element_of).collect())
    }

    /// The message for a value that is of the right type and still cannot be.
    pub fn error(&self, problem: impl std::fmt::Display, hint: impl Into<String>) -> Error {
        let problem = format!("\"{}\" in {} {problem}", self.key, self.parent);
        Error::scene(&self.at, problem, hint)
    }

    fn array<T, const N: usize>(&self, read: impl Fn(&DeValue) -> Option<T>) -> Option<[T; N]> {
        let elements = self.value.as_array()?;
        let values: Option<Vec<T>> = elements.iter().map(|e| read(e.get_ref())).collect();
        values?.try_into().ok()
    }

    fn wrong(&self, expected: &str) -> Error {
        Error::scene(
            &self.at,
            format!(
                "\"{}\" in {} is {}",
                self.key,
                self.parent,
                describe(&self.value)
            ),
            format!("give {expected}"),
        )
    }
}

fn describe(value: &DeValue) -> String {
    match value {
        DeValue::String(text) => format!("the string \"{text}\""),
        DeValue::Integer(integer) => format!("the integer {integer}"),
        DeValue::Float(float) => format!("the number {float}"),
        DeValue::Boolean(flag) => flag.to_string(),
        DeValue::Datetime(_) => "a date".into(),
        DeValue::Table(_) => "a table".into(),
        DeValue::Array(elements) => {
            let elements: Vec<_> = elements.iter().map(|e| describe(e.get_ref())).collect();
            format!("the array [{}]", elements.join(", "))
        }
    }
}

/// A whole number is a number: `1` may stand for `1.0`.
fn finite_number(value: &DeValue) -> Option<f64> {
    let number = match value {
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix())
            .ok()
            .map(|integer| integer as f64),
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    };
    number.filter(|number: &f64| number.is_finite())
}

fn count(value: &DeValue) -> Option<u32> {
    let integer = value.as_integer()?;
    u32::from_str_radix(integer.as_str(), integer.radix()).ok()
}
