//! Calibrations by OpenCV, ROS (camera_info) and Kalibr (also of the EuRoC data set).

use super::node::Node;
use super::{CameraOfFile, Fault, Read, chosen, intrinsics_of_opencv, lens, place, pose};
use crate::import::unused::{Unused, shown};
use crate::scene::{CameraAxes, Distortion};

/// What files call the camera matrix, the coefficients and the size, without "_", small, and without the number of a camera.
const MATRIX: [&str; 5] = ["cameramatrix", "k", "m", "mtx", "intrinsicmatrix"];
const COEFFICIENTS: [&str; 6] = [
    "distortioncoefficients",
    "distortioncoeffs",
    "distcoeffs",
    "distcoeff",
    "dist",
    "d",
];
const WIDTH: [&str; 2] = ["imagewidth", "width"];
const HEIGHT: [&str; 2] = ["imageheight", "height"];
const SIZE: [&str; 2] = ["imagesize", "resolution"];

/// Other keys that programs write and that camlux knows, in the same way. First those that it uses, or else refuses.
const OTHERS: [&str; 43] = [
    "intrinsics",
    "distortionmodel",
    "fisheyemodel",
    "cameramodel",
    "tbs",
    "cameraname",
    // How the camera was calibrated: OpenCV's samples and Kalibr.
    "calibrationtime",
    "nframes",
    "nrofframes",
    "boardwidth",
    "boardheight",
    "squaresize",
    "markersize",
    "aspectratio",
    "fixaspectratio",
    "flags",
    "avgreprojectionerror",
    "perviewreprojectionerrors",
    "extrinsicparameters",
    "imagepoints",
    "gridpoints",
    "rms",
    "camoverlaps",
    "rostopic",
    "timeshiftcamimu",
    "ratehz",
    "sensortype",
    "comment",
    // A pair of cameras, and its rectification.
    "tcamimu",
    "tcncnm",
    "r",
    "t",
    "e",
    "f",
    "p",
    "q",
    "rectificationmatrix",
    "projectionmatrix",
    // Messages of ROS.
    "header",
    "binningx",
    "binningy",
    "roi",
    "stamp",
];
/// The keys that a misspelt one may stand for.
const SUGGESTED: [&str; 14] = [
    "camera_matrix",
    "distortion_coefficients",
    "distortion_coeffs",
    "dist_coeffs",
    "image_width",
    "image_height",
    "image_size",
    "resolution",
    "distortion_model",
    "fisheye_model",
    "camera_model",
    "camera_name",
    "intrinsics",
    "T_BS",
];

/// Counts the keys of a table that are none of the format.
fn unused(table: &Node) -> Unused {
    let mut unused = Unused::default();
    let known = [&MATRIX[..], &COEFFICIENTS, &WIDTH, &HEIGHT, &SIZE, &OTHERS].concat();
    for entry in table.entries() {
        // What a table holds for another camera of a chain is its own.
        if !known.contains(&&*stem(&entry.key).0) && entry.get("intrinsics").is_none() {
            unused.add_unknown(&entry.key, &SUGGESTED);
        }
    }
    unused
}

/// A camera of the file. `name`: the key of its matrix, or of its table in a chain of Kalibr.
pub(super) fn camera(root: &Node, name: Option<&str>) -> Read<CameraOfFile> {
    if root.get("intrinsics").is_some() {
        return kalibr(root);
    }
    let chain = root.entries().iter();
    let chain: Vec<&Node> = chain
        .filter(|entry| entry.get("intrinsics").is_some())
        .collect();
    if !chain.is_empty() {
        let names: Vec<&str> = chain.iter().map(|camera| &*camera.key).collect();
        return kalibr(chain[chosen(&names, name, "camera")?]);
    }
    let matrices = root.entries().iter();
    let matrices: Vec<&Node> = matrices
        .filter(|entry| MATRIX.contains(&&*stem(&entry.key).0) && !entry.is_word())
        .collect();
    if matrices.is_empty() {
        let hint = "add camera_matrix (or K, M1, ...) of OpenCV, or intrinsics of Kalibr";
        return Err(Fault::new("has no camera matrix", hint));
    }
    let names: Vec<&str> = matrices.iter().map(|matrix| &*matrix.key).collect();
    // ROS names the camera beside its matrix.
    let own_name = root.get("camera_name").map(Node::text).transpose()?;
    let name = name.filter(|name| names.len() > 1 || own_name != Some(*name));
    let matrix = matrices[chosen(&names, name, "camera")?];
    let (_, number) = stem(&matrix.key);
    let [fx, skew, cx, zero, fy, cy, last @ ..] = matrix.exactly::<9>("3 rows of 3 numbers")?;
    if zero != 0.0 || last != [0.0, 0.0, 1.0] {
        let hint = "give [fx, skew, cx, 0, fy, cy, 0, 0, 1], pixels";
        return Err(matrix.error("is no camera matrix", hint));
    }
    let coefficients = of_camera(root, &COEFFICIENTS, &number);
    if let (None, Some(first)) = (coefficients, root.get("k1")) {
        let hint = "give them as distortion_coefficients: [k1, k2, p1, p2, k3]";
        return Err(first.error("is a coefficient with a key of its own", hint));
    }
    let distortion = coefficients
        .map(|node| distortion(root, node))
        .transpose()?;
    Ok(CameraOfFile {
        resolution_px: resolution_px(root, &number)?,
        lens: lens(
            intrinsics_of_opencv([fx, skew, cx, fy, cy]),
            distortion.flatten(),
        ),
        pose: None,
        on_body: None,
        unused: unused(root),
    })
}

