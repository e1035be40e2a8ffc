//! Plain OpenEXR files: one for each layer, with the channels that every program reads.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{ExrOptions, Frame, Layer, OutputFile, WrittenExr};
use crate::error::Result;
use crate::exr_decode::ImageLayer;

/// The attribute that names the layer of a plain file, or of a part, after the prefix `camlux.`.
pub(super) const LAYER: &str = "layer";

/// The plain file of a layer: `x.depth.exr` for `x.exr`.
pub fn plain_path(path: &Path, layer: Layer) -> PathBuf {
    let extension = path.extension().unwrap_or("exr".as_ref()).display();
    path.with_extension(format!("{}.{extension}", layer.name()))
}

/// Writes the frame as an OpenEXR file, or each of its layers as a [plain](ExrOptions::plain) one beside that path. Several files are
/// hashed one after the other, in the order of [`Layer::all`].
///
/// # Errors
/// The same as [`write_exr`](super::write_exr), and for a plain file with an id above 2^24, which no float holds.
pub fn write_exr_files(path: &Path, frame: &Frame, options: &ExrOptions) -> Result<WrittenExr> {
    let mut written = WrittenExr::default();
    let mut hasher = blake3::Hasher::new();
    if !options.plain {
        let output = OutputFile::create(path)?;
        written.add(output, frame, options, &mut hasher)?;
    } else {
        let output = OutputFile::create(path)?;
        options.require_layers(&output, frame)?;
        let has = |layer: &Layer| frame.layers.iter().any(|(kind, _)| kind == layer);
        for layer in Layer::all().filter(|layer| has(layer) && options.picks(*layer)) {
            let mut of_layer = options.clone();
            of_layer.layers = Some(vec![layer]);
            of_layer
                .attributes
                .push((LAYER.into(), layer.name().into()));
            let output = OutputFile::create(plain_path(path, layer))?;
            written.add(output, frame, &of_layer, &mut hasher)?;
        }
    }
    written.blake3 = hasher.finalize().to_hex().to_string();
    written.bytes = hasher.count();
    Ok(written)
}

/// Gives the layer of a plain file, and those of parts, their own names and channels again.
pub(super) fn restore(layers: &mut [ImageLayer], attributes: &BTreeMap<String, String>) {
    if let [only] = layers {
        restore_only(only, attributes);
    }
    for layer in layers {
        // The part of a whole number has the channel Y, which the layer has not.
        let kind = Layer::from_name(&layer.name).filter(|kind| kind.is_id());
        if let (Some(kind), [channel]) = (kind, &mut layer.channel_names[..])
            && *channel == format!("{}.Y", kind.name())
        {
            *channel = kind.name().into();
        }
    }
}

fn restore_only(only: &mut ImageLayer, attributes: &BTreeMap<String, String>) {
    let named = attributes.get(&format!("camlux.{LAYER}"));
    let Some(layer) = named.and_then(|name| Layer::from_name(name)) else {
        return;
    };
    let ways = [layer.part_channel_names(), layer.plain_channel_names()];
    let way = ways.iter().find(|way| only.channel_names == **way);
    let (true, Some(stored)) = (only.name.is_empty(), way) else {
        return;
    };
    let names = layer.channel_names();
    if names.len() < stored.len() {
        let pixels = only.values.chunks_exact(stored.len());
        let own = pixels.flat_map(|pixel| pixel.iter().take(names.len()).copied());
        only.values = own.collect();
    }
    only.name = layer.name().into();
    only.channel_names = names.iter().map(|&name| name.into()).collect();
}
