//! Path-traced images that share no code with the engine. `tests/data/README.md` says where they come from.

use std::path::Path;

use camlux::scene::Bands;
use exr::prelude::read_first_rgba_layer_from_file;

/// The pixels of an image of `tests/data`, row by row from the top.
pub fn read(name: &str) -> Vec<Bands> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name);
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| (size.width(), vec![[0.0; 3]; size.area()]),
        |(width, pixels), at, (r, g, b, _): (f32, f32, f32, f32)| {
            pixels[at.y() * *width + at.x()] = [r, g, b].map(f64::from);
        },
    );
    image
        .expect("the image is readable")
        .layer_data
        .channel_data
        .pixels
        .1
}
