// Extends paths from P by one more bounce. The surfaces that their last rays meet are taken in groups of neighbours. Of each group one is
// drawn, in proportion to what it hands on, and stands for all (resampling, Talbot et al. 2005). There the path goes on like P gathers: along
// a direction from the lobes of the BRDF, and to one of some VPLs, both weighted by the balance heuristic.
//
// Light of the first bounce's VPLs is weighted by their true density, that of further bounces by the density that VPLs are given for it
// (light_paths.wgsl). A path that goes on leaves the other part of that weight to VPLs. That density is known once a path has chosen from
// where light comes to the surface after: it is in proportion to the directivity of that surface.

#import final_gather_mis
#import hits
#import vpl_list
#import texel_list

// As in final_gather_emit.wgsl.
var lattice: texture_2d<f32>;
var<storage, read_write> rays: array<Ray>;
var<storage, read> hits: array<u32>;
var<storage, read_write> paths: array<Path>;

// The end of a path.
struct Vertex {
    hit: Hit,
    // A unit vector.
    to_previous: vec3<f32>,
    // From the radiance that the surface sends along the path to the irradiance of P, as in Contribution, but for the shares that the path
    // leaves to VPLs here and at the surface before.
    weight: vec3<f32>,
    // Density of VPLs at both, over that of directions there, for a directivity of 1.
    vpl_ratio: f32,
    vpl_ratio_before: f32,
    // As in Contribution.
    lobe: Shape,
    // Of the path.
    length: f32,
    // What P would reflect if even light arrived, as if its k_d and k_s were 1, all bands together.
    importance: f32,
}

fn albedo(brdf: Brdf) -> vec3<f32> {
    var sum = brdf.kd;
    if (SPECULAR) {
        sum += reflected_share(brdf.lobe);
    }
    return sum;
}

fn vertex_of(packet: u32, lobe: u32, number: u32, receiver: Receiver) -> Vertex {
    let in_bounce = parameters.extended_count * (direction_count() * packet + lobe) + number;
    let index = parameters.first_extended + in_bounce;
    let ray = rays[index];
    let met = hits[index];
    let is_hit = met != NOTHING_HIT;
    var vertex: Vertex;
    vertex.hit = ray_hit(select(0u, met, is_hit), ray.origin, ray.direction);
    vertex.to_previous = -ray.direction;
    if (DEEP) {
        let path = paths[index - SAMPLES * direction_count() * parameters.packet_count];
        let offset = vertex.hit.position - ray.origin;
        let cosine_q = dot(vertex.hit.geometric_normal, vertex.to_previous);
        let of_vpls = candidate_density(parameters.extended_vpls, parameters.reflected_density, dot(offset, offset), cosine_q);
        vertex.weight = path.weight / max(path.density, 1e-30);
        vertex.vpl_ratio = of_vpls / max(path.density, 1e-30);
        vertex.vpl_ratio_before = path.vpl_ratio;
        vertex.lobe = path.lobe;
        vertex.length = path.length + length(offset);
    } else {
        let offset = vertex.hit.position - receiver.position;
        let cosine_q = dot(vertex.hit.geometric_normal, vertex.to_previous);
        let alone = mis_contribution(receiver, ray.direction, dot(offset, offset), vec3<f32>(1.0), cosine_q, 0.0, parameters.extended_vpls);
        let of_vpls = candidate_density(parameters.extended_vpls, parameters.reflected_density, dot(offset, offset), cosine_q);
        vertex.weight = alone.irradiance;
        // The irradiance is the cosine over the density of directions.
        vertex.vpl_ratio = of_vpls * alone.irradiance.x / max(dot(receiver.normal, ray.direction), 1e-30);
        vertex.lobe = alone.lobe;
        vertex.length = length(offset);
    }
    var seen = 1.0;
    if (GLOSSY) {
        seen = diffuse_factor(vec3<f32>(1.0)).x + mean_shape(vertex.lobe);
    }
    let left = (1.0 + vertex.vpl_ratio) * (1.0 + vertex.vpl_ratio_before);
    vertex.importance = select(0.0, seen * band_sum(vertex.weight * albedo(vertex.hit.brdf)) / left, is_hit);
    return vertex;
}

