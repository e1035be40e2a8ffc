//! Measured radiation patterns of lights.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::{PatternIntegral, SpotCone};

/// The radiant intensity of a lamp over all directions, relative to its largest value.
///
/// Directions use the C-γ system of the CIE, which is the type C system of IES LM-63. γ is the angle from the direction in which the lamp
/// shines. The plane C turns about that direction, counterclockwise as seen along it. Between the nodes of γ and C the intensity is
/// interpolated linearly in both; before the first and after the last γ it is 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    /// Nodes of γ, radians, increasing, from 0 to π at most.
    pub gammas_rad: Vec<f64>,
    /// Nodes of C, radians, increasing, from 0 to 2π. The values at 0 and 2π are the same.
    pub planes_rad: Vec<f64>,
    /// For each plane one value per γ, 0 to 1.
    pub intensities: Vec<f64>,
    /// The intensity in the file that corresponds to 1.
    pub peak: f64,
}

/// The measurements in a file, before they are spread over all planes.
pub(crate) struct Measured {
    /// Degrees, increasing.
    pub gammas_deg: Vec<f64>,
    /// Degrees, increasing.
    pub planes_deg: Vec<f64>,
    /// For each plane one value per γ, in the unit of the file.
    pub intensities: Vec<f64>,
}

impl Pattern {
    /// The pattern seen through the opening of a spot light: multiplied by s(γ), which is interpolated linearly between nodes in the
    /// penumbra.
    pub(crate) fn within(&self, cone: SpotCone) -> Pattern {
        /// Number of intervals in the penumbra.
        const PARTS: u32 = 32;
        let inner = cone.inner_half_angle_deg.to_radians().min(PI);
        let outer = cone.outer_half_angle_deg.to_radians().min(PI);
        let of_penumbra =
            (0..=PARTS).map(|part| inner + (outer - inner) * f64::from(part) / f64::from(PARTS));
        let own = self.gammas_rad.iter().copied();
        // A node just beyond the edge, so that the intensity is 0 beyond a sharp edge.
        let beyond = [(outer * (1.0 + 1e-9)).min(PI)];
        let all = own
            .filter(|gamma| *gamma < outer)
            .chain(of_penumbra)
            .chain(beyond);
        let (first, last) = (
            self.gammas_rad[0],
            self.gammas_rad[self.gammas_rad.len() - 1],
        );
        let mut gammas_rad: Vec<f64> = all.filter(|gamma| (first..=last).contains(gamma)).collect();
        gammas_rad.sort_by(f64::total_cmp);
        gammas_rad.dedup();
        let falloff = |gamma: f64| match gamma {
            gamma if gamma <= inner => 1.0,
            gamma if gamma > outer => 0.0,
            gamma => (0.5 * PI * (gamma - inner) / (outer - inner))
                .cos()
                .max(0.0),
        };
        let planes = self.planes_rad.iter().flat_map(|&plane_rad| {
            let value = move |&gamma: &f64| falloff(gamma) * self.intensity(gamma, plane_rad);
            gammas_rad.iter().map(value)
        });
        let intensities = planes.collect();
        Pattern {
            intensities,
            planes_rad: self.planes_rad.clone(),
            gammas_rad,
            peak: self.peak,
        }
    }

