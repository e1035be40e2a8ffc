//! `camlux batch`: the data sets that it writes, and its messages about bad jobs.
#![cfg(feature = "cli")]

use std::fs;

use crate::jobs::{JOB, JOB_FRAMES, Jobs, SCENE, files_below};
use crate::rows::{assert_says, rows};
use camlux::output::LayeredImage;
use exr::prelude::{FlatImage, read_all_flat_layers_from_file};
use glam::{DQuat, DVec3};
use serde_json::json;

fn pixels(image: &FlatImage) -> String {
    format!("{:?}", image.layer_data[0].channel_data)
}

#[test]
fn a_job_becomes_a_data_set() {
    let jobs = Jobs::new(JOB);
    let stderr = jobs.succeed("set", &[]);
    assert!(stderr.contains("rendered 12 frames"), "{stderr}");
    assert_says(&stderr, &["frames/s", "GPU"]);
    let mut expected: Vec<String> = (0..JOB_FRAMES).map(|i| format!("{i:06}.exr")).collect();
    expected.extend(["dataset.json".into(), "manifest.jsonl".into()]);
    assert_eq!(files_below(&jobs.path("set")), expected);

    let lines = jobs.manifest("set/manifest.jsonl");
    assert_eq!(lines.len(), JOB_FRAMES);
    for (index, line) in lines.iter().enumerate() {
        assert_eq!(line["index"], index);
        assert_eq!(line["file"], format!("frames/{index:06}.exr"));
        assert_eq!(line["seed"], 3);
        assert_eq!(line["estimated_error"], json!(null));
        assert!(line["ms"].as_f64().unwrap() > 0.0);
        assert_eq!(line["camera"]["intrinsics_px"]["cx"], 8.0);
        let height_m = line["lights"][0]["position_m"][1].as_f64().unwrap();
        assert!((0.5..1.5).contains(&height_m));
    }
    let hashes = jobs.hashes("set");
    let different: std::collections::BTreeSet<_> = hashes.values().collect();
    assert_eq!(different.len(), JOB_FRAMES, "no two frames are the same");

    let dataset = jobs.json("set/dataset.json");
    assert_eq!(dataset["frame_count"], JOB_FRAMES);
    assert_eq!(dataset["job"]["text"], JOB);
    assert_eq!(
        dataset["scenes"][0]["layers"]["radiance"]["unit"],
        "W/sr/m^2"
    );
    assert_eq!(dataset["engine_hash"].as_str().unwrap().len(), 64);
}

/// Compares each frame with `camlux render` of a scene file with the same values.
#[test]
fn frames_are_the_images_of_camlux_render() {
    let job = r#"
        [job]
        scene = "scene.toml"
        compression = "piz"
        [camera]
        poses = [
            { position = [0.5, 0.25, 2.0], look_at = [0.0, 0.5, 0.0] },
            { position = [0.5, 0.25, 4.0], look_at = [0.0, 0.5, 0.0], up = [1.0, 1.0, 0.0] },
        ]
        [[light]]
        index = 0
        poses = [{ position = [0.0, 0.0, 1.5] }, { position = [0.0, -0.5, 2.5] }]
        power_factors = [0.5, 2.0]
        [[mesh]]
        index = 0
        poses = [
            { position = [0.0, 0.0, 0.0] },
            { position = [0.125, 0.25, -0.5], rotation = [0.0, 0.0, 1.0, 0.0] },
        ]
        [[sweep]]
        material = "white"
        kd = [0.25, [0.5, 0.75, 1.0]]
    "#;
    let jobs = Jobs::new(job);
    jobs.succeed("set", &[]);
    assert_eq!(jobs.hashes("set").len(), 4);
    let poses = [
        (
            "[0.5, 0.25, 2.0]",
            "[0.0, 1.0, 0.0]",
            "[0.0, 0.0, 1.5]",
            25.0,
            "",
        ),
        (
            "[0.5, 0.25, 4.0]",
            "[1.0, 1.0, 0.0]",
            "[0.0, -0.5, 2.5]",
            100.0,
            "rotate_deg = [0.0, 0.0, 180.0]\ntranslate = [0.125, 0.25, -0.5]",
        ),
    ];
    for (step, kd) in ["0.25", "[0.5, 0.75, 1.0]"].iter().enumerate() {
        for (frame, (position, up, light, power, place)) in poses.iter().enumerate() {
            let scene = SCENE
                .replace("[0.0, 0.0, 3.0]", position)
                .replace("look_at = [0.0, 0.0, 0.0]", "look_at = [0.0, 0.5, 0.0]")
                .replace("up = [0.0, 1.0, 0.0]", &format!("up = {up}"))
                .replace("[0.5, 1.0, 2.0]", light)
                .replace("50.0\n[[mesh]]", &format!("{power:?}\n[[mesh]]\n{place}"))
                .replace("kd = 0.7", &format!("kd = {kd}"));
            jobs.write("one.toml", &scene);
            let render = ["render", "one.toml", "-o", "one.exr"];
            assert!(jobs.program(&render).output().unwrap().status.success());
            let number = 2 * step + frame;
            let [one, of_batch] = ["one.exr".into(), format!("set/frames/{number:06}.exr")]
                .map(|name| read_all_flat_layers_from_file(jobs.path(&name)).unwrap());
            // In the rotation of the scene file, sin(180°) is 1e-16 instead of 0. An f32 does not keep this difference.
            assert!(
                pixels(&one) == pixels(&of_batch),
                "frame {number}:\n{scene}"
            );
        }
    }
}

