//! Frames that stay on the device, and devices of a host's, through the C interface; `tests/hard/host_device.rs` is such a host, and so is
//! `examples/cpp_host`.

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
    // SAFETY: all of it points to what it should.
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
    // It outlives its renderer.
    ok(image_of(staying, CAMLUX_LAYER_DIRECT, &mut image));
    for frame in [plain, staying] {
        ok(camlux_frame_release(frame));
    }
}

#[test]
fn what_is_no_device_of_a_host_is_refused() {
    unsafe extern "C" fn nothing() {}
    unsafe extern "C" fn lock(_: *mut std::ffi::c_void) {}
    let create = |vulkan: *const camlux_vulkan_device, words: &str| {
        let mut device = null_mut();
        // SAFETY: both are null or point to what they should.
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
