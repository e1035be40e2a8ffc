// Gathers the single bounce L–Q–P at a list of receivers P, by rays. Two techniques sample Q: from P, along directions from the lobes of
// f_P; and from L, as one of the VPLs. Each Q contributes F(Q) / Σ n_i·p_i(Q). F is the integrand over the solid angle at P; n_i and p_i
// are the number of samples and the density of each technique (the balance heuristic, Veach & Guibas 1995). So neither the 1/d² of a near
// VPL nor a small bright spot that few directions find makes noise, and nothing is clamped.
//
// A receiver takes 64 samples at a time: by a subgroup of eight lanes as a packet, or by 32 lanes of a workgroup with two rays each. The
// directions are a lattice sequence, which is evenly distributed for any number of directions. Each receiver shifts it by its own numbers,
// so it can continue later where it stopped.
//
// VPLs are weighted before rays are sent to them (resampling, Talbot et al. 2005). Each ray has some candidates, which are neighbours in
// the list; the list is in Morton order. One candidate is drawn in proportion to its contribution if nothing hides it, and stands for all
// of them.

#import brdf
#import lights
#import hits
#import vpl_list
#import random
#import refinement
#if PHASORS
#import phasor
#endif

struct FinalGatherParameters {
    // C
    camera_position: vec3<f32>,
    // First index in the list of receivers.
    first_receiver: u32,
    receiver_count: u32,
    // Index of the first result.
    first_result: u32,
    // 1: adds the results to the stored ones.
    adds: u32,
    // Packets of each receiver: how many to skip, and how many to take now.
    skipped_packets: u32,
    packet_count: u32,
    // The lights whose light the directions collect in this dispatch. Rays go to VPLs together with the first light of the list.
    first_light: u32,
    light_count: u32,
    // VPLs per set, and number of sets. Receivers take the sets in rotation.
    set_size: u32,
    set_count: u32,
    // 1: stores what each ray to a VPL finds.
    is_pilot: u32,
    // Each seed gives other samples.
    seed: u32,
}

// Result of a pilot's ray to a VPL.
struct PilotSample {
    // Index of the VPL in its set.
    vpl: u32,
    // Contribution of the candidate if nothing hides it, all bands together; and what the ray found, for all candidates that this one
    // stands for.
    candidate: f32,
    found: f32,
}

// Per ray to a VPL.
const CANDIDATES: u32 = 8u;
// Per receiver, which takes 64 samples at a time.
const LANES: u32 = 64u / RAYS;
const WORKGROUP: u32 = 64u;
const RECEIVERS: u32 = WORKGROUP / LANES;

var position_mesh: texture_2d<f32>;
var normal_geometric: texture_2d<f32>;
#if GLOSSY
var ks_shininess: texture_2d<f32>;
#endif
var<storage, read> receivers: array<u32>;
// Packets of samples that each receiver takes, of each technique: first + 65536 · end, where end is one after the last.
var<storage, read> sample_ranges: array<u32>;
// The density of VPLs in the lights' maps. A list in an image, like ray_triangles in trace.wgsl. First a texel for each tile of every
// light: index of its first cell, and number of cells along its edge. The third component of a cell: samples per area of the map's tiles,
// normalised to one sample.
var vpl_densities: texture_storage_2d<rgba32float, read>;
// Results of the rays to VPLs; written only if the parameters say so.
var<storage, read_write> pilot_samples: array<PilotSample>;
// Lattice sequence on the unit square. Each packet is in Morton order. A sampled image, because some devices allow only eight storage
// images per kernel.
var lattice: texture_2d<f32>;
// Sums over a receiver's samples, in the refinement's layout: light reflected by its diffuse and by its specular lobe, as if k_d and k_s
// were 1; and for each the squared differences.
var<storage, read_write> results: array<vec4<f32>>;
var<immediate> parameters: FinalGatherParameters;

