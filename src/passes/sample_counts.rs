//! Sample counts pass: how many samples each receiver takes.

use super::{
    Context,
    gbuffer::GBuffer,
    receivers::{ReceiverRange, Receivers},
    refinement::{RefinementCriteria, RefinementImages},
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{
        Allocate, Buffer, BufferUse, Device, Resource,
        shaders::{Key, SampleCountParameters},
    },
};

/// Samples come in packets of this many rays.
pub(crate) const PACKET_SAMPLES: u32 = 64;

/// Least scale of packets. Its powers are finite in f32.
const LEAST_SCALE: f64 = 1e-9;

/// The packets that each receiver of a list takes: the first one, plus 65536 times the one after the last.
pub(crate) struct SampleCounts<A: Allocate = Device> {
    pub ranges: A::Buffer,
    readback: A::Buffer,
    capacity: u32,
    /// Whether the image is compared with these gathers. They begin with their first packet; the image's continue from what it has.
    of_estimate: bool,
}

pub(super) fn key(plan: &Plan) -> Key {
    Key::SampleCounts {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
    }
}

impl<A: Allocate> SampleCounts<A> {
    /// Allocates room for the counts of `capacity` receivers.
    pub fn new(allocate: &A, capacity: u32) -> Result<SampleCounts<A>> {
        let capacity = capacity.max(1);
        let buffer = |usage| allocate.buffer("sample counts", 4 * u64::from(capacity), usage);
        Ok(SampleCounts {
            ranges: buffer(BufferUse::Device)?,
            readback: buffer(BufferUse::Readback)?,
            capacity,
            of_estimate: false,
        })
    }
}

impl SampleCounts {
    /// Room for the counts of gathers that the image is compared with.
    pub fn of_estimate(context: &Context, capacity: u32) -> Result<SampleCounts> {
        Ok(SampleCounts {
            of_estimate: true,
            ..SampleCounts::new(context.device, capacity)?
        })
    }

    /// Gives each receiver this many packets.
    pub fn even(device: &Device, capacity: u32, packets: u32) -> Result<SampleCounts> {
        let capacity = capacity.max(1);
        let ranges = vec![packets << 16; capacity as usize];
        let filled = |usage| Buffer::filled(device, "even sample counts", &ranges, usage);
        Ok(SampleCounts {
            ranges: filled(BufferUse::Upload)?,
            readback: filled(BufferUse::Readback)?,
            capacity,
            of_estimate: false,
        })
    }

    /// Gives each of the first receivers this many packets, in all passes that are recorded from here on.
    pub fn set_even(&mut self, context: &Context, count: u32, packets: u32) -> Result<()> {
        let range = packets << 16;
        context.record(|recorder| {
            recorder.fill_words(&self.ranges, count, range);
            Ok(())
        })?;
        let known = self.readback.mapped_mut::<u32>(count as usize)?;
        known.fill(range);
        Ok(())
    }

    /// Computes what each receiver of a list takes, from the variances that the image knows. The host can read it after the submission.
    pub fn count(
        &self,
        context: &Context,
        gbuffer: &GBuffer,
        images: &RefinementImages,
        receivers: &Receivers,
        criteria: RefinementCriteria,
    ) -> Result<()> {
        let mut resources = gbuffer.resources();
        resources.extend(images.resources());
        resources.extend([
            ("receivers", Resource::Buffer(&receivers.pixels)),
            ("lengths", Resource::Buffer(receivers.lengths())),
            ("sample_ranges", Resource::Buffer(&self.ranges)),
        ]);
        let allocation = match self.of_estimate {
            true => criteria.allocation_of_estimate,
            false => criteria.allocation,
        };
        let parameters = SampleCountParameters {
            continues: u32::from(!self.of_estimate),
            max_packets: allocation.max_packets,
            is_smoothed: u32::from(!self.of_estimate),
            packets_scale: allocation.packets_scale.max(LEAST_SCALE) as f32,
            variance_rate: allocation.variance_rate as f32,
            packet_variance: allocation.packet_variance as f32,
            mean_variance: allocation.mean_variance as f32,
            least_variance: allocation.least_variance as f32,
            least_radiance: criteria.least_radiance(),
            own_share: criteria.own_share(),
        };
        let key = key(context.plan);
        let size = [receivers.candidate_count(), 1];
        context.dispatch(key, &resources, &parameters, size)?;
        context.record(|recorder| {
            recorder.barrier();
            recorder.copy_buffer(&self.ranges, &self.readback, 4 * u64::from(self.capacity));
            Ok(())
        })
    }

    /// The packets that each receiver takes, as the host has read them back: the first one, and the one after the last.
    pub fn ranges(&self, range: ReceiverRange) -> Result<Vec<(u32, u32)>> {
        let ranges = self.readback.mapped::<u32>(self.capacity as usize)?;
        let ranges = &ranges[range.first as usize..][..range.count as usize];
        Ok(ranges
            .iter()
            .map(|range| (range & 0xffff, range >> 16))
            .collect())
    }
}
