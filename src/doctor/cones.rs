//! The cases of [lights](super::lights) that are about the cones of spots.

use glam::DVec3;

use super::{
    Examiner, Measurement,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, largest, values},
    scenes::{lit_by, room, spot_light, with_sum},
};
use crate::{
    Result, Scene,
    internals::f64_kernels,
    model::CompensatedSum,
    output::Layer,
    reference::Reference,
    scene::{Lens, VplSum},
};

/// What the VPLs may lose of the light's power: exact integrals in f64, a few roundings for each of at most four thousand texels.
const POWER_BOUND: f64 = 1e-12;

/// f32 tells directions apart to 1e-7, over a penumbra of this width.
fn penumbra_bound(penumbra_deg: f64) -> f64 {
    2e-7 / penumbra_deg.to_radians()
}

pub(super) fn spot_of_half_a_degree(examiner: &mut Examiner) -> Result<Measurement> {
    let at = DVec3::new(0.33, 0.81, 0.2);
    let target = DVec3::new(-0.3, -1.0, 0.5);
    let spot = spot_light(at, target - at, [0.1, 0.25]);
    let mut scene = lit_by(&room(), vec![spot]);
    let whole = scene.clone();
    // Up close: the lit spot of 14 mm fills the image.
    scene.camera.position_m = DVec3::new(-0.1, -0.6, 0.7);
    scene.camera.look_at_m = target;
    scene.camera.lens = Lens::FovY { fov_y_deg: 4.0 };
    let bound = DIRECT_BOUND + penumbra_bound(0.15);
    Ok(Measurement::of([
        examiner.direct("the spot up close", &scene, bound)?,
        examiner.sums("the whole room", &whole, 24, KERNEL_BOUND)?,
        examiner.bounce("the whole room", &whole)?,
    ]))
}

pub(super) fn narrowest_spot(examiner: &mut Examiner) -> Result<Measurement> {
    let at = DVec3::new(0.33, 0.81, 0.2);
    let spot = spot_light(at, DVec3::new(-0.3, -1.0, 0.5) - at, [0.5e-4, 1e-4]);
    let scene = lit_by(&room(), vec![spot]);
    let lost = lost_power(examiner, &scene, 24)?;
    Ok(Measurement::of([
        Measurement::new("power of the VPLs", lost, POWER_BOUND),
        examiner.sums("the whole room", &scene, 24, KERNEL_BOUND)?,
        examiner.bounce("the whole room", &scene)?,
    ]))
}

pub(super) fn wide_spots(examiner: &mut Examiner) -> Result<Measurement> {
    let mut parts = Vec::new();
    for half_angles_deg in [[10.0, 89.5], [89.0, 89.5], [100.0, 179.0], [180.0, 180.0]] {
        let spot = spot_light(
            DVec3::new(0.23, 0.41, 0.17),
            DVec3::new(0.3, -0.8, -0.4),
            half_angles_deg,
        );
        let scene = lit_by(&room(), vec![spot]);
        let [inner, outer] = half_angles_deg;
        let what = format!("{inner}° to {outer}°");
        let bound = DIRECT_BOUND + penumbra_bound(if inner < outer { outer - inner } else { 90.0 });
        parts.push(examiner.direct(&what, &scene, bound)?);
        parts.push(examiner.sums(&what, &scene, 24, KERNEL_BOUND)?);
        parts.push(examiner.bounce(&what, &scene)?);
    }
    Ok(Measurement::of(parts))
}

pub(super) fn equal_cones(examiner: &mut Examiner) -> Result<Measurement> {
    let mut parts = Vec::new();
    for half_angle_deg in [0.25, 20.0, 90.0] {
        let at = DVec3::new(0.23, 0.71, 0.17);
        let spot = spot_light(at, DVec3::new(-0.2, -1.0, -0.4) - at, [half_angle_deg; 2]);
        let scene = lit_by(&room(), vec![spot]);
        let what = format!("{half_angle_deg}°");
        if half_angle_deg > 1.0 {
            parts.push(examiner.direct(&what, &scene, DIRECT_BOUND)?);
        }
        parts.push(examiner.sums(&what, &scene, 24, KERNEL_BOUND)?);
        parts.push(examiner.bounce(&what, &scene)?);
    }
    Ok(Measurement::of(parts))
}

