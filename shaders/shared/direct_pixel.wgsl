// What one light sends to each pixel's P if nothing blocks it: E_P.

#import light
#import pattern

struct DirectParameters {
    // C
    camera_position: vec3<f32>,
    // Weight of this G-buffer's light in the image.
    share: f32,
    // Distance from C to the local origin, in turns of each frequency.
    camera_turns: vec4<f32>,
    // 1: phasors include the path to C, 0: they do not.
    has_way_to_camera: f32,
    // The rows of pixels to process; with rays, those whose rays are in the list.
    first_row: u32,
    row_end: u32,
}

var position_instance: texture_2d<f32>;
var normal_geometric: texture_2d<f32>;
var<uniform> light: Light;
var<storage, read> pattern: array<f32>;

fn pattern_number(light: Light, at: u32) -> f32 {
    return pattern[at];
}
var<immediate> parameters: DirectParameters;

struct Pixel {
    position: vec3<f32>,
    normal: vec3<f32>,
    geometric_normal: vec3<f32>,
    to_light: vec3<f32>,
    // E_P if nothing blocks the light; 0 where the light does not reach.
    irradiance: vec3<f32>,
}

// A permutation selects the kind of light, not a branch. lavapipe computes both sides of a branch. It also compiles a kernel that branches
// at a uniform again for each dispatch, and keeps it.
fn illuminate_by_kind(light: Light, position: vec3<f32>) -> Illumination {
    if (DIRECTIONAL) {
        return Illumination(-light.axis, light.intensity);
    } else {
        var illumination = illuminate_evenly(light, position);
        if (SPOT) {
            illumination.irradiance *= spot_falloff(light, -illumination.to_light);
        }
        if (PATTERN) {
            illumination.irradiance *= measured_intensity(light, -illumination.to_light);
        }
        if (PROJECTOR) {
            illumination.irradiance *= projected_intensity(light, -illumination.to_light);
        }
        return illumination;
    }
}

fn pixel_at(place: vec2<u32>) -> Pixel {
    let is_in_image = all(place < textureDimensions(position_instance));
    let surface = textureLoad(position_instance, min(place, textureDimensions(position_instance) - 1u), 0);
    let normal = textureLoad(normal_geometric, min(place, textureDimensions(position_instance) - 1u), 0);
    var pixel: Pixel;
    pixel.position = surface.xyz;
    pixel.normal = normal.xyz;
    pixel.geometric_normal = unpack_direction(normal.w);
    let illumination = illuminate_by_kind(light, surface.xyz);
    pixel.to_light = illumination.to_light;
    let is_surface = is_in_image && surface.w != 0.0;
    pixel.irradiance = select(vec3<f32>(0.0), illumination.irradiance * max(dot(pixel.normal, pixel.to_light), 0.0), is_surface);
    return pixel;
}

fn ray_index(place: vec2<u32>) -> u32 {
    return (place.y - parameters.first_row) * textureDimensions(position_instance).x + place.x;
}

// The pixel of an invocation, among the rows of the dispatch.
fn place_of(global: vec3<u32>) -> vec2<u32> {
    return global.xy + vec2<u32>(0u, parameters.first_row);
}
