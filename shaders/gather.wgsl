// Sums over all VPLs: tiled accumulation. Each invocation keeps a handful of receivers in registers and sweeps the
// VPLs past them; each VPL is fetched once per subgroup or workgroup.
//
// The sum has three levels (tile, dispatch, result), so that its rounding does not grow with the number of VPLs.

#import vpl_list

// Receivers of an invocation, chosen by measurement: more hide the latency of the division, fewer spill registers.
#if PHONG GLOSSY
const RECEIVERS: u32 = 4u;
#else
const RECEIVERS: u32 = 8u;
#endif
// VPLs summed before their sum is added to the dispatch's. Dispatches cover a multiple of it.
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
    // Into the list of receivers.
    first_receiver: u32,
    receiver_count: u32,
    first_vpl: u32,
    vpl_count: u32,
    // Where the results begin, and whether this is the first dispatch of these receivers.
    first_result: u32,
    is_first: u32,
}

var position_mesh: texture_2d<f32>;
var normal_geometric: texture_2d<f32>;
var ks_shininess: texture_2d<f32>;
// Two a receiver: what it reflects by its diffuse and by its specular lobe, as if k_d and k_s were 1.
var<storage, read_write> results: array<vec4<f32>>;
var<storage, read> receivers: array<u32>;
var<immediate> parameters: GatherParameters;

// Pixel, P, n_P, the lobe towards the camera, and the sums of the receivers.
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

// One VPL against every receiver. No branches: on a vector unit they skip nothing. In stages, each over all receivers, so
// that the long chains of the lobes run side by side: 17 % faster than receiver by receiver.
#if GLOSSY
fn accumulate(vpl: Vpl, vpl_lobe: VplLobe) {
#else
fn accumulate(vpl: Vpl) {
#endif
    var radiance: array<vec3<f32>, RECEIVERS>;
    var direction: array<vec3<f32>, RECEIVERS>;
    for (var i = 0u; i < RECEIVERS; i++) {
        let offset = vpl.position - position[i];
        let distance_squared = dot(offset, offset);
        let receiver_side = max(dot(normal[i], offset), 0.0);
        // Negative where P lies above Q's horizon: negating costs the inner loop more than min does.
        let behind_vpl = dot(vpl.normal, offset);
#if AVERAGE PHONG GLOSSY
        let inverse_distance = inverseSqrt(max(distance_squared, 1e-18));
#endif
#if AVERAGE
        // cosθ_{P→Q}, and f_Q = 0 below Q's horizon.
        let weight = select(0.0, receiver_side * inverse_distance, behind_vpl < 0.0);
#else
        // −cosθ_{P→Q}·cosθ_{Q→P}/d²; the sign is taken back at the end. P = Q gives 0 · 1e36.
#if PHONG GLOSSY
        let inverse_squared = inverse_distance * inverse_distance;
        let weight = receiver_side * min(behind_vpl, 0.0) * (inverse_squared * inverse_squared);
#else
        // One division and no root.
        let weight = receiver_side * min(behind_vpl, 0.0) / (distance_squared * distance_squared + 1e-37);
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
    }
#if GLOSSY
    for (var i = 0u; i < RECEIVERS; i++) {
        radiance[i] *= vpl.diffuse + vpl_lobe.specular * eval_lobe(vpl_lobe.lobe, -direction[i]);
    }
#endif
    for (var i = 0u; i < RECEIVERS; i++) {
        tile_diffuse[i] += radiance[i];
#if PHONG
        tile_specular[i] += radiance[i] * eval_lobe(lobe[i], direction[i]);
#endif
    }
}

// The last fetch may go beyond the list. What lies there is a VPL of an earlier list: here it faces nothing.
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
    }

    let end = parameters.first_vpl + parameters.vpl_count;
    for (var tile = parameters.first_vpl; tile < end; tile += TILE_VPLS) {
        for (var i = 0u; i < RECEIVERS; i++) {
            tile_diffuse[i] = vec3<f32>(0.0);
#if PHONG
            tile_specular[i] = vec3<f32>(0.0);
#endif
        }
        let tile_end = min(tile + TILE_VPLS, end);
        for (var first = tile; first < tile_end; first += FETCH_VPLS) {
#if BROADCAST8
            let mine = fetch_vpl(first + lane);
#if GLOSSY
            let my_lobe = load_vpl_lobe(first + lane);
#repeat LANE 8
            accumulate(vpl_of_LANE(mine), lobe_of_LANE(my_lobe));
#endrepeat
#else
#repeat LANE 8
            accumulate(vpl_of_LANE(mine));
#endrepeat
#endif
#endif
#if BROADCAST4
            let mine = fetch_vpl(first + lane);
#if GLOSSY
            let my_lobe = load_vpl_lobe(first + lane);
#repeat LANE 4
            accumulate(vpl_of_LANE(mine), lobe_of_LANE(my_lobe));
#endrepeat
#else
#repeat LANE 4
            accumulate(vpl_of_LANE(mine));
#endrepeat
#endif
#endif
#if TILE
            workgroupBarrier();
            fetched[local] = fetch_vpl(first + local);
#if GLOSSY
            fetched_lobes[local] = load_vpl_lobe(first + local);
#endif
            workgroupBarrier();
            for (var i = 0u; i < FETCH_VPLS; i++) {
#if GLOSSY
                accumulate(fetched[i], fetched_lobes[i]);
#else
                accumulate(fetched[i]);
#endif
            }
#endif
        }
        for (var i = 0u; i < RECEIVERS; i++) {
            diffuse[i] += tile_diffuse[i];
#if PHONG
            specular[i] += tile_specular[i];
#endif
        }
    }

    for (var i = 0u; i < RECEIVERS; i++) {
#if RADIOSITY
        diffuse[i] = -diffuse[i];
#if PHONG
        specular[i] = -specular[i];
#endif
#endif
        let slot = first_slot + i * WORKGROUP;
        if (slot < parameters.receiver_count) {
            let place = 2u * (parameters.first_result + slot);
            let is_first = parameters.is_first == 1u;
            results[place] = select(results[place], vec4<f32>(0.0), is_first) + vec4<f32>(diffuse_factor(vec3<f32>(1.0)) * diffuse[i], 0.0);
            var specular_sum = vec3<f32>(0.0);
#if PHONG
            specular_sum = specular_factor(vec3<f32>(1.0), lobe[i].shininess) * specular[i];
#endif
            results[place + 1u] = select(results[place + 1u], vec4<f32>(0.0), is_first) + vec4<f32>(specular_sum, 0.0);
        }
    }
}

#if BROADCAST8 BROADCAST4
#repeat LANE 8
fn vpl_of_LANE(mine: Vpl) -> Vpl {
    return Vpl(subgroupBroadcast(mine.position, LANEu), subgroupBroadcast(mine.density, LANEu),
        subgroupBroadcast(mine.normal, LANEu), subgroupBroadcast(mine.diffuse, LANEu));
}

fn lobe_of_LANE(mine: VplLobe) -> VplLobe {
    return VplLobe(subgroupBroadcast(mine.specular, LANEu), broadcast_of_LANE(mine.lobe));
}
#endrepeat
#endif
