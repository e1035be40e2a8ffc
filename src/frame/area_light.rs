//! Direct light of a light with an area: its light without occlusion, times the share that its points see. Adds more and more points, tested
//! with rays, until the target error is met.

use std::ops::Range;

use super::{FrameImages, ProgressReport, lights::UpdatedLight};
use crate::{
    Result, lattice,
    passes::{
        Context,
        direct::{self, SeenPoints},
        light::upload_area_point,
        random::hash,
    },
};

/// Number of points of a half at first.
const FIRST_POINTS: u32 = 8;
/// Factor on the difference of the halves. Where light falls evenly, it is wrong by the same amount everywhere, so the
/// difference is a single random number.
const CAUTION: f64 = 1.5;
/// Most points. A pixel in a penumbra is then wrong by a tenth of a percent of the light.
const MAX_POINTS: u32 = 1024;
/// Points per submission. Between submissions the device has time for other work.
const POINTS_PER_SUBMISSION: u32 = 32;

/// Adds a light to the images of direct light, as the G-buffer shows it. Another `seed` gives other points of the area.
/// Returns an estimate of the relRMSE of that light, from the difference of two halves of the points; `None` if no light shines.
pub(super) fn shade(
    context: &Context,
    seen: SeenPoints,
    light: &UpdatedLight,
    images: &FrameImages,
    seed: u32,
    progress: &mut ProgressReport,
) -> Result<Option<f64>> {
    let Some(sums) = &images.area_light else {
        return Ok(None);
    };
    let UpdatedLight {
        index,
        device,
        occluders,
        ..
    } = *light;
    let target_error = context.plan.target_area_light_error.unwrap_or_default();
    // The errors of a pixel's samples are independent.
    let target_error = target_error / seen.share.unwrap_or(1.0).sqrt();
    let seed = hash(seed ^ hash(index as u32));
    let unweighted = SeenPoints {
        share: seen.share.map(|_| 1.0),
        ..seen
    };
    let shade_points = |half: usize, points: Range<u32>| -> Result<()> {
        for point in points {
            let place = lattice::scrambled(point, seed);
            let point_of_area = upload_area_point(context, index, device, place)?;
            let (point_of_area, half) = (Some(&point_of_area), sums.half(half));
            direct::shade(context, unweighted, device, point_of_area, occluders, half)?;
            if (point + 1) % POINTS_PER_SUBMISSION == 0 {
                context.finish()?;
            }
        }
        Ok(())
    };
    shade_points(0, 0..FIRST_POINTS)?;
    let mut points = FIRST_POINTS;
    let mut before = f64::INFINITY;
    let error = loop {
        shade_points(1, points..2 * points)?;
        let apart = sums.merge(context, seen.gbuffer, device, points)?;
        points *= 2;
        // Halves may agree by chance. Twice the points at best halve the error.
        let error = CAUTION * apart.max(0.5 * before);
        if error <= target_error || points == MAX_POINTS {
            break error;
        }
        before = apart;
        progress.ask()?;
    };
    let direct = images.direct_images();
    sums.add_to(context, seen, device, direct, points)?;
    Ok(Some(error))
}
