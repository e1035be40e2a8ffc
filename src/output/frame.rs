//! The result of a render: named layers of pixels, how they were computed, and what it cost.

use crate::error::{Error, Result};
use crate::scene::{Camera, IndirectLight, Light, Scene, Sensor};

/// A quantity that a frame holds for each pixel. P is the surface point seen at the pixel centre, C the camera centre.
///
/// Background pixels (no P) hold 0, except `depth` and `range`, which hold +∞.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layer {
    /// L*_{P→C} = direct + indirect, W/sr/m², channels R, G, B. Numerically also E_C, the irradiance at the pixel, W/m².
    Radiance,
    /// L_{P→C} = Σ over lights of f_P(l, n_P, v) · L_{L→P} · cosθ_{P→L} · V(L,P), W/sr/m², channels R, G, B.
    Direct,
    /// Single bounce over the reflective shadow maps by the [`IndirectLight`](crate::scene::IndirectLight) that
    /// [`FrameDescription::indirect`] names, W/sr/m², channels R, G, B.
    Indirect,
    /// Standard error of `indirect`, and so of `radiance`, W/sr/m², channels R, G, B: only a reference image has it.
    StandardError,
    /// Q_C = E_C · SensorPixelArea · SignalDutyCycle · ExposureTime, joules, channels R, G, B.
    Energy,
    /// P in world space, metres, channels X, Y, Z; rounded to f32, so at 10⁵ m from the origin it has steps of 8 mm,
    /// where `depth` and `range` keep theirs.
    Position,
    /// n_P in world space, unit length, on the side of the camera, channels X, Y, Z.
    Normal,
    /// Component of P − C along the viewing axis, metres.
    Depth,
    /// |P − C|, metres.
    Range,
    /// 0: background, else 1 + index into [`Scene::meshes`].
    InstanceId,
    /// 0: background, else 1 + index into [`Scene::materials`].
    MaterialId,
    /// 1: the pixel's centre lies within 1/128 pixel of an edge, so that rounding decides which of two surfaces it shows; else
    /// 0. Only a reference image has it, and [`Comparison`](crate::metrics::Comparison) can leave these pixels out.
    Edge,
}

impl Layer {
    /// Every layer, in the order of the documentation.
    pub const ALL: [Layer; 12] = [
        Layer::Radiance,
        Layer::Direct,
        Layer::Indirect,
        Layer::StandardError,
        Layer::Energy,
        Layer::Position,
        Layer::Normal,
        Layer::Depth,
        Layer::Range,
        Layer::InstanceId,
        Layer::MaterialId,
        Layer::Edge,
    ];

    /// The name in OpenEXR files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Layer::Radiance => "radiance",
            Layer::Direct => "direct",
            Layer::Indirect => "indirect",
            Layer::StandardError => "stderr",
            Layer::Energy => "energy",
            Layer::Position => "P",
            Layer::Normal => "N",
            Layer::Depth => "depth",
            Layer::Range => "range",
            Layer::InstanceId => "id.instance",
            Layer::MaterialId => "id.material",
            Layer::Edge => "edge",
        }
    }

    /// The layer of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|layer| layer.name() == name)
    }

    /// Full OpenEXR channel names, in the order in which [`LayerData`] interleaves them.
    pub fn channel_names(self) -> &'static [&'static str] {
        match self {
            Layer::Radiance => &["radiance.R", "radiance.G", "radiance.B"],
            Layer::Direct => &["direct.R", "direct.G", "direct.B"],
            Layer::Indirect => &["indirect.R", "indirect.G", "indirect.B"],
            Layer::StandardError => &["stderr.R", "stderr.G", "stderr.B"],
            Layer::Energy => &["energy.R", "energy.G", "energy.B"],
            Layer::Position => &["P.X", "P.Y", "P.Z"],
            Layer::Normal => &["N.X", "N.Y", "N.Z"],
            Layer::Depth => &["depth.Z"],
            Layer::Range => &["range.Z"],
            Layer::InstanceId => &["id.instance"],
            Layer::MaterialId => &["id.material"],
            Layer::Edge => &["edge"],
        }
    }

    /// The unit of the values; "1" for a plain number.
    pub fn unit(self) -> &'static str {
        match self {
            Layer::Radiance | Layer::Direct | Layer::Indirect | Layer::StandardError => "W/sr/m^2",
            Layer::Energy => "J",
            Layer::Position | Layer::Depth | Layer::Range => "m",
            Layer::Normal | Layer::InstanceId | Layer::MaterialId | Layer::Edge => "1",
        }
    }

    /// Whether the values are whole numbers ([`LayerData::Id`]).
    pub fn is_id(self) -> bool {
        matches!(self, Layer::InstanceId | Layer::MaterialId | Layer::Edge)
    }

    /// Whether a frame of this scene has the layer: `energy` needs a sensor, `indirect` needs indirect light. No
    /// render has `stderr` or `edge`.
    pub fn is_made_for(self, scene: &Scene) -> bool {
        match self {
            Layer::Energy => scene.sensor.is_some(),
            Layer::Indirect => scene.indirect.is_some(),
            Layer::StandardError | Layer::Edge => false,
            _ => true,
        }
    }
}

