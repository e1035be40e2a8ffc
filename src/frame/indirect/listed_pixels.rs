//! Lists of pixels that are gathered separately from the image. The device leaves out those that show no surface.

use std::collections::HashMap;

use super::{expected_errors::ExpectedErrors, limits::GROUPS, refine::Refiner};
use crate::{
    Result,
    passes::{
        random,
        receivers::{self, Receivers},
        refinement::{RefinementCriteria, RefinementImages},
        sample_counts::SampleCounts,
    },
};

/// Evenly chosen pixels. The device lists those that show a surface with the next submission.
pub(super) struct ScatteredPixels {
    pub receivers: Receivers,
    /// About how many were wanted, how many were tried, and how often each is in the list.
    at_least: u32,
    tried: u32,
    copies: u32,
    pub seed: u32,
}

impl ScatteredPixels {
    /// Chooses about `at_least` pixels. Another `seed` gives other pixels.
    pub fn list(refiner: &Refiner, at_least: u32, seed: u32) -> Result<ScatteredPixels> {
        ScatteredPixels::try_pixels(refiner, at_least, seed, at_least, 1)
    }

    fn try_pixels(
        refiner: &Refiner,
        at_least: u32,
        seed: u32,
        tried: u32,
        copies: u32,
    ) -> Result<ScatteredPixels> {
        let (context, gbuffer) = (refiner.context, refiner.gbuffer);
        let own_seed = seed ^ random::hash(context.seed);
        let pixels = scattered(context.plan.resolution_px, tried, own_seed);
        let pixels = pixels.repeat(copies as usize);
        let receivers = Receivers::with_candidates(context.device, &pixels)?;
        receivers::list(context, gbuffer, &receivers, None)?;
        Ok(ScatteredPixels {
            receivers,
            at_least,
            tried,
            copies,
            seed,
        })
    }

    /// Another list, if the device has found too few pixels.
    pub fn list_more(&self, refiner: &Refiner) -> Result<Option<ScatteredPixels>> {
        let pixels: u64 = (refiner.context.plan.resolution_px.map(u64::from))
            .iter()
            .product();
        let count: u32 = (self.receivers.ranges()?.iter().map(|range| range.count)).sum();
        let is_all = u64::from(self.tried) >= pixels;
        let (tried, copies) = if is_all && (1..GROUPS).contains(&count) {
            // Repeat the pixels, so that each group has some.
            (self.tried, GROUPS.div_ceil(count))
        } else if count >= self.at_least / 4 || is_all {
            return Ok(None);
        } else {
            // If little of the image shows a surface, more places are tried.
            (self.tried.saturating_mul(4), self.copies)
        };
        ScatteredPixels::try_pixels(refiner, self.at_least, self.seed, tried, copies).map(Some)
    }
}

/// Pixels with the samples that they take. The device lists them with the next submission.
pub(super) struct ListedPixels {
    pub receivers: Receivers,
    pub counts: SampleCounts,
    /// As those of a [`ProbePixels`].
    pub weights: HashMap<u32, f64>,
}

impl ListedPixels {
    /// Chooses `wanted` pixels with a probability that grows with the square of the error that the image expects of them. `None` in an
    /// image of no more pixels, and in one that expects nothing.
    pub fn by_expected_error(
        refiner: &Refiner,
        images: &RefinementImages,
        expected: &ExpectedErrors,
        criteria: RefinementCriteria,
        wanted: u32,
        seed: u32,
    ) -> Result<Option<ListedPixels>> {
        let (context, gbuffer) = (refiner.context, refiner.gbuffer);
        let chosen = expected.choose(wanted, seed ^ random::hash(context.seed));
        if chosen.is_empty() {
            return Ok(None);
        }
        let pixels: Vec<u32> = chosen.iter().map(|&(pixel, _)| pixel).collect();
        let receivers = Receivers::with_candidates(context.device, &pixels)?;
        let counts = SampleCounts::of_estimate(context, pixels.len() as u32)?;
        receivers::list(context, gbuffer, &receivers, None)?;
        counts.count(context, gbuffer, images, &receivers, criteria)?;
        Ok(Some(ListedPixels {
            receivers,
            counts,
            weights: chosen.into_iter().collect(),
        }))
    }
}

/// Chooses about `count` pixels, one at a random place in each cell of a grid over the image, each as column + 65536 · row.
fn scattered([width, height]: [u32; 2], count: u32, seed: u32) -> Vec<u32> {
    let pixels = f64::from(width) * f64::from(height);
    let edge = (pixels / f64::from(count)).sqrt().max(1.0);
    let [columns, rows] = [width, height].map(|size| (f64::from(size) / edge).ceil() as u32);
    let mut chosen = Vec::new();
    for cell in 0..columns * rows {
        let random = |salt: u32| {
            let word = random::hash((2 * cell + salt) ^ random::hash(seed));
            f64::from(word) / 4_294_967_296.0
        };
        let x = ((f64::from(cell % columns) + random(0)) * edge) as u32;
        let y = ((f64::from(cell / columns) + random(1)) * edge) as u32;
        if x < width && y < height {
            chosen.push(x + (y << 16));
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::{super::limits::PROBE_PIXELS, *};

    #[test]
    fn scattered_pixels_lie_in_the_image_each_in_a_cell_of_its_own() {
        for size in [[1, 1], [2, 3], [70, 1], [96, 96], [800, 600]] {
            let chosen = scattered(size, PROBE_PIXELS, 0);
            let [width, height] = size;
            let inside = |&pixel: &u32| pixel & 0xffff < width && pixel >> 16 < height;
            assert!(chosen.iter().all(inside));
            let different: std::collections::BTreeSet<u32> = chosen.iter().copied().collect();
            assert_eq!(different.len(), chosen.len());
            let due = (width * height).min(PROBE_PIXELS) as usize;
            assert!(
                chosen.len() >= due * 9 / 10 && chosen.len() <= due * 5 / 4,
                "{size:?}: {}",
                chosen.len()
            );
        }
    }
}
