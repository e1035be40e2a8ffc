//! OpenEXR output: one file with one part, whose channel names have the layer as prefix, or with a part for each layer.

use std::io::Seek;
use std::path::PathBuf;

use exr::block::lines::LineRefMut;
use exr::image::write::WritableImage;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::image::{AnyChannel, AnyChannels, Blocks, Encoding, Image, Layer as ExrPart};
use exr::math::{RoundingMode, Vec2};
use exr::meta::attribute::{IntegerBounds, LevelMode, LineOrder, SampleType};
use exr::meta::header::{Header, ImageAttributes};
use exr::prelude::Compression;
use half::f16;

use super::atomic::OutputFile;
use super::exr_header_order;
use super::header::{self, Attribute};
use super::{Frame, Layer, LayerData, plain};
use crate::error::Result;

/// The contents of an OpenEXR file. The default is every layer of the frame as 32-bit float.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExrOptions {
    /// Store light (`radiance`, `direct`, `indirect`, `emission`), normals and `albedo` as 16-bit float: 11 significant bits, from 6·10⁻⁸ up to 65 504. Larger values are
    /// stored as 65 504 and smaller ones as 0. The other layers stay 32-bit: an energy is around 10⁻¹⁵ J, and 11 bits of a distance of 3 m
    /// are steps of 2 mm.
    pub half: bool,
    /// The layers to write; `None` for all.
    pub layers: Option<Vec<Layer>>,
    /// How pixels are packed. Reading returns the same values.
    pub compression: ExrCompression,
    /// Write each layer to a file of its own, with the channels R, G, B or Y, which programs such as OpenCV read. Ids become floats.
    /// [`write_exr_files`](super::write_exr_files) names the files.
    pub plain: bool,
    /// Write a part for each layer, with its name, and channels without it: R of the part `direct`. Programs read one part without the
    /// others. Not together with `plain`.
    pub multipart: bool,
    /// Further header attributes: names, which get the prefix `camlux.`, and values.
    pub attributes: Vec<(String, Attribute)>,
}

/// How the pixels of a file are packed. All ways are lossless.
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
    /// All of them, in the order of the documentation.
    pub const ALL: [ExrCompression; 5] = [
        ExrCompression::None,
        ExrCompression::Rle,
        ExrCompression::Zips,
        ExrCompression::Zip,
        ExrCompression::Piz,
    ];

    /// The name that other programs use.
    pub fn name(self) -> &'static str {
        self.names().0
    }

    /// The compression of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|way| way.name() == name)
    }

    fn names(self) -> (&'static str, Compression) {
        match self {
            ExrCompression::None => ("none", Compression::Uncompressed),
            ExrCompression::Rle => ("rle", Compression::RLE),
            ExrCompression::Zips => ("zips", Compression::ZIP1),
            ExrCompression::Zip => ("zip", Compression::ZIP16),
            ExrCompression::Piz => ("piz", Compression::PIZ),
        }
    }
}

impl ExrOptions {
    /// Whether the file contains this layer if the frame has it.
    pub fn picks(&self, layer: Layer) -> bool {
        let picked = self.layers.as_ref();
        picked.is_none_or(|layers| layers.contains(&layer))
    }

    /// Rejects a frame that lacks a requested layer.
    pub(super) fn require_layers(&self, output: &OutputFile, frame: &Frame) -> Result<()> {
        let is_there = |layer: Layer| frame.layers.iter().any(|(kind, _)| *kind == layer);
        let mut requested = self.layers.iter().flatten().copied();
        match requested.find(|&layer| !is_there(layer)) {
            None => Ok(()),
            Some(missing) => Err(output.refused(
                format!("the frame has no layer {}", missing.name()),
                &format!(
                    "{}, or leave it out",
                    missing.hint(frame.description.tof.as_ref())
                ),
            )),
        }
    }

    /// Warnings about values that the file cannot hold as they are, one sentence per layer: values above and below the range of 16 bits.
    pub fn warnings(&self, frame: &Frame) -> Vec<String> {
        let mut warnings = Vec::new();
        for (layer, data) in &frame.layers {
            let LayerData::Float(values) = data else {
                continue;
            };
            if !self.picks(*layer) || sample_type(*layer, self.half) != SampleType::F16 {
                continue;
            }
            let (mut over, mut below) = (0, 0);
            for &value in values {
                let stored = saturating_half(value).to_f32();
                // Rounding to 16 bits takes values a little above the largest one down to it.
                let is_over = value.is_finite() && value.abs() > 1.001 * f32::from(f16::MAX);
                over += usize::from(is_over);
                below += usize::from(value != 0.0 && stored == 0.0);
            }
            if over + below > 0 {
                warnings.push(format!(
                    "{} has {over} values above 65504 and {below} below 6e-8, which 16 bits cannot hold: the file has 65504 and 0 instead; store 32 bits",
                    layer.name()
                ));
            }
        }
        warnings
    }
}

