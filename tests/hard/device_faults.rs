//! Faults: the driver runs out of memory at any call, the device is lost in any pass, a render is cancelled at any progress report.

use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use crate::common::gather::gather;
use crate::common::gpu::{Gpu, assert_is_lit, demo_scene, plain_sum};
use camlux::{
    Device, DeviceKind, DeviceOptions, Error, Fault, Progress, RenderOptions, Renderer, Scene,
    Tracer,
    internals::ray_probe::RayProbe,
    output::{Frame, Layer},
    scene::{IndirectLight, RsmAverage, Shadow},
};

/// The Vulkan functions that create a pipeline and its parts.
const PIPELINE_FUNCTIONS: [&str; 5] = [
    "vkCreateDescriptorSetLayout",
    "vkCreatePipelineLayout",
    "vkCreateShaderModule",
    "vkCreateComputePipelines",
    "vkCreateGraphicsPipelines",
];

fn bounce(name: &str, size_px: [u32; 2]) -> Scene {
    let mut scene = demo_scene(name, size_px);
    scene.indirect = Some(gather!(0.5, rsm_size = Some(8)));
    scene
}

/// A scene whose image is large enough that the sum is gathered at few pixels.
fn sum_at_few_pixels() -> Scene {
    let mut scene = demo_scene("glossy", [192, 176]);
    scene.indirect = Some(IndirectLight::RsmAverage(RsmAverage {
        rsm_size: 32,
        interpolation_error: Some(0.2),
    }));
    scene
}

