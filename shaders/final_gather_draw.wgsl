// Draws a VPL for each sample of a receiver, and emits the ray to it. VPLs are weighted before rays are sent to them (resampling, Talbot
// et al. 2005). Each ray has some candidates, which are neighbours in the list; the list is in Morton order. One candidate is drawn in
// proportion to its contribution if nothing hides it, and stands for all of them.

#import final_gather_mis
#import vpl_list

var<storage, read_write> rays: array<Ray>;
// Written only if the parameters say so.
var<storage, read_write> pilot_samples: array<PilotSample>;

// A VPL as P sees it.
struct Candidate {
    // If nothing hides it.
    contribution: Contribution,
    position: vec3<f32>,
    // Light that the lobes of P reflect of it, as if k_d and k_s were 1, all bands together.
    weight: f32,
}

fn load_candidate(receiver: Receiver, vpl_index: u32) -> Candidate {
    let vpl = load_vpl(vpl_index);
    let offset = vpl.position - receiver.position;
    let distance_squared = dot(offset, offset);
    let direction = offset * inverseSqrt(max(distance_squared, 1e-18));
    let radiance = vpl_light(vpl, vpl_index, -direction).radiance;
    var contribution = mis_contribution(receiver, direction, distance_squared, radiance, -dot(vpl.normal, direction), vpl.density, parameters.vpl_count);
    if (PHASORS) {
        let turns = vpl_turns(vpl_index) + modulation.turns_per_unit * sqrt(distance_squared);
        contribution.turns = select(vec4<f32>(-1.0), turns, vpl.is_modulated == 1.0);
    }
    let weight = select(0.0, diffuse_factor(vec3<f32>(1.0)).x, receiver.has_base) + mean_shape(contribution.lobe);
    return Candidate(contribution, vpl.position, weight * band_sum(contribution.irradiance));
}

fn seen_light(contribution: Contribution) -> vec3<f32> {
    return select(vec3<f32>(0.0), modulation.is_seen * contribution.irradiance, contribution.turns.x >= 0.0);
}

// Squared differences of two candidates: light of the diffuse and of the specular lobe, then their light that is modulated. Neighbours have
// almost the same phase, so only their light is compared.
fn squared_differences(a: Contribution, b: Contribution) -> vec4<f32> {
    var squares = vec4<f32>(square(a.irradiance - b.irradiance), square(a.irradiance * a.lobe - b.irradiance * b.lobe), 0.0, 0.0);
    if (PHASORS) {
        let seen_a = seen_light(a);
        let seen_b = seen_light(b);
        squares.z = square(seen_a - seen_b);
        squares.w = square(seen_a * a.lobe - seen_b * b.lobe);
    }
    return squares;
}

@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let index = LANES * (group.x + 65535u * group.y) + local / LANES;
    if (index >= parameters.packet_count) {
        return;
    }
    let packet = packets[index];
    let receiver = receiver_of(packet);
    let set_start = set_of(packet) * parameters.set_size;
    let first_vpl = set_start + parameters.first_vpl;
    let seed = hash(hash(seed_of(packet)) ^ hash(SAMPLES * packet.begin));
    // Over all packets of the gather, so the samples do not depend on which of them are processed together.
    let candidate_count = CANDIDATES * SAMPLES * (packet.end - packet.begin);
    let vpls_per_candidate = f32(parameters.vpl_count) / f32(candidate_count);
    for (var sample = local % LANES; sample < SAMPLES; sample += LANES) {
        let number = SAMPLES * (packet.number - packet.begin) + sample;
        var random = hash(seed ^ number);
        var drawn_vpl = first_vpl;
        var drawn_weight = 0.0;
        var weight_sum = 0.0;
        // The scatter of candidates is noise like that of rays, even if the candidates are hidden. Where few candidates matter, it is most
        // of the noise.
        var differences = vec4<f32>(0.0);
        var before: Contribution;
        for (var j = 0u; j < CANDIDATES; j++) {
            random = hash(random);
            // A random place within each step: even steps along a Morton curve are a grid, which may miss narrow features.
            let along = u32((f32(CANDIDATES * number + j) + f32(random & 255u) / 256.0) * vpls_per_candidate);
            let vpl_index = first_vpl + min(along, parameters.vpl_count - 1u);
            let to = load_candidate(receiver, vpl_index);
            differences += f32(j & 1u) * squared_differences(to.contribution, before);
            before = to.contribution;
            weight_sum += to.weight;
            let is_drawn = unit(random) * weight_sum <= to.weight;
            drawn_vpl = select(drawn_vpl, vpl_index, is_drawn);
            drawn_weight = select(drawn_weight, to.weight, is_drawn);
        }
        let to = load_candidate(receiver, drawn_vpl);
        let ray = vpl_ray(index, sample);
        rays[ray] = Ray(receiver.start, select(NO_RAY, 1.0, weight_sum > 0.0), to.position - receiver.start, 0.0);
        var contribution = to.contribution;
        contribution.irradiance *= weight_sum / max(drawn_weight, 1e-37);
        store_contribution(contribution_place(ray), contribution);
        contributions[difference_place(index, sample)] = differences;
        if (parameters.is_pilot == 1u) {
            let candidate = band_sum(to.contribution.irradiance);
            let found = band_sum(contribution.irradiance);
            pilot_samples[pilot_place(packet, sample)] = PilotSample(drawn_vpl - set_start, candidate, found);
        }
    }
}
