//! The frames of a job: what each one shows, and the scene that it is rendered from.

use std::path::{Path, PathBuf};

use camlux::glam::{DMat3, DMat4, DQuat, DVec3};
use camlux::output::{Attribute, FLOW_LAYERS, Layer, describe_frame, plain_path};
use camlux::scene::{Camera, IndirectLight};
use camlux::{Scene, engine_hash};
use serde_json::{Map, Value, json};

use super::blur::is_averaged;
use super::draws::Draws;
use super::job::Job;
use super::pose::{Aim, Pose, rotation_of};
use super::rig::JobScene;
use super::timing::{self, Image};
use crate::options::warn_of;
use crate::output::with_warnings;
use crate::{Failure, warn};

/// A job with its scenes.
pub struct Frames {
    pub job: Job,
    pub scenes: Vec<LoadedScene>,
    /// Hash of everything that all frames share.
    shared_hash: blake3::Hasher,
}

pub struct LoadedScene {
    /// The name as the job has it.
    pub name: String,
    pub hash: String,
    /// The folder of its frames, below the data set's folder; empty if the job has only one scene.
    pub folder: String,
    /// The scene from its file, at the job's size, and after its own textures those of the job.
    pub scene: Scene,
    /// From its file.
    as_loaded: Scene,
    own_textures: usize,
}

/// One frame, before it is rendered.
pub struct Planned {
    pub index: u64,
    /// Position and attitude, metres and a unit quaternion.
    pub camera_pose: (DVec3, DQuat),
    /// Path below the data set's folder. Plain files have the names of their layers as well.
    pub file: String,
    has_depth_png: bool,
    /// The layers with plain files; empty: all layers are in one file.
    plain_layers: Vec<Layer>,
    /// The layers of its file; `None`: all.
    pub layers: Option<Vec<Layer>>,
    /// BLAKE3 of everything that the image and its file depend on.
    pub inputs: String,
    /// Its description in the manifest.
    pub description: Value,
    /// The scene at the beginning of the frame.
    pub begin: Moment,
    /// Its layers of flow.
    pub flow: Vec<Layer>,
    /// The next and the previous frame of the sequence, where there is one that a layer of flow needs.
    pub others: [Option<Moment>; 2],
    /// What is exposed while something moves.
    pub exposed: Exposed,
    /// Name and time of each phase image, in seconds from the frame's beginning, if the job has times.
    phase_starts_s: Vec<(String, f64)>,
}

/// The scene at the times of the exposures; empty if nothing moves during them.
#[derive(Default)]
pub struct Exposed {
    /// For a frame without time of flight.
    pub frame: Vec<Moment>,
    /// For each phase image.
    pub phase_images: Vec<(Image, Vec<Moment>)>,
}

impl Exposed {
    fn moments(&self) -> impl Iterator<Item = &Moment> {
        let of_images = self.phase_images.iter().flat_map(|(_, moments)| moments);
        self.frame.iter().chain(of_images)
    }
}

/// One of the frames of a scene.
#[derive(Clone, Copy)]
struct Place {
    scene: usize,
    number: u64,
}

/// The scene at one time.
pub struct Moment {
    scene_index: usize,
    /// Its meshes are still where the scene has them.
    scene: Scene,
    mesh_poses: Vec<(usize, DVec3, DQuat)>,
    camera_pose: Option<Pose>,
}

