//! What the command line changes in a scene.

use std::path::Path;

use camlux::Scene;
use camlux::output::Layer;
use camlux::scene::{Camera, Intrinsics, Lens};

use crate::Failure;

/// Returns the camera at another resolution: a field of view stays as it is, measured intrinsics are scaled with the width
/// (fx, cx) and the height (fy, cy), so that the frame shows the same part of the scene.
pub fn resize(camera: Camera, resolution_px: [u32; 2]) -> Camera {
    let scale =
        |axis: usize| f64::from(resolution_px[axis]) / f64::from(camera.resolution_px[axis]);
    let lens = match camera.lens {
        Lens::FovY { fov_y_deg } => Lens::FovY { fov_y_deg },
        Lens::Intrinsics(Intrinsics { fx, fy, cx, cy }) => Lens::Intrinsics(Intrinsics {
            fx: fx * scale(0),
            fy: fy * scale(1),
            cx: cx * scale(0),
            cy: cy * scale(1),
        }),
    };
    Camera {
        resolution_px,
        lens,
        ..camera
    }
}

/// Refuses an output whose name promises another format.
pub fn require_exr(path: &Path) -> Result<(), Failure> {
    let is_exr = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("exr"));
    if is_exr {
        return Ok(());
    }
    let path = path.display();
    Err(format!(
        "--output {path}: camlux writes OpenEXR; end the name in .exr (a PNG preview is --png)"
    )
    .into())
}

/// Refuses layers that a frame of this scene will not have, before the time for it is spent.
pub fn check_layers(scene: &Scene, layers: &[Layer]) -> Result<(), Failure> {
    let Some(missing) = layers.iter().find(|layer| !layer.is_made_for(scene)) else {
        return Ok(());
    };
    let hint = match missing {
        Layer::Energy => "add [sensor] to the scene",
        _ => "add [indirect] to the scene, or --estimator",
    };
    let name = missing.name();
    Err(
        format!("--layers: a frame of this scene has no layer {name}; {hint}, or leave it out")
            .into(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn camera(lens: Lens) -> Camera {
        Camera {
            resolution_px: [800, 600],
            position_m: DVec3::ZERO,
            look_at_m: DVec3::Z,
            up: DVec3::Y,
            lens,
        }
    }

    #[test]
    fn resized_camera_sees_the_same() {
        let intrinsics = Intrinsics {
            fx: 700.0,
            fy: 710.0,
            cx: 390.0,
            cy: 310.0,
        };
        for lens in [Lens::FovY { fov_y_deg: 50.0 }, Lens::Intrinsics(intrinsics)] {
            let full = camera(lens);
            let half = resize(full, [400, 300]);
            assert_eq!(half.resolution_px, [400, 300]);
            // The same corner of the image in both; f64 rounding of a few operations on values below 2.
            let apart = full.ray_direction(800.0, 0.0) - half.ray_direction(400.0, 0.0);
            assert!(apart.length() < 1e-14, "{lens:?}: {apart}");
        }
    }
}