#[test]
fn several_scenes_have_folders_of_their_own() {
    let jobs = Jobs::new(
        "[job]\nscenes = [\"scene.toml\", \"dark.toml\"]\nframes = 2\n[camera]\nrandom = { min = [-1, -1, 2], max = [1, 1, 3], look_at = [0, 0, 0] }\n",
    );
    jobs.write("dark.toml", &SCENE.replace("kd = 0.7", "kd = 0.1"));
    jobs.succeed("set", &[]);
    let lines = jobs.manifest("set/manifest.jsonl");
    let seen: Vec<(&str, &str)> = lines
        .iter()
        .map(|l| (l["scene"].as_str().unwrap(), l["file"].as_str().unwrap()))
        .collect();
    let expected = [
        ("scene.toml", "frames/scene/000000.exr"),
        ("scene.toml", "frames/scene/000001.exr"),
        ("dark.toml", "frames/dark/000000.exr"),
        ("dark.toml", "frames/dark/000001.exr"),
    ];
    assert_eq!(seen, expected);
    assert_eq!(jobs.hashes("set").len(), 4);
    jobs.write(
        "job.toml",
        "[job]\nscenes = [\"scene.toml\", \"../scene.toml\"]\n",
    );
    let stderr = jobs.fail("set2", &[]);
    assert_says(&stderr, &["job.toml:2: ", "different names"]);
}

#[test]
fn shards_share_the_frames() {
    let jobs = Jobs::new(JOB);
    let mut frames = Vec::new();
    for shard in ["1/3", "2/3", "3/3"] {
        let listed = [
            "batch",
            "job.toml",
            "--dry-run",
            "--frames",
            "2..11",
            "--shard",
            shard,
        ];
        let output = jobs.program(&listed).output().unwrap();
        for line in String::from_utf8(output.stdout).unwrap().lines() {
            let (index, _) = line.split_once(' ').unwrap();
            frames.push(index.parse::<u64>().unwrap());
        }
    }
    assert_eq!(frames[..3], [3, 6, 9]);
    frames.sort();
    assert_eq!(frames, (2..11).collect::<Vec<_>>());
    let stderr = jobs.fail("set", &["--frames", "2..13"]);
    assert!(stderr.contains("2..13: the job has 12 frames"), "{stderr}");
}

