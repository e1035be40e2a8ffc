//! How direct and indirect light are computed.

use super::*;
use crate::{
    Error,
    scene::{DEFAULT_RSM_SIZE, DEFAULT_TARGET_ERROR, Direct, ErrorNorm, IndirectLight, Shadow},
};

/// Final gathering by rays from both ends. Converges to the true single bounce, and meets a target error.
pub const CAMLUX_ESTIMATOR_FINAL_GATHER: i32 = 0;
/// The mean over the reflective shadow map, as in CamSim, without distance falloff or visibility.
pub const CAMLUX_ESTIMATOR_RSM_AVERAGE: i32 = 1;
/// The plain sum over the virtual point lights (Keller 1997), without visibility.
pub const CAMLUX_ESTIMATOR_INSTANT_RADIOSITY: i32 = 2;

/// The target error applies to all pixels at once: bright pixels count most.
pub const CAMLUX_NORM_IMAGE: i32 = 0;
/// The target error applies to tiles of the image. Each tile with light has the same weight, so that no dark part stays noisy.
pub const CAMLUX_NORM_LOCAL: i32 = 1;

/// How the single bounce is computed. Initialise with CAMLUX_INDIRECT_INIT: final gathering with a target error of 0.02.
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
    /// CAMLUX_ESTIMATOR_FINAL_GATHER only: target error (relRMSE) against the true bounce, 0.002 to 0.5; 0: 0.02.
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
    /// 0.
    pub reserved: u32,
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

fn indirect_to_c(indirect: &IndirectLight) -> camlux_indirect {
    let init = camlux_indirect::default();
    match *indirect {
        IndirectLight::FinalGather {
            target_error,
            error_norm,
            rsm_size,
            max_ms,
            max_rays,
            stderr_layer,
            target_range_error_mm,
        } => camlux_indirect {
            estimator: CAMLUX_ESTIMATOR_FINAL_GATHER,
            rsm_size: rsm_size.unwrap_or(0),
            error_norm: match error_norm {
                ErrorNorm::Image => CAMLUX_NORM_IMAGE,
                ErrorNorm::Local => CAMLUX_NORM_LOCAL,
            },
            target_error,
            max_ms: max_ms.unwrap_or(0.0),
            max_rays: max_rays.unwrap_or(0),
            stderr_layer: stderr_layer.into(),
            target_range_error_mm: target_range_error_mm.unwrap_or(0.0),
            ..init
        },
        IndirectLight::RsmAverage {
            rsm_size,
            interpolation_error,
        } => camlux_indirect {
            estimator: CAMLUX_ESTIMATOR_RSM_AVERAGE,
            rsm_size,
            interpolation_error: interpolation_error.unwrap_or(0.0),
            ..init
        },
        IndirectLight::InstantRadiosity { rsm_size } => camlux_indirect {
            estimator: CAMLUX_ESTIMATOR_INSTANT_RADIOSITY,
            rsm_size,
            ..init
        },
    }
}

fn indirect_from_c(raw: camlux_indirect) -> Outcome<IndirectLight> {
    args::reserved(camlux_indirect::NAME, raw.reserved)?;
    let stderr_layer = args::flag("stderr_layer", raw.stderr_layer)?;
    let given = |value: f64| (value != 0.0).then_some(value);
    let (target, interpolation) = (given(raw.target_error), given(raw.interpolation_error));
    let range_error = given(raw.target_range_error_mm);
    let (max_ms, max_rays) = (
        given(raw.max_ms),
        (raw.max_rays > 0).then_some(raw.max_rays),
    );
    let norms = args::choices![
        CAMLUX_NORM_IMAGE => ErrorNorm::Image,
        CAMLUX_NORM_LOCAL => ErrorNorm::Local,
    ];
    let error_norm = args::one_of("error_norm", raw.error_norm, &norms)?;
    let rsm_size = match raw.rsm_size {
        0 => DEFAULT_RSM_SIZE,
        rsm_size => rsm_size,
    };
    let choices = args::choices![
        CAMLUX_ESTIMATOR_FINAL_GATHER => IndirectLight::FinalGather {
            target_error: target.unwrap_or(DEFAULT_TARGET_ERROR),
            error_norm,
            rsm_size: (raw.rsm_size > 0).then_some(raw.rsm_size),
            max_ms,
            max_rays,
            stderr_layer,
            target_range_error_mm: range_error,
        },
        CAMLUX_ESTIMATOR_RSM_AVERAGE => IndirectLight::RsmAverage {
            rsm_size,
            interpolation_error: interpolation,
        },
        CAMLUX_ESTIMATOR_INSTANT_RADIOSITY => IndirectLight::InstantRadiosity { rsm_size },
    ];
    let indirect = args::one_of("estimator", raw.estimator, &choices)?;
    let rays = |rays: Option<u64>| rays.map(|rays| rays as f64);
    let norm = |norm: ErrorNorm| (norm != ErrorNorm::Image).then_some(f64::from(raw.error_norm));
    let given_and_used = [
        ("target_error", target, indirect.target_error()),
        (
            "interpolation_error",
            interpolation,
            indirect.interpolation_error(),
        ),
        (
            "target_range_error_mm",
            range_error,
            indirect.target_range_error_mm(),
        ),
        ("max_ms", max_ms, indirect.max_ms()),
        ("max_rays", rays(max_rays), rays(indirect.max_rays())),
        (
            "error_norm",
            norm(error_norm),
            indirect.error_norm().and_then(norm),
        ),
        (
            "stderr_layer",
            stderr_layer.then_some(1.0),
            indirect.stderr_layer().map(f64::from),
        ),
    ];
    for (name, given, used) in given_and_used {
        if let (Some(value), None) = (given, used) {
            let problem = format!("{name} is {value}, but {} has none", indirect.name());
            let hint = "leave it 0; see camlux_indirect for which estimator has which member";
            return Err(Error::scene("indirect", problem, hint).into());
        }
    }
    indirect.validate()?;
    Ok(indirect)
}
