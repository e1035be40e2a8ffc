// Rays among all triangles, RAYS of them per lane: either they start at one origin, or they lead to one light. See
// src/ray_tree.rs for what the images hold.
//
// A packet meets the large triangles, which stand alone, one after the other: what depends on the triangle and the rays'
// common end is worked out once, a triangle per lane, and broadcast. The others lie in a tree of boxes, where
// each lane takes its own way with one of its rays after the other: rays that start together soon part among small triangles. A scene
// without small triangles has no tree, and its kernels none of that.
//
// A mesh that instances share has a tree in its own space. A ray that enters the box of an instance is turned into that space, goes on through
// that tree, and then returns. Distances are the same in both: a direction is turned with its length.
//
// Everything is meant to be right but for rounding, of which u = 2^-24 is the unit: errors are bounded as in Pharr, Jakob,
// Humphreys, "Physically Based Rendering", section "Managing rounding error".

#import light
#import instance
#if CUTOUT
#import texels
#endif

#if QUERY
enable wgpu_ray_query;

// All triangles, in the order of ray_triangles. The device traverses it, and none of the tests of boxes and triangles below are there.
var ray_scene: acceleration_structure;
#else
var ray_boxes: texture_storage_2d<rgba32float, read>;
#endif
// Four texels a triangle: its corners, each with a component of the unit normal; its place in the scene, and 1 + its place among those with cut-outs
// where it has any. The first one also tells where those begin that an acceleration structure has as its second geometry, and how many triangles there
// are. Behind them lie those with cut-outs again: the texture coordinates of the corners, columns and rows of the alpha texture, and its first word,
// for word_index, three texels each.
var ray_triangles: texture_storage_2d<rgba32float, read>;

// Rays of a lane.
#if PACKET
const RAYS: u32 = 8u;
const RAY_PAIRS: u32 = 4u;
#else
const RAYS: u32 = 2u;
const RAY_PAIRS: u32 = 1u;
#endif
// Texels of a row of the images, as a shift.
const ROW_SHIFT: u32 = 10u;
const ROW_MASK: u32 = 1023u;
const NOTHING_HIT: u32 = 0xffffffffu;
// Texels of ray_boxes before the first node.
const HEADER_TEXELS: u32 = 3u;
// The word of a leaf: LEAF | triangle, and LEAF_CUTOUT where that has cut-outs.
const LEAF: u32 = 0x40000000u;
const LEAF_CUTOUT: u32 = 0x20000000u;
// That of an instance: LEAF | LEAF_INSTANCE | its place.
const LEAF_INSTANCE: u32 = 0x10000000u;
const LEAF_FLAGS: u32 = LEAF | LEAF_CUTOUT | LEAF_INSTANCE;
// Boxes that a lane tests before it looks at leaves.
const STRIDE: u32 = 8u;

// What a ray has of its own. From an origin: its direction, whose length is the unit of its distances. To a light: its start.
var<private> ray_vector: array<vec3<f32>, RAYS>;
// 1 / distance of the nearest hit so far. To be set before: 1 where the ray ends at its direction's head, 0 where it does
// not end, NOT_WANTED where it is none. Of a ray to a light, whose distances are not known: BLOCKED.
var<private> ray_inverse_t: array<f32, RAYS>;
// The triangle that was hit, for scene_triangle; or NOTHING_HIT.
var<private> ray_hit: array<u32, RAYS>;
const NOT_WANTED: f32 = 1e30;
const BLOCKED: f32 = 2.0;

// Arrays live in registers as long as every index is a constant. A loop over the rays with much in it is not unrolled by the
// driver: it sets them by comparing its number with each.
fn set_ray(ray: u32, vector: vec3<f32>, inverse_t: f32) {
#repeat SLOT RAYS
    ray_vector[SLOT] = select(ray_vector[SLOT], vector, ray == SLOTu);
    ray_inverse_t[SLOT] = select(ray_inverse_t[SLOT], inverse_t, ray == SLOTu);
#endrepeat
}

// Of a texel in an image that holds a list.
fn list_place(index: u32) -> vec2<u32> {
    return vec2<u32>(index & ROW_MASK, index >> ROW_SHIFT);
}

fn triangle_texel(index: u32) -> vec4<f32> {
    return textureLoad(ray_triangles, list_place(index));
}

// So that 0 times the inverse is 0 and not NaN.
fn inverse_of(direction: vec3<f32>) -> vec3<f32> {
    return 1.0 / select(direction, vec3<f32>(1e-30), abs(direction) < vec3<f32>(1e-30));
}

