// V(L, P) by a ray among all triangles, which lie in a tree of boxes (src/bvh.rs).
//
// Everything is meant to be right but for rounding, of which u = 2^-24 is the unit: errors are bounded as in Pharr, Jakob,
// Humphreys, "Physically Based Rendering", section "Managing rounding error".

// Eight words a node: low corner of the box, the node after the subtree; high corner, triangles (count << 24 | first).
@group(0) @binding(9) var<storage, read> nodes: array<u32>;
#if PACKET
// Twelve words a triangle: each corner, and behind it a component of the unit normal.
@group(0) @binding(10) var<storage, read> ray_triangles: array<f32>;
#else
@group(0) @binding(10) var<storage, read> ray_triangles: array<vec4<f32>>;
#endif

// By how much a ray starts before P's surface, for each component of the normal. P = v0 + b1·e1 + b2·e2 is off its plane by up to
// 10u: 4u for each of b1·e1 + b2·e2 ≤ 2, and 2u for v0 ≤ 1. Corners of a neighbour in the same plane are u off it, in either
// direction, the shift is rounded by u, and the height of the ray's origin over a plane is off by 5u of an offset ≤ 2.
const ORIGIN_SHIFT: f32 = 24.0 * 5.9604645e-8;
// A box is left no earlier than this much later than computed: 2·γ(4).
const LATER: f32 = 1.0 + 8.0 * 5.9604645e-8;

struct Ray {
    origin: vec3<f32>,
    // Leads to the light in one step; directional: against the light's axis, without an end.
    direction: vec3<f32>,
    inverse: vec3<f32>,
    // Two vectors that are orthogonal to the ray and to each other.
    right: vec3<f32>,
    up: vec3<f32>,
}

fn shadow_ray(position: vec3<f32>, geometric_normal: vec3<f32>) -> Ray {
    var ray: Ray;
    let shift = ORIGIN_SHIFT * dot(abs(geometric_normal), vec3<f32>(1.0));
    ray.origin = position + shift * geometric_normal;
#if DIRECTIONAL
    ray.direction = -light.axis;
#else
    ray.direction = light.position - ray.origin;
#endif
    // So that 0 times the inverse is 0 and not NaN.
    ray.inverse = 1.0 / select(ray.direction, vec3<f32>(1e-30), abs(ray.direction) < vec3<f32>(1e-30));
    // Duff et al., "Building an orthonormal basis, revisited" (JCGT 2017).
    let along = normalize(ray.direction);
    let sign_z = select(-1.0, 1.0, along.z >= 0.0);
    let a = -1.0 / (sign_z + along.z);
    let b = along.x * along.y * a;
    ray.right = vec3<f32>(1.0 + sign_z * along.x * along.x * a, sign_z * b, -sign_z * along.x);
    ray.up = vec3<f32>(b, sign_z + along.y * along.y * a, -along.y);
    return ray;
}

fn meets_box(ray: Ray, low: vec3<f32>, high: vec3<f32>) -> bool {
    let a = (low - ray.origin) * ray.inverse;
    let b = (high - ray.origin) * ray.inverse;
    let enters = min(a, b);
    let leaves = max(a, b) * LATER;
    let enter = max(max(enters.x, enters.y), max(enters.z, 0.0));
#if DIRECTIONAL
    let leave = min(min(leaves.x, leaves.y), leaves.z);
#else
    let leave = min(min(leaves.x, leaves.y), min(leaves.z, LATER));
#endif
    return enter <= leave;
}

// The ray passes inside the triangle if it has the three edges on the same side. Neighbours compute the same products of
// their common edge and compare them, so that nothing slips between them. Whether it ends before the triangle's plane tell
// the heights of its ends over that, whose error does not grow with the light's distance or the triangle's slimness.
fn meets_triangle(ray: Ray, corner0: vec3<f32>, corner1: vec3<f32>, corner2: vec3<f32>, normal: vec3<f32>) -> bool {
    let c0 = corner0 - ray.origin;
    let c1 = corner1 - ray.origin;
    let c2 = corner2 - ray.origin;
    let x = vec3<f32>(dot(c0, ray.right), dot(c1, ray.right), dot(c2, ray.right));
    let y = vec3<f32>(dot(c0, ray.up), dot(c1, ray.up), dot(c2, ray.up));
    let one = x * y.yzx;
    let other = x.yzx * y;
    let is_inside = all(one >= other) | all(one <= other);
#if DIRECTIONAL
    let beyond = -dot(normal, ray.direction);
#else
    let beyond = dot(normal, corner0 - light.position);
#endif
    return is_inside & (dot(normal, c0) * beyond < 0.0);
}

