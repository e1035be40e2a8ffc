//! The scenes of a job, and cameras that are fixed to each other: `[[rig]]`.

use std::path::{Path, PathBuf};

use camlux::glam::{DQuat, DVec3};
use camlux::keys::{Keys, Value};
use camlux::output::Layer;
use camlux::scene::Camera;
use serde_json::{Value as Json, json};

use super::job::layers;
use super::motion;
use super::pose::{Aim, Pose, rotation_of};
use crate::Failure;

/// A scene of a job.
pub struct JobScene {
    /// The file as the job has it.
    pub name: String,
    pub path: PathBuf,
    /// The folder of its frames, if the job has several.
    pub folder: String,
    /// Where its camera is on the rig, if there is one.
    pub mount: Option<Mount>,
    /// The layers of its files; `None`: those by default.
    pub layers: Option<Vec<Layer>>,
    /// Those of flow.
    pub flow: Vec<Layer>,
}

/// The place of a camera on a rig, in the axes of the rig: x right, y down, z forward.
pub struct Mount {
    pub name: String,
    pose: Pose,
}

impl JobScene {
    /// A scene that has no layers yet.
    fn new(
        value: &Value,
        folder: &Path,
        own_folder: String,
        mount: Option<Mount>,
    ) -> Result<JobScene, Failure> {
        let name = value.text()?.to_owned();
        Ok(JobScene {
            path: folder.join(&name),
            name,
            folder: own_folder,
            mount,
            layers: None,
            flow: Vec::new(),
        })
    }
}

impl Mount {
    /// The pose of the camera when `rig` is where the rig is. `rig_pose`: its pose, if the job moves it.
    pub fn pose(&self, rig: &Camera, rig_pose: Option<Pose>) -> Pose {
        let rig_to_world = match rig_pose.and_then(|pose| pose.aim) {
            Some(Aim::Rotation(rotation)) => rotation,
            _ => rotation_of(rig),
        };
        Pose {
            position_m: rig.position_m + rig_to_world * self.pose.position_m,
            aim: Some(Aim::Rotation(rig_to_world * self.pose.rotation())),
            time_s: rig_pose.and_then(|pose| pose.time_s),
        }
    }

    /// For `dataset.json`: the extrinsics of the camera.
    pub fn description(&self) -> Json {
        json!({
            "name": self.name,
            "position_m": self.pose.position_m.to_array(),
            "rotation_xyzw": self.pose.rotation().to_array(),
        })
    }
}

/// Reads the scenes of `[job]`, or those that the cameras of `[[rig]]` see, with the layers that a camera has for itself.
pub fn scenes(job: &mut Keys, rig: Vec<Keys>, folder: &Path) -> Result<Vec<JobScene>, Failure> {
    if rig.is_empty() {
        let values = match job.take_one(&["scene", "scenes"])? {
            Some(("scenes", scenes)) => scenes.filled("name one or more")?.list()?,
            Some((_, scene)) => vec![scene],
            None => vec![job.need("scene", "scene = \"scene.toml\" or scenes = [...]")?],
        };
        let mut scenes = Vec::new();
        for value in values {
            let folder_name = folder_name(value.text()?);
            let hint = "give the files different names";
            let scene = JobScene::new(&value, folder, folder_name, None)?;
            add(&mut scenes, scene, &value, hint)?;
        }
        return Ok(scenes);
    }
    let hint = "give the scene of each camera in [[rig]], or one scene for all";
    job.refuse("scenes", "is not allowed beside [[rig]]", hint)?;
    let of_all = job.take("scene");
    let mut scenes = Vec::new();
    for mut keys in rig {
        keys.only(&["name", "scene", "position", "rotation", "layers"])?;
        let name = keys.need("name", "name = \"left\", for its folder")?;
        let text = name.text()?.to_owned();
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
        if text.is_empty() || !text.chars().all(is_plain) {
            let hint = "give letters, digits, - and _: it is the name of a folder";
            Err(name.error(format!("is \"{text}\""), hint))?;
        }
        let layers = layers(&mut keys)?;
        let own = keys.take("scene");
        let missing = || keys.error("[[rig]] has no \"scene\"", "add one, or scene to [job]");
        let scene = own.as_ref().or(of_all.as_ref()).ok_or_else(missing)?;
        let pose = Pose {
            position_m: keys
                .optional("position", Value::vec3)?
                .unwrap_or(DVec3::ZERO),
            aim: match keys.take("rotation") {
                Some(rotation) => Some(Aim::Rotation(motion::rotation(&rotation)?)),
                None => Some(Aim::Rotation(DQuat::IDENTITY)),
            },
            time_s: None,
        };
        let mount = Mount {
            name: text.clone(),
            pose,
        };
        let hint = "give each camera a name of its own";
        let value = scene;
        let scene = JobScene {
            layers,
            ..JobScene::new(value, folder, text, Some(mount))?
        };
        add(&mut scenes, scene, value, hint)?;
    }
    Ok(scenes)
}

fn add(
    scenes: &mut Vec<JobScene>,
    scene: JobScene,
    value: &Value,
    hint: &str,
) -> Result<(), Failure> {
    let JobScene { name, path, .. } = &scene;
    if scenes.iter().any(|other| other.folder == scene.folder) {
        let problem = match &scene.mount {
            None => format!("names \"{name}\", and another scene has the same file name"),
            Some(mount) => format!(
                "is for the camera \"{}\", and another one has this name",
                mount.name
            ),
        };
        return Err(value.error(problem, hint).into());
    }
    if !path.exists() {
        let problem = format!("names {}, which does not exist", path.display());
        let hint = "check the path, which is relative to the job file";
        return Err(value.error(problem, hint).into());
    }
    scenes.push(scene);
    Ok(())
}

/// The folder for the frames of a scene, by its name in the job: the name of its file, or of the folder of a file `scene.toml`, as saved
/// scenes are called.
fn folder_name(scene: &str) -> String {
    let path = Path::new(scene);
    let saved_in = path.parent().and_then(Path::file_name);
    let name = match saved_in {
        Some(folder) if path.ends_with("scene.toml") => Some(folder),
        _ => path.file_stem(),
    };
    name.unwrap_or_default().to_string_lossy().into_owned()
}
