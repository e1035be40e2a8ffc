// The VPLs of further bounces: where light that VPLs reflect meets the scene. Of each group of neighbours among the VPLs of the bounce before,
// one is drawn in proportion to what it reflects, and stands for all. Its light goes on in one direction.
//
// How dense such VPLs are at a point is not known. They are stored as if their density were a given one, with the radiance that makes their
// light right. So both techniques of final gathering weight them by the same function of Q, and the weights add up to 1.

#import lights
#import drawn_vpls
#import random
#import phasor

struct LightPathParameters {
    // VPLs per set.
    set_size: u32,
    // The VPLs of this bounce and those of the bounce before, in each set.
    first_vpl: u32,
    vpl_count: u32,
    first_before: u32,
    count_before: u32,
    // Per area, as in Vpl, for a directivity of 1.
    density: f32,
    // Each seed gives other directions.
    seed: u32,
    // The rays of all sets that are in the list: the first one, and the one after the last.
    first_in_list: u32,
    end_in_list: u32,
}

// What a ray carries.
struct LightPath {
    // Radiance at the VPL, times the cosine there, over the density of VPLs and of directions.
    flux: vec3<f32>,
    // 1 if it is modulated.
    is_modulated: f32,
    // Of the path from L to the VPL.
    turns: vec4<f32>,
    // Of the VPL, along the ray.
    directivity: f32,
}

#if EMIT
var<storage, read_write> rays: array<Ray>;
var<storage, read_write> light_paths: array<LightPath>;
#else
var<storage, read> rays: array<Ray>;
var<storage, read> hits: array<u32>;
var<storage, read> light_paths: array<LightPath>;
#endif
var<immediate> parameters: LightPathParameters;

fn strongest(v: vec3<f32>) -> f32 {
    return max(max(v.x, v.y), v.z);
}

#if EMIT
// What a VPL reflects over its density: by its base, and by its lobe.
fn reflected_by(index: u32) -> vec2<f32> {
    let vpl = load_vpl(index);
    var reflected = vec2<f32>(PI * strongest(vpl.diffuse), 0.0);
    if (SPECULAR) {
        let specular = load_vpl_lobe(index);
        reflected.y = strongest(specular.specular) / unit_specular_factor(specular.lobe);
    }
    return reflected / max(vpl.density, 1e-30);
}

@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let index = parameters.first_in_list + 64u * (group.x + 65535u * group.y) + local;
    if (index >= parameters.end_in_list) {
        return;
    }
    let number = index % parameters.vpl_count;
    let first = index / parameters.vpl_count * parameters.set_size + parameters.first_before;
    var random = hash(parameters.seed ^ hash(index ^ 0x3c6ef372u));

    // One of a group.
    let least = parameters.count_before / parameters.vpl_count;
    let larger = parameters.count_before % parameters.vpl_count;
    let begin = number * least + min(number, larger);
    let size = least + select(0u, 1u, number < larger);
    var drawn = first + begin;
    var drawn_parts = vec2<f32>(0.0);
    var sum = 0.0;
    for (var i = 0u; i < least + 1u; i++) {
        let parts = select(vec2<f32>(0.0), reflected_by(first + min(begin + i, parameters.count_before - 1u)), i < size);
        sum += parts.x + parts.y;
        random = hash(random);
        let is_drawn = unit(random) * sum < parts.x + parts.y;
        drawn = select(drawn, first + begin + i, is_drawn);
        drawn_parts = select(drawn_parts, parts, is_drawn);
    }
    let of_drawn = max(drawn_parts.x + drawn_parts.y, 1e-37);
    let vpl = load_vpl(drawn);

    // One direction.
    let square = vec2<f32>(unit(hash(random ^ 0x68bc21ebu)), unit(hash(random ^ 0x02e5be93u)));
    var direction = sample_diffuse(square, frame_around(vpl.normal));
    let base_share = drawn_parts.x / of_drawn;
    var radiance = vpl.diffuse;
    var directed = 1.0;
    var density = diffuse_density(base_share, dot(vpl.normal, direction));
    if (SPECULAR) {
        let specular = load_vpl_lobe(drawn);
        let in_lobe = sample_lobe(square, specular.lobe, lobe_frame(specular.lobe));
        direction = select(in_lobe, direction, unit(hash(random ^ 0x967a889bu)) < base_share);
        let shape = eval_lobe(specular.lobe, direction);
        radiance += specular.specular * shape;
        directed = directivity(vpl.base_share, specular.lobe, shape);
        density = diffuse_density(base_share, dot(vpl.normal, direction));
        density += select(0.0, lobe_density(1.0 - base_share, specular.lobe, direction, shape), base_share < 1.0);
    }
    let cosine = dot(vpl.normal, direction);
    let flux = radiance * (cosine / max(density * vpl.density, 1e-30) * (sum / of_drawn));
    let is_wanted = sum > 0.0 && cosine > 0.0 && density > 0.0;
    let in_list = index - parameters.first_in_list;
    rays[in_list] = Ray(vpl.position, select(NO_RAY, NO_END, is_wanted), direction, 0.0);
    var turns = vec4<f32>(0.0);
    if (PHASORS) {
        turns = vpl_turns(drawn);
    }
    light_paths[in_list] = LightPath(select(vec3<f32>(0.0), flux, is_wanted), vpl.is_modulated, turns, directed);
}
#else
@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let index = parameters.first_in_list + 64u * (group.x + 65535u * group.y) + local;
    if (index >= parameters.end_in_list) {
        return;
    }
    let in_list = index - parameters.first_in_list;
    let vpl = index / parameters.vpl_count * parameters.set_size + parameters.first_vpl + index % parameters.vpl_count;
    let path = light_paths[in_list];
    let ray = rays[in_list];
    let met = hits[in_list];
    let is_hit = met != NOTHING_HIT;
    let hit = ray_hit(select(0u, met, is_hit), ray.origin, ray.direction);
    let to_before = -ray.direction;
    let cosine = dot(hit.shading_normal, to_before);
    let geometric_cosine = dot(hit.geometric_normal, to_before);
    let is_lit = is_hit && cosine > 0.0 && geometric_cosine > 0.0;
    let density = parameters.density * path.directivity;
    let incident = select(vec3<f32>(0.0), path.flux * (density * cosine / max(geometric_cosine, 1e-6)), is_lit);
    var turns: vec4<f32>;
    if (PHASORS) {
        turns = path.turns + modulation.turns_per_unit * distance(hit.position, ray.origin);
    }
    store_hit(vpl, hit, to_before, incident, density, path.is_modulated, turns);
}
#endif
