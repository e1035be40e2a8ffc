//! Frames: their layers, viewed in place, copied, and written to files.

use std::{
    ffi::{CStr, CString, c_char, c_void},
    sync::{LazyLock, OnceLock},
};

use super::*;
use crate::{
    DeviceFrame,
    output::{
        ExrOptions, Frame, FrameDescription, FrameStats, Layer, LayerData, OutputFile, PngView,
        write_exr_files, write_png,
    },
};

/// A layer in the frame's memory. Pixels without a surface hold 0, unless the layer's constant says otherwise. Initialise with
/// CAMLUX_VIEW_INIT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_view {
    /// Set by CAMLUX_VIEW_INIT.
    pub struct_size: u32,
    /// CAMLUX_LAYER_RADIANCE and so on.
    pub layer: i32,
    /// The upper left pixel. Rows run from the top, pixels from the left, channels are interleaved. Valid and unchanged until
    /// the frame's last release.
    pub data: *const c_void,
    /// Bytes from one row to the next.
    pub row_stride_bytes: usize,
    /// Size of the layer, bytes.
    pub size_bytes: usize,
    /// Pixels in a row.
    pub width_px: u32,
    /// Number of rows.
    pub height_px: u32,
    /// Number of values per pixel: 1, 2 or 3.
    pub channels: u32,
    /// CAMLUX_FORMAT_F32 or CAMLUX_FORMAT_U32.
    pub format: i32,
    /// The layer's name in files, such as "radiance". A static string of the library, always valid.
    pub name: *const c_char,
    /// The unit of the values, such as "W/sr/m^2"; "1" for plain numbers. A static string of the library, always valid.
    pub unit: *const c_char,
}

/// How to write an OpenEXR file. Initialise with CAMLUX_EXR_OPTIONS_INIT: all layers at full precision.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_exr_options {
    /// Set by CAMLUX_EXR_OPTIONS_INIT.
    pub struct_size: u32,
    /// 1: radiance, direct, indirect and normals are written in 16 bits. Values above 65504 are then stored as 65504.
    pub half: i32,
    /// Layers to write: the first of layer_count numbers, such as CAMLUX_LAYER_RADIANCE; NULL, with layer_count 0: all layers of the frame.
    pub layers: *const i32,
    /// Number of these layers.
    pub layer_count: usize,
    /// 1: each layer gets a file of its own with the channels R, G, B or Y, which programs such as OpenCV read: x.depth.exr for x.exr.
    pub plain: i32,
    /// 1: each layer gets a part of its own in the file, with its name, and channels without it: R of the part direct. 0 if plain is 1.
    pub multipart: i32,
}

c_struct!(camlux_view, 64, format: CAMLUX_FORMAT_F32);

c_struct!(camlux_exr_options, 32);

/// A frame, and its texts as C strings.
pub(super) struct FrameObject {
    pub rendered: Rendered,
    pub snapshot_ms: f64,
    pub device: CString,
    pub driver: CString,
    pub pass_names: Vec<CString>,
}

/// Where the layers of a frame are.
pub(super) enum Rendered {
    ToHost(Frame),
    /// Without layers, which went to the host's own memory. The warnings were computed before.
    ToTargets(Frame, Vec<String>),
    /// The layers are read from the device at the first request.
    OnDevice(DeviceFrame, OnceLock<Frame>),
}

impl Rendered {
    pub fn description(&self) -> &FrameDescription {
        match self {
            Rendered::ToHost(frame) | Rendered::ToTargets(frame, _) => &frame.description,
            Rendered::OnDevice(frame, _) => frame.description(),
        }
    }

    pub fn stats(&self) -> &FrameStats {
        match self {
            Rendered::ToHost(frame) | Rendered::ToTargets(frame, _) => &frame.stats,
            Rendered::OnDevice(frame, _) => frame.stats(),
        }
    }
}

impl FrameObject {
    pub fn new(rendered: Rendered, snapshot_ms: f64) -> FrameObject {
        let stats = rendered.stats();
        let passes = stats.passes.iter();
        FrameObject {
            snapshot_ms,
            device: c_string(&stats.device),
            driver: c_string(&stats.driver),
            pass_names: passes.map(|pass| c_string(pass.name)).collect(),
            rendered,
        }
    }

    /// The frame with its layers. Reads them from the device if necessary.
    fn frame(&self) -> Outcome<&Frame> {
        let (on_device, layers) = match &self.rendered {
            Rendered::ToHost(frame) => return Ok(frame),
            Rendered::ToTargets(..) => {
                let problem = "the frame has no layers: they were written to the targets of camlux_render_options; render without targets to keep the layers in the frame";
                return Err(Failure::argument(problem));
            }
            Rendered::OnDevice(on_device, layers) => (on_device, layers),
        };
        if let Some(read) = layers.get() {
            return Ok(read);
        }
        let read = on_device.read()?;
        // Another thread may have been first; it has read the same layers.
        Ok(layers.get_or_init(|| read))
    }

