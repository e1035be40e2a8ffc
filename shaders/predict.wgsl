// What the neighbours of a pixel say of its bounce, and whether that will do: the pixels of a lattice are visited from coarse to
// fine, each between four that are known. Where these lie on one surface, and where such predictions have been right so far, the
// pixel is interpolated; elsewhere it becomes a candidate for the gather.

struct PredictParameters {
    // Pixels from a new point to its neighbours, along an axis.
    reach: u32,
    // BASE, CENTRES or EDGES.
    pattern: u32,
    // New points of a row, and in all.
    columns: u32,
    item_count: u32,
    // Radiance that an interpolated pixel may be off by, W/sr/m²; negative: nothing is interpolated.
    tolerance: f32,
}

@group(0) @binding(0) var position_mesh: texture_2d<f32>;
@group(0) @binding(1) var normal_geometric: texture_2d<f32>;
#if PHONG
@group(0) @binding(2) var ks_shininess: texture_2d<f32>;
@group(0) @binding(3) var specular_bounce: texture_storage_2d<rgba32float, read_write>;
#endif
// Irradiance by the bounce, W/m²; state: UNKNOWN, to be gathered (negative), or 1 + the error expected, W/sr/m².
@group(0) @binding(4) var diffuse_bounce: texture_storage_2d<rgba32float, read_write>;
// Pixels to gather as column + 65536 · row, or NO_PIXEL.
@group(0) @binding(5) var<storage, read_write> candidates: array<u32>;
var<immediate> parameters: PredictParameters;

// The coarsest lattice, without neighbours; centres of its squares, with neighbours along the diagonals; and then the middles of
// the edges, with neighbours along the axes.
const BASE: u32 = 0u;
const CENTRES: u32 = 1u;
const EDGES: u32 = 2u;
const NO_PIXEL: u32 = 0xffffffffu;
const WITH_PREDICTION: f32 = -1.0;
const WITHOUT_PREDICTION: f32 = -2.0;
// Of a neighbour's normal with the pixel's.
const MIN_COSINE: f32 = 0.9;
// How far a neighbour may lie off the pixel's tangent plane, over its distance.
const MAX_SLOPE: f32 = 0.08;

@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let item = id.x;
    if (item >= parameters.item_count) {
        return;
    }
    let column = item % parameters.columns;
    let row = item / parameters.columns;
    let is_axial = parameters.pattern == EDGES;
    var pixel = vec2<u32>(column, row);
    if (parameters.pattern == CENTRES) {
        pixel = 2u * pixel + 1u;
    }
    if (is_axial) {
        pixel.x = 2u * column + (1u - row % 2u);
    }
    pixel *= parameters.reach;
    let size = textureDimensions(position_mesh);
    if (any(pixel >= size)) {
        candidates[item] = NO_PIXEL;
        return;
    }
    let surface = textureLoad(position_mesh, pixel, 0);
    if (surface.w == 0.0) {
        candidates[item] = NO_PIXEL;
        return;
    }
    let normal = textureLoad(normal_geometric, pixel, 0).xyz;
#if PHONG
    let gloss = textureLoad(ks_shininess, pixel, 0);
    var specular = vec3<f32>(0.0);
#endif
    var diffuse = vec3<f32>(0.0);
    var expected_error = 0.0;
    var neighbours = 0u;
    for (var i = 0u; i < 4u; i++) {
        let side = select(-1, 1, (i & 1u) == 1u) * i32(parameters.reach);
        let other_side = select(-1, 1, i >= 2u) * i32(parameters.reach);
        let along_axis = select(vec2<i32>(side, 0), vec2<i32>(0, side), i >= 2u);
        let place = vec2<i32>(pixel) + select(vec2<i32>(side, other_side), along_axis, is_axial);
        if (any(place < vec2<i32>(0)) || any(place >= vec2<i32>(size))) {
            continue;
        }
        let neighbour = vec2<u32>(place);
        let position = textureLoad(position_mesh, neighbour, 0);
        let bounce = textureLoad(diffuse_bounce, neighbour);
        let other_normal = textureLoad(normal_geometric, neighbour, 0).xyz;
        let offset = position.xyz - surface.xyz;
        let off_plane = max(abs(dot(offset, normal)), abs(dot(offset, other_normal)));
        var is_same = bounce.w >= 1.0 && dot(normal, other_normal) > MIN_COSINE && off_plane <= MAX_SLOPE * length(offset);
#if PHONG
        let other_gloss = textureLoad(ks_shininess, neighbour, 0);
        is_same = is_same && gloss.w == other_gloss.w && any(gloss.rgb > vec3<f32>(0.0)) == any(other_gloss.rgb > vec3<f32>(0.0));
#endif
        if (is_same) {
            neighbours += 1u;
            diffuse += bounce.rgb;
            expected_error = max(expected_error, bounce.w - 1.0);
#if PHONG
            specular += textureLoad(specular_bounce, neighbour).rgb;
#endif
        }
    }
    // The spacing has shrunk by √2 since the neighbours' errors were seen, and those are of second order.
    expected_error *= 0.5;
    let scale = 1.0 / f32(max(neighbours, 1u));
#if PHONG
    textureStore(specular_bounce, pixel, vec4<f32>(specular * scale, 0.0));
#endif
    let is_known = neighbours >= 3u && expected_error <= parameters.tolerance;
    let to_gather = select(WITHOUT_PREDICTION, WITH_PREDICTION, neighbours >= 2u);
    textureStore(diffuse_bounce, pixel, vec4<f32>(diffuse * scale, select(to_gather, 1.0 + expected_error, is_known)));
    candidates[item] = select(pixel.x + (pixel.y << 16u), NO_PIXEL, is_known);
}
