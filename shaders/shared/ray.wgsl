// Rays are data: some passes emit them to a list, the trace pass finds what they hit, and other passes shade the hits. None of these knows
// how another one works.

struct Ray {
    origin: vec3<f32>,
    // Distance of the ray's end, in lengths of `direction`. Below 0: there is no ray, and it hits nothing.
    t_max: f32,
    direction: vec3<f32>,
    // Rays ignore a triangle if their fixed end is no higher than this over the triangle's plane, for each component of the normal. The fixed
    // end is where any hit counts the head of `direction`, and the origin where the closest hit counts.
    end_height: f32,
}

// Longer than the scene, in local units.
const NO_END: f32 = 1e30;
const NO_RAY: f32 = -1.0;

const NOTHING_HIT: u32 = 0xffffffffu;

// Distance by which a ray starts before P's surface, for each component of the normal. P = v0 + b1·e1 + b2·e2 is off its plane by up to
// 10u: 4u for each of the two products, where b1·e1 + b2·e2 ≤ 2, and 2u for v0 ≤ 1. The corners of a neighbour in the same plane are off it
// by u, in either direction. The shift is rounded by u. The height of the ray's origin over a plane is off by 5u of an offset ≤ 2.
const ORIGIN_SHIFT: f32 = 24.0 * 5.9604645e-8;
// Distance by which a ray ends before Q's surface. The height of its end over the plane is the difference of two heights that are off by
// 10u each. Their quotient is rounded by 3u of an offset ≤ 2.
const END_SHIFT: f32 = 40.0 * 5.9604645e-8;

fn before_surface(position: vec3<f32>, geometric_normal: vec3<f32>, shift: f32) -> vec3<f32> {
    return position + shift * dot(abs(geometric_normal), vec3<f32>(1.0)) * geometric_normal;
}
