//! CUDA imports shared memory through NVIDIA's driver interface.

use std::{
    ffi::{c_int, c_uint, c_ulonglong, c_void},
    ptr,
};

use camlux::{Device, DeviceOptions, Renderer, SharedMemory, output::Layer};
use libloading::Library;

use crate::host_device::{bands, copy_to_shared, scene};

/// The union of a file descriptor and two pointers.
#[repr(C, align(8))]
struct Handle {
    fd: c_int,
    rest: [c_uint; 3],
}

/// `CUDA_EXTERNAL_MEMORY_HANDLE_DESC`.
#[repr(C)]
struct HandleDesc {
    handle_type: c_uint,
    handle: Handle,
    size: c_ulonglong,
    flags: c_uint,
    reserved: [c_uint; 16],
}

/// `CUDA_EXTERNAL_MEMORY_BUFFER_DESC`.
#[repr(C)]
struct BufferDesc {
    offset: c_ulonglong,
    size: c_ulonglong,
    flags: c_uint,
    reserved: [c_uint; 16],
}

/// `CU_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD`.
const OPAQUE_FD: c_uint = 1;
/// `CUDA_EXTERNAL_MEMORY_DEDICATED`.
const DEDICATED: c_uint = 1;

/// Calls a function of the CUDA driver. All functions return 0 on success.
macro_rules! cuda {
    ($library:ident.$name:ident($($argument:expr => $kind:ty),*)) => {{
        // SAFETY: the name and the types are those of cuda.h.
        let code = unsafe {
            let function = $library.get::<unsafe extern "C" fn($($kind),*) -> c_int>(
                concat!(stringify!($name), "\0").as_bytes(),
            );
            (function.expect("the driver has it"))($($argument),*)
        };
        assert_eq!(code, 0, stringify!($name));
    }};
}

#[test]
#[ignore = "needs an NVIDIA GPU with its CUDA driver"]
fn cuda_imports_shared_memory() {
    let device = Device::open(&DeviceOptions::default()).expect("a device");
    let image_bytes: u64 = 24 * 16 * 16;
    let memory = SharedMemory::new(&device, 2 * image_bytes).expect("it exports memory");
    let info = memory.info();

    // SAFETY: only NVIDIA's initialisers run.
    let driver = unsafe { Library::new("libcuda.so.1") }.expect("a CUDA driver");
    cuda!(driver.cuInit(0 => c_uint));
    let mut count: c_int = 0;
    cuda!(driver.cuDeviceGetCount(&raw mut count => *mut c_int));
    let uuid = device.info().uuid.replace('-', "");
    let same = (0..count).find(|&index| {
        let mut bytes = [0_u8; 16];
        cuda!(driver.cuDeviceGetUuid_v2(bytes.as_mut_ptr() => *mut u8, index => c_int));
        bytes.map(|byte| format!("{byte:02x}")).concat() == uuid
    });
    let same = same.expect("CUDA knows the Vulkan device by its UUID");
    let mut context: *mut c_void = ptr::null_mut();
    cuda!(driver.cuDevicePrimaryCtxRetain(&raw mut context => *mut *mut c_void, same => c_int));
    cuda!(driver.cuCtxSetCurrent(context => *mut c_void));

    let handle = HandleDesc {
        handle_type: OPAQUE_FD,
        handle: Handle {
            fd: memory.export_fd().expect("a file descriptor"),
            rest: [0; 3],
        },
        size: info.allocation_bytes,
        flags: if info.is_dedicated { DEDICATED } else { 0 },
        reserved: [0; 16],
    };
    let mut imported: *mut c_void = ptr::null_mut();
    cuda!(driver.cuImportExternalMemory(&raw mut imported => *mut *mut c_void, &raw const handle => *const HandleDesc));
    let buffer = BufferDesc {
        offset: 0,
        size: 2 * image_bytes,
        flags: 0,
        reserved: [0; 16],
    };
    let mut address: c_ulonglong = 0;
    cuda!(driver.cuExternalMemoryGetMappedBuffer(
        &raw mut address => *mut c_ulonglong, imported => *mut c_void, &raw const buffer => *const BufferDesc));

    let mut renderer = Renderer::new(&device).expect("a renderer");
    let mut scene = scene();
    for height_m in [0.0, 0.1] {
        scene.camera.position_m.y += height_m;
        let drawn = renderer.render_on_device(&scene, &mut Default::default());
        let drawn = drawn.expect("it renders");
        let frame = drawn.read().expect("it is read");
        copy_to_shared(&drawn, &memory, image_bytes);
        let mut texels = vec![0.0_f32; 2 * image_bytes as usize / 4];
        cuda!(driver.cuMemcpyDtoH_v2(
            texels.as_mut_ptr().cast() => *mut c_void, address => c_ulonglong, 2 * image_bytes as usize => usize));
        let (radiance, normals) = texels.split_at(texels.len() / 2);
        assert!(Some(&bands(radiance)[..]) == frame.values(Layer::Radiance));
        assert!(Some(&bands(normals)[..]) == frame.values(Layer::Normal));
    }

    cuda!(driver.cuMemFree_v2(address => c_ulonglong));
    cuda!(driver.cuDestroyExternalMemory(imported => *mut c_void));
    cuda!(driver.cuDevicePrimaryCtxRelease_v2(same => c_int));
}
