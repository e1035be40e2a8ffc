//! Cameras and images of COLMAP: cameras.txt with images.txt, and the same in binary.

use std::path::{Path, PathBuf};

use glam::{DAffine3, DQuat, DVec3};

use super::{
    CameraOfFile, CameraPlace, Fault, ImagePoses, Read, bytes, chosen, in_file, lens, place, text,
};
use crate::import::unused::{Unused, shown};
use crate::scene::{Distortion, Intrinsics, Lens};
use crate::{Error, Result};

/// The models: number in binary files, name, number of parameters. Those without parameters are refused.
const MODELS: [(i32, &str, usize); 16] = [
    (0, "SIMPLE_PINHOLE", 3),
    (1, "PINHOLE", 4),
    (2, "SIMPLE_RADIAL", 4),
    (3, "RADIAL", 5),
    (4, "OPENCV", 8),
    (5, "OPENCV_FISHEYE", 8),
    (6, "FULL_OPENCV", 12),
    (7, "FOV", 0),
    (8, "SIMPLE_RADIAL_FISHEYE", 0),
    (9, "RADIAL_FISHEYE", 0),
    (10, "THIN_PRISM_FISHEYE", 0),
    (11, "RAD_TAN_THIN_PRISM_FISHEYE", 0),
    (12, "SIMPLE_DIVISION", 0),
    (13, "DIVISION", 0),
    (14, "SIMPLE_FISHEYE", 0),
    (15, "FISHEYE", 0),
];

/// How far a quaternion's length may be from 1.
const LENGTH_TOLERANCE: f64 = 1e-3;

struct CameraRecord {
    id: i64,
    resolution_px: [u32; 2],
    lens: Lens,
}

struct ImageRecord {
    name: String,
    camera_id: i64,
    to_world: DAffine3,
}

/// The camera of an image of images.txt, or of images.bin, with its pose. Of cameras.txt and cameras.bin, a camera without a pose, by its
/// number.
pub(super) fn camera(
    path: &Path,
    named_at: &str,
    name: Option<&str>,
) -> Result<Read<CameraOfFile>> {
    let of = |camera: &CameraRecord, pose: Option<CameraPlace>| CameraOfFile {
        resolution_px: Some(camera.resolution_px),
        lens: camera.lens,
        pose,
        on_body: None,
        unused: Unused::default(),
    };
    match path.file_stem().unwrap_or_default().to_str() {
        Some("cameras") => Ok(cameras(path, named_at)?.and_then(|cameras| {
            let ids: Vec<String> = cameras.iter().map(|camera| camera.id.to_string()).collect();
            let ids: Vec<&str> = ids.iter().map(String::as_str).collect();
            Ok(of(&cameras[chosen(&ids, name, "camera")?], None))
        })),
        Some("images") => {
            let beside = cameras_of(path);
            let cameras = cameras(&beside, named_at)?;
            let cameras = cameras.map_err(|fault| in_file(fault, &beside, named_at))?;
            Ok(images(path, named_at)?.and_then(|images| {
                let names: Vec<&str> = images.iter().map(|image| &*image.name).collect();
                let image = &images[chosen(&names, name, "image")?];
                let mut cameras = cameras.iter();
                let camera = cameras.find(|camera| camera.id == image.camera_id);
                let camera = camera.ok_or_else(|| {
                    let (name, id) = (shown(&image.name), image.camera_id);
                    let problem = format!("has the image \"{name}\" of camera {id}");
                    let hint = "give the cameras file of the same model, which has it";
                    Fault::new(problem, hint)
                })?;
                Ok(of(camera, Some(place(&image.to_world))))
            }))
        }
        _ => {
            let problem = format!("{} is no file of COLMAP by its name", path.display());
            let hint =
                "give images.txt or images.bin, or for a lens alone cameras.txt or cameras.bin";
            Err(Error::scene(named_at, problem, hint))
        }
    }
}

/// The poses of all images, in the order of their names.
pub(super) fn image_poses(path: &Path, named_at: &str) -> Result<Read<ImagePoses>> {
    Ok(images(path, named_at)?.map(|mut images| {
        images.sort_by(|a, b| a.name.cmp(&b.name));
        let mut cameras = images.iter().map(|image| image.camera_id);
        let first = cameras.next();
        ImagePoses {
            to_world: images.iter().map(|image| image.to_world).collect(),
            is_of_one_camera: cameras.all(|camera| Some(camera) == first),
            warning: None,
        }
    }))
}

/// The file of the cameras beside a file of images.
fn cameras_of(images: &Path) -> PathBuf {
    let extension = images.extension().unwrap_or_default();
    images.with_file_name("cameras").with_extension(extension)
}

fn is_binary(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "bin")
}