// P
var<private> receiver_position: vec3<f32>;
var<private> receiver_start: vec3<f32>;
var<private> receiver_normal: vec3<f32>;
var<private> receiver_geometric: vec3<f32>;
var<private> receiver_lobe: Lobe;
// Index among the receiver's lanes.
var<private> own_lane: u32;
var<private> diffuse: vec3<f32>;
var<private> specular: vec3<f32>;
// For each of these: Σ of the squared differences between pairs of neighbouring samples, all bands together.
var<private> diffuse_squared_differences: f32;
var<private> specular_squared_differences: f32;
#if PHASORS
var<private> diffuse_phasors: BandPhasors;
var<private> specular_phasors: BandPhasors;
// Of each frequency.
var<private> diffuse_phasor_squares: vec4<f32>;
var<private> specular_phasor_squares: vec4<f32>;
#endif

// Contribution of a Q.
struct Contribution {
    irradiance: vec3<f32>,
    // Shape of the specular lobe of P.
    lobe: Shape,
#if PHASORS
    // 1 if the light is modulated; and the phase of the path to P.
    is_modulated: f32,
    turns: vec4<f32>,
#endif
}

// Contribution of a Q that sends `radiance` to P, for one sample of each technique. `direction` leads from P to Q and has unit length.
// `vpl_density` is the density of VPLs at Q, per area.
fn mis_contribution(direction: vec3<f32>, distance_squared: f32, radiance: vec3<f32>, cosine_q: f32, vpl_density: f32) -> Contribution {
    let cosine = dot(receiver_normal, direction);
    let is_above = cosine > 0.0 && dot(receiver_geometric, direction) > 0.0 && cosine_q > 0.0;
    var lobe = Shape();
    // Samples per solid angle at P: from P, and from L.
    var density = diffuse_density(1.0, cosine);
#if GLOSSY
    lobe = eval_lobe(receiver_lobe, direction);
    density += lobe_density(1.0, receiver_lobe, direction, lobe);
#endif
    density += f32(CANDIDATES) * vpl_density * distance_squared / max(cosine_q, 1e-6);
    var contribution: Contribution;
    contribution.irradiance = select(vec3<f32>(0.0), radiance * (cosine / density), is_above);
    contribution.lobe = lobe;
    return contribution;
}

// Density of a light's VPLs, as in Vpl, at a point that the light reaches, on a surface that faces the light.
fn facing_vpl_density(light: Light, position: vec3<f32>) -> f32 {
    let from_light = position - light.position;
    let shown = map_place(light, from_light);
    let tiles = light.emission_size;
    let place = max(shown.place, vec2<f32>(0.0)) * f32(tiles);
    let column_row = min(vec2<u32>(place), vec2<u32>(tiles - 1u));
    let tile = textureLoad(vpl_densities, list_place(light.first_tile + shown.face * tiles * tiles + morton_code(column_row)));
    let cell = min(vec2<u32>((place - vec2<f32>(column_row)) * tile.y), vec2<u32>(u32(tile.y) - 1u));
    return textureLoad(vpl_densities, list_place(u32(tile.x) + morton_code(cell))).z / facing_cell_area(light, from_light, shown.depth);
}

fn morton_code(column_row: vec2<u32>) -> u32 {
    return spread_bits(column_row.x) + 2u * spread_bits(column_row.y);
}

// Select the point of an area light that rays from P lead to: a number for each packet, a seed, and a shift. The shift spreads neighbouring
// pixels, which are averaged, evenly over the area (a two-dimensional Kronecker sequence over two indices).
var<private> area_number: u32;
var<private> area_seed: u32;
var<private> area_shift: vec2<f32>;

// Contribution of each ray if nothing blocks it.
var<private> contributions: array<Contribution, RAYS>;
// Directions of the rays from P, and what they hit.
var<private> met_direction: array<vec3<f32>, RAYS>;
var<private> met_hit: array<u32, RAYS>;

