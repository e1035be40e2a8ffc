//! Textures from PNG, JPEG and WebP files.

use std::io::Cursor;
use std::path::Path;

use glam::Vec3;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};

use crate::scene::{Encoding, Texels, Texture};
use crate::{Error, Result, input_file};

/// What to do about an image that cannot be read.
pub(super) const GIVE_IMAGE: &str = "give a PNG, JPEG or WebP image";

/// A map named by `norm` or `map_Bump`.
pub(super) struct NormalMap {
    /// The factor for slopes.
    pub strength: f64,
    /// Whether grey values are heights.
    pub may_be_heights: bool,
    /// The line that names it.
    pub named_at: String,
}

impl Texture {
    /// Loads an image of 8 or 16 bits, grey or RGB, as reflectances. `named_at`: the line that names it.
    ///
    /// # Errors
    /// [`Error::Scene`] if the file is missing or is no PNG, JPEG or WebP.
    pub fn load(file: &Path, named_at: &str) -> Result<Texture> {
        load(file, named_at)
    }
}

/// Loads an image of 8 or 16 bits, grey or RGB. An alpha channel is ignored.
///
/// # Errors
/// Returns an error at `named_at` if the file is missing, is no PNG, JPEG or WebP, or claims more pixels than its bytes can hold.
pub(super) fn load(file: &Path, named_at: &str) -> Result<Texture> {
    let image = load_image(file, named_at)?;
    Ok(of_image(file.display().to_string(), image))
}

/// As [`load`], with the alpha of each texel if the image has any.
pub(super) fn load_with_alpha(file: &Path, named_at: &str) -> Result<(Texture, Option<Vec<u8>>)> {
    let image = load_image(file, named_at)?;
    let has_alpha = image.color().has_alpha();
    let alpha = has_alpha.then(|| alpha_channel(image.clone()));
    Ok((of_image(file.display().to_string(), image), alpha))
}

/// The colours of an image, as sRGB.
pub(super) fn of_image(name: String, image: DynamicImage) -> Texture {
    let size_px = [image.width(), image.height()];
    let bits = image.color().bits_per_pixel() / u16::from(image.color().channel_count());
    let texels = if bits <= 8 {
        let texels = image.into_rgb8().into_raw();
        Texels::U8(texels.as_chunks().0.to_vec(), Encoding::Srgb)
    } else {
        let texels = image.into_rgb16().into_raw();
        Texels::U16(texels.as_chunks().0.to_vec(), Encoding::Srgb)
    };
    Texture {
        name,
        size_px,
        texels,
    }
}

/// Loads a cut-out map: the alpha channel of an image that has one, else its grey values. `None` if nothing is cut out.
pub(super) fn load_alpha(file: &Path, named_at: &str) -> Result<Option<Texture>> {
    let image = load_image(file, named_at)?;
    let size_px = [image.width(), image.height()];
    let name = file.display().to_string();
    let values = match image.color().has_alpha() {
        true => alpha_channel(image),
        false => of_image(name.clone(), image)
            .into_brightness()
            .red_in_8_bits(),
    };
    Ok(alpha_texture(name, size_px, values, 0.5))
}

/// The alpha channel of an image; 255 if it has none.
pub(super) fn alpha_channel(image: DynamicImage) -> Vec<u8> {
    let texels = image.into_rgba8();
    texels.pixels().map(|texel| texel[3]).collect()
}

/// Makes an alpha texture; `None` if nothing is below the cutoff.
pub(super) fn alpha_texture(
    name: String,
    size_px: [u32; 2],
    values: Vec<u8>,
    cutoff: f64,
) -> Option<Texture> {
    let is_kept = |value: &u8| f64::from(*value) / f64::from(u8::MAX) >= cutoff;
    if values.iter().all(is_kept) {
        return None;
    }
    let texels = values.into_iter().map(|value| [value; 3]);
    Some(Texture {
        name,
        size_px,
        texels: Texels::U8(texels.collect(), Encoding::Linear),
    })
}

/// Loads a normal map. If the map may hold heights and the image is grey, loads a height map, with heights in texels.
pub(super) fn load_normals(file: &Path, map: &NormalMap) -> Result<Texture> {
    let texture = load(file, &map.named_at)?;
    Ok(as_normals(texture, map.strength, map.may_be_heights))
}

/// Converts an image to a normal map. Slopes are multiplied by `strength`.
pub(super) fn as_normals(mut texture: Texture, strength: f64, may_be_heights: bool) -> Texture {
    let texels = texture.texels.encoded_as(Encoding::Linear);
    let strength = strength as f32;
    texture.texels = if may_be_heights && texels.are_grey() {
        normals_of_heights(&texels, texture.size_px, strength)
    } else if strength == 1.0 {
        texels
    } else {
        let stronger = texels.reflectances().map(|[x, y, z]| {
            let [x, y] = [x, y].map(|value| strength * (2.0 * value - 1.0));
            as_texel(Vec3::new(x, y, (2.0 * z - 1.0).max(0.0)))
        });
        Texels::F32(stronger.collect())
    };
    texture
}

