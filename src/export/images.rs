//! Textures and projected images as files, bit by bit.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, Vec2,
    WritableImage,
};
use image::{EncodableLayout, ImageBuffer, ImageFormat, PixelWithColorType, Primitive, Rgb};

use crate::scene::{Texels, Texture};

/// A texture as PNG of 8 or 16 bits, or as OpenEXR.
pub(super) fn of_texture(texture: &Texture) -> Result<Vec<u8>, String> {
    match &texture.texels {
        Texels::U8(texels, _) => png(texture.size_px, texels),
        Texels::U16(texels, _) => png(texture.size_px, texels),
        Texels::F32(texels) => {
            let band = |band: usize| texels.iter().map(|texel| texel[band]).collect();
            let channels = [("B", 2), ("G", 1), ("R", 0)];
            exr(texture.size_px, channels.map(|(n, b)| (n, band(b))))
        }
    }
}

/// A PNG file of these texels.
fn png<C>([width, height]: [u32; 2], texels: &[[C; 3]]) -> Result<Vec<u8>, String>
where
    C: Primitive,
    [C]: EncodableLayout,
    Rgb<C>: PixelWithColorType<Subpixel = C>,
{
    let texels = texels.as_flattened().to_vec();
    let image = ImageBuffer::<Rgb<C>, _>::from_raw(width, height, texels);
    let image = image.ok_or("a texture has fewer texels than its size")?;
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write_to(&mut bytes, ImageFormat::Png);
    written.map_err(|error| error.to_string())?;
    Ok(bytes.into_inner())
}

/// Grey values as OpenEXR.
pub(super) fn grey_exr(size_px: [u32; 2], values: &[f32]) -> Result<Vec<u8>, String> {
    exr(size_px, [("Y", values.to_vec())])
}

/// An OpenEXR file of these channels.
fn exr<const N: usize>(
    [width, height]: [u32; 2],
    channels: [(&str, Vec<f32>); N],
) -> Result<Vec<u8>, String> {
    let channels = channels.map(|(name, values)| AnyChannel::new(name, FlatSamples::F32(values)));
    let layer = Layer::new(
        Vec2(width as usize, height as usize),
        LayerAttributes::default(),
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut bytes = Cursor::new(Vec::new());
    let written = Image::from_layer(layer).write().to_buffered(&mut bytes);
    written.map_err(|error| error.to_string())?;
    Ok(bytes.into_inner())
}
