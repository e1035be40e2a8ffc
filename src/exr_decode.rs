//! Reads an OpenEXR file into its layers, block by block. The `exr` crate's own image readers allocate all memory that a header claims at
//! once, and end the program if there is not enough.

use std::any::Any;
use std::collections::{BTreeMap, HashSet};
use std::fmt::Display;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::block::reader::{ChunksReader, Reader};
use exr::meta::attribute::{AttributeValue, SampleType};
use exr::meta::header::Header;
use exr::prelude::{Compression, Vec2};
use half::f16;

use crate::input_file;

/// What is wrong, and how to fix it.
pub(crate) type Refusal = (String, &'static str);

/// The channels of a file that share a prefix.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageLayer {
    /// The part of the channels' names before the last dot, or `""` without a dot. Exceptions: `id.instance`, `id.material` and `edge` are
    /// layers of one channel, as [`Layer::name`](crate::output::Layer::name) names them.
    pub name: String,
    /// The full names, as in the file: R, G, B, A, then X, Y, Z, then others in alphabetical order.
    pub channel_names: Vec<String>,
    /// Row by row from the top, channels interleaved in the order of `channel_names`: width · height · channels values. 16-bit floats are
    /// exact; whole numbers (UINT) above 2^24 are rounded to the nearest f32.
    pub values: Vec<f32>,
}

/// The content of a file.
pub(crate) struct DecodedImage {
    pub size_px: [u32; 2],
    /// In alphabetical order.
    pub layers: Vec<ImageLayer>,
    /// The attributes of the header, as text.
    pub attributes: BTreeMap<String, String>,
}

