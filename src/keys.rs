//! Takes keys out of a TOML table one by one, so that each error names the file, the line and the key.

use std::fmt::Display;
use std::path::Path;
use std::rc::Rc;

use glam::DVec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::{Error, Result, input_file};

/// The format version of scene files and job files.
const VERSION: u32 = 1;

/// Reads the text of a file. `what` names it in messages: "scene file".
pub fn read_text(file: &Path, what: &str) -> Result<String> {
    let unreadable = |problem: &dyn Display| {
        Error::scene(
            file.display().to_string(),
            format!("cannot read the {what}: {problem}"),
            "check the path and that it is a UTF-8 text file",
        )
    };
    let bytes = input_file::read(file).map_err(|error| unreadable(&error))?;
    String::from_utf8(bytes).map_err(|error| unreadable(&error))
}

/// A file's name, and where each line but the first begins. Counting the lines again for each key would take time quadratic in the file's
/// size.
struct Source {
    file: String,
    line_starts: Vec<usize>,
}

impl Source {
    /// Formats a place: `scene.toml:12`.
    fn at(&self, offset: usize) -> String {
        let line = 1 + self.line_starts.partition_point(|&start| start <= offset);
        format!("{}:{line}", self.file)
    }
}

/// A table whose keys are taken one by one.
pub struct Keys<'t> {
    source: Rc<Source>,
    /// The name of the table in messages: `[camera]`.
    name: String,
    /// Where the table begins: `scene.toml:3`.
    pub at: String,
    table: DeTable<'t>,
}

impl<'t> Keys<'t> {
    /// Parses the text of a file as one table, of the supported version and with no keys but `known`. `what`: "scene file".
    pub fn parse(text: &'t str, file: &Path, what: &str, known: &[&str]) -> Result<Self> {
        let breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let source = Rc::new(Source {
            file: file.display().to_string(),
            line_starts: breaks.map(|(offset, _)| offset + 1).collect(),
        });
        let root = DeTable::parse(text).map_err(|error| {
            Error::scene(
                source.at(error.span().unwrap_or_default().start),
                format!("not valid TOML: {}", error.message()),
                "correct this line",
            )
        })?;
        let mut keys = Keys {
            name: format!("the {what}"),
            at: source.file.clone(),
            source,
            table: root.into_inner(),
        };
        let is_job = keys.table.contains_key("job");
        if is_job != known.contains(&"job") {
            let (problem, hint) = match is_job {
                true => ("this is a job file", "give it to camlux batch"),
                false => (
                    "there is no [job] table",
                    "add it, or give a scene file to camlux render",
                ),
            };
            return Err(keys.error(problem, hint));
        }
        keys.only(known)?;
        if let Some(value) = keys.take("version") {
            let version = value.count()?;
            if version != VERSION {
                return Err(Error::scene(
                    value.at,
                    format!("{what} version {version} is not known"),
                    format!("write version = {VERSION}, or use a newer camlux"),
                ));
            }
        }
        Ok(keys)
    }

    /// Refuses a key that is not in `known`. The message suggests the nearest known key that the table does not have yet.
    pub fn only(&self, known: &[&str]) -> Result<()> {
        // The first unknown key in the text, not in the alphabet.
        let unknown = self
            .table
            .keys()
            .filter(|key| !known.contains(&key.get_ref().as_ref()))
            .min_by_key(|key| key.span().start);
        let Some(key) = unknown else { return Ok(()) };
        let is_absent = |known: &&&str| !self.table.contains_key(**known);
        let absent: Vec<&str> = known.iter().filter(is_absent).copied().collect();
        Err(Error::scene(
            self.source.at(key.span().start),
            format!("unknown key \"{}\" in {}", key.get_ref(), self.name),
            suggestion(key.get_ref(), &absent, "keys not used yet"),
        ))
    }

