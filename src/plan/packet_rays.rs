//! Where the rays of final gathering are in the list of rays: those of a packet's samples, and those of the longer paths that go on from
//! them. The layout is that of `shaders/shared/final_gather.wgsl`.

use std::ops::Range;

use super::Plan;
use crate::vulkan::shaders::{FinalGatherParameters, constants::SAMPLES};

/// Longer paths of two bounces, for each packet and lobe. With every second bounce there are half as many, because they carry less light,
/// down to [`FEWEST_PATHS`].
const PATHS_OF_TWO_BOUNCES: u32 = 16;
/// Two show their noise.
const FEWEST_PATHS: u32 = 2;

/// The rays of packets.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PacketRays {
    lobes: u32,
    lights: u32,
    /// With what surfaces emit.
    gathered_lights: u32,
    bounces: u32,
    /// Whether only paths with so many bounces lead to lights.
    are_last_alone: bool,
}

impl PacketRays {
    pub fn new(plan: &Plan, lobes: u32) -> PacketRays {
        PacketRays {
            lobes,
            lights: plan.lights.len() as u32,
            gathered_lights: plan.gathered_lights(),
            bounces: plan.bounces(),
            are_last_alone: plan.gathers_last_bounce_alone(),
        }
    }

    /// Longer paths of each bounce, for each packet and lobe; and the lights that each leads to.
    fn path_counts(&self) -> impl Iterator<Item = (u32, u32)> {
        (2..=self.bounces).map(|bounces| {
            let count = (PATHS_OF_TWO_BOUNCES >> ((bounces - 2) / 2)).max(FEWEST_PATHS);
            let lights = match self.are_last_alone && bounces < self.bounces {
                true => 0,
                false => self.lights,
            };
            (count, lights)
        })
    }

    /// Longer paths of a packet.
    pub fn paths(&self) -> u32 {
        self.lobes * self.path_counts().map(|(count, _)| count).sum::<u32>()
    }

    /// Rays of a packet along directions and longer paths.
    fn along(&self) -> u32 {
        SAMPLES * self.lobes + self.paths()
    }

    /// Rays of a packet that lead to VPLs and to lights.
    fn leading_to_light(&self) -> u32 {
        let of_directions = SAMPLES * self.lobes * self.gathered_lights;
        let of_paths = self
            .path_counts()
            .map(|(count, lights)| count * (1 + lights));
        SAMPLES + of_directions + self.lobes * of_paths.sum::<u32>()
    }

    /// Rays of a packet.
    pub fn of_packet(&self) -> u32 {
        self.along() + self.leading_to_light()
    }

    /// The same, if none lead to VPLs.
    pub fn without_vpls(&self) -> u32 {
        self.of_packet() - SAMPLES - self.paths()
    }

    /// Index of the first ray that leads to light.
    pub fn first_to_light(&self, packets: u32) -> u32 {
        packets * self.along()
    }

    /// What the kernels need to know of the longer paths, bounce by bounce.
    /// `vpls` are those of a set that each bounce may use; `light_end` is the number of lights.
    pub fn longer_paths(
        &self,
        of_packets: FinalGatherParameters,
        vpls: &[Range<u32>],
    ) -> Vec<FinalGatherParameters> {
        let packets = of_packets.packet_count;
        let mut parameters = FinalGatherParameters {
            path_count: SAMPLES,
            first_path_to_light: of_packets.first_to_light
                + SAMPLES * packets * (1 + self.lobes * self.gathered_lights),
            ..of_packets
        };
        let mut to_lights = 0;
        let counts = self
            .path_counts()
            .zip(vpls)
            .map(|((path_count, lights), vpls)| {
                parameters = FinalGatherParameters {
                    path_count,
                    first_path: parameters.first_path
                        + self.lobes * parameters.path_count * packets,
                    first_path_to_light: parameters.first_path_to_light + to_lights,
                    extended_count: parameters.path_count,
                    first_extended: parameters.first_path,
                    first_vpl: vpls.start,
                    vpl_count: vpls.len() as u32,
                    extended_vpls: parameters.vpl_count,
                    light_end: lights,
                    ..parameters
                };
                to_lights = self.lobes * path_count * packets * (1 + lights);
                parameters
            });
        counts.collect()
    }
}
