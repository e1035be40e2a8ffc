//! Selects the layers to compare.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::Path;

use camlux::metrics::{Comparison, Pixels, ZScores};
use camlux::output::{ImageLayer, Layer, LayerNeed, LayeredImage, TofQuantity};
use camlux::scene::{IndirectLight, MAX_FREQUENCIES};

use super::Args;
use crate::Failure;
use crate::range_error::{RangeErrors, range_errors_m, range_noise_m};

/// The layers that are compared by default. For time of flight, Z of each frequency is added.
const USUAL: [Layer; 3] = [Layer::Indirect, Layer::Direct, Layer::Radiance];

fn usual() -> impl Iterator<Item = Layer> {
    let phasors = (0..MAX_FREQUENCIES as u8).flat_map(|frequency| {
        let quantities = [TofQuantity::PhasorIndirect, TofQuantity::Phasor];
        quantities.map(|quantity| Layer::Tof(frequency, quantity))
    });
    USUAL.into_iter().chain(phasors)
}

/// One layer of both images, with the same channels.
pub struct LayerPair<'images> {
    /// The unit from the headers of the images, else the unit that camlux writes; `""` if neither is known.
    pub unit: &'images str,
    image: Cow<'images, ImageLayer>,
    reference: Cow<'images, ImageLayer>,
    image_standard_error: Option<&'images [f32]>,
    /// Whether `image_standard_error` is a render's estimate of its own error. If so, it is judged and not subtracted as noise.
    is_judged: bool,
    /// Modulation frequency, if the layer is Z of all light.
    frequency_hz: Option<f64>,
    reference_standard_error: Option<&'images [f32]>,
}

impl LayerPair<'_> {
    /// The name of the layer; `NAME=NAME` if the images call it differently.
    pub fn name(&self) -> Cow<'_, str> {
        if self.image.name == self.reference.name {
            Cow::Borrowed(&self.image.name)
        } else {
            Cow::Owned(format!("{}={}", self.image.name, self.reference.name))
        }
    }

    pub fn pixels<'a>(&'a self, valid: &'a [bool], edges: Option<&'a [bool]>) -> Pixels<'a> {
        Pixels {
            image: &self.image.values,
            reference: &self.reference.values,
            image_standard_error: self.image_standard_error.filter(|_| !self.is_judged),
            reference_standard_error: self.reference_standard_error,
            valid,
            edges,
            channels: self.image.channel_names.len(),
        }
    }

    /// Range error from the phasors, without unwrapping, metres: median and 99th percentile over the pixels that have a range in both
    /// images. `None` for other layers.
    pub fn range_errors_m(&self, valid: &[bool], edges: Option<&[bool]>) -> Option<RangeErrors> {
        range_errors_m(
            &self.image.values,
            &self.reference.values,
            self.frequency_hz?,
            counts(valid, edges),
        )
    }

    /// [`Self::range_errors_m`] of an image without error, caused by the noise of the reference alone.
    pub fn range_noise_m(&self, valid: &[bool], edges: Option<&[bool]>) -> Option<RangeErrors> {
        range_noise_m(
            &self.reference.values,
            self.reference_standard_error?,
            self.frequency_hz?,
            counts(valid, edges),
        )
    }

    /// The z-scores of a render's estimate of its own error; `None` if it states none, or if there is nothing to judge.
    pub fn judge(
        &self,
        valid: &[bool],
        edges: Option<&[bool]>,
    ) -> Result<Option<ZScores>, Failure> {
        let Some(stated) = self.image_standard_error.filter(|_| self.is_judged) else {
            return Ok(None);
        };
        let comparison = Comparison::new(&Pixels {
            image_standard_error: Some(stated),
            ..self.pixels(valid, edges)
        })?;
        Ok(comparison.z_scores)
    }
}

fn counts<'a>(valid: &'a [bool], edges: Option<&'a [bool]>) -> impl Fn(usize) -> bool + 'a {
    move |pixel| valid[pixel] && edges.is_none_or(|edges| !edges[pixel])
}

/// The names of one layer in the image and in the reference.
type Names<'a> = [&'a str; 2];

