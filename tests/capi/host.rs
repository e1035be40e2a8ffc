//! The C interface as a C program uses it, for the tests in Rust.

use std::{
    ffi::CStr,
    ptr::{null, null_mut},
};

use camlux::{
    capi::*,
    output::{Layer, LayerData, TofQuantity},
    scene::{
        AreaShape, Carrier, ChargeUnit, Distortion, ErrorNorm, IndirectLight, Lens, Light,
        PixelFilter, PixelSampling, Profile, TextureLookup, TimeOfFlight,
    },
};
use glam::DVec3;

pub use crate::objects::*;

pub fn last_error() -> String {
    // SAFETY: a string of the library, valid until this thread's next failing call.
    let message = unsafe { CStr::from_ptr(camlux_last_error()) };
    message.to_str().expect("messages are UTF-8").to_owned()
}

pub const ARGUMENT: camlux_status = CAMLUX_ERROR_INVALID_ARGUMENT;
pub const SCENE: camlux_status = CAMLUX_ERROR_SCENE;

#[track_caller]
pub fn ok(status: camlux_status) {
    assert_eq!(status, CAMLUX_OK, "{}", last_error());
}

/// Asserts that a call failed with this status and a message with these words.
#[track_caller]
pub fn fails(status: camlux_status, expected: camlux_status, words: &str) {
    let message = last_error();
    assert_eq!(status, expected, "{message}");
    assert!(message.contains(words), "{message:?} lacks {words:?}");
}

/// The value of an `_INIT` macro.
macro_rules! init {
    ($name:ident { $($field:ident : $value:expr),* $(,)? }) => {{
        #[allow(unused_mut, reason = "not all are changed")]
        let mut value = $name::default();
        $(value.$field = $value;)*
        value
    }};
}
pub(crate) use init;

/// The same for a frame that was rendered without the C interface.
pub fn layers_of(frame: &camlux::output::Frame) -> Vec<(i32, Vec<u32>)> {
    let number = |layer: Layer| {
        let first = layer.c_constant().map_or(-1, |(_, number)| number);
        match layer {
            Layer::Tof(frequency, TofQuantity::Taps(phase)) => {
                first + CAMLUX_TOF_NEXT_FREQUENCY * i32::from(frequency) + i32::from(phase)
            }
            Layer::Tof(frequency, _) => first + CAMLUX_TOF_NEXT_FREQUENCY * i32::from(frequency),
            _ => first,
        }
    };
    let bits = |data: &LayerData| match data {
        LayerData::Float(values) => values.iter().map(|value| value.to_bits()).collect(),
        LayerData::Id(ids) => ids.clone(),
    };
    let layers = frame.layers.iter();
    layers
        .map(|(layer, data)| (number(*layer), bits(data)))
        .collect()
}

pub fn handle_count() -> u32 {
    let mut count = 0;
    // SAFETY: it points to a number.
    ok(unsafe { camlux_handle_count(&mut count) });
    count
}

pub fn array<T>(values: &[T], format: i32) -> camlux_array {
    camlux_array {
        data: values.as_ptr().cast(),
        stride_bytes: 0,
        format,
        reserved: 0,
    }
}

pub fn set_tof(scene: &Scene, tof: &TimeOfFlight) {
    let ambient: Vec<u32> = tof.ambient_lights.iter().map(|&i| i as u32).collect();
    let mut c_tof = init!(camlux_tof {
        frequency_count: tof.frequencies_hz.len() as u32,
        band_weights: tof.band_weights,
        phase_offset_deg: tof.phase_offset_deg,
        phase_count: tof.phase_count,
        output: match tof.output {
            ChargeUnit::Electrons => CAMLUX_CHARGE_ELECTRONS,
            ChargeUnit::DigitalNumbers => CAMLUX_CHARGE_DN,
        },
        ambient_lights: ambient.as_ptr(),
        ambient_light_count: ambient.len(),
    });
    c_tof.frequencies_hz[..tof.frequencies_hz.len()].copy_from_slice(&tof.frequencies_hz);
    c_tof.contrasts[..tof.contrasts.len()].copy_from_slice(&tof.contrasts);
    let noise = tof.noise.map(|noise| {
        init!(camlux_tof_noise {
            bits: noise.bits,
            seed: noise.seed,
            dark_e_per_s: noise.dark_e_per_s,
            read_noise_e: noise.read_noise_e,
            full_well_e: noise.full_well_e,
            gain_dn_per_e: noise.gain_dn_per_e,
            black_level_dn: noise.black_level_dn,
        })
    });
    c_tof.noise = noise.as_ref().map_or(null(), std::ptr::from_ref);
    ok(scene.set_tof(&c_tof));
}

