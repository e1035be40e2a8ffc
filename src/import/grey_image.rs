//! Grey images: of projectors, and maps of all directions.

use std::path::Path;

use super::texture;
use crate::exr_decode::{Refusal, decode_file};
use crate::scene::Encoding;
use crate::{Error, Result};

/// A grey image with values from 0 to 1, row by row from the top.
pub(super) struct GreyImage {
    pub size_px: [u32; 2],
    pub values: Vec<f32>,
}

impl GreyImage {
    /// Reads a PNG, JPEG or OpenEXR file. The values of an OpenEXR file are linear and are divided by the largest of them.
    ///
    /// # Errors
    /// Returns an error at `named_at` in the same cases as for textures, and if the image has colours.
    pub fn load(file: &Path, encoding: Encoding, named_at: &str) -> Result<GreyImage> {
        let extension = file.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("exr") {
            return GreyImage::load_exr(file).map_err(|(problem, hint)| {
                let problem = format!("cannot read the image {}: {problem}", file.display());
                Error::scene(named_at, problem, hint)
            });
        }
        let image = texture::load(file, named_at)?;
        let texels = image.texels.encoded_as(encoding);
        let values: Option<Vec<f32>> = texels
            .reflectances()
            .map(|[r, g, b]| (r == g && g == b).then_some(r))
            .collect();
        let values = values.ok_or_else(|| {
            Error::scene(
                named_at,
                format!("the image {} is not grey", file.display()),
                "save it as a grey PNG and set the bands with power_w, or use one light for each band",
            )
        })?;
        Ok(GreyImage {
            size_px: image.size_px,
            values,
        })
    }

    fn load_exr(file: &Path) -> std::result::Result<GreyImage, Refusal> {
        let image = decode_file(file, &|_| None)?;
        let plain = image.layers.into_iter().find(|layer| layer.name.is_empty());
        let plain = plain.ok_or_else(|| {
            let problem = "it has no channel without a layer's name".into();
            (problem, "save it with one channel, Y, or with R, G and B")
        })?;
        // Alpha carries no light.
        let is_band = |name: &String| name != "A";
        let bands = plain
            .channel_names
            .iter()
            .filter(|name| is_band(name))
            .count();
        let pixels = plain.values.chunks(plain.channel_names.len());
        let grey = pixels.map(|pixel| {
            let mut of_bands = plain.channel_names.iter().zip(pixel);
            let mut of_bands = of_bands.by_ref().filter(|(name, _)| is_band(name));
            let (_, &first) = of_bands.next()?;
            of_bands.all(|(_, &value)| value == first).then_some(first)
        });
        let grey: Option<Vec<f32>> = grey.collect();
        let grey = grey.filter(|_| bands > 0).ok_or_else(|| {
            let problem = "it is not grey".into();
            (
                problem,
                "save one channel and set the bands with power_w, or use one light for each band",
            )
        })?;
        let is_light = |&value: &f32| value >= 0.0 && value.is_finite();
        if let Some(value) = grey.iter().find(|value| !is_light(value)) {
            return Err((
                format!("a pixel is {value}"),
                "save finite values of 0 or more",
            ));
        }
        let most = grey.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        Ok(GreyImage {
            size_px: image.size_px,
            values: grey.into_iter().map(|value| value / most).collect(),
        })
    }
}
