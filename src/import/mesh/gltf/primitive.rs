//! The mesh of a node, from its primitives.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use super::Loader;
use super::document::{self, Primitive};
use super::file::GltfFile;
use super::keys;
use super::material::Converted;
use crate::Result;
use crate::import::mesh::polygons::{Corners, Polygons};
use crate::scene::Mesh;

/// Accessors of the attributes of a vertex that camlux uses.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Attributes {
    positions: usize,
    normals: Option<usize>,
    /// In the order of [`Mesh::texcoords`] and [`Mesh::texcoords_1`].
    texcoords: [Option<usize>; 2],
    colors: Option<usize>,
    tangents: Option<usize>,
}

/// A primitive to read.
struct Part<'p> {
    primitive: &'p Primitive,
    attributes: Attributes,
    material: u32,
}

impl Loader<'_> {
    /// The mesh of a node, placed by `to_world`.
    pub(super) fn mesh(
        &mut self,
        name: &str,
        of_node: &document::Mesh,
        to_world: &DAffine3,
    ) -> Result<Mesh> {
        let file = self.file;
        let mut parts = Vec::new();
        for primitive in &of_node.primitives {
            parts.extend(self.part(primitive)?);
        }
        self.drop_incomplete_tangents(&mut parts);
        let mut polygons = Polygons::default();
        let mut corners = Vec::new();
        let mut first_of_attributes = HashMap::new();
        for part in &parts {
            // Primitives may share their vertices.
            let first = match first_of_attributes.get(&part.attributes) {
                Some(&first) => first,
                None => {
                    let first = polygons.positions.len();
                    file.append_vertices(&mut polygons, &part.attributes)?;
                    first_of_attributes.insert(part.attributes, first);
                    first
                }
            };
            let count = polygons.positions.len() - first;
            let face_count = corners.len() / 3;
            file.append_triangles(&mut corners, part.primitive, first, count)?;
            let added = corners.len() / 3 - face_count;
            polygons.materials.resize(face_count + added, part.material);
        }
        polygons.corners = Corners::Shared(corners);
        let mut unused = file.unused.borrow_mut();
        let mesh = polygons.into_mesh(name, to_world, self.request.flat, &mut unused);
        drop(unused);
        mesh.map_err(|problem| file.broken(problem))
    }

    /// `None` for a primitive that is not seen.
    fn part<'p>(&mut self, primitive: &'p Primitive) -> Result<Option<Part<'p>>> {
        let file = self.file;
        let materials = &file.document.materials;
        let of_file = match primitive.material {
            Some(index) => Some(file.find(materials, index, "material", "a primitive")?),
            None => None,
        };
        let is_overridden = self.request.material_override.is_some();
        let sets = match of_file {
            Some(material) if !is_overridden => material.texcoord_sets(),
            _ => Vec::new(),
        };
        let mut rest: Vec<&(String, usize)> = primitive.attributes.iter().collect();
        let mut take = |name: &str| {
            let place = rest.iter().position(|(other, _)| other == name)?;
            Some(rest.remove(place).1)
        };
        let positions =
            take("POSITION").ok_or_else(|| file.broken("a primitive has no POSITION"))?;
        let has_normal_map = of_file.is_some_and(|material| material.normal_texture.is_some());
        let (normals, colors) = (take("NORMAL"), take("COLOR_0"));
        let tangents = take("TANGENT");
        // Without a texture, the first set is kept for a material that the scene gets later.
        let set = |index: usize| sets.get(index).copied().or((index == 0).then_some(0));
        let texcoords = [0, 1].map(|index| take(&format!("TEXCOORD_{}", set(index)?)));
        let mut unused = file.unused.borrow_mut();
        for (name, _) in rest {
            count_attribute(name, &mut unused);
        }
        drop(unused);
        if primitive.mode < 4 {
            file.leave_out("points and lines");
            return Ok(None);
        }
        if primitive.mode > 6 {
            return Err(file.broken(format!("a primitive has the mode {}", primitive.mode)));
        }
        let has_data = |accessor: &document::Accessor| accessor.view.is_some();
        let of_positions = file.document.accessors.get(positions);
        if primitive.is_draco && !of_positions.is_some_and(has_data) {
            return Err(file.compressed("KHR_draco_mesh_compression"));
        }
        let material = match self.request.material_override {
            Some(material) => material,
            None => match self.material(primitive.material)? {
                Converted::Visible(material) => material,
                Converted::Invisible => return Ok(None),
            },
        };
        for (index, set) in sets.iter().enumerate() {
            if texcoords[index].is_none() {
                let name = of_file.and_then(|material| material.name.as_deref());
                let name = name.unwrap_or("without a name");
                let problem = format!(
                    "a primitive of the textured material \"{name}\" has no TEXCOORD_{set}"
                );
                let hint = "export its texture coordinates, or give it another material";
                return Err(file.error(problem, hint));
            }
        }
        Ok(Some(Part {
            primitive,
            attributes: Attributes {
                positions,
                normals,
                texcoords,
                colors,
                // Nothing else asks for them.
                tangents: tangents
                    .filter(|_| has_normal_map && !is_overridden && normals.is_some()),
            },
            material,
        }))
    }

    /// The material of a primitive in the scene.
    fn material(&mut self, index: Option<usize>) -> Result<Converted> {
        let last = self.material_of_index.len() - 1;
        let slot = index.unwrap_or(last);
        if let Some(known) = self.material_of_index[slot] {
            return Ok(known);
        }
        let converted = self.assets.add_gltf_material(self.file, index)?;
        self.material_of_index[slot] = Some(converted);
        Ok(converted)
    }

    /// A mesh has tangents everywhere or nowhere. Leaves them out where a primitive with a normal map has none.
    fn drop_incomplete_tangents(&self, parts: &mut [Part]) {
        let materials = &self.assets.materials;
        let lacks = |part: &Part| {
            part.attributes.tangents.is_none()
                && materials[part.material as usize].normal_texture.is_some()
        };
        if !parts.iter().any(lacks) {
            return;
        }
        for part in parts {
            if part.attributes.tangents.take().is_some() {
                self.file.leave_out(
                    "TANGENT of a primitive beside others with a normal map and without TANGENT",
                );
            }
        }
    }
}

