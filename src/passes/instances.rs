//! Where instances place the meshes that they share, on the device.

use glam::DAffine3;

use crate::{
    Result,
    geometry::Geometry,
    local_space::LocalSpace,
    ray_tree::{TreeInstance, rows_of, whole_number},
    vulkan::{Allocate, CommandPool, Resource, TexelList},
};

/// Texels of an instance, as in the shader.
const INSTANCE_TEXELS: u64 = 8;

/// The list of `shaders/shared/instance.wgsl`. Instances of the same mesh follow each other.
pub(crate) struct Instances(TexelList);

/// Declares the memory for the list.
pub(crate) fn declare(allocate: &impl Allocate, instance_count: u64) -> Result<()> {
    TexelList::declare(
        allocate,
        "instances",
        (1 + instance_count) * INSTANCE_TEXELS,
    )
}

impl Instances {
    /// Uploads the scene itself first, with the nodes of its tree. The instances of shared meshes follow, each with the tree that its
    /// rays traverse.
    pub fn upload(
        commands: &CommandPool,
        geometry: &Geometry,
        space: &LocalSpace,
        trees: &[TreeInstance],
        node_count: u32,
    ) -> Result<Instances> {
        let scene = TreeInstance {
            first_texel: 1,
            node_end: node_count,
            ..TreeInstance::default()
        };
        let count = trees.len() as u32;
        let mut texels = instance_texels(DAffine3::IDENTITY, &scene, count, 0).to_vec();
        // Hits on instances are numbered after those on triangles in the scene's space.
        let mut first_hit = trees.first().map_or(0, |tree| tree.first_triangle);
        let instances = geometry.shared.iter().flat_map(|mesh| {
            let placed = mesh.instances.iter();
            placed.map(|instance| (instance.index, mesh.to_local(instance, space)))
        });
        for ((index, to_scene), tree) in instances.zip(trees) {
            texels.extend(instance_texels(to_scene, tree, first_hit, 1 + index as u32));
            first_hit += tree.triangle_count;
        }
        Ok(Instances(TexelList::new(commands, "instances", texels)?))
    }

    /// The list with its name in the shaders.
    pub fn resource(&self) -> (&'static str, Resource<'_>) {
        ("instances", self.0.resource())
    }
}

fn instance_texels(
    to_scene: DAffine3,
    tree: &TreeInstance,
    first_hit: u32,
    instance_id: u32,
) -> [[f32; 4]; INSTANCE_TEXELS as usize] {
    let [x, y, z] = rows_of(to_scene);
    let [back_x, back_y, back_z] = rows_of(to_scene.inverse());
    let hit_offset = first_hit.saturating_sub(tree.first_triangle) * u32::from(instance_id > 0);
    let numbers = [tree.first_texel, tree.node_end, tree.next_node, hit_offset];
    let handedness = to_scene.matrix3.determinant().signum() as f32;
    let [first_hit, instance_id] = [first_hit, instance_id].map(whole_number);
    let more = [first_hit, instance_id, handedness, 0.0];
    [
        x,
        y,
        z,
        back_x,
        back_y,
        back_z,
        numbers.map(whole_number),
        more,
    ]
}
