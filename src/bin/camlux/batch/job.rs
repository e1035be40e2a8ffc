//! The job file: which scenes, what varies, and what is written.

use std::path::{Path, PathBuf};

use camlux::keys::{Keys, LineStarts, TomlText, Value};
use camlux::output::{ExrCompression, ExrOptions, Layer};
use camlux::{input_file, scene::Bands};

use super::changes::{LightChange, MaterialChange, MeshChange, Sweep};
use super::motion::{self, Motion};
use crate::Failure;

const VERSION: u32 = 1;

pub struct Job {
    pub text: String,
    pub file: PathBuf,
    /// As written, and where they lie.
    pub scenes: Vec<(String, PathBuf)>,
    /// Of one sequence: as many for each scene and each step of the sweeps.
    pub frame_count: u32,
    pub seed: u32,
    pub size_px: Option<[u32; 2]>,
    pub exr: ExrOptions,
    pub camera: Option<Motion>,
    pub lights: Vec<LightChange>,
    pub meshes: Vec<MeshChange>,
    pub materials: Vec<MaterialChange>,
    pub sweeps: Vec<Sweep>,
}

impl Job {
    pub fn load(file: &Path) -> Result<Job, Failure> {
        let unreadable = |problem: &dyn std::fmt::Display| {
            format!(
                "{}: cannot read the job file: {problem}; check the path and that it is a UTF-8 text file",
                file.display()
            )
        };
        let bytes = input_file::read(file).map_err(|error| unreadable(&error))?;
        let text = String::from_utf8(bytes).map_err(|error| unreadable(&error))?;
        Job::parse(text, file)
    }

    pub fn parse(text: String, file: &Path) -> Result<Job, Failure> {
        let lines = LineStarts::new(&text);
        let mut keys = TomlText {
            name: "the job file",
            text: &text,
            file,
            lines: &lines,
        }
        .parse()?;
        keys.only(&[
            "version", "job", "camera", "light", "mesh", "material", "sweep",
        ])?;
        if let Some(version) = keys.take("version")
            && version.count()? != VERSION
        {
            let hint = format!("write version = {VERSION}, or use a newer camlux");
            return Err(version.error("is not known", hint).into());
        }
        let folder = file.parent().unwrap_or(Path::new(""));
        let mut job_keys = keys
            .need("job", "a [job] table with scene = \"scene.toml\"")?
            .table("[job]")?;
        job_keys.only(&[
            "scene",
            "scenes",
            "frames",
            "seed",
            "size",
            "layers",
            "half",
            "compression",
        ])?;
        let camera = match keys.take("camera") {
            Some(value) => {
                let mut camera_keys = value.table("[camera]")?;
                camera_keys.only(&motion::KEYS)?;
                Motion::read(&mut camera_keys, folder)?
            }
            None => None,
        };
        let mut job = Job {
            scenes: scenes(&mut job_keys, folder)?,
            frame_count: 1,
            seed: job_keys.take("seed").map_or(Ok(0), |seed| seed.count())?,
            size_px: job_keys.take("size").map(size).transpose()?,
            exr: exr_options(&mut job_keys)?,
            camera,
            lights: each(&mut keys, "light", |keys| LightChange::read(keys, folder))?,
            meshes: each(&mut keys, "mesh", |keys| MeshChange::read(keys, folder))?,
            materials: each(&mut keys, "material", MaterialChange::read)?,
            sweeps: each(&mut keys, "sweep", Sweep::read)?,
            file: file.to_owned(),
            text: String::new(),
        };
        job.frame_count = job.count_frames(&mut job_keys)?;
        drop(keys);
        job.text = text;
        Ok(job)
    }

    fn motions(&self) -> impl Iterator<Item = &Motion> {
        let lights = self.lights.iter().filter_map(|light| light.motion.as_ref());
        let meshes = self.meshes.iter().map(|mesh| &mesh.motion);
        self.camera.iter().chain(lights).chain(meshes)
    }

