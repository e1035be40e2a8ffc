//! How direct and indirect light are computed.

use super::*;
use crate::{
    Error,
    scene::{Direct, ErrorNorm, IndirectLight, ParameterValue, Shadow},
};

/// Final gathering by rays from both ends. Converges to the true bounces, and meets a target error.
pub const CAMLUX_ESTIMATOR_FINAL_GATHER: i32 = 0;
/// The mean over the reflective shadow map, as in CamSim, without distance falloff or visibility.
pub const CAMLUX_ESTIMATOR_RSM_AVERAGE: i32 = 1;
/// The plain sum over the virtual point lights (Keller 1997), without visibility.
pub const CAMLUX_ESTIMATOR_INSTANT_RADIOSITY: i32 = 2;

/// The target error applies to all pixels at once: bright pixels count most.
pub const CAMLUX_NORM_IMAGE: i32 = 0;
/// The target error applies to tiles of the image. Each tile with light has the same weight, so that no dark part stays noisy.
pub const CAMLUX_NORM_LOCAL: i32 = 1;

/// How indirect light is computed. Initialise with CAMLUX_INDIRECT_INIT: final gathering with a target error of 0.02.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_indirect {
    /// Set by CAMLUX_INDIRECT_INIT.
    pub struct_size: u32,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER, CAMLUX_ESTIMATOR_RSM_AVERAGE or CAMLUX_ESTIMATOR_INSTANT_RADIOSITY.
    pub estimator: i32,
    /// Texels along an edge of a face of the reflective shadow map. 0: camlux chooses for CAMLUX_ESTIMATOR_FINAL_GATHER, and 64 for the others.
    pub rsm_size: u32,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: what target_error applies to, CAMLUX_NORM_IMAGE or CAMLUX_NORM_LOCAL.
    pub error_norm: i32,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: target error (relRMSE) against the true bounces, 0.002 to 0.5; 0: 0.02.
    pub target_error: f64,
    /// CAMLUX_ESTIMATOR_RSM_AVERAGE only: relative error (relRMSE), against the sum at every pixel, that interpolation between
    /// pixels may cause, 0.002 to 0.5; 0: no interpolation, the sum at every pixel.
    pub interpolation_error: f64,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: limit of the wall time of a frame from the call on, milliseconds, without compiling. If it is reached
    /// before the target error, the result is the best image so far. The least image with an estimate is always made; least_ms in
    /// camlux_frame_stats is its time.
    /// 0: no limit.
    pub max_ms: f64,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: limit of the number of rays, like max_ms; the least image is always made. 0: no limit.
    pub max_rays: u64,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: 1: frames have the layer CAMLUX_LAYER_STDERR.
    pub stderr_layer: i32,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: largest number of surfaces that reflect light on its way from a light to what the camera sees, 1 to 16; 0: 1.
    pub bounces: u32,
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only, with time of flight: target of the range error that the error of the bounce causes, rms over pixels,
    /// millimetres, 0.1 to 1000; target_error is then for the light alone. 0: target_error is for the phasors, too.
    pub target_range_error_mm: f64,
}

/// By rays if indirect light casts rays, a surface has cut-outs or a light has an area; otherwise from maps.
pub const CAMLUX_SHADOW_DEFAULT: i32 = 0;
/// From a map of what the light sees. Not for surfaces with cut-outs or lights with an area.
pub const CAMLUX_SHADOW_MAP: i32 = 1;
/// Exact, by one ray for each pixel and light.
pub const CAMLUX_SHADOW_RAYS: i32 = 2;

/// How direct light is computed. Initialise with CAMLUX_DIRECT_INIT: CAMLUX_SHADOW_DEFAULT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_direct {
    /// Set by CAMLUX_DIRECT_INIT.
    pub struct_size: u32,
    /// CAMLUX_SHADOW_DEFAULT, CAMLUX_SHADOW_MAP or CAMLUX_SHADOW_RAYS.
    pub shadow: i32,
}

c_struct!(camlux_indirect, 56);

c_struct!(camlux_direct, 8);