/// A key in small letters without "_", and the number of a camera at its end.
fn stem(key: &str) -> (String, String) {
    let small = key.replace(['_', '-'], "").to_ascii_lowercase();
    let stem = small.trim_end_matches(|c: char| c.is_ascii_digit());
    (stem.to_owned(), small[stem.len()..].to_owned())
}

/// The value of one of these keys, with the number of the camera, or else without one.
fn of_camera<'n, 't>(root: &'n Node<'t>, stems: &[&str], number: &str) -> Option<&'n Node<'t>> {
    let with = |number: &str| {
        let entries = &mut root.entries().iter();
        entries.find(|entry| {
            let (stem, own) = stem(&entry.key);
            own == number && stems.contains(&&*stem)
        })
    };
    with(number).or_else(|| with(""))
}

fn resolution_px(root: &Node, number: &str) -> Read<Option<[u32; 2]>> {
    let side = |stems| of_camera(root, stems, number);
    if let (Some(width), Some(height)) = (side(&WIDTH), side(&HEIGHT)) {
        return Ok(Some([width.pixels()?, height.pixels()?]));
    }
    let Some(size) = side(&SIZE) else {
        return Ok(None);
    };
    let pixels = size.exactly::<2>("width and height")?;
    if pixels
        .iter()
        .any(|&px| px.fract() != 0.0 || !(0.0..=1e9).contains(&px))
    {
        return Err(size.error(format!("is {pixels:?}"), "give whole numbers of pixels"));
    }
    Ok(Some(pixels.map(|px| px as u32)))
}

/// The distortion of these coefficients, with the model that the table names; `None` without one.
fn distortion(table: &Node, coefficients: &Node) -> Read<Option<Distortion>> {
    let model = table.get("distortion_model");
    let is_flagged = table.get("fisheye_model").map(Node::number).transpose()?;
    let flagged = match is_flagged {
        Some(flag) if flag != 0.0 => "fisheye",
        _ => "plumb_bob",
    };
    let name = model.map(Node::text).transpose()?.unwrap_or(flagged);
    let numbers = coefficients.numbers()?;
    let count = numbers.len();
    let wrong = |due: &str| {
        let problem = format!("has {count} numbers, and the model is \"{}\"", shown(name));
        coefficients.error(problem, format!("give {due}"))
    };
    match &*name.to_ascii_lowercase().replace(['-', ' '], "_") {
        "none" | "" => Ok(None),
        // ROS writes none for an image without distortion.
        "plumb_bob" if count == 0 => Ok(None),
        "plumb_bob" | "rational_polynomial" | "radtan" | "radial_tangential" | "opencv" => {
            let distortion = Distortion::from_opencv(&numbers);
            distortion
                .map(Some)
                .ok_or_else(|| wrong("4, 5, 8, 12 or 14"))
        }
        "equidistant" | "fisheye" => {
            let four = numbers.try_into().map_err(|_| wrong("4"))?;
            Ok(Some(Distortion::Fisheye(four)))
        }
        _ => Err(model.unwrap_or(coefficients).error(
            format!("is \"{}\", which camlux does not know", shown(name)),
            "calibrate with plumb_bob, rational_polynomial, radtan or equidistant",
        )),
    }
}

/// A camera of Kalibr or EuRoC.
fn kalibr(table: &Node) -> Read<CameraOfFile> {
    if let Some(model) = table.get("camera_model")
        && model.text()? != "pinhole"
    {
        let problem = format!(
            "is \"{}\", which camlux does not know",
            shown(model.text()?)
        );
        return Err(model.error(problem, "calibrate with the model pinhole"));
    }
    let [fx, fy, cx, cy] = table.need("intrinsics")?.exactly("fx, fy, cx, cy")?;
    let coefficients = of_camera(table, &COEFFICIENTS, "");
    let distortion = coefficients
        .map(|node| distortion(table, node))
        .transpose()?;
    let on_body = table.get("T_BS").map(|node| pose(node, CameraAxes::OpenCv));
    Ok(CameraOfFile {
        resolution_px: resolution_px(table, "")?,
        lens: lens(
            intrinsics_of_opencv([fx, 0.0, cx, fy, cy]),
            distortion.flatten(),
        ),
        pose: None,
        on_body: on_body.transpose()?.as_ref().map(place),
        unused: unused(table),
    })
}
