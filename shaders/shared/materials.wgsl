// The materials of a scene, how they look textures up, and the values of vertices that few meshes have: colours, a second set of texture
// coordinates, tangents. The importing file defines a function tangent_in_scene.

#import brdf
#import texel_list
#import texels

// MATERIAL_TEXELS per material, as src/passes/materials.rs lists them. Texel 0: k_d per band, the sum of what of this list it has. Texel 1:
// the lobe. From KD_MAP on, for each map: columns and rows (0 for none), words per texel, flags; its first word, for word_index; the rows
// of the transform of texture coordinates, the first with the cutoff of alpha behind it. At VERTICES: where in `vertex_values` the scene's
// triangle 0 would be (below 0 if the mesh begins later), where the mesh's vertex 0 is, and the number of texels of a vertex; then which of
// these texels are its colour, its second texture coordinates and its tangent. At EMISSION: the radiance that the surface emits.
var materials: texture_storage_2d<rgba32float, read>;

// For each mesh that has such values: a texel per triangle, its corners among the mesh's vertices; then the texels of each vertex.
var vertex_values: texture_2d<f32>;

const MAP_TEXELS: u32 = 4u;
const KD_MAP: u32 = 2u;
// The first of LOBE_MAPS.
const LOBE_MAP: u32 = KD_MAP + MAP_TEXELS;
const NORMAL_MAP: u32 = LOBE_MAP + LOBE_MAPS * MAP_TEXELS;
const ALPHA_MAP: u32 = NORMAL_MAP + MAP_TEXELS;
const EMISSION_MAP: u32 = ALPHA_MAP + MAP_TEXELS;
const VERTICES: u32 = EMISSION_MAP + MAP_TEXELS;
const EMISSION: u32 = VERTICES + 2u;
const MATERIAL_TEXELS: u32 = EMISSION + 1u;

const HAS_KD_MAP: u32 = 1u;
// The first of LOBE_MAPS bits.
const HAS_LOBE_MAP: u32 = 2u;
const HAS_NORMAL_MAP: u32 = HAS_LOBE_MAP << LOBE_MAPS;
const HAS_COLORS: u32 = HAS_NORMAL_MAP << 1u;
const HAS_TANGENTS: u32 = HAS_NORMAL_MAP << 2u;
// Whether any of these needs values of vertices.
const HAS_VERTICES: u32 = HAS_NORMAL_MAP << 3u;
// Whether the camera looks through it where it sees it from behind.
const HAS_ONE_SIDE: u32 = HAS_NORMAL_MAP << 4u;

fn material_texel(index: u32) -> vec4<f32> {
    return textureLoad(materials, list_place(index));
}

// The texture of the map that the list describes from this texel on.
fn texture_at(index: u32) -> Texture {
    let texture = vec4<u32>(material_texel(index));
    return Texture(texture.xy, word_index(material_texel(index + 1u).xy), texture.z, texture.w);
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
    // −1 if the corners turn clockwise on the front, as on a mirrored instance; else 1.
    front: f32,
    instance: u32,
    // The first texel of the material, and its HAS_ bits.
    material: u32,
    has: u32,
    // The corners among the mesh's vertices.
    vertices: vec3<u32>,
}

// 1 if the triangle has this, else 0: the turns of a loop that other surfaces skip. Drivers that compute both sides of a branch would make
// them pay for it.
fn turns(triangle: Triangle, bit: u32) -> u32 {
    return min(triangle.has & bit, 1u);
}

fn vertex_texel(index: u32) -> vec4<f32> {
    return textureLoad(vertex_values, list_place(index), 0);
}

// The corners of a triangle of the scene among its mesh's vertices.
fn corners_in_mesh(material: u32, triangle: u32) -> vec3<u32> {
    let first = i32(material_texel(material + VERTICES).x);
    return vec3<u32>(vertex_texel(u32(first + i32(triangle))).xyz);
}

const COLOR: u32 = 0u;
const TEXCOORD: u32 = 1u;
const TANGENT: u32 = 2u;

// A value of each corner.
fn corner_values(triangle: Triangle, value: u32) -> mat3x4<f32> {
    let place = vec4<u32>(max(material_texel(triangle.material + VERTICES), vec4<f32>(0.0)));
    let texel = place.y + u32(material_texel(triangle.material + VERTICES + 1u)[value]);
    let corners = texel + place.z * triangle.vertices;
    return mat3x4<f32>(vertex_texel(corners.x), vertex_texel(corners.y), vertex_texel(corners.z));
}

fn color_at(triangle: Triangle, b: vec3<f32>) -> vec3<f32> {
    return (corner_values(triangle, COLOR) * b).xyz;
}

