//! glTF 2.0: meshes, their materials and lights, and cameras, placed by their nodes.

mod accessor;
mod file;
mod light;
mod material;

use std::path::Path;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use gltf::mesh::Mode;
use gltf::scene::Transform as NodeTransform;
use gltf::{Node, Primitive, Semantic};

use super::assets::{Assets, MeshRequest, Transform};
use crate::keys::did_you_mean;
use crate::scene::{Camera, Instance, Lens, Light, Mesh, Shared, normal_matrix, unit_normal};
use crate::{Error, Result};
use file::{GltfFile, KNOWN_EXTENSIONS};

impl Assets {
    /// Loads a glTF file: each node with a mesh becomes a separate mesh, with the materials that its triangles use. Returns the lights of
    /// the nodes.
    pub(super) fn load_gltf(&mut self, request: &MeshRequest) -> Result<Vec<Light>> {
        let file = GltfFile::read(&request.path, &request.named_at)?;
        for name in file.document.extensions_used() {
            if !KNOWN_EXTENSIONS.contains(&name) {
                self.leave_out(&request.path, &format!("the extension {name}"));
            }
        }
        let mut loader = Loader {
            material_of_index: vec![None; file.document.materials().len() + 1],
            placed_count: vec![0; file.document.meshes().len()],
            lights: Vec::new(),
            assets: self,
            file: &file,
            request,
        };
        file.for_each_node(&mut |node, _| {
            if let Some(mesh) = node.mesh() {
                loader.placed_count[mesh.index()] += 1;
            }
            Ok(())
        })?;
        file.for_each_node(&mut |node, to_world| loader.add_node(node, to_world))?;
        Ok(loader.lights)
    }
}

/// Sets `camera` to the pose and the lens of the file's camera of that name.
pub(super) fn camera(path: &Path, named_at: &str, name: &str, camera: &mut Camera) -> Result<()> {
    let file = GltfFile::read(path, named_at)?;
    let mut names = Vec::new();
    let mut found = false;
    file.for_each_node(&mut |node, to_world| {
        let Some(of_node) = node.camera() else {
            return Ok(());
        };
        let own = [node.name(), of_node.name()];
        names.extend(own.into_iter().flatten().map(str::to_owned));
        if found || !own.contains(&Some(name)) {
            return Ok(());
        }
        found = true;
        let gltf::camera::Projection::Perspective(lens) = of_node.projection() else {
            let problem = format!("camera \"{name}\" is orthographic");
            return Err(Error::scene(named_at, problem, "name a perspective camera"));
        };
        // A glTF camera looks along -z, with y up.
        let position_m = to_world.transform_point3(DVec3::ZERO);
        camera.position_m = position_m;
        camera.look_at_m =
            position_m + to_world.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
        camera.up = to_world.transform_vector3(DVec3::Y);
        camera.lens = Lens::FovY {
            fov_y_deg: f64::from(lens.yfov()).to_degrees(),
        };
        Ok(())
    })?;
    if found {
        return Ok(());
    }
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    let hint = match known.is_empty() {
        true => "the file has no cameras: give position, look_at, up and a lens".into(),
        false => did_you_mean(name, &known),
    };
    let problem = format!("{} has no camera \"{name}\"", path.display());
    Err(Error::scene(named_at, problem, hint))
}

impl GltfFile {
    /// Visits every node of the file's scene, with the transform from the node's space to the file's.
    fn for_each_node(&self, visit: &mut dyn FnMut(&Node, DMat4) -> Result<()>) -> Result<()> {
        let shown = self.document.default_scene();
        let Some(scene) = shown.or_else(|| self.document.scenes().next()) else {
            return Err(self.error("has no scene", "export one"));
        };
        let mut is_seen = vec![false; self.document.nodes().len()];
        let roots = scene.nodes().map(|node| (node, DMat4::IDENTITY));
        let mut waiting: Vec<(Node, DMat4)> = roots.collect();
        waiting.reverse();
        while let Some((node, outer)) = waiting.pop() {
            if std::mem::replace(&mut is_seen[node.index()], true) {
                let problem = format!("node {} is at two places of the tree", node.index());
                return Err(self.error(problem, "give each node one parent"));
            }
            let to_world = outer * matrix(node.transform());
            visit(&node, to_world)?;
            let first = waiting.len();
            waiting.extend(node.children().map(|child| (child, to_world)));
            // Keep the order of the file.
            waiting[first..].reverse();
        }
        Ok(())
    }
}

fn matrix(transform: NodeTransform) -> DMat4 {
    match transform {
        NodeTransform::Matrix { matrix } => {
            DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)))
        }
        NodeTransform::Decomposed {
            translation,
            rotation,
            scale,
        } => DMat4::from_scale_rotation_translation(
            scale.map(f64::from).into(),
            DQuat::from_array(rotation.map(f64::from)).normalize(),
            translation.map(f64::from).into(),
        ),
    }
}

