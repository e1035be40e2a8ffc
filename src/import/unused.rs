//! What files hold and camlux does not use.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

use crate::keys::nearest;

/// Kinds that a warning lists; of the others it gives the number.
const MOST_LISTED: usize = 40;

/// What a file holds and camlux does not use: each kind once, with its count, in the order of the file.
#[derive(Debug, Default)]
pub(super) struct Unused {
    kinds: Vec<(String, u64)>,
    index_of: HashMap<String, usize>,
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
        match nearest(key, known) {
            Some(known) => self.add(&format!("the unknown \"{key}\", perhaps \"{known}\"")),
            None => self.add(&format!("the unknown \"{key}\"")),
        }
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
