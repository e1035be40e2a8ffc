//! Frames that stay on the device, and a host's own device, through the C interface. `tests/hard/host_device.rs` and `examples/cpp_host` are
//! such hosts.

#[cfg(unix)]
use std::os::fd::FromRawFd;
use std::ptr::{null, null_mut};

use crate::host::*;
use camlux::capi::*;

fn image_of(frame: &Frame, layer: i32, image: &mut camlux_vulkan_image) -> camlux_status {
    // SAFETY: it points to a struct of that size.
    unsafe { camlux_frame_get_vulkan_image(frame.raw(), layer, image) }
}

#[test]
fn a_frame_on_the_device_is_the_same_frame() {
    let device = Device::open();
    let scene = load_at("glossy", [24, 20]);
    let renderer = device.renderer();
    let plain = renderer.render(&scene);
    let options = init!(camlux_render_options { on_device: 1 });
    let staying = renderer.try_render(&scene, &options).expect("it renders");

    let mut images = Vec::new();
    for layer in [
        CAMLUX_LAYER_RADIANCE,
        CAMLUX_LAYER_DIRECT,
        CAMLUX_LAYER_INDIRECT,
        CAMLUX_LAYER_POSITION,
        CAMLUX_LAYER_NORMAL,
    ] {
        let mut image = init!(camlux_vulkan_image {});
        ok(image_of(&staying, layer, &mut image));
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
    for (frame, layer, words) in [
        (&staying, CAMLUX_LAYER_DEPTH, "depth is not on the device"),
        (&plain, CAMLUX_LAYER_DIRECT, "on_device"),
        (&staying, 63, "layer is 63"),
    ] {
        fails(image_of(frame, layer, &mut image), ARGUMENT, words);
    }
    assert_eq!(image.image, 0);

    assert!(staying.layers() == plain.layers());
    drop(renderer);
    drop(scene);
    // The frame outlives its renderer.
    ok(image_of(&staying, CAMLUX_LAYER_DIRECT, &mut image));
}

#[test]
fn a_frame_goes_to_shared_memory() {
    let device = Device::open();
    let scene = load_at("glossy", [24, 20]);
    let renderer = device.renderer();
    let options = init!(camlux_render_options { on_device: 1 });
    let image_bytes = 24 * 20 * 16;
    let frame = renderer.try_render(&scene, &options).expect("it renders");
    let create = |bytes| {
        // SAFETY: a pointer to a pointer.
        Owned::try_new(|memory| unsafe { camlux_shared_memory_create(device.0, bytes, memory) })
    };
    let memory = create(image_bytes).expect("there is memory");
    let copy = |frame: &Frame, layer, offset_bytes| {
        // SAFETY: handles and numbers.
        unsafe { camlux_frame_copy_to_shared(frame.raw(), layer, memory.raw(), offset_bytes) }
    };
    let (mut info, mut fd) = (init!(camlux_shared_memory_info {}), -1);
    // SAFETY: a struct of that size, and a pointer to a number.
    unsafe {
        ok(camlux_shared_memory_get_info(memory.raw(), &mut info));
        ok(camlux_shared_memory_export_fd(memory.raw(), &mut fd));
    }
    assert!(fd >= 0 && info.allocation_bytes >= image_bytes);
    #[cfg(unix)]
    // SAFETY: nothing else owns the descriptor.
    drop(unsafe { std::os::fd::OwnedFd::from_raw_fd(fd) });
    ok(copy(&frame, CAMLUX_LAYER_DIRECT, 0));
    if !info.host_data.is_null() {
        let direct = frame.view(CAMLUX_LAYER_DIRECT);
        // SAFETY: both have that number of values.
        let [texels, values] = unsafe {
            [(info.host_data, 4), (direct.data, 3)].map(|(data, channels)| {
                std::slice::from_raw_parts(data.cast::<f32>(), 24 * 20 * channels)
            })
        };
        let bands = texels.chunks(4).flat_map(|texel| &texel[..3]);
        assert!(bands.eq(values) && values.iter().any(|&value| value > 0.0));
    }

    let plain = renderer.render(&scene);
    for (frame, layer, offset_bytes, words) in [
        (&frame, CAMLUX_LAYER_DEPTH, 0, "depth is not on the device"),
        (&frame, CAMLUX_LAYER_DIRECT, 4, "not a multiple of 16"),
        (&frame, CAMLUX_LAYER_DIRECT, 1 << 20, "do not fit"),
        (&frame, 63, 0, "layer is 63"),
        (&plain, CAMLUX_LAYER_DIRECT, 0, "on_device"),
    ] {
        fails(copy(frame, layer, offset_bytes), ARGUMENT, words);
    }
    fails(create(0).unwrap_err(), ARGUMENT, "size_bytes is 0");
    // The frame and the memory outlive the renderer and the scene.
    drop(renderer);
    drop(scene);
    ok(copy(&frame, CAMLUX_LAYER_DIRECT, 0));
}

#[test]
fn what_is_no_device_of_a_host_is_refused() {
    unsafe extern "C" fn nothing() {}
    unsafe extern "C" fn lock(_: *mut std::ffi::c_void) {}
    let create = |vulkan: *const camlux_vulkan_device, words: &str| {
        let mut device = null_mut();
        // SAFETY: both are NULL or valid.
        let status = unsafe { camlux_device_create_from_vulkan(vulkan, &mut device) };
        fails(status, ARGUMENT, words);
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
