//! Wall-clock time of the first picture in a fresh container: no kernel has been compiled.

use std::{env, path::Path, process::Command, time::Instant};

use crate::{Failure, Spread, verdict};

const RUNS: usize = 5;
/// Most time over that of Mitsuba's first picture.
const BAR: f64 = 2.0;
/// Scenes, and sizes of their images.
const SCENES: [(&str, [&str; 2]); 3] = [
    ("cornell_spot", ["128", "128"]),
    ("glossy", ["128", "128"]),
    ("knot", ["160", "120"]),
];
const TARGET_ERROR: &str = "0.05";

pub fn report() -> Result<(), Failure> {
    println!(
        "first    whole process, nothing compiled before, {RUNS} runs in turn: camlux at a target error of {TARGET_ERROR}; Mitsuba with 64 samples"
    );
    println!(
        "{:<14} {:<10} {:>9} {:>9} {:>6}  bar",
        "scene", "pixels", "camlux s", "Mitsuba s", "ratio"
    );
    for (name, size) in SCENES {
        row(name, size)?;
    }
    Ok(())
}

fn row(name: &str, [width, height]: [&str; 2]) -> Result<(), Failure> {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = repository.join(format!("scenes/{name}.toml"));
    let (mut own, mut mitsuba) = (Vec::new(), Vec::new());
    for run in 0..=RUNS {
        let folder = tempfile::tempdir()?;
        let image = folder.path().join("first.exr");
        let mut camlux = Command::new(env!("CARGO_BIN_EXE_camlux"));
        camlux.arg("render").arg(&scene).arg("--output").arg(&image);
        camlux.args(["--size", width, height, "--target-error", TARGET_ERROR]);
        camlux.env("MESA_SHADER_CACHE_DISABLE", "true");
        let own_s = seconds_of(&mut camlux)?;
        let mut peer = Command::new(repository.join("benches/peers/run"));
        peer.arg("--scene").arg(&scene).arg("--first").arg(&image);
        // Its cache of kernels is in the home folder.
        peer.args(["--size", width, height])
            .env("HOME", folder.path());
        let its_s = seconds_of(&mut peer)?;
        // The first run fetches what is missing, and reads the programs from the disk.
        if run > 0 {
            own.push(own_s);
            mitsuba.push(its_s);
        }
    }
    let [own, mitsuba] = [own, mitsuba].map(|seconds| Spread::of(seconds).median);
    let ratio = own / mitsuba;
    println!(
        "{name:<14} {:<10} {own:>9.2} {mitsuba:>9.2} {ratio:>6.2}  ≤ {BAR:.1} {}",
        format!("{width} x {height}"),
        verdict(ratio <= BAR)
    );
    Ok(())
}

fn seconds_of(command: &mut Command) -> Result<f64, Failure> {
    let start = Instant::now();
    let output = command.output()?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into());
    }
    Ok(start.elapsed().as_secs_f64())
}
