// Virtual point lights from the texels of an RSM that carry flux.

#import light
#import compact
#import vpl_list

var rsm_position: texture_2d_array<f32>;
var rsm_normal: texture_2d_array<f32>;
var rsm_kd_irradiance: texture_2d_array<f32>;
var rsm_lobe_parameters: texture_2d_array<f32>;
var<storage, read> emission: array<vec2<f32>>;
var<uniform> light: Light;
var matte_vpls: texture_storage_2d_array<rgba32float, write>;
var glossy_vpls: texture_storage_2d_array<rgba32float, write>;

struct TexelPlace {
    column_row: vec2<u32>,
    face: u32,
    // Index into the emission table.
    index: u32,
}

fn texel_place(item: u32) -> TexelPlace {
    let texels_per_face = light.emission_size * light.emission_size;
    let in_face = item % texels_per_face;
    return TexelPlace(vec2<u32>(in_face % light.emission_size, in_face / light.emission_size), item / texels_per_face, item);
}

fn list_of(item: u32) -> u32 {
    let texel = texel_place(item);
    let is_surface = textureLoad(rsm_position, texel.column_row, texel.face, 0).w >= 0.0;
    let kd_irradiance = textureLoad(rsm_kd_irradiance, texel.column_row, texel.face, 0);
    let is_lit = is_surface && kd_irradiance.w > 0.0 && emission[texel.index].x > 0.0;
    var is_glossy = false;
    if (SPECULAR) {
        is_glossy = has_lobe(textureLoad(rsm_lobe_parameters, texel.column_row, texel.face, 0));
    }
    if (is_lit && is_glossy) {
        return GLOSSY_LIST;
    }
    return select(NOTHING, MATTE_LIST, is_lit && (is_glossy || any(kd_irradiance.rgb > vec3<f32>(0.0))));
}

fn place(item: u32, list: u32, index: u32) {
    let texel = texel_place(item);
    let slot = vpl_place(light.first_vpl + index);
    let surface = textureLoad(rsm_position, texel.column_row, texel.face, 0).xyz;
    let normal_geometric = textureLoad(rsm_normal, texel.column_row, texel.face, 0);
    let kd_irradiance = textureLoad(rsm_kd_irradiance, texel.column_row, texel.face, 0);
    let from_light = surface - light.position;
    let is_parallel = light.is_parallel == 1u;
    let to_light = select(normalize(-from_light), -light.axis, is_parallel);
    var incident = light.intensity * (emission[texel.index].x * emission[texel.index].y);
    if (AVERAGE) {
        let part = emission[texel.index].x / light.emission_measure;
        let cosine = max(dot(normal_geometric.xyz, to_light), 0.0);
        incident = light.intensity * (kd_irradiance.w * cosine * part);
    }
    let diffuse = diffuse_factor(kd_irradiance.rgb) * incident;
    // ΔΩ·d²/cosθ, at most d².
    let distance_squared = dot(from_light, from_light);
    let facing = max(dot(normal_geometric.xyz, to_light), emission[texel.index].x);
    let area = select(emission[texel.index].x * distance_squared / facing, 0.0, is_parallel);
    if (SPECULAR) {
        let parameters = textureLoad(rsm_lobe_parameters, texel.column_row, texel.face, 0);
        let specular = vec4<f32>(specular_factor(parameters) * incident, 0.0);
        let lobe = lobe_of(to_light, normal_geometric.xyz, parameters);
        if (list == GLOSSY_LIST) {
            textureStore(glossy_vpls, slot, 0, vec4<f32>(surface, area));
            textureStore(glossy_vpls, slot, 1, vec4<f32>(normal_geometric.xyz, 0.0));
            textureStore(glossy_vpls, slot, 2, vec4<f32>(diffuse, 0.0));
            textureStore(glossy_vpls, slot, VPL_LAYERS, specular);
            for (var i = 0u; i < lobe_layers(); i++) {
                textureStore(glossy_vpls, slot, VPL_LAYERS + 1u + i, lobe_texel(lobe, i));
            }
            return;
        }
    }
    textureStore(matte_vpls, slot, 0, vec4<f32>(surface, area));
    textureStore(matte_vpls, slot, 1, vec4<f32>(normal_geometric.xyz, 0.0));
    textureStore(matte_vpls, slot, 2, vec4<f32>(diffuse, 0.0));
}
