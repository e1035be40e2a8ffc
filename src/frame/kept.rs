//! What a frame leaves on the device for the next one.

use super::{FrameImages, lighting::Lighting, stage::Stage};

/// Nothing, before the first frame and after one that failed. Whether it is there shows in a frame's time and in nothing else.
#[derive(Default)]
pub(crate) struct Kept {
    pub stage: Option<Stage>,
    pub lighting: Option<Lighting>,
    pub images: Option<FrameImages>,
}
