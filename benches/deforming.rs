//! Frames of a mesh that changes its shape, with a refitted and with a rebuilt ray tree: `cargo bench --bench deforming`.
//!
//! The knot sways: 52 000 triangles, direct light by rays. camlux refits a tree as long as the triangles join the same vertices. If the
//! triangles are in the opposite order, the surface is the same, but camlux builds a new tree.

#[path = "shared/two_threads.rs"]
mod two_threads;

use std::{path::Path, process::ExitCode, time::Instant};

use camlux::glam::{DQuat, DVec3};
use camlux::scene::{Mesh, Shadow};
use camlux::{Device, DeviceOptions, RenderOptions, Renderer, Scene};
use two_threads::Failure;

const FRAMES: usize = 60;
const RESOLUTION_PX: [u32; 2] = [160, 120];
/// Largest turn of the knot at a height of 1 m from its middle.
const SWAY_RAD: f64 = 0.4;

/// What changes from frame to frame: label, whether the vertices move, whether the triangles change order.
const KINDS: [(&str, bool, bool); 3] = [
    ("nothing", false, false),
    ("vertices: refitted", true, false),
    ("vertices and order: built", true, true),
];

fn main() -> ExitCode {
    two_threads::run("deforming", report)
}

fn report() -> Result<(), Failure> {
    let device = Device::open(&DeviceOptions::default())?;
    let mut scene = Scene::load(Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/scenes/knot.toml"
    )))?;
    scene.camera.resolution_px = RESOLUTION_PX;
    scene.direct.shadow = Some(Shadow::Rays);
    scene.indirect = None;
    let rest = Mesh::clone(&scene.meshes[1]);
    println!("device   {}", device.info().name);
    println!(
        "{} triangles, {RESOLUTION_PX:?} pixels, median of {FRAMES} frames",
        rest.triangles.len()
    );
    println!("{:<32} {:>9}", "what changes", "ms");
    for (what, moves, reorders) in KINDS {
        let mut renderer = Renderer::new(&device)?;
        let mut times_ms = Vec::new();
        for frame in 0..FRAMES + 2 {
            if moves {
                scene.meshes[1].mesh = swayed(&rest, frame).into();
            }
            if reorders && frame % 2 == 1 {
                scene.meshes[1].mesh.triangles.reverse();
            }
            let start = Instant::now();
            let rendered = renderer.render(&scene, &mut RenderOptions::default())?;
            times_ms.push(start.elapsed().as_secs_f64() * 1e3);
            renderer.return_buffers(rendered);
        }
        // The first frames compile kernels.
        let mut times_ms = times_ms.split_off(2);
        times_ms.sort_by(f64::total_cmp);
        println!("{what:<32} {:>9.2}", times_ms[FRAMES / 2]);
    }
    Ok(())
}

/// The knot at a frame: turned about the vertical axis, in proportion to the height above its middle.
fn swayed(rest: &Mesh, frame: usize) -> Mesh {
    let mut mesh = rest.clone();
    let phase = (frame as f64 * 0.2).sin();
    for position_m in &mut mesh.positions_m {
        let height_m = position_m.y - 0.92;
        let turn = DQuat::from_axis_angle(DVec3::Y, SWAY_RAD * phase * height_m);
        *position_m = turn * *position_m;
    }
    mesh
}