// How a vertex reflects light to the surface before it.
struct Reflection {
    lobe: Lobe,
    // Share of directions that are drawn from the base.
    base_share: f32,
}

fn reflection_at(vertex: Vertex) -> Reflection {
    var reflection: Reflection;
    reflection.base_share = base_share(vertex.hit.brdf);
    if (SPECULAR) {
        reflection.lobe = lobe_of(vertex.to_previous, vertex.hit.shading_normal, vertex.hit.brdf.lobe);
    }
    return reflection;
}

// Irradiance of P per radiance from a direction, but for the share that the path leaves to VPLs at the vertex; and the density of such
// directions.
struct Scattered {
    weight: vec3<f32>,
    density: f32,
}

fn scattered(vertex: Vertex, reflection: Reflection, direction: vec3<f32>) -> Scattered {
    let hit = vertex.hit;
    let cosine = dot(hit.shading_normal, direction);
    var factor = diffuse_factor(hit.brdf.kd);
    var density = diffuse_density(reflection.base_share, cosine);
    var directed = 1.0;
    if (SPECULAR) {
        let shape = eval_lobe(reflection.lobe, direction);
        factor += specular_factor(hit.brdf.lobe) * shape;
        let share = 1.0 - reflection.base_share;
        density += select(0.0, lobe_density(share, reflection.lobe, direction, shape), share > 0.0);
        directed = directivity(reflection.base_share, reflection.lobe, shape);
    }
    factor /= 1.0 + vertex.vpl_ratio_before * directed;
    let is_above = cosine > 0.0 && dot(hit.geometric_normal, direction) > 0.0;
    return Scattered(select(vec3<f32>(0.0), vertex.weight * factor * cosine, is_above), density);
}

// What a VPL contributes by way of the vertex if nothing hides it.
struct Candidate {
    irradiance: vec3<f32>,
    position: vec3<f32>,
}

fn load_candidate(vertex: Vertex, reflection: Reflection, vpl_index: u32) -> Candidate {
    let vpl = load_vpl(vpl_index);
    let offset = vpl.position - vertex.hit.position;
    let distance_squared = dot(offset, offset);
    let direction = offset * inverseSqrt(max(distance_squared, 1e-18));
    let light = vpl_light(vpl, vpl_index, -direction);
    let cosine_q = -dot(vpl.normal, direction);
    let path = scattered(vertex, reflection, direction);
    let density = path.density + candidate_density(parameters.vpl_count, vpl.density, distance_squared, cosine_q);
    let share = 1.0 / ((1.0 + vertex.vpl_ratio * light.directivity) * max(density, 1e-30));
    let irradiance = select(vec3<f32>(0.0), path.weight * light.radiance * share, cosine_q > 0.0);
    return Candidate(irradiance, vpl.position);
}

// A permutation of the numbers below a power of two.
fn shuffled(number: u32, count: u32, seed: u32) -> u32 {
    let mask = count - 1u;
    var shuffled = (number ^ seed) & mask;
    shuffled = (shuffled * (seed >> 8u | 1u) + (seed >> 16u)) & mask;
    shuffled ^= shuffled >> 2u;
    return (shuffled * (seed >> 20u | 1u)) & mask;
}

