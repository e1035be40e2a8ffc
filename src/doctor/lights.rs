//! Lights on surfaces, in boxes, in the camera's place; needles and half spaces of cones; nothing, too much and too many.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::{
    Case, Examiner, Measurement, cones,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, bands_of, error_of, largest, values},
    scenes::{
        COLOURED, GREY, amplified, cuboid, directional_light, grid, lit_by, point_light, quad,
        room, scene_of, spot_light, turned, with_rays, with_sum,
    },
};
use crate::{
    Result, Scene,
    output::Layer,
    reference::Reference,
    scene::{Bands, Lens, Light, VplSum},
};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "light_a_millimetre_above_a_surface",
        hazard: "irradiance of 1e6 times the rest of the image, a depth of 1 mm in a map, a shadow bias that swallows it",
        remedy: "shadow rays start from the surface, with errors that do not depend on how near the light is",
        is_short: true,
        known_issue: None,
        run: light_a_millimetre_above,
    },
    Case {
        name: "light_on_a_surface_along_the_axes",
        hazard: "the floor that the light lies in hides the whole room",
        remedy: "what a light lies in is not in its way",
        is_short: true,
        known_issue: None,
        run: |examiner| light_on_a_surface(examiner, 0.0),
    },
    Case {
        name: "light_on_a_tilted_surface",
        hazard: "rounding puts the light below its floor, which then hides the whole room",
        remedy: "a plane that the light lies in but for rounding is not in its way",
        is_short: true,
        known_issue: None,
        run: |examiner| light_on_a_surface(examiner, 0.23),
    },
    Case {
        name: "light_in_a_corner_of_a_mesh",
        hazard: "three faces meet in the light: all of them are level with it, and its distance to them is 0",
        remedy: "what a light lies in is not in its way, and has no cosine",
        is_short: true,
        known_issue: None,
        run: light_in_a_corner,
    },
    Case {
        name: "spot_mounted_on_a_tilted_ceiling",
        hazard: "rounding puts the lamp behind the ceiling that it is mounted on, which then hides the whole room",
        remedy: "a plane that the light lies in but for rounding is not in its way",
        is_short: true,
        known_issue: None,
        run: spot_on_a_ceiling,
    },
    Case {
        name: "light_inside_closed_geometry",
        hazard: "light leaks through the edges and corners of a closed box",
        remedy: "edges are decided alike by both neighbours",
        is_short: true,
        known_issue: None,
        run: light_inside_a_box,
    },
    Case {
        name: "light_at_the_camera",
        hazard: "light and view along one ray: every pixel is its own shadow's edge (time-of-flight cameras)",
        remedy: "the shadow test starts off the surface by its own rounding bound",
        is_short: true,
        known_issue: None,
        run: light_at_the_camera,
    },
    Case {
        name: "spot_of_half_a_degree",
        hazard: "acos of a cosine loses half the digits; of a map over a hemisphere a few texels are lit",
        remedy: "angles by the arctangent, an RSM over the cone and no more, ΔΩ by exact integrals",
        is_short: true,
        known_issue: None,
        run: cones::spot_of_half_a_degree,
    },
    Case {
        name: "narrowest_spot",
        hazard: "a cone of 1e-4°: 60 of f32's steps of direction from side to side",
        remedy: "its power is exact, and so is all that it lights by way of others; its rim is rounded",
        is_short: true,
        known_issue: None,
        run: cones::narrowest_spot,
    },
    Case {
        name: "spot_of_179_degrees",
        hazard: "a perspective map of 179° has texels of no use; wider than 180° there is none",
        remedy: "cones over 60° are cut into the faces of a cube",
        is_short: false,
        known_issue: None,
        run: cones::wide_spots,
    },
    Case {
        name: "spot_with_equal_cones",
        hazard: "a penumbra of width 0 divides 0 by 0",
        remedy: "its inverse is finite: 0 · 1e30 is no falloff",
        is_short: false,
        known_issue: None,
        run: cones::equal_cones,
    },
    Case {
        name: "edge_of_the_cone_inside_one_texel",
        hazard: "a texel counts as lit or not by its centre, and power is lost or made",
        remedy: "the part of each texel inside the cone and the falloff over it are exact integrals",
        is_short: true,
        known_issue: None,
        run: cones::cone_inside_a_texel,
    },
    Case {
        name: "spot_axis_along_every_edge_of_the_cube",
        hazard: "a basis built from the axis and `up` vanishes where they are parallel; faces change hands at edges and corners",
        remedy: "a basis without a preferred axis; faces that the cone only touches are counted",
        is_short: false,
        known_issue: None,
        run: cones::axes_of_the_cube,
    },
    Case {
        name: "directional_light_at_89_99_degrees",
        hazard: "cosines of 1.7e-4 keep four digits of f32, and shadows are 6 000 times as long as what throws them",
        remedy: "f32 directions to 6e-8: the error is that over the cosine and no more",
        is_short: true,
        known_issue: None,
        run: grazing_directional,
    },
    Case {
        name: "point_light_a_hundred_thousand_kilometres_away",
        hazard: "a scene that is smaller than a texel of the light's map; planes through a far light lose the scene in rounding",
        remedy: "what is in the way is computed from the side of the surface",
        is_short: true,
        known_issue: None,
        run: far_light,
    },
    Case {
        name: "shadow_map_of_a_light_far_away",
        hazard: "all of the scene lies between two texels of a map over all directions",
        remedy: "nothing: shadow = \"rays\" is for that",
        is_short: true,
        known_issue: Some(
            "the map of a point light covers the whole sphere, so that from afar it sees nothing, and nothing throws a shadow",
        ),
        run: map_of_far_light,
    },
    Case {
        name: "power_from_a_trillionth_of_a_watt_to_a_trillion",
        hazard: "products of power, solid angle and falloff leave the range of f32",
        remedy: "lengths near 1 by the local space, so that only the power itself is large or small",
        is_short: true,
        known_issue: None,
        run: extreme_powers,
    },
    Case {
        name: "light_without_power",
        hazard: "densities in proportion to power are 0/0",
        remedy: "exactly 0, and a warning that names the light",
        is_short: false,
        known_issue: None,
        run: no_power,
    },
    Case {
        name: "sixty_four_lights",
        hazard: "errors and memory that grow with the number of lights; noise shared out badly among them",
        remedy: "lights share the draws by what they bring; sums keep their three levels",
        is_short: true,
        known_issue: None,
        run: sixty_four_lights,
    },
];

