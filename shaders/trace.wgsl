// Rays among all triangles, RAYS of them per lane that start at one origin. See src/ray_tree.rs for what the images hold.
//
// A packet meets the triangles that stand alone one after the other: what depends on the origin and the triangle but not
// on the direction is worked out once, a triangle per lane, and broadcast. The other triangles lie in trees. The few rays
// of a packet that meet a tree's box go through it one by one, the lanes being the eight boxes of a node or the eight
// triangles of a leaf.
//
// Everything is meant to be right but for rounding, of which u = 2^-24 is the unit: errors are bounded as in Pharr, Jakob,
// Humphreys, "Physically Based Rendering", section "Managing rounding error".

@group(0) @binding(9) var ray_boxes: texture_2d<f32>;
@group(0) @binding(10) var ray_triangles: texture_2d<f32>;

// Rays of a lane.
const RAYS: u32 = 8u;
// Texels of a row of the images, as a shift.
const ROW_SHIFT: u32 = 10u;
const ROW_MASK: u32 = 1023u;
const NOTHING_HIT: u32 = 0xffffffffu;
// A child that waits: distance at which the ray enters its box, coarsely (7 bits), LEAF, its index.
const NONE: u32 = 0xffffffffu;
const LEAF: u32 = 0x1000000u;
const INDEX: u32 = 0xffffffu;
// What a box is of, beside its high corner; 0 where there is none.
const OF_LEAF: f32 = 2.0;

// By how much a ray starts before P's surface, for each component of the normal. P = v0 + b1·e1 + b2·e2 is off its plane by up to
// 10u: 4u for each of b1·e1 + b2·e2 ≤ 2, and 2u for v0 ≤ 1. Corners of a neighbour in the same plane are u off it, in either
// direction, the shift is rounded by u, and the height of the ray's origin over a plane is off by 5u of an offset ≤ 2.
const ORIGIN_SHIFT: f32 = 24.0 * 5.9604645e-8;
// By how much a ray ends before Q's surface: its end's height over the plane is the difference of two that are off by 10u
// each, and their quotient is rounded by 3u of an offset ≤ 2.
const END_SHIFT: f32 = 40.0 * 5.9604645e-8;
// A box is left no earlier than this much later than computed: 2·γ(4).
const LATER: f32 = 1.0 + 8.0 * 5.9604645e-8;

// Each ray's direction, whose length is the unit of its distances.
var<private> ray_direction: array<vec3<f32>, RAYS>;
// 1 / distance of the nearest hit so far. To be set before: 1 where the ray ends at its direction's head, 0 where it does
// not end, NOT_WANTED where it is none.
var<private> ray_nearness: array<f32, RAYS>;
// The triangle that was hit, for scene_triangle; or NOTHING_HIT.
var<private> ray_hit: array<u32, RAYS>;
const NOT_WANTED: f32 = 1e30;

fn before_surface(position: vec3<f32>, geometric_normal: vec3<f32>, shift: f32) -> vec3<f32> {
    return position + shift * dot(abs(geometric_normal), vec3<f32>(1.0)) * geometric_normal;
}

fn box_texel(index: u32) -> vec4<f32> {
    return textureLoad(ray_boxes, vec2<u32>(index & ROW_MASK, index >> ROW_SHIFT), 0);
}

fn triangle_texel(index: u32) -> vec4<f32> {
    return textureLoad(ray_triangles, vec2<u32>(index & ROW_MASK, index >> ROW_SHIFT), 0);
}

// So that 0 times the inverse is 0 and not NaN.
fn inverse_of(direction: vec3<f32>) -> vec3<f32> {
    return 1.0 / select(direction, vec3<f32>(1e-30), abs(direction) < vec3<f32>(1e-30));
}

// What all rays from one origin share of a triangle.
struct Facet {
    // A direction passes inside the triangle if its product with none of these is negative. Neighbours have exactly
    // opposite ones for their common edge, so that nothing slips between them.
    edge0: vec3<f32>,
    edge1: vec3<f32>,
    edge2: vec3<f32>,
    // Unit normal over the origin's height: its product with a direction is 1 / distance.
    normal: vec3<f32>,
}

