// The lobe of the modified Phong BRDF, precise where drivers' pow is not: for s = 200 an error of 1e-6 in log2 is
// 1.4e-4 in the result.

// log2 of a positive normal number whose distance from 1 is known better than the number itself: value = 1 − deficit.
fn log2_near_one(value: f32, deficit: f32) -> f32 {
    // Mantissa in [√½, √2) by integer arithmetic, as musl's logf does it.
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
    // Taylor to t^7, |t| ≤ ½: within 6e-9. By Estrin's scheme: a lobe is one long chain of operations, and latency bounds it.
    let t2 = t * t;
    let low = (1.0 + t * 0.69314718) + t2 * (0.24022651 + t * 0.055504109);
    let high = (0.0096181291 + t * 0.0013333558) + t2 * (0.00015403530 + t * 0.000015252734);
    let power = low + (t2 * t2) * high;
    let scale = bitcast<f32>(u32(i32(whole) + 127) << 23u);
    return select(power * scale, 0.0, x < -126.0);
}

// max(0, r·w)^s of two unit vectors; 0 for r·w ≤ 0 also where s = 0.
fn phong_lobe(mirror: vec3<f32>, direction: vec3<f32>, shininess: f32) -> f32 {
    let cosine = dot(mirror, direction);
    // 1 − cosθ = |r − w|²/2 has no cancellation: a sharp lobe lives where the cosine is 1 to six digits.
    let apart = mirror - direction;
    let lobe = exp2_of_negative(shininess * min(log2_near_one(max(cosine, 1e-30), 0.5 * dot(apart, apart)), 0.0));
    return select(0.0, lobe, cosine > 0.0);
}
