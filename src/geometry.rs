//! A scene's meshes on the device: in the scene's space, or once for all instances in a space of their own.
//!
//! Rays find meshes in the scene's space faster. A shared mesh takes the memory of one mesh, and its instances can move without a copy.

use std::collections::{HashMap, HashSet};

use glam::{DAffine3, DMat3, DVec3};

use crate::{
    LocalSpace, Scene,
    scene::{BoundingBox, Instance, Mesh, Shadow, Shared},
};

/// Smaller meshes are copied into the scene's space for each instance.
const LEAST_SHARED_TRIANGLES: usize = 256;
/// How much more a shared mesh may be stretched along one axis than along another: f32 has no digits for more.
const MOST_STRETCH: f64 = 200.0;

/// The meshes of a valid scene.
#[derive(Debug)]
pub(crate) struct Geometry {
    pub placed: Vec<PlacedMesh>,
    pub shared: Vec<SharedMesh>,
}

/// A mesh in world space.
#[derive(Debug, Clone)]
pub(crate) struct PlacedMesh {
    /// The index of its instance in the scene.
    pub index: usize,
    pub mesh: Shared<Mesh>,
    /// The instance that it was made from.
    instance: Instance,
}

/// A mesh with its instances.
#[derive(Debug)]
pub(crate) struct SharedMesh {
    pub mesh: Shared<Mesh>,
    /// Its own space on the device: its coordinates are within −1 and 1.
    pub space: LocalSpace,
    pub instances: Vec<SharedInstance>,
}

/// The placement of a shared mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SharedInstance {
    /// The index in the scene.
    pub index: usize,
    pub to_world: DAffine3,
}

/// How much of a scene's meshes the device holds.
#[derive(Debug, Default, Clone, Copy)]
pub(crate) struct GeometrySize {
    pub triangles: u64,
    pub vertices: u64,
    pub meshes: u64,
    pub shared_instances: u64,
}

impl Geometry {
    /// The geometry of a scene. Meshes in the scene's space come from the previous geometry if they are the same.
    pub fn of(scene: &Scene, before: Option<&Geometry>) -> Geometry {
        let placed = before.iter().flat_map(|before| &before.placed);
        let before: HashMap<usize, &PlacedMesh> =
            placed.map(|placed| (placed.index, placed)).collect();
        let placed_before = |index: usize, instance: &Instance| {
            let placed = before.get(&index)?;
            let is_same = placed.instance.is_same(instance);
            is_same.then(|| placed.mesh.clone())
        };
        let mut geometry = Geometry {
            placed: Vec::new(),
            shared: Vec::new(),
        };
        let mut places = HashMap::new();
        for (index, (instance, is_shared)) in scene.meshes.iter().zip(are_shared(scene)).enumerate()
        {
            if !is_shared {
                let mesh = placed_before(index, instance).unwrap_or_else(|| instance.placed());
                geometry.placed.push(PlacedMesh {
                    index,
                    mesh,
                    instance: instance.clone(),
                });
                continue;
            }
            let place = *places.entry(instance.mesh.id()).or_insert_with(|| {
                geometry.shared.push(SharedMesh::new(&instance.mesh));
                geometry.shared.len() - 1
            });
            let to_world = instance.to_world;
            let instances = &mut geometry.shared[place].instances;
            instances.push(SharedInstance { index, to_world });
        }
        geometry
    }

    pub fn placed_triangle_count(&self) -> u32 {
        let counts = self.placed.iter().map(|placed| placed.mesh.triangles.len());
        counts.sum::<usize>() as u32
    }

    /// Whether the device holds the same data, except for the placement of shared meshes.
    pub fn holds_the_same(&self, other: &Geometry) -> bool {
        let placed = |a: &PlacedMesh, b: &PlacedMesh| a.index == b.index && a.mesh.ptr_eq(&b.mesh);
        let shared = |a: &SharedMesh, b: &SharedMesh| {
            a.mesh.ptr_eq(&b.mesh) && a.instances.len() == b.instances.len()
        };
        are_alike(&self.placed, &other.placed, placed)
            && are_alike(&self.shared, &other.shared, shared)
    }

