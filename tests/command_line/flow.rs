//! Optical flow and scene flow of a batch, against closed forms.

use camlux::glam::{DMat3, DVec2, DVec3};
use camlux::output::{Layer, LayeredImage};

use crate::jobs::Jobs;

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
