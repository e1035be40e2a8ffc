// Rays among all triangles, RAYS of them per lane: either they start at one origin, or they lead to one light. See
// src/ray_tree.rs for what the images hold.
//
// A packet meets the large triangles, which stand alone, one after the other: what depends on the triangle and the rays'
// common end is worked out once, a triangle per lane, and broadcast. The others lie in a tree of boxes, where
// each lane takes its own way with one of its rays after the other: rays that start together soon part among small triangles. A scene
// without small triangles has no tree, and its kernels none of that.
//
// Everything is meant to be right but for rounding, of which u = 2^-24 is the unit: errors are bounded as in Pharr, Jakob,
// Humphreys, "Physically Based Rendering", section "Managing rounding error".

#import ray_ends
#import light_plane

var ray_boxes: texture_storage_2d<rgba32float, read>;
var ray_triangles: texture_storage_2d<rgba32float, read>;

// Rays of a lane.
const RAYS: u32 = 8u;
// Texels of a row of the images, as a shift.
const ROW_SHIFT: u32 = 10u;
const ROW_MASK: u32 = 1023u;
const NOTHING_HIT: u32 = 0xffffffffu;
// Texels of ray_boxes before the first node.
const HEADER_TEXELS: u32 = 3u;
// The word of a leaf: LEAF | triangle.
const LEAF: u32 = 0x40000000u;
// Boxes that a lane tests before it looks at leaves.
const STRIDE: u32 = 8u;

// What a ray has of its own. From an origin: its direction, whose length is the unit of its distances. To a light: its start.
var<private> ray_vector: array<vec3<f32>, RAYS>;
// 1 / distance of the nearest hit so far. To be set before: 1 where the ray ends at its direction's head, 0 where it does
// not end, NOT_WANTED where it is none. Of a ray to a light, whose distances are not known: BLOCKED.
var<private> ray_nearness: array<f32, RAYS>;
// The triangle that was hit, for scene_triangle; or NOTHING_HIT.
var<private> ray_hit: array<u32, RAYS>;
const NOT_WANTED: f32 = 1e30;
const BLOCKED: f32 = 2.0;
// Longer than the scene, local units.
const REACH: f32 = 8.0;

// Arrays live in registers as long as every index is a constant. A loop over the rays with much in it is not unrolled by the
// driver: it puts them by comparing its number with each.
fn put_ray(ray: u32, vector: vec3<f32>, nearness: f32) {
#repeat SLOT 8
    ray_vector[SLOT] = select(ray_vector[SLOT], vector, ray == SLOTu);
    ray_nearness[SLOT] = select(ray_nearness[SLOT], nearness, ray == SLOTu);
#endrepeat
}

// Of a texel in an image that holds a list.
fn list_place(index: u32) -> vec2<u32> {
    return vec2<u32>(index & ROW_MASK, index >> ROW_SHIFT);
}

fn box_texel(index: u32) -> vec4<f32> {
    return textureLoad(ray_boxes, list_place(index));
}

