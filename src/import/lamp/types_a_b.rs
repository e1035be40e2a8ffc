//! Photometry of types A and B, turned into type C.

use crate::scene::{Measured, Pattern, place};

/// Limit of nodes of γ, above what any instrument measures.
const MOST_GAMMAS: usize = 2000;
/// Limit of the intensities that the pattern gets.
const MOST_INTENSITIES: usize = 130_000;
/// Steps of the pattern are no longer than this; those of C no shorter than the second.
const LONGEST_STEP_DEG: f64 = 1.25;
const LEAST_PLANE_STEP_DEG: f64 = 0.5;
/// Tolerance at the edge of the measurements, where rounding decides.
const AT_EDGE_DEG: f64 = 1e-6;

/// The axis in which the planes of measurement meet. H = V = 0 is the direction of the lamp. V = 90 is up, and H = 90 is right for a viewer
/// who looks along the direction.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum PolarAxis {
    /// Type A: H turns about the vertical axis, V is the elevation from the plane perpendicular to it.
    Vertical,
    /// Type B: V turns about the horizontal axis, H is the angle from the plane perpendicular to it.
    Horizontal,
}

/// Intensities over vertical and horizontal angles, interpolated linearly in both.
pub(super) struct Grid {
    polar_axis: PolarAxis,
    vertical_deg: Vec<f64>,
    horizontal_deg: Vec<f64>,
    /// For each horizontal angle one value per vertical angle.
    intensities: Vec<f64>,
}

impl Grid {
    /// # Errors
    /// Returns what is wrong with the angles.
    pub fn new(
        polar_axis: PolarAxis,
        vertical_deg: Vec<f64>,
        horizontal_deg: Vec<f64>,
        intensities: Vec<f64>,
    ) -> Result<Grid, String> {
        let (most_vertical, most_horizontal) = match polar_axis {
            PolarAxis::Vertical => (90.0, 180.0),
            PolarAxis::Horizontal => (180.0, 90.0),
        };
        for (name, angles, most) in [
            ("vertical", &vertical_deg, most_vertical),
            ("horizontal", &horizontal_deg, most_horizontal),
        ] {
            if angles.len() < 2 || angles.windows(2).any(|pair| pair[0] >= pair[1]) {
                return Err(format!(
                    "the {name} angles do not increase, or are fewer than two"
                ));
            }
            if angles.iter().any(|angle| angle.abs() > most) {
                return Err(format!(
                    "the {name} angles are not all within {} and {most} degrees",
                    -most
                ));
            }
        }
        Ok(Grid {
            polar_axis,
            vertical_deg,
            horizontal_deg,
            intensities,
        })
    }

    /// Samples the grid at nodes of γ and C. On the axes H = 0 and V = 0 every angle of the file becomes a node.
    pub fn pattern(&self) -> Result<Pattern, String> {
        let angles = self.vertical_deg.iter().chain(&self.horizontal_deg);
        let mut nodes: Vec<f64> = angles.map(|angle| angle.abs()).collect();
        nodes.extend([0.0, self.widest_deg()]);
        nodes.sort_by(f64::total_cmp);
        nodes.dedup_by(|a, b| *a - *b < AT_EDGE_DEG);
        let mut gammas_deg = vec![0.0];
        for pair in nodes.windows(2) {
            // Off the axes the kinks lie between these nodes.
            let parts = ((pair[1] - pair[0]) / LONGEST_STEP_DEG).ceil().max(2.0) as usize;
            let part = |i: usize| pair[0] + (pair[1] - pair[0]) * i as f64 / parts as f64;
            gammas_deg.extend((1..=parts).map(part));
            if gammas_deg.len() > MOST_GAMMAS {
                return Err("there are more angles than any instrument measures".into());
            }
        }
        let steps = |angles: &[f64]| {
            let steps = angles.windows(2).map(|pair| pair[1] - pair[0]);
            steps.fold(f64::INFINITY, f64::min)
        };
        let finest_deg = steps(&self.vertical_deg).min(steps(&self.horizontal_deg));
        let step_deg = finest_deg.clamp(LEAST_PLANE_STEP_DEG, LONGEST_STEP_DEG);
        let most_planes = MOST_INTENSITIES / gammas_deg.len();
        // A multiple of 4, so that the axes are nodes.
        let quarter = ((90.0 / step_deg).ceil() as usize).clamp(1, (most_planes / 4).max(1));
        let planes_deg: Vec<f64> = (0..=4 * quarter)
            .map(|i| 90.0 * i as f64 / quarter as f64)
            .collect();
        let at = planes_deg
            .iter()
            .flat_map(|&plane| gammas_deg.iter().map(move |&gamma| (gamma, plane)));
        let intensities = at
            .map(|(gamma, plane)| self.intensity(gamma, plane))
            .collect();
        Pattern::of(Measured {
            gammas_deg,
            planes_deg,
            intensities,
        })
    }

    /// γ beyond which nothing was measured.
    fn widest_deg(&self) -> f64 {
        let most = |angles: &[f64]| {
            let ends = [angles[0], angles[angles.len() - 1]];
            ends.map(f64::abs).into_iter().fold(0.0, f64::max)
        };
        let (v, h) = (most(&self.vertical_deg), most(&self.horizontal_deg));
        if v > 90.0 || h > 90.0 {
            return 180.0;
        }
        let cosine = v.to_radians().cos() * h.to_radians().cos();
        cosine.clamp(0.0, 1.0).acos().to_degrees().max(v).max(h)
    }

    /// The intensity in a direction of type C.
    fn intensity(&self, gamma_deg: f64, plane_deg: f64) -> f64 {
        let (sin_gamma, cos_gamma) = gamma_deg.to_radians().sin_cos();
        let (sin_plane, cos_plane) = plane_deg.to_radians().sin_cos();
        let (up, right) = (sin_gamma * cos_plane, -sin_gamma * sin_plane);
        let (vertical, horizontal) = match self.polar_axis {
            PolarAxis::Vertical => (up.clamp(-1.0, 1.0).asin(), right.atan2(cos_gamma)),
            PolarAxis::Horizontal => (up.atan2(cos_gamma), right.clamp(-1.0, 1.0).asin()),
        };
        let along = |angles: &[f64], angle_deg: f64| {
            let (first, last) = (angles[0], angles[angles.len() - 1]);
            // Angles from 0 on mean that the other side is the same.
            let angle_deg = if first == 0.0 {
                angle_deg.abs()
            } else {
                angle_deg
            };
            let is_measured = (first - AT_EDGE_DEG..=last + AT_EDGE_DEG).contains(&angle_deg);
            is_measured.then(|| place(angles, angle_deg))
        };
        let (Some((row, down)), Some((column, across))) = (
            along(&self.vertical_deg, vertical.to_degrees()),
            along(&self.horizontal_deg, horizontal.to_degrees()),
        ) else {
            return 0.0;
        };
        let at = |column: usize| {
            let of_column = &self.intensities[column * self.vertical_deg.len()..];
            of_column[row] + down * (of_column[row + 1] - of_column[row])
        };
        at(column) + across * (at(column + 1) - at(column))
    }
}
