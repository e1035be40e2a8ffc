//! The errors that an image expects of its pixels, and pixels chosen by them.

use super::refine::Refiner;
use crate::{
    Result, metrics,
    parallel::{for_each_at_once, thread_count},
    passes::{random, refinement::RefinementImages},
    vulkan::{Image, Readback},
};

/// Share of the pixels that are chosen evenly; the others by the error that is expected of them. Nobody expects some errors.
const EVEN_SHARE: f64 = 0.5;
/// Pixels along the edge of a block. Each stratum of the cumulative probability is a region of the image.
const BLOCK_PX: u32 = 8;
/// Fewer blocks are not worth a thread of their own.
const MIN_BLOCKS_OF_THREAD: usize = 1024;

/// The errors that an image expects of its pixels.
pub(super) struct ExpectedErrors<'r> {
    /// As the resolve pass stores it.
    image: &'r [[f32; 4]],
    /// Factors of the squared errors; empty if they are 1.
    weights: Vec<f32>,
    size_px: [u32; 2],
    /// Edge of the tiles that errors are relative to, and their number along a row.
    tile_px: u32,
    tile_columns: u32,
    /// The square that errors of each tile are relative to.
    squares: Vec<f64>,
    blocks: Vec<Block>,
    /// Of all blocks.
    total: Block,
}

/// The pixels of a block that show a surface.
#[derive(Clone, Copy, Default)]
struct Block {
    count: f64,
    /// Sum of their squared expected errors.
    expected: f64,
}

