//! Other programs on the same scene: their images are measured like the engine's, their times are their own.
//!
//! The program is run as `PROGRAM --scene FILE --size W H --output FOLDER [--quick]` and prints a JSON object a line. The
//! first has `about` and `notes`; each other one has `peer` and either `unsupported` with the reason, or `label`, `seconds`
//! (the timed runs), `seconds_of` (their parts) and `image`, an OpenEXR file with the layers `direct` and `indirect`.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use camlux::Error;
use camlux::output::{Layer, LayeredImage};
use serde::Deserialize;

use super::results::{Entry, Kind, Peers, Seconds, TimePart, Unsupported};
use super::steps::Steps;
use super::truth::{Measured, TruthImage};
use crate::{Failure, warn};

/// A line of the program. What is not named here is for other readers.
#[derive(Deserialize)]
struct Line {
    about: Option<String>,
    #[serde(default)]
    notes: Vec<String>,
    peer: Option<String>,
    label: Option<String>,
    spp: Option<u64>,
    #[serde(default)]
    seconds: Vec<f64>,
    #[serde(default)]
    seconds_of: BTreeMap<String, f64>,
    image: Option<PathBuf>,
    unsupported: Option<String>,
}

/// What to run, and on what.
pub struct PeerRun<'a> {
    pub program: &'a Path,
    pub name: &'a str,
    pub scene_file: &'a Path,
    pub resolution_px: [u32; 2],
    /// For the peers' images.
    pub folder: PathBuf,
    pub is_quick: bool,
    pub truth: &'a TruthImage,
    pub steps: &'a Steps,
}

