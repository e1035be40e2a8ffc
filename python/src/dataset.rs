//! What `camlux.DatasetWriter` needs of the engine.

use std::fs::File;
use std::path::PathBuf;

use camlux::glam::{DMat3, DMat4, DQuat, DVec3};
use camlux::output;
use camlux::output::{
    Attribute, DATASET_FORMAT, ExrOptions, FLOW_LAYERS, FileFormat, Layer, LayerNeed, OtherFrame,
    dataset_conventions, describe_frame, describe_scene, flow_layers, write_frame_files,
};
use camlux::scene::IndirectLight;
use pyo3::prelude::*;
use serde_json::{Value, json};

use crate::arguments::layers;
use crate::errors::{ArgumentError, raised};
use crate::frame::{Frame, compression_named};
use crate::scene::scene_from;

/// The largest difference from a rotation that rounding explains.
const ROUNDING: f64 = 1e-9;

/// A scene as it was at one time.
#[pyclass(module = "camlux", frozen)]
pub struct SceneState(pub camlux::Scene);

#[pymethods]
impl SceneState {
    #[new]
    fn new(scene: &Bound<'_, PyAny>) -> PyResult<Self> {
        let scene = scene_from(scene)?;
        scene.validate().map_err(raised)?;
        Ok(SceneState(scene))
    }

    #[getter]
    fn hash(&self, py: Python) -> String {
        py.detach(|| self.0.hash())
    }

    /// Its surfaces and its camera, without light.
    fn geometry(&self) -> SceneState {
        SceneState(self.0.geometry())
    }

    /// Camera, lights, moved meshes and changed materials for the manifest, as JSON. `base`: the scene at the beginning.
    fn describe(&self, base: &SceneState) -> String {
        let scene = self.0.in_world();
        let camera = scene.camera.basis();
        let axes = camera.matrix();
        let rotation = DQuat::from_mat3(&axes);
        let poses: Vec<_> = self.moves_since(base).filter_map(pose).collect();
        let described = describe_frame(&scene, &base.0, rotation, &poses);
        Value::Object(described).to_string()
    }
}

impl SceneState {
    /// The meshes that have moved as a whole: index, and transform in the world.
    fn moves_since(&self, base: &SceneState) -> impl Iterator<Item = (usize, DMat4)> {
        let meshes = base.0.meshes.iter().zip(&self.0.meshes).enumerate();
        meshes.filter_map(|(index, (before, now))| {
            let moved = before.to_world != now.to_world;
            moved.then(|| {
                let [before, now] = [before, now].map(|mesh| DMat4::from(mesh.to_world));
                // Of a mesh that was where its positions are, every digit is kept.
                match before == DMat4::IDENTITY {
                    true => (index, now),
                    false => (index, now * before.inverse()),
                }
            })
        })
    }

    /// How each mesh moves to another frame. NaN for another mesh.
    fn moves_to(&self, other: &SceneState) -> Vec<Option<DMat4>> {
        let mut moves = vec![Some(DMat4::NAN); self.0.meshes.len()];
        let meshes = self.0.meshes.iter().zip(&other.0.meshes);
        for (moved, (now, other)) in moves.iter_mut().zip(meshes) {
            if now.mesh == other.mesh {
                let [before, after] = [now, other].map(|mesh| DMat4::from(mesh.to_world));
                *moved = (before != after).then(|| after * before.inverse());
            }
        }
        moves
    }
}

/// Position and rotation of a move that neither stretches nor mirrors.
fn pose((index, moved): (usize, DMat4)) -> Option<(usize, DVec3, DQuat)> {
    let linear = DMat3::from_mat4(moved);
    let error = linear * linear.transpose() - DMat3::IDENTITY;
    let is_rotation = error.to_cols_array().iter().all(|e| e.abs() < ROUNDING);
    (is_rotation && linear.determinant() > 0.0)
        .then(|| (index, moved.w_axis.truncate(), DQuat::from_mat3(&linear)))
}

/// The next or the previous frame, and what it shows if occlusion needs that.
type Other<'py> = Option<(Bound<'py, SceneState>, Option<Bound<'py, Frame>>)>;

