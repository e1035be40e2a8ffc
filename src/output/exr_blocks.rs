//! From the blocks of an OpenEXR file to the values of its layers.

use std::collections::{BTreeMap, HashSet};
use std::io::{Read, Seek};

use exr::block::UncompressedBlock;
use exr::block::reader::{ChunksReader, Reader};
use exr::meta::attribute::{ChannelDescription, SampleType};
use exr::meta::header::Header;
use half::f16;

use super::exr_decode::{Refusal, damaged, explain};
use super::exr_dwa::check_block;
use super::exr_read::ImageLayer;
use super::frame::Layer;

/// Reads the layers of a file of one part whose header is sound.
pub(super) fn read_layers<R: Read + Seek>(
    reader: Reader<R>,
    header: &Header,
) -> Result<Vec<ImageLayer>, Refusal> {
    let mut layers = LayerUnderConstruction::all(header);
    read_blocks(reader, header, &mut layers)?;
    Ok(layers.into_iter().map(|layer| layer.layer).collect())
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
    let mut full_resolution = reader
        .filter_chunks(false, |_, tile, _| tile.is_largest_resolution_level())
        .map_err(explain)?;
    let mut blocks_read = HashSet::new();
    let mut pixels_read = 0;
    while let Some(chunk) = full_resolution.read_next_chunk() {
        let chunk = chunk.map_err(explain)?;
        check_block(&chunk, header)?;
        let block = UncompressedBlock::decompress_chunk(chunk, full_resolution.meta_data(), false)
            .map_err(explain)?;
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
