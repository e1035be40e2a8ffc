//! PLY files, for example from scanners: text or binary, one mesh without materials.
//!
//! The crate `ply-rs-bw` (4.0) is not used: it refuses numbers such as `1.` and `.5`, gives no lines in messages, and keeps every element as a
//! whole. For the binary file of `cargo bench --bench load` it takes 7.6 times the memory of the mesh instead of 1.4, and twice the
//! CPU time.

mod body;
mod header;
mod slots;

use std::path::Path;

use glam::DAffine3;

use super::colors::as_unit_colors;
use super::polygons::{Columns, Corners, NONE, Polygons};
use super::{Assets, MeshRequest, TextureUse};
use crate::import::lines::{Lines, named_file, open};
use crate::import::texture;
use crate::import::unused::{Unused, shown};
use crate::keys::did_you_mean;
use crate::scene::Mesh;
use crate::{Error, Result};
use body::Body;
use header::{Element, Format, Header, Property, Type};
use slots::{Slots, color};

const HINT: &str = "export it again";
const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];
const COLORS: [[&str; 3]; 3] = [
    ["red", "green", "blue"],
    ["diffuse_red", "diffuse_green", "diffuse_blue"],
    ["r", "g", "b"],
];
const ALPHAS: [&str; 3] = ["alpha", "diffuse_alpha", "a"];
const TEXCOORDS: [[&str; 2]; 7] = [
    ["u", "v"],
    ["s", "t"],
    ["texture_u", "texture_v"],
    ["texture_s", "texture_t"],
    ["texcoord_u", "texcoord_v"],
    ["tex_u", "tex_v"],
    ["u1", "v1"],
];

/// Names that programs write.
const ELEMENTS: [&str; 8] = [
    "vertex",
    "face",
    "tristrips",
    "edge",
    "material",
    "camera",
    "range_grid",
    "user",
];

impl Assets {
    /// Loads a PLY file as one mesh.
    pub(super) fn load_ply(&mut self, request: &MeshRequest) -> Result<Mesh> {
        let path = &request.path;
        let of_faces = request.as_is.as_ref().map(|as_is| &as_is.materials[..]);
        let material = match of_faces {
            // Without faces it does not matter.
            Some(materials) => materials.first().copied().unwrap_or_default(),
            None => request.only_material()?,
        };
        let (stream, file_bytes) = open(path, &request.named_at, "mesh")?;
        let mut lines = Lines::new(path, stream);
        let mut unused = Unused::default();
        let header = Header::read(&mut lines, path, &mut unused)?;
        let mut body = Body::new(lines, &header);
        let mut reader = Reader::new(path, &header, file_bytes, of_faces)?;
        for element in &header.elements {
            match element.name.as_str() {
                "vertex" => reader.vertices(element, &mut body, &mut unused)?,
                "face" => reader.faces(element, &mut body, &mut unused)?,
                "tristrips" => reader.strips(element, &mut body, &mut unused)?,
                name => {
                    let kind = format!("element \"{}\"", shown(name));
                    match ELEMENTS.contains(&name) {
                        true => unused.add_many(&kind, element.count),
                        false => unused.add_unknown(name, &ELEMENTS),
                    }
                    reader.skip(element, &mut body)?;
                }
            }
        }
        if body.has_more()? {
            unused.add("what follows the last element");
        }
        let Reader {
            mut polygons,
            corners,
            texture_of_face,
            material_of_face,
            ..
        } = reader;
        if corners.positions.is_empty() && !polygons.positions.is_empty() {
            unused.add("the points of a file without faces");
        }
        polygons.stay_as_is = of_faces.is_some();
        polygons.materials = match material_of_face.is_empty() {
            false => material_of_face,
            true => self.materials_of_ply(
                &header,
                material,
                &texture_of_face,
                !corners.texcoords.is_empty() || !polygons.texcoords.is_empty(),
                request,
                &mut unused,
            )?,
        };
        as_unit_colors(&mut polygons.colors);
        polygons.corners = match [&corners.texcoords, &corners.colors] {
            [texcoords, colors] if texcoords.is_empty() && colors.is_empty() => {
                Corners::Shared(corners.positions)
            }
            _ => Corners::Separate(Columns {
                normals: match polygons.normals.is_empty() {
                    true => Vec::new(),
                    false => corners.positions.clone(),
                },
                ..corners
            }),
        };
        let to_world = DAffine3::from_mat4(request.transform.matrix());
        let mesh = polygons.into_mesh(&request.name, &to_world, request.flat, &mut unused);
        self.report(path, &unused);
        mesh.map_err(|problem| Error::scene(path.display().to_string(), problem, HINT))
    }