fn facet_of(triangle: u32, origin: vec3<f32>) -> Facet {
    let a = triangle_texel(4u * triangle);
    let b = triangle_texel(4u * triangle + 1u);
    let c = triangle_texel(4u * triangle + 2u);
    let normal = vec3<f32>(a.w, b.w, c.w);
    let c0 = a.xyz - origin;
    let c1 = b.xyz - origin;
    let c2 = c.xyz - origin;
    let height = dot(normal, c0);
    let turn = select(-1.0, 1.0, height > 0.0);
    var facet: Facet;
    facet.edge0 = turn * cross(c1 + c2, c2 - c1);
    facet.edge1 = turn * cross(c2 + c0, c0 - c2);
    facet.edge2 = turn * cross(c0 + c1, c1 - c0);
    // The origin in the plane, or a triangle without area: never hit.
    facet.normal = select(normal / height, vec3<f32>(0.0), height == 0.0);
    return facet;
}

// 1 / distance at which a ray hits the triangle; 0 or less: it does not.
fn nearness_of(facet: Facet, direction: vec3<f32>) -> f32 {
    let inside = min(min(dot(facet.edge0, direction), dot(facet.edge1, direction)), dot(facet.edge2, direction));
    return select(0.0, dot(facet.normal, direction), inside >= 0.0);
}

struct BoxSpan {
    enter: f32,
    is_met: bool,
}

// The box is relative to the origin; the ray ends at `reach`.
fn meet_box(low: vec3<f32>, high: vec3<f32>, inverse: vec3<f32>, reach: f32) -> BoxSpan {
    let a = low * inverse;
    let b = high * inverse;
    let enters = min(a, b);
    let leaves = max(a, b);
    let enter = max(max(enters.x, enters.y), max(enters.z, 0.0));
    let leave = min(min(leaves.x, leaves.y), leaves.z) * LATER;
    return BoxSpan(enter, enter <= min(leave, reach));
}

// 7 bits of a distance, in its order: 2^-12 to 2^4 in steps of an eighth.
fn coarse(distance: f32) -> u32 {
    return min(max(bitcast<u32>(distance) >> 20u, 920u) - 920u, 127u);
}

#if PACKET
var<private> lane: u32;

fn least(value: u32) -> u32 {
    return min(
        min(min(subgroupBroadcast(value, 0u), subgroupBroadcast(value, 1u)),
            min(subgroupBroadcast(value, 2u), subgroupBroadcast(value, 3u))),
        min(min(subgroupBroadcast(value, 4u), subgroupBroadcast(value, 5u)),
            min(subgroupBroadcast(value, 6u), subgroupBroadcast(value, 7u))));
}

fn greatest(value: f32) -> f32 {
    return max(
        max(max(subgroupBroadcast(value, 0u), subgroupBroadcast(value, 1u)),
            max(subgroupBroadcast(value, 2u), subgroupBroadcast(value, 3u))),
        max(max(subgroupBroadcast(value, 4u), subgroupBroadcast(value, 5u)),
            max(subgroupBroadcast(value, 6u), subgroupBroadcast(value, 7u))));
}

fn union_of(value: u32) -> u32 {
    return subgroupBroadcast(value, 0u) | subgroupBroadcast(value, 1u) | subgroupBroadcast(value, 2u)
        | subgroupBroadcast(value, 3u) | subgroupBroadcast(value, 4u) | subgroupBroadcast(value, 5u)
        | subgroupBroadcast(value, 6u) | subgroupBroadcast(value, 7u);
}

// The value of one lane, which all name alike.
fn from_lane(value: vec4<f32>, which: u32) -> vec4<f32> {
    var found = subgroupBroadcast(value, 0u);
#repeat LANE 8
    found = select(found, subgroupBroadcast(value, LANEu), which == LANEu);
#endrepeat
    return found;
}

#repeat LANE 8
fn meet_facet_LANE(mine: Facet, first: u32) {
    let facet = Facet(subgroupBroadcast(mine.edge0, LANEu), subgroupBroadcast(mine.edge1, LANEu),
        subgroupBroadcast(mine.edge2, LANEu), subgroupBroadcast(mine.normal, LANEu));
    for (var i = 0u; i < RAYS; i++) {
        let nearness = nearness_of(facet, ray_direction[i]);
        ray_hit[i] = select(ray_hit[i], first + LANEu, nearness > ray_nearness[i]);
        ray_nearness[i] = max(ray_nearness[i], nearness);
    }
}
#endrepeat

// One ray, which all lanes know, on its way through a tree.
var<private> walk_nearness: f32;
var<private> walk_hit: u32;
// Keys of the children that wait, a child per lane: those of the node visited last, and those of nodes above it, where
// some wait.
var<private> waiting: array<u32, 8>;

