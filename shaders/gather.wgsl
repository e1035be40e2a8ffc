// Sums over all VPLs by tiled accumulation. Each invocation keeps a few receivers in registers and loops over the VPLs. Each VPL is fetched
// once per subgroup or workgroup.
//
// The sum has three levels (tile, dispatch, result), so its rounding error does not grow with the number of VPLs.

#import vpl_list
#if PHASORS
#import phasor
#import refinement
#endif

// Receivers per invocation, chosen by measurement: more receivers hide the latency of the division, but too many spill registers.
#if PHONG GLOSSY
const RECEIVERS: u32 = 4u;
#else
const RECEIVERS: u32 = 8u;
#endif
// VPLs that are summed before their sum is added to the dispatch's. Dispatches cover a multiple of this number.
const TILE_VPLS: u32 = 256u;
// VPLs fetched together.
#if BROADCAST8
const FETCH_VPLS: u32 = 8u;
#endif
#if BROADCAST4
const FETCH_VPLS: u32 = 4u;
#endif
#if TILE
const FETCH_VPLS: u32 = 64u;
#endif
const WORKGROUP: u32 = 64u;

struct GatherParameters {
    // C
    camera_position: vec3<f32>,
    // First index in the list of receivers.
    first_receiver: u32,
    receiver_count: u32,
    first_vpl: u32,
    vpl_count: u32,
    // Index of the first result; and 1 if this is the first dispatch of these receivers.
    first_result: u32,
    is_first: u32,
}

var position_mesh: texture_2d<f32>;
var normal_geometric: texture_2d<f32>;
var ks_shininess: texture_2d<f32>;
#if PHASORS
// The light of the list of VPLs.
var<uniform> light: Light;
#else
const RESULT_VECTORS: u32 = 2u;
#endif
// In the refinement's layout: light that a receiver reflects by its diffuse and by its specular lobe, as if k_d and k_s were 1.
var<storage, read_write> results: array<vec4<f32>>;
var<storage, read> receivers: array<u32>;
var<immediate> parameters: GatherParameters;

// Per receiver: pixel, P, n_P, the lobe towards the camera, and the sums.
var<private> pixel: array<vec2<u32>, RECEIVERS>;
var<private> position: array<vec3<f32>, RECEIVERS>;
var<private> normal: array<vec3<f32>, RECEIVERS>;
var<private> tile_diffuse: array<vec3<f32>, RECEIVERS>;
var<private> diffuse: array<vec3<f32>, RECEIVERS>;
#if PHONG
var<private> lobe: array<Lobe, RECEIVERS>;
var<private> tile_specular: array<vec3<f32>, RECEIVERS>;
var<private> specular: array<vec3<f32>, RECEIVERS>;
#endif

#if PHASORS
// Modulation of the light that a VPL reflects.
struct VplPhase {
    // Of the path from L.
    turns: Frequencies,
    // Component of the direction to L along the surface.
    along_surface: vec3<f32>,
    // Logarithm of the factor that reduces Z because paths over the VPL's area differ in length, for a length gradient of 1.
    damping: Frequencies,
}

// Per band, phasors of the frequencies.
struct PhasorSum {
    red: Phasors,
    green: Phasors,
    blue: Phasors,
}

var<private> tile_diffuse_phasors: array<PhasorSum, RECEIVERS>;
var<private> diffuse_phasors: array<PhasorSum, RECEIVERS>;
#if PHONG
var<private> tile_specular_phasors: array<PhasorSum, RECEIVERS>;
var<private> specular_phasors: array<PhasorSum, RECEIVERS>;
#endif

fn phase_of(vpl: Vpl) -> VplPhase {
    let offset = light.position - vpl.position;
    // Entries after the end of a list may be at the light's position.
    let to_light = offset * inverseSqrt(max(dot(offset, offset), 1e-18));
    // Over a square of edge e, Z is its value at the centre times sinc(π·f/c·e·gradient), which e^(−x²/6) approximates.
    let turns_per_edge = of_frequencies(modulation.turns_per_unit) * (PI * sqrt(vpl.density));
    return VplPhase(of_frequencies(turns_from_light(light, vpl.position)), to_light - dot(to_light, vpl.normal) * vpl.normal,
        turns_per_edge * turns_per_edge * (-1.0 / 6.0));
}