/// The pixels of a layer, row by row from the top, channels interleaved: width · height · channels values.
#[derive(Debug, Clone, PartialEq)]
pub enum LayerData {
    Float(Vec<f32>),
    Id(Vec<u32>),
}

impl LayerData {
    fn len(&self) -> usize {
        match self {
            LayerData::Float(values) => values.len(),
            LayerData::Id(ids) => ids.len(),
        }
    }
}

/// One rendered frame.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Width, height.
    pub resolution_px: [u32; 2],
    pub layers: Vec<(Layer, LayerData)>,
    pub stats: FrameStats,
    pub description: FrameDescription,
}

impl Frame {
    /// The pixels of a layer; `None` where the frame has no such layer or it holds ids.
    pub fn values(&self, layer: Layer) -> Option<&[f32]> {
        match self.data(layer)? {
            LayerData::Float(values) => Some(values),
            LayerData::Id(_) => None,
        }
    }

    /// The ids of a layer; `None` where the frame has no such layer or it holds values.
    pub fn ids(&self, layer: Layer) -> Option<&[u32]> {
        match self.data(layer)? {
            LayerData::Id(ids) => Some(ids),
            LayerData::Float(_) => None,
        }
    }

    /// What is probably not meant and only the finished frame shows, one sentence each: nothing in view, a layer without light.
    /// [`Scene::warnings`] has what can be known before.
    pub fn warnings(&self) -> Vec<String> {
        let is_black = |layer| {
            let values = self.values(layer);
            values.is_some_and(|values| values.iter().all(|&value| value == 0.0))
        };
        let ids = self.ids(Layer::InstanceId);
        let warning = if ids.is_some_and(|ids| ids.iter().all(|&id| id == 0)) {
            "nothing is in view: every pixel shows the background; check the camera's position and look_at"
        } else if is_black(Layer::Radiance) {
            "no light reaches what is in view: the image is black; check where the lights are and what they shine at"
        } else if is_black(Layer::Indirect) {
            "no indirect light reaches what is in view: the layer indirect is black, and its error is not estimated"
        } else {
            return Vec::new();
        };
        vec![warning.into()]
    }

    pub(crate) fn data(&self, layer: Layer) -> Option<&LayerData> {
        let (_, data) = self.layers.iter().find(|(kind, _)| *kind == layer)?;
        Some(data)
    }

