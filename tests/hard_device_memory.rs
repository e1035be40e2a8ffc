//! What a frame holds of the device's memory: known before, all of it given back, and never more than the device has.

mod gpu;

use std::{collections::BTreeSet, time::Instant};

use camlux::{
    DeviceInfo, Error, Plan, RenderOptions, Scene,
    output::Layer,
    scene::{Estimator, Indirect, Mesh, Shadow, Visibility},
};
use gpu::{DEMO_SCENES, Gpu, demo_scene, plain_sum};

/// By how much the figure may be over what was held: there are fewer boxes for rays where triangles stand alone, and the list of all
/// tiles of the RSMs is counted at the length that it has where every tile lights a surface.
const SLACK: f64 = 1.1;
/// Set aside whatever the scene: for what the refinement takes, and for small things.
const CONSTANT_BYTES: u64 = 2 << 20;

fn with(scene: &Scene, change: impl Fn(&mut Scene)) -> Scene {
    let mut scene = scene.clone();
    change(&mut scene);
    scene
}

fn indirect(visibility: Visibility, target_error: Option<f64>) -> Option<Indirect> {
    Some(Indirect {
        estimator: match visibility {
            Visibility::None => Estimator::RsmAverage,
            Visibility::Rays => Estimator::InstantRadiosity,
        },
        rsm_size: Some(64),
        visibility,
        target_error,
    })
}

/// Scenes that between them make every buffer and every image that there is.
fn scenes(size_px: [u32; 2]) -> Vec<(String, Scene)> {
    let mut scenes = Vec::new();
    for name in DEMO_SCENES {
        let demo = demo_scene(name, size_px);
        let mut add = |what: &str, scene| scenes.push((format!("{name}, {what}"), scene));
        add("sum", plain_sum(demo.clone(), 64));
        add(
            "direct light by a map",
            with(&demo, |scene| {
                scene.indirect = None;
                scene.direct.shadow = Some(Shadow::Map);
            }),
        );
        add(
            "sum with an error",
            with(&demo, |scene| {
                scene.indirect = indirect(Visibility::None, Some(0.05));
            }),
        );
        add(
            "two lights by rays",
            with(&demo, |scene| {
                scene.lights.push(scene.lights[0]);
                scene.indirect = indirect(Visibility::Rays, Some(0.3));
            }),
        );
    }
    scenes
}

#[test]
fn the_plan_knows_what_a_frame_holds() {
    let mut gpu = Gpu::open();
    for (what, scene) in scenes([320, 240]) {
        let plan = Plan::new(&scene, gpu.device.info()).expect("the scene is valid");
        gpu.device.inject(None);
        let frame = gpu.render(&scene);
        let held = gpu.device.memory_use();
        assert_eq!((held.allocations, held.bytes), (0, 0), "{what}");
        let said = plan.device_memory_bytes(&scene);
        let ratio = said as f64 / held.peak_bytes as f64;
        println!("{what}: {said} said, {} held, {ratio:.3}", held.peak_bytes);
        assert!(said >= held.peak_bytes, "{what}: {said} < {held:?}");
        let bound = (held.peak_bytes as f64 * SLACK) as u64 + CONSTANT_BYTES;
        assert!(said <= bound, "{what}: {said} > {bound}, {held:?}");

        let values = |layer| frame.values(layer).map_or(0, <[f32]>::len);
        let ids = |layer| frame.ids(layer).map_or(0, <[u32]>::len);
        let words: usize = Layer::ALL
            .into_iter()
            .map(|layer| values(layer).max(ids(layer)))
            .sum();
        assert_eq!(plan.layer_bytes(), 4 * words as u64, "{what}");
    }
}

/// Raises a limit from 1 to where the plan takes the scene. Returns what was over it on the way, and where it ends.
fn raised(
    scene: &Scene,
    mut device: DeviceInfo,
    limit: impl Fn(&mut DeviceInfo, u64),
) -> (BTreeSet<String>, u64) {
    let mut met = BTreeSet::new();
    let mut value = 1;
    loop {
        limit(&mut device, value);
        match Plan::new(scene, &device) {
            Ok(_) => return (met, value),
            Err(Error::DeviceLimit { what, asked, .. }) => {
                assert!(asked > value, "{what}");
                met.insert(what);
                value = asked;
            }
            Err(other) => panic!("{other}"),
        }
    }
}

