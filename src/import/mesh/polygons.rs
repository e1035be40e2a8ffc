//! From the polygons that a reader found in a file to a mesh: the same rules for every format.
//!
//! - A polygon becomes triangles that cover its area, whatever its shape.
//! - A face is flat if a corner of it has no normal, or one without a direction. Exporters write zero normals for degenerate faces.
//! - The front of a triangle, where its corners turn counterclockwise, stays its front where the file is placed mirrored, and where its
//!   normals are left out.
//! - A face of fewer than three corners is ignored, with a warning.

use std::ops::Range;

use glam::{DAffine3, DVec3};

pub(super) use super::corners::{Columns, Corners, NONE};
use super::split::{Splitter, vector_area};
use crate::import::unused::Unused;
use crate::scene::Mesh;

/// The polygons of a file in the file's own space, as a reader found them. An empty list: the file has no such values.
#[derive(Debug, Default)]
pub(super) struct Polygons {
    pub positions: Vec<DVec3>,
    /// Of any length; zero or not finite for none.
    pub normals: Vec<DVec3>,
    pub texcoords: Vec<[f64; 2]>,
    /// With the index of the position.
    pub texcoords_1: Vec<[f64; 2]>,
    /// Linear.
    pub colors: Vec<[f32; 3]>,
    /// With the index of the position.
    pub tangents: Vec<[f32; 4]>,
    /// Of all faces, one after the other.
    pub corners: Corners,
    /// Where each face ends in `corners`; empty: every three corners are a face.
    pub face_ends: Vec<u32>,
    /// The material of each face, or one for all.
    pub materials: Vec<u32>,
    /// Whether normals and tangents keep every bit, instead of being made unit vectors.
    pub stay_as_is: bool,
}

impl Polygons {
    fn face_count(&self) -> usize {
        match self.face_ends.len() {
            0 => self.corners.len() / 3,
            count => count,
        }
    }

    fn face(&self, face: usize) -> Range<usize> {
        if self.face_ends.is_empty() {
            return 3 * face..3 * face + 3;
        }
        let start = face.checked_sub(1).map_or(0, |last| self.face_ends[last]);
        start as usize..self.face_ends[face] as usize
    }

    fn material(&self, face: usize) -> u32 {
        match self.materials[..] {
            [one] => one,
            _ => self.materials[face],
        }
    }

    /// Ends a face whose corners are all those from `start` on.
    pub fn end_face(face_ends: &mut Vec<u32>, start: usize, end: usize) {
        if face_ends.is_empty() {
            if start + 3 == end {
                return;
            }
            // So far every three corners were a face.
            face_ends.extend((1..=start as u32 / 3).map(|face| 3 * face));
        }
        face_ends.push(end as u32);
    }

    /// The first face with such a material and a corner without a texture coordinate.
    pub fn first_without_texcoord(&self, is_such: impl Fn(u32) -> bool) -> Option<usize> {
        let lacks = |corner| self.texcoords.is_empty() || self.corners.texcoord(corner) == NONE;
        (0..self.face_count())
            .filter(|&face| self.face(face).len() >= 3)
            .find(|&face| self.face(face).any(lacks) && is_such(self.material(face)))
    }

    /// Makes the mesh, placed by `to_world`. `flat`: without normals.
    ///
    /// # Errors
    /// Returns what is wrong with an index, with the number of values, or with a polygon.
    pub fn into_mesh(
        mut self,
        name: &str,
        to_world: &DAffine3,
        flat: bool,
        unused: &mut Unused,
    ) -> Result<Mesh, String> {
        self.check()?;
        self.clamp_colors(unused);
        let is_number = |normal: &&DVec3| !normal.is_finite();
        let not_finite = self.normals.iter().filter(is_number).count() as u64;
        unused.add_many(
            "normals that are no numbers, whose faces are flat",
            not_finite,
        );
        self.share_indices();
        self.shrink();
        let builder = Builder::new(&self, flat);
        let is_smooth = builder.is_smooth;
        let keeps_vertices =
            matches!(self.corners, Corners::Shared(_)) && !(is_smooth && builder.has_flat_faces);
        let mut mesh = match keeps_vertices {
            true => builder.without_vertices(unused)?,
            false => builder.with_own_vertices(unused)?,
        };
        if keeps_vertices {
            // Moved, so that a large mesh is not twice in memory.
            mesh.positions_m = self.positions;
            mesh.normals = if is_smooth { self.normals } else { Vec::new() };
            mesh.texcoords = self.texcoords;
            mesh.texcoords_1 = self.texcoords_1;
            mesh.colors = self.colors;
            mesh.tangents = self.tangents;
        }
        mesh.name = name.to_owned();
        if !self.stay_as_is {
            place(&mut mesh, to_world);
        }
        Ok(mesh)
    }

