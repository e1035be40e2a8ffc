//! Which VPLs final gathering samples: those more often that contribute more to the image, as a pilot has seen.

use super::{light::DeviceLight, vpl::VplLists};
use crate::{
    Result,
    scene::Bands,
    vulkan::{Device, Recorder, Resource, TexelList, shaders},
};

/// Share of the samples that goes to all VPLs alike, so that none is forgotten which the pilot has not seen.
const EVEN_PART: f64 = 0.25;

/// A light whose VPLs are listed.
pub(crate) struct ListedLight {
    pub parameters: shaders::Light,
    /// VPLs of each tile of its RSM.
    tile_lengths: Vec<u32>,
    /// What it sends into its emission domain, W, all bands together.
    power_w: f64,
}

impl ListedLight {
    /// After the submission that listed the light's VPLs.
    pub fn new(light: &DeviceLight, vpls: &VplLists) -> Result<ListedLight> {
        let power = |bands: Bands| bands.iter().sum::<f64>();
        let texels = light.domain.texels.iter();
        Ok(ListedLight {
            parameters: light.parameters,
            tile_lengths: vpls.tile_lengths()?,
            power_w: texels
                .map(|texel| power(light.domain.incident_power_w(texel)))
                .sum(),
        })
    }

    pub fn has_vpls(&self) -> bool {
        self.tile_lengths.iter().any(|&length| length > 0)
    }
}

/// The VPLs of a tile of 8 x 8 texels of an RSM.
#[derive(Debug, Clone, Copy, Default)]
struct Tile {
    first_vpl: u32,
    vpl_count: u32,
    /// Of all its VPLs together.
    probability: f64,
}

/// The discrete distribution of the samples over the tiles of all lights.
pub(crate) struct VplSampler {
    /// In the order of lights, faces, and Morton order.
    tiles: Vec<Tile>,
    /// Cumulative, before each of those that have VPLs, in order.
    cdf: Vec<f32>,
    ranges: TexelList,
    guide: TexelList,
    pmf: TexelList,
}

impl VplSampler {
    /// Half of the samples go to the lights alike and half by their power; within a light all VPLs are alike.
    pub fn even(device: &Device, lights: &[&ListedLight], guide_cells: u32) -> Result<VplSampler> {
        let lit = || lights.iter().filter(|light| light.has_vpls());
        let power_w: f64 = lit().map(|light| light.power_w).sum();
        let mut tiles = Vec::new();
        for light in lights {
            let by_power = if power_w > 0.0 {
                light.power_w / power_w
            } else {
                0.0
            };
            let of_light = 0.5 / lit().count().max(1) as f64 + 0.5 * by_power;
            let vpl_count: u32 = light.tile_lengths.iter().sum();
            let mut first_vpl = light.parameters.first_vpl;
            // A light with fewer faces than another leaves room.
            tiles.resize(light.parameters.first_tile as usize, Tile::default());
            for &length in &light.tile_lengths {
                tiles.push(Tile {
                    first_vpl,
                    vpl_count: length,
                    probability: of_light * f64::from(length) / f64::from(vpl_count.max(1)),
                });
                first_vpl += length;
            }
        }
        VplSampler::new(device, tiles, guide_cells)
    }

    fn new(device: &Device, tiles: Vec<Tile>, guide_cells: u32) -> Result<VplSampler> {
        let mut cumulative = 0.0;
        let ranges: Vec<[f32; 4]> = tiles
            .iter()
            .filter(|tile| tile.vpl_count > 0)
            .map(|tile| {
                let from = cumulative;
                cumulative += tile.probability;
                // Counts of less than 2^24 are exact.
                let [first_vpl, vpl_count] = [tile.first_vpl, tile.vpl_count].map(|n| n as f32);
                [first_vpl, vpl_count, from as f32, tile.probability as f32]
            })
            .collect();
        let cdf: Vec<f32> = ranges.iter().map(|range| range[2]).collect();
        let guide = (0..guide_cells)
            .map(|cell| range_at(&cdf, cell as f32 / guide_cells as f32))
            .map(|range| [range as f32, 0.0, 0.0, 0.0]);
        let pmf = tiles
            .iter()
            .map(|tile| tile.probability / f64::from(tile.vpl_count.max(1)))
            .map(|probability| [probability as f32, 0.0, 0.0, 0.0]);
        Ok(VplSampler {
            ranges: TexelList::new(device, "ranges of VPLs", ranges)?,
            guide: TexelList::new(device, "guide to the ranges of VPLs", guide.collect())?,
            pmf: TexelList::new(device, "pmf of VPLs", pmf.collect())?,
            tiles,
            cdf,
        })
    }

    /// Fills the images; once, before anything reads them.
    pub fn record_copy<'r>(&'r self, recorder: &mut Recorder<'r>) {
        for list in [&self.ranges, &self.guide, &self.pmf] {
            list.record_copy(recorder);
        }
    }

    /// The same VPLs, sampled by what they have contributed: `contributions` has for every receiver those of its `samples` samples,
    /// which were those that `pilot_sample` says. A tile's probability becomes the root of the mean square (which makes
    /// the least noise), but for what goes to all alike.
    pub fn learned(
        &self,
        device: &Device,
        contributions: &[f32],
        samples: u32,
        guide_cells: u32,
    ) -> Result<VplSampler> {
        if self.cdf.is_empty() {
            return VplSampler::new(device, self.tiles.clone(), guide_cells);
        }
        let mut squares = vec![(0.0, 0_u32); self.cdf.len()];
        for (receiver, contributions) in contributions.chunks_exact(samples as usize).enumerate() {
            for (sample, &contribution) in contributions.iter().enumerate() {
                let range = range_at(&self.cdf, pilot_sample(receiver, sample, samples));
                squares[range].0 += f64::from(contribution).powi(2);
                squares[range].1 += 1;
            }
        }
        let mut squares = squares.into_iter();
        let weights: Vec<f64> = self
            .tiles
            .iter()
            .map(|tile| match tile.vpl_count {
                0 => 0.0,
                _ => {
                    let (sum, count) = squares.next().unwrap_or_default();
                    tile.probability * (sum / f64::from(count.max(1))).sqrt()
                }
            })
            .collect();
        let total: f64 = weights.iter().sum();
        if total <= 0.0 {
            return VplSampler::new(device, self.tiles.clone(), guide_cells);
        }
        let tiles = self.tiles.iter().zip(weights).map(|(tile, weight)| Tile {
            probability: EVEN_PART * tile.probability + (1.0 - EVEN_PART) * weight / total,
            ..*tile
        });
        VplSampler::new(device, tiles.collect(), guide_cells)
    }

    /// Tiles that have VPLs.
    pub fn range_count(&self) -> u32 {
        self.cdf.len() as u32
    }

    /// The images under the names that the shaders give them.
    pub fn resources(&self) -> [(&'static str, Resource<'_>); 3] {
        [
            ("vpl_ranges", self.ranges.resource()),
            ("vpl_guide", self.guide.resource()),
            ("vpl_pmf", self.pmf.resource()),
        ]
    }
}

/// The last range that begins at or before a number of 0 to 1.
fn range_at(cdf: &[f32], x: f32) -> usize {
    cdf.partition_point(|&first| first <= x).saturating_sub(1)
}

/// Where in 0 to 1 the pilot samples, as `shaders/final_gather.wgsl` has it.
fn pilot_sample(receiver: usize, sample: usize, samples: u32) -> f32 {
    let shift = (receiver as f32 * 0.618_034).fract();
    (sample as f32 + shift) / samples as f32
}
