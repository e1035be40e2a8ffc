//! Texels of a projector's face, exact for its image.

use super::{TexelEmission, texels::Grid};
use crate::model::rectangle_solid_angle;
use crate::scene::{Intrinsics, ProjectedImage};

/// Texels of a face about the axis, with the up direction of the image.
pub(super) fn projected_face(
    image: &ProjectedImage,
    size: u32,
    half_extent: f64,
) -> Vec<TexelEmission> {
    let grid = Grid::new(size, half_extent);
    let sums = sums_over(image);
    let [columns, rows] = image.size_px.map(|size| size as usize);
    let Intrinsics { fx, fy, cx, cy, .. } = image.intrinsics;
    // ∫∫ of the image from its upper left corner to a point of the screen. It is bilinear within each pixel.
    let within = |u: f64, v: f64| {
        let place = |pixels: f64, count: usize| {
            let pixels = pixels.clamp(0.0, count as f64);
            let index = (pixels as usize).min(count - 1);
            (index, pixels - index as f64)
        };
        let (column, x) = place(fx * u + cx, columns);
        let (row, y) = place(fy * v + cy, rows);
        let at = |column: usize, row: usize| sums[row * (columns + 1) + column];
        let above = at(column, row) + x * (at(column + 1, row) - at(column, row));
        let below = at(column, row + 1) + x * (at(column + 1, row + 1) - at(column, row + 1));
        (above + y * (below - above)) / (fx * fy)
    };
    let [across, down] = image.edges();
    let cut =
        |[low, high]: [f64; 2], edges: [f64; 2]| [low, high].map(|t| t.clamp(edges[0], edges[1]));
    let texel = |x: usize, row: usize| {
        let [up_low, up_high] = grid.span(row);
        let [left, right] = cut(grid.span(x), across);
        let [top, bottom] = cut([-up_high, -up_low], down);
        let measure = rectangle_solid_angle([left, right], [top, bottom]);
        let lit =
            within(right, bottom) - within(left, bottom) - within(right, top) + within(left, top);
        if measure <= 0.0 {
            return TexelEmission::default();
        }
        TexelEmission {
            measure,
            falloff: lit.max(0.0) / measure,
        }
    };
    let rows = (0..grid.size).rev();
    rows.flat_map(|row| (0..grid.size).map(move |x| (x, row)))
        .map(|(x, row)| texel(x, row))
        .collect()
}

/// For each corner of a pixel, the sum over all pixels above and to the left.
fn sums_over(image: &ProjectedImage) -> Vec<f64> {
    let columns = image.size_px[0] as usize;
    let mut sums = vec![0.0; columns + 1];
    for row in image.values.chunks_exact(columns) {
        let above = sums.len() - (columns + 1);
        let mut of_row = 0.0;
        sums.push(0.0);
        for (column, &value) in row.iter().enumerate() {
            of_row += f64::from(value);
            sums.push(sums[above + column + 1] + of_row);
        }
    }
    sums
}
