// Rays and one triangle: the terms that rays from one origin or to one light share, and the hit.

#import light
#if CUTOUT
#import texels
#endif

// The corners of a triangle, each with a component of the unit normal.
struct Corners {
    a: vec4<f32>,
    b: vec4<f32>,
    c: vec4<f32>,
}

fn corners_at(triangle: u32) -> Corners {
    return Corners(triangle_texel(4u * triangle), triangle_texel(4u * triangle + 1u), triangle_texel(4u * triangle + 2u));
}

// Terms of a triangle that all rays from one origin share.
struct OriginPlanes {
    // A direction passes inside the triangle if its dot product with none of these is negative. Neighbours have exactly opposite vectors
    // for their common edge, so no ray slips between them.
    edge0: vec3<f32>,
    edge1: vec3<f32>,
    edge2: vec3<f32>,
    // Unit normal over the origin's height: its dot product with a direction is 1 / distance.
    normal: vec3<f32>,
}

// `unit` is the length of the scene's local unit in the space of the corners.
fn planes_from_origin(corners: Corners, origin: vec3<f32>, unit: f32) -> OriginPlanes {
    let a = corners.a;
    let b = corners.b;
    let c = corners.c;
    let normal = vec3<f32>(a.w, b.w, c.w);
    let c0 = a.xyz - origin;
    let c1 = b.xyz - origin;
    let c2 = c.xyz - origin;
    let height = dot(normal, c0);
    let turn = select(-1.0, 1.0, height > 0.0);
    var planes: OriginPlanes;
    planes.edge0 = turn * cross(c1 + c2, c2 - c1);
    planes.edge1 = turn * cross(c2 + c0, c0 - c2);
    planes.edge2 = turn * cross(c0 + c1, c1 - c0);
#if CENTRAL
    // From a light, which may be mounted on a surface.
    let is_in_plane = abs(height) <= unit * LIGHT_IN_PLANE * dot(abs(normal), vec3<f32>(1.0));
#else
    // The origin is in the plane, or the triangle has no area: never hit.
    let is_in_plane = height == 0.0;
#endif
    planes.normal = select(normal / height, vec3<f32>(0.0), is_in_plane);
    return planes;
}

// 1 / distance at which a ray hits the triangle; 0 or less: no hit.
fn inverse_t_of(planes: OriginPlanes, direction: vec3<f32>) -> f32 {
    let inside = min(min(dot(planes.edge0, direction), dot(planes.edge1, direction)), dot(planes.edge2, direction));
    return select(0.0, dot(planes.normal, direction), inside >= 0.0);
}

// The direction from a ray's start to the light. `light_end` is the light's position and 1, or the direction to it and 0. That direction's
// length is how far rays go.
//
// All terms are relative to the start, near which positions are exact; the light may be far away.
fn direction_to_light(start: vec3<f32>, light_end: vec4<f32>) -> vec3<f32> {
    return light_end.xyz - light_end.w * start;
}

// Terms of a triangle that all rays to one light share.
struct LightPlanes {
    // Normals of the planes through an edge and the light, and their dot products with a point of the plane. A ray passes inside the
    // triangle if none of its start's dot products is less than the offset. Neighbours have exactly opposite planes.
    plane0: vec3<f32>,
    plane1: vec3<f32>,
    plane2: vec3<f32>,
    offsets: vec3<f32>,
    corner: vec3<f32>,
    // On the light's side; 0 if the light is in the plane up to rounding.
    normal: vec3<f32>,
}

fn planes_to_light(corners: Corners, light_end: vec4<f32>, unit: f32) -> LightPlanes {
    let a = corners.a;
    let b = corners.b;
    let c = corners.c;
    let normal = vec3<f32>(a.w, b.w, c.w);
    let height = dot(normal, direction_to_light(a.xyz, light_end));
    let turn = select(-1.0, 1.0, height > 0.0);
    let twice_light = turn * 2.0 * light_end.xyz;
    let weight = turn * light_end.w;
    // Twice the edges' middles.
    let middle0 = b.xyz + c.xyz;
    let middle1 = c.xyz + a.xyz;
    let middle2 = a.xyz + b.xyz;
    var planes: LightPlanes;
    planes.plane0 = cross(twice_light - weight * middle0, c.xyz - b.xyz);
    planes.plane1 = cross(twice_light - weight * middle1, a.xyz - c.xyz);
    planes.plane2 = cross(twice_light - weight * middle2, b.xyz - a.xyz);
    planes.offsets = 0.5 * vec3<f32>(dot(planes.plane0, middle0), dot(planes.plane1, middle1), dot(planes.plane2, middle2));
    planes.corner = a.xyz;
    let is_in_plane = abs(height) <= unit * LIGHT_IN_PLANE * dot(abs(normal), vec3<f32>(1.0));
#if PARALLEL
    // Turns a height over the plane into a distance along the rays.
    planes.normal = select(normal / height, vec3<f32>(0.0), is_in_plane);
#else
    planes.normal = select(turn * normal, vec3<f32>(0.0), is_in_plane);
#endif
    return planes;
}

// BLOCKED or 0; for parallel rays from a light, 1 / distance or 0. The heights of a ray's ends over the triangle's plane tell their sides.
// The error of a height does not grow with the light's distance or the triangle's slimness.
fn blocking(planes: LightPlanes, start: vec3<f32>) -> f32 {
    let inside = min(min(dot(planes.plane0, start) - planes.offsets.x, dot(planes.plane1, start) - planes.offsets.y),
        dot(planes.plane2, start) - planes.offsets.z);
    let height = dot(planes.normal, start - planes.corner);
#if PARALLEL
    return select(0.0, -1.0 / height, (inside >= 0.0) & (height < 0.0));
#else
    return select(0.0, BLOCKED, (inside >= 0.0) & (height < 0.0));
#endif
}

#if CUTOUT
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
#endif
