//! The scene's triangles on the device for rays.

use std::{iter, sync::Arc};

use glam::DAffine3;

use super::instances::Instances;
use super::textures::{Textures, halves_of_first_word};
use crate::{
    Result, Scene, Tracer,
    geometry::{Geometry, GeometrySize, PlacedMesh, SharedMesh},
    local_space::LocalSpace,
    ray_tree::{
        Cutouts, Find, HostTracer, MeshTrees, RayTree, SharedTree, TRIANGLE_TEXELS, Texel,
        TreeInstance, alpha_cutoff, alpha_textures, corners_of, corners_of_placed, max_box_texels,
        rows_of, triangle_texels_in,
    },
    vulkan::{
        AccelerationStructure, Allocate, BufferUse, CommandPool, InstancedTriangles, Resource,
        TexelList,
        shaders::{Hit, Key, Search, Traced},
    },
};

/// Approximate bytes of an acceleration structure per triangle. Building it takes the same again.
const STRUCTURE_BYTES: u64 = 128;

/// Texels per triangle with cut-outs.
const CUTOUT_TEXELS: u64 = 3;

/// The lists in which `shaders/shared/hit_triangle.wgsl` finds a scene's triangles, and what leads rays to them.
pub(crate) struct RayTriangles {
    pub instances: Arc<Instances>,
    is_instanced: bool,
    triangles: TexelList,
    found_by: Finder,
    /// Only if some triangle has cut-outs.
    alpha_textures: Option<Arc<Textures>>,
}

/// What leads rays to triangles.
enum Finder {
    Host(Box<HostTracer>),
    /// The boxes of a ray tree.
    Kernel(TexelList),
    Device(Box<AccelerationStructure>),
}

/// Declares the memory for the triangles of a scene.
pub(crate) fn declare(allocate: &impl Allocate, scene: &Scene, tracer: Tracer) -> Result<()> {
    let size = GeometrySize::of(scene);
    let triangles = size.triangles;
    let with_cutouts = scene.meshes.iter().filter(|_| scene.has_cutouts());
    let alpha = with_cutouts.flat_map(|instance| alpha_textures(scene, instance));
    let of_cutouts = CUTOUT_TEXELS * alpha.flatten().count() as u64;
    let texels = TRIANGLE_TEXELS as u64 * triangles + of_cutouts;
    TexelList::declare(allocate, "triangles for rays", texels)?;
    match tracer {
        Tracer::Host => Ok(()),
        Tracer::Query => {
            let what = "acceleration structure";
            allocate.buffer(what, triangles * STRUCTURE_BYTES, BufferUse::Device)?;
            allocate.buffer(what, triangles * STRUCTURE_BYTES, BufferUse::Staging)?;
            Ok(())
        }
        Tracer::Kernel => {
            let texels = max_box_texels(triangles, size.shared_instances);
            TexelList::declare(allocate, "boxes for rays", texels)
        }
    }
}

/// For each triangle in the scene's space: 1 + its place among those with cut-outs, or 0. Also returns the triangles with cut-outs,
/// as the list of `shaders/shared/hit_triangle.wgsl`.
fn cutouts_of(
    scene: &Scene,
    geometry: &Geometry,
    textures: &Textures,
) -> (Vec<u32>, Vec<[f32; 4]>) {
    let mut numbers = Vec::new();
    let mut texels = Vec::new();
    for PlacedMesh { mesh, .. } in &geometry.placed {
        let triangles = mesh.triangles.iter().zip(&mesh.triangle_materials);
        for ((corners, &material), alpha) in triangles.zip(alpha_textures(scene, mesh)) {
            if let Some(lookup) = alpha {
                let [a, b, c] =
                    corners.map(|corner| mesh.texcoord(&lookup, corner).map(|c| c as f32));
                let place = textures.alpha_place_of(alpha);
                let [width, height] = place.size.map(|size| size as f32);
                let [first, second] = halves_of_first_word(place);
                let cutoff = alpha_cutoff(&scene.materials[material as usize]);
                texels.extend([
                    [a[0], a[1], b[0], b[1]],
                    [c[0], c[1], width, height],
                    [first, second, cutoff, place.flags as f32],
                ]);
            }
            numbers.push(alpha.map_or(0, |_| (texels.len() as u64 / CUTOUT_TEXELS) as u32));
        }
    }
    (numbers, texels)
}