impl Frames {
    pub fn load(job: Job) -> Result<Frames, Failure> {
        let mut scenes: Vec<LoadedScene> = Vec::new();
        for (number, of_job) in job.scenes.iter().enumerate() {
            let JobScene { name, path, .. } = of_job;
            let mut scene = match job.scenes[..number].iter().position(|s| s.path == *path) {
                Some(same) => scenes[same].as_loaded.clone(),
                None => Scene::load(path)?,
            };
            share_meshes(&mut scene, &scenes);
            let as_loaded = scene.clone();
            if of_job.mount.is_some() {
                set_apart(&mut scene, number as u64);
            }
            if let Some(size_px) = job.size_px {
                scene.camera = scene.camera.resized(size_px);
            }
            if let Some(target_error) = job.target_error {
                set_target_error(&mut scene, target_error, name)?;
            }
            warn_of(&scene, name);
            let layers = of_job.layers.iter().flatten();
            for layer in layers.filter(|layer| layer.is_rendered()) {
                layer.check_made_for(&scene)?;
            }
            if let Some(timing) = &job.timing {
                timing.check(&scene, name)?;
            }
            job.changes.check(&scene)?;
            let folder = match (job.scenes.len(), job.has_rig) {
                (1, false) => String::new(),
                _ => format!("{}/", of_job.folder),
            };
            let hash = scene.hash();
            let own_textures = scene.textures.len();
            let textures = &job.changes.textures.textures;
            scene.textures.extend(textures.iter().cloned());
            let loaded = LoadedScene {
                name: name.clone(),
                hash,
                folder,
                scene,
                as_loaded,
                own_textures,
            };
            loaded.warn_of_draws(&job);
            scenes.push(loaded);
        }
        let mut shared_hash = blake3::Hasher::new();
        shared_hash.update(engine_hash().as_bytes());
        let files = (&job.exr, job.format, job.has_depth_png);
        shared_hash.update(format!("{files:?}").as_bytes());
        if !job.changes.textures.textures.is_empty() {
            let textures = job.changes.textures.hasher.finalize();
            shared_hash.update(textures.as_bytes());
        }
        for images in &job.changes.light_images {
            shared_hash.update(images.digest().as_bytes());
        }
        if let Some(timing) = &job.timing {
            shared_hash.update(format!("{timing:?}").as_bytes());
        }
        let frames = Frames {
            job,
            scenes,
            shared_hash,
        };
        frames.warn_of_left_lights();
        Ok(frames)
    }

    /// Warns of a time-of-flight camera that leaves a light behind which its scene has at the lens.
    fn warn_of_left_lights(&self) {
        /// Frames of each scene to check, evenly spread.
        const CHECKED: u64 = 16;
        let count = self.count_in_scene();
        let step = count.div_ceil(CHECKED).max(1) as usize;
        for (number, loaded) in self.scenes.iter().enumerate() {
            let mut lights = loaded.scene.fixed_lights_at_lens();
            let moved = &self.job.changes.lights;
            lights.retain(|light| moved.iter().all(|(moved, _)| moved != light));
            if lights.is_empty() {
                continue;
            }
            let mut left = (0..count).step_by(step).filter_map(|frame| {
                let place = Place {
                    scene: number,
                    number: frame,
                };
                let still_there = self.moment(place, 0.0).scene.fixed_lights_at_lens();
                lights.iter().find(|light| !still_there.contains(light))
            });
            if let Some(light) = left.next() {
                warn(format_args!(
                    "{}: light {light} is at the lens of the time-of-flight camera, and stays there when this job moves the camera; if it is part of the camera, give it relative_to = \"camera\" and its position in the camera's axes",
                    loaded.name
                ));
            }
        }
    }

    /// Number of frames of one scene.
    pub fn count_in_scene(&self) -> u64 {
        let sweeps = self.job.changes.sweeps.iter();
        let steps = sweeps.map(|sweep| sweep.len() as u64);
        u64::from(self.job.frame_count) * steps.product::<u64>()
    }

    pub fn count(&self) -> u64 {
        self.count_in_scene() * self.scenes.len() as u64
    }

    /// The index of the frame's scene.
    pub fn scene_index(&self, index: u64) -> usize {
        self.place(index).scene
    }

    /// Where a frame is. The cameras of a rig take turns, so that they share what does not change between them.
    fn place(&self, index: u64) -> Place {
        let (scene, number) = if self.job.has_rig {
            let cameras = self.scenes.len() as u64;
            (index % cameras, index / cameras)
        } else {
            (index / self.count_in_scene(), index % self.count_in_scene())
        };
        Place {
            scene: scene as usize,
            number,
        }
    }

