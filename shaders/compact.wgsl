// Stable compaction of items into two lists, in three kernels: count per group, scan over groups, write. An append by
// atomics would be one kernel, but its order, and with it the last bits of every sum, would change from run to run.
//
// The file that comes after this one gives list_of(item) and place(item, list, index).

const GROUP: u32 = 256u;
const NOTHING: u32 = 0u;
const MATTE: u32 = 1u;
const GLOSSY: u32 = 2u;

struct ListLengths {
    matte: u32,
    glossy: u32,
}

struct Compaction {
    item_count: u32,
    group_count: u32,
}

@group(0) @binding(0) var<storage, read_write> groups: array<ListLengths>;
@group(0) @binding(1) var<storage, read_write> lengths: ListLengths;
var<immediate> compaction: Compaction;

#if COUNT
var<workgroup> matte_in_group: atomic<u32>;
var<workgroup> glossy_in_group: atomic<u32>;

@compute @workgroup_size(256)
fn compute_main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    if (local == 0u) {
        atomicStore(&matte_in_group, 0u);
        atomicStore(&glossy_in_group, 0u);
    }
    workgroupBarrier();
    if (id.x < compaction.item_count) {
        let list = list_of(id.x);
        if (list == MATTE) {
            atomicAdd(&matte_in_group, 1u);
        }
        if (list == GLOSSY) {
            atomicAdd(&glossy_in_group, 1u);
        }
    }
    workgroupBarrier();
    if (local == 0u) {
        groups[group.x] = ListLengths(atomicLoad(&matte_in_group), atomicLoad(&glossy_in_group));
    }
}
#endif

#if SCAN
var<workgroup> sums: array<vec2<u32>, GROUP>;

// One workgroup: each invocation turns a run of group counts into the groups' first places.
@compute @workgroup_size(256)
fn compute_main(@builtin(local_invocation_index) local: u32) {
    let run = (compaction.group_count + GROUP - 1u) / GROUP;
    let first = min(local * run, compaction.group_count);
    let end = min(first + run, compaction.group_count);
    var sum = vec2<u32>(0u);
    for (var i = first; i < end; i++) {
        sum += vec2<u32>(groups[i].matte, groups[i].glossy);
    }
    sums[local] = sum;
    workgroupBarrier();
    var place = vec2<u32>(0u);
    for (var i = 0u; i < local; i++) {
        place += sums[i];
    }
    for (var i = first; i < end; i++) {
        let count = vec2<u32>(groups[i].matte, groups[i].glossy);
        groups[i] = ListLengths(place.x, place.y);
        place += count;
    }
    if (local == GROUP - 1u) {
        lengths = ListLengths(place.x, place.y);
    }
}
#endif

#if WRITE
// One bit an invocation: the rank of an item is the number of bits before its own.
var<workgroup> matte_bits: array<atomic<u32>, 8>;
var<workgroup> glossy_bits: array<atomic<u32>, 8>;

@compute @workgroup_size(256)
fn compute_main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    if (local < 8u) {
        atomicStore(&matte_bits[local], 0u);
        atomicStore(&glossy_bits[local], 0u);
    }
    workgroupBarrier();
    var list = NOTHING;
    if (id.x < compaction.item_count) {
        list = list_of(id.x);
    }
    let word = local / 32u;
    let bit = 1u << (local % 32u);
    if (list == MATTE) {
        atomicOr(&matte_bits[word], bit);
    }
    if (list == GLOSSY) {
        atomicOr(&glossy_bits[word], bit);
    }
    workgroupBarrier();
    var before = vec2<u32>(groups[group.x].matte, groups[group.x].glossy);
    for (var i = 0u; i <= word; i++) {
        let mask = select(0xffffffffu, bit - 1u, i == word);
        before.x += countOneBits(atomicLoad(&matte_bits[i]) & mask);
        before.y += countOneBits(atomicLoad(&glossy_bits[i]) & mask);
    }
    if (list == MATTE) {
        place(id.x, MATTE, before.x);
    }
    if (list == GLOSSY) {
        place(id.x, GLOSSY, before.y);
    }
}
#endif
