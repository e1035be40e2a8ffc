//! Measure and mean falloff of the texels of one face.
//!
//! All integrals run along the edges of the texels. With θ the angle from the axis, φ the azimuth about it and G(θ) = ∫₀^θ s·sin θ' dθ' in
//! closed form ([`ConeIntegral`]), Green's theorem gives ∫ s dω = ∮ G(θ) dφ around a texel. On an edge, the integrand is a smooth function
//! of φ except at the kinks of the emission, which are known. So a low-order Gauss rule between them reaches rounding error. Neighbours
//! share their edges, so the sums over a face telescope: they are exact at any size. Nothing is normalised afterwards.

use std::f64::consts::PI;

use glam::DVec2;

use super::TexelEmission;
use crate::model::rectangle_solid_angle;
use crate::scene::ConeIntegral;

/// How a face of a cube is oriented to a spot light's axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ConeFace {
    /// The axis leaves through its centre.
    Front,
    /// The reversed axis leaves through its centre.
    Back,
    /// Parallel to the axis, which is its up direction.
    Side,
}

/// An integral over a texel or along an edge: x is the integral of 1, y the integral of the falloff s.
pub(super) type Integral = DVec2;

/// Texels of one face of a cube around a point light.
pub(super) fn cube_face(size: u32) -> Vec<TexelEmission> {
    let grid = Grid::new(size, 1.0);
    grid.texels(|x, row| {
        // Compute all in one quadrant, so that mirrored texels are exactly equal.
        let [x, row] = [x, row].map(|i| grid.span(grid.size - 1 - grid.outward(i)));
        DVec2::splat(rectangle_solid_angle(x, row))
    })
}

/// Texels of one face around a spot light. `half_extent` is 1 for the faces of a cube.
pub(super) fn cone_face(
    size: u32,
    half_extent: f64,
    integral: &ConeIntegral,
    kind: ConeFace,
) -> Vec<TexelEmission> {
    let grid = Grid::new(size, half_extent);
    let outer_rad = integral.outer_rad;
    let kinks_rad = integral.kinks_rad();
    let within = |theta| {
        let solid_angle = integral.solid_angle_within(theta);
        DVec2::new(solid_angle, integral.falloff_within(theta))
    };
    let total = within(PI);
    let arc = |rise, reach| Arc { rise, reach };
    match kind {
        ConeFace::Front => centred_face(
            &grid,
            |near, _| near.atan() < outer_rad,
            |p, t| {
                arc(p, 1.0).integrate(t.map(|t| t / p), &kinks_rad, &[], |theta, _| within(theta))
            },
        ),
        // Here G is counted from the pole at the back, because around that pole ∮ dφ is not 0.
        ConeFace::Back => centred_face(
            &grid,
            |_, far| PI - far.atan() < outer_rad,
            |p, t| {
                let beyond = |theta, _| total - within(theta);
                arc(p, -1.0).integrate(t.map(|t| t / p), &kinks_rad, &[], beyond)
            },
        ),
        ConeFace::Side => side_face(
            &grid,
            |cot_theta| 1f64.atan2(cot_theta) < outer_rad,
            |b, a| arc(1.0, b).integrate(a, &kinks_rad, &[], |theta, _| within(theta)),
        ),
    }
}

/// Texels of a directional light's face: areas inside the disc with this radius, in closed form (∮ ½ρ² dφ).
pub(super) fn disc_face(size: u32, half_extent_m: f64, radius_m: f64) -> Vec<TexelEmission> {
    centred_face(
        &Grid::new(size, half_extent_m),
        |near_m, _| near_m < radius_m,
        |p_m, t_m| {
            let rim_m = (radius_m * radius_m - p_m * p_m).max(0.0).sqrt();
            let from_foot_m2 = |t_m: f64| {
                let inside_m = t_m.abs().min(rim_m);
                let outside_rad = t_m.abs().atan2(p_m) - inside_m.atan2(p_m);
                0.5 * (p_m * inside_m + radius_m * radius_m * outside_rad) * t_m.signum()
            };
            DVec2::splat(from_foot_m2(t_m[1]) - from_foot_m2(t_m[0]))
        },
    )
}