fn set_contribution(ray: u32, contribution: Contribution) {
#repeat SLOT RAYS
    contributions[SLOT].irradiance = select(contributions[SLOT].irradiance, contribution.irradiance, ray == SLOTu);
    contributions[SLOT].lobe = select(contributions[SLOT].lobe, contribution.lobe, ray == SLOTu);
#if PHASORS
    contributions[SLOT].is_modulated = select(contributions[SLOT].is_modulated, contribution.is_modulated, ray == SLOTu);
    contributions[SLOT].turns = select(contributions[SLOT].turns, contribution.turns, ray == SLOTu);
#endif
#endrepeat
}

// Adds the contributions of the rays that nothing blocks.
fn add_unblocked() {
    var arrived: array<vec3<f32>, RAYS>;
#repeat SLOT RAYS
    arrived[SLOT] = select(contributions[SLOT].irradiance, vec3<f32>(0.0), ray_inverse_t[SLOT] > 1.0);
    diffuse += arrived[SLOT];
#endrepeat
#repeat PAIR RAY_PAIRS
    diffuse_squared_differences += square(arrived[2 * PAIR] - arrived[2 * PAIR + 1]);
#endrepeat
#if GLOSSY
    var in_lobe: array<vec3<f32>, RAYS>;
#repeat SLOT RAYS
    in_lobe[SLOT] = arrived[SLOT] * contributions[SLOT].lobe;
    specular += in_lobe[SLOT];
#endrepeat
#repeat PAIR RAY_PAIRS
    specular_squared_differences += square(in_lobe[2 * PAIR] - in_lobe[2 * PAIR + 1]);
#endrepeat
#endif
#if PHASORS
    var phasors: array<BandPhasors, RAYS>;
#repeat SLOT RAYS
    let path_SLOT = phasors_of(contributions[SLOT].turns);
    phasors[SLOT] = band_phasors(contributions[SLOT].is_modulated * arrived[SLOT], path_SLOT);
    diffuse_phasors = add_phasors(diffuse_phasors, phasors[SLOT]);
#endrepeat
#repeat PAIR RAY_PAIRS
    diffuse_phasor_squares += squared_difference(phasors[2 * PAIR], phasors[2 * PAIR + 1]);
#endrepeat
#if GLOSSY
    var lobe_phasors: array<BandPhasors, RAYS>;
#repeat SLOT RAYS
    lobe_phasors[SLOT] = band_phasors(contributions[SLOT].is_modulated * in_lobe[SLOT], path_SLOT);
    specular_phasors = add_phasors(specular_phasors, lobe_phasors[SLOT]);
#endrepeat
#repeat PAIR RAY_PAIRS
    specular_phasor_squares += squared_difference(lobe_phasors[2 * PAIR], lobe_phasors[2 * PAIR + 1]);
#endrepeat
#endif
#endif
}

// The result does not depend on the order of the bands, because what is learned from it must not.
fn band_sum(v: vec3<f32>) -> f32 {
    let low = min(v.x, v.y);
    let high = max(v.x, v.y);
    return min(low, v.z) + max(low, min(high, v.z)) + max(high, v.z);
}

fn square(v: vec3<f32>) -> f32 {
    return dot(v, v);
}

