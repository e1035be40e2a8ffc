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
    /// The part of the channels' names before the last dot, or `""` without a dot. Exceptions: `id.instance`, `edge` and other whole numbers are
    /// layers of one channel, as [`Layer::name`](crate::output::Layer::name) names them.
    pub name: String,
    /// The full names, as in the file: R, G, B, A, then X, Y, Z, then others in alphabetical order.
    pub channel_names: Vec<String>,
    /// Row by row from the top, channels interleaved in the order of `channel_names`: width · height · channels values. 16-bit floats are
    /// exact; whole numbers (UINT) above 2^24 are rounded to the nearest f32.
    pub values: Vec<f32>,
}

/// The content of a file: the pixels of its display window. Those outside of a data window are 0.
pub(crate) struct DecodedImage {
    pub size_px: [u32; 2],
    /// The pixels that every part has: from a column and row on, to below another. The whole image, unless a data window is smaller.
    pub covered_px: [[u32; 2]; 2],
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
    let hint = "save it with flat pixels and all samples of each channel, uncompressed or ZIP";
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
    let headers = reader.headers().to_vec();
    check_headers(&headers, file_bytes)?;
    let display = headers[0].shared_attributes.display_window;
    let size_px = [display.size.0, display.size.1].map(|px| px as u32);
    let mut covered_px = [[0; 2], size_px];
    let mut attributes = BTreeMap::new();
    for header in &headers {
        let window = PartWindow::of(header);
        let [[left, right], [top, bottom]] = [0, 1].map(|axis| window.covered(axis));
        let [[x, y], [end_x, end_y]] = covered_px;
        covered_px = [
            [x.max(left), y.max(top)],
            [end_x.min(right), end_y.min(bottom)],
        ];
        for (name, value) in header.all_named_attributes() {
            if let Some(value) = readable(&value) {
                let name = name.iter().map(|&byte| char::from(byte)).collect();
                attributes.entry(name).or_insert(value);
            }
        }
    }
    Ok(DecodedImage {
        size_px,
        covered_px,
        layers: read_layers(reader, &headers, own_layer)?,
        attributes,
    })
}

/// Where the data window of a part lies in the display window.
#[derive(Clone, Copy)]
struct PartWindow {
    /// Of the display window.
    size_px: [i64; 2],
    /// The first column and row of the data, counted in the display window.
    first_px: [i64; 2],
    data_size_px: [i64; 2],
}

impl PartWindow {
    fn of(header: &Header) -> PartWindow {
        let display = header.shared_attributes.display_window;
        let (at, zero) = (header.own_attributes.layer_position, display.position);
        PartWindow {
            size_px: [display.size.0, display.size.1].map(|px| px as i64),
            first_px: [
                i64::from(at.0) - i64::from(zero.0),
                i64::from(at.1) - i64::from(zero.1),
            ],
            data_size_px: [header.layer_size.0, header.layer_size.1].map(|px| px as i64),
        }
    }

    /// Whether the display window has columns (axis 0) or rows without data.
    fn crops(&self, axis: usize) -> bool {
        self.covered(axis) != [0, self.size_px[axis] as u32]
    }

