//! Triangles with cut-outs, for rays that the host traces: the same as `is_hole` of `shaders/shared/triangle_hit.wgsl`.

use crate::{
    geometry::{Geometry, PlacedMesh},
    scene::{Filter, Material, Mesh, Scene, Shared, Texture, TextureLookup, Wrap},
};

/// The triangles with cut-outs, in the order of their numbers.
pub(crate) struct Cutouts {
    triangles: Vec<Cutout>,
    textures: Vec<Shared<Texture>>,
}

struct Cutout {
    texcoords: [[f32; 2]; 3],
    lookup: TextureLookup,
    cutoff: f32,
}

/// The alpha texture of each triangle of a mesh. A mesh without texture coordinates has no cut-outs.
pub(crate) fn alpha_textures<'s>(
    scene: &'s Scene,
    mesh: &'s Mesh,
) -> impl Iterator<Item = Option<TextureLookup>> + 's {
    let materials = mesh.triangle_materials.iter();
    let alpha = |&material: &u32| scene.materials[material as usize].alpha_texture;
    materials.map(move |material| alpha(material).filter(|lookup| mesh.shows(lookup)))
}

/// The cutoff of a material's alpha for rays and rasteriser. Texels that equal the cutoff stay, whatever f32 rounds.
pub(crate) fn alpha_cutoff(material: &Material) -> f32 {
    const ROUNDING: f64 = 3e-7;
    (material.alpha_cutoff - ROUNDING) as f32
}

impl Cutouts {
    pub fn of(scene: &Scene, geometry: &Geometry) -> Cutouts {
        let mut triangles = Vec::new();
        for PlacedMesh { mesh, .. } in &geometry.placed {
            let of_mesh = mesh.triangles.iter().zip(&mesh.triangle_materials);
            for ((corners, &material), lookup) in of_mesh.zip(alpha_textures(scene, mesh)) {
                triangles.extend(lookup.map(|lookup| Cutout {
                    texcoords:
                        corners.map(|corner| mesh.texcoord(&lookup, corner).map(|c| c as f32)),
                    lookup,
                    cutoff: alpha_cutoff(&scene.materials[material as usize]),
                }));
            }
        }
        Cutouts {
            triangles,
            textures: scene.textures.clone(),
        }
    }

    /// Whether a triangle, given by 1 + its index among those with cut-outs, has a hole at barycentric coordinates that are given up to a
    /// factor.
    pub fn is_hole(&self, number: u32, weights: [f32; 3]) -> bool {
        let Some(cutout) = self.triangles.get((number as usize).wrapping_sub(1)) else {
            return false;
        };
        let sum: f32 = weights[0] + weights[1] + weights[2];
        let along = |axis: usize| {
            let [a, b, c] = cutout.texcoords.map(|texcoord| texcoord[axis]);
            (weights[0] * a + weights[1] * b + weights[2] * c) / sum
        };
        let texture = &self.textures[cutout.lookup.texture];
        // Rows count from the top.
        let down = [along(0), 1.0 - along(1)];
        let [(column, right), (row, below)] = [0, 1].map(|axis| {
            let size = texture.size_px[axis];
            place(
                down[axis],
                size as f32,
                cutout.lookup.wrap[axis],
                cutout.lookup.filter,
            )
        });
        let alpha = |column: usize, row: usize| {
            let [width, height] = texture.size_px.map(|size| size as usize);
            let [alpha, ..] = texture
                .texels
                .reflectance(row % height * width + column % width);
            (255.0 * alpha).round() / 255.0
        };
        let mix = |a: f32, b: f32, share: f32| a * (1.0 - share) + b * share;
        let above = mix(alpha(column, row), alpha(column + 1, row), right);
        let under = mix(alpha(column, row + 1), alpha(column + 1, row + 1), right);
        mix(above, under, below) < cutout.cutoff
    }
}

/// The texel before a place along an axis, and how far the place is from its centre: as `texel_corner` of `shaders/shared/texels.wgsl`.
fn place(at: f32, size: f32, wrap: Wrap, filter: Filter) -> (usize, f32) {
    let fract = |x: f32| x - x.floor();
    let folded = match wrap {
        Wrap::Repeat => fract(at),
        Wrap::Mirror => 1.0 - (2.0 * fract(0.5 * at) - 1.0).abs(),
        Wrap::Clamp => at.clamp(0.0, 1.0),
    };
    let between = folded * size - 0.5;
    let place = match (filter, wrap) {
        (Filter::Nearest, _) => (folded * size).floor().min(size - 1.0),
        (_, Wrap::Repeat) => between,
        _ => between.clamp(0.0, size - 1.0),
    };
    let corner = place.floor();
    // The texel before the first one is the last one.
    let texel = (corner + size) as usize % size as usize;
    (texel, place - corner)
}
