//! The image of a projector.

use super::Intrinsics;

/// Maximum tangent of the angle between a projector's axis and a corner of its image. Wider projectors are refused.
const WIDEST_TANGENT: f64 = 10.0;

/// The image of a projector: on a screen across its axis, each pixel is evenly lit, with no gap to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct ProjectedImage {
    /// Width, height.
    pub size_px: [u32; 2],
    /// As for a camera; the upper left pixel begins at (0, 0).
    pub intrinsics: Intrinsics,
    /// Irradiance on such a screen relative to the largest one, 0 to 1; row by row from the top.
    pub values: Vec<f32>,
}

impl ProjectedImage {
    /// Checks that the image is valid; the error says what is wrong.
    pub(super) fn check(&self) -> std::result::Result<(), String> {
        let [width, height] = self.size_px.map(|size| size as usize);
        let Intrinsics {
            fx,
            fy,
            cx,
            cy,
            skew,
        } = self.intrinsics;
        let is_positive = |value: f64| value.is_finite() && value > 0.0;
        for (is_right, problem) in [
            (
                width > 0 && height > 0 && self.values.len() == width * height,
                "the image has no pixels, or not one value for each",
            ),
            (
                self.values.iter().all(|value| (0.0..=1.0).contains(value))
                    && self.values.iter().any(|&value| value > 0.0),
                "the image's values must be from 0 to 1, and at least one above 0",
            ),
            (
                is_positive(fx) && is_positive(fy) && cx.is_finite() && cy.is_finite(),
                "the focal lengths fx, fy are not above 0, or cx, cy are not finite",
            ),
            (skew == 0.0, "the lens of a projector has no skew"),
        ] {
            if !is_right {
                return Err(problem.into());
            }
        }
        let widest = self.corner_tangent();
        if widest > WIDEST_TANGENT {
            return Err(format!(
                "a corner of the image is {:.1} degrees off the axis, above the maximum of 84",
                widest.atan().to_degrees()
            ));
        }
        Ok(())
    }

    /// The image's edges on a screen at distance 1: left and right, upper and lower, measured from the axis to the right and downwards.
    pub(crate) fn edges(&self) -> [[f64; 2]; 2] {
        let [width, height] = self.size_px.map(f64::from);
        let Intrinsics { fx, fy, cx, cy, .. } = self.intrinsics;
        [
            [-cx / fx, (width - cx) / fx],
            [-cy / fy, (height - cy) / fy],
        ]
    }

    /// Tangent of the angle between the axis and the farthest corner.
    pub(crate) fn corner_tangent(&self) -> f64 {
        let [across, down] = self.edges().map(|[a, b]| a.abs().max(b.abs()));
        across.hypot(down)
    }

    /// Radiant intensity in a direction (right, down, along the axis), relative to the intensity along the axis of a pixel with value 1.
    pub fn intensity(&self, [right, down, along]: [f64; 3]) -> f64 {
        if along <= 0.0 {
            return 0.0;
        }
        let (u, v) = (right / along, down / along);
        let Intrinsics { fx, fy, cx, cy, .. } = self.intrinsics;
        let [x, y] = [fx * u + cx, fy * v + cy].map(f64::floor);
        let [width, height] = self.size_px.map(f64::from);
        if !(0.0..width).contains(&x) || !(0.0..height).contains(&y) {
            return 0.0;
        }
        // On the screen, E = I·cos³θ.
        let value = self.values[y as usize * self.size_px[0] as usize + x as usize];
        f64::from(value) * (1.0 + u * u + v * v).powf(1.5)
    }

    /// Integral of [`ProjectedImage::intensity`] over all directions, sr.
    pub fn total(&self) -> f64 {
        let sum: f64 = self.values.iter().map(|&value| f64::from(value)).sum();
        sum / (self.intrinsics.fx * self.intrinsics.fy)
    }
}
