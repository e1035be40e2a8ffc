//! The surfaces of a scene that emit, as one light.

use std::borrow::Cow;
use std::f64::consts::PI;

use glam::DVec3;

use super::{Bands, Filter, Lamp, Light, Profile, Scene, Shared, Texture, TextureLookup, Wrap};
use crate::lattice;

/// Points that are drawn for each that is kept, where textures vary the emission.
const CANDIDATES: u32 = 4;
/// Levels of the subdivision of a triangle: the finest parts are as fine as f32 coordinates.
const LEVELS: u32 = 24;

/// The triangles that emit, in world space.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EmissiveSurfaces {
    triangles: Vec<EmissiveTriangle>,
}

/// A side of a triangle that emits.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EmissiveTriangle {
    /// Counterclockwise, as seen from the side that emits.
    pub corners_m: [DVec3; 3],
    /// W/(sr·m²), without the texture.
    pub radiance: Bands,
    pub texture: Option<TriangleTexture>,
    /// Where it is cut out: the alpha texture, and the cutoff.
    pub alpha: Option<(TriangleTexture, f64)>,
}

/// A texture on a triangle.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TriangleTexture {
    texture: Shared<Texture>,
    lookup: TextureLookup,
    /// Of the corners, in the texture's coordinates.
    texcoords: [[f64; 2]; 3],
}

/// A point of the surfaces, which stands for all of them. It emits with the cosine to its normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct EmissionPoint {
    pub position_m: DVec3,
    pub normal: DVec3,
    /// W/(sr·m²)
    pub radiance: Bands,
    /// Density of such points per area, normalised to one point, 1/m². It is in proportion to the radiance, all bands together.
    pub density_per_m2: f64,
}

impl Scene {
    /// The scene with its emissive surfaces as one more light, which is not modulated, if final gathering finds its light. The scene must be
    /// validated.
    pub(crate) fn with_emissive_light(&self) -> Cow<'_, Scene> {
        let is_there = self.lights.iter().any(|light| light.surfaces().is_some());
        let is_gathered = self
            .indirect
            .is_some_and(|indirect| indirect.gather().is_some());
        if is_there || !is_gathered || !self.has_emission() {
            return Cow::Borrowed(self);
        }
        let surfaces = EmissiveSurfaces::of(self);
        if surfaces.triangles.is_empty() {
            return Cow::Borrowed(self);
        }
        let mut lit = self.clone();
        if let Some(tof) = &mut lit.tof {
            tof.ambient_lights.push(lit.lights.len());
        }
        lit.lights.push(surfaces.into_light().into());
        Cow::Owned(lit)
    }
}

impl EmissiveSurfaces {
    fn of(scene: &Scene) -> EmissiveSurfaces {
        let mut triangles = Vec::new();
        for instance in &scene.meshes {
            if !scene.has_material(&instance.mesh, |material| material.is_emissive()) {
                continue;
            }
            let mesh = instance.placed();
            let corners_m = mesh.corners_m().zip(&mesh.triangles);
            for ((corners_m, corners), &material) in corners_m.zip(&mesh.triangle_materials) {
                let material = &scene.materials[material as usize];
                if !material.is_emissive() || area_m2(corners_m) == 0.0 {
                    continue;
                }
                let texture_of = |lookup: Option<TextureLookup>| {
                    let lookup = lookup.filter(|lookup| mesh.shows(lookup))?;
                    Some(TriangleTexture {
                        texture: scene.textures[lookup.texture].clone(),
                        lookup,
                        texcoords: corners.map(|corner| mesh.texcoord(&lookup, corner)),
                    })
                };
                let alpha = texture_of(material.alpha_texture);
                let front = EmissiveTriangle {
                    corners_m,
                    radiance: material.emission_w_sr_m2,
                    texture: texture_of(material.emission_texture),
                    alpha: alpha.map(|alpha| (alpha, material.alpha_cutoff)),
                };
                if !material.is_one_sided {
                    triangles.push(front.turned());
                }
                triangles.push(front);
            }
        }
        EmissiveSurfaces { triangles }
    }