    /// The layers that it has: none if they were written to targets.
    fn layers(&self) -> Outcome<&[(Layer, LayerData)]> {
        match &self.rendered {
            Rendered::ToTargets(..) => Ok(&[]),
            _ => Ok(&self.frame()?.layers),
        }
    }

    fn layer(&self, layer: i32) -> Outcome<(Layer, &LayerData)> {
        let kind = layer_of(layer)?;
        let mut layers = self.frame()?.layers.iter();
        let found = layers.find(|(layer, _)| *layer == kind);
        let (_, data) = found.ok_or_else(|| {
            let tof = self.rendered.description().tof.as_ref();
            let hint = kind.hint(tof);
            let problem = format!("the frame has no layer {}; {hint}", kind.name());
            Failure::argument(words::in_c(&problem))
        })?;
        Ok((kind, data))
    }

    /// # Safety
    /// There are `layer_count` layers.
    unsafe fn exr_options(&self, options: camlux_exr_options) -> Outcome<ExrOptions> {
        // SAFETY: the caller guarantees it.
        let numbers = unsafe { layer_numbers(options.layers, options.layer_count) }?;
        let picked = numbers.into_iter().map(|number| Ok(self.layer(number)?.0));
        let picked = picked.collect::<Outcome<Vec<Layer>>>()?;
        Ok(ExrOptions {
            half: args::flag("half", options.half)?,
            layers: (!picked.is_empty()).then_some(picked),
            plain: args::flag("plain", options.plain)?,
            multipart: args::flag("multipart", options.multipart)?,
            ..ExrOptions::default()
        })
    }

    fn view(&self, layer: i32) -> Outcome<camlux_view> {
        let (kind, data) = self.layer(layer)?;
        let [width_px, height_px] = self.frame()?.resolution_px;
        let (data, count, format): (*const c_void, _, _) = match data {
            LayerData::Float(values) => (values.as_ptr().cast(), values.len(), CAMLUX_FORMAT_F32),
            LayerData::Id(ids) => (ids.as_ptr().cast(), ids.len(), CAMLUX_FORMAT_U32),
        };
        // Values of both formats have 4 bytes.
        let size_bytes = 4 * count;
        let (name, mut unit) = texts(kind);
        if kind.unit_by(self.frame()?.description.tof.as_ref()) == "DN" {
            unit = c"DN";
        }
        Ok(camlux_view {
            layer,
            data,
            row_stride_bytes: size_bytes / height_px as usize,
            size_bytes,
            width_px,
            height_px,
            channels: kind.channel_names().len() as u32,
            format,
            name: name.as_ptr(),
            unit: unit.as_ptr(),
            ..Default::default()
        })
    }
}

/// The numbers of a list of layers.
///
/// # Safety
/// There are `layer_count` of them.
pub(super) unsafe fn layer_numbers(layers: *const i32, layer_count: usize) -> Outcome<Vec<i32>> {
    let numbers = args::Rows {
        name: "layers",
        count_name: "layer_count",
        data: layers.cast(),
        stride_bytes: 0,
        count: layer_count,
        length: 1,
    };
    // SAFETY: the caller guarantees it.
    unsafe { numbers.read(|number: &[i32]| number[0]) }
}

pub(super) fn layer_of(number: i32) -> Outcome<Layer> {
    // `of_frequency` of camlux.hpp returns this for a layer that does not exist.
    if number == -1 {
        let problem = "layer is -1, which stands for a time-of-flight frequency or phase image that does not exist; give a smaller index";
        return Err(Failure::argument(problem));
    }
    if let Some(found) = Layer::all().find(|&layer| number_of(layer) == Some(number)) {
        return Ok(found);
    }
    // Those of time of flight are too many to list.
    let plain = Layer::all().filter(|layer| !matches!(layer, Layer::Tof(..)));
    let choice = |layer: Layer| {
        let (name, number) = layer.c_constant()?;
        Some((number, name, layer))
    };
    let mut choices: Vec<_> = plain.filter_map(choice).collect();
    choices.sort_by_key(|(number, ..)| *number);
    args::one_of("layer", number, &choices)
}

/// The number of a layer; `None` for layers that no render has.
fn number_of(layer: Layer) -> Option<i32> {
    let (_, first) = layer.c_constant()?;
    let frequency = match layer {
        Layer::Tof(frequency, _) => frequency,
        _ => 0,
    };
    let own = match layer.number() {
        Some(number) if layer.bounces().is_some() => number - 1,
        Some(phase) => phase,
        None => 0,
    };
    Some(first + CAMLUX_TOF_NEXT_FREQUENCY * i32::from(frequency) + i32::from(own))
}

/// Name and unit of a layer as C strings, created once.
fn texts(layer: Layer) -> (&'static CStr, &'static CStr) {
    static TEXTS: LazyLock<Vec<(Layer, CString, CString)>> = LazyLock::new(|| {
        let texts = |layer: Layer| (layer, c_string(layer.name()), c_string(layer.unit()));
        Layer::all().map(texts).collect()
    });
    let found = TEXTS.iter().find(|(kind, ..)| *kind == layer);
    found.map_or((c"", c""), |(_, name, unit)| (name, unit))
}

