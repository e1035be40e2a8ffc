//! Textures.

use std::ffi::{c_char, c_void};

use super::*;
use crate::scene::{Encoding, Texels, Texture};

/// 8-bit components: 0 to 255 stand for 0 to 1.
pub const CAMLUX_COMPONENT_U8: i32 = 0;
/// 16-bit components: 0 to 65535 stand for 0 to 1.
pub const CAMLUX_COMPONENT_U16: i32 = 1;
/// 32-bit floating-point components, 0 to 1.
pub const CAMLUX_COMPONENT_F32: i32 = 2;

/// CAMLUX_ENCODING_LINEAR for floating point, otherwise CAMLUX_ENCODING_SRGB.
pub const CAMLUX_ENCODING_DEFAULT: i32 = 0;
/// Values are reflectances.
pub const CAMLUX_ENCODING_LINEAR: i32 = 1;
/// Values are encoded with the sRGB transfer function (IEC 61966-2-1), as in most image files.
pub const CAMLUX_ENCODING_SRGB: i32 = 2;

/// A texture for a material. Initialise with CAMLUX_TEXTURE_INIT: three 8-bit channels, encoded as sRGB.
///
/// The first row is the upper edge, v = 1. Textures repeat, and are sampled bilinearly.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_texture {
    /// sizeof(camlux_texture)
    pub struct_size: u32,
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// CAMLUX_COMPONENT_U8, CAMLUX_COMPONENT_U16 or CAMLUX_COMPONENT_F32.
    pub component: i32,
    /// Components of a pixel: 1 (grey), 3 (R, G, B) or 4 (R, G, B and one that is ignored).
    pub channels: u32,
    /// CAMLUX_ENCODING_DEFAULT, CAMLUX_ENCODING_LINEAR or CAMLUX_ENCODING_SRGB.
    pub encoding: i32,
    /// The first row, aligned to the size of a component; copied.
    pub pixels: *const c_void,
    /// Bytes from one row to the next, a multiple of the size of a component; 0: rows are contiguous.
    pub row_stride_bytes: usize,
    /// Name for messages, UTF-8, copied; NULL: none.
    pub name: *const c_char,
}

c_struct!(camlux_texture, 48, channels: 3);

/// Adds a texture. Its pixels are copied.
///
/// \param index receives its index; may be NULL.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values out of range;
/// CAMLUX_ERROR_OUT_OF_MEMORY.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_add_texture(
    scene: *mut camlux_scene,
    texture: *const camlux_texture,
    index: *mut u32,
) -> camlux_status {
    ffi_guard("camlux_scene_add_texture", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        unsafe {
            let texture = texture_from_c(args::read(texture)?)?;
            object.add(index, |state| {
                let textures = &mut state.scene.textures;
                texture.validate(textures.len())?;
                push(textures, texture.into(), "texture")
            })
        }
    })
}

/// Replaces a texture.
///
/// \param index of the texture to replace.
/// \errors as camlux_scene_add_texture.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_texture(
    scene: *mut camlux_scene,
    index: u32,
    texture: *const camlux_texture,
) -> camlux_status {
    ffi_guard("camlux_scene_set_texture", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let texture = unsafe { texture_from_c(args::read(texture)?) }?;
        let mut state = object.lock_to_change();
        let place = part(&mut state.scene.textures, index, "texture")?;
        texture.validate(index as usize)?;
        *place = texture.into();
        Ok(())
    })
}

/// # Safety
/// The pixels are null, or there are as many as the texture states; the name is null or a C string.
unsafe fn texture_from_c(texture: camlux_texture) -> Outcome<Texture> {
    // SAFETY: the caller guarantees it.
    let name = unsafe { args::text(texture.name, "name") }?.unwrap_or_default();
    let channels = texture.channels as usize;
    if ![1, 3, 4].contains(&channels) {
        return Err(Failure::argument(format!(
            "channels is {channels}; give 1, 3 or 4"
        )));
    }
    let encodings = args::choices![
        CAMLUX_ENCODING_DEFAULT => match texture.component {
            CAMLUX_COMPONENT_F32 => Encoding::Linear,
            _ => Encoding::Srgb,
        },
        CAMLUX_ENCODING_LINEAR => Encoding::Linear,
        CAMLUX_ENCODING_SRGB => Encoding::Srgb,
    ];
    let encoding = args::one_of("encoding", texture.encoding, &encodings)?;
    let rows = Rows {
        name: "pixels",
        data: texture.pixels,
        stride_bytes: texture.row_stride_bytes,
        count: texture.height_px as usize,
        length: texture.width_px as usize * channels,
    };
    let components = args::choices![
        CAMLUX_COMPONENT_U8 => 0,
        CAMLUX_COMPONENT_U16 => 1,
        CAMLUX_COMPONENT_F32 => 2,
    ];
    let component = args::one_of("component", texture.component, &components)?;
    // SAFETY: the caller guarantees it.
    let texels = unsafe {
        match component {
            0 => Texels::U8(texels(&rows, channels, |value| value)?, encoding),
            1 => Texels::U16(texels(&rows, channels, |value| value)?, encoding),
            _ => {
                let decode = |value: f32| encoding.decode(value.into());
                Texels::F32(texels(&rows, channels, decode)?)
            }
        }
    };
    Ok(Texture {
        name,
        size_px: [texture.width_px, texture.height_px],
        texels,
    })
}

/// # Safety
/// As for [`Rows::read`].
unsafe fn texels<C: Copy>(
    rows: &Rows,
    channels: usize,
    decode: impl Fn(C) -> C,
) -> Outcome<Vec<[C; 3]>> {
    let texel = |pixel: &[C]| match *pixel {
        [r, g, b, ..] => [r, g, b].map(&decode),
        _ => [decode(pixel[0]); 3],
    };
    let of_row = |row: &[C]| -> Vec<[C; 3]> { row.chunks_exact(channels).map(texel).collect() };
    // SAFETY: the caller guarantees it.
    Ok(unsafe { rows.read(of_row) }?.concat())
}
