// Sums the direct light of points on one light's area, and measures how far two halves of the points differ. What the points find is scaled
// by what they would have found without occlusion: so they decide only how much of the light is hidden.

#import unoccluded_area

struct AreaLightParameters {
    // Weight of the image.
    share: f32,
    // Points of a half.
    point_count: f32,
    // Layers of the phasor images.
    pair_count: u32,
}

// Sum over one half of the points. The fourth value is that of E_P without occlusion, all bands together.
var first_half: texture_storage_2d<rgba32float, read_write>;
var second_half: texture_storage_2d<rgba32float, read_write>;
// Per workgroup: Σ(a − b)² and Σ(a + b)² over pixels and bands.
var<storage, read_write> differences: array<vec2<f32>>;
var<workgroup> of_pixels: array<vec2<f32>, 64>;
var direct_radiance: texture_storage_2d<rgba32float, read_write>;
// Sums over all points.
var point_phasors: texture_storage_2d_array<rgba32float, read_write>;
var direct_phasors: texture_storage_2d_array<rgba32float, read_write>;
var position_instance: texture_2d<f32>;
var normal_geometric: texture_2d<f32>;
var<uniform> light: Light;
var<immediate> parameters: AreaLightParameters;

// ∫ cosθ_P dω over the area that a pixel sees.
fn form_factor_at(place: vec2<u32>) -> f32 {
    return area_form_factor(light, textureLoad(position_instance, place, 0).xyz, textureLoad(normal_geometric, place, 0).xyz);
}

// The mean over a half, if the area's light without occlusion is that.
fn mean_of(half: vec4<f32>, form_factor: f32) -> vec3<f32> {
    let mean = half / parameters.point_count;
    return area_ratio(light, form_factor, mean.w) * mean.rgb;
}

#if MERGE
// Stores the sum of both halves in the first half, and clears the second.
@compute @workgroup_size(8, 8)
fn compute_main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let pixel = id.xy;
    let size = textureDimensions(first_half);
    let is_in_image = all(pixel < size);
    let place = min(pixel, size - 1u);
    let first = textureLoad(first_half, place);
    let second = textureLoad(second_half, place);
    let form_factor = form_factor_at(place);
    let a = mean_of(first, form_factor);
    let b = mean_of(second, form_factor);
    let of_pixel = vec2<f32>(dot(a - b, a - b), dot(a + b, a + b));
    of_pixels[local] = select(vec2<f32>(0.0), of_pixel, is_in_image);
    workgroupBarrier();
    if (is_in_image) {
        textureStore(first_half, place, first + second);
        textureStore(second_half, place, vec4<f32>(0.0));
    }
    if (local == 0u) {
        var sum = vec2<f32>(0.0);
        for (var i = 0u; i < 64u; i++) {
            sum += of_pixels[i];
        }
        differences[group.y * groups.x + group.x] = sum;
    }
}
#else
// Adds the mean over the points to the image, and clears the sums.
@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if (any(pixel >= textureDimensions(direct_radiance))) {
        return;
    }
    let sum = textureLoad(first_half, pixel);
    let mean = parameters.share * mean_of(sum, form_factor_at(pixel));
    let radiance = textureLoad(direct_radiance, pixel).rgb + mean;
    textureStore(direct_radiance, pixel, vec4<f32>(radiance, 0.0));
    textureStore(first_half, pixel, vec4<f32>(0.0));
    if (PHASORS) {
        let scale = parameters.share * area_ratio(light, form_factor_at(pixel), sum.w / parameters.point_count) / parameters.point_count;
        for (var layer = 0u; layer < parameters.pair_count; layer++) {
            let phasors = textureLoad(direct_phasors, pixel, layer) + scale * textureLoad(point_phasors, pixel, layer);
            textureStore(direct_phasors, pixel, layer, phasors);
            textureStore(point_phasors, pixel, layer, vec4<f32>(0.0));
        }
    }
}
#endif