/// Finds the layers in both images.
pub fn select<'images>(
    args: &Args,
    image: &'images LayeredImage,
    reference: &'images LayeredImage,
) -> Result<Vec<LayerPair<'images>>, Failure> {
    let of_both = |name: &str| [image, reference].iter().all(|i| find(i, name).is_some());
    let named = args.layers.iter().map(|argument| {
        // A layer of both images may have the sign in its name.
        let split = argument.split_once('=').filter(|_| !of_both(argument));
        split.map_or([argument.as_str(); 2], |(a, b)| [a, b])
    });
    let mut names: Vec<Names> = named.collect();
    let mut seen = BTreeSet::new();
    names.retain(|name| seen.insert(*name));
    if names.is_empty() {
        let usual = usual().map(|layer| layer.name());
        names.extend(usual.filter(|name| of_both(name)).map(|name| [name; 2]));
    }
    if names.is_empty() {
        return Err(format!(
            "the images have none of the layers {} in common: {}; {}; {}",
            USUAL.map(Layer::name).join(", "),
            list(&args.image, image),
            list(&args.reference, reference),
            example(image, reference)
        )
        .into());
    }
    let pairs = names.into_iter();
    pairs
        .map(|names| pair(names, args, image, reference))
        .collect()
}

/// How to name layers, by those of the images that could be meant: the first with three channels.
fn example(image: &LayeredImage, reference: &LayeredImage) -> String {
    let likely = |image: &LayeredImage, name: Option<&str>| {
        let layers = image.layers().iter();
        let known = name.and_then(|name| find(image, name));
        let light = [Layer::Radiance, Layer::Direct, Layer::Indirect];
        let known = known.or_else(|| light.iter().find_map(|layer| find(image, layer.name())));
        let has_bands = |layer: &&ImageLayer| {
            let of_band = |band: &str| {
                let is_band = |name: &String| name.rsplit('.').next() == Some(band);
                layer.channel_names.iter().any(is_band)
            };
            ["R", "G", "B"].into_iter().all(of_band)
        };
        let first = layers
            .clone()
            .find(has_bands)
            .or_else(|| layers.clone().next());
        let name = known.map(|layer| layer.name.clone());
        name.or_else(|| first.map(|layer| layer.name.clone()))
            .unwrap_or_default()
    };
    let of_image = likely(image, None);
    let of_reference = likely(reference, Some(&of_image));
    if of_image == of_reference {
        return format!("name a layer of both with --layer {of_image}");
    }
    format!("name one of each, first that of the image: --layer \"{of_image}={of_reference}\"")
}

/// R, G and B of a layer that also has alpha, which is no light, if the other image has none.
fn without_alpha<'image>(
    layer: Cow<'image, ImageLayer>,
    other: &ImageLayer,
) -> Cow<'image, ImageLayer> {
    let is_alpha = |name: &String| last_part(name) == "A";
    let Some(alpha) = layer.channel_names.iter().position(is_alpha) else {
        return layer;
    };
    if [layer.channel_names.len(), other.channel_names.len()] != [4, 3] {
        return layer;
    }
    let count = layer.channel_names.len();
    let mut rest = layer.into_owned();
    rest.channel_names.remove(alpha);
    let values = rest.values.iter().enumerate();
    let values = values.filter(|(i, _)| i % count != alpha);
    rest.values = values.map(|(_, &value)| value).collect();
    Cow::Owned(rest)
}

/// The name of a channel in its layer.
fn last_part(channel: &str) -> &str {
    channel.rsplit('.').next().unwrap_or_default()
}

