//! What a frame leaves on the device for the next one.

use std::sync::{Arc, Mutex};

use super::{
    FrameImages,
    cache::Cached,
    images::FrameImagesKey,
    lights::{Lights, LightsKey},
    scene_resources::{SceneResources, SharedScenes},
};
use crate::Device;

/// Empty before the first frame and after one that failed. Its contents affect only the time of a frame.
#[derive(Default)]
pub(crate) struct FrameCache {
    /// Shared by the renderers of a device.
    pub scenes: Arc<Mutex<SharedScenes>>,
    pub scene: SceneResources,
    pub lights: Cached<LightsKey, Lights>,
    pub images: Cached<FrameImagesKey, FrameImages>,
}

impl FrameCache {
    pub fn new(device: &Device) -> FrameCache {
        FrameCache {
            scenes: device.shared_by_renderers(),
            ..FrameCache::default()
        }
    }

    /// Drops all that frames have left.
    pub fn clear(&mut self) {
        *self = FrameCache {
            scenes: self.scenes.clone(),
            ..FrameCache::default()
        };
    }
}
