//! The memory layouts of the structs of the C interface.

use std::ffi::c_char;

use camlux::capi::*;

pub struct Layout {
    pub name: &'static str,
    pub bytes: usize,
    /// 0 for a struct that is only a member of others.
    pub version_1_bytes: usize,
    pub fields: Vec<Field>,
    /// The bytes of its `_INIT`; empty for a struct that is only a member of others.
    pub init: Vec<u8>,
}

pub struct Field {
    pub name: &'static str,
    pub offset: usize,
    pub bytes: usize,
    /// The initial value, as C code.
    pub first: String,
}

trait InC {
    /// A C initialiser with this value.
    fn in_c(&self) -> String;
}

macro_rules! numbers_in_c {
    ($($number:ty),*) => {
        $(impl InC for $number {
            fn in_c(&self) -> String {
                format!("{self:?}")
            }
        })*
    };
}

numbers_in_c!(c_char, i32, u64, usize, f64);

impl InC for u32 {
    fn in_c(&self) -> String {
        match *self {
            camlux::capi::CAMLUX_NEXT_FRAME => "CAMLUX_NEXT_FRAME".into(),
            number => number.to_string(),
        }
    }
}

impl<T> InC for *const T {
    fn in_c(&self) -> String {
        assert!(self.is_null(), "no struct begins with a place in memory");
        "NULL".into()
    }
}

impl<T> InC for *mut T {
    fn in_c(&self) -> String {
        self.cast_const().in_c()
    }
}

/// A function pointer.
impl<T> InC for Option<T> {
    fn in_c(&self) -> String {
        assert!(self.is_none(), "no struct begins with a function");
        "NULL".into()
    }
}

impl<T: InC, const N: usize> InC for [T; N] {
    fn in_c(&self) -> String {
        let items: Vec<String> = self.iter().map(InC::in_c).collect();
        // An array of zeros, such as an empty text.
        if items.iter().all(|item| item == "0") {
            return "{0}".into();
        }
        format!("{{{}}}", items.join(", "))
    }
}

impl InC for camlux_array {
    fn in_c(&self) -> String {
        let Layout { fields, .. } = array_layout(*self);
        let members: Vec<String> = fields.into_iter().map(|field| field.first).collect();
        format!("{{{}}}", members.join(", "))
    }
}

macro_rules! fields {
    ($first:expr, $name:ident { $($field:ident),* $(,)? }) => {{
        let first: $name = $first;
        vec![$(Field {
            name: stringify!($field),
            offset: std::mem::offset_of!($name, $field),
            bytes: size_of_val(&first.$field),
            first: first.$field.in_c(),
        }),*]
    }};
}

macro_rules! layouts {
    ($($name:ident { $($field:ident),* $(,)? })*) => {
        vec![$(Layout {
            name: $name::NAME,
            bytes: size_of::<$name>(),
            version_1_bytes: $name::VERSION_1_BYTES,
            fields: fields!($name::default(), $name { struct_size, $($field),* }),
            init: init_bytes::<$name>(),
        }),*]
    };
}

fn init_bytes<T: CStruct>() -> Vec<u8> {
    let init = T::default();
    // SAFETY: a `CStruct` has no padding, so that all of its bytes are set.
    unsafe { std::slice::from_raw_parts((&raw const init).cast::<u8>(), size_of::<T>()) }.to_vec()
}

