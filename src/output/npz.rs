//! Numpy's archives: a zip file with an array for each layer.

use std::io::{Cursor, Write};
use std::path::Path;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::exr::{is_half, saturating_half};
use super::{ExrOptions, Frame, LayerData, OutputFile, WrittenExr};
use crate::error::Result;

/// Writes layers of a frame as a numpy archive: `numpy.load(path)["depth"]`. Arrays are (height, width) or (height, width, channels), of
/// `float32`, `uint32`, or `float16` where the options say half. Of the options, the layers and half count. The same frame gives the same bytes.
///
/// # Errors
/// [`Error::Output`](crate::Error::Output) when the frame lacks a requested layer, and when the file cannot be written.
pub fn write_npz(
    path: &Path,
    frame: &Frame,
    options: &ExrOptions,
    is_compressed: bool,
) -> Result<WrittenExr> {
    let output = OutputFile::create(path)?;
    frame.check_for_output(output.path())?;
    options.require_layers(&output, frame)?;
    let method = match is_compressed {
        true => CompressionMethod::Deflated,
        false => CompressionMethod::Stored,
    };
    // Without a time, so that the bytes depend on the frame alone.
    let entry = SimpleFileOptions::default()
        .last_modified_time(zip::DateTime::default())
        .compression_method(method)
        .large_file(true);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let picked = frame.layers.iter();
    for (layer, data) in picked.filter(|(layer, _)| options.picks(*layer)) {
        let (kind, bytes) = match data {
            LayerData::Float(values) if is_half(*layer, options.half) => {
                let halves = values.iter().map(|&value| saturating_half(value));
                ("<f2", halves.flat_map(|half| half.to_le_bytes()).collect())
            }
            LayerData::Float(values) => ("<f4", bytes_of(values, |value| value.to_le_bytes())),
            LayerData::Id(ids) => ("<u4", bytes_of(ids, |id| id.to_le_bytes())),
        };
        let header = header(kind, frame.resolution_px, layer.channel_names().len());
        let written = archive
            .start_file(format!("{}.npy", layer.name()), entry)
            .map_err(std::io::Error::from)
            .and_then(|()| archive.write_all(&header))
            .and_then(|()| archive.write_all(&bytes));
        written.map_err(|error| output.failed(&error))?;
    }
    let archive = archive.finish().map_err(|error| output.failed(&error))?;
    let bytes = archive.into_inner();
    let written = WrittenExr {
        blake3: blake3::hash(&bytes).to_hex().to_string(),
        bytes: bytes.len() as u64,
        files: vec![path.to_owned()],
    };
    output.commit_with(&bytes)?;
    Ok(written)
}

fn bytes_of<T: Copy>(values: &[T], bytes: impl Fn(T) -> [u8; 4]) -> Vec<u8> {
    values.iter().flat_map(|&value| bytes(value)).collect()
}

/// The header of an array in the format NPY, version 1.0. Its length is a multiple of 64.
fn header(kind: &str, [width, height]: [u32; 2], channels: usize) -> Vec<u8> {
    /// The magic word, the version and the length of what follows.
    const BEGIN: usize = 10;
    let shape = match channels {
        1 => format!("({height}, {width})"),
        _ => format!("({height}, {width}, {channels})"),
    };
    let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (BEGIN + text.len() + 1).next_multiple_of(64) - BEGIN;
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend((length as u16).to_le_bytes());
    header.extend(format!("{text:<0$}\n", length - 1).bytes());
    header
}