/// Small scenes that together use textures, a spot light, a sensor, sums of matte and glossy VPLs, a shadow map and rays.
fn small_scenes() -> [(&'static str, Scene); 4] {
    let mut by_map = plain_sum(demo_scene("textured", [16, 16]), 8);
    by_map.direct.shadow = Some(Shadow::Map);
    by_map.lights.push(by_map.lights[0].clone());
    // Its budget is for a first image and a few rounds more.
    let mut by_rays = bounce("glossy", [8, 8]);
    by_rays.indirect = Some(gather!(0.5, rsm_size = Some(8), max_rays = Some(80_000)));
    [
        ("textured, shadow map, two lights", by_map),
        (
            "cornell_spot, sum",
            plain_sum(demo_scene("cornell_spot", [16, 16]), 8),
        ),
        ("glossy, sum", plain_sum(demo_scene("glossy", [16, 16]), 8)),
        ("glossy, by rays", by_rays),
    ]
}

fn try_render(renderer: &mut Renderer, scene: &Scene) -> camlux::Result<Frame> {
    renderer.render(scene, &mut RenderOptions::default())
}

/// Checks that the device holds no memory, for example after a failed frame.
#[track_caller]
fn assert_nothing_held(device: &Device) {
    let held = device.memory_use();
    assert_eq!((held.allocations, held.bytes), (0, 0));
}

/// Renders again and again, and lets the next call of a function (`None`: of any function) fail each time, until a frame has no such call
/// left. Returns the number of calls. `is_fresh`: with a new renderer that has no pipelines yet. After every `check_each`-th failure, a frame
/// without faults must be as before.
fn fail_each_call(
    gpu: &mut Gpu,
    scene: &Scene,
    function: Option<&'static str>,
    is_fresh: bool,
    check_each: u64,
) -> u64 {
    let fresh = gpu.render(scene);
    assert_is_lit(&fresh, Layer::Direct);
    for call in 0.. {
        if is_fresh {
            // Renderers of one device share pipelines.
            *gpu = Gpu::open();
        }
        gpu.renderer.forget();
        gpu.device
            .inject(Some(Fault::OutOfMemory { function, call }));
        let result = try_render(&mut gpu.renderer, scene);
        gpu.device.inject(None);
        if result.is_err() {
            assert_nothing_held(&gpu.device);
        }
        match result {
            Ok(frame) => {
                assert!(frame.layers == fresh.layers);
                gpu.renderer.forget();
                assert_nothing_held(&gpu.device);
                return call;
            }
            Err(Error::Memory { problem, .. }) => assert_eq!(problem, "Out of memory"),
            Err(Error::Vulkan {
                call: told, result, ..
            }) => {
                assert!(function.is_none_or(|function| function == told));
                assert_eq!(result.as_raw(), -2, "ERROR_OUT_OF_DEVICE_MEMORY");
            }
            Err(other) => panic!("call {call}: {other:?}"),
        }
        if call % check_each == 0 {
            let again = gpu.render(scene);
            assert!(again.layers == fresh.layers, "after call {call}");
        }
    }
    unreachable!("a frame has an end");
}

#[test]
fn memory_runs_out_at_each_call_of_a_frame() {
    let mut gpu = Gpu::open();
    for (what, scene) in small_scenes() {
        let start = Instant::now();
        let calls = fail_each_call(&mut gpu, &scene, None, false, 64);
        println!("{what}: {calls} calls, {:.1?}", start.elapsed());
        // The G-buffer and its submission alone make that many.
        assert!(calls > 100, "{what}: {calls}");
    }
}

#[test]
fn memory_runs_out_at_each_call_that_makes_a_pipeline() {
    let mut gpu = Gpu::open();
    let (_, scene) = &small_scenes()[1];
    let mut counts = [0; 5];
    for (count, function) in counts.iter_mut().zip(PIPELINE_FUNCTIONS) {
        *count = fail_each_call(&mut gpu, scene, Some(function), true, 16);
    }
    println!("{counts:?}");
    let [set_layouts, layouts, modules, compute, raster] = counts;
    assert_eq!(set_layouts, compute + raster);
    assert_eq!(layouts, compute + raster);
    assert_eq!(modules, compute + 2 * raster);
    assert!(compute > 5 && raster >= 2);
}

#[test]
#[ignore = "long: makes all pipelines anew for each of some hundred calls"]
fn memory_runs_out_at_each_call_with_pipelines_to_be_made() {
    let mut gpu = Gpu::open();
    let (what, scene) = &small_scenes()[1];
    let calls = fail_each_call(&mut gpu, scene, None, true, 64);
    println!("{what}: {calls} calls");
}

#[test]
#[ignore = "long: a frame of 192 x 176 for each of its calls"]
fn memory_runs_out_at_each_call_of_a_sum_at_few_pixels() {
    let mut gpu = Gpu::open();
    let calls = fail_each_call(&mut gpu, &sum_at_few_pixels(), None, false, 64);
    println!("sum at few pixels: {calls} calls");
}

/// Opens a device and loses it in a render. Returns the pass that the error names, or `None` if the fault did not occur. The frame must then
/// be as before.
#[track_caller]
fn lose(scene: &Scene, fresh: &Frame, fault: Fault) -> Option<&'static str> {
    let mut gpu = Gpu::open();
    gpu.device.inject(Some(fault));
    let error = match try_render(&mut gpu.renderer, scene) {
        Ok(frame) => {
            assert!(frame.layers == fresh.layers);
            return None;
        }
        Err(error) => error,
    };
    let Error::DeviceLost { pass, call } = error else {
        panic!("{error:?}");
    };
    assert_eq!(call, "vkWaitForFences");
    let message = error.to_string();
    for part in [pass, call, "open the device again", "submission_target"] {
        assert!(message.contains(part), "{part} is missing in: {message}");
    }
    assert_nothing_held(&gpu.device);
    // Every later use of the device fails at once with the same message.
    let start = Instant::now();
    let again = try_render(&mut gpu.renderer, scene).expect_err("it is lost");
    assert_eq!(again.to_string(), message);
    let mut other = Renderer::new(&gpu.device).expect("a renderer asks nothing of the device");
    let again = try_render(&mut other, scene).expect_err("it is lost");
    assert_eq!(again.to_string(), message);
    let probe = RayProbe::new(&gpu.device, scene, Tracer::Kernel);
    assert_eq!(probe.err().expect("it is lost").to_string(), message);
    assert!(start.elapsed() < Duration::from_millis(500));
    assert_nothing_held(&gpu.device);
    Some(pass)
}

