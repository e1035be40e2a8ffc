//! The data that a renderer keeps between frames changes no image, and saves the passes whose input has not changed.

use std::thread;

use crate::common::gather::gather;
use crate::common::gpu::{Gpu, assert_is_lit, demo_scene, plain_sum};
use crate::common::instances::{crowd, slabs};
use camlux::{
    Device, DeviceOptions, Error, RenderOptions, Renderer, Scene,
    glam::{DAffine3, DVec3},
    output::{Frame, Layer, StopReason, TofQuantity},
    scene::{IndirectLight, Light, Mesh, RsmAverage, SensorNoise, Shadow, Shared, VplSum},
};

fn final_gather(mut scene: Scene) -> Scene {
    scene.indirect = Some(gather!(0.2, rsm_size = Some(16)));
    scene
}

fn refined(mut scene: Scene) -> Scene {
    scene.indirect = Some(IndirectLight::RsmAverage(RsmAverage {
        rsm_size: 16,
        interpolation_error: Some(0.05),
    }));
    scene
}

/// The prediction scales gathering passes with the rays that more pixels, less error or a limit need, accurate to a factor of 2. It scales
/// the other passes with the pixels. (`cargo bench --bench bound` compares times, also of previews and of small limits.)
#[test]
fn the_time_of_a_frame_is_foretold_by_the_last_one() {
    let mut gpu = Gpu::open();
    for name in ["glossy", "knot"] {
        let scene_of = |size: u32, target: f64, limit: Option<u64>| {
            let mut scene = demo_scene(name, [size, size]);
            scene.indirect = Some(gather!(target, max_rays = limit));
            scene
        };
        let first = scene_of(128, 0.03, None);
        assert_eq!(gpu.renderer.foretell_ms(&first), None);
        let stats = gpu.render(&first).stats;
        let [gather_ms, other_ms] = [true, false].map(|gathers| -> f64 {
            let is_gather = |name: &str| {
                ["trace", "light_rays"].contains(&name) || name.starts_with("final_gather")
            };
            let passes = stats.passes.iter();
            let passes = passes.filter(|pass| is_gather(pass.name) == gathers);
            passes.map(|pass| pass.milliseconds).sum()
        });
        let foretold_ms = gpu.renderer.foretell_ms(&first).expect("it was rendered");
        assert!((foretold_ms / (gather_ms + other_ms) - 1.0).abs() < 1e-9);
        let others = [
            (64, 0.03, None),
            (256, 0.03, None),
            (128, 0.015, None),
            (128, 0.01, Some(8_000_000)),
        ];
        let foretold = others.map(|(size, target_error, limit)| {
            let scene = scene_of(size, target_error, limit);
            let foretold_ms = gpu.renderer.foretell_ms(&scene).expect("it is alike");
            let pixels = f64::from(size * size) / (128.0 * 128.0);
            (scene, (foretold_ms - other_ms * pixels) / gather_ms)
        });
        for (scene, foretold) in foretold {
            let grown = gpu.render(&scene).stats.ray_count as f64 / stats.ray_count as f64;
            println!("{name}: foretold {foretold:.2}, grown by {grown:.2}");
            assert!((0.5..=2.0).contains(&(foretold / grown)));
        }
        let mut other = demo_scene(name, [128, 128]);
        other.lights.push(other.lights[0].clone());
        assert_eq!(gpu.renderer.foretell_ms(&other), None);
        gpu = Gpu::open();
    }
}

fn two_lights(mut scene: Scene) -> Scene {
    let mut second = scene.lights[0].clone();
    shift(&mut second, DVec3::new(-0.1, -0.2, 0.05));
    scene.lights.push(second);
    scene
}

fn shift(light: &mut Light, by_m: DVec3) {
    match light.position_m_mut() {
        Some(position_m) => *position_m += by_m,
        None => *light.direction_mut().expect("parallel light has one") += by_m,
    }
}