    fn check(&self) -> Result<(), String> {
        let count = self.positions.len();
        let columns = match &self.corners {
            Corners::Shared(_) => None,
            Corners::Separate(columns) => Some(columns),
        };
        let has_colors = columns.is_some_and(|columns| !columns.colors.is_empty());
        let lists = [
            ("texture coordinates", self.texcoords_1.len(), true),
            ("colours", self.colors.len(), !has_colors),
            ("tangents", self.tangents.len(), true),
            (
                "texture coordinates",
                self.texcoords.len(),
                columns.is_none(),
            ),
            ("normals", self.normals.len(), columns.is_none()),
        ];
        for (what, values, is_by_position) in lists {
            if is_by_position && values != 0 && values != count {
                return Err(format!("there are {values} {what} for {count} positions"));
            }
        }
        if count >= NONE as usize || self.corners.len() >= NONE as usize {
            return Err("there are 2^32 positions or corners of faces, or more".into());
        }
        let check = |indices: &[u32], what: &str, count: usize, may_lack: bool| {
            let is_wrong = |&&index: &&u32| index as usize >= count && !(may_lack && index == NONE);
            match indices.iter().find(is_wrong) {
                None => Ok(()),
                Some(index) => Err(format!(
                    "a face uses {what} {index}, but there are {count}, counted from 0"
                )),
            }
        };
        match &self.corners {
            Corners::Shared(indices) => check(indices, "position", count, false),
            Corners::Separate(columns) => {
                let texcoords = self.texcoords.len();
                check(&columns.positions, "position", count, false)?;
                check(&columns.texcoords, "texture coordinate", texcoords, true)?;
                check(&columns.normals, "normal", self.normals.len(), true)?;
                check(&columns.colors, "colour", self.colors.len(), false)
            }
        }
    }

    fn clamp_colors(&mut self, unused: &mut Unused) {
        let is_color = |value: &f32| (0.0..=1.0).contains(value);
        let mut count = 0;
        for color in self.colors.iter_mut().filter(|c| !c.iter().all(is_color)) {
            *color = color.map(|value| match value.is_nan() {
                true => 0.0,
                false => value.clamp(0.0, 1.0),
            });
            count += 1;
        }
        unused.add_many(
            "colours of vertices beyond 0 to 1, which are clamped",
            count,
        );
    }

    /// Uses one index for all values where the corners do, or have nothing else.
    fn share_indices(&mut self) {
        let Corners::Separate(columns) = &mut self.corners else {
            return;
        };
        let count = self.positions.len();
        let positions = &columns.positions;
        let is_same = |column: &[u32], values: usize| {
            column.is_empty() || (values == count && column == &positions[..])
        };
        if is_same(&columns.texcoords, self.texcoords.len())
            && is_same(&columns.normals, self.normals.len())
            && is_same(&columns.colors, self.colors.len())
        {
            if columns.texcoords.is_empty() {
                self.texcoords = Vec::new();
            }
            if columns.normals.is_empty() {
                self.normals = Vec::new();
            }
            self.corners = Corners::Shared(std::mem::take(&mut columns.positions));
        }
    }

