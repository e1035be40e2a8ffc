// Stable compaction of items into two lists, in three kernels: count, scan, write. Appending with atomics needs only one kernel. But its
// order changes between runs, and so do the last bits of every sum.
//
// Each invocation takes a run of neighbouring items, so it needs neither barriers nor atomics. The importing file defines list_of(item) and
// place(item, list, index).

const RUN_ITEMS: u32 = 64u;
const NOTHING: u32 = 0u;
const MATTE_LIST: u32 = 1u;
const GLOSSY_LIST: u32 = 2u;

struct ListLengths {
    matte: u32,
    glossy: u32,
}

struct Compaction {
    item_count: u32,
    run_count: u32,
    // Receivers pass only: pixels between the points of the grid whose points are the items; 0: the items are listed.
    grid_stride: u32,
}

// Number of items of each run; after the scan, the index of each run's first items.
var<storage, read_write> runs: array<ListLengths>;
var<storage, read_write> lengths: ListLengths;
var<immediate> compaction: Compaction;

#if COUNT
@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let run = id.x;
    if (run >= compaction.run_count) {
        return;
    }
    let end = min((run + 1u) * RUN_ITEMS, compaction.item_count);
    var matte = 0u;
    var glossy = 0u;
    for (var item = run * RUN_ITEMS; item < end; item++) {
        let list = list_of(item);
        matte += u32(list == MATTE_LIST);
        glossy += u32(list == GLOSSY_LIST);
    }
    runs[run] = ListLengths(matte, glossy);
}
#endif

#if SCAN
const SCANNERS: u32 = 256u;
var<workgroup> sums: array<vec2<u32>, SCANNERS>;

// One workgroup. Each invocation turns a stretch of counts into indices.
@compute @workgroup_size(256)
fn compute_main(@builtin(local_invocation_index) local: u32) {
    let stretch = (compaction.run_count + SCANNERS - 1u) / SCANNERS;
    let first = min(local * stretch, compaction.run_count);
    let end = min(first + stretch, compaction.run_count);
    var sum = vec2<u32>(0u);
    for (var i = first; i < end; i++) {
        sum += vec2<u32>(runs[i].matte, runs[i].glossy);
    }
    sums[local] = sum;
    workgroupBarrier();
    var place = vec2<u32>(0u);
    for (var i = 0u; i < local; i++) {
        place += sums[i];
    }
    for (var i = first; i < end; i++) {
        let count = vec2<u32>(runs[i].matte, runs[i].glossy);
        runs[i] = ListLengths(place.x, place.y);
        place += count;
    }
    if (local == SCANNERS - 1u) {
        lengths = ListLengths(place.x, place.y);
    }
}
#endif

#if WRITE
@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let run = id.x;
    if (run >= compaction.run_count) {
        return;
    }
    let end = min((run + 1u) * RUN_ITEMS, compaction.item_count);
    var matte = runs[run].matte;
    var glossy = runs[run].glossy;
    for (var item = run * RUN_ITEMS; item < end; item++) {
        let list = list_of(item);
        if (list == MATTE_LIST) {
            place(item, MATTE_LIST, matte);
            matte++;
        }
        if (list == GLOSSY_LIST) {
            place(item, GLOSSY_LIST, glossy);
            glossy++;
        }
    }
}
#endif
