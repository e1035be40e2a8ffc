//! Plain OpenEXR files, and files with a part for each layer, of `camlux render` and `camlux batch`.

use std::fs;

use crate::jobs::{JOB, Jobs, files_below};
use camlux::output::LayeredImage;

#[test]
fn render_writes_a_file_for_each_layer() {
    let jobs = Jobs::new("");
    let render = |more: &[&str]| {
        let command = [&["render", "scene.toml", "-o", "x.exr"], more].concat();
        let output = jobs.program(&command).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{stderr}");
        stderr
    };
    render(&[]);
    let whole = LayeredImage::read(jobs.path("x.exr")).unwrap();
    fs::remove_file(jobs.path("x.exr")).unwrap();
    let stderr = render(&["--plain", "--layers", "depth,radiance,id.instance"]);
    assert!(stderr.contains("x.depth.exr"), "{stderr}");
    assert!(!jobs.path("x.exr").exists());
    for name in ["depth", "radiance", "id.instance"] {
        let plain = LayeredImage::read(jobs.path(&format!("x.{name}.exr"))).unwrap();
        assert_eq!(plain.layers().len(), 1);
        assert_eq!(plain.layer(name), whole.layer(name));
    }
    // compare reads them.
    jobs.program(&["render", "scene.toml", "-o", "y.exr"])
        .output()
        .unwrap();
    let compared = jobs
        .program(&["compare", "x.radiance.exr", "y.exr"])
        .output()
        .unwrap();
    let text = String::from_utf8(compared.stdout).unwrap();
    assert!(
        compared.status.success() && text.contains("radiance"),
        "{text}"
    );
}

#[test]
fn a_batch_of_plain_files_resumes() {
    let job = JOB.replace(
        "seed = 3",
        "seed = 3\nframes = 2\nplain = true\nlayers = [\"radiance\", \"depth\"]\nflow = true",
    );
    let jobs = Jobs::new(&job);
    jobs.succeed("set", &["--contact-sheet", "sheet.png"]);
    let mut expected: Vec<String> = Vec::new();
    for frame in ["000000", "000001"] {
        for layer in ["depth", "flow", "radiance", "scene_flow"] {
            expected.push(format!("{frame}.{layer}.exr"));
        }
    }
    expected.extend(["dataset.json".into(), "manifest.jsonl".into()]);
    assert_eq!(files_below(&jobs.path("set")), expected);
    let lines = jobs.manifest("set/manifest.jsonl");
    for line in &lines {
        let mut hasher = blake3::Hasher::new();
        for file in line["files"].as_object().unwrap().values() {
            hasher.update(&jobs.read(&format!("set/{}", file.as_str().unwrap())));
        }
        assert_eq!(line["blake3"], hasher.finalize().to_hex().as_str());
        assert_eq!(line["bytes"], hasher.count());
    }
    assert_eq!(lines[0]["files"]["depth"], "frames/000000.depth.exr");
    let before = jobs.read("set/frames/000001.depth.exr");
    fs::write(jobs.path("set/frames/000001.depth.exr"), b"damaged").unwrap();
    let stderr = jobs.succeed("set", &[]);
    assert!(stderr.contains("rendered 1 frame"), "{stderr}");
    assert_eq!(jobs.read("set/frames/000001.depth.exr"), before);
    assert!(
        jobs.succeed("set", &["--merge"])
            .contains("merged 2 of 2 frames")
    );
}

#[test]
fn render_and_batch_write_a_part_for_each_layer() {
    let job = JOB.replace("seed = 3", "seed = 3\nframes = 2\nmultipart = true");
    let jobs = Jobs::new(&job);
    let render = |file: &str, more: &[&str]| {
        let command = [&["render", "scene.toml", "-o", file], more].concat();
        jobs.program(&command).output().unwrap()
    };
    for (file, more) in [("x.exr", &["--multipart"][..]), ("y.exr", &[])] {
        assert!(render(file, more).status.success());
    }
    let [parts, whole] =
        ["x.exr", "y.exr"].map(|file| LayeredImage::read(jobs.path(file)).unwrap());
    assert_eq!(parts.layers(), whole.layers());
    assert!(jobs.read("x.exr") != jobs.read("y.exr"));
    let both = render("x.exr", &["--multipart", "--plain"]);
    let stderr = String::from_utf8(both.stderr).unwrap();
    assert!(stderr.contains("cannot be used with"), "{stderr}");
    let compared = jobs.program(&["compare", "x.exr", "y.exr"]).output();
    let text = String::from_utf8(compared.unwrap().stdout).unwrap();
    assert!(
        text.contains("as it is                               0 %"),
        "{text}"
    );
    jobs.succeed("set", &[]);
    jobs.write("job.toml", &job.replace("multipart = true", ""));
    jobs.succeed("single", &[]);
    let [parts, whole] = ["set", "single"]
        .map(|set| LayeredImage::read(jobs.path(&format!("{set}/frames/000001.exr"))).unwrap());
    assert_eq!(parts.attribute("name"), Some("radiance"));
    assert_eq!(parts.layers(), whole.layers());
}