fn cameras(path: &Path, named_at: &str) -> Result<Read<Vec<CameraRecord>>> {
    Ok(if is_binary(path) {
        cameras_of_bytes(&bytes(path, named_at)?)
    } else {
        let text = text(path, named_at)?;
        let lines = statements(&text);
        lines
            .map(|(line, words)| camera_of_line(words).map_err(|fault| fault.on_line(line)))
            .collect()
    })
}

fn images(path: &Path, named_at: &str) -> Result<Read<Vec<ImageRecord>>> {
    Ok(if is_binary(path) {
        images_of_bytes(&bytes(path, named_at)?)
    } else {
        images_of_text(&text(path, named_at)?)
    })
}

/// Lines that are neither empty nor comments, with their numbers.
fn statements(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = (1..).zip(text.lines().map(str::trim));
    lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

fn camera_of_line(line: &str) -> Read<CameraRecord> {
    let mut words = line.split_whitespace();
    let what = "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]";
    let mut next = || {
        words
            .next()
            .ok_or_else(|| Fault::new("a camera is cut short", format!("write {what}")))
    };
    let id = whole(next()?)?;
    let name = next()?;
    let size = [whole(next()?)?, whole(next()?)?];
    let model = MODELS.iter().find(|(_, own, _)| *own == name);
    let (name, count) = known(model.copied(), name)?;
    let parameters = words.map(number).collect::<Read<Vec<f64>>>()?;
    if parameters.len() != count {
        let problem = format!("a camera has {} parameters", parameters.len());
        return Err(Fault::new(problem, format!("give the {count} of {name}")));
    }
    record(id, name, size, &parameters)
}

/// The name of a model that camlux knows, and its number of parameters. `called`: how the file names it.
fn known(model: Option<(i32, &'static str, usize)>, called: &str) -> Read<(&'static str, usize)> {
    match model {
        Some((_, name, count @ 1..)) => Ok((name, count)),
        other => {
            let name = other.map_or_else(|| shown(called), |(_, name, _)| name.to_owned());
            let read = MODELS.iter().filter(|(.., count)| *count > 0);
            let read: Vec<&str> = read.map(|(_, name, _)| *name).collect();
            let problem = format!("a camera has the model {name}, which camlux does not know");
            Err(Fault::new(
                problem,
                format!("use one of {}", read.join(", ")),
            ))
        }
    }
}

fn whole(word: &str) -> Read<i64> {
    word.parse().map_err(|_| {
        let problem = format!("\"{}\" is no whole number", shown(word));
        Fault::new(problem, "give a whole number")
    })
}

fn number(word: &str) -> Read<f64> {
    let number = word.parse().ok();
    finite(number.unwrap_or(f64::NAN)).map_err(|_| {
        let problem = format!("\"{}\" is no finite number", shown(word));
        Fault::new(problem, "give a finite number")
    })
}

fn finite(number: f64) -> Read<f64> {
    let fault = || Fault::new(format!("holds the number {number}"), "give finite numbers");
    number.is_finite().then_some(number).ok_or_else(fault)
}

/// COLMAP has the centre of the first pixel at (0.5, 0.5), as camlux.
fn record(id: i64, model: &str, size: [i64; 2], parameters: &[f64]) -> Read<CameraRecord> {
    let sides = size.map(u32::try_from);
    let [Ok(width), Ok(height)] = sides else {
        let problem = format!("a camera has {} x {} pixels", size[0], size[1]);
        return Err(Fault::new(problem, "give width and height in pixels"));
    };
    let (intrinsics, coefficients) = match (model, parameters) {
        ("SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL", [f, cx, cy, rest @ ..]) => {
            ([*f, *f, *cx, *cy], rest)
        }
        (_, [fx, fy, cx, cy, rest @ ..]) => ([*fx, *fy, *cx, *cy], rest),
        _ => {
            return Err(Fault::new(
                "a camera has too few parameters",
                "export it again",
            ));
        }
    };
    let distortion = match (model, coefficients) {
        ("OPENCV_FISHEYE", &[k1, k2, k3, k4]) => Some(Distortion::Fisheye([k1, k2, k3, k4])),
        (_, []) => None,
        (_, [k1]) => Distortion::from_opencv(&[*k1, 0.0, 0.0, 0.0]),
        (_, [k1, k2]) => Distortion::from_opencv(&[*k1, *k2, 0.0, 0.0]),
        (_, vector) => Distortion::from_opencv(vector),
    };
    let [fx, fy, cx, cy] = intrinsics;
    let intrinsics = Intrinsics {
        fx,
        fy,
        cx,
        cy,
        skew: 0.0,
    };
    Ok(CameraRecord {
        id,
        resolution_px: [width, height],
        lens: lens(intrinsics, distortion),
    })
}

/// An image takes two lines, of which the second, its points, may be empty.
fn images_of_text(text: &str) -> Read<Vec<ImageRecord>> {
    let mut images = Vec::new();
    let mut lines = (1..).zip(text.lines().map(str::trim));
    while let Some((line, words)) = lines.next() {
        if words.is_empty() || words.starts_with('#') {
            continue;
        }
        let image = image_of_line(words).map_err(|fault| fault.on_line(line))?;
        images.push(image);
        lines.next();
    }
    Ok(images)
}

fn image_of_line(line: &str) -> Read<ImageRecord> {
    let what =
        "write IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and the points on the next line";
    let short = || Fault::new("an image is cut short", what);
    let mut rest = line;
    let mut next = || {
        let (word, after) = rest.split_once(char::is_whitespace).ok_or_else(short)?;
        rest = after.trim_start();
        Ok(word)
    };
    whole(next()?)?;
    let mut pose = [0.0; 7];
    for value in &mut pose {
        *value = number(next()?)?;
    }
    let camera_id = whole(next()?)?;
    image(rest.to_owned(), camera_id, pose)
}

/// `pose`: a quaternion w, x, y, z and a translation, from the world to the camera.
fn image(name: String, camera_id: i64, pose: [f64; 7]) -> Read<ImageRecord> {
    let [w, x, y, z, tx, ty, tz] = pose;
    let quaternion = DQuat::from_xyzw(x, y, z, w);
    let length = quaternion.length();
    let is_unit = (length - 1.0).abs() <= LENGTH_TOLERANCE;
    if !is_unit || !DVec3::new(tx, ty, tz).is_finite() {
        let problem = format!(
            "the image \"{}\" has a quaternion of length {length} and the translation {tx}, {ty}, {tz}",
            shown(&name)
        );
        return Err(Fault::new(
            problem,
            "give a unit quaternion and finite metres",
        ));
    }
    let back = quaternion.normalize().conjugate();
    let position_m = -(back * DVec3::new(tx, ty, tz));
    Ok(ImageRecord {
        name,
        camera_id,
        to_world: DAffine3::from_rotation_translation(back, position_m),
    })
}

/// Takes numbers of a binary file, which are little-endian.
struct Bytes<'b>(&'b [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> Read<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk().ok_or_else(cut_short)?;
        self.0 = rest;
        Ok(*bytes)
    }

    fn i32(&mut self) -> Read<i32> {
        self.take().map(i32::from_le_bytes)
    }

    fn u64(&mut self) -> Read<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Read<f64> {
        finite(self.take().map(f64::from_le_bytes)?)
    }

    fn skip(&mut self, count: u64) -> Read<()> {
        let count = usize::try_from(count).ok();
        self.0 = count
            .and_then(|count| self.0.get(count..))
            .ok_or_else(cut_short)?;
        Ok(())
    }

    /// A text that ends with a zero.
    fn text(&mut self) -> Read<String> {
        let end = memchr::memchr(0, self.0).ok_or_else(cut_short)?;
        let text = String::from_utf8_lossy(&self.0[..end]).into_owned();
        self.0 = &self.0[end + 1..];
        Ok(text)
    }
}

fn cut_short() -> Fault {
    Fault::new("ends too early", "export the model of COLMAP again")
}

fn cameras_of_bytes(bytes: &[u8]) -> Read<Vec<CameraRecord>> {
    let mut bytes = Bytes(bytes);
    let mut cameras = Vec::new();
    for _ in 0..bytes.u64()? {
        let (id, model) = (bytes.i32()?, bytes.i32()?);
        let size = [bytes.u64()?, bytes.u64()?];
        let size = size.map(|side| i64::try_from(side).unwrap_or(-1));
        let called = format!("number {model}");
        let model = MODELS.iter().find(|(number, ..)| *number == model);
        let (name, count) = known(model.copied(), &called)?;
        let parameters = (0..count).map(|_| bytes.f64());
        let parameters = parameters.collect::<Read<Vec<f64>>>()?;
        cameras.push(record(id.into(), name, size, &parameters)?);
    }
    Ok(cameras)
}

fn images_of_bytes(bytes: &[u8]) -> Read<Vec<ImageRecord>> {
    /// Of a point: x, y and the number of its point in space.
    const POINT_BYTES: u64 = 24;
    let mut bytes = Bytes(bytes);
    let mut images = Vec::new();
    for _ in 0..bytes.u64()? {
        bytes.i32()?;
        let mut pose = [0.0; 7];
        for value in &mut pose {
            *value = bytes.f64()?;
        }
        let camera_id = bytes.i32()?;
        let name = bytes.text()?;
        let points = bytes.u64()?;
        bytes.skip(points.checked_mul(POINT_BYTES).ok_or_else(cut_short)?)?;
        images.push(image(name, camera_id.into(), pose)?);
    }
    Ok(images)
}