/// The noise of the sensor depends on the index of the frame, not on which other frames are rendered.
#[test]
fn time_of_flight_has_noise_of_its_own_in_each_frame() {
    let jobs = Jobs::new("[job]\nscene = \"scene.toml\"\nframes = 3\n");
    let sensor = "[sensor]\npixel_pitch_um = [10, 10]\nexposure_time_s = 1e-3\nduty_cycle = 1\nwavelength_nm = 850\nquantum_efficiency = 0.8\n";
    let tof = "[tof]\nfrequencies_mhz = [20]\ncontrast = 0.75\nband = \"R\"\noutput = \"dn\"\n";
    let noise = "[tof.noise]\ndark_e_per_s = 0\nread_noise_e = 5\nfull_well_e = 1e5\ngain_dn_per_e = 0.1\nblack_level_dn = 10\nbits = 12\n";
    jobs.write("scene.toml", &format!("{SCENE}{sensor}{tof}{noise}"));
    jobs.succeed("all", &[]);
    jobs.succeed("shard", &["--shard", "2/3"]);
    let file = |set: &str, i: usize| jobs.path(&format!("{set}/frames/{i:06}.exr"));
    let taps = |i| {
        let image = LayeredImage::read(file("all", i)).unwrap();
        image.layer("tof0.phase0").unwrap().values.clone()
    };
    assert_ne!(taps(0), taps(1));
    assert_ne!(taps(1), taps(2));
    let of_shard = (0..3).find(|&i| file("shard", i).exists()).unwrap();
    let bytes = |set| fs::read(file(set, of_shard)).unwrap();
    assert!(bytes("all") == bytes("shard"), "frame {of_shard}");
    let dataset = jobs.json("all/dataset.json");
    assert_eq!(dataset["scenes"][0]["layers"]["tof0.phase0"]["unit"], "DN");
    assert_eq!(dataset["scenes"][0]["layers"]["tof0.range"]["unit"], "m");
}

#[test]
fn nonsense_for_frames_and_shards_is_wrong_usage() {
    let jobs = Jobs::new(JOB);
    let frames = ["", "5", "5..5", "6..5", "a..b", "1..=2"].map(|text| format!("--frames={text}"));
    let shards = ["", "0/4", "5/4", "1", "1/0", "-1/4"].map(|text| format!("--shard={text}"));
    for argument in frames.iter().chain(&shards) {
        let output = jobs.run("set", &[argument]);
        assert_eq!(output.status.code(), Some(2), "{argument}");
    }
}

/// The random camera poses of 10 000 frames, as a dry run lists them.
fn drawn_poses(jobs: &Jobs, seed: u32, more: &str) -> Vec<(DVec3, DQuat)> {
    jobs.write(
        "job.toml",
        &format!(
            "[job]\nscene = \"scene.toml\"\nframes = 10000\nseed = {seed}\n[camera]\n{DRAWN}{more}"
        ),
    );
    let output = jobs.program(&["batch", "job.toml", "--dry-run"]).output();
    let stdout = String::from_utf8(output.unwrap().stdout).unwrap();
    let poses = stdout.lines().map(|line| {
        let (_, pose) = line.split_once("position = ").unwrap();
        let words = pose.split(|c: char| !(c.is_ascii_digit() || "-.e".contains(c)));
        let numbers: Vec<f64> = words.filter_map(|word| word.parse().ok()).collect();
        (
            DVec3::from_slice(&numbers),
            DQuat::from_slice(&numbers[3..]),
        )
    });
    poses.collect()
}

const DRAWN: &str = "random = { min = [2, 2, 2], max = [4, 4, 4], turn = \"any\" }\n";

