// Traces the rays of a list: finds the triangle that each hits, or whether any is in its way. It knows nothing of materials, except for
// cut-outs.

#import ray
#if QUERY
#import ray_query
#else
#import ray_tree
#endif

struct TraceParameters {
    first_ray: u32,
    ray_count: u32,
}

var<storage, read> rays: array<Ray>;
// For each ray, the triangle that was hit, for `located`; or NOTHING_HIT.
var<storage, read_write> hits: array<u32>;
var<immediate> parameters: TraceParameters;

@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let index = 64u * (group.x + 65535u * group.y) + local;
    if (index < parameters.ray_count) {
        let ray = parameters.first_ray + index;
        hits[ray] = trace_ray(rays[ray]);
    }
}
