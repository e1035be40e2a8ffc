//! glTF 2.0: meshes, their materials and lights, and cameras, placed by their nodes.
//!
//! The JSON is read as what the specification has in it, and every key that nobody asks for is counted: see [`record`]. Crates that know
//! glTF convert it to structures of their own first, and what these do not have is lost without a trace; they also refuse valid files, such
//! as ones with an accessor without data.

mod accessor;
mod camera;
mod document;
mod file;
mod keys;
mod light;
mod material;
mod primitive;
mod record;
mod surface;

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::{Assets, MeshRequest};
use crate::Result;
use crate::scene::{Instance, Light, Shared};
use document::Node;
use file::GltfFile;
use material::Converted;

pub(in crate::import) use camera::camera;

impl Assets {
    /// Loads a glTF file: each node with a mesh becomes a separate mesh, with the materials that its triangles use. Returns the lights of
    /// the nodes.
    pub(super) fn load_gltf(&mut self, request: &MeshRequest) -> Result<Vec<Light>> {
        let file = GltfFile::read(&request.path, &request.named_at)?;
        let (path, _, flat, material) = request.key(0);
        let is_same =
            |key: &(_, usize, bool, Option<u32>)| (&key.0, key.2, key.3) == (&path, flat, material);
        // Meshes of a file that is placed again are not read again, so that a second warning would lack what they hold.
        let is_first = !self.shared_meshes.keys().any(is_same);
        let mut loader = Loader {
            material_of_index: vec![None; file.document.materials.len() + 1],
            placed_count: vec![0; file.document.meshes.len()],
            lights: Vec::new(),
            assets: self,
            file: &file,
            request,
        };
        file.for_each_node(&mut |_, node, _| {
            if let Some(count) = node.mesh.and_then(|mesh| loader.placed_count.get_mut(mesh)) {
                *count += if node.instances.is_some() { 2 } else { 1 };
            }
            Ok(())
        })?;
        file.for_each_node(&mut |index, node, to_world| loader.add_node(index, node, to_world))?;
        let lights = loader.lights;
        if is_first {
            self.report(&request.path, &file.unused.borrow());
        }
        Ok(lights)
    }
}

impl GltfFile {
    /// Visits every node of the file's scene, with its index and the transform from the node's space to the file's.
    fn for_each_node(
        &self,
        visit: &mut dyn FnMut(usize, &Node, DMat4) -> Result<()>,
    ) -> Result<()> {
        let nodes = &self.document.nodes;
        let mut is_seen = vec![false; nodes.len()];
        let mut waiting: Vec<(usize, DMat4)> = Vec::new();
        let roots = self.roots()?;
        waiting.extend(roots.into_iter().map(|node| (node, DMat4::IDENTITY)));
        waiting.reverse();
        while let Some((index, outer)) = waiting.pop() {
            let node = self.find(nodes, index, "node", "the tree of nodes")?;
            if std::mem::replace(&mut is_seen[index], true) {
                let problem = format!("node {index} is at two places of the tree");
                return Err(self.error(problem, "give each node one parent"));
            }
            let to_world = outer * node.to_parent;
            visit(index, node, to_world)?;
            let first = waiting.len();
            waiting.extend(node.children.iter().map(|&child| (child, to_world)));
            // Keep the order of the file.
            waiting[first..].reverse();
        }
        Ok(())
    }

    /// The nodes of the file's scene. A file without scenes is a library, whose nodes are all shown.
    fn roots(&self) -> Result<Vec<usize>> {
        let (scenes, nodes) = (&self.document.scenes, &self.document.nodes);
        match (self.document.scene, scenes.len()) {
            (Some(scene), _) => Ok(self.find(scenes, scene, "scene", "the key scene")?.clone()),
            (None, 1..) => Ok(scenes[0].clone()),
            (None, 0) if nodes.is_empty() => Err(self.error("has no scene", "export one")),
            (None, 0) => {
                let mut is_root = vec![true; nodes.len()];
                for &child in nodes.iter().flat_map(|node| &node.children) {
                    if let Some(is_root) = is_root.get_mut(child) {
                        *is_root = false;
                    }
                }
                Ok((0..nodes.len()).filter(|&node| is_root[node]).collect())
            }
        }
    }

