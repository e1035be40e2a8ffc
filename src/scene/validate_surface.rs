//! The part of [`Scene::validate`] that concerns materials, textures and meshes, and the warnings.

use super::validate::{Check, Part, has_direction, is_near};
use super::{Bands, Material, Mesh, Scene, Texture};

impl Scene {
    /// What can be rendered but is probably not meant, one sentence each: materials that reflect more than they receive,
    /// textures that cannot be seen, lights without power. Meaningful for a validated scene only.
    pub fn warnings(&self) -> Vec<String> {
        let materials = self.materials.iter();
        let too_bright = materials
            .filter(|material| {
                let kd = self.brightest_kd(material);
                (0..3).any(|band| kd[band] + material.ks[band] > 1.0)
            })
            .map(|material| {
                format!(
                    "material \"{}\" reflects more than it receives: kd + ks is above 1; lower kd {:?} or ks {:?}",
                    material.name, material.kd, material.ks
                )
            });
        let unseen = self.meshes.iter().filter_map(|mesh| {
            let material = self.textured_material(mesh)?;
            mesh.texcoords.is_empty().then(|| {
                format!(
                    "the texture of material \"{}\" cannot be seen on mesh \"{}\", which has no texture coordinates",
                    material.name, mesh.name
                )
            })
        });
        let lights = self.lights.iter().enumerate();
        let dark = lights
            .filter(|(_, light)| light.emission() == [0.0; 3])
            .map(|(i, light)| format!("light {i} ({}) emits nothing", light.kind()));
        too_bright.chain(unseen).chain(dark).collect()
    }

    /// k_d per band at the brightest texel.
    fn brightest_kd(&self, material: &Material) -> Bands {
        let Some(texture) = material.kd_texture else {
            return material.kd;
        };
        let texels = self.textures[texture].linear_rgb.iter();
        let brightest = texels.fold([0.0_f32; 3], |most, texel| {
            std::array::from_fn(|band| most[band].max(texel[band]))
        });
        std::array::from_fn(|band| material.kd[band] * f64::from(brightest[band]))
    }

    fn textured_material(&self, mesh: &Mesh) -> Option<&Material> {
        let materials = mesh.triangle_materials.iter();
        materials
            .map(|&material| &self.materials[material as usize])
            .find(|material| material.kd_texture.is_some())
    }
}

pub(super) fn check(scene: &Scene) -> Check {
    for (i, texture) in scene.textures.iter().enumerate() {
        check_texture(Part::Texture(i), texture)?;
    }
    for (i, material) in scene.materials.iter().enumerate() {
        check_material(Part::Material(i), material, scene.textures.len())?;
    }
    for (i, mesh) in scene.meshes.iter().enumerate() {
        check_mesh(Part::Mesh(i), mesh, scene.materials.len())?;
    }
    Ok(())
}

pub(super) fn check_texture(part: Part, texture: &Texture) -> Check {
    let [width, height] = texture.size_px;
    let texels = texture.linear_rgb.len();
    part.require(
        width > 0 && height > 0 && u64::from(width) * u64::from(height) == texels as u64,
        || format!("size_px is {width} x {height}, but there are {texels} texels"),
        "give width x height texels, at least one",
    )?;
    let wrong = texture.linear_rgb.iter().position(|&texel| {
        let is_reflectance = texel.iter().all(|value| (0.0..=1.0).contains(value));
        !is_reflectance
    });
    part.require(
        wrong.is_none(),
        || {
            let texel = wrong.unwrap_or_default();
            format!("texel {texel} is {:?}", texture.linear_rgb[texel])
        },
        "give reflectances from 0 to 1",
    )
}

/// The largest Phong exponent: beyond, a lobe is narrower than f32 directions.
const SHARPEST: f64 = 1e9;
/// Beyond, f32 has no digits left to tell texels apart.
const FARTHEST_TEXCOORD: f64 = 1e6;

pub(super) fn check_material(part: Part, material: &Material, texture_count: usize) -> Check {
    for (what, bands) in [("kd", material.kd), ("ks", material.ks)] {
        part.require(
            bands.iter().all(|value| (0.0..=1.0).contains(value)),
            || format!("{what} is {bands:?}"),
            "give reflectances from 0 to 1",
        )?;
    }
    let shininess = material.shininess;
    part.require(
        (0.0..=SHARPEST).contains(&shininess),
        || format!("shininess is {shininess}"),
        "give a Phong exponent of 0 or more, up to 1e9",
    )?;
    let index = material.kd_texture.unwrap_or_default();
    part.require(
        material.kd_texture.is_none() || index < texture_count,
        || format!("kd_texture is {index}, but the number of textures is {texture_count}"),
        "give the index of a texture, counted from 0",
    )
}

pub(super) fn check_mesh(part: Part, mesh: &Mesh, material_count: usize) -> Check {
    let vertex_count = mesh.positions_m.len();
    if let Some(vertex) = mesh.positions_m.iter().position(|&p| !is_near(p)) {
        part.require_position(&format!("vertex {vertex}"), mesh.positions_m[vertex])?;
    }
    for (what, count) in [
        ("normals", mesh.normals.len()),
        ("texcoords", mesh.texcoords.len()),
    ] {
        part.require(
            count == 0 || count == vertex_count,
            || format!("{count} {what} for {vertex_count} vertices"),
            "give one per vertex, or none",
        )?;
    }
    if let Some(vertex) = mesh.normals.iter().position(|&n| !has_direction(n)) {
        part.require_direction(&format!("normal of vertex {vertex}"), mesh.normals[vertex])?;
    }
    let wrong = mesh
        .texcoords
        .iter()
        .position(|uv| !uv.iter().all(|t| t.abs() <= FARTHEST_TEXCOORD));
    part.require(
        wrong.is_none(),
        || {
            let vertex = wrong.unwrap_or_default();
            format!(
                "texture coordinate of vertex {vertex} is {:?}",
                mesh.texcoords[vertex]
            )
        },
        "give texture coordinates within -1e6 and 1e6",
    )?;

    let triangle_count = mesh.triangles.len();
    let outside = |triangle: &[u32; 3]| triangle.iter().any(|&v| v as usize >= vertex_count);
    let wrong = mesh.triangles.iter().position(outside);
    part.require(
        wrong.is_none(),
        || {
            let triangle = wrong.unwrap_or_default();
            format!(
                "triangle {triangle} has vertices {:?} of {vertex_count}",
                mesh.triangles[triangle]
            )
        },
        "give indices of vertices, counted from 0",
    )?;
    let materials = &mesh.triangle_materials;
    part.require(
        materials.len() == triangle_count,
        || {
            format!(
                "{} triangle_materials for {triangle_count} triangles",
                materials.len()
            )
        },
        "give one per triangle",
    )?;
    let wrong = materials.iter().position(|&m| m as usize >= material_count);
    part.require(
        wrong.is_none(),
        || {
            let triangle = wrong.unwrap_or_default();
            format!(
                "triangle {triangle} has material {} of {material_count}",
                materials[triangle]
            )
        },
        "give the index of a material, counted from 0",
    )
}