// Follows the directions in ray_vector from P and adds what they find.
fn follow_directions() {
    trace(receiver_start, false);
#repeat SLOT RAYS
    met_direction[SLOT] = ray_vector[SLOT];
    met_hit[SLOT] = select(ray_hit[SLOT], NOTHING_HIT, ray_inverse_t[SLOT] >= NOT_WANTED);
#endrepeat
    for (var index = parameters.first_light; index < parameters.first_light + parameters.light_count; index++) {
        // Once for all rays of a packet: loading a light takes as long as tracing some rays.
        var light = load_light(index);
        light.position += area_offset(light, fract(area_place(area_number, area_seed ^ index) + area_shift));
#if PHASORS
        light.origin_turns = area_origin_turns(light);
#endif
        for (var i = 0u; i < RAYS; i++) {
            var direction = met_direction[0];
            var met = met_hit[0];
#repeat SLOT RAYS
            direction = select(direction, met_direction[SLOT], i == SLOTu);
            met = select(met, met_hit[SLOT], i == SLOTu);
#endrepeat
            let is_hit = met != NOTHING_HIT;
            let hit = hit_surface(select(0u, met, is_hit), receiver_start, direction);
            let illumination = illuminate_without_pattern(light, hit.position);
            let cosine_light = dot(hit.shading_normal, illumination.to_light);
            let geometric_cosine_light = dot(hit.geometric_normal, illumination.to_light);
            let reflected = eval_brdf(hit.brdf, hit.shading_normal, illumination.to_light, -direction);
            let offset = hit.position - receiver_position;
            var found = mis_contribution(direction, dot(offset, offset), reflected * illumination.irradiance * cosine_light,
                -dot(hit.geometric_normal, direction), facing_vpl_density(light, hit.position) * geometric_cosine_light);
            let is_lit = is_hit && cosine_light > 0.0 && geometric_cosine_light > 0.0 && any(found.irradiance > vec3<f32>(0.0));
#if PHASORS
            found.is_modulated = f32(light.is_modulated);
            found.turns = turns_from_light(light, hit.position) + modulation.turns_per_unit * length(offset);
#endif
            set_contribution(i, found);
            // The end is on the side that P sees, even if Q is also in a second surface.
            let end = before_surface(hit.position, hit.geometric_normal, END_SHIFT) - END_SHIFT * direction;
            set_ray(i, end, select(NOT_WANTED, 1.0, is_lit));
        }
        // A separate loop, so that other lights do not pay for it: drivers that compute both sides of a branch would take a branch above
        // for every ray.
        for (var i = 0u; i < select(0u, RAYS, light.pattern_columns > 0u); i++) {
            var direction = met_direction[0];
            var met = met_hit[0];
#repeat SLOT RAYS
            direction = select(direction, met_direction[SLOT], i == SLOTu);
            met = select(met, met_hit[SLOT], i == SLOTu);
#endrepeat
            let hit = hit_surface(select(0u, met, met != NOTHING_HIT), receiver_start, direction);
            let share = pattern_intensity(light, -illuminate_evenly(light, hit.position).to_light);
#repeat SLOT RAYS
            contributions[SLOT].irradiance *= select(1.0, share, i == SLOTu);
#endrepeat
        }
        trace_to_light(light_end(light));
        add_unblocked();
    }
}

// A VPL as P sees it.
struct Candidate {
    // If nothing hides it.
    contribution: Contribution,
    position: vec3<f32>,
    // Light that the lobes of P reflect of it, as if k_d and k_s were 1, all bands together.
    weight: f32,
}

fn load_candidate(vpl_index: u32) -> Candidate {
    let vpl = load_vpl(vpl_index);
    let offset = vpl.position - receiver_position;
    let distance_squared = dot(offset, offset);
    let direction = offset * inverseSqrt(max(distance_squared, 1e-18));
    var radiance = vpl.diffuse;
#if PHONG
    let vpl_lobe = load_vpl_lobe(vpl_index);
    radiance += vpl_lobe.specular * eval_lobe(vpl_lobe.lobe, -direction);
#endif
    var contribution = mis_contribution(direction, distance_squared, radiance, -dot(vpl.normal, direction), vpl.density);
#if PHASORS
    contribution.is_modulated = vpl.is_modulated;
    contribution.turns = vpl.turns + modulation.turns_per_unit * sqrt(distance_squared);
#endif
    var weight = diffuse_factor(vec3<f32>(1.0)).x;
#if GLOSSY
    weight += specular_factor(vec3<f32>(1.0), receiver_lobe.shininess).x * contribution.lobe;
#endif
    return Candidate(contribution, vpl.position, weight * band_sum(contribution.irradiance));
}

// How a receiver's rays to VPLs are drawn.
struct RaysToVpls {
    count: u32,
    first_vpl: u32,
    seed: u32,
}