/// Writes the frame as an OpenEXR file and gives the file its name.
///
/// The file has one part with the channels of [`Layer::channel_names`] (ids as UINT), or [several](ExrOptions::multipart) with those of
/// [`Layer::part_channel_names`]. The header, that of each part, holds the frame's description: standard
/// attributes `software`, `worldToCamera`, `worldToNDC` and `expTime`, the rest under `camlux.`, such as `camlux.unit.radiance` =
/// `W/sr/m^2`. `docs/output.md` lists them.
///
/// By default of the library the pixels are stored uncompressed: any compression takes more time than the saved disk space is worth while
/// the next frame waits. Measured with 22 channels of 800 × 800 (a Cornell box of 200 × 200 repeated, which favours ZIP and PXR24), release build, 2
/// cores, into the file cache:
///
/// | | none | RLE | ZIP, 1 line | ZIP, 16 lines | PXR24 (drops 8 bits) | PIZ |
/// |---|---|---|---|---|---|---|
/// | ms | 31–57 | 115 | 210–300 | 280 | 190–220 | 530–580 |
/// | MB | 56 | 39 | 7 | 7 | 3 | 26 |
///
/// The same frame written with the same options gives the same bytes.
///
/// # Errors
/// [`Error::Output`](crate::Error::Output) when the frame lacks a requested layer, when the frame's layers do not fit its resolution, and
/// when the file cannot be written. The final name then has no file, or still the previous one.
pub fn write_exr(mut output: OutputFile, frame: &Frame, options: &ExrOptions) -> Result<()> {
    fill(&mut output, frame, options)?;
    output.commit()
}

/// Identifies a written file, or the plain files of a frame.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WrittenExr {
    /// BLAKE3 of the file, or of all files one after the other, 64 hexadecimal digits.
    pub blake3: String,
    pub bytes: u64,
    pub files: Vec<PathBuf>,
}

impl WrittenExr {
    /// Writes another file.
    pub(super) fn add(
        &mut self,
        mut output: OutputFile,
        frame: &Frame,
        options: &ExrOptions,
        hasher: &mut blake3::Hasher,
    ) -> Result<()> {
        fill(&mut output, frame, options)?;
        let file = &mut output.temporary;
        file.rewind()
            .and_then(|()| hasher.update_reader(file).map(|_| ()))
            .map_err(|error| output.failed(&error))?;
        self.files.push(output.path().to_owned());
        output.commit()
    }
}

fn fill(output: &mut OutputFile, frame: &Frame, options: &ExrOptions) -> Result<()> {
    frame.check_for_output(output.path())?;
    options.require_layers(output, frame)?;
    let layers = frame.layers.iter().map(|(layer, data)| (*layer, data));
    let picked: Vec<_> = layers.filter(|(layer, _)| options.picks(*layer)).collect();
    check_picked(output, &picked, options)?;
    let mut further = options.attributes.clone();
    if let ([(only, _)], true) = (&picked[..], options.multipart) {
        // Readers do not look at the name of a single part, which other programs set by accident.
        further.push((plain::LAYER.into(), only.name().into()));
    }
    let layers_of_part = match options.multipart {
        true => 1,
        false => picked.len(),
    };
    let parts = picked.chunks(layers_of_part);
    let parts = parts.map(|layers| part(output, frame, layers, options, &further));
    let parts = parts.collect::<Result<Vec<_>>>()?;
    let bounds = IntegerBounds::from_dimensions(resolution(frame));
    let image = Image::from_layers(ImageAttributes::new(bounds), parts);
    let writer = image.write();
    // Threads cost more than they save where a block is one line of a layer.
    let writer = match (options.multipart, options.compression) {
        (true, ExrCompression::Rle) => writer.non_parallel(),
        _ => writer,
    };
    writer
        .to_unbuffered(&mut output.temporary)
        .map_err(|error| output.failed(&error))?;
    exr_header_order::sort(&mut output.temporary).map_err(|error| output.failed(&error))
}

/// A layer of a frame.
type OfFrame<'f> = (Layer, &'f LayerData);

/// Rejects layers that a file of its options cannot hold.
fn check_picked(output: &OutputFile, picked: &[OfFrame], options: &ExrOptions) -> Result<()> {
    if options.plain && options.multipart {
        let hint = "leave out plain or multipart";
        return Err(output.refused("a plain file has one part", hint));
    }
    match picked.len() {
        0 => Err(output.refused("no layer is picked", "name at least one")),
        2.. if options.plain => {
            let hint = "write each layer to a file of its own";
            Err(output.refused("a plain file holds one layer", hint))
        }
        _ => Ok(()),
    }
}

/// A part with these layers, and with the description of the frame.
fn part<'f>(
    output: &OutputFile,
    frame: &Frame,
    layers: &[OfFrame<'f>],
    options: &ExrOptions,
    further: &[(String, Attribute)],
) -> Result<ExrPart<AnyChannels<ChannelSamples<'f>>>> {
    let has = |layer| layers.iter().any(|(kind, _)| *kind == layer);
    let mut attributes = header::attributes(frame, &has, further);
    if let ([(layer, _)], true) = (layers, options.multipart) {
        attributes.layer_name = Some(layer.name().into());
    }
    let encoding = Encoding {
        compression: options.compression.names().1,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let channels = AnyChannels::sort(channels(output, layers, options)?.into());
    Ok(ExrPart::new(
        resolution(frame),
        attributes,
        encoding,
        channels,
    ))
}

