//! The variance of each pixel's mean, from its own rounds and those of the pixels around it.
//!
//! A few rounds tell little of a variance: now and then they agree by chance, and where all of them miss the light that matters they
//! agree on too little. So the pixel's own estimate is mixed with the mean of those around it, as if these had added rounds of
//! their own (as Smyth 2004 does for genes).

use glam::DVec3;
use rayon::prelude::*;

/// Pixels to either side that count as neighbours.
const REACH: usize = 1;
/// The neighbours count like so many more differences between rounds. More of them would hide how much noisier a pixel is than those
/// around it.
const NEIGHBOURS_WORTH: u32 = 3;
/// Each leaves four tenths of the error or less: the mean over a square has no eigenvalue below −1/3, and counts for three tenths.
const STEPS_TO_INVERT: u32 = 30;
/// What a pixel's own rounds count for at least, so that the mixture can be undone.
const OWN_WORTH: u32 = 7;

/// How the variances of an image are mixed.
pub struct Pooling<'a> {
    width: usize,
    /// Which pixels have a variance.
    is_sampled: &'a [bool],
    neighbours_share: f64,
}

impl Pooling<'_> {
    /// Of an image of this width, from so many rounds, two at least.
    pub fn new(width: usize, is_sampled: &[bool], rounds: u32) -> Pooling<'_> {
        let own_worth = (rounds - 1).max(OWN_WORTH);
        let all = f64::from(own_worth) + f64::from(NEIGHBOURS_WORTH);
        Pooling {
            width,
            is_sampled,
            neighbours_share: f64::from(NEIGHBOURS_WORTH) / all,
        }
    }

    /// The mixed variances of the pixels from their own.
    pub fn pooled(&self, own: &[DVec3]) -> Vec<DVec3> {
        let pixels = (0..own.len()).into_par_iter();
        pixels
            .map(|pixel| match self.is_sampled[pixel] {
                true => own[pixel].lerp(self.mean_around(own, pixel), self.neighbours_share),
                false => own[pixel],
            })
            .collect()
    }

    /// What was mixed to these variances, so that an image can be gone on with from its file (Richardson's iteration).
    pub fn own(&self, pooled: &[DVec3]) -> Vec<DVec3> {
        let mut own = pooled.to_vec();
        for _ in 0..STEPS_TO_INVERT {
            let again = self.pooled(&own);
            for ((own, again), pooled) in own.iter_mut().zip(again).zip(pooled) {
                *own += *pooled - again;
            }
        }
        // Rounding may leave a little less than nothing.
        own.iter().map(|own| own.max(DVec3::ZERO)).collect()
    }

    /// Over the square around a pixel, which counts itself.
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
