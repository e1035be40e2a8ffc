//! Scenes over the limits of the device, almost empty scenes, and cancelled renders.

use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use crate::common::gather::gather;
use crate::common::gpu::{Gpu, assert_is_lit, demo_scene, plain_sum};
use camlux::{
    DeviceInfo, DeviceKind, Error, GatherKernel, Plan, Quirks, RenderOptions, Scene, Tracer,
    output::{Frame, Layer},
    scene::{Encoding, IndirectLight, Material, Mesh, Shadow, Shared, Texels, Texture, VplSum},
};

/// The device with lavapipe's limits. The limits of a real GPU may be too large for these tests.
fn small_device(gpu: &Gpu) -> DeviceInfo {
    let mut device = gpu.device.info().clone();
    device.limits.max_image_px = 16384;
    device.limits.max_allocation_bytes = 2 << 30;
    device.limits.max_storage_buffer_bytes = 128 << 20;
    device.limits.max_buffer_bytes = 2 << 30;
    device.limits.sub_pixel_bits = 8;
    device.quirks = Quirks::default();
    // A frame over the total memory would be reported first. The tests in `device_memory` cover that.
    device.limits.memory_bytes = 1 << 50;
    device
}

/// Asserts that the plan refuses the scene at once, and that the message has the limit, the requested value and a remedy.
#[track_caller]
fn assert_over_limit(gpu: &Gpu, scene: &Scene, says: &[&str], hint: &str) {
    let device = small_device(gpu);
    let start = Instant::now();
    let error = Plan::new(scene, &device).expect_err("that is too much");
    assert!(start.elapsed().as_secs_f64() < 0.5, "work was started");
    assert!(matches!(error, Error::DeviceLimit { .. }), "{error:?}");
    let message = error.to_string();
    for part in says.iter().chain(&["over the limit", &device.name, hint]) {
        assert!(message.contains(part), "{part:?} is missing in: {message}");
    }
}

fn with_rsm_size(rsm_size: u32) -> Scene {
    let mut scene = demo_scene("cornell", [8, 8]);
    scene.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, rsm_size));
    scene
}

const SMALLER_IMAGE: &str = "render a smaller image";
const SMALLER_RSM: &str = "set a smaller rsm_size";

#[test]
fn images_over_the_limits_are_refused_by_the_plan() {
    let gpu = Gpu::open();
    let wide = demo_scene("cornell", [20_000, 8]);
    assert_over_limit(&gpu, &wide, &["width", "20000", "16384"], SMALLER_IMAGE);
    let high = demo_scene("cornell", [8, 20_000]);
    assert_over_limit(&gpu, &high, &["height", "20000", "16384"], SMALLER_IMAGE);
    // 16384² pixels of 16 bytes are 4 GiB.
    let large = demo_scene("cornell", [16_384, 16_384]);
    let says = ["G-buffer positions (bytes)", "4294967296", "2147483648"];
    assert_over_limit(&gpu, &large, &says, SMALLER_IMAGE);
    // A list of 6000² pixels has 144 MB. Only the gather needs it.
    let mut listed = demo_scene("cornell", [6000, 6000]);
    let says = ["list of pixels (bytes)", "144000000", "134217728"];
    assert_over_limit(&gpu, &listed, &says, SMALLER_IMAGE);
    listed.indirect = None;
    assert!(Plan::new(&listed, &small_device(&gpu)).is_ok());
}

#[test]
fn reflective_shadow_maps_over_the_limits_are_refused_by_the_plan() {
    let gpu = Gpu::open();
    let says = ["rsm_size", "20000", "16384"];
    assert_over_limit(&gpu, &with_rsm_size(20_000), &says, SMALLER_RSM);
    // 6 · 8192² texels of 16 bytes are 6 GiB.
    let says = ["RSM positions (bytes)", "6442450944"];
    assert_over_limit(&gpu, &with_rsm_size(8192), &says, SMALLER_RSM);
    // 6 · 2048² texels are 25 M VPLs, 1024 per row.
    let says = ["VPLs, height (px)", "24576", "16384"];
    assert_over_limit(&gpu, &with_rsm_size(2048), &says, SMALLER_RSM);
    assert!(Plan::new(&with_rsm_size(1672), &small_device(&gpu)).is_ok());
    // The largest rsm_size of a scene must not cause an overflow.
    let says = ["rsm_size", "4294967295"];
    assert_over_limit(&gpu, &with_rsm_size(u32::MAX), &says, SMALLER_RSM);
}

