// Virtual point lights from the texels of an RSM that carry flux.

@group(0) @binding(2) var rsm_position: texture_2d_array<f32>;
@group(0) @binding(3) var rsm_normal: texture_2d_array<f32>;
@group(0) @binding(4) var rsm_kd_irradiance: texture_2d_array<f32>;
@group(0) @binding(5) var rsm_ks_shininess: texture_2d_array<f32>;
@group(0) @binding(6) var<storage, read> emission: array<vec2<f32>>;
@group(0) @binding(7) var<uniform> light: Light;
@group(0) @binding(8) var vpls: texture_storage_2d_array<rgba32float, write>;
@group(0) @binding(9) var glossy_vpls: texture_storage_2d_array<rgba32float, write>;

struct TexelPlace {
    column_row: vec2<u32>,
    face: u32,
}

fn texel_place(item: u32) -> TexelPlace {
    let texels_per_face = light.rsm_size * light.rsm_size;
    let in_face = item % texels_per_face;
    return TexelPlace(vec2<u32>(in_face % light.rsm_size, in_face / light.rsm_size), item / texels_per_face);
}

fn list_of(item: u32) -> u32 {
    let texel = texel_place(item);
    let is_surface = textureLoad(rsm_position, texel.column_row, texel.face, 0).w >= 0.0;
    let kd_irradiance = textureLoad(rsm_kd_irradiance, texel.column_row, texel.face, 0);
    let is_lit = is_surface && kd_irradiance.w > 0.0 && emission[item].x > 0.0;
#if PHONG
    let is_glossy = any(textureLoad(rsm_ks_shininess, texel.column_row, texel.face, 0).rgb > vec3<f32>(0.0));
    if (is_lit && is_glossy) {
        return GLOSSY;
    }
#endif
    return select(NOTHING, MATTE, is_lit && any(kd_irradiance.rgb > vec3<f32>(0.0)));
}

#if WRITE
fn place(item: u32, list: u32, index: u32) {
    let texel = texel_place(item);
    let position = textureLoad(rsm_position, texel.column_row, texel.face, 0).xyz;
    let normal = textureLoad(rsm_normal, texel.column_row, texel.face, 0).xyz;
    let kd_irradiance = textureLoad(rsm_kd_irradiance, texel.column_row, texel.face, 0);
    let to_light = select(normalize(light.position - position), -light.axis, light.is_parallel == 1u);

#if AVERAGE
    let cosine = max(dot(normal, to_light), 0.0);
    let share = emission[item].x / light.emission_measure;
    let incident = light.intensity * (kd_irradiance.w * cosine * share);
#else
    let incident = light.intensity * (emission[item].x * emission[item].y);
#endif
    let diffuse = kd_irradiance.rgb / PI * incident;
#if PHONG
    if (list == GLOSSY) {
        let ks_shininess = textureLoad(rsm_ks_shininess, texel.column_row, texel.face, 0);
        let specular = ks_shininess.rgb * ((ks_shininess.w + 2.0) / (2.0 * PI)) * incident;
        let mirror = 2.0 * dot(normal, to_light) * normal - to_light;
        textureStore(glossy_vpls, vpl_place(index), 0, vec4<f32>(position, 0.0));
        textureStore(glossy_vpls, vpl_place(index), 1, vec4<f32>(normal, 0.0));
        textureStore(glossy_vpls, vpl_place(index), 2, vec4<f32>(diffuse, 0.0));
        textureStore(glossy_vpls, vpl_place(index), 3, vec4<f32>(specular, ks_shininess.w));
        textureStore(glossy_vpls, vpl_place(index), 4, vec4<f32>(mirror, 0.0));
        return;
    }
#endif
    textureStore(vpls, vpl_place(index), 0, vec4<f32>(position, 0.0));
    textureStore(vpls, vpl_place(index), 1, vec4<f32>(normal, 0.0));
    textureStore(vpls, vpl_place(index), 2, vec4<f32>(diffuse, 0.0));
}
#endif
