//! What the refinement gathers its pixels from: rays, whose gathers have noise, or sums over all VPLs, which are exact.

use super::{Cost, ProgressReport};
use crate::{
    Result,
    passes::{
        bounce::Bounce,
        compact::Run,
        gather::{Gather, ListedVpls, Sums},
        receivers::{self, Receivers},
        refine::Refinement,
    },
    vulkan::{Buffer, Image, Recorder},
};

/// Pixels of an image of which a sample is but a small part.
const LEAST_PIXELS: u32 = 1 << 15;
/// VPLs of a sum that takes longer than interpolation: predicting, listing and resolving all pixels costs about as much as 400 VPLs
/// on lavapipe.
const LEAST_VPLS: u32 = 1024;

/// How a pixel is gathered, where there is a choice.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Draws {
    pub count: u32,
    /// Another number: other draws.
    pub seed: u32,
}

/// Gathers the bounce at pixels of a list.
pub(crate) trait Source {
    /// The name of its pass.
    fn name(&self) -> &'static str;

    /// Whether draws make no difference: gathers have no noise.
    fn is_exact(&self) -> bool;

    /// Until `learn`, what is gathered is a pilot of so many results.
    fn begin_pilot(&mut self, _results: u32, _draws: u32) -> Result<()> {
        Ok(())
    }

    /// Learns from the pilot how to draw. Whether that made a difference.
    fn learn(&mut self, _results: u32, _draws: u32) -> Result<bool> {
        Ok(false)
    }

    /// Gathers at the receivers of a run. The results go to `first_result` and on: two vectors a receiver, what it reflects
    /// diffusely, and the same weighted by the Phong lobe. `proceed` is called between submissions; its error ends the gather.
    fn gather(
        &mut self,
        receivers: (&Refinement, Run),
        results: (&Buffer, u32),
        draws: Draws,
        proceed: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()>;
}

impl Source for Bounce<'_> {
    fn name(&self) -> &'static str {
        "bounce"
    }

    fn is_exact(&self) -> bool {
        false
    }

    fn begin_pilot(&mut self, results: u32, draws: u32) -> Result<()> {
        Bounce::begin_pilot(self, results, draws)
    }

    fn learn(&mut self, results: u32, draws: u32) -> Result<bool> {
        Bounce::learn(self, results, draws)?;
        Ok(true)
    }

    fn gather(
        &mut self,
        (refinement, run): (&Refinement, Run),
        results: (&Buffer, u32),
        Draws { count, seed }: Draws,
        proceed: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        Bounce::gather(self, refinement, run, results, count, seed, proceed)
    }
}

/// The sums over the VPLs of all lights.
pub(crate) struct SumOfLights<'s> {
    pub gather: Gather<'s>,
    pub lights: &'s [ListedVpls],
}

impl Source for SumOfLights<'_> {
    fn name(&self) -> &'static str {
        "gather"
    }

    fn is_exact(&self) -> bool {
        true
    }

    fn gather(
        &mut self,
        (refinement, run): (&Refinement, Run),
        (results, first_result): (&Buffer, u32),
        _: Draws,
        proceed: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        let sums = Sums::List {
            results,
            first_result,
        };
        let receivers = (&refinement.receivers, &[run][..]);
        let report = &mut |_| proceed();
        self.gather.accumulate(self.lights, receivers, sums, report)
    }
}

impl SumOfLights<'_> {
    /// Whether gathering few pixels can be faster than gathering all: the sample is small beside the image, and the sums take
    /// longer than the passes that interpolate.
    pub fn may_pay(&self) -> bool {
        let [width, height] = self.gather.context.plan.resolution_px;
        let vpl_count: u32 = self.lights.iter().map(ListedVpls::count).sum();
        width * height >= LEAST_PIXELS && vpl_count >= LEAST_VPLS
    }

    /// Gathers at every pixel.
    pub fn gather_everywhere(
        &mut self,
        indirect_radiance: &Image,
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<()> {
        let Gather {
            context, gbuffer, ..
        } = self.gather;
        let receivers = Receivers::new(context.device, context.plan)?;
        let mut recorder = Recorder::new(context.device, 1)?;
        receivers::list(&mut recorder, context, gbuffer, &receivers)?;
        cost.submit(recorder)?;
        let runs = receivers.runs()?;
        let pixels = (&receivers.pixels, &runs[..]);
        let report = &mut |share| progress.report_attempt("gather", share);
        self.gather
            .accumulate(self.lights, pixels, Sums::Image(indirect_radiance), report)
    }
}
