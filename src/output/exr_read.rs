//! OpenEXR input: an image with named layers, for comparison with another image.

use std::collections::BTreeMap;
use std::path::Path;

use super::{Layer, plain};
use crate::error::{Error, Result};
pub use crate::exr_decode::ImageLayer;
use crate::exr_decode::{DecodedImage, decode_file};

/// An image read from an OpenEXR file: camlux's own or another program's.
#[derive(Debug, Clone, PartialEq)]
pub struct LayeredImage {
    resolution_px: [u32; 2],
    covered_px: [[u32; 2]; 2],
    layers: Vec<ImageLayer>,
    attributes: BTreeMap<String, String>,
}

impl LayeredImage {
    /// Reads a scan-line or tiled file with flat pixels, at its full resolution. It accepts every compression that the `exr` crate knows (all
    /// but HTJ2K). The memory used is bounded by the file's real contents, and by 64 MiB more where a data window is smaller than the display window.
    ///
    /// The image is the display window. Pixels outside of the data window are 0, see [`LayeredImage::data_pixels`]. In a file of several
    /// parts, the name of a channel begins with that of its part: channel `R` of the part `direct` is `direct.R`. [Plain](super::ExrOptions::plain)
    /// files and [parts](super::ExrOptions::multipart) of camlux have their layers.
    ///
    /// # Errors
    /// [`Error::Input`] when the file is missing or cannot be read, when it is not OpenEXR or is damaged, and for what camlux does not
    /// read: deep pixels and subsampled channels.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let own_layer = |channel: &str| {
            Layer::all().find_map(|layer| {
                let mut names = layer.channel_names().iter();
                Some((layer.name(), names.position(|name| *name == channel)?))
            })
        };
        let DecodedImage {
            size_px,
            covered_px,
            mut layers,
            attributes,
        } = decode_file(path, &own_layer)
            .map_err(|(problem, hint)| Error::input(path.display().to_string(), problem, hint))?;
        plain::restore(&mut layers, &attributes);
        Ok(LayeredImage {
            resolution_px: size_px,
            covered_px,
            layers,
            attributes,
        })
    }

    /// Width, height.
    pub fn resolution_px(&self) -> [u32; 2] {
        self.resolution_px
    }

    /// Every layer, in alphabetical order.
    pub fn layers(&self) -> &[ImageLayer] {
        &self.layers
    }

    /// The layer of that name.
    pub fn layer(&self, name: &str) -> Option<&ImageLayer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// The pixels of a camlux layer; `None` if the image lacks it, or has other channels under its name.
    pub fn values(&self, layer: Layer) -> Option<&[f32]> {
        let found = self.layer(layer.name())?;
        (found.channel_names == layer.channel_names()).then_some(&found.values)
    }

    /// L*_{P→C}, W/sr/m², channels R, G, B: the layer `radiance`, otherwise `direct` + `indirect`; `None` without either.
    pub fn total_radiance(&self) -> Option<Vec<f32>> {
        if let Some(radiance) = self.values(Layer::Radiance) {
            return Some(radiance.to_vec());
        }
        let direct = self.values(Layer::Direct)?;
        let indirect = self.values(Layer::Indirect)?;
        Some(direct.iter().zip(indirect).map(|(d, i)| d + i).collect())
    }

    /// Which pixels the file holds, row by row from the top: those in the data windows of all its parts.
    pub fn data_pixels(&self) -> Vec<bool> {
        let [width, height] = self.resolution_px;
        let [[left, top], [right, bottom]] = self.covered_px;
        let has = |x, y| (left..right).contains(&x) && (top..bottom).contains(&y);
        let rows = (0..height).flat_map(|y| (0..width).map(move |x| has(x, y)));
        rows.collect()
    }

    /// Which pixels show a surface, row by row from the top. The first of these layers in the file decides: `valid.A` over 0.5,
    /// `id.instance` over 0, finite `depth`. Without any of them, all pixels count that the file holds.
    pub fn surface_pixels(&self) -> Vec<bool> {
        let mut pixels = self.pixels_by_layers();
        for (counts, has_data) in pixels.iter_mut().zip(self.data_pixels()) {
            *counts &= has_data;
        }
        pixels
    }

    fn pixels_by_layers(&self) -> Vec<bool> {
        let single = |name: &str| {
            self.layer(name)
                .filter(|layer| layer.channel_names.len() == 1)
        };
        let where_true = |layer: &ImageLayer, test: &dyn Fn(f32) -> bool| {
            layer.values.iter().map(|&value| test(value)).collect()
        };
        if let Some(valid) = single("valid") {
            return where_true(valid, &|value| value > 0.5);
        }
        if let Some(id) = single(Layer::InstanceId.name()) {
            return where_true(id, &|value| value > 0.0);
        }
        if let Some(depth) = single(Layer::Depth.name()) {
            return where_true(depth, &f32::is_finite);
        }
        vec![true; self.resolution_px.map(|px| px as usize).iter().product()]
    }

    /// Pixels where rounding decides which of two surfaces they show, row by row from the top: those with an `edge` over 0. `None` without
    /// that layer.
    pub fn edge_pixels(&self) -> Option<Vec<bool>> {
        let edge = self.values(Layer::Edge)?;
        Some(edge.iter().map(|&value| value > 0.0).collect())
    }

    /// A header attribute that is a text, a number or a list of f64, by its full name, such as `camlux.scene_hash`.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.get(name).map(String::as_str)
    }

    /// Name and value of every attribute that is a text, a number or a list of f64.
    pub fn attributes(&self) -> impl Iterator<Item = (&str, &str)> {
        self.attributes
            .iter()
            .map(|(name, value)| (name.as_str(), value.as_str()))
    }
}