fn add_to(sum: PhasorSum, radiance: vec3<f32>, phasors: Phasors) -> PhasorSum {
    return PhasorSum(Phasors(sum.red.re + radiance.r * phasors.re, sum.red.im + radiance.r * phasors.im),
        Phasors(sum.green.re + radiance.g * phasors.re, sum.green.im + radiance.g * phasors.im),
        Phasors(sum.blue.re + radiance.b * phasors.re, sum.blue.im + radiance.b * phasors.im));
}

fn sum_of(a: PhasorSum, b: PhasorSum) -> PhasorSum {
    return PhasorSum(Phasors(a.red.re + b.red.re, a.red.im + b.red.im), Phasors(a.green.re + b.green.re, a.green.im + b.green.im),
        Phasors(a.blue.re + b.blue.re, a.blue.im + b.blue.im));
}

// Adds a sum to a receiver's results.
fn keep_phasors(sum: PhasorSum, factor: f32, lobe: u32, receiver: u32) {
    keep_band(sum.red, factor, 0u, lobe, receiver);
    keep_band(sum.green, factor, 1u, lobe, receiver);
    keep_band(sum.blue, factor, 2u, lobe, receiver);
}

fn keep_band(sum: Phasors, factor: f32, band: u32, lobe: u32, receiver: u32) {
    let is_first = parameters.is_first == 1u;
    let place = RESULT_VECTORS * receiver + phasor_result(0u, band, lobe);
#if ONE
    let first = factor * vec4<f32>(sum.re, sum.im, 0.0, 0.0);
#else
    let first = factor * vec4<f32>(sum.re.xy, sum.im.xy).xzyw;
    let next = RESULT_VECTORS * receiver + phasor_result(1u, band, lobe);
    results[next] = select(results[next], vec4<f32>(0.0), is_first) + factor * vec4<f32>(sum.re.zw, sum.im.zw).xzyw;
#endif
    results[place] = select(results[place], vec4<f32>(0.0), is_first) + first;
}
#endif

// Adds one VPL to every receiver. There are no branches, because on a vector unit they skip nothing. Each stage loops over all receivers,
// so that the long dependency chains of the lobes overlap: 17 % faster than receiver by receiver.
fn accumulate(
    vpl: Vpl,
#if GLOSSY
    vpl_lobe: VplLobe,
#endif
#if PHASORS
    phase: VplPhase,
#endif
) {
#if PHASORS
    var phasors: array<Phasors, RECEIVERS>;
    let gradient_at_normal = 1.0 + dot(phase.along_surface, phase.along_surface);
#endif
    var radiance: array<vec3<f32>, RECEIVERS>;
    var direction: array<vec3<f32>, RECEIVERS>;
    for (var i = 0u; i < RECEIVERS; i++) {
        let offset = vpl.position - position[i];
        let distance_squared = dot(offset, offset);
        let receiver_side = max(dot(normal[i], offset), 0.0);
        // Negative where P is above Q's horizon. The sign stays, because negating costs the inner loop more than min does.
        let behind_vpl = dot(vpl.normal, offset);
        let inverse_distance = inverseSqrt(max(distance_squared, 1e-18));
        var weight: f32;
#if AVERAGE
        // cosθ_{P→Q}, and f_Q = 0 below Q's horizon.
        weight = select(0.0, receiver_side * inverse_distance, behind_vpl < 0.0);
#else
        // −cosθ_{P→Q}·cosθ_{Q→P}/d². The sign is removed at the end. P = Q gives 0 · 1e36.
#if PHONG GLOSSY
        let inverse_squared = inverse_distance * inverse_distance;
        weight = receiver_side * min(behind_vpl, 0.0) * (inverse_squared * inverse_squared);
#else
        // One division and no square root.
        weight = receiver_side * min(behind_vpl, 0.0) / (distance_squared * distance_squared + 1e-37);
#endif
#endif
#if PHONG GLOSSY
        direction[i] = offset * inverse_distance;
#endif
#if GLOSSY
        radiance[i] = vec3<f32>(weight);
#else
        radiance[i] = vpl.diffuse * weight;
#endif
#if PHASORS
        let cosine = behind_vpl * inverse_distance;
        let gradient_squared = max(gradient_at_normal - 2.0 * inverse_distance * dot(phase.along_surface, offset) - cosine * cosine, 0.0);
        let path = phasors_of(phase.turns + of_frequencies(modulation.turns_per_unit) * (distance_squared * inverse_distance));
        let left = f32(light.is_modulated) * exp(phase.damping * gradient_squared);
        phasors[i] = Phasors(left * path.re, left * path.im);
#endif
    }
#if GLOSSY
    for (var i = 0u; i < RECEIVERS; i++) {
        radiance[i] *= vpl.diffuse + vpl_lobe.specular * eval_lobe(vpl_lobe.lobe, -direction[i]);
    }
#endif
    for (var i = 0u; i < RECEIVERS; i++) {
        tile_diffuse[i] += radiance[i];
#if PHONG
        let in_lobe = radiance[i] * eval_lobe(lobe[i], direction[i]);
        tile_specular[i] += in_lobe;
#endif
#if PHASORS
        tile_diffuse_phasors[i] = add_to(tile_diffuse_phasors[i], radiance[i], phasors[i]);
#if PHONG
        tile_specular_phasors[i] = add_to(tile_specular_phasors[i], in_lobe, phasors[i]);
#endif
#endif
    }
}

