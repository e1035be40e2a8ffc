//! `camlux batch`: several scenes of one job show the same thing in the same frame; what a job draws for materials.

use std::collections::BTreeSet;

use crate::jobs::{Jobs, SCENE};
use crate::rows::{assert_says, rows};
use camlux::output::LayeredImage;
use serde_json::Value;

const QUAD: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";

/// Everything random that a job has.
const DRAWN: &str = r#"
[camera]
random = { min = [-1, -1, 2], max = [1, 1, 3], look_at = [0, 0, 0] }
[[light]]
index = 0
power_factor_range = [0.5, 2.0]
random = { min = [-1.0, 0.5, 1.0], max = [1.0, 1.5, 2.0] }
[[mesh]]
index = 0
random = { min = [-0.3, 0.0, -0.3], max = [0.3, 0.0, 0.3], turn = "any" }
[[material]]
name = "*"
kd_min = 0.2
kd_max = 0.7
"#;

/// What is drawn in each frame of a scene, by the index of the frame in its scene.
fn drawn(jobs: &Jobs, scene: &str) -> Vec<Value> {
    let lines = jobs.manifest("set/manifest.jsonl").into_iter();
    let mut lines: Vec<Value> = lines.filter(|line| line["scene"] == scene).collect();
    lines.sort_by_key(|line| line["frame"].as_u64());
    let values = lines.iter().map(|line| {
        let camera = &line["camera"];
        let kd = &line["materials_kd"]["white"];
        serde_json::json!([
            camera["position_m"],
            camera["rotation_xyzw"],
            line["lights"],
            line["meshes"],
            kd
        ])
    });
    values.collect()
}

#[test]
fn scenes_of_one_job_show_the_same_in_the_same_frame() {
    let head = "[job]\nscenes = [\"scene.toml\", \"wide.toml\"]\nframes = 3\n";
    // The sweep makes nine frames of each scene, so that a frame's index in the job says nothing.
    let sweep = "[[sweep]]\nlight = 0\npower_factors = [1.0, 2.0, 3.0]\n";
    let jobs = Jobs::new(&format!("{head}{DRAWN}{sweep}"));
    let wide = SCENE.replace("[16, 16]", "[24, 16]");
    // Another material first: draws go by names.
    let wide = wide.replace(
        "[material.white]",
        "[material.other]\nkd = 0.4\n[material.white]",
    );
    jobs.write("wide.toml", &wide);
    jobs.succeed("set", &[]);
    let [first, second] = ["scene.toml", "wide.toml"].map(|scene| drawn(&jobs, scene));
    assert_eq!(first.len(), 9);
    assert_eq!(first, second);
    let texts: BTreeSet<String> = first.iter().map(Value::to_string).collect();
    assert_eq!(texts.len(), 9, "every frame has its own values");

    jobs.write(
        "job.toml",
        &format!("{head}draws_per_scene = true\n{DRAWN}{sweep}"),
    );
    jobs.succeed("set", &[]);
    let [alone, apart] = ["scene.toml", "wide.toml"].map(|scene| drawn(&jobs, scene));
    assert_eq!(alone, first, "the first scene keeps its values");
    for (own, other) in alone.iter().zip(&apart) {
        for (own, other) in own
            .as_array()
            .unwrap()
            .iter()
            .zip(other.as_array().unwrap())
        {
            assert_ne!(own, other);
        }
    }
}

/// Saved scenes are all called `scene.toml`.
#[test]
fn the_folders_of_saved_scenes_tell_them_apart() {
    let job = "[job]\nscenes = [\"a/scene.toml\", \"b/scene.toml\"]\n";
    let jobs = Jobs::new(job);
    for name in ["a", "b"] {
        std::fs::create_dir(jobs.path(name)).unwrap();
        jobs.write(
            &format!("{name}/scene.toml"),
            &SCENE.replace("quad.obj", "../quad.obj"),
        );
    }
    jobs.succeed("set", &[]);
    let lines = jobs.manifest("set/manifest.jsonl");
    let files: Vec<&str> = lines.iter().map(|l| l["file"].as_str().unwrap()).collect();
    assert_eq!(files, ["frames/a/000000.exr", "frames/b/000000.exr"]);
}

