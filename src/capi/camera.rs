//! Camera and sensor.

use glam::DVec3;

use super::*;
use crate::scene::{
    BayerPattern, Camera, Distortion, Intrinsics, Lens, PixelFilter, PixelSampling, Sensor,
    SensorNoise, Vignetting,
};

/// Lens given by `fov_y_deg`.
pub const CAMLUX_LENS_FOV_Y: i32 = 0;
/// Lens given by `fx_px`, `fy_px`, `cx_px`, `cy_px`.
pub const CAMLUX_LENS_INTRINSICS: i32 = 1;
/// As CAMLUX_LENS_INTRINSICS, with the distortion of OpenCV's calibrateCamera: k1, k2, p1, p2, k3, k4, k5, k6, and prism_tilt.
pub const CAMLUX_LENS_RATIONAL: i32 = 2;
/// As CAMLUX_LENS_INTRINSICS, with the distortion of OpenCV's fisheye: k1, k2, k3, k4.
pub const CAMLUX_LENS_FISHEYE: i32 = 3;
/// Lens given by `fov_x_deg`.
pub const CAMLUX_LENS_FOV_X: i32 = 4;
/// All directions: 360 degrees of longitude from left to right, 180 degrees of latitude from top to bottom, the view in the middle.
pub const CAMLUX_LENS_EQUIRECTANGULAR: i32 = 5;
/// Parallel rays along the view, from the plane through `position_m`. `height_m` is the height of the image.
pub const CAMLUX_LENS_ORTHOGRAPHIC: i32 = 6;

/// All samples of a pixel have the same weight.
pub const CAMLUX_FILTER_BOX: i32 = 0;
/// Gaussian weights with a standard deviation of 0.5 pixels, cut off 1.5 pixels from the pixel's centre.
pub const CAMLUX_FILTER_GAUSSIAN: i32 = 1;

/// Pixels have no colour filters.
pub const CAMLUX_BAYER_NONE: i32 = 0;
/// Colour filters, row by row from the upper left pixel: R G, G B.
pub const CAMLUX_BAYER_RGGB: i32 = 1;
/// Colour filters: G R, B G.
pub const CAMLUX_BAYER_GRBG: i32 = 2;
/// Colour filters: G B, R G.
pub const CAMLUX_BAYER_GBRG: i32 = 3;
/// Colour filters: B G, G R.
pub const CAMLUX_BAYER_BGGR: i32 = 4;

/// A camera. Initialise with CAMLUX_CAMERA_INIT: 640 x 480 pixels, at the origin, looking along +z with +y up, 45 degrees.
///
/// Pixel (0, 0) is the upper left one, and its centre is at (0.5, 0.5): add 0.5 to a cx, cy of OpenCV.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_camera {
    /// Set by CAMLUX_CAMERA_INIT.
    pub struct_size: u32,
    /// Width of the image, pixels.
    pub width_px: u32,
    /// Height of the image, pixels.
    pub height_px: u32,
    /// One of CAMLUX_LENS_FOV_Y, _FOV_X, _EQUIRECTANGULAR, _ORTHOGRAPHIC, _INTRINSICS, _RATIONAL, _FISHEYE. Members of other lens models are ignored.
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
    /// Focal lengths in pixels, above 0: x_px = fx_px * X / Z + skew_px * Y / Z + cx_px with X right, Y down, Z forward.
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
    /// As fov_y_deg, from the left to the right edge: for CAMLUX_LENS_FOV_X.
    pub fov_x_deg: f64,
    /// See fx_px; 0 where columns are at a right angle to the rows.
    pub skew_px: f64,
    /// Further coefficients of CAMLUX_LENS_RATIONAL: s1, s2, s3, s4 of a thin prism, and the tilt of the sensor tau_x, tau_y, radians.
    pub prism_tilt: [f64; 6],
    /// CAMLUX_LENS_ORTHOGRAPHIC: extent of the image from its upper to its lower edge, m, above 0.
    pub height_m: f64,
}

