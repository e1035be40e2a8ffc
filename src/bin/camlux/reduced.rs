//! Reduces images for pages and contact sheets.

use glam::{DVec3, Vec3};

/// The smallest squares of pixels that make an image narrow enough. Squares at the right and bottom edge may be cut.
pub struct Squares {
    /// Number of squares in a row and in a column.
    pub size_px: [usize; 2],
    edge: usize,
    resolution_px: [usize; 2],
}

impl Squares {
    pub fn new(resolution_px: [u32; 2], widest_px: usize) -> Squares {
        let resolution_px = resolution_px.map(|px| px as usize);
        let edge = resolution_px[0].div_ceil(widest_px).max(1);
        Squares {
            size_px: resolution_px.map(|px| px.div_ceil(edge)),
            edge,
            resolution_px,
        }
    }

    /// Indices of the pixels in a square.
    pub fn pixels(&self, [x, y]: [usize; 2]) -> impl Iterator<Item = usize> {
        let [width, height] = self.resolution_px;
        let columns = x * self.edge..((x + 1) * self.edge).min(width);
        let rows = y * self.edge..((y + 1) * self.edge).min(height);
        rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
    }
}

/// An RGB image, row by row from the top.
pub struct Reduced {
    pub size_px: [usize; 2],
    pub rgb: Vec<[f32; 3]>,
}

impl Reduced {
    /// The mean of each square of pixels.
    pub fn new(resolution_px: [u32; 2], values: &[f32], widest_px: usize) -> Reduced {
        let squares = Squares::new(resolution_px, widest_px);
        let [columns, rows] = squares.size_px;
        let (pixels, _) = values.as_chunks::<3>();
        let mean = |at| {
            let (mut sum, mut count) = (DVec3::ZERO, 0);
            for index in squares.pixels(at) {
                sum += Vec3::from(pixels[index]).as_dvec3();
                count += 1;
            }
            (sum / f64::from(count)).as_vec3().into()
        };
        let places = (0..rows).flat_map(|y| (0..columns).map(move |x| [x, y]));
        Reduced {
            rgb: places.map(mean).collect(),
            size_px: squares.size_px,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_keep_the_mean() {
        // 482 x 3 pixels in squares of 3: 161 x 1, the last column 2 wide.
        let values: Vec<f32> = (0..482 * 3).flat_map(|i| [(i % 482) as f32; 3]).collect();
        let small = Reduced::new([482, 3], &values, 240);
        assert_eq!(small.size_px, [161, 1]);
        assert_eq!(small.rgb[0], [1.0; 3]);
        assert_eq!(small.rgb[160], [480.5; 3]);
    }
}
