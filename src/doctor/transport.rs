//! Light that has no way, one narrow way, or a million of them.

use std::f64::consts::PI;

use glam::DVec3;

use super::{
    Case, Examiner, Measurement,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, TARGET_ERROR, TARGET_SLACK, error_of, largest, values},
    geometry::no_indirect_light,
    scenes::{
        COLOURED, GREY, cuboid, globe, lit_by, point_light, quad, room, rounded, scene_of, sphere,
        spot_light, with_rays, with_sum,
    },
};
use crate::{
    Result, Scene,
    output::Layer,
    scene::{Bands, Lens, Light, Shared, VplSum},
};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "sphere_lit_from_its_centre",
        hazard: "every P sees every Q at every distance: errors of the measure, of 1/d² and of the weights all show",
        remedy: "the closed form is met: 0.5 direct, 0.25 by one bounce, 1/(6π) by the average",
        is_short: true,
        known_issue: None,
        run: |examiner| sphere_from_its_centre(examiner, 32),
    },
    Case {
        name: "no_vpl_above_the_horizon",
        hazard: "sums and densities of nothing: 0/0",
        remedy: "exactly 0",
        is_short: true,
        known_issue: None,
        run: no_vpl_above_the_horizon,
    },
    Case {
        name: "no_vpl_at_all",
        hazard: "a light that misses everything, or a scene without reflectance: lists of VPLs without entries",
        remedy: "sums over nothing are 0",
        is_short: true,
        known_issue: None,
        run: no_vpl_at_all,
    },
    Case {
        name: "every_vpl_hidden",
        hazard: "an error relative to a black image, and draws that never find any light",
        remedy: "black is black: exactly 0, and no error is claimed",
        is_short: true,
        known_issue: None,
        run: every_vpl_hidden,
    },
    Case {
        name: "light_only_through_a_slit",
        hazard: "one direction in a thousand finds light, and so does one VPL in a hundred",
        remedy: "a pilot learns which VPLs bring something where",
        is_short: false,
        known_issue: None,
        run: through_a_slit,
    },
    Case {
        name: "single_convex_object",
        hazard: "points of one convex object do not see each other, but rounding says they do",
        remedy: "both cosines must be positive, and rays start off the surface: exactly 0",
        is_short: true,
        known_issue: None,
        run: single_convex_object,
    },
    Case {
        name: "grazing_receivers_and_vpls",
        hazard: "in a wedge of 1° both cosines are small differences of large numbers",
        remedy: "cosines by the difference P − Q, of which nothing is lost that positions have",
        is_short: true,
        known_issue: None,
        run: wedge,
    },
    Case {
        name: "wedge_of_a_hundredth_of_a_degree",
        hazard: "0.3 mm between plates of 2 m, which no texel of the light's map hits",
        remedy: "directions find what the map has missed",
        is_short: true,
        known_issue: None,
        run: narrow_wedge,
    },
    Case {
        name: "one_and_a_half_million_vpls",
        hazard: "a plain f32 sum of 1.5e6 terms has lost its last four digits; lists outgrow loops and buffers",
        remedy: "sums of three levels; the gather is cut into dispatches",
        is_short: false,
        known_issue: None,
        run: |examiner| sphere_from_its_centre(examiner, 512),
    },
];

