//! Camera, sensor, and options of direct and indirect light.

use glam::DVec3;

use super::*;
use crate::{
    Error,
    scene::{
        Camera, DEFAULT_RSM_SIZE, DEFAULT_TARGET_ERROR, Direct, Distortion, ErrorNorm,
        IndirectLight, Intrinsics, Lens, Photodetector, PixelFilter, PixelSampling, Sensor, Shadow,
    },
};

/// Lens given by `fov_y_deg`.
pub const CAMLUX_LENS_FOV_Y: i32 = 0;
/// Lens given by `fx_px`, `fy_px`, `cx_px`, `cy_px`.
pub const CAMLUX_LENS_INTRINSICS: i32 = 1;
/// As CAMLUX_LENS_INTRINSICS, with the distortion of OpenCV's calibrateCamera: k1, k2, p1, p2, k3, k4, k5, k6.
pub const CAMLUX_LENS_RATIONAL: i32 = 2;
/// As CAMLUX_LENS_INTRINSICS, with the distortion of OpenCV's fisheye: k1, k2, k3, k4.
pub const CAMLUX_LENS_FISHEYE: i32 = 3;

/// All samples of a pixel have the same weight.
pub const CAMLUX_FILTER_BOX: i32 = 0;
/// Gaussian weights with a standard deviation of 0.5 pixels, cut off 1.5 pixels from the pixel's centre.
pub const CAMLUX_FILTER_GAUSSIAN: i32 = 1;

/// A camera. Initialise with CAMLUX_CAMERA_INIT: 640 x 480 pixels, at the origin, looking along +z with +y up, 45 degrees.
///
/// Pixel (0, 0) is the upper left one, and its centre is at (0.5, 0.5): add 0.5 to a cx, cy of OpenCV.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_camera {
    /// sizeof(camlux_camera)
    pub struct_size: u32,
    /// Width of the image, pixels.
    pub width_px: u32,
    /// Height of the image, pixels.
    pub height_px: u32,
    /// CAMLUX_LENS_FOV_Y or one of CAMLUX_LENS_INTRINSICS, _RATIONAL, _FISHEYE. Members of other lens models are ignored.
    pub lens: i32,
    /// The camera's centre in world space, m.
    pub position_m: [f64; 3],
    /// A point in the middle of the view, m; it must differ from position_m.
    pub look_at_m: [f64; 3],
    /// The upward direction in the image; of any length, not parallel to the view.
    pub up: [f64; 3],
    /// Full angle from the upper to the lower edge, degrees above 0 and below 180. Pixels are square, and the principal point is
    /// in the middle.
    pub fov_y_deg: f64,
    /// Focal lengths in pixels, above 0: x_px = fx_px * X / Z + cx_px with X right, Y down, Z forward.
    pub fx_px: f64,
    /// See fx_px.
    pub fy_px: f64,
    /// Principal point in pixels.
    pub cx_px: f64,
    /// See cx_px.
    pub cy_px: f64,
    /// Coefficients of CAMLUX_LENS_RATIONAL or CAMLUX_LENS_FISHEYE (first four). Coefficients that fold the image over are refused.
    pub distortion: [f64; 8],
    /// Number of samples averaged per pixel, up to 4096; 0 or 1: the pixel shows what is at its centre.
    pub samples: u32,
    /// Weight of the samples: CAMLUX_FILTER_BOX or CAMLUX_FILTER_GAUSSIAN.
    pub filter: i32,
}

/// A sensor, which turns the irradiance on a pixel into energy: Q = E * pixel area * duty cycle * exposure time. Initialise with
/// CAMLUX_SENSOR_INIT, and set at least pixel_pitch_um and exposure_time_s.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_sensor {
    /// sizeof(camlux_sensor)
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Width and height of a pixel, micrometres, above 0.
    pub pixel_pitch_um: [f64; 2],
    /// Exposure time, seconds, above 0.
    pub exposure_time_s: f64,
    /// Fraction of the exposure in which the signal is on, 0 to 1.
    pub duty_cycle: f64,
    /// Wavelength with which time of flight counts photons (camlux_scene_set_tof), nanometres. 0, with quantum_efficiency 0: the sensor has no
    /// photodetector for time of flight.
    pub wavelength_nm: f64,
    /// Electrons per photon, above 0 and up to 1.
    pub quantum_efficiency: f64,
    /// Focal length divided by the diameter of the aperture. The irradiance on a pixel is its radiance times (pi/4) / f_number^2 * cos^4 of the
    /// angle to the axis. 0: the irradiance is numerically the radiance. Not with CAMLUX_LENS_FISHEYE.
    pub f_number: f64,
}

