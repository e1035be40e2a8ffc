//! The patterns of measured lamps, the images of projectors and vignetting maps, from arrays and files.

use std::{ffi::c_char, path::Path};

use super::*;
use crate::{
    Error,
    scene::{
        Encoding, Intrinsics, Lens, Measured, Pattern, Profile, ProjectedImage, Shared,
        VignettingMap,
    },
};

/// The measured pattern of a lamp, in the C-gamma system of the CIE: gamma is the angle from the direction of the light, C the angle about it,
/// counterclockwise for a viewer who looks along it. Initialise with CAMLUX_PATTERN_INIT, and give either a file or arrays.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_pattern {
    /// Set by CAMLUX_PATTERN_INIT.
    pub struct_size: u32,
    /// How a PNG, JPEG or WebP file encodes values: CAMLUX_ENCODING_DEFAULT, which is sRGB, CAMLUX_ENCODING_LINEAR or CAMLUX_ENCODING_SRGB.
    pub encoding: i32,
    /// An IES (.ies) or EULUMDAT (.ldt) file, or a grey map of all directions (.png, .jpg, .webp, .exr), UTF-8; NULL: from the arrays.
    pub path: *const c_char,
    /// Angles gamma, degrees, increasing, within 0 and 180; at least two.
    pub gammas_deg: *const f64,
    /// Number of these angles.
    pub gamma_count: usize,
    /// Angles C, degrees, increasing: 0 alone for a lamp that is symmetric about its direction; 0 to 90 or 0 to 180, which are mirrored; or the
    /// whole turn.
    pub planes_deg: *const f64,
    /// Number of these angles.
    pub plane_count: usize,
    /// Radiant intensities of 0 or more, of which only the ratios matter: for each plane gamma_count values.
    pub intensities: *const f64,
}

/// The image of a projector, grey: the irradiance of each pixel on a screen across its axis. Initialise with CAMLUX_PROJECTED_IMAGE_INIT, and
/// give either a file or an array, and a lens.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_projected_image {
    /// Set by CAMLUX_PROJECTED_IMAGE_INIT.
    pub struct_size: u32,
    /// How a PNG, JPEG or WebP file encodes values: CAMLUX_ENCODING_DEFAULT, which is sRGB, CAMLUX_ENCODING_LINEAR or CAMLUX_ENCODING_SRGB.
    pub encoding: i32,
    /// A grey PNG, JPEG, WebP or OpenEXR file, UTF-8; NULL: from the array.
    pub path: *const c_char,
    /// Width of the array, pixels; 0 with a file.
    pub width_px: u32,
    /// Height of the array, pixels; 0 with a file.
    pub height_px: u32,
    /// Relative irradiances from 0 to 1, rows from the top.
    pub values: *const f32,
    /// Bytes from one row to the next, a multiple of 4; 0: rows are contiguous.
    pub row_stride_bytes: usize,
    /// CAMLUX_LENS_FOV_Y or CAMLUX_LENS_INTRINSICS, as for a camera.
    pub lens: i32,
    /// 0.
    pub reserved: u32,
    /// With CAMLUX_LENS_FOV_Y: full angle from the upper to the lower edge, degrees above 0 and below 180.
    pub fov_y_deg: f64,
    /// With CAMLUX_LENS_INTRINSICS: focal lengths in pixels, above 0.
    pub fx_px: f64,
    /// See fx_px.
    pub fy_px: f64,
    /// Principal point in pixels, from the upper left corner of the image.
    pub cx_px: f64,
    /// See cx_px.
    pub cy_px: f64,
}

/// The measured vignetting of the camera's lens as an image, in place of the vignetting of camlux_sensor: an image of an evenly bright
/// surface, divided by its value on the axis. It spans the image of the camera, whatever the resolutions of both. Initialise with
/// CAMLUX_VIGNETTING_MAP_INIT, and give either a file or an array.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_vignetting_map {
    /// Set by CAMLUX_VIGNETTING_MAP_INIT.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// A grey PNG, JPEG, WebP or OpenEXR file with linear values, UTF-8; NULL: from the array.
    pub path: *const c_char,
    /// Width of the array, pixels; 0 with a file.
    pub width_px: u32,
    /// Height of the array, pixels; 0 with a file.
    pub height_px: u32,
    /// Light over that on the axis, from 0 to 100, rows from the top.
    pub values: *const f32,
    /// Bytes from one row to the next, a multiple of 4; 0: rows are contiguous.
    pub row_stride_bytes: usize,
}

