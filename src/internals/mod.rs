//! A look inside a frame, for tests, benches, the doctor and the report. Unstable: no part of the interface.

pub mod f64_kernels;
mod intermediates;
#[cfg(feature = "test-hooks")]
pub mod ray_probe;
mod shuffle;

pub use intermediates::{Intermediates, LightIntermediates, RsmTexel, SurfacePoint};

pub use crate::lattice::rank1;

use crate::{RenderOptions, Renderer, Result, Scene, frame::BufferPool, output::Frame};

impl Renderer {
    /// Renders a frame and keeps what its passes hand to each other. Everything is made anew.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_with_intermediates(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
    ) -> Result<(Frame, Intermediates)> {
        let mut intermediates = Intermediates::default();
        let drawn = self.draw_observed(scene, options, &mut |context, lights, index| {
            let light = LightIntermediates::read(context, lights, index)?;
            intermediates.lights.push(light);
            Ok(())
        })?;
        let device = &self.device;
        intermediates.read_gbuffer(device, &drawn.images.gbuffer, &drawn.space)?;
        let frame = drawn.read(device, BufferPool::default())?;
        Ok((frame, intermediates))
    }

    /// Renders a frame whose plain sums take the VPLs of each light in an order that `seed` decides, to see what the order makes of
    /// a sum. The draws of rays need the order of the RSM's texels and keep it. Everything is made anew.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_shuffled(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
        seed: u64,
    ) -> Result<Frame> {
        let drawn = self.draw_observed(scene, options, &mut |context, lights, index| match (
            &lights.vpls,
            lights.vpls_of(index),
        ) {
            (Some(vpls), Some(listed)) if !context.plan.has_final_gather() => {
                shuffle::shuffle(context.device, vpls, listed, seed)
            }
            _ => Ok(()),
        })?;
        drawn.read(&self.device, BufferPool::default())
    }
}
