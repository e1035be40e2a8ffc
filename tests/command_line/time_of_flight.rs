//! The program with the demo scene of time of flight.

use std::path::Path;
use std::process::Command;

use camlux::output::LayeredImage;

#[test]
fn the_preview_has_range_amplitude_and_multipath_error_of_each_frequency() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tof_corner.toml");
    let output = Command::new(env!("CARGO_BIN_EXE_camlux"))
        .arg("render")
        .arg(scene)
        .args("--size 48 36 --target-error 0.1 -o a.exr --png a.png".split(' '))
        .current_dir(folder.path())
        .output()
        .unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
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
