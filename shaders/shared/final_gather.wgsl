// Gathers the single bounce L–Q–P at a list of receivers P, by rays. Two techniques sample Q: from P, along directions from the lobes of
// f_P; and from L, as one of the VPLs. Each Q contributes F(Q) / Σ n_i·p_i(Q). F is the integrand over the solid angle at P; n_i and p_i
// are the number of samples and the density of each technique (the balance heuristic, Veach & Guibas 1995). So neither the 1/d² of a near
// VPL nor a small bright spot that few directions find makes noise, and nothing is clamped.
//
// Receivers take packets of 64 samples of each technique: a direction from each lobe, and a VPL. Four passes process a list of packets:
// final_gather_emit makes the rays along directions, and final_gather_draw those to VPLs; the first are traced to their closest hits; then
// final_gather_shade makes a ray from each hit to each light; all rays that lead to light are traced, and final_gather_sum adds up the
// contributions of those that nothing blocks.

#import brdf
#import random
#import ray
#import refinement
#import phasor

struct FinalGatherParameters {
    // C
    camera_position: vec3<f32>,
    // Packets in the list, and those receivers whose packets it holds.
    packet_count: u32,
    span_count: u32,
    // The light to shade with, or the lights to sum up: the first one, and the one after the last.
    light_index: u32,
    light_end: u32,
    // VPLs per set, and number of sets. Receivers take the sets in rotation.
    set_size: u32,
    set_count: u32,
    // Samples of a packet that are VPLs: all, or none if lights have none.
    vpl_samples: u32,
    // The VPLs of a set that paths lead to: the first one, and their number. With others, paths would not have a wanted number of bounces.
    first_vpl: u32,
    vpl_count: u32,
    // 1: stores what each ray to a VPL finds.
    is_pilot: u32,
    // Index of a receiver's result, less its index in the list.
    result_offset: u32,
    // Each seed gives other samples.
    seed: u32,
    // Points of emissive surfaces per area and sample, over the radiance there, all bands together.
    emission_density: f32,
    // Index of the first ray that leads to light, of any path.
    first_to_light: u32,
    // Density that VPLs of further bounces are given, as in Vpl.
    reflected_density: f32,
    // Of the paths with one more bounce than others: their number for each packet and lobe; the ray along the first one, and the first one
    // that leads from them to light.
    path_count: u32,
    first_path: u32,
    first_path_to_light: u32,
    // The same of the paths that they extend.
    extended_count: u32,
    first_extended: u32,
    extended_vpls: u32,
}

// A packet of samples.
struct Packet {
    // Index in the list of receivers.
    receiver: u32,
    // Number of the packet among all that the receiver takes, and those of the current gather: first, and one after the last.
    number: u32,
    begin: u32,
    end: u32,
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

// Samples of a packet: an invocation takes every LANES-th of them.
const SAMPLES: u32 = 64u;
const LANES: u32 = 8u;
// Per ray to a VPL.
const CANDIDATES: u32 = 8u;
// Rays of a sample along directions.
fn direction_count() -> u32 {
    return select(1u, 2u, GLOSSY);
}

var<immediate> parameters: FinalGatherParameters;

// P
struct Receiver {
    // Column and row.
    pixel: vec2<u32>,
    position: vec3<f32>,
    // Where rays from P start.
    start: vec3<f32>,
    normal: vec3<f32>,
    geometric_normal: vec3<f32>,
    lobe: Lobe,
    // Whether it reflects by more than its lobe.
    has_base: bool,
}

// What a Q contributes to a sum over samples.
struct Contribution {
    // Irradiance over the density of samples.
    irradiance: vec3<f32>,
    // Factor to what the specular lobe of P reflects of it, for a reflected_share of 1.
    lobe: Shape,
    // Of the path to P. Below 0: the light is not modulated.
    turns: vec4<f32>,
}

// The lobe of Phong is a number beside the irradiance. That of microfacets, and the turns, are vectors of their own.
fn contribution_vectors() -> u32 {
    return turns_vector() + select(0u, 1u, PHASORS);
}

fn turns_vector() -> u32 {
    return select(1u, 2u, GLOSSY & MICROFACET);
}

// A path from P over at least one surface, before the surface that its last ray meets.
struct Path {
    // From the radiance that arrives along the last ray to the irradiance of P, as in Contribution, times the density.
    weight: vec3<f32>,
    // Of the last ray's directions, per solid angle.
    density: f32,
    // As in Contribution.
    lobe: Shape,
    // Up to the last ray.
    length: f32,
    // Of the ray before: density of VPLs where it ends, over that of directions, for a directivity of 1.
    vpl_ratio: f32,
}

// The list of rays: those along directions, lobe by lobe for each packet; those along longer paths, bounce by bounce; those to VPLs, packet
// by packet; and those to lights, for each light as along the directions that found their starts. The same then follows for longer paths.
fn direction_ray(packet: u32, lobe: u32, sample: u32) -> u32 {
    return SAMPLES * (direction_count() * packet + lobe) + sample;
}

fn vpl_ray(packet: u32, sample: u32) -> u32 {
    return parameters.first_to_light + SAMPLES * packet + sample;
}

fn light_ray(light: u32, packet: u32, lobe: u32, sample: u32) -> u32 {
    return parameters.first_to_light + SAMPLES * (1u + direction_count() * light) * parameters.packet_count + direction_ray(packet, lobe, sample);
}

// A longer path among those of its bounce.
fn path_at(packet: u32, lobe: u32, number: u32) -> u32 {
    return parameters.path_count * (direction_count() * packet + lobe) + number;
}

// Index of a longer path among those of all bounces.
fn path_place(path: u32) -> u32 {
    return parameters.first_path + path - SAMPLES * direction_count() * parameters.packet_count;
}

fn path_vpl_ray(path: u32) -> u32 {
    return parameters.first_path_to_light + path;
}

fn path_light_ray(light: u32, path: u32) -> u32 {
    return parameters.first_path_to_light + parameters.path_count * direction_count() * parameters.packet_count * (1u + light) + path;
}

// Where the contribution of a ray to a VPL or to a light is in a list of vectors. Below: the differences of candidates, one vector per ray
// to a VPL.
fn contribution_place(ray: u32) -> u32 {
    return contribution_vectors() * (ray - parameters.first_to_light) + SAMPLES * parameters.packet_count;
}

fn difference_place(packet: u32, sample: u32) -> u32 {
    return SAMPLES * packet + sample;
}

fn pilot_place(packet: Packet, sample: u32) -> u32 {
    return SAMPLES * (packet.receiver + parameters.result_offset) + sample;
}

fn square(v: vec3<f32>) -> f32 {
    return dot(v, v);
}