    /// Checks what the writers rely on, for a frame may have been put together by hand: some pixels, no layer twice, and
    /// in each layer as many values as its pixels have channels.
    ///
    /// # Errors
    /// [`Error::Output`] for `path`, naming the layer.
    pub(crate) fn check_for_output(&self, path: &std::path::Path) -> Result<()> {
        let refuse = |problem: String| {
            Err(Error::Output {
                path: path.to_owned(),
                problem,
                hint: "write a frame as the renderer returns it".into(),
            })
        };
        let [width, height] = self.resolution_px.map(|px| px as usize);
        if width == 0 || height == 0 || self.layers.is_empty() {
            return refuse(format!(
                "a frame of {width} x {height} pixels and {} layers is empty",
                self.layers.len()
            ));
        }
        for (index, (layer, data)) in self.layers.iter().enumerate() {
            let name = layer.name();
            let channels = layer.channel_names().len();
            if width
                .checked_mul(height)
                .and_then(|px| px.checked_mul(channels))
                != Some(data.len())
            {
                return refuse(format!(
                    "layer {name} has {} values where {width} x {height} pixels of {channels} are due",
                    data.len()
                ));
            }
            if layer.is_id() != matches!(data, LayerData::Id(_)) {
                return refuse(format!("layer {name} mixes up values and ids"));
            }
            if self.layers[..index]
                .iter()
                .any(|(earlier, _)| earlier == layer)
            {
                return refuse(format!("layer {name} is there twice"));
            }
        }
        Ok(())
    }
}

/// What a frame cost.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameStats {
    /// Name of the device that rendered it.
    pub device: String,
    /// Name and version of its driver.
    pub driver: String,
    /// In the order of execution.
    pub passes: Vec<PassTime>,
    /// Virtual point lights that carry flux, over all lights.
    pub vpl_count: u64,
    /// How many (pixel, VPL) pairs the gather evaluated.
    pub pixel_vpl_pairs: u64,
    /// Rays that the indirect light cast; 0 for plain sums.
    pub ray_count: u64,
    /// relRMSE of the indirect light against the true bounce, sqrt(Σ(x−t)²/Σt²), as the engine estimates it from the frame
    /// itself; `None` for sums over VPLs, whose error it cannot know, and where the indirect light is dark.
    pub estimated_error: Option<f64>,
    /// relRMSE of the indirect light against the sum over VPLs at every pixel, estimated likewise; `None` where no
    /// interpolation error was requested.
    pub estimated_interpolation_error: Option<f64>,
    /// Queue submissions of the passes.
    pub submissions: u32,
    /// From the call of the renderer to its return.
    pub wall_milliseconds: f64,
}

impl FrameStats {
    /// Pairs over the GPU time of the pass named `gather`; `None` without such a pass, or where it took no time.
    pub fn pairs_per_second(&self) -> Option<f64> {
        let gather = self.passes.iter().find(|pass| pass.name == "gather")?;
        (gather.milliseconds > 0.0)
            .then(|| self.pixel_vpl_pairs as f64 / (gather.milliseconds * 1e-3))
    }
}

/// GPU time of one pass, from timestamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassTime {
    pub name: &'static str,
    pub milliseconds: f64,
}

/// What a frame shows: goes into the header of the image file. Device and driver are in [`FrameStats`].
#[derive(Debug, Clone, PartialEq)]
pub struct FrameDescription {
    /// `None`: direct light only, or a reference.
    pub indirect: Option<IndirectLight>,
    /// Only of a path-sampled image.
    pub reference: Option<ReferenceSamples>,
    pub lights: Vec<Light>,
    pub camera: Camera,
    pub sensor: Option<Sensor>,
    /// Identifies the scene, its meshes and textures included.
    pub scene_hash: String,
}

impl FrameDescription {
    /// Describes a frame of this scene.
    pub fn new(scene: &Scene, scene_hash: String) -> Self {
        FrameDescription {
            indirect: scene.indirect,
            reference: None,
            lights: scene.lights.clone(),
            camera: scene.camera,
            sensor: scene.sensor,
            scene_hash,
        }
    }
}

/// How a path-sampled image was sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReferenceSamples {
    pub samples_per_pixel: u32,
    /// Samples are stratified within a round; rounds are independent of each other.
    pub samples_per_round: u32,
}
