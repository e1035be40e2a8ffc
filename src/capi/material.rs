//! Materials.

use std::ffi::c_char;

use super::*;
use crate::{
    Error,
    scene::{Material, MetallicRoughness, TextureLookup, TextureSource},
};

/// Reflectance and emission of a surface: modified Phong, f = kd/pi + ks (s+2)/(2 pi) max(0, r.v)^s; or, with a roughness, metallic-roughness as in glTF
/// 2.0. Initialise with CAMLUX_MATERIAL_INIT: black, without texture, and no light.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_material {
    /// Set by CAMLUX_MATERIAL_INIT.
    pub struct_size: u32,
    /// The number of a texture, from camlux_scene_add_texture, that multiplies kd; 0: none.
    pub kd_texture: u32,
    /// Diffuse reflectance of the bands R, G, B, 0 to 1. With a roughness, the base colour.
    pub kd: [f64; 3],
    /// Specular reflectance of the bands R, G, B, 0 to 1.
    pub ks: [f64; 3],
    /// Phong exponent s, 0 to 1e9. Below 0: not given, which is allowed if ks is 0.
    pub shininess: f64,
    /// Name for messages, UTF-8, copied; NULL: none.
    pub name: *const c_char,
    /// The number of a normal texture; 0: none. R, G, B from 0 to 1 stand for components from -1 to 1: along the direction in which u grows,
    /// across it on the side to which v grows, and along the mesh's own normal.
    pub normal_texture: u32,
    /// The number of an alpha texture; 0: none. The surface is cut out, on both sides, where alpha is below alpha_cutoff, or the brightness of
    /// a texture without alpha.
    pub alpha_texture: u32,
    /// The number of a texture that multiplies ks; 0: none.
    pub ks_texture: u32,
    /// The number of a texture whose brightness multiplies the shininess; 0: none.
    pub shininess_texture: u32,
    /// See alpha_texture; 0 to 1.
    pub alpha_cutoff: f64,
    /// Roughness of a metallic-roughness surface, 0.03 to 1; the alpha of its microfacets (GGX) is the square. 0: modified Phong.
    pub roughness: f64,
    /// Share of a metallic-roughness surface that is metal, 0 to 1.
    pub metallic: f64,
    /// Index of refraction of a metallic-roughness surface where it is no metal, 1 to 10.
    pub ior: f64,
    /// Factor of what a metallic-roughness surface reflects straight on where it is no metal, 0 to 1.
    pub specular: f64,
    /// The number of a texture whose green value multiplies the roughness and whose blue value multiplies metallic; 0: none.
    pub metallic_roughness_texture: u32,
    /// 0.
    pub reserved: u32,
    /// Radiance of the bands R, G, B that the surface emits in every direction, W/(sr m^2), from both sides, or from the front of a
    /// one-sided one. 0: it is no light.
    pub emission_w_sr_m2: [f64; 3],
    /// The number of a texture that multiplies emission_w_sr_m2; 0: none.
    pub emission_texture: u32,
    /// 1: the camera looks through the surface where it sees it from behind. The front is the side on which the corners of a triangle turn
    /// counterclockwise. Light meets both sides. 0: the camera sees both sides.
    pub one_sided: i32,
}

c_struct!(
    camlux_material, 72,
    shininess: -1.0,
    alpha_cutoff: 0.5,
    ior: 1.5,
    specular: 1.0,
);

/// Adds a material.
///
/// \param index receives its index; may be NULL.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values out of range.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_add_material(
    scene: *mut camlux_scene,
    material: *const camlux_material,
    index: *mut u32,
) -> camlux_status {
    ffi_guard("camlux_scene_add_material", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        unsafe {
            let material = material_from_c(args::read(material)?)?;
            object.add(index, |state| {
                let materials = &mut state.scene.materials;
                validate(&material, materials.len(), &state.textures)?;
                push(materials, material, "material")
            })
        }
    })
}

/// Replaces a material. It keeps what camlux_material does not hold and a scene file may give: how a texture lies on surfaces (coordinates,
/// transform, wrap and filter), as long as its number stays the same.
///
/// \param index of the material to replace.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values out of range.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_material(
    scene: *mut camlux_scene,
    index: u32,
    material: *const camlux_material,
) -> camlux_status {
    ffi_guard("camlux_scene_set_material", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let material = unsafe { material_from_c(args::read(material)?) }?;
        let state = &mut *object.lock_to_change();
        let place = part(&mut state.scene.materials, index, "material")?;
        let material = replaced(place, material);
        validate(&material, index as usize, &state.textures)?;
        *place = material;
        Ok(())
    })
}

