//! Device memory of a frame: the plan knows it beforehand, the frame frees all of it, and it never exceeds the device's memory.

use std::time::Instant;

use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene, plain_sum};
use crate::common::instances::crowd;
use camlux::{
    DeviceInfo, DeviceKind, Error, Plan, Quirks, RenderOptions, Renderer, Scene,
    output::Layer,
    scene::{
        ChargeUnit, FinalGather, IndirectLight, Instance, Light, Mesh, PixelFilter, PixelSampling,
        RsmAverage, Sensor, Shadow, Texels, Texture, TimeOfFlight, VplSum,
    },
};
use glam::{DAffine3, DVec3, dvec3};

/// Maximum ratio of the plan's figure to the memory in use. The plan counts an upper bound of the boxes for rays, and the list of RSM tiles
/// as if every tile lit a surface.
const SLACK: f64 = 1.1;
/// Memory that the plan counts for every scene: for the refinement, for pilots and more samples of pixels than most scenes need, for the
/// cells of a pilot, and for small buffers.
const CONSTANT_BYTES: u64 = 4 << 20;

fn with(scene: &Scene, change: impl Fn(&mut Scene)) -> Scene {
    let mut scene = scene.clone();
    change(&mut scene);
    scene
}

const FINAL_GATHER: Option<IndirectLight> = Some(final_gather(64));
const INTERPOLATED_AVERAGE: Option<IndirectLight> = Some(IndirectLight::RsmAverage(RsmAverage {
    rsm_size: 64,
    interpolation_error: Some(0.05),
}));

const fn final_gather(rsm_size: u32) -> IndirectLight {
    IndirectLight::FinalGather(FinalGather {
        rsm_size: Some(rsm_size),
        ..FinalGather::new(0.3)
    })
}

/// Gives the scene a time-of-flight camera with three frequencies.
fn time_of_flight(scene: &mut Scene) {
    scene.sensor = Some(Sensor {
        pixel_pitch_um: [10.0; 2],
        exposure_time_s: 1e-3,
        duty_cycle: 1.0,
        f_number: None,
        wavelength_nm: Some(850.0),
        quantum_efficiency: Some(0.8),
        ..Sensor::DEFAULT
    });
    let is_ambient = |light: &usize| scene.lights[*light].position_m().is_none();
    let ambient_lights = (0..scene.lights.len()).filter(is_ambient).collect();
    scene.tof = Some(TimeOfFlight {
        frequencies_hz: vec![20e6, 50e6, 100e6],
        phase_count: 4,
        contrasts: vec![0.75; 3],
        band_weights: [1.0, 0.0, 0.0],
        phase_offset_deg: 0.0,
        ambient_lights,
        output: ChargeUnit::Electrons,
        noise: None,
    });
}

/// Scenes that together create every kind of buffer and image.
fn scenes(size_px: [u32; 2]) -> Vec<(String, Scene)> {
    let mut scenes = Vec::new();
    for name in DEMO_SCENES {
        let demo = demo_scene(name, size_px);
        let mut add = |what: &str, scene| scenes.push((format!("{name}, {what}"), scene));
        add("sum", plain_sum(demo.clone(), 16));
        add(
            "direct light by a map",
            with(&demo, |scene| {
                scene.indirect = None;
                scene.direct.shadow = Some(Shadow::Map);
            }),
        );
        for (what, indirect) in [
            ("time of flight", None),
            ("time of flight of a bounce", FINAL_GATHER),
            ("time of flight of a sum", INTERPOLATED_AVERAGE),
        ] {
            let scene = with(&demo, |scene| {
                // Adds a light with a position, which not all scenes have.
                scene
                    .lights
                    .push(Light::point(scene.camera.position_m, [1.0; 3]).into());
                scene.indirect = indirect;
                time_of_flight(scene);
            });
            add(what, scene);
        }
        add(
            "sum with an error",
            with(&demo, |scene| {
                scene.indirect = INTERPOLATED_AVERAGE;
            }),
        );
        add(
            "two lights by rays",
            with(&demo, |scene| {
                scene.lights.push(scene.lights[0].clone());
                scene.indirect = FINAL_GATHER;
                if let Some(IndirectLight::FinalGather(gather)) = &mut scene.indirect {
                    gather.stderr_layer = true;
                }
            }),
        );
        add(
            "more bounces",
            with(&demo, |scene| {
                scene.indirect = FINAL_GATHER;
                if let Some(IndirectLight::FinalGather(gather)) = &mut scene.indirect {
                    gather.bounces = 5;
                }
            }),
        );
        for (what, indirect) in [
            ("samples of a bounce", FINAL_GATHER),
            ("samples of a sum", INTERPOLATED_AVERAGE),
        ] {
            let scene = with(&demo, |scene| {
                scene.indirect = indirect;
                scene.camera.pixel_sampling = Some(PixelSampling {
                    samples: 2,
                    filter: PixelFilter::Box,
                });
            });
            add(what, scene);
        }
    }
    let shared = with(&crowd(size_px), |scene| scene.indirect = FINAL_GATHER);
    scenes.push(("instances".into(), shared));
    scenes
}