// Takes the nearest child of those found, or else of those that wait; NONE: there are no more.
fn take_child(found: u32) -> u32 {
    let first_found = least(found);
    let first_waiting = least(waiting[0]);
    let is_down = first_found != NONE;
    let is_pushed = is_down & (first_waiting != NONE);
    let is_popped = !is_down & (first_waiting == NONE);
    let above = waiting[0];
    waiting[0] = select(select(waiting[0], found, is_down), waiting[1], is_popped);
    var pushed = above;
    for (var level = 1u; level < 8u; level++) {
        let here = waiting[level];
        let higher = select(NONE, waiting[min(level + 1u, 7u)], level < 7u);
        waiting[level] = select(select(here, pushed, is_pushed), higher, is_popped);
        pushed = here;
    }
    let taken = select(select(first_waiting, first_found, is_down), least(waiting[0]), is_popped);
    waiting[0] = select(waiting[0], NONE, waiting[0] == taken);
    return taken;
}

// Takes a ray through the tree under a node. A ray that looks for any hit ends at the first.
fn walk(root: u32, origin: vec3<f32>, direction: vec3<f32>, is_any: bool) {
    let inverse = inverse_of(direction);
    for (var level = 0u; level < 8u; level++) {
        waiting[level] = NONE;
    }
    var next = root;
    loop {
        loop {
            // Node 0 has no boxes.
            let child = 16u * select(next & INDEX, 0u, next == NONE) + lane;
            let low = box_texel(child);
            let high = box_texel(child + 8u);
            let reach = 1.0 / walk_nearness;
            let span = meet_box(low.xyz - origin, high.xyz - origin, inverse, reach);
            let key = (coarse(span.enter) << 25u) | select(0u, LEAF, high.w == OF_LEAF) | u32(low.w);
            next = take_child(select(NONE, key, span.is_met & (high.w != 0.0)));
            continuing {
                break if (next & LEAF) != 0u;
            }
        }
        loop {
            let triangle = 8u * select(next & INDEX, 0u, next == NONE) + lane;
            let facet = facet_of(triangle, origin);
            let nearness = select(nearness_of(facet, direction), 0.0, next == NONE);
            let nearest = greatest(nearness);
            let is_nearer = nearest > walk_nearness;
            let hit = least(select(NONE, triangle, nearness == nearest));
            walk_hit = select(walk_hit, hit, is_nearer);
            walk_nearness = max(walk_nearness, nearest);
            next = select(take_child(NONE), NONE, is_any & is_nearer);
            continuing {
                break if (next == NONE) | ((next & LEAF) == 0u);
            }
        }
        continuing {
            break if next == NONE;
        }
    }
}