fn light_a_millimetre_above(examiner: &mut Examiner) -> Result<Measurement> {
    let light_m = DVec3::new(-0.23, -0.999, 0.31);
    let scene = lit_by(&room(), vec![point_light(light_m)]);
    // f32 moves P and L by 6e-8 m each; over 1 mm that is 1.2e-4, and irradiance goes with the cube: d⁻³ times the height.
    let bound = 3.0 * 1.2e-7 / 1e-3;
    let mut parts = vec![
        examiner.direct("1 mm", &scene, bound)?,
        examiner.sums("1 mm", &scene, 24, KERNEL_BOUND + 1.2e-4)?,
        examiner.bounce("1 mm", &scene)?,
    ];
    parts.push(examiner.direct_by_map("1 mm", &scene, bound)?);
    Ok(Measurement::of(parts))
}

/// In the floor itself: what is above is lit as by a lamp a nanometre above, wherever rounding puts it.
fn light_on_a_surface(examiner: &mut Examiner, tilt: f64) -> Result<Measurement> {
    let along = DVec3::new(3.0, tilt, 0.4 * tilt);
    let across = DVec3::new(0.0, 0.31 * tilt, 3.0);
    let corner = DVec3::new(-1.5, -0.63, -1.5);
    let above = across.cross(along).normalize();
    let mut scene = room();
    scene.meshes.truncate(1);
    scene
        .meshes
        .push(quad("floor", corner, along, across, COLOURED).into());
    scene.camera.look_at_m = DVec3::new(0.0, -0.2, -0.6);
    let mut parts = Vec::new();
    for (u, v) in [(0.37, 0.61), (0.5, 0.5), (0.61, 0.43)] {
        let at = corner + u * along + v * across;
        scene.lights = vec![point_light(at)];
        let frame = examiner.render(&scene)?;
        let lifted = lit_by(&scene, vec![point_light(at + 1e-9 * above)]);
        let truth = Reference::new(&lifted, 1)?.frame();
        let error = error_of(
            values(&frame, Layer::Direct),
            &bands_of(values(&truth, Layer::Direct), 1.0),
        );
        // Whether P lies 1e-7 m above the lamp or below is not known; the nearest pixels are 5 cm from it, where that is
        // 1e-7/d³ = 1e-3 W/m² more or less. Along the axes P and lamp have the same height, bit for bit.
        let bound = if tilt == 0.0 { 2e-5 } else { 1e-3 };
        let what = format!("lamp at ({u}, {v})");
        let direct = format!("{what}, direct");
        parts.push(Measurement::new(direct, error, bound));
        parts.push(examiner.sums(&what, &scene, 24, KERNEL_BOUND)?);
        // Half of its light goes below the floor. A lamp above, however near, would shine on the floor under it instead.
        let half_sphere = spot_light(at + 1e-9 * above, above, [90.0, 90.0]);
        let upper = lit_by(&scene, vec![amplified(half_sphere, [0.5; 3])]);
        parts.push(examiner.bounce_like(&what, &scene, &upper)?);
    }
    Ok(Measurement::of(parts))
}

