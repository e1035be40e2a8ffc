// Where rays between surfaces start and end: off them, by what rounding may have moved their points.

// By how much a ray starts before P's surface, for each component of the normal. P = v0 + b1·e1 + b2·e2 is off its plane by up to
// 10u: 4u for each of b1·e1 + b2·e2 ≤ 2, and 2u for v0 ≤ 1. Corners of a neighbour in the same plane are u off it, in either
// direction, the shift is rounded by u, and the height of the ray's origin over a plane is off by 5u of an offset ≤ 2.
const ORIGIN_SHIFT: f32 = 24.0 * 5.9604645e-8;
// By how much a ray ends before Q's surface: its end's height over the plane is the difference of two that are off by 10u
// each, and their quotient is rounded by 3u of an offset ≤ 2.
const END_SHIFT: f32 = 40.0 * 5.9604645e-8;

fn before_surface(position: vec3<f32>, geometric_normal: vec3<f32>, shift: f32) -> vec3<f32> {
    return position + shift * dot(abs(geometric_normal), vec3<f32>(1.0)) * geometric_normal;
}
