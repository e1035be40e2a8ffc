//! Integrals of a measured pattern, exact for the interpolated pattern.

use super::pattern::{Pattern, place};

/// ∫ p·sin γ dγ from γ = 0 on, for each plane of a pattern.
#[derive(Debug, Clone, PartialEq)]
pub struct PatternIntegral<'p> {
    pattern: &'p Pattern,
    /// The integral up to each γ node, plane by plane.
    up_to: Vec<f64>,
}

impl<'p> PatternIntegral<'p> {
    pub fn new(pattern: &'p Pattern) -> PatternIntegral<'p> {
        let mut up_to = Vec::with_capacity(pattern.intensities.len());
        for plane in 0..pattern.planes_rad.len() {
            let mut sum = 0.0;
            up_to.push(sum);
            for row in 0..pattern.gammas_rad.len() - 1 {
                sum += interval(pattern, plane, row, pattern.gammas_rad[row + 1]);
                up_to.push(sum);
            }
        }
        PatternIntegral { pattern, up_to }
    }

    /// ∫ p·sin γ' dγ' from 0 to γ at this C, per radian of C.
    pub fn within(&self, gamma_rad: f64, plane_rad: f64) -> f64 {
        let (gammas_rad, rows) = (&self.pattern.gammas_rad, self.pattern.gammas_rad.len());
        let gamma_rad = gamma_rad.clamp(gammas_rad[0], gammas_rad[rows - 1]);
        let (row, _) = place(gammas_rad, gamma_rad);
        let (column, across) = place(&self.pattern.planes_rad, plane_rad);
        let at = |plane: usize| {
            self.up_to[plane * rows + row] + interval(self.pattern, plane, row, gamma_rad)
        };
        let (a, b) = (at(column), at(column + 1));
        a + across * (b - a)
    }

    /// ∫ p dω over all directions, sr.
    pub fn total(&self) -> f64 {
        let (planes_rad, rows) = (&self.pattern.planes_rad, self.pattern.gammas_rad.len());
        let of_plane = |plane: usize| self.up_to[plane * rows + rows - 1];
        let wedges = planes_rad.windows(2).enumerate();
        let wedges = wedges.map(|(plane, ends)| {
            0.5 * (of_plane(plane) + of_plane(plane + 1)) * (ends[1] - ends[0])
        });
        wedges.sum()
    }
}

/// ∫ p·sin from a node to an angle before the next, where p = v + s·(γ − γ_0): v·cos γ_0 − p·cos γ + s·(sin γ − sin γ_0). The differences
/// are written as products, so that nothing cancels in narrow beams.
fn interval(pattern: &Pattern, plane: usize, row: usize, gamma_rad: f64) -> f64 {
    let (low, high) = (pattern.gammas_rad[row], pattern.gammas_rad[row + 1]);
    let values = pattern.plane(plane);
    let slope = (values[row + 1] - values[row]) / (high - low);
    let step = gamma_rad - low;
    let (middle, half) = (low + 0.5 * step, 0.5 * step);
    // ∫ sin = 2·sin(middle)·sin(half); ∫ (γ − γ_0)·sin = sin γ − sin γ_0 − (γ − γ_0)·cos γ.
    let of_one = 2.0 * middle.sin() * half.sin();
    let of_step = 2.0 * middle.cos() * half.sin() - step * gamma_rad.cos();
    values[row] * of_one + slope * of_step
}
