//! Runs of `camlux batch` that are killed, damaged or split into shards still give the same data set, byte for byte.
#![cfg(feature = "cli")]

use std::fs;
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::jobs::{JOB, JOB_FRAMES, Jobs, files_below};
use crate::rows::assert_says;

/// The number of rendered frames that a run reports.
fn rendered(stderr: &str) -> usize {
    let (_, count) = stderr.split_once("rendered ").unwrap_or(("", "0 "));
    count.split_once(' ').unwrap().0.parse().unwrap()
}

#[test]
fn what_is_missing_or_damaged_is_rendered_again() {
    let jobs = Jobs::new(JOB);
    jobs.succeed("set", &[]);
    let hashes = jobs.hashes("set");
    let again = |count: usize| {
        let stderr = jobs.succeed("set", &[]);
        assert_eq!(rendered(&stderr), count, "{stderr}");
        assert_eq!(jobs.hashes("set"), hashes);
    };
    again(0);
    fs::remove_file(jobs.path("set/frames/000003.exr")).unwrap();
    again(1);

    // Flip one bit of a pixel, and empty another file.
    let mut bytes = jobs.read("set/frames/000005.exr");
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(jobs.path("set/frames/000005.exr"), &bytes).unwrap();
    fs::write(jobs.path("set/frames/000006.exr"), "").unwrap();
    again(2);

    // Cut off the last line of the manifest, then its second half.
    let manifest = jobs.read("set/manifest.jsonl");
    let line_end = manifest.iter().rposition(|&b| b == b'{').unwrap();
    fs::write(jobs.path("set/manifest.jsonl"), &manifest[..line_end]).unwrap();
    again(1);
    fs::write(
        jobs.path("set/manifest.jsonl"),
        &manifest[..manifest.len() / 2],
    )
    .unwrap();
    let stderr = jobs.succeed("set", &[]);
    assert!((5..=7).contains(&rendered(&stderr)), "{stderr}");
    assert_eq!(jobs.hashes("set"), hashes);
    fs::remove_file(jobs.path("set/manifest.jsonl")).unwrap();
    again(JOB_FRAMES);

    // A new seed moves the light, so every frame changes. The unfinished file of an earlier run is removed.
    fs::write(jobs.path("set/frames/.000002.exr.1-7.part"), "half").unwrap();
    jobs.write("job.toml", &JOB.replace("seed = 3", "seed = 4"));
    assert_eq!(rendered(&jobs.succeed("set", &[])), JOB_FRAMES);
    assert_eq!(files_below(&jobs.path("set")).len(), JOB_FRAMES + 2);
    assert_ne!(jobs.hashes("set"), hashes);
}

#[test]
fn shards_merge_into_what_one_run_makes() {
    let jobs = Jobs::new(JOB);
    jobs.succeed("whole", &["--queue", "0"]);
    for shard in ["1/4", "4/4", "2/4"] {
        assert_eq!(rendered(&jobs.succeed("shared", &["--shard", shard])), 3);
    }
    let stderr = jobs.fail("shared", &["--merge"]);
    assert_says(&stderr, &["3 frames are missing or damaged: 2, 6, 10"]);
    // As if rendered on another machine.
    jobs.succeed("far", &["--shard", "3/4"]);
    fs::copy(
        jobs.path("far/manifest-3-of-4.jsonl"),
        jobs.path("shared/manifest-3-of-4.jsonl"),
    )
    .unwrap();
    for frame in ["000002", "000006", "000010"] {
        let name = |set: &str| jobs.path(&format!("{set}/frames/{frame}.exr"));
        fs::copy(name("far"), name("shared")).unwrap();
    }
    fs::remove_file(jobs.path("shared/dataset.json")).unwrap();
    let stderr = jobs.succeed("shared", &["--merge"]);
    assert_eq!(
        jobs.read("shared/dataset.json"),
        jobs.read("whole/dataset.json")
    );
    assert_says(&stderr, &["merged 12 of 12 frames from 4 shards"]);
    assert_eq!(jobs.hashes("shared"), jobs.hashes("whole"));
    assert_eq!(rendered(&jobs.succeed("shared", &[])), 0);
    assert_eq!(rendered(&jobs.succeed("shared", &["--shard", "2/4"])), 0);

    fs::write(jobs.path("shared/frames/000004.exr"), "damaged").unwrap();
    let stderr = jobs.fail("shared", &["--merge"]);
    assert_says(&stderr, &["1 frame is missing or damaged: 4"]);
}

