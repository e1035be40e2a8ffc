//! Checks an OBJ file line by line and rewrites it into a form that `tobj` reads without loss.
//!
//! `tobj` alone loses data silently: it turns a polyline into a face, shifts normals if only some faces have them, drops the name of an
//! unknown material, cuts concave quads wrongly, and reports no line numbers. So it gets only positions, normals, texture coordinates and
//! faces, in groups ("runs") that share one material and one form.

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;

use super::lines::{Line, lines};
use crate::Result;

/// An OBJ file, checked and rewritten for `tobj`.
#[derive(Default)]
pub(super) struct CheckedObj {
    /// The rewritten file. Its groups are named by their index in `runs`.
    pub text: String,
    pub runs: Vec<FaceGroup>,
    /// The names in the `usemtl` statements, one per statement.
    pub materials: Vec<Named>,
    pub libraries: Vec<Named>,
}

/// A name and the line that contains it.
pub(super) struct Named {
    pub name: String,
    pub line: usize,
}

/// Consecutive faces of one material and one form.
pub(super) struct FaceGroup {
    /// Index in [`CheckedObj::materials`]. The name itself is not stored here, because a long name could then be stored a thousand times.
    pub material: Option<usize>,
    pub form: Form,
    /// The line of the first face.
    pub line: usize,
}

/// What the corners of a face have besides a position.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Form {
    pub texcoords: bool,
    pub normals: bool,
}

/// A corner of a face: zero-based indices of position, texture coordinate, normal.
type Corner = [Option<usize>; 3];

/// Statements that do not affect the surface: groups, smoothing (normals are given or not), points, lines, display.
const IGNORED: &str = "o g s mg p l vp bevel c_interp d_interp lod maplib usemap shadow_obj";

/// Maximum number of triangles to test in the search for a fan: per polygon, and per corner of a large polygon.
const MOST_TRIANGLES: usize = 1_000_000;
const MOST_TRIANGLES_PER_CORNER: usize = 100;

/// Checks the text of the OBJ `file`. If `flat` is set, normals are left out.
///
/// A zero normal (exporters write them for degenerate faces) makes its face flat.
///
/// # Errors
/// Returns an error with file and line for numbers that do not parse or are not finite, indices out of range, faces of fewer than three
/// corners, faces whose corners have different forms, polygons that no fan of triangles fills, and statements that are not polygons.
pub(super) fn check(text: &str, file: &Path, flat: bool) -> Result<CheckedObj> {
    let mut checker = Checker {
        flat,
        ..Checker::default()
    };
    for line in lines(text, file) {
        checker.take(&line)?;
    }
    Ok(checker.obj)
}

#[derive(Default)]
struct Checker {
    flat: bool,
    positions: Vec<DVec3>,
    texcoord_count: usize,
    normal_is_zero: Vec<bool>,
    obj: CheckedObj,
}

impl Checker {
    fn take(&mut self, line: &Line) -> Result<()> {
        match line.keyword() {
            "v" => {
                // A fourth number is a weight for curves, and more numbers are vertex colours. Both are ignored.
                let numbers = line.numbers(3..=7)?;
                self.positions.push(DVec3::from_slice(&numbers));
                self.write("v", &numbers[..3]);
            }
            "vt" => {
                let mut numbers = line.numbers(1..=3)?;
                numbers.resize(2, 0.0);
                self.texcoord_count += 1;
                self.write("vt", &numbers);
            }
            "vn" => {
                let numbers = line.numbers(3..=3)?;
                self.normal_is_zero.push(numbers.iter().all(|&n| n == 0.0));
                self.write("vn", &numbers);
            }
            "f" => self.face(line)?,
            "usemtl" => self.obj.materials.push(named(line)?),
            "mtllib" => self.obj.libraries.push(named(line)?),
            keyword if IGNORED.split(' ').any(|ignored| ignored == keyword) => {}
            _ => {
                return Err(line.error(
                    "is not a statement that camlux reads",
                    "export the mesh as polygons, or remove the line",
                ));
            }
        }
        Ok(())
    }

    fn write(&mut self, keyword: &str, numbers: &[f64]) {
        self.obj.text.push_str(keyword);
        for number in numbers {
            // Writing to a String cannot fail, and an f64 is written so that it reads back the same.
            let _ = write!(self.obj.text, " {number:?}");
        }
        self.obj.text.push('\n');
    }

