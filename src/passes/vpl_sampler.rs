//! Decides where the rays of the lights go: more often where their VPLs contribute more to the image, as a pilot has found.
//!
//! The map of a light is cut into tiles. Tiles where a pilot had many samples are cut into cells. The cells of a tile are equally
//! large, and their number is a power of four.

use super::{
    light::DeviceLight,
    light_paths,
    ray_table::{RayTable, RaysOfLight},
    sample_counts::PACKET_SAMPLES,
};
use crate::{
    Result,
    metrics::LOCAL_FLOOR,
    scene::ErrorNorm,
    vulkan::{CommandPool, TexelList, shaders::PilotSample},
};

/// Share of the rays that is distributed to the cells by their light alone, so that cells that the pilot missed get some too.
const EVEN_PART: f64 = 0.1;
/// Shares that go to the tiles around those that contribute, and to the cells around those that do. A narrow feature may begin in one
/// and continue in the next, where the pilot saw nothing. (Without the share for cells, a keyhole took 35 times the rays.)
const NEIGHBOUR_TILE_PART: f64 = 0.05;
const NEIGHBOUR_CELL_PART: f64 = 0.1;
/// The neighbours of a cell with at least this share of all samples become as small as the cell.
const LARGE_SHARE: f64 = 1e-3;
/// A tile has at most 4 to this power of cells, as many as `shaders/light_rays.wgsl` can number.
const MAX_LEVEL: u32 = 4;
/// Number of samples with light that a cell should have.
const SAMPLES_PER_CELL: usize = 8;
/// What is known of a tile counts as this many samples of each of its cells.
const PRIOR_SAMPLES: f64 = 2.0;
/// Distance in units of half the scene's size. The rays of a light farther away cannot tell surfaces apart in f32, and all but a
/// part of one tile would miss the scene. Such a light gets no rays; rays from P find what it illuminates.
const MAX_DISTANCE: f32 = 4096.0;
/// The rays of a light in a set are a multiple of this, because packets do not mix lights.
const PACKET_RAYS: u32 = 64;
/// Points of emissive surfaces for each ray from lights. They are VPLs, too.
pub(super) const POINTS_PER_RAY: f64 = 0.5;
/// Most cells beyond those that are whole tiles: half of them where samples were, half next to those.
pub(super) const MAX_SMALL_CELLS: usize = 1 << 15;

/// The distribution of the samples over the maps of all lights.
pub(crate) struct VplSampler {
    /// In the order of lights, then of faces, then in Morton order.
    tiles: Vec<Tile>,
    has_points: bool,
    /// The probability of each cell, in the order of tiles, then in Morton order.
    cells: Vec<f64>,
    /// Where the tiles of each light begin.
    first_tiles: Vec<usize>,
    /// What all pilots have seen in each tile.
    seen: Vec<Vec<Seen>>,
    pilots: u8,
}

/// What the samples of a pilot found.
pub(crate) struct Pilot<'p> {
    /// A packet of samples for each result.
    pub samples: &'p [PilotSample],
    pub first_result: u32,
    /// The first result for which the lights' rays had a seed, and that seed.
    pub rays: &'p [(u32, u32)],
}

/// A sample that a pilot took.
#[derive(Clone, Copy)]
struct Seen {
    pilot: u8,
    /// Place in the tile, in steps of the finest cells.
    place: u16,
    /// What the sample adds to the integral of the squared contribution over the tile.
    square: f64,
}

#[derive(Clone, Copy)]
struct Tile {
    /// Probability by the light that passes through the tile.
    even_probability: f64,
    first_cell: usize,
    /// The tile has 4 to this power of cells.
    level: u32,
}

/// Cells around another one, each once, in order: their tiles, and their places in Morton order.
#[derive(Default)]
struct Around {
    cells: [(usize, u32); 8],
    count: usize,
}

impl Around {
    fn cells(&self) -> &[(usize, u32)] {
        &self.cells[..self.count]
    }

    fn insert(&mut self, cell: (usize, u32)) {
        let Err(at) = self.cells().binary_search(&cell) else {
            return;
        };
        self.cells.copy_within(at..self.count, at + 1);
        self.cells[at] = cell;
        self.count += 1;
    }
}

