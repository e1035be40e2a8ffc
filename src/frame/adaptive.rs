//! Indirect light where it varies: gathered at few pixels, interpolated at the others, until the error asked for is met.
//!
//! Pixels are visited from a coarse lattice to fine ones (after Nichols & Wyman 2009). A pixel that is gathered tells how wrong
//! its prediction from the coarser ones was; where that was little, the finer ones around it are interpolated. The error of the whole
//! image is then measured, not supposed: by rays some pixels are gathered twice more, each time with other draws; of a sum, whose gathers
//! are exact, once.

use super::{
    Cost, ProgressReport,
    source::{Draws, Source},
};
use crate::{
    Result,
    passes::{
        Context, appraise,
        compact::Run,
        gbuffer::GBuffer,
        predict::{self, BounceImages, Judgement, Step},
        refine::{self, Refinement},
        resolve, settle,
        smooth::Smoothing,
    },
    plan::RefinementPlan,
    vulkan::{Buffer, BufferUse, Device, Image, Recorder},
};

/// Pixels that are gathered again to see the image's error.
const APPRAISED_PIXELS: u32 = 1024;
/// Draws of the first look at the scene.
const PILOT_DRAWS: u32 = 64;
/// Draws of a second one, where the first has seen no light.
const SECOND_LOOK_DRAWS: u32 = 1024;
/// The noise of a gather falls with this power of its draws (measured: 0.68 to 0.77).
const NOISE_RATE: f64 = 0.72;
/// Draws of a gather at most.
const MAX_DRAWS: u32 = 1 << 14;
/// Draws come in packets of rays.
const DRAWS_STEP: u32 = 64;
/// The variance of a gather over the spread of its draws, which is that of points at random, falls with this power of their number
/// (measured: 0.1 to 0.5, once below 0).
const EVENNESS_RATE: f64 = 0.2;
/// Noise of a gathered pixel over the error of the image: smoothing and interpolation take some of it away (measured: 1 to 2.6).
const NOISE_OVER_TARGET: f64 = 1.7;
/// What an interpolated pixel may be off by where it is worst, over the error aimed at (measured of sums: the image's is then 0.2 to
/// 0.7 of the latter; half of this takes a tenth more pixels).
const TOLERANCE_OVER_AIM: f64 = 4.0;
/// What an interpolated pixel may be off by at most.
const MAX_TOLERANCE: f64 = 0.2;
/// Attempts to meet the target. The last one of a sum leaves nothing to interpolation.
const MAX_ATTEMPTS: u32 = 4;
/// The lattice that is gathered whatever the light: it and the first step between its pixels show what is to be expected.
const LATTICE_STEPS: usize = 3;
/// Receivers whose results there is room for.
const MAX_RESULTS: u32 = 1 << 16;

/// Sums over the appraised pixels and their bands.
#[derive(Debug, Clone, Copy, Default)]
struct Appraisal {
    /// Σ(x − t)², Σt², and Σσ² of one gather's noise. The first two without noise but for its scatter.
    error: f64,
    signal: f64,
    noise: f64,
    /// Of the draws of one gather.
    spread: f64,
    /// Of `error`, from how it scatters over the pixels.
    standard_error: f64,
    /// Of the gathers.
    draws: u32,
}

impl Appraisal {
    /// Not below its own standard error: few pixels may show none by chance.
    fn relative_error(&self) -> f64 {
        (self.error.max(self.standard_error) / self.signal).sqrt()
    }

    /// Of a gather with so many draws.
    fn relative_noise(&self, draws: u32) -> f64 {
        let fewer = f64::from(self.draws) / f64::from(draws);
        (self.noise / self.signal).sqrt() * fewer.powf(NOISE_RATE)
    }

    /// Variance of a gather with so many draws over their spread.
    fn variance_of_spread(&self, draws: u32) -> f64 {
        let fewer = f64::from(self.draws) / f64::from(draws);
        self.noise / self.spread.max(f64::MIN_POSITIVE) * fewer.powf(EVENNESS_RATE)
    }

    /// Draws whose noise is this.
    fn draws_for(&self, noise: f64) -> u32 {
        let more = (self.relative_noise(PILOT_DRAWS) / noise).powf(1.0 / NOISE_RATE);
        let steps = (f64::from(PILOT_DRAWS) * more / f64::from(DRAWS_STEP)).ceil();
        (steps.clamp(1.0, f64::from(MAX_DRAWS / DRAWS_STEP)) as u32) * DRAWS_STEP
    }
}

