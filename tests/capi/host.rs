//! The C interface as a C program uses it, for the tests in Rust.

use std::{
    ffi::{CStr, CString},
    path::Path,
    ptr::{null, null_mut},
};

use camlux::{
    capi::*,
    output::{Layer, LayerData, TofQuantity},
    scene::{
        AreaShape, Carrier, ChargeUnit, Distortion, ErrorNorm, IndirectLight, Lens, Light,
        PixelFilter, PixelSampling, TimeOfFlight,
    },
};

pub fn last_error() -> String {
    // SAFETY: a string of the library, valid until this thread's next failing call.
    let message = unsafe { CStr::from_ptr(camlux_last_error()) };
    message.to_str().expect("messages are UTF-8").to_owned()
}

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

/// A device with the validation layer. Dropping it asserts that the layer reported nothing.
pub struct Device(pub *mut camlux_device);

// SAFETY: a handle is a number, and any thread may use a device.
unsafe impl Sync for Device {}

impl Device {
    pub fn open() -> Device {
        let options = init!(camlux_device_options { validation: 1 });
        let mut device = null_mut();
        // SAFETY: both pointers are valid.
        ok(unsafe { camlux_device_create(&options, &mut device) });
        Device(device)
    }

    pub fn renderer(&self) -> *mut camlux_renderer {
        let mut renderer = null_mut();
        // SAFETY: it points to a pointer.
        ok(unsafe { camlux_renderer_create(self.0, &mut renderer) });
        renderer
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        let mut count = 0;
        // SAFETY: it points to a number.
        ok(unsafe { camlux_device_validation_count(self.0, &mut count) });
        ok(camlux_device_release(self.0));
        assert!(count == 0 || std::thread::panicking(), "{count} messages");
    }
}

pub fn new_scene() -> *mut camlux_scene {
    let mut scene = null_mut();
    // SAFETY: it points to a pointer.
    ok(unsafe { camlux_scene_create(&mut scene) });
    scene
}

pub fn scene_file(name: &str) -> CString {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
    CString::new(path.to_str().expect("a UTF-8 path")).expect("no NUL")
}

pub fn load(name: &str) -> *mut camlux_scene {
    let mut scene = null_mut();
    // SAFETY: a string, and a pointer to a pointer.
    ok(unsafe { camlux_scene_load_file(scene_file(name).as_ptr(), &mut scene) });
    scene
}

pub fn resize(scene: *mut camlux_scene, width_px: u32, height_px: u32) {
    let mut camera = init!(camlux_camera {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_get_camera(scene, &mut camera) });
    (camera.width_px, camera.height_px) = (width_px, height_px);
    // SAFETY: as above.
    ok(unsafe { camlux_scene_set_camera(scene, &camera) });
}

pub fn plain_sum(scene: *mut camlux_scene, rsm_size: u32) {
    let indirect = init!(camlux_indirect {
        estimator: CAMLUX_ESTIMATOR_INSTANT_RADIOSITY,
        rsm_size: rsm_size
    });
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_set_indirect(scene, &indirect) });
}

pub fn render(renderer: *mut camlux_renderer, scene: *mut camlux_scene) -> *mut camlux_frame {
    let mut frame = null_mut();
    // SAFETY: it points to a pointer; the options may be NULL.
    ok(unsafe { camlux_renderer_render(renderer, scene, null(), &mut frame) });
    frame
}

pub fn view(frame: *mut camlux_frame, layer: i32) -> camlux_view {
    let mut view = init!(camlux_view {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_frame_view(frame, layer, &mut view) });
    view
}

/// All layers of a frame, as the bits of their values.
pub fn layers(frame: *mut camlux_frame) -> Vec<(i32, Vec<u32>)> {
    let mut count = 0;
    // SAFETY: it points to a number.
    ok(unsafe { camlux_frame_layer_count(frame, &mut count) });
    let layer = |index| {
        let mut layer = -1;
        // SAFETY: it points to a number.
        ok(unsafe { camlux_frame_get_layer(frame, index, &mut layer) });
        let view = view(frame, layer);
        let length = view.size_bytes / 4;
        // SAFETY: a view is as large as it says; values of both formats have four bytes.
        let bits = unsafe { std::slice::from_raw_parts(view.data.cast::<u32>(), length) };
        (layer, bits.to_vec())
    };
    (0..count).map(layer).collect()
}

pub fn stats(frame: *mut camlux_frame) -> camlux_frame_stats {
    let mut stats = init!(camlux_frame_stats {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_frame_get_stats(frame, &mut stats) });
    stats
}

pub fn passes(frame: *mut camlux_frame) -> Vec<String> {
    let pass = |index| {
        let mut pass = init!(camlux_pass_time {});
        // SAFETY: it points to a struct of that size; the name lives as long as the frame.
        unsafe {
            ok(camlux_frame_get_pass(frame, index, &mut pass));
            CStr::from_ptr(pass.name)
                .to_str()
                .expect("ASCII")
                .to_owned()
        }
    };
    (0..stats(frame).pass_count).map(pass).collect()
}

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

