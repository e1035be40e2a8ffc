//! The program with the demo scene of time of flight.

use std::path::Path;
use std::process::Command;

use camlux::output::LayeredImage;

/// Renders the demo scene, changed, and returns what the program says.
fn render(folder: &Path, change: impl Fn(String) -> String, arguments: &str) -> String {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let text = std::fs::read_to_string(scenes.join("tof_corner.toml")).unwrap();
    let text = text.replace("path = \"", &format!("path = \"{}/", scenes.display()));
    std::fs::write(folder.join("scene.toml"), change(text)).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_camlux"))
        .args(["render", "scene.toml", "-o", "a.exr", "--png", "a.png"])
        .args(arguments.split(' '))
        .current_dir(folder)
        .output()
        .unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    stderr
}

/// Without a bounce there is no multipath error; and whatever the image's form, the picture has a size to look at.
#[test]
fn a_preview_of_direct_light_has_range_and_amplitude() {
    let folder = tempfile::tempdir().unwrap();
    let without_bounce = |text: String| text.split("[indirect]").next().unwrap().to_owned();
    for (size, width, height) in [("48 36", 240, 180), ("1 700", 240, 700), ("1 1", 240, 240)] {
        let stderr = render(folder.path(), without_bounce, &format!("--size {size}"));
        assert!(stderr.contains("range | amplitude, a row"), "{stderr}");
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
    assert!(
        stderr.contains("range | amplitude | multipath error"),
        "{stderr}"
    );

    let image = LayeredImage::read(folder.path().join("a.exr")).unwrap();
    // Walls that light each other seem too far.
    let mpi = &image.layer("tof0.mpi").unwrap().values;
    let mean = mpi.iter().sum::<f32>() / mpi.len() as f32;
    assert!((0.03..0.3).contains(&mean), "{mean}");

    let preview = image::open(folder.path().join("a.png")).unwrap().to_rgb8();
    // Small frames are drawn larger: 48 pixels as 240, with margins of 12; 36 as 180, with heading and legend.
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
