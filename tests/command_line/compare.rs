//! `camlux compare`: reads two image files, and writes figures and an error map. It needs no device.
#![cfg(feature = "cli")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    SmallVec, Text, WritableImage,
};
use serde_json::Value;

fn compare(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_camlux"))
        .arg("compare")
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// The program's stdout. Checks that the program succeeded and that stderr contains these words, or is empty if there are none.
#[track_caller]
fn assert_succeeds(output: &Output, stderr: &str) -> String {
    let said = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(0), "{said}");
    if stderr.is_empty() {
        assert_eq!(said, "");
    }
    assert!(said.contains(stderr), "{stderr:?} is missing in: {said}");
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Checks that stderr has one line with these parts, that the exit code is 1 and that stdout is empty.
#[track_caller]
fn assert_fails(output: &Output, says: &[&str]) {
    let stderr = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    for part in says {
        assert!(stderr.contains(part), "{part:?} is missing in: {stderr}");
    }
    assert!(output.stdout.is_empty());
}

/// Writes an image. A layer gets these pixels in R, G and B; a name with a dot, or `edge`, is one channel.
fn write(
    path: &Path,
    size: (usize, usize),
    layers: &[(&str, &[f32])],
    attributes: &[(&str, &str)],
) {
    let mut channels = Vec::new();
    for (name, pixels) in layers {
        let names = if name.contains('.') || *name == "edge" {
            vec![(*name).to_owned()]
        } else {
            ["R", "G", "B"]
                .map(|band| format!("{name}.{band}"))
                .to_vec()
        };
        for name in names {
            channels.push(AnyChannel::new(
                name.as_str(),
                FlatSamples::F32(pixels.to_vec()),
            ));
        }
    }
    let mut header = LayerAttributes::default();
    for (name, value) in attributes {
        let value = AttributeValue::Text(Text::from(*value));
        header.other.insert(Text::from(*name), value);
    }
    let channels = AnyChannels::sort(SmallVec::from_vec(channels));
    let layer = Layer::new(size, header, Encoding::UNCOMPRESSED, channels);
    Image::from_layer(layer).write().to_file(path).unwrap();
}

/// Writes `a.exr` and the reference `t.exr`: five pixels, the last of them background. The tests' figures are worked out by hand.
/// indirect: d = 0.5, 0, −1, 1 for t = 1, 2, 2, 4. direct: equal. The reference has no radiance.
fn write_pair(folder: &Path) {
    let direct: &[f32] = &[4.0, 3.0, 3.0, 1.0, 0.0];
    write(
        &folder.join("a.exr"),
        (5, 1),
        &[
            ("direct", direct),
            ("indirect", &[1.5, 2.0, 1.0, 5.0, 77.0]),
            ("radiance", &[5.5, 5.0, 4.0, 6.0, 77.0]),
        ],
        &[],
    );
    write(
        &folder.join("t.exr"),
        (5, 1),
        &[
            ("direct", direct),
            ("indirect", &[1.0, 2.0, 2.0, 4.0, 0.0]),
            ("stderr", &[0.01, 0.02, 0.02, 0.04, 0.0]),
            ("valid.A", &[1.0, 1.0, 1.0, 1.0, 0.0]),
        ],
        &[],
    );
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let mut arguments = arguments.to_vec();
    arguments.push("--json");
    serde_json::from_str(&assert_succeeds(&compare(folder, &arguments), "")).unwrap()
}

#[track_caller]
fn assert_near(value: &Value, expected: f64) {
    let value = value.as_f64().unwrap();
    assert!(
        (value - expected).abs() < 1e-6 * expected.abs().max(1e-3),
        "{value} is not {expected}"
    );
}

#[test]
fn the_usual_layers_are_compared_as_json() {
    let folder = tempfile::tempdir().unwrap();
    write_pair(folder.path());
    let report = json(folder.path(), &["a.exr", "t.exr"]);
    assert_eq!(report["resolution_px"], serde_json::json!([5, 1]));
    assert_eq!(report["valid_pixels"], 4);
    let layers = report["layers"].as_array().unwrap();
    let names: Vec<&str> = layers
        .iter()
        .map(|layer| layer["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["indirect", "direct", "radiance"]);

    let indirect = &layers[0];
    assert_eq!(indirect["unit"], "W/sr/m^2");
    assert_eq!(indirect["value_count"], 12);
    assert_near(&indirect["image_mean"], 9.5 / 4.0);
    assert_near(&indirect["errors"]["relative_rmse"], 0.3);
    assert_near(&indirect["errors"]["bias"], 0.5 / 9.0);
    assert_near(&indirect["errors"]["mean_relative_error"], 2.5 / 9.0);
    assert_near(&indirect["noise"]["relative_rmse_of_noise"], 0.01);
    assert_near(
        &indirect["noise"]["relative_rmse"],
        (2.2475_f64 / 24.9975).sqrt(),
    );
    assert!(indirect["noise"]["relative_rmse_below"].is_null());

    let direct = &layers[1];
    assert_eq!(direct["errors"]["relative_rmse"], 0.0);
    assert!(direct["noise"].is_null(), "direct light has no noise");

    // The reference's radiance is direct + indirect = 5, 5, 5, 5.
    let radiance = &layers[2];
    assert_near(&radiance["reference_mean"], 5.0);
    assert_near(&radiance["errors"]["relative_rmse"], 0.15);
    assert_near(&radiance["noise"]["relative_rmse_of_noise"], 0.005);
}

#[test]
fn the_table_says_what_was_taken_out() {
    let folder = tempfile::tempdir().unwrap();
    write_pair(folder.path());
    let table = assert_succeeds(&compare(folder.path(), &["a.exr", "t.exr"]), "");
    for part in [
        "5 x 1; 4 show a surface",
        "indirect [W/sr/m^2]",
        "30.0 %",
        "noise of 1.00 % is subtracted",
        "not finite",
    ] {
        assert!(table.contains(part), "{part:?} is missing in: {table}");
    }
    let of_bias: Vec<&str> = table
        .lines()
        .filter(|line| line.starts_with("bias"))
        .collect();
    // The bias is 0.5/9. Its standard error, for three bands with the same noise, is 9.5/9·0.05·3/27. Direct light has no noise.
    assert!(of_bias[0].contains("5.56 ± 0.59 %"), "{table}");

    // The reference against itself: the table states that it can show no error.
    let table = assert_succeeds(&compare(folder.path(), &["t.exr", "t.exr"]), "");
    assert!(table.contains("below") && table.contains("too small for this reference to show"));
}

/// For two references of the same scene, the variance of the difference is the sum of both variances.
#[test]
fn the_noise_of_both_images_counts() {
    let folder = tempfile::tempdir().unwrap();
    write_pair(folder.path());
    let report = json(folder.path(), &["t.exr", "t.exr", "--layer", "indirect"]);
    let indirect = &report["layers"][0];
    assert_near(
        &indirect["noise"]["relative_rmse_of_noise"],
        0.01 * 2.0_f64.sqrt(),
    );
    assert_eq!(indirect["z_scores"]["variance"], 0.0);
}

/// The stderr layer of a render is not subtracted as noise. It is compared with the actual errors.
#[test]
fn a_render_is_judged_by_what_it_says_of_its_error() {
    let folder = tempfile::tempdir().unwrap();
    write_pair(folder.path());
    let indirect: &[f32] = &[1.5, 2.0, 1.0, 5.0, 77.0];
    let render = |scale: f32| {
        let stated = [0.5, 0.5, 1.0, 1.0, 9.0].map(|error| scale * error);
        write(
            &folder.path().join("r.exr"),
            (5, 1),
            &[("indirect", indirect), ("stderr", &stated)],
            &[("camlux.estimator", "final-gather")],
        );
        let table = assert_succeeds(&compare(folder.path(), &["r.exr", "t.exr"]), "");
        (json(folder.path(), &["r.exr", "t.exr"]), table)
    };
    let (report, table) = render(1.0);
    let layer = &report["layers"][0];
    // The same as without the stderr layer.
    assert_near(&layer["noise"]["relative_rmse_of_noise"], 0.01);
    // z = 0.5/sqrt(0.25 + 1e-4), 0, −1/sqrt(1 + 4e-4), 1/sqrt(1 + 16e-4).
    let squares = 0.25 / 0.2501 + 1.0 / 1.0004 + 1.0 / 1.0016;
    assert_near(
        &layer["stated_error"]["deviation"],
        (squares / 4.0_f64).sqrt(),
    );
    assert!(
        table.contains("the image's layer stderr is right"),
        "{table}"
    );
    for (scale, verdict) in [(0.3, "too small"), (2.0, "too large")] {
        let (_, table) = render(scale);
        let verdict = format!("the image's layer stderr is {verdict}");
        assert!(table.contains(&verdict), "{table}");
    }
    // The stderr of a reference is noise.
    let report = json(folder.path(), &["t.exr", "t.exr", "--layer", "indirect"]);
    assert_eq!(report["layers"][0]["stated_error"], Value::Null);
}

/// Writes the pair with a reference `e.exr` whose third pixel and background are on edges.
fn write_pair_with_edges(folder: &Path) {
    write_pair(folder);
    write(
        &folder.join("e.exr"),
        (5, 1),
        &[
            ("direct", &[4.0, 3.0, 3.0, 1.0, 0.0]),
            ("edge", &[0.0, 0.0, 1.0, 0.0, 1.0]),
            ("indirect", &[1.0, 2.0, 2.0, 4.0, 0.0]),
            ("stderr", &[0.01, 0.02, 0.02, 0.04, 0.0]),
            ("valid.A", &[1.0, 1.0, 1.0, 1.0, 0.0]),
        ],
        &[],
    );
}

/// Pixels on edges do not count in the errors, but the report states them.
#[test]
fn pixels_on_edges_are_left_out_and_said() {
    let folder = tempfile::tempdir().unwrap();
    write_pair_with_edges(folder.path());
    let report = json(folder.path(), &["a.exr", "e.exr"]);
    assert_eq!(report["valid_pixels"], 4);
    assert_eq!(report["edge_pixels"], 1, "the background does not count");
    assert_eq!(report["edge_share"], 0.25);
    let indirect = &report["layers"][0];
    assert_eq!(indirect["value_count"], 9);
    // d = 0.5, 0, 1 over t = 1, 2, 4.
    let without = (1.25_f64 / 21.0).sqrt();
    assert_near(&indirect["errors"]["relative_rmse"], without);
    assert_near(&indirect["errors"]["bias"], 1.5 / 7.0);
    assert_near(&indirect["noise"]["relative_rmse_of_noise"], 0.01);
    let with_edges = &indirect["with_edges"];
    assert_eq!(with_edges["value_count"], 12);
    assert_near(&with_edges["errors"]["relative_rmse"], 0.3);

    let table = assert_succeeds(&compare(folder.path(), &["a.exr", "e.exr"]), "");
    for part in [
        "5 x 1; 3 show a surface",
        "1 more (25.0 %) could show either of two surfaces and are left out",
    ] {
        assert!(table.contains(part), "{part:?} is missing in: {table}");
    }
    let row = |label: &str| table.lines().find(|line| line.starts_with(label)).unwrap();
    assert!(row("relative RMSE").contains("24.4 %"), "{table}");
    assert!(row("  with the edge").contains("30.0 %"), "{table}");

    let arguments = ["a.exr", "e.exr", "--error-map", "map.png"];
    assert_succeeds(&compare(folder.path(), &arguments), "");
    let map = image::open(folder.path().join("map.png"))
        .unwrap()
        .to_rgb8();
    assert_eq!(map.get_pixel(16 + 2 * 96 + 48, 16 + 48).0, [128; 3]);
    assert_ne!(map.get_pixel(16 + 48, 16 + 48).0, [128; 3]);

    // A reference without the layer `edge`.
    let report = json(folder.path(), &["a.exr", "t.exr"]);
    assert!(report["edge_pixels"].is_null() && report["edge_share"].is_null());
    assert!(report["layers"][0]["with_edges"].is_null());
    let table = assert_succeeds(&compare(folder.path(), &["a.exr", "t.exr"]), "");
    assert!(!table.contains("edge"), "{table}");
}

/// A value that is not finite gives a warning even in a pixel that does not count.
#[test]
fn no_number_on_an_edge_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    write_pair_with_edges(folder.path());
    let pixels = [4.0, 3.0, f32::NAN, 1.0, 0.0];
    write(
        &folder.path().join("n.exr"),
        (5, 1),
        &[("direct", &pixels)],
        &[],
    );
    let output = compare(folder.path(), &["n.exr", "e.exr"]);
    let says = "warning: 3 values of layer direct of n.exr are not finite";
    let table = assert_succeeds(&output, says);
    assert!(table.contains("0, 0"), "{table}");
}

#[test]
fn any_layer_of_both_images_can_be_named() {
    let folder = tempfile::tempdir().unwrap();
    write_pair(folder.path());
    let layers = ["a.exr", "t.exr", "--layer", "direct", "--layer", "direct"];
    let report = json(folder.path(), &layers);
    assert_eq!(report["layers"].as_array().unwrap().len(), 1);
    let report = json(folder.path(), &["t.exr", "t.exr", "--layer", "valid"]);
    assert_eq!(report["layers"][0]["value_count"], 4);
    assert_eq!(report["layers"][0]["unit"], "");
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder = tempfile::tempdir().unwrap();
    write_pair(folder.path());
    let path = |name: &str| folder.path().join(name);
    let says = |arguments: &[&str], says: &[&str]| {
        assert_fails(&compare(folder.path(), arguments), says);
    };
    says(&["none.exr", "t.exr"], &["none.exr: there is no such file"]);
    says(
        &["a.exr", "t.exr", "--layer", "energy"],
        &["no layer energy", "a.exr has direct, indirect, radiance"],
    );
    write(&path("wide.exr"), (6, 1), &[("direct", &[1.0; 6])], &[]);
    says(&["wide.exr", "t.exr"], &["6 x 1", "5 x 1", "--size"]);
    write(&path("rgb.exr"), (5, 1), &[("P.X", &[1.0; 5])], &[]);
    says(
        &["rgb.exr", "t.exr"],
        &[
            "none of the layers",
            "rgb.exr has P",
            "t.exr has direct, indirect, stderr, valid",
        ],
    );
    write(&path("red.exr"), (5, 1), &[("direct.R", &[1.0; 5])], &[]);
    says(
        &["red.exr", "t.exr"],
        &[
            "layer direct has the channels direct.R in red.exr",
            "direct.R, direct.G, direct.B in t.exr",
        ],
    );
    let map = |file: &str| compare(folder.path(), &["a.exr", "t.exr", "--error-map", file]);
    assert_fails(&map("a.exr"), &["end the name in .png"]);
    assert_fails(&map("missing/a.png"), &["folder does not exist"]);
    fs::copy(path("a.exr"), path("b.png")).unwrap();
    let onto_itself = ["b.png", "t.exr", "--error-map", "./b.png"];
    says(&onto_itself, &["is an input"]);
}

#[test]
fn a_black_reference_is_said_to_be_black() {
    let folder = tempfile::tempdir().unwrap();
    write_pair(folder.path());
    let black = folder.path().join("black.exr");
    write(&black, (5, 1), &[("direct", &[0.0; 5])], &[]);
    let table = assert_succeeds(&compare(folder.path(), &["a.exr", "black.exr"]), "");
    assert!(
        table.contains("direct: undefined: the reference is black"),
        "{table}"
    );
    let report = json(folder.path(), &["a.exr", "black.exr"]);
    assert!(report["layers"][0]["errors"].is_null());
    let arguments = ["a.exr", "black.exr", "--error-map", "a.png"];
    assert_fails(
        &compare(folder.path(), &arguments),
        &["no error map", "direct"],
    );
    assert!(!folder.path().join("a.png").exists());
}

#[test]
fn warnings_go_to_stderr() {
    let folder = tempfile::tempdir().unwrap();
    write_pair(folder.path());
    let write = |name: &str, value: f32, position: &str| {
        let attributes = [
            ("camlux.camera.position_m", position),
            ("camlux.light.0", "point"),
            // Different estimators have different hashes, which is no reason for a warning.
            ("camlux.scene_hash", name),
        ];
        let pixels = [value, 1.0, 1.0, 1.0, 1.0];
        write(
            &folder.path().join(name),
            (5, 1),
            &[("direct", &pixels)],
            &attributes,
        );
    };
    write("1.exr", 1.0, "[0.0]");
    write("2.exr", f32::NAN, "[0.0]");
    write("3.exr", 1.0, "[1.0]");
    let output = compare(folder.path(), &["2.exr", "1.exr"]);
    let table = assert_succeeds(
        &output,
        "warning: 3 values of layer direct of 2.exr are not finite",
    );
    assert!(table.contains("3, 0"), "{table}");
    let output = compare(folder.path(), &["1.exr", "3.exr"]);
    let said = "differ in camlux.camera.position_m; check that both show the same scene";
    assert_succeeds(&output, said);
    assert_succeeds(&compare(folder.path(), &["1.exr", "1.exr"]), "");
    assert_succeeds(&compare(folder.path(), &["1.exr", "t.exr"]), "");
}

#[test]
fn the_error_map_shows_the_sign() {
    let folder = tempfile::tempdir().unwrap();
    write_pair(folder.path());
    let arguments = [
        "a.exr",
        "t.exr",
        "--layer",
        "indirect",
        "--error-map",
        "map.png",
    ];
    assert_succeeds(&compare(folder.path(), &arguments), "");
    let map = image::open(folder.path().join("map.png"))
        .unwrap()
        .to_rgb8();
    // Five pixels, each 96 wide, inside a margin of 16; legend below.
    assert!(map.width() == 5 * 96 + 32 && map.height() > 96 + 32);
    let at = |pixel: u32| {
        map.get_pixel(16 + pixel * 96 + 48, 16 + 48)
            .0
            .map(i32::from)
    };
    let [r, _, b] = at(0);
    assert!(r > b, "too bright is red");
    assert_eq!(at(1), [247; 3], "no error is almost white");
    let [r, _, b] = at(2);
    assert!(b > r, "too dark is blue");
    assert_eq!(at(4), [128; 3], "background is grey");
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
    let folder = tempfile::tempdir().unwrap();
    write_pair(folder.path());
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
    let folder = tempfile::tempdir().unwrap();
    write_pair(folder.path());
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
