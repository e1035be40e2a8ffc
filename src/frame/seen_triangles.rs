//! The layers of the triangles that pixels show: which ones, and the texture coordinates there.

use super::BufferPool;
use crate::{
    geometry::Geometry,
    output::{Layer, LayerData, per_pixel},
    passes::surface::draw_order,
    scene::Mesh,
};

/// Whether layers need the image of triangles.
pub(crate) fn shows_triangles(wanted: Option<&[Layer]>) -> bool {
    [Layer::TriangleId, Layer::Texcoord]
        .into_iter()
        .any(|layer| layer.is_among(wanted))
}

/// How the device numbers a scene's triangles: mesh after mesh.
pub(super) struct Numbering<'g> {
    meshes: Vec<NumberedMesh<'g>>,
}

struct NumberedMesh<'g> {
    first: usize,
    mesh: &'g Mesh,
    /// The rasteriser draws the triangles of a mesh of several materials in another order.
    order: Option<Vec<usize>>,
}

impl<'g> Numbering<'g> {
    pub fn new(geometry: &'g Geometry, is_by_rays: bool) -> Numbering<'g> {
        let mut first = 0;
        let meshes = geometry.meshes().map(|mesh| {
            let is_sorted = is_by_rays || mesh.triangle_materials.is_sorted();
            let numbered = NumberedMesh {
                first,
                mesh,
                order: (!is_sorted).then(|| draw_order(mesh)),
            };
            first += mesh.triangles.len();
            numbered
        });
        Numbering {
            meshes: meshes.collect(),
        }
    }

    /// The mesh of a triangle, and its index there.
    fn located(&self, number: usize) -> Option<(&Mesh, usize)> {
        let after = self.meshes.partition_point(|mesh| mesh.first <= number);
        let found = self.meshes.get(after.checked_sub(1)?)?;
        let index = number - found.first;
        let index = match &found.order {
            Some(order) => *order.get(index)?,
            None => index,
        };
        Some((found.mesh, index))
    }

    /// The wanted layers from the image of triangles: 1 + number of the triangle, and barycentric coordinates of corners 1 and 2.
    pub fn layers(
        &self,
        pixels: &[[f32; 4]],
        is_wanted: &dyn Fn(Layer) -> bool,
        pool: &mut BufferPool,
    ) -> Vec<(Layer, LayerData)> {
        let located = |[number, ..]: [f32; 4]| self.located((number as usize).checked_sub(1)?);
        let mut layers = Vec::new();
        if is_wanted(Layer::TriangleId) {
            let mut ids = pool.ids(pixels.len());
            per_pixel(&mut ids, |i| {
                let index = located(pixels[i]).map(|(_, index)| index as u32);
                [index.map_or(0, |index| 1 + index)]
            });
            layers.push((Layer::TriangleId, LayerData::Id(ids)));
        }
        if is_wanted(Layer::Texcoord) {
            let mut texcoords = pool.floats(2 * pixels.len());
            per_pixel(&mut texcoords, |i| {
                let texcoord = located(pixels[i]).and_then(|(mesh, index)| {
                    let [_, b1, b2, _] = pixels[i].map(f64::from);
                    texcoord_at(mesh, index, [1.0 - b1 - b2, b1, b2])
                });
                texcoord.unwrap_or_default().map(|value| value as f32)
            });
            layers.push((Layer::Texcoord, LayerData::Float(texcoords)));
        }
        layers
    }
}

/// Interpolated texture coordinates; `None` for a mesh without.
fn texcoord_at(mesh: &Mesh, triangle: usize, barycentric: [f64; 3]) -> Option<[f64; 2]> {
    let mut sum = [0.0; 2];
    for (&corner, weight) in mesh.triangles.get(triangle)?.iter().zip(barycentric) {
        let texcoord = mesh.texcoords.get(corner as usize)?;
        sum = [0, 1].map(|i| sum[i] + weight * texcoord[i]);
    }
    Some(sum)
}
