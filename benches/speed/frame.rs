//! Wall-clock time of the whole program.

use std::{env, fs, path::Path, process::Command, time::Instant};

use camlux::scene::VplSum;

use crate::{Failure, Spread, verdict};

/// Runs of each row, after one that fills the driver's shader cache.
const RUNS: usize = 7;
const BAR_S: f64 = 1.0;

pub fn report() -> Result<(), Failure> {
    println!(
        "frame    camlux render scenes/cornell.toml, 800 x 800 px, OpenEXR written; whole process, {RUNS} runs, shader cache warm"
    );
    println!(
        "{:<18} {:<12} {:>6} {:>9} {:>7} {:>7}  bar",
        "estimator", "RSM texels", "VPLs", "median s", "min s", "max s"
    );
    // 32² texels per face are 6 144 texels; those that see a surface are VPLs. 52² texels per face give 6 050 VPLs.
    for rsm_size in [32, 52] {
        for estimator in VplSum::ALL {
            row(estimator, rsm_size)?;
        }
    }
    println!(
        "CamSim (OpenGL on llvmpipe, 6 050 VPLs, Lambert): 25.1 s, measured once on another 2-core machine, not in this run."
    );
    Ok(())
}

fn row(estimator: VplSum, rsm_size: u32) -> Result<(), Failure> {
    let folder = tempfile::tempdir()?;
    let stats = folder.path().join("stats.json");
    let mut command = Command::new(env!("CARGO_BIN_EXE_camlux"));
    command
        .arg("render")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.toml"))
        .args(["--size", "800", "800", "--estimator", estimator.name()])
        .args(["--rsm-size", &rsm_size.to_string()])
        .arg("--output")
        .arg(folder.path().join("frame.exr"))
        .arg("--stats")
        .arg(&stats);
    let mut seconds = Vec::new();
    for run in 0..=RUNS {
        let start = Instant::now();
        let output = command.output()?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into());
        }
        if run > 0 {
            seconds.push(start.elapsed().as_secs_f64());
        }
    }
    let stats: serde_json::Value = serde_json::from_str(&fs::read_to_string(&stats)?)?;
    let Spread { median, min, max } = Spread::of(seconds);
    println!(
        "{:<18} {:<12} {:>6} {median:>9.3} {min:>7.3} {max:>7.3}  ≤ {BAR_S:.1} s {}",
        estimator.name(),
        format!("6 x {rsm_size}²"),
        stats["vpl_count"],
        verdict(median <= BAR_S),
    );
    Ok(())
}
