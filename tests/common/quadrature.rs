//! Adaptive quadrature, for integrals that have no closed form.

/// ∫∫ f(u, v) over 0 to 1 in both, to a relative error of about `tolerance`, for an integrand of one sign.
pub fn unit_square(tolerance: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    unit_interval(tolerance, |u| unit_interval(1e-3 * tolerance, |v| f(u, v)))
}

/// ∫ f(t) from 0 to 1, to a relative error of about `tolerance`, for an integrand of one sign.
pub fn unit_interval(tolerance: f64, f: impl Fn(f64) -> f64) -> f64 {
    // The tolerance is relative to this rough integral, which must not miss all of f.
    const PARTS: usize = 16;
    let part = 1.0 / PARTS as f64;
    let rough: f64 = (0..PARTS)
        .map(|i| gauss(&f, i as f64 * part, part).abs())
        .sum();
    (0..PARTS)
        .map(|i| refine(&f, i as f64 * part, part, tolerance * rough * part, 20))
        .sum()
}

/// Each half keeps the full tolerance. Half of it at each level would soon be below the rounding of f.
fn refine(f: &impl Fn(f64) -> f64, start: f64, width: f64, tolerance: f64, depth: u32) -> f64 {
    let half = 0.5 * width;
    let whole = gauss(f, start, width);
    let halves = gauss(f, start, half) + gauss(f, start + half, half);
    if (whole - halves).abs() <= tolerance || depth == 0 {
        return halves;
    }
    refine(f, start, half, tolerance, depth - 1)
        + refine(f, start + half, half, tolerance, depth - 1)
}

/// Gauss-Legendre with five points (Abramowitz & Stegun 25.4.30).
fn gauss(f: &impl Fn(f64) -> f64, start: f64, width: f64) -> f64 {
    const PAIRS: [(f64, f64); 2] = [
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let at = |node: f64| f(start + 0.5 * width * (1.0 + node));
    let pairs: f64 = PAIRS
        .iter()
        .map(|(node, weight)| weight * (at(*node) + at(-node)))
        .sum();
    0.5 * width * (0.568_888_888_888_888_9 * at(0.0) + pairs)
}
