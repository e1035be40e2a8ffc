// Virtual point lights and the lists that they lie in.

#import brdf

// Lists of VPLs lie in image arrays, one layer per member: lavapipe fetches a texel for eight lanes in half the time of a
// buffer load, and images have no limit of 128 MiB. A row holds this many VPLs.
const VPLS_PER_ROW: u32 = 1024u;
// Layers: position and density, normal, diffuse; specular, those of the lobe.
#if ONE FOUR
const VPL_LAYERS: u32 = 3u;
#else
#if PHASORS
// And the phase of the way from the light: sums work it out themselves, for all VPLs of a list have one light.
const TURNS_LAYER: u32 = 3u;
const VPL_LAYERS: u32 = 4u;
#else
const VPL_LAYERS: u32 = 3u;
#endif
#endif
const GLOSSY_VPL_LAYERS: u32 = VPL_LAYERS + 1u + LOBE_LAYERS;

// A virtual point light on a matte surface.
struct Vpl {
    // Q
    position: vec3<f32>,
    // Of those for rays: samples per area, if there is one sample, per local unit². For sums: the area that it stands for, local units².
    density: f32,
    // n_Q
    normal: vec3<f32>,
    // What it sends in every direction of its hemisphere, the diffuse factor of f_Q times: rsm-average: L_{L→Q}·cosθ_{Q→L}·ΔΩ/ΣΔΩ;
    // instant-radiosity: I·ΔΩ, for intensity per cosine; for rays: the irradiance at Q, for radiance.
    diffuse: vec3<f32>,
#if ONE FOUR
#else
#if PHASORS
    // 1 where its light is modulated.
    is_modulated: f32,
    // Of the way from L, of each frequency.
    turns: vec4<f32>,
#endif
#endif
}

// What a surface with a specular lobe adds.
struct VplLobe {
    // As `diffuse`, with the specular factor; the lobe's shape is left to the gather.
    specular: vec3<f32>,
    lobe: Lobe,
}

// The layers are those of VPL_LAYERS or GLOSSY_VPL_LAYERS.
var vpls: texture_storage_2d_array<rgba32float, read>;

fn load_vpl(index: u32) -> Vpl {
    let place = vpl_place(index);
    let position_density = textureLoad(vpls, place, 0);
    let normal_modulated = textureLoad(vpls, place, 1);
    var vpl: Vpl;
    vpl.position = position_density.xyz;
    vpl.density = position_density.w;
    vpl.normal = normal_modulated.xyz;
    vpl.diffuse = textureLoad(vpls, place, 2).xyz;
#if ONE FOUR
#else
#if PHASORS
    vpl.is_modulated = normal_modulated.w;
    vpl.turns = textureLoad(vpls, place, TURNS_LAYER);
#endif
#endif
    return vpl;
}

fn load_vpl_lobe(index: u32) -> VplLobe {
    let place = vpl_place(index);
    var texels: array<vec4<f32>, LOBE_LAYERS>;
    for (var i = 0u; i < LOBE_LAYERS; i++) {
        texels[i] = textureLoad(vpls, place, VPL_LAYERS + 1u + i);
    }
    return VplLobe(textureLoad(vpls, place, VPL_LAYERS).xyz, lobe_of_texels(texels));
}

fn vpl_place(index: u32) -> vec2<u32> {
    return vec2<u32>(index % VPLS_PER_ROW, index / VPLS_PER_ROW);
}
