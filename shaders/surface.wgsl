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
}

var<uniform> view: View;
var<storage, read> positions: array<vec4<f32>>;
var<storage, read> indices: array<u32>;
var<storage, read> normals: array<vec4<f32>>;
var<storage, read> texcoords: array<vec2<f32>>;
var kd_texture: texture_2d<f32>;
var<immediate> draw: Draw;

struct Raster {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
}

// A point of a surface, seen from the view's origin.
struct Hit {
    position: vec3<f32>,
    // Unit normals, turned to the side that the ray hits.
    geometric_normal: vec3<f32>,
    shading_normal: vec3<f32>,
    // k_d with the texture, where there is one.
    kd: vec3<f32>,
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

fn hit_surface(raster: Raster) -> Hit {
    let pixel = vec3<f32>(1.0, raster.position.xy);
    let ray_offset = view.ray_offset * pixel;
    let ray_direction = view.ray_direction * pixel;

    let i0 = indices[3u * raster.triangle];
    let i1 = indices[3u * raster.triangle + 1u];
    let i2 = indices[3u * raster.triangle + 2u];
    let corner0 = positions[i0].xyz - view.origin;
    let corner1 = positions[i1].xyz - view.origin;
    let corner2 = positions[i2].xyz - view.origin;
    // Not from the corners: those of a far origin have lost their detail.
    let edge1 = positions[i1].xyz - positions[i0].xyz;
    let edge2 = positions[i2].xyz - positions[i0].xyz;
    let normal = normalize(cross(edge1, edge2));

    let depth0 = ray_parameter(corner0);
    let depth1 = ray_parameter(corner1);
    let depth2 = ray_parameter(corner2);
    let nearest = min(min(depth0, depth1), depth2);
    let farthest = max(max(depth0, depth1), depth2);
    // Clamped to the triangle's own depths: a triangle seen edge-on has no usable plane.
    let depth = clamp(dot(normal, corner0 - ray_offset) / dot(normal, ray_direction), nearest, farthest);
    let offset = ray_offset + depth * ray_direction;

    var hit: Hit;
    hit.geometric_normal = select(normal, -normal, dot(normal, ray_direction) > 0.0);
    hit.shading_normal = hit.geometric_normal;
    hit.kd = draw.kd;

    // Barycentric coordinates of corners 1 and 2.
    let doubled_area = cross(edge1, edge2);
    let from0 = offset - corner0;
    let scale = 1.0 / dot(doubled_area, doubled_area);
    let plain = scale * vec2<f32>(dot(cross(from0, edge2), doubled_area), dot(cross(edge1, from0), doubled_area));
    // Rasterisers round corners to 1/256 pixel, so that the ray may miss the triangle.
    let is_inside = min(min(plain.x, plain.y), 1.0 - plain.x - plain.y) >= 0.0;
    let shares = select(nearest_on_rim(from0, edge1, edge2), plain, is_inside);
    let b1 = shares.x;
    let b2 = shares.y;
    let b0 = 1.0 - b1 - b2;
    // From the triangle and not along the ray, whose rounding would lift the point off the surface: so it is right by its
    // plane to rounding, however far the origin is.
    hit.position = positions[i0].xyz + b1 * edge1 + b2 * edge2;
#if SMOOTH
    // Opposed normals may cancel: the triangle's own stays.
    let blend = b0 * normals[i0].xyz + b1 * normals[i1].xyz + b2 * normals[i2].xyz;
    let length_squared = dot(blend, blend);
    let smooth_normal = blend * inverseSqrt(max(length_squared, 1e-12));
    let turned = select(smooth_normal, -smooth_normal, dot(smooth_normal, hit.geometric_normal) < 0.0);
    hit.shading_normal = select(hit.shading_normal, turned, length_squared > 1e-12);
#endif
#if TEXTURED
    hit.kd *= sample_kd(b0 * texcoords[i0] + b1 * texcoords[i1] + b2 * texcoords[i2]);
#endif
    return hit;
}

#if TEXTURED
// Bilinear, repeating, v up, with full f32 weights: samplers interpolate with 8 bits.
fn sample_kd(texcoord: vec2<f32>) -> vec3<f32> {
    let size = vec2<i32>(textureDimensions(kd_texture));
    let place = fract(vec2<f32>(texcoord.x, 1.0 - texcoord.y)) * vec2<f32>(size) - 0.5;
    let corner = floor(place);
    let weight = place - corner;
    let low = (vec2<i32>(corner) + size) % size;
    let high = (low + 1) % size;
    let above = mix(textureLoad(kd_texture, low, 0).rgb, textureLoad(kd_texture, vec2<i32>(high.x, low.y), 0).rgb, weight.x);
    let below = mix(textureLoad(kd_texture, vec2<i32>(low.x, high.y), 0).rgb, textureLoad(kd_texture, high, 0).rgb, weight.x);
    return mix(above, below, weight.y);
}
#endif

// A unit vector as an integer below 2^24, exact in f32: octahedral, 12 bits an axis, within 1.1e-3 rad. The axes
// are exact: 4094 is even.
fn pack_direction(direction: vec3<f32>) -> f32 {
    let flat = direction.xy / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    let sign_xy = select(vec2<f32>(-1.0), vec2<f32>(1.0), flat >= vec2<f32>(0.0));
    let folded = select(flat, (1.0 - abs(flat.yx)) * sign_xy, direction.z < 0.0);
    let grid = round(clamp(folded * 0.5 + 0.5, vec2<f32>(0.0), vec2<f32>(1.0)) * 4094.0);
    return grid.y * 4096.0 + grid.x;
}