/// A sensor, which turns the irradiance on a pixel into energy: Q = E * pixel area * duty cycle * exposure time. Initialise with
/// CAMLUX_SENSOR_INIT, and set at least pixel_pitch_um and exposure_time_s.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_sensor {
    /// Set by CAMLUX_SENSOR_INIT.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Width and height of a pixel, micrometres, above 0.
    pub pixel_pitch_um: [f64; 2],
    /// Exposure time, seconds, above 0.
    pub exposure_time_s: f64,
    /// Fraction of the exposure in which the signal is on, 0 to 1.
    pub duty_cycle: f64,
    /// Wavelength with which electrons are counted, nanometres: by time of flight (camlux_scene_set_tof), with noise
    /// (camlux_scene_set_sensor_noise), and with bayer or monochrome. 0, with quantum_efficiency 0: electrons are not counted.
    pub wavelength_nm: f64,
    /// Electrons per photon, above 0 and up to 1.
    pub quantum_efficiency: f64,
    /// Focal length divided by the diameter of the aperture. The irradiance on a pixel is its radiance times (pi/4) / f_number^2 * cos^4 of the
    /// angle to the axis, or the polynomial of vignetting or the map of camlux_scene_set_vignetting_map in place of cos^4. With CAMLUX_LENS_ORTHOGRAPHIC that angle is 0. 0: the irradiance is numerically the radiance. With
    /// CAMLUX_LENS_FISHEYE and CAMLUX_LENS_EQUIRECTANGULAR only beside one of them.
    pub f_number: f64,
    /// Factors of quantum_efficiency for light in the bands R, G and B. Time of flight has its own.
    pub band_weights: [f64; 3],
    /// CAMLUX_BAYER_NONE, or the colour filters: each pixel then counts the electrons of one band, CAMLUX_LAYER_RAW_ELECTRONS.
    pub bayer: i32,
    /// 1: a pixel counts the electrons of all bands together, CAMLUX_LAYER_RAW_ELECTRONS; otherwise 0.
    pub monochrome: i32,
    /// k1, k2 and k3 of the measured vignetting, 1 + k1 r^2 + k2 r^4 + k3 r^6, where r is the distance of a pixel's centre from the principal
    /// point over half the diagonal of the image, both in pixels. Above 0 wherever the lens sees. Read if has_vignetting is 1.
    pub vignetting: [f64; 3],
    /// 1: vignetting takes the place of cos^4, and f_number is needed; otherwise 0.
    pub has_vignetting: i32,
    /// 0.
    pub reserved_end: u32,
}

/// The noise of a sensor (EMVA 1288), with or without time of flight, and its conversion of electrons to digital numbers. Each value of a
/// pixel is a separate well: for time of flight, each tap. Initialise with CAMLUX_TOF_NOISE_INIT, and set at least full_well_e. Defaults: 12
/// bits, 1 DN per electron, shot noise only.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_tof_noise {
    /// Set by CAMLUX_TOF_NOISE_INIT.
    pub struct_size: u32,
    /// Bits, 1 to 24: DN are from 0 to 2^bits - 1.
    pub bits: u32,
    /// Seed of the noise. The noise also differs for each frame_index and seed of camlux_render_options, and for each camera.
    pub seed: u64,
    /// Dark current of a well, electrons per second.
    pub dark_e_per_s: f64,
    /// Standard deviation of the read noise, electrons.
    pub read_noise_e: f64,
    /// Largest number of electrons that a well holds.
    pub full_well_e: f64,
    /// DN per electron.
    pub gain_dn_per_e: f64,
    /// DN for 0 electrons.
    pub black_level_dn: f64,
    /// Dark signal non-uniformity (DSNU), electrons: standard deviation over the pixels of what a pixel adds to every reading. It depends on
    /// the seed, and stays from frame to frame.
    pub dsnu_e: f64,
    /// Photo response non-uniformity (PRNU), 0 to 1: standard deviation over the pixels of the factor of their quantum efficiency. It stays
    /// like dsnu_e.
    pub prnu: f64,
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

c_struct!(
    camlux_sensor, 40,
    duty_cycle: Sensor::DEFAULT.duty_cycle,
    band_weights: Sensor::DEFAULT.band_weights,
);

c_struct!(
    camlux_tof_noise, 56,
    bits: SensorNoise::DEFAULT.bits,
    gain_dn_per_e: SensorNoise::DEFAULT.gain_dn_per_e,
);

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

/// Sets the sensor. Frames then have the layer CAMLUX_LAYER_ENERGY. The noise of the sensor before stays (camlux_scene_set_sensor_noise).
///
/// \param sensor NULL: none, the default, and no noise.
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
        let mut object = object.lock_to_change();
        let noise = object.scene.sensor.and_then(|before| before.noise);
        let sensor = sensor.map(|sensor| Sensor { noise, ..sensor });
        sensor.map_or(Ok(()), |sensor| sensor.validate())?;
        object.scene.sensor = sensor;
        Ok(())
    })
}