impl VplSampler {
    /// Creates a sampler that samples tiles by the light that passes through them. Half of the samples go to all shining lights
    /// evenly, half by power.
    pub fn even(lights: &[&DeviceLight]) -> VplSampler {
        let power = |light: &DeviceLight| {
            let texels = light.domain.texels.iter();
            let power_w = texels.map(|texel| light.domain.incident_power_w(texel).iter().sum());
            power_w.collect::<Vec<f64>>()
        };
        let powers_w: Vec<Vec<f64>> = lights
            .iter()
            .map(|light| {
                let is_far = |at: &f32| at.abs() > MAX_DISTANCE;
                let is_too_far = light.parameters.is_parallel == 0
                    && light.parameters.position.iter().any(is_far);
                let powers_w = power(light);
                if is_too_far {
                    vec![0.0; powers_w.len()]
                } else {
                    powers_w
                }
            })
            .collect();
        let sums_w: Vec<f64> = powers_w.iter().map(|tiles| tiles.iter().sum()).collect();
        let total_w: f64 = sums_w.iter().sum();
        let shining = sums_w.iter().filter(|&&sum_w| sum_w > 0.0).count();
        let mut tiles = Vec::new();
        let mut first_tiles = Vec::new();
        for ((light, powers_w), sum_w) in lights.iter().zip(&powers_w).zip(&sums_w) {
            let of_light = 0.5 / shining.max(1) as f64 + 0.5 * sum_w / total_w;
            // A light with fewer faces than another leaves a gap.
            let first_tile = light.parameters.first_tile as usize;
            tiles.resize(first_tile, 0.0);
            first_tiles.push(first_tile);
            let size = light.parameters.emission_size;
            for index in 0..powers_w.len() as u32 {
                let (face, code) = (index / size.pow(2), index % size.pow(2));
                let texel =
                    face * size.pow(2) + every_other_bit(code >> 1) * size + every_other_bit(code);
                let share = powers_w[texel as usize] / sum_w;
                tiles.push(if *sum_w > 0.0 { of_light * share } else { 0.0 });
            }
        }
        VplSampler {
            has_points: lights.iter().any(|light| light.plan.emission_points > 0),
            cells: tiles.clone(),
            seen: vec![Vec::new(); tiles.len()],
            pilots: 0,
            tiles: tiles
                .into_iter()
                .enumerate()
                .map(|(first_cell, even_probability)| Tile {
                    even_probability,
                    first_cell,
                    level: 0,
                })
                .collect(),
            first_tiles,
        }
    }

    /// Distributes about this many rays to the cells. Each light that shines gets some. Of the VPLs of further bounces, it is assumed that
    /// they are spread over this area.
    pub fn table(
        &self,
        commands: &CommandPool,
        requested_set_size: u32,
        bounces: u32,
        assumed_area: f64,
    ) -> Result<RayTable> {
        let mut cells = Vec::new();
        let mut texels = Vec::new();
        let mut lights = Vec::new();
        let mut set_size = 0;
        let mut probabilities = vec![0.0; self.cells.len()];
        let ends = self
            .first_tiles
            .iter()
            .skip(1)
            .copied()
            .chain([self.tiles.len()]);
        for (&first_tile, end_tile) in self.first_tiles.iter().zip(ends) {
            let tiles = &self.tiles[first_tile..end_tile];
            let probability: f64 = tiles
                .iter()
                .flat_map(|tile| &self.cells[tile.cells()])
                .sum();
            let packets =
                (probability * f64::from(requested_set_size / PACKET_RAYS)).round() as u32;
            let ray_count = if probability > 0.0 {
                packets.max(1) * PACKET_RAYS
            } else {
                0
            };
            let stride = u32::MAX / ray_count.max(1);
            let whole = f64::from(ray_count * stride);
            let first_cell = cells.len() as u32;
            let (mut cumulative, mut begin) = (0.0, 0);
            for (index, tile) in tiles.iter().enumerate() {
                for (code, cell) in tile.cells().enumerate() {
                    cumulative += self.cells[cell];
                    let end = (cumulative / probability * whole).round().min(whole) as u32;
                    if end > begin {
                        let place = code as u32 + 256 * tile.level;
                        let [begin_bits, share_bits] = [begin, end - begin].map(f32::from_bits);
                        texels.push([begin_bits, share_bits, index as f32, place as f32]);
                        cells.push((begin, end - begin, cell));
                        probabilities[cell] = f64::from(end - begin) / whole * f64::from(ray_count);
                    }
                    begin = end;
                }
            }
            lights.push(RaysOfLight {
                first_ray: set_size,
                ray_count,
                first_cell,
                cell_count: cells.len() as u32 - first_cell,
                stride,
            });
            set_size += ray_count;
        }
        let point_count = match self.has_points {
            true => ((POINTS_PER_RAY * f64::from(set_size)) as u32)
                .next_multiple_of(PACKET_RAYS)
                .max(PACKET_RAYS),
            false => 0,
        };
        let reflected = light_paths::vpl_counts(set_size, bounces);
        set_size += reflected.iter().sum::<u32>() + point_count;
        let mut densities: Vec<[f32; 4]> = Vec::with_capacity(self.tiles.len() + self.cells.len());
        let first_listed = self.tiles.len();
        for tile in &self.tiles {
            let first_cell = (first_listed + tile.first_cell) as f32;
            densities.push([first_cell, tile.cells_per_edge() as f32, 0.0, 0.0]);
        }
        for tile in &self.tiles {
            for cell in tile.cells() {
                let density = tile.density(probabilities[cell] / f64::from(set_size.max(1)));
                densities.push([0.0, 0.0, density as f32, 0.0]);
            }
        }
        let of_two_bounces = reflected.first().copied().unwrap_or_default();
        Ok(RayTable {
            set_size,
            reflected,
            reflected_density: light_paths::density(of_two_bounces, set_size, assumed_area),
            point_count,
            requested_set_size,
            lights,
            cells,
            cell_list: TexelList::new(commands, "cells of the lights' rays", texels)?,
            densities: TexelList::new(commands, "densities of VPLs", densities)?,
        })
    }