/// Texels of a face with the axis through its centre. `edge(p, [t0, t1])` is the integral over the azimuth along an edge at distance p > 0
/// from the centre, with t measured from the foot of the perpendicular. `reached(near, far)` decides whether a texel is in the domain at
/// all, from the distances of its nearest and farthest point.
fn centred_face(
    grid: &Grid,
    reached: impl Fn(f64, f64) -> bool,
    edge: impl Fn(f64, [f64; 2]) -> Integral,
) -> Vec<TexelEmission> {
    // An edge's integral changes sign with p, is the same for mirrored t, and is the same for columns and rows. So an eighth of the edges
    // is enough.
    let size = grid.size;
    let first_line = size.div_ceil(2);
    let half = size - size / 2;
    let mut edges = Vec::with_capacity((size + 1 - first_line) * half);
    for line in first_line..=size {
        let p = grid.line(line);
        for span in size / 2..size {
            edges.push(if p > 0.0 {
                edge(p, grid.span(span))
            } else {
                DVec2::ZERO
            });
        }
    }
    let edge_at = |line: usize, span: usize| {
        let mirrored = line.max(size - line);
        let value = edges[(mirrored - first_line) * half + grid.outward(span) - size / 2];
        if line < mirrored { -value } else { value }
    };
    grid.texels(|x, row| {
        let ([near_x, far_x], [near_y, far_y]) = (grid.distances(x), grid.distances(row));
        if !reached(near_x.hypot(near_y), far_x.hypot(far_y)) {
            return DVec2::ZERO;
        }
        let rows = edge_at(row + 1, x) - edge_at(row, x);
        let columns = edge_at(x + 1, row) - edge_at(x, row);
        rows + columns
    })
}

/// Texels of a face parallel to the axis. `edge(b, [a0, a1])` is the integral over the azimuth along an edge at height b; the upright edges
/// are on meridians and add nothing. `reached` gets the largest cot θ in a texel.
fn side_face(
    grid: &Grid,
    reached: impl Fn(f64) -> bool,
    edge: impl Fn(f64, [f64; 2]) -> Integral,
) -> Vec<TexelEmission> {
    let size = grid.size;
    let half = size - size / 2;
    let mut edges = Vec::with_capacity((size + 1) * half);
    for line in 0..=size {
        for span in size / 2..size {
            edges.push(edge(grid.line(line), grid.span(span)));
        }
    }
    let edge_at = |line: usize, span: usize| edges[line * half + grid.outward(span) - size / 2];
    grid.texels(|x, row| {
        let [near, far] = grid.distances(x);
        let top = grid.line(row + 1);
        let a = if top > 0.0 { near } else { far };
        if !reached(top / 1f64.hypot(a)) {
            return DVec2::ZERO;
        }
        edge_at(row, x) - edge_at(row + 1, x)
    })
}

/// The lines between the texels of a face, in units of the face's plane.
pub(super) struct Grid {
    pub size: usize,
    half_extent: f64,
}

impl Grid {
    pub fn new(size: u32, half_extent: f64) -> Self {
        Grid {
            size: size as usize,
            half_extent,
        }
    }

    /// Coordinate of line i of 0..=size. Computed from integers, so that mirrored lines have exactly mirrored coordinates.
    pub fn line(&self, i: usize) -> f64 {
        self.half_extent * ((2 * i) as f64 - self.size as f64) / self.size as f64
    }

    /// Both ends of the interval between line i and the next.
    pub fn span(&self, i: usize) -> [f64; 2] {
        [self.line(i), self.line(i + 1)]
    }

