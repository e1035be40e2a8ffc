// The single bounce L–Q–P at a list of receivers P, by rays. Q is drawn in two ways: from P, along directions from the lobes of
// f_P; and from L, as one of the VPLs. Every Q so found counts F(Q) / Σ n_i·p_i(Q), F being the integrand over the solid angle at
// P, and n_i and p_i the number of draws of each way and their density (the balance heuristic, Veach & Guibas 1995). So neither
// the 1/d² of a near VPL nor a small bright spot that few directions find makes noise, and nothing is clamped.
//
// A subgroup takes a receiver. The draws are sets that fall evenly: directions are a rank-1 lattice, and VPLs are taken at equal
// steps of their shares of the draws, along their list, which is in Morton order; each receiver shifts both by numbers of its own.

#import lighting
#import spot
#import phong
#import hits

// Parts of 0 to 1 in which the range of a draw is known.
const GUIDE_CELLS: u32 = 4096u;
// Texels along the edge of a tile; compact.wgsl takes as many together.
const TILE_TEXELS: u32 = 8u;

struct BounceParameters {
    // C
    camera_position: vec3<f32>,
    // Into the list of receivers.
    first_receiver: u32,
    receiver_count: u32,
    // Where the results begin.
    first_result: u32,
    // Draws of this dispatch: from first_draw, draw_count of each way.
    first_draw: u32,
    draw_count: u32,
    // Draws of each way in all.
    draws: u32,
    light_count: u32,
    range_count: u32,
    // 1: what VPLs bring is kept.
    is_pilot: u32,
    // Another number: other draws.
    seed: u32,
}

var position_mesh: texture_2d<f32>;
var normal_geometric: texture_2d<f32>;
#if GLOSSY
var ks_shininess: texture_2d<f32>;
#endif
// Lists in images, as that of triangles in trace.wgsl. LIGHT_TEXELS a light, as a Light lies in a buffer.
var lights: texture_storage_2d<rgba32float, read>;
var<storage, read> receivers: array<u32>;
var vpls: texture_2d_array<f32>;
// The tiles of 8 x 8 texels that have VPLs, which lie next to each other: the first VPL, their number; and the draws that fall to
// them: from which share of 0 to 1, and how much of it.
var vpl_ranges: texture_storage_2d<rgba32float, read>;
// For every GUIDE_CELLS-th part of 0 to 1 the range in which it begins.
var vpl_guide: texture_storage_2d<rgba32float, read>;
// For every tile of every light the share of the draws that falls to each of its VPLs; 0: it has none.
var vpl_shares: texture_storage_2d<rgba32float, read>;
// What each draw of a VPL has brought; only where the parameters say so.
var<storage, read_write> brought_by_vpls: array<f32>;
// Rank-1 lattice on the unit square in Morton order.
var lattice: texture_storage_2d<rgba32float, read>;
// Two a receiver: the irradiance by the bounce, and its spread; the irradiance weighted by the Phong lobe, Σ L·lobe·cosθ, and its.
var<storage, read_write> results: array<vec4<f32>>;
var<immediate> parameters: BounceParameters;

// P
var<private> receiver_position: vec3<f32>;
var<private> receiver_start: vec3<f32>;
var<private> receiver_normal: vec3<f32>;
var<private> receiver_geometric: vec3<f32>;
var<private> receiver_mirror: vec3<f32>;
var<private> receiver_shininess: f32;
var<private> own_lane: u32;
var<private> diffuse: vec3<f32>;
var<private> specular: vec3<f32>;
// Σ over pairs of neighbouring draws of their difference squared, all bands together, of each of these.
var<private> diffuse_spread: f32;
var<private> specular_spread: f32;