fn placements(mesh: &SharedMesh, space: &LocalSpace) -> Vec<DAffine3> {
    let instances = mesh.instances.iter();
    instances
        .map(|instance| mesh.to_local(instance, space))
        .collect()
}

/// The finder of triangles, and the triangles in the order that it uses.
struct Made {
    found_by: Finder,
    triangles: Vec<Texel>,
    instances: Vec<TreeInstance>,
    /// Nodes of the scene's own tree.
    node_count: u32,
}

fn by_tree(
    commands: &CommandPool,
    geometry: &Geometry,
    space: &LocalSpace,
    cutouts: &[u32],
    trees: &mut MeshTrees,
    host_cutouts: Option<Cutouts>,
    is_for_host: bool,
) -> Result<Made> {
    let to_local = geometry.shared.iter().map(|mesh| placements(mesh, space));
    let to_local: Vec<Vec<DAffine3>> = to_local.collect();
    let scene = trees.of_scene(geometry, space, cutouts);
    let trees = trees.of_shared(&geometry.shared, &to_local);
    let mut first_place = geometry.placed_triangle_count();
    let shared = trees.iter().zip(to_local).map(|(tree, to_local)| {
        let of_mesh = SharedTree {
            tree,
            first_place,
            to_local,
        };
        first_place += tree.triangle_count();
        of_mesh
    });
    let shared: Vec<SharedTree> = shared.collect();
    let tree = RayTree::over(&scene, &shared);
    let found_by = match is_for_host {
        true => Finder::Host(HostTracer::over(&scene, &shared, host_cutouts).into()),
        false => Finder::Kernel(TexelList::new(commands, "boxes for rays", tree.boxes)?),
    };
    Ok(Made {
        found_by,
        triangles: tree.triangles,
        instances: tree.instances,
        node_count: tree.node_count,
    })
}

/// In each mesh, triangles with cut-outs come last.
fn by_device(
    commands: &CommandPool,
    geometry: &Geometry,
    space: &LocalSpace,
    cutouts: &[u32],
) -> Result<Made> {
    let placed = corners_of_placed(geometry, space);
    let mut first_place = placed.len() as u32;
    let placed = (placed, cutouts.to_vec(), 0, vec![DAffine3::IDENTITY]);
    let shared = geometry.shared.iter().map(|mesh| {
        let corners = corners_of(&mesh.mesh, &mesh.space);
        let without_cutouts = vec![0; corners.len()];
        let place = first_place;
        first_place += corners.len() as u32;
        (corners, without_cutouts, place, placements(mesh, space))
    });
    let (mut triangles, mut instances, mut levels) = (Vec::new(), Vec::new(), Vec::new());
    for (corners, cutouts, first_place, to_local) in iter::once(placed).chain(shared) {
        let all = 0..corners.len() as u32;
        let (mut order, with_cutouts): (Vec<u32>, Vec<u32>) =
            all.partition(|&place| cutouts[place as usize] == 0);
        let whole_count = order.len();
        order.extend(with_cutouts);
        let first_triangle = triangles.len() / TRIANGLE_TEXELS;
        triangles.extend(triangle_texels_in(&order, &corners, &cutouts));
        for triangle in (first_triangle..).take(order.len()) {
            triangles[TRIANGLE_TEXELS * triangle + 3][0] += first_place as f32;
        }
        if let Some(numbers) = triangles.get_mut(TRIANGLE_TEXELS * first_triangle + 3) {
            numbers[2] = whole_count as f32;
        }
        let in_order = order.iter().map(|&place| corners[place as usize]);
        levels.push(InstancedTriangles {
            corners: in_order
                .map(|corners| corners.map(|corner| corner.to_array()))
                .collect(),
            opaque_count: whole_count,
            to_scene: to_local.iter().map(|&to_local| rows_of(to_local)).collect(),
        });
        instances.push((first_triangle, order.len(), to_local.len()));
    }
    let instances = instances.into_iter().skip(1);
    let instances = instances.flat_map(|(first_triangle, triangle_count, count)| {
        let instance = TreeInstance {
            first_triangle: first_triangle as u32,
            triangle_count: triangle_count as u32,
            ..TreeInstance::default()
        };
        iter::repeat_n(instance, count)
    });
    Ok(Made {
        found_by: Finder::Device(Box::new(AccelerationStructure::over(commands, &levels)?)),
        triangles,
        instances: instances.collect(),
        node_count: 0,
    })
}