/// Normals from the differences of the texels on either side; the map repeats.
fn normals_of_heights(texels: &Texels, size_px: [u32; 2], strength: f32) -> Texels {
    let [width, height] = size_px.map(|size| size as usize);
    let heights: Vec<f32> = texels.reflectances().map(|[height, ..]| height).collect();
    let at = |column: usize, row: usize| heights[row % height * width + column % width];
    let normal = |column: usize, row: usize| {
        let along_u = 0.5 * (at(column + 1, row) - at(column + width - 1, row));
        // v grows upwards.
        let along_v = 0.5 * (at(column, row + height - 1) - at(column, row + 1));
        as_texel(Vec3::new(-strength * along_u, -strength * along_v, 1.0))
    };
    let places = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    Texels::F32(places.map(|(column, row)| normal(column, row)).collect())
}

/// Encodes a direction as a texel of a normal map.
fn as_texel(direction: Vec3) -> [f32; 3] {
    (0.5 * direction.normalize_or(Vec3::Z) + 0.5).to_array()
}

fn load_image(file: &Path, named_at: &str) -> Result<DynamicImage> {
    let unreadable = |problem: String| {
        Error::scene(
            named_at,
            format!("cannot read the texture {}: {problem}", file.display()),
            "give the path of a PNG, JPEG or WebP file, relative to the file that names it",
        )
    };
    let bytes = input_file::read(file).map_err(|error| unreadable(error.to_string()))?;
    decode(&bytes).map_err(unreadable)
}

/// Decodes a PNG, JPEG or WebP file, told apart by its content. Memory is allocated only for pixels that the file can hold.
pub(super) fn decode(file: &[u8]) -> std::result::Result<DynamicImage, String> {
    let text = |error: ImageError| error.to_string();
    let reader = ImageReader::new(Cursor::new(file)).with_guessed_format();
    let reader = reader.map_err(|error| error.to_string())?;
    if !matches!(
        reader.format(),
        Some(ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP)
    ) {
        return Err(match other_kind(file) {
            Some(kind) => format!("it is {kind}, which camlux does not read"),
            None if file.is_empty() => "it is empty".into(),
            None => "it is none of PNG, JPEG and WebP".into(),
        });
    }
    let decoder = reader.into_decoder().map_err(text)?;
    let (width, height) = decoder.dimensions();
    if u64::from(width) * u64::from(height) > most_pixels(file) {
        return Err(format!(
            "its header claims {width} x {height} pixels, which {} bytes cannot hold",
            file.len()
        ));
    }
    Limits::default()
        .reserve(decoder.total_bytes())
        .map_err(text)?;
    DynamicImage::from_decoder(decoder).map_err(text)
}

/// The kind of an image file that camlux does not read.
fn other_kind(file: &[u8]) -> Option<&'static str> {
    const BEGINNINGS: [(&[u8], &str); 14] = [
        (b"II*\0", "TIFF"),
        (b"MM\0*", "TIFF"),
        (b"BM", "BMP"),
        (b"GIF8", "GIF"),
        (b"DDS ", "DDS"),
        (b"\xabKTX 20", "KTX2"),
        (b"\xabKTX 11", "KTX"),
        (b"\x76\x2f\x31\x01", "OpenEXR"),
        (b"#?", "Radiance HDR"),
        (b"8BPS", "a Photoshop file"),
        (b"\xff\x0a", "JPEG XL"),
        (b"\0\0\0\x0cJXL ", "JPEG XL"),
        (b"\0\0\0\x0cjP  ", "JPEG 2000"),
        (b"sB", "Basis Universal"),
    ];
    // TGA begins with its kinds of map and of image, and may end with its name.
    let is_tga = file.ends_with(b"TRUEVISION-XFILE.\0")
        || matches!(
            file,
            [_, 0, 2 | 3 | 10 | 11, 0, 0, 0, 0, ..] | [_, 1, 1 | 9, 0, 0, ..]
        );
    let is_heif = file.get(4..8) == Some(b"ftyp");
    let known = BEGINNINGS
        .iter()
        .find(|(beginning, _)| file.starts_with(beginning));
    match known {
        Some((_, kind)) => Some(kind),
        None if is_heif => Some("AVIF or HEIF"),
        None if is_tga => Some("TGA"),
        None => None,
    }
}

/// The maximum number of pixels of an image file with this content.
fn most_pixels(file: &[u8]) -> u64 {
    const PNG_BEGINNING: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";
    let file_bits = 8 * file.len() as u64;
    match file.strip_prefix(PNG_BEGINNING) {
        // Width and height, bits per sample, kind of pixel. Deflate expands one byte to at most 1032 bytes.
        Some([_, _, _, _, _, _, _, _, sample_bits, kind, ..]) => {
            let samples = match kind {
                2 => 3,
                4 => 2,
                6 => 4,
                _ => 1,
            };
            file_bits * 1032 / (samples * u64::from(*sample_bits)).max(1)
        }
        // WebP: one colour everywhere takes hardly any bits. As many as for PNG, and some more.
        None if file.starts_with(b"RIFF") => (1 << 16) + file_bits * 1032,
        // JPEG: a block of 8 x 8 pixels takes at least one bit.
        _ => file_bits * 64,
    }
}
