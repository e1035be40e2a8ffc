//! Cameras of files: of glTF, and of calibrations by OpenCV, ROS, Kalibr, COLMAP and nerfstudio.

mod colmap;
mod node;
mod opencv;
mod transforms;

use std::path::Path;

use glam::{DAffine3, DVec3};

use super::mesh::gltf;
use crate::import::unused::{Unused, shown};
use crate::keys::nearest;
use crate::scene::{CameraAxes, Distortion, Intrinsics, Lens, point_ahead};
use crate::{Error, Result, input_file};
use node::Node;

/// What a file says of a camera.
pub(super) struct CameraOfFile {
    pub resolution_px: Option<[u32; 2]>,
    pub lens: Lens,
    pub pose: Option<CameraPlace>,
    /// The same on the body that carries the camera, whose place in the world the file does not know.
    pub on_body: Option<CameraPlace>,
    /// Keys that are none of the format.
    pub unused: Unused,
}

/// Position, the point in the middle of the view, up.
pub(super) type CameraPlace = [DVec3; 3];

/// The poses of the images of a file.
pub struct ImagePoses {
    /// From the camera's axes (x right, y down, z forward) to the world.
    pub to_world: Vec<DAffine3>,
    /// Whether one camera took them all.
    pub is_of_one_camera: bool,
    /// What the file holds and camlux does not use, if there is such a thing.
    pub warning: Option<String>,
}

/// What is wrong with a file.
struct Fault {
    /// In a text file.
    line: Option<usize>,
    problem: String,
    hint: String,
}

type Read<T> = std::result::Result<T, Fault>;

impl Fault {
    fn new(problem: impl Into<String>, hint: impl Into<String>) -> Fault {
        Fault {
            line: None,
            problem: problem.into(),
            hint: hint.into(),
        }
    }

    fn on_line(self, line: usize) -> Fault {
        Fault {
            line: Some(line),
            ..self
        }
    }
}

/// Reads a camera of a file: the one of that name, or the only one.
pub(super) fn camera(path: &Path, named_at: &str, name: Option<&str>) -> Result<CameraOfFile> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let found = match &*extension.to_ascii_lowercase() {
        "yaml" | "yml" | "json" => {
            let text = text(path, named_at)?;
            Node::of_yaml(&text).and_then(|root| match root.get("frames") {
                Some(_) => transforms::camera(&root, name),
                None => opencv::camera(&root, name),
            })
        }
        "xml" => {
            let text = text(path, named_at)?;
            Node::of_xml(&text).and_then(|root| opencv::camera(&root, name))
        }
        "txt" | "bin" => colmap::camera(path, named_at, name)?,
        "gltf" | "glb" => return gltf::camera(path, named_at, name),
        _ => {
            let problem = format!(
                "{} is no file with a camera that camlux reads",
                path.display()
            );
            let hint = "give a glTF file (.gltf, .glb), a calibration (.yaml, .xml), images.txt or images.bin of COLMAP, or transforms.json";
            return Err(Error::scene(named_at, problem, hint));
        }
    };
    found.map_err(|fault| in_file(fault, path, named_at))
}

/// Reads the poses of all images of COLMAP or of a transforms.json; `None` if the file is neither, by its name.
pub fn image_poses(path: &Path, named_at: &str) -> Result<Option<ImagePoses>> {
    let is_of_colmap = ["images.txt", "images.bin"]
        .iter()
        .any(|name| path.ends_with(name));
    let is_json = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("json"));
    let poses = if is_of_colmap {
        colmap::image_poses(path, named_at)?
    } else if is_json {
        let text = text(path, named_at)?;
        Node::of_yaml(&text).and_then(|root| transforms::image_poses(&root, path))
    } else {
        return Ok(None);
    };
    let poses = poses.map_err(|fault| in_file(fault, path, named_at))?;
    Ok(Some(poses))
}

/// The place is in the file if it has lines, and else where the file is named.
fn in_file(fault: Fault, path: &Path, named_at: &str) -> Error {
    let Fault {
        line,
        problem,
        hint,
    } = fault;
    match line {
        Some(line) => Error::scene(format!("{}:{line}", path.display()), problem, hint),
        None => Error::scene(named_at, format!("{} {problem}", path.display()), hint),
    }
}

