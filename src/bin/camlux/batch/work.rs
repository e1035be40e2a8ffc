//! Renders frames and writes them: while one renders, the last is packed and written by a thread of its own.

use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use camlux::output::{ExrOptions, Frame, OutputFile, write_exr_hashed};
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

    /// Takes a frame that was written.
    pub fn return_buffers(&mut self, frame: Frame) {
        self.renderer.return_buffers(frame);
    }

    pub fn device_name(&self) -> &str {
        &self.device.info().name
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
        device: engine.device_name().to_owned(),
        journal,
        progress: FrameProgress::new(indices.len() as u64),
        done: Done::default(),
    };
    // Returns a frame that was written, where there is one.
    type Take<'t> = dyn FnMut(Rendered) -> Result<Option<Frame>, Failure> + 't;
    let mut source = |take: &mut Take| {
        for &index in indices {
            if is_interrupted() {
                return Ok(false);
            }
            let planned = frames.plan(index);
            let start = Instant::now();
            let frame = engine.render(frames, &planned);
            let stops = frame.is_err() && options.fail_fast;
            let time = start.elapsed();
            let written = take(Rendered {
                planned,
                frame,
                time,
            })?;
            if let Some(written) = written {
                engine.return_buffers(written);
            }
            if stops {
                return Ok(false);
            }
        }
        Ok::<bool, Failure>(true)
    };
    let is_whole = if options.queue == 0 {
        source(&mut |rendered| Ok(writer.write(rendered)?))?
    } else {
        let (sender, receiver) = sync_channel(options.queue);
        // Those that nobody takes back are dropped.
        let (give_back, written) = sync_channel(1);
        thread::scope(|scope| {
            let writing = scope.spawn(|| writer.write_all(receiver, give_back));
            let ended = source(&mut |rendered| {
                send(&sender, rendered)?;
                Ok(written.try_recv().ok())
            });
            drop(sender);
            match writing.join() {
                // Its error is the cause of the other.
                Ok(written) => written.map_err(Failure::from).and(ended),
                Err(_) => Err("the thread that writes has ended by a bug".into()),
            }
        })?
    };
    writer.done.is_whole = is_whole;
    Ok((writer.done, writer.journal))
}

fn send(sender: &SyncSender<Rendered>, rendered: Rendered) -> Result<(), Failure> {
    let closed = |_| "the thread that writes has ended".into();
    sender.send(rendered).map_err(closed)
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
    fn write_all(
        &mut self,
        rendered: Receiver<Rendered>,
        give_back: SyncSender<Frame>,
    ) -> Result<(), Error> {
        for rendered in rendered {
            if let Some(written) = self.write(rendered)? {
                let _ = give_back.try_send(written);
            }
        }
        Ok(())
    }

    /// Returns the frame, where it did not fail.
    fn write(&mut self, rendered: Rendered) -> Result<Option<Frame>, Error> {
        let Rendered {
            mut planned,
            frame,
            time,
        } = rendered;
        let mut line = serde_json::Map::new();
        line.insert("index".into(), json!(planned.index));
        line.append(&mut planned.description);
        self.done.rendering += time;
        let written = match frame {
            Ok(frame) => {
                let start = Instant::now();
                self.exr.attributes = planned.attributes();
                let output = OutputFile::create(planned.path(self.folder))?;
                let written = write_exr_hashed(output, &frame, &self.exr)?;
                line.insert("file".into(), json!(planned.file));
                line.insert("blake3".into(), json!(written.blake3));
                line.insert("bytes".into(), json!(written.bytes));
                line.insert("ms".into(), json!(rounded_ms(time)));
                let estimated_error = frame.stats.estimated_error;
                line.insert("estimated_error".into(), json!(estimated_error));
                let interpolation_error = frame.stats.estimated_interpolation_error;
                if interpolation_error.is_some() {
                    let key = "estimated_interpolation_error".into();
                    line.insert(key, json!(interpolation_error));
                }
                let warnings = [frame.warnings(), self.exr.warnings(&frame)].concat();
                self.done.warned += u64::from(!warnings.is_empty());
                line.insert("warnings".into(), json!(warnings));
                self.done.written += 1;
                self.done.bytes += written.bytes;
                let gpu_ms: f64 = frame.stats.passes.iter().map(|p| p.milliseconds).sum();
                self.done.gpu += Duration::from_secs_f64(gpu_ms * 1e-3);
                self.done.writing += start.elapsed();
                Some(frame)
            }
            Err(error) => {
                let index = planned.index;
                self.progress
                    .say(&format!("camlux: frame {index} failed: {error}"));
                line.insert("error".into(), json!(error.to_string()));
                line.insert("ms".into(), json!(rounded_ms(time)));
                self.done.failed += 1;
                None
            }
        };
        line.insert("device".into(), json!(self.device));
        line.insert("inputs".into(), json!(planned.inputs));
        self.journal.append(&line.into())?;
        self.progress.step();
        Ok(written)
    }
}

fn rounded_ms(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e6).round() * 1e-3
}

/// What was done, for people.
pub fn tell_summary(done: &Done, wall: Duration) {
    let wall_s = wall.as_secs_f64();
    let rate = done.written as f64 / wall_s;
    let share = |part: Duration| 100.0 * part.as_secs_f64() / wall_s;
    tell(&format!(
        "rendered {} in {wall_s:.2} s: {rate:.2} frames/s, {:.1} MB; of the wall time GPU {:.0} %, rendering {:.0} %, writing {:.0} %",
        counted(done.written, "frame", "frames"),
        done.bytes as f64 * 1e-6,
        share(done.gpu),
        share(done.rendering),
        share(done.writing),
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
