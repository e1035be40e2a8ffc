mod gpu;
use gpu::*;
#[test]
fn smoke() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        let scene = demo_scene(name, [64, 64]);
        gpu.render(&scene);
    }
}