    fn face(&mut self, line: &Line) -> Result<()> {
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
        let form_of = |corner: &Corner| Form {
            texcoords: corner[1].is_some(),
            normals: corner[2].is_some(),
        };
        let mut form = form_of(&corners[0]);
        if corners.iter().any(|corner| form_of(corner) != form) {
            return Err(line.error(
                "has corners with and without texture coordinate or normal",
                "give all corners of a face the same parts",
            ));
        }
        let zero_normal = |corner: &Corner| corner[2].is_some_and(|n| self.normal_is_zero[n]);
        if self.flat || corners.iter().any(zero_normal) {
            form.normals = false;
        }
        let positions = corners.iter().filter_map(|corner| corner[0]);
        let outline: Vec<DVec3> = positions.map(|v| self.positions[v]).collect();
        let apex = fan_apex(&outline).ok_or_else(|| {
            line.error(
                "is a concave polygon that camlux cannot split into a fan of triangles",
                "triangulate the mesh before you export it",
            )
        })?;
        corners.rotate_left(apex);

        self.begin_run(form, line);
        self.obj.text.push('f');
        for [v, vt, vn] in corners {
            let one_based = |index: Option<usize>, wanted: bool| {
                let index = index.filter(|_| wanted);
                index.map_or(String::new(), |index| (index + 1).to_string())
            };
            let (vt, vn) = (one_based(vt, form.texcoords), one_based(vn, form.normals));
            let _ = write!(self.obj.text, " {}/{vt}/{vn}", one_based(v, true));
        }
        self.obj.text.push('\n');
        Ok(())
    }

    fn begin_run(&mut self, form: Form, line: &Line) {
        let material = self.obj.materials.len().checked_sub(1);
        let last = self.obj.runs.last();
        if last.is_some_and(|run| run.form == form && run.material == material) {
            return;
        }
        let _ = writeln!(self.obj.text, "g {}", self.obj.runs.len());
        self.obj.runs.push(FaceGroup {
            material,
            form,
            line: line.number(),
        });
    }

    fn corner(&self, word: &str, line: &Line) -> Result<Corner> {
        let counts = [
            ("vertices", self.positions.len()),
            ("texture coordinates", self.texcoord_count),
            ("normals", self.normal_is_zero.len()),
        ];
        let parts: Vec<&str> = word.split('/').collect();
        if parts.len() > 3 || parts[0].is_empty() {
            return Err(line.error(
                format!("has the corner \"{word}\""),
                "write v, v/vt, v//vn or v/vt/vn",
            ));
        }
        let mut corner = [None; 3];
        for ((part, index), (what, count)) in parts.iter().zip(&mut corner).zip(counts) {
            if !part.is_empty() {
                *index = Some(zero_based(part, count).ok_or_else(|| {
                    line.error(
                        format!("refers to {part}, but there are {count} {what} above it"),
                        "indices begin at 1, or at -1 for the last one",
                    )
                })?);
            }
        }
        Ok(corner)
    }
}

fn named(line: &Line) -> Result<Named> {
    Ok(Named {
        name: line.name()?.to_owned(),
        line: line.number(),
    })
}

/// OBJ indices begin at 1; negative ones count back from the last element so far.
fn zero_based(word: &str, count: usize) -> Option<usize> {
    let index: i64 = word.parse().ok()?;
    let from_start = match index {
        1.. => index - 1,
        0 => return None,
        _ => index.checked_add_unsigned(count as u64)?,
    };
    usize::try_from(from_start).ok().filter(|&i| i < count)
}

/// The corner from which a fan of triangles fills the polygon without folding over; `None` if none was found.
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
    // A triangle without area does not fold; rounding may give it either sign.
    let folded = -1e-9 * area.length_squared();
    // All fans are tried for polygons of up to a thousand corners. With a million corners, trying all would take hours.
    let mut triangles_left = MOST_TRIANGLES.max(MOST_TRIANGLES_PER_CORNER * n);
    (0..n).find(|&apex| {
        fan(apex).all(|triangle| {
            triangles_left = triangles_left.saturating_sub(1);
            triangles_left > 0 && triangle.dot(area) >= folded
        })
    })
}
