//! `camlux batch`: cameras that are fixed to each other.

use crate::jobs::{Jobs, SCENE};
use crate::rows::{assert_says, rows};
use camlux::output::{Layer, LayeredImage};

/// A rig that looks along −z and moves to the right, with a light above it.
const RIG: &str = r#"
[camera]
poses = [
    { position = [0.0, 0.0, 3.0], rotation = [1, 0, 0, 0] },
    { position = [0.25, 0.0, 3.0], rotation = [1, 0, 0, 0] },
]
[[rig]]
name = "left"
position = [-0.125, 0.0, 0.0]
[[rig]]
name = "right"
scene = "wide.toml"
position = [0.125, 0.5, 0.0]
rotation = [0.0, 0.28, 0.0, 0.96]
"#;

fn rig(job: &str) -> Jobs {
    let jobs = Jobs::new(job);
    let carried = SCENE.replace(
        "position = [0.5, 1.0, 2.0]",
        "position = [0.0, -1.0, 0.0]\nrelative_to = \"camera\"",
    );
    let sensor = "[sensor]\npixel_pitch_um = [5, 5]\nexposure_time_s = 1e-3\nwavelength_nm = 550\nquantum_efficiency = 0.5\n\
                  [sensor.noise]\nfull_well_e = 1e5\nread_noise_e = 5\n";
    jobs.write("scene.toml", &format!("{carried}{sensor}"));
    let wide = carried.replace("resolution = [16, 16]", "resolution = [24, 16]");
    jobs.write("wide.toml", &format!("{wide}{sensor}"));
    jobs
}

fn image(jobs: &Jobs, file: &str) -> LayeredImage {
    LayeredImage::read(jobs.path(file)).unwrap()
}

#[test]
fn a_camera_of_a_rig_sees_what_it_sees_alone() {
    let jobs = rig(&format!("[job]\nscene = \"scene.toml\"\n{RIG}"));
    jobs.succeed("set", &[]);
    // The rig's light, in the world, and the poses of each camera, by hand.
    for (name, scene, x_m, y_m, rotation) in [
        ("left", "scene.toml", -0.125, 0.0, "[1, 0, 0, 0]"),
        ("right", "wide.toml", 0.125, -0.5, "[0.96, 0, 0.28, 0]"),
    ] {
        for (frame, rig_m) in [(0, 0.0), (1, 0.25)] {
            let x_m = x_m + rig_m;
            let alone = rig(&format!(
                "[job]\nscene = \"alone.toml\"\n[camera]\nposes = [{{ position = [{x_m}, {y_m}, 3.0], rotation = {rotation} }}]\n"
            ));
            let text = String::from_utf8(alone.read(scene)).unwrap();
            let in_world = format!("position = [{rig_m}, 1.0, 3.0]");
            let carried = "position = [0.0, -1.0, 0.0]\nrelative_to = \"camera\"";
            alone.write("alone.toml", &text.replace(carried, &in_world));
            alone.succeed("set", &[]);
            let of_rig = image(&jobs, &format!("set/frames/{name}/{frame:06}.exr"));
            let of_one = image(&alone, "set/frames/000000.exr");
            for layer in [
                Layer::Radiance,
                Layer::Position,
                Layer::Depth,
                Layer::Energy,
            ] {
                let [a, b] = [&of_rig, &of_one].map(|image| image.values(layer).unwrap());
                assert!(a.iter().any(|&value| value != 0.0));
                assert!(a == b, "{name} {frame} {}", layer.name());
            }
        }
    }
}

