//! Reads `[camera]`, and the lens of a projector.

use std::path::Path;

use glam::DVec3;

use crate::Result;
use crate::import::calibration::{self, CameraOfFile};
use crate::keys::{Keys, Value};
use crate::scene::{Camera, CameraAxes, Distortion, Intrinsics, Lens, PixelFilter, PixelSampling};

/// The keys of a pose, of which a file with a pose takes the place.
const POSE: [&str; 6] = [
    "position",
    "look_at",
    "up",
    "camera_to_world",
    "world_to_camera",
    "axes",
];

/// The keys that tell the focal lengths.
const LENSES: [&str; 5] = [
    "fov_x_deg",
    "fov_y_deg",
    "intrinsics_px",
    "camera_matrix",
    "projection",
];

/// The keys that bend lines.
const DISTORTIONS: [&str; 2] = ["distortion", "fisheye"];

/// The camera, and a warning of what its file holds and camlux does not use.
pub(super) fn camera(mut keys: Keys, folder: &Path) -> Result<(Camera, Option<String>)> {
    let others = [
        "resolution",
        "height_m",
        "samples",
        "filter",
        "path",
        "name",
    ];
    keys.only(&[&POSE, &LENSES[..], &DISTORTIONS, &others].concat())?;
    let path = keys.take("path");
    let Some(path) = &path else {
        keys.refuse(
            "name",
            "names a camera of a file, but there is no path",
            "add path = \"room.glb\", or remove it",
        )?;
        let camera = Camera {
            resolution_px: resolution(&mut keys)?,
            position_m: DVec3::ZERO,
            look_at_m: DVec3::Z,
            up: DVec3::Y,
            lens: lens(&mut keys, "[camera]")?,
            pixel_sampling: pixel_sampling(&mut keys)?,
        };
        return Ok((posed(camera, &mut keys)?, None));
    };
    // Without a name it is the file's only camera.
    let name = keys.take("name");
    let name = name.as_ref().map(Value::text).transpose()?;
    let file = folder.join(path.text()?);
    let of_file = calibration::camera(&file, &path.at, name)?;
    let mut refuse = |key: &str| {
        let hint = "remove it, or path";
        keys.refuse(key, "comes from the file that path names", hint)
    };
    let CameraOfFile {
        resolution_px,
        lens,
        pose,
        on_body,
        unused,
    } = of_file;
    LENSES
        .iter()
        .chain(&DISTORTIONS)
        .chain(&["height_m"])
        .try_for_each(|key| refuse(key))?;
    if resolution_px.is_some() {
        refuse("resolution")?;
    }
    if pose.is_some() {
        POSE.iter().try_for_each(|key| refuse(key))?;
    }
    let resolution_px = match resolution_px {
        Some(resolution_px) => resolution_px,
        None => resolution(&mut keys)?,
    };
    let is_posed = keys.lines().any(|(key, _)| POSE.contains(&&*key));
    let pose = pose.or(on_body.filter(|_| !is_posed));
    let [position_m, look_at_m, up] = pose.unwrap_or_default();
    let camera = Camera {
        resolution_px,
        position_m,
        look_at_m,
        up,
        lens,
        pixel_sampling: pixel_sampling(&mut keys)?,
    };
    let camera = match pose {
        Some(_) => camera,
        None => posed(camera, &mut keys)?,
    };
    Ok((camera, unused.warning(&file)))
}

fn resolution(keys: &mut Keys) -> Result<[u32; 2]> {
    keys.need("resolution", "resolution = [800, 800]")?.counts()
}

/// Reads the pose.
fn posed(camera: Camera, keys: &mut Keys) -> Result<Camera> {
    let Some((key, matrix)) = keys.take_one(&["camera_to_world", "world_to_camera"])? else {
        let problem = "tells the axes of a matrix, but there is none";
        let hint = "add camera_to_world or world_to_camera, or remove it";
        keys.refuse("axes", problem, hint)?;
        return Ok(Camera {
            position_m: keys.need("position", "position = [x, y, z]")?.vec3()?,
            look_at_m: keys.need("look_at", "look_at = [x, y, z]")?.vec3()?,
            up: keys.optional("up", |up| up.vec3())?.unwrap_or(DVec3::Y),
            ..camera
        });
    };
    for other in ["position", "look_at", "up"] {
        let problem = format!("is given beside \"{key}\"");
        keys.refuse(other, &problem, "keep one of them")?;
    }
    let which =
        "axes = \"opencv\" (x right, y down, z forward) or \"opengl\" (x right, y up, z backward)";
    let axes = keys.need("axes", which)?;
    let axes = axes.choice(&CameraAxes::ALL, CameraAxes::name)?;
    let pose = axes.pose(&matrix.rows::<4>()?, key == "camera_to_world");
    let hint = "give 3 or 4 rows [r, r, r, t] of a rotation and a translation in metres, for column vectors, without scale and mirror";
    let pose = pose.map_err(|problem| matrix.error(problem, hint))?;
    Ok(camera.posed(&pose))
}

