// Stores the VPLs of rays.

#import hits
#import vpl_list

var drawn_vpls: texture_storage_2d_array<rgba32float, write>;

fn store_vpl(index: u32, vpl: Vpl, turns: vec4<f32>, specular: VplLobe) {
    let slot = vpl_place(index);
    textureStore(drawn_vpls, slot, 0, vec4<f32>(vpl.position, vpl.density));
    textureStore(drawn_vpls, slot, 1, vec4<f32>(vpl.normal, vpl.is_modulated));
    textureStore(drawn_vpls, slot, 2, vec4<f32>(vpl.diffuse, vpl.base_share));
    if (PHASORS) {
        textureStore(drawn_vpls, slot, TURNS_LAYER, turns);
    }
    if (SPECULAR) {
        textureStore(drawn_vpls, slot, VPL_LAYERS, vec4<f32>(specular.specular, 0.0));
        for (var i = 0u; i < lobe_layers(); i++) {
            textureStore(drawn_vpls, slot, VPL_LAYERS + 1u + i, lobe_texel(specular.lobe, i));
        }
    }
}

// The VPL where light from the unit direction `to_light` hits a surface. `incident` is its irradiance there.
fn store_hit(index: u32, hit: Hit, to_light: vec3<f32>, incident: vec3<f32>, density: f32, is_modulated: f32, turns: vec4<f32>) {
    // Off its surface, for the rays that end there; and on the side that the light sees, even if Q is also in a second surface.
    let position = before_surface(hit.position, hit.geometric_normal, END_SHIFT) + END_SHIFT * to_light;
    let diffuse = diffuse_factor(hit.brdf.kd) * incident;
    let vpl = Vpl(position, density, hit.geometric_normal, is_modulated, diffuse, base_share(hit.brdf));
    var specular: VplLobe;
    if (SPECULAR) {
        specular = VplLobe(specular_factor(hit.brdf.lobe) * incident, lobe_of(to_light, hit.shading_normal, hit.brdf.lobe));
    }
    store_vpl(index, vpl, turns, specular);
}
