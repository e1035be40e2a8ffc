//! Motion in a batch: optical flow, scene flow and motion blur against closed forms, and lights that move with the camera or a mesh.

use std::fs;

use crate::rows::assert_says;
use camlux::glam::{DMat3, DVec2, DVec3};
use camlux::output::{Layer, LayeredImage};

use crate::jobs::{Jobs, SCENE};

/// Focal length of [`SCENE`]'s camera: 16 pixels over 50°. The camera is at z = 3, the quad at z = 0.
const FOCAL_PX: f64 = 17.156_055_364_076_47;

struct Flow {
    positions: Vec<DVec3>,
    flow_px: Vec<DVec2>,
    scene_flow_m: Vec<DVec3>,
    ids: Vec<f32>,
}

fn read(jobs: &Jobs, frame: u32) -> Flow {
    let image = LayeredImage::read(jobs.path(&format!("set/frames/{frame:06}.exr"))).unwrap();
    let vectors = |layer| -> Vec<DVec3> {
        let (values, _) = image.values(layer).unwrap().as_chunks::<3>();
        let vector = |v: &[f32; 3]| DVec3::from(v.map(f64::from));
        values.iter().map(vector).collect()
    };
    let (flow, _) = image.values(Layer::Flow).unwrap().as_chunks::<2>();
    Flow {
        positions: vectors(Layer::Position),
        flow_px: flow.iter().map(|v| DVec2::from(v.map(f64::from))).collect(),
        scene_flow_m: vectors(Layer::SceneFlow),
        ids: image.layer("id.instance").unwrap().values.clone(),
    }
}

#[test]
fn points_move_as_camera_and_mesh_do() {
    let job = r#"
        [job]
        scene = "scene.toml"
        flow = true
        layers = ["P", "id.instance"]
        [camera]
        poses = [
            { position = [0.0, 0.0, 3.0] },
            { position = [0.25, 0.0, 3.0] },
            { position = [0.25, 0.0, 3.0] },
            { position = [0.25, 0.0, 3.0] },
        ]
        [[mesh]]
        index = 0
        poses = [
            { position = [0.0, 0.0, 0.0] },
            { position = [0.0, 0.0, 0.0] },
            { position = [0.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.5, 0.8660254037844386] },
            { position = [0.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.5, 0.8660254037844386] },
        ]
    "#;
    let jobs = Jobs::new(job);
    jobs.succeed("set", &[]);
    let set = jobs.json("set/dataset.json");
    assert_eq!(set["scenes"][0]["layers"]["flow"]["unit"], "px");
    let turn = DMat3::from_rotation_z(std::f64::consts::FRAC_PI_3);
    for frame in 0..4 {
        let Flow {
            positions,
            flow_px,
            scene_flow_m,
            ids,
        } = read(&jobs, frame);
        let mut seen = 0;
        for i in 0..ids.len() {
            if ids[i] == 0.0 || frame == 3 {
                assert!(flow_px[i].is_nan() && scene_flow_m[i].is_nan());
                continue;
            }
            seen += 1;
            let p = positions[i];
            let (due_px, due_m) = match frame {
                // The camera moves to the right, so the image moves to the left by f·0.25/3.
                0 => (DVec2::new(-FOCAL_PX * 0.25 / 3.0, 0.0), DVec3::ZERO),
                // The quad turns by 60° and moves towards the camera.
                1 => {
                    let next = turn * p + DVec3::new(0.0, 0.0, 0.5);
                    let shown = |p: DVec3| DVec2::new(p.x - 0.25, -p.y) * FOCAL_PX / (3.0 - p.z);
                    (shown(next) - shown(p), next - p)
                }
                _ => (DVec2::ZERO, DVec3::ZERO),
            };
            assert!(
                flow_px[i].distance(due_px) < 1e-5,
                "{frame}: {} {due_px}",
                flow_px[i]
            );
            assert!(
                scene_flow_m[i].distance(due_m) < 1e-6,
                "{frame}: {} {due_m}",
                scene_flow_m[i]
            );
            // Where nothing moves, the flow is exactly zero.
            assert!(frame != 2 || flow_px[i] == DVec2::ZERO && scene_flow_m[i] == DVec3::ZERO);
        }
        assert!(frame == 3 || seen > 60, "{seen}");
    }
}

