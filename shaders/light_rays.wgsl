// The VPLs of final gathering: the points where rays from a light hit the scene. The light's map is divided into cells. Each cell gets rays
// in proportion to its share of all samples. A ray's place within its cell is random. So the density of VPLs is known at every point that
// the light sees, however fine the scene is compared with the cells. Separate draws have no error in common.

#import lights
#import drawn_vpls
#import random
#import phasor

struct LightRayParameters {
    light_index: u32,
    // The light's rays in each set. Their number is a multiple of 64.
    first_ray: u32,
    ray_count: u32,
    // Rays per set, over all lights; and number of sets, each of which covers all cells.
    set_size: u32,
    set_count: u32,
    // The light's cells.
    first_cell: u32,
    cell_count: u32,
    // Share of each ray in the light's cumulative probability, in units of its cells' bounds.
    stride: u32,
    // Each seed gives other rays.
    seed: u32,
    // The rays of all sets that are in the list: the first one, and the one after the last.
    first_in_list: u32,
    end_in_list: u32,
}

// Lists in images, like ray_triangles in hit_triangle.wgsl. The cells of the lights: start and size in the light's cumulative probability, as
// whole numbers; index of the tile among the light's tiles; index of the cell in Morton order in that tile + 256 · the tile's level.
var ray_cells: texture_storage_2d<rgba32float, read>;
#if EMIT
var<storage, read_write> rays: array<Ray>;
// The cell of each ray.
var<storage, read_write> light_ray_cells: array<u32>;
#else
var<storage, read> rays: array<Ray>;
var<storage, read> light_ray_cells: array<u32>;
var<storage, read> hits: array<u32>;
#endif
var<immediate> parameters: LightRayParameters;

struct LightRay {
    origin: vec3<f32>,
    direction: vec3<f32>,
}

// The light at the point of its area where a ray starts. Rays that start together cover all of the map, so neighbours in the map start at
// different points.
fn light_of_ray(whole_light: Light, set_index: u32, ray: u32) -> Light {
    var light = light_at(whole_light, area_place(ray % packet_count(), parameters.seed ^ hash(set_index)));
    if (PHASORS) {
        light.origin_turns = area_origin_turns(light);
    }
    return light;
}

// Per set.
fn packet_count() -> u32 {
    return parameters.ray_count / 64u;
}

fn seed_of(set_index: u32, ray: u32) -> u32 {
    return hash(parameters.seed ^ hash(set_index * parameters.set_size + parameters.first_ray + ray));
}

// Where a ray is in the light's cumulative probability.
fn drawn_place(ray: u32, seed: u32) -> u32 {
    return ray * parameters.stride + u32(unit(seed) * f32(parameters.stride));
}

// The last cell that begins at `drawn` or before.
fn cell_at(drawn: u32) -> u32 {
    var low = parameters.first_cell;
    var high = low + parameters.cell_count;
    for (var i = 0u; i < 20u; i++) {
        let middle = (low + high) / 2u;
        let is_before = bitcast<u32>(textureLoad(ray_cells, list_place(middle)).x) <= drawn;
        low = select(low, middle, is_before);
        high = select(middle, high, is_before);
    }
    return low;
}

// The ray through a cell, from its place `drawn` in the light's cumulative probability.
fn light_ray(light: Light, drawn: u32, cell_index: u32, seed: u32) -> LightRay {
    let cell = textureLoad(ray_cells, list_place(cell_index));
    let tile = u32(cell.z);
    let level = u32(cell.w) >> 8u;
    let cells_per_edge = f32(1u << level);
    // Along the cell's Morton curve, so that neighbours in the list are neighbours in the map.
    let share = f32(bitcast<u32>(cell.y));
    let place_in_cell = curve_point(f32(drawn - bitcast<u32>(cell.x)) / share, seed);
    let cell_place = morton_place(u32(cell.w) & 255u);
    let place_in_tile = (vec2<f32>(cell_place) + place_in_cell) / cells_per_edge;
    let tiles = light.emission_size;
    var face = light.faces[0];
#repeat FACE 6
    if (tile / (tiles * tiles) == FACEu) {
        face = light.faces[FACE];
    }
#endrepeat
    let place = (vec2<f32>(morton_place(tile % (tiles * tiles))) + place_in_tile) / f32(tiles);
    let across = light.half_extent * (2.0 * place - 1.0);
    let sideways = across.x * face.right - across.y * face.up;
    let is_parallel = light.is_parallel == 1u;
    return LightRay(light.position + select(vec3<f32>(0.0), sideways, is_parallel), select(face.forward + sideways, light.axis, is_parallel));
}

// Samples per area of the map's tiles in a cell, normalised to one sample.
fn map_density_of(cell_index: u32) -> f32 {
    let cell = textureLoad(ray_cells, list_place(cell_index));
    let cells_per_edge = f32(1u << (u32(cell.w) >> 8u));
    let of_light = f32(parameters.ray_count) / f32(parameters.set_size);
    return f32(bitcast<u32>(cell.y)) / (f32(parameters.ray_count) * f32(parameters.stride)) * of_light * cells_per_edge * cells_per_edge;
}

