//! The surface at a ray's hit.

use glam::{DVec2, DVec3, Vec4};

use super::{brdf::Brdf, placed::placed, rays::Hit, texture::Place};
use crate::scene::{Instance, Material, Scene};

/// Rounding error of a hit's position. γ(7) · Σ|weight · corner| of three coordinates within 1 (pbrt, "Managing rounding error") is
/// 1.4e-15. That of the triangle's plane is the same size.
const POSITION_ROUNDING: f64 = 8e-15;

/// A texel that equals the cutoff is not below it, although texels are f32.
const ALPHA_ROUNDING: f64 = 1e-7;

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
    /// Radiance that it emits, W/(sr·m²).
    pub emission: DVec3,
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
        let mut scene = scene.clone();
        for instance in &mut scene.meshes {
            *instance = Instance::from(placed(instance));
        }
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

    /// The point of its mesh, and the material there.
    fn place(&self, hit: &Hit) -> (Place<'_>, &Material) {
        let scene = &self.scene;
        let [mesh, index] = self.sources[hit.triangle as usize].map(|index| index as usize);
        let mesh = &scene.meshes[mesh];
        let place = Place {
            scene,
            mesh,
            corners: mesh.triangles[index].map(|corner| corner as usize),
            weights: hit.weights,
        };
        let material = mesh.triangle_materials[index];
        (place, &scene.materials[material as usize])
    }

    /// Whether the triangle's material is present at the hit, and not cut out.
    pub fn is_at(&self, hit: &Hit) -> bool {
        let (place, material) = self.place(hit);
        let alpha = place.value(material.alpha_texture);
        alpha.is_none_or(|alpha| alpha.x >= material.alpha_cutoff - ALPHA_ROUNDING)
    }

    /// The radiance that the surface emits at a hit.
    pub fn emission(&self, hit: &Hit) -> DVec3 {
        let (place, material) = self.place(hit);
        emission(&place, material)
    }

    /// Whether a camera that looks in this direction sees the surface at the hit, and not its back, which it looks through.
    pub fn is_seen(&self, hit: &Hit, direction: DVec3) -> bool {
        let (_, material) = self.place(hit);
        let [a, b, c] = self.triangles[hit.triangle as usize];
        !material.is_one_sided || (b - a).cross(c - a).dot(direction) <= 0.0
    }

    /// The surface at a hit of a ray in this direction.
    pub fn at(&self, hit: &Hit, direction: DVec3) -> Surface {
        let corners = self.triangles[hit.triangle as usize];
        let [a, b, c] = corners;
        let [wa, wb, wc] = hit.weights;
        let outward = (b - a).cross(c - a).normalize();
        let geometric_normal = turned_to(outward, -direction);
        let (place, material) = self.place(hit);
        let front = interpolated_normal(&place).unwrap_or(outward);
        let normal = turned_to(front, geometric_normal);
        let mapped = mapped_normal(&place, material, corners, front)
            .map(|mapped| if normal == front { mapped } else { -mapped })
            // Ignore a normal that is turned away from the viewer.
            .filter(|mapped| mapped.dot(geometric_normal) > 0.01);
        Surface {
            position: wa * a + wb * b + wc * c,
            geometric_normal,
            normal: mapped.unwrap_or(normal),
            triangle: hit.triangle,
            brdf: Brdf::at(&place, material),
            emission: match material.is_one_sided && outward.dot(direction) > 0.0 {
                true => DVec3::ZERO,
                false => emission(&place, material),
            },
        }
    }
}

fn emission(place: &Place, material: &Material) -> DVec3 {
    let texel = place.value(material.emission_texture);
    DVec3::from(material.emission_w_sr_m2) * texel.unwrap_or(DVec3::ONE)
}

fn turned_to(normal: DVec3, side: DVec3) -> DVec3 {
    if normal.dot(side) < 0.0 {
        -normal
    } else {
        normal
    }
}

/// The normal on the front that the material's normal map gives, where its value from −1 to 1 is along u, v and the front's own normal.
fn mapped_normal(
    place: &Place,
    material: &Material,
    corners: [DVec3; 3],
    front: DVec3,
) -> Option<DVec3> {
    let texcoords = place.texcoords(material.normal_texture)?;
    let map = 2.0 * place.value(material.normal_texture)? - 1.0;
    let [along_u, along_v] =
        given_axes(place, front).or_else(|| axes(corners, texcoords, front))?;
    let turned = map.x * along_u + map.y * along_v + map.z.max(0.0) * front;
    turned.try_normalize()
}

/// The map's axes where the mesh gives tangents.
fn given_axes(place: &Place, front: DVec3) -> Option<[DVec3; 2]> {
    let tangents = &place.mesh.tangents;
    if tangents.is_empty() {
        return None;
    }
    let tangent = |vertex: usize| {
        let tangent = Vec4::from(tangents[vertex]).as_dvec4();
        let sign = tangent.w;
        tangent.truncate().normalize_or_zero().extend(sign)
    };
    let blend = place.blend(tangent);
    let along_u = blend.truncate().reject_from(front).try_normalize()?;
    let sign = if blend.w < 0.0 { -1.0 } else { 1.0 };
    Some([along_u, sign * front.cross(along_u)])
}

/// The map's axes as its coordinates at the corners give them, perpendicular to the front's normal. `None` if they span no area.
fn axes([a, b, c]: [DVec3; 3], texcoords: [DVec2; 3], front: DVec3) -> Option<[DVec3; 2]> {
    let (uv1, uv2) = (texcoords[1] - texcoords[0], texcoords[2] - texcoords[0]);
    // P = a + u'·p_u + v'·p_v with (u', v') from the first corner: two equations for each of p_u, p_v.
    let area = uv1.perp_dot(uv2);
    if area == 0.0 {
        return None;
    }
    let p_u = ((b - a) * uv2.y - (c - a) * uv1.y) / area;
    let p_v = ((c - a) * uv1.x - (b - a) * uv2.x) / area;
    let along_u = p_u.reject_from(front).try_normalize()?;
    let across = front.cross(along_u);
    Some([along_u, turned_to(across, p_v)])
}

/// `None` for a flat mesh, and if normals cancel.
fn interpolated_normal(place: &Place) -> Option<DVec3> {
    let normals = &place.mesh.normals;
    if normals.is_empty() {
        return None;
    }
    let blend = place.blend(|vertex| normals[vertex].normalize());
    (blend.length() > 1e-6).then(|| blend.normalize())
}
