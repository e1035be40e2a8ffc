//! The variance of each pixel's mean, from its own rounds and those of the surrounding pixels.
//!
//! A few rounds give a poor estimate of a variance: sometimes they agree by chance, and if all of them miss the light that matters they
//! agree on too small a value. So the pixel's own estimate is mixed with the mean of the surrounding ones, as if these had added rounds
//! (as Smyth 2004 does for genes).

use glam::DVec3;
use rayon::prelude::*;

/// Pixels to either side that count as neighbours.
const REACH: usize = 1;
/// Weight of the neighbours, as a number of differences between rounds. A larger weight would hide how much noisier a pixel is than its
/// neighbours.
const NEIGHBOURS_WORTH: u32 = 3;
/// Each step leaves at most 0.4 of the error: the mean over a square has a weight of at most 0.3 and no eigenvalue below −1/3.
const STEPS_TO_INVERT: u32 = 30;
/// Least weight of a pixel's own rounds, so that the mixing can be inverted.
const OWN_WORTH: u32 = 7;

/// Weights that mix the variances of an image.
pub struct Pooling<'a> {
    width: usize,
    /// Which pixels have a variance.
    is_sampled: &'a [bool],
    neighbours_share: f64,
}

impl Pooling<'_> {
    /// For an image of this width, from at least two rounds.
    pub fn new(width: usize, is_sampled: &[bool], rounds: u32) -> Pooling<'_> {
        let own_worth = (rounds - 1).max(OWN_WORTH);
        let all = f64::from(own_worth) + f64::from(NEIGHBOURS_WORTH);
        Pooling {
            width,
            is_sampled,
            neighbours_share: f64::from(NEIGHBOURS_WORTH) / all,
        }
    }

    /// Mixes the pixels' own variances.
    pub fn pooled(&self, own: &[DVec3]) -> Vec<DVec3> {
        let pixels = (0..own.len()).into_par_iter();
        pixels
            .map(|pixel| match self.is_sampled[pixel] {
                true => own[pixel].lerp(self.mean_around(own, pixel), self.neighbours_share),
                false => own[pixel],
            })
            .collect()
    }

    /// Recovers the own variances from mixed ones, so that an image can be continued from its file (Richardson's iteration).
    pub fn own(&self, pooled: &[DVec3]) -> Vec<DVec3> {
        let mut own = pooled.to_vec();
        for _ in 0..STEPS_TO_INVERT {
            let again = self.pooled(&own);
            for ((own, again), pooled) in own.iter_mut().zip(again).zip(pooled) {
                *own += *pooled - again;
            }
        }
        // Rounding may leave slightly negative values.
        own.iter().map(|own| own.max(DVec3::ZERO)).collect()
    }

    /// Mean over the square around a pixel, including the pixel.
    fn mean_around(&self, own: &[DVec3], pixel: usize) -> DVec3 {
        let height = own.len() / self.width;
        let range = |at: usize, end: usize| at.saturating_sub(REACH)..(at + REACH + 1).min(end);
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for row in range(pixel / self.width, height) {
            for column in range(pixel % self.width, self.width) {
                let neighbour = row * self.width + column;
                if self.is_sampled[neighbour] {
                    sum += own[neighbour];
                    count += 1.0;
                }
            }
        }
        sum / count
    }
}
