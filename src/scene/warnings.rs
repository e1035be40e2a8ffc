//! Warnings about scenes that can be rendered but are probably not intended.

use glam::DVec3;

use super::{Bands, Material, Scene};

/// Distance relative to the radius of the scene. A light nearer to a surface than this counts as in the surface: rounding then decides
/// which side it lights, if any.
const IN_SURFACE: f64 = 1e-6;

impl Scene {
    /// Lists what can be rendered but is probably not intended, one sentence each: materials that reflect more than they receive, textures
    /// that cannot be seen, lights without power or in a surface, meshes without a surface, features of files that are not modelled. Valid
    /// for a validated scene only. [`Frame::warnings`](crate::output::Frame::warnings) has the warnings that need a finished frame.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.left_out.clone();
        for material in &self.materials {
            let kd = self.brightest_kd(material);
            if (0..3).any(|band| kd[band] + material.ks[band] > 1.0) {
                warnings.push(format!(
                    "material \"{}\" reflects more than it receives: kd + ks is above 1; lower kd {:?} or ks {:?}",
                    material.name, material.kd, material.ks
                ));
            }
        }
        if let Some(tof) = &self.tof
            && !self.lights.is_empty()
            && (0..self.lights.len()).all(|light| !tof.is_modulated(light))
        {
            warnings.push("no light is modulated, so time of flight has no range".into());
        }
        if self.meshes.is_empty() {
            warnings.push("there is no mesh, so every frame is black".into());
        }
        for mesh in &self.meshes {
            let materials = mesh.triangle_materials.iter();
            let mut materials = materials.map(|&material| &self.materials[material as usize]);
            if mesh.texcoords.is_empty()
                && let Some(material) = materials.find(|m| m.has_texture())
            {
                warnings.push(format!(
                    "the texture of material \"{}\" cannot be seen on mesh \"{}\", which has no texture coordinates",
                    material.name, mesh.name
                ));
            }
            if mesh.triangles.is_empty() {
                warnings.push(format!(
                    "mesh \"{}\" has no triangles, so nothing of it is seen",
                    mesh.name
                ));
            } else if mesh.corners_m().all(has_no_area) {
                warnings.push(format!(
                    "no triangle of mesh \"{}\" has an area, so nothing of it is seen",
                    mesh.name
                ));
            }
        }
        let sphere = self.bounding_sphere();
        let tolerance_m = sphere.map_or(0.0, |sphere| IN_SURFACE * sphere.radius_m);
        for (i, light) in self.lights.iter().enumerate() {
            let kind = light.kind();
            if light.emission() == [0.0; 3] {
                warnings.push(format!("light {i} ({kind}) emits nothing"));
            }
            let Some(position_m) = light.position_m() else {
                continue;
            };
            let is_at_light = |corners| is_in_triangle(position_m, corners, tolerance_m);
            if let Some(mesh) = self.meshes.iter().find(|m| m.corners_m().any(is_at_light)) {
                warnings.push(format!(
                    "light {i} ({kind}) is in a surface of mesh \"{}\", which may block all of its light; move it off the surface",
                    mesh.name
                ));
            }
        }
        warnings
    }

    /// k_d per band at the brightest texel.
    fn brightest_kd(&self, material: &Material) -> Bands {
        let Some(texture) = material.kd_texture else {
            return material.kd;
        };
        let texels = self.textures[texture.texture].texels.reflectances();
        let brightest = texels.fold([0.0_f32; 3], |most, texel| {
            std::array::from_fn(|band| most[band].max(texel[band]))
        });
        std::array::from_fn(|band| material.kd[band] * f64::from(brightest[band]))
    }
}

/// Whether a triangle is a line or a point, within f64 rounding.
fn has_no_area([a, b, c]: [DVec3; 3]) -> bool {
    let longest_m2 = (b - a).length_squared().max((c - a).length_squared());
    (b - a).cross(c - a).length() <= 1e-12 * longest_m2
}

fn is_in_triangle(point_m: DVec3, [a, b, c]: [DVec3; 3], tolerance_m: f64) -> bool {
    let Some(normal) = (b - a).cross(c - a).try_normalize() else {
        return false;
    };
    let is_inside = |from: DVec3, to: DVec3| {
        let inwards = normal.cross(to - from).normalize_or_zero();
        (point_m - from).dot(inwards) >= -tolerance_m
    };
    (point_m - a).dot(normal).abs() <= tolerance_m
        && is_inside(a, b)
        && is_inside(b, c)
        && is_inside(c, a)
}
