// Virtual point lights and their lists.

#import brdf

// Lists of VPLs are image arrays, one layer per member. lavapipe fetches a texel for eight lanes in half the time of a buffer load, and
// images have no limit of 128 MiB. A row holds this many VPLs.
const VPLS_PER_ROW: u32 = 1024u;
// Layers: position and density, normal, diffuse. Rays need the phase of the path from the light, too; sums compute it themselves, because
// all VPLs of a list have one light. Then specular, and the layers of the lobe.
const TURNS_LAYER: u32 = 3u;
const VPL_LAYERS: u32 = select(3u, 4u, PHASORS && !(ONE || FOUR));
const PHONG_VPL_LAYERS: u32 = VPL_LAYERS + 1u + PHONG_LAYERS;
const MICROFACET_VPL_LAYERS: u32 = VPL_LAYERS + 1u + LOBE_LAYERS;

// A virtual point light on a matte surface.
struct Vpl {
    // Q
    position: vec3<f32>,
    // For rays: samples per area, normalised to one sample, per local unit². For sums: the area that it stands for, local units².
    density: f32,
    // n_Q
    normal: vec3<f32>,
    // For rays: 1 if its light is modulated.
    is_modulated: f32,
    // Light that it sends in every direction of its hemisphere, including the diffuse factor of f_Q. rsm-average:
    // L_{L→Q}·cosθ_{Q→L}·ΔΩ/ΣΔΩ; instant-radiosity: I·ΔΩ, which gives intensity per cosine; for rays: the irradiance at Q, which gives
    // radiance.
    diffuse: vec3<f32>,
    // For rays: as in brdf.wgsl.
    base_share: f32,
}

// What a surface with a specular lobe has in addition.
struct VplLobe {
    // Like `diffuse`, with the specular factor. The gather evaluates the lobe's shape.
    specular: vec3<f32>,
    lobe: Lobe,
}

// Its layers are VPL_LAYERS, PHONG_VPL_LAYERS or MICROFACET_VPL_LAYERS.
var vpls: texture_storage_2d_array<rgba32float, read>;

fn load_vpl(index: u32) -> Vpl {
    let place = vpl_place(index);
    let position_density = textureLoad(vpls, place, 0);
    let normal_modulated = textureLoad(vpls, place, 1);
    let diffuse_share = textureLoad(vpls, place, 2);
    return Vpl(
        position_density.xyz,
        position_density.w,
        normal_modulated.xyz,
        normal_modulated.w,
        diffuse_share.xyz,
        diffuse_share.w,
    );
}

// For rays: of the path from L, for each frequency.
fn vpl_turns(index: u32) -> vec4<f32> {
    return textureLoad(vpls, vpl_place(index), TURNS_LAYER);
}

fn load_vpl_lobe(index: u32) -> VplLobe {
    let place = vpl_place(index);
    var texels: array<vec4<f32>, LOBE_LAYERS>;
    for (var i = 0u; i < lobe_layers(); i++) {
        texels[i] = textureLoad(vpls, place, VPL_LAYERS + 1u + i);
    }
    return VplLobe(textureLoad(vpls, place, VPL_LAYERS).xyz, lobe_of_texels(texels));
}

// For rays: what a VPL sends along a direction.
struct VplLight {
    radiance: vec3<f32>,
    // As in brdf.wgsl.
    directivity: f32,
}

// `direction` leads away from the VPL and has unit length.
fn vpl_light(vpl: Vpl, index: u32, direction: vec3<f32>) -> VplLight {
    var light = VplLight(vpl.diffuse, 1.0);
    if (SPECULAR) {
        let vpl_lobe = load_vpl_lobe(index);
        let shape = eval_lobe(vpl_lobe.lobe, direction);
        light.radiance += vpl_lobe.specular * shape;
        light.directivity = directivity(vpl.base_share, vpl_lobe.lobe, shape);
    }
    return light;
}

fn vpl_place(index: u32) -> vec2<u32> {
    return vec2<u32>(index % VPLS_PER_ROW, index / VPLS_PER_ROW);
}