/// How far the power of all VPLs is from the light's: in a closed room every texel hits.
fn lost_power(examiner: &mut Examiner, scene: &Scene, rsm_size: u32) -> Result<f64> {
    let scene = with_sum(scene, VplSum::InstantRadiosity, rsm_size);
    let (_, kept) = examiner.render_keeping(&scene)?;
    let vpls = f64_kernels::vpls(&scene.lights[0], &kept.lights[0]);
    let of_vpls: CompensatedSum = vpls.iter().map(|vpl| vpl.incident_power_w[0]).collect();
    Ok((of_vpls.value() / scene.lights[0].emission()[0] - 1.0).abs())
}

pub(super) fn cone_inside_a_texel(examiner: &mut Examiner) -> Result<Measurement> {
    let mut parts = Vec::new();
    for rsm_size in [1, 2, 3, 5] {
        for half_angles_deg in [[7.0, 8.0], [30.0, 30.0], [40.0, 100.0]] {
            let at = DVec3::new(0.23, 0.71, 0.17);
            let spot = spot_light(at, DVec3::new(-0.21, -1.0, -0.43) - at, half_angles_deg);
            let scene = lit_by(&room(), vec![spot]);
            let what = format!("{rsm_size} texels, {}°", half_angles_deg[1]);
            let lost = lost_power(examiner, &scene, rsm_size)?;
            parts.push(Measurement::new(
                format!("{what}, power of the VPLs"),
                lost,
                POWER_BOUND,
            ));
            parts.push(examiner.sums(&what, &scene, rsm_size, KERNEL_BOUND)?);
        }
    }
    Ok(Measurement::of(parts))
}

/// 26 axes: to the faces, the edges and the corners of the cube.
pub(super) fn axes_of_the_cube(examiner: &mut Examiner) -> Result<Measurement> {
    let steps = [-1.0, 0.0, 1.0];
    let axes = steps.iter().flat_map(|&x| {
        steps
            .iter()
            .flat_map(move |&y| steps.map(|z| DVec3::new(x, y, z)))
    });
    let mut scene = room();
    scene.camera.resolution_px = [12, 12];
    scene.camera.lens = Lens::FovY { fov_y_deg: 120.0 };
    let mut parts = Vec::new();
    for axis in axes.filter(|&axis| axis != DVec3::ZERO) {
        for half_angles_deg in [[20.0, 28.0], [60.0, 95.0]] {
            scene.lights = vec![spot_light(
                DVec3::new(0.23, 0.41, 0.17),
                axis,
                half_angles_deg,
            )];
            let what = format!("axis {axis}, {}°", half_angles_deg[1]);
            let lost = lost_power(examiner, &scene, 9)?;
            parts.push(Measurement::new(
                format!("{what}, power of the VPLs"),
                lost,
                POWER_BOUND,
            ));
            parts.push(examiner.sums(&what, &scene, 9, KERNEL_BOUND)?);
            let truth = Reference::new(&scene, 1)?.frame();
            // A cone that lights nothing in view has no relative error.
            if largest(values(&truth, Layer::Direct)) > 0.0 {
                let bound = DIRECT_BOUND + penumbra_bound(8.0);
                parts.push(examiner.direct(&what, &scene, bound)?);
            }
            // The narrow cone may not be seen to light anything, and then nothing may be claimed.
            if half_angles_deg[1] > 90.0 {
                parts.push(examiner.bounce(&what, &scene)?);
            }
        }
    }
    Ok(Measurement::of(parts))
}
