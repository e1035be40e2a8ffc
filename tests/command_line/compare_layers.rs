//! `camlux compare` on layers of other names, units and data windows, and on phasors.

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, SmallVec,
    WritableImage,
};
use serde_json::Value;

use crate::compare::{assert_near, assert_succeeds, compare, json, pair, write};
use crate::program::assert_fails;

#[test]
fn any_layer_of_both_images_can_be_named() {
    let folder = pair();
    let layers = ["a.exr", "t.exr", "--layer", "direct", "--layer", "direct"];
    let report = json(folder.path(), &layers);
    assert_eq!(report["layers"].as_array().unwrap().len(), 1);
    let report = json(folder.path(), &["t.exr", "t.exr", "--layer", "valid"]);
    assert_eq!(report["layers"][0]["value_count"], 4);
    assert_eq!(report["layers"][0]["unit"], "");
}

/// Z of three pixels, two of them turned by 0.1 and 0.3 rad. At 100 MHz, c/(4πf) is 0.23857 m per radian.
#[test]
fn phasors_are_compared_with_the_range_that_they_tell() {
    let folder = tempfile::tempdir().unwrap();
    let of_angles = |angles: [f32; 3]| angles.map(|angle| [angle.cos(), angle.sin()]);
    let write_phasors = |name: &str, angles: [f32; 3]| {
        let phasors = of_angles(angles);
        let [re, im] = [0, 1].map(|part| phasors.map(|phasor| phasor[part]));
        let layers: &[(&str, &[f32])] = &[
            ("tof0.phasor.re", &re),
            ("tof0.phasor.im", &im),
            ("tof0.phasor_stderr.re", &[0.01; 3]),
            ("tof0.phasor_stderr.im", &[0.01; 3]),
            ("direct", &[1.0; 3]),
        ];
        let frequency = [("camlux.tof0.frequency_hz", "100000000")];
        write(&folder.path().join(name), (3, 1), layers, &frequency);
    };
    write_phasors("z.exr", [1.1, 2.0, -2.7]);
    write_phasors("z_truth.exr", [1.0, 2.0, -3.0]);
    let found = json(folder.path(), &["z.exr", "z_truth.exr"]);
    let layers = found["layers"].as_array().unwrap();
    let layer = layers.iter().find(|layer| layer["name"] == "tof0.phasor");
    let layer = layer.expect("it is compared unasked");
    let number = |value: &Value| value.as_f64().unwrap();
    let range = &layer["range_error"];
    assert!(
        (number(&range["median_m"]) - 0.023857).abs() < 1e-5,
        "{range}"
    );
    assert!(
        (number(&range["percentile_99_m"]) - 0.071571).abs() < 1e-5,
        "{range}"
    );
    // Chords of unit circles: 2·sin(0.05) and 2·sin(0.15).
    let due = ((0.1f64 / 2.0).sin().powi(2) + (0.3f64 / 2.0).sin().powi(2)) * 4.0 / 3.0;
    let rmse = number(&layer["errors"]["relative_rmse"]);
    assert!((rmse - due.sqrt()).abs() < 1e-4, "{rmse}");
    assert!(
        layer["noise"].is_object(),
        "the phasors' own standard error counts"
    );
    assert!(layers[0]["range_error"].is_null());
}

/// Every pixel has noise of 0.01 rad. Half of a normal distribution is within 0.674 standard deviations, 99 % within 2.576.
#[test]
fn the_noise_of_a_reference_is_told_as_range() {
    let folder = tempfile::tempdir().unwrap();
    let pixels = 20_000;
    let path = folder.path().join("z.exr");
    let layers: &[(&str, &[f32])] = &[
        ("tof0.phasor.re", &vec![0.6; pixels]),
        ("tof0.phasor.im", &vec![-0.8; pixels]),
        ("tof0.phasor_stderr.re", &vec![0.01; pixels]),
        ("tof0.phasor_stderr.im", &vec![0.01; pixels]),
    ];
    let frequency = [("camlux.tof0.frequency_hz", "100000000")];
    write(&path, (pixels, 1), layers, &frequency);
    let found = json(folder.path(), &["z.exr", "z.exr"]);
    let layer = &found["layers"][0];
    assert_eq!(layer["range_error"]["percentile_99_m"], 0.0);
    for (key, due) in [("median_m", 0.674_49), ("percentile_99_m", 2.575_83)] {
        let deviations = layer["range_error_of_noise"][key].as_f64().unwrap() / 0.002_385_672_5;
        assert!(
            (deviations / due - 1.0).abs() < 0.01,
            "{key}: {deviations} of {due}"
        );
    }
}