// The corners of a triangle, each with a component of the unit normal.
struct Corners {
    a: vec4<f32>,
    b: vec4<f32>,
    c: vec4<f32>,
}

fn corners_at(triangle: u32) -> Corners {
    return Corners(triangle_texel(4u * triangle), triangle_texel(4u * triangle + 1u), triangle_texel(4u * triangle + 2u));
}

// What all rays from one origin share of a triangle.
struct OriginPlanes {
    // A direction passes inside the triangle if its product with none of these is negative. Neighbours have exactly
    // opposite ones for their common edge, so that nothing slips between them.
    edge0: vec3<f32>,
    edge1: vec3<f32>,
    edge2: vec3<f32>,
    // Unit normal over the origin's height: its product with a direction is 1 / distance.
    normal: vec3<f32>,
}

// `unit` is a length of the scene in the space of the corners.
fn planes_from_origin(corners: Corners, origin: vec3<f32>, unit: f32) -> OriginPlanes {
    let a = corners.a;
    let b = corners.b;
    let c = corners.c;
    let normal = vec3<f32>(a.w, b.w, c.w);
    let c0 = a.xyz - origin;
    let c1 = b.xyz - origin;
    let c2 = c.xyz - origin;
    let height = dot(normal, c0);
    let turn = select(-1.0, 1.0, height > 0.0);
    var planes: OriginPlanes;
    planes.edge0 = turn * cross(c1 + c2, c2 - c1);
    planes.edge1 = turn * cross(c2 + c0, c0 - c2);
    planes.edge2 = turn * cross(c0 + c1, c1 - c0);
#if CENTRAL
    // From a light: it may be mounted on a surface.
    let is_in_plane = abs(height) <= unit * LIGHT_IN_PLANE * dot(abs(normal), vec3<f32>(1.0));
#else
    // The origin in the plane, or a triangle without area: never hit.
    let is_in_plane = height == 0.0;
#endif
    planes.normal = select(normal / height, vec3<f32>(0.0), is_in_plane);
    return planes;
}

// 1 / distance at which a ray hits the triangle; 0 or less: it does not.
fn inverse_t_of(planes: OriginPlanes, direction: vec3<f32>) -> f32 {
    let inside = min(min(dot(planes.edge0, direction), dot(planes.edge1, direction)), dot(planes.edge2, direction));
    return select(0.0, dot(planes.normal, direction), inside >= 0.0);
}

// A light as rays lead to it: its position and 1, or the direction to it and 0. A direction's length is how far rays go.
//
// All is relative to a ray's start, whose surroundings are known exactly, while the light may be far away.
fn direction_to_light(start: vec3<f32>, light_end: vec4<f32>) -> vec3<f32> {
    return light_end.xyz - light_end.w * start;
}

