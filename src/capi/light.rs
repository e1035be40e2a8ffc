//! Lights.

use std::slice;

use glam::DVec3;

use super::*;
use crate::{
    Error,
    scene::{AreaShape, Carrier, Light, ParameterValue, PlacedLight, Profile},
};

/// Emits its power evenly over the sphere: position_m, power_w.
pub const CAMLUX_LIGHT_POINT: i32 = 0;
/// Emits its power into a cone: position_m, direction, power_w, inner_half_angle_deg, outer_half_angle_deg.
pub const CAMLUX_LIGHT_SPOT: i32 = 1;
/// Parallel light: direction, irradiance_w_m2.
pub const CAMLUX_LIGHT_DIRECTIONAL: i32 = 2;
/// A lamp with a measured pattern: position_m, direction (gamma = 0), up (towards the plane C = 0), pattern, power_w.
pub const CAMLUX_LIGHT_PATTERN: i32 = 3;
/// A projector: position_m, direction (its axis), up (up in the image), image, power_w.
pub const CAMLUX_LIGHT_PROJECTOR: i32 = 4;
/// Emits its power uniformly from an area, towards its front, with a cosine distribution: position_m (its middle), direction, up, power_w,
/// and size_m of a rectangle or radius_m of a disc.
pub const CAMLUX_LIGHT_AREA: i32 = 5;

/// Position and directions of a light are in world space.
pub const CAMLUX_RELATIVE_TO_WORLD: i32 = 0;
/// Position and directions of a light are in the camera's axes: x right, y down, z forward, from the camera's centre. The light moves with
/// the camera.
pub const CAMLUX_RELATIVE_TO_CAMERA: i32 = 1;

/// A light. Initialise with CAMLUX_LIGHT_INIT: a point light without power at the origin. Members that its kind does not use are
/// ignored.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_light {
    /// Set by CAMLUX_LIGHT_INIT.
    pub struct_size: u32,
    /// CAMLUX_LIGHT_POINT, CAMLUX_LIGHT_SPOT, CAMLUX_LIGHT_DIRECTIONAL, CAMLUX_LIGHT_PATTERN, CAMLUX_LIGHT_PROJECTOR or CAMLUX_LIGHT_AREA.
    pub kind: i32,
    /// Position in the space that relative_to says, m.
    pub position_m: [f64; 3],
    /// Direction in which the light travels, in that space; of any length but zero.
    pub direction: [f64; 3],
    /// Power of the whole light, per band R, G, B, watts, 0 to 1e24.
    pub power_w: [f64; 3],
    /// Irradiance on a surface that faces the light, per band R, G, B, W/m^2, 0 to 1e24.
    pub irradiance_w_m2: [f64; 3],
    /// Angle from the axis up to which the intensity is full, degrees, 0 to outer_half_angle_deg.
    pub inner_half_angle_deg: f64,
    /// Angle from the axis beyond which the intensity is 0, degrees above 0 up to 180.
    pub outer_half_angle_deg: f64,
    /// Up in a projector's image, the plane C = 0 of a lamp, or the direction of a rectangle's height, in that space; of any length, not
    /// parallel to direction. A disc needs none: 0, 0, 0.
    pub up: [f64; 3],
    /// Width and height of a rectangle, m; 0, 0 for a disc.
    pub size_m: [f64; 2],
    /// Radius of a disc, m; 0 for a rectangle.
    pub radius_m: f64,
    /// The pattern of a CAMLUX_LIGHT_PATTERN, copied. NULL in camlux_scene_set_light: the pattern that the light has. Always NULL when read.
    pub pattern: *const camlux_pattern,
    /// The image of a CAMLUX_LIGHT_PROJECTOR, likewise.
    pub image: *const camlux_projected_image,
    /// CAMLUX_RELATIVE_TO_WORLD or CAMLUX_RELATIVE_TO_CAMERA. camlux_scene_set_pose moves the light to a pose in world space, and sets it to
    /// CAMLUX_RELATIVE_TO_WORLD.
    pub relative_to: i32,
    /// 0.
    pub reserved: u32,
}

c_struct!(camlux_light, 120);

/// Adds a light.
///
/// \param index receives its index; may be NULL.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values out of range.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_add_light(
    scene: *mut camlux_scene,
    light: *const camlux_light,
    index: *mut u32,
) -> camlux_status {
    ffi_guard("camlux_scene_add_light", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        unsafe {
            let light = args::read(light)?;
            let light = light_from_c(light, pattern_of(&light)?)?;
            object.add(index, |state| {
                light.validate(state.scene.lights.len())?;
                let free = state.absent_lights.take_free();
                // Time of flight may have been set since the removal.
                if let Some(index) = free {
                    state.forget_light(index);
                }
                put(&mut state.scene.lights, free, light, "light")
            })
        }
    })
}

/// Replaces a light. The new one may be of another kind. A lamp or a projector without pattern and image keeps those of the old light.
///
/// \param index of the light to replace.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values out of range.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_light(
    scene: *mut camlux_scene,
    index: u32,
    light: *const camlux_light,
) -> camlux_status {
    ffi_guard("camlux_scene_set_light", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let light = unsafe { args::read(light) }?;
        // SAFETY: the caller guarantees it.
        let given = unsafe { pattern_of(&light) }?;
        let mut state = object.lock_to_change();
        let before = state.light(index)?.lamp();
        let before = before.map(|lamp| lamp.profile.clone());
        let light = light_from_c(light, given.or(before))?;
        light.validate(index as usize)?;
        state.put(index as usize, Moved::Light(light));
        Ok(())
    })
}

