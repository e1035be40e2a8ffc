//! Warnings about scenes that can be rendered but are probably not intended.

use glam::DVec3;

use super::{Bands, Material, Scene, TextureLookup, TextureRole, named};

/// Distance relative to the radius of the scene. A light nearer to a surface than this counts as in the surface: rounding then decides
/// which side it lights, if any.
const IN_SURFACE: f64 = 1e-6;

impl Scene {
    /// Lists what can be rendered but is probably not intended, one sentence each: materials that reflect more than they receive, textures
    /// that cannot be seen, lights without power or in a surface, meshes without a surface, features of files that are not modelled. Valid
    /// for a validated scene only. [`Frame::warnings`](crate::output::Frame::warnings) has the warnings that need a finished frame.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.left_out.clone();
        let colors = self.brightest_colors();
        let material_name = |index: usize| named("material", index, &self.materials[index].name);
        let mesh_name = |index: usize| named("mesh", index, &self.meshes[index].name);
        let materials = self.materials.iter().zip(&colors).enumerate();
        let mut too_bright = materials.filter(|(_, (material, color))| {
            let kd = self.brightest(material.kd, material.kd_texture);
            let ks = self.brightest(material.ks, material.ks_texture);
            (0..3).any(|band| kd[band] * color[band] + ks[band] > 1.0)
        });
        if let Some((index, (material, _))) = too_bright.next() {
            let others = match too_bright.count() {
                0 => String::new(),
                others => format!("; so do {others} other materials"),
            };
            warnings.push(format!(
                "{} reflects more than it receives: kd + ks is above 1; lower kd {:?} or ks {:?}{others}",
                material_name(index),
                material.kd,
                material.ks
            ));
        }
        warnings.extend((0..self.materials.len()).find_map(|index| self.doubtful_normals(index)));
        for (index, material) in self.materials.iter().enumerate() {
            for (role, _) in material.textures() {
                let (name, factor) = match role {
                    TextureRole::Kd => ("kd", material.kd),
                    TextureRole::Ks => ("ks", material.ks),
                    TextureRole::Emission => ("emission_w_sr_m2", material.emission_w_sr_m2),
                    _ => continue,
                };
                if factor == [0.0; 3] {
                    warnings.push(format!(
                        "the {} of {} multiplies {name}, which is 0, so it cannot be seen; set {name} to 1",
                        role.field(),
                        material_name(index)
                    ));
                }
            }
        }
        if let Some(map) = &self.vignetting_map {
            let resolution_px = self.camera.resolution_px;
            let lens = self.camera.intrinsics_px();
            let [column, row] = [0, 1].map(|axis| {
                let centre_px = [lens.cx, lens.cy][axis].max(0.0) as u32;
                centre_px.min(resolution_px[axis] - 1)
            });
            let on_axis = map.at([column, row], resolution_px);
            if !(0.5..=2.0).contains(&on_axis) {
                warnings.push(format!(
                    "the vignetting map is {on_axis:.3} at the principal point, where 1 is expected; divide the image of the flat field by its value there"
                ));
            }
        }
        let unseen = self.camera.unseen_border();
        if unseen > 0.0 {
            warnings.push(format!(
                "the image circle of the fisheye lens ends inside the image: {:.0} % of the image's border are outside it, and black; if the lens shows more, check its coefficients and focal lengths",
                100.0 * unseen
            ));
        }
        if let Some(tof) = &self.tof
            && !self.lights.is_empty()
            && (0..self.lights.len()).all(|light| !tof.is_modulated(light))
        {
            warnings.push("no light is modulated, so time of flight has no range".into());
        }
        let is_gathered = self
            .indirect
            .is_some_and(|indirect| indirect.gather().is_some());
        if self.has_emission() && !is_gathered {
            warnings.push(
                "surfaces that emit light are seen, but light nothing: that takes the estimator final-gather".into(),
            );
        }
        if self.lights.is_empty() && !self.has_emission() {
            warnings.push("there is no light, so every frame is black".into());
        }
        if self.meshes.is_empty() {
            warnings.push("there is no mesh, so every frame is black".into());
        }
        // The field of a texture that each material looks up by each set of coordinates.
        let of_sets = [0, 1].map(|set| {
            let of_material = |material: &Material| {
                let mut textures = material.textures();
                let found = textures.find(|(_, lookup)| lookup.texcoord_set == set);
                found.map(|(role, _)| role.field())
            };
            let names = self.materials.iter().map(of_material);
            names.collect::<Vec<Option<&str>>>()
        });
        for (index, mesh) in self.meshes.iter().enumerate() {
            for (set, texcoords) in [&mesh.texcoords, &mesh.texcoords_1].into_iter().enumerate() {
                // Most scenes have no such texture, so their triangles need not be checked.
                if !texcoords.is_empty() || of_sets[set].iter().all(Option::is_none) {
                    continue;
                }
                let mut materials = mesh.triangle_materials.iter();
                let hidden = materials.find_map(|&material| {
                    let name = of_sets[set][material as usize]?;
                    Some((name, material_name(material as usize)))
                });
                match hidden {
                    Some((_, material)) if set == 0 => warnings.push(format!(
                        "the texture of {material} cannot be seen on {}, which has no texture coordinates",
                        mesh_name(index)
                    )),
                    Some((name, material)) => warnings.push(format!(
                        "the {name} of {material} cannot be seen on {}, which has no second set of texture coordinates",
                        mesh_name(index)
                    )),
                    None => {}
                }
            }
            if mesh.triangles.is_empty() {
                warnings.push(format!(
                    "{} has no triangles, so nothing of it is seen",
                    mesh_name(index)
                ));
            } else if mesh.corners_m().all(has_no_area) {
                warnings.push(format!(
                    "no triangle of {} has an area, so nothing of it is seen",
                    mesh_name(index)
                ));
            }
        }
        let sphere = self.bounding_sphere();
        let tolerance_m = sphere.map_or(0.0, |sphere| IN_SURFACE * sphere.radius_m);
        for (i, light) in self.in_world().lights.iter().enumerate() {
            let kind = light.kind();
            if light.emission() == [0.0; 3] {
                warnings.push(format!("light {i} ({kind}) emits nothing"));
            }
            let Some(position_m) = light.position_m() else {
                continue;
            };
            let is_at_light = |corners| is_in_triangle(position_m, corners, tolerance_m);
            let mut meshes = self.meshes.iter();
            if let Some(mesh) = meshes.position(|m| m.corners_m().any(is_at_light)) {
                warnings.push(format!(
                    "light {i} ({kind}) is in a surface of {}, which may block all of its light; move it off the surface",
                    mesh_name(mesh)
                ));
            }
        }
        warnings
    }

    /// Warns of a map whose normals mostly point along the surface: a grey image, or one with blue first.
    fn doubtful_normals(&self, index: usize) -> Option<String> {
        let material = &self.materials[index];
        let lookup = material.normal_texture?;
        let texels = &self.textures[lookup.texture].texels;
        let along = texels.reflectances().filter(|[.., blue]| *blue < 0.6);
        (2 * along.count() > texels.len()).then(|| {
            format!(
                "most normals of the normal_texture of {} point along the surface, since blue is below 0.6; red, green and blue from 0 to 1 are the components from -1 to 1, blue that along the surface's normal (OpenCV has blue first, and a grey image holds heights)",
                named("material", index, &material.name)
            )
        })
    }

    /// A reflectance per band at the brightest texel.
    fn brightest(&self, reflectance: Bands, lookup: Option<TextureLookup>) -> Bands {
        let Some(lookup) = lookup else {
            return reflectance;
        };
        let texels = self.textures[lookup.texture].texels.reflectances();
        let brightest = texels.fold([0.0_f32; 3], |most, texel| {
            std::array::from_fn(|band| most[band].max(texel[band]))
        });
        std::array::from_fn(|band| reflectance[band] * f64::from(brightest[band]))
    }

    /// For each material, the largest value per band among the colours of the vertices that have it.
    fn brightest_colors(&self) -> Vec<Bands> {
        let white = [1.0; 3];
        if self.meshes.iter().all(|mesh| mesh.colors.is_empty()) {
            return vec![white; self.materials.len()];
        }
        let mut brightest = vec![None; self.materials.len()];
        for mesh in self.distinct_meshes() {
            for (corners, &material) in mesh.triangles.iter().zip(&mesh.triangle_materials) {
                let most: &mut Bands = brightest[material as usize].get_or_insert([0.0; 3]);
                if mesh.colors.is_empty() {
                    *most = white;
                    continue;
                }
                for &corner in corners {
                    for (most, color) in most.iter_mut().zip(mesh.colors[corner as usize]) {
                        *most = most.max(color.into());
                    }
                }
            }
        }
        let brightest = brightest.into_iter();
        brightest.map(|most| most.unwrap_or(white)).collect()
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