/// In the upper corner of a box, along the axes and turned: as a lamp a nanometre outside.
fn light_in_a_corner(examiner: &mut Examiner) -> Result<Measurement> {
    let mut parts = Vec::new();
    let turns = [
        ("along the axes", DMat3::IDENTITY),
        (
            "turned",
            DMat3::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 0.4),
        ),
    ];
    for (what, turn) in turns {
        let upright = room();
        let corner_m = upright.meshes[1].positions_m[7];
        let outside_m = corner_m + 1e-9 * DVec3::ONE;
        let [scene, outside] =
            [corner_m, outside_m].map(|at| turned(&lit_by(&upright, vec![point_light(at)]), turn));
        // As on a tilted surface: on which side of the lamp P lies on the box's own faces is not known.
        parts.push(examiner.layer(what, &scene, (&outside, Layer::Direct), 1e-3)?);
        parts.push(examiner.sums(what, &scene, 24, KERNEL_BOUND)?);
    }
    Ok(Measurement::of(parts))
}

/// Its cone does not touch the ceiling, so that direct and indirect light are those of a spot a nanometre below it.
fn spot_on_a_ceiling(examiner: &mut Examiner) -> Result<Measurement> {
    let along = DVec3::new(1.9, 0.31, 0.17);
    let across = DVec3::new(-0.23, 0.13, 1.9);
    let corner = DVec3::new(-0.9, 0.4, -0.95);
    let down = along.cross(across).normalize();
    let mut scene = room();
    scene
        .meshes
        .push(quad("ceiling", corner, along, across, COLOURED).into());
    let mut parts = Vec::new();
    for (u, v) in [(0.37, 0.61), (0.5, 0.5), (0.61, 0.43), (0.41, 0.47)] {
        let at = corner + u * along + v * across;
        scene.lights = vec![spot_light(at, down, [30.0, 50.0])];
        let lifted = lit_by(
            &scene,
            vec![spot_light(at + 1e-9 * down, down, [30.0, 50.0])],
        );
        let what = format!("lamp at ({u}, {v})");
        // Lamp and P are rounded to 6e-8 m each, and what is lit is at least 2 cm from the lamp.
        let of_lifted = (&lifted, Layer::Direct);
        parts.push(examiner.layer(&what, &scene, of_lifted, 2e-5)?);
        let [sum, of_lifted] =
            [&scene, &lifted].map(|scene| with_sum(scene, VplSum::InstantRadiosity, 24));
        let below = lit_by(
            &of_lifted,
            vec![spot_light(at + 1e-5 * down, down, [30.0, 50.0])],
        );
        let truth = examiner.render(&below)?;
        let truth = bands_of(values(&truth, Layer::Indirect), 1.0);
        let error = error_of(values(&examiner.render(&sum)?, Layer::Indirect), &truth);
        // The VPLs move by 1e-5 m with it, and those near a corner bring more or less.
        let what = format!("{what}, instant-radiosity");
        parts.push(Measurement::new(what, error, 1e-2));
    }
    Ok(Measurement::of(parts))
}