c_struct!(camlux_pattern, 56);

c_struct!(camlux_projected_image, 88);

c_struct!(camlux_vignetting_map, 40);

/// Sets the vignetting of the lens as an image. It stays when the sensor changes. A frame needs a sensor with an f_number and without
/// vignetting of its own.
///
/// \param map NULL: none, the default.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values out of range, and for a file that cannot be
/// read.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_vignetting_map(
    scene: *mut camlux_scene,
    map: *const camlux_vignetting_map,
) -> camlux_status {
    ffi_guard("camlux_scene_set_vignetting_map", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let raw = unsafe { args::read_optional(map) }?;
        // SAFETY: as above.
        let map = raw.map(|raw| unsafe { map_from_c(raw) }).transpose()?;
        if let Some(map) = &map {
            map.validate()?;
        }
        object.lock_to_change().scene.vignetting_map = map.map(Shared::from);
        Ok(())
    })
}

/// The pattern or the image that a light points to.
///
/// # Safety
/// Its pointers are null, or misaligned, or point to what their members state.
pub(super) unsafe fn pattern_of(light: &camlux_light) -> Outcome<Option<Profile>> {
    // SAFETY: the caller guarantees it.
    unsafe {
        if light.kind == CAMLUX_LIGHT_PATTERN {
            let given = args::read_optional(light.pattern)?;
            let read = given.map(|pattern| Ok(pattern_from_c(pattern)?.into()));
            return read.transpose();
        }
        if light.kind == CAMLUX_LIGHT_PROJECTOR {
            let given = args::read_optional(light.image)?;
            let read = given.map(|image| Ok(image_from_c(image)?.into()));
            return read.transpose();
        }
    }
    Ok(None)
}

/// # Safety
/// As for [`pattern_of`].
unsafe fn pattern_from_c(raw: camlux_pattern) -> Outcome<Pattern> {
    let encoding = encoding(raw.encoding)?;
    // SAFETY: the caller guarantees it.
    if let Some(path) = unsafe { args::text(raw.path, "camlux_pattern.path") }? {
        file_alone(raw.gamma_count == 0 && raw.plane_count == 0)?;
        let (pattern, warning) =
            Pattern::load(Path::new(&path), encoding, &path).map_err(Failure::as_it_is)?;
        warn(warning);
        return Ok(pattern);
    }
    let (gammas, planes) = (raw.gamma_count, raw.plane_count);
    if gammas < 2 || planes < 1 {
        let problem = format!(
            "the pattern has no path, and gamma_count {gammas} and plane_count {planes}; give a path, or at least two angles gamma and one angle C"
        );
        return Err(Failure::argument(problem));
    }
    let list = |[name, count_name]: [&'static str; 2], data, count, length| args::Rows {
        name,
        count_name,
        data,
        stride_bytes: 0,
        count,
        length,
    };
    let number = |row: &[f64]| row[0];
    // SAFETY: the caller guarantees it.
    let (gammas_deg, planes_deg, rows) = unsafe {
        (
            list(
                ["camlux_pattern.gammas_deg", "gamma_count"],
                raw.gammas_deg.cast(),
                gammas,
                1,
            )
            .read(number)?,
            list(
                ["camlux_pattern.planes_deg", "plane_count"],
                raw.planes_deg.cast(),
                planes,
                1,
            )
            .read(number)?,
            list(
                ["camlux_pattern.intensities", "plane_count"],
                raw.intensities.cast(),
                planes,
                gammas,
            )
            .read(|row: &[f64]| row.to_vec())?,
        )
    };
    let measured = Measured {
        gammas_deg,
        planes_deg,
        intensities: rows.concat(),
    };
    Pattern::of(measured).map_err(|problem| {
        Error::scene("pattern", problem, "see camlux_pattern for what is allowed").into()
    })
}