fn morton_place(code: u32) -> vec2<u32> {
    return vec2<u32>(every_other_bit(code), every_other_bit(code >> 1u));
}

// The point of the unit square at `along` (0 to 1) on its Morton curve. The seed selects the place within a step of the curve.
fn curve_point(along: f32, seed: u32) -> vec2<f32> {
    let step = min(u32(along * 16777216.0), 16777215u);
    let within = vec2<f32>(unit(hash(seed)), unit(hash(seed ^ 0x9e3779b9u)));
    return (vec2<f32>(morton_place(step)) + within) / 4096.0;
}

// An invocation takes several rays, because loading a light takes as long as tracing some.
const RAYS_AT_ONCE: u32 = 8u;

#if SURFACES
// Points of emissive surfaces are VPLs, too, which need no rays.
@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let index = 64u * (group.x + 65535u * group.y) + local;
    if (index >= parameters.ray_count * parameters.set_count) {
        return;
    }
    let set_index = index / parameters.ray_count;
    let number = index % parameters.ray_count;
    let along = (f32(number) + unit(seed_of(set_index, number))) / f32(parameters.ray_count);
    let point = emission_point(load_light(parameters.light_index), along);
    let density = point.density * f32(parameters.ray_count) / f32(parameters.set_size);
    let vpl = Vpl(before_surface(point.position, point.normal, END_SHIFT), density, point.normal, 0.0, point.radiance, 1.0);
    var specular: VplLobe;
    if (SPECULAR) {
        // A lobe that reflects nothing.
        specular.lobe = lobe_of(point.normal, point.normal, vec4<f32>(0.0, 0.0, 0.0, 1.0));
    }
    store_vpl(set_index * parameters.set_size + parameters.first_ray + number, vpl, vec4<f32>(0.0), specular);
}
#else
#if EMIT
@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let first = parameters.first_in_list + RAYS_AT_ONCE * (64u * (group.x + 65535u * group.y) + local);
    let end = min(first + RAYS_AT_ONCE, parameters.end_in_list);
    let whole_light = load_light(parameters.light_index);
    for (var index = first; index < end; index++) {
        let set_index = index / parameters.ray_count;
        let ray_of_light = index % parameters.ray_count;
        let light = light_of_ray(whole_light, set_index, ray_of_light);
        let seed = seed_of(set_index, ray_of_light);
        let drawn = drawn_place(ray_of_light, seed);
        let cell = cell_at(drawn);
        let ray = light_ray(light, drawn, cell, seed);
        let is_parallel = light.is_parallel == 1u;
        let in_list = index - parameters.first_in_list;
        // The map of emissive surfaces has all directions; each of their points emits to its front.
        let is_behind = light.emission_points > 0u && dot(light.axis, ray.direction) <= 0.0;
        rays[in_list] = Ray(ray.origin, select(NO_END, NO_RAY, is_behind), ray.direction, select(LIGHT_IN_PLANE, 0.0, is_parallel));
        light_ray_cells[in_list] = cell;
    }
}
#else
@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let first = parameters.first_in_list + RAYS_AT_ONCE * (64u * (group.x + 65535u * group.y) + local);
    let end = min(first + RAYS_AT_ONCE, parameters.end_in_list);
    let whole_light = load_light(parameters.light_index);
    for (var index = first; index < end; index++) {
        shade(index, whole_light);
    }
}

fn shade(index: u32, whole_light: Light) {
    let set_index = index / parameters.ray_count;
    let ray_of_light = index % parameters.ray_count;
    let place = set_index * parameters.set_size + parameters.first_ray + ray_of_light;
    let in_list = index - parameters.first_in_list;
    let met = hits[in_list];
    let is_hit = met != NOTHING_HIT;
    let light = light_of_ray(whole_light, set_index, ray_of_light);
    let hit = ray_hit(select(0u, met, is_hit), rays[in_list].origin, rays[in_list].direction);
    let illumination = illuminate(light, hit.position);
    let cosine = dot(hit.shading_normal, illumination.to_light);
    let geometric_cosine = dot(hit.geometric_normal, illumination.to_light);
    let is_lit = is_hit && cosine > 0.0 && geometric_cosine > 0.0;
    let from_light = hit.position - light.position;
    let density = map_density_of(light_ray_cells[in_list]) * geometric_cosine / facing_cell_area(light, from_light, map_place(light, from_light).depth);
    let incident = select(vec3<f32>(0.0), illumination.irradiance * cosine, is_lit);
    var turns: vec4<f32>;
    if (PHASORS) {
        turns = turns_from_light(light, hit.position);
    }
    store_hit(place, hit, illumination.to_light, incident, select(1.0, density, is_lit), f32(light.is_modulated), turns);
}
#endif
#endif