fn count_attribute(name: &str, unused: &mut crate::import::unused::Unused) {
    let (stem, number) = name.rsplit_once('_').unwrap_or((name, ""));
    let is_numbered = ["TEXCOORD", "COLOR", "JOINTS", "WEIGHTS"].contains(&stem)
        && !number.is_empty()
        && number.bytes().all(|digit| digit.is_ascii_digit());
    if is_numbered || name.starts_with('_') {
        unused.add(&format!("{name} of primitives"));
    } else {
        unused.add_unknown(name, &keys::ATTRIBUTES.keys[..6]);
    }
}

impl GltfFile {
    /// Appends the vertices of a primitive. A list that has values for some primitives has them for all.
    fn append_vertices(&self, polygons: &mut Polygons, attributes: &Attributes) -> Result<()> {
        const USER: &str = "a primitive";
        let first = polygons.positions.len();
        let positions: Vec<[f64; 3]> = self.numbers(attributes.positions, USER)?;
        let count = positions.len();
        append(
            &mut polygons.positions,
            positions.into_iter().map(DVec3::from).collect(),
        );
        let end = first + count;
        let per_vertex = |found: usize, name: &str| match found == count {
            true => Ok(()),
            false => Err(self.broken(format!("{name} has {found} elements for {count} positions"))),
        };
        if let Some(normals) = attributes.normals {
            let normals: Vec<[f64; 3]> = self.numbers(normals, USER)?;
            per_vertex(normals.len(), "NORMAL")?;
            polygons.normals.resize(first, DVec3::ZERO);
            append(
                &mut polygons.normals,
                normals.into_iter().map(DVec3::from).collect(),
            );
        } else if !polygons.normals.is_empty() {
            // Faces with zero normals are flat.
            polygons.normals.resize(end, DVec3::ZERO);
        }
        let lists = [&mut polygons.texcoords, &mut polygons.texcoords_1];
        for (list, accessor) in lists.into_iter().zip(attributes.texcoords) {
            if let Some(texcoords) = accessor {
                let mut texcoords: Vec<[f64; 2]> = self.numbers(texcoords, USER)?;
                per_vertex(texcoords.len(), "TEXCOORD")?;
                // v grows downwards in the file.
                texcoords.iter_mut().for_each(|[_, v]| *v = 1.0 - *v);
                list.resize(first, [0.0; 2]);
                append(list, texcoords);
            } else if !list.is_empty() {
                list.resize(end, [0.0; 2]);
            }
        }
        if let Some(colors) = attributes.colors {
            let colors = self.colors(colors)?;
            per_vertex(colors.len(), "COLOR_0")?;
            polygons.colors.resize(first, [1.0; 3]);
            append(&mut polygons.colors, colors);
        } else if !polygons.colors.is_empty() {
            polygons.colors.resize(end, [1.0; 3]);
        }
        if let Some(tangents) = attributes.tangents {
            let tangents: Vec<[f64; 4]> = self.numbers(tangents, USER)?;
            per_vertex(tangents.len(), "TANGENT")?;
            polygons.tangents.resize(first, NO_TANGENT);
            polygons.tangents.extend(tangents.into_iter().map(tangent));
        } else if !polygons.tangents.is_empty() {
            polygons.tangents.resize(end, NO_TANGENT);
        }
        Ok(())
    }

