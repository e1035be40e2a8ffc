// Direct radiance of one light: L_{P→C} = f_P(l, n_P, v) · L_{L→P} · cosθ_{P→L} · V(L, P), added to the direct image.

#import direct_pixel
#import brdf
#import phasor
#import light_map

var kd_material: texture_2d<f32>;
var lobe_parameters: texture_2d<f32>;
var direct_radiance: texture_storage_2d<rgba32float, read_write>;
// Z; without the path to C where each pixel shows one point.
var direct_phasors: texture_storage_2d_array<rgba32float, read_write>;
var<storage, read> hits: array<u32>;

fn is_lit(place: vec2<u32>, pixel: Pixel) -> bool {
    if (RAYS) {
        return hits[ray_index(place)] == NOTHING_HIT;
    } else {
        return is_visible(pixel.position, pixel.geometric_normal);
    }
}

// Adds the light that a pixel sends to C. For a point of an area, the fourth value is E_P as if nothing blocked it, all bands together.
fn add_light(place: vec2<u32>, pixel: Pixel, is_lit: bool) {
    var brdf: Brdf;
    brdf.kd = textureLoad(kd_material, place, 0).rgb;
    if (SPECULAR) {
        brdf.lobe = textureLoad(lobe_parameters, place, 0);
    }
    let to_camera = normalize(parameters.camera_position - pixel.position);
    let reflected = parameters.share * (eval_brdf(brdf, pixel.normal, pixel.to_light, to_camera) * pixel.irradiance);
    let before = textureLoad(direct_radiance, place);
    var sum = vec4<f32>(before.rgb + reflected, 0.0);
    if (AREA) {
        sum = before + vec4<f32>(select(vec3<f32>(0.0), reflected, is_lit), dot(pixel.irradiance, vec3<f32>(1.0)));
    }
    textureStore(direct_radiance, place, sum);
    if (PHASORS) {
        let seen = select(0.0, dot(modulation.band_weights, reflected), is_lit);
        let way_to_camera = turns_between(parameters.camera_position, parameters.camera_turns, pixel.position);
        let path = phasors_of(turns_from_light(light, pixel.position) + parameters.has_way_to_camera * way_to_camera);
        for (var layer = 0u; layer < modulation.pair_count; layer++) {
            textureStore(direct_phasors, place, layer, textureLoad(direct_phasors, place, layer) + seen * phasor_pair(path, layer));
        }
    }
}

@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) global: vec3<u32>) {
    let place = place_of(global);
    let pixel = pixel_at(place);
    if (place.y < parameters.row_end && any(pixel.irradiance > vec3<f32>(0.0))) {
        let lit = is_lit(place, pixel);
        if (AREA | lit) {
            add_light(place, pixel, lit);
        }
    }
}