/// # Safety
/// As for [`pattern_of`].
unsafe fn map_from_c(raw: camlux_vignetting_map) -> Outcome<VignettingMap> {
    args::reserved(camlux_vignetting_map::NAME, raw.reserved)?;
    // SAFETY: the caller guarantees it.
    if let Some(path) = unsafe { args::text(raw.path, "camlux_vignetting_map.path") }? {
        file_alone(raw.width_px == 0 && raw.height_px == 0)?;
        let (map, warning) =
            VignettingMap::load(Path::new(&path), &path).map_err(Failure::as_it_is)?;
        warn(warning);
        return Ok(map);
    }
    let size_px = [raw.width_px, raw.height_px];
    if size_px.contains(&0) {
        let problem = "the vignetting map has no path, and no width_px or no height_px; give a path, or an array";
        return Err(Failure::argument(problem));
    }
    let (name, stride_bytes) = ("camlux_vignetting_map.values", raw.row_stride_bytes);
    // SAFETY: the caller guarantees it.
    let values = unsafe { grey_values(name, size_px, raw.values, stride_bytes) }?;
    Ok(VignettingMap { size_px, values })
}

/// # Safety
/// The pointer is null, or misaligned, or to values of this size and stride.
unsafe fn grey_values(
    name: &'static str,
    [width, height]: [u32; 2],
    values: *const f32,
    stride_bytes: usize,
) -> Outcome<Vec<f32>> {
    let rows = args::Rows {
        name,
        count_name: "height_px",
        data: values.cast(),
        stride_bytes,
        count: height as usize,
        length: width as usize,
    };
    // SAFETY: the caller guarantees it.
    let rows = unsafe { rows.read(|row: &[f32]| row.to_vec()) }?;
    Ok(rows.concat())
}

/// # Safety
/// As for [`pattern_of`].
unsafe fn image_from_c(raw: camlux_projected_image) -> Outcome<ProjectedImage> {
    args::reserved(camlux_projected_image::NAME, raw.reserved)?;
    let encoding = encoding(raw.encoding)?;
    let lenses = args::choices![
        CAMLUX_LENS_FOV_Y => Lens::FovY {
            fov_y_deg: raw.fov_y_deg,
        },
        CAMLUX_LENS_INTRINSICS => Lens::Intrinsics(Intrinsics {
            fx: raw.fx_px,
            fy: raw.fy_px,
            cx: raw.cx_px,
            cy: raw.cy_px,
            skew: 0.0,
        }),
    ];
    let lens = args::one_of("lens", raw.lens, &lenses)?;
    if let Lens::FovY { fov_y_deg } = lens
        && !(fov_y_deg > 0.0 && fov_y_deg < 180.0)
    {
        let problem = format!("fov_y_deg is {fov_y_deg}");
        let hint =
            "give degrees between 0 and 180, both excluded, or set lens to CAMLUX_LENS_INTRINSICS";
        return Err(Error::scene("projected image", problem, hint).into());
    }
    // SAFETY: the caller guarantees it.
    if let Some(path) = unsafe { args::text(raw.path, "camlux_projected_image.path") }? {
        file_alone(raw.width_px == 0 && raw.height_px == 0)?;
        let (image, warning) = ProjectedImage::load(Path::new(&path), encoding, None, lens, &path)
            .map_err(Failure::as_it_is)?;
        warn(warning);
        return Ok(image);
    }
    let size_px = [raw.width_px, raw.height_px];
    if size_px.contains(&0) {
        let problem = "the projected image has no path, and no width_px or no height_px; give a path, or an array";
        return Err(Failure::argument(problem));
    }
    let (name, stride_bytes) = ("camlux_projected_image.values", raw.row_stride_bytes);
    // SAFETY: the caller guarantees it.
    let values = unsafe { grey_values(name, size_px, raw.values, stride_bytes) }?;
    Ok(ProjectedImage {
        size_px,
        intrinsics: lens.intrinsics_px(size_px),
        values,
    })
}

fn encoding(number: i32) -> Outcome<Encoding> {
    let choices = args::choices![
        CAMLUX_ENCODING_DEFAULT => Encoding::Srgb,
        CAMLUX_ENCODING_LINEAR => Encoding::Linear,
        CAMLUX_ENCODING_SRGB => Encoding::Srgb,
    ];
    args::one_of("encoding", number, &choices)
}

fn file_alone(is_alone: bool) -> Outcome {
    if is_alone {
        return Ok(());
    }
    let problem = "there are a path and arrays; give only one of them";
    Err(Failure::argument(problem))
}

/// Logs what a file holds and camlux does not use.
fn warn(warning: Option<String>) {
    if let Some(warning) = warning {
        log::write(CAMLUX_LOG_WARNING, || warning);
    }
}