// Draws a VPL for each ray of the lane, from the receiver's ray `first_ray` on. Then follows the rays and adds what they find.
fn follow_to_vpls(rays: RaysToVpls, first_ray: u32, first_record: u32) {
    var drawn: array<u32, RAYS>;
    for (var i = 0u; i < RAYS; i++) {
        let first_candidate = CANDIDATES * (first_ray + i);
        let vpls_per_candidate = f32(parameters.set_size) / f32(CANDIDATES * max(rays.count, 1u));
        var random = hash(rays.seed ^ (first_ray + i));
        var drawn_vpl = 0u;
        var drawn_weight = 0.0;
        var weight_sum = 0.0;
        var before: Contribution;
        let candidates = select(0u, CANDIDATES, first_ray + i < rays.count);
        for (var j = 0u; j < candidates; j++) {
            random = hash(random);
            // A random place within each step: even steps along a Morton curve are a grid, which may miss narrow features.
            let along = u32((f32(first_candidate + j) + f32(random & 255u) / 256.0) * vpls_per_candidate);
            let vpl_index = rays.first_vpl + min(along, parameters.set_size - 1u);
            let to = load_candidate(vpl_index);
            // The scatter of candidates is noise like that of rays, even if the candidates are hidden. Where few candidates matter, it is
            // most of the noise.
            let is_second = f32(j & 1u);
            let difference = to.contribution.irradiance - before.irradiance;
            diffuse_squared_differences += is_second * square(difference);
#if GLOSSY
            let lobe_difference = to.contribution.irradiance * to.contribution.lobe - before.irradiance * before.lobe;
            specular_squared_differences += is_second * square(lobe_difference);
#endif
#if PHASORS
            // Neighbours have almost the same phase, so only their light is compared.
            let modulated = to.contribution.is_modulated * to.contribution.irradiance;
            let modulated_before = before.is_modulated * before.irradiance;
            diffuse_phasor_squares += (is_second * square(modulation.is_seen * (modulated - modulated_before))) * modulation.is_used;
#if GLOSSY
            let modulated_in_lobe = modulated * to.contribution.lobe - modulated_before * before.lobe;
            specular_phasor_squares += (is_second * square(modulation.is_seen * modulated_in_lobe)) * modulation.is_used;
#endif
#endif
            before = to.contribution;
            weight_sum += to.weight;
            let is_drawn = unit(random) * weight_sum <= to.weight;
            drawn_vpl = select(drawn_vpl, vpl_index, is_drawn);
            drawn_weight = select(drawn_weight, to.weight, is_drawn);
        }
        let to = load_candidate(drawn_vpl);
        var contribution = to.contribution;
        contribution.irradiance *= weight_sum / max(drawn_weight, 1e-37);
        set_contribution(i, contribution);
        set_ray(i, to.position - receiver_start, select(NOT_WANTED, 1.0, weight_sum > 0.0));
#repeat SLOT RAYS
        drawn[SLOT] = select(drawn[SLOT], drawn_vpl, i == SLOTu);
#endrepeat
    }
    trace(receiver_start, true);
    add_unblocked();
    if (parameters.is_pilot == 1u) {
        let count = min(max(rays.count, first_ray) - first_ray, RAYS);
#repeat SLOT RAYS
        if (SLOTu < count) {
            let candidate = band_sum(load_candidate(drawn[SLOT]).contribution.irradiance);
            let found = select(band_sum(contributions[SLOT].irradiance), 0.0, ray_inverse_t[SLOT] > 1.0);
            pilot_samples[first_record + first_ray + SLOTu] = PilotSample(drawn[SLOT] - rays.first_vpl, candidate, found);
        }
#endrepeat
    }
}

fn sample_point(sample: u32) -> vec2<f32> {
    return textureLoad(lattice, list_place(sample), 0).xy;
}

// The sample of a lane's ray. A lane takes neighbouring samples.
fn sample_of(first: u32, ray: u32) -> u32 {
    return first + own_lane * RAYS + ray;
}