    /// The material of each face, or one for all: the given one, with the textures that the file names.
    fn materials_of_ply(
        &mut self,
        header: &Header,
        given: u32,
        texture_of_face: &[f64],
        has_texcoords: bool,
        request: &MeshRequest,
        unused: &mut Unused,
    ) -> Result<Vec<u32>> {
        if header.texture_files.is_empty() {
            return Ok(vec![given]);
        }
        let has_own = self.materials[given as usize].kd_texture.is_some();
        if !has_texcoords || has_own {
            let why = match has_own {
                true => "the material has a texture",
                false => "the mesh has no texture coordinates",
            };
            let count = header.texture_files.len() as u64;
            unused.add_many(&format!("comment TextureFile, because {why}"), count);
            return Ok(vec![given]);
        }
        let folder = request.path.parent().unwrap_or(Path::new(""));
        let mut textured = Vec::new();
        for (name, at) in &header.texture_files {
            let file = named_file(folder, name);
            let load = |_: &_| texture::load(&file, at).map(Some);
            let texture = self.texture(&file, TextureUse::Reflectance, load)?;
            let mut material = self.materials[given as usize].clone();
            material.name = format!("{} with {name}", material.name);
            material.kd_texture = texture.map(Into::into);
            textured.push(self.push_material(material, at.clone()));
        }
        if texture_of_face.is_empty() {
            let more = textured.len() as u64 - 1;
            unused.add_many("comment TextureFile that no face names by texnumber", more);
            return Ok(vec![textured[0]]);
        }
        // MeshLab writes −1 for a face without a texture.
        let of_face = texture_of_face.iter().map(|&number| match number {
            0.0.. => textured.get(number as usize).copied().unwrap_or(given),
            _ => given,
        });
        Ok(of_face.collect())
    }
}

struct Reader<'h> {
    file: &'h Path,
    file_bytes: u64,
    format: Format,
    vertex_count: u64,
    polygons: Polygons,
    corners: Columns,
    /// The number of the texture of each face; empty: all have the first.
    texture_of_face: Vec<f64>,
    /// The materials that the faces number, for a mesh that stays as it is.
    materials: Option<&'h [u32]>,
    /// Empty: all faces have one material.
    material_of_face: Vec<u32>,
}

impl<'h> Reader<'h> {
    fn new(
        file: &'h Path,
        header: &Header,
        file_bytes: u64,
        materials: Option<&'h [u32]>,
    ) -> Result<Self> {
        let Some(vertex) = header.element("vertex") else {
            let problem = "it has no element \"vertex\"";
            return Err(Error::scene(file.display().to_string(), problem, HINT));
        };
        Ok(Reader {
            file,
            file_bytes,
            format: header.format,
            vertex_count: vertex.count,
            polygons: Polygons::default(),
            corners: Columns::default(),
            texture_of_face: Vec::new(),
            materials,
            material_of_face: Vec::new(),
        })
    }

    /// The number of elements to make room for: no more than the file can hold.
    fn room(&self, element: &Element) -> usize {
        let most = self.file_bytes / element.least_bytes(self.format);
        element.count.min(most) as usize
    }

    fn vertices(&mut self, element: &Element, body: &mut Body, unused: &mut Unused) -> Result<()> {
        // x y z, nx ny nz, u v, red green blue, alpha, u2 v2, tangent.
        let mut slots = Slots::<18>::new(element);
        if slots.take(element, 0, ["x", "y", "z"]).is_none() {
            let problem = "its vertices have no x, y and z";
            return Err(element.error(self.file, problem, HINT));
        }
        let has_normals = slots.take(element, 3, ["nx", "ny", "nz"]).is_some();
        let has_texcoords = slots.take_one(element, 6, &TEXCOORDS).is_some();
        let colors = slots.take_one(element, 8, &COLORS);
        let alphas = ALPHAS.map(|name| [name]);
        let alpha = slots.take_one(element, 11, &alphas);
        let has_texcoords_1 = slots.take(element, 12, ["u2", "v2"]).is_some();
        let has_tangents = slots.take(element, 14, ["tx", "ty", "tz", "tw"]).is_some();
        slots.report(element, |_| false, unused);
        let mut transparent = 0;
        let room = self.room(element);
        let polygons = &mut self.polygons;
        polygons.positions.reserve(room);
        polygons.normals.reserve(if has_normals { room } else { 0 });
        polygons
            .texcoords
            .reserve(if has_texcoords { room } else { 0 });
        polygons
            .colors
            .reserve(if colors.is_some() { room } else { 0 });
        let mut list = Vec::new();
        for index in 0..element.count {
            body.begin(element, index)?;
            for (property, slot) in element.properties.iter().zip(&slots.of_property) {
                if let Some(length) = property.length {
                    body.list(length, property.kind, &mut list)?;
                    continue;
                }
                let value = body.value(property.kind)?;
                if let Some(slot) = *slot {
                    slots.values[slot] = value;
                }
            }
            let values = &slots.values;
            if !values[..3]
                .iter()
                .chain(&values[6..8])
                .chain(&values[12..18])
                .all(|v| v.is_finite())
            {
                return Err(body.error("a vertex has a coordinate that is not a finite number"));
            }
            polygons
                .positions
                .push([values[0], values[1], values[2]].into());
            if has_normals {
                polygons
                    .normals
                    .push([values[3], values[4], values[5]].into());
            }
            if has_texcoords {
                polygons.texcoords.push([values[6], values[7]]);
            }
            if has_texcoords_1 {
                polygons.texcoords_1.push([values[12], values[13]]);
            }
            if has_tangents {
                let tangent = [values[14], values[15], values[16], values[17]];
                polygons.tangents.push(tangent.map(|value| value as f32));
            }
            if let Some(kinds) = colors {
                polygons.colors.push(color(&values[8..11], kinds));
            }
            let is_opaque = |[kind]: [Type; 1]| values[11] == kind.white();
            transparent += u64::from(!alpha.is_none_or(is_opaque));
        }
        unused.add_many("\"alpha\" of \"vertex\"", transparent);
        Ok(())
    }