    pub fn take(&mut self, key: &str) -> Option<Value<'t>> {
        let value = self.table.remove(key)?;
        Some(Value::new(self.source.clone(), key, &self.name, value))
    }

    /// The value of a key that may be a text, if it is one.
    pub fn take_text(&mut self, key: &str) -> Option<Value<'t>> {
        let value = self.table.get(key)?;
        value.get_ref().is_str().then(|| self.take(key)).flatten()
    }

    /// The value of an optional key, converted by `read`.
    pub fn optional<T>(
        &mut self,
        key: &str,
        read: impl FnOnce(&Value<'t>) -> Result<T>,
    ) -> Result<Option<T>> {
        self.take(key).as_ref().map(read).transpose()
    }

    /// The table `[key]`, if it is there.
    pub fn table(&mut self, key: &str) -> Result<Option<Keys<'t>>> {
        let value = self.take(key);
        // A nested table is written with the names of both.
        let outer = self
            .name
            .strip_prefix('[')
            .and_then(|n| n.strip_suffix(']'));
        let name = match outer {
            Some(outer) if !outer.starts_with('[') => format!("[{outer}.{key}]"),
            _ => format!("[{key}]"),
        };
        value.map(|v| v.table(name)).transpose()
    }

    /// The tables `[[key]]`.
    pub fn tables(&mut self, key: &str) -> Result<Vec<Keys<'t>>> {
        self.take(key).map_or(Ok(Vec::new()), Value::tables)
    }

    /// The value of one of these keys, and that key. Refuses two of them.
    pub fn take_one<'k>(&mut self, keys: &[&'k str]) -> Result<Option<(&'k str, Value<'t>)>> {
        let mut given = keys.iter().filter_map(|&key| Some((key, self.take(key)?)));
        let (first, second) = (given.next(), given.next());
        match (first, second) {
            (Some((key, _)), Some((_, other))) => {
                let problem = format!("conflicts with \"{key}\"");
                Err(other.error(problem, "keep one of them"))
            }
            (first, _) => Ok(first),
        }
    }

    /// The value of a required key; `example` shows how to write it.
    pub fn need(&mut self, key: &str, example: &str) -> Result<Value<'t>> {
        self.take(key).ok_or_else(|| {
            let problem = format!("{} has no \"{key}\"", self.name);
            self.error(problem, format!("add {example}"))
        })
    }

    /// Refuses this key, which does not apply here.
    pub fn refuse(&mut self, key: &str, problem: &str, hint: &str) -> Result<()> {
        let value = self.take(key);
        value.map_or(Ok(()), |value| Err(value.error(problem, hint)))
    }

    /// Each key, and file and line of its value.
    pub fn lines(&self) -> impl Iterator<Item = (String, String)> {
        let entries = self.table.iter();
        entries.map(|(key, value)| {
            (
                key.get_ref().to_string(),
                self.source.at(value.span().start),
            )
        })
    }

    /// All remaining keys with their values, in the order of the text.
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
}

/// "did you mean "box"? choose one of: ..."
pub fn did_you_mean(word: &str, known: &[&str]) -> String {
    suggestion(word, known, "choose one of")
}

/// The known word that is most like another one, if one is like it by more than a share of 1.
pub(crate) fn nearest<'k>(word: &str, known: &[&'k str], least_likeness: f64) -> Option<&'k str> {
    // Jaro-Winkler favours a common beginning: "fov" is nearer to "fov_y_deg" than to "up".
    let lower = |word: &str| beginning(word).to_lowercase();
    let word = lower(word);
    let likeness = |known: &str| strsim::jaro_winkler(&word, &lower(known));
    let like = known.iter().map(|known| (likeness(known), *known));
    let like = like.filter(|(likeness, _)| *likeness > least_likeness);
    let nearest = like.max_by(|(a, _), (b, _)| a.total_cmp(b));
    nearest.map(|(_, known)| known)
}

fn suggestion(word: &str, known: &[&str], heading: &str) -> String {
    let possible = format!("{heading}: {}", known.join(", "));
    // Below this likeness are words of another meaning; above it are words of two letters with one wrong.
    const LEAST_LIKENESS: f64 = 0.6;
    match nearest(word, known, LEAST_LIKENESS) {
        Some(nearest) => format!("did you mean \"{nearest}\"? {possible}"),
        None if known.is_empty() => "remove it".into(),
        None => possible,
    }
}

/// The part of a word that is compared. The time grows with the product of both lengths.
fn beginning(word: &str) -> &str {
    const MOST_CHARACTERS: usize = 64;
    let end = word.char_indices().nth(MOST_CHARACTERS);
    end.map_or(word, |(end, _)| &word[..end])
}

/// The value of one key.
pub struct Value<'t> {
    source: Rc<Source>,
    /// `scene.toml:12`
    pub at: String,
    key: String,
    parent: String,
    value: DeValue<'t>,
}

