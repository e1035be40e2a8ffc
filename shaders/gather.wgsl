// Sums over all VPLs: tiled accumulation. Each invocation keeps a handful of receivers in registers and sweeps the
// VPLs past them; each VPL is fetched once per subgroup or workgroup.
//
// The sum has three levels (tile, dispatch, result), so that its rounding does not grow with the number of VPLs.

#import lighting
#import phong

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
// Two a receiver: diffuse, specular, before f_P.
var<storage, read_write> results: array<vec4<f32>>;
var<storage, read> receivers: array<u32>;
// The layers are those of VPL_LAYERS or GLOSSY_VPL_LAYERS.
var vpls: texture_2d_array<f32>;
var<immediate> parameters: GatherParameters;

// Pixel, P, n_P, the mirror direction of v, s, and the sums of the receivers.
var<private> pixel: array<vec2<u32>, RECEIVERS>;
var<private> position: array<vec3<f32>, RECEIVERS>;
var<private> normal: array<vec3<f32>, RECEIVERS>;
var<private> tile_diffuse: array<vec3<f32>, RECEIVERS>;
var<private> diffuse: array<vec3<f32>, RECEIVERS>;
#if PHONG
var<private> mirror: array<vec3<f32>, RECEIVERS>;
var<private> shininess: array<f32, RECEIVERS>;
var<private> tile_specular: array<vec3<f32>, RECEIVERS>;
var<private> specular: array<vec3<f32>, RECEIVERS>;
#endif

// One VPL against every receiver. No branches: on a vector unit they skip nothing. In stages, each over all receivers, so
// that the long chains of the lobes run side by side: 17 % faster than receiver by receiver.
#if GLOSSY
fn accumulate(vpl: GlossyVpl) {
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
        radiance[i] *= vpl.diffuse + vpl.specular * phong_lobe(vpl.mirror, -direction[i], vpl.shininess);
    }
#endif
    for (var i = 0u; i < RECEIVERS; i++) {
        tile_diffuse[i] += radiance[i];
#if PHONG
        tile_specular[i] += radiance[i] * phong_lobe(mirror[i], direction[i], shininess[i]);
#endif
    }
}

// The last fetch may go beyond the list: what lies there is a VPL of an earlier list.
fn is_listed(index: u32) -> bool {
    return index < parameters.first_vpl + parameters.vpl_count;
}

#if GLOSSY
fn load_vpl(index: u32) -> GlossyVpl {
    let place = vpl_place(index);
    let specular_shininess = textureLoad(vpls, place, 3, 0);
    let is_listed = is_listed(index);
    return GlossyVpl(
        textureLoad(vpls, place, 0, 0).xyz, specular_shininess.w, textureLoad(vpls, place, 1, 0).xyz,
        select(vec3<f32>(0.0), textureLoad(vpls, place, 2, 0).xyz, is_listed),
        select(vec3<f32>(0.0), specular_shininess.xyz, is_listed), textureLoad(vpls, place, 4, 0).xyz);
}
#else
fn load_vpl(index: u32) -> Vpl {
    let place = vpl_place(index);
    return Vpl(textureLoad(vpls, place, 0, 0).xyz, textureLoad(vpls, place, 1, 0).xyz,
        select(vec3<f32>(0.0), textureLoad(vpls, place, 2, 0).xyz, is_listed(index)));
}
#endif

fn pixel_of(slot: u32) -> vec2<u32> {
    let last = parameters.first_receiver + parameters.receiver_count - 1u;
    let packed = receivers[min(parameters.first_receiver + slot, last)];
    return vec2<u32>(packed & 0xffffu, packed >> 16u);
}

#if TILE
#if GLOSSY
var<workgroup> fetched: array<GlossyVpl, FETCH_VPLS>;
#else
var<workgroup> fetched: array<Vpl, FETCH_VPLS>;
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
        // r·v is symmetric: the mirror of l against v is the mirror of v against l.
        mirror[i] = 2.0 * dot(normal[i], to_camera) * normal[i] - to_camera;
        shininess[i] = textureLoad(ks_shininess, pixel[i], 0).w;
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
            let mine = load_vpl(first + lane);
#repeat LANE 8
            accumulate(from_lane_LANE(mine));
#endrepeat
#endif
#if BROADCAST4
            let mine = load_vpl(first + lane);
#repeat LANE 4
            accumulate(from_lane_LANE(mine));
#endrepeat
#endif
#if TILE
            workgroupBarrier();
            fetched[local] = load_vpl(first + local);
            workgroupBarrier();
            for (var i = 0u; i < FETCH_VPLS; i++) {
                accumulate(fetched[i]);
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
            results[place] = select(results[place], vec4<f32>(0.0), is_first) + vec4<f32>(diffuse[i], 0.0);
            var specular_sum = vec3<f32>(0.0);
#if PHONG
            specular_sum = specular[i];
#endif
            results[place + 1u] = select(results[place + 1u], vec4<f32>(0.0), is_first) + vec4<f32>(specular_sum, 0.0);
        }
    }
}

#if BROADCAST8 BROADCAST4
#repeat LANE 8
#if GLOSSY
fn from_lane_LANE(mine: GlossyVpl) -> GlossyVpl {
    return GlossyVpl(
        subgroupBroadcast(mine.position, LANEu), subgroupBroadcast(mine.shininess, LANEu),
        subgroupBroadcast(mine.normal, LANEu), subgroupBroadcast(mine.diffuse, LANEu),
        subgroupBroadcast(mine.specular, LANEu), subgroupBroadcast(mine.mirror, LANEu));
}
#else
fn from_lane_LANE(mine: Vpl) -> Vpl {
    return Vpl(
        subgroupBroadcast(mine.position, LANEu), subgroupBroadcast(mine.normal, LANEu),
        subgroupBroadcast(mine.diffuse, LANEu));
}
#endif
#endrepeat
#endif