/// Final gathering by rays from both ends. Converges to the true single bounce, and meets a target error.
pub const CAMLUX_ESTIMATOR_FINAL_GATHER: i32 = 0;
/// The mean over the reflective shadow map, as in CamSim, without distance falloff or visibility.
pub const CAMLUX_ESTIMATOR_RSM_AVERAGE: i32 = 1;
/// The plain sum over the virtual point lights (Keller 1997), without visibility.
pub const CAMLUX_ESTIMATOR_INSTANT_RADIOSITY: i32 = 2;

/// The target error applies to all pixels at once: bright pixels count most.
pub const CAMLUX_NORM_IMAGE: i32 = 0;
/// The target error applies to tiles of the image. Each tile with light has the same weight, so that no dark part stays noisy.
pub const CAMLUX_NORM_LOCAL: i32 = 1;

/// How the single bounce is computed. Initialise with CAMLUX_INDIRECT_INIT: final gathering with a target error of 0.02.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_indirect {
    /// sizeof(camlux_indirect)
    pub struct_size: u32,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER, CAMLUX_ESTIMATOR_RSM_AVERAGE or CAMLUX_ESTIMATOR_INSTANT_RADIOSITY.
    pub estimator: i32,
    /// Texels along an edge of a face of the reflective shadow map. 0: camlux chooses for CAMLUX_ESTIMATOR_FINAL_GATHER, and 64 for the others.
    pub rsm_size: u32,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: what target_error applies to, CAMLUX_NORM_IMAGE or CAMLUX_NORM_LOCAL.
    pub error_norm: i32,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: target error (relRMSE) against the true bounce, 0.002 to 0.5; 0: 0.02.
    pub target_error: f64,
    /// CAMLUX_ESTIMATOR_RSM_AVERAGE only: relative error (relRMSE), against the sum at every pixel, that interpolation between
    /// pixels may cause, 0.002 to 0.5; 0: no interpolation, the sum at every pixel.
    pub interpolation_error: f64,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: limit of the wall-clock time for the indirect light of a frame, milliseconds. If it is reached before
    /// the target error, the result is the best image so far. A first image is always made; least_ms in camlux_frame_stats is its time.
    /// 0: no limit.
    pub max_ms: f64,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: limit of the number of rays, like max_ms; a first image is always made. 0: no limit.
    pub max_rays: u64,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: 1: frames have the layer CAMLUX_LAYER_STDERR.
    pub stderr_layer: i32,
    /// 0.
    pub reserved: u32,
}

/// By rays if indirect light casts rays, a surface has cut-outs or a light has an area; otherwise from maps.
pub const CAMLUX_SHADOW_DEFAULT: i32 = 0;
/// From a map of what the light sees. Not for surfaces with cut-outs or lights with an area.
pub const CAMLUX_SHADOW_MAP: i32 = 1;
/// Exact, by one ray for each pixel and light.
pub const CAMLUX_SHADOW_RAYS: i32 = 2;

/// How direct light is computed. Initialise with CAMLUX_DIRECT_INIT: CAMLUX_SHADOW_DEFAULT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_direct {
    /// sizeof(camlux_direct)
    pub struct_size: u32,
    /// CAMLUX_SHADOW_DEFAULT, CAMLUX_SHADOW_MAP or CAMLUX_SHADOW_RAYS.
    pub shadow: i32,
}

c_struct!(
    camlux_camera, 128,
    width_px: 640,
    height_px: 480,
    look_at_m: [0.0, 0.0, 1.0],
    up: [0.0, 1.0, 0.0],
    fov_y_deg: 45.0,
    samples: 1,
);

c_struct!(camlux_sensor, 40, duty_cycle: 1.0);

c_struct!(camlux_indirect, 56);

c_struct!(camlux_direct, 8);

/// Sets the camera. Lights with CAMLUX_RELATIVE_TO_CAMERA move with it. Until then a created scene has the camera of CAMLUX_CAMERA_INIT.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values out of range.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_camera(
    scene: *mut camlux_scene,
    camera: *const camlux_camera,
) -> camlux_status {
    ffi_guard("camlux_scene_set_camera", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let camera = camera_from_c(unsafe { args::read(camera) }?)?;
        camera.validate()?;
        object.lock_to_change().scene.camera = camera;
        Ok(())
    })
}

/// Reads the camera as it was set or last moved.
///
/// \param camera initialise with CAMLUX_CAMERA_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_camera(
    scene: *mut camlux_scene,
    camera: *mut camlux_camera,
) -> camlux_status {
    ffi_guard("camlux_scene_get_camera", || {
        let object = handle::get(scene)?;
        let found = || Ok(camera_to_c(&object.lock().scene.camera));
        // SAFETY: the caller guarantees it.
        unsafe { args::write(camera, found) }
    })
}

