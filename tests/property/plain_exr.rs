//! Plain OpenEXR files: one for each layer, with the channels that every program reads.

use crate::common::rows::assert_says;
use camlux::output::{
    ExrOptions, Frame, Layer, LayerData, LayeredImage, OutputFile, plain_path, write_exr,
    write_exr_files,
};
use exr::prelude::read_all_flat_layers_from_file;

use crate::output;

/// A frame whose ids a float holds.
fn frame() -> Frame {
    let mut frame = output::frame();
    for (_, data) in &mut frame.layers {
        if let LayerData::Id(ids) = data {
            ids.iter_mut().for_each(|id| *id %= 1 << 24);
        }
    }
    frame
}

fn plain() -> ExrOptions {
    ExrOptions {
        plain: true,
        ..ExrOptions::default()
    }
}

#[test]
fn every_layer_has_a_file_with_r_g_b_or_y_and_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let frame = frame();
    let written = write_exr_files(&path, &frame, &plain()).unwrap();
    assert!(!path.exists());
    let paths: Vec<_> = Layer::all().map(|l| plain_path(&path, l)).collect();
    assert_eq!(written.files, paths);
    assert_eq!(
        plain_path(&path, Layer::Depth),
        folder.path().join("a.depth.exr")
    );
    let mut hasher = blake3::Hasher::new();
    for (layer, data) in &frame.layers {
        let path = plain_path(&path, *layer);
        hasher.update(&std::fs::read(&path).unwrap());
        let file = read_all_flat_layers_from_file(&path).unwrap();
        let channels = file.layer_data[0].channel_data.list.iter();
        let mut names: Vec<String> = channels.map(|c| c.name.to_string()).collect();
        names.sort();
        let mut expected = layer.plain_channel_names().to_vec();
        expected.sort_unstable();
        assert_eq!(names, expected, "{layer:?}");
        let image = LayeredImage::read(&path).unwrap();
        assert_eq!(image.layers().len(), 1);
        let values: Vec<f32> = match data {
            LayerData::Float(values) => values.clone(),
            LayerData::Id(ids) => ids.iter().map(|&id| id as f32).collect(),
        };
        assert_eq!(image.values(*layer), Some(&values[..]), "{layer:?}");
    }
    assert_eq!(written.blake3, hasher.finalize().to_hex().as_str());
    assert_eq!(written.bytes, hasher.count());
}

#[test]
fn only_the_picked_layers_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut options = plain();
    options.layers = Some(vec![Layer::Depth, Layer::Radiance]);
    options.half = true;
    write_exr_files(&folder.path().join("b.exr"), &frame(), &options).unwrap();
    let mut names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(names.len(), 2);
    names.retain(|name| name.as_ref().unwrap().file_name() == "b.depth.exr");
    assert_eq!(names.len(), 1);
}

#[test]
fn an_id_that_no_float_holds_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.exr");
    let mut frame = frame();
    for (layer, data) in &mut frame.layers {
        if let (Layer::InstanceId, LayerData::Id(ids)) = (layer, data) {
            ids[3] = (1 << 24) + 1;
        }
    }
    let error = write_exr_files(&path, &frame, &plain())
        .unwrap_err()
        .to_string();
    assert_says(&error, &["c.id.instance.exr", "16777217"]);
    write_exr_files(&path, &frame, &ExrOptions::default()).unwrap();
}

#[test]
fn one_plain_file_does_not_take_several_layers() {
    let folder = tempfile::tempdir().unwrap();
    let output = OutputFile::create(folder.path().join("d.exr")).unwrap();
    let error = write_exr(output, &frame(), &plain())
        .unwrap_err()
        .to_string();
    assert!(error.contains("a plain file holds one layer"), "{error}");
}
