// Sums over all VPLs by tiled accumulation. Each invocation keeps a few receivers in registers and loops over the VPLs. Each VPL is fetched
// once per subgroup or workgroup.
//
// The sum has three levels (tile, dispatch, result), so its rounding error does not grow with the number of VPLs.

#import vpl_list
#import signal
#import results

// Whether a VPL or a receiver may have a lobe.
const HAS_LOBES: bool = SPECULAR || GLOSSY;
// Receivers per invocation, chosen by measurement: more receivers hide the latency of the division, but too many spill registers.
const RECEIVERS: u32 = select(8u, 4u, HAS_LOBES);
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

var position_instance: texture_2d<f32>;
var normal_geometric: texture_2d<f32>;
var lobe_parameters: texture_2d<f32>;
// The light of the list of VPLs.
var<uniform> light: Light;
var<storage, read> receivers: array<u32>;
var<immediate> parameters: GatherParameters;

// Per receiver: pixel, P, n_P, the lobe towards the camera, and the sums.
var<private> pixel: array<vec2<u32>, RECEIVERS>;
var<private> position: array<vec3<f32>, RECEIVERS>;
var<private> normal: array<vec3<f32>, RECEIVERS>;
var<private> lobe: array<Lobe, RECEIVERS>;
var<private> tile_diffuse: array<Signal, RECEIVERS>;
var<private> tile_specular: array<Signal, RECEIVERS>;
var<private> diffuse: array<Signal, RECEIVERS>;
var<private> specular: array<Signal, RECEIVERS>;

// Modulation of the light that a VPL reflects.
struct VplPhase {
    // Of the path from L.
    turns: Frequencies,
    // Component of the direction to L along the surface.
    along_surface: vec3<f32>,
    // Logarithm of the factor that reduces Z because paths over the VPL's area differ in length, for a length gradient of 1.
    damping: Frequencies,
}

fn phase_of(vpl: Vpl) -> VplPhase {
    var phase: VplPhase;
    if (PHASORS) {
        let offset = light.position - vpl.position;
        // Entries after the end of a list may be at the light's position.
        let to_light = offset * inverseSqrt(max(dot(offset, offset), 1e-18));
        // Over a square of edge e, Z is its value at the centre times sinc(π·f/c·e·gradient), which e^(−x²/6) approximates.
        let turns_per_edge = of_frequencies(modulation.turns_per_unit) * (PI * sqrt(vpl.density));
        phase.turns = of_frequencies(turns_from_light(light, vpl.position));
        phase.along_surface = to_light - dot(to_light, vpl.normal) * vpl.normal;
        phase.damping = turns_per_edge * turns_per_edge * (-1.0 / 6.0);
    }
    return phase;
}

// Adds one VPL to every receiver. There are no branches, because on a vector unit they skip nothing. Each stage loops over all receivers,
// so that the long dependency chains of the lobes overlap: 17 % faster than receiver by receiver.
fn accumulate(vpl: Vpl, vpl_lobe: VplLobe, phase: VplPhase) {
    var phasors: array<Phasors, RECEIVERS>;
    var radiance: array<vec3<f32>, RECEIVERS>;
    var direction: array<vec3<f32>, RECEIVERS>;
    let gradient_at_normal = 1.0 + dot(phase.along_surface, phase.along_surface);
    for (var i = 0u; i < RECEIVERS; i++) {
        let offset = vpl.position - position[i];
        let distance_squared = dot(offset, offset);
        let receiver_side = max(dot(normal[i], offset), 0.0);
        // Negative where P is above Q's horizon. The sign stays, because negating costs the inner loop more than min does.
        let behind_vpl = dot(vpl.normal, offset);
        let inverse_distance = inverseSqrt(max(distance_squared, 1e-18));
        if (HAS_LOBES) {
            direction[i] = offset * inverse_distance;
        }
        var weight: f32;
        if (AVERAGE) {
            // cosθ_{P→Q}, and f_Q = 0 below Q's horizon.
            weight = select(0.0, receiver_side * inverse_distance, behind_vpl < 0.0);
        } else if (HAS_LOBES) {
            // −cosθ_{P→Q}·cosθ_{Q→P}/d². The sign is removed at the end. P = Q gives 0 · 1e36.
            let inverse_squared = inverse_distance * inverse_distance;
            weight = receiver_side * min(behind_vpl, 0.0) * (inverse_squared * inverse_squared);
        } else {
            // The same with one division and no square root.
            weight = receiver_side * min(behind_vpl, 0.0) / (distance_squared * distance_squared + 1e-37);
        }
        if (GLOSSY) {
            radiance[i] = vec3<f32>(weight);
        } else {
            radiance[i] = vpl.diffuse * weight;
        }
        if (PHASORS) {
            let cosine = behind_vpl * inverse_distance;
            let gradient_squared = max(gradient_at_normal - 2.0 * inverse_distance * dot(phase.along_surface, offset) - cosine * cosine, 0.0);
            let path = phasors_of(phase.turns + of_frequencies(modulation.turns_per_unit) * (distance_squared * inverse_distance));
            let left = f32(light.is_modulated) * exp(phase.damping * gradient_squared);
            phasors[i] = Phasors(left * path.re, left * path.im);
        }
    }
    if (GLOSSY) {
        for (var i = 0u; i < RECEIVERS; i++) {
            radiance[i] *= vpl.diffuse + vpl_lobe.specular * eval_lobe(vpl_lobe.lobe, -direction[i]);
        }
    }
    for (var i = 0u; i < RECEIVERS; i++) {
        tile_diffuse[i] = add_modulated(tile_diffuse[i], radiance[i], phasors[i]);
        if (SPECULAR) {
            let in_lobe = radiance[i] * eval_lobe(lobe[i], direction[i]);
            tile_specular[i] = add_modulated(tile_specular[i], in_lobe, phasors[i]);
        }
    }
}