    /// Learns from what a pilot's samples of VPLs have contributed. Apart from the even share and the shares of neighbours, a cell's
    /// probability becomes the one with the least noise: the root of its area times the integral of the squared contribution over it.
    /// The norm weights the contributions.
    ///
    /// Returns the share of the samples that go elsewhere from now on.
    pub fn learn(
        &mut self,
        lights: &[&DeviceLight],
        table: &RayTable,
        pilot: &Pilot,
        norm: ErrorNorm,
    ) -> f64 {
        self.look(table, pilot, norm);
        let lit: Vec<usize> = self
            .seen
            .iter()
            .map(|seen| seen.iter().filter(|seen| seen.square > 0.0).count())
            .collect();
        let samples_per_cell =
            (2 * lit.iter().sum::<usize>() / MAX_SMALL_CELLS).max(SAMPLES_PER_CELL);
        let levels: Vec<u32> = lit
            .iter()
            .map(|lit| ((lit / samples_per_cell).max(1).ilog2() / 2).min(MAX_LEVEL))
            .collect();
        let seen = self.weighted(&levels);
        let Some((tiles, mut cells)) = seen
            .and_then(|(tiles, cells)| self.weighted(&self.refined_levels(lights, &tiles, &cells)))
        else {
            return 0.0;
        };
        let mut around = vec![0.0; cells.len()];
        for (index, tile) in tiles.iter().enumerate() {
            let of_tile = &cells[tile.cells()];
            let mut hand_out = |weight: f64, code: u32, level: u32| {
                if weight == 0.0 {
                    return;
                }
                let neighbours = self.cells_around(lights, index, code, level);
                for &(neighbour, code) in neighbours.cells() {
                    let cells = tiles[neighbour].cells_at(code, level);
                    let share = weight / neighbours.cells().len() as f64 / cells.len() as f64;
                    around[cells].iter_mut().for_each(|cell| *cell += share);
                }
            };
            hand_out(NEIGHBOUR_TILE_PART * of_tile.iter().sum::<f64>(), 0, 0);
            for (code, weight) in of_tile.iter().enumerate() {
                hand_out(NEIGHBOUR_CELL_PART * weight, code as u32, tile.level);
            }
        }
        let all_around: f64 = around.iter().sum();
        let mut moved = 0.0;
        for (tile, old) in tiles.iter().zip(&self.tiles) {
            let even = EVEN_PART * tile.even_probability / tile.cells().len() as f64;
            for cell in tile.cells() {
                cells[cell] = even + around[cell] + (1.0 - EVEN_PART - all_around) * cells[cell];
            }
            let [new, old]: [f64; 2] = [
                cells[tile.cells()].iter().sum(),
                self.cells[old.cells()].iter().sum(),
            ];
            moved += 0.5 * (new - old).abs();
        }
        (self.tiles, self.cells) = (tiles, cells);
        moved
    }

    /// The tiles with cells of these levels, and the cells' weights by what was seen, with the sum 1. `None` if nothing was seen.
    fn weighted(&self, levels: &[u32]) -> Option<(Vec<Tile>, Vec<f64>)> {
        let mut cells = Vec::new();
        let mut tiles = self.tiles.clone();
        for ((tile, seen), &level) in tiles.iter_mut().zip(&self.seen).zip(levels) {
            tile.level = level;
            tile.first_cell = cells.len();
            cells.extend(tile.weights(seen, self.pilots));
        }
        let total: f64 = cells.iter().sum();
        cells.iter_mut().for_each(|cell| *cell /= total);
        (total > 0.0).then_some((tiles, cells))
    }