#[test]
fn a_range_leaves_the_others_alone() {
    let jobs = Jobs::new(JOB);
    assert_eq!(rendered(&jobs.succeed("set", &["--frames", "2..5"])), 3);
    assert_eq!(rendered(&jobs.succeed("set", &["--frames", "4..12"])), 7);
    let stderr = jobs.fail("set", &["--frames", "4..100"]);
    let says = "--frames 4..100: the job has 12 frames; end at 12 at most";
    assert!(stderr.contains(says), "{stderr}");
    let there: Vec<u64> = jobs.hashes("set").into_keys().collect();
    assert_eq!(there, (2..12).collect::<Vec<_>>());
    assert_eq!(rendered(&jobs.succeed("set", &[])), 2);
    let both = ["--frames", "0..8", "--shard", "2/3"];
    assert_eq!(rendered(&jobs.succeed("other", &both)), 3);
}

/// Kills a run at each of these times after its start, then lets one run finish.
fn kill_and_finish(moments: &[Duration]) {
    let jobs = Jobs::new(JOB);
    jobs.succeed("whole", &[]);
    for &moment in moments {
        let mut child = jobs.start("set", &[]);
        sleep(moment);
        child.kill().unwrap();
        child.wait().unwrap();
        if let Ok(entries) = fs::read_dir(jobs.path("set/frames")) {
            for path in entries.map(|entry| entry.unwrap().path()) {
                let name = path.file_name().unwrap().to_str().unwrap();
                if !name.starts_with('.') {
                    let number: usize = name[..6].parse().unwrap();
                    let whole = jobs.read(&format!("whole/frames/{number:06}.exr"));
                    assert!(
                        fs::read(&path).unwrap() == whole,
                        "{name} has its final name"
                    );
                }
            }
        }
    }
    jobs.succeed("set", &[]);
    assert_eq!(jobs.hashes("set"), jobs.hashes("whole"));
    // Shards share dataset.json, so no run removes its unfinished files: another shard may be writing one.
    let mut files = files_below(&jobs.path("set"));
    files.retain(|name| !name.starts_with(".dataset.json."));
    assert_eq!(files, files_below(&jobs.path("whole")));
}

/// Different times within the duration of an undisturbed run.
fn moments(count: u32) -> Vec<Duration> {
    let jobs = Jobs::new(JOB);
    let start = Instant::now();
    jobs.succeed("set", &[]);
    let whole = start.elapsed();
    // The golden ratio spreads them. The clock shifts them for each run of the test.
    let shift = f64::from(start.elapsed().subsec_nanos()) * 1e-9;
    let share = |i: u32| (shift + f64::from(i) * 0.618_033_988_749_895).fract();
    (0..count).map(|i| whole.mul_f64(share(i))).collect()
}

#[test]
fn killed_runs_end_in_the_same_data_set() {
    kill_and_finish(&moments(4));
}

#[test]
#[ignore = "long"]
fn runs_killed_at_twenty_moments_end_in_the_same_data_set() {
    for moment in moments(20) {
        kill_and_finish(&[moment]);
    }
}

/// SIGTERM, like Ctrl-C, ends a run after the current frame and leaves a consistent data set.
#[cfg(unix)]
#[test]
fn a_signal_ends_a_run_in_order() {
    // More frames than a run can render before the signal.
    let job = JOB.replace("seed = 3", "seed = 3\nframes = 100000");
    let jobs = Jobs::new(&job);
    let mut child = jobs.start("set", &[]);
    let deadline = Instant::now() + Duration::from_secs(60);
    while !jobs.path("set/frames/000001.exr").exists() {
        assert!(Instant::now() < deadline && child.try_wait().unwrap().is_none());
        sleep(Duration::from_millis(5));
    }
    let stderr = jobs.fail("set", &[]);
    let says = "set/manifest.jsonl: another run uses it";
    assert!(stderr.contains(says), "{stderr}");
    // A shard has a manifest of its own.
    jobs.succeed("set", &["--frames", "0..1", "--shard", "1/2"]);
    let pid = child.id().to_string();
    let signal = Command::new("kill").args(["-TERM", &pid]).status().unwrap();
    assert!(signal.success());
    assert_eq!(child.wait().unwrap().code(), Some(1));
    let count = jobs.hashes("set").len();
    let files = files_below(&jobs.path("set"));
    assert_eq!(
        files.len(),
        // dataset.json and two manifests.
        count + 3,
        "each file has a line, none is unfinished"
    );
    let more = (count + 2).to_string();
    let stderr = jobs.succeed("set", &["--frames", &format!("0..{more}")]);
    assert_eq!(rendered(&stderr), 2, "{stderr}");
}