struct Loader<'l> {
    assets: &'l mut Assets,
    file: &'l GltfFile,
    request: &'l MeshRequest,
    /// Index in the scene for each index in the file; the last one is the default material.
    material_of_index: Vec<Option<u32>>,
    /// The number of nodes that place each mesh.
    placed_count: Vec<usize>,
    lights: Vec<Light>,
}

impl Loader<'_> {
    fn add_node(&mut self, node: &Node, to_file: DMat4) -> Result<()> {
        if let Some(light) = node.light() {
            let to_world = self.request.transform.matrix() * to_file;
            self.lights.push(light::of_node(&light, to_world));
        }
        let Some(of_node) = node.mesh() else {
            return Ok(());
        };
        let name = match node.name().or(of_node.name()) {
            Some(name) => format!("{}#{name}", self.request.name),
            None => format!("{}#node{}", self.request.name, node.index()),
        };
        if node.skin().is_some() || node.weights().is_some() {
            self.leave_out("skins and morph targets: meshes are in the pose of their vertices");
        }
        let request = self.request;
        if !request.is_repeated && self.placed_count[of_node.index()] == 1 {
            let mesh = self.mesh(name, &of_node, (to_file, &request.transform))?;
            self.assets.meshes.push(mesh.into());
            return Ok(());
        }
        let key = request.key(of_node.index());
        let mesh = match self.assets.shared_meshes.get(&key) {
            Some(mesh) => mesh.clone(),
            None => {
                let in_own_space = (DMat4::IDENTITY, &Transform::IDENTITY);
                Shared::from(self.mesh(name.clone(), &of_node, in_own_space)?)
            }
        };
        self.assets.shared_meshes.insert(key, mesh.clone());
        self.assets.meshes.push(Instance {
            name,
            mesh,
            to_world: DAffine3::from_mat4(request.transform.matrix() * to_file),
        });
        Ok(())
    }

    /// The mesh of a node, placed by the transform to the file's space and then by the scene file.
    fn mesh(
        &mut self,
        name: String,
        of_node: &gltf::Mesh,
        place: (DMat4, &Transform),
    ) -> Result<Mesh> {
        let mut mesh = Mesh {
            name,
            ..Mesh::default()
        };
        let parts = of_node
            .primitives()
            .map(|part| Part::read(self.file, &part));
        let parts = parts.collect::<Result<Vec<_>>>()?;
        // If only some primitives have normals, the others get those of their faces.
        let any_normals = !self.request.flat && parts.iter().any(|part| !part.normals.is_empty());
        let any_texcoords = parts.iter().any(|part| !part.texcoords.is_empty());
        for (part, primitive) in parts.into_iter().zip(of_node.primitives()) {
            let Some(triangles) = part.triangles(primitive.mode()) else {
                self.leave_out("points and lines");
                continue;
            };
            let material = match self.request.material_override {
                Some(material) => material,
                None => self.material(&primitive.material(), &part)?,
            };
            let part = match any_normals && part.normals.is_empty() {
                true => part.with_face_normals(&triangles),
                false => (part, triangles),
            };
            let has = [any_normals, any_texcoords];
            append(&mut mesh, part, material, place, has);
        }
        Ok(mesh)
    }

    /// The index in the scene of a material of the file.
    fn material(&mut self, material: &gltf::Material, part: &Part) -> Result<u32> {
        let last = self.material_of_index.len() - 1;
        let slot = material.index().unwrap_or(last);
        let index = match self.material_of_index[slot] {
            Some(index) => index,
            None => {
                let index = self.assets.add_gltf_material(self.file, material)?;
                self.material_of_index[slot] = Some(index);
                index
            }
        };
        if part.texcoords.is_empty() && self.assets.materials[index as usize].has_texture() {
            let name = material.name().unwrap_or("without a name");
            let problem =
                format!("a primitive of the textured material \"{name}\" has no TEXCOORD_0");
            return Err(self.file.error(
                problem,
                "export its texture coordinates, or give it another material",
            ));
        }
        Ok(index)
    }

    fn leave_out(&mut self, what: &str) {
        self.assets.leave_out(&self.request.path, what);
    }
}

/// The data of a primitive.
struct Part {
    positions: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    texcoords: Vec<[f64; 2]>,
    indices: Vec<u32>,
}

