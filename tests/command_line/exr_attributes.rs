//! Reads attributes from the header of an OpenEXR file with the exr library.

use exr::prelude::{AttributeValue, FlatImage, Text};

pub fn text_attribute(image: &FlatImage, name: &str) -> String {
    let attributes = &image.layer_data[0].attributes.other;
    match attributes.get(&Text::from(name)) {
        Some(AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{name}: {other:?}"),
    }
}
