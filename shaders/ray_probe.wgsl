// Traces many rays from points of surfaces, for the tests and benches of trace.wgsl.

#import hit
#import trace

struct RayProbeParameters {
    // Rays per point: a multiple of PACKET_RAYS.
    rays_per_point: u32,
    packet_count: u32,
}

// P and the unit normal of its triangle: two texels per point, in one row.
var points: texture_2d<f32>;
// Any hit: Q and the unit normal of its triangle, packed. Closest hit: a direction.
var ends: texture_2d<f32>;
// Any hit: 1 for each blocked ray. Closest hit, for each ray: 1 / distance, and the triangle as 1 + its index in the scene.
var<storage, read_write> found: array<u32>;
var<immediate> parameters: RayProbeParameters;

const PACKET_RAYS: u32 = 8u * RAYS;

@compute @workgroup_size(64)
fn compute_main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
#if PACKET
    @builtin(subgroup_invocation_id) subgroup_lane: u32,
#endif
) {
#if PACKET
    lane = subgroup_lane;
#else
    let lane = local & 7u;
#endif
    // Surplus packets of the last workgroup repeat the last packet.
    let packet = min(8u * (group.x + 1024u * group.y) + (local >> 3u), parameters.packet_count - 1u);
    let first = packet * PACKET_RAYS + lane;
    let point = first / parameters.rays_per_point;
    let column = 2u * (point & 511u);
    let position = textureLoad(points, vec2<u32>(column, point >> 9u), 0).xyz;
    let normal = textureLoad(points, vec2<u32>(column + 1u, point >> 9u), 0).xyz;
    let origin = before_surface(position, normal, ORIGIN_SHIFT);
    for (var i = 0u; i < RAYS; i++) {
        let ray = first + 8u * i;
        let end = textureLoad(ends, vec2<u32>(ray & 1023u, ray >> 10u), 0);
#if ANY
        ray_vector[i] = before_surface(end.xyz, unpack_direction(end.w), END_SHIFT) - origin;
        ray_inverse_t[i] = 1.0;
#else
        ray_vector[i] = end.xyz;
        ray_inverse_t[i] = 0.0;
#endif
    }
#if ANY
    trace(origin, true);
    for (var i = 0u; i < RAYS; i++) {
        found[first + 8u * i] = select(0u, 1u, ray_inverse_t[i] > 1.0);
    }
#else
    trace(origin, false);
    for (var i = 0u; i < RAYS; i++) {
        found[2u * (first + 8u * i)] = bitcast<u32>(ray_inverse_t[i]);
        let triangle = scene_triangle(select(ray_hit[i], 0u, ray_hit[i] == NOTHING_HIT));
        found[2u * (first + 8u * i) + 1u] = select(1u + triangle, 0u, ray_hit[i] == NOTHING_HIT);
    }
#endif
}