/// Apart from their poses and boxes.
#[test]
fn a_thousand_instances_take_the_memory_of_one() {
    let mut gpu = Gpu::open();
    let mut held = Vec::new();
    for count in [2, 1000] {
        let scene = with(&crowd([64, 64]), |scene| {
            let knot = scene.meshes[1].clone();
            scene.meshes.truncate(1);
            for index in 0..count {
                let cell = [1, 10, 100].map(|step| f64::from(index / step % 10));
                let [x, y, z] = cell.map(|cell| 0.2 * cell + 0.1);
                scene.meshes.push(Instance {
                    to_world: DAffine3::from_translation(dvec3(x - 1.0, y, z - 1.0))
                        * DAffine3::from_scale(DVec3::splat(0.1)),
                    ..knot.clone()
                });
            }
            scene.indirect = FINAL_GATHER;
        });
        assert!(scene.meshes[1].triangles.len() > 10_000);
        let plan = Plan::new(&scene, gpu.device.info()).expect("the scene is valid");
        gpu.device.inject(None);
        let frame = gpu.render(&scene);
        let ids = frame.ids(Layer::InstanceId).expect("every frame has it");
        let last = u32::try_from(scene.meshes.len()).expect("a small number");
        assert!(count == 2 || ids.iter().any(|&id| id > last / 2));
        gpu.renderer.forget();
        let peak_bytes = gpu.device.memory_use().peak_bytes;
        let said = plan.device_memory_bytes(&scene);
        println!("{count} instances: {said} said, {peak_bytes} held");
        assert!(said >= peak_bytes);
        held.push(peak_bytes);
    }
    // 128 bytes per instance and 32 for two boxes, and the same again for the upload.
    assert!(
        held[1] < held[0] + 2 * 1000 * (128 + 32) + (64 << 10),
        "{held:?}"
    );
}

/// The same values in other objects, which nothing shares.
fn copy_of(scene: &Scene) -> Scene {
    with(scene, |scene| {
        for instance in &mut scene.meshes {
            instance.mesh = Mesh::clone(&instance.mesh).into();
        }
        for texture in &mut scene.textures {
            *texture = Texture::clone(texture).into();
        }
    })
}

#[test]
fn renderers_of_a_device_hold_a_scene_once() {
    let gpu = Gpu::open();
    for name in ["knot", "textured"] {
        let scene = demo_scene(name, [16, 16]);
        let scene = with(&scene, |scene| scene.indirect = FINAL_GATHER);
        let mut renderers = Vec::new();
        let added = [scene.clone(), copy_of(&scene), scene].map(|scene| {
            let before = gpu.device.memory_use().bytes;
            let mut renderer = Renderer::new(&gpu.device).expect("a renderer");
            let rendered = renderer.render(&scene, &mut RenderOptions::default());
            rendered.expect("a frame");
            renderers.push(renderer);
            gpu.device.memory_use().bytes - before
        });
        let [first, copied, again] = added;
        println!("{first} B for the first, {copied} B for a copy, {again} B for the scene again");
        // What every scene has is shared with the copy, too.
        assert!(
            copied + (2 << 20) >= first && copied > again + (512 << 10),
            "{name}"
        );
        renderers.clear();
        assert_eq!(gpu.device.memory_use().bytes, 0);
    }
}

#[test]
fn a_gpu_renders_as_many_frames_as_its_memory_holds() {
    let mut device = Gpu::open().device.info().clone();
    let scene = with(&demo_scene("textured", [320, 240]), |scene| {
        scene.indirect = FINAL_GATHER;
    });
    assert_eq!(device.kind, DeviceKind::Cpu);
    let plan = Plan::new(&scene, &device).expect("the scene is valid");
    assert_eq!(plan.frames_in_flight(&scene, &device, true), 1);
    device.kind = DeviceKind::Discrete;
    let whole = plan.device_memory_bytes(&scene);
    let mut in_flight = |memory_bytes: u64, keeps_surfaces: bool| {
        device.limits.memory_bytes = memory_bytes;
        plan.frames_in_flight(&scene, &device, keeps_surfaces)
    };
    for frames in 1..=4 {
        let memory_bytes = frames as u64 * whole;
        assert_eq!(in_flight(memory_bytes, false), frames);
        assert_eq!(in_flight(memory_bytes - 1, false), (frames - 1).max(1));
        // The second frame needs no copy of the scene.
        assert!(in_flight(memory_bytes - 1, true) == frames);
    }
    assert_eq!(in_flight(100 * whole, true), 4);
}

