//! Plans the indirect light.

use super::GatherKernel;
use crate::{
    scene::{ErrorNorm, IndirectLight, Scene, VplSum},
    vulkan::DeviceInfo,
};

/// From this target error on, points of the coarsest grid along the shorter edge of the image, and its largest stride.
const GRIDS: [(f64, u32, u32); 4] = [(0.0, 25, 16), (0.05, 16, 16), (0.1, 12, 32), (0.2, 6, 64)];
/// Texels along the edge of a tile, if the scene sets the size of the RSM for final gathering.
const RSM_TEXELS_PER_TILE: u32 = 8;
/// Most tiles along the edge of a face.
const MAX_TILES: u32 = 32;

/// What the indirect light needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IndirectPlan {
    /// Cells along one edge of a face of a light's emission domain: texels of its RSM, or tiles through which final gathering
    /// sends rays.
    pub emission_size: u32,
    pub gather: GatherPlan,
    pub refinement: RefinementPlan,
    /// Whether the standard error of each pixel's indirect light is requested.
    pub has_stderr_layer: bool,
    /// Whether the light of fewer bounces than the gather's is left out.
    pub(crate) has_last_bounce_alone: bool,
}

/// A gather among several of a frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GatheredPart {
    /// It is for light of so many bounces alone; `None`: for all light.
    pub bounces: Option<u32>,
    /// Its target error, if it has another than the frame.
    pub target_error: Option<f64>,
    /// Shares of the frame's limits: of the gathers before it, and its own.
    pub begin: f64,
    pub share: f64,
}

/// What gathers a pixel's indirect light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GatherPlan {
    /// The sum over all VPLs, without visibility.
    VplSum { sum: VplSum, kernel: GatherKernel },
    /// Rays from P and rays to VPLs.
    FinalGather { bounces: u32 },
}

/// Which pixels are gathered; the others are interpolated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefinementPlan {
    /// Requested relRMSE of the indirect light; `None`: every pixel is gathered. The reference is the sum at every pixel for a sum,
    /// and the true bounce for final gathering.
    pub target_error: Option<f64>,
    /// Requested error of range, metres; only with time of flight of the bounce. `target_error` is then for the light alone.
    pub target_range_error_m: Option<f64>,
    /// The norm of this error; [`ErrorNorm::Image`] for sums.
    pub error_norm: ErrorNorm,
    /// Wall time of a frame from the call on, milliseconds; `None`: no limit.
    pub max_ms: Option<f64>,
    /// Rays for the indirect light of a frame; `None`: no limit.
    pub max_rays: Option<u64>,
    /// Stride of the grid of pixels that are gathered first; a power of two, 1 if every pixel is gathered.
    pub coarsest_stride: u32,
}

impl IndirectPlan {
    pub(super) fn new(indirect: IndirectLight, scene: &Scene, device: &DeviceInfo) -> IndirectPlan {
        IndirectPlan {
            emission_size: planned_emission_size(indirect, scene.lights.len()),
            gather: planned_gather(indirect, device),
            refinement: planned_refinement(indirect, scene.camera.resolution_px),
            has_stderr_layer: indirect.gather().is_some_and(|gather| gather.stderr_layer),
            has_last_bounce_alone: false,
        }
    }

    /// The plan of one of the frame's gathers.
    pub(super) fn of_part(self, part: GatheredPart) -> IndirectPlan {
        let RefinementPlan {
            target_error,
            max_ms,
            max_rays,
            ..
        } = self.refinement;
        let plan = IndirectPlan {
            refinement: RefinementPlan {
                target_error: part.target_error.or(target_error),
                max_ms: max_ms.map(|ms| part.share * ms),
                max_rays: max_rays.map(|rays| (part.share * rays as f64) as u64),
                ..self.refinement
            },
            ..self
        };
        match part.bounces {
            None => plan,
            Some(bounces) => IndirectPlan {
                gather: GatherPlan::FinalGather { bounces },
                has_stderr_layer: false,
                has_last_bounce_alone: true,
                ..plan
            },
        }
    }

    /// The formula of the sum over VPLs; `None` for final gathering.
    pub fn sum(&self) -> Option<VplSum> {
        match self.gather {
            GatherPlan::VplSum { sum, .. } => Some(sum),
            GatherPlan::FinalGather { .. } => None,
        }
    }

    /// Edge of a face of the RSM, texels; `None` if there is no RSM.
    pub fn rsm_size(&self) -> Option<u32> {
        self.sum().map(|_| self.emission_size)
    }

    /// Whether rays find visibility.
    pub fn is_final_gather(&self) -> bool {
        matches!(self.gather, GatherPlan::FinalGather { .. })
    }
}

fn planned_gather(indirect: IndirectLight, device: &DeviceInfo) -> GatherPlan {
    match indirect.sum() {
        Some(sum) => GatherPlan::VplSum {
            sum,
            kernel: GatherKernel::best_for(device),
        },
        None => GatherPlan::FinalGather {
            bounces: indirect.gather().map_or(1, |gather| gather.bounces),
        },
    }
}

fn planned_refinement(indirect: IndirectLight, resolution_px: [u32; 2]) -> RefinementPlan {
    let gather = indirect.gather();
    let target_error = match gather {
        None => indirect.interpolation_error(),
        Some(gather) => Some(gather.target_error),
    };
    let range_mm = gather.and_then(|gather| gather.target_range_error_mm);
    RefinementPlan {
        target_error,
        target_range_error_m: range_mm.map(|mm| 1e-3 * mm),
        error_norm: gather.map_or(ErrorNorm::Image, |gather| gather.error_norm),
        max_ms: gather.and_then(|gather| gather.max_ms),
        max_rays: gather.and_then(|gather| gather.max_rays),
        coarsest_stride: match target_error {
            None => 1,
            // Sums differ little in time.
            Some(_) if gather.is_none() => coarsest_stride(resolution_px, 0.0),
            Some(target) => coarsest_stride(resolution_px, target),
        },
    }
}

/// Stride of the pixels that are gathered in any case: a few of them along the shorter edge show what the image is like.
fn coarsest_stride(resolution_px: [u32; 2], target_error: f64) -> u32 {
    let [width, height] = resolution_px;
    let mut grids = GRIDS.into_iter().rev();
    let grid = grids.find(|&(least, ..)| target_error >= least);
    let (_, points, most) = grid.unwrap_or(GRIDS[0]);
    let stride = (width.min(height) / points).clamp(2, most);
    1 << stride.ilog2()
}

/// Cells along one edge of a face. Tiles are stored in Morton order, so their number is a power of two.
fn planned_emission_size(indirect: IndirectLight, light_count: usize) -> u32 {
    match (indirect.rsm_size(), light_count) {
        (Some(size), _) if indirect.sum().is_some() => size,
        (Some(size), _) => (size / RSM_TEXELS_PER_TILE)
            .clamp(1, MAX_TILES)
            .next_power_of_two(),
        // Many lights share the rays that a single light would have.
        (None, 0..=4) => 16,
        (None, 5..=16) => 8,
        (None, _) => 4,
    }
}
