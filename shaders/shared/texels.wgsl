// The texels of all textures, at the precision of their source.

// Where a texture's texels are stored.
struct Texture {
    // Columns and rows, 0 for none.
    size: vec2<u32>,
    first_word: u32,
    // Words per texel: 1, three values of 8 bits; 2, three of 16 bits; 3, three floats.
    words: u32,
    // The sum of these constants.
    flags: u32,
}

// Integers are encoded by sRGB.
const SRGB: u32 = 1u;
// Beyond the edges along u and v: mirrored, or the texels at the edge; else repeated.
const MIRROR_U: u32 = 2u;
const CLAMP_U: u32 = 4u;
const MIRROR_V: u32 = 8u;
const CLAMP_V: u32 = 16u;
// The nearest texel.
const NEAREST: u32 = 32u;
// By the second set of texture coordinates; by transformed coordinates.
const SECOND_SET: u32 = 64u;
const TRANSFORMED: u32 = 128u;

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
    return select(values, linear_from_srgb(values), (texture.flags & SRGB) != 0u);
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

// v up, with full f32 weights: samplers interpolate with 8 bits.
fn sample_texture(texture: Texture, texcoord: vec2<f32>) -> vec3<f32> {
    let corner = texel_corner(texture, texcoord);
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

fn texel_corner(texture: Texture, texcoord: vec2<f32>) -> TexelCorner {
    let size = vec2<f32>(texture.size);
    let down = vec2<f32>(texcoord.x, 1.0 - texcoord.y);
    var place = fract(down) * size - 0.5;
    if (DETAILED | CUTOUT) {
        // Where a texture does not repeat, the place is moved to the centres of its outermost texels, whose neighbours then have no weight.
        let mirrors = (vec2<u32>(texture.flags) & vec2<u32>(MIRROR_U, MIRROR_V)) != vec2<u32>(0u);
        let clamps = (vec2<u32>(texture.flags) & vec2<u32>(CLAMP_U, CLAMP_V)) != vec2<u32>(0u);
        let there_and_back = 1.0 - abs(2.0 * fract(0.5 * down) - 1.0);
        let folded = select(select(fract(down), there_and_back, mirrors), clamp(down, vec2<f32>(0.0), vec2<f32>(1.0)), clamps);
        let between = folded * size - 0.5;
        let within = select(between, clamp(between, vec2<f32>(0.0), size - 1.0), mirrors | clamps);
        let nearest = min(floor(folded * size), size - 1.0);
        place = select(within, nearest, (texture.flags & NEAREST) != 0u);
    }
    let corner = floor(place);
    return TexelCorner(vec2<u32>(vec2<i32>(corner) + vec2<i32>(texture.size)) % texture.size, place - corner);
}

// Whether a surface with an alpha texture is cut out at a point. A word has the alpha of a texel, and of those to the right, below, and
// below right.
fn is_cut_out(texture: Texture, cutoff: f32, texcoord: vec2<f32>) -> bool {
    let corner = texel_corner(texture, texcoord);
    let alpha = unpack4x8unorm(word(texture.first_word + corner.texel.y * texture.size.x + corner.texel.x));
    let above_below = mix(alpha.xz, alpha.yw, corner.weight.x);
    return mix(above_below.x, above_below.y, corner.weight.y) < cutoff;
}
