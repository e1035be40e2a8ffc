//! The part of [`Scene::validate`](super::Scene::validate) for materials, textures and meshes.

use super::validate::{Part, STRONGEST, has_direction, is_near};
use super::{BoundingBox, Instance, Material, Mesh, Reflectance, Texels, Texture, TextureRole};
use crate::Result;

/// The largest texture coordinate. Beyond it, f32 cannot tell texels apart.
const FARTHEST_TEXCOORD: f64 = 1e6;

impl Texture {
    pub(crate) fn validate(&self, index: usize) -> Result<()> {
        self.validate_as(&Part(format!("texture {index} (\"{}\")", self.name)))
    }

    pub(super) fn validate_as(&self, part: &Part) -> Result<()> {
        let [width, height] = self.size_px;
        let texels = self.texels.len();
        part.require(
            width > 0 && height > 0 && u64::from(width) * u64::from(height) == texels as u64,
            format_args!("size_px is {width} x {height}, but there are {texels} texels"),
            "give width x height texels, at least one",
        )?;
        let Texels::F32(texels) = &self.texels else {
            return Ok(());
        };
        part.require_each(
            texels,
            |texel| texel.iter().all(|value| (0.0..=1.0).contains(value)),
            |index, texel| format!("texel {index} is {texel:?}"),
            "give reflectances from 0 to 1",
        )
    }
}

impl Material {
    pub(crate) fn validate(&self, index: usize, texture_count: usize) -> Result<()> {
        let part = Part(format!("material {index} (\"{}\")", self.name));
        for Reflectance {
            name,
            values,
            most,
            hint,
        } in self.reflectance()
        {
            let is_fine = values.iter().all(|value| (0.0..=most).contains(value));
            match values {
                [value] => part.require(is_fine, format_args!("{name} is {value}"), hint)?,
                _ => part.require(is_fine, format_args!("{name} is {values:?}"), hint)?,
            }
        }
        if let Some(microfacets) = &self.microfacets {
            microfacets.validate(&part)?;
            part.require(
                self.ks == [0.0; 3],
                "has microfacets and ks",
                "give one of them: ks and shininess describe a Phong lobe",
            )?;
        }
        let emission = self.emission_w_sr_m2;
        part.require(
            emission
                .iter()
                .all(|value| (0.0..=STRONGEST).contains(value)),
            format_args!("emission_w_sr_m2 is {emission:?}"),
            "give radiances from 0 to 1e24",
        )?;
        part.require(
            (0.0..=1.0).contains(&self.alpha_cutoff),
            format_args!("alpha_cutoff is {}", self.alpha_cutoff),
            "give a value from 0 to 1",
        )?;
        for (role, lookup) in self.textures() {
            let (name, index) = (role.field(), lookup.texture);
            part.require(
                index < texture_count,
                format_args!("{name} is {index}, but the number of textures is {texture_count}"),
                "give the index of a texture, counted from 0",
            )?;
            part.require(
                lookup.texcoord_set <= 1,
                format_args!("{name} has the texcoord_set {}", lookup.texcoord_set),
                "give 0 or 1",
            )?;
            let is_fine = |value: &f64| value.abs() <= FARTHEST_TEXCOORD;
            part.require(
                lookup.transform.as_flattened().iter().all(is_fine),
                format_args!("{name} has the transform {:?}", lookup.transform),
                "give numbers within -1e6 and 1e6",
            )?;
        }
        Ok(())
    }

    /// Refuses textures whose encoding contradicts their role, as `contradicts` finds for a role and the index of a texture.
    ///
    /// # Errors
    /// Returns an error that names the field of this material, whose index is `index`.
    pub fn validate_encodings(
        &self,
        index: usize,
        contradicts: impl Fn(TextureRole, usize) -> bool,
    ) -> Result<()> {
        let part = Part(format!("material {index} (\"{}\")", self.name));
        let mut textures = self.textures();
        let wrong = textures.find(|(role, lookup)| contradicts(*role, lookup.texture));
        let Some((role, _)) = wrong else {
            return Ok(());
        };
        part.require(
            false,
            format_args!(
                "the texture of {} is encoded as sRGB, but its values are linear in this role",
                role.field()
            ),
            "make its encoding linear",
        )
    }
}

impl Mesh {
    pub(crate) fn validate(&self, index: usize, material_count: usize) -> Result<()> {
        let part = Part(format!("mesh {index} (\"{}\")", self.name));
        let vertex_count = self.positions_m.len();
        if let Some(i) = self.positions_m.iter().position(|&p| !is_near(p)) {
            part.require_position(format_args!("vertex {i}"), self.positions_m[i])?;
        }
        for (what, count) in [
            ("normals", self.normals.len()),
            ("texcoords", self.texcoords.len()),
            ("texcoords_1", self.texcoords_1.len()),
            ("colors", self.colors.len()),
            ("tangents", self.tangents.len()),
        ] {
            part.require(
                count == 0 || count == vertex_count,
                format_args!("{count} {what} for {vertex_count} vertices"),
                "give one per vertex, or none",
            )?;
        }
        if let Some(i) = self.normals.iter().position(|&n| !has_direction(n)) {
            part.require_direction(format_args!("normal of vertex {i}"), self.normals[i])?;
        }
        for texcoords in [&self.texcoords, &self.texcoords_1] {
            part.require_each(
                texcoords,
                |uv| uv.iter().all(|t| t.abs() <= FARTHEST_TEXCOORD),
                |vertex, uv| format!("texture coordinate of vertex {vertex} is {uv:?}"),
                "give texture coordinates within -1e6 and 1e6",
            )?;
        }
        part.require_each(
            &self.colors,
            |color| color.iter().all(|value| (0.0..=1.0).contains(value)),
            |vertex, color| format!("colour of vertex {vertex} is {color:?}"),
            "give values from 0 to 1",
        )?;
        part.require_each(
            &self.tangents,
            |tangent| tangent.iter().all(|value| value.abs() <= 2.0),
            |vertex, tangent| format!("tangent of vertex {vertex} is {tangent:?}"),
            "give a unit vector, and 1 or -1",
        )?;
        part.require_each(
            &self.triangles,
            |triangle| triangle.iter().all(|&v| (v as usize) < vertex_count),
            |i, triangle| format!("triangle {i} has vertices {triangle:?} of {vertex_count}"),
            "give indices of vertices, counted from 0",
        )?;
        let (materials, triangles) = (self.triangle_materials.len(), self.triangles.len());
        part.require(
            materials == triangles,
            format_args!("{materials} triangle_materials for {triangles} triangles"),
            "give one per triangle",
        )?;
        part.require_each(
            &self.triangle_materials,
            |&material| (material as usize) < material_count,
            |i, material| format!("triangle {i} has material {material} of {material_count}"),
            "give the index of a material, counted from 0",
        )
    }
}

impl Instance {
    /// Validates an instance of a valid mesh. `bounds` is the mesh's box in its own space.
    pub(crate) fn validate(&self, index: usize, bounds: Option<BoundingBox>) -> Result<()> {
        if self.is_in_world_space() {
            return Ok(());
        }
        let part = Part(format!("instance {index}"));
        part.require_position("position", self.to_world.translation)?;
        let linear = self.to_world.matrix3;
        part.require(
            linear.is_finite(),
            format_args!("to_world is {linear}"),
            "give finite numbers",
        )?;
        let corners_m = bounds.iter().flat_map(BoundingBox::corners_m);
        let mut placed_m = corners_m.map(|corner_m| self.to_world.transform_point3(corner_m));
        placed_m.try_for_each(|corner_m| part.require_position("a corner of its box", corner_m))
    }
}
