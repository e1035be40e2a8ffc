//! Sizes and offsets of the structs, for the tests that compare them with C's.

use super::{
    args::{CStruct, camlux_array},
    device::{camlux_device_info, camlux_device_options},
    frame::{camlux_exr_options, camlux_view},
    frame_stats::{camlux_frame_stats, camlux_pass_time},
    instances::camlux_pose,
    light::camlux_light,
    material::camlux_material,
    mesh::camlux_mesh,
    renderer::camlux_render_options,
    scene::{camlux_bounds, camlux_scene_counts},
    scene_options::{camlux_camera, camlux_direct, camlux_indirect, camlux_sensor},
    texture::camlux_texture,
    vulkan::{camlux_vulkan_device, camlux_vulkan_image},
};

/// A struct of the interface as it lies in memory.
#[doc(hidden)]
pub struct Layout {
    pub name: &'static str,
    pub bytes: usize,
    /// 0 for what is only found inside of others.
    pub version_1_bytes: usize,
    pub fields: Vec<Field>,
    /// The bytes of its `_INIT`; empty for what is only found inside of others.
    pub init: Vec<u8>,
}

#[doc(hidden)]
pub struct Field {
    pub name: &'static str,
    pub offset: usize,
    pub bytes: usize,
}

fn bytes_of_field<T, F>(_: impl Fn(T) -> F) -> usize {
    size_of::<F>()
}

macro_rules! fields {
    ($name:ident { $($field:ident),* $(,)? }) => {{
        // Fails to compile where a field is missing.
        let _ = |$name { $($field: _),* }: $name| ();
        vec![$(Field {
            name: stringify!($field),
            offset: std::mem::offset_of!($name, $field),
            bytes: bytes_of_field(|value: $name| value.$field),
        }),*]
    }};
}

macro_rules! layout {
    ($name:ident $fields:tt) => {
        Layout {
            name: stringify!($name),
            bytes: size_of::<$name>(),
            version_1_bytes: $name::VERSION_1_BYTES,
            fields: fields!($name $fields),
            init: init_bytes::<$name>(),
        }
    };
}

fn init_bytes<T: CStruct>() -> Vec<u8> {
    let value = T::INIT;
    let bytes = (&raw const value).cast::<u8>();
    // SAFETY: a `CStruct` has no padding, so that all of its bytes are set.
    unsafe { std::slice::from_raw_parts(bytes, size_of::<T>()) }.to_vec()
}

/// Every struct of the interface.
#[doc(hidden)]
pub fn layouts() -> Vec<Layout> {
    vec![
        Layout {
            name: "camlux_array",
            bytes: size_of::<camlux_array>(),
            version_1_bytes: 0,
            fields: fields!(camlux_array {
                data,
                stride_bytes,
                format,
                reserved
            }),
            init: Vec::new(),
        },
        layout!(camlux_device_options {
            struct_size,
            choice,
            index,
            validation,
            name
        }),
        layout!(camlux_device_info {
            struct_size,
            index,
            kind,
            is_usable,
            max_image_px,
            subgroup_lanes,
            max_allocation_bytes,
            name,
            driver,
            lacks,
            api_version
        }),
        layout!(camlux_camera {
            struct_size,
            width_px,
            height_px,
            lens,
            position_m,
            look_at_m,
            up,
            fov_y_deg,
            fx_px,
            fy_px,
            cx_px,
            cy_px
        }),
        layout!(camlux_sensor {
            struct_size,
            reserved,
            pixel_pitch_um,
            exposure_time_s,
            duty_cycle
        }),
        layout!(camlux_indirect {
            struct_size,
            estimator,
            rsm_size,
            reserved,
            target_error,
            interpolation_error
        }),
        layout!(camlux_direct {
            struct_size,
            shadow
        }),
        layout!(camlux_pose {
            struct_size,
            reserved,
            position_m,
            orientation_xyzw
        }),
        layout!(camlux_material {
            struct_size,
            kd_texture,
            kd,
            ks,
            shininess,
            name
        }),
        layout!(camlux_texture {
            struct_size,
            width_px,
            height_px,
            component,
            channels,
            encoding,
            pixels,
            row_stride_bytes,
            name
        }),
        layout!(camlux_mesh {
            struct_size,
            material,
            vertex_count,
            triangle_count,
            positions_m,
            normals,
            texcoords,
            indices,
            triangle_materials,
            name
        }),
        layout!(camlux_light {
            struct_size,
            kind,
            position_m,
            direction,
            power_w,
            irradiance_w_m2,
            inner_half_angle_deg,
            outer_half_angle_deg
        }),
        layout!(camlux_scene_counts {
            struct_size,
            textures,
            materials,
            meshes,
            instances,
            lights
        }),
        layout!(camlux_bounds {
            struct_size,
            is_empty,
            min_m,
            max_m
        }),
        layout!(camlux_render_options {
            struct_size,
            submission_target_ms,
            progress,
            progress_user,
            on_device,
            reserved
        }),
        layout!(camlux_vulkan_device {
            struct_size,
            queue_family,
            get_instance_proc_addr,
            instance,
            physical_device,
            device,
            device_create_info,
            queue,
            lock_queue,
            unlock_queue,
            lock_user
        }),
        layout!(camlux_vulkan_image {
            struct_size,
            layer,
            image,
            semaphore,
            semaphore_value,
            format,
            layout,
            width_px,
            height_px,
            queue_family,
            reserved,
            origin_m,
            metres_per_unit
        }),
        layout!(camlux_view {
            struct_size,
            layer,
            data,
            row_stride_bytes,
            size_bytes,
            width_px,
            height_px,
            channels,
            format,
            name,
            unit
        }),
        layout!(camlux_exr_options {
            struct_size,
            half,
            layers,
            reserved
        }),
        layout!(camlux_frame_stats {
            struct_size,
            pass_count,
            wall_ms,
            passes_ms,
            snapshot_ms,
            vpl_count,
            ray_count,
            pixel_vpl_pairs,
            estimated_error,
            estimated_interpolation_error,
            submissions,
            reserved,
            device,
            driver
        }),
        layout!(camlux_pass_time {
            struct_size,
            reserved,
            ms,
            name
        }),
    ]
}