/// How the frames of a data set are written.
#[pyclass(module = "camlux", frozen)]
pub struct DatasetOptions {
    exr: ExrOptions,
    format: FileFormat,
    has_depth_png: bool,
    flow: Vec<Layer>,
}

#[pymethods]
impl DatasetOptions {
    #[new]
    #[allow(clippy::too_many_arguments, reason = "Python's have names")]
    fn new(
        flow: bool,
        layers: Option<Bound<'_, PyAny>>,
        half: bool,
        compression: Option<&str>,
        plain: bool,
        multipart: bool,
        format: &str,
        has_depth_png: bool,
    ) -> PyResult<Self> {
        let mut formats = FileFormat::ALL.into_iter();
        let known = formats.find(|known| known.name() == format);
        let format = known.ok_or_else(|| {
            let problem = format!("format is \"{format}\"; give \"exr\" or \"npz\"");
            ArgumentError::new_err(problem)
        })?;
        if plain && format == FileFormat::Npz {
            let problem = "plain is True, in npz files; leave out one of them: only OpenEXR files can be plain";
            return Err(ArgumentError::new_err(problem));
        }
        if multipart && format == FileFormat::Npz {
            let problem = "multipart is True, in npz files; leave out one of them: only OpenEXR files have parts";
            return Err(ArgumentError::new_err(problem));
        }
        if multipart && plain {
            return Err(ArgumentError::new_err(
                "plain and multipart are True; leave out one of them: a plain file has one part",
            ));
        }
        let compression = compression.map(compression_named).transpose()?;
        let compression = compression.unwrap_or(format.usual_compression());
        if !format.compressions().contains(&compression) {
            return Err(ArgumentError::new_err(format!(
                "compression is \"{}\", in npz files; give \"none\" or \"zip\", which numpy reads",
                compression.name()
            )));
        }
        let mut exr = ExrOptions {
            half,
            layers: layers.map(|names| self::layers(&names)).transpose()?,
            compression,
            plain,
            multipart,
            ..ExrOptions::default()
        };
        let flow = flow_layers(&mut exr.layers, flow);
        Ok(DatasetOptions {
            exr,
            format,
            has_depth_png,
            flow,
        })
    }

    /// Whether layers are of flow to the next frame, and to the previous one; and whether they tell what those hide.
    #[getter]
    fn flow(&self) -> [(bool, bool); 2] {
        FLOW_LAYERS.map(|layers| {
            let has = |layer: &Layer| self.flow.contains(layer);
            (layers.iter().any(has), has(&layers[2]))
        })
    }