/// Rebuilds a scene call by call, from the arrays of its parts.
pub fn from_arrays(scene: &camlux::Scene) -> Scene {
    let built = new_scene();
    let camera = scene.camera;
    let mut c_camera = init!(camlux_camera {
        width_px: camera.resolution_px[0],
        height_px: camera.resolution_px[1],
        position_m: camera.position_m.to_array(),
        look_at_m: camera.look_at_m.to_array(),
        up: camera.up.to_array(),
    });
    match camera.lens {
        Lens::FovY { fov_y_deg } => c_camera.fov_y_deg = fov_y_deg,
        Lens::FovX { fov_x_deg } => {
            (c_camera.lens, c_camera.fov_x_deg) = (CAMLUX_LENS_FOV_X, fov_x_deg);
        }
        Lens::Equirectangular => c_camera.lens = CAMLUX_LENS_EQUIRECTANGULAR,
        Lens::Orthographic { height_m } => {
            (c_camera.lens, c_camera.height_m) = (CAMLUX_LENS_ORTHOGRAPHIC, height_m);
        }
        Lens::Intrinsics(lens)
        | Lens::Distorted {
            intrinsics: lens, ..
        } => {
            c_camera.lens = CAMLUX_LENS_INTRINSICS;
            (c_camera.fx_px, c_camera.fy_px) = (lens.fx, lens.fy);
            (c_camera.cx_px, c_camera.cy_px) = (lens.cx, lens.cy);
            c_camera.skew_px = lens.skew;
        }
    }
    if let Some(PixelSampling { samples, filter }) = camera.pixel_sampling {
        c_camera.samples = samples;
        c_camera.filter = match filter {
            PixelFilter::Box => CAMLUX_FILTER_BOX,
            PixelFilter::Gaussian => CAMLUX_FILTER_GAUSSIAN,
        };
    }
    match camera.distortion() {
        None | Some(Distortion::Equirectangular) => {}
        Some(Distortion::Rational(coefficients)) => {
            c_camera.lens = CAMLUX_LENS_RATIONAL;
            c_camera.distortion.copy_from_slice(&coefficients[..8]);
            c_camera.prism_tilt.copy_from_slice(&coefficients[8..]);
        }
        Some(Distortion::Fisheye(coefficients)) => {
            c_camera.lens = CAMLUX_LENS_FISHEYE;
            c_camera.distortion[..4].copy_from_slice(&coefficients);
        }
    }
    ok(built.set_camera(&c_camera));
    if let Some(sensor) = scene.sensor {
        let c_sensor = init!(camlux_sensor {
            pixel_pitch_um: sensor.pixel_pitch_um,
            exposure_time_s: sensor.exposure_time_s,
            duty_cycle: sensor.duty_cycle,
            wavelength_nm: sensor.wavelength_nm.unwrap_or_default(),
            quantum_efficiency: sensor.quantum_efficiency.unwrap_or_default(),
            f_number: sensor.f_number.unwrap_or_default(),
            vignetting: sensor.vignetting.unwrap_or_default().0,
            has_vignetting: sensor.vignetting.is_some().into(),
        });
        ok(built.set_sensor(&c_sensor));
    }
    if let Some(tof) = &scene.tof {
        set_tof(&built, tof);
    }
    if let Some(indirect) = scene.indirect {
        let gather = indirect.gather();
        let range_mm = gather.and_then(|gather| gather.target_range_error_mm);
        let c_indirect = init!(camlux_indirect {
            estimator: match indirect {
                IndirectLight::FinalGather(_) => CAMLUX_ESTIMATOR_FINAL_GATHER,
                IndirectLight::RsmAverage(_) => CAMLUX_ESTIMATOR_RSM_AVERAGE,
                IndirectLight::InstantRadiosity(_) => CAMLUX_ESTIMATOR_INSTANT_RADIOSITY,
            },
            rsm_size: indirect.rsm_size().unwrap_or(0),
            error_norm: match gather.map(|gather| gather.error_norm) {
                Some(ErrorNorm::Local) => CAMLUX_NORM_LOCAL,
                Some(ErrorNorm::Image) | None => CAMLUX_NORM_IMAGE,
            },
            target_error: indirect.target_error().unwrap_or(0.0),
            max_ms: gather.and_then(|gather| gather.max_ms).unwrap_or(0.0),
            max_rays: gather.and_then(|gather| gather.max_rays).unwrap_or(0),
            stderr_layer: gather.map_or(0, |gather| gather.stderr_layer.into()),
            interpolation_error: indirect.interpolation_error().unwrap_or(0.0),
            target_range_error_mm: range_mm.unwrap_or(0.0),
        });
        ok(built.set_indirect(&c_indirect));
    }
    for texture in &scene.textures {
        let texels: Vec<[f32; 3]> = texture.texels.reflectances().collect();
        let texture = init!(camlux_texture {
            width_px: texture.size_px[0],
            height_px: texture.size_px[1],
            component: CAMLUX_COMPONENT_F32,
            encoding: CAMLUX_ENCODING_LINEAR,
            pixels: texels.as_ptr().cast(),
        });
        built.add_texture(&texture).expect("it is added");
    }
    let number = |lookup: Option<TextureLookup>| lookup.map_or(0, |of| of.texture as u32 + 1);
    for material in &scene.materials {
        let material = init!(camlux_material {
            kd_texture: number(material.kd_texture),
            kd: material.kd,
            ks: material.ks,
            shininess: material.shininess,
            normal_texture: number(material.normal_texture),
            alpha_texture: number(material.alpha_texture),
        });
        built.add_material(&material).expect("it is added");
    }
    for light in &scene.lights {
        let placed = camlux_light {
            relative_to: match light.relative_to {
                Some(Carrier::Camera) => CAMLUX_RELATIVE_TO_CAMERA,
                _ => CAMLUX_RELATIVE_TO_WORLD,
            },
            ..c_light(light)
        };
        built.add_light(&placed).expect("it is added");
    }
    for mesh in &scene.meshes {
        let mut c_mesh = init!(camlux_mesh {
            vertex_count: mesh.positions_m.len(),
            triangle_count: mesh.triangles.len(),
            positions_m: array(&mesh.positions_m, CAMLUX_FORMAT_F64),
            indices: array(&mesh.triangles, CAMLUX_FORMAT_U32),
            triangle_materials: array(&mesh.triangle_materials, CAMLUX_FORMAT_U32),
        });
        if !mesh.normals.is_empty() {
            c_mesh.normals = array(&mesh.normals, CAMLUX_FORMAT_F64);
        }
        if !mesh.texcoords.is_empty() {
            c_mesh.texcoords = array(&mesh.texcoords, CAMLUX_FORMAT_F64);
        }
        let index = built.add_mesh(&c_mesh).expect("it is added");
        // SAFETY: the pose and the index may be NULL.
        ok(unsafe { camlux_scene_add_instance(built.raw(), index, null(), null_mut()) });
    }
    built
}