#[test]
fn the_plan_knows_what_a_frame_holds_and_has_checked_all_of_it() {
    let mut gpu = Gpu::open();
    for (what, scene) in scenes([320, 240]) {
        let plan = Plan::new(&scene, gpu.device.info()).expect("the scene is valid");
        gpu.device.inject(None);
        // The second frame has what the first one leaves.
        gpu.render(&scene);
        let frame = gpu.render(&scene);
        gpu.renderer.forget();
        let held = gpu.device.memory_use();
        assert_eq!((held.allocations, held.bytes), (0, 0), "{what}");
        let said = plan.device_memory_bytes(&scene);
        let ratio = said as f64 / held.peak_bytes as f64;
        println!("{what}: {said} said, {} held, {ratio:.3}", held.peak_bytes);
        assert!(said >= held.peak_bytes, "{what}: {said} < {held:?}");
        let bound = (held.peak_bytes as f64 * SLACK) as u64 + CONSTANT_BYTES;
        assert!(said <= bound, "{what}: {said} > {bound}, {held:?}");

        // Every Vulkan device has room for the refinement's results. Their size is the same for every scene. Where there is room, the images
        // that the host reads are copied to one buffer: four to twelve.
        let copies = 12 * 320 * 240 * 16;
        let checked = least_allocation_bytes(&scene, gpu.device.info()).max(2 << 20);
        let checked = checked.max(u64::min(copies, held.peak_bytes / 2));
        assert!(checked >= held.largest_bytes, "{what}: {checked}, {held:?}");

        let values = |layer| frame.values(layer).map_or(0, <[f32]>::len);
        let ids = |layer| frame.ids(layer).map_or(0, <[u32]>::len);
        let words: usize = Layer::all()
            .map(|layer| values(layer).max(ids(layer)))
            .sum();
        assert_eq!(plan.layer_bytes(), 4 * words as u64, "{what}");
    }
}

/// The lowest `max_allocation_bytes` with which the plan accepts the scene.
fn least_allocation_bytes(scene: &Scene, device: &DeviceInfo) -> u64 {
    let mut device = device.clone();
    device.limits.max_allocation_bytes = 1;
    loop {
        match Plan::new(scene, &device) {
            Ok(_) => return device.limits.max_allocation_bytes,
            Err(Error::DeviceLimit { requested, .. }) => {
                device.limits.max_allocation_bytes = requested
            }
            Err(other) => panic!("{other}"),
        }
    }
}

/// Asserts that the plan accepts the scene with this limit, and refuses it with one less.
#[track_caller]
fn assert_checked(what: &str, scene: &Scene, asked: u64, limit: fn(&mut DeviceInfo, u64)) {
    let gpu = Gpu::open();
    let mut device = gpu.device.info().clone();
    device.quirks = Quirks::default();
    limit(&mut device, asked - 1);
    let error = Plan::new(scene, &device).expect_err(what);
    let message = error.to_string();
    let says = format!("{what} is {asked}, over the limit of {}", asked - 1);
    assert!(message.contains(&says), "{message}");
    limit(&mut device, asked);
    if let Err(next) = Plan::new(scene, &device) {
        assert!(!next.to_string().contains(what), "{next}");
    }
}