    /// Spreads measurements over all planes. A single plane applies to all. Half and quarters of a turn are mirrored at their first and last
    /// planes, which are multiples of 90 degrees.
    pub(crate) fn of(measured: Measured) -> std::result::Result<Pattern, String> {
        let Measured {
            gammas_deg,
            planes_deg,
            intensities,
        } = measured;
        if planes_deg.windows(2).any(|pair| pair[0] >= pair[1]) || planes_deg.is_empty() {
            return Err("the horizontal angles do not increase".into());
        }
        let measured = intensities.chunks(gammas_deg.len().max(1));
        let mut planes: Vec<(f64, &[f64])> = planes_deg.iter().copied().zip(measured).collect();
        let (first_deg, last_deg) = (planes_deg[0], planes_deg[planes_deg.len() - 1]);
        let mut mirror = || {
            let about_deg = planes[planes.len() - 1].0;
            for i in (0..planes.len() - 1).rev() {
                planes.push((2.0 * about_deg - planes[i].0, planes[i].1));
            }
        };
        let is_on_axis = first_deg.rem_euclid(90.0) == 0.0;
        let widest_deg = planes_deg.windows(2).map(|pair| pair[1] - pair[0]);
        let widest_deg = widest_deg.fold(0.0, f64::max);
        match last_deg - first_deg {
            0.0 if first_deg == 0.0 => {}
            90.0 if is_on_axis => {
                mirror();
                mirror();
            }
            180.0 if is_on_axis => mirror(),
            360.0 => {}
            // The last plane is before 360 degrees, as in EULUMDAT.
            span if span < 360.0 && 360.0 - span <= widest_deg * (1.0 + 1e-6) => {}
            _ => {
                return Err(format!(
                    "the horizontal angles are from {first_deg} to {last_deg} degrees, which is neither 0, a whole turn, nor a half or a quarter from a multiple of 90"
                ));
            }
        }
        // A turn from 0 to 360, whatever the first angle was.
        if planes.len() > 1 && planes[planes.len() - 1].0 - planes[0].0 == 360.0 {
            planes.pop();
        }
        for (plane_deg, _) in &mut planes {
            *plane_deg = plane_deg.rem_euclid(360.0);
        }
        planes.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let (after, before) = (planes[0], planes[planes.len() - 1]);
        let at_0: Vec<f64> = if after.0 == 0.0 {
            after.1.to_vec()
        } else {
            let share = (360.0 - before.0) / (360.0 - before.0 + after.0);
            let pairs = before.1.iter().zip(after.1);
            pairs.map(|(a, b)| a + share * (b - a)).collect()
        };
        let inside = planes.iter().filter(|(plane_deg, _)| *plane_deg != 0.0);
        let whole = [(0.0, &at_0[..])].into_iter().chain(inside.copied());
        let (planes_deg, planes): (Vec<f64>, Vec<&[f64]>) =
            whole.chain([(360.0, &at_0[..])]).unzip();
        let values = planes.concat();
        let peak = values.iter().copied().fold(0.0, f64::max);
        let radians = |angles: Vec<f64>| angles.into_iter().map(f64::to_radians).collect();
        let pattern = Pattern {
            gammas_rad: radians(gammas_deg),
            planes_rad: radians(planes_deg),
            intensities: values.into_iter().map(|value| value / peak).collect(),
            peak,
        };
        pattern.check().map(|()| pattern)
    }

    /// Checks that the pattern is valid; the error says what is wrong.
    pub(crate) fn check(&self) -> std::result::Result<(), String> {
        let Pattern {
            gammas_rad,
            planes_rad,
            intensities,
            peak,
        } = self;
        let increases = |angles: &[f64]| angles.windows(2).all(|pair| pair[0] < pair[1]);
        let is_whole_turn = planes_rad.first() == Some(&0.0)
            && planes_rad
                .last()
                .is_some_and(|last| (last - TAU).abs() < 1e-9);
        let is_relative = |value: &f64| (0.0..=1.0).contains(value);
        for (is_right, problem) in [
            (
                gammas_rad.len() >= 2 && increases(gammas_rad),
                "the vertical angles do not increase, or are fewer than two",
            ),
            (
                gammas_rad.iter().all(|gamma| (0.0..=PI).contains(gamma)),
                "the vertical angles are not all within 0 and 180 degrees",
            ),
            (
                planes_rad.len() >= 2 && increases(planes_rad) && is_whole_turn,
                "the horizontal angles do not increase from 0 to 360 degrees",
            ),
            (
                intensities.len() == gammas_rad.len() * planes_rad.len(),
                "there must be one intensity for each pair of a vertical and a horizontal angle",
            ),
            (
                intensities.iter().all(is_relative)
                    && intensities.iter().any(|&value| value > 0.0)
                    && (0.0..=1e30).contains(peak),
                "the intensities must be finite values of 0 or more, and at least one above 0",
            ),
        ] {
            if !is_right {
                return Err(problem.into());
            }
        }
        // The solid angle of a cone of 1e-4 degrees.
        const NARROWEST_SR: f64 = 1e-11;
        match PatternIntegral::new(self).total() {
            total if total >= NARROWEST_SR => Ok(()),
            total => Err(format!(
                "the beam has a solid angle of {total:e} sr, below the minimum of 1e-11 sr"
            )),
        }
    }