    /// All meshes, those in world space first.
    pub fn meshes(&self) -> impl Iterator<Item = &Shared<Mesh>> {
        let placed = self.placed.iter().map(|placed| &placed.mesh);
        placed.chain(self.shared.iter().map(|shared| &shared.mesh))
    }
}

impl GeometrySize {
    /// The size of a scene's geometry, without building the geometry.
    pub fn of(scene: &Scene) -> GeometrySize {
        let are_shared = are_shared(scene).into_iter();
        let mut size = GeometrySize {
            shared_instances: are_shared.filter(|is_shared| *is_shared).count() as u64,
            ..GeometrySize::default()
        };
        for mesh in meshes_on_device(scene) {
            size.meshes += 1;
            size.triangles += mesh.triangles.len() as u64;
            size.vertices += mesh.positions_m.len() as u64;
        }
        size
    }
}

/// The meshes that the device holds: one for each instance, or one for all instances that share it.
pub(crate) fn meshes_on_device(scene: &Scene) -> impl Iterator<Item = &Shared<Mesh>> {
    let mut seen = HashSet::new();
    let instances = scene.meshes.iter().zip(are_shared(scene));
    instances.filter_map(move |(instance, is_shared)| {
        let is_new = !is_shared || seen.insert(instance.mesh.id());
        is_new.then_some(&instance.mesh)
    })
}

fn are_alike<T>(a: &[T], b: &[T], is_alike: impl Fn(&T, &T) -> bool) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_alike(a, b))
}

/// Whether each instance shares its mesh on the device.
pub(crate) fn are_shared(scene: &Scene) -> Vec<bool> {
    let mut counts = HashMap::new();
    for instance in &scene.meshes {
        *counts.entry(instance.mesh.id()).or_insert(0) += 1;
    }
    // A texel of a shadow map stores a triangle, not its instance. And no kernel supports both instances and cut-outs.
    let is_possible = scene.direct.shadow != Some(Shadow::Map) && !scene.has_cutouts();
    let is_shared = |instance: &Instance| {
        let is_at_home = counts[&instance.mesh.id()] == 1 && instance.is_in_world_space();
        is_possible
            && !is_at_home
            && instance.triangles.len() >= LEAST_SHARED_TRIANGLES
            && is_even(instance.to_world.matrix3)
    };
    scene.meshes.iter().map(is_shared).collect()
}

/// Whether a matrix stretches all axes about equally.
fn is_even(linear: DMat3) -> bool {
    let size = |matrix: DMat3| {
        let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        columns.map(DVec3::length_squared).iter().sum::<f64>()
    };
    // About 2s² for a matrix that stretches one axis by s; NaN or more for a singular one.
    size(linear) * size(linear.inverse()) < 2.0 * MOST_STRETCH.powi(2)
}

/// Whether a scene has meshes that instances share on the device.
pub(crate) fn has_shared_meshes(scene: &Scene) -> bool {
    are_shared(scene).contains(&true)
}

impl SharedMesh {
    fn new(mesh: &Shared<Mesh>) -> SharedMesh {
        let corners = mesh.triangles.as_flattened().iter();
        let corners_m = corners.map(|&corner| mesh.positions_m[corner as usize]);
        SharedMesh {
            mesh: mesh.clone(),
            space: LocalSpace::of(BoundingBox::around(corners_m)),
            instances: Vec::new(),
        }
    }

    /// The transform from the mesh's own space to the scene's.
    pub fn to_local(&self, instance: &SharedInstance, scene: &LocalSpace) -> DAffine3 {
        let own = self.space;
        let origin_m = instance.to_world.transform_point3(own.origin_m);
        DAffine3 {
            matrix3: instance.to_world.matrix3 * (own.metres_per_unit / scene.metres_per_unit),
            translation: (origin_m - scene.origin_m) / scene.metres_per_unit,
        }
    }
}
