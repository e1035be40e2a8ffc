//! The layers of a frame: names, channels, units, and which scenes have them.

use super::tof_layers::{TOF_LAYERS, TofQuantity, describe_tof};
use crate::error::{Error, Result};
use crate::scene::{ChargeUnit, IndirectLight, Scene, TimeOfFlight};

/// A quantity that a frame holds for each pixel. P is the surface point seen at the pixel centre, C the camera centre. If pixels are
/// averaged over [samples](crate::scene::PixelSampling), light is the mean over the samples, but P, normals, ids, `depth` and `range` are
/// those of the centre.
///
/// Background pixels (no P) hold 0, except depths and `range`, which hold +∞.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layer {
    /// L*_{P→C} = direct + indirect, W/sr/m², channels R, G, B. Numerically also E_C, the irradiance at the pixel, W/m².
    Radiance,
    /// L_{P→C} = Σ over lights of f_P(l, n_P, v) · L_{L→P} · cosθ_{P→L} · V(L,P), W/sr/m², channels R, G, B.
    Direct,
    /// Single bounce over the reflective shadow maps, computed by the [`IndirectLight`](crate::scene::IndirectLight) in
    /// [`FrameDescription::indirect`](super::FrameDescription::indirect), W/sr/m², channels R, G, B.
    Indirect,
    /// Standard error of `indirect`, and so of `radiance`, W/sr/m², channels R, G, B. Reference images have it, and frames by final
    /// gathering whose scene requests it.
    StandardError,
    /// Q_C = E_C · SensorPixelArea · SignalDutyCycle · ExposureTime, joules, channels R, G, B.
    Energy,
    /// P in world space, metres, channels X, Y, Z; rounded to f32, so at 10⁵ m from the origin it has steps of 8 mm.
    /// [`Layer::CameraPosition`], `depth` and `range` keep their precision there.
    Position,
    /// P in the camera's axes, metres from C, channels X (right), Y (down), Z (forward: `depth`). Its error is below 10⁻⁶ of the scene's
    /// size or of |P − C|, wherever the scene is.
    CameraPosition,
    /// n_P in world space, unit length, on the camera's side, channels X, Y, Z.
    Normal,
    /// Component of P − C along the viewing axis, metres.
    Depth,
    /// |P − C|, metres.
    Range,
    /// Mean depth of the pixel's samples that show a surface, metres. Only present if pixels are averaged over
    /// [samples](crate::scene::PixelSampling).
    MeanDepth,
    /// The smallest depth of a pixel's samples, metres. Present under the same condition as [`Layer::MeanDepth`].
    NearestDepth,
    /// 0: background, else 1 + index into [`Scene::meshes`].
    InstanceId,
    /// 0: background, else 1 + index into [`Scene::materials`].
    MaterialId,
    /// 1: the pixel's centre is within 1/128 pixel of an edge, so rounding decides which of two surfaces it shows; otherwise 0. Only
    /// reference images have it. [`Comparison`](crate::metrics::Comparison) can exclude these pixels.
    Edge,
    /// Half the length of the shortest path L–P–C of a modulated light, metres; +∞ for the background. It is |P − C| if the light is at
    /// the camera.
    HalfPath,
    /// Optical flow: movement in the image of the point that a pixel shows, to the next frame of a sequence, pixels, channels X (right), Y
    /// (down). NaN for the background, where the next frame's lens does not see the point, and without a next frame. Only frames of a
    /// batch have it.
    Flow,
    /// Scene flow: movement of that point in the world, metres, channels X, Y, Z; NaN for the background and without a next frame. Present
    /// under the same condition as [`Layer::Flow`].
    SceneFlow,
    /// A time-of-flight quantity of a frequency, given by its index in
    /// [`TimeOfFlight::frequencies_hz`](crate::scene::TimeOfFlight::frequencies_hz).
    Tof(u8, TofQuantity),
}

