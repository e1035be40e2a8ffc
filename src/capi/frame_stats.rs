//! Statistics of a frame, and the version.

use std::{ffi::c_char, ops::Add};

use super::*;
use crate::output::{PassTime, StopReason};

/// The version of this header is CAMLUX_VERSION_MAJOR.CAMLUX_VERSION_MINOR.CAMLUX_VERSION_PATCH.
pub const CAMLUX_VERSION_MAJOR: u32 = 0;
/// See CAMLUX_VERSION_MAJOR.
pub const CAMLUX_VERSION_MINOR: u32 = 1;
/// See CAMLUX_VERSION_MAJOR.
pub const CAMLUX_VERSION_PATCH: u32 = 0;

/// The version of the library: 1000000 * major + 1000 * minor + patch.
///
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_version() -> u32 {
    1_000_000 * CAMLUX_VERSION_MAJOR + 1000 * CAMLUX_VERSION_MINOR + CAMLUX_VERSION_PATCH
}

/// There was no target error, or the indirect light is dark.
pub const CAMLUX_STOP_NONE: i32 = 0;
/// The error is within target_error.
pub const CAMLUX_STOP_TARGET_MET: i32 = 1;
/// max_ms or max_rays was reached before the target error: the frame is the best image so far.
pub const CAMLUX_STOP_BUDGET_SPENT: i32 = 2;
/// The largest number of samples was reached; target_error was missed.
pub const CAMLUX_STOP_SAMPLES_EXHAUSTED: i32 = 3;
/// The render was cancelled, and keep_partial of its options is 1: the frame is the best image so far.
pub const CAMLUX_STOP_CANCELLED: i32 = 4;

/// What a frame has cost: times, counts and estimated errors. Initialise with CAMLUX_FRAME_STATS_INIT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_frame_stats {
    /// Set by CAMLUX_FRAME_STATS_INIT.
    pub struct_size: u32,
    /// Number of passes, for camlux_frame_get_pass.
    pub pass_count: u32,
    /// Time from the snapshot of the scene to the frame, milliseconds.
    pub wall_ms: f64,
    /// GPU time of all passes together, milliseconds.
    pub passes_ms: f64,
    /// Time of the snapshot, before wall_ms: moving the vertices of instances whose pose has changed, milliseconds.
    pub snapshot_ms: f64,
    /// Number of virtual point lights (VPLs) that carry flux, over all lights.
    pub vpl_count: u64,
    /// Number of rays for the indirect light; 0 for plain sums.
    pub ray_count: u64,
    /// Number of evaluated pairs of a pixel and a virtual point light.
    pub pixel_vpl_pairs: u64,
    /// Relative error (relRMSE) of the indirect light against the true bounce, which camlux estimates from the frame itself.
    /// NaN if it cannot be estimated, as for the sums of CAMLUX_ESTIMATOR_RSM_AVERAGE and CAMLUX_ESTIMATOR_INSTANT_RADIOSITY.
    pub estimated_error: f64,
    /// Upper bound (95 %) of that error, from the uncertainty of the estimate; NaN if there is none.
    pub estimated_error_upper: f64,
    /// Relative error (relRMSE) of the indirect light against the sum at every pixel, also estimated; NaN if no
    /// interpolation_error was requested.
    pub estimated_interpolation_error: f64,
    /// Number of queue submissions.
    pub submissions: u32,
    /// Why final gathering stopped: CAMLUX_STOP_TARGET_MET and so on; CAMLUX_STOP_NONE for sums and for a frame without indirect
    /// light.
    pub stop: i32,
    /// Name of the device, UTF-8, valid until the frame's last release.
    pub device: *const c_char,
    /// Name and version of its driver, UTF-8, valid until the frame's last release.
    pub driver: *const c_char,
    /// Relative error (relRMSE) of the direct light of area lights, estimated from two halves of their sample points. It is the largest
    /// error of any area light; NaN without one.
    pub estimated_area_light_error: f64,
    /// Time of the least image with an estimate, milliseconds: final gathering makes it whatever max_ms and max_rays are. It is known as
    /// far as this frame tells; NaN if it is not known.
    pub least_ms: f64,
    /// Number of rays of that image; 0 if it is not known.
    pub least_rays: u64,
    /// Part of wall_ms in which pipelines were compiled and the surfaces were copied to the device, milliseconds: most of a first frame, unless
    /// camlux_renderer_prepare has done it. What a driver compiles when a kernel first runs counts for the pass instead.
    pub preparation_ms: f64,
    /// Index of the frame in its sequence: that of camlux_render_options, or the renderer's count.
    pub frame_index: u32,
    /// Index of the frame's camera in camlux_renderer_render_cameras; otherwise 0.
    pub camera_index: u32,
    /// Range error that the error of the bounce causes, rms over pixels, of the worst frequency, millimetres; estimated as estimated_error is.
    /// NaN if no target_range_error_mm was requested.
    pub estimated_range_error_mm: f64,
    /// Upper bound (95 %) of that error; NaN if there is none.
    pub estimated_range_error_upper_mm: f64,
    /// What the host did meanwhile, without waiting for the device and without compiling, milliseconds: what is left of wall_ms beside the
    /// passes and their submissions.
    pub host_ms: f64,
}