    /// The first column (axis 0) or row of the display window that the data has, and the first behind.
    fn covered(&self, axis: usize) -> [u32; 2] {
        let first = self.first_px[axis];
        let ends = [first, first + self.data_size_px[axis]];
        ends.map(|px| px.clamp(0, self.size_px[axis]) as u32)
    }
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

/// Memory that the pixels of a display window may take, however small the file is.
const LEAST_BYTES_OF_DISPLAY: u64 = 1 << 26;
/// The maximum expansion of one byte. Deflate reaches 1032, and PXR24 leaves out every fourth byte before it.
const MOST_EXPANSION: u64 = 1032 * 4 / 3;

/// Refuses headers that would be read wrongly, and headers that claim more than the file can hold.
fn check_headers(headers: &[Header], file_bytes: u64) -> Result<(), Refusal> {
    let Some(first) = headers.first() else {
        return Err(damaged("it has no part"));
    };
    let display = first.shared_attributes.display_window;
    let mut names = HashSet::new();
    let (mut data_bytes, mut most_bytes, mut blocks, mut channels) = (0_u64, 0_u64, 0_u64, 0_u64);
    for header in headers {
        if header.shared_attributes.display_window != display {
            return Err(damaged("its parts have different display windows"));
        }
        for channel in &header.channels.list {
            let name = full_name(headers, header, &channel.name.to_string());
            if let Some(twice) = names.replace(name) {
                return Err(damaged(format!("channel {twice} is there twice")));
            }
        }
        // DWA may write one zero pair for the 64 coefficients of a block before Deflate.
        let bytes_per_byte: u64 = match header.compression {
            Compression::Uncompressed => 1,
            Compression::DWAA(_) | Compression::DWAB(_) => 64 * 2 * 1032,
            _ => MOST_EXPANSION,
        };
        // A block of a small image may be larger than the image, and its compressed form has a header.
        most_bytes = most_bytes.max(
            file_bytes
                .saturating_mul(bytes_per_byte)
                .saturating_add(1 << 20),
        );
        let bytes = |Vec2(width, height): Vec2<usize>| {
            let pixels = (width as u64).saturating_mul(height as u64);
            pixels.saturating_mul(header.channels.bytes_per_pixel as u64)
        };
        // Tiles may be larger than their image, but they are read one by one.
        let of_block = bytes(header.max_block_pixel_size());
        data_bytes = data_bytes.saturating_add(bytes(header.layer_size));
        blocks = blocks.saturating_add(header.chunk_count as u64);
        channels += header.channels.list.len() as u64;
        // Each block has an entry of 8 bytes in the table and a header of at least 8.
        if data_bytes.max(of_block) > most_bytes || blocks > file_bytes / 16 {
            let Vec2(width, height) = header.layer_size;
            return Err(damaged(format!(
                "its header claims {width} x {height} pixels, which {file_bytes} bytes cannot hold"
            )));
        }
    }
    let Vec2(width, height) = display.size;
    let display_pixels = (width as u64).saturating_mul(height as u64);
    let is_cropped = headers
        .iter()
        .any(|header| (0..2).any(|axis| PartWindow::of(header).crops(axis)));
    let display_bytes = display_pixels.saturating_mul(4 * channels);
    let most_display_bytes = file_bytes
        .saturating_mul(MOST_EXPANSION)
        .saturating_add(LEAST_BYTES_OF_DISPLAY);
    if is_cropped && display_bytes > most_display_bytes {
        return Err(unsupported(format!(
            "its display window of {width} x {height} pixels needs too much memory for what its data window holds"
        )));
    }
    Ok(())
}

/// The name of a channel in the whole file. In a file of several parts it begins with that of the part.
fn full_name(headers: &[Header], part: &Header, channel: &str) -> String {
    let part_name = part.own_attributes.layer_name.as_ref();
    let part_name = part_name.filter(|name| headers.len() > 1 && !name.as_slice().is_empty());
    let Some(part_name) = part_name.map(ToString::to_string) else {
        return channel.to_owned();
    };
    // Some writers repeat the part's name.
    let after = channel.strip_prefix(&part_name);
    if after.is_some_and(|after| after.starts_with('.')) {
        channel.to_owned()
    } else {
        format!("{part_name}.{channel}")
    }
}

/// Reads the layers of a file with valid headers.
fn read_layers<R: Read + Seek>(
    reader: Reader<R>,
    headers: &[Header],
    own_layer: OwnLayer,
) -> Result<Vec<ImageLayer>, Refusal> {
    let (mut layers, places) = empty_layers(headers, own_layer)?;
    let mut chunks = reader
        .filter_chunks(false, |_, tile, _| tile.is_largest_resolution_level())
        .map_err(explain)?;
    let mut blocks_read = HashSet::new();
    let mut pixels_read = vec![0; headers.len()];
    while let Some(chunk) = chunks.read_next_chunk() {
        let chunk = chunk.map_err(explain)?;
        let part = chunk.layer_index;
        let Some(header) = headers.get(part) else {
            return Err(damaged(format!("a block is of part {part}")));
        };
        if matches!(
            header.compression,
            Compression::DWAA(_) | Compression::DWAB(_)
        ) {
            check_dwa_block(&chunk, header)?;
        }
        let block = UncompressedBlock::decompress_chunk(chunk, chunks.meta_data(), false);
        let block = block.map_err(explain)?;
        let (at, size) = (block.index.pixel_position, block.index.pixel_size);
        if block.index.level != Vec2(0, 0) || !blocks_read.insert((part, at)) {
            continue;
        }
        pixels_read[part] += size.area();
        let window = PartWindow::of(header);
        let [width, height] = window.size_px;
        let [first_x, first_y] = window.first_px;
        let rows = (first_y + (at.y() + size.height()) as i64).clamp(0, height);
        for &(layer, _) in &places[part] {
            let layer = &mut layers[layer];
            // Memory that no block has reached is never touched, so a file takes no more memory than it has content.
            let reached = (rows * width) as usize * layer.channel_names.len();
            layer.values.resize(layer.values.len().max(reached), 0.0);
        }
        for line in block.lines(&header.channels) {
            let (x, y) = (line.location.position.x(), line.location.position.y());
            let (x, y) = (first_x + x as i64, first_y + y as i64);
            let skipped = (-x).max(0);
            let count = line.location.sample_count as i64;
            let count = count.min(width - x) - skipped;
            if !(0..height).contains(&y) || count <= 0 {
                continue;
            }
            let channel = line.location.channel;
            let (layer, offset) = places[part][channel];
            let layer = &mut layers[layer];
            let stride = layer.channel_names.len();
            let first_pixel = (y * width + x + skipped) as usize;
            let values = layer.values[first_pixel * stride + offset..].iter_mut();
            let values = values.step_by(stride).take(count as usize);
            let skipped = skipped as usize;
            match header.channels.list[channel].sample_type {
                SampleType::F16 => copy(&line.value[2 * skipped..], values, |b| {
                    f16::from_ne_bytes(b).to_f32()
                }),
                SampleType::F32 => copy(&line.value[4 * skipped..], values, f32::from_ne_bytes),
                SampleType::U32 => copy(&line.value[4 * skipped..], values, |b| {
                    u32::from_ne_bytes(b) as f32
                }),
            }
        }
    }
    for (header, pixels_read) in headers.iter().zip(pixels_read) {
        let pixels = header.layer_size.area();
        if pixels_read != pixels {
            let problem = format!("{pixels_read} of its {pixels} pixels are there");
            return Err(damaged(problem));
        }
    }
    let pixels = headers[0].shared_attributes.display_window.size.area();
    for layer in &mut layers {
        layer.values.resize(pixels * layer.channel_names.len(), 0.0);
    }
    Ok(layers)
}

/// Where the values of a channel go: index of the layer, offset in its pixels.
type Place = (usize, usize);

/// The layers of a file, with memory for their values, and the place of each channel of each part.
fn empty_layers(
    headers: &[Header],
    own_layer: OwnLayer,
) -> Result<(Vec<ImageLayer>, Vec<Vec<Place>>), Refusal> {
    let mut by_name: BTreeMap<String, Vec<(usize, String, [usize; 2])>> = BTreeMap::new();
    let mut places = Vec::new();
    for (part, header) in headers.iter().enumerate() {
        places.push(vec![(0, 0); header.channels.list.len()]);
        for (index, channel) in header.channels.list.iter().enumerate() {
            let channel = full_name(headers, header, &channel.name.to_string());
            let (layer, rank) = place_of_channel(&channel, own_layer);
            let layer = by_name.entry(layer.into()).or_default();
            layer.push((rank, channel, [part, index]));
        }
    }
    let pixels = headers[0].shared_attributes.display_window.size.area();
    let mut layers = Vec::new();
    for (name, mut channels) in by_name {
        channels.sort();
        for (offset, &(_, _, [part, index])) in channels.iter().enumerate() {
            places[part][index] = (layers.len(), offset);
        }
        let mut values = Vec::new();
        let all = pixels * channels.len();
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