    /// Its power is that without textures.
    fn into_light(self) -> Light {
        let mut power_w = [0.0; 3];
        let (mut position_m, mut weight) = (DVec3::ZERO, 0.0);
        for triangle in &self.triangles {
            let area_m2 = area_m2(triangle.corners_m);
            for (power_w, radiance) in power_w.iter_mut().zip(triangle.radiance) {
                *power_w += PI * area_m2 * radiance;
            }
            let [a, b, c] = triangle.corners_m;
            position_m += triangle.weight() * (a + b + c) / 3.0;
            weight += triangle.weight();
        }
        Light::Lamp(Lamp {
            position_m: position_m / weight,
            direction: DVec3::Z,
            up: DVec3::Y,
            profile: Profile::Uniform,
            area: None,
            power_w,
            surfaces: Some(self.into()),
        })
    }

    /// Points drawn in proportion to what they emit, all bands together. Neighbours in the list are neighbours on the surfaces, so any
    /// even choice of them covers the surfaces evenly. Another seed gives other points.
    pub fn points(&self, count: u32, seed: u32) -> Vec<EmissionPoint> {
        let is_even = |t: &EmissiveTriangle| t.texture.is_none() && t.alpha.is_none();
        if self.triangles.iter().all(is_even) {
            return self.drawn_by_power(count, seed);
        }
        // Each weighs as much as its texel is bright.
        let candidates = self.drawn_by_power(CANDIDATES * count, seed);
        let brightness = |point: &EmissionPoint| point.radiance.iter().sum::<f64>();
        let weight = |point: &EmissionPoint| brightness(point) / point.density_per_m2;
        let total: f64 = candidates.iter().map(weight).sum();
        let mean = total / candidates.len() as f64;
        let [start, _] = lattice::scrambled(0, !seed);
        let (mut index, mut end) = (0, candidates.first().map_or(0.0, weight));
        let kept = (0..count).map(|i| {
            let at = (f64::from(i) + start) / f64::from(count) * total;
            while end < at && index + 1 < candidates.len() {
                index += 1;
                end += weight(&candidates[index]);
            }
            let candidate = candidates[index];
            EmissionPoint {
                density_per_m2: match mean {
                    0.0 => 0.0,
                    mean => brightness(&candidate) / mean,
                },
                ..candidate
            }
        });
        kept.collect()
    }

    /// Points drawn in proportion to what they would emit without textures.
    fn drawn_by_power(&self, count: u32, seed: u32) -> Vec<EmissionPoint> {
        let total: f64 = self.triangles.iter().map(EmissiveTriangle::weight).sum();
        let (mut index, mut begin) = (0, 0.0);
        let points = (0..count).map(|i| {
            let [jitter, _] = lattice::scrambled(i, seed);
            let at = (f64::from(i) + jitter) / f64::from(count) * total;
            // The last triangle takes what rounding leaves.
            while at >= begin + self.triangles[index].weight() && index + 1 < self.triangles.len() {
                begin += self.triangles[index].weight();
                index += 1;
            }
            let triangle = &self.triangles[index];
            let share = ((at - begin) / triangle.weight()).clamp(0.0, 1.0);
            triangle.point(on_triangle(share), total)
        });
        points.collect()
    }
}

impl EmissiveTriangle {
    fn turned(&self) -> EmissiveTriangle {
        let mut turned = self.clone();
        turned.corners_m.swap(1, 2);
        let alpha = turned.alpha.as_mut().map(|(alpha, _)| alpha);
        for texture in turned.texture.as_mut().into_iter().chain(alpha) {
            texture.texcoords.swap(1, 2);
        }
        turned
    }

    /// Radiance times area, all bands together.
    fn weight(&self) -> f64 {
        area_m2(self.corners_m) * self.radiance.iter().sum::<f64>()
    }

