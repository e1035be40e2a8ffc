//! Averages the bounce over the pixels' area. Most samples of a pixel show the same surface as the centre of a pixel around them, and
//! take their light from what was gathered there. The others are gathered.

use super::{refine::Refiner, resources::MAX_RESULT_VECTORS};
use crate::{
    Result,
    frame::{FrameImages, direct::see, scene_resources::SceneResources},
    passes::{
        gatherer::{GatheredFor, LightRaySets, Results, Samples},
        pixel_filter::FilteredImages,
        receivers::{self, ListedReceivers, Receivers},
        sample_counts::{PACKET_SAMPLES, SampleCounts},
    },
    plan::Plan,
    vulkan::{Allocate, Device, Image},
};

/// Seeds of these gathers, different from those of images and those of estimates.
const FIRST_SEED: u32 = 0x4000_0000;

/// The lists and buffers for gathering samples.
pub(crate) struct AntialiasedBounceResources<A: Allocate = Device> {
    receivers: Receivers<A>,
    results: A::Buffer,
    /// Number of receivers whose results fit.
    max_results: u32,
}

impl<A: Allocate> AntialiasedBounceResources<A> {
    pub fn new(allocate: &A, plan: &Plan) -> Result<AntialiasedBounceResources<A>> {
        let pixels: u32 = plan.resolution_px.iter().product();
        let max_results = pixels.min(MAX_RESULT_VECTORS / Results::vectors(plan)?);
        Ok(AntialiasedBounceResources {
            receivers: Receivers::new(allocate, pixels, pixels)?,
            results: Results::room(allocate, plan, max_results)?,
            max_results,
        })
    }
}

/// Fills the images of the bounce from what the refiner has gathered at the pixels' centres.
pub(super) fn average(
    refiner: &mut Refiner,
    scene: &SceneResources,
    images: &FrameImages,
    gathered: &Image,
    indirect: &Image,
) -> Result<()> {
    let (Some(sampled), Some(samples_of_pixel)) = (&images.sampled, refiner.samples_of_pixel)
    else {
        // Nothing was gathered: there is no light.
        return Ok(());
    };
    let context = refiner.context;
    let AntialiasedBounceResources {
        mut receivers,
        results,
        max_results,
    } = AntialiasedBounceResources::new(context.device, context.plan)?;
    let pixels: u32 = context.plan.resolution_px.iter().product();
    receivers.set_candidate_count(pixels)?;
    let filtered = FilteredImages {
        indirect,
        phasors: images.indirect_phasors.as_ref(),
    };
    let all: Vec<_> = sampled.samples(context).collect();
    // If all samples of a pixel are gathered, that pixel gets twice the samples of another.
    let packets = (2 * samples_of_pixel / PACKET_SAMPLES).div_ceil(all.len() as u32);
    let counts = (!refiner.gatherer.is_noiseless())
        .then(|| SampleCounts::even(context.device, pixels, packets))
        .transpose()?;
    let pass = refiner.gatherer.pass();
    for (index, sample) in all.iter().enumerate() {
        let share = Some(sample.share);
        see(
            context,
            scene,
            sample.offset_px,
            share,
            sample.gbuffer,
            None,
        )?;
        sample.interpolate(context, &images.gbuffer, gathered, &receivers, filtered)?;
        receivers::list(context, sample.gbuffer, &receivers, None)?;
        context.finish()?;
        let ranges = receivers.ranges()?;
        let most = match &counts {
            Some(_) => LightRaySets::max_receivers(PACKET_SAMPLES * packets).min(max_results),
            None => max_results,
        };
        let parts = ranges.into_iter().flat_map(|range| range.split(most));
        for (part, range) in parts.enumerate() {
            let seed = FIRST_SEED + ((index as u32) << 16);
            let samples = counts.as_ref().map(|counts| Samples {
                counts,
                seed,
                light_rays: LightRaySets {
                    seed: seed + part as u32,
                    gathered_for: GatheredFor::Image,
                    samples: PACKET_SAMPLES * packets,
                    receivers: most,
                    set_count: 1,
                },
            });
            let into = Results {
                buffer: &results,
                first: 0,
            };
            let progress = &mut *refiner.progress;
            let mut proceed = |_| progress.report_sample(pass, 0.5 * sample.share * index as f64);
            let at = ListedReceivers {
                gbuffer: sample.gbuffer,
                list: &receivers,
                range,
            };
            refiner.gatherer.gather(at, into, samples, &mut proceed)?;
            let counts = counts.as_ref();
            sample.add_gathered(context, at, &results, counts, filtered)?;
        }
    }
    Ok(())
}
