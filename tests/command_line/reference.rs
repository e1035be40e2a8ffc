//! `camlux reference` from the scene file to the image file.
#![cfg(feature = "cli")]

use std::{
    fs,
    io::{BufRead, BufReader},
    path::Path,
    process::{Command, Output, Stdio},
};

use crate::program::{assert_fails, assert_succeeds, program, scene_file, stderr};
use crate::rows::assert_says;
use camlux::output::{Layer, LayeredImage};

/// `camlux reference` of the Cornell box at 16 x 12 pixels into `a.exr` of a folder.
fn command(folder: &Path, more: &[&str]) -> Command {
    let mut command = program(folder, &["reference"]);
    command.arg(scene_file("cornell"));
    command.args(["-o", "a.exr"]);
    if !more.contains(&"--size") {
        command.args(["--size", "16", "12"]);
    }
    command.args(more);
    command
}

fn run(folder: &Path, more: &[&str]) -> Output {
    command(folder, more).output().unwrap()
}

fn read(folder: &Path) -> LayeredImage {
    LayeredImage::read(folder.join("a.exr")).unwrap()
}

fn samples(image: &LayeredImage) -> u32 {
    let text = image.attribute("camlux.samples_per_pixel").unwrap();
    text.parse().unwrap()
}

#[test]
fn samples_are_added_up_to_the_goal() {
    let folder = tempfile::tempdir().unwrap();
    assert_succeeds(&run(folder.path(), &["--spp", "256"]));
    let first = read(folder.path());
    assert_eq!(samples(&first), 256);
    assert_eq!(first.resolution_px(), [16, 12]);
    for layer in [
        Layer::Radiance,
        Layer::Direct,
        Layer::Indirect,
        Layer::StandardError,
    ] {
        let values = first.values(layer).expect("every reference has it");
        assert!(
            values.iter().all(|value| value.is_finite()),
            "{}",
            layer.name()
        );
        assert!(values.iter().any(|&value| value > 0.0), "{}", layer.name());
    }

    let told = assert_succeeds(&run(folder.path(), &["--spp", "1000"]));
    assert!(told.contains("adding to 256 samples"), "{told}");
    let second = read(folder.path());
    assert!((1000..1032).contains(&samples(&second)));

    // The requested number of samples is reached, so nothing is added.
    assert_succeeds(&run(folder.path(), &["--spp", "1000"]));
    assert_eq!(samples(&read(folder.path())), samples(&second));

    assert_succeeds(&run(folder.path(), &["--stderr", "0.02"]));
    let third = read(folder.path());
    assert!(samples(&third) > samples(&second));
    let error = |image: &LayeredImage| {
        let sum = |layer: Layer| -> f64 {
            let values = image.values(layer).unwrap().iter();
            values.map(|&value| f64::from(value).powi(2)).sum()
        };
        (sum(Layer::StandardError) / sum(Layer::Indirect)).sqrt()
    };
    assert!(error(&third) <= 0.0201, "{}", error(&third));
}

#[test]
fn what_is_no_reference_of_the_scene_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let refused = |says: &str| {
        let output = run(folder.path(), &["--spp", "64"]);
        assert_fails(&output, &[says, "a.exr", "remove this one"]);
    };
    assert_succeeds(&run(folder.path(), &["--spp", "64", "--size", "8", "8"]));
    let other = fs::read(&path).unwrap();
    refused("another resolution");
    assert_eq!(fs::read(&path).unwrap(), other);

    let more = run(
        folder.path(),
        &["--spp", "64", "--size", "8", "8", "--bounces", "3"],
    );
    assert_fails(
        &more,
        &[
            "up to 1, and those of the scene up to 3",
            "a.exr",
            "remove this one",
        ],
    );
    assert_eq!(fs::read(&path).unwrap(), other);

    let rendered = program(folder.path(), &["render"])
        .arg(scene_file("cornell"))
        .args(["--size", "16", "12", "--rsm-size", "4", "-o", "a.exr"])
        .output();
    assert_succeeds(&rendered.unwrap());
    refused("does not hold a reference");
}

/// More bounces are more light, and the file knows their number.
#[test]
fn bounces_are_those_of_the_option() {
    let folder = tempfile::tempdir().unwrap();
    let mut last = 0.0;
    for bounces in ["1", "4"] {
        let path = folder.path().join("a.exr");
        let _ = fs::remove_file(path);
        assert_succeeds(&run(folder.path(), &["--spp", "256", "--bounces", bounces]));
        let again = assert_succeeds(&run(folder.path(), &["--spp", "512", "--bounces", bounces]));
        assert!(again.contains("adding to 256 samples"), "{again}");
        let image = read(folder.path());
        assert_eq!(image.attribute("camlux.bounces"), Some(bounces));
        assert_eq!(image.attribute("camlux.estimator"), Some("path-sampled"));
        let light: f32 = image.values(Layer::Indirect).unwrap().iter().sum();
        assert!(light > 1.2 * last, "{light} after {last}");
        last = light;
    }
    let refused = run(folder.path(), &["--spp", "256", "--bounces", "17"]);
    assert_fails(&refused, &["bounces is 17", "from 1 to 16"]);
}

#[test]
fn wrong_goals_and_names_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (more, code, says) in [
        (&[][..], 2, "--spp"),
        (&["--spp", "0"], 2, "0"),
        (&["--stderr", "0"], 2, "between 0 and 1"),
        (&["--stderr", "NaN"], 2, "between 0 and 1"),
        (
            &["--spp", "64", "--stderr", "0.1"],
            2,
            "cannot be used with",
        ),
        (&["--spp", "64", "-o", "a.png"], 2, "--output"),
        (
            &["--spp", "64", "--size", "4", "4", "--size", "8", "8"],
            2,
            "--size",
        ),
    ] {
        let output = run(folder.path(), more);
        let stderr = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{stderr}");
        assert!(stderr.contains(says), "{says:?} is missing in: {stderr}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// Ctrl-C keeps the finished rounds, and the same command continues from them.
#[test]
fn an_interrupted_reference_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    // Hundreds of rounds; a tenth of them is reported.
    let mut child = command(folder.path(), &["--spp", "2000000", "--size", "8", "6"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().contains('%')));
    let pid = child.id().to_string();
    let signal = Command::new("kill").args(["-INT", &pid]).status().unwrap();
    assert!(signal.success());
    let told: Vec<String> = lines.map(|line| line.unwrap()).collect();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{told:?}");
    assert!(
        told.iter().any(|line| line.contains("which are kept")),
        "{told:?}"
    );
    let kept = samples(&read(folder.path()));
    assert!(kept > 0);

    let more = (kept + 1).to_string();
    let told = assert_succeeds(&run(folder.path(), &["--size", "8", "6", "--spp", &more]));
    assert_says(&told, &[&format!("adding to {kept} samples")]);
    assert!(samples(&read(folder.path())) > kept);
}
