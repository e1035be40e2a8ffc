//! Where instances place the meshes that they share, on the device.

use glam::{DAffine3, DVec3};

use crate::{
    Result,
    geometry::Geometry,
    local_space::LocalSpace,
    ray_tree::{TreeInstance, unit_length, whole_number},
    vulkan::{Allocate, CommandPool, Resource, TexelList},
};

/// Texels of an instance, as the shader has it.
const INSTANCE_TEXELS: u64 = 9;

/// The list of `shaders/instance.wgsl`. In it instances of one mesh lie one after the other.
pub(crate) struct Instances(TexelList);

/// What the list takes.
pub(crate) fn declare(allocate: &impl Allocate, instance_count: u64) -> Result<()> {
    TexelList::declare(allocate, "instances", 1 + instance_count * INSTANCE_TEXELS)
}

impl Instances {
    /// The instances of shared meshes, with what rays go through that meet them.
    pub fn upload(
        commands: &CommandPool,
        geometry: &Geometry,
        space: &LocalSpace,
        trees: &[TreeInstance],
    ) -> Result<Instances> {
        // Behind the hits on what lies in the scene's space.
        let mut first_hit = trees.first().map_or(0, |tree| tree.first_triangle);
        let mut texels = vec![[whole_number(trees.len() as u32), 0.0, 0.0, 0.0]];
        let instances = geometry.shared.iter().flat_map(|mesh| {
            let placed = mesh.instances.iter();
            placed.map(|instance| (instance.index, mesh.to_local(instance, space)))
        });
        for ((index, to_local), tree) in instances.zip(trees) {
            texels.extend(placement_texels(
                to_local,
                [first_hit - tree.first_triangle, first_hit, 1 + index as u32],
            ));
            let unit = unit_length(&to_local);
            let handedness = to_local.matrix3.determinant().signum();
            let [first_node, end] = tree.nodes.map(whole_number);
            texels.extend([
                tree.grid.low.extend(first_node).to_array(),
                tree.grid.step.extend(end).to_array(),
                [whole_number(tree.next_node), handedness as f32, unit as f32, 0.0],
            ]);
            first_hit += tree.triangle_count;
        }
        Ok(Instances(TexelList::new(commands, "instances", texels)?))
    }

    /// Under the name that the shaders give it.
    pub fn resource(&self) -> (&'static str, Resource<'_>) {
        ("instances", self.0.resource())
    }
}

/// The rows of what places a mesh, and those of the linear part of its inverse with a number each.
fn placement_texels(to_local: DAffine3, numbers: [u32; 3]) -> [[f32; 4]; 6] {
    let rows = to_local.matrix3.transpose();
    let rows = [rows.x_axis, rows.y_axis, rows.z_axis];
    let back = to_local.matrix3.inverse().transpose();
    let back = [back.x_axis, back.y_axis, back.z_axis];
    let offsets = to_local.translation.to_array().map(|offset| offset as f32);
    let texel = |row: DVec3, last: f32| row.as_vec3().extend(last).to_array();
    std::array::from_fn(|i| match i {
        0..3 => texel(rows[i], offsets[i]),
        _ => texel(back[i - 3], whole_number(numbers[i - 3])),
    })
}
