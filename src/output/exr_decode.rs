//! From the blocks of an OpenEXR file to layers.

use std::any::Any;
use std::collections::{BTreeMap, HashSet};
use std::fs::{self, File};
use std::io::{BufReader, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::block::reader::{ChunksReader, Reader};
use exr::block::{UncompressedBlock, read as read_meta_data};
use exr::meta::BlockDescription;
use exr::meta::attribute::{AttributeValue, ChannelDescription, SampleType};
use exr::meta::header::Header;
use exr::prelude::Compression;
use half::f16;

use super::exr_read::{ImageLayer, LayeredImage};
use super::frame::Layer;

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

fn damaged(problem: impl std::fmt::Display) -> Refusal {
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

fn explain(error: exr::error::Error) -> Refusal {
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
    let cannot_open = |error: std::io::Error| {
        let mend = "check the name and the permissions";
        match error.kind() {
            std::io::ErrorKind::NotFound => ("there is no such file".into(), mend),
            _ => (format!("cannot read: {error}"), mend),
        }
    };
    let metadata = fs::metadata(path).map_err(cannot_open)?;
    if !metadata.is_file() {
        return Err(("it is not a file".into(), "name an OpenEXR file"));
    }
    if metadata.len() == 0 {
        return Err(damaged("the file is empty"));
    }
    let file = File::open(path).map_err(cannot_open)?;
    Ok((file, metadata.len()))
}

fn decode(file: impl Read + Seek, file_bytes: u64) -> Result<LayeredImage, Refusal> {
    let reader = read_meta_data(file, false).map_err(explain)?;
    let [header] = reader.headers() else {
        let parts = reader.headers().len();
        return Err(unsupported(format!("the file has {parts} parts")));
    };
    let header = header.clone();
    check(&header, file_bytes)?;
    let mut layers = LayerUnderConstruction::all(&header);
    read_blocks(reader, &header, &mut layers)?;
    Ok(LayeredImage {
        // `check` has seen that they fit.
        resolution_px: [header.layer_size.width(), header.layer_size.height()].map(|px| px as u32),
        layers: layers.into_iter().map(|layer| layer.layer).collect(),
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

/// A layer, and which channels of the file it takes.
struct LayerUnderConstruction {
    layer: ImageLayer,
    /// Index in the file of each channel.
    file_channels: Vec<usize>,
}

impl LayerUnderConstruction {
    fn all(header: &Header) -> Vec<Self> {
        let mut by_name: BTreeMap<String, Vec<(usize, String)>> = BTreeMap::new();
        for (index, channel) in header.channels.list.iter().enumerate() {
            let channel_name = channel.name.to_string();
            let layer_name = layer_of_channel(&channel_name).to_owned();
            by_name
                .entry(layer_name)
                .or_default()
                .push((index, channel_name));
        }
        by_name
            .into_iter()
            .map(|(name, mut channels)| {
                channels.sort_by_key(|(_, name)| channel_rank(name));
                let (file_channels, channel_names) = channels.into_iter().unzip();
                LayerUnderConstruction {
                    layer: ImageLayer {
                        name,
                        channel_names,
                        values: Vec::new(),
                    },
                    file_channels,
                }
            })
            .collect()
    }

    /// Makes room for rows up to this one. Room that no block has reached yet is reserved but never touched, so that
    /// a file costs no more memory than it has content.
    fn grow_to(&mut self, rows: usize, header: &Header) -> Result<(), Refusal> {
        let row = header.layer_size.width() * self.file_channels.len();
        let values = &mut self.layer.values;
        if values.capacity() == 0 {
            let all = row * header.layer_size.height();
            values.try_reserve_exact(all).map_err(|_| {
                let problem = format!(
                    "{all} values of layer {} need too much memory",
                    self.layer.name
                );
                (problem, "compare smaller images")
            })?;
        }
        if values.len() < rows * row {
            values.resize(rows * row, 0.0);
        }
        Ok(())
    }
}

/// The layer that a channel belongs to: camlux's own by their names, others by what stands before the last dot.
fn layer_of_channel(channel: &str) -> &str {
    let own = Layer::ALL
        .into_iter()
        .find(|layer| layer.channel_names().contains(&channel));
    match own {
        Some(layer) => layer.name(),
        None => channel.rsplit_once('.').map_or("", |(layer, _)| layer),
    }
}

fn channel_rank(channel: &str) -> (usize, String) {
    const ORDER: [&str; 7] = ["R", "G", "B", "A", "X", "Y", "Z"];
    let last = channel.rsplit_once('.').map_or(channel, |(_, last)| last);
    let rank = ORDER.iter().position(|name| *name == last);
    (rank.unwrap_or(ORDER.len()), channel.to_owned())
}

fn read_blocks<R: Read + Seek>(
    reader: Reader<R>,
    header: &Header,
    layers: &mut [LayerUnderConstruction],
) -> Result<(), Refusal> {
    let full_resolution = reader
        .filter_chunks(false, |_, tile, _| tile.is_largest_resolution_level())
        .map_err(explain)?;
    let mut blocks_read = HashSet::new();
    let mut pixels_read = 0;
    for block in full_resolution.sequential_decompressor(false) {
        let block = block.map_err(explain)?;
        let at = block.index.pixel_position;
        if block.index.level.0 == 0 && block.index.level.1 == 0 && blocks_read.insert((at.0, at.1))
        {
            pixels_read += block.index.pixel_size.area();
            copy_block(&block, header, layers)?;
        }
    }
    if pixels_read != header.layer_size.area() {
        return Err(damaged(format!(
            "{pixels_read} of its {} pixels are there",
            header.layer_size.area()
        )));
    }
    Ok(())
}

fn copy_block(
    block: &UncompressedBlock,
    header: &Header,
    layers: &mut [LayerUnderConstruction],
) -> Result<(), Refusal> {
    let index = block.index;
    for layer in &mut *layers {
        layer.grow_to(index.pixel_position.y() + index.pixel_size.height(), header)?;
    }
    let mut places = vec![(0, 0); header.channels.list.len()];
    for (number, layer) in layers.iter().enumerate() {
        for (offset, &channel) in layer.file_channels.iter().enumerate() {
            places[channel] = (number, offset);
        }
    }
    // A block holds its rows one after the other, and in each the channels in the order of the file.
    let mut bytes = block.data.as_slice();
    for row in 0..index.pixel_size.height() {
        for (channel, &(layer, offset)) in header.channels.list.iter().zip(&places) {
            let row_bytes = index.pixel_size.width() * channel.sample_type.bytes_per_sample();
            let Some((samples, rest)) = bytes.split_at_checked(row_bytes) else {
                return Err(damaged("a block is too short"));
            };
            bytes = rest;
            let stride = layers[layer].file_channels.len();
            let first_pixel = (index.pixel_position.y() + row) * header.layer_size.width()
                + index.pixel_position.x();
            let values = &mut layers[layer].layer.values[first_pixel * stride + offset..];
            copy_samples(samples, channel, values.iter_mut().step_by(stride));
        }
    }
    Ok(())
}

/// The `exr` crate hands over samples in the byte order of this machine.
fn copy_samples<'v>(
    bytes: &[u8],
    channel: &ChannelDescription,
    values: impl Iterator<Item = &'v mut f32>,
) {
    match channel.sample_type {
        SampleType::F16 => copy(bytes, values, |b| f16::from_ne_bytes(b).to_f32()),
        SampleType::F32 => copy(bytes, values, f32::from_ne_bytes),
        SampleType::U32 => copy(bytes, values, |b| u32::from_ne_bytes(b) as f32),
    }
}

fn copy<'v, const N: usize>(
    bytes: &[u8],
    values: impl Iterator<Item = &'v mut f32>,
    to_f32: impl Fn([u8; N]) -> f32,
) {
    let (samples, _) = bytes.as_chunks::<N>();
    for (value, sample) in values.zip(samples) {
        *value = to_f32(*sample);
    }
}

fn attributes(header: &Header) -> BTreeMap<String, String> {
    let readable = |value: AttributeValue| match value {
        AttributeValue::Text(text) => Some(text.to_string()),
        AttributeValue::I32(number) => Some(number.to_string()),
        AttributeValue::F32(number) => Some(number.to_string()),
        AttributeValue::F64(number) => Some(number.to_string()),
        _ => None,
    };
    header
        .all_named_attributes()
        .filter_map(|(name, value)| {
            let name = name.iter().map(|&byte| char::from(byte)).collect();
            Some((name, readable(value)?))
        })
        .collect()
}