// Traces the rays of a packet, which are those of the eight lanes of a subgroup. All lanes must come here, with the same
// origin, whether their rays are wanted or not. Afterwards ray_nearness and ray_hit tell what was hit.
fn trace(origin: vec3<f32>, is_any: bool) {
    let header = box_texel(0u);
    let facet_groups = u32(header.x);
    let trees = u32(header.y);
    for (var i = 0u; i < RAYS; i++) {
        ray_hit[i] = NOTHING_HIT;
    }
    var first = 0u;
    loop {
        let mine = facet_of(first + lane, origin);
#repeat LANE 8
        meet_facet_LANE(mine, first);
#endrepeat
        first += 8u;
        continuing {
            break if first >= 8u * facet_groups;
        }
    }

    var tree = 0u;
    loop {
        // Rays that meet the tree's box, four of each lane in a word.
        var low_mask = 0u;
        var high_mask = 0u;
        var root = 0u;
        loop {
            let mine = box_texel(16u + 2u * tree + (lane & 1u));
            root = u32(subgroupBroadcast(mine.w, 0u));
            let is_tree = subgroupBroadcast(mine.w, 1u) != 0.0;
            let low = subgroupBroadcast(mine.xyz, 0u) - origin;
            let high = subgroupBroadcast(mine.xyz, 1u) - origin;
            var low_bits = 0u;
            var high_bits = 0u;
            for (var i = 0u; i < RAYS; i++) {
                let is_open = select(true, ray_nearness[i] <= 1.0, is_any);
                let is_met = meet_box(low, high, inverse_of(ray_direction[i]), 1.0 / ray_nearness[i]).is_met & is_open & is_tree;
                let bit = select(0u, 1u << (8u * (i & 3u)), is_met) << lane;
                if (i < 4u) {
                    low_bits |= bit;
                } else {
                    high_bits |= bit;
                }
            }
            low_mask = union_of(low_bits);
            high_mask = union_of(high_bits);
            tree++;
            continuing {
                break if ((low_mask | high_mask) != 0u) | (tree >= trees);
            }
        }
        if ((low_mask | high_mask) == 0u) {
            break;
        }
        loop {
            let is_low = low_mask != 0u;
            let bit = firstTrailingBit(select(high_mask, low_mask, is_low));
            let slot = (bit >> 3u) + select(4u, 0u, is_low);
            let owner = bit & 7u;
            var ray = vec4<f32>(ray_direction[0], ray_nearness[0]);
            for (var i = 1u; i < RAYS; i++) {
                ray = select(ray, vec4<f32>(ray_direction[i], ray_nearness[i]), slot == i);
            }
            ray = from_lane(ray, owner);
            walk_nearness = ray.w;
            walk_hit = NOTHING_HIT;
            walk(root, origin, ray.xyz, is_any);
            for (var i = 0u; i < RAYS; i++) {
                let is_this = (slot == i) & (owner == lane) & (walk_hit != NOTHING_HIT);
                ray_nearness[i] = select(ray_nearness[i], walk_nearness, is_this);
                ray_hit[i] = select(ray_hit[i], walk_hit, is_this);
            }
            high_mask = select(high_mask & (high_mask - 1u), high_mask, is_low);
            low_mask = low_mask & (low_mask - 1u);
            low_mask = select(0u, low_mask, is_low);
            continuing {
                break if (low_mask | high_mask) == 0u;
            }
        }
        continuing {
            break if tree >= trees;
        }
    }
}
#else
// Traces the rays of one lane. The lanes need not have an origin in common.
fn trace(origin: vec3<f32>, is_any: bool) {
    let header = box_texel(0u);
    let facet_count = 8u * u32(header.x);
    let trees = u32(header.y);
    for (var i = 0u; i < RAYS; i++) {
        ray_hit[i] = NOTHING_HIT;
    }
    for (var triangle = 0u; triangle < facet_count; triangle++) {
        let facet = facet_of(triangle, origin);
        for (var i = 0u; i < RAYS; i++) {
            meet_facet(facet, triangle, i);
        }
    }
    for (var i = 0u; i < RAYS; i++) {
        let inverse = inverse_of(ray_direction[i]);
        for (var tree = 0u; tree < trees; tree++) {
            if (!meets_child(16u + 2u * tree, 1u, origin, inverse, i)) {
                continue;
            }
            // Boxes that wait; at most eight of each of eight levels.
            var waiting: array<u32, 64>;
            waiting[0] = u32(box_texel(16u + 2u * tree).w);
            var count = 1u;
            while (count > 0u && !(is_any && ray_nearness[i] > 1.0)) {
                count--;
                let key = waiting[count];
                if ((key & LEAF) != 0u) {
                    for (var triangle = 8u * (key & INDEX); triangle < 8u * (key & INDEX) + 8u; triangle++) {
                        meet_facet(facet_of(triangle, origin), triangle, i);
                    }
                } else {
                    for (var child = 16u * key; child < 16u * key + 8u; child++) {
                        let kind = box_texel(child + 8u).w;
                        if (kind != 0.0 && meets_child(child, 8u, origin, inverse, i)) {
                            waiting[count] = select(0u, LEAF, kind == OF_LEAF) | u32(box_texel(child).w);
                            count++;
                        }
                    }
                }
            }
        }
    }
}

fn meet_facet(facet: Facet, triangle: u32, i: u32) {
    let nearness = nearness_of(facet, ray_direction[i]);
    ray_hit[i] = select(ray_hit[i], triangle, nearness > ray_nearness[i]);
    ray_nearness[i] = max(ray_nearness[i], nearness);
}

fn meets_child(texel: u32, step: u32, origin: vec3<f32>, inverse: vec3<f32>, i: u32) -> bool {
    let low = box_texel(texel).xyz - origin;
    let high = box_texel(texel + step).xyz - origin;
    return meet_box(low, high, inverse, 1.0 / ray_nearness[i]).is_met;
}
#endif

// The place in the scene of the triangle that was hit.
fn scene_triangle(hit: u32) -> u32 {
    return u32(triangle_texel(4u * hit + 3u).x);
}