/// The passes of a frame with one light begin in a fixed order in each submission.
#[test]
fn a_lost_device_tells_the_last_pass_begun() {
    let (_, scene) = &small_scenes()[1];
    let fresh = Gpu::open().render(scene);
    let lose = |submission, pass| lose(scene, &fresh, Fault::DeviceLost { submission, pass });
    let submissions: [&[&str]; 3] = [
        &["gbuffer", "rsm", "shadow", "direct", "vpl"],
        &["receivers"],
        &["gather", "scatter", "resolve", "sensor"],
    ];
    for (submission, passes) in submissions.iter().enumerate() {
        for (index, pass) in passes.iter().enumerate() {
            let told = lose(submission as u64, index);
            assert_eq!(told, Some(*pass), "submission {submission}");
        }
    }
    // The last one also copies the images to the host.
    assert_eq!(lose(3, 0), None);
}

#[test]
fn a_device_can_be_lost_in_every_pass_of_the_bounce() {
    let scene = bounce("glossy", [16, 16]);
    let fresh = Gpu::open().render(&scene);
    let passes: Vec<&str> = fresh.stats.passes.iter().map(|pass| pass.name).collect();
    for name in [
        "gbuffer",
        "direct_emit",
        "trace",
        "direct",
        "light_rays",
        "predict",
        "receivers",
        "final_gather_emit",
        "final_gather_draw",
        "final_gather_shade",
        "final_gather_sum",
        "scatter",
        "smooth",
        "resolve",
        "error_estimate",
    ] {
        assert!(passes.contains(&name), "{name}");
    }
    let is_by_host = Gpu::open().device.info().kind == DeviceKind::Cpu;
    for pass in passes {
        if pass == "trace" && is_by_host {
            continue;
        }
        let told = lose(&scene, &fresh, Fault::DeviceLostIn { pass });
        assert_eq!(told, Some(pass));
    }
}

/// Vulkan does not guarantee timestamps. Without them, all passes of a submission report the same time, and the image is the same.
#[test]
fn a_queue_without_timestamps_renders_the_same() {
    let mut gpu = Gpu::open();
    let mut scene = bounce("cornell", [32, 32]);
    scene.direct.shadow = Some(Shadow::Map);
    let timed = gpu.render(&scene);
    let mut gpu = Gpu::open();
    gpu.device.inject(Some(Fault::NoTimestamps));
    let untimed = gpu.render(&scene);
    assert!(untimed.layers == timed.layers);
    let names = |frame: &Frame| -> Vec<_> { frame.stats.passes.iter().map(|p| p.name).collect() };
    assert_eq!(names(&untimed), names(&timed));
    // Both passes are in the same single submission.
    let time = |frame: &Frame, name| {
        let pass = frame.stats.passes.iter().find(|pass| pass.name == name);
        pass.expect("it ran").milliseconds
    };
    assert!(time(&untimed, "shadow") > 0.0);
    assert_eq!(time(&untimed, "shadow"), time(&untimed, "direct"));
    assert_ne!(time(&timed, "shadow"), time(&timed, "direct"));
}

/// A lost device that the caller keeps does not disturb a new device.
#[test]
fn a_new_device_works_beside_a_lost_one() {
    let (_, scene) = &small_scenes()[0];
    let mut lost = Gpu::open();
    let fresh = lost.render(scene);
    lost.device.inject(Some(Fault::DeviceLost {
        submission: 1,
        pass: 0,
    }));
    assert!(try_render(&mut lost.renderer, scene).is_err());
    let mut other = Gpu::open();
    assert!(other.render(scene).layers == fresh.layers);
    assert!(try_render(&mut lost.renderer, scene).is_err());
    other.renderer.forget();
    assert_nothing_held(&other.device);
}

