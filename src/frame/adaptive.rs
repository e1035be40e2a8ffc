//! The bounce where it varies: gathered at few pixels, interpolated at the others, until the error asked for is met.
//!
//! Pixels are visited from a coarse lattice to fine ones (after Nichols & Wyman 2009). A pixel that is gathered tells how wrong
//! its prediction from the coarser ones was; where that was little, the finer ones around it are interpolated. The error of the whole
//! image is then measured, not supposed: some pixels are gathered twice more, each time with other draws.

use super::{Cost, ProgressReport};
use crate::{
    Result,
    passes::{
        Context, appraise,
        bounce::{Bounce, MAX_RESULTS},
        gbuffer::GBuffer,
        predict::{self, BounceImages, Step},
        refine::{self, Refinement},
        resolve, settle,
    },
    plan::BouncePlan,
    vulkan::{Buffer, BufferUse, Image, Recorder},
};

/// Pixels that are gathered again to see the image's error.
const APPRAISED_PIXELS: u32 = 1024;
/// Draws of the first look at the scene.
const PILOT_DRAWS: u32 = 64;
/// The noise of a gather falls with this power of its draws (measured: 0.68 to 0.77).
const NOISE_RATE: f64 = 0.72;
/// Draws of a gather at most.
const MAX_DRAWS: u32 = 1 << 14;
/// Attempts to meet the target.
const MAX_ATTEMPTS: u32 = 4;

/// Sums over the appraised pixels and their bands.
#[derive(Debug, Clone, Copy, Default)]
struct Appraisal {
    /// Σ(x − t)², Σt², and Σσ² of one gather's noise. The first two without noise but for its scatter.
    error: f64,
    signal: f64,
    noise: f64,
    bands: f64,
}

impl Appraisal {
    fn relative_error(&self) -> f64 {
        (self.error.max(0.0) / self.signal).sqrt()
    }

    fn relative_noise(&self) -> f64 {
        (self.noise / self.signal).sqrt()
    }
}

/// What the refinement works on.
pub(crate) struct Adaptive<'a> {
    pub context: &'a Context<'a>,
    pub plan: BouncePlan,
    pub gbuffer: &'a GBuffer,
    pub indirect_radiance: &'a Image,
}