/// Sets the noise of the sensor. Frames then have the layers CAMLUX_LAYER_ELECTRONS and CAMLUX_LAYER_DN; with bayer or monochrome of
/// camlux_sensor CAMLUX_LAYER_RAW_ELECTRONS and CAMLUX_LAYER_RAW_DN. Time of flight has its own noise, in camlux_tof.
///
/// \param noise NULL: none, the default.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT, also without a sensor; CAMLUX_ERROR_SCENE for values out of range, and
/// for a sensor without wavelength_nm and quantum_efficiency.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_sensor_noise(
    scene: *mut camlux_scene,
    noise: *const camlux_tof_noise,
) -> camlux_status {
    ffi_guard("camlux_scene_set_sensor_noise", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let noise = unsafe { args::read_optional(noise) }?.map(noise_from_c);
        let mut object = object.lock_to_change();
        match object.scene.sensor {
            Some(sensor) => {
                let sensor = Sensor { noise, ..sensor };
                sensor.validate()?;
                object.scene.sensor = Some(sensor);
                Ok(())
            }
            None if noise.is_none() => Ok(()),
            None => Err(Failure::argument(
                "there is no sensor that has noise; call camlux_scene_set_sensor first",
            )),
        }
    })
}

/// Reads the noise of the sensor.
///
/// \param noise initialise with CAMLUX_TOF_NOISE_INIT. Unchanged if there is none.
/// \param is_set receives 1, or 0 if there is none.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_sensor_noise(
    scene: *mut camlux_scene,
    noise: *mut camlux_tof_noise,
    is_set: *mut i32,
) -> camlux_status {
    ffi_guard("camlux_scene_get_sensor_noise", || {
        let sensor = handle::get(scene)?.lock().scene.sensor;
        let found = sensor.and_then(|sensor| sensor.noise);
        // SAFETY: the caller guarantees it.
        unsafe { args::write_optional(noise, is_set, found.as_ref().map(noise_to_c)) }
    })
}

/// Reads the sensor.
///
/// \param sensor initialise with CAMLUX_SENSOR_INIT. Unchanged if there is none.
/// \param is_set receives 1, or 0 if there is none.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_sensor(
    scene: *mut camlux_scene,
    sensor: *mut camlux_sensor,
    is_set: *mut i32,
) -> camlux_status {
    ffi_guard("camlux_scene_get_sensor", || {
        let found = handle::get(scene)?.lock().scene.sensor;
        // SAFETY: the caller guarantees it.
        unsafe { args::write_optional(sensor, is_set, found.as_ref().map(sensor_to_c)) }
    })
}