    fn faces(&mut self, element: &Element, body: &mut Body, unused: &mut Unused) -> Result<()> {
        let indices = self.indices(element)?;
        let texcoords = element.find(&["texcoord"]);
        let is_list = |index: &usize| element.properties[*index].length.is_some();
        let texcoords = texcoords.filter(is_list);
        // red green blue, texnumber, alpha, material_index.
        let mut slots = Slots::<6>::new(element);
        let of_vertices = !self.polygons.colors.is_empty();
        let colors = match of_vertices {
            true => None,
            false => slots.take_one(element, 0, &COLORS),
        };
        let has_numbers = slots.take(element, 3, ["texnumber"]).is_some();
        let alpha = slots.take_one(element, 4, &ALPHAS.map(|name| [name]));
        let has_materials =
            self.materials.is_some() && slots.take(element, 5, ["material_index"]).is_some();
        let mut transparent = 0;
        let is_used = |property: &Property| {
            let is_one = |index: usize| std::ptr::eq(property, &element.properties[index]);
            is_one(indices) || texcoords.is_some_and(is_one)
        };
        slots.report(element, is_used, unused);
        let room = self.room(element);
        let least_corners = 3 * room;
        self.corners.positions.reserve(match self.format {
            // A face of three corners takes seven bytes or more.
            Format::Text => least_corners.min(self.file_bytes as usize / 2),
            _ => {
                let bytes = element.properties[indices].kind.bytes() as u64;
                least_corners.min((self.file_bytes / bytes) as usize)
            }
        });
        let (mut list, mut face_texcoords) = (Vec::new(), Vec::new());
        for index in 0..element.count {
            body.begin(element, index)?;
            let start = self.corners.positions.len();
            for (at, property) in element.properties.iter().enumerate() {
                if let Some(length) = property.length {
                    let is_texcoords = Some(at) == texcoords;
                    let values = if is_texcoords {
                        &mut face_texcoords
                    } else {
                        &mut list
                    };
                    body.list(length, property.kind, values)?;
                    if at == indices {
                        for &vertex in list.iter() {
                            self.corners.positions.push(self.vertex(vertex, body)?);
                        }
                    }
                    continue;
                }
                let value = body.value(property.kind)?;
                if let Some(slot) = slots.of_property[at] {
                    slots.values[slot] = value;
                }
            }
            let end = self.corners.positions.len();
            Polygons::end_face(&mut self.polygons.face_ends, start, end);
            if texcoords.is_some() {
                self.corner_texcoords(&face_texcoords, end, body)?;
            }
            if let Some(kinds) = colors {
                let color_index = self.polygons.colors.len() as u32;
                self.polygons.colors.push(color(&slots.values, kinds));
                self.corners.colors.resize(end, color_index);
            }
            if has_materials {
                let material = self.material(slots.values[5], body)?;
                self.material_of_face.push(material);
            }
            if has_numbers {
                self.texture_of_face.push(slots.values[3]);
            }
            let is_opaque = |[kind]: [Type; 1]| slots.values[4] == kind.white();
            transparent += u64::from(!alpha.is_none_or(is_opaque));
        }
        unused.add_many("\"alpha\" of \"face\"", transparent);
        Ok(())
    }

