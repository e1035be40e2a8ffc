//! The inside of a frame, for tests, benches, the hard cases and the report. Unstable: not part of the public interface.

pub mod f64_kernels;
mod intermediates;
#[cfg(feature = "test-hooks")]
pub mod ray_probe;
#[cfg(feature = "test-hooks")]
pub mod smooth_probe;

pub use intermediates::{Intermediates, LightIntermediates, RsmTexel, SurfacePoint};

pub use crate::lattice::{scrambled, sequence};

use crate::{
    RenderOptions, Renderer, Result, Scene,
    frame::BufferPool,
    output::Frame,
    passes::{gather::ListedVpls, vpl::VplLists},
    vulkan::{Buffer, CommandPool, Readback},
};

impl Renderer {
    /// Renders a frame and keeps the data that its passes hand to each other. Nothing is reused from earlier frames.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_with_intermediates(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
    ) -> Result<(Frame, Intermediates)> {
        let mut lights = Vec::new();
        let drawn = self.draw_observed(scene, options, &mut |context, of_frame, index| {
            lights.push(LightIntermediates::read(context, of_frame, index)?);
            Ok(())
        })?;
        let space = drawn.space;
        let gbuffer = intermediates::read_gbuffer(&self.device, &drawn.images.gbuffer, &space)?;
        let kept = Intermediates {
            space,
            gbuffer,
            lights,
        };
        Ok((
            drawn.read(
                &mut Readback::new(&self.device),
                BufferPool::default(),
                None,
            )?,
            kept,
        ))
    }

    /// Renders a frame whose plain sums take the VPLs of each light in an order given by `seed`, to show the effect of the order on a sum.
    /// Sampled rays need the order of the RSM's texels and keep it. Nothing is reused from earlier frames.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_shuffled(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
        seed: u64,
    ) -> Result<Frame> {
        let drawn = self.draw_observed(scene, options, &mut |context, lights, index| {
            if let (Some(vpls), Some(listed)) = (&lights.vpls, lights.vpls_of(index)) {
                shuffle(context.commands, vpls, listed, seed)?;
            }
            Ok(())
        })?;
        drawn.read(
            &mut Readback::new(&self.device),
            BufferPool::default(),
            None,
        )
    }
}

/// Shuffles a light's VPLs, matte and glossy, in an order given by a seed.
fn shuffle(commands: &CommandPool, vpls: &VplLists, listed: ListedVpls, seed: u64) -> Result<()> {
    let lists = [
        (Some(&vpls.matte), listed.lengths.matte),
        (vpls.glossy.as_ref(), listed.lengths.glossy),
    ];
    for (list, length) in lists {
        let Some(list) = list else { continue };
        let mut readback = Readback::new(commands.device());
        let mut texels = readback.pixels(list)?.to_vec();
        let texels_per_layer = texels.len() / list.shape.layer_count() as usize;
        for layer in texels.chunks_exact_mut(texels_per_layer) {
            let of_light = &mut layer[listed.first as usize..][..length as usize];
            // A VPL has a texel in each layer, so all layers get the same order.
            fastrand::Rng::with_seed(seed).shuffle(of_light);
        }
        let buffer = Buffer::upload(commands.device(), "shuffled VPLs", &texels)?;
        let mut recorder = commands.begin()?;
        recorder.copy_to_image(&buffer, list);
        recorder.submit()?;
    }
    Ok(())
}
