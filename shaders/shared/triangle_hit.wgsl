// A ray and one triangle. Results are exact up to rounding, whose unit is u = 2^-24. Errors are bounded as in Pharr, Jakob, Humphreys,
// "Physically Based Rendering", section "Managing rounding error". src/ray_tree/wide.rs computes the same on the host.

#import hit_triangle
#import texels

// Where a ray meets the plane of a triangle.
struct Meeting {
    // Whether the ray passes inside the triangle. Neighbours have exactly opposite numbers for their common edge, so no ray slips between
    // them.
    is_inside: bool,
    // Barycentric coordinates, up to a factor.
    weights: vec3<f32>,
    // Height of the plane over the ray's origin, and the part of it that the ray's direction covers.
    height: f32,
    covered: f32,
    // Heights that count as 0 at the ray's fixed end.
    end_height: f32,
}

// `unit` is the length of the scene's local unit in the space of the corners.
fn meet(corners: Corners, origin: vec3<f32>, direction: vec3<f32>, end_height: f32, unit: f32) -> Meeting {
    let normal = vec3<f32>(corners.a.w, corners.b.w, corners.c.w);
    // From sums and differences of corners: their products do not cancel in small triangles.
    let c0 = corners.a.xyz - origin;
    let c1 = corners.b.xyz - origin;
    let c2 = corners.c.xyz - origin;
    let weights = vec3<f32>(dot(cross(c1 + c2, c2 - c1), direction), dot(cross(c2 + c0, c0 - c2), direction),
        dot(cross(c0 + c1, c1 - c0), direction));
    let height = dot(normal, c0);
    let turned = select(-weights, weights, height > 0.0);
    let is_inside = min(min(turned.x, turned.y), turned.z) >= 0.0;
    return Meeting(is_inside, weights, height, dot(normal, direction), unit * end_height * dot(abs(normal), vec3<f32>(1.0)));
}

// 1 / distance of the hit, in lengths of the ray's direction; 0 or less: no hit. A triangle without area, or with the origin in its plane,
// is never hit.
fn inverse_t_of(at: Meeting) -> f32 {
    return select(0.0, at.covered / at.height, at.is_inside & (abs(at.height) > at.end_height));
}

// Whether the ends of the ray are on different sides of the triangle. The error of a height does not grow with the triangle's slimness.
fn is_between_ends(at: Meeting) -> bool {
    let beyond = select(at.height - at.covered, at.covered - at.height, at.height > 0.0);
    return at.is_inside & (at.height != 0.0) & (beyond > at.end_height);
}

// Whether a triangle with cut-outs has a hole at barycentric coordinates `b`, given up to a factor.
fn is_hole(cutout: u32, b: vec3<f32>) -> bool {
    let first = 4u * u32(triangle_texel(3u).w) + 3u * (cutout - 1u);
    let texcoords01 = triangle_texel(first);
    let texcoord2_size = triangle_texel(first + 1u);
    let place = triangle_texel(first + 2u);
    let alpha = Texture(vec2<u32>(texcoord2_size.zw), word_index(place.xy), 1u, u32(place.w));
    let texcoord = (b.x * texcoords01.xy + b.y * texcoords01.zw + b.z * texcoord2_size.xy) / (b.x + b.y + b.z);
    return is_cut_out(alpha, place.z, texcoord);
}

// 1 + index among the triangles with cut-outs; 0: the triangle is whole.
fn cutout_of(triangle: u32) -> u32 {
    return u32(triangle_texel(4u * triangle + 3u).y);
}
