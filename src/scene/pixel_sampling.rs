//! The area of a pixel over which the camera averages light.

use std::f64::consts::TAU;

use glam::DVec2;

/// σ of the Gaussian and its cut-off radius, pixels from the pixel's centre.
const GAUSSIAN_SIGMA_PX: f64 = 0.5;
const GAUSSIAN_RADIUS_PX: f64 = 1.5;

/// The points of a pixel over which light is averaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelSampling {
    /// Points per pixel, 2 to [`PixelSampling::MAX_SAMPLES`].
    pub samples: u32,
    pub filter: PixelFilter,
}

/// The weight of a point of the image, by its position around the pixel's centre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PixelFilter {
    /// All points of the pixel count equally.
    #[default]
    Box,
    /// A Gaussian of σ = 0.5 pixels, cut off at 1.5 pixels.
    Gaussian,
}

impl PixelFilter {
    pub const ALL: [PixelFilter; 2] = [PixelFilter::Box, PixelFilter::Gaussian];

    /// The name in scene files and image headers.
    pub fn name(self) -> &'static str {
        match self {
            PixelFilter::Box => "box",
            PixelFilter::Gaussian => "gaussian",
        }
    }
}

impl PixelSampling {
    /// Maximum number of points per pixel.
    pub const MAX_SAMPLES: u32 = 4096;

    /// The points, pixels from the pixel's centre. All have the same weight: for the Gaussian, the density of the points follows the
    /// filter.
    pub(crate) fn offsets_px(&self) -> Vec<DVec2> {
        let points = lattice(self.samples);
        let offset = |[u, v]: [f64; 2]| match self.filter {
            PixelFilter::Box => DVec2::new(u - 0.5, v - 0.5),
            PixelFilter::Gaussian => {
                // The share of the Gaussian beyond its cut-off radius.
                let tail = (-0.5 * (GAUSSIAN_RADIUS_PX / GAUSSIAN_SIGMA_PX).powi(2)).exp();
                let radius = GAUSSIAN_SIGMA_PX * (-2.0 * (1.0 - u * (1.0 - tail)).ln()).sqrt();
                radius * DVec2::from_angle(TAU * v)
            }
        };
        points.into_iter().map(offset).collect()
    }
}

/// Points spread evenly over the unit square, none on its border: the rank-1 lattice with the largest minimum distance between points.
fn lattice(count: u32) -> Vec<[f64; 2]> {
    let n = u64::from(count);
    // Square of the distance from 0 in steps of 1/n, around the torus.
    let from_0 = |steps: u64| (steps % n).min(n - steps % n).pow(2);
    let nearest = |generator: u64| {
        let apart = (1..n).map(|i| from_0(i) + from_0(i * generator));
        apart.min().unwrap_or_default()
    };
    // A generator and its negative give mirror images. One that shares a factor with n would put several points into one row.
    let generators = (1..=n / 2).filter(|&generator| greatest_common_divisor(generator, n) == 1);
    let generator = generators.max_by_key(|&generator| nearest(generator));
    let generator = generator.unwrap_or(1);
    let place = |steps: u64| ((steps % n) as f64 + 0.5) / n as f64;
    (0..n).map(|i| [i, i * generator].map(place)).collect()
}

fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    match b {
        0 => a,
        _ => greatest_common_divisor(b, a % b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each strip of a pixel has its share of the points, along both axes, and the means match the filter's.
    #[test]
    fn points_lie_evenly_in_the_filter() {
        for samples in [2, 3, 16, 50, 64, 1024] {
            let sampling = |filter| PixelSampling { samples, filter }.offsets_px();
            let in_box = sampling(PixelFilter::Box);
            for axis in 0..2 {
                let mut places: Vec<f64> = in_box.iter().map(|offset| offset[axis]).collect();
                places.sort_by(f64::total_cmp);
                for (i, place) in places.iter().enumerate() {
                    let due = (i as f64 + 0.5) / f64::from(samples) - 0.5;
                    assert!((place - due).abs() < 1e-12, "{samples}: {place} for {due}");
                }
            }
            let gaussian = sampling(PixelFilter::Gaussian);
            assert_eq!(gaussian.len(), samples as usize);
            let inside = |offset: &DVec2| offset.length() <= GAUSSIAN_RADIUS_PX;
            assert!(gaussian.iter().all(inside));
            if samples >= 50 {
                let mean_square = gaussian.iter().map(|offset| offset.length_squared());
                let mean_square = mean_square.sum::<f64>() / f64::from(samples);
                // 2σ²·(1 − tail·(1 + R²/2σ²))/(1 − tail), R = 3σ.
                let tail = (-4.5_f64).exp();
                let due = 0.5 * (1.0 - tail * 5.5) / (1.0 - tail);
                assert!(
                    (mean_square - due).abs() < 0.02,
                    "{samples}: {mean_square} for {due}"
                );
            }
        }
    }
}