@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let path = 64u * (group.x + 65535u * group.y) + local;
    let number = path % parameters.path_count;
    let of_lobe = path / parameters.path_count;
    let lobe = of_lobe % direction_count();
    let index = of_lobe / direction_count();
    if (index >= parameters.packet_count) {
        return;
    }
    let packet = packets[index];
    var receiver: Receiver;
    if (!DEEP) {
        receiver = receiver_of(packet);
    }
    // All paths of a packet and bounce share this seed.
    let seed = hash(hash(seed_of(packet)) ^ hash(parameters.first_path / max(parameters.packet_count, 1u)) ^ lobe);
    var random = hash(hash(seed ^ packet.number) ^ number);

    // The surface where the path goes on.
    let group_size = parameters.extended_count / parameters.path_count;
    var vertex: Vertex;
    var importance = 0.0;
    for (var i = 0u; i < group_size; i++) {
        let met = vertex_of(index, lobe, group_size * number + i, receiver);
        importance += met.importance;
        random = hash(random);
        if (unit(random) * importance < met.importance) {
            vertex = met;
        }
    }
    vertex.weight *= importance / max(vertex.importance, 1e-37);
    let goes_on = importance > 0.0;
    let hit = vertex.hit;
    let start = before_surface(hit.position, hit.geometric_normal, ORIGIN_SHIFT) + ORIGIN_SHIFT * vertex.to_previous;
    let reflection = reflection_at(vertex);

    // Along a direction.
    let shift = vec2<f32>(unit(hash(seed)), unit(hash(seed ^ 0x9e3779b9u)));
    let in_packet = SAMPLES / parameters.path_count * shuffled(number, parameters.path_count, hash(seed ^ packet.number ^ 0x85ebca6bu));
    let square = fract(textureLoad(lattice, list_place(SAMPLES * packet.number + in_packet), 0).xy + shift);
    var direction = sample_diffuse(square, frame_around(hit.shading_normal));
    if (SPECULAR) {
        random = hash(random);
        let in_lobe = sample_lobe(square, reflection.lobe, lobe_frame(reflection.lobe));
        direction = select(in_lobe, direction, unit(random) < reflection.base_share);
    }
    let along = scattered(vertex, reflection, direction);
    let is_wanted = goes_on && along.density > 0.0 && any(along.weight > vec3<f32>(0.0));
    // A path that has met nothing has no lobe to draw a direction from.
    direction = select(vec3<f32>(0.0, 0.0, 1.0), direction, is_wanted);
    rays[parameters.first_path + path] = Ray(start, select(NO_RAY, NO_END, is_wanted), direction, 0.0);
    paths[path_place(path)] = Path(select(vec3<f32>(0.0), along.weight, is_wanted), select(1.0, along.density, is_wanted), vertex.lobe, vertex.length, vertex.vpl_ratio);

    // To a VPL.
    let first_vpl = set_of(packet) * parameters.set_size + parameters.first_vpl;
    // All candidates of a path together cover the whole list, because each path has another vertex.
    let vpls_per_candidate = f32(parameters.vpl_count) / f32(CANDIDATES);
    let slot = shuffled(number, parameters.path_count, hash(seed ^ packet.number ^ 0xc2b2ae35u));
    let candidates = select(0u, CANDIDATES, parameters.vpl_samples > 0u);
    var drawn_vpl = first_vpl;
    var drawn_weight = 0.0;
    var weight_sum = 0.0;
    for (var j = 0u; j < candidates; j++) {
        random = hash(random);
        let within = (f32(slot) + f32(random & 1023u) / 1024.0) / f32(parameters.path_count);
        let place = u32((f32(j) + within) * vpls_per_candidate);
        let vpl_index = first_vpl + min(place, max(parameters.vpl_count, 1u) - 1u);
        let weight = band_sum(load_candidate(vertex, reflection, vpl_index).irradiance);
        weight_sum += weight;
        let is_drawn = unit(random) * weight_sum <= weight;
        drawn_vpl = select(drawn_vpl, vpl_index, is_drawn);
        drawn_weight = select(drawn_weight, weight, is_drawn);
    }
    let to = load_candidate(vertex, reflection, drawn_vpl);
    let ray = path_vpl_ray(path);
    let is_sent = goes_on && weight_sum > 0.0;
    rays[ray] = Ray(start, select(NO_RAY, 1.0, is_sent), to.position - start, 0.0);
    var contribution: Contribution;
    contribution.lobe = vertex.lobe;
    contribution.irradiance = select(vec3<f32>(0.0), to.irradiance * (weight_sum / max(drawn_weight, 1e-37)), is_sent);
    if (PHASORS) {
        let turns = vpl_turns(drawn_vpl) + modulation.turns_per_unit * (vertex.length + distance(to.position, hit.position));
        contribution.turns = select(vec4<f32>(-1.0), turns, load_vpl(drawn_vpl).is_modulated == 1.0);
    }
    store_contribution(contribution_place(ray), contribution);
}
