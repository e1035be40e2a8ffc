//! A lens with distortion: the program's output and messages, and a comparison with OpenCV.

use std::fs;
use std::path::Path;
use std::process::Command;

use camlux::output::LayeredImage;
use camlux::scene::{Distortion, Lens};

use crate::calibrations::{self, Calibration};

/// Writes a scene file: a room of 2 m around the camera, seen through the calibrated lens.
fn scene_file(folder: &Path, calibration: &Calibration) {
    let corners = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let mut room = String::from("newmtl white\nKd 0.8 0.8 0.8\n");
    fs::write(folder.join("room.mtl"), &room).unwrap();
    room = "mtllib room.mtl\nusemtl white\n".into();
    for [x, y, z] in (0..8).map(corners) {
        room += &format!("v {x} {y} {z}\n");
    }
    room += "f 1 2 4 3\nf 5 6 8 7\nf 1 2 6 5\nf 3 4 8 7\nf 1 3 7 5\nf 2 4 8 6\n";
    fs::write(folder.join("room.obj"), room).unwrap();
    let Lens::Distorted {
        intrinsics,
        distortion,
    } = calibration.lens
    else {
        panic!("{} is not distorted", calibration.name);
    };
    let names: &[&str] = match distortion {
        Distortion::Rational(_) => &Distortion::RATIONAL,
        Distortion::Fisheye(_) => &Distortion::FISHEYE,
        Distortion::Equirectangular => panic!("{} has no coefficients", calibration.name),
    };
    let key = if names.len() == 4 {
        "fisheye"
    } else {
        "distortion"
    };
    let coefficients = names.iter().zip(distortion.coefficients());
    let coefficients = coefficients.map(|(name, value)| format!("{name} = {value:?}"));
    let scene = format!(
        "[camera]\nresolution = {:?}\nposition = [0.1, -0.2, 0.3]\nlook_at = [0.7, -0.1, 0.9]\nup = [0, 1, 0]\n\
         intrinsics_px = {{ fx = {:?}, fy = {:?}, cx = {:?}, cy = {:?}, skew = {:?} }}\n{key} = {{ {} }}\n\
         [[light]]\nkind = \"point\"\nposition = [0, 0, 0]\npower_w = 10\n[[mesh]]\npath = \"room.obj\"\n",
        calibration.resolution_px,
        intrinsics.fx,
        intrinsics.fy,
        intrinsics.cx,
        intrinsics.cy,
        intrinsics.skew,
        coefficients.collect::<Vec<_>>().join(", ")
    );
    fs::write(folder.join("scene.toml"), scene).unwrap();
}

fn render(folder: &Path, arguments: &[&str]) -> (bool, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_camlux"))
        .args(["render", "scene.toml", "-o", "image.exr"])
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    (output.status.success(), stderr)
}

#[test]
fn a_lens_is_read_and_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let calibration = calibrations::all().swap_remove(0);
    scene_file(folder, &calibration);
    let (is_done, stderr) = render(folder, &["--size", "96", "54"]);
    assert!(is_done, "{stderr}");
    let image = LayeredImage::read(folder.join("image.exr")).unwrap();
    assert_eq!(
        image.attribute("camlux.camera.distortion_model"),
        Some("rational")
    );
    let told = image.attribute("camlux.camera.distortion").unwrap();
    assert!(told.starts_with("[0.09370951394834764, -0.164"), "{told}");

    let scene = fs::read_to_string(folder.join("scene.toml")).unwrap();
    let line = scene
        .lines()
        .position(|line| line.starts_with("distortion"));
    let at = format!("scene.toml:{}", line.unwrap() + 1);
    for (from, to, says) in [
        (
            "k2 = -0.1",
            "k2 = -9.1",
            "camera: the distorted image folds over",
        ),
        ("k6 =", "k7 =", &format!("{at}: unknown key \"k7\"")),
        (
            "k6 = 0.0",
            "k6 = 0.0, tau_x = 1.6",
            "camera: the distorted image folds over",
        ),
        (
            "distortion =",
            "fisheye = { k1 = 0.1 }\ndistortion =",
            "keep one of them",
        ),
    ] {
        fs::write(folder.join("scene.toml"), scene.replace(from, to)).unwrap();
        let (is_done, stderr) = render(folder, &[]);
        assert!(!is_done && stderr.contains(says), "{stderr}");
    }
    let by_angle = scene.lines().map(|line| match line.split_once(" = ") {
        Some(("intrinsics_px", _)) => "fov_y_deg = 50",
        _ => line,
    });
    fs::write(
        folder.join("scene.toml"),
        by_angle.collect::<Vec<_>>().join("\n"),
    )
    .unwrap();
    let (is_done, stderr) = render(folder, &[]);
    assert!(
        !is_done && stderr.contains("give intrinsics_px"),
        "{stderr}"
    );
}

#[test]
#[ignore = "takes Python with OpenCV: scripts/test-python"]
fn opencv_sees_points_at_their_pixels() {
    let python = std::env::var("CAMLUX_PYTHON").unwrap_or("python3".into());
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/python/tests/project_points.py"
    );
    for calibration in calibrations::all() {
        let folder = tempfile::tempdir().unwrap();
        scene_file(folder.path(), &calibration);
        let (is_done, stderr) = render(folder.path(), &["--layers", "P,depth"]);
        assert!(is_done, "{stderr}");
        let output = Command::new(&python)
            .args([script.as_ref(), folder.path().join("image.exr").as_os_str()])
            .output()
            .unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{stderr}");
        let stdout = String::from_utf8(output.stdout).unwrap();
        println!("{}: {stdout}", calibration.name);
        let (count, off_px) = stdout.trim().split_once(" points within ").unwrap();
        let count: u32 = count.parse().unwrap();
        let [width, height] = calibration.resolution_px;
        assert!(count > width * height / 2, "{stdout}");
        let off_px: f64 = off_px.trim_end_matches(" px").parse().unwrap();
        assert!(off_px < 1e-3, "{}: {stdout}", calibration.name);
    }
}