impl Layer {
    /// Every layer in the order of the documentation, except those of a time-of-flight frequency.
    const PLAIN: [Layer; 18] = [
        Layer::Radiance,
        Layer::Direct,
        Layer::Indirect,
        Layer::StandardError,
        Layer::Energy,
        Layer::Position,
        Layer::CameraPosition,
        Layer::Normal,
        Layer::Depth,
        Layer::Range,
        Layer::MeanDepth,
        Layer::NearestDepth,
        Layer::InstanceId,
        Layer::MaterialId,
        Layer::Edge,
        Layer::HalfPath,
        Layer::Flow,
        Layer::SceneFlow,
    ];
    /// Layers that only frames of a sequence have.
    pub const OF_SEQUENCE: [Layer; 2] = [Layer::Flow, Layer::SceneFlow];

    /// Every layer, in the order of the documentation.
    pub fn all() -> impl Iterator<Item = Layer> {
        Self::PLAIN.into_iter().chain(TOF_LAYERS)
    }

    /// The name in OpenEXR files and on the command line.
    pub fn name(self) -> &'static str {
        self.describe().0
    }

    /// The layer of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().find(|layer| layer.name() == name)
    }

    /// Full OpenEXR channel names, in the order in which [`LayerData`](super::LayerData) interleaves them.
    pub fn channel_names(self) -> &'static [&'static str] {
        self.describe().1
    }

    /// The unit of the values; "1" for a plain number.
    pub fn unit(self) -> &'static str {
        self.describe().2
    }

    /// The unit in a frame of this time-of-flight camera, which may output charges as digital numbers.
    pub fn unit_by(self, tof: Option<&TimeOfFlight>) -> &'static str {
        let is_charge = matches!(
            self,
            Layer::Tof(
                _,
                TofQuantity::Taps(_) | TofQuantity::Amplitude | TofQuantity::Intensity
            )
        );
        match tof.map(|tof| tof.output) {
            Some(ChargeUnit::DigitalNumbers) if is_charge => "DN",
            _ => self.unit(),
        }
    }

    /// Name, channels, unit.
    fn describe(self) -> (&'static str, &'static [&'static str], &'static str) {
        const RADIANCE: &str = "W/sr/m^2";
        match self {
            Layer::Radiance => (
                "radiance",
                &["radiance.R", "radiance.G", "radiance.B"],
                RADIANCE,
            ),
            Layer::Direct => ("direct", &["direct.R", "direct.G", "direct.B"], RADIANCE),
            Layer::Indirect => (
                "indirect",
                &["indirect.R", "indirect.G", "indirect.B"],
                RADIANCE,
            ),
            Layer::StandardError => ("stderr", &["stderr.R", "stderr.G", "stderr.B"], RADIANCE),
            Layer::Energy => ("energy", &["energy.R", "energy.G", "energy.B"], "J"),
            Layer::Position => ("P", &["P.X", "P.Y", "P.Z"], "m"),
            Layer::CameraPosition => ("P_camera", &["P_camera.X", "P_camera.Y", "P_camera.Z"], "m"),
            Layer::Normal => ("N", &["N.X", "N.Y", "N.Z"], "1"),
            Layer::Depth => ("depth", &["depth.Z"], "m"),
            Layer::Range => ("range", &["range.Z"], "m"),
            Layer::MeanDepth => ("depth_mean", &["depth_mean.Z"], "m"),
            Layer::NearestDepth => ("depth_nearest", &["depth_nearest.Z"], "m"),
            Layer::InstanceId => ("id.instance", &["id.instance"], "1"),
            Layer::MaterialId => ("id.material", &["id.material"], "1"),
            Layer::Edge => ("edge", &["edge"], "1"),
            Layer::HalfPath => ("half_path", &["half_path.Z"], "m"),
            Layer::Flow => ("flow", &["flow.X", "flow.Y"], "px"),
            Layer::SceneFlow => (
                "scene_flow",
                &["scene_flow.X", "scene_flow.Y", "scene_flow.Z"],
                "m",
            ),
            Layer::Tof(frequency, quantity) => describe_tof(frequency, quantity),
        }
    }

    /// Whether the values are whole numbers ([`LayerData::Id`](super::LayerData::Id)).
    pub fn is_id(self) -> bool {
        matches!(
            self,
            Layer::InstanceId | Layer::MaterialId | Layer::Edge | Layer::Tof(_, TofQuantity::Wraps)
        )
    }

    /// Whether a render can have the layer; false for layers that only reference images or sequences have.
    pub fn is_rendered(self) -> bool {
        let of_reference = TofQuantity::PhasorStandardError;
        let is_of_others = self == Layer::Edge || Self::OF_SEQUENCE.contains(&self);
        !is_of_others && !matches!(self, Layer::Tof(_, quantity) if quantity == of_reference)
    }

    /// Whether a frame of this scene has the layer. `energy` needs a sensor, `indirect` needs indirect light, `stderr` needs a scene that
    /// requests it, and time-of-flight layers need a time-of-flight camera. No render has `edge`.
    pub fn is_made_for(self, scene: &Scene) -> bool {
        let gather = scene.indirect.as_ref().and_then(IndirectLight::gather);
        self.is_made_with(FrameParts {
            has_sensor: scene.sensor.is_some(),
            has_indirect: scene.indirect.is_some(),
            has_samples: scene.camera.pixel_sampling.is_some(),
            has_stderr: gather.is_some_and(|gather| gather.stderr_layer),
            tof: FrameParts::of_tof(scene.tof.as_ref()),
        })
    }

    /// Refuses, before any rendering, a layer that a frame of this scene will not have.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) names what the scene lacks.
    pub fn check_made_for(self, scene: &Scene) -> Result<()> {
        if self.is_made_for(scene) {
            return Ok(());
        }
        Err(Error::Scene {
            at: "layers".into(),
            problem: format!("a frame of this scene has no layer {}", self.name()),
            hint: format!("{}, or leave it out", self.need(scene.tof.as_ref())),
        })
    }

    /// What to do for the layer, if a frame with this time of flight has none.
    pub(crate) fn need(self, tof: Option<&TimeOfFlight>) -> String {
        match (self, tof) {
            (Layer::Energy, _) => "give the scene a sensor".into(),
            (Layer::StandardError, _) => "set stderr_layer of its indirect light".into(),
            (Layer::MeanDepth | Layer::NearestDepth, _) => "set samples of its camera".into(),
            (Layer::HalfPath | Layer::Tof(..), None) => {
                "give the scene time of flight (tof)".into()
            }
            (Layer::Tof(frequency, _), Some(tof))
                if usize::from(frequency) >= tof.frequencies_hz.len() =>
            {
                let (count, last) = (tof.frequencies_hz.len(), tof.frequencies_hz.len() - 1);
                format!("choose one of its {count} frequencies, tof0 to tof{last}")
            }
            (Layer::Tof(_, TofQuantity::Taps(_)), Some(tof)) => {
                let (count, last) = (tof.phase_count, tof.phase_count - 1);
                format!("choose one of its {count} phase images, phase0 to phase{last}")
            }
            (Layer::Indirect | Layer::Tof(..), _) => "give the scene indirect light".into(),
            _ => "take it from a reference or a sequence".into(),
        }
    }

    /// Whether a frame with these parts has the layer.
    pub(crate) fn is_made_with(self, parts: FrameParts) -> bool {
        let has_frequency =
            |frequency: u8| parts.tof.is_some_and(|[n, _]| u32::from(frequency) < n);
        match self {
            Layer::StandardError => parts.has_stderr,
            Layer::Energy => parts.has_sensor,
            Layer::Indirect => parts.has_indirect,
            Layer::MeanDepth | Layer::NearestDepth => parts.has_samples,
            Layer::HalfPath => parts.tof.is_some(),
            Layer::Tof(frequency, quantity) => {
                has_frequency(frequency)
                    && match quantity {
                        TofQuantity::PhasorIndirect | TofQuantity::MultipathError => {
                            parts.has_indirect
                        }
                        TofQuantity::Taps(phase) => {
                            parts.tof.is_some_and(|[_, n]| u32::from(phase) < n)
                        }
                        _ => self.is_rendered(),
                    }
            }
            _ => self.is_rendered(),
        }
    }
}

/// The parts of a frame that decide its layers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrameParts {
    pub has_sensor: bool,
    pub has_indirect: bool,
    /// Whether pixels are averaged over samples.
    pub has_samples: bool,
    pub has_stderr: bool,
    /// Time of flight: number of frequencies, and of phase images per frequency.
    pub tof: Option<[u32; 2]>,
}

impl FrameParts {
    pub fn of_tof(tof: Option<&TimeOfFlight>) -> Option<[u32; 2]> {
        tof.map(|tof| [tof.frequencies_hz.len() as u32, tof.phase_count])
    }
}