/// Unit sphere with k_d = ½, a light of π W/sr at its centre: direct 0.5, bounce 0.25, average 1/(6π).
fn sphere_from_its_centre(examiner: &mut Examiner, rsm_size: u32) -> Result<Measurement> {
    let ball = rounded(sphere(DVec3::ZERO, 1.0, 64, GREY), DVec3::ZERO);
    let eye_m = DVec3::new(0.3, 0.2, 0.4);
    let mut scene = scene_of(vec![ball], point_light(DVec3::ZERO), eye_m, -eye_m);
    scene.camera.resolution_px = [12, 12];
    if let [Light::Point { power_w, .. }] = &mut scene.lights[..] {
        *power_w = [4.0 * PI * PI; 3];
    }
    // Facets of 1.4° lie up to 7.5e-5 of the radius inside the sphere: twice that in 1/d², twice for P and Q.
    const FACETS: f64 = 3e-4;
    // The average tends to its limit with the square of the texels.
    let of_texels = 2.0 / f64::from(rsm_size).powi(2);
    let [average, radiosity] = [1.0 / (6.0 * PI), 0.25];
    let sum = |estimator| with_sum(&scene, estimator, rsm_size);
    let ways = [
        (
            "rsm-average",
            sum(VplSum::RsmAverage),
            average,
            FACETS + of_texels,
        ),
        (
            "instant-radiosity",
            sum(VplSum::InstantRadiosity),
            radiosity,
            FACETS + of_texels,
        ),
        (
            "final-gather",
            with_rays(&scene, TARGET_ERROR),
            radiosity,
            TARGET_SLACK * TARGET_ERROR,
        ),
    ];
    let mut parts = Vec::new();
    for (what, scene, closed, bound) in ways {
        let frame = examiner.render(&scene)?;
        for (layer, closed, bound) in [
            (Layer::Indirect, closed, bound),
            (Layer::Direct, 0.5, FACETS),
        ] {
            let image = values(&frame, layer);
            let truth: Vec<Bands> = vec![[closed; 3]; image.len() / 3];
            let what = format!("{what}, {}", layer.name());
            parts.push(Measurement::new(what, error_of(image, &truth), bound));
        }
    }
    if rsm_size > 100 {
        scene.camera.resolution_px = [6, 6];
        parts.push(examiner.sums("against the f64 kernels", &scene, rsm_size, KERNEL_BOUND)?);
    }
    Ok(Measurement::of(parts))
}

/// A lit plate that looks up, and another one below it.
fn no_vpl_above_the_horizon(examiner: &mut Examiner) -> Result<Measurement> {
    let plate = |name: &str, y: f64, half: f64| {
        let corner = DVec3::new(-half, y, -half);
        quad(
            name,
            corner,
            2.0 * half * DVec3::Z,
            2.0 * half * DVec3::X,
            COLOURED,
        )
    };
    let meshes = vec![plate("upper", 0.0, 0.5), plate("lower", -0.6, 1.5)];
    let light = spot_light(DVec3::new(0.1, 1.0, 0.05), -DVec3::Y, [10.0, 20.0]);
    let eye_m = DVec3::new(1.2, 1.1, 1.3);
    no_indirect_light(examiner, &scene_of(meshes, light, eye_m, DVec3::ZERO), 0.0)
}

/// A spot that shines away from the scene, and a room that is black.
fn no_vpl_at_all(examiner: &mut Examiner) -> Result<Measurement> {
    let mut open = room();
    open.meshes.remove(0);
    let away = spot_light(DVec3::new(0.0, 2.0, 0.0), DVec3::Y, [20.0, 30.0]);
    let missed = lit_by(&open, vec![away]);
    let mut black = room();
    for material in &mut black.materials {
        material.kd = [0.0; 3];
    }
    let mut parts = Vec::new();
    for (what, scene) in [("spot that misses", missed), ("black room", black)] {
        for scene in [
            with_sum(&scene, VplSum::RsmAverage, 16),
            with_sum(&scene, VplSum::InstantRadiosity, 16),
            with_rays(&scene, 0.1),
        ] {
            let radiance = largest(values(&examiner.render(&scene)?, Layer::Radiance));
            parts.push(Measurement::new(format!("{what}, radiance"), radiance, 0.0));
        }
    }
    Ok(Measurement::of(parts))
}

/// A spot in a closed case without thickness, in the middle of what the camera sees.
fn every_vpl_hidden(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    let size = DVec3::new(0.4, 0.5, 0.3);
    let corner = DVec3::new(-0.2, -0.2, -0.1);
    scene
        .meshes
        .push(cuboid("case", corner, size, COLOURED).into());
    let at = corner + 0.6 * size;
    scene.lights = vec![spot_light(at, -DVec3::Y, [30.0, 50.0])];
    let frame = examiner.render(&with_rays(&scene, 0.1))?;
    let radiance = largest(values(&frame, Layer::Radiance));
    let claimed = f64::from(frame.stats.estimated_error.is_some());
    Ok(Measurement::of([
        Measurement::new("radiance", radiance, 0.0),
        Measurement::new("errors claimed of nothing", claimed, 0.0),
    ]))
}

