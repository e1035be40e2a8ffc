//! Light with no path, with one narrow path, or with a million paths.

use std::f64::consts::PI;

use glam::{DVec3, dvec3};

use super::{
    Case, Examiner,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, TARGET_ERROR, TARGET_SLACK, error_of, largest, values},
    geometry::no_indirect_light,
    scenes::{
        COLOURED, GREY, amplified, cuboid, empty_room, globe, lit_by, point_light, quad, room,
        rounded, scene_of, sphere, spot_light, with_each_estimator, with_rays,
    },
};
use crate::{Result, output::Layer, scene::Lens};

pub const CASES: &[Case] = &[
    Case::new(
        "sphere_lit_from_its_centre",
        "every P sees every Q at every distance, which shows errors of the measure, of 1/d² and of the weights",
        "matches the closed form: 0.5 direct, 0.25 by one bounce, 1/(6π) by the average",
        |exam| sphere_from_its_centre(exam, 32),
    ),
    Case::new(
        "no_vpl_above_the_horizon",
        "sums and densities of nothing: 0/0",
        "exactly 0",
        no_vpl_above_the_horizon,
    ),
    Case::new(
        "no_vpl_at_all",
        "a light that misses everything, or a scene without reflectance: empty lists of VPLs",
        "sums over nothing are 0",
        no_vpl_at_all,
    ),
    Case::new(
        "every_vpl_hidden",
        "an error relative to a black image, and samples that never find light",
        "the image is exactly 0, without an estimated error",
        every_vpl_hidden,
    ),
    Case::new(
        "light_only_through_a_slit",
        "one direction in a thousand finds light, and one VPL in a hundred",
        "a pilot learns which VPLs contribute where",
        through_a_slit,
    )
    .long(),
    Case::new(
        "single_convex_object",
        "points of one convex object do not see each other, but rounding says they do",
        "both cosines must be positive, and rays start off the surface: exactly 0",
        single_convex_object,
    ),
    Case::new(
        "grazing_receivers_and_vpls",
        "in a wedge of 1° both cosines are small differences of large numbers",
        "cosines use the difference P − Q, which keeps all digits of the positions",
        |exam| wedge(exam, 1.0),
    ),
    Case::new(
        "wedge_of_a_hundredth_of_a_degree",
        "0.3 mm between plates of 2 m, which no texel of the light's map hits",
        "sampled directions find what the map misses",
        |exam| wedge(exam, 0.01),
    ),
    Case::new(
        "one_and_a_half_million_vpls",
        "a plain f32 sum of 1.5e6 terms loses its last four digits; lists outgrow loops and buffers",
        "sums of three levels; the gather is split into dispatches",
        |exam| sphere_from_its_centre(exam, 512),
    )
    .long(),
];

/// Unit sphere with k_d = ½ and a light of π W/sr at its centre: direct 0.5, bounce 0.25, average 1/(6π).
fn sphere_from_its_centre(exam: &mut Examiner, rsm_size: u32) -> Result<()> {
    let ball = rounded(sphere(DVec3::ZERO, 1.0, 64, GREY), DVec3::ZERO);
    let eye_m = dvec3(0.3, 0.2, 0.4);
    let light = amplified(&point_light(DVec3::ZERO), [PI; 3]);
    let mut scene = scene_of(vec![ball], light, eye_m, -eye_m);
    scene.camera.resolution_px = [12, 12];
    // Facets of 1.4° are up to 7.5e-5 of the radius inside the sphere: twice that in 1/d², twice for P and Q.
    const FACETS: f64 = 3e-4;
    // Bound for the mean of some thousand samples.
    const MEAN_BOUND: f64 = 1e-2;
    // The average approaches its limit with the square of the number of texels along an edge.
    let of_sums = FACETS + 2.0 / f64::from(rsm_size).powi(2);
    let truths = [
        (1.0 / (6.0 * PI), of_sums),
        (0.25, of_sums),
        (0.25, TARGET_SLACK * TARGET_ERROR),
    ];
    let ways = with_each_estimator(&scene, rsm_size, TARGET_ERROR);
    for ((estimator, scene), (indirect, bound)) in ways.into_iter().zip(truths) {
        let frame = exam.render(&scene)?;
        for (layer, closed, bound) in [
            (Layer::Indirect, indirect, bound),
            (Layer::Direct, 0.5, FACETS),
        ] {
            let image = values(&frame, layer);
            let error = error_of(image, &vec![closed; image.len()]);
            exam.record(estimator, layer.name(), error, bound);
            if estimator == "final-gather" && layer == Layer::Indirect {
                // Light that is lost everywhere alike does not appear as noise.
                let mean =
                    image.iter().map(|&value| f64::from(value)).sum::<f64>() / image.len() as f64;
                exam.record(estimator, "mean", (mean / closed - 1.0).abs(), MEAN_BOUND);
            }
        }
    }
    if rsm_size > 100 {
        scene.camera.resolution_px = [6, 6];
        exam.sums("against the f64 kernels", &scene, rsm_size, KERNEL_BOUND)?;
    }
    Ok(())
}

