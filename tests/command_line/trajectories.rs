//! Trajectories of `camlux batch`: files of poses as other programs write them.

use std::path::Path;

use crate::jobs::Jobs;
use crate::rows::assert_says;
use camlux::output::LayeredImage;
use glam::{DMat4, DQuat, DVec3};
use serde_json::json;

/// Compares the poses in the manifest and in the header with those of a trajectory of a thousand rows.
#[test]
fn poses_of_a_trajectory_survive_to_the_last_digits() {
    const ROWS: usize = 1000;
    let mut rows = String::from("# timestamp tx ty tz qx qy qz qw\n");
    let mut poses = Vec::new();
    for i in 0..ROWS {
        let angle = i as f64 * 0.1;
        let [x, y, z] = [angle.sin(), 0.3 * angle.cos(), 1.0].map(|v| v / (1.0 + 0.3 * angle));
        let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt() * if i % 2 == 0 { 1.0 } else { -1.0 };
        let length = (x * x + y * y + z * z + w * w).sqrt();
        let [qx, qy, qz, qw] = [x, y, z, w].map(|v| v / length);
        let (px, py) = (3e3 * angle.cos() / 7.0, -angle / 3.0);
        let pose = [px, py, 1.0 / 3.0, qx, qy, qz, qw];
        rows += &format!(
            "{:?} {px} {py} {} {qx} {qy} {qz} {qw}\n",
            0.1 * i as f64,
            1.0 / 3.0
        );
        poses.push(pose);
    }
    let jobs = Jobs::new(
        "[job]\nscene = \"scene.toml\"\nsize = [4, 4]\nlayers = [\"depth\"]\n[camera]\ntrajectory = \"path.txt\"\n",
    );
    jobs.write("path.txt", &rows);
    jobs.succeed("set", &[]);
    let lines = jobs.manifest("set/manifest.jsonl");
    assert_eq!(lines.len(), ROWS);
    let numbers = |text: &str| -> Vec<f64> {
        let words = text.split(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)));
        words.filter_map(|word| word.parse().ok()).collect()
    };
    let near = |seen: &[f64], pose: &[f64; 7]| {
        seen.len() == 7 && seen.iter().zip(pose).all(|(a, b)| (a - b).abs() < 1e-12)
    };
    for (index, (line, pose)) in lines.iter().zip(&poses).enumerate() {
        let camera = &line["camera"];
        let position = camera["position_m"].as_array().unwrap().iter();
        let rotation = camera["rotation_xyzw"].as_array().unwrap().iter();
        let seen: Vec<f64> = position
            .chain(rotation)
            .map(|v| v.as_f64().unwrap())
            .collect();
        assert!(near(&seen, pose), "{index}: {seen:?} instead of {pose:?}");
        assert!((line["time_s"].as_f64().unwrap() - 0.1 * index as f64).abs() < 1e-12);
        let file = jobs.path(&format!("set/frames/{index:06}.exr"));
        let seen = LayeredImage::read(&file).unwrap();
        let seen = numbers(seen.attribute("camlux.cameraToWorld").unwrap());
        let rotation = DQuat::from_slice(&pose[3..]);
        let position_m = DVec3::from_slice(pose);
        let to_world = DMat4::from_rotation_translation(rotation, position_m);
        let pairs = seen.iter().zip(to_world.to_cols_array());
        let farthest = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(seen.len() == 16 && farthest < 1e-12, "{index}: {seen:?}");
    }
}

#[test]
fn a_trajectory_may_have_comments_and_commas() {
    let jobs = Jobs::new(
        "[job]\nscene = \"scene.toml\"\nsize = [4, 4]\n[camera]\ntrajectory = \"a.csv\"\n",
    );
    let rows =
        "# made by hand\nt,tx,ty,tz,qx,qy,qz,qw\n\n1.5, 1,2,3, 0,0,0,1 # end\n2 4 5 6 0 0 1 0\r\n";
    jobs.write("a.csv", rows);
    jobs.succeed("set", &[]);
    let lines = jobs.manifest("set/manifest.jsonl");
    assert_eq!(lines.len(), 2);
    for (line, time_s, position_m, rotation) in [
        (&lines[0], 1.5, [1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0]),
        (&lines[1], 2.0, [4.0, 5.0, 6.0], [0.0, 0.0, 1.0, 0.0]),
    ] {
        assert_eq!(line["time_s"], json!(time_s));
        assert_eq!(line["camera"]["position_m"], json!(position_m));
        assert_eq!(line["camera"]["rotation_xyzw"], json!(rotation));
    }
}

