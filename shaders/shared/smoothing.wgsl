// What the passes share that smooth gathers.

#import refinement
#import reflect
#import sampling

// Difference of the normals at which a pixel has 1/e of the weight of one with the same normal.
const TURN: f32 = 0.6;

// Squared distance from a pixel to the nearest of the four next ones on the grid, and how many of them were sampled.
struct Spacing {
    squared: f32,
    sampled: u32,
}

fn spacing_at(pixel: vec2<u32>, position: vec3<f32>, stride: u32) -> Spacing {
    let size = vec2<i32>(textureDimensions(position_instance));
    var spacing = Spacing(1e30, 0u);
    for (var i = 0; i < 4; i++) {
        let along = 2 * (i & 1) - 1;
        let place = vec2<i32>(pixel) + i32(stride) * select(vec2<i32>(along, 0), vec2<i32>(0, along), i > 1);
        let other = vec2<u32>(clamp(place, vec2<i32>(0), size - 1));
        let there = textureLoad(position_instance, other);
        let offset = there.xyz - position;
        let is_other = there.w != 0.0 && any(other != pixel);
        spacing.squared = select(spacing.squared, min(spacing.squared, dot(offset, offset)), is_other);
        spacing.sampled += u32(is_other && textureLoad(samples, other, SAMPLING).x > 0.0);
    }
    return spacing;
}

// Weight of a pixel whose normal and position differ by that. `distance` is that at which it falls to 1/e, over the spacing.
fn weight_of(turn: vec3<f32>, offset: vec3<f32>, distance: f32, spacing: Spacing) -> f32 {
    return exp(-dot(turn, turn) / (TURN * TURN) - dot(offset, offset) / (distance * distance * spacing.squared));
}

// A pixel's own light, for k = 1.
fn sampled_light(pixel: vec2<u32>, lobe: u32, packets: f32) -> vec3<f32> {
    return textureLoad(samples, pixel, SUMS_DIFFUSE + lobe).rgb / (PACKET_SAMPLES * max(packets, 1.0));
}

fn sampled_phasors(pixel: vec2<u32>, layer: u32, lobe: u32, packets: f32) -> vec4<f32> {
    return textureLoad(samples, pixel, phasor_sums_layer(layer, lobe)) / (PACKET_SAMPLES * max(packets, 1.0));
}
