//! The result of a render: named layers of pixels, how they were computed, and their cost.

use super::atomic::output_error;
use super::tof::TofCamera;
use super::tof_layers::{TOF_LAYERS, TofQuantity, describe_tof};
use crate::error::{Error, Result};
use crate::scene::{
    Camera, ChargeUnit, DEFAULT_TARGET_ERROR, IndirectLight, Light, Scene, Sensor, TimeOfFlight,
};

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
    /// [`FrameDescription::indirect`], W/sr/m², channels R, G, B.
    Indirect,
    /// Standard error of `indirect`, and so of `radiance`, W/sr/m², channels R, G, B. Reference images have it, and frames by final
    /// gathering whose scene requests it.
    StandardError,
    /// Q_C = E_C · SensorPixelArea · SignalDutyCycle · ExposureTime, joules, channels R, G, B.
    Energy,
    /// P in world space, metres, channels X, Y, Z; rounded to f32, so at 10⁵ m from the origin it has steps of 8 mm. `depth` and `range`
    /// keep their precision there.
    Position,
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
    const PLAIN: [Layer; 17] = [
        Layer::Radiance,
        Layer::Direct,
        Layer::Indirect,
        Layer::StandardError,
        Layer::Energy,
        Layer::Position,
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

    /// Full OpenEXR channel names, in the order in which [`LayerData`] interleaves them.
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

    /// Whether the values are whole numbers ([`LayerData::Id`]).
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
        let stderr = scene.indirect.and_then(|indirect| indirect.stderr_layer());
        self.is_made_with(FrameParts {
            has_sensor: scene.sensor.is_some(),
            has_indirect: scene.indirect.is_some(),
            has_samples: scene.camera.pixel_sampling.is_some(),
            has_stderr: stderr.unwrap_or(false),
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
        let hint = match (self, &scene.tof) {
            (Layer::Energy, _) => "add [sensor] to the scene".into(),
            (Layer::StandardError, _) => "add stderr_layer = true to [indirect]".into(),
            (Layer::MeanDepth | Layer::NearestDepth, _) => "add samples to [camera]".into(),
            (Layer::HalfPath | Layer::Tof(..), None) => "add [tof] to the scene".into(),
            (Layer::Tof(frequency, quantity), Some(tof))
                if usize::from(frequency) >= tof.frequencies_hz.len()
                    || matches!(quantity, TofQuantity::Taps(_)) =>
            {
                let last = tof.frequencies_hz.len() - 1;
                let last_phase = tof.phase_count - 1;
                format!("[tof] has tof0 to tof{last}, and phase0 to phase{last_phase} of each")
            }
            (Layer::Indirect | Layer::Tof(..), _) => "add [indirect] to the scene".into(),
            _ => "no render has it".into(),
        };
        Err(Error::Scene {
            at: "layers".into(),
            problem: format!("a frame of this scene has no layer {}", self.name()),
            hint: format!("{hint}, or leave it out"),
        })
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

/// The pixels of a layer, row by row from the top, channels interleaved: width · height · channels values.
#[derive(Debug, Clone, PartialEq)]
pub enum LayerData {
    Float(Vec<f32>),
    Id(Vec<u32>),
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
    /// The pixels of a layer; `None` if the frame lacks the layer or the layer holds ids.
    pub fn values(&self, layer: Layer) -> Option<&[f32]> {
        self.layers.iter().find_map(|(kind, data)| match data {
            LayerData::Float(values) if *kind == layer => Some(&values[..]),
            _ => None,
        })
    }

    /// The ids of a layer; `None` if the frame lacks the layer or the layer holds values.
    pub fn ids(&self, layer: Layer) -> Option<&[u32]> {
        self.layers.iter().find_map(|(kind, data)| match data {
            LayerData::Id(ids) if *kind == layer => Some(&ids[..]),
            _ => None,
        })
    }

    /// Probable mistakes that only the finished frame shows, one sentence each: nothing in view, a layer without light and why, a missed
    /// target error. [`Scene::warnings`] reports what is known before rendering.
    pub fn warnings(&self) -> Vec<String> {
        let black = self.black_layer();
        let missed = self.stats.missed_target(&self.description);
        let full = self.full_taps();
        let area_light = self.stats.missed_area_light(&self.description);
        let missed = missed.into_iter().chain(area_light);
        black.into_iter().chain(missed).chain(full).collect()
    }

    /// Warns about pixels with a full tap. Gives their number at the modulation frequency that has the most.
    fn full_taps(&self) -> Option<String> {
        let tof = self.description.tof.as_ref()?;
        let full = tof.noise?.full_tap(tof.output);
        let count = |frequency: u8| {
            let taps = (0..tof.phase_count as u8)
                .filter_map(|phase| self.values(Layer::Tof(frequency, TofQuantity::Taps(phase))))
                .map(|taps| taps.as_chunks::<2>().0);
            let taps: Vec<&[[f32; 2]]> = taps.collect();
            let is_full = |pixel: &usize| {
                let of_pixel = taps.iter().filter_map(|taps| taps.get(*pixel));
                of_pixel.flatten().any(|&tap| f64::from(tap) >= full)
            };
            let pixels = taps.first().map_or(0, |taps| taps.len());
            (0..pixels).filter(is_full).count()
        };
        let counts = (0..tof.frequencies_hz.len() as u8).map(count);
        let most = counts.max().filter(|&count| count > 0)?;
        Some(format!(
            "{most} pixels have a tap that is full, or nearly, and so a range that is wrong; lower the power of the lights or the exposure time, or raise full_well_e or bits"
        ))
    }

    /// Warns about a layer without light, and says why.
    fn black_layer(&self) -> Option<String> {
        let is_black = |layer| {
            let values = self.values(layer);
            values.is_some_and(|values| values.iter().all(|&value| value == 0.0))
        };
        let ids = self.ids(Layer::InstanceId);
        if ids.is_some_and(|ids| ids.iter().all(|&id| id == 0)) {
            return Some(
                "nothing is in view: every pixel shows the background; check the camera's position and look_at"
                    .into(),
            );
        }
        let no_flux = "the lights shine at no surface: their reflective shadow maps hold no flux";
        if is_black(Layer::Radiance) {
            let lights = &self.description.lights;
            let why = if lights.iter().all(|light| light.emission() == [0.0; 3]) {
                "every light emits 0; set their power_w or irradiance_w_m2"
            } else if self.description.indirect.is_some() && self.stats.vpl_count == 0 {
                no_flux
            } else {
                "it lies in shadow, faces away from the lights or reflects nothing; check where the lights are and what they shine at"
            };
            return Some(format!(
                "no light reaches what is in view, the image is black: {why}"
            ));
        }
        if is_black(Layer::Indirect) {
            let FrameStats {
                vpl_count,
                ray_count,
                ..
            } = self.stats;
            let why = match ray_count {
                _ if vpl_count == 0 => no_flux.into(),
                0 => format!("it faces away from all {vpl_count} VPLs, or reflects nothing"),
                _ => format!(
                    "{ray_count} rays between it and what is lit found no light, which is hidden, or too narrow to be found; its error is not estimated"
                ),
            };
            return Some(format!(
                "no indirect light reaches what is in view, the layer indirect is black: {why}"
            ));
        }
        None
    }

    /// Checks what the writers rely on, because a frame may have been assembled by hand: there are pixels, no layer occurs twice, and each
    /// layer has one value per pixel and channel.
    ///
    /// # Errors
    /// [`Error::Output`] for `path`; it names the layer.
    pub(crate) fn check_for_output(&self, path: &std::path::Path) -> Result<()> {
        let refuse = |problem: String| {
            let hint = "write a frame as the renderer returns it";
            Err(output_error(path, problem, hint))
        };
        let [width, height] = self.resolution_px.map(|px| px as usize);
        if width == 0 || height == 0 || self.layers.is_empty() {
            let layers = self.layers.len();
            return refuse(format!(
                "a frame of {width} x {height} pixels and {layers} layers is empty"
            ));
        }
        for (index, (layer, data)) in self.layers.iter().enumerate() {
            let name = layer.name();
            let channels = layer.channel_names().len();
            let due = width
                .checked_mul(height)
                .and_then(|px| px.checked_mul(channels));
            let (count, is_id) = match data {
                LayerData::Float(values) => (values.len(), false),
                LayerData::Id(ids) => (ids.len(), true),
            };
            if due != Some(count) {
                return refuse(format!(
                    "layer {name} has {count} values where {width} x {height} pixels of {channels} are due"
                ));
            }
            if layer.is_id() != is_id {
                return refuse(format!("layer {name} mixes up values and ids"));
            }
            let mut earlier = self.layers[..index].iter();
            if earlier.any(|(earlier, _)| earlier == layer) {
                return refuse(format!("layer {name} is there twice"));
            }
        }
        Ok(())
    }
}

/// The cost of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameStats {
    /// Name of the device that rendered it.
    pub device: String,
    /// Name and version of its driver.
    pub driver: String,
    /// In execution order.
    pub passes: Vec<PassTime>,
    /// Virtual point lights that carry flux, over all lights.
    pub vpl_count: u64,
    /// Number of (pixel, VPL) pairs that the gather evaluated.
    pub pixel_vpl_pairs: u64,
    /// Rays that the indirect light cast; 0 for plain sums.
    pub ray_count: u64,
    /// relRMSE of the indirect light against the true bounce, sqrt(Σ(x−t)²/Σt²), estimated by the engine from the frame itself. `None` for
    /// sums over VPLs, whose error it cannot know, and where the indirect light is dark.
    pub estimated_error: Option<f64>,
    /// 95 % upper bound of that error, from the estimate's own uncertainty; `None` if there is no such bound.
    pub estimated_error_upper: Option<f64>,
    /// Why final gathering stopped; `None` for sums, and where the indirect light is dark.
    pub stop: Option<StopReason>,
    /// relRMSE of the indirect light against the sum over VPLs at every pixel, also estimated; `None` if no interpolation error was
    /// requested.
    pub estimated_interpolation_error: Option<f64>,
    /// relRMSE of the direct light of area lights, estimated from two halves of their points: the largest of any area light; `None`
    /// without one.
    pub estimated_area_light_error: Option<f64>,
    /// Queue submissions of all passes.
    pub submissions: u32,
    /// From the call of the renderer until it returns.
    pub wall_milliseconds: f64,
}

/// Why final gathering stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The error is within the target.
    TargetMet,
    /// `max_ms` or `max_rays` was spent first: this is the best image so far.
    BudgetSpent,
    /// No further samples are available.
    SamplesExhausted,
}

impl StopReason {
    /// The name in image headers and statistics.
    pub fn name(self) -> &'static str {
        match self {
            StopReason::TargetMet => "target-met",
            StopReason::BudgetSpent => "budget-spent",
            StopReason::SamplesExhausted => "samples-exhausted",
        }
    }
}

