//! Cameras of calibration files see points where OpenCV and COLMAP see them, and the numbers of scene files mean the same as those of files.

use std::path::{Path, PathBuf};

use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder};
use camlux::scene::{Camera, Lens};
use glam::{DMat4, DVec2, DVec3};
use serde_json::Value;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/calibrations")
}

/// A pose for cameras of files without one: the camera's axes are the world's.
const POSE: &str =
    "camera_to_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]\naxes = \"opencv\"\n";

#[track_caller]
fn camera(keys: &str) -> Camera {
    let scene = SceneFolder::new().load(&format!("[camera]\n{keys}{LIGHT}{MESH}"));
    scene
        .unwrap_or_else(|error| panic!("{keys}: {error}"))
        .camera
}

fn vector(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().expect("a vector").iter();
    numbers
        .map(|number| number.as_f64().expect("a number"))
        .collect()
}

/// `make.py` writes the files, and the points with their pixels.
#[test]
fn points_are_seen_where_opencv_and_colmap_see_them() {
    let seen = std::fs::read(folder().join("seen.json")).unwrap();
    let cases: Vec<Value> = serde_json::from_slice(&seen).unwrap();
    let mut formats = std::collections::HashSet::new();
    for case in &cases {
        let file = case["path"].as_str().expect("a path");
        let mut keys = format!("path = {:?}\n", folder().join(file));
        if let Some(name) = case["name"].as_str() {
            keys += &format!("name = {name:?}\n");
        }
        if !case["has_pose"].as_bool().expect("a flag") {
            keys += POSE;
        }
        // Their files do not tell the size.
        if ["stereo.yaml", "nerf.json"].contains(&file) {
            keys += "resolution = [752, 480]\n";
        }
        let camera = camera(&keys);
        assert_eq!(camera.resolution_px, [752, 480]);
        let points = case["points_m"].as_array().expect("points").iter();
        let pixels = case["pixels"].as_array().expect("pixels").iter();
        let mut largest_px: f64 = 0.0;
        for (point, pixel) in points.zip(pixels) {
            let point_m = DVec3::from_slice(&vector(point));
            let shown = camera.project(point_m).expect("it is seen");
            largest_px = largest_px.max(shown.distance(DVec2::from_slice(&vector(pixel))));
            let ray = camera.ray_direction(shown.x, shown.y).normalize();
            let due = (point_m - camera.position_m).normalize();
            assert!(ray.distance(due) < 1e-12, "{file}: {ray} {due}");
        }
        println!("{file} {}: {largest_px:.1e} px", case["name"]);
        assert!(largest_px < 1e-9, "{file}: {largest_px:e} px");
        formats.insert(file);
    }
    assert_eq!((cases.len(), formats.len()), (30, 16));
}

/// The warnings of a scene whose camera is of a file with this content, as far as they are about it.
fn warnings(file: &str, content: &str) -> Vec<String> {
    let folder = SceneFolder::new();
    folder.write(file, content);
    let keys = format!("path = {file:?}\nresolution = [752, 480]\n{POSE}");
    let load = |keys: &str| folder.load(&format!("[camera]\n{keys}{LIGHT}{MESH}"));
    // Some files tell the size or the pose.
    let lines: Vec<&str> = keys.lines().collect();
    let scene = [
        &lines[..],
        &lines[..1],
        &[lines[0], lines[2], lines[3]],
        &lines[..2],
    ]
    .into_iter()
    .find_map(|lines| load(&(lines.join("\n") + "\n")).ok());
    let mut warnings = scene.expect("it loads").warnings();
    warnings.retain(|warning| warning.contains(file));
    warnings
}

#[test]
fn unknown_keys_are_named_in_one_warning() {
    let cam = "width: 752\nheight: 480\nK: [450, 0, 375, 0, 450, 239, 0, 0, 1]\n";
    let frame = r#"{"file_path": "a.png", "lens": 1, "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}"#;
    for (file, content, says) in [
        (
            "cam.yaml",
            &format!("{cam}distortion_coefs: [0.1, 0, 0, 0]\nzoom: 2\nrms: 0.2\nR: [1]\n"),
            "camlux ignores the unknown \"distortion_coefs\", perhaps \"distortion_coeffs\"; the unknown \"zoom\"",
        ),
        (
            "chain.yaml",
            &"cam0:\n  resolution: [752, 480]\n  intrinsics: [450, 450, 375, 239]\n  intrinsic: 3\nlens: 1\n".to_owned(),
            "camlux ignores the unknown \"intrinsic\", perhaps \"intrinsics\"",
        ),
        (
            "nerf.json",
            &format!(
                r#"{{"camera_angle_x": 0.8, "camera_angle_z": 0.8, "aabb_scale": 4, "frames": [{frame}]}}"#
            ),
            "camlux ignores the unknown \"camera_angle_z\", perhaps \"camera_angle_y\"; the unknown \"lens\"",
        ),
    ] {
        let warnings = warnings(file, content);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].ends_with(&format!("{file}: {says}")), "{warnings:?}");
    }
    assert_eq!(warnings("cam.yaml", cam), Vec::<String>::new());
}