fn brighten(light: &mut Light) {
    let [r, g, b] = light.emission();
    *light = light.with_emission([r, 1.5 * g, b]);
}

type Change = fn(&mut Scene);

/// Successive changes. Each keeps part of the previous frame's data and invalidates part.
fn changes() -> Vec<(&'static str, Change)> {
    vec![
        ("nothing", |_| {}),
        ("camera", |scene| {
            scene.camera.position_m += DVec3::new(0.05, -0.03, 0.02);
        }),
        ("light", |scene| {
            shift(&mut scene.lights[0], DVec3::new(0.1, -0.05, 0.02));
        }),
        ("power", |scene| brighten(&mut scene.lights[0])),
        ("last light", |scene| {
            let last = scene.lights.len() - 1;
            shift(&mut scene.lights[last], DVec3::new(0.0, -0.1, 0.1));
        }),
        ("material", |scene| scene.materials[0].kd = [0.1, 0.7, 0.3]),
        ("power and material", |scene| {
            brighten(&mut scene.lights[0]);
            scene.materials[0].kd = [0.3, 0.2, 0.6];
        }),
        ("mesh", |scene| {
            for position_m in &mut scene.meshes[0].positions_m {
                *position_m *= 0.95;
            }
        }),
        ("mesh put back by another of the same values", |scene| {
            let mesh = scene.meshes[0].clone();
            scene.meshes[0] = camlux::scene::Mesh::clone(&mesh).into();
        }),
        ("resolution", |scene| {
            scene.camera.resolution_px = [20, 12];
        }),
        ("shadows", |scene| {
            scene.direct.shadow = match scene.direct.shadow {
                Some(Shadow::Map) => Some(Shadow::Rays),
                _ => Some(Shadow::Map),
            };
        }),
        ("another light", |scene| {
            let mut light = scene.lights[0].clone();
            shift(&mut light, DVec3::new(0.05, -0.1, -0.1));
            scene.lights.push(light);
        }),
        ("no indirect light", |scene| scene.indirect = None),
        ("indirect light again", |scene| {
            scene.indirect = Some(IndirectLight::vpl_sum(VplSum::InstantRadiosity, 8));
        }),
        ("no sensor", |scene| scene.sensor = None),
        ("camera and light", |scene| {
            scene.camera.position_m += DVec3::new(-0.02, 0.03, 0.0);
            shift(&mut scene.lights[0], DVec3::new(0.0, -0.02, 0.03));
        }),
    ]
}

fn assert_same(what: &str, frame: &Frame, other: &Frame) {
    assert_eq!(frame.layers.len(), other.layers.len(), "{what}");
    for ((layer, data), (other_layer, other_data)) in frame.layers.iter().zip(&other.layers) {
        assert_eq!(layer, other_layer, "{what}");
        assert!(data == other_data, "{what}: {}", layer.name());
    }
    assert_eq!(frame.stats.vpl_count, other.stats.vpl_count, "{what}");
    assert_eq!(frame.stats.ray_count, other.stats.ray_count, "{what}");
    let errors = [frame, other].map(|frame| frame.stats.estimated_error);
    assert_eq!(errors[0], errors[1], "{what}");
}

fn scenes() -> [Scene; 4] {
    [
        final_gather(demo_scene("glossy", [24, 24])),
        final_gather(two_lights(demo_scene("textured", [16, 16]))),
        plain_sum(two_lights(demo_scene("cornell", [16, 16])), 16),
        refined(two_lights(demo_scene("cornell_spot", [200, 200]))),
    ]
}

/// Memory from a driver may hold anything.
#[test]
fn what_new_memory_holds_does_not_show() {
    let mut poisoned = Gpu::open();
    for mut scene in scenes() {
        for shadow in [Shadow::Map, Shadow::Rays] {
            scene.direct.shadow = Some(shadow);
            // A device of its own, so that no memory holds earlier data.
            let mut plain =
                Renderer::new(&Device::open(&DeviceOptions::default()).expect("a device"))
                    .expect("a renderer");
            let frame = plain.render(&scene, &mut Default::default());
            assert_same(
                "new memory",
                &poisoned.render(&scene),
                &frame.expect("it renders"),
            );
        }
    }
}