#[test]
fn draws_are_even_and_depend_on_seed_frame_and_purpose() {
    let jobs = Jobs::new("");
    let poses = drawn_poses(&jobs, 7, "");
    assert_eq!(poses.len(), 10_000);
    assert_ne!(poses[0], poses[1]);
    assert_ne!(poses[0], drawn_poses(&jobs, 8, "")[0]);
    for axis in 0..3 {
        let values = poses.iter().map(|(position_m, _)| position_m[axis]);
        assert!(values.clone().all(|value| (2.0..4.0).contains(&value)));
        let mean = values.sum::<f64>() / 1e4;
        // Six standard errors of the mean of a uniform distribution of width 2.
        assert!(
            (mean - 3.0).abs() < 6.0 * 2.0 / 12_f64.sqrt() / 100.0,
            "{mean}"
        );
    }
    // The mean of a randomly rotated axis is zero.
    assert!(poses.iter().all(|(_, q)| (q.length() - 1.0).abs() < 1e-15));
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        let mean = poses.iter().map(|(_, q)| *q * axis).sum::<DVec3>() / 1e4;
        assert!(mean.length() < 6.0 / 100.0, "{axis}: {mean}");
    }
    // Random values of a light do not change those of the camera.
    let light = format!("[[light]]\nindex = 0\n{DRAWN}");
    assert_eq!(poses, drawn_poses(&jobs, 7, &light));
    jobs.succeed("set", &["--frames", "0..1"]);
    let line = &jobs.manifest("set/manifest.jsonl")[0];
    assert_ne!(
        line["lights"][0]["position_m"],
        line["camera"]["position_m"]
    );
}

fn refuses_job(job: &str, words: &[&str]) {
    let jobs = Jobs::new(job);
    jobs.write("bad.txt", "# rows\n0 0 0 0 0 0 0 1\n1 x 0 0 0 0 0 1\n");
    let stderr = jobs.fail("set", &[]);
    assert_says(&stderr, words);
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!(!jobs.path("set").exists());
}