#[test]
fn textures_over_the_limits_are_refused_by_the_plan() {
    let gpu = Gpu::open();
    let mut device = small_device(&gpu);
    let mut scene = demo_scene("textured", [8, 8]);
    scene.indirect = None;
    scene.direct.shadow = Some(Shadow::Rays);
    let wide = Texture {
        // Wider than the device's images, which is allowed because texels are stored in a list.
        size_px: [1 << 20, 1],
        texels: Texels::U8(vec![[128; 3]; 1 << 20], Encoding::Srgb),
        ..Texture::clone(&scene.textures[0])
    };
    scene.textures = vec![wide.into(); scene.textures.len()];
    assert_eq!(scene.textures.len(), 2);
    // 2 097 152 texels of one word (4 bytes) each.
    device.limits.max_allocation_bytes = 4 << 21;
    assert!(Plan::new(&scene, &device).is_ok());
    device.limits.max_allocation_bytes -= 1;
    let refused = Plan::new(&scene, &device).expect_err("that is too much");
    let message = refused.to_string();
    for part in [
        "textures (bytes) is 8388608, over",
        "scale the textures down",
    ] {
        assert!(message.contains(part), "{part:?} is missing in: {message}");
    }
}

#[test]
fn two_million_triangles_and_sixteen_textures_fit_2_gib() {
    let gpu = Gpu::open();
    let mut scene = demo_scene("textured", [640, 480]);
    let many = with_triangles(2_000_000).meshes;
    scene.meshes.extend(many.last().cloned());
    scene.indirect = Some(IndirectLight::final_gather(0.02));
    let texture: Shared<Texture> = Texture {
        name: "large".into(),
        size_px: [4096, 4096],
        texels: Texels::U8(vec![[128; 3]; 1 << 24], Encoding::Srgb),
    }
    .into();
    scene.textures = vec![texture; 16];
    // Only textures that a material uses are loaded.
    scene.materials.extend((0..16).map(|index| Material {
        kd_texture: Some(index.into()),
        ..Material::lambert("large", [0.5; 3])
    }));
    let mut device = gpu.device.info().clone();
    device.limits.memory_bytes = 2 << 30;
    Plan::new(&scene, &device).expect("it fits");
    // The textures alone take 1 GiB of this.
    device.limits.memory_bytes = 3 << 29;
    let refused = Plan::new(&scene, &device).expect_err("that is too little");
    println!("{refused}");
}

/// The demo room with added triangles, `count` in total.
fn with_triangles(count: usize) -> Scene {
    let mut scene = demo_scene("cornell", [8, 8]);
    scene.indirect = None;
    let few: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    let corners = [[0.0, 1.0, 0.0], [0.1, 1.0, 0.0], [0.0, 1.1, 0.0]];
    let many = vec![[0, 1, 2]; count - few];
    scene
        .meshes
        .push(Mesh::from_slices("many", &corners, &many, 0).into());
    scene
}

fn bounce_by_rays(rsm_size: u32) -> Option<IndirectLight> {
    Some(gather!(0.02, rsm_size = Some(rsm_size)))
}

/// Asserts that the plan refuses the scene, and accepts it after the change that the message suggests.
#[track_caller]
fn assert_refused(scene: &Scene, device: &DeviceInfo, parts: &[&str]) {
    let message = Plan::new(scene, device)
        .expect_err("that is too much")
        .to_string();
    for part in parts {
        assert!(message.contains(part), "{part:?} is missing in: {message}");
    }
    let mut without = scene.clone();
    if message.contains("shadow maps") {
        without.direct.shadow = Some(Shadow::Map);
    }
    if message.contains("instant-radiosity estimator") {
        without.indirect = Some(IndirectLight::vpl_sum(VplSum::InstantRadiosity, 8));
    }
    assert!(Plan::new(&without, device).is_ok());
}

