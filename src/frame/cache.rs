//! Values with the keys that they were made from: those of one renderer, and those that the renderers of a device share.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use crate::Result;

/// A value and the key that it was made from.
pub(crate) struct Cached<K, T>(Option<(K, T)>);

impl<K, T> Default for Cached<K, T> {
    fn default() -> Self {
        Cached(None)
    }
}

impl<K: PartialEq, T> Cached<K, T> {
    pub fn new(key: K, value: T) -> Self {
        Cached(Some((key, value)))
    }

    /// Drops a value that was made from another key. Call this before making anything, so that old and new never exist together.
    pub fn drop_unless(&mut self, key: &K) {
        self.0.take_if(|(made_from, _)| made_from != key);
    }

    /// The value for this key, and whether it had to be made.
    pub fn get_or_make(
        &mut self,
        key: K,
        make: impl FnOnce() -> Result<T>,
    ) -> Result<(&mut T, bool)> {
        self.drop_unless(&key);
        let is_new = self.0.is_none();
        let (_, value) = match self.0.take() {
            Some(entry) => self.0.insert(entry),
            None => self.0.insert((key, make()?)),
        };
        Ok((value, is_new))
    }

    pub fn get(&self) -> Option<&T> {
        self.0.as_ref().map(|(_, value)| value)
    }

    pub fn get_mut(&mut self) -> Option<&mut T> {
        self.0.as_mut().map(|(_, value)| value)
    }

    pub fn take(&mut self) -> Option<T> {
        self.0.take().map(|(_, value)| value)
    }
}

/// A value that does not change, and the key that it was made from. Renderers share it.
pub(crate) struct SharedValue<K, T>(Option<Arc<(K, T)>>);

/// Shared values that some renderer keeps.
pub(crate) struct SharedValues<K, T>(Vec<Weak<(K, T)>>);

/// Locked as soon as a value has to be made or found, so that no two renderers make the same.
pub(crate) struct LockedLate<'m, T> {
    mutex: &'m Mutex<T>,
    guard: Option<MutexGuard<'m, T>>,
}

impl<K, T> Default for SharedValue<K, T> {
    fn default() -> Self {
        SharedValue(None)
    }
}

impl<K, T> Default for SharedValues<K, T> {
    fn default() -> Self {
        SharedValues(Vec::new())
    }
}

impl<K: PartialEq, T> SharedValue<K, T> {
    /// Drops a value that was made from another key. Call this before making anything, so that old and new never exist together.
    pub fn drop_unless(&mut self, key: &K) {
        self.0.take_if(|made| made.0 != *key);
    }

    /// The value for this key, and whether this renderer did not have it. Another renderer's is as good as one that is made.
    pub fn get_or_make<S>(
        &mut self,
        key: K,
        shared: &mut LockedLate<S>,
        values: fn(&mut S) -> &mut SharedValues<K, T>,
        make: impl FnOnce() -> Result<T>,
    ) -> Result<(&T, bool)> {
        self.drop_unless(&key);
        let (made, is_new) = match self.0.take() {
            Some(made) => (made, false),
            None => match values(shared.lock()).find(&key) {
                Some(made) => (made, true),
                None => (Arc::new((key, make()?)), true),
            },
        };
        Ok((&self.0.insert(made).1, is_new))
    }

    pub fn get(&self) -> Option<&T> {
        self.0.as_ref().map(|made| &made.1)
    }

    pub fn clear(&mut self) {
        self.0 = None;
    }

    /// Lets other renderers find the value. It must be complete on the device.
    pub fn share(&self, values: &mut SharedValues<K, T>) {
        if let Some(made) = &self.0 {
            values.add(made);
        }
    }
}

impl<K: PartialEq, T> SharedValues<K, T> {
    fn find(&mut self, key: &K) -> Option<Arc<(K, T)>> {
        let mut kept = self.0.iter().filter_map(Weak::upgrade);
        kept.find(|made| made.0 == *key)
    }

    fn add(&mut self, made: &Arc<(K, T)>) {
        self.0.retain(|kept| kept.strong_count() > 0);
        let made = Arc::downgrade(made);
        if !self.0.iter().any(|kept| kept.ptr_eq(&made)) {
            self.0.push(made);
        }
    }
}

impl<'m, T> LockedLate<'m, T> {
    pub fn new(mutex: &'m Mutex<T>) -> Self {
        LockedLate { mutex, guard: None }
    }

    pub fn is_locked(&self) -> bool {
        self.guard.is_some()
    }

    pub fn lock(&mut self) -> &mut T {
        let lock = || self.mutex.lock().unwrap_or_else(PoisonError::into_inner);
        self.guard.get_or_insert_with(lock)
    }
}