/// A lamp in a box in a room: outside the box everything is black.
fn light_inside_a_box(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    let bright = largest(values(&examiner.render(&scene)?, Layer::Direct));
    let size = DVec3::new(0.3, 0.2, 0.25);
    let centre = DVec3::new(-0.2, 0.3, -0.1);
    scene
        .meshes
        .push(cuboid("case", centre - 0.5 * size, size, COLOURED).into());
    let mut parts = Vec::new();
    for at in [DVec3::ZERO, DVec3::splat(0.01), 0.49 * size] {
        scene.lights = vec![point_light(centre + at)];
        parts.push(examiner.leaks(&scene, bright)?);
        // To sums the box is no obstacle.
        parts.push(examiner.sums("", &scene, 24, KERNEL_BOUND)?);
    }
    Ok(Measurement::of(parts))
}

fn light_at_the_camera(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    scene.lights = vec![point_light(scene.camera.position_m)];
    let mut parts = vec![examiner.all("no offset", &scene, 24)?];
    scene.lights = vec![point_light(
        scene.camera.position_m + DVec3::new(0.0, 0.01, 0.0),
    )];
    parts.push(examiner.all("1 cm", &scene, 24)?);
    Ok(Measurement::of(parts))
}

/// Over a floor, level and tilted, without and with a block on it; closed form: E·cosθ·k_d/π, where k_d is ½.
fn grazing_directional(examiner: &mut Examiner) -> Result<Measurement> {
    let angle = f64::to_radians(89.99);
    let mut parts = Vec::new();
    for (what, tilt) in [("level", 0.0), ("tilted", 0.37)] {
        let turn = glam::DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), tilt);
        let plane = [DVec3::new(-1.0, 0.0, -1.0), 2.0 * DVec3::Z, 2.0 * DVec3::X];
        let floor = grid("floor", plane.map(|v| turn * v), [3, 3], GREY);
        let direction = turn * DVec3::new(angle.sin(), -angle.cos(), 0.0);
        let eye_m = turn * DVec3::new(0.2, 1.0, 0.3);
        let light = directional_light(direction);
        let mut scene = scene_of(vec![floor], light, eye_m, DVec3::ZERO);
        scene.camera.lens = Lens::FovY { fov_y_deg: 40.0 };
        let frame = examiner.render(&scene)?;
        let direct = values(&frame, Layer::Direct);
        let closed: Vec<Bands> = vec![[PI * angle.cos() * 0.5 / PI; 3]; direct.len() / 3];
        // Normal and direction are each off by up to 1e-7, over a cosine of 1.7e-4.
        let bound = DIRECT_BOUND + 2.0 * 1e-7 / angle.cos();
        let error = error_of(direct, &closed);
        parts.push(Measurement::new(
            format!("{what} floor, direct"),
            error,
            bound,
        ));
        // Its shadow would reach 600 m.
        let block = cuboid(
            "block",
            DVec3::new(-0.2, 0.0, -0.3),
            DVec3::new(0.3, 0.4, 0.4),
            COLOURED,
        );
        if tilt == 0.0 {
            scene.meshes.push(block.into());
            parts.push(examiner.direct("floor and block", &scene, bound)?);
            parts.push(examiner.sums("floor and block", &scene, 24, KERNEL_BOUND)?);
            parts.push(examiner.bounce("floor and block", &scene)?);
        }
    }
    Ok(Measurement::of(parts))
}

/// As bright as a lamp of 12 W at 1 m, from twice the height of a geostationary orbit and more, through an open side.
fn room_lit_from_afar() -> Scene {
    let distance_m = 1e8;
    let mut scene = room();
    let back = DVec3::splat(-1.0);
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| 2.0 * axis);
    scene.meshes[0] = quad("floor", back, z, x, GREY).into();
    scene.meshes.push(quad("back", back, x, y, COLOURED).into());
    let towards = DVec3::new(0.43, 0.61, 0.67).normalize();
    let light = point_light(distance_m * towards);
    scene.lights = vec![amplified(light, [distance_m * distance_m; 3])];
    scene
}

