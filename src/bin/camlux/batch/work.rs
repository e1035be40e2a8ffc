//! Renders frames and writes them. Other threads pack and write finished frames while the next ones render.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use camlux::output::{Frame, StopReason};
use camlux::{Device, DeviceInfo, DeviceKind, DeviceOptions, Error, Plan};
use serde_json::json;

use super::engine::{Engine, EngineDevice};
use super::files;
use super::frames::{Frames, Planned};
use super::job::Job;
use super::manifest::Journal;
use super::progress::FrameProgress;
use crate::progress::is_interrupted;
use crate::{Failure, counted, tell};

/// Options of the work.
#[derive(Clone, Copy)]
pub struct WorkOptions<'o> {
    pub folder: &'o Path,
    pub device: &'o DeviceOptions,
    /// Number of frames that may wait to be written; 0: each frame is written before the next one renders.
    pub queue: usize,
    pub fail_fast: bool,
}

/// The result of the work.
#[derive(Default)]
pub struct Done {
    pub written: u64,
    pub failed: u64,
    /// Frames that are probably not meant that way; the manifest says why.
    pub warned: u64,
    pub bytes: u64,
    pub gpu: Duration,
    /// Time of rendering, and of packing and writing. Because they overlap, the sum may exceed the wall time.
    pub rendering: Duration,
    pub writing: Duration,
    /// Whether all frames were processed. False if a signal or a failed frame ended the work early.
    pub is_whole: bool,
}

/// A rendered frame that waits to be written.
struct Rendered {
    planned: Planned,
    frame: Result<Frame, Error>,
    time: Duration,
}

/// Number of frames that render at a time.
pub fn frames_in_flight(frames: &Frames, indices: &[u64], device: &DeviceInfo) -> usize {
    let keeps_surfaces = !frames.job.changes.moves_surfaces();
    let of_scene = |scene| {
        indices
            .iter()
            .find(|&&index| frames.scene_index(index) == scene)
    };
    let first_of_scenes = (0..frames.scenes.len()).filter_map(of_scene);
    let of_scenes = first_of_scenes.filter_map(|&index| {
        let scene = frames.plan(index).begin.scene();
        // A scene that has no plan fails when it is rendered.
        let plan = Plan::new(&scene, device).ok()?;
        Some(plan.frames_in_flight(&scene, device, keeps_surfaces))
    });
    of_scenes.min().unwrap_or(1).min(indices.len())
}

/// Threads that pack and write frames. On a CPU driver, more would take the cores from it.
fn writers(device: &DeviceInfo) -> usize {
    let cores = thread::available_parallelism().map_or(1, usize::from);
    match device.kind {
        DeviceKind::Cpu => 1,
        _ => (cores / 4).clamp(1, 4),
    }
}

/// Renders these frames.
///
/// # Errors
/// If files cannot be written, or if no device can be opened. Nothing else ends the work early.
pub fn render(
    frames: &Frames,
    indices: &[u64],
    journal: Journal,
    options: WorkOptions,
) -> Result<(Done, Journal), Failure> {
    let device = Device::open(options.device)?;
    let in_flight = match options.queue {
        0 => 1,
        _ => frames_in_flight(frames, indices, device.info()),
    };
    let writers = writers(device.info());
    let device = EngineDevice::new(device, options.device);
    let engines = (0..in_flight).map(|_| Engine::on(&device));
    let engines = engines.collect::<Result<Vec<_>, Error>>()?;
    drop(device);
    render_by(engines, writers, frames, indices, journal, options)
}

