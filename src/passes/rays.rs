//! The scene's triangles on the device for rays.

use std::sync::Arc;

use super::textures::{Textures, halves_of_first_word};
use crate::{
    RayKernel, Result, Scene,
    local_space::LocalSpace,
    ray_tree::{
        RayTree, TRIANGLE_TEXELS, corners_of, max_box_texels, max_triangle_texels,
        triangle_texels_in,
    },
    scene::Mesh,
    vulkan::{AccelerationStructure, Allocate, BufferUse, CommandPool, Resource, TexelList},
};

/// Iterations of its loops in which a packet goes through a tree, for each halving of its nodes: about seven times what knot takes, by an
/// estimate from the boxes that its rays test.
const TREE_ITERATIONS: f64 = 240.0;
/// The same of the smallest trees, for each node: a lane takes its eight rays two at a time.
const NODE_ITERATIONS: f64 = 5.0;

/// What an acceleration structure takes for a triangle, about, and as much again while it is built.
const STRUCTURE_BYTES: u64 = 128;

/// Texels of a triangle's cut-outs.
const CUTOUT_TEXELS: u64 = 3;

/// What `shaders/trace.wgsl` finds a scene's triangles in.
pub(crate) struct RayTriangles {
    triangles: TexelList,
    triangle_count: u32,
    found_by: Finder,
    /// Where some triangle has cut-outs.
    alpha_textures: Option<Arc<Textures>>,
}

/// What leads rays to triangles.
enum Finder {
    Tree {
        boxes: TexelList,
        node_count: u32,
        group_count: u32,
    },
    Device(Box<AccelerationStructure>),
}

/// What the triangles of a scene take.
pub(crate) fn declare(allocate: &impl Allocate, scene: &Scene, kernel: RayKernel) -> Result<()> {
    let triangles = scene.triangle_count();
    let meshes = scene.meshes.iter();
    let alpha = meshes.flat_map(|mesh| alpha_textures(scene, mesh));
    let of_cutouts = CUTOUT_TEXELS * alpha.flatten().count() as u64;
    let texels = max_triangle_texels(triangles) + of_cutouts;
    TexelList::declare(allocate, "triangles for rays", texels)?;
    if kernel == RayKernel::Query {
        let what = "acceleration structure";
        allocate.buffer(what, triangles * STRUCTURE_BYTES, BufferUse::Device)?;
        allocate.buffer(what, triangles * STRUCTURE_BYTES, BufferUse::Staging)?;
        return Ok(());
    }
    TexelList::declare(allocate, "boxes for rays", max_box_texels(triangles))
}

/// That of each triangle of a mesh. A mesh without texture coordinates has no cut-outs.
fn alpha_textures<'s>(
    scene: &'s Scene,
    mesh: &'s Mesh,
) -> impl Iterator<Item = Option<usize>> + 's {
    let materials = mesh.triangle_materials.iter();
    let alpha = |&material: &u32| scene.materials[material as usize].alpha_texture;
    materials.map(move |material| alpha(material).filter(|_| !mesh.texcoords.is_empty()))
}

/// For each triangle of a scene 1 + its place among those with cut-outs, or 0; and these as the list of `shaders/trace.wgsl`.
fn cutouts_of(scene: &Scene, textures: &Textures) -> (Vec<u32>, Vec<[f32; 4]>) {
    let mut numbers = Vec::new();
    let mut texels = Vec::new();
    for mesh in &scene.meshes {
        for (corners, alpha) in mesh.triangles.iter().zip(alpha_textures(scene, mesh)) {
            if alpha.is_some() {
                let [a, b, c] =
                    corners.map(|corner| mesh.texcoords[corner as usize].map(|c| c as f32));
                let place = textures.alpha_place_of(alpha);
                let [width, height] = place.size.map(|size| size as f32);
                let [first, second] = halves_of_first_word(place);
                texels.extend([
                    [a[0], a[1], b[0], b[1]],
                    [c[0], c[1], width, height],
                    [first, second, 0.0, 0.0],
                ]);
            }
            numbers.push(alpha.map_or(0, |_| (texels.len() as u64 / CUTOUT_TEXELS) as u32));
        }
    }
    (numbers, texels)
}

