#![no_main]
//! An OpenEXR file, read and compared with itself as `camlux compare` does.

use camlux::metrics::{Comparison, Pixels};
use camlux::output::LayeredImage;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let read = camlux_fuzz::with_file("image.exr", bytes, |file| LayeredImage::read(file));
    let image = match read {
        Ok(image) => image,
        Err(error) => return camlux_fuzz::check_message(&error),
    };
    let valid = image.surface_pixels();
    let edges = image.edge_pixels();
    for layer in image.layers() {
        let pixels = Pixels {
            image: &layer.values,
            reference: &layer.values,
            image_standard_error: None,
            reference_standard_error: None,
            valid: &valid,
            edges: edges.as_deref(),
            channels: layer.channel_names.len(),
        };
        Comparison::of(&pixels).expect("every layer has all pixels");
    }
    image.total_radiance();
});