    /// The scene in a frame, or `later` after its beginning, as a fraction of the time to the next frame.
    fn moment(&self, place: Place, later: f64) -> Moment {
        let changes = &self.job.changes;
        let Place {
            scene: scene_index,
            number,
        } = place;
        let frame = (number % u64::from(self.job.frame_count)) as u32;
        let loaded = &self.scenes[scene_index];
        // Scenes of one job show the same thing in the same frame, such as to a colour and to a time-of-flight camera.
        let drawn_for = match self.job.draws_per_scene {
            true => number + scene_index as u64 * self.count_in_scene(),
            false => number,
        };
        let draws = |purpose: &str| Draws::new(self.job.seed, drawn_for, purpose);

        let mut scene = loaded.scene.clone();
        let mut step = (number / u64::from(self.job.frame_count)) as usize;
        for sweep in changes.sweeps.iter().rev() {
            sweep.apply(&mut scene, step % sweep.len(), draws);
            step /= sweep.len();
        }
        for change in &changes.values {
            change.apply(&mut scene, frame as usize, draws);
        }
        for images in &changes.light_images {
            images.apply(&mut scene, frame as usize);
        }
        for drawn in &changes.materials {
            let materials = scene.materials.iter_mut().filter(|m| drawn.is_of(m));
            materials.for_each(|material| drawn.apply(material, loaded.own_textures, draws));
        }
        for (light, motion) in &changes.lights {
            let pose = motion.pose(frame, later, draws(&format!("light {light}")));
            scene.lights[*light].light = pose.light(&scene.lights[*light]);
        }
        let camera = changes.camera.as_ref();
        let mut camera_pose = camera.map(|motion| motion.pose(frame, later, draws("camera")));
        let mount = self.job.scenes[scene_index].mount.as_ref();
        let own_camera = scene.camera;
        if mount.is_some() {
            // The first camera's scene says where the rig is, unless the job moves it.
            scene.camera = self.scenes[0].scene.camera;
        }
        if let Some(pose) = &camera_pose {
            scene.camera = pose.camera(&scene.camera);
        }
        let meshes = changes.meshes.iter().map(|(mesh, motion)| {
            let pose = motion.pose(frame, later, draws(&format!("mesh {mesh}")));
            (*mesh, pose.position_m, pose.rotation())
        });
        let mesh_poses: Vec<_> = meshes.collect();
        for &(mesh, position_m, rotation) in &mesh_poses {
            let rotation = DMat3::from_quat(rotation);
            scene.carry_lights(mesh, rotation, position_m);
        }
        // Lights relative to the camera are relative to the rig.
        let mut scene = scene.in_world().into_owned();
        if let Some(mount) = mount {
            let pose = mount.pose(&scene.camera, camera_pose);
            scene.camera = pose.camera(&own_camera);
            camera_pose = Some(pose);
        }
        Moment {
            scene_index,
            mesh_poses,
            camera_pose,
            scene,
        }
    }

