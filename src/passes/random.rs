//! Pseudo-random numbers, the same as in `shaders/shared/random.wgsl`.

/// PCG (Jarzynski & Olano 2020).
pub(crate) fn hash(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// A number from 0 to 1, excluding 1.
pub(crate) fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * 5.960_464_5e-8
}