// The last fetch may go beyond the list. It then reads a VPL of an earlier list. With a normal of 0, that VPL faces nothing.
fn fetch_vpl(index: u32) -> Vpl {
    var vpl = load_vpl(index);
    let is_listed = index < parameters.first_vpl + parameters.vpl_count;
    vpl.normal = select(vec3<f32>(0.0), vpl.normal, is_listed);
    return vpl;
}

fn fetch_lobe(index: u32) -> VplLobe {
    if (GLOSSY) {
        return load_vpl_lobe(index);
    } else {
        return VplLobe();
    }
}

#if TILE
var<workgroup> fetched: array<Vpl, FETCH_VPLS>;
var<workgroup> fetched_lobes: array<VplLobe, FETCH_VPLS>;
var<workgroup> fetched_phases: array<VplPhase, FETCH_VPLS>;

fn fetched_lobe(index: u32) -> VplLobe {
    if (GLOSSY) {
        return fetched_lobes[index];
    } else {
        return VplLobe();
    }
}

fn fetched_phase(index: u32) -> VplPhase {
    if (PHASORS) {
        return fetched_phases[index];
    } else {
        return VplPhase();
    }
}

// The VPLs from `first` on, through the memory of the workgroup.
fn accumulate_fetched(first: u32, local: u32, lane: u32) {
    workgroupBarrier();
    fetched[local] = fetch_vpl(first + local);
    if (GLOSSY) {
        fetched_lobes[local] = fetch_lobe(first + local);
    }
    if (PHASORS) {
        fetched_phases[local] = phase_of(fetched[local]);
    }
    workgroupBarrier();
    for (var i = 0u; i < FETCH_VPLS; i++) {
        accumulate(fetched[i], fetched_lobe(i), fetched_phase(i));
    }
}
#else
// The VPLs from `first` on, from lane to lane of the subgroup.
fn accumulate_fetched(first: u32, local: u32, lane: u32) {
    let mine = fetch_vpl(first + lane);
    let my_lobe = fetch_lobe(first + lane);
    let my_phase = phase_of(mine);
#repeat LANE FETCH_VPLS
    accumulate(vpl_of_LANE(mine), lobe_of_LANE(my_lobe), phase_of_LANE(my_phase));
#endrepeat
}

#repeat LANE FETCH_VPLS
fn vpl_of_LANE(mine: Vpl) -> Vpl {
    return Vpl(subgroupBroadcast(mine.position, LANEu), subgroupBroadcast(mine.density, LANEu), subgroupBroadcast(mine.normal, LANEu),
        mine.is_modulated, subgroupBroadcast(mine.diffuse, LANEu), mine.base_share);
}

fn lobe_of_LANE(mine: VplLobe) -> VplLobe {
    if (GLOSSY) {
        return VplLobe(subgroupBroadcast(mine.specular, LANEu), broadcast_of_LANE(mine.lobe));
    } else {
        return mine;
    }
}

fn phase_of_LANE(mine: VplPhase) -> VplPhase {
    if (PHASORS) {
        return VplPhase(subgroupBroadcast(mine.turns, LANEu), subgroupBroadcast(mine.along_surface, LANEu),
            subgroupBroadcast(mine.damping, LANEu));
    } else {
        return mine;
    }
}
#endrepeat
#endif

fn pixel_of(slot: u32) -> vec2<u32> {
    let last = parameters.first_receiver + parameters.receiver_count - 1u;
    let packed = receivers[min(parameters.first_receiver + slot, last)];
    return vec2<u32>(packed & 0xffffu, packed >> 16u);
}

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
        position[i] = textureLoad(position_instance, pixel[i], 0).xyz;
        normal[i] = textureLoad(normal_geometric, pixel[i], 0).xyz;
        diffuse[i] = Signal();
        if (SPECULAR) {
            specular[i] = Signal();
            let to_camera = normalize(parameters.camera_position - position[i]);
            lobe[i] = lobe_of(to_camera, normal[i], textureLoad(lobe_parameters, pixel[i], 0));
        }
    }

    let end = parameters.first_vpl + parameters.vpl_count;
    for (var tile = parameters.first_vpl; tile < end; tile += TILE_VPLS) {
        for (var i = 0u; i < RECEIVERS; i++) {
            tile_diffuse[i] = Signal();
            if (SPECULAR) {
                tile_specular[i] = Signal();
            }
        }
        let tile_end = min(tile + TILE_VPLS, end);
        for (var first = tile; first < tile_end; first += FETCH_VPLS) {
            accumulate_fetched(first, local, lane);
        }
        for (var i = 0u; i < RECEIVERS; i++) {
            diffuse[i] = add_signals(diffuse[i], tile_diffuse[i]);
            if (SPECULAR) {
                specular[i] = add_signals(specular[i], tile_specular[i]);
            }
        }
    }

    var sign = 1.0;
    if (RADIOSITY) {
        sign = -1.0;
    }
    let is_first = parameters.is_first == 1u;
    for (var i = 0u; i < RECEIVERS; i++) {
        let slot = first_slot + i * WORKGROUP;
        if (slot < parameters.receiver_count) {
            let receiver = parameters.first_result + slot;
            let diffuse_scale = sign * diffuse_factor(vec3<f32>(1.0));
            add_to_result(receiver, 0u, scaled_signal(diffuse[i], diffuse_scale), 0.0, is_first);
            var reflected: Signal;
            if (SPECULAR) {
                reflected = scaled_signal(specular[i], vec3<f32>(sign * unit_specular_factor(lobe[i])));
            }
            add_to_result(receiver, 1u, reflected, 0.0, is_first);
        }
    }
}
