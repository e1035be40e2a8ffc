//! `transforms.json` of nerfstudio and instant-ngp.

use std::path::Path;

use super::node::Node;
use super::{CameraOfFile, ImagePoses, Read, chosen, lens, place, pose};
use crate::import::unused::{Unused, shown};
use crate::scene::{CameraAxes, Distortion, Intrinsics, Lens};

/// The keys that a frame has, or all frames together.
const OF_CAMERA: [&str; 17] = [
    "w",
    "h",
    "fl_x",
    "fl_y",
    "cx",
    "cy",
    "k1",
    "k2",
    "k3",
    "k4",
    "p1",
    "p2",
    "camera_angle_x",
    "camera_angle_y",
    "camera_model",
    "is_fisheye",
    "frames",
];
/// Known, without effect, of the file and of a frame.
const WITHOUT_EFFECT: [&str; 13] = [
    "scale",
    "offset",
    "aabb_scale",
    "aabb",
    "applied_transform",
    "applied_scale",
    "ply_file_path",
    "orientation_override",
    "train_filenames",
    "val_filenames",
    "test_filenames",
    "n_extra_learnable_dims",
    "up",
];
const OF_FRAME: [&str; 10] = [
    "file_path",
    "transform_matrix",
    "mask_path",
    "depth_file_path",
    "semantics_path",
    "normal_file_path",
    "sharpness",
    "rotation",
    "colmap_im_id",
    "time",
];

/// Counts the keys that are none of the format.
fn unused(root: &Node, frames: &[Node]) -> Unused {
    let mut unused = Unused::default();
    let tables = std::iter::once((root, &WITHOUT_EFFECT[..]))
        .chain(frames.iter().map(|frame| (frame, &OF_FRAME[..])));
    for (table, own) in tables {
        for entry in table.entries() {
            let key = &*entry.key;
            if !OF_CAMERA.contains(&key) && !own.contains(&key) {
                unused.add_unknown(key, &[&OF_CAMERA, own].concat());
            }
        }
    }
    unused
}

/// The camera of one of the frames. `name`: its image.
pub(super) fn camera(root: &Node, name: Option<&str>) -> Read<CameraOfFile> {
    let frames = root.need("frames")?.list()?;
    let names = frames.iter().map(|frame| match frame.get("file_path") {
        Some(path) => path.text(),
        None => Ok(""),
    });
    let names: Vec<&str> = names.collect::<Read<_>>()?;
    let frame = &frames[chosen(&names, name, "frame")?];
    let of_frame = OfFrame { frame, root };
    let to_world = pose(frame.need("transform_matrix")?, CameraAxes::OpenGl)?;
    let (resolution_px, lens) = of_frame.lens()?;
    Ok(CameraOfFile {
        resolution_px,
        lens,
        pose: Some(place(&to_world)),
        on_body: None,
        unused: unused(root, frames),
    })
}

/// The poses of all frames, in the order of the file.
pub(super) fn image_poses(root: &Node, path: &Path) -> Read<ImagePoses> {
    let frames = root.need("frames")?.list()?;
    let poses = frames
        .iter()
        .map(|frame| pose(frame.need("transform_matrix")?, CameraAxes::OpenGl));
    let mut lenses = frames
        .iter()
        .map(|frame| OfFrame { frame, root }.lens().ok());
    let first = lenses.next().flatten();
    Ok(ImagePoses {
        to_world: poses.collect::<Read<_>>()?,
        is_of_one_camera: lenses.all(|lens| lens == first),
        warning: unused(root, frames).warning(path),
    })
}

/// The values of a frame, which it may share with all others.
struct OfFrame<'n, 't> {
    frame: &'n Node<'t>,
    root: &'n Node<'t>,
}

impl<'n, 't> OfFrame<'n, 't> {
    fn get(&self, key: &str) -> Option<&'n Node<'t>> {
        self.frame.get(key).or(self.root.get(key))
    }

    fn number(&self, key: &str) -> Read<Option<f64>> {
        self.get(key).map(Node::number).transpose()
    }

    fn lens(&self) -> Read<(Option<[u32; 2]>, Lens)> {
        let side = |key| self.get(key).map(Node::pixels).transpose();
        let resolution_px = side("w")?.zip(side("h")?).map(|(w, h)| [w, h]);
        let distortion = self.distortion()?;
        let angles = [
            self.number("camera_angle_x")?,
            self.number("camera_angle_y")?,
        ];
        let focal = [self.number("fl_x")?, self.number("fl_y")?];
        let centre = [self.number("cx")?, self.number("cy")?];
        let is_by_angle = focal == [None; 2] && centre == [None; 2] && distortion.is_none();
        match angles {
            [Some(x), None] if is_by_angle => {
                let fov_x_deg = x.to_degrees();
                return Ok((resolution_px, Lens::FovX { fov_x_deg }));
            }
            [None, Some(y)] if is_by_angle => {
                let fov_y_deg = y.to_degrees();
                return Ok((resolution_px, Lens::FovY { fov_y_deg }));
            }
            _ => {}
        }
        let size_px = resolution_px.map(|size| size.map(f64::from));
        let missing = |key: &str| self.root.need(key).map(|_| f64::NAN);
        let focal = [0, 1].map(|axis| {
            let of_angle = || Some(0.5 * size_px?[axis] / (0.5 * angles[axis]?).tan());
            focal[axis].or_else(of_angle)
        });
        let fx = focal[0].or(focal[1]).map_or_else(|| missing("fl_x"), Ok)?;
        let middle = |axis: usize| size_px.map(|size| 0.5 * size[axis]);
        let along = |axis: usize, key| {
            centre[axis]
                .or(middle(axis))
                .map_or_else(|| missing(key), Ok)
        };
        let intrinsics = Intrinsics {
            fx,
            fy: focal[1].unwrap_or(fx),
            cx: along(0, "cx")?,
            cy: along(1, "cy")?,
            skew: 0.0,
        };
        Ok((resolution_px, lens(intrinsics, distortion)))
    }

    /// `None` without coefficients; a fisheye has one without them, too.
    fn distortion(&self) -> Read<Option<Distortion>> {
        let model = self.get("camera_model");
        let is_fisheye = match model.map(Node::text).transpose()? {
            None => self.get("is_fisheye").map(Node::text).transpose()? == Some("true"),
            Some("SIMPLE_PINHOLE" | "PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "OPENCV") => false,
            Some("OPENCV_FISHEYE") => true,
            Some(name) => {
                let problem = format!("is \"{}\", which camlux does not know", shown(name));
                let hint =
                    "give PINHOLE, SIMPLE_PINHOLE, RADIAL, SIMPLE_RADIAL, OPENCV or OPENCV_FISHEYE";
                return Err(model.unwrap_or(self.root).error(problem, hint));
            }
        };
        let number = |key| self.number(key).map(Option::unwrap_or_default);
        let [k1, k2, k3, k4] = [number("k1")?, number("k2")?, number("k3")?, number("k4")?];
        if is_fisheye {
            return Ok(Some(Distortion::Fisheye([k1, k2, k3, k4])));
        }
        if let Some(node) = self.get("k4").filter(|_| k4 != 0.0) {
            let hint = "set it to 0: only a fisheye has it";
            return Err(node.error(format!("is {k4}"), hint));
        }
        let vector = [k1, k2, number("p1")?, number("p2")?, k3];
        let is_bent = vector.iter().any(|&coefficient| coefficient != 0.0);
        Ok(is_bent.then(|| Distortion::from_opencv(&vector)).flatten())
    }
}
