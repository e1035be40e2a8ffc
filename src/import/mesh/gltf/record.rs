//! The JSON objects of a glTF file, whose keys are taken one by one.

use std::cell::RefCell;

use serde_json::{Map, Value};

use super::keys::{KNOWN_EXTENSIONS, Kind, MEANINGLESS_EXTENSIONS, WITHOUT_MEANING, reason};
use crate::import::unused::Unused;

/// An object of the file. When it is dropped, every key that nobody took is counted as unused: a key that a reader forgets is reported.
pub(super) struct Record<'u> {
    keys: Map<String, Value>,
    kind: &'static Kind,
    /// The place in the file: `materials[2].pbrMetallicRoughness`.
    pub at: String,
    unused: &'u RefCell<Unused>,
}

/// What is wrong with the file's JSON.
pub(super) type Parsed<T> = Result<T, String>;

impl<'u> Record<'u> {
    pub fn new(
        value: Value,
        kind: &'static Kind,
        at: String,
        unused: &'u RefCell<Unused>,
    ) -> Parsed<Record<'u>> {
        match value {
            Value::Object(keys) => Ok(Record {
                keys,
                kind,
                at,
                unused,
            }),
            _ => Err(format!("{at} is no object")),
        }
    }

    fn take(&mut self, key: &str) -> Option<Value> {
        // The order of what is left is that of the file.
        let value = self.keys.shift_remove(key)?;
        (!value.is_null()).then_some(value)
    }

    fn take_as<T>(
        &mut self,
        key: &str,
        what: &str,
        read: impl FnOnce(Value) -> Option<T>,
    ) -> Parsed<Option<T>> {
        let Some(value) = self.take(key) else {
            return Ok(None);
        };
        let value = read(value);
        value
            .map(Some)
            .ok_or_else(|| self.wrong(key, &format!("is not {what}")))
    }

    pub fn wrong(&self, key: &str, problem: &str) -> String {
        let dot = if self.at.is_empty() { "" } else { "." };
        format!("{}{dot}{key} {problem}", self.at)
    }

    pub fn need<T>(&self, key: &str, value: Option<T>) -> Parsed<T> {
        value.ok_or_else(|| self.wrong(key, "is missing"))
    }

    pub fn number(&mut self, key: &str) -> Parsed<Option<f64>> {
        self.take_as(key, "a number", |value| value.as_f64())
    }

    /// A whole number of 0 or more.
    pub fn index(&mut self, key: &str) -> Parsed<Option<usize>> {
        self.take_as(key, "a whole number of 0 or more", |value| whole(&value))
    }

    /// Takes a key only if it has this value.
    pub fn take_if(&mut self, key: &str, value: usize) {
        if self.keys.get(key).and_then(whole) == Some(value) {
            self.take(key);
        }
    }

    pub fn flag(&mut self, key: &str) -> Parsed<Option<bool>> {
        self.take_as(key, "true or false", |value| value.as_bool())
    }

    pub fn text(&mut self, key: &str) -> Parsed<Option<String>> {
        self.take_as(key, "a string", |value| match value {
            Value::String(text) => Some(text),
            _ => None,
        })
    }

    pub fn numbers<const N: usize>(&mut self, key: &str) -> Parsed<Option<[f64; N]>> {
        let what = format!("an array of {N} numbers");
        self.take_as(key, &what, |value| {
            let values = value.as_array()?.iter().map(Value::as_f64);
            values.collect::<Option<Vec<f64>>>()?.try_into().ok()
        })
    }

    pub fn indices(&mut self, key: &str) -> Parsed<Vec<usize>> {
        let what = "an array of whole numbers of 0 or more";
        let indices = self.take_as(key, what, |value| {
            value.as_array()?.iter().map(whole).collect()
        });
        Ok(indices?.unwrap_or_default())
    }

    pub fn texts(&mut self, key: &str) -> Parsed<Vec<String>> {
        let texts = self.take_as(key, "an array of strings", |value| {
            let texts = value.as_array()?.iter();
            texts.map(|text| Some(text.as_str()?.to_owned())).collect()
        });
        Ok(texts?.unwrap_or_default())
    }

    pub fn record(&mut self, key: &str, kind: &'static Kind) -> Parsed<Option<Record<'u>>> {
        let at = self.wrong(key, "").trim_end().to_owned();
        let value = self.take(key);
        let record = value.map(|value| Record::new(value, kind, at, self.unused));
        record.transpose()
    }

    /// The objects of an array, each converted.
    pub fn list<T>(
        &mut self,
        key: &str,
        kind: &'static Kind,
        read: impl Fn(Record<'u>) -> Parsed<T>,
    ) -> Parsed<Vec<T>> {
        let values = self.take_as(key, "an array", |value| match value {
            Value::Array(values) => Some(values),
            _ => None,
        })?;
        let at = self.wrong(key, "").trim_end().to_owned();
        let values = values.unwrap_or_default().into_iter().enumerate();
        let records =
            values.map(|(i, value)| Record::new(value, kind, format!("{at}[{i}]"), self.unused));
        records.map(|record| read(record?)).collect()
    }

    /// An extension of this object.
    pub fn extension(&mut self, name: &str, kind: &'static Kind) -> Parsed<Option<Record<'u>>> {
        let at = self.wrong(name, "").trim_end().to_owned();
        let Some(Value::Object(extensions)) = self.keys.get_mut("extensions") else {
            return Ok(None);
        };
        let value = extensions.shift_remove(name);
        let record = value.map(|value| Record::new(value, kind, at, self.unused));
        record.transpose()
    }

    /// The names of the extensions that nobody took.
    pub fn other_extensions(&self) -> impl Iterator<Item = &str> {
        let extensions = self.keys.get("extensions").and_then(Value::as_object);
        extensions
            .into_iter()
            .flat_map(|extensions| extensions.keys())
            .map(String::as_str)
    }

    /// All remaining keys, whose values are indices.
    pub fn all_indices(mut self) -> Parsed<Vec<(String, usize)>> {
        let is_key = |key: &&String| !WITHOUT_MEANING.contains(&key.as_str());
        let keys: Vec<String> = self.keys.keys().filter(is_key).cloned().collect();
        let mut indices = Vec::new();
        for key in keys.into_iter().filter(|key| key != "extensions") {
            if let Some(index) = self.index(&key)? {
                indices.push((key, index));
            }
        }
        Ok(indices)
    }
}

impl Drop for Record<'_> {
    fn drop(&mut self) {
        let mut unused = self.unused.borrow_mut();
        for (key, value) in &self.keys {
            match (key.as_str(), value) {
                ("extensions", extensions) => count_extensions(extensions, &mut unused),
                ("name" | "extras", _) | (_, Value::Null) => {}
                (key, _) if WITHOUT_MEANING.contains(&key) && self.kind.keys.contains(&key) => {}
                (key, value) => {
                    count_key(key, value, self.kind, &mut unused);
                    count_inner_extensions(value, &mut unused);
                }
            }
        }
    }
}

fn count_key(key: &str, value: &Value, kind: &Kind, unused: &mut Unused) {
    // Keys of applications begin with an underscore.
    if !kind.keys.contains(&key) && !key.starts_with('_') {
        return unused.add_unknown(key, kind.keys);
    }
    let count = match value {
        Value::Array(elements) if kind.of.is_empty() => elements.len() as u64,
        _ => 1,
    };
    let of = if kind.of.is_empty() { "" } else { " of " };
    unused.add_many(&format!("{key}{of}{}{}", kind.of, reason(key)), count);
}

fn count_extensions(extensions: &Value, unused: &mut Unused) {
    for (name, value) in extensions.as_object().into_iter().flatten() {
        if !MEANINGLESS_EXTENSIONS.contains(&name.as_str()) {
            unused.add(&format!("the extension {name}"));
        }
        count_inner_extensions(value, unused);
    }
}

/// Counts the extensions anywhere in a value that nobody read. Those that camlux supports elsewhere are part of that value.
fn count_inner_extensions(value: &Value, unused: &mut Unused) {
    match value {
        Value::Array(values) => values
            .iter()
            .for_each(|value| count_inner_extensions(value, unused)),
        Value::Object(keys) => {
            for (key, value) in keys.iter().filter(|(key, _)| *key != "extras") {
                if let ("extensions", Some(extensions)) = (key.as_str(), value.as_object()) {
                    let is_unknown = |name: &&String| !KNOWN_EXTENSIONS.contains(&name.as_str());
                    for name in extensions.keys().filter(is_unknown) {
                        unused.add(&format!("the extension {name}"));
                    }
                }
                count_inner_extensions(value, unused);
            }
        }
        _ => {}
    }
}

/// A whole number of 0 or more, also where it is written as `3.0`.
fn whole(value: &Value) -> Option<usize> {
    if let Some(whole) = value.as_u64() {
        return whole.try_into().ok();
    }
    let number = value.as_f64()?;
    let is_whole = number.fract() == 0.0 && (0.0..9e15).contains(&number);
    is_whole.then_some(number as usize)
}