    /// Lists say how many frames there are, and keyframes where no list does; `frames` may take fewer of a list.
    fn count_frames(&self, keys: &mut Keys) -> Result<u32, Failure> {
        let factors = self.lights.iter().filter_map(LightChange::listed_count);
        let mut lists: Vec<usize> = factors.collect();
        let mut keyed = None;
        let mut is_random =
            !self.materials.is_empty() || self.lights.iter().any(|light| light.is_random());
        for motion in self.motions() {
            match motion {
                Motion::Listed(poses) => lists.push(poses.len()),
                Motion::Keyed(keyframes) => {
                    let count = keyframes
                        .last()
                        .map_or(1, |&(frame, _)| frame.saturating_add(1));
                    keyed = keyed.max(Some(count));
                }
                Motion::Random(_) => is_random = true,
            }
        }
        let shortest = lists.iter().copied().min();
        let requested = keys.take("frames");
        if let Some(requested) = requested {
            let count = requested.count()?;
            return match shortest {
                _ if count == 0 => Err(requested.error("is 0", "give 1 or more").into()),
                Some(length) if (count as usize) > length => {
                    let problem = format!("is {count}, but a list has {length} frames only");
                    Err(requested.error(problem, "give as many or fewer").into())
                }
                _ => Ok(count),
            };
        }
        if let (Some(length), Some(longest)) = (shortest, lists.iter().copied().max()) {
            if length != longest {
                let problem =
                    format!("lists of {length} and of {longest} frames stand beside each other");
                return Err(keys
                    .error(problem, "give them one length, or say frames = N")
                    .into());
            }
            return Ok(u32::try_from(length)?);
        }
        match keyed {
            Some(count) => Ok(count),
            None if is_random => Err(keys
                .error("nothing says how many frames are drawn", "add frames = 100")
                .into()),
            None => Ok(1),
        }
    }
}

fn each<T>(
    keys: &mut Keys,
    key: &str,
    read: impl Fn(&mut Keys) -> Result<T, Failure>,
) -> Result<Vec<T>, Failure> {
    let tables = keys.take(key).map_or(Ok(Vec::new()), Value::tables)?;
    tables
        .into_iter()
        .map(|mut table| read(&mut table))
        .collect()
}

fn scenes(keys: &mut Keys, folder: &Path) -> Result<Vec<(String, PathBuf)>, Failure> {
    let values = match keys.take_one(&["scene", "scenes"])? {
        Some(("scenes", scenes)) => {
            let at = scenes.at.clone();
            let list = scenes.list()?;
            if list.is_empty() {
                return Err(format!("{at}: \"scenes\" is empty; name one or more").into());
            }
            list
        }
        Some((_, scene)) => vec![scene],
        None => vec![keys.need("scene", "scene = \"scene.toml\" or scenes = [...]")?],
    };
    let mut scenes: Vec<(String, PathBuf)> = Vec::new();
    for value in values {
        let name = value.text()?.to_owned();
        let path = folder.join(&name);
        if scenes
            .iter()
            .any(|(_, other)| other.file_stem() == path.file_stem())
        {
            let problem = format!("names \"{name}\", whose folder of frames another scene has");
            return Err(value
                .error(problem, "give the files different names")
                .into());
        }
        scenes.push((name, path));
    }
    Ok(scenes)
}

fn size(value: Value) -> Result<[u32; 2], Failure> {
    let size_px = value.counts()?;
    match size_px.contains(&0) {
        true => Err(value
            .error("holds 0", "give [width, height] in pixels")
            .into()),
        false => Ok(size_px),
    }
}

fn exr_options(keys: &mut Keys) -> Result<ExrOptions, Failure> {
    let word_of = |value: &Value, known: &[&str]| -> Result<String, Failure> {
        let word = value.text()?;
        match known.contains(&word) {
            true => Ok(word.to_owned()),
            false => {
                let hint = format!("possible are: {}", known.join(", "));
                Err(value.error(format!("names \"{word}\""), hint).into())
            }
        }
    };
    let rendered = Layer::ALL
        .into_iter()
        .filter(|layer| !matches!(layer, Layer::StandardError | Layer::Edge));
    let layer_names: Vec<&str> = rendered.map(Layer::name).collect();
    let layers = match keys.take("layers") {
        Some(value) => {
            let at = value.at.clone();
            let mut layers = Vec::new();
            for value in value.list()? {
                layers.extend(Layer::from_name(&word_of(&value, &layer_names)?));
            }
            if layers.is_empty() {
                return Err(format!("{at}: \"layers\" is empty; name one or more").into());
            }
            Some(layers)
        }
        None => None,
    };
    let compression = match keys.take("compression") {
        Some(value) => {
            let names = ExrCompression::ALL.map(ExrCompression::name);
            ExrCompression::from_name(&word_of(&value, &names)?).unwrap_or_default()
        }
        None => super::DEFAULT_COMPRESSION,
    };
    Ok(ExrOptions {
        half: keys.take("half").map_or(Ok(false), |half| half.flag())?,
        layers,
        compression,
        attributes: Vec::new(),
    })
}

/// `[[light]]` and others name what they change by its number in the scene.
pub fn index(keys: &mut Keys) -> Result<(usize, String), Failure> {
    let index = keys.need("index", "index = 0, its place in the scene file")?;
    Ok((index.count()? as usize, index.at))
}

/// Two bounds, the lower one first.
pub fn ordered(keys: &Keys, least: Bands, most: Bands) -> Result<(), Failure> {
    match (0..3).all(|band| least[band] <= most[band]) {
        true => Ok(()),
        false => Err(keys
            .error(format!("{least:?} is above {most:?}"), "exchange them")
            .into()),
    }
}
