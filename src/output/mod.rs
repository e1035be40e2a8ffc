//! Output: the frame in memory, OpenEXR files for measurements, PNG files for viewing. Also reads OpenEXR files.

mod atomic;
mod dataset;
mod depth_png;
mod exr;
mod exr_header_order;
mod exr_read;
mod flow;
mod frame;
#[cfg(feature = "npz")]
mod frame_files;
mod header;
mod layer;
mod layer_table;
#[cfg(feature = "npz")]
mod npz;
mod per_pixel;
mod plain;
mod png;
mod readout;
mod tof;

pub use atomic::OutputFile;
#[doc(hidden)]
pub use dataset::{
    DATASET_FORMAT, dataset_conventions, dataset_layers, describe_frame, describe_scene,
};
pub use depth_png::write_depth_png;
pub use exr::{ExrCompression, ExrOptions, WrittenExr, write_exr};
pub use exr_read::{ImageLayer, LayeredImage};
#[doc(hidden)]
pub use flow::flow_layers;
pub use flow::{FLOW_LAYERS, OtherFrame};
pub use frame::{
    Frame, FrameDescription, FrameStats, LayerData, PassTime, ReferenceSamples, StopReason,
};
#[cfg(feature = "npz")]
#[doc(hidden)]
pub use frame_files::{FileFormat, write_frame_files};
pub use header::{Attribute, TOF_CONVENTION};
pub(crate) use layer::FrameParts;
pub use layer_table::{Layer, LayerNeed, TofQuantity};
#[cfg(feature = "npz")]
pub use npz::write_npz;
pub(crate) use per_pixel::{per_pixel, pixels_of_a_thread};
pub use plain::{plain_path, write_exr_files};
pub use png::{PngPreview, PngView, srgb_byte, white_radiance, write_png};
pub(crate) use readout::SensorReadout;
pub use tof::Exposure;
pub(crate) use tof::{PixelPhasors, TofCamera, WantedLayers};
