//! OpenEXR output: one file, one part, channel names with the layer as prefix.

use std::collections::HashSet;
use std::io::Seek;

use exr::block::BlockIndex;
use exr::image::write::WritableImage;
use exr::image::write::channels::{ChannelsWriter, WritableChannels};
use exr::image::{Blocks, Encoding, Image, Layer as ExrPart};
use exr::math::RoundingMode;
use exr::meta::attribute::{
    ChannelDescription, ChannelList, LevelMode, LineOrder, SampleType, Text,
};
use exr::meta::header::Header;
use exr::prelude::Compression;
use half::f16;

use super::atomic::OutputFile;
use super::exr_header_order;
use super::frame::{Frame, Layer, LayerData};
use super::header::{self, Attribute};
use crate::error::{Error, Result};

/// What to put into an OpenEXR file. The default is every layer of the frame as 32-bit float.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExrOptions {
    /// Store `radiance`, `direct`, `indirect` and `N` as 16-bit float: 11 significant bits, from 6·10⁻⁸ up to 65 504;
    /// what is larger is stored as 65 504 and what is smaller as 0. The other layers stay 32-bit: an energy is around
    /// 10⁻¹⁵ J, and 11 bits of a distance of 3 m are steps of 2 mm.
    pub half: bool,
    /// The layers to write; `None` for all.
    pub layers: Option<Vec<Layer>>,
    /// How pixels are packed; what is read back is the same.
    pub compression: ExrCompression,
    /// More for the header: names, which go behind `camlux.`, and values.
    pub attributes: Vec<(String, Attribute)>,
}

/// How the pixels of a file are packed: without loss, each of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ExrCompression {
    #[default]
    None,
    Rle,
    /// ZIP, line by line.
    Zips,
    /// ZIP, 16 lines at a time.
    Zip,
    Piz,
}

impl ExrCompression {
    /// All, in the order of the documentation.
    pub const ALL: [ExrCompression; 5] = [
        ExrCompression::None,
        ExrCompression::Rle,
        ExrCompression::Zips,
        ExrCompression::Zip,
        ExrCompression::Piz,
    ];

    /// The name that other programs have for it.
    pub fn name(self) -> &'static str {
        match self {
            ExrCompression::None => "none",
            ExrCompression::Rle => "rle",
            ExrCompression::Zips => "zips",
            ExrCompression::Zip => "zip",
            ExrCompression::Piz => "piz",
        }
    }

    /// The compression of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|way| way.name() == name)
    }

    fn to_exr(self) -> Compression {
        match self {
            ExrCompression::None => Compression::Uncompressed,
            ExrCompression::Rle => Compression::RLE,
            ExrCompression::Zips => Compression::ZIP1,
            ExrCompression::Zip => Compression::ZIP16,
            ExrCompression::Piz => Compression::PIZ,
        }
    }
}

impl ExrOptions {
    /// What the file will not hold as it is, a sentence for each layer: values over the range of 16 bits, and below it.
    pub fn warnings(&self, frame: &Frame) -> Vec<String> {
        let is_written = |layer: &Layer| self.layers.as_ref().is_none_or(|l| l.contains(layer));
        let layers = frame.layers.iter().filter(|(layer, _)| {
            is_written(layer) && sample_type(*layer, self.half) == SampleType::F16
        });
        let describe = |(layer, data): &(Layer, LayerData)| {
            let LayerData::Float(values) = data else {
                return None;
            };
            let count = |is_lost: fn(f32, f32) -> bool| {
                let stored = |value: f32| saturating_half(value).to_f32();
                values.iter().filter(|&&v| is_lost(v, stored(v))).count()
            };
            let over = count(|value, stored| {
                value.is_finite() && value.abs() > 1.001 * stored.abs() && stored != 0.0
            });
            let below = count(|value, stored| value != 0.0 && stored == 0.0);
            (over + below > 0).then(|| {
                format!(
                    "{} holds {over} values over 65504 and {below} below 6e-8, which 16 bits cannot: they are stored as 65504 and as 0; store 32 bits",
                    layer.name()
                )
            })
        };
        layers.filter_map(describe).collect()
    }
}

