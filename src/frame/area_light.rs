//! Direct light of a light with an area: its light without occlusion, times the share that its points see. Adds more and more points, tested
//! with rays, until the target error is met.

use std::ops::Range;

use super::ProgressReport;
use crate::{
    Result, lattice,
    passes::{
        Context,
        area_light::AreaLightImages,
        direct::{self, DirectImages, Occluders, SeenAt},
        gbuffer::GBuffer,
        light::{DeviceLight, upload_area_point},
        random::hash,
        surface::Surfaces,
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

/// Adds a light to the images of direct light, as the G-buffer shows it. Another `seed` gives other points.
/// Returns an estimate of the relRMSE of that light, from the difference of two halves of the points.
pub(super) fn shade(
    context: &Context,
    surfaces: &Surfaces,
    (gbuffer, share): (&GBuffer, Option<f64>),
    (number, light, occluders): (usize, &DeviceLight, Occluders),
    (sums, direct): (&AreaLightImages, DirectImages),
    seed: u32,
    progress: &mut ProgressReport,
) -> Result<f64> {
    // The errors of a pixel's samples are independent.
    let target_error =
        context.plan.area_light_error.unwrap_or_default() / share.unwrap_or(1.0).sqrt();
    let seed = hash(seed ^ hash(number as u32));
    let seen_at = match share {
        None => SeenAt::Centres,
        Some(_) => SeenAt::Samples { share: 1.0 },
    };
    let shade_points = |half: usize, points: Range<u32>| -> Result<()> {
        for point in points {
            let place = lattice::scrambled(point, seed);
            let uniform = upload_area_point(context, number, light, place)?;
            let seen = (gbuffer, seen_at);
            let light = (light, Some(&uniform), occluders);
            direct::shade(context, surfaces, seen, light, sums.half(half))?;
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
        let apart = sums.merge(context, (gbuffer, light), points)?;
        points *= 2;
        // Halves may agree by chance. Twice the points at best halve the error.
        let error = CAUTION * apart.max(0.5 * before);
        if error <= target_error || points == MAX_POINTS {
            break error;
        }
        before = apart;
        progress.ask()?;
    };
    let weight = (points, share.unwrap_or(1.0));
    context.record(|recorder| sums.add_to(recorder, context, (gbuffer, light), direct, weight))?;
    Ok(error)
}