/// Cancels a render after this number of reports. Returns false if the render ended first.
fn cancel_after(gpu: &mut Gpu, scene: &Scene, reports: usize) -> bool {
    let mut left = reports;
    let mut stop = |_: Progress| match left {
        0 => ControlFlow::Break(()),
        _ => {
            left -= 1;
            ControlFlow::Continue(())
        }
    };
    let mut options = RenderOptions {
        progress: Some(&mut stop),
        // A short target gives many submissions, with a report between them.
        submission_target: Duration::from_millis(10),
        ..RenderOptions::default()
    };
    match gpu.renderer.render(scene, &mut options) {
        Ok(_) => false,
        Err(Error::Cancelled) => true,
        Err(other) => panic!("after {reports} reports: {other:?}"),
    }
}

fn cancel_at_each_report(scene: &Scene, least: usize, check_each: usize) {
    let mut gpu = Gpu::open();
    let fresh = gpu.render(scene);
    assert_is_lit(&fresh, Layer::Indirect);
    let mut reports = 0;
    while cancel_after(&mut gpu, scene, reports) {
        assert_nothing_held(&gpu.device);
        if reports.is_multiple_of(check_each) {
            let frame = gpu.render(scene);
            assert!(frame.layers == fresh.layers, "after {reports} reports");
        }
        reports += 1;
    }
    println!("{reports} reports");
    assert!(reports >= least, "{reports}");
    assert!(gpu.render(scene).layers == fresh.layers);
}

#[test]
fn a_bounce_cancelled_at_any_report_leaves_a_usable_engine() {
    cancel_at_each_report(&bounce("glossy", [16, 16]), 10, 1);
}

#[test]
fn a_sum_cancelled_at_any_report_leaves_a_usable_engine() {
    cancel_at_each_report(&sum_at_few_pixels(), 10, 8);
    cancel_at_each_report(&plain_sum(demo_scene("cornell", [48, 48]), 16), 3, 1);
}

/// Closes a device that nothing else holds. Only then does the validation layer report objects that were not destroyed, including those
/// without memory.
#[track_caller]
fn assert_closes(device: Device) {
    let messages = device.close().expect("nothing holds the device");
    assert_eq!(messages, [""; 0]);
}

fn open_device() -> Device {
    let options = DeviceOptions {
        validation: true,
        ..DeviceOptions::default()
    };
    Device::open(&options).expect("scripts/test installs a driver and the layer")
}

#[test]
fn nothing_is_left_when_the_device_closes() {
    let device = open_device();
    let (_, scene) = &small_scenes()[2];
    let mut renderer = Renderer::new(&device).expect("a renderer");
    try_render(&mut renderer, scene).expect("the scene renders");
    drop(renderer);
    assert_closes(device);
}

#[test]
fn nothing_is_left_when_calls_have_failed() {
    let device = open_device();
    let scene = plain_sum(demo_scene("glossy", [8, 8]), 8);
    let mut renderer = Renderer::new(&device).expect("a renderer");
    for call in 0.. {
        let function = None;
        device.inject(Some(Fault::OutOfMemory { function, call }));
        if try_render(&mut renderer, &scene).is_ok() {
            break;
        }
    }
    drop(renderer);
    assert_closes(device);
}

#[test]
fn nothing_is_left_when_the_device_was_lost() {
    let device = open_device();
    let (_, scene) = &small_scenes()[2];
    let mut renderer = Renderer::new(&device).expect("a renderer");
    device.inject(Some(Fault::DeviceLostIn { pass: "gather" }));
    try_render(&mut renderer, scene).expect_err("it is lost");
    drop(renderer);
    assert_closes(device);
}