fn far_light(examiner: &mut Examiner) -> Result<Measurement> {
    let scene = room_lit_from_afar();
    Ok(Measurement::of([
        examiner.direct("1e8 m", &scene, DIRECT_BOUND)?,
        examiner.bounce("1e8 m", &scene)?,
    ]))
}

fn map_of_far_light(examiner: &mut Examiner) -> Result<Measurement> {
    examiner.direct_by_map("1e8 m", &room_lit_from_afar(), DIRECT_BOUND)
}

/// A power of two as the factor is the same image times that factor, bit for bit: nothing is rounded otherwise, as long as no
/// number leaves the range of normal ones and nothing small is compared with a constant.
fn extreme_powers(examiner: &mut Examiner) -> Result<Measurement> {
    let scene = room();
    let light = scene.lights[0];
    let ways = |factor: f64| {
        let lit = lit_by(&scene, vec![amplified(light, [factor; 3])]);
        [
            ("rsm-average", with_sum(&lit, VplSum::RsmAverage, 16)),
            (
                "instant-radiosity",
                with_sum(&lit, VplSum::InstantRadiosity, 16),
            ),
            ("final-gather", with_rays(&lit, 0.1)),
        ]
    };
    let mut truths = Vec::new();
    for (_, scene) in ways(1.0) {
        truths.push(examiner.render(&scene)?);
    }
    let mut parts = Vec::new();
    for factor in [2f64.powi(-40), 2f64.powi(40)] {
        for ((what, scene), truth) in ways(factor).iter().zip(&truths) {
            let frame = examiner.render(scene)?;
            let scaled = bands_of(values(truth, Layer::Radiance), factor);
            let error = error_of(values(&frame, Layer::Radiance), &scaled);
            parts.push(Measurement::new(
                format!("{factor:.0e} times, {what}"),
                error,
                0.0,
            ));
        }
    }
    Ok(Measurement::of(parts))
}

fn no_power(examiner: &mut Examiner) -> Result<Measurement> {
    let room = room();
    let light = room.lights[0];
    let dark = amplified(light, [0.0; 3]);
    let ways = |lights: Vec<Light>| {
        let lit = lit_by(&room, lights);
        [
            with_sum(&lit, VplSum::RsmAverage, 16),
            with_sum(&lit, VplSum::InstantRadiosity, 16),
            with_rays(&lit, 0.1),
        ]
    };
    let mut parts = Vec::new();
    for scene in ways(vec![dark]) {
        let radiance = largest(values(&examiner.render(&scene)?, Layer::Radiance));
        parts.push(Measurement::new("alone, radiance", radiance, 0.0));
        let is_told = scene.warnings().iter().any(|text| text.contains("light 0"));
        parts.push(Measurement::new(
            "warnings that are missing",
            f64::from(!is_told),
            0.0,
        ));
    }
    let beside = lit_by(&room, vec![dark, light]);
    parts.push(examiner.bounce("beside another light", &beside)?);
    Ok(Measurement::of(parts))
}

/// Point lights, spots and parallel light in turn, of powers from 1 to 1/64.
fn sixty_four_lights(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    scene.meshes[0] = quad(
        "floor",
        DVec3::splat(-1.0),
        2.0 * DVec3::Z,
        2.0 * DVec3::X,
        GREY,
    )
    .into();
    scene.lights = (0..64)
        .map(|i: u32| {
            let [column, row] = [i % 8, i / 8].map(|n| -0.8 + 0.2 * f64::from(n) + 0.013);
            let at = DVec3::new(column, 0.6 + 0.1 * column * row, row);
            let down = DVec3::new(0.2 * row, -1.0, 0.3 * column);
            let light = match i % 3 {
                0 => point_light(at),
                1 => spot_light(at, down, [15.0, 35.0]),
                _ => directional_light(down),
            };
            amplified(
                light,
                [1.0 / f64::from(i + 1), 0.5, 1.0 / f64::from(64 - i)],
            )
        })
        .collect();
    Ok(Measurement::of([
        examiner.direct("room without walls", &scene, DIRECT_BOUND)?,
        examiner.sums("room without walls", &scene, 8, KERNEL_BOUND)?,
        examiner.bounce_within("room without walls", &scene, 0.05, 32)?,
    ]))
}
