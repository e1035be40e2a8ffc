// Traces rays in a tree of boxes. Each lane traverses the tree on its own, because rays that start together soon diverge among small
// triangles. src/ray_tree describes the list.
//
// A mesh that instances share has a tree in its own space. A ray that enters the box of an instance is transformed into that space,
// traverses that tree, and then returns. Distances are the same in both spaces, because a direction is transformed with its length.

#import instance
#import triangle_hit

// Texels of ray_boxes before the first node.
const HEADER_TEXELS: u32 = 3u;
// The word of a leaf: LEAF | triangle, with LEAF_CUTOUT if the triangle has cut-outs.
const LEAF: u32 = 0x40000000u;
const LEAF_CUTOUT: u32 = 0x20000000u;
// The word of an instance: LEAF | LEAF_INSTANCE | its index.
const LEAF_INSTANCE: u32 = 0x10000000u;
const LEAF_FLAGS: u32 = LEAF | LEAF_CUTOUT | LEAF_INSTANCE;
// Boxes that a lane tests before it processes leaves.
const STRIDE: u32 = 8u;

#if CUTOUT
// Barycentric coordinates, up to a factor, of the point where a ray hits a triangle.
fn weights_of(corners: Corners, vector: vec3<f32>, end: vec4<f32>, is_to_light: bool) -> vec3<f32> {
    if (is_to_light) {
        let planes = planes_to_light(corners, end, 1.0);
        return vec3<f32>(dot(planes.plane0, vector), dot(planes.plane1, vector), dot(planes.plane2, vector)) - planes.offsets;
    }
    let planes = planes_from_origin(corners, end.xyz, 1.0);
    return vec3<f32>(dot(planes.edge0, vector), dot(planes.edge1, vector), dot(planes.edge2, vector));
}
#endif

// A ray that traverses the tree, in coordinates of the grid to which boxes are rounded.
struct Traversal {
    // Bit of the ray.
    ray: u32,
    vector: vec3<f32>,
    // The ray crosses a grid coordinate at distance coordinate · `scale` + `start`.
    scale: vec3<f32>,
    start: vec3<f32>,
    inverse_t: f32,
    // Distance of the nearest hit so far.
    t_max: f32,
    hit: u32,
    // Next node to test.
    node: u32,
    // A leaf that waits to be processed; 0: none.
    leaf: u32,
#if INSTANCED
    // The instance whose tree the ray traverses, 0: the scene's tree; and the end of that tree.
    instance: u32,
    node_end: u32,
    // In the space of the tree: the ray; the common origin, or the light; and the largest length of the scene's local unit. Then the offset
    // that distinguishes hits in this tree from others.
    own_vector: vec3<f32>,
    own_end: vec4<f32>,
    unit: f32,
    hit_offset: u32,
#endif
}

// Rays that a lane traverses at once: one waits for its node while the other is tested.
const TRAVERSALS: u32 = 2u;
var<private> traversals: array<Traversal, TRAVERSALS>;

// For the tree that a ray traverses: its end; the ray, and the common origin or the light, in its space; the length of the scene's local
// unit in its space; and the hit number of one of its triangles.
#if INSTANCED
fn tree_end(w: u32, node_count: u32) -> u32 {
    return traversals[w].node_end;
}

fn is_in_scene(w: u32) -> bool {
    return traversals[w].instance == 0u;
}

// Whether the waiting leaf is an instance.
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

// Moves a ray to the tree where it continues, and into the space of that tree. That is the tree of an instance whose box it has entered, or
// the scene's tree at the end of an instance's tree. Returns where the tree's grid begins in ray_boxes.
fn enter_tree(w: u32, end: vec4<f32>, is_to_light: bool) -> u32 {
    let traversal = traversals[w];
    let is_entry = is_at_instance(w);
    let is_exit = (traversal.instance != 0u) & (traversal.node >= traversal.node_end) & (traversal.leaf == 0u);
    let instance = select(select(traversal.instance, 0u, is_exit), 1u + (traversal.leaf & ~LEAF_FLAGS), is_entry);
    let tree = instance_texel(instance, 6u);
    let grid = whole_number(tree.x);
    let next = whole_number(instance_texel(traversal.instance, 6u).z);
    let back = to_mesh(instance);
    // A direction has no translation.
    let is_end_point = select(1.0, end.w, is_to_light);
    let own_end = placed_direction(back, end.xyz) + is_end_point * vec3<f32>(back.x.w, back.y.w, back.z.w);
    let is_vector_point = select(0.0, 1.0, is_to_light);
    traversals[w].own_vector = placed_direction(back, traversal.vector) + is_vector_point * vec3<f32>(back.x.w, back.y.w, back.z.w);
    traversals[w].own_end = vec4<f32>(own_end, end.w);
    traversals[w].unit = sqrt(max(max(dot(back.x.xyz, back.x.xyz), dot(back.y.xyz, back.y.xyz)), dot(back.z.xyz, back.z.xyz)));
    traversals[w].hit_offset = whole_number(tree.w);
    traversals[w].instance = instance;
    traversals[w].node_end = whole_number(tree.y);
    // Nodes count from the first node of the scene's tree.
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

// Stores the result of a finished ray, and starts the lane's next ray. Returns the rays left to do.
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

// Tests a box. If a leaf already waits, the ray stops before the next leaf. Returns whether there is more to test.
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

// Of triangles at equal distance, a ray hits the first one, whichever box it enters first. So the structure of a tree does not affect the
// image.
fn is_before(hit: u32, other: u32) -> bool {
    // NOTHING_HIT comes before all others.
    return bitcast<i32>(hit) < bitcast<i32>(other);
}

fn take_hit(w: u32, triangle: u32, inverse_t: f32, is_nearer: bool) {
    traversals[w].hit = select(traversals[w].hit, hit_in_tree(w, triangle), is_nearer);
    traversals[w].inverse_t = select(traversals[w].inverse_t, inverse_t, is_nearer);
    traversals[w].t_max = 1.0 / traversals[w].inverse_t;
}

// Traverses the tree with each ray of the lane that is not yet done. `end` is the common origin, or the light. Lanes are independent of one
// another.
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
        // 1 / distance of a hit that may be in a hole, or 0.
        var doubtful: array<f32, TRAVERSALS>;
        var doubtful_triangle: array<u32, TRAVERSALS>;
#endif
        for (var w = 0u; w < TRAVERSALS; w++) {
            let triangle = traversals[w].leaf & ~LEAF_FLAGS;
            // The leaf of an instance stays.
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
        // A loop that most rays skip: drivers that compute both sides of a branch would make all rays pay for it.
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
