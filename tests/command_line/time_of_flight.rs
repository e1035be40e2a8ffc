//! The program with time-of-flight scenes.

use std::path::Path;

use camlux::output::LayeredImage;

use crate::jobs::{Jobs, SCENE};
use crate::program::{assert_succeeds, program, stderr};
use crate::rows::{assert_says, rows};

/// Renders the demo scene after a change, and returns stderr.
fn render(folder: &Path, change: impl Fn(String) -> String, arguments: &str) -> String {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let text = std::fs::read_to_string(scenes.join("tof_corner.toml")).unwrap();
    let text = text.replace("path = \"", &format!("path = \"{}/", scenes.display()));
    std::fs::write(folder.join("scene.toml"), change(text)).unwrap();
    let output = program(folder, &["render", "scene.toml"])
        .args(["-o", "a.exr", "--png", "a.png"])
        .args(arguments.split(' '))
        .output();
    assert_succeeds(&output.unwrap())
}

/// Without a bounce there is no multipath error. The preview has a useful size for every image size.
#[test]
fn a_preview_of_direct_light_has_range_and_amplitude() {
    let folder = tempfile::tempdir().unwrap();
    let without_bounce = |text: String| text.split("[indirect]").next().unwrap().to_owned();
    for (size, width, height) in [("48 36", 240, 180), ("1 700", 240, 700), ("1 1", 240, 240)] {
        let stderr = render(folder.path(), without_bounce, &format!("--size {size}"));
        assert!(stderr.contains("range | amplitude, one row"), "{stderr}");
        let preview = image::open(folder.path().join("a.png")).unwrap();
        let due = (2 * (width + 12) + 12, 2 * (20 + height + 40) + 12);
        assert_eq!((preview.width(), preview.height()), due, "{size}");
    }
}

#[test]
fn the_preview_has_range_amplitude_and_multipath_error_of_each_frequency() {
    let folder = tempfile::tempdir().unwrap();
    let stderr = render(
        folder.path(),
        |text| text,
        "--size 48 36 --target-error 0.1",
    );
    assert_says(&stderr, &["range | amplitude | multipath error"]);

    let image = LayeredImage::read(folder.path().join("a.exr")).unwrap();
    // Walls that light each other appear too far away.
    let mpi = &image.layer("tof0.mpi").unwrap().values;
    let mean = mpi.iter().sum::<f32>() / mpi.len() as f32;
    assert!((0.03..0.3).contains(&mean), "{mean}");

    let preview = image::open(folder.path().join("a.png")).unwrap().to_rgb8();
    // Small frames are enlarged: 48 pixels to 240, with margins of 12; 36 to 180, with heading and legend.
    assert_eq!(
        preview.dimensions(),
        (3 * (240 + 12) + 12, 2 * (20 + 180 + 40) + 12)
    );
    for row in 0..2 {
        for column in 0..3 {
            let [left, top] = [12 + column * 252, row * 240 + 20];
            let inside = image::imageops::crop_imm(&preview, left, top, 240, 180);
            let pixels = inside.to_image();
            let colors: std::collections::BTreeSet<_> = pixels.pixels().map(|p| p.0).collect();
            assert!(
                colors.len() > 20,
                "row {row}, column {column}: {}",
                colors.len()
            );
        }
    }
}

