//! Frames of many cameras with one layer: `cargo bench --bench cameras -- [SCENE.toml...] [WIDTHpx] [Nframes]`.
//!
//! Renders each scene from a row of cameras, one after the other and with frames in flight, and prints frames a second and the time of a frame over that of its passes.
//! Without scenes, those of the list.

#[path = "shared/scenes.rs"]
mod scenes;
#[path = "shared/two_threads.rs"]
mod two_threads;

use std::{env, path::PathBuf, time::Instant};

use camlux::{
    Device, DeviceOptions, RenderOptions, Renderer, Scene, glam::DVec3, output::Layer,
    scene::Camera,
};
use two_threads::Failure;

const SCENES: [&str; 3] = ["textured", "glossy", "knot"];

fn main() -> std::process::ExitCode {
    two_threads::run("cameras", report)
}

fn report() -> Result<(), Failure> {
    let (mut scenes, mut width_px, mut frames) = (Vec::new(), 800, 40);
    for word in env::args().skip(1).filter(|word| !word.starts_with('-')) {
        let number = |unit| word.strip_suffix(unit).map(str::parse::<u32>);
        match (number("px"), number("frames")) {
            (Some(Ok(px)), _) => width_px = px,
            (_, Some(Ok(count))) => frames = count,
            _ => scenes.push(PathBuf::from(word)),
        }
    }
    let device = Device::open(&DeviceOptions::default())?;
    println!(
        "{:<14} {:>11} {:>10} {:>16} {:>16} {:>16}",
        "scene", "px", "passes, ms", "one by one, 1/s", "in flight, 1/s", "frame / passes"
    );
    for path in scenes::given_or(scenes, &SCENES) {
        let mut scene = Scene::load(&path)?;
        let [width, height] = scene.camera.resolution_px;
        scene.camera = scene.camera.resized([width_px, height * width_px / width]);
        let cameras: Vec<Camera> = (0..frames).map(|i| moved(&scene.camera, i)).collect();
        let mut renderer = Renderer::new(&device)?;
        let options = || RenderOptions {
            layers: Some(&[Layer::Radiance]),
            ..RenderOptions::default()
        };
        // Compiles, and makes what frames keep.
        let all = |renderer: &mut Renderer, cameras: &[Camera]| {
            let frames = renderer.render_cameras(&scene, cameras, &mut options());
            frames.map_err(|(_, error)| error)
        };
        all(&mut renderer, &cameras[..cameras.len().min(8)])?;
        let start = Instant::now();
        let mut passes_ms = 0.0;
        for camera in &cameras {
            let scene = Scene {
                camera: *camera,
                ..scene.clone()
            };
            let frame = renderer.render(&scene, &mut options())?;
            passes_ms += frame.stats.gpu_milliseconds();
            renderer.return_buffers(frame);
        }
        let one_by_one_s = start.elapsed().as_secs_f64();
        let start = Instant::now();
        for cameras in cameras.chunks(8) {
            all(&mut renderer, cameras)?;
        }
        let in_flight_s = start.elapsed().as_secs_f64();
        let count = f64::from(frames);
        println!(
            "{:<14} {:>11} {:>10.1} {:>16.2} {:>16.2} {:>16.2}",
            path.file_stem().unwrap_or_default().to_string_lossy(),
            scene
                .camera
                .resolution_px
                .map(|px| px.to_string())
                .join(" × "),
            passes_ms / count,
            count / one_by_one_s,
            count / in_flight_s,
            1e3 * in_flight_s / passes_ms
        );
    }
    Ok(())
}

/// The camera a little to the side, and farther with each number.
fn moved(camera: &Camera, number: u32) -> Camera {
    let aside = (camera.look_at_m - camera.position_m).cross(camera.up);
    let step: DVec3 = 0.002 * f64::from(1 + number) * aside;
    Camera {
        position_m: camera.position_m + step,
        look_at_m: camera.look_at_m + step,
        ..*camera
    }
}