fn hash(value: u32) -> u32 {
    // PCG (Jarzynski & Olano 2020).
    let state = value * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

fn unit(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604645e-8;
}

// Density of the draws from P per solid angle, times their numbers: cosine lobe, and Phong lobe.
fn density_from_receiver(cosine: f32, lobe: f32) -> f32 {
    var density = f32(parameters.draws) * cosine / PI;
#if GLOSSY
    density += f32(parameters.draws) * (receiver_shininess + 1.0) / (2.0 * PI) * lobe;
#endif
    return density;
}

struct Brought {
    irradiance: vec3<f32>,
    // Of the Phong lobe of P.
    lobe: f32,
}

// What a Q that sends `radiance` to P counts. `direction` leads from P to Q and has unit length; `vpl_area` is the area that a VPL
// stands for at Q, and `vpl_share` the draws per VPL.
fn bring(direction: vec3<f32>, distance_squared: f32, radiance: vec3<f32>, cosine_q: f32, vpl_area: f32, vpl_share: f32) -> Brought {
    let cosine = dot(receiver_normal, direction);
    let is_above = cosine > 0.0 && dot(receiver_geometric, direction) > 0.0 && cosine_q > 0.0;
    var lobe = 0.0;
#if GLOSSY
    lobe = phong_lobe(receiver_mirror, direction, receiver_shininess);
#endif
    // Draws from L per solid angle at P.
    let from_light = vpl_share * distance_squared / (vpl_area * max(cosine_q, 1e-6));
    let density = density_from_receiver(cosine, lobe) + from_light;
    return Brought(select(vec3<f32>(0.0), radiance * (cosine / density), is_above), lobe);
}

// How a light reaches a point: s(θ)·I_0/d² or E_L; the area facing the light that a texel of its RSM has there; and the share of
// the draws of a VPL there.
struct Illumination {
    to_light: vec3<f32>,
    irradiance: vec3<f32>,
    facing_area: f32,
    vpl_share: f32,
}

// Zeros between the bits.
fn spread_bits(number: u32) -> u32 {
    var x = number & 0xffffu;
    x = (x | (x << 8u)) & 0x00ff00ffu;
    x = (x | (x << 4u)) & 0x0f0f0f0fu;
    x = (x | (x << 2u)) & 0x33333333u;
    return (x | (x << 1u)) & 0x55555555u;
}

const LIGHT_TEXELS: u32 = 23u;

// The light that rays lead to.
var<private> held_light: Light;

fn light_texel(index: u32, texel: u32) -> vec4<f32> {
    return textureLoad(lights, list_place(LIGHT_TEXELS * index + texel));
}

// Once for all rays of a packet: it takes as long as to trace some.
fn hold_light(index: u32) {
    let position = light_texel(index, 0u);
    let axis = light_texel(index, 1u);
    let intensity = light_texel(index, 2u);
    held_light.position = position.xyz;
    held_light.half_extent = position.w;
    held_light.axis = axis.xyz;
    held_light.outer_half_angle = axis.w;
    held_light.intensity = intensity.xyz;
    held_light.inverse_penumbra = intensity.w;
#repeat FACE 6
    held_light.faces[FACE].right = light_texel(index, 3u * FACEu + 3u).xyz;
    held_light.faces[FACE].up = light_texel(index, 3u * FACEu + 4u).xyz;
    held_light.faces[FACE].forward = light_texel(index, 3u * FACEu + 5u).xyz;
#endrepeat
    let counts = bitcast<vec4<u32>>(light_texel(index, 21u));
    let places = bitcast<vec4<u32>>(light_texel(index, 22u));
    held_light.rsm_size = counts.z;
    held_light.is_parallel = places.x;
    held_light.first_tile = places.z;
}

// By the held light.
fn illuminate(position: vec3<f32>) -> Illumination {
    var result: Illumination;
    let from_light = position - held_light.position;
    let is_parallel = held_light.is_parallel == 1u;
    var face = 0u;
    var depth = dot(from_light, held_light.faces[0].forward);
    var right = held_light.faces[0].right;
    var up = held_light.faces[0].up;
    // A light with fewer faces has copies of its first.
#repeat FACE 6
    let along_FACE = dot(from_light, held_light.faces[FACE].forward);
    let is_deeper_FACE = along_FACE > depth;
    face = select(face, FACEu, is_deeper_FACE);
    depth = select(depth, along_FACE, is_deeper_FACE);
    right = select(right, held_light.faces[FACE].right, is_deeper_FACE);
    up = select(up, held_light.faces[FACE].up, is_deeper_FACE);
#endrepeat
    let size = held_light.rsm_size;
    let across = vec2<f32>(dot(from_light, right), -dot(from_light, up));
    let place = across / (held_light.half_extent * select(depth, 1.0, is_parallel));
    let texel = clamp((0.5 + 0.5 * place) * f32(size), vec2<f32>(0.0), vec2<f32>(f32(size) - 0.5));
    let tile = vec2<u32>(texel) / TILE_TEXELS;
    let tiles = size / TILE_TEXELS;
    let tile_index = held_light.first_tile + face * tiles * tiles + spread_bits(tile.x) + 2u * spread_bits(tile.y);
    result.vpl_share = f32(parameters.draws) * textureLoad(vpl_shares, list_place(tile_index)).x;
    result.facing_area = facing_texel_area(held_light.is_parallel, held_light.half_extent, size, from_light, depth);
    if (is_parallel) {
        result.to_light = -held_light.axis;
        result.irradiance = held_light.intensity;
        return result;
    }
    let distance_squared = max(dot(from_light, from_light), 1e-18);
    result.to_light = -from_light * inverseSqrt(distance_squared);
    result.irradiance = select(vec3<f32>(0.0), held_light.intensity / distance_squared, any(from_light != vec3<f32>(0.0)));
    if (held_light.outer_half_angle > 0.0) {
        result.irradiance *= spot_falloff(held_light.axis, held_light.outer_half_angle, held_light.inverse_penumbra, -result.to_light);
    }
    return result;
}

// Orthonormal vectors beside a unit vector: Duff et al., "Building an orthonormal basis, revisited" (JCGT 2017).
struct Frame {
    right: vec3<f32>,
    up: vec3<f32>,
}

fn frame_around(axis: vec3<f32>) -> Frame {
    let sign_z = select(-1.0, 1.0, axis.z >= 0.0);
    let a = -1.0 / (sign_z + axis.z);
    let b = axis.x * axis.y * a;
    return Frame(vec3<f32>(1.0 + sign_z * axis.x * axis.x * a, sign_z * b, -sign_z * axis.x),
        vec3<f32>(b, sign_z + axis.y * axis.y * a, -axis.y));
}

// From the unit square to the unit disc, neighbours to neighbours (Shirley & Chiu 1997).
fn to_disc(place: vec2<f32>) -> vec2<f32> {
    let centred = 2.0 * place - 1.0;
    let is_wide = abs(centred.x) > abs(centred.y);
    let radius = select(centred.y, centred.x, is_wide);
    let ratio = select(centred.x, centred.y, is_wide) / select(radius, 1e-20, radius == 0.0);
    let turn = select(0.5 * PI - 0.25 * PI * ratio, 0.25 * PI * ratio, is_wide);
    return radius * vec2<f32>(cos(turn), sin(turn));
}

// What each ray brings if nothing is in its way: W/m² of irradiance; of that, the share that the Phong lobe of P takes.
var<private> brought: array<vec3<f32>, RAYS>;
#if GLOSSY
var<private> brought_lobe: array<f32, RAYS>;
#endif
// What the rays from P met.
var<private> met_direction: array<vec3<f32>, RAYS>;
var<private> met_hit: array<u32, RAYS>;

fn put_brought(ray: u32, what: Brought) {
#repeat SLOT 8
    brought[SLOT] = select(brought[SLOT], what.irradiance, ray == SLOTu);
#if GLOSSY
    brought_lobe[SLOT] = select(brought_lobe[SLOT], what.lobe, ray == SLOTu);
#endif
#endrepeat
}

// Adds what the rays bring that nothing is in the way of.
fn add_unblocked() {
#repeat SLOT 8
    let arrived_SLOT = select(brought[SLOT], vec3<f32>(0.0), ray_nearness[SLOT] > 1.0);
    diffuse += arrived_SLOT;
#endrepeat
    diffuse_spread += square(arrived_0 - arrived_1) + square(arrived_2 - arrived_3) + square(arrived_4 - arrived_5) + square(arrived_6 - arrived_7);
#if GLOSSY
#repeat SLOT 8
    let in_lobe_SLOT = arrived_SLOT * brought_lobe[SLOT];
    specular += in_lobe_SLOT;
#endrepeat
    specular_spread += square(in_lobe_0 - in_lobe_1) + square(in_lobe_2 - in_lobe_3) + square(in_lobe_4 - in_lobe_5) + square(in_lobe_6 - in_lobe_7);
#endif
}

fn square(v: vec3<f32>) -> f32 {
    return dot(v, v);
}

// Follows the directions in ray_vector from P and adds what they find.
fn follow_directions() {
    trace(receiver_start, false);
#repeat SLOT 8
    met_direction[SLOT] = ray_vector[SLOT];
    met_hit[SLOT] = select(ray_hit[SLOT], NOTHING_HIT, ray_nearness[SLOT] >= NOT_WANTED);
#endrepeat
    for (var light = 0u; light < parameters.light_count; light++) {
        hold_light(light);
        for (var i = 0u; i < RAYS; i++) {
            var direction = met_direction[0];
            var met = met_hit[0];
#repeat SLOT 8
            direction = select(direction, met_direction[SLOT], i == SLOTu);
            met = select(met, met_hit[SLOT], i == SLOTu);
#endrepeat
            let is_hit = met != NOTHING_HIT;
            let hit = hit_surface(select(0u, met, is_hit), receiver_start, direction);
            let illumination = illuminate(hit.position);
            let cosine_light = dot(hit.shading_normal, illumination.to_light);
            let geometric_cosine_light = dot(hit.geometric_normal, illumination.to_light);
            var brdf = hit.kd / PI;
#if PHONG
            let mirror = 2.0 * cosine_light * hit.shading_normal - illumination.to_light;
            brdf += hit.ks * ((hit.shininess + 2.0) / (2.0 * PI)) * phong_lobe(mirror, -direction, hit.shininess);
#endif
            let offset = hit.position - receiver_position;
            let found = bring(direction, dot(offset, offset), brdf * illumination.irradiance * cosine_light,
                -dot(hit.geometric_normal, direction), illumination.facing_area / max(geometric_cosine_light, 1e-6), illumination.vpl_share);
            let is_lit = is_hit && cosine_light > 0.0 && geometric_cosine_light > 0.0 && any(found.irradiance > vec3<f32>(0.0));
            put_brought(i, found);
            // On the side that P sees, where Q lies in a second surface, too.
            let end = before_surface(hit.position, hit.geometric_normal, END_SHIFT) - END_SHIFT * direction;
            put_ray(i, end, select(NOT_WANTED, 1.0, is_lit));
        }
        let is_parallel = held_light.is_parallel == 1u;
        trace_to_light(select(vec4<f32>(held_light.position, 1.0), vec4<f32>(-REACH * held_light.axis, 0.0), is_parallel));
        add_unblocked();
    }
}

fn follow_to_vpls(first: u32, end: u32, shift: f32, first_record: u32, is_receiver: bool) {
    for (var i = 0u; i < RAYS; i++) {
        let draw = draw_of(first, i);
        let x = (f32(draw) + shift) / f32(parameters.draws);
        var index = u32(textureLoad(vpl_guide, list_place(min(u32(x * f32(GUIDE_CELLS)), GUIDE_CELLS - 1u))).x);
        var range = textureLoad(vpl_ranges, list_place(index));
        while (index + 1u < parameters.range_count && x >= range.z + range.w) {
            index++;
            range = textureLoad(vpl_ranges, list_place(index));
        }
        let step = min(max((x - range.z) / range.w * range.y, 0.0), range.y - 1.0);
        let place = vpl_place(u32(range.x) + u32(step));
        let share = f32(parameters.draws) * range.w / range.y;
        let position_area = textureLoad(vpls, place, 0, 0);
        let normal_shininess = textureLoad(vpls, place, 1, 0);
        let offset = position_area.xyz - receiver_position;
        let distance_squared = dot(offset, offset);
        let direction = offset * inverseSqrt(max(distance_squared, 1e-18));
        var radiance = textureLoad(vpls, place, 2, 0).rgb;
#if PHONG
        let lobe = phong_lobe(textureLoad(vpls, place, 4, 0).xyz, -direction, normal_shininess.w);
        radiance += textureLoad(vpls, place, 3, 0).rgb * lobe;
#endif
        let found = bring(direction, distance_squared, radiance, -dot(normal_shininess.xyz, direction), position_area.w, share);
        put_brought(i, found);
        let is_wanted = draw < end && parameters.range_count > 0u && any(found.irradiance > vec3<f32>(0.0));
        put_ray(i, position_area.xyz - receiver_start, select(NOT_WANTED, 1.0, is_wanted));
    }
    trace(receiver_start, true);
    add_unblocked();
    if (parameters.is_pilot == 1u) {
#repeat SLOT 8
        if (is_receiver && draw_of(first, SLOTu) < end) {
            let sum_SLOT = dot(brought[SLOT], vec3<f32>(1.0));
            brought_by_vpls[first_record + draw_of(first, SLOTu)] = select(sum_SLOT, 0.0, ray_nearness[SLOT] > 1.0);
        }
#endrepeat
    }
}

fn lattice_point(draw: u32) -> vec2<f32> {
    return textureLoad(lattice, list_place(min(draw, parameters.draws - 1u))).xy;
}

// The draw of a lane's ray: neighbours go together.
fn draw_of(first: u32, ray: u32) -> u32 {
    return first + own_lane * RAYS + ray;
}

@compute @workgroup_size(64)
fn compute_main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(subgroup_id) subgroup: u32,
    @builtin(num_subgroups) subgroups: u32,
    @builtin(subgroup_invocation_id) subgroup_lane: u32,
    @builtin(subgroup_size) lanes: u32,
) {
    own_lane = subgroup_lane;
#if PACKET
    lane = subgroup_lane;
#endif
    // No lane leaves early: they go through the tree of boxes together.
    let slot = group.x * subgroups + subgroup;
    let is_receiver = slot < parameters.receiver_count;
    let packed = receivers[parameters.first_receiver + min(slot, parameters.receiver_count - 1u)];
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    receiver_position = textureLoad(position_mesh, pixel, 0).xyz;
    let normal = textureLoad(normal_geometric, pixel, 0);
    receiver_normal = normal.xyz;
    receiver_geometric = unpack_direction(normal.w);
    // Where P lies in a second surface, too, as in the corner of two walls, it is meant on the side that the camera sees: nothing is
    // between them.
    let to_camera = normalize(parameters.camera_position - receiver_position);
    receiver_start = before_surface(receiver_position, receiver_geometric, ORIGIN_SHIFT) + ORIGIN_SHIFT * to_camera;
#if GLOSSY
    receiver_mirror = 2.0 * dot(normal.xyz, to_camera) * normal.xyz - to_camera;
    receiver_shininess = textureLoad(ks_shininess, pixel, 0).w;
#endif

    let seed0 = hash(packed ^ hash(parameters.seed));
    let seed1 = hash(seed0);
    // The host must know which VPLs the pilot drew.
    let pilot_shift = fract(f32(parameters.first_result + slot) * 0.618034);
    let shift_of_vpls = select(unit(hash(seed1)), pilot_shift, parameters.is_pilot == 1u);
    let first_record = (parameters.first_result + min(slot, parameters.receiver_count - 1u)) * parameters.draws;
    let shift = vec2<f32>(unit(seed0), unit(seed1));
    let end = parameters.first_draw + parameters.draw_count;
    let around_normal = frame_around(receiver_normal);
#if GLOSSY
    let around_mirror = frame_around(receiver_mirror);
#endif
    for (var first = parameters.first_draw; first < end; first += lanes * RAYS) {
        for (var i = 0u; i < RAYS; i++) {
            let draw = draw_of(first, i);
            let disc = to_disc(fract(lattice_point(draw) + shift));
            let direction = disc.x * around_normal.right + disc.y * around_normal.up
                + sqrt(max(1.0 - dot(disc, disc), 0.0)) * receiver_normal;
            let is_wanted = draw < end && dot(receiver_geometric, direction) > 0.0;
            put_ray(i, direction, select(NOT_WANTED, 0.0, is_wanted));
        }
        follow_directions();
#if GLOSSY
        for (var i = 0u; i < RAYS; i++) {
            let draw = draw_of(first, i);
            let disc = to_disc(fract(lattice_point(draw) + shift.yx));
            // 1 − |disc|² is uniform in 0 to 1: cosθ = (1 − |disc|²)^(1/(s+1)).
            let inner = dot(disc, disc);
            let cosine = exp2(log2(max(1.0 - inner, 1e-30)) / (receiver_shininess + 1.0));
            let scale = sqrt(max(1.0 - cosine * cosine, 0.0)) * inverseSqrt(max(inner, 1e-30));
            let direction = normalize(scale * disc.x * around_mirror.right + scale * disc.y * around_mirror.up + cosine * receiver_mirror);
            let is_wanted = draw < end && dot(receiver_geometric, direction) > 0.0 && dot(receiver_normal, direction) > 0.0;
            put_ray(i, direction, select(NOT_WANTED, 0.0, is_wanted));
        }
        follow_directions();
#endif
        follow_to_vpls(first, end, shift_of_vpls, first_record, is_receiver);
    }

    let diffuse_sum = subgroupAdd(vec4<f32>(diffuse, diffuse_spread));
#if GLOSSY
    let specular_sum = subgroupAdd(vec4<f32>(specular, specular_spread));
#endif
    if (is_receiver && own_lane == 0u) {
        let place = 2u * (parameters.first_result + slot);
        let is_first = parameters.first_draw == 0u;
        results[place] = select(results[place], vec4<f32>(0.0), is_first) + diffuse_sum;
#if PHONG
        var specular_sum_or_none = vec4<f32>(0.0);
#if GLOSSY
        specular_sum_or_none = specular_sum;
#endif
        results[place + 1u] = select(results[place + 1u], vec4<f32>(0.0), is_first) + specular_sum_or_none;
#endif
    }
}
