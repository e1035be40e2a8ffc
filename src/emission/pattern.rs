//! Texels of the faces around a light with a measured pattern, exact for the interpolated pattern.
//!
//! As for a spot light (`texels.rs`), but the integral up to γ also depends on the azimuth: linearly between two planes of the pattern.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec2;

use super::TexelEmission;
use super::texels::{Arc, ConeFace, Grid, Integral};
use crate::scene::{Pattern, PatternIntegral};

/// The pattern and its integral, from which the texels are computed.
pub(super) struct PatternTexels<'p> {
    pattern: &'p Pattern,
    integral: PatternIntegral<'p>,
}

impl<'p> PatternTexels<'p> {
    pub fn new(pattern: &'p Pattern) -> Self {
        PatternTexels {
            pattern,
            integral: PatternIntegral::new(pattern),
        }
    }

    /// Texels of a face about the axis γ = 0; a cube's faces have a `half_extent` of 1. The middle of a side is in the plane `turn_rad`. On
    /// the other faces, the plane C = 0 is upwards.
    pub fn face(
        &self,
        size: u32,
        half_extent: f64,
        kind: ConeFace,
        turn_rad: f64,
    ) -> Vec<TexelEmission> {
        let grid = Grid::new(size, half_extent);
        match kind {
            ConeFace::Side => {
                let edges = edges(&grid, |line, span| {
                    self.edge(&arc(1.0, line), turn_rad, span, false)
                });
                grid.texels(|x, row| edges(row, x) - edges(row + 1, x))
            }
            // Seen from inside, azimuths run counterclockwise on the front face and clockwise on the back face.
            ConeFace::Front => self.polar_face(&grid, false),
            ConeFace::Back => {
                let mut texels = self.polar_face(&grid, true);
                texels.chunks_mut(grid.size).for_each(<[_]>::reverse);
                texels
            }
        }
    }

    /// A face with a pole in its middle. Columns to the right assume that azimuths run counterclockwise.
    fn polar_face(&self, grid: &Grid, is_behind: bool) -> Vec<TexelEmission> {
        // The integral over `span` of a line at this distance from the pole.
        let edge = |distance: f64, foot_rad: f64, span: [f64; 2]| {
            let reach = if is_behind { -1.0 } else { 1.0 };
            self.edge(
                &arc(distance, reach),
                foot_rad,
                span.map(|t| t / distance),
                is_behind,
            )
        };
        let reversed = |[start, end]: [f64; 2]| [-end, -start];
        let rows = edges(grid, |height, span| match height {
            h if h > 0.0 => -edge(h, 0.0, reversed(span)),
            h if h < 0.0 => edge(-h, PI, span),
            _ => Integral::ZERO,
        });
        let columns = edges(grid, |right, span| match right {
            r if r > 0.0 => edge(r, -FRAC_PI_2, span),
            r if r < 0.0 => -edge(-r, FRAC_PI_2, reversed(span)),
            _ => Integral::ZERO,
        });
        grid.texels(|x, row| {
            rows(row, x) + columns(x + 1, row) - rows(row + 1, x) - columns(x, row)
        })
    }

    /// The integral over the azimuth along a great circle, counted from the nearer pole. The foot of the circle is in the plane `foot_rad`.
    fn edge(&self, arc: &Arc, foot_rad: f64, span: [f64; 2], is_behind: bool) -> Integral {
        let gammas_rad = &self.pattern.gammas_rad;
        let ends = [gammas_rad[0], self.pattern.widest_rad()];
        let turned = |psi_rad: f64| (foot_rad + psi_rad).rem_euclid(TAU);
        let up_to = |gamma_rad: f64, plane_rad: f64| {
            let clipped = gamma_rad.clamp(ends[0], ends[1]);
            // The difference of the cosines as a product, so that nothing cancels in narrow beams.
            let half_sines = [0.5 * (clipped + ends[0]), 0.5 * (clipped - ends[0])].map(f64::sin);
            let solid_angle = 2.0 * half_sines[0] * half_sines[1];
            DVec2::new(solid_angle, self.integral.within(gamma_rad, plane_rad))
        };
        // Nodes that the edge crosses: γ nodes between its ends and its foot, C nodes within its turn.
        let [first, last] = span.map(f64::atan);
        let foot = 0f64.clamp(first, last);
        let thetas = [first, last, foot].map(|psi_rad| arc.theta_rad(psi_rad));
        let low = thetas.iter().copied().fold(f64::INFINITY, f64::min);
        let high = thetas.iter().copied().fold(0.0, f64::max);
        let begin = gammas_rad.partition_point(|&gamma| gamma <= low);
        let end = gammas_rad.partition_point(|&gamma| gamma < high);
        let planes_rad = self.pattern.planes_rad.iter();
        let turns_rad: Vec<f64> = planes_rad
            .map(|plane_rad| (plane_rad - foot_rad + PI).rem_euclid(TAU) - PI)
            .filter(|turn_rad| (first..last).contains(turn_rad))
            .collect();
        let kinks_rad = &gammas_rad[begin.min(end)..end];
        arc.integrate(span, kinks_rad, &turns_rad, |theta_rad, psi_rad| {
            let plane_rad = turned(psi_rad);
            let before = up_to(theta_rad, plane_rad);
            if is_behind {
                up_to(PI, plane_rad) - before
            } else {
                before
            }
        })
    }
}

fn arc(rise: f64, reach: f64) -> Arc {
    Arc { rise, reach }
}

/// The integrals along the lines of a grid, for each span between crossing lines.
fn edges(
    grid: &Grid,
    integral: impl Fn(f64, [f64; 2]) -> Integral,
) -> impl Fn(usize, usize) -> Integral {
    let size = grid.size;
    let lines = (0..=size).flat_map(|line| (0..size).map(move |span| (line, span)));
    let edges: Vec<Integral> = lines
        .map(|(line, span)| integral(grid.line(line), grid.span(span)))
        .collect();
    move |line, span| edges[line * size + span]
}