pub(super) fn camera_from_c(camera: camlux_camera) -> Outcome<Camera> {
    let intrinsics = Intrinsics {
        fx: camera.fx_px,
        fy: camera.fy_px,
        cx: camera.cx_px,
        cy: camera.cy_px,
        skew: camera.skew_px,
    };
    let distorted = |distortion| Lens::Distorted {
        intrinsics,
        distortion,
    };
    let [k1, k2, k3, k4, ..] = camera.distortion;
    let is_distorted = [CAMLUX_LENS_RATIONAL, CAMLUX_LENS_FISHEYE].contains(&camera.lens);
    if !is_distorted && camera.distortion != [0.0; 8] {
        return Err(Failure::argument(
            "lens has no distortion, but distortion is given; set lens to CAMLUX_LENS_RATIONAL or CAMLUX_LENS_FISHEYE",
        ));
    }
    if camera.lens != CAMLUX_LENS_RATIONAL && camera.prism_tilt != [0.0; 6] {
        return Err(Failure::argument(
            "lens has no thin prism and no tilt, but prism_tilt is given; set lens to CAMLUX_LENS_RATIONAL",
        ));
    }
    let mut rational = [0.0; 14];
    rational[..8].copy_from_slice(&camera.distortion);
    rational[8..].copy_from_slice(&camera.prism_tilt);
    let lenses = args::choices![
        CAMLUX_LENS_FOV_Y => Lens::FovY {
            fov_y_deg: camera.fov_y_deg,
        },
        CAMLUX_LENS_FOV_X => Lens::FovX {
            fov_x_deg: camera.fov_x_deg,
        },
        CAMLUX_LENS_EQUIRECTANGULAR => Lens::Equirectangular,
        CAMLUX_LENS_ORTHOGRAPHIC => Lens::Orthographic {
            height_m: camera.height_m,
        },
        CAMLUX_LENS_INTRINSICS => Lens::Intrinsics(intrinsics),
        CAMLUX_LENS_RATIONAL => distorted(Distortion::Rational(rational)),
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
    match camera.lens {
        Lens::FovY { fov_y_deg } => {
            found.fov_y_deg = fov_y_deg;
            return found;
        }
        Lens::FovX { fov_x_deg } => {
            (found.lens, found.fov_x_deg) = (CAMLUX_LENS_FOV_X, fov_x_deg);
            return found;
        }
        Lens::Equirectangular => {
            found.lens = CAMLUX_LENS_EQUIRECTANGULAR;
            return found;
        }
        Lens::Orthographic { height_m } => {
            (found.lens, found.height_m) = (CAMLUX_LENS_ORTHOGRAPHIC, height_m);
            return found;
        }
        Lens::Intrinsics(_) | Lens::Distorted { .. } => {}
    }
    let Intrinsics {
        fx,
        fy,
        cx,
        cy,
        skew,
    } = camera.intrinsics_px();
    (found.fx_px, found.fy_px) = (fx, fy);
    (found.cx_px, found.cy_px) = (cx, cy);
    found.skew_px = skew;
    found.lens = match camera.distortion() {
        None | Some(Distortion::Equirectangular) => CAMLUX_LENS_INTRINSICS,
        Some(Distortion::Rational(coefficients)) => {
            found.distortion.copy_from_slice(&coefficients[..8]);
            found.prism_tilt.copy_from_slice(&coefficients[8..]);
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
    args::reserved(camlux_sensor::NAME, sensor.reserved | sensor.reserved_end)?;
    let given = |value: f64| (value != 0.0).then_some(value);
    let patterns = args::choices![
        CAMLUX_BAYER_NONE => None,
        CAMLUX_BAYER_RGGB => Some(BayerPattern::Rggb),
        CAMLUX_BAYER_GRBG => Some(BayerPattern::Grbg),
        CAMLUX_BAYER_GBRG => Some(BayerPattern::Gbrg),
        CAMLUX_BAYER_BGGR => Some(BayerPattern::Bggr),
    ];
    let sensor = Sensor {
        pixel_pitch_um: sensor.pixel_pitch_um,
        exposure_time_s: sensor.exposure_time_s,
        duty_cycle: sensor.duty_cycle,
        wavelength_nm: given(sensor.wavelength_nm),
        quantum_efficiency: given(sensor.quantum_efficiency),
        f_number: given(sensor.f_number),
        vignetting: args::flag("has_vignetting", sensor.has_vignetting)?
            .then_some(Vignetting(sensor.vignetting)),
        band_weights: sensor.band_weights,
        bayer: args::one_of("bayer", sensor.bayer, &patterns)?,
        monochrome: args::flag("monochrome", sensor.monochrome)?,
        noise: None,
    };
    sensor.validate()?;
    Ok(sensor)
}

fn sensor_to_c(sensor: &Sensor) -> camlux_sensor {
    camlux_sensor {
        pixel_pitch_um: sensor.pixel_pitch_um,
        exposure_time_s: sensor.exposure_time_s,
        duty_cycle: sensor.duty_cycle,
        wavelength_nm: sensor.wavelength_nm.unwrap_or(0.0),
        quantum_efficiency: sensor.quantum_efficiency.unwrap_or(0.0),
        f_number: sensor.f_number.unwrap_or(0.0),
        band_weights: sensor.band_weights,
        bayer: match sensor.bayer {
            None => CAMLUX_BAYER_NONE,
            Some(BayerPattern::Rggb) => CAMLUX_BAYER_RGGB,
            Some(BayerPattern::Grbg) => CAMLUX_BAYER_GRBG,
            Some(BayerPattern::Gbrg) => CAMLUX_BAYER_GBRG,
            Some(BayerPattern::Bggr) => CAMLUX_BAYER_BGGR,
        },
        monochrome: sensor.monochrome.into(),
        vignetting: sensor.vignetting.unwrap_or_default().0,
        has_vignetting: sensor.vignetting.is_some().into(),
        ..Default::default()
    }
}