#[test]
fn bad_jobs_are_refused_with_file_and_line() {
    rows! { refuses_job;
        "[job]\n" => "job.toml:1: [job] has no \"scene\"";
        SCENE => "job.toml: there is no [job] table; add it, or give a scene file to camlux render";
        "[job]\nscene = \"scene.toml\"\n[[light]]\nindex = 0\npower_factors = [1, -2]\n" =>
            "job.toml:5: \"power_factors\" in [[light]] has -2; give factors of 0 or more";
        "[job]\nscene = \"scene.toml\"\nlayers = [\"dept\"]\n" =>
            "job.toml:3: \"layers\" in [job] names no layer: \"dept\"; the layers are radiance, direct";
        "[job]\nscene = \"none.toml\"\n" => "none.toml, which does not exist; check the path";
        "[job]\nscene = \"scene.toml\"\nframe = 3\n" =>
            "job.toml:3: unknown key \"frame\" in [job]; did you mean \"frames\"?";
        "[job]\nscene = \"scene.toml\"\n[camera]\nposes = []\n" => "job.toml:4: \"poses\" is empty";
        "[job]\nscene = \"scene.toml\"\n[camera]\nposes = [{ look_at = [0, 0, 0] }]\n" =>
            "job.toml:4: [[poses]] has no \"position\"";
        "[job]\nscene = \"scene.toml\"\n[camera]\nposes = [{ position = [0, 0, 1], rotation = [0, 0, 0, 2] }]\n" =>
            "job.toml:4: \"rotation\" in [[poses]] is not a rotation: the quaternion [0.0, 0.0, 0.0, 2.0] has length 2.0000";
        "[job]\nscene = \"scene.toml\"\n[camera]\nkeyframes = [\n{ frame = 2, position = [0, 0, 1] },\n{ frame = 2, position = [0, 0, 1] }]\n" =>
            "job.toml:6: \"frame\" in [[keyframes]] is 2, not after";
        "[job]\nscene = \"scene.toml\"\n[camera]\ntrajectory = \"bad.txt\"\n" =>
            "bad.txt:3: \"x\" is not a finite number";
        "[job]\nscene = \"scene.toml\"\n[camera]\ntrajectory = \"none.txt\"\n" =>
            "job.toml:4: cannot read the trajectory none.txt";
        "[job]\nscene = \"scene.toml\"\n[camera]\npath = \"a.txt\"\n" =>
            "job.toml:4: unknown key \"path\" in [camera]; keys not used yet: poses, keyframes, trajectory, random";
        "[job]\nscene = \"scene.toml\"\n[[light]]\nindex = 1\npower_factors = [1]\n" =>
            "job.toml:4: there is no light 1";
        "[job]\nscene = \"scene.toml\"\n[[mesh]]\nindex = 0\n" =>
            "job.toml:3: [[mesh]] has no motion";
        "[job]\nscene = \"scene.toml\"\nframes = 2\n[[material]]\nname = \"whit\"\nkd_min = 0\nkd_max = 1\n" =>
            "job.toml:5: no material \"whit\" in a scene of this job; did you mean \"white\"?";
        "[job]\nscene = \"scene.toml\"\nframes = 2\n[[material]]\nname = \"white\"\nkd_min = 1\nkd_max = 0\n" =>
            "job.toml:6: \"kd_min\" in [[material]] is above \"kd_max\"; swap them";
        "[job]\nscene = \"scene.toml\"\n[[light]]\nindex = 0\npower_factor_range = [1, 2]\n" =>
            "job.toml:1: the number of random frames is missing";
        "[job]\nscene = \"scene.toml\"\nframes = 3\n[[light]]\nindex = 0\npower_factors = [1, 2]\n" =>
            "job.toml:3: \"frames\" in [job] is 3, but a list has only 2 frames";
        "[job]\nscene = \"scene.toml\"\n[[light]]\nindex = 0\npower_factors = [1, 2]\nposes = [{ position = [0, 0, 1] }]\n" =>
            "the lists have 1 and 2 frames";
        "[job]\nscene = \"scene.toml\"\nlayers = [\"indirect\"]\n" => "no layer indirect";
        "[job]\nscene = \"scene.toml\"\nformat = \"hdf5\"\n" =>
            "job.toml:3: unknown format \"hdf5\" in [job]; choose one of: exr, npz";
        "[job]\nscene = \"scene.toml\"\nformat = \"npz\"\ncompression = \"rle\"\n" =>
            "job.toml:4: \"compression\" in [job] is \"rle\", in an npz file; give none or zip, which numpy reads, or leave out format";
        "[job]\nscene = \"scene.toml\"\nplain = true\nformat = \"npz\"\n" =>
            "job.toml:3: \"plain\" in [job] is true, in an npz file; leave out one of them: only OpenEXR files can be plain";
        "[job]\nscene = \"scene.toml\"\nmultipart = true\nformat = \"npz\"\n" =>
            "job.toml:3: \"multipart\" in [job] is true, in an npz file; leave out one of them: only OpenEXR files have parts";
        "[job]\nscene = \"scene.toml\"\nplain = true\nmultipart = true\n" =>
            "job.toml:4: \"multipart\" in [job] is true, beside plain; leave out one of them: a plain file has one part";
        "[job]\nscene = \"scene.toml\"\ncompression = \"dwaa\"\n" =>
            "job.toml:3: unknown compression \"dwaa\" in [job]; choose one of: none, rle, zips, zip, piz";
        "version = 2\n[job]\nscene = \"scene.toml\"\n" =>
            "job.toml:1: job file version 2 is not known; write version = 1";
        "[job]\nscene = \"scene.toml\"\n[[sweep]]\nlight = 0\npower_factors = []\n" =>
            "job.toml:3: [[sweep]] has no values";
    }
}

#[test]
fn a_dry_run_lists_and_estimates_and_writes_nothing() {
    let jobs = Jobs::new(JOB);
    let output = jobs
        .program(&["batch", "job.toml", "--dry-run", "--frames", "3..7"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0));
    let stdout = String::from_utf8(output.stdout).unwrap();
    let indices: Vec<&str> = stdout
        .lines()
        .map(|l| l.split_once(' ').unwrap().0)
        .collect();
    assert_eq!(indices, ["3", "4", "5", "6"]);
    assert!(
        stdout.contains("frames/000003.exr camera position = [-0.45")
            && stdout.contains(", light 0 = {\"kind\":"),
        "{stdout}"
    );
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_says(&stderr, &["4 frames, 3 to 6: about ", " MB"]);
    assert_eq!(
        files_below(jobs.folder.path()),
        ["job.toml", "quad.obj", "scene.toml"]
    );
}