impl RayTriangles {
    pub fn of(
        commands: &CommandPool,
        scene: &Scene,
        space: &LocalSpace,
        textures: &Arc<Textures>,
        kernel: RayKernel,
    ) -> Result<RayTriangles> {
        let corners = corners_of(scene, space);
        let (cutouts, cutout_texels) = cutouts_of(scene, textures);
        let alpha_textures = (!cutout_texels.is_empty()).then(|| textures.clone());
        let (found_by, mut texels) = if kernel == RayKernel::Query {
            let places = 0..corners.len() as u32;
            let (mut order, with_cutouts): (Vec<u32>, Vec<u32>) =
                places.partition(|&place| cutouts[place as usize] == 0);
            let whole_count = order.len();
            order.extend(with_cutouts);
            let in_order = order.iter().map(|&place| corners[place as usize]);
            let in_order: Vec<_> = in_order
                .map(|corners| corners.map(|corner| corner.to_array()))
                .collect();
            let structure = AccelerationStructure::over(commands, &in_order, whole_count)?;
            let mut texels = triangle_texels_in(&order, &corners, &cutouts);
            if let Some(numbers) = texels.get_mut(3) {
                numbers[2] = whole_count as f32;
            }
            (Finder::Device(Box::new(structure)), texels)
        } else {
            let tree = RayTree::over(&corners, &cutouts);
            let tree_of = Finder::Tree {
                node_count: tree.node_count(),
                group_count: tree.group_count(),
                boxes: TexelList::new(commands, "boxes for rays", tree.boxes)?,
            };
            (tree_of, tree.triangles)
        };
        let triangle_count = texels.len() / TRIANGLE_TEXELS;
        if let Some(numbers) = texels.get_mut(3) {
            numbers[3] = triangle_count as f32;
        }
        texels.extend(cutout_texels);
        Ok(RayTriangles {
            triangles: TexelList::new(commands, "triangles for rays", texels)?,
            triangle_count: corners.len() as u32,
            found_by,
            alpha_textures,
        })
    }

    /// The word of the kernels that go through these.
    pub fn kernel_word(&self) -> &'static str {
        match self.found_by {
            _ if self.alpha_textures.is_some() => "cutout",
            Finder::Tree {
                node_count: 1.., ..
            } => "tree",
            _ => "",
        }
    }

    /// Iterations of the loops in which eight rays a lane are traced, of which `single` and `query` have two. No bound, but what they are expected to stay far below.
    pub fn loop_iterations(&self, kernel: RayKernel) -> f64 {
        let (groups, nodes) = match self.found_by {
            Finder::Tree {
                group_count,
                node_count,
                ..
            } => (f64::from(group_count), f64::from(node_count)),
            Finder::Device(_) => (0.0, 2.0 * f64::from(self.triangle_count)),
        };
        let in_tree = (TREE_ITERATIONS * (nodes + 1.0).log2()).min(NODE_ITERATIONS * nodes);
        in_tree
            + match kernel {
                RayKernel::Packet => groups,
                RayKernel::Single | RayKernel::Query => 8.0 * groups,
            }
    }

    /// Under the names that the shaders give them.
    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let mut resources = vec![
            ("ray_triangles", self.triangles.resource()),
            match &self.found_by {
                Finder::Tree { boxes, .. } => ("ray_boxes", boxes.resource()),
                Finder::Device(structure) => {
                    ("ray_scene", Resource::AccelerationStructure(structure))
                }
            },
        ];
        let textures = self.alpha_textures.as_ref();
        resources.extend(textures.and_then(|textures| textures.resource()));
        resources
    }
}