impl<'r> ExpectedErrors<'r> {
    /// Reads those of the image that was resolved last.
    pub fn read(
        refiner: &Refiner,
        images: &RefinementImages,
        tile_px: Option<u32>,
        readback: &'r mut Readback,
    ) -> Result<ExpectedErrors<'r>> {
        let radiance = refiner.indirect_radiance;
        let weights = images.range_weights.as_ref();
        let both: Vec<&Image> = [radiance].into_iter().chain(weights).collect();
        let context = refiner.context;
        context.submit(|recorder| readback.record(recorder, &both))?;
        let mut of_range = Vec::new();
        if let Some(weights) = weights {
            // What the worst of light and ranges makes of an error.
            let worst = |pixel: &[f32; 4]| pixel.iter().fold(1.0, |a: f32, &b| a.max(b));
            of_range.extend(readback.copied(weights)?.iter().map(worst));
        }
        let image = readback.copied(radiance)?;
        let size_px = context.plan.resolution_px;
        Ok(ExpectedErrors::new(image, of_range, size_px, tile_px))
    }

    fn new(
        image: &'r [[f32; 4]],
        weights: Vec<f32>,
        size_px: [u32; 2],
        tile_px: Option<u32>,
    ) -> ExpectedErrors<'r> {
        let [width, height] = size_px;
        let tile_px = tile_px.unwrap_or(width.max(height));
        let [tile_columns, tile_rows] = size_px.map(|size| size.div_ceil(tile_px));
        let mut errors = ExpectedErrors {
            image,
            weights,
            size_px,
            tile_px,
            tile_columns,
            squares: vec![1.0; (tile_columns * tile_rows) as usize],
            blocks: Vec::new(),
            total: Block::default(),
        };
        // In one tile, errors need not be relative to anything.
        if errors.squares.len() > 1 {
            errors.squares = errors.mean_squares();
        }
        let [columns, rows] = errors.block_counts();
        let mut blocks = vec![Block::default(); (columns * rows) as usize];
        let of_thread = blocks
            .len()
            .div_ceil(thread_count())
            .max(MIN_BLOCKS_OF_THREAD);
        let parts = blocks.chunks_mut(of_thread).enumerate();
        for_each_at_once(parts, |(part, blocks)| {
            for (index, block) in (part * of_thread..).zip(blocks) {
                let index = index as u32;
                for (_, expected) in errors.pixels_of([index % columns, index / columns]) {
                    block.count += 1.0;
                    block.expected += expected;
                }
            }
        });
        for block in &blocks {
            errors.total.count += block.count;
            errors.total.expected += block.expected;
        }
        ExpectedErrors { blocks, ..errors }
    }

    /// The error that is expected of the whole image, relative to its radiance.
    pub fn relative_error(&self, radiance: f64) -> f64 {
        let mean_square = self.total.expected / self.total.count;
        (mean_square / 3.0).sqrt() / radiance
    }

    fn block_counts(&self) -> [u32; 2] {
        self.size_px.map(|size| size.div_ceil(BLOCK_PX))
    }

    /// The mean square of each tile's light, but not far below that of the image.
    fn mean_squares(&self) -> Vec<f64> {
        let width = self.size_px[0];
        let mut tiles = vec![(0.0, 0.0); self.squares.len()];
        for (index, pixel) in (0..).zip(self.image) {
            let [r, g, b, error] = pixel.map(f64::from);
            if error != 0.0 {
                let (sum, count) = &mut tiles[self.tile_of(index % width, index / width)];
                *sum += r * r + g * g + b * b;
                *count += 1.0;
            }
        }
        let all = tiles
            .iter()
            .fold((0.0, 0.0), |all, tile| (all.0 + tile.0, all.1 + tile.1));
        let floor = metrics::LOCAL_FLOOR.powi(2) * all.0 / f64::max(all.1, 1.0);
        let square = |(sum, count): (f64, f64)| (sum / count).max(floor);
        tiles.into_iter().map(square).collect()
    }

    fn tile_of(&self, x: u32, y: u32) -> usize {
        (y / self.tile_px * self.tile_columns + x / self.tile_px) as usize
    }

    /// The pixels of a block that show a surface, as column and row, with their squared expected errors.
    fn pixels_of(&self, [column, row]: [u32; 2]) -> impl Iterator<Item = ([u32; 2], f64)> {
        let [left, top] = [column, row].map(|at| at * BLOCK_PX);
        let [width, height] = self.size_px;
        let rows = top..(top + BLOCK_PX).min(height);
        let columns = left..(left + BLOCK_PX).min(width);
        let places = rows.flat_map(move |y| columns.clone().map(move |x| [x, y]));
        places.filter_map(move |[x, y]| {
            let index = (y * width + x) as usize;
            let error = f64::from(self.image[index][3]);
            let weight = self.weights.get(index).map_or(1.0, |&weight| weight.into());
            let relative_to = match self.squares.len() {
                1 => 1.0,
                _ => self.squares[self.tile_of(x, y)],
            };
            (error != 0.0).then_some(([x, y], weight * error * error / relative_to))
        })
    }

    /// Chooses `wanted` pixels, and their weights. Those with a larger expected error are chosen more often, some repeatedly. None if the
    /// image has no more pixels than that, or expects no error.
    pub fn choose(&self, wanted: u32, seed: u32) -> Vec<(u32, f64)> {
        let Block { count, expected } = self.total;
        if count <= f64::from(wanted) || !(expected > 0.0 && expected.is_finite()) {
            return Vec::new();
        }
        let mut chosen = Vec::new();
        let threshold = |stratum: usize| {
            let word = random::hash(stratum as u32 ^ random::hash(seed));
            (stratum as f64 + f64::from(word) / 4_294_967_296.0) / f64::from(wanted)
        };
        let even = 1.0 / count;
        let probability =
            |of: Block| EVEN_SHARE * of.count * even + (1.0 - EVEN_SHARE) * of.expected / expected;
        let (mut cumulative, [columns, _]) = (0.0, self.block_counts());
        for (index, block) in (0..).zip(&self.blocks) {
            let end = cumulative + probability(*block);
            for ([x, y], expected) in self.pixels_of([index % columns, index / columns]) {
                if threshold(chosen.len()) >= end {
                    break;
                }
                let own = probability(Block {
                    count: 1.0,
                    expected,
                });
                cumulative += own;
                while chosen.len() < wanted as usize && threshold(chosen.len()) < cumulative {
                    chosen.push((x + (y << 16), even / own));
                }
            }
            cumulative = end;
        }
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels with large errors are chosen more often, and weights undo it: sums over the sample are those over the image.
    #[test]
    fn weights_undo_the_choice_by_error() {
        let size = [90, 70];
        let error = |pixel: u32| if pixel % 53 == 7 { 1.0 } else { -0.05 };
        let mut image: Vec<[f32; 4]> = (0..90 * 70).map(|p| [1.0, 2.0, 3.0, error(p)]).collect();
        // The background.
        image[..900].fill([0.0; 4]);
        let pixels = image.len() as f64 - 900.0;
        for tile in [None, Some(9)] {
            let chosen = ExpectedErrors::new(&image, Vec::new(), size, tile).choose(1024, 5);
            assert_eq!(chosen.len(), 1024);
            let of = |pixel: u32| image[((pixel >> 16) * 90 + (pixel & 0xffff)) as usize][3];
            assert!(chosen.iter().all(|&(pixel, _)| of(pixel) != 0.0));
            let large = chosen.iter().filter(|&&(pixel, _)| of(pixel) == 1.0);
            assert!(large.clone().count() > 400);
            let share = large.map(|(_, weight)| weight).sum::<f64>() / chosen.len() as f64;
            let expected = image.iter().filter(|pixel| pixel[3] == 1.0).count() as f64 / pixels;
            assert!((share / expected - 1.0).abs() < 0.1, "{share} {expected}");
            let mean = chosen.iter().map(|(_, weight)| weight).sum::<f64>() / chosen.len() as f64;
            assert!((mean - 1.0).abs() < 0.05, "{mean}");
        }
        let none = ExpectedErrors::new(&image[..900], Vec::new(), [90, 10], None);
        assert!(none.choose(1024, 5).is_empty());
    }
}