#[test]
fn triangles_for_rays_over_the_limits_are_refused_by_the_plan() {
    let gpu = Gpu::open();
    let mut device = small_device(&gpu);
    device.limits.max_image_px = 1024;
    // Four texels per triangle, 1024 texels per row.
    let mut scene = with_triangles(262_144);
    scene.direct.shadow = Some(Shadow::Rays);
    assert!(Plan::new(&scene, &device).is_ok());
    let mut scene = with_triangles(262_145);
    let rows = "triangles for rays, height (px) is 1025, over the limit of 1024";
    scene.direct.shadow = Some(Shadow::Rays);
    let hint = "use shadow maps, simplify the meshes";
    assert_refused(&scene, &device, &[rows, hint]);
    scene.indirect = bounce_by_rays(8);
    let hint = "use shadow maps and the instant-radiosity estimator, simplify";
    assert_refused(&scene, &device, &[rows, hint]);
    scene.direct.shadow = Some(Shadow::Map);
    let hint = "use the instant-radiosity estimator, simplify the meshes";
    assert_refused(&scene, &device, &[rows, hint]);

    device.limits.max_image_px = 16_384;
    device.limits.max_allocation_bytes = 1 << 24;
    scene.direct.shadow = Some(Shadow::Rays);
    let message = Plan::new(&scene, &device).expect_err("that is too much");
    // The memory of images is counted in blocks of 4 × 4 pixels.
    let bytes = "triangles for rays (bytes) is 16842752, over the limit of 16777216";
    assert!(message.to_string().contains(bytes), "{message}");
}

#[test]
fn what_rays_hit_over_the_limits_is_refused_by_the_plan() {
    let gpu = Gpu::open();
    let mut device = small_device(&gpu);
    let mut scene = with_triangles(2000);
    scene.indirect = bounce_by_rays(8);
    device.limits.max_storage_images = 7;
    assert!(Plan::new(&scene, &device).is_ok());
    device.limits.max_storage_images = 6;
    let says = "the number of storage images that a kernel of final gathering reads is 7, over the limit of 6";
    assert_refused(
        &scene,
        &device,
        &[says, "use the instant-radiosity estimator"],
    );
    // Shadow rays do not need the hit surface.
    scene.direct.shadow = Some(Shadow::Rays);
    scene.indirect = None;
    assert!(Plan::new(&scene, &device).is_ok());
}

/// The VPLs of all lights are in one list.
#[test]
fn vpls_of_many_lights_over_the_limits_are_refused_by_the_plan() {
    let gpu = Gpu::open();
    let mut device = small_device(&gpu);
    let mut scene = demo_scene("cornell", [8, 8]);
    scene.direct.shadow = Some(Shadow::Rays);
    scene.indirect = Some(IndirectLight::vpl_sum(VplSum::InstantRadiosity, 32));
    // Six rows of 1024 VPLs per light.
    device.limits.max_image_px = 1024;
    scene.lights = vec![scene.lights[0].clone(); 170];
    assert!(Plan::new(&scene, &device).is_ok());
    scene.lights = vec![scene.lights[0].clone(); 171];
    let assert_refused = |scene: &Scene, device: &DeviceInfo, parts: &[&str]| {
        let message = Plan::new(scene, device).expect_err("that is too much");
        for part in parts {
            assert!(message.to_string().contains(part), "{part:?}: {message}");
        }
    };
    let hint = "set a smaller rsm_size, use fewer lights";
    let says = "VPLs, height (px) is 1026, over the limit of 1024";
    assert_refused(&scene, &device, &[says, hint]);
    device.limits.max_image_px = 16_384;
    device.limits.max_allocation_bytes = 1028 * 1024 * 3 * 16 - 1;
    let says = "VPLs (bytes) is 50528256, over";
    assert_refused(&scene, &device, &[says, hint]);
    device.limits.max_allocation_bytes += 1;
    assert!(Plan::new(&scene, &device).is_ok());
}

