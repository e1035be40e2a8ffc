//! Which VPLs the bounce draws: those more often that bring more to the image, as a pilot has seen.

use super::{light::DeviceLight, vpl::VplLists};
use crate::{
    Result,
    scene::Bands,
    vulkan::{Device, Recorder, Resource, TexelList, shaders},
};

/// Share of the draws that goes to all VPLs alike, so that none is forgotten which the pilot has not seen.
const EVEN_SHARE: f64 = 0.25;

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
    /// Of the draws.
    share: f64,
}

/// How the draws fall to the tiles of all lights.
pub(crate) struct VplDraws {
    /// In the order of lights, faces, and Morton order.
    tiles: Vec<Tile>,
    /// Of those that have VPLs, in order.
    first_shares: Vec<f32>,
    ranges: TexelList,
    guide: TexelList,
    shares: TexelList,
}

impl VplDraws {
    /// Half of the draws go to the lights alike and half by their power; within a light all VPLs are alike.
    pub fn even(device: &Device, lights: &[&ListedLight], guide_cells: u32) -> Result<VplDraws> {
        let lit = || lights.iter().filter(|light| light.has_vpls());
        let power_w: f64 = lit().map(|light| light.power_w).sum();
        let mut tiles = Vec::new();
        for light in lights {
            let by_power = if power_w > 0.0 {
                light.power_w / power_w
            } else {
                0.0
            };
            let light_share = 0.5 / lit().count().max(1) as f64 + 0.5 * by_power;
            let vpl_count: u32 = light.tile_lengths.iter().sum();
            let mut first_vpl = light.parameters.first_vpl;
            // A light with fewer faces than another leaves room.
            tiles.resize(light.parameters.first_tile as usize, Tile::default());
            for &length in &light.tile_lengths {
                tiles.push(Tile {
                    first_vpl,
                    vpl_count: length,
                    share: light_share * f64::from(length) / f64::from(vpl_count.max(1)),
                });
                first_vpl += length;
            }
        }
        VplDraws::of(device, tiles, guide_cells)
    }

    fn of(device: &Device, tiles: Vec<Tile>, guide_cells: u32) -> Result<VplDraws> {
        let mut first_share = 0.0;
        let ranges: Vec<[f32; 4]> = tiles
            .iter()
            .filter(|tile| tile.vpl_count > 0)
            .map(|tile| {
                let from = first_share;
                first_share += tile.share;
                // Counts of less than 2^24 are exact.
                let [first_vpl, vpl_count] = [tile.first_vpl, tile.vpl_count].map(|n| n as f32);
                [first_vpl, vpl_count, from as f32, tile.share as f32]
            })
            .collect();
        let first_shares: Vec<f32> = ranges.iter().map(|range| range[2]).collect();
        let guide = (0..guide_cells)
            .map(|cell| range_at(&first_shares, cell as f32 / guide_cells as f32))
            .map(|range| [range as f32, 0.0, 0.0, 0.0]);
        let shares = tiles
            .iter()
            .map(|tile| tile.share / f64::from(tile.vpl_count.max(1)))
            .map(|share| [share as f32, 0.0, 0.0, 0.0]);
        Ok(VplDraws {
            ranges: TexelList::new(device, "draws of VPLs", ranges)?,
            guide: TexelList::new(device, "guide to the draws of VPLs", guide.collect())?,
            shares: TexelList::new(device, "shares of VPLs", shares.collect())?,
            tiles,
            first_shares,
        })
    }

    /// Fills the images; once, before anything reads them.
    pub fn record_copy<'r>(&'r self, recorder: &mut Recorder<'r>) {
        for list in [&self.ranges, &self.guide, &self.shares] {
            list.record_copy(recorder);
        }
    }

    /// The same VPLs, drawn by what they have brought: `brought` has for every receiver what its `draws` draws brought,
    /// which were those that `pilot_draw` says. A tile's share becomes the root of the mean square (which makes
    /// the least noise), but for what goes to all alike.
    pub fn learned(
        &self,
        device: &Device,
        brought: &[f32],
        draws: u32,
        guide_cells: u32,
    ) -> Result<VplDraws> {
        if self.first_shares.is_empty() {
            return VplDraws::of(device, self.tiles.clone(), guide_cells);
        }
        let mut squares = vec![(0.0, 0_u32); self.first_shares.len()];
        for (receiver, brought) in brought.chunks_exact(draws as usize).enumerate() {
            for (draw, &brought) in brought.iter().enumerate() {
                let range = range_at(&self.first_shares, pilot_draw(receiver, draw, draws));
                squares[range].0 += f64::from(brought).powi(2);
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
                    tile.share * (sum / f64::from(count.max(1))).sqrt()
                }
            })
            .collect();
        let total: f64 = weights.iter().sum();
        if total <= 0.0 {
            return VplDraws::of(device, self.tiles.clone(), guide_cells);
        }
        let tiles = self.tiles.iter().zip(weights).map(|(tile, weight)| Tile {
            share: EVEN_SHARE * tile.share + (1.0 - EVEN_SHARE) * weight / total,
            ..*tile
        });
        VplDraws::of(device, tiles.collect(), guide_cells)
    }

    /// Tiles that have VPLs.
    pub fn range_count(&self) -> u32 {
        self.first_shares.len() as u32
    }

    /// The images under the names that the shaders give them.
    pub fn resources(&self) -> [(&'static str, Resource<'_>); 3] {
        [
            ("vpl_ranges", self.ranges.resource()),
            ("vpl_guide", self.guide.resource()),
            ("vpl_shares", self.shares.resource()),
        ]
    }
}

/// The last range that begins at or before a number of 0 to 1.
fn range_at(first_shares: &[f32], x: f32) -> usize {
    first_shares
        .partition_point(|&first| first <= x)
        .saturating_sub(1)
}

/// Where in 0 to 1 the pilot draws, as `shaders/bounce.wgsl` has it.
fn pilot_draw(receiver: usize, draw: usize, draws: u32) -> f32 {
    let shift = (receiver as f32 * 0.618_034).fract();
    (draw as f32 + shift) / draws as f32
}
