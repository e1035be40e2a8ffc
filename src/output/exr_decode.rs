//! From an OpenEXR file to layers: what is refused, and the header.

use std::any::Any;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::block::read as read_meta_data;
use exr::meta::BlockDescription;
use exr::meta::header::Header;
use exr::prelude::Compression;

use super::exr_blocks::read_layers;
use super::exr_read::LayeredImage;
use super::header::readable;
use crate::input_file;

/// What is wrong, and what to do about it.
pub(super) type Refusal = (String, &'static str);

/// Reads a file; what `exr` panics at becomes a refusal, too.
pub(super) fn decode_file(path: &Path) -> Result<LayeredImage, Refusal> {
    let (file, file_bytes) = open(path)?;
    // A net: 420 000 damaged files did not reach it, but a library must not end its program where one would.
    let read = catch_unwind(AssertUnwindSafe(|| {
        decode(BufReader::new(file), file_bytes)
    }));
    read.unwrap_or_else(|panic| Err(damaged(panic_text(&*panic))))
}

pub(super) fn damaged(problem: impl std::fmt::Display) -> Refusal {
    (
        format!("not a whole OpenEXR image: {problem}"),
        "write or copy the file again",
    )
}

fn unsupported(problem: impl Into<String>) -> Refusal {
    (
        problem.into(),
        "save it as one flat part with all of its pixels, uncompressed or ZIP",
    )
}

pub(super) fn explain(error: exr::error::Error) -> Refusal {
    match error {
        exr::error::Error::NotSupported(what) => unsupported(format!("it cannot be read: {what}")),
        error => damaged(error),
    }
}

fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    let text = text.or_else(|| panic.downcast_ref::<&str>().map(|&text| text.to_owned()));
    text.unwrap_or_else(|| "its content contradicts itself".into())
}

fn open(path: &Path) -> Result<(File, u64), Refusal> {
    let (file, file_bytes) = input_file::open(path).map_err(|error| {
        let hint = "check the name and the permissions";
        match error.kind() {
            ErrorKind::NotFound => ("there is no such file".into(), hint),
            ErrorKind::InvalidInput => (error.to_string(), "name an OpenEXR file"),
            _ => (format!("cannot read: {error}"), hint),
        }
    })?;
    if file_bytes == 0 {
        return Err(damaged("the file is empty"));
    }
    Ok((file, file_bytes))
}

fn decode(file: impl Read + Seek, file_bytes: u64) -> Result<LayeredImage, Refusal> {
    let reader = read_meta_data(file, false).map_err(explain)?;
    let [header] = reader.headers() else {
        let parts = reader.headers().len();
        return Err(unsupported(format!("the file has {parts} parts")));
    };
    let header = header.clone();
    check(&header, file_bytes)?;
    let layers = read_layers(reader, &header)?;
    Ok(LayeredImage {
        // `check` has seen that they fit.
        resolution_px: [header.layer_size.width(), header.layer_size.height()].map(|px| px as u32),
        layers,
        attributes: attributes(&header),
    })
}

/// Refuses what would be read wrongly, and headers that claim more than the file can hold.
fn check(header: &Header, file_bytes: u64) -> Result<(), Refusal> {
    let display = header.shared_attributes.display_window;
    if (display.position, display.size) != (header.own_attributes.layer_position, header.layer_size)
    {
        return Err(unsupported("its data window is not its display window"));
    }
    let channels = &header.channels.list;
    if let Some(twice) = channels
        .windows(2)
        .find(|pair| pair[0].name == pair[1].name)
    {
        return Err(damaged(format!("channel {} is there twice", twice[0].name)));
    }
    // The most that one byte can stand for: deflate ends at 1032, and PXR24 leaves out every fourth byte before it; DWA
    // may write one zero pair for the 64 coefficients of a block before it.
    let bytes_per_byte: u64 = match header.compression {
        Compression::Uncompressed => 1,
        Compression::DWAA(_) | Compression::DWAB(_) => 64 * 2 * 1032,
        _ => 1032 * 4 / 3,
    };
    // A block of a small image may be larger than the image, and its compressed form has a head.
    let most_bytes = file_bytes
        .saturating_mul(bytes_per_byte)
        .saturating_add(1 << 20);
    let [width, height] =
        [header.layer_size.width(), header.layer_size.height()].map(|px| px as u64);
    let [block_width, block_height] = match header.blocks {
        BlockDescription::Tiles(tiles) => [tiles.tile_size.width(), tiles.tile_size.height()],
        BlockDescription::ScanLines => [
            header.layer_size.width(),
            header.compression.scan_lines_per_block(),
        ],
    }
    .map(|px| px as u64);
    let bytes = |width: u64, height: u64| {
        let pixels = width.saturating_mul(height);
        pixels.saturating_mul(header.channels.bytes_per_pixel as u64)
    };
    // Each block has an entry of 8 bytes in the table and a head of at least 8.
    let block_count_fits = header.chunk_count as u64 <= file_bytes / 16;
    if bytes(width, height) > most_bytes
        || bytes(block_width, block_height) > most_bytes
        || !block_count_fits
    {
        return Err(damaged(format!(
            "its header claims {width} x {height} pixels, which {file_bytes} bytes cannot hold"
        )));
    }
    Ok(())
}

fn attributes(header: &Header) -> BTreeMap<String, String> {
    header
        .all_named_attributes()
        .filter_map(|(name, value)| {
            let name = name.iter().map(|&byte| char::from(byte)).collect();
            Some((name, readable(&value)?))
        })
        .collect()
}