#[test]
fn what_is_kept_does_not_show() {
    let mut gpu = Gpu::open();
    for scene in scenes() {
        assert_changes_leave_nothing(&mut gpu, scene, &changes());
    }
}

/// Renders as hosts do: if nothing has changed, the frame comes back.
fn repeated(gpu: &mut Gpu, scene: &Scene, seed: u32) -> Frame {
    let mut options = RenderOptions {
        repeat_unchanged: true,
        seed,
        ..Default::default()
    };
    let frame = gpu.renderer.render(scene, &mut options);
    frame.expect("it renders")
}

#[test]
fn a_frame_of_which_nothing_has_changed_comes_back() {
    let mut gpu = Gpu::open();
    let mut scene = final_gather(demo_scene("tof_corner", [32, 24]));
    if let Some(tof) = &mut scene.tof {
        tof.noise = Some(SensorNoise {
            seed: 1,
            dark_e_per_s: 0.0,
            read_noise_e: 10.0,
            full_well_e: 1e5,
            gain_dn_per_e: 1.0,
            black_level_dn: 0.0,
            bits: 12,
            ..SensorNoise::DEFAULT
        });
    }
    let first = repeated(&mut gpu, &scene, 0);
    let again = repeated(&mut gpu, &scene, 0);
    assert!(!first.stats.passes.is_empty() && first.stats.submissions > 0);
    assert!(again.stats.passes.is_empty() && again.stats.submissions == 0);
    let of = |frame: &Frame, layer| frame.values(layer).expect("it is there").to_vec();
    assert_eq!(of(&again, Layer::Indirect), of(&first, Layer::Indirect));
    assert_eq!(again.stats.estimated_error, first.stats.estimated_error);
    // It is the next one, and its sensor has noise of its own.
    let indices = [&first, &again].map(|frame| frame.description.key.index);
    assert_eq!(indices, [0, 1]);
    let range = Layer::Tof(0, TofQuantity::Range);
    assert_ne!(of(&again, range), of(&first, range));
    // Others are drawn: with another seed, after preparing, and to be measured.
    assert!(!repeated(&mut gpu, &scene, 1).stats.passes.is_empty());
    gpu.renderer.prepare(&scene).expect("it is prepared");
    assert!(repeated(&mut gpu, &scene, 1).stats.passes.is_empty());
    assert!(!gpu.render_seeded(&scene, 1).stats.passes.is_empty());
    // What a limit of time has cut short may become better.
    scene.indirect = Some(gather!(0.002, rsm_size = Some(16), max_ms = Some(1.0)));
    for _ in 0..2 {
        let frame = repeated(&mut gpu, &scene, 0);
        assert_eq!(frame.stats.stop, Some(StopReason::BudgetSpent));
        assert!(!frame.stats.passes.is_empty());
    }
}

#[test]
fn a_frame_that_would_come_back_may_be_cancelled() {
    let mut gpu = Gpu::open();
    let scene = final_gather(demo_scene("cornell", [16, 16]));
    let whole = repeated(&mut gpu, &scene, 0);
    for keep_partial in [true, false] {
        let mut stop = |_| std::ops::ControlFlow::Break(());
        let mut options = RenderOptions {
            progress: Some(&mut stop),
            repeat_unchanged: true,
            keep_partial,
            ..Default::default()
        };
        match (gpu.renderer.render(&scene, &mut options), keep_partial) {
            (Ok(frame), true) => assert_same("complete", &frame, &whole),
            (Err(Error::Cancelled), false) => {}
            (other, _) => panic!("{other:?}"),
        }
    }
    assert_same("after it", &repeated(&mut gpu, &scene, 0), &whole);
}

