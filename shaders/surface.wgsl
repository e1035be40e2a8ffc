// Rasterises triangles as seen from a camera or from a light, and finds where the ray through a pixel's centre meets
// the triangle. The position comes from the ray and the triangle's plane, not from interpolated attributes: rasterisers
// snap vertices to a subpixel grid, which would move positions by 1/512 pixel along the surface.
//
// Lengths are local units (see LocalSpace): the scene is about 1 large and lies around 0.

struct View {
    // Clip position of an offset from the origin; reversed depth, no far plane.
    clip_from_offset: mat4x4<f32>,
    // Camera centre C, light position L, or the centre of a directional light's plane.
    origin: vec3<f32>,
    // Unit vector along which depth is measured.
    forward: vec3<f32>,
    // The ray of pixel (x, y): origin + ray_offset·(1, x, y) + t · ray_direction·(1, x, y). The direction's component
    // along `forward` is 1, so that t is the depth. A perspective view has no offsets, a parallel one no slopes.
    ray_offset: mat3x3<f32>,
    ray_direction: mat3x3<f32>,
    // Texels of the faces before this one, and texels along the edge of a face (light views).
    first_texel: u32,
    size_px: u32,
    // 1 for a parallel view, else 0.
    is_parallel: u32,
}

struct Draw {
    // k_d per band; a textured surface multiplies its texture in.
    kd: vec3<f32>,
    // 1 + index of the mesh, as a float: exact up to 2^24.
    mesh_id: f32,
    // k_s per band.
    ks: vec3<f32>,
    // s, the Phong exponent.
    shininess: f32,
    // 1 + index of the material.
    material_id: f32,
    texture: Texture,
}

var<uniform> view: View;
var<storage, read> positions: array<vec4<f32>>;
var<storage, read> indices: array<u32>;
var<storage, read> normals: array<vec4<f32>>;
var<storage, read> texcoords: array<vec2<f32>>;
var<immediate> draw: Draw;

// Here, so that what it binds comes after what both stages have.
#import hit

struct Raster {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
}

fn ray_parameter(corner: vec3<f32>) -> f32 {
    return dot(corner, view.forward);
}

// Barycentric coordinates of the point of a triangle's edges that is nearest. To cut those of a point outside would move it along a needle,
// and by more than it is outside.
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

fn corner(index: u32) -> Corner {
    var corner: Corner;
    corner.position = positions[index].xyz;
#if SMOOTH
    corner.normal = normals[index].xyz;
#endif
#if TEXTURED
    corner.texcoord = texcoords[index];
#endif
    return corner;
}

fn hit_surface(raster: Raster) -> Hit {
    let pixel = vec3<f32>(1.0, raster.position.xy);
    let ray_offset = view.ray_offset * pixel;
    let ray_direction = view.ray_direction * pixel;

    var triangle: Triangle;
    triangle.corners[0] = corner(indices[3u * raster.triangle]);
    triangle.corners[1] = corner(indices[3u * raster.triangle + 1u]);
    triangle.corners[2] = corner(indices[3u * raster.triangle + 2u]);
    triangle.brdf = Brdf(draw.kd, draw.ks, draw.shininess);
#if TEXTURED
    triangle.texture = draw.texture;
#endif
    let corner0 = triangle.corners[0].position - view.origin;
    let corner1 = triangle.corners[1].position - view.origin;
    let corner2 = triangle.corners[2].position - view.origin;
    // Not from the corners: those of a far origin have lost their detail.
    let edge1 = triangle.corners[1].position - triangle.corners[0].position;
    let edge2 = triangle.corners[2].position - triangle.corners[0].position;
    let doubled_area = cross(edge1, edge2);
    triangle.normal = normalize(doubled_area);

    let depth0 = ray_parameter(corner0);
    let depth1 = ray_parameter(corner1);
    let depth2 = ray_parameter(corner2);
    let nearest = min(min(depth0, depth1), depth2);
    let farthest = max(max(depth0, depth1), depth2);
    // Clamped to the triangle's own depths: a triangle seen edge-on has no usable plane.
    let depth = clamp(dot(triangle.normal, corner0 - ray_offset) / dot(triangle.normal, ray_direction), nearest, farthest);

    // Barycentric coordinates of corners 1 and 2.
    let from0 = ray_offset + depth * ray_direction - corner0;
    let scale = 1.0 / dot(doubled_area, doubled_area);
    let plain = scale * vec2<f32>(dot(cross(from0, edge2), doubled_area), dot(cross(edge1, from0), doubled_area));
    // Rasterisers round corners to 1/256 pixel, so that the ray may miss the triangle.
    let is_inside = min(min(plain.x, plain.y), 1.0 - plain.x - plain.y) >= 0.0;
    let b = select(nearest_on_rim(from0, edge1, edge2), plain, is_inside);
    return hit_at(triangle, vec3<f32>(1.0 - b.x - b.y, b), ray_direction);
}