/// GPU time of one pass. Initialise with CAMLUX_PASS_TIME_INIT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_pass_time {
    /// Set by CAMLUX_PASS_TIME_INIT.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// GPU time, milliseconds.
    pub ms: f64,
    /// Name of the pass, such as "rsm", "vpl", "gather"; valid until the frame's last release.
    pub name: *const c_char,
}

c_struct!(camlux_frame_stats, 104);

c_struct!(camlux_pass_time, 24);

/// Reads what a frame has cost.
///
/// \param stats initialise with CAMLUX_FRAME_STATS_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any; frames are immutable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_frame_get_stats(
    frame: *mut camlux_frame,
    stats: *mut camlux_frame_stats,
) -> camlux_status {
    ffi_guard("camlux_frame_get_stats", || {
        let object = handle::get(frame)?;
        let stats_of = || {
            let found = object.rendered.stats();
            let key = object.rendered.description().key;
            Ok(camlux_frame_stats {
                pass_count: found.passes.len() as u32,
                wall_ms: found.wall_milliseconds,
                passes_ms: sum_ms(&found.passes),
                host_ms: sum_ms(&found.host_steps),
                snapshot_ms: object.snapshot_ms,
                vpl_count: found.vpl_count,
                ray_count: found.ray_count,
                pixel_vpl_pairs: found.pixel_vpl_pairs,
                estimated_error: found.estimated_error.unwrap_or(f64::NAN),
                estimated_interpolation_error: found
                    .estimated_interpolation_error
                    .unwrap_or(f64::NAN),
                estimated_error_upper: found.estimated_error_upper.unwrap_or(f64::NAN),
                estimated_area_light_error: found.estimated_area_light_error.unwrap_or(f64::NAN),
                least_ms: found.least_milliseconds.unwrap_or(f64::NAN),
                least_rays: found.least_rays.unwrap_or(0),
                submissions: found.submissions,
                preparation_ms: found.preparation_milliseconds,
                stop: match found.stop {
                    None => CAMLUX_STOP_NONE,
                    Some(StopReason::TargetMet) => CAMLUX_STOP_TARGET_MET,
                    Some(StopReason::BudgetSpent) => CAMLUX_STOP_BUDGET_SPENT,
                    Some(StopReason::SamplesExhausted) => CAMLUX_STOP_SAMPLES_EXHAUSTED,
                    Some(StopReason::Cancelled) => CAMLUX_STOP_CANCELLED,
                },
                device: object.device.as_ptr(),
                driver: object.driver.as_ptr(),
                frame_index: key.index,
                camera_index: key.camera,
                estimated_range_error_mm: found.estimated_range_error_mm.unwrap_or(f64::NAN),
                estimated_range_error_upper_mm: found
                    .estimated_range_error_upper_mm
                    .unwrap_or(f64::NAN),
                ..Default::default()
            })
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write(stats, stats_of) }
    })
}

fn sum_ms(times: &[PassTime]) -> f64 {
    // The sum of none is -0.
    let milliseconds = times.iter().map(|time| time.milliseconds);
    milliseconds.fold(0.0, Add::add)
}

/// Reads the GPU time of a pass of a frame. Work that was reused from the previous frame has no pass: after a camera move there is neither
/// "rsm" nor "vpl".
///
/// \param index from 0 to pass_count - 1, in the order of execution.
/// \param pass initialise with CAMLUX_PASS_TIME_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any; frames are immutable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_frame_get_pass(
    frame: *mut camlux_frame,
    index: u32,
    pass: *mut camlux_pass_time,
) -> camlux_status {
    ffi_guard("camlux_frame_get_pass", || {
        let object = handle::get(frame)?;
        let passes = &object.rendered.stats().passes;
        let time = || {
            let found = passes.iter().zip(&object.pass_names).nth(index as usize);
            let (pass, name) = found.ok_or_else(|| no_part(index, passes.len(), "pass"))?;
            Ok(camlux_pass_time {
                ms: pass.milliseconds,
                name: name.as_ptr(),
                ..Default::default()
            })
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write(pass, time) }
    })
}
