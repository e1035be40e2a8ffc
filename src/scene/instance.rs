//! Meshes placed in a scene.

use std::ops::{Deref, DerefMut};

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

use super::{Mesh, Shared};

/// A mesh placed in the scene. Instances of one mesh share it, in the host's memory and on the device.
///
/// It derefs to its mesh, whose positions and normals are in the mesh's own space. [`Instance::placed`] gives them in world space.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Instance {
    pub name: String,
    pub mesh: Shared<Mesh>,
    /// Transform from the mesh's own space to world space, metres. With the identity, the mesh is where its positions say.
    pub to_world: DAffine3,
}

impl Instance {
    /// Whether the mesh's own space is world space.
    pub fn is_in_world_space(&self) -> bool {
        self.to_world == DAffine3::IDENTITY
    }

    /// Whether both are the same shared mesh at the same place.
    pub(crate) fn is_same(&self, other: &Instance) -> bool {
        self.mesh.ptr_eq(&other.mesh) && self.to_world == other.to_world
    }

    /// The mesh in world space: the shared one if its own space is world space, otherwise a copy.
    pub fn placed(&self) -> Shared<Mesh> {
        if self.is_in_world_space() {
            return self.mesh.clone();
        }
        let positions_m = self.mesh.positions_m.iter();
        let positions_m = positions_m.map(|&at_m| self.to_world.transform_point3(at_m));
        let mut placed = Mesh {
            positions_m: positions_m.collect(),
            ..Mesh::clone(&self.mesh)
        };
        placed.place_directions(self.to_world.matrix3);
        Shared::from(placed)
    }

    /// The same mesh, rotated about the world's origin and then translated.
    pub fn posed(&self, rotation: DQuat, translation_m: DVec3) -> Instance {
        Instance {
            to_world: DAffine3::from_rotation_translation(rotation, translation_m) * self.to_world,
            ..self.clone()
        }
    }

    /// The corners of each triangle in world space. The mesh must belong to a validated scene.
    pub(super) fn corners_m(&self) -> impl Iterator<Item = [DVec3; 3]> {
        let place = |at_m| self.to_world.transform_point3(at_m);
        self.mesh.corners_m().map(move |corners| corners.map(place))
    }
}

impl Mesh {
    /// Transforms everything but positions. The front of each triangle stays its front where the transform mirrors.
    pub(crate) fn place_directions(&mut self, linear: DMat3) {
        let turn = normal_matrix(linear);
        for normal in &mut self.normals {
            *normal = unit_normal(turn, *normal);
        }
        let is_mirrored = linear.determinant() < 0.0;
        for [x, y, z, sign] in &mut self.tangents {
            let along = linear * Vec3::new(*x, *y, *z).as_dvec3();
            [*x, *y, *z] = along.normalize_or_zero().as_vec3().to_array();
            *sign = if is_mirrored { -*sign } else { *sign };
        }
        if is_mirrored {
            self.triangles
                .iter_mut()
                .for_each(|triangle| triangle.swap(1, 2));
        }
    }
}

/// The matrix that transforms normals. For a singular matrix, any result is valid.
fn normal_matrix(linear: DMat3) -> DMat3 {
    match linear.determinant() {
        0.0 => linear,
        _ => linear.inverse().transpose(),
    }
}

/// Transforms a normal of any length but zero, and normalises it.
fn unit_normal(turn: DMat3, normal: DVec3) -> DVec3 {
    // Without the division the square of a very short or long normal would leave the range of f64.
    (turn * (normal / normal.abs().max_element())).normalize_or(DVec3::Z)
}

impl From<Mesh> for Instance {
    /// Places the mesh where its positions are, under its own name.
    fn from(mesh: Mesh) -> Self {
        Instance::from(Shared::from(mesh))
    }
}

impl From<Shared<Mesh>> for Instance {
    fn from(mesh: Shared<Mesh>) -> Self {
        Instance {
            name: mesh.name.clone(),
            mesh,
            to_world: DAffine3::IDENTITY,
        }
    }
}

impl Deref for Instance {
    type Target = Shared<Mesh>;

    fn deref(&self) -> &Shared<Mesh> {
        &self.mesh
    }
}

impl DerefMut for Instance {
    fn deref_mut(&mut self) -> &mut Shared<Mesh> {
        &mut self.mesh
    }
}
