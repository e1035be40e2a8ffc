//! OBJ files: one mesh with the materials of its MTL files.
//!
//! The file is read line by line, straight into [`Polygons`]. The crate `tobj` loses data without a word: it turns a polyline into a face,
//! shifts normals if only some faces have them, drops the name of an unknown material, splits concave polygons wrongly, and reports no line
//! numbers.

mod map;
mod material;
mod mtl;

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine3, DVec3};

use super::colors::as_unit_colors;
use super::polygons::{Columns, Corners, NONE, Polygons};
use super::{Assets, MeshRequest};
use crate::import::lines::{Line, Lines, open, place};
use crate::import::unused::{Unused, shown};
use crate::keys::did_you_mean;
use crate::scene::Mesh;
use crate::{Error, Result};
use mtl::Library;

/// All statements of the format. Those that camlux does not use are named in the warning, except groups and smoothing, which carry nothing
/// that is seen.
const STATEMENTS: [&str; 45] = [
    "v",
    "vt",
    "vn",
    "f",
    "fo",
    "usemtl",
    "mtllib",
    "o",
    "g",
    "s",
    "mg",
    "p",
    "l",
    "vp",
    "cstype",
    "deg",
    "bmat",
    "step",
    "curv",
    "curv2",
    "surf",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "maplib",
    "usemap",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "call",
    "csh",
    "bsp",
    "bzp",
    "cdc",
    "cdp",
    "res",
];

/// A material that faces name.
struct Named {
    name: String,
    line: usize,
}

/// Consecutive faces of one material.
struct Run {
    /// Index in [`Reader::materials`].
    material: Option<usize>,
    first_face: usize,
    /// The line of the first face.
    line: usize,
}

#[derive(Default)]
struct Reader {
    polygons: Polygons,
    corners: Columns,
    face_count: usize,
    runs: Vec<Run>,
    materials: Vec<Named>,
    material_of_name: HashMap<String, usize>,
    /// The material of the faces that follow.
    material: Option<usize>,
    libraries: Vec<Named>,
    /// The first statement that is none of OBJ.
    first_unknown: Option<(String, usize)>,
    is_any_known: bool,
    unused: Unused,
}

impl Assets {
    pub(super) fn load_obj(&mut self, request: &MeshRequest) -> Result<Mesh> {
        let file = &request.path;
        let (stream, _) = open(file, &request.named_at, "mesh")?;
        let mut lines = Lines::new(file, stream);
        let mut reader = Reader::default();
        while let Some(line) = lines.next_statement()? {
            reader.take(&line)?;
        }
        drop(lines);
        if let (Some((word, line)), false) = (&reader.first_unknown, reader.is_any_known) {
            let problem = format!("\"{}\" is not a statement of OBJ", shown(word));
            return Err(Error::scene(
                place(file, *line),
                problem,
                "give an OBJ file",
            ));
        }
        let materials = match request.material_override {
            Some(material) => vec![material],
            None => {
                let of_runs = self.materials_of_runs(&reader, file)?;
                reader.material_of_faces(&of_runs)
            }
        };
        let Reader {
            mut polygons,
            corners,
            mut unused,
            ..
        } = reader;
        as_unit_colors(&mut polygons.colors);
        polygons.corners = Corners::Separate(corners);
        polygons.materials = materials;
        if request.material_override.is_none() {
            self.check_texcoords(&polygons, file)?;
        }
        let to_world = DAffine3::from_mat4(request.transform.matrix());
        let mesh = polygons.into_mesh(&request.name, &to_world, request.flat, &mut unused);
        self.report(file, &unused);
        let refuse = |problem| Error::scene(file.display().to_string(), problem, "export it again");
        mesh.map_err(refuse)
    }