fn pair<'images>(
    [name, reference_name]: Names,
    args: &Args,
    image: &'images LayeredImage,
    reference: &'images LayeredImage,
) -> Result<LayerPair<'images>, Failure> {
    let found = |name: &str, path: &Path, image: &'images LayeredImage| {
        find(image, name).ok_or_else(|| {
            let which = match name {
                "" => "layer without a name",
                name => name,
            };
            format!("there is no layer {which}: {}", list(path, image))
        })
    };
    let of_image = found(name, &args.image, image)?;
    let of_reference = found(reference_name, &args.reference, reference)?;
    let of_image = without_alpha(of_image, &of_reference);
    let of_reference = without_alpha(of_reference, &of_image);
    let channels = |layer: &ImageLayer| -> Vec<String> {
        let names = layer.channel_names.iter();
        names.map(|name| last_part(name).to_owned()).collect()
    };
    if channels(&of_image) != channels(&of_reference) {
        return Err(format!(
            "layer {name} has the channels {} in {} and {} in {}; compare layers of the same channels",
            of_image.channel_names.join(", "),
            args.image.display(),
            of_reference.channel_names.join(", "),
            args.reference.display()
        )
        .into());
    }
    let layer = Layer::from_name(name);
    let reference_layer = Layer::from_name(reference_name);
    let written_unit =
        |image: &'images LayeredImage, name: &str| image.attribute(&format!("camlux.unit.{name}"));
    let unit = written_unit(image, name);
    let due_unit = written_unit(reference, reference_name);
    if let (Some(unit), Some(due_unit)) = (unit, due_unit)
        && unit != due_unit
    {
        return Err(format!(
            "layer {name} is in {unit} in {} and in {due_unit} in {}; compare layers of the same unit",
            args.image.display(),
            args.reference.display()
        )
        .into());
    }
    let standard_error = |image: &'images LayeredImage, layer: Option<Layer>| {
        layer?
            .standard_error()
            .and_then(|noise| image.values(noise))
    };
    let frequency_hz = match layer {
        Some(layer @ Layer::Tof(frequency, TofQuantity::Phasor))
            if of_image.channel_names == layer.channel_names() =>
        {
            let name = format!("camlux.tof{frequency}.frequency_hz");
            image.attribute(&name).and_then(|hz| hz.parse().ok())
        }
        _ => None,
    };
    Ok(LayerPair {
        unit: unit
            .or(due_unit)
            .or(layer.or(reference_layer).map(Layer::unit))
            .unwrap_or_default(),
        image: of_image,
        reference: of_reference,
        image_standard_error: standard_error(image, layer),
        frequency_hz,
        is_judged: image
            .attribute("camlux.estimator")
            .is_some_and(|name| IndirectLight::NAMES.contains(&name)),
        reference_standard_error: standard_error(reference, reference_layer),
    })
}

/// The layer of that name. Total radiance may also be the sum of its parts.
fn find<'image>(image: &'image LayeredImage, name: &str) -> Option<Cow<'image, ImageLayer>> {
    if let Some(layer) = image.layer(name) {
        return Some(Cow::Borrowed(layer));
    }
    if name != Layer::Radiance.name() {
        return None;
    }
    let channel_names = Layer::Radiance.channel_names().iter();
    Some(Cow::Owned(ImageLayer {
        name: name.to_owned(),
        channel_names: channel_names.map(|name| name.to_string()).collect(),
        values: image.total_radiance()?,
    }))
}

fn list(path: &Path, image: &LayeredImage) -> String {
    let layers = image
        .layers()
        .iter()
        .map(|layer| match layer.name.as_str() {
            "" => format!("\"\" ({})", layer.channel_names.join(", ")),
            name => name.to_owned(),
        });
    let layers: Vec<String> = layers.collect();
    format!("{} has {}", path.display(), layers.join(", "))
}

/// The names of the camera and light attributes that both images have with different values. The scene's hash does not help, because it
/// includes the estimator.
pub fn differing_scenes(image: &LayeredImage, reference: &LayeredImage) -> Option<String> {
    let is_of_scene = |name: &str| {
        let prefixes = ["camlux.camera.", "camlux.light."];
        prefixes.iter().any(|prefix| name.starts_with(prefix))
    };
    let [a, b] = [image, reference].map(|image| {
        let attributes = image.attributes().filter(|(name, _)| is_of_scene(name));
        attributes.collect::<BTreeSet<_>>()
    });
    if a.is_empty() || b.is_empty() || a == b {
        return None;
    }
    let names: BTreeSet<&str> = a.symmetric_difference(&b).map(|(name, _)| *name).collect();
    Some(Vec::from_iter(names).join(", "))
}

/// The bounces of the indirect light of both images, if their numbers differ.
pub fn differing_bounces(
    args: &Args,
    image: &LayeredImage,
    reference: &LayeredImage,
) -> Option<[u32; 2]> {
    // The light of one bounce alone is the same, however many there are.
    let is_alone = |name: &String| {
        let layer = Layer::from_name(name);
        layer.is_some_and(|layer| layer.need() == LayerNeed::MoreBounces)
    };
    if !args.layers.is_empty() && args.layers.iter().all(is_alone) {
        return None;
    }
    let bounces = |image: &LayeredImage| {
        let estimator = image.attribute("camlux.estimator")?;
        let number = image.attribute("camlux.bounces");
        // Only an estimator of more bounces than one gives their number.
        let number = number.map_or(Some(1), |number| number.parse().ok());
        number.filter(|_| estimator != "none")
    };
    let both = [bounces(image)?, bounces(reference)?];
    (both[0] != both[1]).then_some(both)
}
