//! PLY files, for example from scanners: text or binary, one mesh without materials.

use glam::DAffine3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{Ply, Property, PropertyAccess, PropertyAccessResult};

use super::assets::{Assets, MeshRequest};
use super::polygons::{Corners, Polygons};
use super::unused::Unused;
use crate::scene::Mesh;
use crate::{Error, Result, input_file};

/// A vertex or a face. Missing properties keep their initial values.
struct Element {
    position: [f64; 3],
    normal: [f64; 3],
    texcoord: [f64; 2],
    corners: Vec<i64>,
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Element {
            position: [0.0; 3],
            normal: [0.0; 3],
            texcoord: [0.0; 2],
            corners: Vec::new(),
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let place = match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            "nx" => &mut self.normal[0],
            "ny" => &mut self.normal[1],
            "nz" => &mut self.normal[2],
            "u" | "s" | "texture_u" => &mut self.texcoord[0],
            "v" | "t" | "texture_v" => &mut self.texcoord[1],
            "vertex_indices" | "vertex_index" => {
                return match corners(property) {
                    Some(corners) => {
                        self.corners = corners;
                        PropertyAccessResult::Set
                    }
                    None => PropertyAccessResult::UnsupportedType,
                };
            }
            _ => return PropertyAccessResult::Ignored,
        };
        match number(property) {
            Some(number) => {
                *place = number;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::UnsupportedType,
        }
    }
}

fn number(property: Property) -> Option<f64> {
    Some(match property {
        Property::Char(value) => value.into(),
        Property::UChar(value) => value.into(),
        Property::Short(value) => value.into(),
        Property::UShort(value) => value.into(),
        Property::Int(value) => value.into(),
        Property::UInt(value) => value.into(),
        Property::Float(value) => value.into(),
        Property::Double(value) => value,
        _ => return None,
    })
}

fn corners(property: Property) -> Option<Vec<i64>> {
    fn whole<T: Into<i64>>(values: Vec<T>) -> Option<Vec<i64>> {
        Some(values.into_iter().map(T::into).collect())
    }
    match property {
        Property::ListChar(values) => whole(values),
        Property::ListUChar(values) => whole(values),
        Property::ListShort(values) => whole(values),
        Property::ListUShort(values) => whole(values),
        Property::ListInt(values) => whole(values),
        Property::ListUInt(values) => whole(values),
        _ => None,
    }
}

impl Assets {
    /// Loads a PLY file as one mesh. Polygons become fans of triangles.
    pub(super) fn load_ply(&mut self, request: &MeshRequest) -> Result<Mesh> {
        let path = &request.path;
        let refuse = |problem: String, hint: &str| {
            Err(Error::scene(path.display().to_string(), problem, hint))
        };
        let Some(material) = request.material_override else {
            let problem = format!("{} has no materials", path.display());
            let hint = "add material = \"NAME\" to the [[mesh]], and a [material.NAME] table to the scene file";
            return Err(Error::scene(&request.named_at, problem, hint));
        };
        let bytes = input_file::read(path).map_err(|error| {
            let problem = format!("cannot read the mesh {}: {error}", path.display());
            let hint = "correct the path; it is relative to the file that names it";
            Error::scene(&request.named_at, problem, hint)
        })?;
        let mut ply: Ply<Element> = match Parser::new().read_ply(&mut bytes.as_slice()) {
            Ok(ply) => ply,
            Err(error) => return refuse(format!("not valid PLY: {error}"), "export it again"),
        };
        let properties = ply.header.elements.get("vertex");
        let properties = properties.map(|vertex| &vertex.properties);
        let has = |names: &[&str]| {
            properties.is_some_and(|all| names.iter().all(|&name| all.contains_key(name)))
        };
        if !has(&["x", "y", "z"]) {
            return refuse("its vertices have no x, y and z".into(), "export it again");
        }
        let has_normals = has(&["nx", "ny", "nz"]);
        let has_texcoords = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]]
            .iter()
            .any(|names| has(names));
        let mut unused = Unused::default();
        if has(&["red", "green", "blue"]) {
            unused.add("colours of vertices");
        }
        let vertices = ply.payload.swap_remove("vertex").unwrap_or_default();
        let faces = ply.payload.swap_remove("face").unwrap_or_default();
        let mut polygons = Polygons {
            positions: vertices.iter().map(|v| v.position.into()).collect(),
            materials: vec![material],
            ..Polygons::default()
        };
        if has_normals {
            polygons.normals = vertices.iter().map(|v| v.normal.into()).collect();
        }
        if has_texcoords {
            polygons.texcoords = vertices.iter().map(|vertex| vertex.texcoord).collect();
        }
        let mut corners = Vec::new();
        for face in &faces {
            for &corner in &face.corners {
                let Ok(index) = u32::try_from(corner) else {
                    return refuse(format!("a face uses vertex {corner}"), "export it again");
                };
                corners.push(index);
            }
            polygons.face_ends.push(corners.len() as u32);
        }
        polygons.corners = Corners::Shared(corners);
        let to_world = DAffine3::from_mat4(request.transform.matrix());
        let mesh = polygons.into_mesh(&request.name, &to_world, request.flat, &mut unused);
        self.report(path, &unused);
        mesh.or_else(|problem| refuse(problem, "export it again"))
    }
}