/// Reads a material as it was set.
///
/// \param material initialise with CAMLUX_MATERIAL_INIT. Its name is returned as NULL.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_material(
    scene: *mut camlux_scene,
    index: u32,
    material: *mut camlux_material,
) -> camlux_status {
    ffi_guard("camlux_scene_get_material", || {
        let object = handle::get(scene)?;
        let found = || {
            let materials = &object.lock().scene.materials;
            let found = materials.get(index as usize);
            let found = found.ok_or_else(|| no_part(index, materials.len(), "material"))?;
            let texture = |lookup: Option<TextureLookup>| {
                lookup.map_or(0, |lookup| lookup.texture as u32 + 1)
            };
            let facets = found.microfacets;
            let default = camlux_material::default();
            Ok(camlux_material {
                roughness: facets.map_or(default.roughness, |of| of.roughness),
                metallic: facets.map_or(default.metallic, |of| of.metallic),
                ior: facets.map_or(default.ior, |of| of.ior),
                specular: facets.map_or(default.specular, |of| of.specular),
                metallic_roughness_texture: texture(found.metallic_roughness_texture),
                emission_w_sr_m2: found.emission_w_sr_m2,
                emission_texture: texture(found.emission_texture),
                one_sided: found.is_one_sided.into(),
                kd: found.kd,
                ks: found.ks,
                shininess: found.shininess,
                kd_texture: texture(found.kd_texture),
                normal_texture: texture(found.normal_texture),
                alpha_texture: texture(found.alpha_texture),
                ks_texture: texture(found.ks_texture),
                shininess_texture: texture(found.shininess_texture),
                alpha_cutoff: found.alpha_cutoff,
                ..default
            })
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write(material, found) }
    })
}

fn validate(material: &Material, index: usize, textures: &[TextureSource]) -> Outcome {
    for (role, lookup) in material.textures() {
        let (number, count) = (lookup.texture + 1, textures.len());
        if lookup.texture >= count {
            let at = format!("material {index} (\"{}\")", material.name);
            let problem = format!(
                "{} is {number}, but the number of textures is {count}",
                role.field()
            );
            let hint = "give what camlux_scene_add_texture gave, from 1, or 0 for none";
            return Err(Error::scene(at, problem, hint).into());
        }
    }
    material.validate(index, textures.len())?;
    material.validate_encodings(index, |role, texture| textures[texture].contradicts(role))?;
    Ok(())
}

/// The new material, with what [`camlux_material`] does not hold from the old one.
fn replaced(old: &Material, mut new: Material) -> Material {
    let texture = |lookup: Option<TextureLookup>| lookup.map(|lookup| lookup.texture);
    for ((_, lookup), (_, before)) in new.by_role_mut().into_iter().zip(old.by_role()) {
        if texture(*lookup) == texture(before) {
            *lookup = before;
        }
    }
    new
}

/// # Safety
/// The name is null or a C string.
unsafe fn material_from_c(raw: camlux_material) -> Outcome<Material> {
    // SAFETY: the caller guarantees it.
    let name = unsafe { args::text(raw.name, "camlux_material.name") }?.unwrap_or_default();
    args::reserved(camlux_material::NAME, raw.reserved)?;
    let mut material = Material::lambert(name, raw.kd);
    material.ks = raw.ks;
    let is_phong = raw.roughness == 0.0;
    material.microfacets = (!is_phong).then_some(MetallicRoughness {
        metallic: raw.metallic,
        roughness: raw.roughness,
        ior: raw.ior,
        specular: raw.specular,
    });
    let texture = |number: u32| {
        let index = number.checked_sub(1)?;
        Some(TextureLookup::from(index as usize))
    };
    material.kd_texture = texture(raw.kd_texture);
    material.normal_texture = texture(raw.normal_texture);
    material.alpha_texture = texture(raw.alpha_texture);
    material.ks_texture = texture(raw.ks_texture);
    material.shininess_texture = texture(raw.shininess_texture);
    material.metallic_roughness_texture = texture(raw.metallic_roughness_texture);
    material.emission_w_sr_m2 = raw.emission_w_sr_m2;
    material.emission_texture = texture(raw.emission_texture);
    material.is_one_sided = args::flag("camlux_material.one_sided", raw.one_sided)?;
    material.alpha_cutoff = raw.alpha_cutoff;
    if raw.shininess.is_nan() || raw.shininess >= 0.0 {
        material.shininess = raw.shininess;
    } else if is_phong && material.is_specular() {
        // A default exponent such as 1 would silently choose a very wide lobe.
        let place = match &material.name[..] {
            "" => "material".into(),
            name => format!("material \"{name}\""),
        };
        let problem = format!("ks is {:?}, but shininess is {}", raw.ks, raw.shininess);
        return Err(Error::scene(place, problem, "set shininess to an exponent such as 20").into());
    }
    Ok(material)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Filter, Wrap};

    #[test]
    fn a_replaced_material_keeps_what_the_struct_does_not_hold() {
        let lookup = |texture: usize| {
            Some(TextureLookup {
                texcoord_set: 1,
                wrap: [Wrap::Clamp, Wrap::Mirror],
                filter: Filter::Nearest,
                ..texture.into()
            })
        };
        let old = Material {
            kd_texture: lookup(0),
            ks_texture: lookup(1),
            shininess_texture: lookup(2),
            normal_texture: lookup(3),
            alpha_texture: lookup(4),
            emission_texture: lookup(5),
            alpha_cutoff: 0.2,
            ..Material::lambert("old", [0.5; 3])
        };
        let new = Material {
            kd_texture: Some(0.into()),
            ks_texture: Some(1.into()),
            normal_texture: Some(1.into()),
            emission_texture: Some(5.into()),
            is_one_sided: true,
            ..Material::lambert("new", [0.25; 3])
        };
        let due = Material {
            kd_texture: lookup(0),
            normal_texture: Some(1.into()),
            shininess_texture: None,
            alpha_texture: None,
            is_one_sided: true,
            alpha_cutoff: 0.5,
            name: "new".into(),
            kd: [0.25; 3],
            ..old.clone()
        };
        assert_eq!(replaced(&old, new), due);
    }
}