    /// Where the instances of a node are, in its own space.
    fn instances(&self, index: usize, accessors: [Option<usize>; 3]) -> Result<Vec<DMat4>> {
        let user = format!("EXT_mesh_gpu_instancing of node {index}");
        let [translations, rotations, scales] = accessors;
        let vectors = |accessor: Option<usize>| {
            let read = |accessor| self.numbers::<3>(accessor, &user);
            accessor.map(read).transpose()
        };
        let (translations, scales) = (vectors(translations)?, vectors(scales)?);
        let rotations = rotations.map(|accessor| self.numbers::<4>(accessor, &user));
        let rotations = rotations.transpose()?;
        let counts = [
            translations.as_ref().map(Vec::len),
            rotations.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
        ];
        let count = counts.iter().flatten().copied().max().unwrap_or(0);
        if counts.iter().flatten().any(|&other| other != count) {
            return Err(self.broken(format!("the attributes of {user} differ in their counts")));
        }
        let matrix = |instance: usize| {
            let scale = scales
                .as_ref()
                .map_or(DVec3::ONE, |all| all[instance].into());
            let rotation = rotations
                .as_ref()
                .map(|all| DQuat::from_array(all[instance]));
            let is_none = |rotation: &DQuat| rotation.length_squared() > 0.0;
            let rotation = rotation
                .filter(is_none)
                .map_or(DQuat::IDENTITY, DQuat::normalize);
            let translation = translations.as_ref();
            let translation = translation.map_or(DVec3::ZERO, |all| all[instance].into());
            DMat4::from_scale_rotation_translation(scale, rotation, translation)
        };
        Ok((0..count).map(matrix).collect())
    }
}

struct Loader<'l> {
    assets: &'l mut Assets,
    file: &'l GltfFile,
    request: &'l MeshRequest,
    /// For each index in the file; the last one is the default material.
    material_of_index: Vec<Option<Converted>>,
    /// The number of places of each mesh; for the instances of one node, 2.
    placed_count: Vec<usize>,
    lights: Vec<Light>,
}

impl Loader<'_> {
    fn add_node(&mut self, index: usize, node: &Node, to_file: DMat4) -> Result<()> {
        let document = &self.file.document;
        let user = format!("node {index}");
        if let Some(light) = node.light {
            let light = self.file.find(&document.lights, light, "light", &user)?;
            let to_world = self.request.transform.matrix() * to_file;
            self.lights.push(light::of_node(light, to_world));
        }
        let Some(mesh) = node.mesh else {
            return Ok(());
        };
        let of_node = self.file.find(&document.meshes, mesh, "mesh", &user)?;
        let name = match node.name.as_ref().or(of_node.name.as_ref()) {
            Some(name) => format!("{}#{name}", self.request.name),
            None => format!("{}#node{index}", self.request.name),
        };
        let request = self.request;
        let to_world = request.transform.matrix() * to_file;
        if !request.is_repeated && self.placed_count[mesh] == 1 {
            let to_world = DAffine3::from_mat4(to_world);
            let mesh = self.mesh(&name, of_node, &to_world)?;
            self.assets.meshes.push(mesh.into());
            return Ok(());
        }
        let key = request.key(mesh);
        let mesh = match self.assets.shared_meshes.get(&key) {
            Some(mesh) => mesh.clone(),
            None => Shared::from(self.mesh(&name, of_node, &DAffine3::IDENTITY)?),
        };
        self.assets.shared_meshes.insert(key, mesh.clone());
        let mut add = |name: String, to_world: DMat4| {
            self.assets.meshes.push(Instance {
                name,
                mesh: mesh.clone(),
                to_world: DAffine3::from_mat4(to_world),
            });
        };
        match node.instances {
            None => add(name, to_world),
            Some(accessors) => {
                let places = self.file.instances(index, accessors)?.into_iter();
                for (i, place) in places.enumerate() {
                    add(format!("{name}[{i}]"), to_world * place);
                }
            }
        }
        Ok(())
    }
}
