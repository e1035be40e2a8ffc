//! Time of a call of the C interface: `cargo bench --bench setters`. The fastest round counts, because other programs use the machine, too.

use std::{hint::black_box, ptr::null_mut, time::Instant};

use camlux::capi::*;

const CALLS: u32 = 100_000;
const ROUNDS: u32 = 9;

type Setter<'s> = (&'static str, Box<dyn Fn() -> camlux_status + 's>);

fn least_ns(call: impl Fn() -> camlux_status) -> f64 {
    let round = |_| {
        let start = Instant::now();
        for _ in 0..CALLS {
            assert_eq!(black_box(call()), CAMLUX_OK);
        }
        start.elapsed().as_secs_f64() * 1e9 / f64::from(CALLS)
    };
    (0..ROUNDS).map(round).fold(f64::INFINITY, f64::min)
}

fn main() {
    let mut scene = null_mut();
    let camera = camlux_camera::default();
    let pose = camlux_pose::default();
    let light = camlux_light {
        power_w: [1.0; 3],
        ..Default::default()
    };
    let material = camlux_material::default();
    let mesh = camlux_mesh::default();
    let indirect = camlux_indirect::default();
    // SAFETY: here and below, pointers to structs of the right size; a null index pointer is allowed.
    let ready = unsafe {
        [
            camlux_scene_create(&mut scene),
            camlux_scene_add_light(scene, &light, null_mut()),
            camlux_scene_add_material(scene, &material, null_mut()),
            camlux_scene_add_mesh(scene, &mesh, null_mut()),
            camlux_scene_add_instance(scene, 0, &pose, null_mut()),
        ]
    };
    assert_eq!(ready, [CAMLUX_OK; 5]);
    // SAFETY: as above, for each of them.
    let setters: [Setter; 7] = unsafe {
        [
            (
                "set_camera",
                Box::new(|| camlux_scene_set_camera(scene, &camera)),
            ),
            (
                "set_indirect",
                Box::new(|| camlux_scene_set_indirect(scene, &indirect)),
            ),
            (
                "set_light",
                Box::new(|| camlux_scene_set_light(scene, 0, &light)),
            ),
            (
                "set_material",
                Box::new(|| camlux_scene_set_material(scene, 0, &material)),
            ),
            (
                "set_pose camera",
                Box::new(|| camlux_scene_set_pose(scene, CAMLUX_PART_CAMERA, 0, &pose)),
            ),
            (
                "set_pose light",
                Box::new(|| camlux_scene_set_pose(scene, CAMLUX_PART_LIGHT, 0, &pose)),
            ),
            (
                "set_pose instance",
                Box::new(|| camlux_scene_set_pose(scene, CAMLUX_PART_INSTANCE, 0, &pose)),
            ),
        ]
    };
    for (name, setter) in setters {
        println!("{name:20} {:6.0} ns", least_ns(setter));
    }
    assert_eq!(camlux_scene_release(scene), CAMLUX_OK);
}