/// A lit plate that faces up, and another one below it.
fn no_vpl_above_the_horizon(exam: &mut Examiner) -> Result<()> {
    let plate = |name: &str, y: f64, half: f64| {
        let [z, x] = [DVec3::Z, DVec3::X].map(|axis| 2.0 * half * axis);
        quad(name, dvec3(-half, y, -half), z, x, COLOURED)
    };
    let meshes = vec![plate("upper", 0.0, 0.5), plate("lower", -0.6, 1.5)];
    let light = spot_light(dvec3(0.1, 1.0, 0.05), -DVec3::Y, [10.0, 20.0]);
    let scene = scene_of(meshes, light, dvec3(1.2, 1.1, 1.3), DVec3::ZERO);
    no_indirect_light(exam, "plates", &scene, 0.0)
}

/// A spot that shines away from the scene, and a room that is black.
fn no_vpl_at_all(exam: &mut Examiner) -> Result<()> {
    let away = spot_light(dvec3(0.0, 2.0, 0.0), DVec3::Y, [20.0, 30.0]);
    let mut missed = lit_by(&room(), vec![away]);
    missed.meshes.remove(0);
    let mut black = room();
    for material in &mut black.materials {
        material.kd = [0.0; 3];
    }
    for (what, scene) in [("spot that misses", missed), ("black room", black)] {
        exam.all_black(what, &scene)?;
    }
    Ok(())
}

/// A spot in a closed case of zero thickness, in the middle of the view.
fn every_vpl_hidden(exam: &mut Examiner) -> Result<()> {
    let size = dvec3(0.4, 0.5, 0.3);
    let corner = dvec3(-0.2, -0.2, -0.1);
    let spot = spot_light(corner + 0.6 * size, -DVec3::Y, [30.0, 50.0]);
    let mut scene = lit_by(&room(), vec![spot]);
    let case = cuboid("case", corner, size, COLOURED);
    scene.meshes.push(case.into());
    let frame = exam.render(&with_rays(&scene, 0.1))?;
    let radiance = largest(values(&frame, Layer::Radiance));
    exam.record("", "radiance", radiance, 0.0);
    let claimed = f64::from(frame.stats.estimated_error.is_some());
    exam.record("", "errors stated without light", claimed, 0.0);
    Ok(())
}

/// Two rooms with a slit of 3 cm between them; the lamp is in one room, the camera in the other.
fn through_a_slit(exam: &mut Examiner) -> Result<()> {
    let mut scene = lit_by(&empty_room(), vec![point_light(dvec3(-0.5, 0.2, 0.1))]);
    for z in [-1.0, 0.015] {
        let corner = dvec3(0.0, -1.0, z);
        let wall = quad("wall", corner, 2.0 * DVec3::Y, 0.985 * DVec3::Z, COLOURED);
        scene.meshes.push(wall.into());
    }
    scene.camera.position_m = dvec3(0.9, 0.1, 0.8);
    scene.camera.look_at_m = dvec3(0.3, -0.2, -0.5);
    // The path is rarely found from either end: the reference, too, needs more than a thousand samples per pixel.
    exam.bounce_against(&exam.sampled(&scene, 1024)?, "slit of 3 cm", &scene, 0.1)
}

/// A cube, a ball of flat facets and one with shading normals, lit and seen from outside.
fn single_convex_object(exam: &mut Examiner) -> Result<()> {
    let cube = cuboid("cube", DVec3::splat(-0.5), DVec3::ONE, GREY);
    let ball = globe(0.7, 12, COLOURED);
    let smooth = rounded(ball.clone(), DVec3::ZERO);
    for (what, body, bound_of_sums) in [
        ("cube", cube, 0.0),
        // Its cells are flat only up to rounding, as in `receiver_and_vpl_in_one_plane`.
        ("ball of facets", ball, 1e-7),
        ("smooth ball", smooth, 0.0),
    ] {
        let light = point_light(dvec3(1.1, 1.3, 0.9));
        let scene = scene_of(vec![body], light, dvec3(0.9, 0.8, 1.4), DVec3::ZERO);
        no_indirect_light(exam, what, &scene, bound_of_sums)?;
    }
    Ok(())
}

/// Two plates of 2 m, lit and seen from their open side.
fn wedge(exam: &mut Examiner, opening_deg: f64) -> Result<()> {
    let opening = opening_deg.to_radians();
    let slant = dvec3(opening.cos(), opening.sin(), 0.0);
    let corner = -DVec3::Z;
    let meshes = vec![
        quad("lower", corner, 2.0 * DVec3::Z, 2.0 * DVec3::X, GREY),
        quad("upper", corner, 2.0 * slant, 2.0 * DVec3::Z, COLOURED),
    ];
    let light = point_light(dvec3(2.1, opening, 0.1));
    let eye_m = dvec3(2.2, 1.1 * opening, -0.1);
    let mut scene = scene_of(meshes, light, eye_m, dvec3(0.0, 0.5 * opening, 0.0));
    let fov_y_deg = 2.0 * opening_deg;
    scene.camera.lens = Lens::FovY { fov_y_deg };
    // The light's height over the plates is rounded by 6e-8 m, and the irradiance is proportional to that height. On the plate that is not
    // along the axes, P's height is rounded, too.
    let of_height = 2.0 * 6e-8 / opening;
    exam.direct("", &scene, DIRECT_BOUND + of_height)?;
    // The narrow wedge has no VPLs, so that the sums are 0.
    if opening_deg > 0.1 {
        exam.sums("", &scene, 24, KERNEL_BOUND + of_height)?;
    }
    exam.bounce("", &scene)
}