pub fn set_tof(scene: *mut camlux_scene, tof: &TimeOfFlight) {
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
    // SAFETY: a struct of that size, with valid pointers.
    ok(unsafe { camlux_scene_set_tof(scene, &c_tof) });
}

/// Rebuilds a scene call by call, from the arrays of its parts.
pub fn from_arrays(scene: &camlux::Scene) -> *mut camlux_scene {
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
        Lens::Intrinsics(lens)
        | Lens::Distorted {
            intrinsics: lens, ..
        } => {
            c_camera.lens = CAMLUX_LENS_INTRINSICS;
            (c_camera.fx_px, c_camera.fy_px) = (lens.fx, lens.fy);
            (c_camera.cx_px, c_camera.cy_px) = (lens.cx, lens.cy);
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
        None => {}
        Some(Distortion::Rational(coefficients)) => {
            c_camera.lens = CAMLUX_LENS_RATIONAL;
            c_camera.distortion = coefficients;
        }
        Some(Distortion::Fisheye(coefficients)) => {
            c_camera.lens = CAMLUX_LENS_FISHEYE;
            c_camera.distortion[..4].copy_from_slice(&coefficients);
        }
    }
    // SAFETY: here and below, structs of their size, arrays of their length, and no index requested.
    unsafe {
        ok(camlux_scene_set_camera(built, &c_camera));
        if let Some(sensor) = scene.sensor {
            let c_sensor = init!(camlux_sensor {
                pixel_pitch_um: sensor.pixel_pitch_um,
                exposure_time_s: sensor.exposure_time_s,
                duty_cycle: sensor.duty_cycle,
                wavelength_nm: sensor.wavelength_nm.unwrap_or_default(),
                quantum_efficiency: sensor.quantum_efficiency.unwrap_or_default(),
                f_number: sensor.f_number.unwrap_or_default(),
            });
            ok(camlux_scene_set_sensor(built, &c_sensor));
        }
        if let Some(tof) = &scene.tof {
            set_tof(built, tof);
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
            ok(camlux_scene_set_indirect(built, &c_indirect));
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
            ok(camlux_scene_add_texture(built, &texture, null_mut()));
        }
        for material in &scene.materials {
            let material = init!(camlux_material {
                kd_texture: material
                    .kd_texture
                    .map_or(0, |lookup| lookup.texture as u32 + 1),
                kd: material.kd,
                ks: material.ks,
                shininess: material.shininess,
                normal_texture: material
                    .normal_texture
                    .map_or(0, |lookup| lookup.texture as u32 + 1),
                alpha_texture: material
                    .alpha_texture
                    .map_or(0, |lookup| lookup.texture as u32 + 1),
            });
            ok(camlux_scene_add_material(built, &material, null_mut()));
        }
        for light in &scene.lights {
            let placed = camlux_light {
                relative_to: match light.relative_to {
                    Some(Carrier::Camera) => CAMLUX_RELATIVE_TO_CAMERA,
                    _ => CAMLUX_RELATIVE_TO_WORLD,
                },
                ..c_light(light)
            };
            ok(camlux_scene_add_light(built, &placed, null_mut()));
        }
        for mesh in &scene.meshes {
            let mut index = u32::MAX;
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
            ok(camlux_scene_add_mesh(built, &c_mesh, &mut index));
            ok(camlux_scene_add_instance(built, index, null(), null_mut()));
        }
    }
    built
}

pub fn c_light(light: &Light) -> camlux_light {
    match *light {
        Light::Point {
            position_m,
            power_w,
        } => init!(camlux_light {
            position_m: position_m.to_array(),
            power_w: power_w
        }),
        Light::Spot {
            position_m,
            direction,
            cone,
            power_w,
        } => init!(camlux_light {
            kind: CAMLUX_LIGHT_SPOT,
            position_m: position_m.to_array(),
            direction: direction.to_array(),
            power_w: power_w,
            inner_half_angle_deg: cone.inner_half_angle_deg,
            outer_half_angle_deg: cone.outer_half_angle_deg,
        }),
        Light::Area {
            position_m,
            direction,
            up,
            shape,
            power_w,
        } => init!(camlux_light {
            kind: CAMLUX_LIGHT_AREA,
            position_m: position_m.to_array(),
            direction: direction.to_array(),
            up: up.to_array(),
            size_m: match shape {
                AreaShape::Rectangle { size_m } => size_m,
                AreaShape::Disc { .. } => [0.0; 2],
            },
            radius_m: match shape {
                AreaShape::Rectangle { .. } => 0.0,
                AreaShape::Disc { radius_m } => radius_m,
            },
            power_w: power_w,
        }),
        Light::Pattern { .. } => unreachable!("C makes no pattern"),
        Light::Directional {
            direction,
            irradiance_w_m2,
        } => init!(camlux_light {
            kind: CAMLUX_LIGHT_DIRECTIONAL,
            direction: direction.to_array(),
            irradiance_w_m2: irradiance_w_m2,
        }),
    }
}
