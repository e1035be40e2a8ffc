// Traces a ray in a tree of boxes, on devices without ray queries. src/ray_tree describes the list. Nodes are stored depth first, each with
// the node after its subtree, so a ray needs no stack.
//
// A mesh that instances share has a tree in its own space. A ray that enters the box of an instance is transformed into that space,
// traverses that tree, and then returns. Distances are the same in both spaces, because a direction is transformed with its length.

#import instance
#import triangle_hit

var ray_boxes: texture_storage_2d<rgba32float, read>;

// Texels of ray_boxes before the first node.
const HEADER_TEXELS: u32 = 3u;
// The word of a leaf: LEAF | triangle, with LEAF_CUTOUT if the triangle has cut-outs.
const LEAF: u32 = 0x40000000u;
const LEAF_CUTOUT: u32 = 0x20000000u;
// The word of an instance: LEAF | LEAF_INSTANCE | its index.
const LEAF_INSTANCE: u32 = 0x10000000u;
const LEAF_FLAGS: u32 = LEAF | LEAF_CUTOUT | LEAF_INSTANCE;

fn box_texel(index: u32) -> vec4<f32> {
    return textureLoad(ray_boxes, list_place(index));
}

// A ray in the space of a tree.
struct RayInTree {
    origin: vec3<f32>,
    direction: vec3<f32>,
    // The ray crosses coordinate `c` of the grid to which boxes are rounded at distance c · `scale` + `start`.
    scale: vec3<f32>,
    start: vec3<f32>,
    // The node after the tree's last.
    node_end: u32,
    // 0: the scene's tree.
    instance: u32,
    // The largest length of the scene's local unit; and what distinguishes hits in this tree from others.
    unit: f32,
    hit_offset: u32,
}

// Never infinite, so that 0 times the inverse is 0 and not NaN.
fn inverse_of(direction: vec3<f32>) -> vec3<f32> {
    return 1.0 / select(direction, vec3<f32>(1e-30), abs(direction) < vec3<f32>(1e-30));
}

// In the tree whose grid begins at texel `grid`.
fn on_grid(ray: RayInTree, grid: u32) -> RayInTree {
    var in_tree = ray;
    let inverse = inverse_of(ray.direction);
    in_tree.scale = box_texel(grid + 1u).xyz * inverse;
    in_tree.start = (box_texel(grid).xyz - ray.origin) * inverse;
    return in_tree;
}

fn in_scene(ray: Ray) -> RayInTree {
    var in_tree: RayInTree;
    in_tree.origin = ray.origin;
    in_tree.direction = ray.direction;
    in_tree.node_end = whole_number(box_texel(0u).x);
    in_tree.unit = 1.0;
    return on_grid(in_tree, 1u);
}

fn in_instance(ray: Ray, instance: u32) -> RayInTree {
    let tree = instance_texel(instance, 6u);
    let back = to_mesh(instance);
    var in_tree: RayInTree;
    in_tree.origin = placed_point(back, ray.origin);
    in_tree.direction = placed_direction(back, ray.direction);
    in_tree.node_end = whole_number(tree.y);
    in_tree.instance = instance;
    in_tree.unit = sqrt(max(max(dot(back.x.xyz, back.x.xyz), dot(back.y.xyz, back.y.xyz)), dot(back.z.xyz, back.z.xyz)));
    in_tree.hit_offset = whole_number(tree.w);
    return on_grid(in_tree, whole_number(tree.x));
}

fn trace_ray(ray: Ray) -> u32 {
    var hit = NOTHING_HIT;
    var inverse_t = 1.0 / ray.t_max;
    var in_tree = in_scene(ray);
    var node = select(0u, in_tree.node_end, ray.t_max < 0.0);
    loop {
        // Up to the next leaf that the ray meets.
        var leaf = 0u;
        let t_max = 1.0 / inverse_t;
        while ((leaf == 0u) & (node < in_tree.node_end)) {
            let words = bitcast<vec4<u32>>(box_texel(HEADER_TEXELS + node));
            let a = vec3<f32>(words.xyz & vec3<u32>(0xffffu)) * in_tree.scale + in_tree.start;
            let b = vec3<f32>(words.xyz >> vec3<u32>(16u)) * in_tree.scale + in_tree.start;
            let enters = min(a, b);
            let leaves = max(a, b);
            let enter = max(max(enters.x, enters.y), max(enters.z, 0.0));
            let leave = min(min(leaves.x, leaves.y), min(leaves.z, t_max));
            let is_met = enter <= leave;
            let is_leaf = (words.w & LEAF) != 0u;
            node = select(words.w, node + 1u, is_met | is_leaf);
            leaf = select(0u, words.w, is_met & is_leaf);
        }
        if (INSTANCED) {
            if (leaf == 0u && in_tree.instance != 0u) {
                node = whole_number(instance_texel(in_tree.instance, 6u).z);
                in_tree = in_scene(ray);
                continue;
            }
            if ((leaf & LEAF_INSTANCE) != 0u) {
                in_tree = in_instance(ray, 1u + (leaf & ~LEAF_FLAGS));
                // Nodes count from the first node of the scene's tree.
                node = whole_number(instance_texel(in_tree.instance, 6u).x) + 2u - HEADER_TEXELS;
                continue;
            }
        }
        if (leaf == 0u) {
            break;
        }
        let triangle = leaf & ~LEAF_FLAGS;
        let at = meet(corners_at(triangle), in_tree.origin, in_tree.direction, ray.end_height, in_tree.unit);
        let own_hit = triangle + in_tree.hit_offset;
        let own_inverse_t = inverse_t_of(at);
        var is_hit: bool;
        if (ANY) {
            is_hit = is_between_ends(at);
        } else {
            // Of triangles at equal distance, a ray hits the first one, whichever box it enters first. So the structure of a tree does not
            // affect the image. NOTHING_HIT comes before all others.
            is_hit = (own_inverse_t > inverse_t) | ((own_inverse_t == inverse_t) & (bitcast<i32>(own_hit) < bitcast<i32>(hit)));
        }
        if (CUTOUT) {
            if (is_hit && (leaf & LEAF_CUTOUT) != 0u) {
                is_hit = !is_hole(cutout_of(triangle), at.weights);
            }
        }
        if (ANY) {
            if (is_hit) {
                return own_hit;
            }
        } else {
            hit = select(hit, own_hit, is_hit);
            inverse_t = select(inverse_t, own_inverse_t, is_hit);
        }
    }
    return hit;
}