    /// Smallest and largest distance of an interval from the centre.
    fn distances(&self, i: usize) -> [f64; 2] {
        let [start, end] = self.span(self.outward(i));
        [start.max(0.0), end]
    }

    /// The interval or its mirror image, whichever has the larger coordinate.
    fn outward(&self, i: usize) -> usize {
        i.max(self.size - 1 - i)
    }

    /// Texels row by row from the top, from `integral(x, row)` with rows counted from the bottom.
    pub fn texels(&self, integral: impl Fn(usize, usize) -> Integral) -> Vec<TexelEmission> {
        let mut texels = Vec::with_capacity(self.size * self.size);
        for row in (0..self.size).rev() {
            for x in 0..self.size {
                let (measure, weighted) = integral(x, row).into();
                // For a very small part, only rounding may be left of the two integrals.
                let falloff = (weighted / measure).clamp(0.0, 1.0);
                texels.push(if measure > 0.0 {
                    TexelEmission { measure, falloff }
                } else {
                    TexelEmission::default()
                });
            }
        }
        texels
    }
}

/// A great circle, on which tan θ = rise/(reach·cos ψ) with ψ the azimuth from the point nearest to a pole.
///
/// Integrals over ψ use τ, with cosh τ = 1/cos ψ. Distances along an edge are sinh τ. An integrand smooth in θ has no singularity within ½π
/// of the real axis, so a fixed step in τ works for edges at any distance from the pole.
pub(super) struct Arc {
    pub rise: f64,
    pub reach: f64,
}

impl Arc {
    /// θ at an azimuth from the point nearest to a pole.
    pub fn theta_rad(&self, psi_rad: f64) -> f64 {
        self.rise.atan2(self.reach * psi_rad.cos())
    }

    /// ∫ f(θ, ψ) dψ between sinh τ = start and sinh τ = end. f may have kinks at some θ and some ψ.
    pub fn integrate(
        &self,
        span: [f64; 2],
        kinks_rad: &[f64],
        turns_rad: &[f64],
        f: impl Fn(f64, f64) -> Integral,
    ) -> Integral {
        let [start, end] = span.map(f64::asinh);
        let mut cuts = vec![start, end];
        for turn_rad in turns_rad {
            cuts.push(turn_rad.tan().asinh().max(start).min(end));
        }
        for kink_rad in kinks_rad {
            // NaN if the circle never reaches this kink; `max` then puts the cut at the start.
            let crossing = (self.reach * kink_rad.sin() / (self.rise * kink_rad.cos())).acosh();
            cuts.push((-crossing).max(start).min(end));
            cuts.push(crossing.max(start).min(end));
        }
        cuts.sort_by(f64::total_cmp);
        let mut sum = DVec2::ZERO;
        for piece in cuts.windows(2) {
            if piece[1] > piece[0] {
                sum += gauss([piece[0], piece[1]], |tau| {
                    let cos_psi = 1.0 / tau.cosh();
                    let theta_rad = self.rise.atan2(self.reach * cos_psi);
                    f(theta_rad, tau.sinh().atan()) * cos_psi
                });
            }
        }
        sum
    }
}

/// Longest interval of τ for one application of the Gauss rule. Its error there is below 10⁻¹⁵ of the integrand.
const GAUSS_STEP: f64 = 0.3;

/// Positive nodes on [−1, 1] and weights of the six-point Gauss–Legendre rule.
const GAUSS: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_4),
];

/// ∫ f from start to end.
fn gauss([start, end]: [f64; 2], f: impl Fn(f64) -> Integral) -> Integral {
    let steps = ((end - start) / GAUSS_STEP).ceil();
    let half_step = 0.5 * (end - start) / steps;
    let mut sum = DVec2::ZERO;
    for step in 0..steps as usize {
        let middle = start + (2 * step + 1) as f64 * half_step;
        for (node, weight) in GAUSS {
            let pair = f(middle - node * half_step) + f(middle + node * half_step);
            sum += weight * half_step * pair;
        }
    }
    sum
}
