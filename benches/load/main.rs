//! Time and memory of loading a mesh of a million triangles from each format: `cargo bench --bench load`.
//!
//! - Seconds by the clock and of CPU time, median of three. CPU time does not count other work of the machine.
//! - The most memory that is allocated at a time, relative to what the loaded mesh takes.
//! - The same times for trimesh, in turn with camlux, if `CAMLUX_PYTHON` names a Python that has it. Its process starts once, and only the call
//!   of `trimesh.load` counts.

mod files;
mod peer;

use std::{error::Error, fs, path::Path, time::Instant};

use camlux::Scene;
use camlux::scene::Mesh;
use files::Surface;
use peak_alloc::PeakAlloc;
use peer::Trimesh;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

type Failure = Box<dyn Error>;

const TURNS: usize = 3;
const SCENE: &str = "[camera]
resolution = [8, 6]
position = [0, 0, 5]
look_at = [0, 0, 0]
up = [0, 1, 0]
fov_y_deg = 50
[[light]]
kind = \"point\"
position = [0, 5, 5]
power_w = 50
[material.clay]
kd = 0.5
[[mesh]]
material = \"clay\"
path = ";

/// Seconds of one load.
#[derive(Clone, Copy)]
struct Times {
    clock_s: f64,
    cpu_s: f64,
}

struct Load {
    times: Times,
    peak_bytes: usize,
    mesh_bytes: usize,
}

fn main() -> Result<(), Failure> {
    let folder = tempfile::tempdir()?;
    let surface = Surface::bumpy_sphere(500, 1000);
    let triangles = surface.triangles.len();
    let names = files::write_all(&surface, folder.path())?;
    drop(surface);
    let mut trimesh = Trimesh::start()?;
    match &trimesh {
        Some(trimesh) => println!("compared with trimesh {}", trimesh.version),
        None => println!("not compared: CAMLUX_PYTHON names no Python with trimesh"),
    }
    println!("{triangles} triangles, medians of {TURNS} loads; s by the clock, and of CPU time");
    println!(
        "{:<18} {:>6} {:>12} {:>12} {:>17} {:>16} {:>12}",
        "file", "MB", "camlux", "CPU", "memory over mesh", "trimesh    CPU", "CPU ratio"
    );
    for name in names {
        let file = folder.path().join(name);
        let megabytes = fs::metadata(&file)?.len() as f64 / 1e6;
        let (mut own, mut others) = (Vec::new(), Vec::new());
        let mut memory = 0.0_f64;
        for _ in 0..TURNS {
            let load = load(&file, triangles)?;
            memory = memory.max(load.peak_bytes as f64 / load.mesh_bytes as f64);
            own.push(load.times);
            if let Some(trimesh) = &mut trimesh {
                others.push(trimesh.load(&file, triangles)?);
            }
        }
        let own = median(own);
        print!(
            "{name:<18} {megabytes:>6.0} {:>12.2} {:>12.2} {memory:>17.2}",
            own.clock_s, own.cpu_s
        );
        if !others.is_empty() {
            let other = median(others);
            let ratio = own.cpu_s / other.cpu_s;
            print!(" {:>9.2} {:>6.2} {ratio:>12.2}", other.clock_s, other.cpu_s);
        }
        println!();
    }
    Ok(())
}

fn load(file: &Path, triangles: usize) -> Result<Load, Failure> {
    let text = format!("{SCENE}{:?}\n", file.display().to_string());
    let before_bytes = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let (start, cpu_start_s) = (Instant::now(), cpu_s()?);
    let scene = Scene::parse(&text, &file.with_file_name("scene.toml"))?;
    let times = Times {
        clock_s: start.elapsed().as_secs_f64(),
        cpu_s: cpu_s()? - cpu_start_s,
    };
    let peak_bytes = ALLOCATOR.peak_usage().saturating_sub(before_bytes);
    let meshes = scene.meshes.iter().map(|instance| &*instance.mesh);
    let found: usize = meshes.clone().map(|mesh| mesh.triangles.len()).sum();
    if found != triangles {
        return Err(format!("{}: {found} triangles", file.display()).into());
    }
    Ok(Load {
        times,
        peak_bytes,
        mesh_bytes: meshes.map(bytes).sum(),
    })
}

/// What a mesh takes in memory.
fn bytes(mesh: &Mesh) -> usize {
    let Mesh {
        name,
        positions_m,
        normals,
        texcoords,
        texcoords_1,
        colors,
        tangents,
        triangles,
        triangle_materials,
    } = mesh;
    name.len()
        + size_of_val(&positions_m[..])
        + size_of_val(&normals[..])
        + size_of_val(&texcoords[..])
        + size_of_val(&texcoords_1[..])
        + size_of_val(&colors[..])
        + size_of_val(&tangents[..])
        + size_of_val(&triangles[..])
        + size_of_val(&triangle_materials[..])
}

/// CPU time of this thread, which loads alone.
fn cpu_s() -> Result<f64, Failure> {
    let text = fs::read_to_string("/proc/thread-self/schedstat")?;
    let running_ns = text.split(' ').next().unwrap_or_default();
    Ok(running_ns.parse::<f64>()? * 1e-9)
}

fn median(mut loads: Vec<Times>) -> Times {
    let middle = loads.len() / 2;
    let mut median = |value: fn(&Times) -> f64| {
        loads.sort_by(|a, b| value(a).total_cmp(&value(b)));
        value(&loads[middle])
    };
    Times {
        clock_s: median(|load| load.clock_s),
        cpu_s: median(|load| load.cpu_s),
    }
}
