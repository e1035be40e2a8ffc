// Where instances place the meshes that they share: src/passes/instances.rs. An instance is 1 + its place in this list; 0: what lies in the
// scene's space anyway.

// A texel with the number of instances, then INSTANCE_TEXELS for each: the rows of what takes its mesh to the scene; those of the linear part of
// the way back, each with a number; the grid of its tree's boxes, low corner and step, each with a number; one more number, -1 where it is mirrored or 1, and how
// long a local unit of the scene is in its mesh's space, at most.
var instances: texture_2d<f32>;

const INSTANCE_TEXELS: u32 = 9u;

fn instance_texel(instance: u32, texel: u32) -> vec4<f32> {
    let index = 1u + INSTANCE_TEXELS * (instance - 1u) + texel;
    return textureLoad(instances, vec2<u32>(index & 1023u, index >> 10u), 0);
}

// A whole number: as the bits of a float that is neither subnormal nor NaN.
fn whole_number(word: f32) -> u32 {
    return bitcast<u32>(word) & 0x3fffffffu;
}

// What is added to a triangle's place in ray_triangles to tell its hit on this instance from that on others.
fn hit_offset(instance: u32) -> u32 {
    return whole_number(instance_texel(instance, 3u).w);
}

fn first_hit(instance: u32) -> u32 {
    return whole_number(instance_texel(instance, 4u).w);
}

fn mesh_id_of(instance: u32) -> u32 {
    return whole_number(instance_texel(instance, 5u).w);
}

struct Placement {
    // To the scene.
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    // The linear part of the way back.
    back_x: vec3<f32>,
    back_y: vec3<f32>,
    back_z: vec3<f32>,
    // -1 or 1.
    handedness: f32,
}

fn placement_of(instance: u32) -> Placement {
    return Placement(instance_texel(instance, 0u), instance_texel(instance, 1u), instance_texel(instance, 2u),
        instance_texel(instance, 3u).xyz, instance_texel(instance, 4u).xyz, instance_texel(instance, 5u).xyz,
        instance_texel(instance, 8u).y);
}

fn placed_point(placement: Placement, point: vec3<f32>) -> vec3<f32> {
    let turned = vec3<f32>(dot(placement.x.xyz, point), dot(placement.y.xyz, point), dot(placement.z.xyz, point));
    return turned + placement_offset(placement);
}

fn placement_offset(placement: Placement) -> vec3<f32> {
    return vec3<f32>(placement.x.w, placement.y.w, placement.z.w);
}

// A unit vector, or 0 for 0.
fn placed_normal(placement: Placement, normal: vec3<f32>) -> vec3<f32> {
    let along = normal.x * placement.back_x + normal.y * placement.back_y + normal.z * placement.back_z;
    let length_squared = dot(along, along);
    return along * select(0.0, 1.0 / sqrt(length_squared), length_squared > 0.0);
}

// That of a triangle, which goes with the order of its corners: in a mirror it is on the other side.
fn placed_triangle_normal(placement: Placement, normal: vec3<f32>) -> vec3<f32> {
    return placement.handedness * placed_normal(placement, normal);
}

fn unplaced_direction(placement: Placement, direction: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(placement.back_x, direction), dot(placement.back_y, direction), dot(placement.back_z, direction));
}