/// A GPU traces rays with its own units, or with a kernel; on the host's processor, the host does.
#[test]
fn each_device_has_its_tracer() {
    let gpu = Gpu::open();
    let mut scene = demo_scene("cornell", [8, 8]);
    scene.direct.shadow = Some(Shadow::Rays);
    let mut device = small_device(&gpu);
    for (kind, has_ray_query, tracer) in [
        (DeviceKind::Discrete, true, Tracer::Query),
        (DeviceKind::Discrete, false, Tracer::Kernel),
        (DeviceKind::Cpu, true, Tracer::Host),
        (DeviceKind::Cpu, false, Tracer::Host),
    ] {
        (device.kind, device.has_ray_query) = (kind, has_ray_query);
        let mut plan = Plan::new(&scene, &device).expect("the scene is valid");
        assert_eq!(plan.tracer, Some(tracer));
        let kernel = plan.trace_by(Tracer::Kernel, &device);
        kernel.expect("it runs anywhere");
        assert_eq!(plan.tracer, Some(Tracer::Kernel));
    }
    scene.direct.shadow = Some(Shadow::Map);
    scene.indirect = None;
    let plan = Plan::new(&scene, &device).expect("the scene is valid");
    assert_eq!(plan.tracer, None);
}

/// The renderer makes the plan first, so it allocates nothing.
#[test]
fn the_renderer_refuses_what_the_plan_refuses() {
    let mut gpu = Gpu::open();
    let too_wide = gpu.device.info().limits.max_image_px + 1;
    let start = Instant::now();
    let error = gpu
        .renderer
        .render(
            &demo_scene("cornell", [too_wide, 1]),
            &mut RenderOptions::default(),
        )
        .expect_err("that is too much");
    assert!(start.elapsed().as_secs_f64() < 0.5, "work was started");
    assert!(matches!(error, Error::DeviceLimit { .. }), "{error:?}");
}

/// A broadcast kernel gives a wrong image if the subgroup has another size.
#[test]
fn a_kernel_for_other_subgroups_is_refused() {
    let mut gpu = Gpu::open();
    let scene = demo_scene("cornell", [8, 8]);
    let device = gpu.device.info().clone();
    let mut refused = 0;
    for kernel in GatherKernel::ALL {
        let result = gpu.try_render_with(&scene, |options| options.gather_kernel = Some(kernel));
        if kernel.runs_on(&device) {
            assert!(result.is_ok());
        } else {
            let message = result.expect_err("it cannot run").to_string();
            assert!(message.contains(kernel.name()), "{message}");
            assert!(message.contains("lanes"), "{message}");
            refused += 1;
        }
    }
    assert!(refused > 0, "every kernel runs here");
    let mut scene = scene;
    scene.direct.shadow = Some(Shadow::Rays);
    for tracer in Tracer::ALL {
        let result = gpu.try_render_with(&scene, |options| options.tracer = Some(tracer));
        match tracer.runs_on(&device) {
            true => assert!(result.is_ok()),
            false => {
                let message = result.expect_err("it cannot run").to_string();
                let lack = match tracer {
                    Tracer::Query => "VK_KHR_ray_query",
                    _ => "the host's processor",
                };
                let says = message.contains(tracer.name()) && message.contains(lack);
                assert!(says, "{message}");
            }
        }
    }
}

/// Asserts that all layers of light are 0 in every pixel.
#[track_caller]
fn assert_black(what: &str, frame: &Frame) {
    for layer in [
        Layer::Radiance,
        Layer::Direct,
        Layer::Indirect,
        Layer::Energy,
    ] {
        let values = frame.values(layer).expect("the scene asks for all");
        assert!(
            values.iter().all(|&value| value == 0.0),
            "{what}: {layer:?}"
        );
    }
}