// In the scene; the fourth value is the sign of normal × tangent along v. 0 if there is none here.
fn tangent_at(triangle: Triangle, b: vec3<f32>) -> vec4<f32> {
    let blend = corner_values(triangle, TANGENT) * b;
    return vec4<f32>(tangent_in_scene(triangle.instance, blend.xyz), triangle.front * select(1.0, -1.0, blend.w < 0.0));
}

// The texture coordinates at the corners for the map at this texel of the material.
fn map_texcoords(triangle: Triangle, map: u32, texture: Texture) -> array<vec2<f32>, 3> {
    var texcoords = array(triangle.corners[0].texcoord, triangle.corners[1].texcoord, triangle.corners[2].texcoord);
    for (var i = 0u; i < min(texture.flags & SECOND_SET, 1u); i++) {
        let second = corner_values(triangle, TEXCOORD);
        texcoords[0] = second[0].xy;
        texcoords[1] = second[1].xy;
        texcoords[2] = second[2].xy;
    }
    for (var i = 0u; i < min(texture.flags & TRANSFORMED, 1u); i++) {
        let row_u = material_texel(triangle.material + map + 2u).xyz;
        let row_v = material_texel(triangle.material + map + 3u).xyz;
        texcoords[0] = vec2<f32>(dot(row_u, vec3<f32>(texcoords[0], 1.0)), dot(row_v, vec3<f32>(texcoords[0], 1.0)));
        texcoords[1] = vec2<f32>(dot(row_u, vec3<f32>(texcoords[1], 1.0)), dot(row_v, vec3<f32>(texcoords[1], 1.0)));
        texcoords[2] = vec2<f32>(dot(row_u, vec3<f32>(texcoords[2], 1.0)), dot(row_v, vec3<f32>(texcoords[2], 1.0)));
    }
    return texcoords;
}

fn blended(texcoords: array<vec2<f32>, 3>, b: vec3<f32>) -> vec2<f32> {
    return b.x * texcoords[0] + b.y * texcoords[1] + b.z * texcoords[2];
}

fn sample_map(triangle: Triangle, map: u32, b: vec3<f32>) -> vec3<f32> {
    let texture = texture_at(triangle.material + map);
    return sample_texture(texture, blended(map_texcoords(triangle, map, texture), b));
}

// The shading normal that the normal map gives. The map's axes are the shading normal on the front and, perpendicular to it, the
// directions in which u and v grow.
fn mapped_normal(triangle: Triangle, b: vec3<f32>, geometric_normal: vec3<f32>, shading_normal: vec3<f32>, is_behind: bool) -> vec3<f32> {
    let texture = texture_at(triangle.material + NORMAL_MAP);
    let texcoords = map_texcoords(triangle, NORMAL_MAP, texture);
    let edge1 = triangle.corners[1].position - triangle.corners[0].position;
    let edge2 = triangle.corners[2].position - triangle.corners[0].position;
    let uv1 = texcoords[1] - texcoords[0];
    let uv2 = texcoords[2] - texcoords[0];
    let front = select(shading_normal, -shading_normal, is_behind);
    let determinant = uv1.x * uv2.y - uv1.y * uv2.x;
    var along_u = (edge1 * uv2.y - edge2 * uv1.y) * sign(determinant);
    // Whether, on the front, v grows to the left of u.
    var handedness = sign(determinant) * sign(dot(cross(edge1, edge2), front));
    for (var i = 0u; i < turns(triangle, HAS_TANGENTS); i++) {
        let tangent = tangent_at(triangle, b);
        let is_given = dot(tangent.xyz, tangent.xyz) > 0.0;
        along_u = select(along_u, tangent.xyz, is_given);
        handedness = select(handedness, tangent.w, is_given);
    }
    let across = along_u - front * dot(front, along_u);
    let length_squared = dot(across, across);
    let tangent = across * inverseSqrt(max(length_squared, 1e-37));
    let bitangent = cross(front, tangent) * handedness;
    let map = 2.0 * sample_texture(texture, blended(texcoords, b)) - 1.0;
    let turned = normalize(map.x * tangent + map.y * bitangent + max(map.z, 0.0) * front);
    let normal = select(turned, -turned, is_behind);
    // A mapped normal that faces away from the visible side is not used.
    let is_usable = length_squared > 0.0 && handedness != 0.0 && dot(normal, geometric_normal) > LEAST_FACING;
    return select(shading_normal, normal, is_usable);
}

// Least cosine between a mapped normal and the triangle's.
const LEAST_FACING: f32 = 0.01;