/// Sets how indirect light is computed. Frames then have the layer CAMLUX_LAYER_INDIRECT.
///
/// \param indirect NULL: direct light only, the default.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for members that do not go together.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_indirect(
    scene: *mut camlux_scene,
    indirect: *const camlux_indirect,
) -> camlux_status {
    ffi_guard("camlux_scene_set_indirect", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let indirect = unsafe { args::read_optional(indirect) }?;
        let indirect = indirect.map(indirect_from_c).transpose()?;
        object.lock_to_change().scene.indirect = indirect;
        Ok(())
    })
}

/// Reads how indirect light is computed.
///
/// \param indirect initialise with CAMLUX_INDIRECT_INIT. Unchanged if there is direct light only.
/// \param is_set receives 1, or 0 if there is direct light only.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_indirect(
    scene: *mut camlux_scene,
    indirect: *mut camlux_indirect,
    is_set: *mut i32,
) -> camlux_status {
    ffi_guard("camlux_scene_get_indirect", || {
        let found = handle::get(scene)?.lock().scene.indirect;
        // SAFETY: the caller guarantees it.
        unsafe { args::write_optional(indirect, is_set, found.as_ref().map(indirect_to_c)) }
    })
}

/// Reads how direct light is computed.
///
/// \param direct initialise with CAMLUX_DIRECT_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_direct(
    scene: *mut camlux_scene,
    direct: *mut camlux_direct,
) -> camlux_status {
    ffi_guard("camlux_scene_get_direct", || {
        let object = handle::get(scene)?;
        let found = || {
            Ok(camlux_direct {
                shadow: match object.lock().scene.direct.shadow {
                    None => CAMLUX_SHADOW_DEFAULT,
                    Some(Shadow::Map) => CAMLUX_SHADOW_MAP,
                    Some(Shadow::Rays) => CAMLUX_SHADOW_RAYS,
                },
                ..Default::default()
            })
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write(direct, found) }
    })
}

/// Sets how direct light is computed.
///
/// \param direct NULL: the default, CAMLUX_SHADOW_DEFAULT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_direct(
    scene: *mut camlux_scene,
    direct: *const camlux_direct,
) -> camlux_status {
    ffi_guard("camlux_scene_set_direct", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let direct = unsafe { args::read_optional(direct) }?.unwrap_or_default();
        let choices = args::choices![
            CAMLUX_SHADOW_DEFAULT => None,
            CAMLUX_SHADOW_MAP => Some(Shadow::Map),
            CAMLUX_SHADOW_RAYS => Some(Shadow::Rays),
        ];
        let shadow = args::one_of("shadow", direct.shadow, &choices)?;
        object.lock_to_change().scene.direct = Direct { shadow };
        Ok(())
    })
}