/// Renders frames; each engine renders one at a time, and each writer writes one.
fn render_by(
    engines: Vec<Engine>,
    writers: usize,
    frames: &Frames,
    indices: &[u64],
    journal: Journal,
    options: WorkOptions,
) -> Result<(Done, Journal), Failure> {
    let device = engines.first().map(|engine| engine.device_info().name);
    let record = Record {
        device: device.unwrap_or_default(),
        journal,
        progress: FrameProgress::new(indices.len() as u64),
        done: Done::default(),
    };
    let record = Mutex::new(record);
    let (sender, rendered) = sync_channel(options.queue);
    // It is gone with the last writer, and engines then end.
    let rendered = Arc::new(Mutex::new(rendered));
    let (give_back, written) = channel();
    let written = Mutex::new(written);
    let next = AtomicUsize::new(0);
    let rendered_count = AtomicUsize::new(0);
    let is_stopped = AtomicBool::new(false);
    let work = |mut engine: Engine, sender: SyncSender<Rendered>| {
        while !is_interrupted() && !is_stopped.load(Ordering::Relaxed) {
            let Some(&index) = indices.get(next.fetch_add(1, Ordering::Relaxed)) else {
                break;
            };
            let planned = frames.plan(index);
            let start = Instant::now();
            let frame = engine.render(&planned);
            let time = start.elapsed();
            let stops = frame.is_err() && options.fail_fast;
            let rendered = Rendered {
                planned,
                frame,
                time,
            };
            // If the writer is gone, the error that ended it is returned below.
            if sender.send(rendered).is_err() || stops {
                is_stopped.store(true, Ordering::Relaxed);
                break;
            }
            rendered_count.fetch_add(1, Ordering::Relaxed);
            let written = lock(&written);
            let back = match options.queue {
                0 => written.recv().ok().flatten(),
                _ => written.try_iter().flatten().last(),
            };
            if let Some(frame) = back {
                engine.renderer.return_buffers(frame);
            }
        }
    };
    let write_all = |rendered: Arc<Mutex<Receiver<Rendered>>>, give_back: Sender<_>| {
        let next = || lock(&rendered).recv().ok();
        while let Some(next) = next() {
            let written = write(next, options.folder, &frames.job, &record);
            let written = written.inspect_err(|_| is_stopped.store(true, Ordering::Relaxed))?;
            // The rendering threads may have ended already.
            let _ = give_back.send(written);
        }
        Ok::<_, Error>(())
    };
    thread::scope(|scope| {
        let writing = (0..writers).map(|_| {
            let (write_all, rendered, give_back) =
                (&write_all, rendered.clone(), give_back.clone());
            scope.spawn(move || write_all(rendered, give_back))
        });
        let writing: Vec<_> = writing.collect();
        drop((rendered, give_back));
        for engine in engines {
            let (work, sender) = (&work, sender.clone());
            scope.spawn(move || work(engine, sender));
        }
        drop(sender);
        for writer in writing {
            let ended = writer.join();
            ended.map_err(|_| "internal error: a writing thread panicked")??;
        }
        Ok::<_, Failure>(())
    })?;
    let mut record = record.into_inner().unwrap_or_else(PoisonError::into_inner);
    record.done.is_whole = rendered_count.load(Ordering::Relaxed) == indices.len();
    Ok((record.done, record.journal))
}

/// Locks data that a panic elsewhere cannot leave half changed.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What the run has done, for its manifest and its summary.
struct Record {
    device: String,
    journal: Journal,
    progress: FrameProgress,
    done: Done,
}