    /// Frees what lists hold in reserve before the mesh takes memory of its own.
    fn shrink(&mut self) {
        self.positions.shrink_to_fit();
        self.normals.shrink_to_fit();
        self.texcoords.shrink_to_fit();
        self.colors.shrink_to_fit();
        match &mut self.corners {
            Corners::Shared(indices) => indices.shrink_to_fit(),
            Corners::Separate(columns) => {
                columns
                    .all()
                    .into_iter()
                    .for_each(|column| column.shrink_to_fit());
            }
        }
    }
}

/// Vertices at a position that are compared with a new one. A file with more at one position gets some of them twice, instead of a search
/// that takes time quadratic in its size.
const MOST_TRIED: usize = 64;

/// Whether two indices are of equal values: some formats have a list with a value for every corner.
fn is_equal<T: PartialEq>(a: u32, b: u32, values: &[T]) -> bool {
    let value = |index: u32| values.get(index as usize);
    a == b || (a != NONE && b != NONE && value(a) == value(b))
}

/// Makes a mesh of polygons whose indices are valid.
struct Builder<'p> {
    polygons: &'p Polygons,
    flat: bool,
    /// Whether a face has normals.
    is_smooth: bool,
    has_flat_faces: bool,
}

impl<'p> Builder<'p> {
    fn new(polygons: &'p Polygons, flat: bool) -> Self {
        let mut builder = Builder {
            polygons,
            flat,
            is_smooth: false,
            has_flat_faces: false,
        };
        for face in 0..polygons.face_count() {
            let is_flat = builder.is_flat(polygons.face(face));
            builder.is_smooth |= !is_flat;
            builder.has_flat_faces |= is_flat;
        }
        builder
    }

    /// Whether a face is flat.
    fn is_flat(&self, mut face: Range<usize>) -> bool {
        self.flat || self.polygons.normals.is_empty() || face.any(|c| self.normal(c).is_none())
    }

    fn normal(&self, corner: usize) -> Option<DVec3> {
        let index = self.polygons.corners.normal(corner);
        let normal = self.polygons.normals.get(index as usize).copied();
        normal.filter(|normal| normal.is_finite() && *normal != DVec3::ZERO)
    }

    /// Calls `add` for each triangle, with its face and its corners.
    fn for_each_triangle(
        &self,
        unused: &mut Unused,
        mut add: impl FnMut(usize, [usize; 3]),
    ) -> Result<(), String> {
        let mut splitter = Splitter::default();
        let mut too_small = 0;
        for face in 0..self.polygons.face_count() {
            let corners = self.polygons.face(face);
            if corners.len() < 3 {
                too_small += 1;
                continue;
            }
            let is_reversed = self.flat && self.opposes_normals(corners.clone());
            let position = |corner| self.position(corner);
            splitter.split(corners, position, |[a, b, c]| {
                add(face, if is_reversed { [a, c, b] } else { [a, b, c] });
            })?;
        }
        unused.add_many("faces of fewer than three corners", too_small);
        Ok(())
    }

    /// Whether the normals of a face are on its back.
    fn opposes_normals(&self, face: Range<usize>) -> bool {
        let normals: DVec3 = face.clone().filter_map(|corner| self.normal(corner)).sum();
        let outline: Vec<DVec3> = face.map(|corner| self.position(corner)).collect();
        vector_area(&outline).dot(normals) < 0.0
    }

    fn position(&self, corner: usize) -> DVec3 {
        self.polygons.positions[self.polygons.corners.position(corner) as usize]
    }

    /// The triangles of a mesh with the vertices of the file.
    fn without_vertices(&self, unused: &mut Unused) -> Result<Mesh, String> {
        let mut mesh = self.empty_mesh();
        self.for_each_triangle(unused, |face, corners| {
            let index = |corner| self.polygons.corners.position(corner);
            mesh.triangles.push(corners.map(index));
            mesh.triangle_materials.push(self.polygons.material(face));
        })?;
        Ok(mesh)
    }

