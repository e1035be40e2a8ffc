//! Materials.

use std::ffi::c_char;

use super::*;
use crate::{
    Error,
    scene::{Material, TextureLookup},
};

/// Reflectance of a surface: modified Phong, f = kd/pi + ks (s+2)/(2 pi) max(0, r.v)^s. Initialise with CAMLUX_MATERIAL_INIT: black,
/// without texture.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_material {
    /// sizeof(camlux_material)
    pub struct_size: u32,
    /// The index of a texture that multiplies kd; CAMLUX_NONE: no texture.
    pub kd_texture: u32,
    /// Diffuse reflectance of the bands R, G, B, 0 to 1.
    pub kd: [f64; 3],
    /// Specular reflectance of the bands R, G, B, 0 to 1.
    pub ks: [f64; 3],
    /// Phong exponent s, 0 to 1e9. Below 0: not given, which is allowed if ks is 0.
    pub shininess: f64,
    /// Name for messages, UTF-8, copied; NULL: none.
    pub name: *const c_char,
    /// The index of a normal texture, used in its linear encoding: R, G, B from 0 to 1 stand for components from -1 to 1. These point along the
    /// directions in which u and v grow, and along the mesh's own normal. CAMLUX_NONE: none.
    pub normal_texture: u32,
    /// The index of an alpha texture, used in its linear encoding: there is a surface where R is at least 0.5. Below 0.5 the surface is cut out,
    /// on both sides. CAMLUX_NONE: none.
    pub alpha_texture: u32,
}

c_struct!(
    camlux_material, 72,
    kd_texture: CAMLUX_NONE,
    shininess: -1.0,
    normal_texture: CAMLUX_NONE,
    alpha_texture: CAMLUX_NONE,
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
                let scene = &mut state.scene;
                material.validate(scene.materials.len(), scene.textures.len())?;
                push(&mut scene.materials, material, "material")
            })
        }
    })
}

/// Replaces a material.
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
        let scene = &mut object.lock_to_change().scene;
        let place = part(&mut scene.materials, index, "material")?;
        material.validate(index as usize, scene.textures.len())?;
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
                lookup.map_or(CAMLUX_NONE, |lookup| lookup.texture as u32)
            };
            Ok(camlux_material {
                kd: found.kd,
                ks: found.ks,
                shininess: found.shininess,
                kd_texture: texture(found.kd_texture),
                normal_texture: texture(found.normal_texture),
                alpha_texture: texture(found.alpha_texture),
                ..Default::default()
            })
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write(material, found) }
    })
}

/// # Safety
/// The name is null or a C string.
unsafe fn material_from_c(raw: camlux_material) -> Outcome<Material> {
    // SAFETY: the caller guarantees it.
    let name = unsafe { args::text(raw.name, "name") }?.unwrap_or_default();
    let mut material = Material::lambert(name, raw.kd);
    material.ks = raw.ks;
    let texture = |index: u32| (index != CAMLUX_NONE).then(|| TextureLookup::from(index as usize));
    material.kd_texture = texture(raw.kd_texture);
    material.normal_texture = texture(raw.normal_texture);
    material.alpha_texture = texture(raw.alpha_texture);
    if raw.shininess.is_nan() || raw.shininess >= 0.0 {
        material.shininess = raw.shininess;
    } else if material.is_specular() {
        // A default exponent such as 1 would silently choose a very wide lobe.
        let place = format!("material \"{}\"", material.name);
        let problem = format!("ks is {:?}, but shininess is {}", raw.ks, raw.shininess);
        return Err(Error::scene(place, problem, "set shininess to an exponent such as 20").into());
    }
    Ok(material)
}