// The last fetch may go beyond the list. It then reads a VPL of an earlier list. With a normal of 0, that VPL faces nothing.
fn fetch_vpl(index: u32) -> Vpl {
    var vpl = load_vpl(index);
    let is_listed = index < parameters.first_vpl + parameters.vpl_count;
    vpl.normal = select(vec3<f32>(0.0), vpl.normal, is_listed);
    return vpl;
}

fn pixel_of(slot: u32) -> vec2<u32> {
    let last = parameters.first_receiver + parameters.receiver_count - 1u;
    let packed = receivers[min(parameters.first_receiver + slot, last)];
    return vec2<u32>(packed & 0xffffu, packed >> 16u);
}

#if TILE
var<workgroup> fetched: array<Vpl, FETCH_VPLS>;
#if GLOSSY
var<workgroup> fetched_lobes: array<VplLobe, FETCH_VPLS>;
#endif
#if PHASORS
var<workgroup> fetched_phases: array<VplPhase, FETCH_VPLS>;
#endif
#endif

@compute @workgroup_size(64)
fn compute_main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
    @builtin(subgroup_invocation_id) lane: u32,
) {
    // Neighbouring lanes take neighbouring receivers.
    let first_slot = group.x * (WORKGROUP * RECEIVERS) + local;
    for (var i = 0u; i < RECEIVERS; i++) {
        pixel[i] = pixel_of(first_slot + i * WORKGROUP);
        position[i] = textureLoad(position_mesh, pixel[i], 0).xyz;
        normal[i] = textureLoad(normal_geometric, pixel[i], 0).xyz;
        diffuse[i] = vec3<f32>(0.0);
#if PHONG
        let to_camera = normalize(parameters.camera_position - position[i]);
        lobe[i] = lobe_of(to_camera, normal[i], textureLoad(ks_shininess, pixel[i], 0));
        specular[i] = vec3<f32>(0.0);
#endif
#if PHASORS
        diffuse_phasors[i] = PhasorSum();
#if PHONG
        specular_phasors[i] = PhasorSum();
#endif
#endif
    }

    let end = parameters.first_vpl + parameters.vpl_count;
    for (var tile = parameters.first_vpl; tile < end; tile += TILE_VPLS) {
        for (var i = 0u; i < RECEIVERS; i++) {
            tile_diffuse[i] = vec3<f32>(0.0);
#if PHONG
            tile_specular[i] = vec3<f32>(0.0);
#endif
#if PHASORS
            tile_diffuse_phasors[i] = PhasorSum();
#if PHONG
            tile_specular_phasors[i] = PhasorSum();
#endif
#endif
        }
        let tile_end = min(tile + TILE_VPLS, end);
        for (var first = tile; first < tile_end; first += FETCH_VPLS) {
#if BROADCAST8
            let mine = fetch_vpl(first + lane);
#if GLOSSY
            let my_lobe = load_vpl_lobe(first + lane);
#endif
#if PHASORS
            let my_phase = phase_of(mine);
#endif
#repeat LANE 8
            accumulate(
                vpl_of_LANE(mine),
#if GLOSSY
                lobe_of_LANE(my_lobe),
#endif
#if PHASORS
                phase_of_LANE(my_phase),
#endif
            );
#endrepeat
#endif
#if BROADCAST4
            let mine = fetch_vpl(first + lane);
#if GLOSSY
            let my_lobe = load_vpl_lobe(first + lane);
#endif
#if PHASORS
            let my_phase = phase_of(mine);
#endif
#repeat LANE 4
            accumulate(
                vpl_of_LANE(mine),
#if GLOSSY
                lobe_of_LANE(my_lobe),
#endif
#if PHASORS
                phase_of_LANE(my_phase),
#endif
            );
#endrepeat
#endif
#if TILE
            workgroupBarrier();
            fetched[local] = fetch_vpl(first + local);
#if GLOSSY
            fetched_lobes[local] = load_vpl_lobe(first + local);
#endif
#if PHASORS
            fetched_phases[local] = phase_of(fetched[local]);
#endif
            workgroupBarrier();
            for (var i = 0u; i < FETCH_VPLS; i++) {
                accumulate(
                    fetched[i],
#if GLOSSY
                    fetched_lobes[i],
#endif
#if PHASORS
                    fetched_phases[i],
#endif
                );
            }
#endif
        }
        for (var i = 0u; i < RECEIVERS; i++) {
            diffuse[i] += tile_diffuse[i];
#if PHONG
            specular[i] += tile_specular[i];
#endif
#if PHASORS
            diffuse_phasors[i] = sum_of(diffuse_phasors[i], tile_diffuse_phasors[i]);
#if PHONG
            specular_phasors[i] = sum_of(specular_phasors[i], tile_specular_phasors[i]);
#endif
#endif
        }
    }

    var sign = 1.0;
#if RADIOSITY
    sign = -1.0;
#endif
    for (var i = 0u; i < RECEIVERS; i++) {
        diffuse[i] *= sign;
#if PHONG
        specular[i] *= sign;
#endif
        let slot = first_slot + i * WORKGROUP;
        if (slot < parameters.receiver_count) {
            let place = RESULT_VECTORS * (parameters.first_result + slot);
            let is_first = parameters.is_first == 1u;
            results[place] = select(results[place], vec4<f32>(0.0), is_first) + vec4<f32>(diffuse_factor(vec3<f32>(1.0)) * diffuse[i], 0.0);
            var specular_sum = vec3<f32>(0.0);
#if PHONG
            specular_sum = specular_factor(vec3<f32>(1.0), lobe[i].shininess) * specular[i];
#endif
            results[place + 1u] = select(results[place + 1u], vec4<f32>(0.0), is_first) + vec4<f32>(specular_sum, 0.0);
#if PHASORS
            let receiver = parameters.first_result + slot;
            keep_phasors(diffuse_phasors[i], sign * diffuse_factor(vec3<f32>(1.0)).x, 0u, receiver);
            var lobe_sum = PhasorSum();
            var lobe_factor = 0.0;
#if PHONG
            lobe_sum = specular_phasors[i];
            lobe_factor = sign * specular_factor(vec3<f32>(1.0), lobe[i].shininess).x;
#endif
            keep_phasors(lobe_sum, lobe_factor, 1u, receiver);
#endif
        }
    }
}

#if BROADCAST8 BROADCAST4
#repeat LANE 8
fn vpl_of_LANE(mine: Vpl) -> Vpl {
    return Vpl(subgroupBroadcast(mine.position, LANEu), subgroupBroadcast(mine.density, LANEu),
        subgroupBroadcast(mine.normal, LANEu), subgroupBroadcast(mine.diffuse, LANEu));
}

#if PHASORS
fn phase_of_LANE(mine: VplPhase) -> VplPhase {
    return VplPhase(subgroupBroadcast(mine.turns, LANEu), subgroupBroadcast(mine.along_surface, LANEu), subgroupBroadcast(mine.damping, LANEu));
}
#endif

fn lobe_of_LANE(mine: VplLobe) -> VplLobe {
    return VplLobe(subgroupBroadcast(mine.specular, LANEu), broadcast_of_LANE(mine.lobe));
}
#endrepeat
#endif