fn pixel_sampling(keys: &mut Keys) -> Result<Option<PixelSampling>> {
    let samples = keys.optional("samples", Value::count)?.unwrap_or(1);
    let filter = keys.take("filter");
    if samples == 1 {
        return match filter {
            None => Ok(None),
            Some(filter) => Err(filter.error(
                "is given without samples to filter",
                "give samples = 16, too, or leave it out",
            )),
        };
    }
    Ok(Some(PixelSampling {
        samples,
        filter: match filter {
            None => PixelFilter::default(),
            Some(filter) => filter.choice(&PixelFilter::ALL, PixelFilter::name)?,
        },
    }))
}

/// Reads a lens. `table`: the name of the table that contains it.
pub(super) fn lens(keys: &mut Keys, table: &str) -> Result<Lens> {
    let distortion = distortion(keys)?;
    let given = keys.take_one(&LENSES)?;
    if let (Some(("fov_x_deg" | "fov_y_deg" | "projection", fov)), Some(_)) = (&given, distortion) {
        return Err(fov.error(
            "is given with a distortion, whose calibration tells the focal lengths",
            "give intrinsics_px = { fx = .., fy = .., cx = .., cy = .. } instead",
        ));
    }
    if let Some(("projection", name)) = &given
        && name.choice(&["equirectangular", "orthographic"], |name| name)? == "orthographic"
    {
        let hint = "height_m = 2.0, from the image's upper edge to its lower";
        let height_m = keys.need("height_m", hint)?.number()?;
        return Ok(Lens::Orthographic { height_m });
    }
    keys.refuse(
        "height_m",
        "is the height of the image of an orthographic camera, and this camera is none",
        "add projection = \"orthographic\" in place of the lens, or remove it",
    )?;
    let intrinsics = match given {
        Some(("fov_x_deg", fov)) => {
            return Ok(Lens::FovX {
                fov_x_deg: fov.number()?,
            });
        }
        Some(("fov_y_deg", fov)) => {
            return Ok(Lens::FovY {
                fov_y_deg: fov.number()?,
            });
        }
        Some(("projection", _)) => return Ok(Lens::Equirectangular),
        Some(("camera_matrix", matrix)) => intrinsics_of_matrix(&matrix)?,
        Some((_, intrinsics)) => {
            let mut keys = intrinsics.table("intrinsics_px")?;
            keys.only(&["fx", "fy", "cx", "cy", "skew"])?;
            let mut pixels = |key| keys.need(key, "all four of fx, fy, cx, cy")?.number();
            Intrinsics {
                fx: pixels("fx")?,
                fy: pixels("fy")?,
                cx: pixels("cx")?,
                cy: pixels("cy")?,
                skew: keys.optional("skew", Value::number)?.unwrap_or_default(),
            }
        }
        None => {
            return Err(keys.error(
                format!("{table} has neither \"fov_y_deg\" nor \"intrinsics_px\""),
                "add fov_y_deg = 50.0 or intrinsics_px = { fx = .., fy = .., cx = .., cy = .. }",
            ));
        }
    };
    Ok(match distortion {
        None => Lens::Intrinsics(intrinsics),
        Some(distortion) => Lens::Distorted {
            intrinsics,
            distortion,
        },
    })
}

/// Reads K.
fn intrinsics_of_matrix(matrix: &Value) -> Result<Intrinsics> {
    let hint = "give [[fx, skew, cx], [0, fy, cy], [0, 0, 1]], pixels";
    match matrix.rows::<3>()?[..] {
        [[fx, skew, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]] => Ok(Intrinsics {
            fx,
            fy,
            cx,
            cy,
            skew,
        }),
        ref rows => Err(matrix.error(format!("has the rows {rows:?}"), hint)),
    }
}

/// Reads the distortion. Missing coefficients are 0.
fn distortion(keys: &mut Keys) -> Result<Option<Distortion>> {
    fn named<const N: usize>(value: Value, names: [&str; N]) -> Result<[f64; N]> {
        let mut keys = value.table("coefficients")?;
        keys.only(&names)?;
        let mut values = [0.0; N];
        for (value, name) in values.iter_mut().zip(names) {
            *value = keys.optional(name, Value::number)?.unwrap_or_default();
        }
        Ok(values)
    }
    let Some((key, value)) = keys.take_one(&DISTORTIONS)? else {
        return Ok(None);
    };
    Ok(Some(match (key, value.is_list()) {
        ("fisheye", true) => Distortion::Fisheye(value.numbers()?),
        ("fisheye", false) => Distortion::Fisheye(named(value, Distortion::FISHEYE)?),
        (_, true) => {
            let vector = value.number_list()?;
            Distortion::from_opencv(&vector).ok_or_else(|| {
                let problem = format!("has {} coefficients", vector.len());
                value.error(problem, "give OpenCV's 4, 5, 8, 12 or 14")
            })?
        }
        (_, false) => Distortion::Rational(named(value, Distortion::RATIONAL)?),
    }))
}
