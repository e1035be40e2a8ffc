//! Frames that stay on the device, and a host's own device, through the C interface. `tests/hard/host_device.rs` and `examples/cpp_host` are
//! such hosts.

#[cfg(unix)]
use std::os::fd::FromRawFd;
use std::ptr::{null, null_mut};

use crate::host::*;
use camlux::capi::*;

fn image_of(
    frame: *mut camlux_frame,
    layer: i32,
    image: &mut camlux_vulkan_image,
) -> camlux_status {
    // SAFETY: it points to a struct of that size.
    unsafe { camlux_frame_get_vulkan_image(frame, layer, image) }
}

#[test]
fn a_frame_on_the_device_is_the_same_frame() {
    let device = Device::open();
    let scene = load("glossy");
    resize(scene, 24, 20);
    let renderer = device.renderer();
    let plain = render(renderer, scene);
    let options = init!(camlux_render_options { on_device: 1 });
    let mut staying = null_mut();
    // SAFETY: all pointers are valid.
    ok(unsafe { camlux_renderer_render(renderer, scene, &options, &mut staying) });

    let mut images = Vec::new();
    for layer in [
        CAMLUX_LAYER_RADIANCE,
        CAMLUX_LAYER_DIRECT,
        CAMLUX_LAYER_INDIRECT,
        CAMLUX_LAYER_POSITION,
        CAMLUX_LAYER_NORMAL,
    ] {
        let mut image = init!(camlux_vulkan_image {});
        ok(image_of(staying, layer, &mut image));
        assert_eq!(
            (image.width_px, image.height_px, image.layer),
            (24, 20, layer)
        );
        assert!(image.image != 0 && image.semaphore != 0);
        assert_eq!(image.semaphore_value, 1);
        assert!(image.metres_per_unit > 0.0);
        images.push(image.image);
    }
    images.dedup();
    assert_eq!(images.len(), 5);
    let mut image = init!(camlux_vulkan_image {});
    let invalid = CAMLUX_ERROR_INVALID_ARGUMENT;
    fails(
        image_of(staying, CAMLUX_LAYER_DEPTH, &mut image),
        invalid,
        "depth is not on the device",
    );
    fails(
        image_of(plain, CAMLUX_LAYER_DIRECT, &mut image),
        invalid,
        "on_device",
    );
    fails(image_of(staying, 63, &mut image), invalid, "layer is 63");
    assert_eq!(image.image, 0);

    assert!(layers(staying) == layers(plain));
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
    // The frame outlives its renderer.
    ok(image_of(staying, CAMLUX_LAYER_DIRECT, &mut image));
    for frame in [plain, staying] {
        ok(camlux_frame_release(frame));
    }
}

#[test]
fn a_frame_goes_to_shared_memory() {
    let device = Device::open();
    let scene = load("glossy");
    resize(scene, 24, 20);
    let renderer = device.renderer();
    let options = init!(camlux_render_options { on_device: 1 });
    let image_bytes = 24 * 20 * 16;
    let (mut frame, mut memory, mut fd) = (null_mut(), null_mut(), -1);
    let mut info = init!(camlux_shared_memory_info {});
    let copy = |frame, layer, memory, offset_bytes| {
        // SAFETY: handles and numbers.
        unsafe { camlux_frame_copy_to_shared(frame, layer, memory, offset_bytes) }
    };
    // SAFETY: all pointers are valid.
    unsafe {
        ok(camlux_renderer_render(
            renderer, scene, &options, &mut frame,
        ));
        ok(camlux_shared_memory_create(
            device.0,
            image_bytes,
            &mut memory,
        ));
        ok(camlux_shared_memory_get_info(memory, &mut info));
        ok(camlux_shared_memory_export_fd(memory, &mut fd));
    }
    assert!(fd >= 0 && info.allocation_bytes >= image_bytes);
    #[cfg(unix)]
    // SAFETY: nothing else owns the descriptor.
    drop(unsafe { std::os::fd::OwnedFd::from_raw_fd(fd) });
    ok(copy(frame, CAMLUX_LAYER_DIRECT, memory, 0));
    if !info.host_data.is_null() {
        let direct = view(frame, CAMLUX_LAYER_DIRECT);
        // SAFETY: both have that number of values.
        let [texels, values] = unsafe {
            [(info.host_data, 4), (direct.data, 3)].map(|(data, channels)| {
                std::slice::from_raw_parts(data.cast::<f32>(), 24 * 20 * channels)
            })
        };
        let bands = texels.chunks(4).flat_map(|texel| &texel[..3]);
        assert!(bands.eq(values) && values.iter().any(|&value| value > 0.0));
    }

    let invalid = CAMLUX_ERROR_INVALID_ARGUMENT;
    let plain = render(renderer, scene);
    for (frame, layer, offset_bytes, words) in [
        (frame, CAMLUX_LAYER_DEPTH, 0, "depth is not on the device"),
        (frame, CAMLUX_LAYER_DIRECT, 4, "not a multiple of 16"),
        (frame, CAMLUX_LAYER_DIRECT, 1 << 20, "do not fit"),
        (frame, 63, 0, "layer is 63"),
        (plain, CAMLUX_LAYER_DIRECT, 0, "on_device"),
    ] {
        fails(copy(frame, layer, memory, offset_bytes), invalid, words);
    }
    let mut none = null_mut();
    // SAFETY: as above.
    unsafe {
        let status = camlux_shared_memory_create(device.0, 0, &mut none);
        fails(status, invalid, "size_bytes is 0");
    }
    // The frame and the memory outlive the renderer and the scene.
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
    ok(copy(frame, CAMLUX_LAYER_DIRECT, memory, 0));
    for frame in [plain, frame] {
        ok(camlux_frame_release(frame));
    }
    ok(camlux_shared_memory_release(memory));
}

#[test]
fn what_is_no_device_of_a_host_is_refused() {
    unsafe extern "C" fn nothing() {}
    unsafe extern "C" fn lock(_: *mut std::ffi::c_void) {}
    let create = |vulkan: *const camlux_vulkan_device, words: &str| {
        let mut device = null_mut();
        // SAFETY: both are NULL or valid.
        let status = unsafe { camlux_device_create_from_vulkan(vulkan, &mut device) };
        fails(status, CAMLUX_ERROR_INVALID_ARGUMENT, words);
        assert!(device.is_null());
    };
    create(null(), "camlux_vulkan_device is NULL");
    create(
        &init!(camlux_vulkan_device {}),
        "get_instance_proc_addr is NULL",
    );
    let half = init!(camlux_vulkan_device {
        get_instance_proc_addr: Some(nothing),
        lock_queue: Some(lock),
    });
    create(&half, "one of lock_queue and unlock_queue is NULL");
    let without = init!(camlux_vulkan_device {
        get_instance_proc_addr: Some(nothing),
    });
    create(&without, "device_create_info is NULL");
    let misaligned = init!(camlux_vulkan_device {
        get_instance_proc_addr: Some(nothing),
        device_create_info: std::ptr::without_provenance(1001),
    });
    create(&misaligned, "not aligned");
}
