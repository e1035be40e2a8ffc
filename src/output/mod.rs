//! Output: the frame in memory, OpenEXR files for measurements, PNG files for viewing. Also reads OpenEXR files.

mod atomic;
mod exr;
mod exr_header_order;
mod exr_read;
mod frame;
mod header;
mod layer;
mod per_pixel;
mod png;
mod tof;
mod tof_layers;

pub use atomic::OutputFile;
pub use exr::{ExrCompression, ExrOptions, WrittenExr, write_exr, write_exr_hashed};
pub use exr_read::{ImageLayer, LayeredImage};
pub use frame::{
    Frame, FrameDescription, FrameStats, LayerData, PassTime, ReferenceSamples, StopReason,
};
pub use header::{Attribute, TOF_CONVENTION};
pub(crate) use layer::FrameParts;
pub use layer::Layer;
pub(crate) use per_pixel::{for_each_at_once, per_pixel, pixels_of_a_thread};
pub use png::{PngPreview, PngView, srgb_byte, white_radiance, write_png};
pub use tof::Exposure;
pub(crate) use tof::{PixelPhasors, TofCamera};
pub use tof_layers::TofQuantity;
