// Shades what the rays along directions and longer paths hit: what each Q contributes if one light reaches it, and the ray from Q to that
// light.

#import final_gather_mis
#import lights
#import hits

// The density of VPLs in the lights' maps. A list in an image, like ray_triangles in hit_triangle.wgsl. First a texel for each tile of every
// light: index of its first cell, and number of cells along its edge. The third component of a cell: samples per area of the map's tiles,
// normalised to one sample.
var vpl_densities: texture_storage_2d<rgba32float, read>;
var<storage, read_write> rays: array<Ray>;
var<storage, read> hits: array<u32>;
var<storage, read> paths: array<Path>;

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

// The point of a light's area that the rays of a packet lead to. Neighbouring pixels, which are averaged, cover the area evenly (a
// two-dimensional Kronecker sequence over two indices).
fn point_for(packet: Packet, pixel: vec2<u32>) -> Light {
    let seed = hash(parameters.seed ^ 0x85ebca6bu) ^ parameters.light_index;
    let shift = fract(vec2<f32>(pixel) * mat2x2<f32>(0.8566749, 0.7338919, 0.6287067, 0.5385972));
    var light = light_at(load_light(parameters.light_index), fract(area_place(packet.number, seed) + shift));
    if (PHASORS) {
        light.origin_turns = area_origin_turns(light);
    }
    return light;
}

// What the end of a longer path contributes, as mis_contribution. `directed` is the directivity of its last surface.
fn path_contribution(path: Path, distance_squared: f32, radiance: vec3<f32>, cosine_q: f32, vpl_density: f32, directed: f32) -> Contribution {
    let density = path.density + candidate_density(parameters.vpl_count, vpl_density, distance_squared, cosine_q);
    let share = 1.0 / ((1.0 + path.vpl_ratio * directed) * max(density, 1e-30));
    var contribution: Contribution;
    contribution.lobe = path.lobe;
    contribution.irradiance = select(vec3<f32>(0.0), path.weight * radiance * share, cosine_q > 0.0);
    return contribution;
}

// An invocation shades some samples of one lobe: loading a light takes as long as tracing some rays.
@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    var count = SAMPLES;
    var lanes = LANES;
    if (DEEP) {
        count = parameters.path_count;
        lanes = min(LANES, count);
    }
    let item = 64u / lanes * (group.x + 65535u * group.y) + local / lanes;
    let index = item / direction_count();
    let lobe = item % direction_count();
    if (index >= parameters.packet_count) {
        return;
    }
    let packet = packets[index];
    let pixel = pixel_of(packet);
    var receiver: Receiver;
    if (!DEEP) {
        receiver = receiver_of(packet);
    }
    var light: Light;
    if (!EMISSIVE) {
        light = point_for(packet, pixel);
    }
    let end = light_end(light);
    for (var sample = local % lanes; sample < count; sample += lanes) {
        var ray = direction_ray(index, lobe, sample);
        var to_light = light_ray(parameters.light_index, index, lobe, sample);
        var path: Path;
        if (DEEP) {
            let place = path_at(index, lobe, sample);
            ray = parameters.first_path + place;
            to_light = path_light_ray(parameters.light_index, place);
            path = paths[path_place(place)];
            receiver.start = rays[ray].origin;
            receiver.position = receiver.start;
        }
        let direction = rays[ray].direction;
        let met = hits[ray];
        let is_hit = met != NOTHING_HIT;
        let hit = ray_hit(select(0u, met, is_hit), receiver.start, direction);
        let offset = hit.position - receiver.position;
        let cosine_q = -dot(hit.geometric_normal, direction);
        if (EMISSIVE) {
            // Q's own light needs no further ray.
            let radiance = select(vec3<f32>(0.0), hit.emission, is_hit);
            let density = parameters.emission_density * (radiance.x + radiance.y + radiance.z);
            var own = mis_contribution(receiver, direction, dot(offset, offset), radiance, cosine_q, density, parameters.vpl_count);
            own.turns = vec4<f32>(-1.0);
            rays[to_light] = Ray(receiver.start, NO_RAY, direction, 0.0);
            store_contribution(contribution_place(to_light), own);
            continue;
        }
        let illumination = illuminate_without_pattern(light, hit.position);
        let cosine_light = dot(hit.shading_normal, illumination.to_light);
        let geometric_cosine_light = dot(hit.geometric_normal, illumination.to_light);
        let reflected = eval_brdf(hit.brdf, hit.shading_normal, illumination.to_light, -direction);
        let radiance = reflected * illumination.irradiance * cosine_light;
        let vpl_density = facing_vpl_density(light, hit.position) * geometric_cosine_light;
        var contribution: Contribution;
        if (DEEP) {
            var directed = 1.0;
            if (SPECULAR) {
                let lobe = lobe_of(illumination.to_light, hit.shading_normal, hit.brdf.lobe);
                directed = directivity(base_share(hit.brdf), lobe, eval_lobe(lobe, -direction));
            }
            contribution = path_contribution(path, dot(offset, offset), radiance, cosine_q, vpl_density, directed);
        } else {
            contribution = mis_contribution(receiver, direction, dot(offset, offset), radiance, cosine_q, vpl_density, parameters.vpl_count);
        }
        // A loop that other lights skip: drivers that compute both sides of a branch would make all of them pay for it.
        for (var i = 0u; i < min(light.pattern_columns, 1u); i++) {
            contribution.irradiance *= pattern_intensity(light, -illumination.to_light);
        }
        let is_lit = is_hit && cosine_light > 0.0 && geometric_cosine_light > 0.0 && any(contribution.irradiance > vec3<f32>(0.0));
        contribution.irradiance = select(vec3<f32>(0.0), contribution.irradiance, is_lit);
        if (PHASORS) {
            let turns = turns_from_light(light, hit.position) + modulation.turns_per_unit * (path.length + length(offset));
            contribution.turns = select(vec4<f32>(-1.0), turns, light.is_modulated == 1u);
        }
        // Q is on the side that P sees, even if it is also in a second surface.
        let start = before_surface(hit.position, hit.geometric_normal, END_SHIFT) - END_SHIFT * direction;
        rays[to_light] = ray_to_light(start, end, is_lit);
        store_contribution(contribution_place(to_light), contribution);
    }
}
