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

// A point on an emissive surface, which stands for all of them.
struct EmissionPoint {
    position: vec3<f32>,
    // Of such points per area, normalised to one point, per local unit².
    density: f32,
    // About which the point emits with the cosine.
    normal: vec3<f32>,
    radiance: vec3<f32>,
}

// The point at `place`, from 0 to 1, of the list of a light's points.
fn emission_point(light: Light, place: f32) -> EmissionPoint {
    let point = light.first_pattern + 3u * min(u32(place * f32(light.emission_points)), light.emission_points - 1u);
    let position_density = textureLoad(lights, list_place(point));
    let normal = textureLoad(lights, list_place(point + 1u)).xyz;
    return EmissionPoint(position_density.xyz, position_density.w, normal, textureLoad(lights, list_place(point + 2u)).xyz);
}

// The light at a point of its area, given in the unit square, or at a point of the emissive surfaces.
fn light_at(whole_light: Light, place: vec2<f32>) -> Light {
    var light = whole_light;
    light.position += area_offset(light, place);
    // A loop that other lights skip: drivers that compute both sides of a branch would make all of them pay for it.
    for (var i = 0u; i < min(light.emission_points, 1u); i++) {
        let point = emission_point(light, place.x);
        light.position = point.position;
        light.axis = point.normal;
        light.intensity = point.radiance / max(point.density, 1e-37);
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
