// Traces a ray with the device's acceleration structure.

#import instance
#import triangle_hit

enable wgpu_ray_query;

// All triangles, in the order of ray_triangles.
var ray_scene: acceleration_structure;

// What a ray hit, for `located`.
fn committed(intersection: RayIntersection) -> u32 {
    return select(NOTHING_HIT, hit_of(intersection), intersection.kind == RAY_QUERY_INTERSECTION_TRIANGLE);
}

fn hit_of(intersection: RayIntersection) -> u32 {
    var hit = intersection.primitive_index;
    if (INSTANCED) {
        if (intersection.instance_custom_data > 0u) {
            hit += first_hit(intersection.instance_custom_data);
        }
    }
    if (CUTOUT) {
        // Triangles with cut-outs are the second geometry.
        hit += select(0u, u32(triangle_texel(3u).z), intersection.geometry_index == 1u);
    }
    return hit;
}

// Whether the ray hits the triangle outside its cut-outs.
fn is_solid(intersection: RayIntersection) -> bool {
    if (CUTOUT) {
        let cutout = cutout_of(hit_of(intersection));
        let b = intersection.barycentrics;
        return cutout == 0u || !is_hole(cutout, vec3<f32>(1.0 - b.x - b.y, b));
    } else {
        return true;
    }
}

fn follow(ray: RayDesc) -> u32 {
    var query: ray_query;
    rayQueryInitialize(&query, ray_scene, ray);
    while (rayQueryProceed(&query)) {
        if (CUTOUT) {
            if (is_solid(rayQueryGetCandidateIntersection(&query))) {
                rayQueryConfirmIntersection(&query);
            }
        }
    }
    return committed(rayQueryGetCommittedIntersection(&query));
}

// Whether the triangle's plane passes through the ray's fixed end.
fn is_at_end(hit: u32, ray: Ray) -> bool {
    let at = meet(corners_of(located(hit)), ray.origin, ray.direction, ray.end_height, 1.0);
    if (ANY) {
        return abs(at.covered - at.height) <= at.end_height;
    } else {
        return abs(at.height) <= at.end_height;
    }
}

fn trace_ray(ray: Ray) -> u32 {
    if (ray.t_max < 0.0) {
        return NOTHING_HIT;
    }
    let flags = select(RAY_FLAG_NONE, RAY_FLAG_TERMINATE_ON_FIRST_HIT, ANY);
    var desc = RayDesc(flags, 0xffu, 0.0, ray.t_max, ray.origin, ray.direction);
    let hit = follow(desc);
    if (hit == NOTHING_HIT || ray.end_height == 0.0 || !is_at_end(hit, ray)) {
        return hit;
    }
    // Once more, asked for each triangle.
    var query: ray_query;
    desc.flags |= RAY_FLAG_FORCE_NO_OPAQUE;
    rayQueryInitialize(&query, ray_scene, desc);
    while (rayQueryProceed(&query)) {
        let candidate = rayQueryGetCandidateIntersection(&query);
        if (!is_at_end(hit_of(candidate), ray) && is_solid(candidate)) {
            rayQueryConfirmIntersection(&query);
        }
    }
    return committed(rayQueryGetCommittedIntersection(&query));
}
