//! Random numbers that depend only on the position.

use glam::DVec3;

/// Smooth noise from -1 to 1 with features about 1 wide: values at integer coordinates, blended in between.
pub fn noise(place: DVec3) -> f64 {
    let corner = place.floor();
    let within = place - corner;
    // Slope and curvature are zero at the corners, so that the lattice is not visible.
    let blend = within * within * within * (within * (within * 6.0 - 15.0) + 10.0);
    let mut sum = 0.0;
    for (x, weight_x) in [(0.0, 1.0 - blend.x), (1.0, blend.x)] {
        for (y, weight_y) in [(0.0, 1.0 - blend.y), (1.0, blend.y)] {
            for (z, weight_z) in [(0.0, 1.0 - blend.z), (1.0, blend.z)] {
                sum += weight_x * weight_y * weight_z * at(corner + DVec3::new(x, y, z));
            }
        }
    }
    sum
}

/// A sum of this noise; each octave is half as wide and half as strong as the one before.
pub fn octaves(place: DVec3, count: u32) -> f64 {
    (0..count)
        .map(|octave| {
            let frequency = f64::from(1 << octave);
            // Shifted, so that the lattices of the octaves do not coincide at the origin.
            noise(place * frequency + 17.3 * f64::from(octave)) / frequency
        })
        .sum()
}

/// From -1 to 1 without a pattern, for integer coordinates. Hash: Mueller's integer mixer.
fn at(corner: DVec3) -> f64 {
    let [x, y, z] = corner.to_array().map(|c| c as i32 as u32);
    let mut hash = x
        .wrapping_mul(0x9e37_79b9)
        .wrapping_add(y.wrapping_mul(0x85eb_ca6b))
        .wrapping_add(z.wrapping_mul(0xc2b2_ae35));
    for _ in 0..2 {
        hash = (hash ^ (hash >> 16)).wrapping_mul(0x45d9_f3b5);
    }
    hash ^= hash >> 16;
    f64::from(hash) / f64::from(u32::MAX) * 2.0 - 1.0
}