#if PACKET
fn sum_over_lanes(own: vec4<f32>, in_group: u32) -> vec4<f32> {
    return subgroupAdd(own);
}
#else
var<workgroup> of_lanes: array<vec4<f32>, WORKGROUP>;

fn sum_over_lanes(own: vec4<f32>, in_group: u32) -> vec4<f32> {
    workgroupBarrier();
    of_lanes[LANES * in_group + own_lane] = own;
    workgroupBarrier();
    var sum = vec4<f32>(0.0);
    for (var i = 0u; i < LANES; i++) {
        sum += of_lanes[LANES * in_group + i];
    }
    return sum;
}
#endif

// A sum and its squared differences, times a factor of the BRDF.
fn reflected(sum: vec4<f32>, factor: vec3<f32>) -> vec4<f32> {
    return sum * vec4<f32>(factor, factor.x * factor.x);
}

#if PHASORS
// Sums what the lanes found of one lobe; the first lane stores it. `factor` is the lobe's factor of the BRDF.
fn keep_phasors(phasors: BandPhasors, squares: vec4<f32>, lobe: u32, factor: f32, in_group: u32, receiver: u32, is_kept: bool) {
    let place = RESULT_VECTORS * receiver;
    let adds = parameters.adds == 1u;
    let squares_sum = factor * factor * sum_over_lanes(squares, in_group);
    if (is_kept) {
        let result = place + PHASOR_SQUARES + lobe;
        results[result] = select(vec4<f32>(0.0), results[result], adds) + squares_sum;
    }
#repeat BAND 3
    let first_BAND = factor * sum_over_lanes(vec4<f32>(phasors.re[BAND].xy, phasors.im[BAND].xy).xzyw, in_group);
    let second_BAND = factor * sum_over_lanes(vec4<f32>(phasors.re[BAND].zw, phasors.im[BAND].zw).xzyw, in_group);
    if (is_kept) {
        let result = place + phasor_result(0u, BANDu, lobe);
        results[result] = select(vec4<f32>(0.0), results[result], adds) + first_BAND;
        let next = place + phasor_result(1u, BANDu, lobe);
        results[next] = select(vec4<f32>(0.0), results[next], adds) + second_BAND;
    }
#endrepeat
}
#endif

