//! The surface at a ray's hit.

use glam::{DVec2, DVec3};

use super::{brdf::Brdf, rays::Hit};
use crate::scene::{Mesh, Scene, Texture};

/// Rounding error of a hit's position. γ(7) · Σ|weight · corner| of three coordinates within 1 (pbrt, "Managing rounding error") is
/// 1.4e-15. That of the triangle's plane is the same size.
const POSITION_ROUNDING: f64 = 8e-15;

/// Sine of 1°. P is sure to be moved off another surface within its rounding if the view ray meets that surface at this angle or more.
const LEAST_SINE: f64 = 0.017;
/// Limit of the move of P: 10⁻⁸ of the scene's size.
const MOST_STEPS: f64 = 1e6;

/// The triangles of a scene in local space, and their sources.
#[derive(Debug)]
pub struct Surfaces {
    /// All meshes are in world space. Used for materials, normals and textures.
    pub scene: Scene,
    pub triangles: Vec<[DVec3; 3]>,
    /// Mesh, and triangle in the mesh.
    sources: Vec<[u32; 2]>,
}

/// A point on a triangle, seen from one side.
#[derive(Debug, Clone, Copy)]
pub struct Surface {
    pub position: DVec3,
    /// Unit normals on the visible side: the triangle's, and the interpolated one if the mesh has normals.
    pub geometric_normal: DVec3,
    pub normal: DVec3,
    pub triangle: u32,
    pub brdf: Brdf,
}

impl Surface {
    /// Start of a ray to that side, lifted off the surface by the rounding error that may have sunk it.
    pub fn start(&self) -> DVec3 {
        self.position + POSITION_ROUNDING * self.geometric_normal
    }

    /// The surface moved slightly towards a viewer at this distance. The way there is free, whereas rounding may put P itself behind
    /// another surface, as in the corner of two walls. Light computed there is the limit that the viewer sees.
    ///
    /// Across the ray, P is off by δ, the rounding of corners as seen from the ray's start. Along the ray, that is δ/sin α for a surface
    /// at the angle α to it. The step counts this three times: for P's own surface, for another surface, and for a margin off that one
    /// larger than the rounding of points on it.
    pub fn towards(self, to_viewer: DVec3, distance: f64) -> Surface {
        let off_own = 1.0 / self.geometric_normal.dot(to_viewer);
        let steps = (off_own + 2.0 / LEAST_SINE).min(MOST_STEPS);
        let step = POSITION_ROUNDING * (1.0 + distance) * steps;
        Surface {
            position: self.position + step.min(0.5 * distance) * to_viewer,
            ..self
        }
    }
}

impl Surfaces {
    pub fn new(scene: &Scene, to_local: impl Fn(DVec3) -> DVec3) -> Surfaces {
        let scene = scene.flattened();
        let mut triangles = Vec::new();
        let mut sources = Vec::new();
        for (mesh_index, mesh) in scene.meshes.iter().enumerate() {
            for (index, triangle) in mesh.triangles.iter().enumerate() {
                let corners = triangle.map(|corner| to_local(mesh.positions_m[corner as usize]));
                let [a, b, c] = corners;
                if (b - a).cross(c - a).try_normalize().is_none() {
                    // Without area there is no light and no normal.
                    continue;
                }
                triangles.push(corners);
                sources.push([mesh_index as u32, index as u32]);
            }
        }
        Surfaces {
            scene,
            triangles,
            sources,
        }
    }

    /// Indices into the scene's meshes and materials.
    pub fn mesh_and_material(&self, triangle: u32) -> [u32; 2] {
        let [mesh, index] = self.sources[triangle as usize];
        let materials = &self.scene.meshes[mesh as usize].triangle_materials;
        [mesh, materials[index as usize]]
    }

    /// Whether the triangle's material is present at the hit, and not cut out.
    pub fn is_at(&self, hit: &Hit) -> bool {
        let [mesh, index] = self.sources[hit.triangle as usize].map(|index| index as usize);
        let mesh = &self.scene.meshes[mesh];
        let material = &self.scene.materials[mesh.triangle_materials[index] as usize];
        let Some(texture) = material
            .alpha_texture
            .filter(|_| !mesh.texcoords.is_empty())
        else {
            return true;
        };
        let uvs = mesh.triangles[index].map(|corner| DVec2::from(mesh.texcoords[corner as usize]));
        let uv: DVec2 = (0..3).map(|i| hit.weights[i] * uvs[i]).sum();
        sample_bilinear(&self.scene.textures[texture.texture], uv.to_array()).x >= 0.5
    }

