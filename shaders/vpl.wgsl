// Virtual point lights from the texels of an RSM that carry flux.

#import lighting
#if BOUNCE
#import ray_ends
#endif
#import compact

var rsm_position: texture_2d_array<f32>;
var rsm_normal: texture_2d_array<f32>;
var rsm_kd_irradiance: texture_2d_array<f32>;
var rsm_ks_shininess: texture_2d_array<f32>;
var<storage, read> emission: array<vec2<f32>>;
var<uniform> light: Light;
var vpls: texture_storage_2d_array<rgba32float, write>;
var glossy_vpls: texture_storage_2d_array<rgba32float, write>;

struct TexelPlace {
    column_row: vec2<u32>,
    face: u32,
    // Into the emission table.
    index: u32,
}

#if BOUNCE
// Morton order: what lies near in the list lies near in the scene. The edge is a power of two.
fn texel_place(item: u32) -> TexelPlace {
    let texels_per_face = light.rsm_size * light.rsm_size;
    let column_row = vec2<u32>(every_other_bit(item % texels_per_face), every_other_bit((item % texels_per_face) >> 1u));
    let face = item / texels_per_face;
    return TexelPlace(column_row, face, face * texels_per_face + column_row.y * light.rsm_size + column_row.x);
}

fn every_other_bit(bits: u32) -> u32 {
    var x = bits & 0x55555555u;
    x = (x | (x >> 1u)) & 0x33333333u;
    x = (x | (x >> 2u)) & 0x0f0f0f0fu;
    x = (x | (x >> 4u)) & 0x00ff00ffu;
    return (x | (x >> 8u)) & 0x0000ffffu;
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
#if APART AVERAGE RADIOSITY
    if (is_lit && is_glossy) {
        return GLOSSY;
    }
#endif
    return select(NOTHING, MATTE, is_lit && (is_glossy || any(kd_irradiance.rgb > vec3<f32>(0.0))));
}

#if WRITE
#if BOUNCE
fn place(item: u32, list: u32, index: u32) {
    let texel = texel_place(item);
    let position = textureLoad(rsm_position, texel.column_row, texel.face, 0).xyz;
    let normal_geometric = textureLoad(rsm_normal, texel.column_row, texel.face, 0);
    let normal = normal_geometric.xyz;
    let geometric_normal = unpack_direction(normal_geometric.w);
    let kd_irradiance = textureLoad(rsm_kd_irradiance, texel.column_row, texel.face, 0);

    let from_light = position - light.position;
    let is_parallel = light.is_parallel == 1u;
    let to_light = select(normalize(-from_light), -light.axis, is_parallel);
    let facing_area = facing_texel_area(light.is_parallel, light.half_extent, light.rsm_size, from_light,
        dot(from_light, light.faces[texel.face].forward));
    // The texel's part inside the emission domain.
    let part = emission[texel.index].x * select(dot(from_light, from_light), 1.0, is_parallel) / facing_area;
    // Both sides of a surface must face the light; grazing ones are left to the rays from P.
    let cosine = max(dot(normal, to_light), 0.0);
    let area = facing_area / max(dot(geometric_normal, to_light), 1e-6);
    let irradiance = light.intensity * (kd_irradiance.w * cosine * part);
    let slot = vpl_place(light.first_vpl + index);
    var shininess = 1.0;
#if PHONG
    let ks_shininess = textureLoad(rsm_ks_shininess, texel.column_row, texel.face, 0);
    let mirror = 2.0 * dot(normal, to_light) * normal - to_light;
    shininess = ks_shininess.w;
    textureStore(vpls, slot, 3, vec4<f32>(ks_shininess.rgb * ((shininess + 2.0) / (2.0 * PI)) * irradiance, 0.0));
    textureStore(vpls, slot, 4, vec4<f32>(mirror, 0.0));
#endif
    // Off its surface, for the rays that end there; and on the side that the light sees, where Q lies in a second one, too.
    let end = before_surface(position, geometric_normal, END_SHIFT) + END_SHIFT * to_light;
    textureStore(vpls, slot, 0, vec4<f32>(end, area));
    textureStore(vpls, slot, 1, vec4<f32>(geometric_normal, shininess));
    textureStore(vpls, slot, 2, vec4<f32>(kd_irradiance.rgb / PI * irradiance, 0.0));
}
#else
fn place(item: u32, list: u32, index: u32) {
    let texel = texel_place(item);
    let slot = vpl_place(light.first_vpl + index);
    let position = textureLoad(rsm_position, texel.column_row, texel.face, 0).xyz;
    let normal = textureLoad(rsm_normal, texel.column_row, texel.face, 0).xyz;
    let kd_irradiance = textureLoad(rsm_kd_irradiance, texel.column_row, texel.face, 0);
    let to_light = select(normalize(light.position - position), -light.axis, light.is_parallel == 1u);

#if AVERAGE
    let cosine = max(dot(normal, to_light), 0.0);
    let share = emission[texel.index].x / light.emission_measure;
    let incident = light.intensity * (kd_irradiance.w * cosine * share);
#else
    let incident = light.intensity * (emission[texel.index].x * emission[texel.index].y);
#endif
    let diffuse = kd_irradiance.rgb / PI * incident;
#if PHONG
    if (list == GLOSSY) {
        let ks_shininess = textureLoad(rsm_ks_shininess, texel.column_row, texel.face, 0);
        let specular = ks_shininess.rgb * ((ks_shininess.w + 2.0) / (2.0 * PI)) * incident;
        let mirror = 2.0 * dot(normal, to_light) * normal - to_light;
        textureStore(glossy_vpls, slot, 0, vec4<f32>(position, 0.0));
        textureStore(glossy_vpls, slot, 1, vec4<f32>(normal, 0.0));
        textureStore(glossy_vpls, slot, 2, vec4<f32>(diffuse, 0.0));
        textureStore(glossy_vpls, slot, 3, vec4<f32>(specular, ks_shininess.w));
        textureStore(glossy_vpls, slot, 4, vec4<f32>(mirror, 0.0));
        return;
    }
#endif
    textureStore(vpls, slot, 0, vec4<f32>(position, 0.0));
    textureStore(vpls, slot, 1, vec4<f32>(normal, 0.0));
    textureStore(vpls, slot, 2, vec4<f32>(diffuse, 0.0));
}
#endif
#endif
