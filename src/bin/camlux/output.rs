//! Writing of results: names, layers, folders and PNG files.

use std::path::{Path, PathBuf};

use camlux::Scene;
use camlux::output::{Layer, TofQuantity};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use crate::Failure;

/// Rejects `-` and any image name whose extension does not match the format that is written: images go to files.
pub fn require_extension(option: &str, path: &Path, extension: &str) -> Result<(), Failure> {
    let own = path.extension().unwrap_or_default();
    if own.eq_ignore_ascii_case(extension) {
        return Ok(());
    }
    let path = path.display();
    Err(format!("{option} {path}: an image is written there; end the name in .{extension}").into())
}

pub fn create_folder(path: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(path).map_err(|error| {
        let path = path.display();
        format!("{path}: cannot create the folder: {error}; name another one").into()
    })
}

/// The canonical path of a file, also if the file does not exist yet.
pub fn file_behind(path: &Path) -> PathBuf {
    let by_folder = || {
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    let canonical = path.canonicalize().ok().or_else(by_folder);
    canonical.unwrap_or_else(|| path.to_owned())
}

/// What to read from the device for these layers of a scene: also what warnings about them look at. Layers that the scene does not have
/// are left out.
pub fn with_warnings(layers: &[Layer], scene: &Scene) -> Vec<Layer> {
    let phases = scene.tof.as_ref().map_or(0, |tof| tof.phase_count);
    let mut read = layers.to_vec();
    for &layer in layers {
        let taps = |phase| match layer {
            Layer::Tof(frequency, _) => Some(Layer::Tof(frequency, TofQuantity::Taps(phase))),
            _ => None,
        };
        read.extend((0..phases as u8).filter_map(taps));
    }
    read.extend([
        Layer::Radiance,
        Layer::Indirect,
        Layer::Emission,
        Layer::InstanceId,
    ]);
    read.retain(|layer| layer.is_made_for(scene));
    read
}

/// A PNG file of 8-bit RGB, row by row from the top.
///
/// # Errors
/// If it cannot be encoded.
pub fn png(size_px: [usize; 2], rgb: &[u8]) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive);
    let [width, height] = size_px.map(|px| px as u32);
    encoder.write_image(rgb, width, height, ExtendedColorType::Rgb8)?;
    Ok(bytes)
}