    fn colors(&self, accessor: usize) -> Result<Vec<[f32; 3]>> {
        const USER: &str = "a primitive";
        if self.component_count(accessor, USER)? == 3 {
            let colors: Vec<[f64; 3]> = self.numbers(accessor, USER)?;
            return Ok(colors.iter().map(|c| c.map(|value| value as f32)).collect());
        }
        let colors: Vec<[f64; 4]> = self.numbers(accessor, USER)?;
        if colors.iter().any(|[.., alpha]| *alpha != 1.0) {
            self.leave_out("the alpha of COLOR_0");
        }
        let bands = |[r, g, b, _]: &[f64; 4]| [*r, *g, *b].map(|value| value as f32);
        Ok(colors.iter().map(bands).collect())
    }

    /// Appends the corners of a primitive's triangles, whose vertices are `count` from `first` on.
    fn append_triangles(
        &self,
        corners: &mut Vec<u32>,
        primitive: &Primitive,
        first: usize,
        count: usize,
    ) -> Result<()> {
        let mut indices = match primitive.indices {
            Some(indices) => self.indices(indices, "a primitive")?,
            None => (0..u32::try_from(count).unwrap_or(u32::MAX)).collect(),
        };
        if let Some(wrong) = indices.iter().find(|&&index| index as usize >= count) {
            let problem = format!("a primitive has the index {wrong}, but only {count} positions");
            return Err(self.broken(problem));
        }
        let first = u32::try_from(first).map_err(|_| self.broken("it has 2^32 vertices"))?;
        if first > 0 {
            // A sum beyond u32 is refused by its number of positions.
            indices
                .iter_mut()
                .for_each(|index| *index = index.saturating_add(first));
        }
        let more = match primitive.mode {
            4 => indices.len() % 3,
            _ => 0,
        };
        self.unused
            .borrow_mut()
            .add_many("indices that make no whole triangle", more as u64);
        match primitive.mode {
            4 => {
                indices.truncate(indices.len() - more);
                append(corners, indices);
            }
            5 => {
                // Every second triangle of a strip turns the other way.
                let strip = indices.windows(3).enumerate();
                corners.extend(strip.flat_map(|(i, w)| match i % 2 {
                    0 => [w[0], w[1], w[2]],
                    _ => [w[0], w[2], w[1]],
                }));
            }
            _ => {
                if let Some((&apex, rim)) = indices.split_first() {
                    corners.extend(rim.windows(2).flat_map(|w| [apex, w[0], w[1]]));
                }
            }
        }
        Ok(())
    }
}

/// Appends to a list, or becomes it: a large list is not copied.
fn append<T>(list: &mut Vec<T>, more: Vec<T>) {
    match list.is_empty() {
        true => *list = more,
        false => list.extend(more),
    }
}

/// For vertices whose material has no normal map.
const NO_TANGENT: [f32; 4] = [1.0, 0.0, 0.0, 1.0];

/// glTF's bitangent, cross(normal, tangent) · w, points to where the green of a normal map shows: up in the image, which is along v here.
fn tangent([x, y, z, w]: [f64; 4]) -> [f32; 4] {
    let along = DVec3::new(x, y, z).normalize_or_zero().as_vec3();
    along.extend(if w < 0.0 { -1.0 } else { 1.0 }).to_array()
}
