//! Options that several commands share.

use std::path::Path;

use camlux::{DeviceChoice, DeviceOptions, Scene};

use crate::{Failure, warn};

#[derive(clap::Args)]
pub struct SizeArgs {
    /// Resolution; the field of view stays
    #[arg(long, num_args = 2, action = clap::ArgAction::Set, value_names = ["WIDTH", "HEIGHT"], value_parser = parse_edge, allow_negative_numbers = true)]
    size: Option<Vec<u32>>,
}

fn parse_edge(text: &str) -> Result<u32, &'static str> {
    let edge = text.parse().ok().filter(|&edge| edge > 0);
    edge.ok_or("give two whole numbers of 1 or more, such as --size 320 240")
}

impl SizeArgs {
    /// Loads the scene of a file at this size.
    pub fn load(&self, file: &Path) -> Result<Scene, Failure> {
        let mut scene = Scene::load(file)?;
        if let Some(size_px) = self.size_px() {
            scene.camera = scene.camera.resized(size_px);
        }
        Ok(scene)
    }

    pub fn size_px(&self) -> Option<[u32; 2]> {
        self.size.as_deref()?.try_into().ok()
    }
}

#[derive(clap::Args)]
pub struct DeviceArgs {
    /// Index, name, UUID or PCI address [default: $CAMLUX_DEVICE, or the best]
    #[arg(long, value_name = "DEVICE")]
    device: Option<String>,
}

impl DeviceArgs {
    pub fn options(&self) -> DeviceOptions {
        let choice = self.device.as_deref().map(DeviceChoice::from);
        DeviceOptions {
            choice: choice.unwrap_or_default(),
            ..DeviceOptions::default()
        }
    }
}

/// Warns of probable mistakes in a scene.
pub fn warn_of(scene: &Scene, name: &dyn std::fmt::Display) {
    for warning in scene.warnings() {
        warn(format_args!("{name}: {warning}"));
    }
}

#[cfg(test)]
mod tests {
    use camlux::scene::{Camera, Intrinsics, Lens};
    use glam::DVec3;

    fn camera(lens: Lens) -> Camera {
        Camera {
            resolution_px: [800, 600],
            position_m: DVec3::ZERO,
            look_at_m: DVec3::Z,
            up: DVec3::Y,
            lens,
            pixel_sampling: None,
        }
    }

    #[test]
    fn resized_camera_sees_the_same() {
        let intrinsics = Intrinsics {
            fx: 700.0,
            fy: 710.0,
            cx: 390.0,
            cy: 310.0,
            skew: 0.0,
        };
        for lens in [Lens::FovY { fov_y_deg: 50.0 }, Lens::Intrinsics(intrinsics)] {
            let full = camera(lens);
            let half = full.resized([400, 300]);
            assert_eq!(half.resolution_px, [400, 300]);
            // The same corner of both images; f64 rounding of a few operations on values below 2.
            let apart = full.ray_direction(800.0, 0.0) - half.ray_direction(400.0, 0.0);
            assert!(apart.length() < 1e-14, "{lens:?}: {apart}");
        }
    }
}