    /// The levels of the tiles, chosen so that cells with much weight have neighbours as small as they are, also in the next tile.
    fn refined_levels(&self, lights: &[&DeviceLight], tiles: &[Tile], cells: &[f64]) -> Vec<u32> {
        let mut levels: Vec<u32> = tiles.iter().map(|tile| tile.level).collect();
        let mut wanted = Vec::new();
        for (index, tile) in tiles.iter().enumerate() {
            for (code, &weight) in cells[tile.cells()].iter().enumerate() {
                if weight >= LARGE_SHARE {
                    let around = self.cells_around(lights, index, code as u32, tile.level);
                    wanted.extend(
                        around
                            .cells()
                            .iter()
                            .map(|&(near, _)| (weight, near, tile.level)),
                    );
                }
            }
        }
        wanted.sort_by(|(a, ..), (b, ..)| b.total_cmp(a));
        let mut room = MAX_SMALL_CELLS / 2;
        for (_, tile, level) in wanted {
            let more = (1_usize << (2 * level)).saturating_sub(1 << (2 * levels[tile]));
            if more > 0 && more <= room {
                room -= more;
                levels[tile] = level;
            }
        }
        levels
    }

    /// The cells around a cell of a tile, as if all tiles had cells of its level, also on other faces of its light.
    /// Returns their tiles, and their places in Morton order, in the order of both.
    fn cells_around(&self, lights: &[&DeviceLight], tile: usize, code: u32, level: u32) -> Around {
        let light = self.first_tiles.partition_point(|&first| first <= tile) - 1;
        let first_tile = self.first_tiles[light];
        let domain = &lights[light].domain;
        let tile = (tile - first_tile) as u32;
        let (face, tile) = (tile / domain.size.pow(2), tile % domain.size.pow(2));
        let code = code + (tile << (2 * level));
        let [column, row] = [every_other_bit(code), every_other_bit(code >> 1)];
        let cells_per_edge = domain.size << level;
        let on_face = |at: u32, offset: i32| {
            at.checked_add_signed(offset)
                .filter(|&at| at < cells_per_edge)
        };
        let middle = |at: u32, offset: i32| {
            (f64::from(at) + 0.5 + f64::from(offset)) / f64::from(cells_per_edge)
        };
        let mut found = Around::default();
        for (x, y) in [-1, 0, 1]
            .into_iter()
            .flat_map(|y| [(-1, y), (0, y), (1, y)])
        {
            let cell = match (on_face(column, x), on_face(row, y)) {
                _ if (x, y) == (0, 0) => continue,
                (Some(column), Some(row)) => Some([face, column, row]),
                // On another face, if there is one.
                _ => {
                    let place = [middle(column, x), middle(row, y)];
                    domain.cell_at(face as usize, place, cells_per_edge)
                }
            };
            let Some([face, column, row]) = cell else {
                continue;
            };
            let code = spread_bits(column) + 2 * spread_bits(row);
            let tile = face * domain.size.pow(2) + (code >> (2 * level));
            found.insert((first_tile + tile as usize, code & ((1 << (2 * level)) - 1)));
        }
        found
    }

    /// Records what a pilot has seen.
    fn look(
        &mut self,
        table: &RayTable,
        &Pilot {
            samples,
            first_result,
            rays,
        }: &Pilot,
        norm: ErrorNorm,
    ) {
        let tile_of_cell: Vec<usize> = (0..self.tiles.len())
            .flat_map(|tile| self.tiles[tile].cells().map(move |_| tile))
            .collect();
        let weights = receiver_weights(samples, norm);
        for (index, sample) in samples.iter().enumerate() {
            let receiver = index / PACKET_SAMPLES as usize;
            let result = first_result + receiver as u32;
            let sent = rays.iter().rfind(|&&(first, _)| first <= result);
            let Some((cell, along, probability)) =
                sent.and_then(|&(_, seed)| table.place(sample.vpl, seed))
            else {
                continue;
            };
            let tile = &self.tiles[tile_of_cell[cell]];
            let finest = 1 << (2 * (MAX_LEVEL - tile.level));
            let place = (cell - tile.first_cell) * finest + (along * finest as f64) as usize;
            // A ray stands for its candidates, and one is drawn by its contribution. On average this gives the sum of their squares.
            let square = f64::from(sample.candidate) * f64::from(sample.found);
            let square = weights[receiver].powi(2) * square;
            self.seen[tile_of_cell[cell]].push(Seen {
                pilot: self.pilots,
                place: place as u16,
                square: tile.density(probability) * square / samples.len() as f64,
            });
        }
        self.pilots += 1;
    }
}