pub fn c_light(light: &Light) -> camlux_light {
    let vector = |vector: Option<DVec3>| vector.unwrap_or_default().to_array();
    let mut c_light = init!(camlux_light {
        position_m: vector(light.position_m()),
        direction: vector(light.direction()),
        up: vector(light.up()),
    });
    let Light::Lamp(lamp) = light else {
        c_light.kind = CAMLUX_LIGHT_DIRECTIONAL;
        c_light.irradiance_w_m2 = light.emission();
        return c_light;
    };
    c_light.power_w = lamp.power_w;
    match (&lamp.profile, lamp.area) {
        (Profile::Uniform, None) => {}
        (Profile::Cone(cone), None) => {
            c_light.kind = CAMLUX_LIGHT_SPOT;
            c_light.inner_half_angle_deg = cone.inner_half_angle_deg;
            c_light.outer_half_angle_deg = cone.outer_half_angle_deg;
        }
        (_, Some(AreaShape::Rectangle { size_m })) => {
            c_light.kind = CAMLUX_LIGHT_AREA;
            c_light.size_m = size_m;
        }
        (_, Some(AreaShape::Disc { radius_m })) => {
            c_light.kind = CAMLUX_LIGHT_AREA;
            c_light.radius_m = radius_m;
        }
        _ => unreachable!("C makes no pattern"),
    }
    c_light
}
