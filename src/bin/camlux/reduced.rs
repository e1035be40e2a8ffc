//! Images made small, for pages and sheets.

/// An RGB image, row by row from the top.
pub struct Reduced {
    pub size_px: [usize; 2],
    pub rgb: Vec<[f32; 3]>,
}

impl Reduced {
    /// The means over the smallest squares that make the image narrow enough; at the right and the bottom a square may be cut.
    pub fn new(resolution_px: [u32; 2], values: &[f32], widest_px: usize) -> Reduced {
        let [width, height] = resolution_px.map(|px| px as usize);
        let (pixels, _) = values.as_chunks::<3>();
        let edge = width.div_ceil(widest_px).max(1);
        let size_px = [width.div_ceil(edge), height.div_ceil(edge)];
        let mean = |left: usize, top: usize| {
            let columns = left..(left + edge).min(width);
            let rows = top..(top + edge).min(height);
            let count = (rows.len() * columns.len()) as f64;
            let mut sum = [0.0_f64; 3];
            for row in rows {
                for pixel in &pixels[row * width + columns.start..row * width + columns.end] {
                    for (sum, &value) in sum.iter_mut().zip(pixel) {
                        *sum += f64::from(value);
                    }
                }
            }
            sum.map(|sum| (sum / count) as f32)
        };
        let corners = (0..size_px[1]).flat_map(|y| (0..size_px[0]).map(move |x| (x, y)));
        Reduced {
            rgb: corners.map(|(x, y)| mean(x * edge, y * edge)).collect(),
            size_px,
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
