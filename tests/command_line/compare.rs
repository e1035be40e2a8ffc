//! `camlux compare`: reads two image files, and writes figures and an error map. It needs no device.
#![cfg(feature = "cli")]

use std::fs;
use std::path::Path;
use std::process::Output;

use crate::program::{self, assert_fails, run};
use crate::rows::assert_says;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    SmallVec, Text, WritableImage,
};
use serde_json::Value;
use tempfile::TempDir;

pub fn compare(folder: &Path, arguments: &[&str]) -> Output {
    run(folder, &[&["compare"], arguments].concat())
}

/// The program's stdout. Checks that the program succeeded and that stderr contains these words, or is empty if there are none.
#[track_caller]
pub fn assert_succeeds(output: &Output, stderr: &str) -> String {
    let said = program::stderr(output);
    assert_eq!(output.status.code(), Some(0), "{said}");
    if stderr.is_empty() {
        assert_eq!(said, "");
    }
    assert_says(&said, &[stderr]);
    program::stdout(output)
}

/// Writes an image. A layer gets these pixels in R, G and B; a name with a dot, or `edge`, is one channel.
pub fn write(
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
pub fn pair() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let direct: &[f32] = &[4.0, 3.0, 3.0, 1.0, 0.0];
    write(
        &folder.path().join("a.exr"),
        (5, 1),
        &[
            ("direct", direct),
            ("indirect", &[1.5, 2.0, 1.0, 5.0, 77.0]),
            ("radiance", &[5.5, 5.0, 4.0, 6.0, 77.0]),
        ],
        &[],
    );
    write(
        &folder.path().join("t.exr"),
        (5, 1),
        &[
            ("direct", direct),
            ("indirect", &[1.0, 2.0, 2.0, 4.0, 0.0]),
            ("stderr", &[0.01, 0.02, 0.02, 0.04, 0.0]),
            ("valid.A", &[1.0, 1.0, 1.0, 1.0, 0.0]),
        ],
        &[],
    );
    folder
}

pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    let mut arguments = arguments.to_vec();
    arguments.push("--json");
    serde_json::from_str(&assert_succeeds(&compare(folder, &arguments), "")).unwrap()
}

#[track_caller]
pub fn assert_near(value: &Value, expected: f64) {
    let value = value.as_f64().unwrap();
    assert!(
        (value - expected).abs() < 1e-6 * expected.abs().max(1e-3),
        "{value} is not {expected}"
    );
}

#[test]
fn the_usual_layers_are_compared_as_json() {
    let folder = pair();
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
    let folder = pair();
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
    let folder = pair();
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
    let folder = pair();
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
    assert_says(&table, &["the image's layer stderr is right"]);
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
fn pair_with_edges() -> TempDir {
    let folder = pair();
    write(
        &folder.path().join("e.exr"),
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
    folder
}

/// Pixels on edges do not count in the errors, but the report states them.
#[test]
fn pixels_on_edges_are_left_out_and_said() {
    let folder = pair_with_edges();
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
    assert_says(
        &table,
        &[
            "5 x 1; 3 show a surface",
            "1 more (25.0 %) could show either of two surfaces and are left out",
        ],
    );
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
    let folder = pair_with_edges();
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
fn what_cannot_be_compared_is_said() {
    let folder = pair();
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
    let folder = pair();
    let black = folder.path().join("black.exr");
    write(&black, (5, 1), &[("direct", &[0.0; 5])], &[]);
    let table = assert_succeeds(&compare(folder.path(), &["a.exr", "black.exr"]), "");
    assert_says(&table, &["direct: undefined: the reference is black"]);
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
    let folder = pair();
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
    let bounced = |name: &str, attributes: &[(&str, &str)]| {
        let pixels: &[f32] = &[1.0; 5];
        self::write(
            &folder.path().join(name),
            (5, 1),
            &[("direct", pixels)],
            attributes,
        );
    };
    bounced("one.exr", &[("camlux.estimator", "rsm-average")]);
    let three = [
        ("camlux.estimator", "path-sampled"),
        ("camlux.bounces", "3"),
    ];
    bounced("three.exr", &three);
    bounced("none.exr", &[("camlux.estimator", "none")]);
    let output = compare(folder.path(), &["one.exr", "three.exr"]);
    let said = "one.exr has indirect light of up to 1 bounces and three.exr of up to 3;";
    assert_succeeds(&output, said);
    assert_succeeds(&compare(folder.path(), &["three.exr", "three.exr"]), "");
    assert_succeeds(&compare(folder.path(), &["none.exr", "three.exr"]), "");
    assert_succeeds(&compare(folder.path(), &["1.exr", "1.exr"]), "");
    assert_succeeds(&compare(folder.path(), &["1.exr", "t.exr"]), "");
}

#[test]
fn the_error_map_shows_the_sign() {
    let folder = pair();
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
