//! Predicts how long a frame will take, from a similar frame that was rendered.

use crate::{Scene, output::FrameStats, scene::IndirectLight};

/// Rays of final gathering, except those of the error estimate, grow with this power of the pixels. Smooth light needs hardly more
/// for a larger image; for fine detail, the rays grow with the pixels (measured: 0 to 0.5 from 128 to 256 pixels, to 1 for larger images).
const PIXELS_POWER: f64 = 0.35;
/// The time of the least frame grows with this power: its gathers do not grow, its passes over the pixels do.
const LEAST_PIXELS_POWER: f64 = 0.7;
/// They fall with this power of the allowed error (measured: 0.7 to 1.75); for previews with the other (0.5 to 1).
const ERROR_POWER: f64 = -1.3;
const PREVIEW_POWER: f64 = -0.7;
const PREVIEW_ERROR: f64 = 0.05;
/// Usual estimated error of a frame, over its target (measured: 0.5 to 0.8).
const USUAL_ERROR: f64 = 0.7;

/// A frame that was rendered.
pub(crate) struct RenderedFrame {
    scene: Scene,
    /// Time of the passes that gather indirect light, and of the others.
    gather_ms: f64,
    other_ms: f64,
    /// Share of the rays of final gathering that estimated the error. Their number does not depend on the image's size.
    estimate_share: f64,
    /// Share of the rays that estimated the error on further pixels, which depends on chance.
    further_share: f64,
    /// Only of final gathering.
    estimated_error: Option<f64>,
    /// The least frame with an estimate, milliseconds; 0 without final gathering.
    least_ms: f64,
    ray_count: u64,
}

impl RenderedFrame {
    /// Creates it from a frame's statistics and the numbers of rays that estimated its error.
    pub fn new(
        scene: &Scene,
        stats: &FrameStats,
        estimate_rays: u64,
        further_rays: u64,
    ) -> RenderedFrame {
        let share = |rays: u64| rays as f64 / stats.ray_count.max(1) as f64;
        // Other passes have rays too, but few.
        let is_gather = |name: &str| {
            ["gather", "light_rays", "trace"].contains(&name) || name.starts_with("final_gather")
        };
        let sum_of = |gathers| {
            let passes = stats.passes.iter();
            let passes = passes.filter(move |pass| is_gather(pass.name) == gathers);
            passes.map(|pass| pass.milliseconds).sum()
        };
        RenderedFrame {
            scene: scene.clone(),
            gather_ms: sum_of(true),
            other_ms: sum_of(false),
            estimate_share: share(estimate_rays),
            further_share: share(further_rays),
            estimated_error: stats.estimated_error,
            least_ms: stats.least_milliseconds.unwrap_or_default(),
            ray_count: stats.ray_count,
        }
    }

    /// GPU time of a frame, milliseconds; `None` if the frame is not like this one.
    /// It must have the same number of triangles and lights, and the same estimator.
    pub fn foretell_ms(&self, scene: &Scene) -> Option<f64> {
        // The same scene takes the same samples.
        if self.scene.hash() == scene.hash() {
            return Some(self.gather_ms + self.other_ms);
        }
        let size = |scene: &Scene| {
            let is_dark = scene.is_dark();
            (scene.triangle_count(), scene.lights.len(), is_dark)
        };
        let is_alike = size(&self.scene) == size(scene);
        let pixels = pixels(scene) / pixels(&self.scene);
        let work = match (&self.scene.indirect, &scene.indirect) {
            (_, None) => 0.0,
            (Some(before), Some(now)) if before.name() == now.name() => {
                self.work(before, now, pixels)?
            }
            _ => return None,
        };
        let limits = scene.indirect.as_ref().and_then(IndirectLight::gather);
        let max_rays = limits.and_then(|limits| limits.max_rays);
        let of_rays = max_rays.map(|rays| rays as f64 / self.ray_count.max(1) as f64);
        let work = of_rays.map_or(work, |most| work.min(most));
        let most = limits.and_then(|limits| limits.max_ms);
        let most = most.unwrap_or(f64::INFINITY);
        // Few rays leave the time of the passes over the pixels.
        let least = match scene.indirect {
            Some(_) => self.least_ms * pixels.powf(LEAST_PIXELS_POWER),
            None => 0.0,
        };
        let ms = self.other_ms * pixels + self.gather_ms * work;
        is_alike.then_some(ms.min(most).max(least))
    }

    /// Work for indirect light, over that of this frame.
    fn work(&self, before: &IndirectLight, now: &IndirectLight, pixels: f64) -> Option<f64> {
        if let (Some(before), Some(now)) = (before.target_error(), now.target_error()) {
            let share = self.estimate_share;
            let of_rest = 1.0 - share - self.further_share;
            let of_image = share + of_rest * pixels.powf(PIXELS_POWER);
            // By chance this frame may have done more than requested, or less.
            let met = self.estimated_error.map(|error| error / USUAL_ERROR);
            return Some(of_image * effort(now) / effort(met.unwrap_or(before)));
        }
        let [before, now] = [before, now].map(|indirect| indirect.rsm_size().map(f64::from));
        Some(pixels * (now? / before?).powi(2))
    }
}

/// Rays for an error, up to a factor.
fn effort(error: f64) -> f64 {
    let for_preview = (error / PREVIEW_ERROR).max(1.0).powf(PREVIEW_POWER);
    error.min(PREVIEW_ERROR).powf(ERROR_POWER) * for_preview
}

fn pixels(scene: &Scene) -> f64 {
    scene.camera.resolution_px.map(f64::from).iter().product()
}