/// One pose in the columns of other programs, with any separator and line end.
#[test]
fn the_names_of_the_columns_of_a_trajectory_decide() {
    let jobs = Jobs::new(
        "[job]\nscene = \"scene.toml\"\nsize = [4, 4]\n[camera]\ntrajectory = \"a.csv\"\n",
    );
    // t = 1.5; x, y, z = 1, 2, 3; a half turn about the axis x.
    for (i, text) in [
        "t tx ty tz qx qy qz qw\n1.5 1 2 3 1 0 0 0\n",
        "t,tx,ty,tz,q_w,q_x,q_y,q_z\n1.5,1,2,3,0,1,0,0\n",
        "t,tx,ty,tz,qw,qx,qy,qz\r\n1.5,1,2,3,0,1,0,0\r\n",
        "\u{feff}timestamp;x;y;z;qw;qx;qy;qz\r1.5;1;2;3;0;1;0;0\r",
        "qw\tqx\tqy\tqz\ttz\tty\ttx\ttime\n0\t1\t0\t0\t3\t2\t1\t1.5\n",
        "# timestamp tx ty tz qw qx qy qz\n1.5 1 2 3 0 1 0 0\n",
        "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n1500000000, 1, 2, 3, 0, 1, 0, 0\n",
        "t [s] tx [mm] ty [mm] tz [mm] qx qy qz qw\n1.5 1000 2000 3000 1 0 0 0\n",
        "time,pose.position.x,pose.position.y,pose.position.z,pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w\n1.5,1,2,3,1,0,0,0\n",
        "\"t\",\"x\",\"y\",\"z\",\"qw\",\"qx\",\"qy\",\"qz\"\n1.5,1,2,3,0,1,0,0\n",
    ]
    .into_iter()
    .enumerate()
    {
        jobs.write("a.csv", text);
        let set = format!("set{i}");
        jobs.succeed(&set, &[]);
        let lines = jobs.manifest(&format!("{set}/manifest.jsonl"));
        assert_eq!(lines.len(), 1, "{text}");
        assert_eq!(lines[0]["time_s"], json!(1.5), "{text}");
        assert_eq!(lines[0]["camera"]["position_m"], json!([1.0, 2.0, 3.0]), "{text}");
        let rotation = &lines[0]["camera"]["rotation_xyzw"];
        assert_eq!(rotation, &json!([1.0, 0.0, 0.0, 0.0]), "{text}");
    }
    for (names, says) in [
        ("t tx ty tz qx qy qz roll", "a.csv:1: no column is qw"),
        ("t tx ty qx qy qz qw", "a.csv:1: no column is tz"),
        (
            "t tx ty tz qx qx qz qw",
            "a.csv:1: the column \"qx\" is there twice",
        ),
        ("t tx[ft] ty tz qx qy qz qw", "a.csv:1: no column is tx"),
    ] {
        jobs.write("a.csv", &format!("{names}\n1.5 1 2 3 1 0 0 0\n"));
        let stderr = jobs.fail("bad", &[]);
        assert!(stderr.contains(says), "{stderr}");
    }
    // Other quantities are named; a row must still have all columns.
    jobs.write(
        "a.csv",
        "t,tx,ty,tz,qx,qy,qz,qw,v_x,frame\n1.5,1,2,3,1,0,0,0,9,a.png\n",
    );
    let said = jobs.succeed("more", &[]);
    assert_says(&said, &["a.csv: camlux ignores the columns v_x, frame"]);
}

/// The images of COLMAP in the order of their names, and the frames of a transforms.json.
#[test]
fn images_of_a_calibration_are_frames() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/calibrations");
    for (file, count, last_m) in [
        ("colmap/images.txt", 7, [1.4, -0.3, 3.2]),
        ("colmap/images.bin", 7, [1.4, -0.3, 3.2]),
        ("transforms.json", 2, [1.4, -0.3, 3.2]),
    ] {
        let path = data.join(file);
        let jobs = Jobs::new(&format!(
            "[job]\nscene = \"scene.toml\"\nsize = [4, 4]\nlayers = [\"depth\"]\n[camera]\ntrajectory = {path:?}\n"
        ));
        let said = jobs.succeed("set", &[]);
        assert_says(
            &said,
            &["its images are of several cameras, and all frames have the lens of the scene"],
        );
        let lines = jobs.manifest("set/manifest.jsonl");
        assert_eq!(lines.len(), count);
        let camera = &lines[count - 1]["camera"];
        let numbers = |key: &str| -> Vec<f64> {
            let numbers = camera[key].as_array().unwrap().iter();
            numbers.map(|number| number.as_f64().unwrap()).collect()
        };
        let position_m = DVec3::from_slice(&numbers("position_m"));
        assert!(
            position_m.distance(last_m.into()) < 1e-12,
            "{file}: {position_m}"
        );
        // The rotation vector of make.py.
        let vector = DVec3::new(0.3, -0.5, 0.2);
        let due = DQuat::from_scaled_axis(vector);
        let found = DQuat::from_slice(&numbers("rotation_xyzw"));
        assert!(found.dot(due).abs() > 1.0 - 1e-12, "{file}: {found}");
    }
}

#[test]
fn bad_rows_of_a_trajectory_are_named() {
    let jobs = Jobs::new("[job]\nscene = \"scene.toml\"\n[camera]\ntrajectory = \"a.txt\"\n");
    for (row, says) in [
        ("1 2 3", "a row has 3 values instead of 8"),
        ("1 2 3 4 5 6 7 8 9", "a row has 9 values"),
        ("1 2 x 4 0 0 0 1", "\"x\" is not a finite number"),
        ("1 2 inf 4 0 0 0 1", "\"inf\" is not"),
        ("1,2,,4,0,0,0,1", "\"\" is not"),
        ("1 2 3 4 0 0 0 0", "has length 0.0000 instead of 1"),
        ("1 2 3 4 0 0 0 1.1", "has length 1.1000"),
    ] {
        jobs.write("a.txt", &format!("# first\n0 0 0 0 0 0 0 1\n{row}\n"));
        let stderr = jobs.fail("set", &[]);
        let names = stderr.contains("a.txt:3: ") && stderr.contains(says);
        assert!(names, "{stderr}");
    }
}