/// What the refinement works on.
pub(crate) struct Adaptive<'a> {
    pub context: &'a Context<'a>,
    pub plan: RefinementPlan,
    pub gbuffer: &'a GBuffer,
    pub indirect_radiance: &'a Image,
}

/// How hard an attempt tries.
struct Effort {
    draws: u32,
    /// Variance of a gather over the spread of its draws.
    variance_of_spread: f64,
    /// What an interpolated pixel may be off by, over the image's radiance; `None`: none is interpolated.
    tolerance: Option<f64>,
}

impl Effort {
    /// For an error aimed at, with rays whose noise the pilot measured.
    fn by_rays(aim: f64, pilot: &Appraisal) -> Effort {
        let draws = pilot.draws_for(NOISE_OVER_TARGET * aim);
        Effort {
            draws,
            variance_of_spread: pilot.variance_of_spread(draws),
            tolerance: Some((TOLERANCE_OVER_AIM * aim).min(MAX_TOLERANCE)),
        }
    }

    /// For an error aimed at, with exact gathers.
    fn by_sums(aim: f64, is_last: bool) -> Effort {
        Effort {
            draws: 0,
            variance_of_spread: 0.0,
            tolerance: (!is_last).then_some(TOLERANCE_OVER_AIM * aim),
        }
    }
}

/// Pixels that are gathered to see the image's error, with room for their results.
struct Sample {
    refinement: Refinement,
    runs: [Run; 2],
    count: u32,
    /// Two gathers, or one that is exact.
    results: Buffer,
    is_exact: bool,
}

