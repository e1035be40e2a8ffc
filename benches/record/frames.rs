//! The frames, and the yardstick for their times.

use std::{env, fs, path::Path, time::Instant};

use camlux::{
    Device, DeviceOptions, RenderOptions, Renderer, Scene, Tracer,
    internals::ray_probe::RayProbe,
    scene::{IndirectLight, VplSum},
};

use crate::{Failure, NO_YARDSTICK, native, rays::Rays, two_threads::DRIVER_THREADS};

/// Scenes, and the edge of their images in pixels. A frame takes a few seconds at most.
const SCENES: [(&str, u32); 4] = [
    ("cornell", 400),
    ("glossy", 200),
    ("cornell_spot", 400),
    ("knot", 64),
];
/// Target errors of each scene.
const TARGET_ERRORS: [f64; 2] = [0.05, 0.02];
/// Turns of all sides, after a warm-up frame.
const TURNS: usize = 3;
/// Edge of the image whose pixels are the origins of the rays for the ray kernel alone.
const RAYS_PX: u32 = 320;
/// The yardstick: texels along a face's edge, and the edge of the image. It takes about a tenth of a second.
const RSM_SIZE: u32 = 32;
const YARDSTICK_PX: u32 = 400;

pub fn report() -> Result<(), Failure> {
    let threads: usize = env::var(DRIVER_THREADS)?.parse()?;
    let device = Device::open(&DeviceOptions::default())?;
    let mut renderer = Renderer::new(&device)?;

    let mut scene = load("cornell")?;
    scene.camera.resolution_px = [YARDSTICK_PX; 2];
    let sum = VplSum::InstantRadiosity;
    scene.indirect = Some(IndirectLight::vpl_sum(sum, RSM_SIZE));
    let (_, kept) = renderer.render_with_intermediates(&scene, &mut RenderOptions::default())?;
    let work = native::Work::of(&kept, sum);
    let yardstick = work.opponent(threads).ok_or(NO_YARDSTICK)?;
    eprintln!(
        "yardstick: {:.3e} pairs, {} vectors of receivers in registers, {threads} threads",
        work.pairs(),
        yardstick.vectors
    );

    for (name, edge_px) in SCENES {
        let mut scene = load(name)?;
        scene.camera.resolution_px = [RAYS_PX; 2];
        let rays = Rays::of(&device, &scene)?;
        let probe = RayProbe::new(&device, &scene, Tracer::best_for(device.info()))?;
        scene.camera.resolution_px = [edge_px; 2];
        for asked in TARGET_ERRORS {
            scene.indirect = Some(IndirectLight::final_gather(asked));
            let (mut frame_s, mut yardstick_s, mut probe_s) =
                (f64::INFINITY, f64::INFINITY, f64::INFINITY);
            let mut stats = renderer
                .render(&scene, &mut RenderOptions::default())?
                .stats;
            let (mut frame_ticks, mut yardstick_ticks) = (0, 0);
            for _ in 0..TURNS {
                let ticks = cpu_ticks()?;
                let start = Instant::now();
                stats = renderer
                    .render(&scene, &mut RenderOptions::default())?
                    .stats;
                frame_s = frame_s.min(start.elapsed().as_secs_f64());
                let ticks_between = cpu_ticks()?;
                yardstick_s = yardstick_s.min(yardstick.run().0.as_secs_f64());
                frame_ticks += ticks_between - ticks;
                yardstick_ticks += cpu_ticks()? - ticks_between;
                let any = probe.any_hit(&rays.points, &rays.ends)?;
                let closest = probe.closest_hit(&rays.points, &rays.directions)?;
                probe_s = probe_s.min(1e-3 * (any.milliseconds + closest.milliseconds));
            }
            let probe_rate = (rays.ends.len() + rays.directions.len()) as f64 / probe_s;
            println!(
                "{name} {edge_px} px {} %,{:.3},{:.3},{:.4},{},{:.6}",
                100.0 * asked,
                frame_s / yardstick_s,
                frame_ticks as f64 / yardstick_ticks as f64,
                stats.ray_count as f64 / frame_s / probe_rate,
                stats.ray_count,
                stats.estimated_error.unwrap_or(f64::NAN),
            );
        }
    }
    Ok(())
}

/// CPU time of all threads of this process, including ended ones, in hundredths of a second.
fn cpu_ticks() -> Result<u64, Failure> {
    let text = fs::read_to_string("/proc/self/stat")?;
    // The name of the program may contain anything, so count after it: utime and stime are fields 14 and 15.
    let (_, fields) = text.rsplit_once(')').unwrap_or_default();
    let times = fields.split_whitespace().skip(11).take(2);
    let times = times.map(str::parse::<u64>);
    Ok(times.sum::<Result<u64, _>>()?)
}

fn load(name: &str) -> Result<Scene, Failure> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    Ok(Scene::load(&folder.join(format!("{name}.toml")))?)
}