impl Adaptive<'_> {
    /// Fills the indirect radiance. Returns its relRMSE, as measured on a sample of pixels; `None` for a dark image.
    pub fn gather(
        &self,
        bounce: &mut Bounce,
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<Option<f64>> {
        let target = self.plan.target_error;
        let pilot = self.appraise(bounce, PILOT_DRAWS, progress, cost)?;
        if pilot.signal <= 0.0 {
            return Ok(None);
        }
        let radiance = (pilot.signal / pilot.bands).sqrt();
        let mut aim = 0.8 * target;
        let mut estimated_error = f64::INFINITY;
        for attempt in 0..MAX_ATTEMPTS {
            let more = (pilot.relative_noise() / aim).powf(1.0 / NOISE_RATE);
            let draws = ((f64::from(PILOT_DRAWS) * more / 64.0).ceil() * 64.0)
                .clamp(f64::from(PILOT_DRAWS), f64::from(MAX_DRAWS)) as u32;
            if std::env::var("CAMLUX_DEBUG").is_ok() {
                eprintln!("attempt {attempt}: pilot noise {:.4} radiance {radiance:.4e} aim {aim:.4} draws {draws}", pilot.relative_noise());
            }
            let draws = std::env::var("CAMLUX_DRAWS").ok().map_or(draws, |d| d.parse().unwrap());
            let tol: f64 = std::env::var("CAMLUX_TOL").ok().map_or(2.5 * aim, |d| d.parse().unwrap());
            let tolerance = tol * radiance;
            let gathered = self.refine(bounce, draws, tolerance, progress, cost)?;
            let appraisal = self.appraise(bounce, draws, progress, cost)?;
            estimated_error = appraisal.relative_error();
            if std::env::var("CAMLUX_DEBUG").is_ok() {
                eprintln!("  gathered {} error {:.4} noise of a gather {:.4}", gathered, estimated_error, appraisal.relative_noise());
            }
            if estimated_error <= 1.1 * target || std::env::var("CAMLUX_DRAWS").is_ok() {
                break;
            }
            aim *= (target / estimated_error).clamp(0.3, 0.8);
        }
        Ok(Some(estimated_error))
    }

    /// Gathers and interpolates all pixels. Returns how many were gathered.
    fn refine(
        &self,
        bounce: &mut Bounce,
        draws: u32,
        tolerance: f64,
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<u64> {
        let Context { device, plan, .. } = *self.context;
        let images = BounceImages::new(device, plan)?;
        let steps = Step::all(self.plan.coarsest_stride);
        let counts = steps.iter().map(|step| {
            let [columns, rows] = step.extent(plan.resolution_px);
            columns * rows
        });
        let counts: Vec<u32> = counts.collect();
        let mut refinement = Refinement::new(device, counts.iter().copied().max().unwrap_or(1))?;
        let mut gathered = 0;
        for (index, (&step, &count)) in steps.iter().zip(&counts).enumerate() {
            refinement.set_candidate_count(count)?;
            let mut recorder = Recorder::new(device, 8)?;
            if index == 0 {
                images.clear(&mut recorder);
            }
            // The lattice and the first step between its pixels show what is to be expected.
            let tolerance = (index > 2).then_some(tolerance);
            predict::predict(
                &mut recorder,
                self.context,
                self.gbuffer,
                &images,
                &refinement.candidates,
                step,
                tolerance,
            )?;
            refine::list(&mut recorder, self.context, self.gbuffer, &refinement)?;
            cost.submit(recorder)?;
            let lengths = refinement.lengths()?;
            let seed = index as u32;
            for (is_glossy, first, count) in [
                (false, 0, lengths.matte),
                (true, lengths.matte, lengths.glossy),
            ] {
                let mut done = 0;
                while done < count {
                    let chunk = (first + done, MAX_RESULTS.min(count - done));
                    bounce.gather(
                        &refinement.receivers,
                        is_glossy,
                        chunk,
                        0,
                        draws,
                        seed,
                        &mut || progress.report("bounce", 0.0),
                    )?;
                    let mut recorder = Recorder::new(device, 1)?;
                    settle::settle(
                        &mut recorder,
                        self.context,
                        self.gbuffer,
                        &images,
                        &refinement.receivers,
                        &bounce.results,
                        chunk,
                    )?;
                    cost.submit(recorder)?;
                    done += chunk.1;
                }
            }
            if std::env::var("CAMLUX_DEBUG").is_ok() {
                eprintln!("  {step:?}: {} of {count}", lengths.matte + lengths.glossy);
            }
            gathered += u64::from(lengths.matte) + u64::from(lengths.glossy);
        }
        let mut recorder = Recorder::new(device, 1)?;
        resolve::resolve(
            &mut recorder,
            self.context,
            self.gbuffer,
            &images,
            self.indirect_radiance,
        )?;
        cost.submit(recorder)?;
        Ok(gathered)
    }

    /// Gathers some pixels twice and compares the image with that.
    fn appraise(
        &self,
        bounce: &mut Bounce,
        draws: u32,
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<Appraisal> {
        let device = self.context.device;
        let pixels = scattered(self.context.plan.resolution_px, APPRAISED_PIXELS);
        let sample = Refinement::with_candidates(device, &pixels)?;
        let mut recorder = Recorder::new(device, 4)?;
        refine::list(&mut recorder, self.context, self.gbuffer, &sample)?;
        cost.submit(recorder)?;
        let lengths = sample.lengths()?;
        let count = lengths.matte + lengths.glossy;
        for gather in 0..2 {
            let seed = 0x5eed_0000 + gather + 2 * draws;
            for (is_glossy, first, length) in [
                (false, 0, lengths.matte),
                (true, lengths.matte, lengths.glossy),
            ] {
                bounce.gather(
                    &sample.receivers,
                    is_glossy,
                    (first, length),
                    gather * count + first,
                    draws,
                    seed,
                    &mut || progress.report("appraise", 0.0),
                )?;
            }
        }
        let bytes = u64::from(count) * size_of::<[f32; 4]>() as u64;
        let appraisals = Buffer::new(device, "appraisals", bytes, BufferUse::Readback)?;
        let mut recorder = Recorder::new(device, 1)?;
        appraise::appraise(
            &mut recorder,
            self.context,
            self.gbuffer,
            self.indirect_radiance,
            &sample.receivers,
            &bounce.results,
            &appraisals,
            count,
        )?;
        cost.submit(recorder)?;
        let mut sum = Appraisal {
            bands: 3.0 * f64::from(count),
            ..Appraisal::default()
        };
        for &[error, signal, noise, _] in appraisals.mapped::<[f32; 4]>(count as usize)? {
            sum.error += f64::from(error);
            sum.signal += f64::from(signal);
            sum.noise += 0.5 * f64::from(noise);
        }
        Ok(sum)
    }
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
            let state = (2 * cell + salt).wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
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
