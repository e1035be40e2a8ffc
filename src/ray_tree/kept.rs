//! The ray trees of the previous frame.

use std::sync::Arc;

use glam::{DAffine3, Vec3};

use super::{MeshTree, corners_of, slack_of_shared};
use crate::{
    LocalSpace,
    geometry::{Geometry, SharedMesh},
    scene::{Mesh, Shared},
};

/// The trees do not change if only instances have moved, come or gone. They are refitted to meshes that have changed their shape.
#[derive(Default)]
pub(crate) struct MeshTrees {
    scene: Option<SceneTree>,
    shared: Vec<MeshTreeOf>,
}

/// The tree of the meshes in the scene's space.
struct SceneTree {
    space: LocalSpace,
    placed: Vec<Shared<Mesh>>,
    tree: Arc<MeshTree>,
}

/// The tree of a shared mesh.
struct MeshTreeOf {
    mesh: Shared<Mesh>,
    /// The slack of its boxes.
    slack: f32,
    tree: Arc<MeshTree>,
}

impl MeshTrees {
    /// The tree over the meshes in the scene's space. See [`MeshTree::of_scene`] for the cut-outs.
    pub fn of_scene(
        &mut self,
        geometry: &Geometry,
        space: &LocalSpace,
        cutouts: &[u32],
    ) -> Arc<MeshTree> {
        let has_instances = !geometry.shared.is_empty();
        let placed = geometry.placed.iter().map(|placed| placed.mesh.clone());
        let placed: Vec<Shared<Mesh>> = placed.collect();
        let before = self.scene.take();
        // A scene with instances has no cut-outs, so they cannot have changed.
        let is_same = |kept: &SceneTree| {
            has_instances
                && kept.tree.has_instances
                && kept.space == *space
                && kept.placed == placed
        };
        let tree = match before {
            Some(kept) if is_same(&kept) => kept.tree,
            kept => {
                let corners = corners_of_placed(geometry, space);
                let refitted = kept.and_then(|SceneTree { mut tree, .. }| {
                    let own = Arc::get_mut(&mut tree)?;
                    let is_good = own.refit_scene(&corners, cutouts, has_instances);
                    is_good.then_some(tree)
                });
                let build = || MeshTree::of_scene(&corners, cutouts, has_instances).into();
                refitted.unwrap_or_else(build)
            }
        };
        self.scene = Some(SceneTree {
            space: *space,
            placed,
            tree: tree.clone(),
        });
        tree
    }

    /// The tree over each of these meshes. `to_local` places their instances in the scene. Trees that are not requested again are dropped.
    pub fn of_shared(
        &mut self,
        meshes: &[SharedMesh],
        to_local: &[Vec<DAffine3>],
    ) -> Vec<Arc<MeshTree>> {
        let mut before = std::mem::take(&mut self.shared);
        let slacks: Vec<f32> = to_local.iter().map(|all| slack_of_shared(all)).collect();
        let same = meshes.iter().zip(&slacks).map(|(shared, slack)| {
            let is_same =
                |kept: &mut MeshTreeOf| kept.mesh.ptr_eq(&shared.mesh) && kept.slack == *slack;
            before.extract_if(.., is_same).next()
        });
        let same: Vec<Option<MeshTreeOf>> = same.collect();
        for ((shared, slack), same) in meshes.iter().zip(slacks).zip(same) {
            let SharedMesh { mesh, space, .. } = shared;
            let kept = same.unwrap_or_else(|| {
                // The first one with the same number of triangles: usually the same mesh in another shape.
                let is_like =
                    |kept: &mut MeshTreeOf| kept.mesh.triangles.len() == mesh.triangles.len();
                let like = before.extract_if(.., is_like).next();
                let corners = corners_of(mesh, space);
                let refitted = like.and_then(|MeshTreeOf { mut tree, .. }| {
                    let own = Arc::get_mut(&mut tree)?;
                    own.refit_mesh(&corners, slack).then_some(tree)
                });
                let build = || MeshTree::of_mesh(&corners, slack).into();
                MeshTreeOf {
                    mesh: mesh.clone(),
                    slack,
                    tree: refitted.unwrap_or_else(build),
                }
            });
            self.shared.push(kept);
        }
        let trees = self.shared.iter().map(|kept| kept.tree.clone());
        trees.collect()
    }
}

/// The corners of the triangles in the scene's space.
pub(crate) fn corners_of_placed(geometry: &Geometry, space: &LocalSpace) -> Vec<[Vec3; 3]> {
    let placed = geometry.placed.iter();
    placed
        .flat_map(|placed| corners_of(&placed.mesh, space))
        .collect()
}
