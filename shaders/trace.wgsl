// Rays among all triangles, RAYS of them per lane: either they start at one origin, or they lead to one light. See
// src/ray_tree for what the images hold. `trace` and `trace_to_light` are those of large_triangles.wgsl or of ray_query.wgsl.
//
// Everything is meant to be right but for rounding, of which u = 2^-24 is the unit: errors are bounded as in Pharr, Jakob,
// Humphreys, "Physically Based Rendering", section "Managing rounding error".

#import instance
#import triangle_hit
#if QUERY
#import ray_query
#else
#import large_triangles
#endif

// Four texels a triangle: its corners, each with a component of the unit normal; its place in the scene, and 1 + its place among those with cut-outs
// where it has any. The first one also tells where those begin that an acceleration structure has as its second geometry, and how many triangles there
// are. Behind them lie those with cut-outs again: the texture coordinates of the corners, columns and rows of the alpha texture, and its first word,
// for word_index, three texels each.
var ray_triangles: texture_storage_2d<rgba32float, read>;

// Rays of a lane.
#if PACKET
const RAYS: u32 = 8u;
const RAY_PAIRS: u32 = 4u;
#else
const RAYS: u32 = 2u;
const RAY_PAIRS: u32 = 1u;
#endif
// Texels of a row of the images, as a shift.
const ROW_SHIFT: u32 = 10u;
const ROW_MASK: u32 = 1023u;
const NOTHING_HIT: u32 = 0xffffffffu;

// What a ray has of its own. From an origin: its direction, whose length is the unit of its distances. To a light: its start.
var<private> ray_vector: array<vec3<f32>, RAYS>;
// 1 / distance of the nearest hit so far. To be set before: 1 where the ray ends at its direction's head, 0 where it does
// not end, NOT_WANTED where it is none. Of a ray to a light, whose distances are not known: BLOCKED.
var<private> ray_inverse_t: array<f32, RAYS>;
// The triangle that was hit, for scene_triangle; or NOTHING_HIT.
var<private> ray_hit: array<u32, RAYS>;
const NOT_WANTED: f32 = 1e30;
const BLOCKED: f32 = 2.0;

// Arrays live in registers as long as every index is a constant. A loop over the rays with much in it is not unrolled by the
// driver: it sets them by comparing its number with each.
fn set_ray(ray: u32, vector: vec3<f32>, inverse_t: f32) {
#repeat SLOT RAYS
    ray_vector[SLOT] = select(ray_vector[SLOT], vector, ray == SLOTu);
    ray_inverse_t[SLOT] = select(ray_inverse_t[SLOT], inverse_t, ray == SLOTu);
#endrepeat
}

// Of a texel in an image that holds a list.
fn list_place(index: u32) -> vec2<u32> {
    return vec2<u32>(index & ROW_MASK, index >> ROW_SHIFT);
}

fn triangle_texel(index: u32) -> vec4<f32> {
    return textureLoad(ray_triangles, list_place(index));
}

// So that 0 times the inverse is 0 and not NaN.
fn inverse_of(direction: vec3<f32>) -> vec3<f32> {
    return 1.0 / select(direction, vec3<f32>(1e-30), abs(direction) < vec3<f32>(1e-30));
}

// A triangle that was hit, and on which instance.
struct Located {
    triangle: u32,
    instance: u32,
}

#if INSTANCED SHADE
fn located(hit: u32) -> Located {
    // Instances whose first hit is not behind this.
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
    // A loop that other triangles do not enter: drivers that compute both sides of a branch would have all of them pay.
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

// The place among triangle_shading of the triangle that was hit.
fn scene_triangle(hit: u32) -> u32 {
    return u32(triangle_texel(4u * located(hit).triangle + 3u).x);
}
