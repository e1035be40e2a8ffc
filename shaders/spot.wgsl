// The cone of a spot light.

#import lighting

// s(θ): 1 inside θ_i, cos(½π·(θ−θ_i)/(θ_o−θ_i)) up to θ_o, 0 outside.
fn spot_falloff(axis: vec3<f32>, outer_half_angle: f32, inverse_penumbra: f32, direction: vec3<f32>) -> f32 {
    let angle = angle_between(axis, direction);
    let inside = clamp((outer_half_angle - angle) * inverse_penumbra, 0.0, 1.0);
    return sin_quarter(inside * (0.5 * PI));
}

// The angle in [0, π]; from sine and cosine, for acos loses narrow cones to rounding.
fn angle_between(a: vec3<f32>, b: vec3<f32>) -> f32 {
    let sine = length(cross(a, b));
    let cosine = dot(a, b);
    let ratio = min(sine, abs(cosine)) / max(sine, abs(cosine));
    let is_wide = ratio > 0.41421356;
    let x = select(ratio, (ratio - 1.0) / (ratio + 1.0), is_wide);
    let z = x * x;
    // Minimax polynomial of atan on |x| ≤ tan(π/8), Cephes atanf: within 1e-7.
    let near = x + x * z * (-0.333329491539 + z * (0.199777106478 + z * (-0.138776856032 + z * 0.0805374449538)));
    let octant = select(near, near + 0.25 * PI, is_wide);
    let quadrant = select(octant, 0.5 * PI - octant, sine > abs(cosine));
    return select(quadrant, PI - quadrant, cosine < 0.0);
}

// sin(x) on [0, π/2], Taylor to x^13: within 7e-10. Drivers' sin may be off by 2^-11.
fn sin_quarter(x: f32) -> f32 {
    let z = x * x;
    return x + x * z * (-0.16666667 + z * (0.0083333333 + z * (-0.00019841270 + z * (2.7557319e-6
        + z * (-2.5052108e-8 + z * 1.6059044e-10)))));
}