/// Writes a frame and records it. Returns the frame unless it failed.
fn write(
    rendered: Rendered,
    folder: &Path,
    job: &Job,
    record: &Mutex<Record>,
) -> Result<Option<Frame>, Error> {
    let Rendered {
        planned,
        frame,
        time,
    } = rendered;
    let Planned { index, inputs, .. } = &planned;
    let description = planned.description.as_object().cloned().unwrap_or_default();
    let mut line = json!({ "index": index });
    description
        .into_iter()
        .for_each(|(key, value)| line[key] = value);
    let start = Instant::now();
    let written = frame.map(|frame| {
        let path = folder.join(&planned.file);
        let (written, of_files) = files::write(job, &planned, &path, &frame)?;
        let warnings = [frame.warnings(), of_files].concat();
        Ok::<_, Error>((frame, written, warnings))
    });
    let mut record = lock(record);
    record.done.rendering += time;
    let ms = (time.as_secs_f64() * 1e6).round() * 1e-3;
    let written = match written {
        Ok(written) => {
            let (frame, written, warnings) = written?;
            if let Some(file) = planned.depth_png() {
                line["depth_png"] = json!(file);
            }
            match job.exr.plain {
                false => line["file"] = json!(planned.file),
                true => line["files"] = json!(planned.plain_files()),
            }
            line["blake3"] = json!(written.blake3);
            line["bytes"] = json!(written.bytes);
            line["ms"] = json!(ms);
            line["estimated_error"] = json!(frame.stats.estimated_error);
            line["estimated_error_upper"] = json!(frame.stats.estimated_error_upper);
            if let Some(error_mm) = frame.stats.estimated_range_error_mm {
                line["estimated_range_error_mm"] = json!(error_mm);
                line["estimated_range_error_upper_mm"] =
                    json!(frame.stats.estimated_range_error_upper_mm);
            }
            line["stop"] = json!(frame.stats.stop.map(StopReason::name));
            if let Some(error) = frame.stats.estimated_interpolation_error {
                line["estimated_interpolation_error"] = json!(error);
            }
            if let Some(error) = frame.stats.estimated_area_light_error {
                line["estimated_area_light_error"] = json!(error);
            }
            record.done.warned += u64::from(!warnings.is_empty());
            line["warnings"] = json!(warnings);
            record.done.written += 1;
            record.done.bytes += written.bytes;
            record.done.gpu += Duration::from_secs_f64(frame.stats.gpu_milliseconds() * 1e-3);
            record.done.writing += start.elapsed();
            Some(frame)
        }
        Err(error) => {
            let failed = format!("camlux: frame {index} failed: {error}");
            record.progress.say(&failed);
            line["error"] = json!(error.to_string());
            line["ms"] = json!(ms);
            record.done.failed += 1;
            None
        }
    };
    line["device"] = json!(record.device);
    line["inputs"] = json!(inputs);
    record.journal.append(&line)?;
    record.progress.step();
    Ok(written)
}

