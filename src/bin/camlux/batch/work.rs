//! Renders frames and writes them: while one renders, the last is packed and written by a thread of its own.

use std::path::Path;
use std::sync::mpsc::{channel, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use camlux::output::{ExrOptions, Frame, OutputFile, StopReason, write_exr_hashed};
use camlux::{Device, DeviceOptions, Error, RenderOptions, Renderer};
use serde_json::json;

use super::frames::{Frames, Planned};
use super::manifest::Journal;
use super::progress::FrameProgress;
use crate::progress::is_interrupted;
use crate::{Failure, counted, tell};

/// How to work.
#[derive(Clone, Copy)]
pub struct WorkOptions<'o> {
    pub folder: &'o Path,
    pub device: &'o DeviceOptions,
    /// Frames that may wait to be written; 0: each is written before the next one renders.
    pub queue: usize,
    pub fail_fast: bool,
}

/// What was done.
#[derive(Default)]
pub struct Done {
    pub written: u64,
    pub failed: u64,
    /// Frames that look as if they were not meant so: the manifest says why.
    pub warned: u64,
    pub bytes: u64,
    pub gpu: Duration,
    /// Of the renderer, and of packing and writing: together more than the wall time where they overlap.
    pub rendering: Duration,
    pub writing: Duration,
    /// Whether the end was reached: not where a signal or a failed frame has ended it before.
    pub is_whole: bool,
}

/// A device and what it keeps from frame to frame.
pub struct Engine {
    options: DeviceOptions,
    device: Device,
    renderer: Renderer,
}

impl Engine {
    pub fn open(options: &DeviceOptions) -> Result<Engine, Error> {
        let device = Device::open(options)?;
        let renderer = Renderer::new(&device)?;
        Ok(Engine {
            options: options.clone(),
            device,
            renderer,
        })
    }

    pub fn render(&mut self, frames: &mut Frames, planned: &Planned) -> Result<Frame, Error> {
        let scene = frames.scene(planned);
        let rendered = self.renderer.render(&scene, &mut RenderOptions::default());
        if let Err(Error::DeviceLost { .. }) = rendered {
            // It is of no more use; the frames behind this one need another.
            *self = Engine::open(&self.options)?;
        }
        rendered
    }
}

/// A frame on its way to the disk.
struct Rendered {
    planned: Planned,
    frame: Result<Frame, Error>,
    time: Duration,
}

/// Renders these frames.
///
/// # Errors
/// Where files cannot be written, and where no device can be opened: nothing else ends the work before its end.
pub fn render(
    frames: &mut Frames,
    indices: &[u64],
    journal: Journal,
    options: WorkOptions,
) -> Result<(Done, Journal), Failure> {
    let mut engine = Engine::open(options.device)?;
    let mut writer = Writer {
        exr: frames.job.exr.clone(),
        folder: options.folder,
        device: engine.device.info().name.clone(),
        journal,
        progress: FrameProgress::new(indices.len() as u64),
        done: Done::default(),
    };
    let (sender, rendered) = sync_channel(options.queue);
    let (give_back, written) = channel();
    thread::scope(|scope| {
        let writing = scope.spawn(move || {
            for rendered in rendered {
                // The renderer may be at its end.
                let _ = give_back.send(writer.write(rendered)?);
            }
            Ok::<_, Error>(writer)
        });
        let mut rendered_count = 0;
        for &index in indices {
            if is_interrupted() {
                break;
            }
            let planned = frames.plan(index);
            let start = Instant::now();
            let frame = engine.render(frames, &planned);
            let time = start.elapsed();
            let stops = frame.is_err() && options.fail_fast;
            let rendered = Rendered {
                planned,
                frame,
                time,
            };
            // Where nobody takes it, the error that ended the writer comes below.
            if sender.send(rendered).is_err() || stops {
                break;
            }
            rendered_count += 1;
            let back = match options.queue {
                0 => written.recv().ok().flatten(),
                _ => written.try_iter().flatten().last(),
            };
            if let Some(frame) = back {
                engine.renderer.return_buffers(frame);
            }
        }
        drop(sender);
        let ended = writing.join();
        let mut writer = ended.map_err(|_| "the thread that writes has ended by a bug")??;
        writer.done.is_whole = rendered_count == indices.len();
        Ok((writer.done, writer.journal))
    })
}

