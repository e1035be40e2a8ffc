//! The job file: its scenes, its changes, and what it writes.

use std::path::{Path, PathBuf};

use camlux::Scene;
use camlux::keys::{self, Keys, Value};
use camlux::output::{ExrCompression, ExrOptions, FileFormat, Layer, dataset_layers, flow_layers};
use camlux::scene::TARGET_ERRORS;

use super::changes::Changes;
use super::rig::{JobScene, scenes};
use super::timing::Timing;
use crate::Failure;

pub struct Job {
    pub text: String,
    pub file: PathBuf,
    pub scenes: Vec<JobScene>,
    /// Whether its scenes are those of cameras that are fixed to each other.
    pub has_rig: bool,
    /// Frames of one sequence: the same number for each scene and each step of the sweeps.
    pub frame_count: u32,
    pub seed: u32,
    /// Whether each scene draws its own values, instead of the same in the same frame.
    pub draws_per_scene: bool,
    /// Of final gathering, whatever the scenes set.
    pub target_error: Option<f64>,
    pub size_px: Option<[u32; 2]>,
    /// Also of files that are not OpenEXR. The layers are those of each scene.
    pub exr: ExrOptions,
    pub format: FileFormat,
    /// Whether each frame has a PNG of its depth, too.
    pub has_depth_png: bool,
    pub changes: Changes,
    /// `None`: the whole frame shows one instant.
    pub timing: Option<Timing>,
}

impl Job {
    /// What the files of a scene hold.
    pub fn exr_of(&self, scene: &JobScene) -> ExrOptions {
        ExrOptions {
            layers: scene.layers.clone(),
            ..self.exr.clone()
        }
    }

    /// The layers that these files have.
    pub fn layers_of(&self, of_job: &JobScene, scene: &Scene) -> Vec<Layer> {
        dataset_layers(scene, &self.exr_of(of_job), !of_job.flow.is_empty())
    }

    pub fn load(file: &Path) -> Result<Job, Failure> {
        Job::parse(keys::read_text(file, "job file")?, file)
    }

    pub fn parse(text: String, file: &Path) -> Result<Job, Failure> {
        let known = [
            "version", "job", "time", "camera", "rig", "light", "mesh", "material", "sweep",
        ];
        let mut keys = Keys::parse(&text, file, "job file", &known)?;
        let mut job = keys
            .need("job", "a [job] table with scene = \"scene.toml\"")?
            .table("[job]")?;
        job.only(&[
            "scene",
            "scenes",
            "frames",
            "seed",
            "draws_per_scene",
            "target_error",
            "size",
            "layers",
            "half",
            "compression",
            "format",
            "depth_png",
            "plain",
            "multipart",
            "flow",
        ])?;
        let folder = file.parent().unwrap_or(Path::new(""));
        let rig = keys.tables("rig")?;
        let has_rig = !rig.is_empty();
        let mut scenes = scenes(&mut job, rig, folder)?;
        let seed = job.optional("seed", Value::count)?.unwrap_or(0);
        let draws_per_scene = job.optional("draws_per_scene", Value::flag)?;
        let target_error = job.optional("target_error", target_error)?;
        let size_px = job.optional("size", size)?;
        let format = job.optional("format", |value| {
            value.choice(&FileFormat::ALL, FileFormat::name)
        })?;
        let format = format.unwrap_or_default();
        let has_depth_png = job.optional("depth_png", Value::flag)?.unwrap_or(false);
        let mut exr = exr_options(&mut job, format)?;
        let flow = job.optional("flow", Value::flag)?.unwrap_or(false);
        let of_all = exr.layers.take();
        for scene in &mut scenes {
            scene.layers = scene.layers.take().or_else(|| of_all.clone());
            scene.flow = flow_layers(&mut scene.layers, flow);
        }
        let changes = Changes::read(&mut keys, folder)?;
        let timing = Timing::read(&mut keys)?;
        let frame_count = changes.count_frames(&mut job)?;
        drop((keys, job));
        Ok(Job {
            text,
            file: file.to_owned(),
            scenes,
            has_rig,
            frame_count,
            seed,
            draws_per_scene: draws_per_scene.unwrap_or(false),
            target_error,
            size_px,
            exr,
            format,
            has_depth_png,
            changes,
            timing,
        })
    }
}

fn size(value: &Value) -> camlux::Result<[u32; 2]> {
    match value.counts()? {
        [0, _] | [_, 0] => Err(value.error("holds 0", "give [width, height] in pixels")),
        size_px => Ok(size_px),
    }
}

fn target_error(value: &Value) -> camlux::Result<f64> {
    match value.number()? {
        error if TARGET_ERRORS.contains(error) => Ok(error),
        error => Err(value.error(format!("is {error}"), TARGET_ERRORS.hint)),
    }
}

/// The layers that a table names.
pub fn layers(keys: &mut Keys) -> camlux::Result<Option<Vec<Layer>>> {
    let layers = keys.take("layers").map(|value| {
        let names = value.filled("name one or more")?.list()?;
        let layers = names.iter().map(|value| {
            let name = value.text()?;
            let unknown = |names| value.error(format!("names no layer: \"{name}\""), names);
            crate::render::parse_layer_of_sequence(name).map_err(unknown)
        });
        layers.collect()
    });
    layers.transpose()
}

fn exr_options(keys: &mut Keys, format: FileFormat) -> Result<ExrOptions, Failure> {
    let layers = layers(keys)?;
    let compression = keys.optional("compression", |value| {
        let way = value.choice(&ExrCompression::ALL, ExrCompression::name)?;
        match format {
            FileFormat::Npz if !format.compressions().contains(&way) => {
                let hint = "give none or zip, which numpy reads, or leave out format";
                Err(value.error(format!("is \"{}\", in an npz file", way.name()), hint))
            }
            _ => Ok(way),
        }
    })?;
    let plain = keys.optional("plain", |value| match (value.flag()?, format) {
        (true, FileFormat::Npz) => {
            let hint = "leave out one of them: only OpenEXR files can be plain";
            Err(value.error("is true, in an npz file", hint))
        }
        (plain, _) => Ok(plain),
    })?;
    let multipart = keys.optional("multipart", |value| match (value.flag()?, format, plain) {
        (true, FileFormat::Npz, _) => {
            let hint = "leave out one of them: only OpenEXR files have parts";
            Err(value.error("is true, in an npz file", hint))
        }
        (true, _, Some(true)) => {
            let hint = "leave out one of them: a plain file has one part";
            Err(value.error("is true, beside plain", hint))
        }
        (multipart, ..) => Ok(multipart),
    })?;
    Ok(ExrOptions {
        half: keys.optional("half", Value::flag)?.unwrap_or(false),
        layers,
        compression: compression.unwrap_or(format.usual_compression()),
        plain: plain.unwrap_or(false),
        multipart: multipart.unwrap_or(false),
        attributes: Vec::new(),
    })
}