    /// γ beyond which there is no light.
    pub fn widest_rad(&self) -> f64 {
        let rows = self.gammas_rad.len();
        let is_lit = |row: &usize| (0..self.planes_rad.len()).any(|c| self.plane(c)[*row] > 0.0);
        let last_lit = (0..rows).rev().find(is_lit).unwrap_or(0);
        self.gammas_rad[(last_lit + 1).min(rows - 1)]
    }

    /// Number of angles and intensities.
    pub(crate) fn number_count(&self) -> u32 {
        (self.gammas_rad.len() + self.planes_rad.len() + self.intensities.len()) as u32
    }

    /// The intensities of a plane, one for each γ.
    pub(crate) fn plane(&self, index: usize) -> &[f64] {
        let count = self.gammas_rad.len();
        &self.intensities[index * count..][..count]
    }

    /// The intensity in a direction, 0 to 1. C is between 0 and 2π.
    pub fn intensity(&self, gamma_rad: f64, plane_rad: f64) -> f64 {
        let (Some(&first), Some(&last)) = (self.gammas_rad.first(), self.gammas_rad.last()) else {
            return 0.0;
        };
        if !(first..=last).contains(&gamma_rad) {
            return 0.0;
        }
        let (row, along) = place(&self.gammas_rad, gamma_rad);
        let (column, across) = place(&self.planes_rad, plane_rad);
        let at = |column: usize| {
            let plane = self.plane(column);
            plane[row] + along * (plane[row + 1] - plane[row])
        };
        let (a, b) = (at(column), at(column + 1));
        a + across * (b - a)
    }
}

/// The interval of nodes that contains a value, and the position in it, 0 to 1.
pub(crate) fn place(nodes: &[f64], value: f64) -> (usize, f64) {
    let after = nodes.partition_point(|&node| node <= value);
    let interval = after.clamp(1, nodes.len() - 1) - 1;
    let (low, high) = (nodes[interval], nodes[interval + 1]);
    (interval, ((value - low) / (high - low)).clamp(0.0, 1.0))
}

/// The axes of a lamp, unit vectors in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatternAxes {
    /// γ = 0.
    pub direction: DVec3,
    /// γ = 90°, C = 0: the part of `up` perpendicular to the direction.
    pub plane_0: DVec3,
    /// γ = 90°, C = 90°.
    pub plane_90: DVec3,
}

impl PatternAxes {
    /// Makes the axes from a direction and an up vector that is not parallel to it.
    pub fn new(direction: DVec3, up: DVec3) -> PatternAxes {
        let direction = direction.normalize();
        let plane_90 = up.cross(direction).normalize();
        PatternAxes {
            direction,
            plane_0: direction.cross(plane_90),
            plane_90,
        }
    }

    /// γ (0 to π) and C (0 to 2π) of a direction of any length but zero.
    pub fn angles_rad(&self, towards: DVec3) -> [f64; 2] {
        let along = towards.dot(self.direction);
        let (x, y) = (towards.dot(self.plane_0), towards.dot(self.plane_90));
        let plane_rad = y.atan2(x);
        let turned = if plane_rad < 0.0 {
            plane_rad + TAU
        } else {
            plane_rad
        };
        [x.hypot(y).atan2(along).min(PI), turned]
    }
}