fn bytes(path: &Path, named_at: &str) -> Result<Vec<u8>> {
    input_file::read(path).map_err(|error| {
        let problem = format!("cannot read {}: {error}", path.display());
        Error::scene(
            named_at,
            problem,
            "correct the path; it is relative to the file that names it",
        )
    })
}

/// The text with `\n` at the ends of its lines. Names of images need not be UTF-8.
fn text(path: &Path, named_at: &str) -> Result<String> {
    let bytes = bytes(path, named_at)?;
    let text = String::from_utf8_lossy(&bytes);
    Ok(input_file::plain_lines(&text).into_owned())
}

/// The index of a name, or of the only one. A path may be named by its last part. `what`: "camera".
fn chosen(names: &[&str], name: Option<&str>, what: &str) -> Read<usize> {
    /// Names that a message lists.
    const MOST_LISTED: usize = 20;
    /// Names of images are all alike.
    const LEAST_LIKENESS: f64 = 0.9;
    let listed = || {
        let listed = names.iter().take(MOST_LISTED).map(|name| shown(name));
        let more = (names.len() > MOST_LISTED).then(|| "...".to_owned());
        Vec::from_iter(listed.chain(more)).join(", ")
    };
    let Some(name) = name else {
        return match names {
            [_] => Ok(0),
            [] => Err(Fault::new(format!("has no {what}"), "give another file")),
            _ => Err(Fault::new(
                format!("has {} {what}s", names.len()),
                format!("give the name of one: {}", listed()),
            )),
        };
    };
    let last = |path: &str| path.rsplit(['/', '\\']).next() == Some(name);
    let by_last = || {
        let mut found = names.iter().enumerate().filter(|(_, own)| last(own));
        let (index, _) = found.next()?;
        found.next().is_none().then_some(index)
    };
    let exact = names.iter().position(|own| *own == name);
    exact.or_else(by_last).ok_or_else(|| {
        let hint = match nearest(name, names, LEAST_LIKENESS) {
            Some(like) => format!("did you mean \"{}\"?", shown(like)),
            None => format!("choose one of: {}", listed()),
        };
        Fault::new(format!("has no {what} \"{}\"", shown(name)), hint)
    })
}

/// A lens. Coefficients of 0 are no distortion, except for a fisheye.
fn lens(intrinsics: Intrinsics, distortion: Option<Distortion>) -> Lens {
    match distortion {
        None => Lens::Intrinsics(intrinsics),
        Some(Distortion::Rational(coefficients)) if coefficients == [0.0; 14] => {
            Lens::Intrinsics(intrinsics)
        }
        Some(distortion) => Lens::Distorted {
            intrinsics,
            distortion,
        },
    }
}

/// In OpenCV, the centre of the first pixel is at (0, 0).
fn intrinsics_of_opencv([fx, skew, cx, fy, cy]: [f64; 5]) -> Intrinsics {
    Intrinsics {
        fx,
        fy,
        cx: cx + 0.5,
        cy: cy + 0.5,
        skew,
    }
}

/// The pose of 12 or 16 numbers, row by row.
fn pose(node: &Node, axes: CameraAxes) -> Read<DAffine3> {
    let numbers = node.numbers()?;
    let (rows, rest) = numbers.as_chunks::<4>();
    if !rest.is_empty() {
        let problem = format!("has {} numbers", numbers.len());
        return Err(node.error(problem, "give 3 or 4 rows of 4 numbers"));
    }
    axes.pose(rows, true).map_err(|problem| {
        node.error(
            problem,
            "export poses without scale: rotations and translations",
        )
    })
}

/// Where a camera with this pose is, as a camera has it.
fn place(to_world: &DAffine3) -> CameraPlace {
    let (position_m, axes) = (to_world.translation, to_world.matrix3);
    [
        position_m,
        point_ahead(position_m, axes.z_axis),
        -axes.y_axis,
    ]
}
