//! A reference image of the Cornell box by a renderer that shares no code with this one. `tests/data/README.md` says how it was made.

use std::path::Path;

use camlux::{
    output::{Layer, LayeredImage},
    scene::Bands,
};

/// 200 x 200 pixels, row by row from the top, W/sr/m².
pub struct Truth {
    pub direct: Vec<Bands>,
    pub indirect: Vec<Bands>,
    /// Of `indirect`.
    pub standard_error: Vec<Bands>,
}

impl Truth {
    pub fn read() -> Truth {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/cornell_200.exr");
        let image = LayeredImage::read(path).expect("the image is readable");
        let layer = |layer: Layer| {
            let values = image.values(layer).expect("it is there").as_chunks().0;
            values
                .iter()
                .map(|pixel: &[f32; 3]| pixel.map(f64::from))
                .collect()
        };
        Truth {
            direct: layer(Layer::Direct),
            indirect: layer(Layer::Indirect),
            standard_error: layer(Layer::StandardError),
        }
    }
}
