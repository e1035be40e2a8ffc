// The surface where a ray hits it, the packing of its directions, and where rays start beside it. The importing file defines a function
// normal_texture for the normal maps.

#import brdf
#import texels

struct Hit {
    position: vec3<f32>,
    // Unit normals, on the side that the ray hits.
    geometric_normal: vec3<f32>,
    shading_normal: vec3<f32>,
    // Includes the texture, if there is one.
    brdf: Brdf,
}

struct Corner {
    position: vec3<f32>,
    // 0: flat.
    normal: vec3<f32>,
    texcoord: vec2<f32>,
}

struct Triangle {
    corners: array<Corner, 3>,
    // Unit vector.
    normal: vec3<f32>,
    brdf: Brdf,
    texture: Texture,
    // 0: no normal map; else the number by which the importing file's normal_texture finds the map.
    normal_map: u32,
}

// The point with barycentric coordinates `b`, hit from `direction`.
fn hit_at(triangle: Triangle, b: vec3<f32>, direction: vec3<f32>) -> Hit {
    let c0 = triangle.corners[0];
    let c1 = triangle.corners[1];
    let c2 = triangle.corners[2];
    var hit: Hit;
    // Computed from the triangle, not along the ray: the ray's rounding would lift the point off the surface. So the point is on the
    // triangle's plane up to rounding, however far the origin is.
    hit.position = c0.position + b.y * (c1.position - c0.position) + b.z * (c2.position - c0.position);
    hit.geometric_normal = select(triangle.normal, -triangle.normal, dot(triangle.normal, direction) > 0.0);
    hit.shading_normal = hit.geometric_normal;
    hit.brdf = triangle.brdf;
#if SMOOTH BUMPED
    // Opposed normals may cancel; then the triangle's own normal stays.
    let blend = b.x * c0.normal + b.y * c1.normal + b.z * c2.normal;
    let length_squared = dot(blend, blend);
    let smooth_normal = blend * inverseSqrt(max(length_squared, 1e-12));
    let turned = select(smooth_normal, -smooth_normal, dot(smooth_normal, hit.geometric_normal) < 0.0);
    hit.shading_normal = select(hit.shading_normal, turned, length_squared > 1e-12);
#endif
#if TEXTURED BUMPED
    let texcoord = texcoord_at(triangle, b);
    if (triangle.texture.size.x > 0u) {
        hit.brdf.kd *= sample_texture(triangle.texture, texcoord);
    }
#endif
#if BUMPED
    // A loop that other surfaces skip: drivers that compute both sides of a branch would make them pay for it.
    for (var i = 0u; i < select(0u, 1u, triangle.normal_map > 0u); i++) {
        let is_behind = dot(triangle.normal, direction) > 0.0;
        hit.shading_normal = mapped_normal(triangle, texcoord, hit.geometric_normal, hit.shading_normal, is_behind);
    }
#endif
    return hit;
}

#if TEXTURED BUMPED
fn texcoord_at(triangle: Triangle, b: vec3<f32>) -> vec2<f32> {
    return b.x * triangle.corners[0].texcoord + b.y * triangle.corners[1].texcoord + b.z * triangle.corners[2].texcoord;
}
#endif

#if BUMPED
// The shading normal that a normal map gives. The map's axes are the shading normal on the triangle's front and, perpendicular to it, the
// directions in which u and v grow.
fn mapped_normal(triangle: Triangle, texcoord: vec2<f32>, geometric_normal: vec3<f32>, shading_normal: vec3<f32>, is_behind: bool) -> vec3<f32> {
    let c0 = triangle.corners[0];
    let edge1 = triangle.corners[1].position - c0.position;
    let edge2 = triangle.corners[2].position - c0.position;
    let uv1 = triangle.corners[1].texcoord - c0.texcoord;
    let uv2 = triangle.corners[2].texcoord - c0.texcoord;
    let front = select(shading_normal, -shading_normal, is_behind);
    // Determinant of the texture coordinates; its sign tells whether the map is mirrored.
    let determinant = uv1.x * uv2.y - uv1.y * uv2.x;
    let along_u = (edge1 * uv2.y - edge2 * uv1.y) * sign(determinant);
    let across = along_u - front * dot(front, along_u);
    let length_squared = dot(across, across);
    let tangent = across * inverseSqrt(max(length_squared, 1e-37));
    let bitangent = cross(front, tangent) * sign(determinant);
    let map = 2.0 * sample_texture(normal_texture(triangle.normal_map), texcoord) - 1.0;
    let turned = normalize(map.x * tangent + map.y * bitangent + max(map.z, 0.0) * front);
    let normal = select(turned, -turned, is_behind);
    // A mapped normal that faces away from the visible side is not used.
    let is_usable = length_squared > 0.0 && determinant != 0.0 && dot(normal, geometric_normal) > LEAST_FACING;
    return select(shading_normal, normal, is_usable);
}

// Least cosine between a mapped normal and the triangle's.
const LEAST_FACING: f32 = 0.01;
#endif

// A unit vector as an integer below 2^24, exact in f32: octahedral, 12 bits per axis, within 1.1e-3 rad. The axes are exact, because 4094
// is even.
fn pack_direction(direction: vec3<f32>) -> f32 {
    let flat = direction.xy / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    let sign_xy = select(vec2<f32>(-1.0), vec2<f32>(1.0), flat >= vec2<f32>(0.0));
    let folded = select(flat, (1.0 - abs(flat.yx)) * sign_xy, direction.z < 0.0);
    let grid = round(clamp(folded * 0.5 + 0.5, vec2<f32>(0.0), vec2<f32>(1.0)) * 4094.0);
    return grid.y * 4096.0 + grid.x;
}

fn unpack_direction(packed: f32) -> vec3<f32> {
    let row = floor(packed / 4096.0);
    let flat = vec2<f32>(packed - row * 4096.0, row) / 4094.0 * 2.0 - 1.0;
    let z = 1.0 - abs(flat.x) - abs(flat.y);
    let fold = max(-z, 0.0);
    return normalize(vec3<f32>(flat - select(vec2<f32>(-fold), vec2<f32>(fold), flat >= vec2<f32>(0.0)), z));
}

// Distance by which a ray starts before P's surface, for each component of the normal. P = v0 + b1·e1 + b2·e2 is off its plane by up to
// 10u: 4u for each of the two products, where b1·e1 + b2·e2 ≤ 2, and 2u for v0 ≤ 1. The corners of a neighbour in the same plane are off it
// by u, in either direction. The shift is rounded by u. The height of the ray's origin over a plane is off by 5u of an offset ≤ 2.
const ORIGIN_SHIFT: f32 = 24.0 * 5.9604645e-8;
// Distance by which a ray ends before Q's surface. The height of its end over the plane is the difference of two heights that are off by
// 10u each. Their quotient is rounded by 3u of an offset ≤ 2.
const END_SHIFT: f32 = 40.0 * 5.9604645e-8;

fn before_surface(position: vec3<f32>, geometric_normal: vec3<f32>, shift: f32) -> vec3<f32> {
    return position + shift * dot(abs(geometric_normal), vec3<f32>(1.0)) * geometric_normal;
}