/// Applies the changes one after another and compares each frame with that of a renderer that has kept nothing.
fn assert_changes_leave_nothing(gpu: &mut Gpu, mut scene: Scene, changes: &[(&str, Change)]) {
    let mut anew = Renderer::new(&gpu.device).expect("a renderer");
    for (what, change) in changes {
        change(&mut scene);
        let frame = repeated(gpu, &scene, 0);
        assert_is_lit(&frame, Layer::Direct);
        let again = repeated(gpu, &scene, 0);
        assert!(again.stats.passes.is_empty(), "{what}");
        assert_same(what, &again, &frame);
        // Keeps only its pipelines.
        anew.forget();
        let other = anew.render(&scene, &mut Default::default());
        assert_same(what, &frame, &other.expect("it renders"));
    }
}

/// Instances move, appear and disappear, with rays and with maps. For maps, each instance has a copy of its mesh.
#[test]
fn what_is_kept_of_instances_does_not_show() {
    let move_last: Change = |scene| {
        let last = scene.meshes.last_mut().expect("instances");
        last.to_world.translation += DVec3::new(0.05, 0.02, -0.03);
    };
    let changes: [(&str, Change); 11] = [
        ("nothing", |_| {}),
        ("moved", move_last),
        ("turned and smaller", |scene| {
            let turn = DAffine3::from_rotation_y(0.4) * DAffine3::from_scale(DVec3::splat(0.9));
            scene.meshes[1].to_world *= turn;
        }),
        ("light", |scene| {
            shift(&mut scene.lights[0], DVec3::new(0.03, -0.02, 0.0));
        }),
        ("removed", |scene| {
            scene.meshes.remove(2);
        }),
        ("added", |scene| {
            let mut again = scene.meshes[1].clone();
            again.to_world.translation.x += 0.3;
            scene.meshes.push(again);
        }),
        ("deformed", |scene| {
            let before = scene.meshes[1].mesh.clone();
            let mut deformed = Mesh::clone(&before);
            deformed
                .positions_m
                .iter_mut()
                .for_each(|at_m| at_m.y *= 1.1);
            let deformed = Shared::from(deformed);
            for instance in scene.meshes.iter_mut().filter(|i| i.mesh.ptr_eq(&before)) {
                instance.mesh = deformed.clone();
            }
        }),
        ("material", |scene| scene.materials[0].kd = [0.1, 0.7, 0.3]),
        ("by maps", |scene| {
            scene.indirect = None;
            scene.direct.shadow = Some(Shadow::Map);
        }),
        ("moved by maps", move_last),
        ("by rays", |scene| scene.direct.shadow = Some(Shadow::Rays)),
    ];
    let scene = final_gather(crowd([24, 24]));
    assert_changes_leave_nothing(&mut Gpu::open(), scene, &changes);
}

/// A ray tree is refitted or rebuilt. Of two coincident surfaces, a ray hits the same one, whatever its path through the tree.
#[test]
fn what_is_kept_of_meshes_that_change_their_shape_does_not_show() {
    let bend: Change = |scene| {
        for mesh in scene.meshes.iter_mut().skip(2) {
            for at_m in &mut mesh.positions_m {
                at_m.x += 0.03 * (3.0 * at_m.y).sin();
            }
        }
    };
    let changes: [(&str, Change); 8] = [
        ("nothing", |_| {}),
        ("bent", bend),
        ("bent again", bend),
        ("as flat as before", |scene| {
            scene.meshes[2]
                .positions_m
                .iter_mut()
                .for_each(|at_m| at_m.x = 0.2);
        }),
        ("triangles in the opposite order", |scene| {
            scene.meshes[3].triangles.reverse();
        }),
        ("bent in that order", bend),
        ("removed", |scene| {
            scene.meshes.remove(1);
        }),
        ("bent after that", |scene| {
            scene.meshes[1]
                .positions_m
                .iter_mut()
                .for_each(|at_m| at_m.z *= 1.02);
        }),
    ];
    let mut scene = slabs([24, 24]).flattened();
    let mut twin = Mesh::clone(&scene.meshes[2]);
    twin.triangle_materials.fill(1);
    scene.meshes.push(twin.into());
    let scene = final_gather(scene);
    assert_changes_leave_nothing(&mut Gpu::open(), scene, &changes);
}