struct Writer<'w> {
    exr: ExrOptions,
    folder: &'w Path,
    device: String,
    journal: Journal,
    progress: FrameProgress,
    done: Done,
}

impl Writer<'_> {
    /// Returns the frame, where it did not fail.
    fn write(&mut self, rendered: Rendered) -> Result<Option<Frame>, Error> {
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
        self.done.rendering += time;
        let ms = (time.as_secs_f64() * 1e6).round() * 1e-3;
        let written = match frame {
            Ok(frame) => {
                let start = Instant::now();
                self.exr.attributes = planned.attributes();
                let output = OutputFile::create(planned.path(self.folder))?;
                let written = write_exr_hashed(output, &frame, &self.exr)?;
                line["file"] = json!(planned.file);
                line["blake3"] = json!(written.blake3);
                line["bytes"] = json!(written.bytes);
                line["ms"] = json!(ms);
                line["estimated_error"] = json!(frame.stats.estimated_error);
                line["estimated_error_upper"] = json!(frame.stats.estimated_error_upper);
                line["stop"] = json!(frame.stats.stop.map(StopReason::name));
                if let Some(error) = frame.stats.estimated_interpolation_error {
                    line["estimated_interpolation_error"] = json!(error);
                }
                let warnings = [frame.warnings(), self.exr.warnings(&frame)].concat();
                self.done.warned += u64::from(!warnings.is_empty());
                line["warnings"] = json!(warnings);
                self.done.written += 1;
                self.done.bytes += written.bytes;
                let gpu_ms: f64 = frame.stats.passes.iter().map(|p| p.milliseconds).sum();
                self.done.gpu += Duration::from_secs_f64(gpu_ms * 1e-3);
                self.done.writing += start.elapsed();
                Some(frame)
            }
            Err(error) => {
                let failed = format!("camlux: frame {index} failed: {error}");
                self.progress.say(&failed);
                line["error"] = json!(error.to_string());
                line["ms"] = json!(ms);
                self.done.failed += 1;
                None
            }
        };
        line["device"] = json!(self.device);
        line["inputs"] = json!(inputs);
        self.journal.append(&line)?;
        self.progress.step();
        Ok(written)
    }
}

/// What was done, for people.
pub fn tell_summary(done: &Done, wall: Duration) {
    let wall_s = wall.as_secs_f64();
    let rate = done.written as f64 / wall_s;
    let share = |part: Duration| 100.0 * part.as_secs_f64() / wall_s;
    let [gpu, rendering, writing] = [done.gpu, done.rendering, done.writing].map(share);
    tell(&format!(
        "rendered {} in {wall_s:.2} s: {rate:.2} frames/s, {:.1} MB; of the wall time GPU {gpu:.0} %, rendering {rendering:.0} %, writing {writing:.0} %",
        counted(done.written, "frame", "frames"),
        done.bytes as f64 * 1e-6,
    ));
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use camlux::{DeviceOptions, Error, Fault};

    use super::{Engine, Frames};
    use crate::batch::job::Job;

    #[test]
    fn a_lost_device_costs_one_frame() {
        let job = "[job]\nscene = \"cornell.toml\"\nframes = 1\nsize = [8, 8]\n".to_owned();
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/job.toml");
        let mut frames = Job::parse(job, &file)
            .and_then(Frames::load)
            .expect("a job");
        let planned = frames.plan(0);
        let mut engine =
            Engine::open(&DeviceOptions::default()).expect("scripts/test has a driver");
        let before = engine.render(&mut frames, &planned).expect("a frame");
        engine
            .device
            .inject(Some(Fault::DeviceLostIn { pass: "gbuffer" }));
        let lost = engine.render(&mut frames, &planned).err();
        assert!(matches!(lost, Some(Error::DeviceLost { .. })), "{lost:?}");
        let after = engine.render(&mut frames, &planned).expect("a frame");
        assert!(after.layers == before.layers);
    }
}