#[test]
fn layers_of_different_units_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let layers: &[(&str, &[f32])] = &[("tof0.amplitude.Y", &[1.0; 2])];
    for (name, unit) in [("e.exr", "e-"), ("dn.exr", "DN")] {
        let path = folder.path().join(name);
        write(
            &path,
            (2, 1),
            layers,
            &[("camlux.unit.tof0.amplitude", unit)],
        );
    }
    let pick = ["--layer", "tof0.amplitude"];
    let found = json(folder.path(), &[&["dn.exr", "dn.exr"][..], &pick].concat());
    assert_eq!(found["layers"][0]["unit"], "DN");
    let output = compare(folder.path(), &[&["dn.exr", "e.exr"][..], &pick].concat());
    let due = "layer tof0.amplitude is in DN in dn.exr and in e- in e.exr; compare layers of the same unit";
    assert_fails(&output, &[due]);
}

/// Files of other programs have their light in R, G and B alone, or in a layer such as ViewLayer.Combined, often with alpha.
#[test]
fn layers_of_other_names_are_paired() {
    let folder = pair();
    let light = [1.0_f32, 2.0, 2.0, 4.0, 0.0];
    // The helper takes only names with a dot for channels.
    let channels =
        ["B", "G", "R"].map(|name| AnyChannel::new(name, FlatSamples::F32(light.to_vec())));
    let channels = AnyChannels::sort(SmallVec::from_vec(channels.to_vec()));
    let header = LayerAttributes::default();
    let layer = Layer::new((light.len(), 1), header, Encoding::UNCOMPRESSED, channels);
    let path = folder.path().join("plain.exr");
    Image::from_layer(layer).write().to_file(path).unwrap();
    let combined: Vec<String> = ["A", "B", "G", "R"]
        .map(|band| format!("ViewLayer.Combined.{band}"))
        .to_vec();
    let combined: Vec<(&str, &[f32])> = combined
        .iter()
        .map(|name| (name.as_str(), &light[..]))
        .collect();
    write(&folder.path().join("blender.exr"), (5, 1), &combined, &[]);
    for (image, layer) in [
        ("plain.exr", "=indirect"),
        ("blender.exr", "ViewLayer.Combined=indirect"),
    ] {
        let report = json(folder.path(), &[image, "t.exr", "--layer", layer]);
        let layers = report["layers"].as_array().unwrap();
        assert_eq!(layers.len(), 1);
        assert_eq!(layers[0]["name"], layer);
        assert_eq!(layers[0]["unit"], "W/sr/m^2");
        assert_eq!(layers[0]["errors"]["relative_rmse"], 0.0);
        // The noise of the reference is that of its own layer.
        assert_near(&layers[0]["noise"]["relative_rmse_of_noise"], 0.01);
        // Without the option both lists and the option are shown.
        let output = compare(folder.path(), &[image, "t.exr"]);
        let option = format!("--layer \"{}\"", layer.replace("=indirect", "=radiance"));
        assert_fails(
            &output,
            &["none of the layers", "t.exr has direct, indirect", &option],
        );
    }
    let layer = "ViewLayer.Combined=";
    let report = json(
        folder.path(),
        &["blender.exr", "plain.exr", "--layer", layer],
    );
    assert_eq!(report["layers"][0]["errors"]["relative_rmse"], 0.0);
    let output = compare(folder.path(), &["plain.exr", "t.exr", "--layer", "=none"]);
    assert_fails(&output, &["there is no layer none: t.exr has direct"]);
}

/// Of a cropped image only the pixels that it holds are compared.
#[test]
fn pixels_outside_of_a_data_window_are_left_out_and_said() {
    let folder = pair();
    let channels = ["indirect.B", "indirect.G", "indirect.R"]
        .map(|name| AnyChannel::new(name, FlatSamples::F32(vec![2.0, 2.0])));
    let channels = AnyChannels::sort(SmallVec::from_vec(channels.to_vec()));
    let mut layer = Layer::new(
        (2, 1),
        LayerAttributes::default(),
        Encoding::UNCOMPRESSED,
        channels,
    );
    layer.attributes.layer_position = exr::prelude::Vec2(1, 0);
    let mut attributes = exr::prelude::ImageAttributes::with_size((5, 1));
    attributes.display_window.size = exr::prelude::Vec2(5, 1);
    let image = Image::empty(attributes).with_layer(layer);
    image
        .write()
        .to_file(folder.path().join("crop.exr"))
        .unwrap();
    let output = compare(folder.path(), &["crop.exr", "t.exr"]);
    let says = "warning: 3 pixels are outside of the data window of crop.exr; they are left out";
    let table = assert_succeeds(&output, says);
    assert!(table.contains("5 x 1; 2 show a surface"), "{table}");
}
