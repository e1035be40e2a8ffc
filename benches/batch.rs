//! Frames per second of `camlux batch`, of the same without overlap, and of a loop of `camlux render`. The scene is the Cornell box at
//! 320 × 240 with a moving camera. The three alternate, and the best round of each counts. First, the bench measures each compression.
//!
//! CAMLUX_BATCH_FRAMES (default 240) and CAMLUX_BATCH_ROUNDS (default 2) set the length of the bench.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::time::Instant;

/// Renders in the loop. A few are enough, because each takes the same time.
const LOOP_RENDERS: u32 = 12;
/// Frames for each compression.
const PACKED_FRAMES: u32 = 24;

fn main() {
    let frames = number("CAMLUX_BATCH_FRAMES", 240);
    let rounds = number("CAMLUX_BATCH_ROUNDS", 2);
    let folder = tempfile::tempdir().expect("a folder");
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for name in ["cornell.obj", "cornell.mtl"] {
        fs::copy(scenes.join(name), folder.path().join(name)).expect("a copy");
    }
    let text = fs::read_to_string(scenes.join("cornell.toml")).expect("the scene");
    let (direct, _) = text.split_once("[indirect]").expect("indirect light");
    for (name, scene) in [
        ("direct light only", direct.to_owned()),
        (
            "interpolation error 0.02",
            format!("{text}\ninterpolation_error = 0.02\n"),
        ),
        ("sum at every pixel", text.clone()),
    ] {
        fs::write(folder.path().join("scene.toml"), scene).expect("a scene");
        println!("{name}");
        if name != "sum at every pixel" {
            for compression in ["none", "rle", "zips", "zip", "piz"] {
                measure_packing(compression, folder.path(), rounds);
            }
        }
        write_job(folder.path(), frames, DEFAULT);
        measure(folder.path(), frames, rounds);
    }
}

fn number(variable: &str, default: u32) -> u32 {
    let value = std::env::var(variable).ok();
    value.map_or(default, |text| text.parse().expect("a whole number"))
}

/// The default compression of a job.
const DEFAULT: &str = "rle";

fn write_job(folder: &Path, frames: u32, compression: &str) {
    let last = frames.max(2) - 1;
    let job = format!(
        "[job]\nscene = \"scene.toml\"\nsize = [320, 240]\nframes = {frames}\ncompression = \"{compression}\"\n\
         [camera]\nkeyframes = [\n\
         {{ frame = 0, position = [-0.6, 1.0, 3.2], look_at = [0.0, 1.0, 0.0] }},\n\
         {{ frame = {last}, position = [0.6, 1.2, 2.8], look_at = [0.0, 1.0, 0.0] }},\n]\n"
    );
    fs::write(folder.join("job.toml"), job).expect("a job");
}

fn measure_packing(compression: &str, folder: &Path, rounds: u32) {
    write_job(folder, PACKED_FRAMES, compression);
    let (mut rate, mut packing_ms) = (0.0_f64, f64::INFINITY);
    let mut megabytes = 0.0;
    for _ in 0..rounds {
        rate = rate.max(timed(PACKED_FRAMES, || {
            batch(folder, "2");
        }));
        let mut share = 0.0;
        let in_turn = timed(PACKED_FRAMES, || {
            let said = batch(folder, "0");
            share = 0.01 * number_before(&said, " %");
            megabytes = number_before(&said, " MB") / f64::from(PACKED_FRAMES);
        });
        packing_ms = packing_ms.min(1e3 * share / in_turn);
    }
    println!(
        "    {compression}: packing and writing {packing_ms:.0} ms, {megabytes:.1} MB a frame; {rate:.1} frames/s"
    );
}

/// The number before the last occurrence of this unit.
fn number_before(said: &str, unit: &str) -> f64 {
    let (before, _) = said.rsplit_once(unit).expect("the unit");
    let (_, number) = before.rsplit_once(' ').expect("a number");
    number.parse().expect("a number")
}

fn measure(folder: &Path, frames: u32, rounds: u32) {
    let mut best = [0.0_f64; 3];
    let mut said = String::new();
    for _ in 0..rounds {
        let overlapping = timed(frames, || {
            said = batch(folder, "2");
        });
        let in_turn = timed(frames, || {
            batch(folder, "0");
        });
        let looped = timed(LOOP_RENDERS, || {
            for _ in 0..LOOP_RENDERS {
                let size = ["--size", "320", "240", "-o", "a.exr"];
                run(folder, &[&["render", "scene.toml"], &size[..]].concat());
            }
        });
        for (best, rate) in best.iter_mut().zip([overlapping, in_turn, looped]) {
            *best = best.max(rate);
        }
    }
    let [overlapping, in_turn, looped] = best;
    println!(
        "    batch {overlapping:.2} frames/s; without overlap {in_turn:.2} ({:.2}x); loop of camlux render {looped:.2} ({:.2}x)\n    {said}",
        overlapping / in_turn,
        overlapping / looped,
    );
}

/// Frames per second, including the start of the program.
fn timed(frames: u32, work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    f64::from(frames) / start.elapsed().as_secs_f64()
}

/// Runs `camlux batch` and returns its last line.
fn batch(folder: &Path, queue: &str) -> String {
    let _ = fs::remove_dir_all(folder.join("set"));
    let output = run(
        folder,
        &["batch", "job.toml", "-o", "set", "--queue", queue],
    );
    let stderr = String::from_utf8_lossy(&output.stderr);
    stderr.lines().last().unwrap_or_default().to_owned()
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_camlux"));
    let output = command.args(arguments).current_dir(folder).output();
    let output = output.expect("the program");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    output
}