    /// The materials of the runs of faces, in the scene.
    fn materials_of_runs(&mut self, reader: &Reader, file: &Path) -> Result<Vec<u32>> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let mut library = Library::default();
        for statement in &reader.libraries {
            library.read(&statement.name, folder, &place(file, statement.line))?;
        }
        let mut index_of = vec![None; reader.materials.len()];
        let mut materials = Vec::with_capacity(reader.runs.len());
        for run in &reader.runs {
            let Some(material) = run.material else {
                return Err(Error::scene(
                    place(file, run.line),
                    "a face has no material",
                    "name one with mtllib and usemtl above it, or give the [[mesh]] a material = \"...\"",
                ));
            };
            let index = match index_of[material] {
                Some(known) => known,
                None => self.add_from_library(&reader.materials[material], file, &library)?,
            };
            index_of[material] = Some(index);
            materials.push(index);
        }
        for (file, unused) in &library.files {
            self.report(file, unused);
        }
        Ok(materials)
    }

    fn add_from_library(&mut self, name: &Named, file: &Path, library: &Library) -> Result<u32> {
        let entry = library.get(&name.name).ok_or_else(|| {
            let known = library.names();
            let hint = if known.is_empty() {
                "name its MTL file with mtllib, or give the [[mesh]] a material = \"...\"".into()
            } else {
                did_you_mean(&name.name, &known)
            };
            Error::scene(
                place(file, name.line),
                format!("material \"{}\" is in no MTL file", name.name),
                hint,
            )
        })?;
        let material = self.material_from(entry)?;
        Ok(self.push_material(material, entry.at.clone()))
    }

    /// Refuses a face of a textured material without texture coordinates: it would show one arbitrary texel if other faces have them.
    fn check_texcoords(&self, polygons: &Polygons, file: &Path) -> Result<()> {
        if polygons.texcoords.is_empty() {
            return Ok(());
        }
        let is_textured = |material: u32| self.materials[material as usize].has_texture();
        let Some(face) = polygons.first_without_texcoord(is_textured) else {
            return Ok(());
        };
        let material = match polygons.materials[..] {
            [one] => one,
            _ => polygons.materials[face],
        };
        Err(Error::scene(
            place_of_face(file, face),
            format!(
                "a face of the textured material \"{}\" has no texture coordinates",
                self.materials[material as usize].name
            ),
            "give its corners vt indices, or another material",
        ))
    }
}

/// The place of a face. Only an error needs it, so that the file is read again rather than every line kept.
fn place_of_face(file: &Path, face: usize) -> String {
    let find = || {
        let (stream, _) = open(file, "", "mesh").ok()?;
        let mut lines = Lines::new(file, stream);
        let mut count = 0;
        while let Some(line) = lines.next_statement().ok()? {
            if matches!(line.keyword(), "f" | "F" | "fo") {
                if count == face {
                    return Some(line.at());
                }
                count += 1;
            }
        }
        None
    };
    find().unwrap_or_else(|| file.display().to_string())
}

impl Reader {
    fn take(&mut self, line: &Line) -> Result<()> {
        let known = match line.keyword() {
            keyword if STATEMENTS[..4].contains(&keyword) => Some(keyword),
            keyword => STATEMENTS
                .into_iter()
                .find(|known| known.eq_ignore_ascii_case(keyword)),
        };
        self.is_any_known |= known.is_some();
        match known {
            Some("v") => self.vertex(line)?,
            Some("vt") => {
                let numbers = line.numbers(1..=3)?;
                let v = numbers.get(1).copied().unwrap_or_default();
                self.polygons.texcoords.push([numbers[0], v]);
            }
            Some("vn") => {
                let normal = DVec3::from_slice(&line.numbers_of_any_kind(3..=3)?);
                self.polygons.normals.push(normal);
            }
            // An older name for faces.
            Some("f" | "fo") => self.face(line)?,
            Some("usemtl") => self.use_material(line)?,
            Some("mtllib") => self.libraries.push(Named {
                name: line.name()?.to_owned(),
                line: line.number(),
            }),
            Some("o" | "g" | "s" | "mg") => {}
            Some("p") => self.unused.add("\"p\": points"),
            Some("l") => self.unused.add("\"l\": lines"),
            Some(known) => self.unused.add(&format!("\"{known}\"")),
            None => {
                let keyword = line.keyword();
                let first = || (shown(keyword), line.number());
                self.first_unknown.get_or_insert_with(first);
                self.unused.add_unknown(keyword, &STATEMENTS);
            }
        }
        Ok(())
    }