fn resolution(frame: &Frame) -> (usize, usize) {
    let [width, height] = frame.resolution_px.map(|px| px as usize);
    (width, height)
}

/// The channels of these layers.
fn channels<'f>(
    output: &OutputFile,
    layers: &[OfFrame<'f>],
    options: &ExrOptions,
) -> Result<Vec<AnyChannel<ChannelSamples<'f>>>> {
    let mut channels = Vec::new();
    for &(layer, data) in layers {
        let names = match (options.plain, options.multipart) {
            (true, _) => layer.plain_channel_names(),
            (false, true) => layer.part_channel_names(),
            (false, false) => layer.channel_names(),
        };
        let stored_as = match (data, options.plain) {
            (LayerData::Id(ids), true) => {
                check_ids(output, ids)?;
                SampleType::F32
            }
            _ => sample_type(layer, options.half),
        };
        for (offset, &name) in names.iter().enumerate() {
            channels.push(AnyChannel {
                name: name.into(),
                sample_data: ChannelSamples {
                    layer: data,
                    stored_as,
                    offset,
                    stride: layer.channel_names().len(),
                },
                // The values are quantities, so a lossy compression must quantise them linearly and not as colours.
                quantize_linearly: true,
                sampling: Vec2(1, 1),
            });
        }
    }
    Ok(channels)
}

/// Rejects ids that a float does not hold exactly.
fn check_ids(output: &OutputFile, ids: &[u32]) -> Result<()> {
    const MOST: u32 = 1 << f32::MANTISSA_DIGITS;
    match ids.iter().find(|&&id| id > MOST) {
        None => Ok(()),
        Some(id) => Err(output.refused(
            format!("the id {id} is above {MOST}, and a plain file holds floats"),
            "write this layer to a file that is not plain",
        )),
    }
}

/// Whether a layer is stored as 16-bit floats.
pub(super) fn is_half(layer: Layer, half: bool) -> bool {
    match layer {
        Layer::Radiance | Layer::Direct | Layer::Indirect | Layer::Emission => half,
        Layer::Bounce(_) => half,
        Layer::Normal | Layer::CameraNormal | Layer::Albedo => half,
        _ => false,
    }
}

fn sample_type(layer: Layer, half: bool) -> SampleType {
    match layer.is_id() {
        true => SampleType::U32,
        false if is_half(layer, half) => SampleType::F16,
        false => SampleType::F32,
    }
}

/// The values of a channel: every `stride`-th of a layer, from `offset` on; 0 where the offset is beyond the stride. They are read in place, because copying each channel would
/// take as long as writing.
#[derive(Clone, Copy)]
struct ChannelSamples<'f> {
    layer: &'f LayerData,
    stored_as: SampleType,
    offset: usize,
    stride: usize,
}

impl<'s, 'f: 's> WritableSamples<'s> for ChannelSamples<'f> {
    type Writer = Self;

    fn sample_type(&self) -> SampleType {
        self.stored_as
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'s self, _: &Header) -> Self {
        *self
    }
}

impl SamplesWriter for ChannelSamples<'_> {
    /// Writes a row in the byte order of this machine, as `exr` expects it.
    fn extract_line(&self, line: LineRefMut<'_>) {
        match (self.layer, self.stored_as) {
            (LayerData::Float(values), SampleType::F16) => {
                self.copy_row(values, line, |value| saturating_half(value).to_ne_bytes());
            }
            (LayerData::Float(values), _) => self.copy_row(values, line, f32::to_ne_bytes),
            (LayerData::Id(ids), SampleType::F32) => {
                self.copy_row(ids, line, |id| (id as f32).to_ne_bytes());
            }
            (LayerData::Id(ids), _) => self.copy_row(ids, line, u32::to_ne_bytes),
        }
    }
}

impl ChannelSamples<'_> {
    fn copy_row<T: Copy + Default, const N: usize>(
        &self,
        layer: &[T],
        line: LineRefMut<'_>,
        to_bytes: impl Fn(T) -> [u8; N],
    ) {
        // A line is a whole row of the image, because the blocks are.
        let row_values = line.location.sample_count * self.stride;
        let row = &layer[line.location.position.y() * row_values..][..row_values];
        let (stored, _) = line.value.as_chunks_mut::<N>();
        for (stored, pixel) in stored.iter_mut().zip(row.chunks_exact(self.stride)) {
            *stored = to_bytes(pixel.get(self.offset).copied().unwrap_or_default());
        }
    }
}

/// Rounds to the nearest half; a finite value stays finite.
pub(super) fn saturating_half(value: f32) -> f16 {
    let half = f16::from_f32(value);
    if half.is_infinite() && value.is_finite() {
        f16::MAX.copysign(half)
    } else {
        half
    }
}
