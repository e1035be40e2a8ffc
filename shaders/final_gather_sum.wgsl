// Sums the contributions of the rays that nothing blocks, receiver by receiver. Packet follows packet in the order of their numbers, so the
// result does not depend on which of them are processed together.

#import final_gather
#import squares
#import results

// A receiver and its packets in the list.
struct Span {
    // Index of the result.
    result: u32,
    first_packet: u32,
    packet_count: u32,
    // 1: adds to the stored result.
    adds: u32,
}

var<storage, read> spans: array<Span>;
var<storage, read> hits: array<u32>;
var<storage, read> contributions: array<vec4<f32>>;
var<storage, read_write> pilot_samples: array<PilotSample>;

// What the samples of a receiver find, for each lobe that it may have; and the squared differences of neighbouring samples.
struct Found {
    diffuse: Signal,
    diffuse_differences: Squares,
    specular: Signal,
    specular_differences: Squares,
}

fn load_contribution(ray: u32) -> Contribution {
    let place = contribution_place(ray);
    let light = contributions[place];
    var contribution: Contribution;
    contribution.irradiance = select(vec3<f32>(0.0), light.xyz, hits[ray] == NOTHING_HIT);
    contribution.lobe = vec3<f32>(light.w);
    if (GLOSSY & MICROFACET) {
        contribution.lobe = contributions[place + 1u].xyz;
    }
    if (PHASORS) {
        contribution.turns = contributions[place + turns_vector()];
    }
    return contribution;
}

fn signal_of(contribution: Contribution) -> Signal {
    var path: Phasors;
    if (PHASORS) {
        path = phasors_of(contribution.turns);
    }
    let modulated = select(vec3<f32>(0.0), contribution.irradiance, contribution.turns.x >= 0.0);
    return modulated_signal(contribution.irradiance, modulated, path);
}

// Adds two neighbouring samples.
fn add_pair(found: ptr<function, Found>, ray: u32) {
    let a = load_contribution(ray);
    let b = load_contribution(ray + 1u);
    let signal_a = signal_of(a);
    let signal_b = signal_of(b);
    (*found).diffuse = add_signals((*found).diffuse, add_signals(signal_a, signal_b));
    (*found).diffuse_differences = add_squares((*found).diffuse_differences, squared_difference(signal_a, signal_b));
    if (GLOSSY) {
        let specular_a = scaled_signal(signal_a, a.lobe);
        let specular_b = scaled_signal(signal_b, b.lobe);
        (*found).specular = add_signals((*found).specular, add_signals(specular_a, specular_b));
        (*found).specular_differences = add_squares((*found).specular_differences, squared_difference(specular_a, specular_b));
    }
}

// What the longer paths find.
fn found_by_paths(index: u32) -> Found {
    var found: Found;
    for (var lobe = 0u; lobe < direction_count(); lobe++) {
        for (var number = 0u; number < parameters.path_count; number += 2u) {
            let path = path_at(index, lobe, number);
            if (parameters.vpl_samples > 0u) {
                add_pair(&found, path_vpl_ray(path));
            }
            for (var light = parameters.light_index; light < parameters.light_end; light++) {
                add_pair(&found, path_light_ray(light, path));
            }
        }
    }
    return found;
}

fn found_by(index: u32) -> Found {
    var found: Found;
    for (var light = parameters.light_index; light < parameters.light_end; light++) {
        for (var lobe = 0u; lobe < direction_count(); lobe++) {
            for (var sample = 0u; sample < SAMPLES; sample += 2u) {
                add_pair(&found, light_ray(light, index, lobe, sample));
            }
        }
    }
    for (var sample = 0u; sample < parameters.vpl_samples; sample += 2u) {
        add_pair(&found, vpl_ray(index, sample));
        let differences = contributions[difference_place(index, sample)] + contributions[difference_place(index, sample + 1u)];
        found.diffuse_differences = add_squares(found.diffuse_differences, squares_of(differences.x, differences.z));
        if (GLOSSY) {
            found.specular_differences = add_squares(found.specular_differences, squares_of(differences.y, differences.w));
        }
    }
    return found;
}

fn keep(receiver: u32, lobe: u32, signal: Signal, squares: Squares) {
    add_to_result(receiver, lobe, signal, squares.light, false);
    if (PHASORS) {
        add_to_vector(RESULT_VECTORS * receiver + PHASOR_SQUARES + lobe, squares.phasors, false);
    }
}

@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let slot = 64u * (group.x + 65535u * group.y) + local;
    if (slot >= parameters.span_count) {
        return;
    }
    let span = spans[slot];
    let place = RESULT_VECTORS * span.result;
    let cleared = select(RESULT_VECTORS, 0u, span.adds == 1u || parameters.light_index > 0u || DEEP);
    for (var i = 0u; i < cleared; i++) {
        results[place + i] = vec4<f32>(0.0);
    }
    let diffuse = diffuse_factor(vec3<f32>(1.0)).x;
    for (var i = 0u; i < span.packet_count; i++) {
        let index = span.first_packet + i;
        var found: Found;
        if (DEEP) {
            found = found_by_paths(index);
        } else {
            found = found_by(index);
        }
        keep(span.result, 0u, scaled_signal(found.diffuse, vec3<f32>(diffuse)), scaled_squares(found.diffuse_differences, diffuse * diffuse));
        if (GLOSSY) {
            keep(span.result, 1u, found.specular, found.specular_differences);
        }
        let pilot_count = select(0u, SAMPLES, parameters.is_pilot == 1u && !DEEP);
        for (var sample = 0u; sample < pilot_count; sample++) {
            if (hits[vpl_ray(index, sample)] != NOTHING_HIT) {
                pilot_samples[SAMPLES * span.result + sample].found = 0.0;
            }
        }
    }
}