fn passes(frame: &Frame) -> Vec<&'static str> {
    frame.stats.passes.iter().map(|pass| pass.name).collect()
}

#[test]
fn a_moved_camera_draws_no_maps_and_lists_no_vpls() {
    let scene = plain_sum(two_lights(demo_scene("cornell", [16, 16])), 16);
    let mut gpu = Gpu::open();
    let first = gpu.render(&scene);
    assert!(passes(&first).contains(&"rsm") && passes(&first).contains(&"vpl"));
    let mut moved = scene.clone();
    moved.camera.position_m += DVec3::new(0.05, -0.03, 0.02);
    let second = gpu.render(&moved);
    for pass in ["rsm", "vpl", "shadow"] {
        assert!(!passes(&second).contains(&pass), "{pass}");
    }
    assert_eq!(first.stats.vpl_count, second.stats.vpl_count);
    assert!(first.values(Layer::Indirect) != second.values(Layer::Indirect));
    // A light that moves needs new maps.
    shift(&mut moved.lights[0], DVec3::new(0.1, -0.05, 0.02));
    assert!(passes(&gpu.render(&moved)).contains(&"rsm"));
}

#[test]
fn two_lights_that_do_not_change_draw_no_maps() {
    for shadow in [Shadow::Map, Shadow::Rays] {
        let mut scene = plain_sum(two_lights(demo_scene("cornell", [16, 16])), 16);
        scene.direct.shadow = Some(shadow);
        let mut gpu = Gpu::open();
        gpu.render(&scene);
        let unchanged = gpu.render(&scene);
        for pass in ["rsm", "vpl", "shadow"] {
            assert!(!passes(&unchanged).contains(&pass), "{pass}");
        }
        shift(&mut scene.lights[1], DVec3::new(0.1, -0.05, 0.02));
        let moved = gpu.render(&scene);
        for pass in ["rsm", "vpl"] {
            assert!(passes(&moved).contains(&pass), "{pass}");
        }
        let mut anew = Renderer::new(&gpu.device).expect("a renderer");
        let other = anew.render(&scene, &mut Default::default());
        assert_same("second light", &moved, &other.expect("it renders"));
    }
}

#[test]
fn a_brighter_light_draws_no_maps() {
    let scene = plain_sum(two_lights(demo_scene("cornell", [16, 16])), 16);
    let mut gpu = Gpu::open();
    let first = gpu.render(&scene);
    let mut brighter = scene.clone();
    brighten(&mut brighter.lights[0]);
    let second = gpu.render(&brighter);
    assert!(passes(&second).contains(&"vpl"));
    for pass in ["rsm", "shadow"] {
        assert!(!passes(&second).contains(&pass), "{pass}");
    }
    assert!(first.values(Layer::Indirect) != second.values(Layer::Indirect));
}

/// Final gathering samples its VPLs again for each gather.
#[test]
fn final_gathering_draws_no_maps() {
    let mut gpu = Gpu::open();
    let frame = gpu.render(&final_gather(two_lights(demo_scene("cornell", [16, 16]))));
    assert!(passes(&frame).contains(&"light_rays"));
    for pass in ["rsm", "vpl", "shadow"] {
        assert!(!passes(&frame).contains(&pass), "{pass}");
    }
}