impl FrameStats {
    /// Adds the cost of another frame that is part of this one. For errors and stop reasons, the worse value is kept.
    pub fn include(&mut self, part: &FrameStats) {
        for pass in &part.passes {
            match self.passes.iter_mut().find(|own| own.name == pass.name) {
                Some(own) => own.milliseconds += pass.milliseconds,
                None => self.passes.push(*pass),
            }
        }
        self.pixel_vpl_pairs += part.pixel_vpl_pairs;
        self.ray_count += part.ray_count;
        self.submissions += part.submissions;
        self.wall_milliseconds += part.wall_milliseconds;
        let worse = |own: &mut Option<f64>, other: Option<f64>| {
            *own = own.iter().copied().chain(other).reduce(f64::max);
        };
        worse(&mut self.estimated_error, part.estimated_error);
        worse(&mut self.estimated_error_upper, part.estimated_error_upper);
        worse(
            &mut self.estimated_interpolation_error,
            part.estimated_interpolation_error,
        );
        worse(
            &mut self.estimated_area_light_error,
            part.estimated_area_light_error,
        );
        if matches!(self.stop, None | Some(StopReason::TargetMet)) {
            self.stop = part.stop.or(self.stop);
        }
    }

    /// The estimated error against the true bounce and its upper bound, per cent: "estimated 1.93 %, below 2.20 % with 95 % confidence".
    pub fn estimated_error_text(&self) -> String {
        let percent = |error: f64| format!("{:.2} %", 100.0 * error);
        let Some(error) = self.estimated_error else {
            return "not estimated".into();
        };
        let upper = self.estimated_error_upper.map_or(String::new(), |upper| {
            format!(", below {} with 95 % confidence", percent(upper))
        });
        format!("estimated {}{upper}", percent(error))
    }

