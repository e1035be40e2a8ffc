// V(L, P) from a map of what the light sees.

#import light

// Position and triangle: from the RSM if it is fine enough, else from a separate map of the light.
var light_map: texture_2d_array<f32>;
var<storage, read> positions: array<vec4<f32>>;
var<storage, read> indices: array<u32>;

// Local units by which rounding moves a position out of its plane.
const ROUNDING: f32 = 2e-6;

// P is hidden if the segment from L to P crosses a triangle that the light sees in one of the four texels whose centres enclose P. If P is
// on the inner side of a straight edge, so is one of these four texels. So shadows have the edges of their triangles, however coarse the
// texels are. Only corners of a triangle, and triangles smaller than a texel, are missed.
//
// For these, P is also hidden if each of the four texels hides it by planes alone: the surface Q that the light sees is in front of P's
// tangent plane *and* P is behind Q's, by more than facets rise from their neighbours. A plane, a convex edge and a concave edge each fail
// one of the two tests, however coarse the texels are. So there is no acne, and no depth bias that grows with the slope.
fn is_visible(position: vec3<f32>, geometric_normal: vec3<f32>) -> bool {
    let offset = position - light.position;
    var face = 0u;
    var depth = dot(offset, light.faces[0].forward);
    // Loops over all possible faces, because lavapipe unrolls a loop that ends at a uniform. It then compiles the kernel again for each
    // dispatch, and keeps the source of each compilation as long as the pipeline.
    for (var i = 1u; i < MAX_FACES; i++) {
        let other = dot(offset, light.faces[i].forward);
        let is_nearer = (other > depth) & (i < light.face_count);
        depth = select(depth, other, is_nearer);
        face = select(face, i, is_nearer);
    }
    var extent = light.half_extent * depth;
    var ray = offset;
    if (DIRECTIONAL) {
        extent = light.half_extent;
        ray = light.axis;
    }
    let size = f32(light.shadow_size);
    let u = dot(offset, light.faces[face].right) / extent;
    let v = dot(offset, light.faces[face].up) / extent;
    let corner = vec2<i32>(floor(vec2<f32>(0.5 + 0.5 * u, 0.5 - 0.5 * v) * size - 0.5));
    // Facets finer than a texel are off the plane of their neighbours.
    let roughness = 0.05 * (2.0 * extent / size);
    var crossed = false;
    var hiding_texels = 0u;
    for (var i = 0; i < 4; i++) {
        let texel = clamp(corner + vec2<i32>(i % 2, i / 2), vec2<i32>(0), vec2<i32>(i32(light.shadow_size) - 1));
        let seen = textureLoad(light_map, texel, face, 0);
        let triangle = u32(max(seen.w, 0.0));
        // Corners relative to P: terms that two triangles share cancel exactly, so no ray slips between them.
        let corner0 = positions[indices[3u * triangle]].xyz - position;
        let corner1 = positions[indices[3u * triangle + 1u]].xyz - position;
        let corner2 = positions[indices[3u * triangle + 2u]].xyz - position;
        let normal = normalize(cross(corner1 - corner0, corner2 - corner0));
        // How far P is behind the triangle's plane, as the light sees it.
        let behind = -dot(normal, corner0) * sign(dot(normal, ray));
        var is_ahead_of_light = true;
        if (!DIRECTIONAL) {
            is_ahead_of_light = dot(normal, corner0 + ray) * dot(normal, ray) > 0.0;
        }
        let side0 = dot(ray, cross(corner1, corner2));
        let side1 = dot(ray, cross(corner2, corner0));
        let side2 = dot(ray, cross(corner0, corner1));
        let is_inside = min(min(side0, side1), side2) >= 0.0 || max(max(side0, side1), side2) <= 0.0;
        let is_surface = seen.w >= 0.0;
        crossed = crossed || (is_surface && is_inside && is_ahead_of_light && behind > ROUNDING);
        let is_before_receiver = dot(geometric_normal, seen.xyz - position) > ROUNDING + roughness;
        hiding_texels += u32(is_surface && is_before_receiver && behind > ROUNDING + roughness);
    }
    return !(crossed || hiding_texels == 4u);
}