    /// The surface at a hit of a ray in this direction.
    pub fn at(&self, hit: &Hit, direction: DVec3) -> Surface {
        let scene = &self.scene;
        let [a, b, c] = self.triangles[hit.triangle as usize];
        let [wa, wb, wc] = hit.weights;
        let outward = (b - a).cross(c - a).normalize();
        let geometric_normal = turned_to(outward, -direction);

        let [mesh, index] = self.sources[hit.triangle as usize];
        let mesh = &scene.meshes[mesh as usize];
        let corners = mesh.triangles[index as usize].map(|corner| corner as usize);
        let normal = interpolated_normal(mesh, corners, hit.weights);
        let material = &scene.materials[mesh.triangle_materials[index as usize] as usize];
        let mut kd = DVec3::from(material.kd);
        let mut normal = turned_to(normal.unwrap_or(geometric_normal), geometric_normal);
        if !mesh.texcoords.is_empty() {
            let uvs = corners.map(|corner| DVec2::from(mesh.texcoords[corner]));
            let uv: DVec2 = (0..3).map(|i| hit.weights[i] * uvs[i]).sum();
            if let Some(texture) = material.kd_texture {
                kd *= sample_bilinear(&scene.textures[texture.texture], uv.to_array());
            }
            if let Some(texture) = material.normal_texture {
                let map =
                    2.0 * sample_bilinear(&scene.textures[texture.texture], uv.to_array()) - 1.0;
                let side = outward.dot(geometric_normal).signum();
                let mapped = mapped_normal(map, [a, b, c], uvs, side * normal);
                let mapped = mapped.map(|mapped| side * mapped);
                // Ignore a normal that is turned away from the viewer.
                normal = mapped
                    .filter(|n| n.dot(geometric_normal) > 0.01)
                    .unwrap_or(normal);
            }
        }
        Surface {
            position: wa * a + wb * b + wc * c,
            geometric_normal,
            normal,
            triangle: hit.triangle,
            brdf: Brdf::new(material, kd),
        }
    }
}

fn turned_to(normal: DVec3, side: DVec3) -> DVec3 {
    if normal.dot(side) < 0.0 {
        -normal
    } else {
        normal
    }
}

/// Applies a normal map's value, from −1 to 1, to the normal on a triangle's front. The gradients of u and v in the triangle's plane give
/// the tangents. `None` if the texture coordinates span no area.
fn mapped_normal(
    map: DVec3,
    [a, b, c]: [DVec3; 3],
    uvs: [DVec2; 3],
    front: DVec3,
) -> Option<DVec3> {
    let (uv1, uv2) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    // P = a + u'·p_u + v'·p_v with (u', v') from the first corner: two equations for each of p_u, p_v.
    let area = uv1.perp_dot(uv2);
    if area == 0.0 {
        return None;
    }
    let p_u = ((b - a) * uv2.y - (c - a) * uv1.y) / area;
    let tangent = (p_u - front * front.dot(p_u)).try_normalize()?;
    // Right-handed unless the map is mirrored on the surface.
    let bitangent = front.cross(tangent) * area.signum();
    let turned = map.x * tangent + map.y * bitangent + map.z.max(0.0) * front;
    turned.try_normalize()
}

/// `None` for a flat mesh, and if normals cancel.
fn interpolated_normal(mesh: &Mesh, corners: [usize; 3], weights: [f64; 3]) -> Option<DVec3> {
    if mesh.normals.is_empty() {
        return None;
    }
    let blend: DVec3 = (0..3)
        .map(|i| weights[i] * mesh.normals[corners[i]].normalize())
        .sum();
    (blend.length() > 1e-6).then(|| blend.normalize())
}

/// Repeats, with v up and texel centres at half texels.
fn sample_bilinear(texture: &Texture, [u, v]: [f64; 2]) -> DVec3 {
    let [width, height] = texture.size_px.map(|size| size as usize);
    let place = |coordinate: f64, size: usize| {
        let texels = coordinate.rem_euclid(1.0) * size as f64 - 0.5;
        let low = texels.floor();
        let index = low.rem_euclid(size as f64) as usize % size;
        (index, (index + 1) % size, texels - low)
    };
    let (left, right, x) = place(u, width);
    let (top, bottom, y) = place(1.0 - v, height);
    let texel = |column: usize, row: usize| {
        DVec3::from(
            texture
                .texels
                .reflectance(row * width + column)
                .map(f64::from),
        )
    };
    let [above, below] = [top, bottom].map(|row| texel(left, row).lerp(texel(right, row), x));
    above.lerp(below, y)
}