#[test]
fn a_frame_in_reused_buffers_is_the_same() {
    // The box leaves much background, which values of other frames must not fill.
    let mut scene = demo_scene("cornell", [24, 16]);
    let mut gpu = Gpu::open();
    for shift_m in [0.0, 1.5, -1.5, 30.0] {
        scene.camera.position_m.x = shift_m;
        let frame = gpu.render(&scene);
        let mut anew = Renderer::new(&gpu.device).expect("a renderer");
        let other = anew.render(&scene, &mut Default::default());
        assert_same("reused", &frame, &other.expect("it renders"));
        gpu.renderer.return_buffers(frame);
        // Another shape with the same number of pixels.
        if shift_m < 0.0 {
            scene.camera.resolution_px = [16, 24];
        }
    }
}

#[test]
fn a_cancelled_frame_does_not_show_in_the_next() {
    let mut gpu = Gpu::open();
    let scene = final_gather(demo_scene("cornell", [16, 16]));
    let whole = gpu.render(&scene);
    assert_is_lit(&whole, Layer::Indirect);
    let mut moved = scene.clone();
    shift(&mut moved.lights[0], DVec3::new(0.1, -0.05, 0.02));
    for stop_at in 0.. {
        let mut reports = 0;
        let mut stop = |_| {
            reports += 1;
            if reports > stop_at {
                std::ops::ControlFlow::Break(())
            } else {
                std::ops::ControlFlow::Continue(())
            }
        };
        let options = &mut camlux::RenderOptions {
            progress: Some(&mut stop),
            ..Default::default()
        };
        let is_done = gpu.renderer.render(&moved, options).is_ok();
        assert_same("after a cancelled frame", &gpu.render(&scene), &whole);
        if is_done {
            assert!(stop_at > 2, "there was nothing to cancel");
            break;
        }
    }
}

#[test]
fn a_change_of_a_shared_value_does_not_reach_the_others() {
    let first = Shared::from(vec![1]);
    let mut second = first.clone();
    assert!(first.ptr_eq(&second));
    second.push(2);
    assert_eq!((&*first, &*second), (&vec![1], &vec![1, 2]));
    assert!(!first.ptr_eq(&second));
}

/// Renderers that find the surfaces of a scene on their device, while others change theirs.
#[test]
fn what_renderers_share_does_not_show() {
    const THREADS: usize = 3;
    const FRAMES: usize = 12;
    let mut gpu = Gpu::open();
    for base in [crowd([24, 24]), demo_scene("textured", [24, 24])] {
        // Some frames are alike, others differ in a pose, a colour or both.
        let scene_of = |frame: usize| {
            let mut scene = final_gather(base.clone());
            let turn = DAffine3::from_rotation_y(0.1 * (frame / 2 % 3) as f64);
            scene.meshes[1].to_world *= turn;
            scene.materials[0].kd = [0.3 + 0.2 * (frame / THREADS % 2) as f64; 3];
            scene
        };
        let alone: Vec<Frame> = (0..FRAMES)
            .map(|frame| gpu.render_seeded(&scene_of(frame), frame as u32))
            .collect();
        gpu.renderer.forget();
        let device = &gpu.device;
        let frames_of = |thread: usize| -> Vec<(usize, Frame)> {
            let mut renderer = Renderer::new(device).expect("a renderer");
            let frames = (thread..FRAMES).step_by(THREADS);
            let rendered = frames.map(|frame| {
                let mut options = RenderOptions {
                    seed: frame as u32,
                    ..RenderOptions::default()
                };
                let rendered = renderer.render(&scene_of(frame), &mut options);
                (frame, rendered.expect("a frame"))
            });
            rendered.collect()
        };
        thread::scope(|scope| {
            let threads = (0..THREADS).map(|thread| scope.spawn(move || frames_of(thread)));
            let threads: Vec<_> = threads.collect();
            for thread in threads {
                for (frame, rendered) in thread.join().expect("frames") {
                    assert_same(&format!("frame {frame}"), &rendered, &alone[frame]);
                }
            }
        });
    }
}