/// Renders a wall that moves away at 10 m/s from a camera and a light at the same point. The exposure is the first half of a frame of 0.1 s.
fn blurred(change: impl Fn(&str) -> String) -> Jobs {
    let job = r#"
        [job]
        scene = "scene.toml"
        size = [1, 1]
        frames = 3
        [time]
        frame_interval_s = 0.1
        temporal_samples = 4
        [[mesh]]
        index = 0
        keyframes = [{ frame = 0, position = [0, 0, 0] }, { frame = 2, position = [0, 0, -2] }]
    "#;
    let jobs = Jobs::new(&change(job));
    let scene = SCENE.replace("[0.5, 1.0, 2.0]", "[0.0, 0.0, 3.0]");
    let sensor = "[sensor]\npixel_pitch_um = [10, 10]\nexposure_time_s = 0.05\nduty_cycle = 1\n\
                  wavelength_nm = 550\nquantum_efficiency = 0.5\nmonochrome = true\n";
    let indirect = "[indirect]\nestimator = \"final-gather\"\ntarget_error = 0.1\n";
    jobs.write("scene.toml", &format!("{scene}{sensor}{indirect}"));
    jobs.succeed("set", &[]);
    jobs
}

#[test]
fn a_frame_is_the_mean_over_its_exposure() {
    let jobs = blurred(str::to_owned);
    for frame in 0..2 {
        let image = LayeredImage::read(jobs.path(&format!("set/frames/{frame:06}.exr"))).unwrap();
        let begin_m = 3.0 + f64::from(frame);
        let radiance_at = |distance_m: f64| {
            let irradiance = 50.0 / (4.0 * std::f64::consts::PI * distance_m.powi(2));
            0.7 / std::f64::consts::PI * irradiance
        };
        let times_s = [1.0, 3.0, 5.0, 7.0].map(|eighth| 0.05 * eighth / 8.0);
        let sum: f64 = times_s
            .iter()
            .map(|t| radiance_at(begin_m + 10.0 * t))
            .sum();
        let due = sum / 4.0;
        for (layer, due) in [
            (Layer::Radiance, due),
            (Layer::Direct, due),
            (Layer::Energy, due * 1e-10 * 0.05),
            // 0.5·λ/(h·c) electrons of a joule, for three bands.
            (
                Layer::RawElectrons,
                3.0 * due * 1e-10 * 0.05 * 0.5 * 550e-9 / (6.626_070_15e-34 * 299_792_458.0),
            ),
        ] {
            let value = f64::from(image.values(layer).unwrap()[0]);
            assert!((value / due - 1.0).abs() < 1e-5, "{layer:?} {value} {due}");
        }
        // A flat wall cannot light itself, so there is no indirect light.
        assert_eq!(image.values(Layer::Indirect).unwrap()[0], 0.0);
        assert_eq!(image.attribute("camlux.estimator"), Some("final-gather"));
        // The other layers show the beginning of the frame.
        let depth_m = f64::from(image.values(Layer::Depth).unwrap()[0]);
        assert!((depth_m / begin_m - 1.0).abs() < 1e-6, "{depth_m}");
    }
    // Nothing moves after the last keyframe.
    let plain = blurred(|job| {
        let (before, time) = job.split_once("[time]").unwrap();
        format!("{before}[[mesh]]{}", time.split_once("[[mesh]]").unwrap().1)
    });
    let [timed, plain] = [&jobs, &plain].map(|jobs| {
        let image = LayeredImage::read(jobs.path("set/frames/000002.exr")).unwrap();
        let values = |layer| image.values(layer).unwrap().to_vec();
        [values(Layer::Radiance), values(Layer::Energy)]
    });
    assert_eq!(timed, plain);
}