impl Part {
    fn read(file: &GltfFile, primitive: &Primitive) -> Result<Part> {
        let attribute = |semantic| primitive.get(&semantic);
        let positions = attribute(Semantic::Positions);
        let positions = positions
            .ok_or_else(|| file.error("a primitive has no POSITION", "export it again"))?;
        let positions: Vec<[f64; 3]> = file.numbers(&positions)?;
        let per_vertex = |count: usize, name: &str| {
            if count == positions.len() {
                return Ok(());
            }
            let problem = format!(
                "{name} has {count} elements for {} positions",
                positions.len()
            );
            Err(file.error(problem, "export it again"))
        };
        let normals = attribute(Semantic::Normals).map(|normals| file.numbers(&normals));
        let normals: Option<Vec<[f64; 3]>> = normals.transpose()?;
        if let Some(normals) = &normals {
            per_vertex(normals.len(), "NORMAL")?;
        }
        let texcoords = attribute(Semantic::TexCoords(0)).map(|uv| file.numbers(&uv));
        let texcoords: Option<Vec<[f64; 2]>> = texcoords.transpose()?;
        if let Some(texcoords) = &texcoords {
            per_vertex(texcoords.len(), "TEXCOORD_0")?;
        }
        let indices = match primitive.indices() {
            Some(indices) => file.indices(&indices)?,
            None => (0..positions.len() as u32).collect(),
        };
        if let Some(&wrong) = indices.iter().find(|&&i| i as usize >= positions.len()) {
            let problem = format!(
                "a primitive has the index {wrong}, but only {} positions",
                positions.len()
            );
            return Err(file.error(problem, "export it again"));
        }
        Ok(Part {
            normals: normals.unwrap_or_default(),
            texcoords: texcoords.unwrap_or_default(),
            indices,
            positions,
        })
    }

    /// `None` for points and lines.
    fn triangles(&self, mode: Mode) -> Option<Vec<[u32; 3]>> {
        let indices = &self.indices;
        Some(match mode {
            Mode::Triangles => indices.as_chunks::<3>().0.to_vec(),
            Mode::TriangleStrip => indices.windows(3).map(|w| [w[0], w[1], w[2]]).collect(),
            Mode::TriangleFan => match indices.split_first() {
                Some((&first, rest)) => rest.windows(2).map(|w| [first, w[0], w[1]]).collect(),
                None => Vec::new(),
            },
            _ => return None,
        })
    }

    /// Gives each triangle its own vertices, with the normal of its face.
    fn with_face_normals(self, triangles: &[[u32; 3]]) -> (Part, Vec<[u32; 3]>) {
        let corners = triangles
            .as_flattened()
            .iter()
            .map(|&corner| corner as usize);
        let normals = triangles.iter().flat_map(|triangle| {
            let [a, b, c] = triangle.map(|corner| DVec3::from(self.positions[corner as usize]));
            // A triangle without area is never seen, so any unit normal will do.
            let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Z);
            [normal.to_array(); 3]
        });
        let count = 3 * triangles.len() as u32;
        let part = Part {
            normals: normals.collect(),
            positions: corners
                .clone()
                .map(|corner| self.positions[corner])
                .collect(),
            texcoords: match self.texcoords.is_empty() {
                true => Vec::new(),
                false => corners.map(|corner| self.texcoords[corner]).collect(),
            },
            indices: (0..count).collect(),
        };
        let triangles = part.indices.as_chunks::<3>().0.to_vec();
        (part, triangles)
    }
}

/// Adds a primitive to a mesh, in world space.
fn append(
    mesh: &mut Mesh,
    (part, triangles): (Part, Vec<[u32; 3]>),
    material: u32,
    (to_file, transform): (DMat4, &Transform),
    [any_normals, any_texcoords]: [bool; 2],
) {
    let first = mesh.positions_m.len() as u32;
    let positions = part.positions.iter().map(|&position| position.into());
    let placed = |position| transform.place(to_file.transform_point3(position));
    mesh.positions_m.extend(positions.map(placed));
    if any_normals {
        let turned = transform.rotation * normal_matrix(DMat3::from_mat4(to_file));
        let normals = part
            .normals
            .iter()
            .map(|&normal| unit_normal(turned, normal.into()));
        mesh.normals.extend(normals);
    }
    if any_texcoords {
        // Primitives without texture coordinates have an untextured material here, so the value is never read.
        let texcoord = |vertex: usize| part.texcoords.get(vertex).copied().unwrap_or_default();
        // v grows downwards.
        let upwards = |[u, v]: [f64; 2]| [u, 1.0 - v];
        mesh.texcoords
            .extend((0..part.positions.len()).map(|vertex| upwards(texcoord(vertex))));
    }
    mesh.triangle_materials
        .resize(mesh.triangles.len() + triangles.len(), material);
    mesh.triangles.extend(
        triangles
            .into_iter()
            .map(|t| t.map(|corner| first + corner)),
    );
}