impl PeerRun<'_> {
    /// Runs the program and measures its images. What goes wrong with it is said on stderr and in the status: a report goes
    /// on without peers.
    ///
    /// # Errors
    /// Only cancelled after a signal.
    pub fn run(&self) -> Result<(Vec<Entry>, Peers), Failure> {
        self.steps.begin(&format!("{}: peers", self.name))?;
        let mut peers = Peers::new("");
        let mut entries = Vec::new();
        let ran = self.follow(&mut |line| self.take(line, &mut entries, &mut peers));
        // A signal ends the report, whatever became of the program.
        if self.steps.tick().is_break() {
            return Err(Error::Cancelled.into());
        }
        peers.status = match ran {
            Ok(()) => format!("ran {}", self.program.display()),
            Err(problem) => {
                let status = format!("{} failed: {problem}", self.program.display());
                warn(format_args!("{}: peers: {status}", self.name));
                status
            }
        };
        Ok((entries, peers))
    }

    /// Starts the program and hands on its lines.
    fn follow(&self, take: &mut dyn FnMut(&str) -> Result<(), String>) -> Result<(), String> {
        std::fs::create_dir_all(&self.folder)
            .map_err(|error| format!("cannot create {}: {error}", self.folder.display()))?;
        let [width, height] = self.resolution_px.map(|px| px.to_string());
        let mut command = Command::new(absolute(self.program));
        command.arg("--scene").arg(absolute(self.scene_file));
        command.args(["--size", &width, &height]);
        command.arg("--output").arg(absolute(&self.folder));
        if self.is_quick {
            command.arg("--quick");
        }
        command.stdin(Stdio::null());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| error.to_string())?;
        let followed = self.follow_child(&mut child, take);
        if followed.is_err() {
            // Gone already, or not to be waited for.
            let _ = child.kill();
        }
        let status = child.wait().map_err(|error| error.to_string())?;
        let last_words = followed?;
        if status.success() {
            return Ok(());
        }
        Err(match last_words.as_str() {
            "" => status.to_string(),
            words => format!("{words} ({status})"),
        })
    }

    /// Its stdout line by line; the last line of its stderr.
    fn follow_child(
        &self,
        child: &mut Child,
        take: &mut dyn FnMut(&str) -> Result<(), String>,
    ) -> Result<String, String> {
        let (sender, lines) = mpsc::channel();
        let stdout = child.stdout.take().ok_or("it has no stdout")?;
        let stderr = child.stderr.take().ok_or("it has no stderr")?;
        let errors = send_lines(stderr, Stream::Stderr, sender.clone());
        let output = send_lines(stdout, Stream::Stdout, sender);
        let mut last_words = String::new();
        loop {
            match lines.recv_timeout(Duration::from_millis(100)) {
                Ok((Stream::Stdout, line)) if !line.trim().is_empty() => take(&line)?,
                Ok((Stream::Stderr, line)) if !line.trim().is_empty() => {
                    self.steps.detail(|| format!("{}: {line}", self.name));
                    last_words = line;
                }
                Ok(_) | Err(mpsc::RecvTimeoutError::Timeout) => {}
                Err(mpsc::RecvTimeoutError::Disconnected) => break,
            }
            if self.steps.tick().is_break() {
                return Err("interrupted".into());
            }
        }
        // Both ended, or the channel would be open.
        let _ = (errors.join(), output.join());
        Ok(last_words)
    }

    fn take(&self, text: &str, entries: &mut Vec<Entry>, peers: &mut Peers) -> Result<(), String> {
        let line: Line = serde_json::from_str(text)
            .map_err(|error| format!("a line of its stdout is not what is due: {error}"))?;
        if line.about.is_some() {
            peers.about = line.about;
        }
        peers.notes.extend(line.notes);
        let Some(peer) = line.peer else {
            return Ok(());
        };
        if let Some(reason) = line.unsupported {
            peers.unsupported.push(Unsupported { peer, reason });
            return Ok(());
        }
        self.steps.detail(|| format!("{}: {peer}", self.name));
        let image = line.image.ok_or_else(|| format!("{peer} names no image"))?;
        let parts = line.seconds_of.into_iter();
        let parts = parts
            .map(|(name, seconds)| TimePart { name, seconds })
            .collect();
        let seconds = Seconds::from_runs(line.seconds, parts)
            .filter(|seconds| seconds.min.is_finite() && seconds.min >= 0.0)
            .ok_or_else(|| format!("{peer} gives no times"))?;
        let measured = self.measure(&image);
        let measured = measured.map_err(|problem| format!("{peer}: {problem}"))?;
        entries.push(Entry {
            kind: Kind::Peer,
            label: match line.spp {
                Some(spp) => format!("{spp} spp"),
                None => line.label.clone().unwrap_or_default(),
            },
            series: peer,
            description: line.label,
            seconds,
            indirect: measured.indirect,
            total: measured.total,
            engine: None,
            is_on_engine_front: false,
            is_on_front: false,
            pictures: Some(measured.pictures),
        });
        Ok(())
    }

    fn measure(&self, file: &Path) -> Result<Measured, Failure> {
        let image = LayeredImage::read(file)?;
        if image.resolution_px() != self.resolution_px {
            let ([width, height], file) = (image.resolution_px(), file.display());
            return Err(format!("{file}: it has {width} x {height} pixels").into());
        }
        let missing = || {
            let file = file.display();
            format!("{file}: it lacks a layer of indirect and direct, with R, G and B")
        };
        let indirect = image.values(Layer::Indirect).ok_or_else(missing)?;
        let total = image.total_radiance().ok_or_else(missing)?;
        self.truth.measure(indirect, &total)
    }
}

/// Where a line came from.
#[derive(Clone, Copy)]
enum Stream {
    Stdout,
    Stderr,
}

fn send_lines(
    from: impl Read + Send + 'static,
    source: Stream,
    to: mpsc::Sender<(Stream, String)>,
) -> thread::JoinHandle<()> {
    thread::spawn(move || {
        for line in BufReader::new(from).lines().map_while(Result::ok) {
            if to.send((source, line)).is_err() {
                return;
            }
        }
    })
}

/// The program runs wherever it likes, so that paths must not depend on the folder. A bare name is looked up in PATH.
fn absolute(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}