/// Sets the sensor. Frames then have the layer CAMLUX_LAYER_ENERGY.
///
/// \param sensor NULL: none, the default.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values out of range.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_sensor(
    scene: *mut camlux_scene,
    sensor: *const camlux_sensor,
) -> camlux_status {
    ffi_guard("camlux_scene_set_sensor", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let sensor = unsafe { args::read_optional(sensor) }?;
        let sensor = sensor.map(sensor_from_c).transpose()?;
        object.lock_to_change().scene.sensor = sensor;
        Ok(())
    })
}

/// Sets how indirect light is computed. Frames then have the layer CAMLUX_LAYER_INDIRECT.
///
/// \param indirect NULL: direct light only, the default.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for members that do not go together.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_indirect(
    scene: *mut camlux_scene,
    indirect: *const camlux_indirect,
) -> camlux_status {
    ffi_guard("camlux_scene_set_indirect", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let indirect = unsafe { args::read_optional(indirect) }?;
        let indirect = indirect.map(indirect_from_c).transpose()?;
        object.lock_to_change().scene.indirect = indirect;
        Ok(())
    })
}

/// Sets how direct light is computed.
///
/// \param direct NULL: the default, CAMLUX_SHADOW_DEFAULT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_direct(
    scene: *mut camlux_scene,
    direct: *const camlux_direct,
) -> camlux_status {
    ffi_guard("camlux_scene_set_direct", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let direct = unsafe { args::read_optional(direct) }?.unwrap_or_default();
        let choices = args::choices![
            CAMLUX_SHADOW_DEFAULT => None,
            CAMLUX_SHADOW_MAP => Some(Shadow::Map),
            CAMLUX_SHADOW_RAYS => Some(Shadow::Rays),
        ];
        let shadow = args::one_of("shadow", direct.shadow, &choices)?;
        object.lock_to_change().scene.direct = Direct { shadow };
        Ok(())
    })
}

pub(super) fn camera_from_c(camera: camlux_camera) -> Outcome<Camera> {
    let intrinsics = Intrinsics {
        fx: camera.fx_px,
        fy: camera.fy_px,
        cx: camera.cx_px,
        cy: camera.cy_px,
    };
    let distorted = |distortion| Lens::Distorted {
        intrinsics,
        distortion,
    };
    let coefficients = camera.distortion;
    let [k1, k2, k3, k4, ..] = coefficients;
    let is_distorted = [CAMLUX_LENS_RATIONAL, CAMLUX_LENS_FISHEYE].contains(&camera.lens);
    if !is_distorted && coefficients != [0.0; 8] {
        return Err(Failure::argument(
            "lens has no distortion, but distortion is given; set lens to CAMLUX_LENS_RATIONAL or CAMLUX_LENS_FISHEYE",
        ));
    }
    let lenses = args::choices![
        CAMLUX_LENS_FOV_Y => Lens::FovY {
            fov_y_deg: camera.fov_y_deg,
        },
        CAMLUX_LENS_INTRINSICS => Lens::Intrinsics(intrinsics),
        CAMLUX_LENS_RATIONAL => distorted(Distortion::Rational(coefficients)),
        CAMLUX_LENS_FISHEYE => distorted(Distortion::Fisheye([k1, k2, k3, k4])),
    ];
    let filters = args::choices![
        CAMLUX_FILTER_BOX => PixelFilter::Box,
        CAMLUX_FILTER_GAUSSIAN => PixelFilter::Gaussian,
    ];
    let filter = args::one_of("filter", camera.filter, &filters)?;
    let samples = camera.samples;
    Ok(Camera {
        resolution_px: [camera.width_px, camera.height_px],
        position_m: DVec3::from(camera.position_m),
        look_at_m: DVec3::from(camera.look_at_m),
        up: DVec3::from(camera.up),
        lens: args::one_of("lens", camera.lens, &lenses)?,
        pixel_sampling: (samples > 1).then_some(PixelSampling { samples, filter }),
    })
}

