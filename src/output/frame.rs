//! The result of a render: named layers of pixels, how they were computed, and their cost.

use glam::DVec3;

use super::atomic::output_error;
use super::{Layer, TofQuantity};
use crate::error::Result;
use crate::model::FrameKey;
use crate::scene::{
    Camera, DEFAULT_TARGET_ERROR, IndirectLight, Light, Scene, Sensor, Shared, TimeOfFlight,
    VignettingMap,
};

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

    /// Which pixels have an id other than 0: with [`Layer::InstanceId`], those that show a surface. Empty if the frame lacks the layer.
    pub fn mask(&self, layer: Layer) -> Vec<bool> {
        let ids = self.ids(layer).unwrap_or_default();
        ids.iter().map(|&id| id != 0).collect()
    }

    /// Probable mistakes that only the finished frame shows, one sentence each: nothing in view, a layer without light and why, a missed
    /// target error, coarse world positions. [`Scene::warnings`] reports what is known before rendering.
    pub fn warnings(&self) -> Vec<String> {
        let black = self.black_layer();
        let missed = self.stats.missed_target(&self.description);
        let full = self.full_taps();
        let area_light = self.stats.missed_area_light(&self.description);
        let missed = missed.into_iter().chain(area_light);
        let coarse = self.coarse_positions();
        let all = black.into_iter().chain(missed).chain(full);
        all.chain(coarse).collect()
    }

    /// Warns if world positions are so far from the origin that f32 rounds them coarsely, compared with what the camera sees.
    fn coarse_positions(&self) -> Option<String> {
        /// Steps of f32, divided by the largest distance from the camera.
        const COARSE: f64 = 1e-5;
        let (positions, _) = self.values(Layer::Position)?.as_chunks::<3>();
        let camera_m = self.description.camera.position_m;
        let (mut farthest, mut range_m) = (0.0_f32, 0.0_f64);
        // The background holds 0.
        for position in positions.iter().filter(|position| **position != [0.0; 3]) {
            farthest = position.iter().fold(farthest, |most, c| most.max(c.abs()));
            range_m = range_m.max(DVec3::from(position.map(f64::from)).distance(camera_m));
        }
        let step_m = f64::from(farthest.next_up()) - f64::from(farthest);
        (farthest > 0.0 && step_m > COARSE * range_m).then(|| {
            let error_m = 0.5 * step_m;
            format!(
                "the scene is so far from the origin that the layer P is up to {error_m} m off; use the layer P_camera, whose place in the world is that of the camera"
            )
        })
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
            "{most} pixels have a full or nearly full tap, so their range is wrong; lower the power of the lights or the exposure time, or raise full_well_e or bits"
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
                "nothing is in view: every pixel shows the background; check where the camera is and where it looks"
                    .into(),
            );
        }
        let no_flux = "the lights shine at no surface that reflects, so there are no VPLs; check where the lights are and what they shine at";
        if is_black(Layer::Radiance) {
            let lights = &self.description.lights;
            let why = if lights.is_empty() {
                "there is no light; add one"
            } else if lights.iter().all(|light| light.emission() == [0.0; 3]) {
                "every light emits 0; set their power_w or irradiance_w_m2"
            } else if self.description.indirect.is_some() && self.stats.vpl_count == 0 {
                no_flux
            } else {
                "it is in shadow, faces away from the lights or reflects nothing; check where the lights are and what they shine at"
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
                    "{ray_count} rays from it found no lit surface: these are hidden from it, or too small to be found; the error is not estimated"
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
                    "layer {name} has {count} values instead of {width} x {height} pixels x {channels} channels"
                ));
            }
            if layer.is_id() != is_id {
                return refuse(format!(
                    "layer {name} has ids where values belong, or values where ids belong"
                ));
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
    /// What the host did meanwhile, by step, without waiting for the device and without compiling.
    pub host_steps: Vec<PassTime>,
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
    /// Error of range, millimetres, as [`IndirectLight::FinalGather`] defines it, of the worst frequency; also estimated. `None` if no target was
    /// requested for it.
    pub estimated_range_error_mm: Option<f64>,
    /// 95 % upper bound of that error.
    pub estimated_range_error_upper_mm: Option<f64>,
    /// Why final gathering stopped; `None` for sums, and where the indirect light is dark. If a limit ended the search for light, this says so.
    pub stop: Option<StopReason>,
    /// Rays of the least image with an estimate, which final gathering makes whatever its limits are, as far as this frame tells.
    pub least_rays: Option<u64>,
    /// Time of that image, milliseconds.
    pub least_milliseconds: Option<f64>,
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
    /// Part of that time in which pipelines were compiled and surfaces were copied to the device.
    pub preparation_milliseconds: f64,
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
    /// The caller ended the render, and keeps what it has.
    Cancelled,
}

