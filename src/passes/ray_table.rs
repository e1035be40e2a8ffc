//! Which rays of the lights go through which cell of their maps, as [`VplSampler`](super::vpl_sampler::VplSampler) decides.

use std::ops::Range;

use super::{
    random::{hash, unit},
    vpl_sampler::MAX_SMALL_CELLS,
};
use crate::{
    Result,
    vulkan::{Allocate, Resource, TexelList},
};

/// The rays of a light in a set, and its cells in the list.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RaysOfLight {
    pub first_ray: u32,
    pub ray_count: u32,
    pub first_cell: u32,
    pub cell_count: u32,
    /// The light's probability per ray, in units of its cells' bounds.
    pub stride: u32,
}

/// Which rays of a set go through which cell.
pub(crate) struct RayTable {
    /// VPLs where the rays of all lights end, then those of further bounces, and then points of emissive surfaces.
    pub set_size: u32,
    /// The VPLs of each further bounce.
    pub reflected: Vec<u32>,
    /// The density that these are given, as in `Vpl` of the shaders.
    pub reflected_density: f32,
    /// These points.
    pub point_count: u32,
    pub(super) requested_set_size: u32,
    pub lights: Vec<RaysOfLight>,
    /// The cells with rays: where each begins in the light's probability, its share, and its place among all cells.
    pub(super) cells: Vec<(u32, u32, usize)>,
    pub(super) cell_list: TexelList,
    pub(super) densities: TexelList,
}

impl RayTable {
    /// Rays of all lights together.
    pub fn ray_count(&self) -> u32 {
        self.lights.iter().map(|light| light.ray_count).sum()
    }

    /// VPLs of up to this many bounces, which a set begins with; or those of this number alone. Points are not among them.
    pub fn vpls_of(&self, bounces: u32, alone: bool) -> Range<u32> {
        let within = |bounces: u32| match bounces {
            0 => 0,
            _ => {
                let further = self.reflected.iter().take(bounces as usize - 1);
                self.ray_count() + further.sum::<u32>()
            }
        };
        let start = if alone { within(bounces - 1) } else { 0 };
        start..within(bounces)
    }

    /// The ray that about led to a VPL; `None` for points.
    fn ray_of(&self, mut vpl: u32) -> Option<u32> {
        let mut counts = vec![self.ray_count()];
        counts.extend(&self.reflected);
        let mut bounce = 0;
        while vpl >= *counts.get(bounce)? {
            vpl -= counts[bounce];
            bounce += 1;
        }
        for of_bounce in counts[..=bounce].windows(2).rev() {
            let [before, count] = [of_bounce[0], of_bounce[1]].map(u64::from);
            vpl = ((2 * u64::from(vpl) + 1) * before / (2 * count)) as u32;
        }
        Some(vpl)
    }

    /// The points' share of the set.
    pub fn point_share(&self) -> f64 {
        f64::from(self.point_count) / f64::from(self.set_size.max(1))
    }

    /// Where the ray of a VPL goes: the cell, the fraction along its Morton curve, and the cell's probability. `None` if there is no ray.
    pub(super) fn place(&self, vpl: u32, seed: u32) -> Option<(usize, f64, f64)> {
        let ray = self.ray_of(vpl)?;
        let light = self.lights.iter().rfind(|light| light.first_ray <= ray)?;
        let jitter = unit(hash(seed ^ hash(ray))) * light.stride as f32;
        let at = (ray - light.first_ray) * light.stride + jitter as u32;
        let cells = &self.cells[light.first_cell as usize..][..light.cell_count as usize];
        let next = cells.partition_point(|&(begin, ..)| begin <= at);
        let &(begin, share, cell) = cells.get(next.checked_sub(1)?)?;
        let along = f64::from(at - begin) / f64::from(share);
        let of_light = f64::from(share) / f64::from(light.stride);
        (along < 1.0).then_some((cell, along, of_light / f64::from(self.set_size)))
    }

    /// Whether the table was made for this requested number of rays.
    pub fn is_for(&self, set_size: u32) -> bool {
        self.requested_set_size == set_size
    }

    /// Declares the memory for tables of up to this many tiles.
    pub fn declare(allocate: &impl Allocate, tiles: u64) -> Result<()> {
        let cells = tiles + MAX_SMALL_CELLS as u64;
        TexelList::declare(allocate, "cells of the lights' rays", cells)?;
        TexelList::declare(allocate, "densities of VPLs", tiles + cells)
    }

    /// The images with their names in the shaders.
    pub fn resources(&self) -> [(&'static str, Resource<'_>); 2] {
        [
            ("ray_cells", self.cell_list.resource()),
            ("vpl_densities", self.densities.resource()),
        ]
    }
}