    /// A mesh with a vertex for each combination of indices, and vertices of their own for flat faces.
    fn with_own_vertices(&self, unused: &mut Unused) -> Result<Mesh, String> {
        let polygons = self.polygons;
        let mut mesh = self.empty_mesh();
        let has_texcoords = !polygons.texcoords.is_empty();
        // The vertices of each position, as lists: the last one, and from each the one before.
        let mut last_of_position = vec![NONE; polygons.positions.len()];
        let mut vertices: Vec<(u32, [u32; 3])> = Vec::new();
        let has_colors = matches!(&polygons.corners, Corners::Separate(c) if !c.colors.is_empty());
        self.for_each_triangle(unused, |face, corners| {
            let position = |corner| polygons.corners.position(corner) as usize;
            let is_flat = self.is_flat(polygons.face(face));
            let face_normal = || {
                let [a, b, c] = corners.map(|corner| self.position(corner));
                // A triangle without area is never seen, so any unit normal will do.
                let normal = (b - a).cross(c - a).try_normalize();
                normal.unwrap_or(DVec3::Z)
            };
            let is_apart = is_flat && self.is_smooth;
            let triangle = corners.map(|corner| {
                let position = position(corner);
                let texcoord = match has_texcoords {
                    true => polygons.corners.texcoord(corner),
                    false => NONE,
                };
                let normal = match self.is_smooth && !is_flat {
                    true => polygons.corners.normal(corner),
                    false => NONE,
                };
                let color = match has_colors {
                    true => polygons.corners.color(corner),
                    false => NONE,
                };
                let values = [texcoord, normal, color];
                let is_same = |[t, n, c]: [u32; 3]| {
                    n == normal
                        && is_equal(t, texcoord, &polygons.texcoords)
                        && is_equal(c, color, &polygons.colors)
                };
                // A vertex of a flat face is in no list, because no other face shares it.
                let last = match is_apart {
                    true => NONE,
                    false => last_of_position[position],
                };
                let mut known = last;
                let mut tried = 0;
                while known != NONE && !is_same(vertices[known as usize].1) {
                    tried += 1;
                    known = match tried < MOST_TRIED {
                        true => vertices[known as usize].0,
                        false => NONE,
                    };
                }
                if known != NONE {
                    return known;
                }
                let vertex = vertices.len() as u32;
                vertices.push((last, values));
                if !is_apart {
                    last_of_position[position] = vertex;
                }
                mesh.positions_m.push(polygons.positions[position]);
                if has_texcoords {
                    // Faces without texture coordinates show no texture, so the value is never read.
                    let texcoord = polygons.texcoords.get(texcoord as usize);
                    mesh.texcoords.push(texcoord.copied().unwrap_or_default());
                }
                if self.is_smooth {
                    let normal = polygons.normals.get(normal as usize).copied();
                    mesh.normals.push(normal.unwrap_or_else(face_normal));
                }
                mesh.texcoords_1.extend(polygons.texcoords_1.get(position));
                let color = polygons.corners.color(corner) as usize;
                mesh.colors.extend(polygons.colors.get(color));
                mesh.tangents.extend(polygons.tangents.get(position));
                vertex
            });
            mesh.triangles.push(triangle);
            mesh.triangle_materials.push(polygons.material(face));
        })?;
        Ok(mesh)
    }

    fn empty_mesh(&self) -> Mesh {
        let faces = self.polygons.face_count();
        let corners = self.polygons.corners.len();
        // Exact for simple polygons; a face of fewer than three corners has none.
        let triangles = corners.saturating_sub(2 * faces);
        Mesh {
            triangles: Vec::with_capacity(triangles),
            triangle_materials: Vec::with_capacity(triangles),
            ..Mesh::default()
        }
    }
}

/// Places a mesh in the file's space where it belongs.
fn place(mesh: &mut Mesh, to_world: &DAffine3) {
    if *to_world != DAffine3::IDENTITY {
        for position in &mut mesh.positions_m {
            *position = to_world.transform_point3(*position);
        }
    }
    for normal in &mut mesh.normals {
        // A vertex that no smooth face uses may have any normal.
        if !normal.is_finite() || *normal == DVec3::ZERO {
            *normal = DVec3::Z;
        }
    }
    mesh.place_directions(to_world.matrix3);
}