/// Counts the layers of a frame. A frame that was rendered to targets has none: they are in the host's memory.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_frame_layer_count(
    frame: *mut camlux_frame,
    count: *mut u32,
) -> camlux_status {
    ffi_guard("camlux_frame_layer_count", || {
        let object = handle::get(frame)?;
        let layers = || Ok(object.layers()?.len() as u32);
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(count, "count", layers) }
    })
}

/// Tells which layer is at an index of the frame's list.
///
/// \param index from 0 to camlux_frame_layer_count - 1.
/// \param layer receives CAMLUX_LAYER_RADIANCE or another layer constant.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_frame_get_layer(
    frame: *mut camlux_frame,
    index: u32,
    layer: *mut i32,
) -> camlux_status {
    ffi_guard("camlux_frame_get_layer", || {
        let object = handle::get(frame)?;
        let number = || {
            let layers = object.layers()?;
            let found = layers.get(index as usize);
            let (layer, _) = found.ok_or_else(|| no_part(index, layers.len(), "layer"))?;
            let problem = || crate::Error::internal("a frame has a layer that no render has");
            Ok(number_of(*layer).ok_or_else(problem)?)
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(layer, "layer", number) }
    })
}

/// Gives access to a layer in the frame's memory, without a copy.
///
/// \param layer CAMLUX_LAYER_RADIANCE and so on.
/// \param view initialise with CAMLUX_VIEW_INIT. What it points to is valid until the frame's last release.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT, also for a layer that the frame does not have.
/// \threads any; frames are immutable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_frame_view(
    frame: *mut camlux_frame,
    layer: i32,
    view: *mut camlux_view,
) -> camlux_status {
    ffi_guard("camlux_frame_view", || {
        let object = handle::get(frame)?;
        // SAFETY: the caller guarantees it.
        unsafe { args::write(view, || object.view(layer)) }
    })
}

/// Copies a layer into the host's memory: rows from the top, channels interleaved, 4 bytes per value.
///
/// \param layer CAMLUX_LAYER_RADIANCE and so on.
/// \param destination of any alignment.
/// \param size_bytes bytes that may be written: at least height - 1 strides plus one row.
/// \param row_stride_bytes from one row to the next; 0: rows are contiguous. Bytes between rows are not changed.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT, also if the layer does not fit.
/// \threads any; frames are immutable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_frame_copy(
    frame: *mut camlux_frame,
    layer: i32,
    destination: *mut c_void,
    size_bytes: usize,
    row_stride_bytes: usize,
) -> camlux_status {
    ffi_guard("camlux_frame_copy", || {
        let object = handle::get(frame)?;
        let (layer, data) = object.layer(layer)?;
        let target = Target::new(layer, destination.cast(), size_bytes, row_stride_bytes)?;
        // SAFETY: the caller guarantees the size of the destination.
        unsafe { target.fill(data, object.frame()?.resolution_px) }
    })
}

/// Writes layers to an OpenEXR file, with units, scene hash and the rest of the description in its header, as
/// `camlux render` does. The file appears complete or not at all.
///
/// \param path UTF-8, ending with .exr; a file of that name is replaced.
/// \param options NULL: those of CAMLUX_EXR_OPTIONS_INIT.
/// \errors CAMLUX_ERROR_OUTPUT; CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT, also for a layer that the frame does
/// not have.
/// \threads any; frames are immutable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_frame_write_exr(
    frame: *mut camlux_frame,
    path: *const c_char,
    options: *const camlux_exr_options,
) -> camlux_status {
    ffi_guard("camlux_frame_write_exr", || {
        let object = handle::get(frame)?;
        // SAFETY: the caller guarantees it.
        let path = unsafe { args::output_path(path, "exr") }?;
        // SAFETY: the caller guarantees it.
        let options = unsafe { args::read_optional(options) }?.unwrap_or_default();
        // SAFETY: the caller guarantees it.
        let options = unsafe { object.exr_options(options) }?;
        write_exr_files(path.as_ref(), object.frame()?, &options)?;
        Ok(())
    })
}

/// Writes an 8-bit sRGB preview: direct, indirect and total radiance side by side, or only the radiance if the frame has no
/// indirect light. The preview is for viewing, not for measurements. The file appears complete or not at all.
///
/// All three have the same exposure: full brightness is the 99th percentile of the total radiance, taken over the brightest band of
/// the pixels that receive light. Brighter values are clipped. So two frames may have two exposures: compare their layers, not their pictures.
///
/// \param path UTF-8, ending with .png; a file of that name is replaced.
/// \errors CAMLUX_ERROR_OUTPUT; CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any; frames are immutable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_frame_write_png(
    frame: *mut camlux_frame,
    path: *const c_char,
) -> camlux_status {
    ffi_guard("camlux_frame_write_png", || {
        let object = handle::get(frame)?;
        // SAFETY: the caller guarantees it.
        let path = unsafe { args::output_path(path, "png") }?;
        let frame = object.frame()?;
        write_png(OutputFile::create(path)?, frame, PngView::for_frame(frame))?;
        Ok(())
    })
}
