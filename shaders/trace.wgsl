// Rays among all triangles, which lie in a tree of boxes (src/bvh.rs).

// Eight words a node: low corner of the box, the node after the subtree; high corner, triangles (count << 24 | first).
@group(0) @binding(9) var<storage, read> nodes: array<u32>;
// Each corner, and behind it a component of the unit normal.
@group(0) @binding(10) var<storage, read> ray_triangles: array<vec4<f32>>;

const ORIGIN_SHIFT: f32 = 24.0 * 5.9604645e-8;
const LATER: f32 = 1.0 + 8.0 * 5.9604645e-8;
// Rays of a lane.
const RAYS: u32 = 8u;
const NO_TRIANGLE: u32 = 0xffffffffu;

// The rays of a lane, all from one origin.
var<private> ray_direction: array<vec3<f32>, RAYS>;
// In lengths of the direction; 0: not wanted.
var<private> ray_end: array<f32, RAYS>;
// What it meets first.
var<private> ray_triangle: array<u32, RAYS>;

fn lifted(position: vec3<f32>, geometric_normal: vec3<f32>) -> vec3<f32> {
    return position + ORIGIN_SHIFT * dot(abs(geometric_normal), vec3<f32>(1.0)) * geometric_normal;
}

fn safe_inverse(direction: vec3<f32>) -> vec3<f32> {
    return 1.0 / select(direction, vec3<f32>(1e-30), abs(direction) < vec3<f32>(1e-30));
}

fn trace(origin: vec3<f32>, is_any: bool) {
    for (var i = 0u; i < RAYS; i++) {
        let direction = ray_direction[i];
        let inverse = safe_inverse(direction);
        var end = ray_end[i];
        var met = NO_TRIANGLE;
        var node = select(parameters.node_count, 0u, end > 0.0);
        while (node < parameters.node_count) {
            let low = vec3<f32>(bitcast<f32>(nodes[8u * node]), bitcast<f32>(nodes[8u * node + 1u]), bitcast<f32>(nodes[8u * node + 2u]));
            let high = vec3<f32>(bitcast<f32>(nodes[8u * node + 4u]), bitcast<f32>(nodes[8u * node + 5u]), bitcast<f32>(nodes[8u * node + 6u]));
            let a = (low - origin) * inverse;
            let b = (high - origin) * inverse;
            let enters = min(a, b);
            let leaves = max(a, b) * LATER;
            let enter = max(max(enters.x, enters.y), max(enters.z, 0.0));
            let leave = min(min(leaves.x, leaves.y), min(leaves.z, end * LATER));
            let is_entered = enter <= leave;
            let triangles = nodes[8u * node + 7u];
            node = select(nodes[8u * node + 3u], node + 1u, is_entered);
            let first = triangles & 0xffffffu;
            let last = first + select(0u, triangles >> 24u, is_entered);
            for (var triangle = first; triangle < last; triangle++) {
                let corner0 = ray_triangles[3u * triangle];
                let corner1 = ray_triangles[3u * triangle + 1u];
                let corner2 = ray_triangles[3u * triangle + 2u];
                let normal = vec3<f32>(corner0.w, corner1.w, corner2.w);
                let c0 = corner0.xyz - origin;
                let c1 = corner1.xyz - origin;
                let c2 = corner2.xyz - origin;
                let e0 = dot(direction, cross(c1, c2));
                let e1 = dot(direction, cross(c2, c0));
                let e2 = dot(direction, cross(c0, c1));
                let is_inside = min(min(e0, e1), e2) >= 0.0 || max(max(e0, e1), e2) <= 0.0;
                let t = dot(normal, c0) / dot(normal, direction);
                if (is_inside && t > 0.0 && t < end) {
                    end = t;
                    met = triangle;
                }
            }
            if (is_any && met != NO_TRIANGLE) {
                node = parameters.node_count;
            }
        }
        ray_end[i] = end;
        ray_triangle[i] = met;
    }
}