    pub fn plan(&self, index: u64) -> Planned {
        let place = self.place(index);
        let begin = self.moment(place, 0.0);
        let Moment {
            scene_index,
            scene,
            mesh_poses,
            camera_pose: camera,
        } = &begin;
        let loaded = &self.scenes[*scene_index];
        let of_job = &self.job.scenes[*scene_index];
        let number = place.number;
        let rotation = match camera.and_then(|pose| pose.aim) {
            Some(Aim::Rotation(rotation)) => rotation,
            _ => rotation_of(&scene.camera),
        };
        let (mut exposed, mut phase_starts_s) = (Exposed::default(), Vec::new());
        if let (Some(timing), Some(sensor)) = (&self.job.timing, scene.sensor) {
            let exposure_s = sensor.exposure_time_s;
            let moments = |start_s| -> Vec<Moment> {
                let samples = timing.samples(start_s, exposure_s);
                samples.map(|later| self.moment(place, later)).collect()
            };
            match &scene.tof {
                None => exposed.frame = moments(0.0),
                Some(tof) => {
                    for image in timing::images(tof) {
                        let timing::Image { frequency, phase } = image;
                        let name = format!("tof{frequency}.phase{phase}.start_s");
                        let start_s = timing.start_s(tof, exposure_s, image);
                        phase_starts_s.push((name, start_s));
                        exposed.phase_images.push((image, moments(start_s)));
                    }
                }
            }
        }
        let poses = begin.poses();
        if exposed.moments().all(|moment| moment.poses() == poses) {
            exposed = Exposed::default();
        }

        let mut description = json!({
            "scene": loaded.name,
            "frame": number,
            "time_s": camera.and_then(|pose| pose.time_s),
        });
        if let Some(mount) = &of_job.mount {
            description["camera_name"] = json!(mount.name);
        }
        let described = describe_frame(scene, &loaded.scene, rotation, mesh_poses);
        described
            .into_iter()
            .for_each(|(key, value)| description[key] = value);
        description["seed"] = json!(self.job.seed);
        let length = u64::from(self.job.frame_count);
        let step = number % length;
        let neighbour = |number| Place { number, ..place };
        let needs = FLOW_LAYERS.map(|of| of.iter().any(|layer| of_job.flow.contains(layer)));
        let others = [
            (needs[0] && step + 1 < length).then(|| self.moment(neighbour(number + 1), 0.0)),
            (needs[1] && step > 0).then(|| self.moment(neighbour(number - 1), 0.0)),
        ];
        let mut hasher = self.shared_hash.clone();
        hasher.update(format!("{:?}", (&of_job.layers, &of_job.flow)).as_bytes());
        hasher.update(loaded.hash.as_bytes());
        hasher.update(description.to_string().as_bytes());
        for moment in exposed.moments().chain(others.iter().flatten()) {
            hasher.update(moment.poses().as_bytes());
        }
        Planned {
            index,
            camera_pose: (scene.camera.position_m, rotation),
            file: {
                let extension = self.job.format.name();
                format!("frames/{}{number:06}.{extension}", loaded.folder)
            },
            has_depth_png: self.job.has_depth_png,
            plain_layers: match self.job.exr.plain {
                true => self.job.layers_of(of_job, &loaded.scene),
                false => Vec::new(),
            },
            layers: of_job.layers.clone(),
            inputs: hasher.finalize().to_hex().to_string(),
            description,
            begin,
            flow: of_job.flow.clone(),
            others,
            exposed,
            phase_starts_s,
        }
    }
}

impl LoadedScene {
    /// Warns of probable mistakes in the brightest values that a job draws, such as materials that reflect more than they receive.
    fn warn_of_draws(&self, job: &Job) {
        let mut scene = self.scene.clone();
        for drawn in &job.changes.materials {
            let materials = scene.materials.iter_mut().filter(|m| drawn.is_of(m));
            materials.for_each(|material| drawn.apply_brightest(material, self.own_textures));
        }
        let known = self.scene.warnings();
        for warning in scene.warnings().iter().filter(|w| !known.contains(w)) {
            warn(format_args!("{}: {warning}", self.name));
        }
    }
}

/// Lets a scene share those meshes that scenes before it have as well, so that these are stored once.
fn share_meshes(scene: &mut Scene, before: &[LoadedScene]) {
    for instance in &mut scene.meshes {
        let mut known = before.iter().flat_map(|loaded| &loaded.scene.meshes);
        if let Some(same) = known.find(|other| other.mesh == instance.mesh) {
            instance.mesh = same.mesh.clone();
        }
    }
}

/// Makes the sensor of a rig's camera another one than those before it, by the seed of its noise.
fn set_apart(scene: &mut Scene, number: u64) {
    let of_sensor = scene
        .sensor
        .as_mut()
        .and_then(|sensor| sensor.noise.as_mut());
    let of_tof = scene.tof.as_mut().and_then(|tof| tof.noise.as_mut());
    for noise in of_sensor.into_iter().chain(of_tof) {
        noise.seed = noise.seed.wrapping_add(number);
    }
}

/// As `camlux render --target-error`.
fn set_target_error(scene: &mut Scene, requested: f64, name: &str) -> Result<(), Failure> {
    match &mut scene.indirect {
        None => scene.indirect = Some(IndirectLight::final_gather(requested)),
        Some(IndirectLight::FinalGather(gather)) => gather.target_error = requested,
        Some(other) => {
            return Err(format!(
                "[job] has a target_error, but {name} computes indirect light by {}, which has none; leave it out, or set estimator = \"final-gather\" there",
                other.name()
            )
            .into());
        }
    }
    Ok(())
}

