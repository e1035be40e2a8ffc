// Virtual point lights from the texels of an RSM that carry flux.

#import light
#import hit
#import compact
#import vpl_list

var rsm_position: texture_2d_array<f32>;
var rsm_normal: texture_2d_array<f32>;
var rsm_kd_irradiance: texture_2d_array<f32>;
var rsm_ks_shininess: texture_2d_array<f32>;
var<storage, read> emission: array<vec2<f32>>;
var<uniform> light: Light;
var matte_vpls: texture_storage_2d_array<rgba32float, write>;
var glossy_vpls: texture_storage_2d_array<rgba32float, write>;

struct TexelPlace {
    column_row: vec2<u32>,
    face: u32,
    // Into the emission table.
    index: u32,
}

#if FINAL_GATHER
// Morton order: what lies near in the list lies near in the scene. The edge is a power of two.
fn texel_place(item: u32) -> TexelPlace {
    let texels_per_face = light.rsm_size * light.rsm_size;
    let column_row = vec2<u32>(every_other_bit(item % texels_per_face), every_other_bit((item % texels_per_face) >> 1u));
    let face = item / texels_per_face;
    return TexelPlace(column_row, face, face * texels_per_face + column_row.y * light.rsm_size + column_row.x);
}
#else
fn texel_place(item: u32) -> TexelPlace {
    let texels_per_face = light.rsm_size * light.rsm_size;
    let in_face = item % texels_per_face;
    return TexelPlace(vec2<u32>(in_face % light.rsm_size, in_face / light.rsm_size), item / texels_per_face, item);
}
#endif

fn list_of(item: u32) -> u32 {
    let texel = texel_place(item);
    let is_surface = textureLoad(rsm_position, texel.column_row, texel.face, 0).w >= 0.0;
    let kd_irradiance = textureLoad(rsm_kd_irradiance, texel.column_row, texel.face, 0);
    let is_lit = is_surface && kd_irradiance.w > 0.0 && emission[texel.index].x > 0.0;
    var is_glossy = false;
#if PHONG
    is_glossy = any(textureLoad(rsm_ks_shininess, texel.column_row, texel.face, 0).rgb > vec3<f32>(0.0));
#endif
#if FINAL_GATHER
    // One list of both.
#else
    if (is_lit && is_glossy) {
        return GLOSSY;
    }
#endif
    return select(NOTHING, MATTE, is_lit && (is_glossy || any(kd_irradiance.rgb > vec3<f32>(0.0))));
}

#if WRITE
fn place(item: u32, list: u32, index: u32) {
    let texel = texel_place(item);
    let slot = vpl_place(light.first_vpl + index);
    let surface = textureLoad(rsm_position, texel.column_row, texel.face, 0).xyz;
    let normal_geometric = textureLoad(rsm_normal, texel.column_row, texel.face, 0);
    let kd_irradiance = textureLoad(rsm_kd_irradiance, texel.column_row, texel.face, 0);
    let from_light = surface - light.position;
    let is_parallel = light.is_parallel == 1u;
    let to_light = select(normalize(-from_light), -light.axis, is_parallel);
    var position = surface;
    var normal = normal_geometric.xyz;
    var area = 0.0;
#if AVERAGE
    let part = emission[texel.index].x / light.emission_measure;
#endif
#if FINAL_GATHER
    let geometric_normal = unpack_direction(normal_geometric.w);
    let facing_area = facing_texel_area(light, from_light, dot(from_light, light.faces[texel.face].forward));
    // Both sides of a surface must face the light; grazing ones are left to the rays from P.
    area = facing_area / max(dot(geometric_normal, to_light), 1e-6);
    // The texel's part inside the emission domain.
    let part = emission[texel.index].x * select(dot(from_light, from_light), 1.0, is_parallel) / facing_area;
    // Off its surface, for the rays that end there; and on the side that the light sees, where Q lies in a second one, too.
    position = before_surface(surface, geometric_normal, END_SHIFT) + END_SHIFT * to_light;
    normal = geometric_normal;
#endif
#if AVERAGE FINAL_GATHER
    let cosine = max(dot(normal_geometric.xyz, to_light), 0.0);
    let incident = light.intensity * (kd_irradiance.w * cosine * part);
#else
    let incident = light.intensity * (emission[texel.index].x * emission[texel.index].y);
#endif
    let diffuse = diffuse_factor(kd_irradiance.rgb) * incident;
#if PHONG
    let ks_shininess = textureLoad(rsm_ks_shininess, texel.column_row, texel.face, 0);
    let specular = vec4<f32>(specular_factor(ks_shininess.rgb, ks_shininess.w) * incident, 0.0);
    let lobe = lobe_of(to_light, normal_geometric.xyz, ks_shininess);
#if FINAL_GATHER
    textureStore(matte_vpls, slot, VPL_LAYERS, specular);
    for (var i = 0u; i < LOBE_LAYERS; i++) {
        textureStore(matte_vpls, slot, VPL_LAYERS + 1u + i, lobe_texel(lobe, i));
    }
#else
    if (list == GLOSSY) {
        textureStore(glossy_vpls, slot, 0, vec4<f32>(position, area));
        textureStore(glossy_vpls, slot, 1, vec4<f32>(normal, 0.0));
        textureStore(glossy_vpls, slot, 2, vec4<f32>(diffuse, 0.0));
        textureStore(glossy_vpls, slot, VPL_LAYERS, specular);
        for (var i = 0u; i < LOBE_LAYERS; i++) {
            textureStore(glossy_vpls, slot, VPL_LAYERS + 1u + i, lobe_texel(lobe, i));
        }
        return;
    }
#endif
#endif
    textureStore(matte_vpls, slot, 0, vec4<f32>(position, area));
    textureStore(matte_vpls, slot, 1, vec4<f32>(normal, 0.0));
    textureStore(matte_vpls, slot, 2, vec4<f32>(diffuse, 0.0));
}
#endif