#[test]
fn motion_blur_averages_the_light_of_each_bounce() {
    let jobs = Jobs::new(
        r#"
        [job]
        scene = "scene.toml"
        size = [16, 12]
        frames = 1
        layers = ["indirect", "indirect.1", "indirect.2"]
        [time]
        frame_interval_s = 0.1
        temporal_samples = 2
        [camera]
        keyframes = [
            { frame = 0, position = [0.0, 1.0, 3.2], look_at = [0.0, 1.0, 0.0] },
            { frame = 1, position = [0.4, 1.0, 3.0], look_at = [0.0, 1.0, 0.0] },
        ]
    "#,
    );
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");
    let scene = fs::read_to_string(format!("{folder}/cornell_spot.toml")).unwrap();
    let scene = scene.replace("cornell.obj", &format!("{folder}/cornell.obj"));
    jobs.write(
        "scene.toml",
        &format!("{scene}\nbounces = 2\ntarget_error = 0.1\n"),
    );
    jobs.succeed("set", &[]);
    let image = LayeredImage::read(jobs.path("set/frames/000000.exr")).unwrap();
    let sum = |name| {
        let values = image.values(Layer::from_name(name).unwrap()).unwrap();
        values.iter().copied().map(f64::from).sum::<f64>()
    };
    let [whole, first, second] = ["indirect", "indirect.1", "indirect.2"].map(sum);
    assert!(0.0 < second && second < first, "{first} {second}");
    assert!(
        (first + second - whole).abs() < 0.1 * whole,
        "{whole} {first} {second}"
    );
}

/// In every frame, one light keeps its position relative to the camera, and another its position relative to the mesh.
#[test]
fn lights_go_with_what_carries_them() {
    let job = r#"
        [job]
        scene = "scene.toml"
        [camera]
        poses = [
            { position = [0.0, 0.0, 3.0], look_at = [0.0, 0.0, 0.0] },
            { position = [0.5, 0.25, 4.0], look_at = [0.0, 0.5, 0.0], up = [1.0, 1.0, 0.0] },
        ]
        [[mesh]]
        index = 0
        poses = [
            { position = [0.0, 0.0, 0.0] },
            { position = [0.125, 0.25, -0.5], rotation = [0.0, 0.0, 1.0, 0.0] },
        ]
    "#;
    let jobs = Jobs::new(job);
    let carried = |carrier: &str, position: &str| {
        format!("[[light]]\nkind = \"point\"\n{carrier}\nposition = {position}\npower_w = 50\n")
    };
    let by_camera = carried("relative_to = \"camera\"", "[0.1, -0.2, 0.3]");
    let by_mesh = carried("relative_to = \"mesh\"\nmesh = 0", "[0.5, 0.25, 1.0]");
    let scene = format!("{SCENE}{by_camera}{by_mesh}");
    jobs.write("scene.toml", &scene);
    jobs.succeed("set", &[]);
    let moved = scene
        .replace("[0.0, 0.0, 3.0]", "[0.5, 0.25, 4.0]")
        .replace("look_at = [0.0, 0.0, 0.0]", "look_at = [0.0, 0.5, 0.0]")
        .replace("up = [0.0, 1.0, 0.0]", "up = [1.0, 1.0, 0.0]")
        .replace(
            "[[mesh]]",
            "[[mesh]]\nrotate_deg = [0.0, 0.0, 180.0]\ntranslate = [0.125, 0.25, -0.5]",
        );
    for (frame, scene) in [scene.clone(), moved].into_iter().enumerate() {
        jobs.write("one.toml", &scene);
        let render = ["render", "one.toml", "-o", "one.exr"];
        let output = jobs.program(&render).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        let file = format!("set/frames/{frame:06}.exr");
        let [of_batch, of_render] = [file.as_str(), "one.exr"].map(|file| {
            let image = camlux::output::LayeredImage::read(jobs.path(file)).unwrap();
            image.total_radiance().unwrap()
        });
        assert!(of_render.iter().any(|&value| value > 0.0));
        for (a, b) in of_batch.iter().zip(&of_render) {
            assert!((a - b).abs() <= 1e-5 * b, "{a} {b}");
        }
    }

    jobs.write("job.toml", &job.replace("[[mesh]]", "[[light]]\nindex = 1\nposes = [{ position = [0, 0, 1] }, { position = [0, 0, 1] }]\n[[mesh]]"));
    let stderr = jobs.fail("other", &[]);
    assert_says(&stderr, &["[[light]] 1 of this job has a motion"]);
}
