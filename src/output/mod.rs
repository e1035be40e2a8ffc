//! What comes out: the frame in memory, OpenEXR files for measurements, PNG files for a look.

mod atomic;
mod exr;
mod frame;
mod header;
mod png;

pub use atomic::OutputFile;
pub use exr::{ExrOptions, write_exr};
pub use frame::{
    Frame, FrameDescription, FrameStats, Layer, LayerData, PassTime, ReferenceSamples,
};
pub use png::{PngPreview, PngView, srgb_byte, white_radiance, write_png};
