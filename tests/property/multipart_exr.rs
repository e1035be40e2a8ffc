//! OpenEXR files with a part for each layer.

use crate::common::rows::assert_says;
use camlux::output::{ExrOptions, Layer, LayeredImage, OutputFile, write_exr, write_exr_files};
use exr::prelude::{FlatImage, read_all_flat_layers_from_file};

use crate::output::frame;

fn multipart() -> ExrOptions {
    ExrOptions {
        multipart: true,
        ..ExrOptions::default()
    }
}

/// Name and channels of each part.
fn parts(image: &FlatImage) -> Vec<(Option<String>, Vec<String>)> {
    let parts = image.layer_data.iter().map(|part| {
        let name = part.attributes.layer_name.as_ref();
        let channels = part.channel_data.list.iter();
        let channels = channels.map(|channel| channel.name.to_string());
        (name.map(ToString::to_string), channels.collect())
    });
    parts.collect()
}

/// The file holds each layer of a frame, also phasors and whole numbers, and says the same of the frame as one with a single part.
#[test]
fn every_layer_has_a_part_of_its_name_and_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let [path, single] = ["a.exr", "b.exr"].map(|name| folder.path().join(name));
    let frame = frame();
    let written = write_exr_files(&path, &frame, &multipart()).unwrap();
    assert_eq!(written.files, std::slice::from_ref(&path));
    write_exr_files(&single, &frame, &ExrOptions::default()).unwrap();
    let image = read_all_flat_layers_from_file(&path).unwrap();
    let expected = frame.layers.iter().map(|(layer, _)| {
        let mut channels = layer.part_channel_names().to_vec();
        channels.sort_unstable();
        let channels = channels.into_iter().map(String::from).collect();
        (Some(layer.name().to_owned()), channels)
    });
    assert_eq!(parts(&image), expected.collect::<Vec<_>>());
    for (name, channels) in [
        ("radiance", &["R", "G", "B"][..]),
        ("depth", &["Z"]),
        ("uv", &["U", "V"]),
        ("id.instance", &["Y"]),
        ("tof0.phasor", &["re", "im"]),
        ("tof1.phase3", &["A", "B"]),
    ] {
        let layer = Layer::from_name(name).unwrap();
        assert_eq!(layer.part_channel_names(), channels);
    }
    let [image, single] = [&path, &single].map(|path| LayeredImage::read(path).unwrap());
    assert_eq!(image.layers(), single.layers());
    assert_eq!(image.layers().len(), Layer::all().count());
    let own = |image: &LayeredImage| -> Vec<(String, String)> {
        let own = image
            .attributes()
            .filter(|(name, _)| name.starts_with("camlux."));
        own.map(|(name, value)| (name.into(), value.into()))
            .collect()
    };
    assert_eq!(own(&image), own(&single));
}

#[test]
fn a_single_part_keeps_its_layer() {
    let folder = tempfile::tempdir().unwrap();
    for layer in [
        Layer::Radiance,
        Layer::Depth,
        Layer::Texcoord,
        Layer::InstanceId,
    ] {
        let [path, usual] = ["a.exr", "b.exr"].map(|name| folder.path().join(name));
        let layers = Some(vec![layer]);
        let options = ExrOptions {
            layers: layers.clone(),
            half: true,
            ..multipart()
        };
        write_exr_files(&path, &frame(), &options).unwrap();
        let usual_options = ExrOptions {
            multipart: false,
            ..options
        };
        write_exr_files(&usual, &frame(), &usual_options).unwrap();
        let image = read_all_flat_layers_from_file(&path).unwrap();
        let mut channels = layer.part_channel_names().to_vec();
        channels.sort_unstable();
        assert_eq!(parts(&image)[0].1, channels);
        let [image, usual] = [path, usual].map(|path| LayeredImage::read(path).unwrap());
        assert_eq!(image.layers(), usual.layers());
    }
}

/// The `exr` crate keeps attributes in a map whose order differs each time.
#[test]
fn the_same_frame_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let write = || {
        write_exr_files(&path, &frame(), &multipart()).unwrap();
        std::fs::read(&path).unwrap()
    };
    let bytes = write();
    for _ in 0..3 {
        assert!(write() == bytes);
    }
}

#[test]
fn a_plain_file_has_one_part() {
    let folder = tempfile::tempdir().unwrap();
    let output = OutputFile::create(folder.path().join("d.exr")).unwrap();
    let options = ExrOptions {
        plain: true,
        ..multipart()
    };
    let error = write_exr(output, &frame(), &options)
        .unwrap_err()
        .to_string();
    assert_says(&error, &["a plain file has one part", "leave out"]);
}
