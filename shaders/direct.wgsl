// Direct radiance of one light: L_{P→C} = f_P(l, n_P, v) · L_{L→P} · cosθ_{P→L} · V(L, P), added to the direct image.

#import brdf
#import light
#import hit
#if PATTERN PROJECTOR
#import pattern
#endif
#if PHASORS
#import phasor
#endif
#if PACKET SINGLE QUERY
#import trace
#else
#import light_map
#endif

struct DirectParameters {
    // C
    camera_position: vec3<f32>,
    // Weight of this G-buffer's light in the image.
    share: f32,
    // Distance from C to the local origin, in turns of each frequency.
    camera_turns: vec4<f32>,
    // 1: phasors include the path to C, 0: they do not.
    has_way_to_camera: f32,
}

var position_mesh: texture_2d<f32>;
var normal_geometric: texture_2d<f32>;
var kd_material: texture_2d<f32>;
var ks_shininess: texture_2d<f32>;
var<uniform> light: Light;
#if PATTERN PROJECTOR
var<storage, read> pattern: array<f32>;

fn pattern_number(light: Light, at: u32) -> f32 {
    return pattern[at];
}
#endif
var direct_radiance: texture_storage_2d<rgba32float, read_write>;
#if PHASORS
// Z; without the path to C where each pixel shows one point.
var direct_phasors: texture_storage_2d_array<rgba32float, read_write>;
#endif
var<immediate> parameters: DirectParameters;

#if PACKET SINGLE QUERY
#import ray_tile
#else
// Pixels of a workgroup.
const TILE_COLUMNS: u32 = 8u;
const TILE_ROWS: u32 = 8u;
#endif

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
fn illuminate(light: Light, position: vec3<f32>) -> Illumination {
#if DIRECTIONAL
    return Illumination(-light.axis, light.intensity);
#else
    var illumination = illuminate_evenly(light, position);
#if SPOT
    illumination.irradiance *= spot_falloff(light, -illumination.to_light);
#endif
#if PATTERN
    illumination.irradiance *= measured_intensity(light, -illumination.to_light);
#endif
#if PROJECTOR
    illumination.irradiance *= projected_intensity(light, -illumination.to_light);
#endif
    return illumination;
#endif
}

fn pixel_at(place: vec2<u32>) -> Pixel {
    let is_in_image = all(place < textureDimensions(position_mesh));
    let surface = textureLoad(position_mesh, min(place, textureDimensions(position_mesh) - 1u), 0);
    let normal = textureLoad(normal_geometric, min(place, textureDimensions(position_mesh) - 1u), 0);
    var pixel: Pixel;
    pixel.position = surface.xyz;
    pixel.normal = normal.xyz;
    pixel.geometric_normal = unpack_direction(normal.w);
    let illumination = illuminate(light, surface.xyz);
    pixel.to_light = illumination.to_light;
    let is_surface = is_in_image && surface.w != 0.0;
    pixel.irradiance = select(vec3<f32>(0.0), illumination.irradiance * max(dot(pixel.normal, pixel.to_light), 0.0), is_surface);
    return pixel;
}

// Adds the light that an unshadowed pixel sends to C.
fn add_light(place: vec2<u32>, pixel: Pixel) {
    var brdf: Brdf;
    brdf.kd = textureLoad(kd_material, place, 0).rgb;
#if PHONG
    let specular = textureLoad(ks_shininess, place, 0);
    brdf.ks = specular.rgb;
    brdf.shininess = specular.w;
#endif
    let to_camera = normalize(parameters.camera_position - pixel.position);
    let reflected = parameters.share * (eval_brdf(brdf, pixel.normal, pixel.to_light, to_camera) * pixel.irradiance);
    let sum = textureLoad(direct_radiance, place).rgb + reflected;
    textureStore(direct_radiance, place, vec4<f32>(sum, 0.0));
#if PHASORS
    let seen = dot(modulation.band_weights, reflected);
    let way_to_camera = turns_between(parameters.camera_position, parameters.camera_turns, pixel.position);
    let path = phasors_of(turns_from_light(light, pixel.position) + parameters.has_way_to_camera * way_to_camera);
    for (var layer = 0u; layer < modulation.pair_count; layer++) {
        let pair = select(vec4<f32>(path.re.xy, path.im.xy), vec4<f32>(path.re.zw, path.im.zw), layer == 1u).xzyw;
        textureStore(direct_phasors, place, layer, textureLoad(direct_phasors, place, layer) + seen * pair);
    }
#endif
}

#if PACKET SINGLE QUERY
@compute @workgroup_size(64)
fn compute_main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
#if PACKET
    @builtin(subgroup_invocation_id) subgroup_lane: u32,
#endif
) {
#if PACKET
    lane = subgroup_lane;
#endif
    for (var i = 0u; i < RAYS; i++) {
        let pixel = pixel_at(place_of(group.xy, local, i));
        // If P is also in a second surface, as in the corner of two walls, the ray starts on the side that the camera sees.
        let to_camera = normalize(parameters.camera_position - pixel.position);
        let start = before_surface(pixel.position, pixel.geometric_normal, ORIGIN_SHIFT) + ORIGIN_SHIFT * to_camera;
        set_ray(i, start, select(NOT_WANTED, 1.0, any(pixel.irradiance > vec3<f32>(0.0))));
    }
    // No lane has returned early: all of them intersect the triangles together.
    trace_to_light(light_end(light));
    var lit = 0u;
    for (var i = 0u; i < RAYS; i++) {
        lit |= select(0u, 1u << i, ray_inverse_t[i] <= 1.0);
    }
    for (var i = 0u; i < RAYS; i++) {
        let place = place_of(group.xy, local, i);
        if ((lit >> i & 1u) == 1u) {
            add_light(place, pixel_at(place));
        }
    }
}
#else
@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) global: vec3<u32>) {
    let pixel = pixel_at(global.xy);
    if (any(pixel.irradiance > vec3<f32>(0.0)) && is_visible(pixel.position, pixel.geometric_normal)) {
        add_light(global.xy, pixel);
    }
}
#endif