/// The layer of a channel, and its place there, for names whose dots separate nothing.
pub(crate) type OwnLayer<'n> = &'n dyn Fn(&str) -> Option<(&'static str, usize)>;

/// Reads a file. A panic in `exr` also becomes a refusal.
pub(crate) fn decode_file(path: &Path, own_layer: OwnLayer) -> Result<DecodedImage, Refusal> {
    let (file, file_bytes) = open(path)?;
    // A safety net: 420 000 damaged files did not trigger it, but a library must not end its program if one would.
    let read = catch_unwind(AssertUnwindSafe(|| {
        decode(BufReader::new(file), file_bytes, own_layer)
    }));
    read.unwrap_or_else(|panic| Err(damaged(panic_text(&*panic))))
}

fn damaged(problem: impl Display) -> Refusal {
    let problem = format!("not a whole OpenEXR image: {problem}");
    (problem, "write or copy the file again")
}

fn unsupported(problem: impl Into<String>) -> Refusal {
    let hint = "save it as one flat part with all of its pixels, uncompressed or ZIP";
    (problem.into(), hint)
}

fn explain(error: exr::error::Error) -> Refusal {
    match error {
        exr::error::Error::NotSupported(what) => unsupported(format!("it cannot be read: {what}")),
        error => damaged(error),
    }
}

fn panic_text(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("its content contradicts itself")
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

fn decode(
    file: impl Read + Seek,
    file_bytes: u64,
    own_layer: OwnLayer,
) -> Result<DecodedImage, Refusal> {
    let reader = exr::block::read(file, false).map_err(explain)?;
    let [header] = reader.headers() else {
        let parts = reader.headers().len();
        return Err(unsupported(format!("the file has {parts} parts")));
    };
    let header = header.clone();
    check_header(&header, file_bytes)?;
    let attributes = header.all_named_attributes().filter_map(|(name, value)| {
        let name = name.iter().map(|&byte| char::from(byte)).collect();
        Some((name, readable(&value)?))
    });
    Ok(DecodedImage {
        // The header has been checked, so the numbers fit.
        size_px: [header.layer_size.0 as u32, header.layer_size.1 as u32],
        layers: read_layers(reader, &header, own_layer)?,
        attributes: attributes.collect(),
    })
}

/// Numbers, vectors and matrices of the header as readable text: `[0.5, 1.0, 3.0]`.
fn readable(value: &AttributeValue) -> Option<String> {
    Some(match value {
        AttributeValue::Text(text) => text.to_string(),
        AttributeValue::I32(number) => number.to_string(),
        AttributeValue::F32(number) => number.to_string(),
        AttributeValue::F64(number) => number.to_string(),
        AttributeValue::Custom { kind, bytes } => {
            let kind = kind.to_string();
            if !["v2d", "v3d", "m44d"].contains(&kind.as_str()) {
                return None;
            }
            let (numbers, _) = bytes.as_chunks();
            let numbers: Vec<f64> = numbers.iter().map(|&b| f64::from_le_bytes(b)).collect();
            format!("{numbers:?}")
        }
        _ => return None,
    })
}

/// Refuses headers that would be read wrongly, and headers that claim more than the file can hold.
fn check_header(header: &Header, file_bytes: u64) -> Result<(), Refusal> {
    let display = header.shared_attributes.display_window;
    let own = &header.own_attributes;
    if (display.position, display.size) != (own.layer_position, header.layer_size) {
        return Err(unsupported("its data window is not its display window"));
    }
    let mut pairs = header.channels.list.windows(2);
    if let Some(twice) = pairs.find(|pair| pair[0].name == pair[1].name) {
        return Err(damaged(format!("channel {} is there twice", twice[0].name)));
    }
    // The maximum expansion of one byte. Deflate reaches 1032, and PXR24 leaves out every fourth byte before it. DWA may write one zero
    // pair for the 64 coefficients of a block before it.
    let bytes_per_byte: u64 = match header.compression {
        Compression::Uncompressed => 1,
        Compression::DWAA(_) | Compression::DWAB(_) => 64 * 2 * 1032,
        _ => 1032 * 4 / 3,
    };
    // A block of a small image may be larger than the image, and its compressed form has a header.
    let most_bytes = file_bytes
        .saturating_mul(bytes_per_byte)
        .saturating_add(1 << 20);
    let is_too_large = |Vec2(width, height): Vec2<usize>| {
        let pixels = (width as u64).saturating_mul(height as u64);
        pixels.saturating_mul(header.channels.bytes_per_pixel as u64) > most_bytes
    };
    // Each block has an entry of 8 bytes in the table and a header of at least 8.
    let has_too_many_blocks = header.chunk_count as u64 > file_bytes / 16;
    if is_too_large(header.layer_size)
        || is_too_large(header.max_block_pixel_size())
        || has_too_many_blocks
    {
        let Vec2(width, height) = header.layer_size;
        return Err(damaged(format!(
            "its header claims {width} x {height} pixels, which {file_bytes} bytes cannot hold"
        )));
    }
    Ok(())
}

/// Reads the layers of a file of one part with a valid header.
fn read_layers<R: Read + Seek>(
    reader: Reader<R>,
    header: &Header,
    own_layer: OwnLayer,
) -> Result<Vec<ImageLayer>, Refusal> {
    let (mut layers, places) = empty_layers(header, own_layer)?;
    let width = header.layer_size.width();
    let mut chunks = reader
        .filter_chunks(false, |_, tile, _| tile.is_largest_resolution_level())
        .map_err(explain)?;
    let mut blocks_read = HashSet::new();
    let mut pixels_read = 0;
    while let Some(chunk) = chunks.read_next_chunk() {
        let chunk = chunk.map_err(explain)?;
        if matches!(
            header.compression,
            Compression::DWAA(_) | Compression::DWAB(_)
        ) {
            check_dwa_block(&chunk, header)?;
        }
        let block = UncompressedBlock::decompress_chunk(chunk, chunks.meta_data(), false);
        let block = block.map_err(explain)?;
        let (at, size) = (block.index.pixel_position, block.index.pixel_size);
        if block.index.level != Vec2(0, 0) || !blocks_read.insert(at) {
            continue;
        }
        pixels_read += size.area();
        for layer in &mut layers {
            // Memory that no block has reached is never touched, so a file takes no more memory than it has content.
            let reached = (at.y() + size.height()) * width * layer.channel_names.len();
            layer.values.resize(layer.values.len().max(reached), 0.0);
        }
        for line in block.lines(&header.channels) {
            let channel = line.location.channel;
            let (layer, offset) = places[channel];
            let layer = &mut layers[layer];
            let stride = layer.channel_names.len();
            let first_pixel = line.location.position.y() * width + line.location.position.x();
            let values = layer.values[first_pixel * stride + offset..].iter_mut();
            let values = values.step_by(stride);
            match header.channels.list[channel].sample_type {
                SampleType::F16 => copy(line.value, values, |b| f16::from_ne_bytes(b).to_f32()),
                SampleType::F32 => copy(line.value, values, f32::from_ne_bytes),
                SampleType::U32 => copy(line.value, values, |b| u32::from_ne_bytes(b) as f32),
            }
        }
    }
    let pixels = header.layer_size.area();
    if pixels_read != pixels {
        let problem = format!("{pixels_read} of its {pixels} pixels are there");
        return Err(damaged(problem));
    }
    Ok(layers)
}

/// Where the values of a channel go: index of the layer, offset in its pixels.
type Place = (usize, usize);

/// The layers of a file, with memory for their values, and the place of each of its channels.
fn empty_layers(
    header: &Header,
    own_layer: OwnLayer,
) -> Result<(Vec<ImageLayer>, Vec<Place>), Refusal> {
    let mut by_name: BTreeMap<String, Vec<(usize, String, usize)>> = BTreeMap::new();
    for (index, channel) in header.channels.list.iter().enumerate() {
        let channel = channel.name.to_string();
        let (layer, rank) = place_of_channel(&channel, own_layer);
        let layer = by_name.entry(layer.into()).or_default();
        layer.push((rank, channel, index));
    }
    let mut layers = Vec::new();
    let mut places = vec![(0, 0); header.channels.list.len()];
    for (name, mut channels) in by_name {
        channels.sort();
        for (offset, &(_, _, index)) in channels.iter().enumerate() {
            places[index] = (layers.len(), offset);
        }
        let mut values = Vec::new();
        let all = header.layer_size.area() * channels.len();
        if values.try_reserve_exact(all).is_err() {
            let problem = format!("{all} values of layer {name} need too much memory");
            return Err((problem, "use smaller images"));
        }
        let channel_names = channels.into_iter().map(|(_, name, _)| name).collect();
        layers.push(ImageLayer {
            name,
            channel_names,
            values,
        });
    }
    Ok((layers, places))
}

/// The layer of a channel, and its place there: from `own_layer` if it knows the name, otherwise from the parts before and after the last
/// dot.
fn place_of_channel<'n>(channel: &'n str, own_layer: OwnLayer) -> (&'n str, usize) {
    const ORDER: [&str; 7] = ["R", "G", "B", "A", "X", "Y", "Z"];
    own_layer(channel).unwrap_or_else(|| {
        let (layer, last) = channel.rsplit_once('.').unwrap_or(("", channel));
        let rank = ORDER.iter().position(|known| *known == last);
        (layer, rank.unwrap_or(ORDER.len()))
    })
}

/// Copies samples, which the `exr` crate returns in the byte order of this machine.
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

/// Refuses a block compressed by DWA that claims more than its pixels can have: `exr` allocates everything that is claimed.
fn check_dwa_block(chunk: &Chunk, header: &Header) -> Result<(), Refusal> {
    /// Which of the 64-bit numbers at the head of the data give unpacked sizes: bytes of other data, of run lengths and of the data that
    /// these encode, number of AC and of DC coefficients.
    const UNPACKED: [usize; 5] = [1, 6, 7, 8, 9];

    let block = &chunk.compressed_block;
    let data = match block {
        CompressedBlock::ScanLine(lines) => &lines.compressed_pixels_le,
        CompressedBlock::Tile(tile) => &tile.compressed_pixels_le,
        // Deep data is refused elsewhere.
        _ => return Ok(()),
    };
    let place = header
        .get_block_data_indices(block)
        .and_then(|indices| header.get_absolute_block_pixel_coordinates(indices))
        .map_err(explain)?;
    let bytes = |round: usize| {
        let Vec2(width, height) = place.size;
        let pixels = width.next_multiple_of(round) * height.next_multiple_of(round);
        pixels * header.channels.bytes_per_pixel
    };
    if data.len() == bytes(1) {
        // The block is not compressed.
        return Ok(());
    }
    // Coefficients come in blocks of 8 x 8. Run lengths may be longer than the data that they encode, but not twice as long.
    let most = 2 * bytes(8) as u64;
    let (numbers, _) = data.as_chunks::<8>();
    let unpacked = UNPACKED.iter().filter_map(|&index| numbers.get(index));
    match unpacked.map(|&bytes| u64::from_le_bytes(bytes)).max() {
        Some(claimed) if claimed > most => Err(damaged(format!(
            "a block claims {claimed} values, but its pixels have at most {most}"
        ))),
        _ => Ok(()),
    }
}