#[test]
fn scenes_without_light_in_view_render_black() {
    let mut gpu = Gpu::open();
    for estimator in VplSum::ALL {
        for name in ["cornell", "cornell_spot", "textured"] {
            let mut scene = demo_scene(name, [16, 16]);
            scene.indirect = Some(IndirectLight::vpl_sum(estimator, 8));
            let lit = gpu.render(&scene);
            assert_is_lit(&lit, Layer::Direct);
            assert_is_lit(&lit, Layer::Indirect);
            let mut render = |what: &str, change: &dyn Fn(&mut Scene)| {
                let mut scene = scene.clone();
                change(&mut scene);
                let frame = gpu.render(&scene);
                assert_black(&format!("{name}, {what}"), &frame);
                frame
            };
            let empty = render("no meshes", &|scene| scene.meshes.clear());
            assert_eq!(empty.stats.vpl_count, 0);
            let empty = render("empty meshes", &|scene| {
                scene.meshes = vec![Mesh::default().into(); 2];
            });
            assert_eq!(empty.ids(Layer::InstanceId), Some(&[0; 16 * 16][..]));
            let away = render("looking away", &|scene| {
                let camera = &mut scene.camera;
                camera.look_at_m = 2.0 * camera.position_m - camera.look_at_m;
            });
            assert_eq!(away.stats.pixel_vpl_pairs, 0);
            render("no power", &|scene| {
                for light in &mut scene.lights {
                    *light = light.with_emission([0.0; 3]).into();
                }
            });
        }
    }
}

/// An empty mesh changes only the ids of the meshes after it.
#[test]
fn an_empty_mesh_among_others_does_not_show() {
    let mut gpu = Gpu::open();
    let scene = plain_sum(demo_scene("glossy", [16, 16]), 32);
    let mut with_empty = scene.clone();
    with_empty.meshes.insert(1, Mesh::default().into());
    let [frame, other] = [&scene, &with_empty].map(|scene| gpu.render(scene));
    assert_is_lit(&frame, Layer::Radiance);
    assert!(frame.values(Layer::Radiance) == other.values(Layer::Radiance));
}

#[test]
fn a_cancelled_renderer_can_be_used_again() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("cornell", [48, 48]);
    scene.lights.push(scene.lights[0].clone());
    let fresh = gpu.render(&scene);
    assert_is_lit(&fresh, Layer::Indirect);
    // A render can be cancelled at each progress report, so collect them.
    let mut reports = Vec::new();
    let mut listen = |progress| {
        reports.push(progress);
        ControlFlow::Continue(())
    };
    let mut options = RenderOptions {
        progress: Some(&mut listen),
        // The size of a submission must not depend on the time of the last one.
        submission_target: Duration::MAX,
        ..RenderOptions::default()
    };
    for _ in 0..2 {
        gpu.renderer
            .render(&scene, &mut options)
            .expect("the scene renders");
    }
    assert_eq!(reports.len() % 2, 0);
    let (once, again) = reports.split_at(reports.len() / 2);
    assert_eq!(once, again, "options can be used again");
    assert!(once.len() >= 5, "{once:?}");
    assert!(once.is_sorted_by(|a, b| a.fraction <= b.fraction));
    assert_eq!(once.last().map(|progress| progress.fraction), Some(1.0));

    for last in 0..once.len() {
        let mut left = last;
        let mut stop = |_| match left {
            0 => ControlFlow::Break(()),
            _ => {
                left -= 1;
                ControlFlow::Continue(())
            }
        };
        let mut options = RenderOptions {
            progress: Some(&mut stop),
            submission_target: Duration::MAX,
            ..RenderOptions::default()
        };
        let error = gpu.renderer.render(&scene, &mut options);
        assert!(matches!(error, Err(Error::Cancelled)), "{error:?}");
        let frame = gpu.render(&scene);
        assert!(frame.layers == fresh.layers, "after {last} reports");
    }
}

/// A rasteriser that snaps corners to 1/16 pixel shows wrong triangles next to edges.
#[test]
fn where_the_rasteriser_is_coarse_rays_find_what_the_camera_sees() {
    let mut info = small_device(&Gpu::open());
    let scene = demo_scene("cornell", [64, 48]);
    let plan = |info: &DeviceInfo| Plan::new(&scene, info).expect("the scene is valid");
    info.limits.sub_pixel_bits = 8;
    assert!(!plan(&info).has_primary_rays);
    info.limits.sub_pixel_bits = 4;
    let by_rays = plan(&info);
    assert!(by_rays.has_primary_rays);
    assert!(by_rays.to_string().contains("primary_rays  64 x 48 px"));
    // Shading what rays hit needs more storage images than Vulkan guarantees.
    info.limits.max_storage_images = 4;
    assert!(!plan(&info).has_primary_rays);
}
