// The point where a ray hits the triangle that a pixel shows. The position comes from the ray and the triangle's plane, not from the method
// that found the triangle: rasterisers snap vertices to a subpixel grid, which would move positions by 1/512 pixel along the surface.

#import hit

// Barycentric coordinates of the nearest point on a triangle's edges. Clamping the coordinates of an outside point would move it along a
// needle, by more than its distance from the triangle.
fn nearest_on_rim(from0: vec3<f32>, edge1: vec3<f32>, edge2: vec3<f32>) -> vec2<f32> {
    let along1 = nearest_on_edge(from0, edge1);
    let along2 = nearest_on_edge(from0, edge2);
    let across = nearest_on_edge(from0 - edge1, edge2 - edge1);
    let off1 = from0 - along1 * edge1;
    let off2 = from0 - along2 * edge2;
    let off3 = from0 - mix(edge1, edge2, across);
    let distances = vec3<f32>(dot(off1, off1), dot(off2, off2), dot(off3, off3));
    let on_a_side = select(vec2<f32>(along1, 0.0), vec2<f32>(0.0, along2), distances.y < distances.x);
    return select(on_a_side, vec2<f32>(1.0 - across, across), distances.z < min(distances.x, distances.y));
}

fn nearest_on_edge(offset: vec3<f32>, edge: vec3<f32>) -> f32 {
    return clamp(dot(offset, edge) / max(dot(edge, edge), 1e-37), 0.0, 1.0);
}

// Barycentric coordinates of the point where the ray hits the triangle. The ray is origin + offset + t · direction. The dot product of
// `direction` and `axis` is 1.
fn place_on_plane(triangle: Triangle, origin: vec3<f32>, offset: vec3<f32>, direction: vec3<f32>, axis: vec3<f32>) -> vec3<f32> {
    let corner0 = triangle.corners[0].position - origin;
    let corner1 = triangle.corners[1].position - origin;
    let corner2 = triangle.corners[2].position - origin;
    // Not from the corners above: relative to a far origin they have lost their detail.
    let edge1 = triangle.corners[1].position - triangle.corners[0].position;
    let edge2 = triangle.corners[2].position - triangle.corners[0].position;
    let doubled_area = cross(edge1, edge2);
    let normal = normalize(doubled_area);

    let depth0 = dot(corner0, axis);
    let depth1 = dot(corner1, axis);
    let depth2 = dot(corner2, axis);
    let nearest = min(min(depth0, depth1), depth2);
    let farthest = max(max(depth0, depth1), depth2);
    // Clamped to the triangle's own depths: a triangle seen edge-on has no usable plane.
    let depth = clamp(dot(normal, corner0 - offset) / dot(normal, direction), nearest, farthest);

    // Barycentric coordinates of corners 1 and 2.
    let from0 = offset + depth * direction - corner0;
    let scale = 1.0 / dot(doubled_area, doubled_area);
    let plain = scale * vec2<f32>(dot(cross(from0, edge2), doubled_area), dot(cross(edge1, from0), doubled_area));
    // The method that found the triangle rounds, so the ray may miss the triangle: rasterisers round corners to 1/256 pixel.
    let is_inside = min(min(plain.x, plain.y), 1.0 - plain.x - plain.y) >= 0.0;
    let rest = select(nearest_on_rim(from0, edge1, edge2), plain, is_inside);
    let b = vec3<f32>(1.0 - rest.x - rest.y, rest);
    if (CUTOUT) {
        let alpha = texture_at(triangle.material + ALPHA_MAP);
        let cutoff = material_texel(triangle.material + ALPHA_MAP + 2u).w;
        if (is_cut_out(alpha, cutoff, blended(map_texcoords(triangle, ALPHA_MAP, alpha), b))) {
            discard;
        }
    }
    return b;
}

// The surface there.
fn hit_on_plane(hit_triangle: Triangle, origin: vec3<f32>, offset: vec3<f32>, direction: vec3<f32>, axis: vec3<f32>) -> Hit {
    let b = place_on_plane(hit_triangle, origin, offset, direction, axis);
    var triangle = hit_triangle;
    let edge1 = triangle.corners[1].position - triangle.corners[0].position;
    let edge2 = triangle.corners[2].position - triangle.corners[0].position;
    triangle.normal = normalize(cross(edge1, edge2));
    return hit_at(triangle, b, direction);
}