#[test]
fn materials_are_drawn_with_highlights_and_textures() {
    let scene = SCENE.replace(
        "[material.white]",
        "[material.shiny]\nkd = 0.3\nks = 0.2\nshininess = 5\n[material.white]",
    );
    let job = r#"
[job]
scene = "scene.toml"
frames = 12
layers = ["radiance"]
[[material]]
name = "*"
kd_min = 0.2
kd_max = [0.7, 0.6, 0.5]
grey = true
[[material]]
name = "shiny"
ks_min = 0.1
ks_max = 0.3
[[material]]
name = "white"
ks_min = 0.1
ks_max = 0.2
shininess_min = 10
shininess_max = 100
textures = ["dark.png", "light.png", "red.png"]
"#;
    let jobs = Jobs::new(job);
    jobs.write("scene.toml", &scene);
    jobs.write("quad.obj", QUAD);
    for (name, rgb) in [
        ("dark.png", [60, 60, 60]),
        ("light.png", [250, 250, 250]),
        ("red.png", [250, 0, 0]),
    ] {
        let image = image::RgbImage::from_pixel(2, 2, image::Rgb(rgb));
        image.save(jobs.path(name)).unwrap();
    }
    let listed = String::from_utf8(jobs.run("set", &["--dry-run"]).stdout).unwrap();
    for words in [
        "kd of white",
        "ks of shiny",
        "shininess of white",
        "texture of white",
    ] {
        assert!(listed.contains(words), "{words} is missing in: {listed}");
    }
    let stderr = jobs.succeed("set", &[]);
    assert!(!stderr.contains("warning"), "{stderr}");
    let lines = jobs.manifest("set/manifest.jsonl");
    let bands = |value: &Value| [0, 1, 2].map(|band| value[band].as_f64().unwrap());
    let mut textures = BTreeSet::new();
    for line in &lines {
        let [white, shiny] = ["white", "shiny"].map(|name| bands(&line["materials_kd"][name]));
        assert_ne!(white, shiny, "each has its own draw");
        for [r, g, b] in [white, shiny] {
            let share = (r - 0.2) / 0.5;
            assert!((0.0..=1.0).contains(&share));
            // One draw for all bands.
            assert!((g - 0.2 - 0.4 * share).abs() < 1e-12 && (b - 0.2 - 0.3 * share).abs() < 1e-12);
        }
        let ks = bands(&line["materials_ks"]["shiny"]);
        assert!(ks.iter().all(|ks| (0.1..=0.3).contains(ks)) && ks[0] != ks[1]);
        let shininess = line["materials_shininess"]["white"].as_f64().unwrap();
        assert!((10.0..=100.0).contains(&shininess));
        assert_eq!(line["materials_shininess"]["shiny"], Value::Null);
        let texture = line["materials_texture"]["white"].as_str().unwrap();
        textures.insert(texture.to_owned());
        let file = jobs.path("set").join(line["file"].as_str().unwrap());
        let image = LayeredImage::read(file).unwrap();
        let radiance = &image.layer("radiance").unwrap().values;
        let [red, green] = [0, 1].map(|band| radiance.iter().skip(band).step_by(3).sum::<f32>());
        assert_eq!(
            texture == "red.png",
            green < 0.5 * red,
            "{texture}: {red} and {green}"
        );
    }
    assert_eq!(textures.len(), 3);
    // A file of the list that changes makes its frames again.
    let image = image::RgbImage::from_pixel(2, 2, image::Rgb([0, 250, 0]));
    image.save(jobs.path("red.png")).unwrap();
    let stderr = jobs.succeed("set", &[]);
    assert!(stderr.contains("rendered 12 frames"), "{stderr}");
}

#[test]
fn the_brightest_draw_is_warned_of() {
    let jobs = Jobs::new(
        "[job]\nscene = \"scene.toml\"\nframes = 1\n[[material]]\nname = \"white\"\nks_min = 0\nks_max = 0.5\nshininess_min = 9\nshininess_max = 9\n",
    );
    let stderr = jobs.succeed("set", &[]);
    assert_says(&stderr, &["reflects more than it receives"]);
}

#[test]
fn a_job_sets_the_target_error() {
    let job = |key: &str| format!("[job]\nscene = \"scene.toml\"\nlayers = [\"radiance\"]\n{key}");
    let jobs = Jobs::new(&job("target_error = 0.25\n"));
    jobs.succeed("set", &[]);
    let image = LayeredImage::read(jobs.path("set/frames/000000.exr")).unwrap();
    assert_eq!(image.attribute("camlux.target_error"), Some("0.25"));
    // Another target error is another image.
    jobs.write("job.toml", &job("target_error = 0.5\n"));
    assert!(jobs.succeed("set", &[]).contains("rendered 1 frame"));
    let sum = format!("{SCENE}[indirect]\nestimator = \"rsm-average\"\nrsm_size = 8\n");
    jobs.write("scene.toml", &sum);
    let stderr = jobs.fail("set2", &[]);
    assert!(
        stderr.contains("scene.toml computes indirect light by rsm-average"),
        "{stderr}"
    );
}

#[test]
fn bad_draws_are_refused_with_file_and_line() {
    let job = "[job]\nscene = \"scene.toml\"\nframes = 2\n";
    let material = format!("{job}[[material]]\nname = \"white\"\n");
    let refuses_job =
        |job: &str, words: &[&str]| assert_says(&Jobs::new(job).fail("set", &[]), words);
    rows! { refuses_job;
        format!("{job}target_error = 0\n") =>
            "job.toml:4: \"target_error\" in [job] is 0; give a relRMSE from 0.002 to 0.5";
        material.clone() => "job.toml:4: [[material]] varies nothing";
        format!("{material}kd_min = 0.1\n") =>
            "job.toml:6: \"kd_min\" in [[material]] has no \"kd_max\"; add kd_max";
        format!("{material}kd_min = 0.1\nkd_max = 1.5\n") =>
            "job.toml:7: \"kd_max\" in [[material]] is [1.5, 1.5, 1.5]; give reflectances from 0 to 1";
        format!("{material}shininess_min = -1\nshininess_max = 1\n") =>
            "\"shininess_min\" in [[material]] is -1; give 0 or more";
        format!("{material}ks_min = 0.1\nks_max = 0.2\n") =>
            "which has no shininess; add shininess_min and shininess_max";
        format!("{material}textures = [\"none.png\"]\n") => "job.toml:6: cannot read the texture";
        format!("{material}grey = true\nshininess_min = 1\nshininess_max = 2\n") =>
            "job.toml:6: \"grey\" in [[material]] is given, but no reflectance is drawn";
    }
}