    /// Warns that the target error was missed, and says why.
    pub(crate) fn missed_target(&self, description: &FrameDescription) -> Option<String> {
        let indirect = description.indirect?;
        let requested = 100.0 * indirect.target_error()?;
        let estimated = self.estimated_error_text();
        let error = format!("requested {requested:.2} %, {estimated}");
        Some(match self.stop? {
            StopReason::TargetMet => return None,
            StopReason::BudgetSpent => {
                let ms = indirect.max_ms().map(|ms| format!("max_ms = {ms}"));
                let rays = indirect.max_rays();
                let rays = rays.map(|rays| format!("max_rays = {rays}"));
                let budget = Vec::from_iter(ms.into_iter().chain(rays)).join(", ");
                format!(
                    "the budget ({budget}) was spent before the target error was met: {error}; give more, or raise target_error"
                )
            }
            StopReason::SamplesExhausted => format!(
                "the target error was missed with the most samples there are: {error}; set a larger rsm_size, or raise target_error"
            ),
        })
    }

    /// Warns that the error of an area light's direct light is above the target error.
    fn missed_area_light(&self, description: &FrameDescription) -> Option<String> {
        let indirect = description
            .indirect
            .and_then(|indirect| indirect.target_error());
        let requested = indirect.unwrap_or(DEFAULT_TARGET_ERROR);
        let estimated = self.estimated_area_light_error.filter(|&e| e > requested)?;
        let [requested, estimated] = [requested, estimated].map(|error| 100.0 * error);
        Some(format!(
            "the direct light of a light with an area is off by about {estimated:.2} %, with the most points that there are: requested {requested:.2} %; make the light smaller, or give the camera more samples"
        ))
    }

