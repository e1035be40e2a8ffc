//! Points that fall evenly into the unit square.

/// Candidates for a generator that are tried.
const CANDIDATES: u32 = 64;

/// A rank-1 lattice of `count` points (k/n, frac(k·g/n)) on the torus, in Morton order: neighbours in the list are
/// neighbours on the square. Of the generators g near the golden ratio, and without a divisor in common with n, so that either
/// coordinate alone falls evenly, too, the one whose nearest points are farthest apart.
pub fn rank1(count: u32) -> Vec<[f32; 2]> {
    let golden = (f64::from(count) * 0.618_033_988_749_894_8) as u32;
    let first = golden.saturating_sub(CANDIDATES / 2).max(1);
    let generator = (first..first + CANDIDATES)
        .filter(|&generator| greatest_common_divisor(generator, count) == 1)
        .max_by_key(|&generator| nearest_squared(count, generator))
        .unwrap_or(1);
    let mut points: Vec<[f32; 2]> = (0..u64::from(count))
        .map(|k| {
            let turned = k * u64::from(generator) % u64::from(count);
            [k, turned].map(|x| (x as f64 / f64::from(count)) as f32)
        })
        .collect();
    points.sort_by_key(|&[x, y]| morton(x) | morton(y) << 1);
    points
}

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}

/// Square of the least distance between two points on the torus, in units of 1/count.
fn nearest_squared(count: u32, generator: u32) -> u64 {
    let count = u64::from(count);
    let around = |x: u64| x.min(count - x);
    (1..count)
        .map(|k| {
            let [x, y] = [around(k), around(k * u64::from(generator) % count)];
            x * x + y * y
        })
        .min()
        .unwrap_or(0)
}

/// The upper sixteen bits of a number in 0 to 1, at every other place.
fn morton(x: f32) -> u32 {
    let bits = (x * 65_536.0) as u32;
    (0..16).fold(0, |spread, bit| spread | (bits >> bit & 1) << (2 * bit))
}
