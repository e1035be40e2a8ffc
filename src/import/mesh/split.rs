//! From polygons to triangles.

use std::ops::Range;

use earcut::Earcut;
use earcut::utils3d::project3d_to_2d;
use glam::DVec3;

/// Earcut takes time quadratic in the number of corners: up to 4 s for these.
const MOST_CORNERS: usize = 1 << 16;

/// Splits polygons into triangles, and keeps its memory from one to the next.
#[derive(Default)]
pub(super) struct Splitter {
    earcut: Option<Earcut<f64>>,
    outline: Vec<DVec3>,
    outline_2d: Vec<[f64; 2]>,
    triangles: Vec<u32>,
}

impl Splitter {
    /// Calls `add` with the corners of each triangle, which turn as the polygon's do.
    ///
    /// # Errors
    /// Returns what is wrong with a polygon that would take too long.
    pub fn split(
        &mut self,
        corners: Range<usize>,
        position: impl Fn(usize) -> DVec3,
        mut add: impl FnMut([usize; 3]),
    ) -> Result<(), String> {
        let first = corners.start;
        let count = corners.len();
        if count == 3 {
            add([first, first + 1, first + 2]);
            return Ok(());
        }
        self.outline.clear();
        self.outline.extend(corners.map(position));
        if let Some(apex) = fan_apex(&self.outline) {
            let corner = |step: usize| first + (apex + step) % count;
            (1..count - 1).for_each(|step| add([corner(0), corner(step), corner(step + 1)]));
            return Ok(());
        }
        if count > MOST_CORNERS {
            return Err(format!(
                "a face has {count} corners and is not convex, which is possible for up to {MOST_CORNERS}"
            ));
        }
        // Relative to a corner: far from the origin products would lose their digits.
        let origin = self.outline[0];
        let outline: Vec<[f64; 3]> = self
            .outline
            .iter()
            .map(|corner| (corner - origin).to_array())
            .collect();
        self.triangles.clear();
        if project3d_to_2d(&outline, count, &mut self.outline_2d) {
            let earcut = self.earcut.get_or_insert_with(Earcut::new);
            let outline = self.outline_2d.iter().copied();
            earcut.earcut(outline, &[], &mut self.triangles);
        }
        let area = vector_area(&self.outline);
        for triangle in self.triangles.as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|corner| corner as usize);
            let [pa, pb, pc] = [a, b, c].map(|corner| self.outline[corner]);
            let turns_alike = (pb - pa).cross(pc - pa).dot(area) >= 0.0;
            let [b, c] = if turns_alike { [b, c] } else { [c, b] };
            add([first + a, first + b, first + c]);
        }
        Ok(())
    }
}

/// Twice the vector area of a polygon (Newell): the sum over any fan of triangles.
pub(super) fn vector_area(outline: &[DVec3]) -> DVec3 {
    let first = outline[0];
    let pairs = outline[1..].windows(2);
    pairs
        .map(|pair| (pair[0] - first).cross(pair[1] - first))
        .sum()
}

/// One of the first corners from which a fan of triangles fills the polygon without folding over. For a quadrilateral there is always one.
fn fan_apex(outline: &[DVec3]) -> Option<usize> {
    const MOST_TRIED: usize = 4;
    let count = outline.len();
    let area = vector_area(outline);
    // A triangle without area does not fold; rounding may give it either sign.
    let folded = -1e-9 * area.length_squared();
    let is_unfolded = |apex: usize| {
        (1..count - 1).all(|step| {
            let [a, b, c] = [0, step, step + 1].map(|step| outline[(apex + step) % count]);
            (b - a).cross(c - a).dot(area) >= folded
        })
    };
    (0..count.min(MOST_TRIED)).find(|&apex| is_unfolded(apex))
}