    /// Gives the corners of a face up to `end` their own texture coordinates.
    fn corner_texcoords(&mut self, values: &[f64], end: usize, body: &Body) -> Result<()> {
        let column = &mut self.corners.texcoords;
        let count = end - column.len();
        if values.is_empty() {
            column.resize(end, NONE);
            return Ok(());
        }
        if values.len() != 2 * count {
            let problem = format!("a face of {count} corners has {} texcoord", values.len());
            return Err(body.error(&problem));
        }
        if !values.iter().all(|value| value.is_finite()) {
            return Err(body.error("a texcoord is not a finite number"));
        }
        for &texcoord in values.as_chunks::<2>().0 {
            column.push(self.polygons.texcoords.len() as u32);
            self.polygons.texcoords.push(texcoord);
        }
        Ok(())
    }

    /// Strips of triangles: each corner after the second forms one with the two before. −1 begins anew.
    fn strips(&mut self, element: &Element, body: &mut Body, unused: &mut Unused) -> Result<()> {
        let indices = self.indices(element)?;
        let slots = Slots::<1>::new(element);
        let is_used = |property: &Property| std::ptr::eq(property, &element.properties[indices]);
        slots.report(element, is_used, unused);
        let mut list = Vec::new();
        for index in 0..element.count {
            body.begin(element, index)?;
            for (at, property) in element.properties.iter().enumerate() {
                body.list_or_nothing(property, &mut list)?;
                if at == indices {
                    self.strip(&list, body)?;
                }
            }
        }
        Ok(())
    }

    fn strip(&mut self, list: &[f64], body: &Body) -> Result<()> {
        const RESTART: [f64; 2] = [-1.0, u32::MAX as f64];
        for strip in list.split(|index| RESTART.contains(index)) {
            let mut before = [NONE; 2];
            for (step, &vertex) in strip.iter().enumerate() {
                let vertex = self.vertex(vertex, body)?;
                let [a, b] = before;
                before = [b, vertex];
                // Equal neighbours join parts of a strip and are no triangle.
                if step < 2 || a == b || b == vertex || a == vertex {
                    continue;
                }
                let triangle = if step % 2 == 0 {
                    [a, b, vertex]
                } else {
                    [b, a, vertex]
                };
                let start = self.corners.positions.len();
                self.corners.positions.extend(triangle);
                Polygons::end_face(&mut self.polygons.face_ends, start, start + 3);
                for column in [&mut self.corners.texcoords, &mut self.corners.colors] {
                    if !column.is_empty() {
                        column.resize(start + 3, NONE);
                    }
                }
                if !self.texture_of_face.is_empty() {
                    self.texture_of_face.push(-1.0);
                }
            }
        }
        Ok(())
    }

    /// The index of the list of an element's vertices.
    fn indices(&self, element: &Element) -> Result<usize> {
        let is_list = |index: &usize| element.properties[*index].length.is_some();
        let Some(index) = element.find(&INDICES).filter(is_list) else {
            let names = element
                .properties
                .iter()
                .map(|property| property.name.as_str());
            let names: Vec<&str> = names.collect();
            let problem = format!("element \"{}\" has no list vertex_indices", element.name);
            let hint = match names.is_empty() {
                true => "export it again".into(),
                false => format!("rename one: {}", did_you_mean(INDICES[0], &names)),
            };
            return Err(element.error(self.file, &problem, &hint));
        };
        match element.properties[index].kind.is_whole() {
            true => Ok(index),
            false => {
                let problem = format!(
                    "the indices of element \"{}\" are no whole numbers",
                    element.name
                );
                Err(element.error(self.file, &problem, HINT))
            }
        }
    }

    fn material(&self, index: f64, body: &Body) -> Result<u32> {
        let materials = self.materials.unwrap_or_default();
        let found = materials.get(index as usize).filter(|_| index >= 0.0);
        found.copied().ok_or_else(|| {
            let count = materials.len();
            let problem =
                format!("a face has material_index {index}, but the [[mesh]] lists {count}");
            body.error(&problem)
        })
    }

    fn vertex(&self, index: f64, body: &Body) -> Result<u32> {
        match index {
            0.0.. if index < self.vertex_count as f64 && index < f64::from(NONE) => {
                Ok(index as u32)
            }
            _ => {
                let count = self.vertex_count;
                let problem = format!("a face uses vertex {index}, but there are {count} vertices");
                Err(body.error(&problem))
            }
        }
    }

    fn skip(&self, element: &Element, body: &mut Body) -> Result<()> {
        if element.properties.is_empty() {
            return Ok(());
        }
        let mut list = Vec::new();
        for index in 0..element.count {
            body.begin(element, index)?;
            for property in &element.properties {
                body.list_or_nothing(property, &mut list)?;
            }
        }
        Ok(())
    }
}