/// Writes the frame as an OpenEXR file and gives the file its name.
///
/// The file has one part with the channels of [`Layer::channel_names`] (ids as UINT), and the frame's description in its
/// header: standard attributes `software`, `worldToCamera`, `worldToNDC` and `expTime`, the rest under `camlux.`, such
/// as `camlux.unit.radiance` = `W/sr/m^2`. `docs/output.md` lists them.
///
/// Unless another is chosen, the pixels are stored uncompressed, for any compression costs more time than the disk space is worth while the next
/// frame waits. Measured with 22 channels of 800 × 800 (a Cornell box of 200 × 200 repeated, which flatters ZIP and
/// PXR24), release build, 2 cores, into the file cache:
///
/// | | none | RLE | ZIP, 1 line | ZIP, 16 lines | PXR24 (drops 8 bits) | PIZ |
/// |---|---|---|---|---|---|---|
/// | ms | 31–57 | 115 | 210–300 | 280 | 190–220 | 530–580 |
/// | MB | 56 | 39 | 7 | 7 | 3 | 26 |
///
/// The same frame, written with the same options, gives the same bytes.
///
/// # Errors
/// [`Error::Output`] when a layer is requested that the frame does not have, when the frame's layers do not fit its
/// resolution, and when the file cannot be written. There is no file under the final name then, or the one from before.
pub fn write_exr(mut output: OutputFile, frame: &Frame, options: &ExrOptions) -> Result<()> {
    fill(&mut output, frame, options)?;
    output.commit()
}

/// A file as it was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WrittenExr {
    /// BLAKE3 of the file, 64 hexadecimal digits.
    pub blake3: String,
    pub bytes: u64,
}

/// Like [`write_exr`], and tells what the file can be known by.
///
/// # Errors
/// Those of [`write_exr`].
pub fn write_exr_hashed(
    mut output: OutputFile,
    frame: &Frame,
    options: &ExrOptions,
) -> Result<WrittenExr> {
    fill(&mut output, frame, options)?;
    let mut hasher = blake3::Hasher::new();
    let file = &mut output.temporary;
    file.rewind()
        .and_then(|()| hasher.update_reader(file).map(|_| ()))
        .map_err(|error| output.failed(&error))?;
    output.commit()?;
    Ok(WrittenExr {
        blake3: hasher.finalize().to_hex().to_string(),
        bytes: hasher.count(),
    })
}

fn fill(output: &mut OutputFile, frame: &Frame, options: &ExrOptions) -> Result<()> {
    frame.check_for_output(output.path())?;
    let channels = FrameChannels::new(frame, options, output)?;
    let size = frame.resolution_px.map(|px| px as usize);
    let encoding = Encoding {
        compression: options.compression.to_exr(),
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let written_layers = channels.list.iter().map(|channel| channel.layer).collect();
    let attributes = header::attributes(frame, &written_layers, &options.attributes);
    let part = ExrPart::new((size[0], size[1]), attributes, encoding, channels);
    Image::from_layer(part)
        .write()
        .to_unbuffered(&mut output.temporary)
        .map_err(|error| output.failed(&error))?;
    exr_header_order::sort(&mut output.temporary).map_err(|error| output.failed(&error))
}

/// The channels of a frame in the order of the file, read in place: a copy per channel would take as long as the writing.
struct FrameChannels<'frame> {
    list: Vec<FrameChannel<'frame>>,
}

/// One channel: every `stride`-th value of a layer, from `offset` on.
struct FrameChannel<'frame> {
    layer: Layer,
    name: &'static str,
    stored_as: SampleType,
    data: &'frame LayerData,
    offset: usize,
    stride: usize,
}

impl<'frame> FrameChannels<'frame> {
    fn new(frame: &'frame Frame, options: &ExrOptions, output: &OutputFile) -> Result<Self> {
        let picked: Option<HashSet<Layer>> = options
            .layers
            .as_ref()
            .map(|layers| layers.iter().copied().collect());
        let is_there = |layer: Layer| frame.layers.iter().any(|(kind, _)| *kind == layer);
        let requested = options.layers.iter().flatten();
        if let Some(missing) = requested.copied().find(|&layer| !is_there(layer)) {
            return Err(Error::Output {
                path: output.path().to_owned(),
                problem: format!("the frame has no layer {}", missing.name()),
                hint: "leave it out; energy needs [sensor] in the scene, indirect needs [indirect]"
                    .into(),
            });
        }
        let mut list = Vec::new();
        for (layer, data) in &frame.layers {
            if picked
                .as_ref()
                .is_some_and(|picked| !picked.contains(layer))
            {
                continue;
            }
            let names = layer.channel_names();
            list.extend(
                names
                    .iter()
                    .enumerate()
                    .map(|(offset, &name)| FrameChannel {
                        layer: *layer,
                        name,
                        stored_as: sample_type(*layer, options.half),
                        data,
                        offset,
                        stride: names.len(),
                    }),
            );
        }
        if list.is_empty() {
            return Err(Error::Output {
                path: output.path().to_owned(),
                problem: "no layer is picked".into(),
                hint: "name at least one".into(),
            });
        }
        // The format wants them in the order of their bytes.
        list.sort_by_key(|channel| channel.name);
        Ok(FrameChannels { list })
    }
}