/// Covers each check that `device_limits` does not test, with a device whose limit is lowered.
#[test]
fn each_list_and_image_is_checked() {
    let scene = demo_scene("cornell", [8, 8]);
    let allocation: fn(&mut DeviceInfo, u64) = |device, value| {
        device.limits.max_allocation_bytes = value;
    };
    let storage: fn(&mut DeviceInfo, u64) = |device, value| {
        device.limits.max_storage_buffer_bytes = value;
    };
    let sum = |rsm_size| {
        with(&plain_sum(scene.clone(), rsm_size), |scene| {
            scene.direct.shadow = Some(Shadow::Rays);
        })
    };
    // 24 rows of 1024 VPLs with three vectors each; 6 · 128² texels of 8 bytes.
    let list_bytes = 24 * 1024 * 3 * 16;
    assert_checked("VPLs (bytes)", &sum(64), list_bytes, allocation);
    let table = "table of the RSM's texels (bytes)";
    assert_checked(table, &sum(128), 6 * 128 * 128 * 8, storage);
    let by_map = with(&scene, |scene| scene.indirect = None);
    // Six faces of 256² pixels.
    let map_bytes = 6 * 256 * 256 * 16;
    assert_checked("shadow map (bytes)", &by_map, map_bytes, allocation);
    let textured = with(&demo_scene("textured", [8, 8]), |scene| {
        scene.indirect = None;
        scene.direct.shadow = Some(Shadow::Rays);
        let texture = &mut scene.textures[0];
        texture.size_px = [400, 400];
        texture.texels = Texels::F32(vec![[0.5; 3]; 160_000]);
    });
    // Three words per texel, one in the other texture; 4096 words per row.
    let words = 3 * 400 * 400 + textured.textures[1].texels.len() as u64;
    let staging_bytes = words.next_multiple_of(4096) * 4;
    let texture_bytes = words.next_multiple_of(4 * 4096) * 4;
    let what = "textures (bytes)";
    assert_checked(what, &textured, texture_bytes, allocation);
    assert_checked(what, &textured, staging_bytes, |device, value| {
        device.limits.max_buffer_bytes = value;
    });
    let many = |vertices: usize, triangles: usize| {
        with(&by_map, |scene| {
            let corners = vec![[0.0, 1.0, 0.0]; vertices];
            let triangles = vec![[0, 1, 2]; triangles];
            scene.meshes = vec![Mesh::from_slices("many", &corners, &triangles, 0).into()];
        })
    };
    let what = "list of vertices (bytes)";
    assert_checked(what, &many(1000, 1), 16_000, storage);
    let what = "list of triangles (bytes)";
    assert_checked(what, &many(3, 1000), 12_000, storage);

    let rays = with(&scene, |scene| {
        scene.indirect = FINAL_GATHER;
    });
    // Each material is stored twice, in 29 texels; 1024 texels per row.
    let materials = with(&rays, |scene| {
        scene.indirect = Some(final_gather(8));
        scene.materials.resize(175_000, scene.materials[0].clone());
    });
    let what = "materials, height (px)";
    assert_checked(what, &materials, 9913, |device, value| {
        device.limits.max_image_px = value as u32;
    });
    let wide = with(&rays, |scene| scene.camera.resolution_px = [4000, 100]);
    let what = "readback (bytes)";
    assert_checked(what, &wide, 4000 * 100 * 16, |device, value| {
        device.limits.max_buffer_bytes = value;
    });
}

#[test]
fn sixteen_thousand_pixels_squared_are_refused_with_what_they_need() {
    let mut gpu = Gpu::open();
    let scene = demo_scene("cornell", [16_384, 16_384]);
    // A device with room for images and buffers of this size. Only its total memory is limited.
    let mut device = gpu.device.info().clone();
    device.limits.max_image_px = 16_384;
    device.limits.max_allocation_bytes = u64::MAX;
    device.limits.max_buffer_bytes = u64::MAX;
    device.limits.max_storage_buffer_bytes = u64::MAX;
    device.limits.memory_bytes = u64::MAX;
    let plan = Plan::new(&scene, &device).expect("there is room");
    let need = plan.device_memory_bytes(&scene);
    // At least seven images of 4 GiB and a depth image.
    assert!(need > 29 << 30, "{need}");
    let takes = |device: &DeviceInfo| Plan::new(&scene, device).is_ok();
    device.limits.memory_bytes = need;
    device.kind = DeviceKind::Discrete;
    assert!(takes(&device));
    // If the device uses the host's memory, the layers count, too.
    device.kind = DeviceKind::Cpu;
    assert!(!takes(&device));
    device.limits.memory_bytes = need + plan.layer_bytes();
    assert!(takes(&device));
    device.kind = DeviceKind::Discrete;
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
    // If the plan refuses the scene on this device, the renderer does so at once and allocates nothing.
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

/// The message suggests making the largest item smaller.
#[test]
fn the_message_names_what_takes_the_most() {
    let gpu = Gpu::open();
    let hint = |scene: &Scene| {
        let mut device = gpu.device.info().clone();
        device.limits.memory_bytes = 1 << 20;
        Plan::new(scene, &device)
            .expect_err("that is too much")
            .to_string()
    };
    let plain = with(&demo_scene("cornell", [256, 256]), |scene| {
        scene.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 8));
    });
    assert!(hint(&plain).contains("render a smaller image"));
    let fine = with(&plain, |scene| {
        scene.camera.resolution_px = [16, 16];
        scene.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 256));
    });
    assert!(hint(&fine).contains("set a smaller rsm_size"));
    let many = with(&plain, |scene| {
        scene.camera.resolution_px = [16, 16];
        scene.direct.shadow = Some(Shadow::Rays);
        let triangles = vec![[0, 1, 2]; 100_000];
        let corners = [[0.0, 1.0, 0.0], [0.1, 1.0, 0.0], [0.0, 1.1, 0.0]];
        let mesh = Mesh::from_slices("many", &corners, &triangles, 0);
        scene.meshes.push(mesh.into());
    });
    assert!(hint(&many).contains("simplify the meshes"));
}
