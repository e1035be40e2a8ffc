//! What the textures and the vertices of a mesh give at a point.

use glam::{DAffine2, DMat2, DVec2, DVec3};

use crate::scene::{Filter, Mesh, Scene, Texture, TextureLookup, Wrap};

/// A point on a triangle of a mesh.
pub struct Place<'s> {
    pub scene: &'s Scene,
    pub mesh: &'s Mesh,
    /// Vertices of the triangle.
    pub corners: [usize; 3],
    /// Barycentric coordinates.
    pub weights: [f64; 3],
}

impl Place<'_> {
    /// The weighted sum of the corners' values.
    pub fn blend<T>(&self, value: impl Fn(usize) -> T) -> T
    where
        T: std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>,
    {
        let [a, b, c] = self.corners.map(value);
        let [wa, wb, wc] = self.weights;
        a * wa + b * wb + c * wc
    }

    /// Where the texture has the corners. `None` without a texture, and if the mesh lacks its coordinates.
    pub fn texcoords(&self, lookup: Option<TextureLookup>) -> Option<[DVec2; 3]> {
        let lookup = lookup?;
        let texcoords = match lookup.texcoord_set {
            0 => &self.mesh.texcoords,
            _ => &self.mesh.texcoords_1,
        };
        if texcoords.is_empty() {
            return None;
        }
        let [[uu, uv, u], [vu, vv, v]] = lookup.transform;
        let linear = DMat2::from_cols_array(&[uu, vu, uv, vv]);
        let transform = DAffine2::from_mat2_translation(linear, DVec2::new(u, v));
        let place = |vertex: usize| transform.transform_point2(texcoords[vertex].into());
        Some(self.corners.map(place))
    }

    /// The texture's value here. `None` as in [`Place::texcoords`].
    pub fn value(&self, lookup: Option<TextureLookup>) -> Option<DVec3> {
        let texcoords = self.texcoords(lookup)?;
        let lookup = lookup?;
        let at: DVec2 = (0..3).map(|i| self.weights[i] * texcoords[i]).sum();
        let texture = &self.scene.textures[lookup.texture];
        let size = texture.size_px.map(f64::from);
        // In texels, from the upper left corner of the image. v points up.
        let (x, y) = (at.x * size[0], (1.0 - at.y) * size[1]);
        Some(match lookup.filter {
            Filter::Nearest => texel(texture, lookup.wrap, [x.floor(), y.floor()]),
            Filter::Bilinear => bilinear(texture, lookup.wrap, [x - 0.5, y - 0.5]),
        })
    }
}

/// The mean of the four texels around a point, by distance. Texel centres are at whole numbers.
fn bilinear(texture: &Texture, wrap: [Wrap; 2], [x, y]: [f64; 2]) -> DVec3 {
    let (left, top) = (x.floor(), y.floor());
    let row = |row: f64| {
        let [near, far] = [left, left + 1.0].map(|column| texel(texture, wrap, [column, row]));
        near.lerp(far, x - left)
    };
    row(top).lerp(row(top + 1.0), y - top)
}

/// The texel in a column and a row, which may be beyond the edges.
fn texel(texture: &Texture, wrap: [Wrap; 2], place: [f64; 2]) -> DVec3 {
    let [column, row] = [0, 1].map(|axis| {
        let size = i64::from(texture.size_px[axis]);
        wrapped(wrap[axis], place[axis] as i64, size) as usize
    });
    let texel = row * texture.size_px[0] as usize + column;
    DVec3::from(texture.texels.reflectance(texel).map(f64::from))
}

/// The index within the edges, 0 to size − 1, that stands for one beyond them.
fn wrapped(wrap: Wrap, index: i64, size: i64) -> i64 {
    match wrap {
        Wrap::Repeat => index.rem_euclid(size),
        Wrap::Clamp => index.clamp(0, size - 1),
        Wrap::Mirror => {
            // A pair of tiles, the second of which is mirrored.
            let in_pair = index.rem_euclid(2 * size);
            in_pair.min(2 * size - 1 - in_pair)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_beyond_the_edges_are_those_of_vulkan() {
        let around = |wrap| [-4, -3, -2, -1, 0, 1, 2, 3, 4, 5].map(|i| wrapped(wrap, i, 3));
        assert_eq!(around(Wrap::Repeat), [2, 0, 1, 2, 0, 1, 2, 0, 1, 2]);
        assert_eq!(around(Wrap::Clamp), [0, 0, 0, 0, 0, 1, 2, 2, 2, 2]);
        assert_eq!(around(Wrap::Mirror), [2, 2, 1, 0, 0, 1, 2, 2, 1, 0]);
    }
}