#if PACKET
// Whether something is in the way of the ray. The rays of a subgroup go through the tree together: where one meets a box, all
// look into it. Eight lanes load a node's words, each one, and broadcast them. All lanes must come here, wanted or not.
fn is_blocked(ray: Ray, is_wanted: bool, lane: u32) -> bool {
    var is_done = !is_wanted;
    var node = 0u;
    // lavapipe would end this silently after 65 535 steps, triangles included: a packet takes hundreds.
    while (node < parameters.node_count) {
        let word = nodes[8u * node + (lane & 7u)];
        let number = bitcast<f32>(word);
        let low = vec3<f32>(subgroupBroadcast(number, 0u), subgroupBroadcast(number, 1u), subgroupBroadcast(number, 2u));
        let high = vec3<f32>(subgroupBroadcast(number, 4u), subgroupBroadcast(number, 5u), subgroupBroadcast(number, 6u));
        let after = subgroupBroadcast(word, 3u);
        let triangles = subgroupBroadcast(word, 7u);
        let is_entered = subgroupAny(meets_box(ray, low, high) & !is_done);
        node = select(after, node + 1u, is_entered);
        let first = triangles & 0xffffffu;
        let end = first + select(0u, triangles >> 24u, is_entered);
        for (var triangle = first; triangle < end; triangle++) {
            let head = ray_triangles[12u * triangle + (lane & 7u)];
            let tail = ray_triangles[12u * triangle + 8u + (lane & 3u)];
            let corner0 = vec3<f32>(subgroupBroadcast(head, 0u), subgroupBroadcast(head, 1u), subgroupBroadcast(head, 2u));
            let corner1 = vec3<f32>(subgroupBroadcast(head, 4u), subgroupBroadcast(head, 5u), subgroupBroadcast(head, 6u));
            let corner2 = vec3<f32>(subgroupBroadcast(tail, 0u), subgroupBroadcast(tail, 1u), subgroupBroadcast(tail, 2u));
            let normal = vec3<f32>(subgroupBroadcast(head, 3u), subgroupBroadcast(head, 7u), subgroupBroadcast(tail, 3u));
            is_done |= meets_triangle(ray, corner0, corner1, corner2, normal);
        }
        if (subgroupAll(is_done)) {
            break;
        }
    }
    return is_done & is_wanted;
}
#else
fn is_blocked(ray: Ray, is_wanted: bool, lane: u32) -> bool {
    var is_met = false;
    var node = select(parameters.node_count, 0u, is_wanted);
    while (node < parameters.node_count && !is_met) {
        let low = vec3<f32>(bitcast<f32>(nodes[8u * node]), bitcast<f32>(nodes[8u * node + 1u]), bitcast<f32>(nodes[8u * node + 2u]));
        let high = vec3<f32>(bitcast<f32>(nodes[8u * node + 4u]), bitcast<f32>(nodes[8u * node + 5u]), bitcast<f32>(nodes[8u * node + 6u]));
        let triangles = nodes[8u * node + 7u];
        let is_entered = meets_box(ray, low, high);
        node = select(nodes[8u * node + 3u], node + 1u, is_entered);
        let first = triangles & 0xffffffu;
        let end = first + select(0u, triangles >> 24u, is_entered);
        for (var triangle = first; triangle < end; triangle++) {
            let corner0 = ray_triangles[3u * triangle];
            let corner1 = ray_triangles[3u * triangle + 1u];
            let corner2 = ray_triangles[3u * triangle + 2u];
            let normal = vec3<f32>(corner0.w, corner1.w, corner2.w);
            is_met = is_met || meets_triangle(ray, corner0.xyz, corner1.xyz, corner2.xyz, normal);
        }
    }
    return is_met;
}
#endif

// All lanes must come here, for they go through the tree together. Where V is not wanted, the result means nothing.
fn visibility(position: vec3<f32>, geometric_normal: vec3<f32>, is_wanted: bool, lane: u32) -> f32 {
    let is_hidden = is_blocked(shadow_ray(position, geometric_normal), is_wanted, lane);
    return select(1.0, 0.0, is_hidden);
}