fn camera_to_c(camera: &Camera) -> camlux_camera {
    let mut found = camlux_camera {
        width_px: camera.resolution_px[0],
        height_px: camera.resolution_px[1],
        position_m: camera.position_m.to_array(),
        look_at_m: camera.look_at_m.to_array(),
        up: camera.up.to_array(),
        ..Default::default()
    };
    if let Some(PixelSampling { samples, filter }) = camera.pixel_sampling {
        found.samples = samples;
        found.filter = match filter {
            PixelFilter::Box => CAMLUX_FILTER_BOX,
            PixelFilter::Gaussian => CAMLUX_FILTER_GAUSSIAN,
        };
    }
    if let Lens::FovY { fov_y_deg } = camera.lens {
        found.fov_y_deg = fov_y_deg;
        return found;
    }
    let Intrinsics { fx, fy, cx, cy } = camera.intrinsics_px();
    (found.fx_px, found.fy_px) = (fx, fy);
    (found.cx_px, found.cy_px) = (cx, cy);
    found.lens = match camera.distortion() {
        None => CAMLUX_LENS_INTRINSICS,
        Some(Distortion::Rational(coefficients)) => {
            found.distortion = coefficients;
            CAMLUX_LENS_RATIONAL
        }
        Some(Distortion::Fisheye(coefficients)) => {
            found.distortion[..4].copy_from_slice(&coefficients);
            CAMLUX_LENS_FISHEYE
        }
    };
    found
}

fn sensor_from_c(sensor: camlux_sensor) -> Outcome<Sensor> {
    args::reserved(camlux_sensor::NAME, sensor.reserved)?;
    let has_photodetector = sensor.wavelength_nm != 0.0 || sensor.quantum_efficiency != 0.0;
    let sensor = Sensor {
        pixel_pitch_um: sensor.pixel_pitch_um,
        exposure_time_s: sensor.exposure_time_s,
        duty_cycle: sensor.duty_cycle,
        photodetector: has_photodetector.then_some(Photodetector {
            wavelength_nm: sensor.wavelength_nm,
            quantum_efficiency: sensor.quantum_efficiency,
        }),
        f_number: (sensor.f_number != 0.0).then_some(sensor.f_number),
    };
    sensor.validate()?;
    Ok(sensor)
}

fn indirect_from_c(raw: camlux_indirect) -> Outcome<IndirectLight> {
    args::reserved(camlux_indirect::NAME, raw.reserved)?;
    let stderr_layer = args::flag("stderr_layer", raw.stderr_layer)?;
    let given = |value: f64| (value != 0.0).then_some(value);
    let (target, interpolation) = (given(raw.target_error), given(raw.interpolation_error));
    let (max_ms, max_rays) = (
        given(raw.max_ms),
        (raw.max_rays > 0).then_some(raw.max_rays),
    );
    let norms = args::choices![
        CAMLUX_NORM_IMAGE => ErrorNorm::Image,
        CAMLUX_NORM_LOCAL => ErrorNorm::Local,
    ];
    let error_norm = args::one_of("error_norm", raw.error_norm, &norms)?;
    let rsm_size = match raw.rsm_size {
        0 => DEFAULT_RSM_SIZE,
        rsm_size => rsm_size,
    };
    let choices = args::choices![
        CAMLUX_ESTIMATOR_FINAL_GATHER => IndirectLight::FinalGather {
            target_error: target.unwrap_or(DEFAULT_TARGET_ERROR),
            error_norm,
            rsm_size: (raw.rsm_size > 0).then_some(raw.rsm_size),
            max_ms,
            max_rays,
            stderr_layer,
        },
        CAMLUX_ESTIMATOR_RSM_AVERAGE => IndirectLight::RsmAverage {
            rsm_size,
            interpolation_error: interpolation,
        },
        CAMLUX_ESTIMATOR_INSTANT_RADIOSITY => IndirectLight::InstantRadiosity { rsm_size },
    ];
    let indirect = args::one_of("estimator", raw.estimator, &choices)?;
    let rays = |rays: Option<u64>| rays.map(|rays| rays as f64);
    let norm = |norm: ErrorNorm| (norm != ErrorNorm::Image).then_some(f64::from(raw.error_norm));
    let given_and_used = [
        ("target_error", target, indirect.target_error()),
        (
            "interpolation_error",
            interpolation,
            indirect.interpolation_error(),
        ),
        ("max_ms", max_ms, indirect.max_ms()),
        ("max_rays", rays(max_rays), rays(indirect.max_rays())),
        (
            "error_norm",
            norm(error_norm),
            indirect.error_norm().and_then(norm),
        ),
        (
            "stderr_layer",
            stderr_layer.then_some(1.0),
            indirect.stderr_layer().map(f64::from),
        ),
    ];
    for (name, given, used) in given_and_used {
        if let (Some(value), None) = (given, used) {
            let problem = format!("{name} is {value}, but {} has none", indirect.name());
            let hint = "leave it 0; see camlux_indirect for which estimator has which member";
            return Err(Error::scene("indirect", problem, hint).into());
        }
    }
    indirect.validate()?;
    Ok(indirect)
}