/// A job does not know the frames that a loop has written, and would leave them out of the manifest.
#[test]
fn the_data_set_of_a_loop_is_left_alone() {
    let jobs = Jobs::new(JOB);
    let folder = jobs.path("set");
    fs::create_dir(&folder).unwrap();
    let about = "{\"job\": null, \"frame_count\": 3}";
    fs::write(folder.join("dataset.json"), about).unwrap();
    let stderr = jobs.fail("set", &[]);
    assert_says(&stderr, &["a loop has written; name another folder"]);
    assert_eq!(files_below(&folder), ["dataset.json"]);
    assert_eq!(jobs.read("set/dataset.json"), about.as_bytes());
}

/// A failed frame is recorded in the manifest, and the other frames are rendered. The next run tries it again.
#[test]
fn frames_that_fail_are_recorded() {
    let job =
        "[job]\nscene = \"scene.toml\"\n[[sweep]]\nmaterial = \"white\"\nkd = [0.25, 1.5, 0.75]\n";
    let jobs = Jobs::new(job);
    let dry = jobs.program(&["batch", "job.toml", "--dry-run"]).output();
    let dry = dry.unwrap();
    assert_eq!(dry.status.code(), Some(1));
    let lines = String::from_utf8(dry.stdout).unwrap();
    assert!(lines.contains("kd of white = [0.75,0.75,0.75]"), "{lines}");
    let said = String::from_utf8(dry.stderr).unwrap();
    assert!(said.contains("frame 1 would fail: ") && said.contains("3 frames, 0 to 2: about "));
    let stderr = jobs.fail("set", &[]);
    for says in [
        "frame 1 failed",
        "kd",
        "rendered 2 frames",
        "1 frame failed",
    ] {
        assert!(stderr.contains(says), "{says}: {stderr}");
    }
    let lines = jobs.manifest("set/manifest.jsonl");
    assert_eq!(lines.len(), 3);
    assert!(lines[1]["error"].as_str().unwrap().contains("1.5"));
    assert!(lines[1].get("file").is_none());
    assert!(!jobs.path("set/frames/000001.exr").exists());
    let stderr = jobs.fail("set", &["--merge"]);
    assert!(stderr.contains("1 frame failed: 1"), "{stderr}");

    let stderr = jobs.fail("fast", &["--fail-fast"]);
    assert!(stderr.contains("stopped with 1 frame to go"), "{stderr}");
    assert!(!jobs.path("fast/frames/000002.exr").exists());

    let before = jobs.read("set/frames/000002.exr");
    jobs.write("job.toml", &job.replace("1.5", "0.5"));
    let stderr = jobs.succeed("set", &[]);
    assert_says(&stderr, &["2 of 3 frames are already complete"]);
    assert_eq!(jobs.hashes("set").len(), 3);
    assert_eq!(
        fs::read(jobs.path("set/frames/000002.exr")).unwrap(),
        before
    );
}

#[test]
fn a_contact_sheet_shows_the_frames() {
    let jobs = Jobs::new(JOB);
    let stderr = jobs.succeed("set", &["--contact-sheet", "sheet.png"]);
    assert!(stderr.contains("sheet.png (12 frames)"), "{stderr}");
    let sheet = image::open(jobs.path("sheet.png")).unwrap().to_rgb8();
    // Four columns and three rows of 16 pixels, with gaps of 2 pixels.
    assert_eq!(sheet.dimensions(), (4 * 18 - 2, 3 * 18 - 2));
    for (column, row) in (0..4).flat_map(|column| (0..3).map(move |row| (column, row))) {
        let middle = sheet.get_pixel(18 * column + 8, 18 * row + 8);
        assert!(
            middle.0[0] > 20,
            "frame in {column}, {row} is lit: {middle:?}"
        );
        if column > 0 {
            assert_eq!(sheet.get_pixel(18 * column - 1, 18 * row).0, [0; 3]);
        }
    }
    jobs.write("job.toml", &JOB.replace("seed = 3", "layers = [\"depth\"]"));
    let stderr = jobs.fail("set", &["--contact-sheet", "sheet.png"]);
    assert!(stderr.contains("radiance"), "{stderr}");
}