    fn normal(&self) -> DVec3 {
        let [a, b, c] = self.corners_m;
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// A point with barycentric coordinates, among points with a density in proportion to the radiance without textures. `total`: the sum
    /// of all weights.
    fn point(&self, weights: [f64; 3], total: f64) -> EmissionPoint {
        let texture = self.texture.as_ref();
        let is_hole = |(alpha, cutoff): &(TriangleTexture, f64)| alpha.at(weights)[0] < *cutoff;
        let texel = match self.alpha.as_ref().is_some_and(is_hole) {
            true => [0.0; 3],
            false => texture.map_or([1.0; 3], |texture| texture.at(weights)),
        };
        let [a, b, c] = self.corners_m;
        EmissionPoint {
            position_m: weights[0] * a + weights[1] * b + weights[2] * c,
            normal: self.normal(),
            radiance: std::array::from_fn(|band| self.radiance[band] * texel[band]),
            density_per_m2: self.radiance.iter().sum::<f64>() / total,
        }
    }
}

impl TriangleTexture {
    /// As `shaders/shared/texels.wgsl` looks it up.
    fn at(&self, weights: [f64; 3]) -> Bands {
        let along = |axis: usize| {
            let texcoords = self.texcoords.iter().zip(weights);
            let sum: f64 = texcoords
                .map(|(texcoord, weight)| weight * texcoord[axis])
                .sum();
            sum
        };
        // Rows count from the top.
        let down = [along(0), 1.0 - along(1)];
        let of_axis = |axis: usize| {
            let TextureLookup { wrap, filter, .. } = self.lookup;
            texels_at(down[axis], self.texture.size_px[axis], wrap[axis], filter)
        };
        let (columns, right) = of_axis(0);
        let (rows, below) = of_axis(1);
        let width = self.texture.size_px[0] as usize;
        let texel = |column: usize, row: usize| {
            let texel = self.texture.texels.reflectance(row * width + column);
            DVec3::from(texel.map(f64::from))
        };
        let row = |row: usize| texel(columns[0], row).lerp(texel(columns[1], row), right);
        row(rows[0]).lerp(row(rows[1]), below).to_array()
    }
}

/// The two texels around a place along an axis, and the share of the second.
fn texels_at(at: f64, size: u32, wrap: Wrap, filter: Filter) -> ([usize; 2], f64) {
    let count = f64::from(size);
    let folded = match wrap {
        Wrap::Repeat => at.rem_euclid(1.0),
        Wrap::Mirror => 1.0 - (at.rem_euclid(2.0) - 1.0).abs(),
        Wrap::Clamp => at.clamp(0.0, 1.0),
    };
    let last = size as usize - 1;
    if filter == Filter::Nearest {
        return ([((folded * count) as usize).min(last); 2], 0.0);
    }
    let between = folded * count - 0.5;
    let before = between.floor();
    let wrapped = |index: f64| match wrap {
        Wrap::Repeat => index.rem_euclid(count) as usize,
        _ => (index.max(0.0) as usize).min(last),
    };
    ([wrapped(before), wrapped(before + 1.0)], between - before)
}

/// Barycentric coordinates of a point for each number from 0 to 1, such that even numbers give even points: each digit in base 4 chooses
/// a quarter of the triangle (Basu & Owen, "Low discrepancy constructions in the triangle", 2015).
fn on_triangle(share: f64) -> [f64; 3] {
    let mut digits = (share * 2_f64.powi(2 * LEVELS as i32)) as u64;
    digits = digits.min((1 << (2 * LEVELS)) - 1);
    let mut corners = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]];
    let middle = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
    for level in (0..LEVELS).rev() {
        let [a, b, c] = corners;
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        corners = match digits >> (2 * level) & 3 {
            0 => [bc, ca, ab],
            1 => [a, ab, ca],
            2 => [ab, b, bc],
            _ => [ca, bc, c],
        };
    }
    let [x, y] = middle(middle(corners[0], corners[1]), corners[2]);
    [x, y, 1.0 - x - y]
}

fn area_m2([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_numbers_give_even_points_of_a_triangle() {
        const COUNT: usize = 4096;
        let points = (0..COUNT).map(|i| on_triangle((i as f64 + 0.5) / COUNT as f64));
        let mut mean = [0.0; 3];
        let mut square = 0.0;
        for point in points {
            assert!(point.iter().all(|&weight| weight >= 0.0));
            for (mean, weight) in mean.iter_mut().zip(point) {
                *mean += weight / COUNT as f64;
            }
            square += point[0] * point[1] / COUNT as f64;
        }
        assert!(
            mean.iter().all(|mean| (mean - 1.0 / 3.0).abs() < 1e-3),
            "{mean:?}"
        );
        // ∫ xy over the triangle, over its area.
        assert!((square - 1.0 / 12.0).abs() < 1e-3, "{square}");
    }
}
