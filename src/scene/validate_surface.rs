//! The part of [`Scene::validate`] that concerns materials, textures and meshes.

use super::validate::{Check, ScenePart, has_direction, is_near};
use super::{Material, Mesh, Scene, Texture};

pub(super) fn check(scene: &Scene) -> Check {
    for (i, texture) in scene.textures.iter().enumerate() {
        check_texture(ScenePart::Texture(i), texture)?;
    }
    for (i, material) in scene.materials.iter().enumerate() {
        check_material(ScenePart::Material(i), material, scene.textures.len())?;
    }
    for (i, mesh) in scene.meshes.iter().enumerate() {
        check_mesh(ScenePart::Mesh(i), mesh, scene.materials.len())?;
    }
    Ok(())
}

pub(super) fn check_texture(part: ScenePart, texture: &Texture) -> Check {
    let [width, height] = texture.size_px;
    let texels = texture.linear_rgb.len();
    part.require(
        width > 0 && height > 0 && u64::from(width) * u64::from(height) == texels as u64,
        || format!("size_px is {width} x {height}, but there are {texels} texels"),
        "give width x height texels, at least one",
    )?;
    part.require_each(
        &texture.linear_rgb,
        |texel| texel.iter().all(|value| (0.0..=1.0).contains(value)),
        |index, texel| format!("texel {index} is {texel:?}"),
        "give reflectances from 0 to 1",
    )
}

/// The largest Phong exponent: beyond, a lobe is narrower than f32 directions.
const SHARPEST: f64 = 1e9;
/// Beyond, f32 has no digits left to tell texels apart.
const FARTHEST_TEXCOORD: f64 = 1e6;

pub(super) fn check_material(part: ScenePart, material: &Material, texture_count: usize) -> Check {
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

pub(super) fn check_mesh(part: ScenePart, mesh: &Mesh, material_count: usize) -> Check {
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
    part.require_each(
        &mesh.texcoords,
        |uv| uv.iter().all(|t| t.abs() <= FARTHEST_TEXCOORD),
        |vertex, uv| format!("texture coordinate of vertex {vertex} is {uv:?}"),
        "give texture coordinates within -1e6 and 1e6",
    )?;
    part.require_each(
        &mesh.triangles,
        |triangle| triangle.iter().all(|&v| (v as usize) < vertex_count),
        |index, triangle| format!("triangle {index} has vertices {triangle:?} of {vertex_count}"),
        "give indices of vertices, counted from 0",
    )?;
    let triangle_count = mesh.triangles.len();
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
    part.require_each(
        materials,
        |&material| (material as usize) < material_count,
        |index, material| format!("triangle {index} has material {material} of {material_count}"),
        "give the index of a material, counted from 0",
    )
}
