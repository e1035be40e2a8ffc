// How the two techniques are weighted.

#import final_gather_receiver

var<storage, read_write> contributions: array<vec4<f32>>;

// Contribution of a Q that sends `radiance` to P, for one sample of each technique. `direction` leads from P to Q and has unit length.
// `vpl_density` is the density of VPLs at Q, per area; P takes candidates among so many VPLs of a set.
fn mis_contribution(
    receiver: Receiver,
    direction: vec3<f32>,
    distance_squared: f32,
    radiance: vec3<f32>,
    cosine_q: f32,
    vpl_density: f32,
    vpls: u32,
) -> Contribution {
    let cosine = dot(receiver.normal, direction);
    let is_above = cosine > 0.0 && dot(receiver.geometric_normal, direction) > 0.0 && cosine_q > 0.0;
    // Samples per solid angle at P: from P, and from L.
    var density = select(0.0, diffuse_density(1.0, cosine), receiver.has_base);
    var contribution: Contribution;
    if (GLOSSY) {
        let shape = eval_lobe(receiver.lobe, direction);
        density += lobe_density(1.0, receiver.lobe, direction, shape);
        contribution.lobe = shape * unit_specular_factor(receiver.lobe);
    }
    density += candidate_density(vpls, vpl_density, distance_squared, cosine_q);
    contribution.irradiance = select(vec3<f32>(0.0), radiance * (cosine / max(density, 1e-30)), is_above);
    return contribution;
}

// Density of the candidates at Q that a point of a path takes among so many VPLs of a set, per solid angle at that point.
fn candidate_density(vpls: u32, vpl_density: f32, distance_squared: f32, cosine_q: f32) -> f32 {
    let per_candidate = f32(parameters.set_size) / f32(max(vpls, 1u));
    let count = select(0.0, f32(CANDIDATES) * per_candidate, parameters.vpl_samples > 0u);
    return count * vpl_density * distance_squared / max(cosine_q, 1e-6);
}

fn store_contribution(place: u32, contribution: Contribution) {
    contributions[place] = vec4<f32>(contribution.irradiance, contribution.lobe.x);
    if (GLOSSY & MICROFACET) {
        contributions[place + 1u] = vec4<f32>(contribution.lobe, 0.0);
    }
    if (PHASORS) {
        contributions[place + turns_vector()] = contribution.turns;
    }
}
