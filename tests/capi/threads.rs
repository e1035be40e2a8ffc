//! Eight threads share a device; each has its own renderer.

use crate::host::*;
use camlux::capi::*;

const THREADS: usize = 8;
const FRAMES: usize = 100;

/// Renders a scene that moves from frame to frame, so that frames keep different data for the next one.
fn frames(device: &Device, seed: usize) -> Vec<Vec<(i32, Vec<u32>)>> {
    let scene = fast_scene(16);
    let renderer = device.renderer();
    let frame = |number: usize| {
        let part = [CAMLUX_PART_CAMERA, CAMLUX_PART_LIGHT][number % 2];
        let shift = 0.01 * ((number + seed) % 7) as f64;
        let position_m = match part {
            CAMLUX_PART_CAMERA => [shift, 1.0, 3.2],
            _ => [shift, 1.8, 0.0],
        };
        let pose = init!(camlux_pose {
            position_m: position_m,
            orientation_xyzw: [1.0, 0.0, 0.0, 0.0],
        });
        ok(scene.set_pose(part, 0, &pose));
        renderer.render(&scene).layers()
    };
    (0..FRAMES).map(frame).collect()
}

#[test]
fn threads_with_a_renderer_each_get_the_images_of_one() {
    let device = Device::open();
    let alone: Vec<_> = (0..2).map(|seed| frames(&device, seed)).collect();
    assert!(alone[0] != alone[1]);
    std::thread::scope(|scope| {
        let (device, alone) = (&device, &alone);
        for thread in 0..THREADS {
            scope.spawn(move || {
                let seed = thread % 2;
                assert!(frames(device, seed) == alone[seed], "thread {thread}");
            });
        }
    });
}
/// A thread changes a scene while another renders it. Every frame shows one of the two states.
#[test]
fn a_scene_can_be_changed_while_it_is_rendered() {
    let device = Device::open();
    let scene = fast_scene(12);
    let light = |power: f64| {
        init!(camlux_light {
            position_m: [0.0, 1.5, 0.0],
            power_w: [power; 3],
        })
    };
    let set = |power| ok(scene.set_light(0, &light(power)));
    let renderer = device.renderer();
    let expected = [10.0, 20.0].map(|power| {
        set(power);
        renderer.render(&scene).layers()
    });
    let stop = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !stop.load(std::sync::atomic::Ordering::Relaxed) {
                set(10.0);
                set(20.0);
            }
        });
        for _ in 0..20 {
            if !expected.contains(&renderer.render(&scene).layers()) {
                stop.store(true, std::sync::atomic::Ordering::Relaxed);
                panic!("a frame of no scene");
            }
        }
        stop.store(true, std::sync::atomic::Ordering::Relaxed);
    });
}