impl Moment {
    pub fn camera(&self) -> &Camera {
        &self.scene.camera
    }

    pub fn mesh_count(&self) -> usize {
        self.scene.meshes.len()
    }

    /// The meshes that move: index, position and rotation.
    pub fn mesh_poses(&self) -> &[(usize, DVec3, DQuat)] {
        &self.mesh_poses
    }

    /// A text with the poses of everything that can move.
    fn poses(&self) -> String {
        let Scene { camera, lights, .. } = &self.scene;
        // Leaves out patterns: they may be large and do not move.
        let lights = lights
            .iter()
            .map(|light| (light.kind(), light.parameters()));
        let lights: Vec<_> = lights.collect();
        format!("{camera:?} {lights:?} {:?}", self.mesh_poses)
    }

    /// The scene to render, with its meshes in their places.
    pub fn scene(&self) -> Scene {
        let mut scene = self.scene.clone();
        for &(index, position_m, rotation) in &self.mesh_poses {
            scene.meshes[index] = scene.meshes[index].posed(rotation, position_m);
        }
        scene
    }
}

impl Planned {
    /// The layers that rendering the frame's scene has to read: those of its file, and what warnings look at. `None`: those by default.
    pub fn layers_to_read(&self, scene: &Scene) -> Option<Vec<Layer>> {
        let mut layers = self.layers.clone()?;
        if self.has_depth_png {
            layers.push(Layer::Depth);
        }
        let is_made_of_others = !self.flow.is_empty() || self.exposed.moments().next().is_some();
        let layers = match is_made_of_others {
            true => Layer::made_for(scene, &layers),
            false => layers,
        };
        Some(with_warnings(&layers, scene))
    }

    /// The layers on request that motion blur averages.
    pub fn averaged_on_request(&self) -> Vec<Layer> {
        let layers = self.layers.iter().flatten().copied();
        let averaged = layers.filter(|&layer| is_averaged(layer) && layer.is_on_request());
        averaged.collect()
    }

    /// The attributes that the header of its file has in addition to those of the frame.
    pub fn attributes(&self) -> Vec<(String, Attribute)> {
        let frame = i32::try_from(self.index).unwrap_or(i32::MAX);
        let frame = ("batch.frame".to_owned(), Attribute::Int(frame));
        let poses = self.begin.mesh_poses.iter();
        let meshes = poses.map(|&(mesh, position_m, rotation)| {
            let to_world = DMat4::from_rotation_translation(rotation, position_m);
            let matrix = Attribute::Matrix4(to_world.to_cols_array());
            (format!("mesh.{mesh}.toWorld"), matrix)
        });
        let starts = self.phase_starts_s.iter();
        let starts = starts.map(|(name, start_s)| (name.clone(), Attribute::Number(*start_s)));
        [frame].into_iter().chain(meshes).chain(starts).collect()
    }

    /// The plain file of each layer, below the data set's folder; none if all layers are in one file.
    pub fn plain_files(&self) -> Map<String, Value> {
        let files = self.plain_layers.iter().map(|&layer| {
            let file = plain_path(self.file.as_ref(), layer);
            (layer.name().to_owned(), json!(file.to_string_lossy()))
        });
        files.collect()
    }

    /// The files of the frame, in the order in which they are hashed.
    pub fn paths(&self, folder: &Path) -> Vec<PathBuf> {
        let path = folder.join(&self.file);
        let mut paths: Vec<PathBuf> = match &self.plain_layers[..] {
            [] => vec![path],
            layers => {
                let paths = layers.iter().map(|&layer| plain_path(&path, layer));
                paths.collect()
            }
        };
        paths.extend(self.depth_png().map(|file| folder.join(file)));
        paths
    }

    /// The PNG of its depth, below the data set's folder.
    pub fn depth_png(&self) -> Option<PathBuf> {
        let path = Path::new(&self.file).with_extension("depth.png");
        self.has_depth_png.then_some(path)
    }

    /// The file that holds the layer.
    pub fn path_of(&self, layer: Layer, folder: &Path) -> PathBuf {
        let path = folder.join(&self.file);
        match self.plain_layers.is_empty() {
            true => path,
            false => plain_path(&path, layer),
        }
    }
}
