// Traces rays among all triangles, RAYS of them per lane. The rays either start at one origin or lead to one light. src/ray_tree describes
// the images. `trace` and `trace_to_light` are in large_triangles.wgsl or ray_query.wgsl.
//
// Results are exact up to rounding, whose unit is u = 2^-24. Errors are bounded as in Pharr, Jakob, Humphreys, "Physically Based
// Rendering", section "Managing rounding error".

#import instance
#import texel_list
#import triangle_hit
#if QUERY
#import ray_query
#else
#import large_triangles
#endif

// Four texels per triangle: its corners, each with a component of the unit normal; its index in the scene, and 1 + its index among the
// triangles with cut-outs, if it has any. The fourth texel of the first triangle also holds the index where the second geometry of an
// acceleration structure begins, and the number of triangles. After all triangles, those with cut-outs follow again, three texels each: the
// texture coordinates of the corners, columns and rows of the alpha texture; its first word, for word_index; the cutoff; and flags.
var ray_triangles: texture_storage_2d<rgba32float, read>;

// Rays per lane.
#if PACKET
const RAYS: u32 = 8u;
const RAY_PAIRS: u32 = 4u;
#else
const RAYS: u32 = 2u;
const RAY_PAIRS: u32 = 1u;
#endif
const NOTHING_HIT: u32 = 0xffffffffu;

// Data per ray. From an origin: its direction, whose length is the unit of its distances. To a light: its start.
var<private> ray_vector: array<vec3<f32>, RAYS>;
// 1 / distance of the nearest hit so far. Set it before tracing: 1 if the ray ends at its direction's head, 0 if it does not end,
// NOT_WANTED if there is no ray. A ray to a light has no known distance; if something blocks it, this is BLOCKED.
var<private> ray_inverse_t: array<f32, RAYS>;
// The triangle that was hit, for scene_triangle; or NOTHING_HIT.
var<private> ray_hit: array<u32, RAYS>;
const NOT_WANTED: f32 = 1e30;
const BLOCKED: f32 = 2.0;

// Arrays stay in registers only if every index is a constant. Drivers do not unroll a long loop over the rays, so this function compares
// the loop's index with each constant.
fn set_ray(ray: u32, vector: vec3<f32>, inverse_t: f32) {
#repeat SLOT RAYS
    ray_vector[SLOT] = select(ray_vector[SLOT], vector, ray == SLOTu);
    ray_inverse_t[SLOT] = select(ray_inverse_t[SLOT], inverse_t, ray == SLOTu);
#endrepeat
}

fn triangle_texel(index: u32) -> vec4<f32> {
    return textureLoad(ray_triangles, list_place(index));
}

// Never infinite, so that 0 times the inverse is 0 and not NaN.
fn inverse_of(direction: vec3<f32>) -> vec3<f32> {
    return 1.0 / select(direction, vec3<f32>(1e-30), abs(direction) < vec3<f32>(1e-30));
}

// A triangle that was hit, and the instance.
struct Located {
    triangle: u32,
    instance: u32,
}

#if INSTANCED SHADE
fn located(hit: u32) -> Located {
    // Counts the instances whose first hit is not after `hit`.
    var low = 0u;
    var high = instance_count();
    while (low < high) {
        let middle = (low + high) / 2u;
        let is_behind = first_hit(1u + middle) > hit;
        high = select(high, middle, is_behind);
        low = select(middle + 1u, low, is_behind);
    }
    var triangle = hit;
    for (var i = 0u; i < min(low, 1u); i++) {
        triangle -= hit_offset(low);
    }
    return Located(triangle, low);
}
#else
fn located(hit: u32) -> Located {
    return Located(hit, 0u);
}
#endif

fn corners_of_hit(hit: u32) -> Corners {
    return corners_of(located(hit));
}

fn corners_of(found: Located) -> Corners {
    var corners = corners_at(found.triangle);
#if INSTANCED SHADE
    // A loop that other triangles skip: drivers that compute both sides of a branch would make all of them pay for it.
    for (var i = 0u; i < min(found.instance, 1u); i++) {
        let placement = to_scene(found.instance);
        let normal = placed_triangle_normal(found.instance, vec3<f32>(corners.a.w, corners.b.w, corners.c.w));
        corners.a = vec4<f32>(placed_point(placement, corners.a.xyz), normal.x);
        corners.b = vec4<f32>(placed_point(placement, corners.b.xyz), normal.y);
        corners.c = vec4<f32>(placed_point(placement, corners.c.xyz), normal.z);
    }
#endif
    return corners;
}

// The index in triangle_shading of the triangle that was hit.
fn scene_triangle(hit: u32) -> u32 {
    return u32(triangle_texel(4u * located(hit).triangle + 3u).x);
}
