// Pseudo-random numbers.

fn hash(value: u32) -> u32 {
    // PCG (Jarzynski & Olano 2020).
    let state = value * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// A number in [0, 1).
fn unit(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604645e-8;
}
