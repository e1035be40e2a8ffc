//! What a frame leaves on the device for the next one.

use super::{
    FrameImages, images::FrameImagesKey, lights::Lights, lights::LightsKey,
    scene_resources::SceneResources,
};
use crate::Result;

/// Empty before the first frame and after one that failed. Its contents affect only the time of a frame.
#[derive(Default)]
pub(crate) struct FrameCache {
    pub scene: SceneResources,
    pub lights: Cached<LightsKey, Lights>,
    pub images: Cached<FrameImagesKey, FrameImages>,
}

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