/// The result of the work, for readers.
pub fn tell_summary(done: &Done, wall: Duration) {
    let wall_s = wall.as_secs_f64();
    let rate = done.written as f64 / wall_s;
    let share = |part: Duration| 100.0 * part.as_secs_f64() / wall_s;
    let [gpu, rendering, writing] = [done.gpu, done.rendering, done.writing].map(share);
    tell(&format!(
        "rendered {} in {wall_s:.2} s: {rate:.2} frames/s, {:.1} MB; share of the wall time: GPU {gpu:.0} %, rendering {rendering:.0} %, writing {writing:.0} %",
        counted(done.written, "frame", "frames"),
        done.bytes as f64 * 1e-6,
    ));
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use camlux::{Device, DeviceOptions, Error, Fault};

    use super::Job;
    use super::{Engine, EngineDevice, Frames, WorkOptions, render_by};
    use crate::batch::manifest::Journal;

    fn frames(job: &str) -> Frames {
        let job = format!("[job]\nscene = \"cornell.toml\"\nsize = [8, 8]\n{job}");
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/job.toml");
        let frames = Job::parse(job, &file).and_then(Frames::load);
        frames.expect("a job")
    }

    fn engines(count: usize) -> Vec<Engine> {
        let options = DeviceOptions::default();
        let device = Device::open(&options).expect("scripts/test has a driver");
        let device = EngineDevice::new(device, &options);
        let engines = (0..count).map(|_| Engine::on(&device).expect("a renderer"));
        engines.collect()
    }

    /// Renders five frames. Returns their files, in the order of the frames; `None` for one that failed.
    fn files_of(engine_count: usize, writers: usize, fault: Option<Fault>) -> Vec<Option<Vec<u8>>> {
        let frames = frames("frames = 5\n[[light]]\nindex = 0\npower_factor_range = [0.5, 2.0]\n");
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("frames")).expect("a folder");
        let journal = Journal::begin(&folder.path().join("manifest.jsonl"), &Default::default());
        let device = DeviceOptions::default();
        let engines = engines(engine_count);
        engines[0].shared.read().device.inject(fault);
        let options = WorkOptions {
            folder: folder.path(),
            device: &device,
            queue: 2,
            fail_fast: false,
        };
        let indices: Vec<u64> = (0..frames.count()).collect();
        let journal = journal.expect("a manifest");
        let done = render_by(engines, writers, &frames, &indices, journal, options);
        let (done, _) = done.expect("frames");
        let files = indices
            .iter()
            .map(|&index| std::fs::read(folder.path().join(frames.plan(index).file)).ok());
        let files: Vec<_> = files.collect();
        let written = files.iter().flatten().count() as u64;
        assert!(done.is_whole && [done.written, done.failed] == [written, 5 - written]);
        files
    }

    #[test]
    fn frames_in_flight_and_writers_do_not_show() {
        let one_by_one = files_of(1, 1, None);
        assert!(one_by_one.iter().all(Option::is_some));
        assert!(files_of(4, 3, None) == one_by_one);
    }

    #[test]
    fn a_frame_that_fails_leaves_those_in_flight_whole() {
        let whole = files_of(1, 1, None);
        let fault = Fault::OutOfMemory {
            function: None,
            call: 300,
        };
        let files = files_of(4, 1, Some(fault));
        let failed = files.iter().filter(|file| file.is_none()).count();
        assert_eq!(failed, 1);
        assert!(
            files
                .iter()
                .zip(&whole)
                .all(|(file, whole)| file.is_none() || file == whole)
        );
    }

    #[test]
    fn a_device_that_one_of_several_frames_loses_costs_none() {
        let fault = Fault::DeviceLostIn { pass: "gbuffer" };
        assert!(files_of(4, 1, Some(fault)) == files_of(1, 1, None));
    }

    #[test]
    fn a_frame_that_cannot_be_written_ends_the_work() {
        let frames = frames("frames = 9\n[[light]]\nindex = 0\npower_factor_range = [0.5, 2.0]\n");
        for writers in [1, 3] {
            let folder = tempfile::tempdir().expect("a folder");
            let manifest = folder.path().join("manifest.jsonl");
            let journal = Journal::begin(&manifest, &Default::default()).expect("a manifest");
            let device = DeviceOptions::default();
            // The folder `frames` is missing.
            let options = WorkOptions {
                folder: folder.path(),
                device: &device,
                queue: 2,
                fail_fast: false,
            };
            let indices: Vec<u64> = (0..frames.count()).collect();
            let ended = render_by(engines(2), writers, &frames, &indices, journal, options);
            assert!(ended.is_err(), "{writers} writers");
        }
    }

    #[test]
    fn a_lost_device_costs_one_frame() {
        let frames = frames("frames = 2\n[[light]]\nindex = 0\npower_factor_range = [0.5, 2.0]\n");
        let planned = frames.plan(0);
        let mut engine =
            Engine::open(&DeviceOptions::default()).expect("scripts/test has a driver");
        let before = engine.render(&planned).expect("a frame");
        // The same frame again would come back without a pass.
        engine.render(&frames.plan(1)).expect("a frame");
        let fault = Fault::DeviceLostIn { pass: "gbuffer" };
        engine.shared.read().device.inject(Some(fault));
        let lost = engine.render(&planned).err();
        assert!(matches!(lost, Some(Error::DeviceLost { .. })), "{lost:?}");
        let after = engine.render(&planned).expect("a frame");
        assert!(after.layers == before.layers);
    }
}
