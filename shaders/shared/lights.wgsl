// The lights of a scene, of any kind, in a list.

#import light
#import texel_list

// Loads a light of the list `lights`, which has the layout of a buffer.
#loader Light lights

#import pattern

// A list in an image, like ray_triangles in hit_triangle.wgsl. The lights' patterns and points follow the lights.
var lights: texture_storage_2d<rgba32float, read>;

fn pattern_number(light: Light, at: u32) -> f32 {
    return textureLoad(lights, list_place(light.first_pattern + at / 4u))[at % 4u];
}

// p in a direction, a unit vector.
fn pattern_intensity(light: Light, direction: vec3<f32>) -> f32 {
    if (light.is_projected == 1u) {
        return projected_intensity(light, direction);
    }
    return measured_intensity(light, direction);
}

// The light at a point of its area, given in the unit square. Emissive surfaces have a list of points: position; normal, about which the
// point emits with the cosine; and intensity over that of the light.
fn light_at(whole_light: Light, place: vec2<f32>) -> Light {
    var light = whole_light;
    light.position += area_offset(light, place);
    // A loop that other lights skip: drivers that compute both sides of a branch would make all of them pay for it.
    for (var i = 0u; i < min(light.emission_points, 1u); i++) {
        let index = min(u32(place.x * f32(light.emission_points)), light.emission_points - 1u);
        let point = light.first_pattern + 3u * index;
        light.position = textureLoad(lights, list_place(point)).xyz;
        light.axis = textureLoad(lights, list_place(point + 1u)).xyz;
        light.intensity *= textureLoad(lights, list_place(point + 2u)).xyz;
    }
    return light;
}

fn illuminate(light: Light, position: vec3<f32>) -> Illumination {
    var illumination = illuminate_without_pattern(light, position);
    if (light.pattern_columns > 0u) {
        illumination.irradiance *= pattern_intensity(light, -illumination.to_light);
    }
    return illumination;
}

fn illuminate_without_pattern(light: Light, position: vec3<f32>) -> Illumination {
    if (light.is_parallel == 1u) {
        return Illumination(-light.axis, light.intensity);
    }
    var illumination = illuminate_evenly(light, position);
    if (light.outer_half_angle > 0.0) {
        illumination.irradiance *= spot_falloff(light, -illumination.to_light);
    }
    return illumination;
}
