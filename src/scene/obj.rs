//! Reads OBJ files: polygons of one material and one form after the other, as triangles.

use std::path::Path;

use glam::DVec3;

use super::lines::{Line, lines};
use crate::Result;

/// What an OBJ file holds.
#[derive(Default)]
pub(super) struct Obj {
    pub positions: Vec<DVec3>,
    pub texcoords: Vec<[f64; 2]>,
    pub normals: Vec<DVec3>,
    pub groups: Vec<FaceGroup>,
    /// What `usemtl` names, one a statement.
    pub materials: Vec<Named>,
    pub libraries: Vec<Named>,
}

/// A name and the line that has it.
pub(super) struct Named {
    pub name: String,
    pub line: usize,
}

/// Consecutive faces of one material and one form.
pub(super) struct FaceGroup {
    /// Index in [`Obj::materials`]: were the name itself here, a long one would be there a thousand times.
    pub material: Option<usize>,
    pub form: Form,
    /// That of the first face.
    pub line: usize,
    pub triangles: Vec<[Corner; 3]>,
}

/// What the corners of a face have beside a position.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Form {
    pub texcoords: bool,
    pub normals: bool,
}

/// A corner of a face: indices into the lists of [`Obj`].
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Corner {
    pub position: u32,
    pub texcoord: Option<u32>,
    pub normal: Option<u32>,
}

impl Corner {
    fn form(&self) -> Form {
        Form {
            texcoords: self.texcoord.is_some(),
            normals: self.normal.is_some(),
        }
    }
}

/// Statements without bearing on the surface: groups, smoothing (normals are given or not), points, lines, display.
const IGNORED: [&str; 14] = [
    "o",
    "g",
    "s",
    "mg",
    "p",
    "l",
    "vp",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "maplib",
    "usemap",
    "shadow_obj",
];

/// How many triangles are tried in search of a fan: for a polygon, and per corner of a large one.
const MOST_TRIANGLES: usize = 1_000_000;
const MOST_TRIANGLES_PER_CORNER: usize = 100;

/// Reads the text of the OBJ `file`; with `flat`, normals are left out.
///
/// A zero normal (exporters write them for degenerate faces) makes its face flat.
///
/// # Errors
/// With file and line: numbers that do not parse or are not finite, indices out of range, faces of fewer than three
/// corners, corners of unlike form, polygons that no fan of triangles fills, statements that are not polygons.
pub(super) fn parse(text: &str, file: &Path, flat: bool) -> Result<Obj> {
    let mut obj = Obj::default();
    for line in lines(text, file) {
        obj.take(&line, flat)?;
    }
    Ok(obj)
}

impl Obj {
    fn take(&mut self, line: &Line, flat: bool) -> Result<()> {
        match line.keyword() {
            "v" => {
                // A fourth number is a weight for curves and more are vertex colours: neither has a bearing here.
                let numbers = line.numbers(3..=7)?;
                self.positions.push(DVec3::from_slice(&numbers));
            }
            "vt" => {
                let numbers = line.numbers(1..=3)?;
                let v = numbers.get(1).copied().unwrap_or(0.0);
                self.texcoords.push([numbers[0], v]);
            }
            "vn" => {
                let numbers = line.numbers(3..=3)?;
                self.normals.push(DVec3::from_slice(&numbers));
            }
            "f" => self.face(line, flat)?,
            "usemtl" => self.materials.push(named(line)?),
            "mtllib" => self.libraries.push(named(line)?),
            keyword if IGNORED.contains(&keyword) => {}
            _ => {
                return Err(line.error(
                    "is not a statement that is read here",
                    "export the mesh as polygons, or remove the line",
                ));
            }
        }
        Ok(())
    }

