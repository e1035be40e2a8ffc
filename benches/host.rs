//! What the host does in a frame beside its passes: `cargo bench --bench host -- [SCENE.toml...] [TRACER] [WIDTHpx] [direct]`.
//!
//! Renders each scene again and again with the same renderer and prints the frame with the median time of the host: its wall time, the time of its passes, how often the host
//! waited for the device, and what it did meanwhile, step by step. Without scenes, those of the list. TRACER is `host`, `query` or `kernel`;
//! rays that the host traces are waits, too. `direct` is direct light alone.

#[path = "shared/scenes.rs"]
mod scenes;
#[path = "shared/two_threads.rs"]
mod two_threads;

use std::{env, path::PathBuf};

use camlux::{
    Device, DeviceOptions, RenderOptions, Renderer, Scene, Tracer,
    output::{FrameStats, PassTime},
};
use two_threads::Failure;

const SCENES: [&str; 5] = ["cornell_spot", "glossy", "textured", "knot", "tof_corner"];
/// Frames of a scene. The first one is not counted.
const FRAMES: u32 = 6;

fn main() -> std::process::ExitCode {
    two_threads::run("host", report)
}

fn report() -> Result<(), Failure> {
    let (mut scenes, mut tracer, mut width_px, mut is_direct) = (Vec::new(), None, None, false);
    for word in env::args().skip(1).filter(|word| !word.starts_with('-')) {
        let mut tracers = Tracer::ALL.into_iter();
        let named = tracers.find(|tracer| tracer.name() == word);
        match (named, word.strip_suffix("px").map(str::parse)) {
            (Some(named), _) => tracer = Some(named),
            (_, Some(Ok(px))) => width_px = Some(px),
            _ if word == "direct" => is_direct = true,
            _ => scenes.push(PathBuf::from(word)),
        }
    }
    let device = Device::open(&DeviceOptions::default())?;
    println!(
        "{:<14} {:>11} {:>8} {:>10} {:>8} {:>6} {:>8}  host by step, ms",
        "scene", "px", "wall, ms", "passes, ms", "host, ms", "waits", "M rays"
    );
    for path in scenes::given_or(scenes, &SCENES) {
        let mut scene = Scene::load(&path)?;
        if let Some(width_px) = width_px {
            let [width, height] = scene.camera.resolution_px;
            scene.camera = scene.camera.resized([width_px, height * width_px / width]);
        }
        scene.indirect = scene.indirect.filter(|_| !is_direct);
        let mut renderer = Renderer::new(&device)?;
        let mut frames = Vec::new();
        for _ in 0..FRAMES {
            let mut options = RenderOptions {
                tracer: tracer.filter(|_| !is_direct),
                ..RenderOptions::default()
            };
            let frame = renderer.render(&scene, &mut options)?;
            frames.push(frame.stats.clone());
            renderer.return_buffers(frame);
        }
        frames.remove(0);
        frames.sort_by(|a, b| sum_ms(&a.host_steps).total_cmp(&sum_ms(&b.host_steps)));
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        print_row(&name, scene.camera.resolution_px, &frames[frames.len() / 2]);
    }
    Ok(())
}

fn print_row(name: &str, [width, height]: [u32; 2], stats: &FrameStats) {
    let steps = stats.host_steps.iter();
    let steps: Vec<String> = steps
        .map(|step| format!("{} {:.1}", step.name, step.milliseconds))
        .collect();
    println!(
        "{name:<14} {:>11} {:>8.0} {:>10.0} {:>8.1} {:>6} {:>8.2}  {}",
        format!("{width} × {height}"),
        stats.wall_milliseconds,
        stats.gpu_milliseconds(),
        sum_ms(&stats.host_steps),
        stats.submissions,
        stats.ray_count as f64 * 1e-6,
        steps.join(", ")
    );
}

fn sum_ms(times: &[PassTime]) -> f64 {
    times.iter().map(|time| time.milliseconds).sum()
}
