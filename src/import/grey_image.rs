//! Grey images: of projectors, maps of all directions, and vignetting.

use std::path::Path;

use super::texture;
use super::unused::Unused;
use crate::exr_decode::{ImageLayer, Refusal, decode_file};
use crate::scene::{Encoding, Lens, ProjectedImage, VignettingMap};
use crate::{Error, Result};

/// What to do about colours where light has them.
pub(super) const BANDS_OF_LIGHT: &str =
    "save it as a grey image and set the bands with power_w, or use one light for each band";

/// A grey image with values from 0 to 1, row by row from the top.
pub(super) struct GreyImage {
    pub size_px: [u32; 2],
    pub values: Vec<f32>,
    pub unused: Unused,
}

impl GreyImage {
    /// Reads a PNG, JPEG or OpenEXR file. The values of an OpenEXR file are linear and are divided by `white`, or by the largest of them.
    /// `if_coloured`: what to do about an image with colours.
    ///
    /// # Errors
    /// Returns an error at `named_at` in the same cases as for textures, and if the image has colours.
    pub fn load(
        file: &Path,
        encoding: Encoding,
        white: Option<f32>,
        named_at: &str,
        if_coloured: &'static str,
    ) -> Result<GreyImage> {
        let extension = file.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("exr") {
            return GreyImage::load_exr(file, white, if_coloured).map_err(|(problem, hint)| {
                let problem = format!("cannot read the image {}: {problem}", file.display());
                Error::scene(named_at, problem, hint)
            });
        }
        if white.is_some() {
            let problem = format!("white is given, but {} is no OpenEXR image", file.display());
            return Err(Error::scene(named_at, problem, "leave it out"));
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
                if_coloured,
            )
        })?;
        Ok(GreyImage {
            size_px: image.size_px,
            values,
            unused: Unused::default(),
        })
    }

    fn load_exr(
        file: &Path,
        white: Option<f32>,
        if_coloured: &'static str,
    ) -> std::result::Result<GreyImage, Refusal> {
        let image = decode_file(file, &|_| None)?;
        let chosen = picture(&image.layers)?;
        let mut unused = Unused::default();
        let others = image
            .layers
            .iter()
            .filter(|layer| layer.name != chosen.name);
        for layer in others {
            unused.add(&match layer.name.as_str() {
                "" => format!("the channels {}", layer.channel_names.join(", ")),
                name => format!("the layer {name}"),
            });
        }
        let names = || chosen.channel_names.iter().map(|name| last_part(name));
        // Alpha carries no light.
        let mut bands: Vec<bool> = names().map(|name| BANDS.contains(&name)).collect();
        if !bands.contains(&true) {
            bands = names().map(|name| name != "A").collect();
        }
        for (name, _) in names().zip(&bands).filter(|(_, is_band)| !**is_band) {
            unused.add(&format!("the channel {name}"));
        }
        let pixels = chosen.values.chunks(chosen.channel_names.len());
        let grey = pixels.map(|pixel| {
            let mut of_bands = pixel.iter().zip(&bands).filter(|(_, is_band)| **is_band);
            let (&first, _) = of_bands.next()?;
            of_bands.all(|(&value, _)| value == first).then_some(first)
        });
        let grey: Option<Vec<f32>> = grey.collect();
        let grey = grey.ok_or_else(|| ("it is not grey".into(), if_coloured))?;
        let is_light = |&value: &f32| value >= 0.0 && value.is_finite();
        if let Some(value) = grey.iter().find(|value| !is_light(value)) {
            return Err((
                format!("a pixel is {value}"),
                "save finite values of 0 or more",
            ));
        }
        let most = || grey.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let white = white.unwrap_or_else(most);
        Ok(GreyImage {
            size_px: image.size_px,
            values: grey.into_iter().map(|value| value / white).collect(),
            unused,
        })
    }
}

impl VignettingMap {
    /// Reads a grey PNG, JPEG, WebP or OpenEXR file. Values are linear: those of an OpenEXR file are the light over that on the axis; in the other
    /// files the largest number, such as 65535, stands for 1. `named_at` is the line of the scene file that names it, or the file itself. Also
    /// returns a warning of what the file holds and camlux does not use.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) if the file is missing or is no grey image.
    pub fn load(path: &Path, named_at: &str) -> Result<(VignettingMap, Option<String>)> {
        let extension = path.extension().unwrap_or_default();
        let white = extension.eq_ignore_ascii_case("exr").then_some(1.0);
        let if_coloured = "save one grey channel: all bands have the same vignetting";
        let image = GreyImage::load(path, Encoding::Linear, white, named_at, if_coloured)?;
        let warning = image.unused.warning(path);
        let map = VignettingMap {
            size_px: image.size_px,
            values: image.values,
        };
        Ok((map, warning))
    }
}

impl ProjectedImage {
    /// Reads a grey PNG, JPEG, WebP or OpenEXR file for a projector with this lens. `white`: the value of an OpenEXR file that stands for 1;
    /// `None`: the largest. `named_at` is the line of the scene file that names it, or
    /// the file itself. Also returns a warning of what the file holds and camlux does not use.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) if the file is missing or is no grey image.
    pub fn load(
        path: &Path,
        encoding: Encoding,
        white: Option<f32>,
        lens: Lens,
        named_at: &str,
    ) -> Result<(ProjectedImage, Option<String>)> {
        if !matches!(
            lens,
            Lens::FovX { .. } | Lens::FovY { .. } | Lens::Intrinsics(_)
        ) {
            let hint = "give a field of view, or intrinsics without a distortion";
            return Err(Error::scene(named_at, "a projector has no such lens", hint));
        }
        let image = GreyImage::load(path, encoding, white, named_at, BANDS_OF_LIGHT)?;
        let warning = image.unused.warning(path);
        let projected = ProjectedImage {
            size_px: image.size_px,
            intrinsics: lens.intrinsics_px(image.size_px),
            values: image.values,
        };
        Ok((projected, warning))
    }
}

/// The channels of light.
const BANDS: [&str; 4] = ["R", "G", "B", "Y"];

fn last_part(channel: &str) -> &str {
    channel.rsplit('.').next().unwrap_or_default()
}

/// The layer without a name, or the only one with channels of light.
fn picture(layers: &[ImageLayer]) -> std::result::Result<&ImageLayer, Refusal> {
    if let Some(plain) = layers.iter().find(|layer| layer.name.is_empty()) {
        return Ok(plain);
    }
    let is_band = |name: &String| BANDS.contains(&last_part(name));
    let is_picture = |layer: &&ImageLayer| layer.channel_names.iter().any(is_band);
    let mut pictures = layers.iter().filter(is_picture);
    if let (Some(only), None) = (pictures.next(), pictures.next()) {
        return Ok(only);
    }
    let names: Vec<&str> = layers.iter().map(|layer| layer.name.as_str()).collect();
    let problem = format!(
        "it has the layers {}, and it is not clear which of them is the picture",
        names.join(", ")
    );
    Err((problem, "save it with one channel, Y, or with R, G and B"))
}
