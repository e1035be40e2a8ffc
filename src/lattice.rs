//! Points spread evenly over the unit square, for any number of points.

/// Points that are sampled together, with one ray each.
pub const PACKET_POINTS: usize = 64;
/// The generator of the lattice. It gives the largest minimum distance between points, for 64 to 16 384 points.
const GENERATOR: f64 = 99.0;

/// The first points of a lattice sequence on the torus (Hickernell et al. 2000): x is van der Corput's sequence in base 2, y a multiple of
/// it. The first 2ⁿ points are a shifted rank-1 lattice, and so are any later 2ⁿ that begin at a multiple of 2ⁿ. Each packet is in Morton
/// order, so that neighbours in the list are neighbours in the square.
pub fn sequence(count: u32) -> Vec<[f32; 2]> {
    let mut points: Vec<[f32; 2]> = (0..count)
        .map(|index| {
            let x = f64::from(index.reverse_bits()) / 4_294_967_296.0;
            let y = (GENERATOR * x).fract();
            [x as f32, y as f32]
        })
        .collect();
    for packet in points.chunks_mut(PACKET_POINTS) {
        packet.sort_by_key(|&[x, y]| morton(x) | morton(y) << 1);
    }
    points
}

/// A point of Sobol's sequence in two dimensions with Owen's scrambling (Burley, "Practical Hash-based Owen Scrambling", JCGT 2020). The
/// first 2ⁿ points fall into 2ⁿ strata of any shape, the next 2ⁿ between them. The position in a stratum is random, so that no repeating
/// pattern is missed.
pub fn scrambled(index: u32, seed: u32) -> [f64; 2] {
    let second = (0..32).filter(|bit| index >> bit & 1 == 1);
    // The columns of the sequence's matrix are the rows of Pascal's triangle modulo 2.
    let column = |bit| (0..bit).fold(1_u32 << 31, |v, _| v ^ v >> 1);
    let second = second.fold(0, |bits, bit| bits ^ column(bit));
    let axes = [(index.reverse_bits(), seed), (second, !seed)];
    axes.map(|(bits, seed)| f64::from(owen_scrambled(bits, seed)) / 4_294_967_296.0)
}

/// Flips each bit by a hash of the bits above it.
fn owen_scrambled(bits: u32, seed: u32) -> u32 {
    let mut x = bits.reverse_bits().wrapping_add(seed);
    for factor in [0x6c50_b47c_u32, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6] {
        x ^= x.wrapping_mul(factor);
    }
    x.reverse_bits()
}

/// The upper sixteen bits of a number from 0 to 1, spread to every second bit.
fn morton(x: f32) -> u32 {
    let bits = (x * 65_536.0) as u32;
    (0..16).fold(0, |spread, bit| spread | (bits >> bit & 1) << (2 * bit))
}