impl Tile {
    fn cells(&self) -> std::ops::Range<usize> {
        self.first_cell..self.first_cell + (1 << (2 * self.level))
    }

    /// The cells at a place in Morton order, where `code` counts cells of `level`.
    fn cells_at(&self, code: u32, level: u32) -> std::ops::Range<usize> {
        let coarser = level.saturating_sub(self.level);
        let finer = self.level.saturating_sub(level);
        let first = self.first_cell + (((code >> (2 * coarser)) << (2 * finer)) as usize);
        first..first + (1 << (2 * finer))
    }

    /// The root of each cell's area times the integral of the square over it. The integrals of the pilots are averaged, weighted by
    /// their samples in the cell.
    fn weights(&self, seen: &[Seen], pilots: u8) -> Vec<f64> {
        let count = self.cells().len();
        if seen.is_empty() {
            return vec![0.0; count];
        }
        let places_per_cell = (1 << (2 * MAX_LEVEL)) / count;
        // For each pilot and cell: the integral, and the number of samples.
        let mut sums = vec![(0.0, 0.0); usize::from(pilots) * count];
        for seen in seen {
            let cell = usize::from(seen.place) / places_per_cell;
            let sum: &mut (f64, f64) = &mut sums[usize::from(seen.pilot) * count + cell];
            *sum = (sum.0 + seen.square, sum.1 + 1.0);
        }
        let pooled: Vec<(f64, f64)> = (0..count)
            .map(|cell| {
                let of_cell = sums.iter().skip(cell).step_by(count);
                let samples: f64 = of_cell.clone().map(|sum| sum.1).sum();
                let integral: f64 = of_cell.map(|sum| sum.0 * sum.1).sum();
                (integral / f64::max(samples, 1.0), samples)
            })
            .collect();
        let area = 1.0 / count as f64;
        let prior = area * pooled.iter().map(|cell| cell.0).sum::<f64>();
        let weight = |&(integral, samples): &(f64, f64)| {
            let known = (samples * integral + PRIOR_SAMPLES * prior) / (samples + PRIOR_SAMPLES);
            (area * known).sqrt()
        };
        pooled.iter().map(weight).collect()
    }

    fn cells_per_edge(&self) -> u32 {
        1 << self.level
    }

    /// Samples per area of a tile, from those of a cell.
    fn density(&self, of_cell: f64) -> f64 {
        of_cell * f64::from(self.cells_per_edge().pow(2))
    }
}

/// The weight of the light at each receiver.
fn receiver_weights(samples: &[PilotSample], norm: ErrorNorm) -> Vec<f64> {
    let receivers = samples.chunks_exact(PACKET_SAMPLES as usize);
    match norm {
        ErrorNorm::Image => vec![1.0; receivers.len()],
        ErrorNorm::Local => {
            let found = |sample: &PilotSample| f64::from(sample.found);
            let sum = |receiver: &[PilotSample]| receiver.iter().map(found).sum::<f64>();
            let sums: Vec<f64> = receivers.map(sum).collect();
            let mean = sums.iter().sum::<f64>() / sums.len().max(1) as f64;
            let least = (LOCAL_FLOOR * mean).max(f64::MIN_POSITIVE);
            sums.iter().map(|sum| 1.0 / sum.max(least)).collect()
        }
    }
}

/// Inserts zeros between the lower sixteen bits of a number.
fn spread_bits(number: u32) -> u32 {
    let mut bits = number & 0xffff;
    bits = (bits | bits << 8) & 0x00ff_00ff;
    bits = (bits | bits << 4) & 0x0f0f_0f0f;
    bits = (bits | bits << 2) & 0x3333_3333;
    (bits | bits << 1) & 0x5555_5555
}

/// Packs the even bits of a number together.
fn every_other_bit(bits: u32) -> u32 {
    let mut bits = bits & 0x5555_5555;
    bits = (bits | bits >> 1) & 0x3333_3333;
    bits = (bits | bits >> 2) & 0x0f0f_0f0f;
    bits = (bits | bits >> 4) & 0x00ff_00ff;
    (bits | bits >> 8) & 0xffff
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread_and_packed() {
        for number in [0, 1, 2, 0x1234, 0xa5c3, 0xffff] {
            let spread = spread_bits(number);
            let slowly: u32 = (0..16).map(|bit| (number & (1 << bit)) << bit).sum();
            assert_eq!(spread, slowly);
            assert_eq!(every_other_bit(spread | spread << 1), number);
        }
    }
}