    /// The layers that are named and that a render has, and that of the PNG. The others are of a sequence.
    #[getter]
    fn rendered_layers(&self) -> Vec<&'static str> {
        let named = self.exr.layers.iter().flatten();
        let rendered = named.filter(|layer| layer.need() != LayerNeed::Sequence);
        let depth = self.has_depth_png.then_some(&Layer::Depth);
        rendered.chain(depth).map(|layer| layer.name()).collect()
    }

    /// The layers that a frame is rendered with if the loop does not say it; None: those that it has by default.
    fn layers_to_render(&self, state: &SceneState, is_indirect: bool) -> Option<Vec<&'static str>> {
        let layers = self.exr.layers.as_ref()?;
        let is_rendered = |layer: &Layer| layer.need() != LayerNeed::Sequence;
        let layers: Vec<Layer> = layers.iter().copied().filter(is_rendered).collect();
        let is_default = layers.iter().all(|layer| !layer.is_on_request());
        let scene = with_indirect(&state.0, is_indirect);
        let made = Layer::made_for(&scene, &layers);
        (!is_default).then(|| made.into_iter().map(Layer::name).collect())
    }

    /// Refuses layers that a frame of the scene will not have. `is_indirect`: the frame has indirect light, even if the scene has none.
    fn check(&self, state: &SceneState, is_indirect: bool) -> PyResult<()> {
        let scene = with_indirect(&state.0, is_indirect);
        let mut layers = self.exr.layers.iter().flatten();
        let is_made = layers.try_for_each(|layer| match layer.need() {
            LayerNeed::Sequence => Ok(()),
            _ => layer.check_made_for(&scene),
        });
        is_made.map_err(raised)
    }

    /// The contents of dataset.json that do not depend on the number of frames, as JSON.
    fn describe(&self, base: &SceneState) -> String {
        let mut scene = json!({ "file": "scene", "hash": base.0.hash(), "frames": "frames/" });
        let described = describe_scene(&base.0, &self.exr, !self.flow.is_empty(), None);
        described
            .into_iter()
            .for_each(|(key, value)| scene[key] = value);
        let object = json!({
            "format": DATASET_FORMAT,
            "camlux_version": env!("CARGO_PKG_VERSION"),
            "engine_hash": camlux::engine_hash(),
            "job": null,
            "scenes": [scene],
            "frame_count": null,
            "frames_per_scene": null,
            "seed": null,
            "compression": self.exr.compression.name(),
            "half": self.exr.half,
            "plain": self.exr.plain,
            "multipart": self.exr.multipart,
            "file_format": self.format.name(),
            "depth_png": self.has_depth_png,
            "time": null,
            "conventions": dataset_conventions(),
        });
        object.to_string()
    }

    /// Writes the file of a frame, or its plain files, and the PNG of its depth. Returns their paths, the hash, the size and warnings.
    #[allow(clippy::too_many_arguments, reason = "the parts of a frame")]
    fn write(
        &self,
        py: Python,
        path: PathBuf,
        index: u32,
        frame: &Bound<'_, Frame>,
        state: &SceneState,
        base: &SceneState,
        others: [Other; 2],
    ) -> PyResult<(Vec<PathBuf>, String, u64, Vec<String>)> {
        let rendered = frame.as_super().get().frame()?;
        let [next, previous] = &others;
        let others = [other_from(next)?, other_from(previous)?];
        let written = py.detach(|| {
            let mut exr = self.exr.clone();
            let number = i32::try_from(index).unwrap_or(i32::MAX);
            let number = ("batch.frame".to_owned(), Attribute::Int(number));
            let meshes = state.moves_since(base).map(|(mesh, moved)| {
                let matrix = Attribute::Matrix4(moved.to_cols_array());
                (format!("mesh.{mesh}.toWorld"), matrix)
            });
            exr.attributes = [number].into_iter().chain(meshes).collect();
            let with_flow = (!self.flow.is_empty()).then(|| {
                let moves = others.map(|other| other.map(|(other, _)| state.moves_to(other)));
                let others = [0, 1].map(|i| {
                    let ((other, shown), mesh_moves) = others[i].zip(moves[i].as_deref())?;
                    Some(OtherFrame {
                        camera: &other.0.camera,
                        mesh_moves,
                        shown,
                    })
                });
                let mut frame = rendered.clone();
                frame.add_flow(&state.0.camera, &self.flow, others);
                frame
            });
            let frame = with_flow.as_ref().unwrap_or(rendered);
            let (written, of_files) =
                write_frame_files(&path, frame, self.format, &exr, self.has_depth_png)?;
            let warnings = [frame.warnings(), of_files].concat();
            Ok((written.files, written.blake3, written.bytes, warnings))
        });
        written.map_err(raised)
    }
}

fn other_from<'o>(
    other: &'o Other<'_>,
) -> PyResult<Option<(&'o SceneState, Option<&'o output::Frame>)>> {
    let Some((state, shown)) = other else {
        return Ok(None);
    };
    let shown = shown.as_ref().map(|shown| shown.as_super().get().frame());
    Ok(Some((state.get(), shown.transpose()?)))
}

/// The scene with indirect light, if the frame has it.
fn with_indirect(scene: &camlux::Scene, is_indirect: bool) -> camlux::Scene {
    let mut scene = scene.clone();
    if is_indirect && scene.indirect.is_none() {
        scene.indirect = Some(IndirectLight::final_gather(1.0));
    }
    scene
}

/// The hash of files one after the other; None if one cannot be read.
#[pyfunction]
pub fn hash_files(py: Python, paths: Vec<PathBuf>) -> Option<String> {
    py.detach(|| {
        let mut hasher = blake3::Hasher::new();
        for path in paths {
            hasher.update_reader(File::open(path).ok()?).ok()?;
        }
        Some(hasher.finalize().to_hex().to_string())
    })
}
