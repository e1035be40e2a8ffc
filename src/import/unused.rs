//! What files hold and camlux does not use.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

use crate::keys::nearest;

/// Likeness of a key to the one that it may stand for. Keys of the format that nobody knows here must not be called misspelt ones.
const LEAST_LIKENESS: f64 = 0.8;

/// Kinds that a warning lists; of the others it gives the number.
const MOST_LISTED: usize = 40;
/// Unknown keys that are told apart. A file of something else may have a million.
const MOST_UNKNOWN: usize = 200;

/// What a file holds and camlux does not use: each kind once, with its count, in the order of the file.
#[derive(Debug, Default)]
pub(super) struct Unused {
    kinds: Vec<(String, u64)>,
    index_of: HashMap<String, usize>,
    /// The kind of each unknown key, because the search for the nearest known one takes long.
    kind_of_unknown: HashMap<String, String>,
}

impl Unused {
    /// Counts one more of a kind.
    pub fn add(&mut self, kind: &str) {
        self.add_many(kind, 1);
    }

    /// Counts `count` more of a kind; none are no kind.
    pub fn add_many(&mut self, kind: &str, count: u64) {
        if count == 0 {
            return;
        }
        if let Some(&index) = self.index_of.get(kind) {
            self.kinds[index].1 += count;
            return;
        }
        if let Entry::Vacant(new) = self.index_of.entry(kind.to_owned()) {
            new.insert(self.kinds.len());
            self.kinds.push((kind.to_owned(), count));
        }
    }

    /// Whether there is one of a kind.
    pub fn has(&self, kind: &str) -> bool {
        self.index_of.contains_key(kind)
    }

    /// Counts a key that is no key of the format, and suggests the nearest of those that are.
    pub fn add_unknown(&mut self, key: &str, known: &[&str]) {
        if let Some(kind) = self.kind_of_unknown.get(key) {
            let kind = kind.clone();
            return self.add(&kind);
        }
        if self.kind_of_unknown.len() >= MOST_UNKNOWN {
            return self.add("other unknown keys");
        }
        let kind = match nearest(key, known, LEAST_LIKENESS) {
            Some(known) => format!("the unknown \"{}\", perhaps \"{known}\"", shown(key)),
            None => format!("the unknown \"{}\"", shown(key)),
        };
        self.add(&kind);
        self.kind_of_unknown.insert(key.to_owned(), kind);
    }

    /// The warning about a file; `None` if camlux uses all of it.
    pub fn warning(&self, file: &Path) -> Option<String> {
        let listed = self.kinds.iter().take(MOST_LISTED);
        let mut list: Vec<String> = listed
            .map(|(kind, count)| match count {
                1 => kind.clone(),
                _ => format!("{kind} ({count} times)"),
            })
            .collect();
        if let Some(more @ 1..) = self.kinds.len().checked_sub(MOST_LISTED) {
            list.push(format!("{more} more"));
        }
        let list = list.join("; ");
        (!list.is_empty()).then(|| format!("{}: camlux ignores {list}", file.display()))
    }
}

/// A word of a file as a warning shows it: its beginning, without control characters.
pub(super) fn shown(word: &str) -> String {
    const MOST_CHARACTERS: usize = 64;
    let escaped = word.chars().take(MOST_CHARACTERS);
    escaped.flat_map(char::escape_debug).collect()
}