@compute @workgroup_size(64)
fn compute_main(
    @builtin(workgroup_id) group: vec3<u32>,
#if PACKET
    @builtin(subgroup_id) subgroup: u32,
    @builtin(subgroup_invocation_id) subgroup_lane: u32,
#else
    @builtin(local_invocation_index) local: u32,
#endif
) {
#if PACKET
    let in_group = subgroup;
    own_lane = subgroup_lane;
    lane = subgroup_lane;
#else
    let in_group = local / LANES;
    own_lane = local % LANES;
#endif
    // No lane returns early: the lanes intersect the triangles together, and add up together.
    let slot = group.x * RECEIVERS + in_group;
    let is_receiver = slot < parameters.receiver_count;
    let packed = receivers[parameters.first_receiver + min(slot, parameters.receiver_count - 1u)];
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    receiver_position = textureLoad(position_mesh, pixel, 0).xyz;
    let normal = textureLoad(normal_geometric, pixel, 0);
    receiver_normal = normal.xyz;
    receiver_geometric = unpack_direction(normal.w);
    // If P is also in a second surface, as in the corner of two walls, the ray starts on the side that the camera sees: nothing is between
    // P and the camera.
    let to_camera = normalize(parameters.camera_position - receiver_position);
    receiver_start = before_surface(receiver_position, receiver_geometric, ORIGIN_SHIFT) + ORIGIN_SHIFT * to_camera;
#if GLOSSY
    receiver_lobe = lobe_of(to_camera, receiver_normal, textureLoad(ks_shininess, pixel, 0));
#endif

    let set_index = (parameters.first_receiver + slot) % parameters.set_count;
    let seed0 = hash(packed ^ hash(parameters.seed + set_index));
    let seed1 = hash(seed0);
    let shift = vec2<f32>(unit(seed0), unit(seed1));
    let first_record = u32(PACKET_SAMPLES) * (parameters.first_result + min(slot, parameters.receiver_count - 1u));
    let range = sample_ranges[parameters.first_receiver + min(slot, parameters.receiver_count - 1u)];
    let begin = u32(PACKET_SAMPLES) * min((range & 0xffffu) + parameters.skipped_packets, range >> 16u);
    let end = min(begin + u32(PACKET_SAMPLES) * parameters.packet_count, u32(PACKET_SAMPLES) * (range >> 16u));
    let takes_vpls = is_receiver && parameters.first_light == 0u && parameters.set_size > 0u;
    let vpl_rays = select(0u, end - begin, takes_vpls);
    let to_vpls = RaysToVpls(vpl_rays, set_index * parameters.set_size, hash(seed1 ^ hash(begin)));
    let around_normal = frame_around(receiver_normal);
#if GLOSSY
    let around_lobe = lobe_frame(receiver_lobe);
#endif
    area_seed = hash(parameters.seed ^ 0x85ebca6bu);
    area_shift = fract(vec2<f32>(pixel) * mat2x2<f32>(0.8566749, 0.7338919, 0.6287067, 0.5385972));
    for (var first = begin; first < end; first += LANES * RAYS) {
        area_number = first / (LANES * RAYS);
        for (var i = 0u; i < RAYS; i++) {
            let sample = sample_of(first, i);
            let direction = sample_diffuse(fract(sample_point(sample) + shift), around_normal);
            let is_wanted = sample < end && dot(receiver_geometric, direction) > 0.0;
            set_ray(i, direction, select(NOT_WANTED, 0.0, is_wanted));
        }
        follow_directions();
#if GLOSSY
        for (var i = 0u; i < RAYS; i++) {
            let sample = sample_of(first, i);
            let direction = sample_lobe(fract(sample_point(sample) + shift.yx), receiver_lobe, around_lobe);
            let is_wanted = sample < end && dot(receiver_geometric, direction) > 0.0 && dot(receiver_normal, direction) > 0.0;
            set_ray(i, direction, select(NOT_WANTED, 0.0, is_wanted));
        }
        follow_directions();
#endif
    }
    for (var first = 0u; first < vpl_rays; first += LANES * RAYS) {
        follow_to_vpls(to_vpls, sample_of(first, 0u), first_record);
    }

    let diffuse_sum = sum_over_lanes(vec4<f32>(diffuse, diffuse_squared_differences), in_group);
#if GLOSSY
    let specular_sum = sum_over_lanes(vec4<f32>(specular, specular_squared_differences), in_group);
#endif
#if PHASORS
    let receiver = parameters.first_result + slot;
    keep_phasors(diffuse_phasors, diffuse_phasor_squares, 0u, diffuse_factor(vec3<f32>(1.0)).x, in_group, receiver, is_receiver && own_lane == 0u);
#if GLOSSY
    let glossy_factor = specular_factor(vec3<f32>(1.0), receiver_lobe.shininess).x;
    keep_phasors(specular_phasors, specular_phasor_squares, 1u, glossy_factor, in_group, receiver, is_receiver && own_lane == 0u);
#else
#if PHONG
    keep_phasors(specular_phasors, specular_phasor_squares, 1u, 0.0, in_group, receiver, is_receiver && own_lane == 0u);
#endif
#endif
#endif
    if (is_receiver && own_lane == 0u) {
        let place = RESULT_VECTORS * (parameters.first_result + slot);
        let adds = parameters.adds == 1u;
        results[place] = select(vec4<f32>(0.0), results[place], adds) + reflected(diffuse_sum, diffuse_factor(vec3<f32>(1.0)));
#if PHONG
        var specular_result = vec4<f32>(0.0);
#if GLOSSY
        specular_result = reflected(specular_sum, specular_factor(vec3<f32>(1.0), receiver_lobe.shininess));
#endif
        results[place + 1u] = select(vec4<f32>(0.0), results[place + 1u], adds) + specular_result;
#endif
    }
}