impl StopReason {
    /// The name in image headers and statistics.
    pub fn name(self) -> &'static str {
        match self {
            StopReason::TargetMet => "target-met",
            StopReason::BudgetSpent => "budget-spent",
            StopReason::SamplesExhausted => "samples-exhausted",
            StopReason::Cancelled => "cancelled",
        }
    }
}

impl FrameStats {
    /// Adds the cost of another frame that is part of this one. For errors and stop reasons, the worse value is kept.
    pub fn include(&mut self, part: &FrameStats) {
        for (own, others) in [
            (&mut self.passes, &part.passes),
            (&mut self.host_steps, &part.host_steps),
        ] {
            for other in others {
                match own.iter_mut().find(|each| each.name == other.name) {
                    Some(each) => each.milliseconds += other.milliseconds,
                    None => own.push(*other),
                }
            }
        }
        let worse = |own: &mut Option<f64>, other: Option<f64>| {
            *own = own.iter().copied().chain(other).reduce(f64::max);
        };
        self.pixel_vpl_pairs += part.pixel_vpl_pairs;
        self.ray_count += part.ray_count;
        self.submissions += part.submissions;
        self.wall_milliseconds += part.wall_milliseconds;
        self.least_rays = self.least_rays.max(part.least_rays);
        worse(&mut self.least_milliseconds, part.least_milliseconds);
        worse(&mut self.estimated_error, part.estimated_error);
        worse(&mut self.estimated_error_upper, part.estimated_error_upper);
        worse(
            &mut self.estimated_range_error_mm,
            part.estimated_range_error_mm,
        );
        worse(
            &mut self.estimated_range_error_upper_mm,
            part.estimated_range_error_upper_mm,
        );
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

    /// The estimated error of range and its upper bound: "estimated 3.1 mm, below 3.6 mm with 95 % confidence"; `None` without one.
    pub fn range_error_text(&self) -> Option<String> {
        let error = self.estimated_range_error_mm?;
        let upper = self.estimated_range_error_upper_mm?;
        let mm = |mm: f64| format!("{mm:.2} mm");
        Some(format!(
            "estimated {}, below {} with 95 % confidence",
            mm(error),
            mm(upper)
        ))
    }

    /// Warns that the target error was missed, and says why.
    pub(crate) fn missed_target(&self, description: &FrameDescription) -> Option<String> {
        let gather = description.indirect.as_ref()?.gather()?;
        let requested = 100.0 * gather.target_error;
        let estimated = self.estimated_error_text();
        let mut error = format!("requested {requested:.2} %, {estimated}");
        if let (Some(mm), Some(text)) = (gather.target_range_error_mm, self.range_error_text()) {
            error += &format!("; of the range, requested {mm} mm, {text}");
        }
        Some(match self.stop? {
            StopReason::TargetMet => return None,
            StopReason::BudgetSpent => {
                let ms = gather.max_ms.map(|ms| format!("max_ms = {ms}"));
                let rays = gather.max_rays.map(|rays| format!("max_rays = {rays}"));
                let budget = Vec::from_iter(ms.into_iter().chain(rays)).join(", ");
                let sent = self.ray_count;
                let least = match (self.least_rays, self.least_milliseconds) {
                    (Some(rays), Some(ms)) => format!(
                        "; no limit lowers the {rays} rays and {ms:.0} ms of the least image and its estimate"
                    ),
                    _ => String::new(),
                };
                format!(
                    "the budget ({budget}) was spent on {sent} rays before the target error was met: {error}{least}; give more, or raise target_error"
                )
            }
            StopReason::Cancelled => {
                format!("the render was ended before the target error was met: {error}")
            }
            StopReason::SamplesExhausted => format!(
                "the target error was missed with the maximum number of samples: {error}; set a larger rsm_size, or raise target_error"
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
            "the direct light of an area light has an estimated error of {estimated:.2} % with the maximum number of points: requested {requested:.2} %; make the light smaller, or give the camera more samples"
        ))
    }

    /// GPU time of all passes.
    pub fn gpu_milliseconds(&self) -> f64 {
        self.passes.iter().map(|pass| pass.milliseconds).sum()
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
    /// That of the scene.
    pub vignetting_map: Option<Shared<VignettingMap>>,
    /// Only present for an image with time-of-flight layers.
    pub tof: Option<TimeOfFlight>,
    /// The frame in its series. The sensor's noise depends on it.
    pub key: FrameKey,
    /// Identifies the scene, including its meshes and textures.
    pub scene_hash: String,
}

impl FrameDescription {
    /// Describes a frame of this scene.
    pub fn new(scene: &Scene, scene_hash: String) -> Self {
        FrameDescription {
            indirect: scene.indirect,
            reference: None,
            lights: scene
                .lights
                .iter()
                .map(|light| light.in_world(&scene.camera))
                .collect(),
            camera: scene.camera,
            sensor: scene.sensor,
            vignetting_map: scene.vignetting_map.clone(),
            tof: scene.tof.clone(),
            key: FrameKey::default(),
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
    /// Most surfaces that reflect light on its way from a light to what the camera sees.
    pub bounces: u32,
}