impl Adaptive<'_> {
    /// Fills the indirect radiance. Returns its relRMSE, as measured on a sample of pixels; `None` where the sample is dark, which
    /// leaves the image as it is.
    pub fn gather(
        &self,
        source: &mut impl Source,
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<Option<f64>> {
        let target = self.plan.target_error;
        let mut sample = self.sample(cost)?;
        let sample_count = sample.count;
        source.begin_pilot(2 * sample_count, PILOT_DRAWS)?;
        let mut look = |draws, progress: &mut _, source: &mut _| {
            self.appraise(source, &mut sample, (draws, 0.0), progress, cost)
        };
        let mut pilot = look(PILOT_DRAWS, progress, source)?;
        if source.learn(2 * sample_count, PILOT_DRAWS)? {
            pilot = look(PILOT_DRAWS, progress, source)?;
        }
        if pilot.signal <= 0.0 && !source.is_exact() {
            pilot = look(SECOND_LOOK_DRAWS, progress, source)?;
        }
        if pilot.signal <= 0.0 {
            return Ok(None);
        }
        let radiance = (pilot.signal / (3.0 * f64::from(sample_count))).sqrt();
        let images = BounceImages::new(self.context.device, self.context.plan, !source.is_exact())?;
        let mut aim = target;
        let mut attempt = 0;
        loop {
            progress.begin_attempt(attempt);
            attempt += 1;
            let effort = if source.is_exact() {
                Effort::by_sums(aim, attempt == MAX_ATTEMPTS)
            } else {
                Effort::by_rays(aim, &pilot)
            };
            // What is exact stays.
            if attempt == 1 || !source.is_exact() {
                let mut recorder = Recorder::new(self.context.device, 1)?;
                images.clear(&mut recorder);
                cost.submit(recorder)?;
            }
            self.refine(source, &images, &effort, radiance, progress, cost)?;
            let error = self
                .appraise(source, &mut sample, (effort.draws, 1.0), progress, cost)?
                .relative_error();
            if error <= target || attempt == MAX_ATTEMPTS || effort.draws == MAX_DRAWS {
                return Ok(Some(error));
            }
            let shrink = if source.is_exact() {
                // The error falls more slowly than what is aimed at; and what was gathered is not lost.
                (0.9 * target / error).powi(2)
            } else {
                // To miss again costs more than to do a little too much.
                0.8 * target / error
            };
            aim *= shrink.max(0.25);
        }
    }

    /// Gathers and interpolates all pixels.
    fn refine(
        &self,
        source: &mut impl Source,
        images: &BounceImages,
        effort: &Effort,
        radiance: f64,
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<()> {
        let Context { device, plan, .. } = *self.context;
        let results = results(device, MAX_RESULTS)?;
        let steps = Step::all(self.plan.coarsest_stride);
        let counts = steps.iter().map(|step| {
            let [columns, rows] = step.extent(plan.resolution_px);
            columns * rows
        });
        let counts: Vec<u32> = counts.collect();
        let mut refinement = Refinement::new(device, counts.iter().copied().max().unwrap_or(1))?;
        // Every pixel of this lattice is gathered.
        let lattice_steps = steps.len().min(LATTICE_STEPS);
        let lattice_stride = (self.plan.coarsest_stride / 2).max(1);
        let smoothing = (!source.is_exact())
            .then(|| Smoothing::new(self.context, lattice_stride))
            .transpose()?;
        for (index, (&step, &count)) in steps.iter().zip(&counts).enumerate() {
            refinement.set_candidate_count(count)?;
            let mut recorder = Recorder::new(device, 8)?;
            let judgement = Judgement {
                radiance,
                tolerance: effort.tolerance.filter(|_| index >= lattice_steps),
                variance_of_spread: effort.variance_of_spread,
            };
            predict::predict(
                &mut recorder,
                self.context,
                self.gbuffer,
                images,
                &refinement.candidates,
                step,
                judgement,
            )?;
            refine::list(&mut recorder, self.context, self.gbuffer, &refinement)?;
            cost.submit(recorder)?;
            let name = source.name();
            let fraction = index as f64 / steps.len() as f64;
            let mut report = || progress.report_attempt(name, fraction);
            let draws = Draws {
                count: effort.draws,
                seed: index as u32,
            };
            for run in refinement.runs()? {
                for run in run.split(MAX_RESULTS) {
                    source.gather((&refinement, run), (&results, 0), draws, &mut report)?;
                    let mut recorder = Recorder::new(device, 1)?;
                    settle::settle(
                        &mut recorder,
                        self.context,
                        self.gbuffer,
                        images,
                        (&refinement, run),
                        &results,
                        judgement,
                    )?;
                    cost.submit(recorder)?;
                }
            }
            if let Some(smoothing) = smoothing.as_ref().filter(|_| index + 1 == lattice_steps) {
                let mut recorder = Recorder::new(device, 1)?;
                smoothing.smooth(&mut recorder, self.context, self.gbuffer, images, judgement)?;
                cost.submit(recorder)?;
            }
        }
        let mut recorder = Recorder::new(device, 1)?;
        resolve::resolve(
            &mut recorder,
            self.context,
            self.gbuffer,
            images,
            self.indirect_radiance,
        )?;
        cost.submit(recorder)
    }

    /// Chooses the sample.
    fn sample(&self, cost: &mut Cost) -> Result<Sample> {
        let device = self.context.device;
        let [width, height] = self.context.plan.resolution_px;
        let mut asked = APPRAISED_PIXELS;
        loop {
            let pixels = scattered([width, height], asked);
            let refinement = Refinement::with_candidates(device, &pixels)?;
            let mut recorder = Recorder::new(device, 4)?;
            refine::list(&mut recorder, self.context, self.gbuffer, &refinement)?;
            cost.submit(recorder)?;
            let runs = refinement.runs()?;
            let count = runs.iter().map(|run| run.count).sum();
            // Where little of the image shows a surface, more places are looked at.
            if count >= APPRAISED_PIXELS / 4
                || u64::from(asked) >= u64::from(width) * u64::from(height)
            {
                return Ok(Sample {
                    refinement,
                    runs,
                    count,
                    results: results(device, 2 * count)?,
                    is_exact: false,
                });
            }
            asked = asked.saturating_mul(4);
        }
    }

    /// Compares the image with gathers of the sample: two with draws of their own, or the one that is exact.
    fn appraise(
        &self,
        source: &mut impl Source,
        sample: &mut Sample,
        (draws, fraction): (u32, f64),
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<Appraisal> {
        let device = self.context.device;
        let count = sample.count;
        let mut report = || progress.report_attempt("appraise", fraction);
        let gathers = match (source.is_exact(), sample.is_exact) {
            (false, _) => 2,
            (true, false) => 1,
            (true, true) => 0,
        };
        for gather in 0..gathers {
            let draws = Draws {
                count: draws,
                // Other draws than those of the image and of other appraisals.
                seed: 0x5eed_0000 + 2 * draws + gather,
            };
            for run in sample.runs {
                let results = (&sample.results, gather * count + run.first);
                source.gather((&sample.refinement, run), results, draws, &mut report)?;
            }
        }
        sample.is_exact = source.is_exact();
        let bytes = u64::from(count) * size_of::<[f32; 4]>() as u64;
        let appraisals = Buffer::new(device, "appraisals", bytes, BufferUse::Readback)?;
        let second_result = if sample.is_exact { 0 } else { count };
        let mut recorder = Recorder::new(device, 1)?;
        appraise::appraise(
            &mut recorder,
            self.context,
            self.gbuffer,
            self.indirect_radiance,
            &sample.refinement,
            (&sample.results, second_result),
            (&appraisals, count),
        )?;
        cost.submit(recorder)?;
        let mut sum = Appraisal {
            draws: draws.max(1),
            ..Appraisal::default()
        };
        let mut squares = 0.0;
        for &[error, signal, noise, spreads] in appraisals.mapped::<[f32; 4]>(count as usize)? {
            sum.error += f64::from(error);
            sum.signal += f64::from(signal);
            sum.noise += 0.5 * f64::from(noise);
            sum.spread += 0.5 * f64::from(spreads);
            squares += f64::from(error).powi(2);
        }
        let mean_square = sum.error * sum.error / f64::from(count.max(1));
        sum.standard_error = (squares - mean_square).max(0.0).sqrt();
        Ok(sum)
    }
}

/// Room for the results of so many receivers: diffuse and specular.
fn results(device: &Device, receiver_count: u32) -> Result<Buffer> {
    let bytes = u64::from(receiver_count) * 2 * size_of::<[f32; 4]>() as u64;
    Buffer::new(device, "bounced light", bytes, BufferUse::Device)
}

/// About `count` pixels, one at a place of its own in each cell of a grid over the image; as column + 65536 · row.
fn scattered([width, height]: [u32; 2], count: u32) -> Vec<u32> {
    let pixels = f64::from(width) * f64::from(height);
    let edge = (pixels / f64::from(count)).sqrt().max(1.0);
    let [columns, rows] = [width, height].map(|size| (f64::from(size) / edge).ceil() as u32);
    let mut chosen = Vec::new();
    for cell in 0..columns * rows {
        let random = |salt: u32| {
            // PCG hash (Jarzynski & Olano 2020).
            let state = (2 * cell + salt)
                .wrapping_mul(747_796_405)
                .wrapping_add(2_891_336_453);
            let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
            f64::from((word >> 22) ^ word) / 4_294_967_296.0
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
    use super::*;

    #[test]
    fn scattered_pixels_lie_in_the_image_each_in_a_cell_of_its_own() {
        for size in [[1, 1], [2, 3], [70, 1], [96, 96], [800, 600]] {
            let chosen = scattered(size, APPRAISED_PIXELS);
            let [width, height] = size;
            let inside = |&pixel: &u32| pixel & 0xffff < width && pixel >> 16 < height;
            assert!(chosen.iter().all(inside));
            let different: std::collections::BTreeSet<u32> = chosen.iter().copied().collect();
            assert_eq!(different.len(), chosen.len());
            let due = (width * height).min(APPRAISED_PIXELS) as usize;
            assert!(
                chosen.len() >= due * 9 / 10 && chosen.len() <= due * 5 / 4,
                "{size:?}: {}",
                chosen.len()
            );
        }
    }

    #[test]
    fn half_the_noise_takes_draws_in_whole_packets() {
        let pilot = Appraisal {
            signal: 1.0,
            noise: 0.01,
            draws: PILOT_DRAWS,
            ..Appraisal::default()
        };
        assert_eq!(pilot.draws_for(1.0), DRAWS_STEP);
        assert_eq!(pilot.draws_for(0.05), 192);
        assert_eq!(pilot.draws_for(1e-9), MAX_DRAWS);
        assert!((pilot.relative_noise(PILOT_DRAWS) - 0.1).abs() < 1e-12);
    }
}