/// No buffer and no image that a frame makes is larger than the plan was told that it may be; and each check is met by some limit.
#[test]
fn whatever_a_frame_makes_is_checked_before() {
    let mut gpu = Gpu::open();
    let mut all = BTreeSet::new();
    for (what, scene) in scenes([320, 240]) {
        let mut device = gpu.device.info().clone();
        // A real device may have less than some of the figures below.
        device.limits.memory_bytes = 1 << 50;
        gpu.device.inject(None);
        gpu.render(&scene);
        let largest = gpu.device.memory_use().largest_bytes;
        let (met, bytes) = raised(&scene, device.clone(), |device, value| {
            device.limits.max_allocation_bytes = value;
        });
        // Every Vulkan device takes the refinement's results, which are as many for every scene.
        let bytes = bytes.max(2 << 20);
        assert!(bytes >= largest, "{what}: {bytes} < {largest}");
        all.extend(met);
        let limits: [fn(&mut DeviceInfo, u64); 5] = [
            |device, value| device.limits.max_image_px = value as u32,
            |device, value| device.limits.max_storage_buffer_bytes = value,
            |device, value| device.limits.max_buffer_bytes = value,
            |device, value| device.limits.memory_bytes = value,
            |device, value| device.limits.max_storage_images = value as u32,
        ];
        for limit in limits {
            all.extend(raised(&scene, device.clone(), limit).0);
        }
    }
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    assert_eq!(all, CHECKS);
}

const CHECKS: [&str; 0] = [];

#[test]
fn sixteen_thousand_pixels_squared_are_refused_with_what_they_need() {
    let mut gpu = Gpu::open();
    let scene = demo_scene("cornell", [16_384, 16_384]);
    // A device that takes images and buffers of this size, but not all of them together.
    let mut device = gpu.device.info().clone();
    device.limits.max_image_px = 16_384;
    device.limits.max_allocation_bytes = u64::MAX;
    device.limits.max_buffer_bytes = u64::MAX;
    device.limits.max_storage_buffer_bytes = u64::MAX;
    device.limits.memory_bytes = u64::MAX;
    let plan = Plan::new(&scene, &device).expect("there is room");
    let need = plan.device_memory_bytes(&scene);
    // Seven images of 4 GiB and a depth at least.
    assert!(need > 29 << 30, "{need}");
    device.limits.memory_bytes = need;
    assert!(Plan::new(&scene, &device).is_ok());
    device.limits.memory_bytes = need - 1;
    let start = Instant::now();
    let error = Plan::new(&scene, &device).expect_err("that is too much");
    let message = error.to_string();
    for part in [
        "the memory of the frame (bytes)",
        &need.to_string(),
        &(need - 1).to_string(),
        "render a smaller image",
    ] {
        assert!(message.contains(part), "{part} is missing in: {message}");
    }
    // This device takes it, or says so at once, and holds nothing.
    if Plan::new(&scene, gpu.device.info()).is_err() {
        let error = gpu
            .renderer
            .render(&scene, &mut RenderOptions::default())
            .expect_err("the plan says so");
        assert!(matches!(error, Error::DeviceLimit { .. }), "{error:?}");
        assert_eq!(gpu.device.memory_use().peak_bytes, 0);
    }
    assert!(start.elapsed().as_secs_f64() < 0.5, "work was started");
}

/// What takes the most is what the message asks to make smaller.
#[test]
fn the_message_names_what_takes_the_most() {
    let gpu = Gpu::open();
    let mend = |scene: &Scene| {
        let mut device = gpu.device.info().clone();
        device.limits.memory_bytes = 1 << 20;
        Plan::new(scene, &device)
            .expect_err("that is too much")
            .to_string()
    };
    let plain = with(&demo_scene("cornell", [256, 256]), |scene| {
        scene.indirect = Some(Indirect::plain_sum(Estimator::RsmAverage, 8));
    });
    assert!(mend(&plain).contains("render a smaller image"));
    let fine = with(&plain, |scene| {
        scene.camera.resolution_px = [16, 16];
        scene.indirect = Some(Indirect::plain_sum(Estimator::RsmAverage, 256));
    });
    assert!(mend(&fine).contains("set a smaller rsm_size"));
    let many = with(&plain, |scene| {
        scene.camera.resolution_px = [16, 16];
        scene.direct.shadow = Some(Shadow::Rays);
        let triangles = vec![[0, 1, 2]; 100_000];
        let corners = [[0.0, 1.0, 0.0], [0.1, 1.0, 0.0], [0.0, 1.1, 0.0]];
        let mesh = Mesh::from_slices("many", &corners, &triangles, 0);
        scene.meshes.push(mesh);
    });
    assert!(mend(&many).contains("simplify the meshes"));
}
