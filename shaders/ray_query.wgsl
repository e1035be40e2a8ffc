// Traces rays among all triangles with the device's acceleration structure.

#import triangle_hit

enable wgpu_ray_query;

// All triangles, in the order of ray_triangles.
var ray_scene: acceleration_structure;

// The nearest triangle that a ray hits, or any triangle; NOTHING_HIT if it hits none.
struct Met {
    hit: u32,
    inverse_t: f32,
}

fn met(intersection: RayIntersection) -> Met {
    let is_met = intersection.kind == RAY_QUERY_INTERSECTION_TRIANGLE;
    return Met(select(NOTHING_HIT, hit_of(intersection), is_met), 1.0 / intersection.t);
}

// The hit, in the form that scene_triangle takes.
fn hit_of(intersection: RayIntersection) -> u32 {
    var hit = intersection.primitive_index;
#if INSTANCED
    if (intersection.instance_custom_data > 0u) {
        hit += first_hit(intersection.instance_custom_data);
    }
#endif
#if CUTOUT
    // Triangles with cut-outs are the second geometry.
    hit += select(0u, u32(triangle_texel(3u).z), intersection.geometry_index == 1u);
#endif
    return hit;
}

// Whether the ray hits the triangle outside its cut-outs.
fn is_solid(intersection: RayIntersection) -> bool {
#if CUTOUT
    let cutout = cutout_of(hit_of(intersection));
    let b = intersection.barycentrics;
    return cutout == 0u || !is_hole(cutout, vec3<f32>(1.0 - b.x - b.y, b));
#else
    return true;
#endif
}

fn follow(ray: RayDesc) -> Met {
    var query: ray_query;
    rayQueryInitialize(&query, ray_scene, ray);
    while (rayQueryProceed(&query)) {
#if CUTOUT
        if (is_solid(rayQueryGetCandidateIntersection(&query))) {
            rayQueryConfirmIntersection(&query);
        }
#endif
    }
    return met(rayQueryGetCommittedIntersection(&query));
}

// Like `follow`, but ignores triangles that the light is mounted on.
fn follow_with_light(ray: RayDesc, light_end: vec4<f32>) -> Met {
    let first = follow(ray);
    if (first.hit == NOTHING_HIT || !is_mounted_on(first.hit, light_end)) {
        return first;
    }
    var query: ray_query;
    var asking = ray;
    asking.flags |= RAY_FLAG_FORCE_NO_OPAQUE;
    rayQueryInitialize(&query, ray_scene, asking);
    while (rayQueryProceed(&query)) {
        let candidate = rayQueryGetCandidateIntersection(&query);
        if (!is_mounted_on(hit_of(candidate), light_end) && is_solid(candidate)) {
            rayQueryConfirmIntersection(&query);
        }
    }
    return met(rayQueryGetCommittedIntersection(&query));
}

fn is_mounted_on(hit: u32, light_end: vec4<f32>) -> bool {
    let corners = corners_of_hit(hit);
    let normal = vec3<f32>(corners.a.w, corners.b.w, corners.c.w);
    let height = dot(normal, direction_to_light(corners.a.xyz, light_end));
    return abs(height) <= LIGHT_IN_PLANE * dot(abs(normal), vec3<f32>(1.0));
}

// Traces the rays of a lane, which share one origin. Afterwards ray_inverse_t and ray_hit hold the hits.
fn trace(origin: vec3<f32>, is_any: bool) {
    let flags = select(RAY_FLAG_NONE, RAY_FLAG_TERMINATE_ON_FIRST_HIT, is_any);
    for (var i = 0u; i < RAYS; i++) {
        let ray = own_ray(i);
        if (ray.inverse_t < NOT_WANTED) {
            let desc = RayDesc(flags, 0xffu, 0.0, end_of(ray.inverse_t), origin, ray.vector);
#if CENTRAL
            put_back(i, follow_with_light(desc, vec4<f32>(origin, 1.0)));
#else
            put_back(i, follow(desc));
#endif
        }
    }
}

// Finds for each ray whether something is between its start and the light. Afterwards a ray_inverse_t above 1 is BLOCKED, or NOT_WANTED as
// before.
//
// For parallel rays from a light it finds the closest hit. `light_end` is then the direction of the rays.
fn trace_to_light(light_end: vec4<f32>) {
    for (var i = 0u; i < RAYS; i++) {
        let ray = own_ray(i);
        if (ray.inverse_t < NOT_WANTED) {
            let direction = direction_to_light(ray.vector, light_end);
#if PARALLEL
            put_back(i, follow(RayDesc(RAY_FLAG_NONE, 0xffu, 0.0, end_of(ray.inverse_t), ray.vector, direction)));
#else
            let desc = RayDesc(RAY_FLAG_TERMINATE_ON_FIRST_HIT, 0xffu, 0.0, 1.0, ray.vector, direction);
            var found = follow_with_light(desc, light_end);
            found.inverse_t = BLOCKED;
            put_back(i, found);
#endif
        }
    }
}

// A ray of the lane, not yet traced.
struct OwnRay {
    vector: vec3<f32>,
    inverse_t: f32,
}

fn own_ray(ray: u32) -> OwnRay {
    var vector: vec3<f32>;
    var inverse_t: f32;
#repeat SLOT RAYS
    vector = select(vector, ray_vector[SLOT], ray == SLOTu);
    inverse_t = select(inverse_t, ray_inverse_t[SLOT], ray == SLOTu);
    ray_hit[SLOT] = select(ray_hit[SLOT], NOTHING_HIT, ray == SLOTu);
#endrepeat
    return OwnRay(vector, inverse_t);
}

fn put_back(ray: u32, found: Met) {
#repeat SLOT RAYS
    let is_SLOT = ray == SLOTu && found.hit != NOTHING_HIT;
    ray_inverse_t[SLOT] = select(ray_inverse_t[SLOT], found.inverse_t, is_SLOT);
    ray_hit[SLOT] = select(ray_hit[SLOT], found.hit, is_SLOT);
#endrepeat
}

// The distance of a ray's end.
fn end_of(inverse_t: f32) -> f32 {
    return 1.0 / max(inverse_t, 1e-30);
}
