// The texels of all textures, at the precision of their source.

// Where a texture's texels are stored.
struct Texture {
    // Columns and rows, 0 for none.
    size: vec2<u32>,
    first_word: u32,
    // Words per texel: 1, three values of 8 bits; 2, three of 16 bits; 3, three floats.
    words: u32,
    // 1: integers are encoded by sRGB.
    is_srgb: u32,
}

#if TEXTURED BUMPED CUTOUT
// A list of words in layers of 4096 x 4096.
var texels: texture_storage_2d_array<r32uint, read>;

fn word(index: u32) -> u32 {
    return textureLoad(texels, vec2<u32>(index & 4095u, index >> 12u & 4095u), index >> 24u).x;
}

fn texture_texel(texture: Texture, column_row: vec2<u32>) -> vec3<f32> {
    let place = texture.first_word + texture.words * (column_row.y * texture.size.x + column_row.x);
    let first = word(place);
    var values = vec3<f32>(vec3<u32>(first & 0xffu, first >> 8u & 0xffu, first >> 16u)) * (1.0 / 255.0);
    if (texture.words == 2u) {
        values = vec3<f32>(vec3<u32>(first & 0xffffu, first >> 16u, word(place + 1u))) * (1.0 / 65535.0);
    } else if (texture.words == 3u) {
        values = bitcast<vec3<f32>>(vec3<u32>(first, word(place + 1u), word(place + 2u)));
    }
    return select(values, linear_from_srgb(values), texture.is_srgb == 1u);
}

// A word's index from two numbers, as texels of an image hold it: 2^16 · first + second.
fn word_index(halves: vec2<f32>) -> u32 {
    let integers = vec2<u32>(halves);
    return integers.x << 16u | integers.y;
}

// IEC 61966-2-1, within 1e-6: x^2.4 = t^8 t^1.6 with t = x^(1/4), and t^1.6 by a polynomial. Vulkan guarantees less precision for pow.
fn linear_from_srgb(encoded: vec3<f32>) -> vec3<f32> {
    let t = sqrt(sqrt((encoded + 0.055) * (1.0 / 1.055)));
    var power = vec3<f32>(0.02136562);
    power = power * t - 0.12632361;
    power = power * t + 0.33817163;
    power = power * t - 0.57991767;
    power = power * t + 1.13354766;
    power = power * t + 0.22339775;
    power = power * t - 0.0102413986;
    let t2 = t * t;
    let t4 = t2 * t2;
    return select(t4 * t4 * power, encoded * (1.0 / 12.92), encoded <= vec3<f32>(0.04045));
}

// Bilinear, repeating, v up, with full f32 weights: samplers interpolate with 8 bits.
fn sample_texture(texture: Texture, texcoord: vec2<f32>) -> vec3<f32> {
    let corner = texel_corner(texture.size, texcoord);
    let low = corner.texel;
    let high = (low + 1u) % texture.size;
    let above = mix(texture_texel(texture, low), texture_texel(texture, vec2<u32>(high.x, low.y)), corner.weight.x);
    let below = mix(texture_texel(texture, vec2<u32>(low.x, high.y)), texture_texel(texture, high), corner.weight.x);
    return mix(above, below, corner.weight.y);
}

// The texel to the upper left of a place, and how far the place is from its centre.
struct TexelCorner {
    texel: vec2<u32>,
    weight: vec2<f32>,
}

fn texel_corner(size: vec2<u32>, texcoord: vec2<f32>) -> TexelCorner {
    let place = fract(vec2<f32>(texcoord.x, 1.0 - texcoord.y)) * vec2<f32>(size) - 0.5;
    let corner = floor(place);
    return TexelCorner(vec2<u32>(vec2<i32>(corner) + vec2<i32>(size)) % size, place - corner);
}
#if CUTOUT

// Whether a surface with an alpha texture of this size is cut out at a point. A word has the alpha of a texel, and of those to the right,
// below, and below right.
fn is_cut_out(size: vec2<u32>, first_word: u32, texcoord: vec2<f32>) -> bool {
    let corner = texel_corner(size, texcoord);
    let alpha = unpack4x8unorm(word(first_word + corner.texel.y * size.x + corner.texel.x));
    let above_below = mix(alpha.xz, alpha.yw, corner.weight.x);
    return mix(above_below.x, above_below.y, corner.weight.y) < 0.5;
}
#endif
#endif
