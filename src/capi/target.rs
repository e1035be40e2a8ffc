//! Layers that are copied to the host's memory.

use std::{ffi::c_void, ptr};

use super::*;
use crate::output::{Layer, LayerData};

/// A layer, and the host's memory for it. Initialise with CAMLUX_TARGET_INIT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_target {
    /// Set by CAMLUX_TARGET_INIT.
    pub struct_size: u32,
    /// CAMLUX_LAYER_RADIANCE and so on.
    pub layer: i32,
    /// Receives the layer from its upper left pixel: rows from the top, channels interleaved, 4 bytes per value. Of any alignment.
    pub data: *mut c_void,
    /// Bytes that may be written: at least height - 1 strides plus one row.
    pub size_bytes: usize,
    /// Bytes from one row to the next; 0: rows are contiguous. Bytes between rows are not changed.
    pub row_stride_bytes: usize,
}

c_struct!(camlux_target, 32);

/// A layer, and the memory for its rows.
#[derive(Clone, Copy)]
pub(super) struct Target {
    pub layer: Layer,
    data: *mut u8,
    size_bytes: usize,
    row_stride_bytes: usize,
}

impl Target {
    pub fn from_c(target: camlux_target) -> Outcome<Target> {
        let layer = layer_of(target.layer)?;
        let at = target.data.cast();
        Target::new(layer, at, target.size_bytes, target.row_stride_bytes)
    }

    pub fn new(
        layer: Layer,
        data: *mut u8,
        size_bytes: usize,
        row_stride_bytes: usize,
    ) -> Outcome<Target> {
        args::check_pointer(data, "the memory for the layer")?;
        Ok(Target {
            layer,
            data,
            size_bytes,
            row_stride_bytes,
        })
    }

    /// Checks that the layer of an image of this size fits. Returns the bytes of a row and the stride.
    pub fn check(&self, [width, height]: [u32; 2]) -> Outcome<[usize; 2]> {
        // Values of all formats have 4 bytes.
        let row_bytes = 4 * width as usize * self.layer.channel_names().len();
        let rows = height as usize;
        let stride = match self.row_stride_bytes {
            0 => row_bytes,
            stride => stride,
        };
        if stride < row_bytes {
            return Err(Failure::argument(format!(
                "row_stride_bytes is {stride}, but a row has {row_bytes} bytes; give 0, or at least those"
            )));
        }
        let needed = stride
            .checked_mul(rows - 1)
            .and_then(|bytes| bytes.checked_add(row_bytes));
        if needed.is_none_or(|needed| needed > self.size_bytes) {
            let size_bytes = self.size_bytes;
            return Err(Failure::argument(format!(
                "{rows} rows of {row_bytes} bytes, {stride} bytes apart, do not fit in {size_bytes} bytes; give more memory"
            )));
        }
        Ok([row_bytes, stride])
    }

    /// Copies the layer to the target.
    ///
    /// # Safety
    /// `size_bytes` bytes may be written at `data`.
    pub unsafe fn fill(&self, data: &LayerData, resolution_px: [u32; 2]) -> Outcome {
        let [row_bytes, stride] = self.check(resolution_px)?;
        let bytes: &[u8] = match data {
            LayerData::Float(values) => bytemuck::cast_slice(values),
            LayerData::Id(ids) => bytemuck::cast_slice(ids),
        };
        for (row, bytes) in bytes.chunks_exact(row_bytes).enumerate() {
            // SAFETY: the number of bytes was checked; the caller guarantees the memory. It may be a part of the frame itself.
            unsafe { ptr::copy(bytes.as_ptr(), self.data.add(row * stride), row_bytes) };
        }
        Ok(())
    }
}
