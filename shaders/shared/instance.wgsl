// Where instances place the meshes that they share: src/passes/instances.rs. Instance numbers are 1 + the instance's index. 0 is the scene
// itself, for everything that is already in the scene's space.

// INSTANCE_TEXELS for each instance. Texels 0 to 2: rows of the transform from its mesh to the scene. Texels 3 to 5: rows of the inverse.
// Texel 6: where its mesh's tree begins in ray_boxes; the node after that tree's last; the node of the scene's tree after the instance; and
// the number added to a triangle's index in ray_triangles, which distinguishes a hit on this instance from hits on others. Texel 7: its
// first hit (for the scene itself: the number of instances); its instance id; −1 if it is mirrored, else 1.
var instances: texture_2d<f32>;

const INSTANCE_TEXELS: u32 = 8u;

fn instance_texel(instance: u32, texel: u32) -> vec4<f32> {
    let index = INSTANCE_TEXELS * instance + texel;
    return textureLoad(instances, vec2<u32>(index & 1023u, index >> 10u), 0);
}

// A whole number, stored as the bits of a float that is neither subnormal nor NaN.
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

fn instance_id_of(instance: u32) -> u32 {
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

// A normal in the scene, from the transform of the scene to its mesh: a unit vector, or 0 for 0.
fn placed_normal(to_mesh: Placement, normal: vec3<f32>) -> vec3<f32> {
    let along = normal.x * to_mesh.x.xyz + normal.y * to_mesh.y.xyz + normal.z * to_mesh.z.xyz;
    let length_squared = dot(along, along);
    return along * select(0.0, 1.0 / sqrt(length_squared), length_squared > 0.0);
}

// −1 for a mirrored instance, else 1.
fn handedness(instance: u32) -> f32 {
    return instance_texel(instance, 7u).z;
}

// A triangle's normal in the scene. Its side depends on the order of the corners, so a mirrored instance flips it.
fn placed_triangle_normal(instance: u32, normal: vec3<f32>) -> vec3<f32> {
    return handedness(instance) * placed_normal(to_mesh(instance), normal);
}