fn sample_type(layer: Layer, half: bool) -> SampleType {
    let may_be_half = match layer {
        Layer::Radiance | Layer::Direct | Layer::Indirect | Layer::Normal => true,
        Layer::StandardError | Layer::Energy | Layer::Position | Layer::Depth | Layer::Range => {
            false
        }
        Layer::InstanceId | Layer::MaterialId | Layer::Edge => return SampleType::U32,
    };
    if half && may_be_half {
        SampleType::F16
    } else {
        SampleType::F32
    }
}

impl<'frame> WritableChannels<'frame> for FrameChannels<'frame> {
    type Writer = &'frame FrameChannels<'frame>;

    fn infer_channel_list(&self) -> ChannelList {
        let describe = |channel: &FrameChannel| {
            // Not a colour to be quantised by a lossy compression.
            let quantize_linearly = true;
            ChannelDescription::new(
                Text::from(channel.name),
                channel.stored_as,
                quantize_linearly,
            )
        };
        ChannelList::new(self.list.iter().map(describe).collect())
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_writer(&'frame self, _: &Header) -> Self::Writer {
        self
    }
}

impl ChannelsWriter for &FrameChannels<'_> {
    fn extract_uncompressed_block(&self, header: &Header, block: BlockIndex) -> Vec<u8> {
        let width = header.layer_size.width();
        let rows = block.pixel_position.y()..block.pixel_position.y() + block.pixel_size.height();
        let mut bytes = Vec::with_capacity(header.channels.bytes_per_pixel * width * rows.len());
        for row in rows {
            for channel in &self.list {
                channel.append_row(&mut bytes, row, width);
            }
        }
        bytes
    }
}

impl FrameChannel<'_> {
    /// Appends the values of one row in the byte order of this machine, as the block's consumer expects them.
    fn append_row(&self, bytes: &mut Vec<u8>, row: usize, width: usize) {
        let range = row * width * self.stride..(row + 1) * width * self.stride;
        match (self.data, self.stored_as) {
            (LayerData::Float(values), SampleType::F16) => {
                append(bytes, &values[range], self.offset, self.stride, |value| {
                    saturating_half(value).to_ne_bytes()
                });
            }
            (LayerData::Float(values), _) => {
                append(
                    bytes,
                    &values[range],
                    self.offset,
                    self.stride,
                    f32::to_ne_bytes,
                );
            }
            (LayerData::Id(ids), _) => {
                append(
                    bytes,
                    &ids[range],
                    self.offset,
                    self.stride,
                    u32::to_ne_bytes,
                );
            }
        }
    }
}

/// Fills a sized slice instead of pushing, for that is what the compiler turns into wide moves.
fn append<T: Copy, const N: usize>(
    bytes: &mut Vec<u8>,
    interleaved: &[T],
    offset: usize,
    stride: usize,
    to_bytes: impl Fn(T) -> [u8; N],
) {
    let start = bytes.len();
    bytes.resize(start + interleaved.len() / stride * N, 0);
    let (stored, _) = bytes[start..].as_chunks_mut::<N>();
    for (stored, pixel) in stored.iter_mut().zip(interleaved.chunks_exact(stride)) {
        *stored = to_bytes(pixel[offset]);
    }
}

/// Rounds to the nearest half; a finite value stays finite.
fn saturating_half(value: f32) -> f16 {
    let half = f16::from_f32(value);
    if half.is_infinite() && value.is_finite() {
        f16::MAX.copysign(half)
    } else {
        half
    }
}