/// Two rooms, a lamp in the one and the camera in the other, and a slit of 3 cm between them.
fn through_a_slit(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    scene.meshes.truncate(1);
    let wall = |name: &str, from: f64, to: f64| {
        let corner = DVec3::new(0.0, -1.0, from);
        quad(
            name,
            corner,
            2.0 * DVec3::Y,
            (to - from) * DVec3::Z,
            COLOURED,
        )
    };
    scene
        .meshes
        .extend([wall("wall", -1.0, -0.015), wall("wall", 0.015, 1.0)].map(Shared::from));
    scene.lights = vec![point_light(DVec3::new(-0.5, 0.2, 0.1))];
    scene.camera.position_m = DVec3::new(0.9, 0.1, 0.8);
    scene.camera.look_at_m = DVec3::new(0.3, -0.2, -0.5);
    // Found seldom from either end: the reference, too, needs a thousand samples a pixel and more.
    examiner.bounce_within("slit of 3 cm", &scene, 0.1, 1024)
}

/// A cube, a ball of flat facets and one with shading normals, lit and seen from outside.
fn single_convex_object(examiner: &mut Examiner) -> Result<Measurement> {
    let ball = globe(0.7, 12, COLOURED);
    let bodies = [
        (
            "cube",
            cuboid("cube", DVec3::splat(-0.5), DVec3::ONE, GREY),
            0.0,
        ),
        // Its cells are flat to rounding only, as in `receiver_and_vpl_in_one_plane`.
        ("ball of facets", ball.clone(), 1e-7),
        ("smooth ball", rounded(ball, DVec3::ZERO), 0.0),
    ];
    let mut parts = Vec::new();
    for (what, body, bound_of_sums) in bodies {
        let light = point_light(DVec3::new(1.1, 1.3, 0.9));
        let scene: Scene = scene_of(vec![body], light, DVec3::new(0.9, 0.8, 1.4), DVec3::ZERO);
        let measured = no_indirect_light(examiner, &scene, bound_of_sums)?;
        parts.push(measured.prefixed(what));
    }
    Ok(Measurement::of(parts))
}

/// Two plates of 2 m, lit and seen from the side on which they open.
fn wedge_of(opening: f64) -> Scene {
    let slant = DVec3::new(opening.cos(), opening.sin(), 0.0);
    let corner = DVec3::new(0.0, 0.0, -1.0);
    let meshes = vec![
        quad("lower", corner, 2.0 * DVec3::Z, 2.0 * DVec3::X, GREY),
        quad("upper", corner, 2.0 * slant, 2.0 * DVec3::Z, COLOURED),
    ];
    let light = point_light(DVec3::new(2.1, opening, 0.1));
    let eye_m = DVec3::new(2.2, 1.1 * opening, -0.1);
    let mut scene = scene_of(meshes, light, eye_m, DVec3::new(0.0, 0.5 * opening, 0.0));
    scene.camera.lens = Lens::FovY {
        fov_y_deg: 2.0 * opening.to_degrees(),
    };
    scene
}

/// The light's height over the plates is rounded by 6e-8 m, and what they receive is in proportion to it; P's is, too, on the
/// plate that is not along the axes.
fn rounding_of_height(opening: f64) -> f64 {
    2.0 * 6e-8 / opening
}

fn wedge(examiner: &mut Examiner) -> Result<Measurement> {
    let opening = f64::to_radians(1.0);
    let scene = wedge_of(opening);
    let of_height = rounding_of_height(opening);
    Ok(Measurement::of([
        examiner.direct("", &scene, DIRECT_BOUND + of_height)?,
        examiner.sums("", &scene, 24, KERNEL_BOUND + of_height)?,
        examiner.bounce("", &scene)?,
    ]))
}

/// There are no VPLs, and so the sums are 0.
fn narrow_wedge(examiner: &mut Examiner) -> Result<Measurement> {
    let opening = f64::to_radians(0.01);
    let scene = wedge_of(opening);
    Ok(Measurement::of([
        examiner.direct("", &scene, DIRECT_BOUND + rounding_of_height(opening))?,
        examiner.bounce("", &scene)?,
    ]))
}
