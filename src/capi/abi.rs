//! The structs of the interface: how they lie in memory, and their first values.

use super::{
    args::camlux_array,
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

/// A struct of the interface.
///
/// # Safety
/// It is `repr(C)`, begins with `struct_size: u32`, has no padding, and any bytes are a value of it.
pub(super) unsafe trait CStruct: Copy {
    const NAME: &'static str;
    /// Its size in the first version of the interface, whatever was added since.
    const VERSION_1_BYTES: usize;
    /// What the `_INIT` macro of the header has.
    const INIT: Self;

    fn fields() -> Vec<Field>;
}

macro_rules! fields {
    ($name:ident { $($field:ident),* $(,)? }) => {
        vec![$($crate::capi::abi::field(
            stringify!($field),
            std::mem::offset_of!($name, $field),
            |value: $name| value.$field,
        )),*]
    };
}
pub(super) use fields;

/// A struct of the interface: its name, its bytes in version 1, and the first values of all members but `struct_size`.
macro_rules! c_struct {
    ($name:ident, $version_1_bytes:literal, { $($field:ident: $first:expr),* $(,)? }) => {
        // SAFETY: repr(C), the size first, numbers and pointers (a function's may be null) without padding: the tests of
        // the header hold all of them to it.
        unsafe impl $crate::capi::abi::CStruct for $name {
            const NAME: &'static str = stringify!($name);
            const VERSION_1_BYTES: usize = $version_1_bytes;
            const INIT: Self = $name {
                struct_size: size_of::<Self>() as u32,
                $($field: $first),*
            };

            fn fields() -> Vec<$crate::capi::Field> {
                $crate::capi::abi::fields!($name { struct_size, $($field),* })
            }
        }
    };
}
pub(super) use c_struct;

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

pub(super) fn field<T, F>(name: &'static str, offset: usize, _: impl Fn(T) -> F) -> Field {
    let bytes = size_of::<F>();
    Field {
        name,
        offset,
        bytes,
    }
}

fn layout<T: CStruct>() -> Layout {
    let init = T::INIT;
    let bytes = (&raw const init).cast::<u8>();
    Layout {
        name: T::NAME,
        bytes: size_of::<T>(),
        version_1_bytes: T::VERSION_1_BYTES,
        fields: T::fields(),
        // SAFETY: a `CStruct` has no padding, so that all of its bytes are set.
        init: unsafe { std::slice::from_raw_parts(bytes, size_of::<T>()) }.to_vec(),
    }
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
        layout::<camlux_device_options>(),
        layout::<camlux_device_info>(),
        layout::<camlux_camera>(),
        layout::<camlux_sensor>(),
        layout::<camlux_indirect>(),
        layout::<camlux_direct>(),
        layout::<camlux_pose>(),
        layout::<camlux_material>(),
        layout::<camlux_texture>(),
        layout::<camlux_mesh>(),
        layout::<camlux_light>(),
        layout::<camlux_scene_counts>(),
        layout::<camlux_bounds>(),
        layout::<camlux_render_options>(),
        layout::<camlux_vulkan_device>(),
        layout::<camlux_vulkan_image>(),
        layout::<camlux_view>(),
        layout::<camlux_exr_options>(),
        layout::<camlux_frame_stats>(),
        layout::<camlux_pass_time>(),
    ]
}
