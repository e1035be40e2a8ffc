//! Renders the same scene with other programs. camlux measures their images like its own; each program measures its own times.
//!
//! The program is run as `PROGRAM --scene FILE --size W H --output FOLDER [--quick]`. It prints one JSON object per line. The first object
//! has `about` and `notes`. Each other object has `peer` and either `unsupported` with the reason, or `label`, `seconds` (the timed runs),
//! `seconds_of` (their parts) and `image`: an OpenEXR file with the layers `direct` and `indirect`, and for time-of-flight scenes also
//! `tof0.phasor`, `tof0.phasor_indirect` and so on.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use camlux::Error;
use camlux::output::{Layer, LayeredImage};
use serde::Deserialize;

use super::Subject;
use super::measured::{Group, file_hash};
use super::reference_image::ReferenceImage;
use super::results::{Entry, Kind, Peers, Unsupported};
use super::steps::Steps;
use super::stopwatch::Seconds;
use crate::output::create_folder;
use crate::{Failure, warn};

/// A line of the program. Keys that are not listed here are ignored.
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

/// The program to run, and its input.
pub struct PeerRun<'a> {
    pub program: &'a Path,
    pub subject: &'a Subject,
    /// Folder for the peers' images.
    pub folder: PathBuf,
    pub is_quick: bool,
    pub reference: &'a ReferenceImage,
    pub measured: &'a Group<'a>,
    pub steps: &'a Steps,
}

impl PeerRun<'_> {
    /// Runs the program and measures its images. Problems go to stderr and into the status; the report continues without peers.
    ///
    /// # Errors
    /// Cancelled after a signal, and if the measurements cannot be stored.
    pub fn run(&self) -> Result<(Vec<Entry>, Peers), Failure> {
        // If the program consists of several files, only the named file counts.
        let inputs = (self.program, file_hash(self.program));
        if let Some(found) = self.measured.find("peers", &inputs) {
            return Ok(found);
        }
        self.steps.begin(format!("{}: peers", self.subject.name))?;
        let mut peers = Peers::default();
        let mut entries = Vec::new();
        let ran = self.follow(&mut |line| self.take(line, &mut entries, &mut peers));
        // A signal ends the report, whatever the program did.
        if self.steps.tick().is_break() {
            return Err(Error::Cancelled.into());
        }
        let is_whole = ran.is_ok();
        peers.status = match ran {
            Ok(()) => format!("ran {}", self.program.display()),
            Err(problem) => {
                let status = format!("{} failed: {problem}", self.program.display());
                warn(format_args!("{}: peers: {status}", self.subject.name));
                status
            }
        };
        let measured = (entries, peers);
        if is_whole {
            self.measured.keep("peers", &inputs, &measured)?;
        }
        Ok(measured)
    }

    /// Starts the program and passes on its lines.
    fn follow(&self, take: &mut Take) -> Result<(), Failure> {
        create_folder(&self.folder)?;
        let size_px = self.subject.scene.camera.resolution_px;
        let [width, height] = size_px.map(|px| px.to_string());
        let mut command = Command::new(absolute(self.program));
        command.arg("--scene").arg(absolute(&self.subject.file));
        command.args(["--size", &width, &height]);
        command.arg("--output").arg(absolute(&self.folder));
        if self.is_quick {
            command.arg("--quick");
        }
        command.stdin(Stdio::null());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn()?;
        let followed = self.follow_child(&mut child, take);
        if followed.is_err() {
            // The process may have ended already; then there is nothing to kill.
            let _ = child.kill();
        }
        let status = child.wait()?;
        let last_words = followed?;
        if status.success() {
            return Ok(());
        }
        Err(match last_words.as_str() {
            "" => status.to_string().into(),
            words => format!("{words} ({status})").into(),
        })
    }

    /// Passes on its stdout line by line; returns the last line of its stderr.
    fn follow_child(&self, child: &mut Child, take: &mut Take) -> Result<String, Failure> {
        let (sender, lines) = mpsc::channel();
        let stdout = child.stdout.take().ok_or("it has no stdout")?;
        let stderr = child.stderr.take().ok_or("it has no stderr")?;
        send_lines(stderr, Said::ToStderr, sender.clone());
        send_lines(stdout, Said::ToStdout, sender);
        let mut last_words = String::new();
        loop {
            match lines.recv_timeout(Duration::from_millis(100)) {
                Ok(Said::ToStdout(line)) => take(&line)?,
                Ok(Said::ToStderr(line)) => {
                    self.steps.detail(format!("{}: {line}", self.subject.name));
                    last_words = line;
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(last_words),
            }
            if self.steps.tick().is_break() {
                return Err("interrupted".into());
            }
        }
    }

    fn take(&self, text: &str, entries: &mut Vec<Entry>, peers: &mut Peers) -> Result<(), Failure> {
        let line: Line = serde_json::from_str(text).map_err(|error| {
            format!("a line of its stdout does not follow benches/peers/README.md: {error}")
        })?;
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
        self.steps.detail(format!("{}: {peer}", self.subject.name));
        let image = line.image.ok_or_else(|| format!("{peer} names no image"))?;
        let seconds = Seconds::from_runs(line.seconds, line.seconds_of)
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
            ..measured
        });
        Ok(())
    }

    fn measure(&self, file: &Path) -> Result<Entry, Failure> {
        let image = LayeredImage::read(file)?;
        if image.resolution_px() != self.subject.scene.camera.resolution_px {
            let ([width, height], file) = (image.resolution_px(), file.display());
            return Err(format!(
                "{file}: it has {width} x {height} pixels instead of those of --size"
            )
            .into());
        }
        let missing = || {
            let file = file.display();
            format!("{file}: it lacks the layer indirect or direct, with R, G and B")
        };
        let indirect = image.values(Layer::Indirect).ok_or_else(missing)?;
        let total = image.total_radiance().ok_or_else(missing)?;
        Ok(Entry {
            time_of_flight: self
                .reference
                .measure_phasors(|layer| image.values(layer))?,
            ..self.reference.measure(indirect, &total)?
        })
    }
}

/// Handles one line of the program's stdout.
type Take<'a> = dyn FnMut(&str) -> Result<(), Failure> + 'a;

/// A line that is not empty.
enum Said {
    ToStdout(String),
    ToStderr(String),
}

/// Passes on lines until the stream ends or the receiver is gone.
fn send_lines(from: impl Read + Send + 'static, said: fn(String) -> Said, to: mpsc::Sender<Said>) {
    thread::spawn(move || {
        let lines = BufReader::new(from).lines().map_while(Result::ok);
        lines
            .filter(|line| !line.trim().is_empty())
            .try_for_each(|line| to.send(said(line)))
    });
}

/// An absolute path, because the program may change its working folder. A bare name is looked up in PATH.
fn absolute(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}