#[test]
fn a_report_says_how_far_off_the_range_is() {
    let folder = tempfile::tempdir().unwrap();
    render(
        folder.path(),
        |text| text,
        "--size 16 12 --target-error 0.2",
    );
    let output = program(folder.path(), &["report", "scene.toml", "-o", "out"])
        .args(["--quick", "--size", "16", "12"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let read = |name: &str| std::fs::read(folder.path().join("out").join(name)).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&read("report.json")).unwrap();
    let scene = &report["scenes"][0];
    assert_eq!(
        scene["reference"]["range_noise_m"]
            .as_array()
            .unwrap()
            .len(),
        2
    );
    let entries = scene["entries"].as_array().unwrap().iter();
    let of_engine: Vec<_> = entries.filter(|entry| entry["kind"] == "engine").collect();
    assert!(of_engine.len() > 5);
    for entry in of_engine {
        for (i, frequency_hz) in [20e6, 100e6].into_iter().enumerate() {
            let error = &entry["time_of_flight"][i];
            assert_eq!(error["frequency_hz"], frequency_hz);
            let number = |value: &serde_json::Value| value.as_f64().unwrap();
            let median_m = number(&error["range_median_m"]);
            let percentile_m = number(&error["range_p99_m"]);
            assert!(0.0 < median_m && median_m <= percentile_m, "{entry}");
            if entry["series"] == "final-gather" {
                assert!(
                    number(&error["indirect"]["relative_rmse"]) < 0.13,
                    "{error}"
                );
                assert!(median_m < 0.01, "{error}");
            }
        }
    }
    for i in [0, 1] {
        let plot = read(&format!("scene-range-error-tof{i}.svg"));
        assert!(plot.starts_with(b"<svg"));
    }
    let page = String::from_utf8(read("index.html")).unwrap();
    assert!(page.contains("Median error of the range at 100 MHz"));
}

/// A wall that moves away at 10 m/s from a camera and a light at the same point. With an exposure of 10 ms and a readout of 5 ms, each
/// of the four phase images begins 15 ms after the one before.
const MOVING_WALL: &str = r#"
[job]
scene = "scene.toml"
size = [1, 1]
frames = 3
[time]
frame_interval_s = 0.1
readout_time_s = 0.005
[[mesh]]
index = 0
keyframes = [{ frame = 0, position = [0, 0, 0] }, { frame = 2, position = [0, 0, -2] }]
"#;

fn moving_wall(change: impl Fn(&str) -> String) -> Jobs {
    let jobs = Jobs::new(&change(MOVING_WALL));
    let sensor = "[sensor]\npixel_pitch_um = [10, 10]\nexposure_time_s = 0.01\nduty_cycle = 1\nwavelength_nm = 850\nquantum_efficiency = 0.8\n";
    let tof = "[tof]\nfrequencies_mhz = [20]\ncontrast = 0.75\nband = \"R\"\n";
    let scene = SCENE.replace("[0.5, 1.0, 2.0]", "[0.0, 0.0, 3.0]");
    jobs.write("scene.toml", &format!("{scene}{sensor}{tof}"));
    jobs
}

/// Both taps of phase image `phase` in closed form: the mean over the wall's positions at these times, s.
fn taps_due(times_s: &[f64], phase: usize) -> [f64; 2] {
    let per_time = times_s.iter().map(|time_s| {
        let distance_m = 3.0 + 10.0 * time_s;
        let irradiance = 50.0 / (4.0 * std::f64::consts::PI * distance_m.powi(2));
        let radiance = 0.7 / std::f64::consts::PI * irradiance;
        // A pixel of 10 µm exposed for 10 ms, and η·λ/(h·c) electrons per joule.
        let charge = radiance * 1e-10 * 0.01 * 0.8 * 850e-9 / (6.62607015e-34 * 299_792_458.0);
        let turns = 20e6 * 2.0 * distance_m / 299_792_458.0 + phase as f64 / 4.0;
        let difference = 0.75 * charge * (std::f64::consts::TAU * turns).cos();
        [0.5 * (charge + difference), 0.5 * (charge - difference)]
    });
    let sum = per_time.fold([0.0; 2], |sum, taps| [sum[0] + taps[0], sum[1] + taps[1]]);
    sum.map(|sum| sum / times_s.len() as f64)
}

#[test]
fn each_phase_image_of_a_batch_has_its_own_time() {
    for (samples, shares) in [(1, &[0.5][..]), (2, &[0.25, 0.75])] {
        let sampled =
            |job: &str| job.replace("[time]", &format!("[time]\ntemporal_samples = {samples}"));
        let jobs = moving_wall(sampled);
        jobs.succeed("set", &[]);
        let mut range_m = [0.0; 2];
        for (frame, range_m) in range_m.iter_mut().enumerate() {
            let image =
                LayeredImage::read(jobs.path(&format!("set/frames/{frame:06}.exr"))).unwrap();
            let begin_s = 0.1 * frame as f64;
            let mut differences = [0.0; 4];
            for (phase, difference) in differences.iter_mut().enumerate() {
                let start_s = 0.015 * phase as f64;
                let attribute = format!("camlux.tof0.phase{phase}.start_s");
                let in_header: f64 = image.attribute(&attribute).unwrap().parse().unwrap();
                assert!((in_header - start_s).abs() < 1e-12, "{in_header}");
                let times_s = shares.iter().map(|share| begin_s + start_s + 0.01 * share);
                let due = taps_due(&times_s.collect::<Vec<_>>(), phase);
                let layer = image.layer(&format!("tof0.phase{phase}")).unwrap();
                for (tap, due) in layer.values.iter().zip(due) {
                    assert!((f64::from(*tap) / due - 1.0).abs() < 1e-5, "{tap} {due}");
                }
                *difference = due[0] - due[1];
            }
            let [d0, d1, d2, d3] = differences;
            let phase_rad = f64::atan2(d3 - d1, d0 - d2).rem_euclid(std::f64::consts::TAU);
            let due_m = 299_792_458.0 / (4.0 * std::f64::consts::PI * 20e6) * phase_rad;
            *range_m = image
                .values(camlux::output::Layer::from_name("tof0.range").unwrap())
                .unwrap()[0];
            assert!(
                (f64::from(*range_m) - due_m).abs() < 1e-4,
                "{range_m} {due_m}"
            );
            // `half_path` is that at the beginning of the frame.
            let half_path_m = image.layer("half_path").unwrap().values[0];
            assert!((f64::from(half_path_m) - (3.0 + 10.0 * begin_s)).abs() < 1e-5);
        }
        // The wall's mean distance is 3.275 m, but the phase images show it at different distances, so the range is wrong.
        assert!((range_m[0] - 3.275).abs() > 0.05, "{range_m:?}");
    }
}

#[test]
fn a_data_set_says_how_its_phase_images_were_taken() {
    let jobs = moving_wall(str::to_owned);
    jobs.succeed("set", &[]);
    let set = jobs.json("set/dataset.json");
    let tof = &set["scenes"][0]["time_of_flight"];
    assert_eq!(tof["frequencies_hz"][0], 20e6);
    assert_eq!(tof["exposure_time_s"], 0.01);
    let numbers = |key: &str| -> Vec<f64> { serde_json::from_value(tof[key].clone()).unwrap() };
    let (starts_s, delays_rad) = (numbers("phase_image_starts_s"), numbers("delays_rad"));
    assert_eq!((starts_s.len(), delays_rad.len()), (4, 4));
    assert!((starts_s[3] - 0.045).abs() < 1e-12, "{starts_s:?}");
    assert!(
        (delays_rad[3] - 1.5 * std::f64::consts::PI).abs() < 1e-12,
        "{delays_rad:?}"
    );
    assert!(tof["convention"].as_str().unwrap().starts_with("Z = sum"));
    let lines = jobs.manifest("set/manifest.jsonl");
    assert_eq!(lines[0]["lights"][0]["modulated"], true);
}

#[test]
fn a_batch_spends_nothing_on_phase_images_where_nothing_moves() {
    let timed = moving_wall(|job| job.into());
    let plain = moving_wall(|job| {
        let (before, time) = job.split_once("[time]").unwrap();
        format!("{before}[[mesh]]{}", time.split_once("[[mesh]]").unwrap().1)
    });
    timed.succeed("set", &[]);
    plain.succeed("set", &[]);
    // The last frame is at the last keyframe, so nothing moves in it.
    let [timed, plain] = [&timed, &plain].map(|jobs| {
        let image = LayeredImage::read(jobs.path("set/frames/000002.exr")).unwrap();
        let bits = image.layers().iter().map(|layer| {
            let bits = layer.values.iter().map(|value| value.to_bits());
            (layer.name.clone(), bits.collect::<Vec<_>>())
        });
        bits.collect::<Vec<_>>()
    });
    assert_eq!(timed, plain);
}

#[test]
fn times_that_cannot_be_are_refused() {
    let refused = |(from, to): &(&str, &str), words: &[&str]| {
        let jobs = moving_wall(|job| job.replacen(from, to, 1));
        assert_says(&jobs.fail("set", &[]), words);
    };
    rows! { refused;
        ("interval_s = 0.1", "interval_s = 0.05") => "4 phase images of scene.toml take 60.0 ms";
        ("interval_s = 0.1", "interval_s = 0") => "\"frame_interval_s\" in [time] is 0";
        ("time_s = 0.005", "time_s = -1") => "\"readout_time_s\" in [time] is -1";
        ("[time]", "[time]\ntemporal_samples = 0") => "\"temporal_samples\" in [time] is 0";
        ("frame_interval_s = 0.1", "") => "frame_interval_s";
        ("readout_time_s", "readout_s") => "readout_time_s";
    }
    let jobs = moving_wall(|job| job.into());
    jobs.write("scene.toml", SCENE);
    let stderr = jobs.fail("set", &[]);
    assert!(stderr.contains("scene.toml has no exposure"), "{stderr}");
    let sensor = "[sensor]\npixel_pitch_um = [10, 10]\nexposure_time_s = 0.01\nduty_cycle = 1\n";
    jobs.write("scene.toml", &format!("{SCENE}{sensor}"));
    let stderr = jobs.fail("set", &[]);
    assert_says(&stderr, &["readout_time_s separates phase images"]);
}

const TOF: &str = r#"
[sensor]
pixel_pitch_um = [10.0, 10.0]
exposure_time_s = 1.0e-3
duty_cycle = 0.5
wavelength_nm = 850.0
quantum_efficiency = 0.5
[tof]
frequencies_mhz = [20.0]
contrast = 0.9
band = "R"
"#;

/// A job that moves the camera away from the light at its lens is probably wrong; one with two devices, or one that moves the light too, is not.
#[test]
fn a_job_that_leaves_the_light_of_the_camera_behind_says_so() {
    let camera = "[job]\nscene = \"scene.toml\"\n[camera]\nposes = [{ position = [0.0, 0.0, 3.0] }, { position = [0.5, 0.0, 3.0] }]\n";
    let jobs = Jobs::new(camera);
    let at = |light: &str| SCENE.replace("position = [0.5, 1.0, 2.0]", light) + TOF;
    let both = format!(
        "{camera}[[light]]\nindex = 0\nposes = [{{ position = [0.0, 0.0, 3.0] }}, {{ position = [0.5, 0.0, 3.0] }}]\n"
    );
    let at_lens = "position = [0.0, 0.0, 3.0]";
    for (light, job, is_said) in [
        (at_lens, camera, true),
        ("position = [0.0, 0.01, 3.0]", camera, true),
        (
            "relative_to = \"camera\"\nposition = [0, 0, 0]",
            camera,
            false,
        ),
        ("position = [0.3, 0.0, 3.0]", camera, false),
        (at_lens, &both[..], false),
        (at_lens, "[job]\nscene = \"scene.toml\"\n", false),
    ] {
        jobs.write("scene.toml", &at(light));
        jobs.write("job.toml", job);
        let _ = std::fs::remove_dir_all(jobs.path("set"));
        let stderr = jobs.succeed("set", &[]);
        let said = stderr.contains("light 0 is at the lens of the time-of-flight camera");
        assert_eq!(said, is_said, "{light}: {stderr}");
    }
}

/// All lamps off: black frames with depth, in the plan no pass for light, and a data set.
#[test]
fn lamps_that_are_off_render_black() {
    let jobs = Jobs::new(
        "[job]\nscene = \"scene.toml\"\n[[light]]\nindex = 0\npower_factors = [0.0, 1.0]\n",
    );
    let indirect = "[indirect]\nestimator = \"final-gather\"\ntarget_error = 0.2\n";
    let lit = format!("{SCENE}{TOF}{indirect}");
    jobs.write("scene.toml", &lit);
    jobs.succeed("set", &[]);
    let read = |file: &str| LayeredImage::read(jobs.path(file)).unwrap();
    let [dark, bright] = ["set/frames/000000.exr", "set/frames/000001.exr"].map(read);
    let values = |image: &LayeredImage, name: &str| image.layer(name).unwrap().values.clone();
    assert!(values(&dark, "radiance").iter().all(|&value| value == 0.0));
    assert!(
        values(&dark, "tof0.range")
            .iter()
            .all(|value| value.is_nan())
    );
    assert_eq!(values(&dark, "depth"), values(&bright, "depth"));
    assert!(values(&bright, "radiance").iter().any(|&value| value > 0.0));
    assert_eq!(
        jobs.manifest("set/manifest.jsonl")[0]["estimated_error"],
        serde_json::Value::Null
    );

    let begin = lit.find("[[light]]").unwrap();
    let end = lit.find("[[mesh]]").unwrap();
    jobs.write("none.toml", &format!("{}{}", &lit[..begin], &lit[end..]));
    jobs.write("off.toml", &lit.replace("power_w = 50.0", "power_w = 0.0"));
    for scene in ["none.toml", "off.toml"] {
        let plan = jobs.program(&["render", scene, "--plan"]).output().unwrap();
        let plan = String::from_utf8(plan.stdout).unwrap();
        assert!(plan.contains("lights: none emits anything"), "{plan}");
        assert!(
            !plan.contains("  direct  ") && !plan.contains("final_gather"),
            "{plan}"
        );
        let output = jobs
            .program(&["render", scene, "-o", "one.exr"])
            .output()
            .unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(
            output.status.success() && stderr.contains("black"),
            "{stderr}"
        );
        assert_eq!(values(&read("one.exr"), "depth"), values(&bright, "depth"));
        let _ = std::fs::remove_file(jobs.path("reference.exr"));
        let reference = ["reference", scene, "-o", "reference.exr", "--spp", "32"];
        let output = jobs.program(&reference).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{stderr}");
        assert!(
            values(&read("reference.exr"), "radiance")
                .iter()
                .all(|&value| value == 0.0)
        );
    }
}