    /// `v x y z`, then the weight of a curve's point, or a colour, or both.
    fn vertex(&mut self, line: &Line) -> Result<()> {
        let numbers = line.numbers(3..=7)?;
        let position = DVec3::from_slice(&numbers);
        let (weight, color) = match numbers[3..] {
            [] => (1.0, None),
            [weight] => (weight, None),
            [r, g, b] => (1.0, Some([r, g, b])),
            [weight, r, g, b] => (weight, Some([r, g, b])),
            _ => {
                let problem = format!("has {} numbers", numbers.len());
                let hint = "write x y z, with a weight, with a colour r g b, or with both";
                return Err(line.error(problem, hint));
            }
        };
        if weight != 1.0 {
            self.unused.add("weights of \"v\", which are for curves");
        }
        let colors = &mut self.polygons.colors;
        if color.is_some() && colors.is_empty() {
            colors.resize(self.polygons.positions.len(), [1.0; 3]);
        }
        if color.is_some() || !colors.is_empty() {
            let color = color.unwrap_or([1.0; 3]);
            colors.push(color.map(|value| value as f32));
        }
        self.polygons.positions.push(position);
        Ok(())
    }

    fn face(&mut self, line: &Line) -> Result<()> {
        let start = self.corners.positions.len();
        let mut form = None;
        for word in line.words() {
            let corner = self.corner(word, line)?;
            let own = [corner[1] == NONE, corner[2] == NONE];
            if *form.get_or_insert(own) != own {
                return Err(line.error(
                    "has corners with and without texture coordinate or normal",
                    "give all corners of a face the same parts",
                ));
            }
            self.corners.push(corner);
        }
        let end = self.corners.positions.len();
        if end >= NONE as usize {
            return Err(line.error("is beyond 2^32 corners of faces", "split the mesh"));
        }
        Polygons::end_face(&mut self.polygons.face_ends, start, end);
        let last = self.runs.last().map(|run| run.material);
        // A face of fewer corners is not seen and needs no material.
        if last != Some(self.material) && end - start >= 3 {
            self.runs.push(Run {
                material: self.material,
                first_face: self.face_count,
                line: line.number(),
            });
        }
        self.face_count += 1;
        Ok(())
    }

    /// The zero-based indices of `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, word: &str, line: &Line) -> Result<[u32; 3]> {
        let counts = [
            ("vertices", self.polygons.positions.len()),
            ("texture coordinates", self.polygons.texcoords.len()),
            ("normals", self.polygons.normals.len()),
        ];
        let slashes = word.bytes().filter(|&byte| byte == b'/').count();
        if slashes > 2 || word.starts_with('/') {
            return Err(line.error(
                format!("has the corner \"{word}\""),
                "write v, v/vt, v//vn or v/vt/vn",
            ));
        }
        let mut corner = [NONE; 3];
        let parts = word.split('/');
        for ((index, (what, count)), part) in corner.iter_mut().zip(counts).zip(parts) {
            if part.is_empty() {
                continue;
            }
            *index = zero_based(part, count).ok_or_else(|| {
                line.error(
                    format!("refers to {part}, but there are {count} {what} above it"),
                    "indices begin at 1, or at -1 for the last one",
                )
            })?;
        }
        Ok(corner)
    }

    fn use_material(&mut self, line: &Line) -> Result<()> {
        let Ok(name) = line.name() else {
            // Some exporters write no name for faces without a material.
            self.material = None;
            return Ok(());
        };
        let known = self.material_of_name.get(name).copied();
        let index = known.unwrap_or_else(|| {
            self.materials.push(Named {
                name: name.to_owned(),
                line: line.number(),
            });
            let index = self.materials.len() - 1;
            self.material_of_name.insert(name.to_owned(), index);
            index
        });
        self.material = Some(index);
        Ok(())
    }

    /// The material of each face, or one for all.
    fn material_of_faces(&self, of_runs: &[u32]) -> Vec<u32> {
        if of_runs.len() <= 1 {
            return of_runs.to_vec();
        }
        let mut materials = Vec::with_capacity(self.face_count);
        for (run, &material) in of_runs.iter().enumerate() {
            let next = self.runs.get(run + 1);
            let end = next.map_or(self.face_count, |next| next.first_face);
            materials.resize(end, material);
        }
        materials
    }
}

/// OBJ indices begin at 1; negative ones count back from the last element so far.
fn zero_based(word: &str, count: usize) -> Option<u32> {
    let index: i64 = word.parse().ok()?;
    let from_start = match index {
        1.. => index - 1,
        0 => return None,
        _ => index.checked_add_unsigned(count as u64)?,
    };
    let is_there = |&index: &u32| (index as usize) < count && index < NONE;
    u32::try_from(from_start).ok().filter(is_there)
}