    /// Pixel–VPL pairs over the GPU time of the pass `gather`; `None` without such a pass, or if it took no time.
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

/// Describes a frame, for the header of the image file. Device and driver are in [`FrameStats`].
#[derive(Debug, Clone, PartialEq)]
pub struct FrameDescription {
    /// `None`: direct light only, or a reference.
    pub indirect: Option<IndirectLight>,
    /// Only present for a path-sampled image.
    pub reference: Option<ReferenceSamples>,
    pub lights: Vec<Light>,
    pub camera: Camera,
    pub sensor: Option<Sensor>,
    /// Only present for an image with time-of-flight layers.
    pub tof: Option<TimeOfFlight>,
    /// Index in a series. The sensor's noise depends on it and on the seed.
    pub frame_index: u32,
    /// Identifies the scene, including its meshes and textures.
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
            tof: scene.tof.clone(),
            frame_index: 0,
            scene_hash,
        }
    }

    /// The time-of-flight camera, if there is one.
    pub(crate) fn time_of_flight(&self) -> Option<TofCamera<'_>> {
        let sensor = self.sensor?;
        Some(TofCamera {
            tof: self.tof.as_ref()?,
            camera: self.camera,
            sensor,
            photodetector: sensor.photodetector?,
            frame_index: self.frame_index,
        })
    }
}

/// How a path-sampled image was sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReferenceSamples {
    pub samples_per_pixel: u32,
    /// Samples are stratified within a round; rounds are independent of each other.
    pub samples_per_round: u32,
}
