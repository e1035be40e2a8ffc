//! What a batch makes of motion: optical flow, scene flow and motion blur, against closed forms.

use camlux::glam::{DMat3, DVec2, DVec3};
use camlux::output::{Layer, LayeredImage};

use crate::jobs::{Jobs, SCENE};

/// The quad at z = 0 from z = 3, in 16 × 16 pixels.
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
    let set: serde_json::Value = serde_json::from_slice(&jobs.read("set/dataset.json")).unwrap();
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
                // The camera steps to the right: all moves to the left, by f·0.25/3.
                0 => (DVec2::new(-FOCAL_PX * 0.25 / 3.0, 0.0), DVec3::ZERO),
                // The quad turns by 60° and comes nearer.
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
            // What stays, stays to the last digit.
            assert!(frame != 2 || flow_px[i] == DVec2::ZERO && scene_flow_m[i] == DVec3::ZERO);
        }
        assert!(frame == 3 || seen > 60, "{seen}");
    }
}

/// A wall that moves away at 10 m/s from a camera with its light beside it, exposed for the first half of a frame of 0.1 s.
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
    let sensor = "[sensor]\npixel_pitch_um = [10, 10]\nexposure_time_s = 0.05\nduty_cycle = 1\n";
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
        ] {
            let value = f64::from(image.values(layer).unwrap()[0]);
            assert!((value / due - 1.0).abs() < 1e-5, "{layer:?} {value} {due}");
        }
        // A flat wall does not light itself.
        assert_eq!(image.values(Layer::Indirect).unwrap()[0], 0.0);
        assert_eq!(image.attribute("camlux.estimator"), Some("final-gather"));
        // What is seen is that at the frame's beginning.
        let depth_m = f64::from(image.values(Layer::Depth).unwrap()[0]);
        assert!((depth_m / begin_m - 1.0).abs() < 1e-6, "{depth_m}");
    }
    // Behind the last keyframe nothing moves.
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