fn triangle_texel(index: u32) -> vec4<f32> {
    return textureLoad(ray_triangles, list_place(index));
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

// A light as rays lead to it: its position and 1, or the direction to it and 0. A direction's length is how far rays go.
//
// All is relative to a ray's start, whose surroundings are known exactly, while the light may be far away.
fn way_to_light(start: vec3<f32>, light_end: vec4<f32>) -> vec3<f32> {
    return light_end.xyz - light_end.w * start;
}

// What all rays to one light share of a triangle.
struct Screen {
    // The normals of the planes through an edge and the light, and their products with a point of theirs. A ray passes inside
    // the triangle if its start's product is less than none of these. Neighbours have exactly opposite ones.
    plane0: vec3<f32>,
    plane1: vec3<f32>,
    plane2: vec3<f32>,
    offsets: vec3<f32>,
    corner: vec3<f32>,
    // On the light's side; 0 where the light lies in the plane but for rounding.
    normal: vec3<f32>,
}

fn screen_of(triangle: u32, light_end: vec4<f32>) -> Screen {
    let a = triangle_texel(4u * triangle);
    let b = triangle_texel(4u * triangle + 1u);
    let c = triangle_texel(4u * triangle + 2u);
    let normal = vec3<f32>(a.w, b.w, c.w);
    let height = dot(normal, way_to_light(a.xyz, light_end));
    let turn = select(-1.0, 1.0, height > 0.0);
    let twice_light = turn * 2.0 * light_end.xyz;
    let weight = turn * light_end.w;
    // Twice the edges' middles.
    let middle0 = b.xyz + c.xyz;
    let middle1 = c.xyz + a.xyz;
    let middle2 = a.xyz + b.xyz;
    var screen: Screen;
    screen.plane0 = cross(twice_light - weight * middle0, c.xyz - b.xyz);
    screen.plane1 = cross(twice_light - weight * middle1, a.xyz - c.xyz);
    screen.plane2 = cross(twice_light - weight * middle2, b.xyz - a.xyz);
    screen.offsets = 0.5 * vec3<f32>(dot(screen.plane0, middle0), dot(screen.plane1, middle1), dot(screen.plane2, middle2));
    screen.corner = a.xyz;
    screen.normal = select(turn * normal, vec3<f32>(0.0), abs(height) <= LIGHT_IN_PLANE * dot(abs(normal), vec3<f32>(1.0)));
    return screen;
}

// BLOCKED or 0. Which side of the triangle's plane a ray's ends are on tell their heights over it, whose error does not
// grow with the light's distance or the triangle's slimness.
fn blocking_of(screen: Screen, start: vec3<f32>) -> f32 {
    let inside = min(min(dot(screen.plane0, start) - screen.offsets.x, dot(screen.plane1, start) - screen.offsets.y),
        dot(screen.plane2, start) - screen.offsets.z);
    return select(0.0, BLOCKED, (inside >= 0.0) & (dot(screen.normal, start - screen.corner) < 0.0));
}

#if TREE
// A ray on its way through the tree, in the coordinates of the grid to which boxes are rounded.
struct Walk {
    // Which ray: a bit.
    ray: u32,
    vector: vec3<f32>,
    // A grid coordinate times `scale` less `start` is where the ray crosses it.
    scale: vec3<f32>,
    start: vec3<f32>,
    nearness: f32,
    // 1 / nearness.
    reach: f32,
    hit: u32,
    // Next to visit.
    node: u32,
    // A leaf that waits; 0: none.
    leaf: u32,
}

// Rays that a lane has on their way through the tree at once: one waits for its node while the other is tested.
const WALKS: u32 = 2u;
var<private> walks: array<Walk, WALKS>;

// Puts away what a ray that is done has found, and takes the lane's next. Returns the rays left to do.
fn take_ray(w: u32, todo: u32, node_count: u32, end: vec4<f32>, is_to_light: bool) -> u32 {
    let walk = walks[w];
    let is_done = (walk.node >= node_count) & (walk.leaf == 0u);
    let next = select(0u, todo & (~todo + 1u), is_done);
    var vector = walk.vector;
    var nearness = walk.nearness;
    var hit = walk.hit;
    for (var i = 0u; i < RAYS; i++) {
        let is_last = is_done & (walk.ray == 1u << i);
        ray_nearness[i] = select(ray_nearness[i], walk.nearness, is_last);
        ray_hit[i] = select(ray_hit[i], walk.hit, is_last);
        let is_this = next == 1u << i;
        vector = select(vector, ray_vector[i], is_this);
        nearness = select(nearness, ray_nearness[i], is_this);
        hit = select(hit, ray_hit[i], is_this);
    }
    let origin = select(end.xyz, vector, is_to_light);
    let inverse = inverse_of(select(vector, way_to_light(vector, end), is_to_light));
    walks[w].ray = select(walk.ray, next, is_done);
    walks[w].vector = vector;
    walks[w].nearness = nearness;
    walks[w].hit = hit;
    walks[w].reach = 1.0 / nearness;
    walks[w].scale = box_texel(2u).xyz * inverse;
    walks[w].start = (box_texel(1u).xyz - origin) * inverse;
    walks[w].node = select(walk.node, 0u, next != 0u);
    return todo & ~next;
}

// Tests a box. A leaf has to wait in the tree where another one waits already. Returns whether there is more to test.
fn visit(w: u32, node_count: u32) -> bool {
    let walk = walks[w];
    let words = bitcast<vec4<u32>>(box_texel(HEADER_TEXELS + min(walk.node, node_count - 1u)));
    let a = vec3<f32>(vec3<i32>(words.xyz & vec3<u32>(0xffffu))) * walk.scale + walk.start;
    let b = vec3<f32>(vec3<i32>(words.xyz >> vec3<u32>(16u))) * walk.scale + walk.start;
    let enters = lesser(a, b);
    let leaves = greater(a, b);
    let enter = greater1(greater1(enters.x, enters.y), greater1(enters.z, 0.0));
    let leave = lesser1(lesser1(leaves.x, leaves.y), lesser1(leaves.z, walk.reach));
    let is_met = enter <= leave;
    let is_leaf = (words.w & LEAF) != 0u;
    let is_free = walk.leaf == 0u;
    walks[w].leaf = select(walk.leaf, words.w, is_met & is_leaf & is_free);
    let is_stuck = (is_met & is_leaf & !is_free) | (walk.node >= node_count);
    let after = select(words.w, walk.node + 1u, is_met | is_leaf);
    walks[w].node = select(after, walk.node, is_stuck);
    return !is_stuck;
}

fn lesser(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return select(b, a, a < b);
}

fn greater(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return select(b, a, a > b);
}

fn lesser1(a: f32, b: f32) -> f32 {
    return select(b, a, a < b);
}

fn greater1(a: f32, b: f32) -> f32 {
    return select(b, a, a > b);
}

// Takes each ray of the lane that is not yet done through the tree: `end` is the common origin, or the light. Lanes need
// nothing of one another.
fn walk_tree(end: vec4<f32>, is_to_light: bool, is_any: bool) {
    let node_count = u32(box_texel(0u).y);
    var todo = 0u;
    for (var i = 0u; i < RAYS; i++) {
        let is_open = select(ray_nearness[i] < NOT_WANTED, ray_nearness[i] <= 1.0, is_any);
        todo |= select(0u, 1u << i, is_open);
    }
    for (var w = 0u; w < WALKS; w++) {
        walks[w].ray = 0u;
        walks[w].node = node_count;
        walks[w].leaf = 0u;
    }
    loop {
        for (var w = 0u; w < WALKS; w++) {
            todo = take_ray(w, todo, node_count, end, is_to_light);
        }
        var steps = 0u;
        loop {
            var is_moving = false;
            for (var w = 0u; w < WALKS; w++) {
                is_moving |= visit(w, node_count);
            }
            steps++;
            continuing {
                break if (steps == STRIDE) | !is_moving;
            }
        }
        var is_done = todo == 0u;
        for (var w = 0u; w < WALKS; w++) {
            let triangle = walks[w].leaf & ~LEAF;
            var nearness: f32;
            if (is_to_light) {
                nearness = blocking_of(screen_of(triangle, end), walks[w].vector);
            } else {
                nearness = nearness_of(facet_of(triangle, end.xyz), walks[w].vector);
            }
            let is_nearer = (nearness > walks[w].nearness) & (walks[w].leaf != 0u);
            walks[w].hit = select(walks[w].hit, triangle, is_nearer);
            walks[w].nearness = select(walks[w].nearness, nearness, is_nearer);
            walks[w].reach = 1.0 / walks[w].nearness;
            walks[w].leaf = 0u;
            walks[w].node = select(walks[w].node, node_count, is_any & (walks[w].nearness > 1.0));
            is_done &= walks[w].node >= node_count;
        }
        continuing {
            break if is_done;
        }
    }
    for (var w = 0u; w < WALKS; w++) {
        for (var i = 0u; i < RAYS; i++) {
            let is_last = walks[w].ray == 1u << i;
            ray_nearness[i] = select(ray_nearness[i], walks[w].nearness, is_last);
            ray_hit[i] = select(ray_hit[i], walks[w].hit, is_last);
        }
    }
}
#endif

#if PACKET
var<private> lane: u32;

#repeat LANE 8
fn meet_facet_LANE(mine: Facet, first: u32) {
    let facet = Facet(subgroupBroadcast(mine.edge0, LANEu), subgroupBroadcast(mine.edge1, LANEu),
        subgroupBroadcast(mine.edge2, LANEu), subgroupBroadcast(mine.normal, LANEu));
    for (var i = 0u; i < RAYS; i++) {
        let nearness = nearness_of(facet, ray_vector[i]);
        ray_hit[i] = select(ray_hit[i], first + LANEu, nearness > ray_nearness[i]);
        ray_nearness[i] = max(ray_nearness[i], nearness);
    }
}
#endrepeat

#repeat LANE 8
fn meet_screen_LANE(mine: Screen) {
    let screen = Screen(subgroupBroadcast(mine.plane0, LANEu), subgroupBroadcast(mine.plane1, LANEu),
        subgroupBroadcast(mine.plane2, LANEu), subgroupBroadcast(mine.offsets, LANEu), subgroupBroadcast(mine.corner, LANEu),
        subgroupBroadcast(mine.normal, LANEu));
    for (var i = 0u; i < RAYS; i++) {
        ray_nearness[i] = max(ray_nearness[i], blocking_of(screen, ray_vector[i]));
    }
}
#endrepeat

// Traces the rays of a packet, which are those of the eight lanes of a subgroup. All lanes must come here, with the same
// origin, whether their rays are wanted or not. Afterwards ray_nearness and ray_hit tell what was hit.
fn trace(origin: vec3<f32>, is_any: bool) {
    let header = box_texel(0u);
    let facet_end = 8u * u32(header.x);
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
            break if first >= facet_end;
        }
    }