// What all rays to one light share of a triangle.
struct LightPlanes {
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

fn planes_to_light(corners: Corners, light_end: vec4<f32>, unit: f32) -> LightPlanes {
    let a = corners.a;
    let b = corners.b;
    let c = corners.c;
    let normal = vec3<f32>(a.w, b.w, c.w);
    let height = dot(normal, direction_to_light(a.xyz, light_end));
    let turn = select(-1.0, 1.0, height > 0.0);
    let twice_light = turn * 2.0 * light_end.xyz;
    let weight = turn * light_end.w;
    // Twice the edges' middles.
    let middle0 = b.xyz + c.xyz;
    let middle1 = c.xyz + a.xyz;
    let middle2 = a.xyz + b.xyz;
    var planes: LightPlanes;
    planes.plane0 = cross(twice_light - weight * middle0, c.xyz - b.xyz);
    planes.plane1 = cross(twice_light - weight * middle1, a.xyz - c.xyz);
    planes.plane2 = cross(twice_light - weight * middle2, b.xyz - a.xyz);
    planes.offsets = 0.5 * vec3<f32>(dot(planes.plane0, middle0), dot(planes.plane1, middle1), dot(planes.plane2, middle2));
    planes.corner = a.xyz;
    let is_in_plane = abs(height) <= unit * LIGHT_IN_PLANE * dot(abs(normal), vec3<f32>(1.0));
#if PARALLEL
    // A height over the plane becomes a distance along the rays.
    planes.normal = select(normal / height, vec3<f32>(0.0), is_in_plane);
#else
    planes.normal = select(turn * normal, vec3<f32>(0.0), is_in_plane);
#endif
    return planes;
}

// BLOCKED or 0; of parallel rays from a light 1 / distance or 0. Which side of the triangle's plane a ray's ends are on tell their
// heights over it, whose error does not grow with the light's distance or the triangle's slimness.
fn blocking(planes: LightPlanes, start: vec3<f32>) -> f32 {
    let inside = min(min(dot(planes.plane0, start) - planes.offsets.x, dot(planes.plane1, start) - planes.offsets.y),
        dot(planes.plane2, start) - planes.offsets.z);
    let height = dot(planes.normal, start - planes.corner);
#if PARALLEL
    return select(0.0, -1.0 / height, (inside >= 0.0) & (height < 0.0));
#else
    return select(0.0, BLOCKED, (inside >= 0.0) & (height < 0.0));
#endif
}

#if CUTOUT
// Whether a triangle that has cut-outs has one where these are the barycentric coordinates, up to a factor.
fn is_hole(cutout: u32, b: vec3<f32>) -> bool {
    let first = 4u * u32(triangle_texel(3u).w) + 3u * (cutout - 1u);
    let texcoords01 = triangle_texel(first);
    let texcoord2_size = triangle_texel(first + 1u);
    let first_word = word_index(triangle_texel(first + 2u).xy);
    let texcoord = (b.x * texcoords01.xy + b.y * texcoords01.zw + b.z * texcoord2_size.xy) / (b.x + b.y + b.z);
    return is_cut_out(vec2<u32>(texcoord2_size.zw), first_word, texcoord);
}

// 0: the triangle is whole.
fn cutout_of(triangle: u32) -> u32 {
    return u32(triangle_texel(4u * triangle + 3u).y);
}
#endif

#if QUERY
// The nearest triangle that a ray meets, or any; NOTHING_HIT where it ends before.
struct Met {
    hit: u32,
    inverse_t: f32,
}

fn met(intersection: RayIntersection) -> Met {
    let is_met = intersection.kind == RAY_QUERY_INTERSECTION_TRIANGLE;
    return Met(select(NOTHING_HIT, hit_of(intersection), is_met), 1.0 / intersection.t);
}

// For scene_triangle.
fn hit_of(intersection: RayIntersection) -> u32 {
    var hit = intersection.primitive_index;
#if INSTANCED
    if (intersection.instance_custom_data > 0u) {
        hit += first_hit(intersection.instance_custom_data);
    }
#endif
#if CUTOUT
    // Triangles with cut-outs are the second geometry.
    hit += select(0u, u32(triangle_texel(3u).z), intersection.geometry_index == 1u);
#endif
    return hit;
}

// Of a triangle that the ray meets.
fn is_solid(intersection: RayIntersection) -> bool {
#if CUTOUT
    let cutout = cutout_of(hit_of(intersection));
    let b = intersection.barycentrics;
    return cutout == 0u || !is_hole(cutout, vec3<f32>(1.0 - b.x - b.y, b));
#else
    return true;
#endif
}

fn follow(ray: RayDesc) -> Met {
    var query: ray_query;
    rayQueryInitialize(&query, ray_scene, ray);
    while (rayQueryProceed(&query)) {
#if CUTOUT
        if (is_solid(rayQueryGetCandidateIntersection(&query))) {
            rayQueryConfirmIntersection(&query);
        }
#endif
    }
    return met(rayQueryGetCommittedIntersection(&query));
}

// But for triangles that a light is mounted on.
fn follow_with_light(ray: RayDesc, light_end: vec4<f32>) -> Met {
    let first = follow(ray);
    if (first.hit == NOTHING_HIT || !is_mounted_on(first.hit, light_end)) {
        return first;
    }
    var query: ray_query;
    var asking = ray;
    asking.flags |= RAY_FLAG_FORCE_NO_OPAQUE;
    rayQueryInitialize(&query, ray_scene, asking);
    while (rayQueryProceed(&query)) {
        let candidate = rayQueryGetCandidateIntersection(&query);
        if (!is_mounted_on(hit_of(candidate), light_end) && is_solid(candidate)) {
            rayQueryConfirmIntersection(&query);
        }
    }
    return met(rayQueryGetCommittedIntersection(&query));
}

fn is_mounted_on(hit: u32, light_end: vec4<f32>) -> bool {
    let corners = corners_of_hit(hit);
    let normal = vec3<f32>(corners.a.w, corners.b.w, corners.c.w);
    let height = dot(normal, direction_to_light(corners.a.xyz, light_end));
    return abs(height) <= LIGHT_IN_PLANE * dot(abs(normal), vec3<f32>(1.0));
}

// Traces the rays of a lane, which have one origin. Afterwards ray_inverse_t and ray_hit tell what was hit.
fn trace(origin: vec3<f32>, is_any: bool) {
    let flags = select(RAY_FLAG_NONE, RAY_FLAG_TERMINATE_ON_FIRST_HIT, is_any);
    for (var i = 0u; i < RAYS; i++) {
        let ray = own_ray(i);
        if (ray.inverse_t < NOT_WANTED) {
            let desc = RayDesc(flags, 0xffu, 0.0, end_of(ray.inverse_t), origin, ray.vector);
#if CENTRAL
            put_back(i, follow_with_light(desc, vec4<f32>(origin, 1.0)));
#else
            put_back(i, follow(desc));
#endif
        }
    }
}

// Finds for each ray whether something is between its start and the light. Afterwards ray_inverse_t is BLOCKED, or NOT_WANTED as
// before, where it is over 1.
//
// Of parallel rays from a light it finds the closest hit: `light_end` is then where they lead.
fn trace_to_light(light_end: vec4<f32>) {
    for (var i = 0u; i < RAYS; i++) {
        let ray = own_ray(i);
        if (ray.inverse_t < NOT_WANTED) {
            let direction = direction_to_light(ray.vector, light_end);
#if PARALLEL
            put_back(i, follow(RayDesc(RAY_FLAG_NONE, 0xffu, 0.0, end_of(ray.inverse_t), ray.vector, direction)));
#else
            let desc = RayDesc(RAY_FLAG_TERMINATE_ON_FIRST_HIT, 0xffu, 0.0, 1.0, ray.vector, direction);
            var found = follow_with_light(desc, light_end);
            found.inverse_t = BLOCKED;
            put_back(i, found);
#endif
        }
    }
}

// A ray of the lane, not yet traced.
struct OwnRay {
    vector: vec3<f32>,
    inverse_t: f32,
}

fn own_ray(ray: u32) -> OwnRay {
    var vector: vec3<f32>;
    var inverse_t: f32;
#repeat SLOT RAYS
    vector = select(vector, ray_vector[SLOT], ray == SLOTu);
    inverse_t = select(inverse_t, ray_inverse_t[SLOT], ray == SLOTu);
    ray_hit[SLOT] = select(ray_hit[SLOT], NOTHING_HIT, ray == SLOTu);
#endrepeat
    return OwnRay(vector, inverse_t);
}

fn put_back(ray: u32, found: Met) {
#repeat SLOT RAYS
    let is_SLOT = ray == SLOTu && found.hit != NOTHING_HIT;
    ray_inverse_t[SLOT] = select(ray_inverse_t[SLOT], found.inverse_t, is_SLOT);
    ray_hit[SLOT] = select(ray_hit[SLOT], found.hit, is_SLOT);
#endrepeat
}

// The distance of a ray's end.
fn end_of(inverse_t: f32) -> f32 {
    return 1.0 / max(inverse_t, 1e-30);
}
#else
fn box_texel(index: u32) -> vec4<f32> {
    return textureLoad(ray_boxes, list_place(index));
}

#if CUTOUT
// The barycentric coordinates, up to a factor, of where a ray meets a triangle.
fn weights_of(corners: Corners, vector: vec3<f32>, end: vec4<f32>, is_to_light: bool) -> vec3<f32> {
    if (is_to_light) {
        let planes = planes_to_light(corners, end, 1.0);
        return vec3<f32>(dot(planes.plane0, vector), dot(planes.plane1, vector), dot(planes.plane2, vector)) - planes.offsets;
    }
    let planes = planes_from_origin(corners, end.xyz, 1.0);
    return vec3<f32>(dot(planes.edge0, vector), dot(planes.edge1, vector), dot(planes.edge2, vector));
}
#endif

#if TREE CUTOUT INSTANCED
// A ray on its way through the tree, in the coordinates of the grid to which boxes are rounded.
struct Traversal {
    // Which ray: a bit.
    ray: u32,
    vector: vec3<f32>,
    // A grid coordinate times `scale` less `start` is where the ray crosses it.
    scale: vec3<f32>,
    start: vec3<f32>,
    inverse_t: f32,
    // Of the nearest hit so far.
    t_max: f32,
    hit: u32,
    // Next to test.
    node: u32,
    // A leaf that waits; 0: none.
    leaf: u32,
#if INSTANCED
    // Whose tree it goes through; 0: that of the scene. And where that tree ends.
    instance: u32,
    node_end: u32,
    // The ray and the common origin, or the light, in the space of the tree; how long a local unit of the scene is there, at most; and what tells
    // hits there from others.
    own_vector: vec3<f32>,
    own_end: vec4<f32>,
    unit: f32,
    hit_offset: u32,
#endif
}

// Rays that a lane has on their way through the tree at once: one waits for its node while the other is tested.
const TRAVERSALS: u32 = 2u;
var<private> traversals: array<Traversal, TRAVERSALS>;

// Of the tree that a ray goes through: where it ends; the ray and the common origin, or the light, in its space; how long a local unit of the scene is
// there; and what one of its triangles is as a hit.
#if INSTANCED
fn tree_end(w: u32, node_count: u32) -> u32 {
    return traversals[w].node_end;
}

fn is_in_scene(w: u32) -> bool {
    return traversals[w].instance == 0u;
}

// Whether the leaf that waits is that of an instance.
fn is_at_instance(w: u32) -> bool {
    return (traversals[w].leaf & LEAF_INSTANCE) != 0u;
}

fn vector_in_tree(w: u32) -> vec3<f32> {
    return traversals[w].own_vector;
}

fn end_in_tree(w: u32, end: vec4<f32>) -> vec4<f32> {
    return traversals[w].own_end;
}

fn unit_in_tree(w: u32) -> f32 {
    return traversals[w].unit;
}

fn hit_in_tree(w: u32, triangle: u32) -> u32 {
    return triangle + traversals[w].hit_offset;
}

// Takes a ray to the tree where it goes on: that of an instance whose box it has met, or that of the scene where it has come to the end of such a tree. And
// into the space of its tree. Returns where its grid begins in ray_boxes.
fn enter_tree(w: u32, end: vec4<f32>, is_to_light: bool) -> u32 {
    let traversal = traversals[w];
    let is_entry = is_at_instance(w);
    let is_exit = (traversal.instance != 0u) & (traversal.node >= traversal.node_end) & (traversal.leaf == 0u);
    let instance = select(select(traversal.instance, 0u, is_exit), 1u + (traversal.leaf & ~LEAF_FLAGS), is_entry);
    let tree = instance_texel(instance, 6u);
    let grid = whole_number(tree.x);
    let next = whole_number(instance_texel(traversal.instance, 6u).z);
    let back = to_mesh(instance);
    // Of a direction nothing is taken off.
    let is_end_point = select(1.0, end.w, is_to_light);
    let own_end = placed_direction(back, end.xyz) + is_end_point * vec3<f32>(back.x.w, back.y.w, back.z.w);
    let is_vector_point = select(0.0, 1.0, is_to_light);
    traversals[w].own_vector = placed_direction(back, traversal.vector) + is_vector_point * vec3<f32>(back.x.w, back.y.w, back.z.w);
    traversals[w].own_end = vec4<f32>(own_end, end.w);
    traversals[w].unit = sqrt(max(max(dot(back.x.xyz, back.x.xyz), dot(back.y.xyz, back.y.xyz)), dot(back.z.xyz, back.z.xyz)));
    traversals[w].hit_offset = whole_number(tree.w);
    traversals[w].instance = instance;
    traversals[w].node_end = whole_number(tree.y);
    // Nodes count from the first one of the scene's tree.
    traversals[w].node = select(select(traversal.node, next, is_exit), grid + 2u - HEADER_TEXELS, is_entry);
    traversals[w].leaf = select(traversal.leaf, 0u, is_entry);
    return grid;
}
#else
fn tree_end(w: u32, node_count: u32) -> u32 {
    return node_count;
}

fn is_in_scene(w: u32) -> bool {
    return true;
}

fn is_at_instance(w: u32) -> bool {
    return false;
}

fn vector_in_tree(w: u32) -> vec3<f32> {
    return traversals[w].vector;
}

fn end_in_tree(w: u32, end: vec4<f32>) -> vec4<f32> {
    return end;
}

fn unit_in_tree(w: u32) -> f32 {
    return 1.0;
}

fn hit_in_tree(w: u32, triangle: u32) -> u32 {
    return triangle;
}

fn enter_tree(w: u32, end: vec4<f32>, is_to_light: bool) -> u32 {
    return 1u;
}
#endif

// Puts away what a ray that is done has found, and takes the lane's next. Returns the rays left to do.
fn take_ray(w: u32, todo: u32, node_count: u32, end: vec4<f32>, is_to_light: bool) -> u32 {
    let traversal = traversals[w];
    let is_done = (traversal.node >= tree_end(w, node_count)) & (traversal.leaf == 0u) & is_in_scene(w);
    let next = select(0u, todo & (~todo + 1u), is_done);
    var vector = traversal.vector;
    var inverse_t = traversal.inverse_t;
    var hit = traversal.hit;
    for (var i = 0u; i < RAYS; i++) {
        let is_last = is_done & (traversal.ray == 1u << i);
        ray_inverse_t[i] = select(ray_inverse_t[i], traversal.inverse_t, is_last);
        ray_hit[i] = select(ray_hit[i], traversal.hit, is_last);
        let is_this = next == 1u << i;
        vector = select(vector, ray_vector[i], is_this);
        inverse_t = select(inverse_t, ray_inverse_t[i], is_this);
        hit = select(hit, ray_hit[i], is_this);
    }
    traversals[w].ray = select(traversal.ray, next, is_done);
    traversals[w].vector = vector;
    traversals[w].inverse_t = inverse_t;
    traversals[w].hit = hit;
    traversals[w].t_max = 1.0 / inverse_t;
    traversals[w].node = select(traversal.node, 0u, next != 0u);
    let grid = enter_tree(w, end, is_to_light);
    let own_vector = vector_in_tree(w);
    let own_end = end_in_tree(w, end);
    let origin = select(own_end.xyz, own_vector, is_to_light);
    let inverse = inverse_of(select(own_vector, direction_to_light(own_vector, own_end), is_to_light));
    traversals[w].scale = box_texel(grid + 1u).xyz * inverse;
    traversals[w].start = (box_texel(grid).xyz - origin) * inverse;
    return todo & ~next;
}

// Tests a box. A leaf has to wait in the tree where another one waits already. Returns whether there is more to test.
fn step(w: u32, node_count: u32) -> bool {
    let traversal = traversals[w];
    let node_end = tree_end(w, node_count);
    let words = bitcast<vec4<u32>>(box_texel(HEADER_TEXELS + min(traversal.node, node_end - 1u)));
    let a = vec3<f32>(vec3<i32>(words.xyz & vec3<u32>(0xffffu))) * traversal.scale + traversal.start;
    let b = vec3<f32>(vec3<i32>(words.xyz >> vec3<u32>(16u))) * traversal.scale + traversal.start;
    let enters = lesser(a, b);
    let leaves = greater(a, b);
    let enter = greater1(greater1(enters.x, enters.y), greater1(enters.z, 0.0));
    let leave = lesser1(lesser1(leaves.x, leaves.y), lesser1(leaves.z, traversal.t_max));
    let is_met = enter <= leave;
    let is_leaf = (words.w & LEAF) != 0u;
    let is_end = traversal.node >= node_end;
    let is_free = (traversal.leaf == 0u) & !is_end;
    traversals[w].leaf = select(traversal.leaf, words.w, is_met & is_leaf & is_free);
    let is_stuck = (is_met & is_leaf & !is_free) | is_end;
    let after = select(words.w, traversal.node + 1u, is_met | is_leaf);
    traversals[w].node = select(after, traversal.node, is_stuck);
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

// Of triangles at one distance a ray hits the first, whichever box it meets first: how a tree is built shows in no image.
fn is_before(hit: u32, other: u32) -> bool {
    // NOTHING_HIT is before all.
    return bitcast<i32>(hit) < bitcast<i32>(other);
}

fn take_hit(w: u32, triangle: u32, inverse_t: f32, is_nearer: bool) {
    traversals[w].hit = select(traversals[w].hit, hit_in_tree(w, triangle), is_nearer);
    traversals[w].inverse_t = select(traversals[w].inverse_t, inverse_t, is_nearer);
    traversals[w].t_max = 1.0 / traversals[w].inverse_t;
}

// Takes each ray of the lane that is not yet done through the tree: `end` is the common origin, or the light. Lanes need
// nothing of one another.
fn traverse(end: vec4<f32>, is_to_light: bool, is_any: bool) {
    let node_count = whole_number(box_texel(0u).y);
    var todo = 0u;
    for (var i = 0u; i < RAYS; i++) {
        let is_open = select(ray_inverse_t[i] < NOT_WANTED, ray_inverse_t[i] <= 1.0, is_any);
        todo |= select(0u, 1u << i, is_open);
    }
    for (var w = 0u; w < TRAVERSALS; w++) {
        traversals[w].ray = 0u;
        traversals[w].node = node_count;
        traversals[w].leaf = 0u;
#if INSTANCED
        traversals[w].instance = 0u;
        traversals[w].node_end = node_count;
#endif
    }
    loop {
        for (var w = 0u; w < TRAVERSALS; w++) {
            todo = take_ray(w, todo, node_count, end, is_to_light);
        }
        var boxes = 0u;
        loop {
            var is_moving = false;
            for (var w = 0u; w < TRAVERSALS; w++) {
                is_moving |= step(w, node_count);
            }
            boxes++;
            continuing {
                break if (boxes == STRIDE) | !is_moving;
            }
        }
#if CUTOUT
        // What a ray meets where there may be a hole: 1 / distance, or 0.
        var doubtful: array<f32, TRAVERSALS>;
        var doubtful_triangle: array<u32, TRAVERSALS>;
#endif
        for (var w = 0u; w < TRAVERSALS; w++) {
            let triangle = traversals[w].leaf & ~LEAF_FLAGS;
            // That of an instance stays.
            let is_triangle = (traversals[w].leaf != 0u) & !is_at_instance(w);
            let corners = corners_at(triangle);
            var inverse_t: f32;
            if (is_to_light) {
                inverse_t = blocking(planes_to_light(corners, end_in_tree(w, end), unit_in_tree(w)), vector_in_tree(w));
            } else {
                inverse_t = inverse_t_of(planes_from_origin(corners, end_in_tree(w, end).xyz, unit_in_tree(w)), vector_in_tree(w));
            }
            let is_nearer = is_triangle & ((inverse_t > traversals[w].inverse_t)
                | ((inverse_t == traversals[w].inverse_t) & is_before(hit_in_tree(w, triangle), traversals[w].hit)));
#if CUTOUT
            let is_doubtful = is_nearer & ((traversals[w].leaf & LEAF_CUTOUT) != 0u);
            doubtful[w] = select(0.0, inverse_t, is_doubtful);
            doubtful_triangle[w] = triangle;
            take_hit(w, triangle, inverse_t, is_nearer & !is_doubtful);
#else
            take_hit(w, triangle, inverse_t, is_nearer);
#endif
            traversals[w].leaf = select(0u, traversals[w].leaf, is_at_instance(w));
        }
#if CUTOUT
        // A loop that most rays do not enter: drivers that compute both sides of a branch would have all of them pay.
        for (var i = 0u; i < select(0u, 1u, doubtful[0] > 0.0) + select(0u, 1u, doubtful[1] > 0.0); i++) {
            let is_first = (i == 0u) & (doubtful[0] > 0.0);
            let triangle = select(doubtful_triangle[1], doubtful_triangle[0], is_first);
            let vector = select(traversals[1].vector, traversals[0].vector, is_first);
            let is_there = !is_hole(cutout_of(triangle), weights_of(corners_at(triangle), vector, end, is_to_light));
            take_hit(0u, triangle, doubtful[0], is_there & is_first);
            take_hit(1u, triangle, doubtful[1], is_there & !is_first);
        }
#endif
        var is_done = todo == 0u;
        for (var w = 0u; w < TRAVERSALS; w++) {
            let is_blocked = is_any & (traversals[w].inverse_t > 1.0);
            traversals[w].node = select(traversals[w].node, node_count, is_blocked);
#if INSTANCED
            traversals[w].instance = select(traversals[w].instance, 0u, is_blocked);
            traversals[w].node_end = select(traversals[w].node_end, node_count, is_blocked);
            traversals[w].leaf = select(traversals[w].leaf, 0u, is_blocked);
            is_done &= traversals[w].leaf == 0u;
#endif
            is_done &= (traversals[w].node >= tree_end(w, node_count)) & is_in_scene(w);
        }
        continuing {
            break if is_done;
        }
    }
    for (var w = 0u; w < TRAVERSALS; w++) {
        for (var i = 0u; i < RAYS; i++) {
            let is_last = traversals[w].ray == 1u << i;
            ray_inverse_t[i] = select(ray_inverse_t[i], traversals[w].inverse_t, is_last);
            ray_hit[i] = select(ray_hit[i], traversals[w].hit, is_last);
        }
    }
}
#endif

fn intersect(planes: OriginPlanes, triangle: u32) {
    for (var i = 0u; i < RAYS; i++) {
        let inverse_t = inverse_t_of(planes, ray_vector[i]);
        // Not max: of 0 and −0, which a triangle without area is hit at, it may give −0, and the ray would end at −∞.
        let is_nearer = inverse_t > ray_inverse_t[i];
        ray_hit[i] = select(ray_hit[i], triangle, is_nearer);
        ray_inverse_t[i] = select(ray_inverse_t[i], inverse_t, is_nearer);
    }
}

fn occlude(planes: LightPlanes, triangle: u32) {
    for (var i = 0u; i < RAYS; i++) {
        let inverse_t = blocking(planes, ray_vector[i]);
#if PARALLEL
        ray_hit[i] = select(ray_hit[i], triangle, inverse_t > ray_inverse_t[i]);
#endif
        ray_inverse_t[i] = max(ray_inverse_t[i], inverse_t);
    }
}

#if PACKET
var<private> lane: u32;

#repeat LANE 8
fn origin_planes_of_LANE(mine: OriginPlanes) -> OriginPlanes {
    return OriginPlanes(subgroupBroadcast(mine.edge0, LANEu), subgroupBroadcast(mine.edge1, LANEu),
        subgroupBroadcast(mine.edge2, LANEu), subgroupBroadcast(mine.normal, LANEu));
}

fn light_planes_of_LANE(mine: LightPlanes) -> LightPlanes {
    return LightPlanes(subgroupBroadcast(mine.plane0, LANEu), subgroupBroadcast(mine.plane1, LANEu),
        subgroupBroadcast(mine.plane2, LANEu), subgroupBroadcast(mine.offsets, LANEu), subgroupBroadcast(mine.corner, LANEu),
        subgroupBroadcast(mine.normal, LANEu));
}
#endrepeat
#endif

// Traces the rays of a lane. Those of a packet, which are of the eight lanes of a subgroup, have one origin, and all its lanes must
// come here, whether their rays are wanted or not. Afterwards ray_inverse_t and ray_hit tell what was hit.
fn trace(origin: vec3<f32>, is_any: bool) {
    let large_end = 8u * whole_number(box_texel(0u).x);
    for (var i = 0u; i < RAYS; i++) {
        ray_hit[i] = NOTHING_HIT;
    }
    var first = 0u;
    loop {
#if PACKET
        let mine = planes_from_origin(corners_at(first + lane), origin, 1.0);
#repeat LANE 8
        intersect(origin_planes_of_LANE(mine), first + LANEu);
#endrepeat
        first += 8u;
#else
        intersect(planes_from_origin(corners_at(first), origin, 1.0), first);
        first++;
#endif
        continuing {
            break if first >= large_end;
        }
    }
#if TREE CUTOUT INSTANCED
    traverse(vec4<f32>(origin, 0.0), false, is_any);
#endif
}

// Finds for each ray whether something is between its start and the light, which is the same for all lanes of a packet; all of them
// must come here. Afterwards ray_inverse_t is BLOCKED, or NOT_WANTED as before, where it is over 1.
//
// Of parallel rays from a light it finds the closest hit: `light_end` is then where they lead.
fn trace_to_light(light_end: vec4<f32>) {
    let large_end = 8u * whole_number(box_texel(0u).x);
#if PARALLEL
    for (var i = 0u; i < RAYS; i++) {
        ray_hit[i] = NOTHING_HIT;
    }
    let is_any = false;
#else
    let is_any = true;
#endif
    var first = 0u;
    loop {
#if PACKET
        let mine = planes_to_light(corners_at(first + lane), light_end, 1.0);
#repeat LANE 8
        occlude(light_planes_of_LANE(mine), first + LANEu);
#endrepeat
        first += 8u;
#else
        occlude(planes_to_light(corners_at(first), light_end, 1.0), first);
        first++;
#endif
        continuing {
            break if first >= large_end;
        }
    }
#if TREE CUTOUT INSTANCED
    traverse(light_end, true, is_any);
#endif
}
#endif

// A triangle that was hit, and on which instance.
struct Located {
    triangle: u32,
    instance: u32,
}

#if INSTANCED SHADE
fn located(hit: u32) -> Located {
    // Instances whose first hit is not behind this.
    var low = 0u;
    var high = instance_count();
    while (low < high) {
        let middle = (low + high) / 2u;
        let is_behind = first_hit(1u + middle) > hit;
        high = select(high, middle, is_behind);
        low = select(middle + 1u, low, is_behind);
    }
    var triangle = hit;
    for (var i = 0u; i < min(low, 1u); i++) {
        triangle -= hit_offset(low);
    }
    return Located(triangle, low);
}
#else
fn located(hit: u32) -> Located {
    return Located(hit, 0u);
}
#endif

fn corners_of_hit(hit: u32) -> Corners {
    return corners_of(located(hit));
}

fn corners_of(found: Located) -> Corners {
    var corners = corners_at(found.triangle);
#if INSTANCED SHADE
    // A loop that other triangles do not enter: drivers that compute both sides of a branch would have all of them pay.
    for (var i = 0u; i < min(found.instance, 1u); i++) {
        let placement = to_scene(found.instance);
        let normal = placed_triangle_normal(found.instance, vec3<f32>(corners.a.w, corners.b.w, corners.c.w));
        corners.a = vec4<f32>(placed_point(placement, corners.a.xyz), normal.x);
        corners.b = vec4<f32>(placed_point(placement, corners.b.xyz), normal.y);
        corners.c = vec4<f32>(placed_point(placement, corners.c.xyz), normal.z);
    }
#endif
    return corners;
}

// The place among triangle_shading of the triangle that was hit.
fn scene_triangle(hit: u32) -> u32 {
    return u32(triangle_texel(4u * located(hit).triangle + 3u).x);
}