impl<'t> Value<'t> {
    fn new(source: Rc<Source>, key: &str, parent: &str, value: Spanned<DeValue<'t>>) -> Self {
        Value {
            at: source.at(value.span().start),
            source,
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

    /// A whole number that need not fit a `u32`.
    pub fn large_count(&self) -> Result<u64> {
        large_count(&self.value).ok_or_else(|| self.wrong("a whole number of 0 or more"))
    }

    pub fn counts<const N: usize>(&self) -> Result<[u32; N]> {
        array(&self.value, count)
            .ok_or_else(|| self.wrong(&format!("an array of {N} whole numbers of 0 or more")))
    }

    pub fn numbers<const N: usize>(&self) -> Result<[f64; N]> {
        array(&self.value, finite_number)
            .ok_or_else(|| self.wrong(&format!("an array of {N} finite numbers")))
    }

    /// A list of numbers of any length.
    pub fn number_list(&self) -> Result<Vec<f64>> {
        let elements = self.value.as_array();
        let numbers = elements.and_then(|e| e.iter().map(|e| finite_number(e.get_ref())).collect());
        numbers.ok_or_else(|| self.wrong("an array of finite numbers"))
    }

    /// The rows of a matrix with N columns.
    pub fn rows<const N: usize>(&self) -> Result<Vec<[f64; N]>> {
        let row = |row: &Spanned<DeValue>| array(row.get_ref(), finite_number);
        let rows = self.value.as_array();
        let rows = rows.and_then(|rows| rows.iter().map(row).collect());
        rows.ok_or_else(|| self.wrong(&format!("a list of rows, each of {N} finite numbers")))
    }

    /// Whether it is an array.
    pub fn is_list(&self) -> bool {
        self.value.as_array().is_some()
    }

    pub fn vec3(&self) -> Result<DVec3> {
        self.numbers::<3>().map(DVec3::from)
    }

    /// One number for all bands, or one per band.
    pub fn bands(&self) -> Result<[f64; 3]> {
        finite_number(&self.value)
            .map(|value| [value; 3])
            .or_else(|| array(&self.value, finite_number))
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

    /// The choice that the text names.
    pub fn choice<T: Copy>(&self, choices: &[T], name: impl Fn(T) -> &'static str) -> Result<T> {
        let word = self.text()?;
        let chosen = choices.iter().find(|&&choice| name(choice) == word);
        chosen.copied().ok_or_else(|| {
            let names: Vec<&str> = choices.iter().map(|&choice| name(choice)).collect();
            Error::scene(
                &self.at,
                format!("unknown {} \"{word}\" in {}", self.key, self.parent),
                did_you_mean(word, &names),
            )
        })
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

    /// The tables `[[key]]`.
    pub fn tables(self) -> Result<Vec<Keys<'t>>> {
        let name = format!("[[{}]]", self.key);
        let elements = self.value.as_array();
        if !elements.is_some_and(|e| e.iter().all(|e| e.get_ref().is_table())) {
            return Err(self.wrong(&format!(
                "a list of tables; each begins with {name}, in double brackets"
            )));
        }
        let list = self.list()?.into_iter();
        list.map(|value| value.table(&*name)).collect()
    }

    /// The elements of an array, each with its own place.
    pub fn list(self) -> Result<Vec<Value<'t>>> {
        let DeValue::Array(elements) = self.value else {
            return Err(self.wrong("an array"));
        };
        let element_of =
            |element| Value::new(self.source.clone(), &self.key, &self.parent, element);
        Ok(elements.into_iter().map(element_of).collect())
    }

    /// Refuses an empty array; `hint` says what to write there.
    pub fn filled(self, hint: &str) -> Result<Self> {
        match self.value.as_array() {
            Some(elements) if elements.is_empty() => {
                let problem = format!("\"{}\" is empty", self.key);
                Err(Error::scene(self.at, problem, hint))
            }
            _ => Ok(self),
        }
    }

    /// The error for a value that has the right type but is not valid.
    pub fn error(&self, problem: impl Display, hint: impl Into<String>) -> Error {
        let problem = format!("\"{}\" in {} {problem}", self.key, self.parent);
        Error::scene(&self.at, problem, hint)
    }

    fn wrong(&self, expected: &str) -> Error {
        let problem = format!("is {}", describe(&self.value));
        self.error(problem, format!("give {expected}"))
    }
}

fn array<T, const N: usize>(
    value: &DeValue,
    read: impl Fn(&DeValue) -> Option<T>,
) -> Option<[T; N]> {
    let elements = value.as_array()?;
    let values: Option<Vec<T>> = elements.iter().map(|e| read(e.get_ref())).collect();
    values?.try_into().ok()
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
            let element = |value: &DeValue| match value {
                DeValue::Integer(integer) => integer.to_string(),
                DeValue::Float(float) => float.to_string(),
                _ => describe(value),
            };
            let elements: Vec<_> = elements.iter().map(|e| element(e.get_ref())).collect();
            format!("the array [{}]", elements.join(", "))
        }
    }
}

/// Reads a finite number. A whole number is valid too: `1` may stand for `1.0`.
fn finite_number(value: &DeValue) -> Option<f64> {
    let number = match value {
        DeValue::Integer(integer) => {
            i64::from_str_radix(integer.as_str(), integer.radix()).ok()? as f64
        }
        DeValue::Float(float) => float.as_str().parse().ok()?,
        _ => return None,
    };
    number.is_finite().then_some(number)
}

fn count(value: &DeValue) -> Option<u32> {
    large_count(value)?.try_into().ok()
}

fn large_count(value: &DeValue) -> Option<u64> {
    let integer = value.as_integer()?;
    u64::from_str_radix(integer.as_str(), integer.radix()).ok()
}
