// Where instances place the meshes that they share: src/passes/instances.rs. An instance is 1 + its place; 0 is the scene itself, for what lies in its
// space anyway.

// INSTANCE_TEXELS for each: the rows of what takes its mesh to the scene, and those of the way back; where its mesh's tree begins in ray_boxes, the
// node behind the tree's last, the node of the scene's tree behind the instance, and what is added to a triangle's place in ray_triangles to tell its
// hit on this instance from that on others; its first hit (of the scene itself the number of instances), its mesh id, and -1 where it is mirrored or 1.
var instances: texture_2d<f32>;

const INSTANCE_TEXELS: u32 = 8u;

fn instance_texel(instance: u32, texel: u32) -> vec4<f32> {
    let index = INSTANCE_TEXELS * instance + texel;
    return textureLoad(instances, vec2<u32>(index & 1023u, index >> 10u), 0);
}

// A whole number: as the bits of a float that is neither subnormal nor NaN.
fn whole_number(word: f32) -> u32 {
    return bitcast<u32>(word) & 0x3fffffffu;
}

fn instance_count() -> u32 {
    return first_hit(0u);
}

fn first_hit(instance: u32) -> u32 {
    return whole_number(instance_texel(instance, 7u).x);
}

fn hit_offset(instance: u32) -> u32 {
    return whole_number(instance_texel(instance, 6u).w);
}

fn mesh_id_of(instance: u32) -> u32 {
    return whole_number(instance_texel(instance, 7u).y);
}

// Rows of an affine transform.
struct Placement {
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
}

fn to_scene(instance: u32) -> Placement {
    return Placement(instance_texel(instance, 0u), instance_texel(instance, 1u), instance_texel(instance, 2u));
}

fn to_mesh(instance: u32) -> Placement {
    return Placement(instance_texel(instance, 3u), instance_texel(instance, 4u), instance_texel(instance, 5u));
}

fn placed_direction(placement: Placement, direction: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(placement.x.xyz, direction), dot(placement.y.xyz, direction), dot(placement.z.xyz, direction));
}

fn placed_point(placement: Placement, point: vec3<f32>) -> vec3<f32> {
    return placed_direction(placement, point) + vec3<f32>(placement.x.w, placement.y.w, placement.z.w);
}

// A normal in the scene, by what takes the scene to its mesh: a unit vector, or 0 for 0.
fn placed_normal(to_mesh: Placement, normal: vec3<f32>) -> vec3<f32> {
    let along = normal.x * to_mesh.x.xyz + normal.y * to_mesh.y.xyz + normal.z * to_mesh.z.xyz;
    let length_squared = dot(along, along);
    return along * select(0.0, 1.0 / sqrt(length_squared), length_squared > 0.0);
}

// That of a triangle, which goes with the order of its corners: in a mirror it is on the other side.
fn placed_triangle_normal(instance: u32, normal: vec3<f32>) -> vec3<f32> {
    return instance_texel(instance, 7u).z * placed_normal(to_mesh(instance), normal);
}
