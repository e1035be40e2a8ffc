// Functions that are more precise than those of drivers, maps of directions, and Morton order.

const PI: f32 = 3.14159265358979;

// The angle in [0, π], from sine and cosine: acos loses narrow cones to rounding.
fn angle_between(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return angle_of(length(cross(a, b)), dot(a, b));
}

// The angle in [0, π] of a vector in the plane whose y is not negative; 0 for the zero vector.
fn angle_of(sine: f32, cosine: f32) -> f32 {
    let ratio = min(sine, abs(cosine)) / max(max(sine, abs(cosine)), 1e-37);
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

// log2 of a positive normal number, value = 1 − deficit. The deficit is known more precisely than the value.
fn log2_near_one(value: f32, deficit: f32) -> f32 {
    // Mantissa in [√½, √2) by integer arithmetic, as in musl's logf.
    let bits = bitcast<u32>(value) + 0x004afb0du;
    let exponent = f32(i32(bits >> 23u) - 127);
    let mantissa = bitcast<f32>((bits & 0x007fffffu) + 0x3f3504f3u);
    let excess = select(mantissa - 1.0, -deficit, exponent == 0.0);
    // ln(1+x) = 2 artanh(x/(2+x)), |x/(2+x)| ≤ 0.1716: the next term is below 1e-9.
    let y = excess / (2.0 + excess);
    let z = y * y;
    let series = y + y * z * ((0.33333333 + z * 0.2) + (z * z) * (0.14285714 + z * 0.11111111));
    return exponent + series * 2.88539008;
}

// 2^x for x ≤ 0; below the smallest normal number the result is 0.
fn exp2_of_negative(x: f32) -> f32 {
    let whole = round(max(x, -126.0));
    let t = max(x, -126.0) - whole;
    // Taylor to t^7, |t| ≤ ½: within 6e-9. Estrin's scheme, because a lobe is one long chain of operations, limited by latency.
    let t2 = t * t;
    let low = (1.0 + t * 0.69314718) + t2 * (0.24022651 + t * 0.055504109);
    let high = (0.0096181291 + t * 0.0013333558) + t2 * (0.00015403530 + t * 0.000015252734);
    let power = low + (t2 * t2) * high;
    let scale = bitcast<f32>(u32(i32(whole) + 127) << 23u);
    return select(power * scale, 0.0, x < -126.0);
}

// Orthonormal vectors around a unit vector: Duff et al., "Building an orthonormal basis, revisited" (JCGT 2017).
struct Frame {
    right: vec3<f32>,
    up: vec3<f32>,
    axis: vec3<f32>,
}

fn frame_around(axis: vec3<f32>) -> Frame {
    let sign_z = select(-1.0, 1.0, axis.z >= 0.0);
    let a = -1.0 / (sign_z + axis.z);
    let b = axis.x * axis.y * a;
    return Frame(vec3<f32>(1.0 + sign_z * axis.x * axis.x * a, sign_z * b, -sign_z * axis.x),
        vec3<f32>(b, sign_z + axis.y * axis.y * a, -axis.y), axis);
}

// Maps the unit square to the unit disc, neighbours to neighbours (Shirley & Chiu 1997).
fn to_disc(place: vec2<f32>) -> vec2<f32> {
    let centred = 2.0 * place - 1.0;
    let is_wide = abs(centred.x) > abs(centred.y);
    let radius = select(centred.y, centred.x, is_wide);
    let ratio = select(centred.x, centred.y, is_wide) / select(radius, 1e-20, radius == 0.0);
    let turn = select(0.5 * PI - 0.25 * PI * ratio, 0.25 * PI * ratio, is_wide);
    return radius * vec2<f32>(cos(turn), sin(turn));
}

// Puts zeros between the bits.
fn spread_bits(number: u32) -> u32 {
    var x = number & 0xffffu;
    x = (x | (x << 8u)) & 0x00ff00ffu;
    x = (x | (x << 4u)) & 0x0f0f0f0fu;
    x = (x | (x << 2u)) & 0x33333333u;
    return (x | (x << 1u)) & 0x55555555u;
}

// The inverse: packs the even bits.
fn every_other_bit(bits: u32) -> u32 {
    var x = bits & 0x55555555u;
    x = (x | (x >> 1u)) & 0x33333333u;
    x = (x | (x >> 2u)) & 0x0f0f0f0fu;
    x = (x | (x >> 4u)) & 0x00ff00ffu;
    return (x | (x >> 8u)) & 0x0000ffffu;
}

// A unit vector as an integer below 2^24, exact in f32: octahedral, 12 bits per axis, within 1.1e-3 rad. The axes are exact, because 4094
// is even.
fn pack_direction(direction: vec3<f32>) -> f32 {
    let flat = direction.xy / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    let sign_xy = select(vec2<f32>(-1.0), vec2<f32>(1.0), flat >= vec2<f32>(0.0));
    let folded = select(flat, (1.0 - abs(flat.yx)) * sign_xy, direction.z < 0.0);
    let grid = round(clamp(folded * 0.5 + 0.5, vec2<f32>(0.0), vec2<f32>(1.0)) * 4094.0);
    return grid.y * 4096.0 + grid.x;
}

fn unpack_direction(packed: f32) -> vec3<f32> {
    let row = floor(packed / 4096.0);
    let flat = vec2<f32>(packed - row * 4096.0, row) / 4094.0 * 2.0 - 1.0;
    let z = 1.0 - abs(flat.x) - abs(flat.y);
    let fold = max(-z, 0.0);
    return normalize(vec3<f32>(flat - select(vec2<f32>(-fold), vec2<f32>(fold), flat >= vec2<f32>(0.0)), z));
}

// The result does not depend on the order of the bands, because what is learned from it must not.
fn band_sum(v: vec3<f32>) -> f32 {
    let low = min(v.x, v.y);
    let high = max(v.x, v.y);
    return min(low, v.z) + max(low, min(high, v.z)) + max(high, v.z);
}