/// A limit on the size of files stands in for a full file system.
#[cfg(unix)]
#[test]
fn a_full_disk_is_one_clear_error() {
    let jobs = Jobs::new(&JOB.replace("seed = 3", "seed = 3\ncompression = \"none\""));
    // dataset.json and the manifest fit, frames of 20 KB do not. If SIGXFSZ were not ignored, it would end the program.
    let program = env!("CARGO_BIN_EXE_camlux");
    let script = format!("trap '' XFSZ; ulimit -f 8; exec {program} batch job.toml -o set");
    let output = Command::new("bash")
        .args(["-c", &script])
        .current_dir(jobs.folder.path())
        .output()
        .unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert_eq!(stderr.matches("camlux: error: ").count(), 1, "{stderr}");
    assert_says(&stderr, &["cannot write", "free space"]);
    assert_eq!(
        files_below(&jobs.path("set")),
        ["dataset.json", "manifest.jsonl"]
    );
    jobs.succeed("set", &[]);
    jobs.succeed("whole", &[]);
    assert_eq!(jobs.hashes("set"), jobs.hashes("whole"));
}

/// A process's anonymous resident memory in KiB, and its number of open files.
#[cfg(target_os = "linux")]
fn held(pid: u32) -> (f64, usize) {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
    let (_, rest) = status.split_once("RssAnon:").unwrap();
    let resident_kib = rest.split_whitespace().next().unwrap().parse().unwrap();
    let files = fs::read_dir(format!("/proc/{pid}/fd")).unwrap().count();
    (resident_kib, files)
}

#[cfg(target_os = "linux")]
#[test]
fn memory_and_open_files_stay_over_two_thousand_frames() {
    let job = r#"
        [job]
        scene = "scene.toml"
        frames = 2050
        size = [64, 64]
        [camera]
        random = { min = [-1, -1, 2], max = [1, 1, 3], look_at = [0, 0, 0] }
        [[light]]
        index = 0
        power_factor_range = [0.5, 2.0]
    "#;
    let jobs = Jobs::new(job);
    let mut command = jobs.command("set", &[]);
    // The validation layer allocates memory of its own.
    command.env_remove("VK_INSTANCE_LAYERS");
    // With a heap for each thread, memory would grow slowly.
    command.env("MALLOC_ARENA_MAX", "1");
    let mut child = command.stderr(std::process::Stdio::null()).spawn().unwrap();
    // The maximum over 40 frames: both figures go up and down within a frame.
    let mut most_after = |frame: usize| {
        let mut most = (0.0_f64, 0);
        for next in frame..frame + 40 {
            while !jobs.path(&format!("set/frames/{next:06}.exr")).exists() {
                assert!(child.try_wait().unwrap().is_none(), "{next}");
                sleep(Duration::from_millis(2));
            }
            let (resident_kib, files) = held(child.id());
            most = (most.0.max(resident_kib), most.1.max(files));
        }
        most
    };
    // NVIDIA's driver fills its caches in the first thousand frames.
    let (early, late) = (most_after(1000), most_after(2000));
    println!("KiB and open files after 1000 frames: {early:?}, after 2000: {late:?}");
    assert!((late.0 / early.0 - 1.0).abs() < 0.02);
    // A reading may miss files that are open only briefly: the frame's file and its folder.
    assert!(early.1.abs_diff(late.1) <= 2);
    assert!(child.wait().unwrap().success());
}