#if TREE
    walk_tree(vec4<f32>(origin, 0.0), false, is_any);
#endif
}

// Finds for each ray of a packet whether something is between its start and the light, which is the same for all lanes.
// All of them must come here. Afterwards ray_nearness is BLOCKED, or NOT_WANTED as before, where it is over 1.
fn trace_to_light(light_end: vec4<f32>) {
    let header = box_texel(0u);
    let facet_end = 8u * u32(header.x);
    var first = 0u;
    loop {
        let mine = screen_of(first + lane, light_end);
#repeat LANE 8
        meet_screen_LANE(mine);
#endrepeat
        first += 8u;
        continuing {
            break if first >= facet_end;
        }
    }
#if TREE
    walk_tree(light_end, true, true);
#endif
}
#else
// Traces the rays of one lane. The lanes need not have an origin in common.
fn trace(origin: vec3<f32>, is_any: bool) {
    let header = box_texel(0u);
    let facet_end = 8u * u32(header.x);
    for (var i = 0u; i < RAYS; i++) {
        ray_hit[i] = NOTHING_HIT;
    }
    for (var triangle = 0u; triangle < facet_end; triangle++) {
        let facet = facet_of(triangle, origin);
        for (var i = 0u; i < RAYS; i++) {
            let nearness = nearness_of(facet, ray_vector[i]);
            ray_hit[i] = select(ray_hit[i], triangle, nearness > ray_nearness[i]);
            ray_nearness[i] = max(ray_nearness[i], nearness);
        }
    }
#if TREE
    walk_tree(vec4<f32>(origin, 0.0), false, is_any);
#endif
}

fn trace_to_light(light_end: vec4<f32>) {
    let header = box_texel(0u);
    for (var triangle = 0u; triangle < 8u * u32(header.x); triangle++) {
        let screen = screen_of(triangle, light_end);
        for (var i = 0u; i < RAYS; i++) {
            ray_nearness[i] = max(ray_nearness[i], blocking_of(screen, ray_vector[i]));
        }
    }
#if TREE
    walk_tree(light_end, true, true);
#endif
}
#endif

// The place in the scene of the triangle that was hit.
fn scene_triangle(hit: u32) -> u32 {
    return u32(triangle_texel(4u * hit + 3u).x);
}