/// Reads a light as it was set or last moved.
///
/// \param light initialise with CAMLUX_LIGHT_INIT. Its pattern and image are returned as NULL.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_light(
    scene: *mut camlux_scene,
    index: u32,
    light: *mut camlux_light,
) -> camlux_status {
    ffi_guard("camlux_scene_get_light", || {
        let object = handle::get(scene)?;
        let found = || Ok(placed_to_c(object.lock().light(index)?));
        // SAFETY: the caller guarantees it.
        unsafe { args::write(light, found) }
    })
}

const KINDS: [(i32, &str, &str); 6] = args::choices![
    CAMLUX_LIGHT_POINT => "point",
    CAMLUX_LIGHT_SPOT => "spot",
    CAMLUX_LIGHT_DIRECTIONAL => "directional",
    CAMLUX_LIGHT_PATTERN => "pattern",
    CAMLUX_LIGHT_PROJECTOR => "projector",
    CAMLUX_LIGHT_AREA => "area",
];

/// The member that holds a parameter of a light.
fn member<'l>(light: &'l mut camlux_light, name: &str) -> &'l mut [f64] {
    match name {
        "position_m" => &mut light.position_m,
        "direction" => &mut light.direction,
        "up" => &mut light.up,
        "power_w" => &mut light.power_w,
        "irradiance_w_m2" => &mut light.irradiance_w_m2,
        "inner_half_angle_deg" => slice::from_mut(&mut light.inner_half_angle_deg),
        "outer_half_angle_deg" => slice::from_mut(&mut light.outer_half_angle_deg),
        "size_m" => &mut light.size_m,
        "radius_m" => slice::from_mut(&mut light.radius_m),
        _ => unreachable!("camlux_light has no {name}"),
    }
}

fn light_from_c(mut light: camlux_light, given: Option<Profile>) -> Outcome<PlacedLight> {
    args::reserved(camlux_light::NAME, light.reserved)?;
    let carriers = args::choices![
        CAMLUX_RELATIVE_TO_WORLD => None,
        CAMLUX_RELATIVE_TO_CAMERA => Some(Carrier::Camera),
    ];
    let kind = args::one_of("kind", light.kind, &KINDS)?;
    let (position_m, direction) = (light.position_m.into(), light.direction.into());
    let given = given.filter(|profile| profile.kind() == kind);
    let read = match (kind, Profile::of_kind(kind), given) {
        (_, Some(mut profile), _) => {
            if let Some(numbers) = profile.numbers_mut() {
                numbers.read(|row| {
                    let number = member(&mut light, row.name)[0];
                    Ok::<_, Failure>(Some(ParameterValue::Number(number)))
                })?;
            }
            let direction = if profile.has_axis() {
                direction
            } else {
                DVec3::Z
            };
            Light::spot(position_m, direction, profile, light.power_w)
        }
        (_, _, Some(profile)) => Light::with_profile(
            position_m,
            direction,
            light.up.into(),
            profile,
            light.power_w,
        ),
        ("directional", ..) => Light::directional(direction, light.irradiance_w_m2),
        ("area", ..) => area(&light)?,
        ("pattern", ..) => {
            return Err(Failure::argument(
                "pattern is NULL; give the pattern of the lamp",
            ));
        }
        _ => {
            return Err(Failure::argument(
                "image is NULL; give the image of the projector",
            ));
        }
    };
    Ok(PlacedLight {
        light: read,
        relative_to: args::one_of("relative_to", light.relative_to, &carriers)?,
    })
}

fn area(light: &camlux_light) -> Outcome<Light> {
    let (size_m, radius_m) = (light.size_m, light.radius_m);
    let wrong = |problem: String, hint: &str| Error::scene("area light", problem, hint).into();
    let (shape, needs_up) = match (size_m == [0.0; 2], radius_m == 0.0) {
        (true, true) => {
            let hint = "give size_m of a rectangle, or radius_m of a disc";
            return Err(wrong("size_m and radius_m are 0".into(), hint));
        }
        (false, false) => {
            let problem = format!("size_m is {size_m:?}, and radius_m is {radius_m}");
            let hint = "an area light is a rectangle or a disc: set the other member to 0";
            return Err(wrong(problem, hint));
        }
        (false, true) => (AreaShape::Rectangle { size_m }, true),
        (true, false) => (AreaShape::Disc { radius_m }, false),
    };
    let up = DVec3::from(light.up);
    let up = Some(up).filter(|up| needs_up || *up != DVec3::ZERO);
    let (position_m, direction) = (light.position_m.into(), light.direction.into());
    Ok(Light::area(position_m, direction, up, shape, light.power_w))
}

fn placed_to_c(placed: &PlacedLight) -> camlux_light {
    let mut kinds = KINDS.iter();
    let kind = kinds.find(|(.., kind)| *kind == placed.kind());
    let mut light = camlux_light {
        kind: kind.map_or(CAMLUX_LIGHT_POINT, |(number, ..)| *number),
        relative_to: match placed.relative_to {
            Some(Carrier::Camera) => CAMLUX_RELATIVE_TO_CAMERA,
            Some(Carrier::Mesh(_)) | None => CAMLUX_RELATIVE_TO_WORLD,
        },
        ..Default::default()
    };
    // Patterns and images are not returned.
    for (name, numbers) in placed.parameters() {
        member(&mut light, name).copy_from_slice(&numbers);
    }
    light
}
