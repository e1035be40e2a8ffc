//! Textures.

use std::ffi::{c_char, c_void};

use super::*;
use crate::scene::{Component, Encoding, TextureSource};

/// 8-bit components: 0 to 255 stand for 0 to 1.
pub const CAMLUX_COMPONENT_U8: i32 = 0;
/// 16-bit components: 0 to 65535 stand for 0 to 1.
pub const CAMLUX_COMPONENT_U16: i32 = 1;
/// 32-bit floating-point components, 0 to 1.
pub const CAMLUX_COMPONENT_F32: i32 = 2;

/// What a material uses the texture for decides: integers are CAMLUX_ENCODING_SRGB as kd_texture and ks_texture, all else is CAMLUX_ENCODING_LINEAR.
pub const CAMLUX_ENCODING_DEFAULT: i32 = 0;
/// Values are as they are.
pub const CAMLUX_ENCODING_LINEAR: i32 = 1;
/// Values are encoded with the sRGB transfer function (IEC 61966-2-1), as in most image files. A normal_texture or shininess_texture must
/// not be, nor an alpha_texture without an alpha channel.
pub const CAMLUX_ENCODING_SRGB: i32 = 2;

/// A texture for a material. Initialise with CAMLUX_TEXTURE_INIT: three 8-bit channels, in the encoding of the texture's use.
///
/// The first row is the upper edge, v = 1. Textures repeat, and are sampled bilinearly.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_texture {
    /// Set by CAMLUX_TEXTURE_INIT.
    pub struct_size: u32,
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// CAMLUX_COMPONENT_U8, CAMLUX_COMPONENT_U16 or CAMLUX_COMPONENT_F32.
    pub component: i32,
    /// Components of a pixel: 1 (grey), 3 (R, G, B) or 4 (R, G, B, alpha). Alpha is linear, and only an alpha_texture uses it.
    pub channels: u32,
    /// Of R, G and B: CAMLUX_ENCODING_DEFAULT, CAMLUX_ENCODING_LINEAR or CAMLUX_ENCODING_SRGB.
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
/// \param number receives its number, for members of camlux_material: the first texture has 1, and 0 stands for none. May be NULL.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values out of range;
/// CAMLUX_ERROR_OUT_OF_MEMORY.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_add_texture(
    scene: *mut camlux_scene,
    texture: *const camlux_texture,
    number: *mut u32,
) -> camlux_status {
    ffi_guard("camlux_scene_add_texture", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        unsafe {
            let texture = texture_from_c(args::read(texture)?)?;
            object.add(number, |state| {
                let textures = &mut state.textures;
                Ok(push(textures, texture, "texture")? + 1)
            })
        }
    })
}

/// Replaces a texture.
///
/// \param number of the texture to replace.
/// \errors as camlux_scene_add_texture; CAMLUX_ERROR_SCENE for an encoding that contradicts a material's use of it.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_texture(
    scene: *mut camlux_scene,
    number: u32,
    texture: *const camlux_texture,
) -> camlux_status {
    ffi_guard("camlux_scene_set_texture", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let texture = unsafe { texture_from_c(args::read(texture)?) }?;
        let state = &mut *object.lock_to_change();
        let count = state.textures.len();
        let index = (number as usize).wrapping_sub(1);
        if index >= count {
            let problem =
                format!("there is no texture {number} among {count}; textures count from 1");
            return Err(Failure::argument(problem));
        }
        for (i, material) in state.scene.materials.iter().enumerate() {
            material
                .validate_encodings(i, |role, used| used == index && texture.contradicts(role))?;
        }
        state.textures[index] = texture;
        Ok(())
    })
}

/// # Safety
/// The pixels are null, or there are as many as the texture states; the name is null or a C string.
unsafe fn texture_from_c(texture: camlux_texture) -> Outcome<TextureSource> {
    // SAFETY: the caller guarantees it.
    let name = unsafe { args::text(texture.name, "camlux_texture.name") }?.unwrap_or_default();
    let channels = texture.channels as usize;
    if ![1, 3, 4].contains(&channels) {
        return Err(Failure::argument(format!(
            "channels is {channels}; give 1, 3 or 4"
        )));
    }
    let encodings = args::choices![
        CAMLUX_ENCODING_DEFAULT => None,
        CAMLUX_ENCODING_LINEAR => Some(Encoding::Linear),
        CAMLUX_ENCODING_SRGB => Some(Encoding::Srgb),
    ];
    let encoding = args::one_of("encoding", texture.encoding, &encodings)?;
    let rows = Rows {
        name: "camlux_texture.pixels",
        count_name: "height_px",
        data: texture.pixels,
        stride_bytes: texture.row_stride_bytes,
        count: texture.height_px as usize,
        length: texture.width_px as usize * channels,
    };
    let size_px = [texture.width_px, texture.height_px];
    let components = args::choices![
        CAMLUX_COMPONENT_U8 => 0,
        CAMLUX_COMPONENT_U16 => 1,
        CAMLUX_COMPONENT_F32 => 2,
    ];
    // SAFETY: the caller guarantees it.
    unsafe {
        match args::one_of("component", texture.component, &components)? {
            0 => source::<u8>(name, size_px, &rows, channels, encoding),
            1 => source::<u16>(name, size_px, &rows, channels, encoding),
            _ => source::<f32>(name, size_px, &rows, channels, encoding),
        }
    }
}

/// # Safety
/// As for [`Rows::read`].
unsafe fn source<C: Component>(
    name: String,
    size_px: [u32; 2],
    rows: &Rows,
    channels: usize,
    encoding: Option<Encoding>,
) -> Outcome<TextureSource> {
    // SAFETY: the caller guarantees it.
    let pixels = unsafe { rows.read(<[C]>::to_vec) }?.concat();
    let source = TextureSource::from_pixels(name, size_px, &pixels, channels, encoding)?;
    Ok(source)
}