#[test]
fn a_data_set_of_a_rig_says_where_its_cameras_are() {
    let jobs = rig(&format!("[job]\nscene = \"scene.toml\"\n{RIG}"));
    jobs.succeed("set", &[]);
    let scenes = &jobs.json("set/dataset.json")["scenes"];
    assert_eq!(scenes[1]["file"], "wide.toml");
    assert_eq!(scenes[1]["frames"], "frames/right/");
    let rig = serde_json::json!({
        "name": "right", "position_m": [0.125, 0.5, 0.0], "rotation_xyzw": [0.0, 0.28, 0.0, 0.96],
    });
    assert_eq!(scenes[1]["rig"], rig);
    let lines = jobs.manifest("set/manifest.jsonl");
    for (index, line) in lines.iter().enumerate() {
        let name = ["left", "right"][index % 2];
        assert_eq!(line["index"], index);
        assert_eq!(
            (&line["camera_name"], &line["frame"]),
            (&name.into(), &(index / 2).into())
        );
        assert_eq!(line["file"], format!("frames/{name}/{:06}.exr", index / 2));
        // All cameras of a frame see its light in one place.
        let x_m = 0.25 * (index / 2) as f64;
        assert_eq!(
            line["lights"][0]["position_m"],
            serde_json::json!([x_m, 1.0, 3.0])
        );
    }
    assert_eq!(lines.len(), 4);
    let seed = |name| {
        let image = image(&jobs, &format!("set/frames/{name}/000000.exr"));
        image
            .attribute("camlux.sensor.noise.seed")
            .map(str::to_owned)
    };
    assert_eq!(
        ["left", "right"].map(seed),
        ["0", "1"].map(|seed| Some(seed.to_owned()))
    );
}

#[test]
fn a_camera_of_a_rig_has_layers_of_its_own() {
    let job = format!("[job]\nscene = \"scene.toml\"\nlayers = [\"radiance\", \"uv\"]\n{RIG}");
    let own = "layers = [\"depth\", \"id.triangle\", \"flow\"]";
    let jobs = rig(&format!("{job}{own}\n"));
    jobs.succeed("set", &[]);
    let layers = |file: &str| -> Vec<String> {
        let image = image(&jobs, file);
        let layers = image.layers().iter();
        layers.map(|layer| layer.name.clone()).collect()
    };
    let of_right = ["depth", "flow", "id.triangle"];
    assert_eq!(layers("set/frames/left/000001.exr"), ["radiance", "uv"]);
    assert_eq!(layers("set/frames/right/000001.exr"), of_right);
    let scenes = jobs.json("set/dataset.json")["scenes"].clone();
    let listed = scenes[1]["layers"].as_object().expect("a table");
    assert!(
        listed.len() == 3 && of_right.iter().all(|name| listed.contains_key(*name)),
        "{listed:?}"
    );
    // Another list of one camera leaves the frames of the other.
    jobs.write("job.toml", &job);
    let said = jobs.succeed("set", &[]);
    assert!(said.contains("rendered 2 frames"), "{said}");
    assert_eq!(layers("set/frames/right/000001.exr"), ["radiance", "uv"]);
    jobs.write("job.toml", &format!("{job}layers = [\"tof0.range\"]\n"));
    let said = "no layer tof0.range; give the scene time of flight";
    assert_says(&jobs.fail("other", &[]), &[said]);
}

#[test]
fn rigs_that_make_no_sense_are_refused() {
    let refused = |job: &String, said: &[&str]| assert_says(&rig(job).fail("set", &[]), said);
    let job = "[job]\nscene = \"scene.toml\"\n";
    rows! { refused;
        format!("{job}[[rig]]\nposition = [0, 0, 0]\n") => "job.toml:3: [[rig]] has no \"name\"";
        format!("{job}[[rig]]\nname = \"a/b\"\n") => "job.toml:4: \"name\" in [[rig]] is \"a/b\"", "name of a folder";
        format!("{job}[[rig]]\nname = \"a\"\n[[rig]]\nname = \"a\"\n") =>
            "\"a\", and another one has this name; give each camera a name of its own";
        format!("{job}[[rig]]\nname = \"a\"\nrotation = [0, 0, 0, 2]\n") => "job.toml:5", "length 1";
        format!("{job}[[rig]]\nname = \"a\"\nlook_at = [0, 0, 0]\n") => "unknown key \"look_at\" in [[rig]]";
        format!("{job}[[rig]]\nname = \"a\"\nlayers = [\"x\"]\n") =>
            "job.toml:5: \"layers\" in [[rig]] names no layer: \"x\"";
        "[job]\n[[rig]]\nname = \"a\"\n".to_owned() => "job.toml:2: [[rig]] has no \"scene\"", "scene to [job]";
        "[job]\nscenes = [\"scene.toml\"]\n[[rig]]\nname = \"a\"\n".to_owned() =>
            "job.toml:2: \"scenes\" in [job] is not allowed beside [[rig]]";
    }
}