/// Every struct of the interface.
pub fn layouts() -> Vec<Layout> {
    let mut layouts = layouts! {
        camlux_device_options {
            choice, index, validation, name,
        }
        camlux_device_info {
            index, kind, is_usable, max_image_px, subgroup_lanes, max_allocation_bytes, name,
            driver, lacks, api_version, uuid, pci,
        }
        camlux_camera {
            width_px, height_px, lens, position_m, look_at_m, up, fov_y_deg, fx_px, fy_px, cx_px,
            cy_px, distortion, samples, filter, fov_x_deg, skew_px, prism_tilt, height_m,
        }
        camlux_sensor {
            reserved, pixel_pitch_um, exposure_time_s, duty_cycle, wavelength_nm,
            quantum_efficiency, f_number, band_weights, bayer, monochrome,
            vignetting, has_vignetting, reserved_end,
        }
        camlux_tof_noise {
            bits, seed, dark_e_per_s, read_noise_e, full_well_e, gain_dn_per_e, black_level_dn,
            dsnu_e, prnu,
        }
        camlux_tof {
            frequency_count, frequencies_hz, contrasts, band_weights, phase_offset_deg, phase_count,
            output, noise, ambient_lights, ambient_light_count,
        }
        camlux_indirect {
            estimator, rsm_size, error_norm, target_error, interpolation_error, max_ms,
            max_rays, stderr_layer, bounces, target_range_error_mm,
        }
        camlux_direct {
            shadow,
        }
        camlux_pose {
            reserved, position_m, orientation_xyzw, scale,
        }
        camlux_material {
            kd_texture, kd, ks, shininess, name, normal_texture, alpha_texture, ks_texture,
            shininess_texture, alpha_cutoff, roughness, metallic, ior, specular,
            metallic_roughness_texture, reserved, emission_w_sr_m2, emission_texture, one_sided,
        }
        camlux_texture {
            width_px, height_px, component, channels, encoding, pixels, row_stride_bytes, name,
        }
        camlux_mesh {
            material, vertex_count, triangle_count, positions_m, normals, texcoords, indices,
            triangle_materials, name,
        }
        camlux_light {
            kind, position_m, direction, power_w, irradiance_w_m2, inner_half_angle_deg,
            outer_half_angle_deg, up, size_m, radius_m, pattern, image, relative_to, reserved,
        }
        camlux_pattern {
            encoding, path, gammas_deg, gamma_count, planes_deg, plane_count, intensities,
        }
        camlux_projected_image {
            encoding, path, width_px, height_px, values, row_stride_bytes, lens, reserved,
            fov_y_deg, fx_px, fy_px, cx_px, cy_px,
        }
        camlux_vignetting_map {
            reserved, path, width_px, height_px, values, row_stride_bytes,
        }
        camlux_scene_counts {
            textures, materials, meshes, instances, lights,
        }
        camlux_bounds {
            is_empty, min_m, max_m,
        }
        camlux_target {
            layer, data, size_bytes, row_stride_bytes,
        }
        camlux_render_options {
            submission_target_ms, progress, progress_user, on_device, frame_index, cancel_token,
            targets, target_count, seed, keep_partial, layers, layer_count,
        }
        camlux_vulkan_device {
            queue_family, get_instance_proc_addr, instance, physical_device, device,
            device_create_info, queue, lock_queue, unlock_queue, lock_user,
        }
        camlux_vulkan_image {
            layer, image, semaphore, semaphore_value, format, layout, width_px, height_px,
            queue_family, reserved, origin_m, metres_per_unit,
        }
        camlux_shared_memory_info {
            memory_type_index, allocation_bytes, is_dedicated, reserved, host_data,
        }
        camlux_view {
            layer, data, row_stride_bytes, size_bytes, width_px, height_px, channels, format, name,
            unit,
        }
        camlux_exr_options {
            half, layers, layer_count, plain, multipart,
        }
        camlux_frame_stats {
            pass_count, wall_ms, passes_ms, snapshot_ms, vpl_count, ray_count, pixel_vpl_pairs,
            estimated_error, estimated_error_upper, estimated_interpolation_error, submissions, stop,
            device, driver, estimated_area_light_error, least_ms, least_rays, preparation_ms,
            frame_index, camera_index, estimated_range_error_mm, estimated_range_error_upper_mm,
            host_ms,
        }
        camlux_pass_time {
            reserved, ms, name,
        }
    };
    layouts.insert(0, array_layout(camlux_mesh::default().positions_m));
    layouts
}

/// The layout of `camlux_array`, which is only a member of other structs.
fn array_layout(first: camlux_array) -> Layout {
    Layout {
        name: "camlux_array",
        bytes: size_of::<camlux_array>(),
        version_1_bytes: 0,
        fields: fields!(
            first,
            camlux_array {
                data,
                stride_bytes,
                format,
                reserved
            }
        ),
        init: Vec::new(),
    }
}