impl RayTriangles {
    pub fn of(
        commands: &CommandPool,
        scene: &Scene,
        geometry: &Geometry,
        space: &LocalSpace,
        textures: &Arc<Textures>,
        tracer: Tracer,
        trees: &mut MeshTrees,
    ) -> Result<RayTriangles> {
        let (cutouts, cutout_texels) = cutouts_of(scene, geometry, textures);
        let alpha_textures = (!cutout_texels.is_empty()).then(|| textures.clone());
        let mut made = match tracer {
            Tracer::Query => by_device(commands, geometry, space, &cutouts)?,
            Tracer::Host | Tracer::Kernel => {
                let host_cutouts = || Cutouts::of(scene, geometry);
                let host_cutouts = (!cutout_texels.is_empty()).then(host_cutouts);
                let for_host = tracer == Tracer::Host;
                by_tree(
                    commands,
                    geometry,
                    space,
                    &cutouts,
                    trees,
                    host_cutouts,
                    for_host,
                )?
            }
        };
        let triangle_count = made.triangles.len() / TRIANGLE_TEXELS;
        if let Some(numbers) = made.triangles.get_mut(3) {
            numbers[3] = triangle_count as f32;
        }
        made.triangles.extend(cutout_texels);
        let instances = &made.instances;
        let node_count = made.node_count;
        let list = Instances::upload(commands, geometry, space, instances, node_count)?;
        Ok(RayTriangles {
            instances: Arc::new(list),
            triangles: TexelList::new(commands, "triangles for rays", made.triangles)?,
            is_instanced: !instances.is_empty(),
            found_by: made.found_by,
            alpha_textures,
        })
    }

    /// The kernel that traces rays among these triangles.
    pub fn key(&self, find: Find) -> Key {
        Key::Trace {
            hit: match find {
                Find::Any => Hit::Any,
                Find::Closest => Hit::Closest,
            },
            search: match self.found_by {
                Finder::Device(_) => Search::Query,
                Finder::Host(_) | Finder::Kernel(_) => Search::Kernel,
            },
            traced: match self.alpha_textures {
                _ if self.is_instanced => Some(Traced::Instanced),
                Some(_) => Some(Traced::Cutout),
                None => None,
            },
        }
    }

    pub fn host_tracer(&self) -> Option<&HostTracer> {
        match &self.found_by {
            Finder::Host(tracer) => Some(tracer),
            _ => None,
        }
    }

    /// The lists with their names in the shaders.
    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let mut resources = vec![
            self.instances.resource(),
            ("ray_triangles", self.triangles.resource()),
        ];
        resources.extend(match &self.found_by {
            Finder::Host(_) => None,
            Finder::Kernel(boxes) => Some(("ray_boxes", boxes.resource())),
            Finder::Device(structure) => {
                Some(("ray_scene", Resource::AccelerationStructure(structure)))
            }
        });
        let textures = self.alpha_textures.as_ref();
        resources.extend(textures.and_then(|textures| textures.resource()));
        resources
    }
}