/// Where a parameter is in the struct. 0 is not given.
enum Member<'m> {
    Number(&'m mut f64),
    Count(&'m mut u32),
    LargeCount(&'m mut u64),
    Flag(&'m mut i32),
    Norm(&'m mut i32),
}

const NORMS: [(i32, &str, ErrorNorm); 2] = args::choices![
    CAMLUX_NORM_IMAGE => ErrorNorm::Image,
    CAMLUX_NORM_LOCAL => ErrorNorm::Local,
];

const ESTIMATORS: [(i32, &str, IndirectLight); 3] = {
    let [gather, average, radiosity] = IndirectLight::all();
    args::choices![
        CAMLUX_ESTIMATOR_FINAL_GATHER => gather,
        CAMLUX_ESTIMATOR_RSM_AVERAGE => average,
        CAMLUX_ESTIMATOR_INSTANT_RADIOSITY => radiosity,
    ]
};

/// The parameters by their names.
fn members(raw: &mut camlux_indirect) -> [(&'static str, Member<'_>); 9] {
    [
        ("target_error", Member::Number(&mut raw.target_error)),
        (
            "interpolation_error",
            Member::Number(&mut raw.interpolation_error),
        ),
        (
            "target_range_error_mm",
            Member::Number(&mut raw.target_range_error_mm),
        ),
        ("max_ms", Member::Number(&mut raw.max_ms)),
        ("max_rays", Member::LargeCount(&mut raw.max_rays)),
        ("error_norm", Member::Norm(&mut raw.error_norm)),
        ("stderr_layer", Member::Flag(&mut raw.stderr_layer)),
        ("rsm_size", Member::Count(&mut raw.rsm_size)),
        ("bounces", Member::Count(&mut raw.bounces)),
    ]
}

impl Member<'_> {
    fn value(&self, name: &str) -> Outcome<Option<ParameterValue>> {
        Ok(match *self {
            Member::Number(&mut number) => {
                (number != 0.0).then_some(ParameterValue::Number(number))
            }
            Member::Count(&mut count) => (count > 0).then_some(ParameterValue::Count(count.into())),
            Member::LargeCount(&mut count) => (count > 0).then_some(ParameterValue::Count(count)),
            Member::Flag(&mut flag) => {
                args::flag(name, flag)?.then_some(ParameterValue::Flag(true))
            }
            Member::Norm(&mut norm) => {
                let norm = args::one_of(name, norm, &NORMS)?;
                (norm != ErrorNorm::Image).then_some(ParameterValue::Name(norm.name()))
            }
        })
    }

    fn set(self, value: ParameterValue) {
        match (self, value) {
            (Member::Number(member), ParameterValue::Number(number)) => *member = number,
            (Member::Count(member), ParameterValue::Count(count)) => *member = count as u32,
            (Member::LargeCount(member), ParameterValue::Count(count)) => *member = count,
            (Member::Flag(member), ParameterValue::Flag(flag)) => *member = flag.into(),
            (Member::Norm(member), ParameterValue::Name(name)) => {
                let mut norms = NORMS.iter();
                let norm = norms.find(|(.., norm)| norm.name() == name);
                *member = norm.map_or(CAMLUX_NORM_IMAGE, |(number, ..)| *number);
            }
            _ => unreachable!("a member is of its parameter's kind"),
        }
    }
}

impl std::fmt::Display for Member<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Member::Number(number) => write!(f, "{number}"),
            Member::Count(count) => write!(f, "{count}"),
            Member::LargeCount(count) => write!(f, "{count}"),
            Member::Flag(number) | Member::Norm(number) => write!(f, "{number}"),
        }
    }
}

fn indirect_to_c(indirect: &IndirectLight) -> camlux_indirect {
    let mut raw = camlux_indirect::default();
    let mut estimators = ESTIMATORS.iter();
    let estimator = estimators.find(|(.., known)| known.name() == indirect.name());
    raw.estimator = estimator.map_or(CAMLUX_ESTIMATOR_FINAL_GATHER, |(number, ..)| *number);
    for (name, member) in members(&mut raw) {
        if let Some(value) = indirect.value(name) {
            member.set(value);
        }
    }
    raw
}

fn indirect_from_c(mut raw: camlux_indirect) -> Outcome<IndirectLight> {
    let mut indirect = args::one_of("estimator", raw.estimator, &ESTIMATORS)?;
    let members = members(&mut raw);
    for (name, member) in &members {
        if member.value(name)?.is_some() && !indirect.has(name) {
            let problem = format!("{name} is {member}, but {} has none", indirect.name());
            let hint = "leave it 0; see camlux_indirect for which estimator has which member";
            return Err(Error::scene("indirect", problem, hint).into());
        }
    }
    indirect.parameters_mut().read(|parameter| {
        let member = members.iter().find(|(name, _)| *name == parameter.name);
        member.map_or(Ok(None), |(name, member)| member.value(name))
    })?;
    indirect.validate()?;
    Ok(indirect)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_parameter_has_a_member() {
        let mut raw = camlux_indirect::default();
        let members = members(&mut raw);
        for parameter in IndirectLight::all_parameters() {
            let is_member = members.iter().any(|(name, _)| *name == parameter.name);
            assert!(is_member, "{}", parameter.name);
        }
    }
}
