// Makes the smoothed light from the model of the smooth pass, and removes the model's bias. A model that is linear in the place errs to one
// side where light curves, by less than noise. So what the gathers of a wider neighbourhood have more than their models, on average, is
// added to the model (twicing, after Tukey, "Exploratory data analysis", 1977). The neighbourhood as a whole then keeps its light.

#import refinement
#import reflect
#import sampling
#import smoothing

struct SmoothResidualsParameters {
    // Pixels between the points of the grid.
    stride: u32,
    columns: u32,
    item_count: u32,
}

var normal_geometric: texture_2d<f32>;
var gathered: texture_storage_2d_array<rgba32float, read_write>;
// In the layout of `gathered`, with the weight of a pixel's own light as the fourth value of light; −1: the pixel has no model.
var modelled: texture_2d_array<f32>;
var<immediate> parameters: SmoothResidualsParameters;

// Points of the grid to each side: twice those of the model, so that the residuals' own noise is a twentieth of the model's.
const REACH: i32 = 4;
const EDGE: i32 = 2 * REACH + 1;
const POINTS: i32 = EDGE * EDGE;
// Farness of a pixel, as in weight_of, at which it has 1/e of the weight.
const DISTANCE: f32 = 6.0;
// About how many pixels a mean residual needs, to have less noise than the model.
const LEAST_PIXELS: f32 = 20.0;

// Sum of weights, and of their squares, for a lobe.
struct Weights {
    sum: f32,
    squares: f32,
}

fn pixel_around(pixel: vec2<u32>, index: i32) -> vec2<i32> {
    return vec2<i32>(pixel) + i32(parameters.stride) * (vec2<i32>(index % EDGE, index / EDGE) - REACH);
}

// 1 over the sum of the weights; 0 if there are too few pixels.
fn scale_of(weights: Weights) -> f32 {
    let is_enough = weights.sum * weights.sum >= LEAST_PIXELS * weights.squares & weights.sum > 0.0;
    return select(0.0, 1.0 / max(weights.sum, 1e-30), is_enough);
}

fn store_lobe(pixel: vec2<u32>, lobe: u32, residual: vec3<f32>, packets: f32) -> vec3<f32> {
    let model = textureLoad(modelled, pixel, lobe, 0);
    let light = max(mix(model.rgb + residual, sampled_light(pixel, lobe, packets), model.w), vec3<f32>(0.0));
    textureStore(gathered, pixel, lobe, vec4<f32>(light, textureLoad(gathered, pixel, lobe).w));
    return light;
}

@compute @workgroup_size(64)
fn compute_main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let item = 64u * (group.y * groups.x + group.x) + local;
    let pixel = parameters.stride * vec2<u32>(item % parameters.columns, item / parameters.columns);
    if (item >= parameters.item_count || textureLoad(modelled, pixel, DIFFUSE_LOBE, 0).w < 0.0) {
        return;
    }
    let size = vec2<i32>(textureDimensions(position_instance));
    let position = textureLoad(position_instance, pixel).xyz;
    let normal = textureLoad(normal_geometric, pixel, 0).xyz;
    let own_lobe = lobe_at(pixel);
    let packets = textureLoad(samples, pixel, SAMPLING).x;
    let spacing = spacing_at(pixel, position, parameters.stride);
    var diffuse = vec3<f32>(0.0);
    var specular = vec3<f32>(0.0);
    var of_diffuse: Weights;
    var of_specular: Weights;
    var weights: array<vec2<f32>, POINTS>;
    for (var i = 0; i < POINTS; i++) {
        let place = pixel_around(pixel, i);
        let is_inside = all(place >= vec2<i32>(0)) && all(place < size);
        let other = select(pixel, vec2<u32>(place), is_inside);
        let offset = textureLoad(position_instance, other).xyz - position;
        let turn = textureLoad(normal_geometric, other, 0).xyz - normal;
        let weight = weight_of(turn, offset, DISTANCE, spacing);
        let model = textureLoad(modelled, other, DIFFUSE_LOBE, 0);
        let is_wanted = is_inside && model.w >= 0.0 && is_one_lobe(own_lobe, lobe_at(other));
        let others_packets = textureLoad(samples, other, SAMPLING).x;
        // What a pixel keeps of its own is not missing.
        weights[i].x = select(0.0, weight * (1.0 - model.w), is_wanted);
        of_diffuse.sum += weights[i].x;
        of_diffuse.squares += weights[i].x * weights[i].x;
        diffuse += weights[i].x * (sampled_light(other, DIFFUSE_LOBE, others_packets) - model.rgb);
        if (SPECULAR) {
            let specular_model = textureLoad(modelled, other, SPECULAR_LOBE, 0);
            weights[i].y = select(0.0, weight * (1.0 - specular_model.w), is_wanted);
            of_specular.sum += weights[i].y;
            of_specular.squares += weights[i].y * weights[i].y;
            let missing = sampled_light(other, SPECULAR_LOBE, others_packets) - specular_model.rgb;
            // Without a model, the others were never written and may be NaN.
            specular += select(vec3<f32>(0.0), weights[i].y * missing, weights[i].y > 0.0);
        }
    }
    let scales = vec2<f32>(scale_of(of_diffuse), scale_of(of_specular));
    var light: array<vec3<f32>, 2>;
    light[0] = store_lobe(pixel, DIFFUSE_LOBE, scales.x * diffuse, packets);
    if (SPECULAR) {
        light[1] = store_lobe(pixel, SPECULAR_LOBE, scales.y * specular, packets);
    }
    if (PHASORS) {
        for (var lobe = 0u; lobe < lobe_count(); lobe++) {
            for (var layer = 0u; layer < phasor_layer_count(); layer++) {
                let index = phasor_layer(layer, lobe);
                var residual = vec4<f32>(0.0);
                for (var i = 0; i < POINTS; i++) {
                    let other = vec2<u32>(clamp(pixel_around(pixel, i), vec2<i32>(0), size - 1));
                    let others_packets = textureLoad(samples, other, SAMPLING).x;
                    let own = sampled_phasors(other, layer, lobe, others_packets);
                    residual += select(vec4<f32>(0.0), weights[i][lobe] * (own - textureLoad(modelled, other, index, 0)), weights[i][lobe] > 0.0);
                }
                let model = textureLoad(modelled, pixel, index, 0) + scales[lobe] * residual;
                let kept = mix(model, sampled_phasors(pixel, layer, lobe, packets), textureLoad(modelled, pixel, lobe, 0).w);
                textureStore(gathered, pixel, index, limit_phasors(kept, light[lobe][band_of(layer)]));
            }
        }
    }
}