/// Files as OpenCV, ROS, Kalibr and nerfstudio write them.
#[test]
fn files_of_programs_have_no_unknown_keys() {
    for file in [
        "brown.yaml",
        "prism.xml",
        "tilted.yml",
        "ros_equidistant.yaml",
        "ros_plumb_bob.yaml",
        "sensor.yaml",
    ] {
        let content = std::fs::read_to_string(folder().join(file)).unwrap();
        assert_eq!(warnings(file, &content), Vec::<String>::new(), "{file}");
    }
}

#[test]
fn a_pose_of_the_scene_file_goes_before_one_on_a_body() {
    let path = format!("path = {:?}\n", folder().join("sensor.yaml"));
    let on_body = camera(&path);
    let placed = camera(&format!(
        "{path}position = [0, 0, 0]\nlook_at = [0, 0, 1]\nup = [0, -1, 0]\n"
    ));
    assert_eq!(placed.lens, on_body.lens);
    assert_eq!(placed.position_m, DVec3::ZERO);
    assert!(on_body.position_m.distance(DVec3::new(0.4, -1.3, 2.2)) < 1e-15);
}

#[test]
fn matrices_and_vectors_are_the_same_as_names() {
    let place = "position = [0.4, -1.3, 2.2]\nlook_at = [1.4, 0.2, 3.5]\nup = [0.1, 1, -0.2]\n";
    let named = camera(&format!(
        "resolution = [752, 480]\n{place}intrinsics_px = {{ fx = 458.6, fy = 457.3, cx = 367.7, cy = 248.9, skew = 3.5 }}\n\
         distortion = {{ k1 = -0.28, k2 = 0.07, p1 = 0.0002, p2 = -0.0003, s1 = 0.011, tau_y = -0.09 }}\n"
    ));
    let lens = "camera_matrix = [[458.6, 3.5, 367.7], [0, 457.3, 248.9], [0, 0, 1]]\n\
         distortion = [-0.28, 0.07, 0.0002, -0.0003, 0, 0, 0, 0, 0.011, 0, 0, 0, 0, -0.09]\n";
    let to_world = named.to_world();
    let opengl = to_world * DMat4::from_scale(DVec3::new(1.0, -1.0, -1.0));
    let rows = |matrix: DMat4, count: usize| {
        let rows = (0..count).map(|row| matrix.row(row).to_array());
        format!("{:?}", rows.collect::<Vec<_>>())
    };
    for (key, matrix, axes, count) in [
        ("camera_to_world", to_world, "opencv", 4),
        ("camera_to_world", opengl, "opengl", 3),
        ("world_to_camera", to_world.inverse(), "opencv", 3),
        ("world_to_camera", opengl.inverse(), "opengl", 4),
    ] {
        let rows = rows(matrix, count);
        let by_matrix = camera(&format!(
            "resolution = [752, 480]\n{lens}{key} = {rows}\naxes = \"{axes}\"\n"
        ));
        assert_eq!(by_matrix.lens, named.lens);
        let off = by_matrix.to_world() - to_world;
        assert!(
            off.to_cols_array().iter().all(|off| off.abs() < 1e-14),
            "{key} {axes}: {off}"
        );
    }
    // Coefficients of 0 and shorter vectors.
    let fisheye = camera(&format!(
        "resolution = [752, 480]\n{place}{}fisheye = [0.1, 0.02, 0, 0]\n",
        lens.lines().next().expect("a line").to_owned() + "\n"
    ));
    let by_names = camera(&format!(
        "resolution = [752, 480]\n{place}{}\nfisheye = {{ k1 = 0.1, k2 = 0.02 }}\n",
        lens.lines().next().expect("a line")
    ));
    assert_eq!(fisheye.lens, by_names.lens);
}

#[test]
fn fov_x_is_fov_y_of_the_other_edge() {
    let of = |line: &str| {
        let camera = camera(
            &CAMERA
                .replace("[camera]\n", "")
                .replace("fov_y_deg = 50.0", line),
        );
        camera.intrinsics_px()
    };
    // 8 x 6 pixels: 4 / tan(45°).
    let by_x = of("fov_x_deg = 90.0");
    assert!((by_x.fx - 4.0).abs() < 1e-12 && by_x.fx == by_x.fy);
    assert_eq!([by_x.cx, by_x.cy], [4.0, 3.0]);
    let fov_y_deg = 2.0 * f64::atan(3.0 / 4.0).to_degrees();
    assert!((of(&format!("fov_y_deg = {fov_y_deg:?}")).fx - 4.0).abs() < 1e-12);
    let resized = Camera {
        lens: Lens::FovX { fov_x_deg: 90.0 },
        ..camera(&CAMERA.replace("[camera]\n", ""))
    };
    assert!((resized.resized([16, 4]).intrinsics_px().fx - 8.0).abs() < 1e-12);
}