    fn face(&mut self, line: &Line, flat: bool) -> Result<()> {
        let mut corners = line
            .words()
            .map(|word| self.corner(word, line))
            .collect::<Result<Vec<Corner>>>()?;
        if corners.len() < 3 {
            return Err(line.error(
                format!("has {} corners", corners.len()),
                "give a face at least three, or remove the line",
            ));
        }
        let mut form = corners[0].form();
        if corners.iter().any(|corner| corner.form() != form) {
            return Err(line.error(
                "has corners with and without texture coordinate or normal",
                "give all corners of a face the same parts",
            ));
        }
        let is_zero = |normal: u32| self.normals[normal as usize] == DVec3::ZERO;
        if flat || corners.iter().any(|c| c.normal.is_some_and(is_zero)) {
            form.normals = false;
            corners.iter_mut().for_each(|corner| corner.normal = None);
        }
        let position = |corner: &Corner| self.positions[corner.position as usize];
        let outline: Vec<DVec3> = corners.iter().map(position).collect();
        let apex = fan_apex(&outline).ok_or_else(|| {
            line.error(
                "is a concave polygon that no fan of triangles fills",
                "triangulate the mesh where it is made",
            )
        })?;
        corners.rotate_left(apex);
        let fan = corners[1..].windows(2);
        let fan = fan.map(|pair| [corners[0], pair[0], pair[1]]);
        self.group(form, line).triangles.extend(fan);
        Ok(())
    }

    /// The group of a face: the last one, or one that begins here.
    fn group(&mut self, form: Form, line: &Line) -> &mut FaceGroup {
        let material = self.materials.len().checked_sub(1);
        let last = self.groups.last();
        if last.is_none_or(|group| group.form != form || group.material != material) {
            self.groups.push(FaceGroup {
                material,
                form,
                line: line.number(),
                triangles: Vec::new(),
            });
        }
        let last = self.groups.len() - 1;
        &mut self.groups[last]
    }

    fn corner(&self, word: &str, line: &Line) -> Result<Corner> {
        let counts = [
            ("vertices", self.positions.len()),
            ("texture coordinates", self.texcoords.len()),
            ("normals", self.normals.len()),
        ];
        let parts: Vec<&str> = word.split('/').collect();
        if parts.len() > 3 || parts[0].is_empty() {
            return Err(line.error(
                format!("has the corner \"{word}\""),
                "write v, v/vt, v//vn or v/vt/vn",
            ));
        }
        let mut indices = [None; 3];
        for ((part, index), (what, count)) in parts.iter().zip(&mut indices).zip(counts) {
            if !part.is_empty() {
                *index = Some(zero_based(part, count).ok_or_else(|| {
                    line.error(
                        format!("refers to {part} of {count} {what} above it"),
                        "indices begin at 1, or at -1 for the last one",
                    )
                })?);
            }
        }
        let [position, texcoord, normal] = indices;
        Ok(Corner {
            // It is not empty.
            position: position.unwrap_or_default(),
            texcoord,
            normal,
        })
    }
}

fn named(line: &Line) -> Result<Named> {
    Ok(Named {
        name: line.name()?.to_owned(),
        line: line.number(),
    })
}

/// OBJ indices begin at 1; negative ones count back from the last element so far.
fn zero_based(word: &str, count: usize) -> Option<u32> {
    let index: i64 = word.parse().ok()?;
    let from_start = match index {
        1.. => index - 1,
        0 => return None,
        _ => index.checked_add_unsigned(count as u64)?,
    };
    let index = u32::try_from(from_start).ok();
    index.filter(|&index| (index as usize) < count)
}

/// The corner from which a fan of triangles fills the polygon without folding over; None where none was found.
fn fan_apex(outline: &[DVec3]) -> Option<usize> {
    let n = outline.len();
    let fan = |apex: usize| {
        (1..n - 1).map(move |i| {
            let [a, b, c] = [apex, apex + i, apex + i + 1].map(|k| outline[k % n]);
            (b - a).cross(c - a)
        })
    };
    // The sum over any fan is twice the vector area of the outline (Newell).
    let area: DVec3 = fan(0).sum();
    // A triangle of no area does not fold; rounding may give it either sign.
    let folded = -1e-9 * area.length_squared();
    // All fans of a polygon of up to a thousand corners are tried. All of a million corners would take hours.
    let mut triangles_left = MOST_TRIANGLES.max(MOST_TRIANGLES_PER_CORNER * n);
    (0..n).find(|&apex| {
        fan(apex).all(|triangle| {
            triangles_left = triangles_left.saturating_sub(1);
            triangles_left > 0 && triangle.dot(area) >= folded
        })
    })
}
