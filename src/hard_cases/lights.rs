//! Lights on surfaces, in boxes and at the camera; very narrow and very wide cones; no light, extreme powers and many lights.

use std::f64::consts::PI;

use glam::{DMat3, DQuat, DVec3, dvec3};

use super::{
    Case, Examiner,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, TARGET_ERROR, error_of, largest, values},
    scenes::{
        COLOURED, GREY, amplified, cuboid, directional_light, empty_room, grid, lit_by,
        point_light, quad, room, scene_of, spot_light, turned, with_each_estimator, with_sum,
    },
};
use crate::{
    Result, Scene,
    internals::f64_kernels,
    model::CompensatedSum,
    output::Layer,
    scene::{Lens, VplSum},
};

pub const CASES: &[Case] = &[
    Case::new(
        "light_a_millimetre_above_a_surface",
        "irradiance of 1e6 times the rest of the image, a depth of 1 mm in a map, a shadow bias larger than that",
        "shadow rays start from the surface; their error does not depend on the light's distance",
        light_a_millimetre_above,
    ),
    Case::new(
        "light_on_a_surface_along_the_axes",
        "the floor that contains the light hides the whole room",
        "a surface that contains the light does not block it",
        |exam| light_on_a_surface(exam, 0.0),
    ),
    Case::new(
        "light_on_a_tilted_surface",
        "rounding puts the light below its floor, which then hides the whole room",
        "a plane that contains the light, to within rounding, does not block it",
        |exam| light_on_a_surface(exam, 0.23),
    ),
    Case::new(
        "light_in_a_corner_of_a_mesh",
        "three faces meet at the light: it is in the plane of each, at distance 0",
        "a surface that contains the light does not block it and receives nothing from it",
        light_in_a_corner,
    ),
    Case::new(
        "spot_mounted_on_a_tilted_ceiling",
        "rounding puts the lamp behind its ceiling, which then hides the whole room",
        "a plane that contains the light, to within rounding, does not block it",
        spot_on_a_ceiling,
    ),
    Case::new(
        "light_inside_closed_geometry",
        "light leaks through the edges and corners of a closed box",
        "edge tests agree between neighbouring triangles",
        light_inside_a_box,
    ),
    Case::new(
        "light_at_the_camera",
        "light and view share one ray, so every pixel is at the edge of its own shadow (time-of-flight cameras)",
        "the shadow test starts off the surface by its own rounding bound",
        light_at_the_camera,
    ),
    Case::new(
        "spot_of_half_a_degree",
        "acos of a cosine loses half the digits; in a map over a hemisphere only a few texels are lit",
        "angles by the arctangent, an RSM over the cone only, ΔΩ by exact integrals",
        spot_of_half_a_degree,
    ),
    Case::new(
        "narrowest_spot",
        "a cone of 1e-4° is 60 steps of an f32 direction wide",
        "its power and its indirect light are exact; its rim is rounded",
        narrowest_spot,
    ),
    Case::new(
        "spot_of_179_degrees",
        "a perspective map of 179° has useless texels; over 180° no such map exists",
        "cones over 60° are split into the faces of a cube",
        wide_spots,
    )
    .long(),
    Case::new(
        "spot_with_equal_cones",
        "a penumbra of width 0 divides 0 by 0",
        "the inverse width is finite: 0 · 1e30 means no falloff",
        equal_cones,
    )
    .long(),
    Case::new(
        "edge_of_the_cone_inside_one_texel",
        "a texel's centre decides whether it is lit, so power is lost or added",
        "the part of each texel inside the cone, and the falloff over it, are exact integrals",
        cone_inside_a_texel,
    ),
    Case::new(
        "spot_axis_along_every_edge_of_the_cube",
        "a basis built from the axis and `up` vanishes where they are parallel; the cube's face changes at edges and corners",
        "the basis has no preferred axis; faces that the cone only touches are counted",
        axes_of_the_cube,
    )
    .long(),
    Case::new(
        "directional_light_at_89_99_degrees",
        "cosines of 1.7e-4 keep four digits of f32, and shadows are 6 000 times as long as their objects",
        "f32 directions are exact to 6e-8: the error is 6e-8 over the cosine and no more",
        grazing_directional,
    ),
    Case::new(
        "point_light_a_hundred_thousand_kilometres_away",
        "the scene is smaller than a texel of the light's map; planes through a far light lose the scene in rounding",
        "occlusion is computed from the surface's side",
        far_light,
    ),
    Case::new(
        "shadow_map_of_a_light_far_away",
        "the whole scene is between two texels of a map over all directions",
        "nothing: use shadow = \"rays\"",
        |exam| exam.direct_by_map("1e8 m", &room_lit_from_afar(), DIRECT_BOUND),
    )
    .with_known_issue("a point light's map covers the whole sphere; from afar no texel sees the scene, and nothing throws a shadow"),
    Case::new(
        "power_from_a_trillionth_of_a_watt_to_a_trillion",
        "products of power, solid angle and falloff leave the range of f32",
        "the local space keeps lengths near 1, so only the power itself is large or small",
        extreme_powers,
    ),
    Case::new(
        "light_without_power",
        "densities proportional to power are 0/0",
        "its light is exactly 0, and a warning names it",
        no_power,
    )
    .long(),
    Case::new(
        "sixty_four_lights",
        "errors and memory that grow with the number of lights; noise shared badly among them",
        "lights share the samples by their contribution; sums keep their three levels",
        sixty_four_lights,
    ),
];

fn light_a_millimetre_above(exam: &mut Examiner) -> Result<()> {
    let scene = lit_by(&room(), vec![point_light(dvec3(-0.23, -0.999, 0.31))]);
    // f32 rounds P and L by 6e-8 m each; over 1 mm that is 1.2e-4. Irradiance changes with the cube: d⁻³ times the height.
    let bound = 3.0 * 1.2e-7 / 1e-3;
    exam.direct("1 mm", &scene, bound)?;
    exam.sums("1 mm", &scene, 24, KERNEL_BOUND + 1.2e-4)?;
    exam.bounce("1 mm", &scene)?;
    exam.direct_by_map("1 mm", &scene, bound)
}

/// A lamp exactly in the floor. Surfaces above it are lit as by a lamp a nanometre above the floor, wherever rounding puts it.
fn light_on_a_surface(exam: &mut Examiner, tilt: f64) -> Result<()> {
    let along = dvec3(3.0, tilt, 0.4 * tilt);
    let across = dvec3(0.0, 0.31 * tilt, 3.0);
    let corner = dvec3(-1.5, -0.63, -1.5);
    let above = across.cross(along).normalize();
    let mut room = empty_room();
    let floor = quad("floor", corner, along, across, COLOURED);
    room.meshes.push(floor.into());
    room.camera.look_at_m = dvec3(0.0, -0.2, -0.6);
    for (u, v) in [(0.37, 0.61), (0.5, 0.5), (0.61, 0.43)] {
        let at = corner + u * along + v * across;
        let lifted = at + 1e-9 * above;
        let scene = lit_by(&room, vec![point_light(at)]);
        let frame = exam.render(&scene)?;
        let truth = exam.unsampled(&lit_by(&room, vec![point_light(lifted)]))?;
        let [direct, truth] = [&frame, &truth].map(|frame| values(frame, Layer::Direct));
        // Rounding decides whether P is 1e-7 m above or below the lamp. The nearest pixels are 5 cm from it, so that the error is 1e-7/d³ =
        // 1e-3 W/m². Along the axes, P and the lamp have the same height, bit for bit.
        let bound = if tilt == 0.0 { 2e-5 } else { 1e-3 };
        let what = format!("lamp at ({u}, {v})");
        exam.record(&what, "direct", error_of(direct, truth), bound);
        exam.sums(&what, &scene, 24, KERNEL_BOUND)?;
        // Half of the lamp's light goes below the floor. A lamp above the floor, however near, would instead light the floor below it.
        let half_sphere = spot_light(lifted, above, [90.0, 90.0]);
        let upper = lit_by(&room, vec![amplified(&half_sphere, [0.5; 3])]);
        let truth = exam.sampled_enough(&upper)?;
        exam.bounce_against(&truth, &what, &scene, TARGET_ERROR)?;
    }
    Ok(())
}

/// A lamp in the upper corner of a box, along the axes and turned: lights the scene like a lamp a nanometre outside the box.
fn light_in_a_corner(exam: &mut Examiner) -> Result<()> {
    let turn = DMat3::from_axis_angle(dvec3(0.48, 0.6, 0.64), 0.4);
    let upright = room();
    let corner_m = upright.meshes[1].positions_m[7];
    for (what, turn) in [("along the axes", DMat3::IDENTITY), ("turned", turn)] {
        let [scene, outside] = [corner_m, corner_m + 1e-9]
            .map(|at| turned(&lit_by(&upright, vec![point_light(at)]), turn));
        let error = exam.error_against(&exam.unsampled(&outside)?, &scene, Layer::Direct)?;
        // As on a tilted surface, rounding decides on which side of the lamp P is on the box's own faces.
        exam.record(what, "direct", error, 1e-3);
        exam.sums(what, &scene, 24, KERNEL_BOUND)?;
    }
    Ok(())
}

/// The cone does not touch the ceiling, so that direct and indirect light equal those of a spot a nanometre below it.
fn spot_on_a_ceiling(exam: &mut Examiner) -> Result<()> {
    let along = dvec3(1.9, 0.31, 0.17);
    let across = dvec3(-0.23, 0.13, 1.9);
    let corner = dvec3(-0.9, 0.4, -0.95);
    let down = along.cross(across).normalize();
    let mut room = room();
    let ceiling = quad("ceiling", corner, along, across, COLOURED);
    room.meshes.push(ceiling.into());
    for (u, v) in [(0.37, 0.61), (0.5, 0.5), (0.61, 0.43), (0.41, 0.47)] {
        let at = corner + u * along + v * across;
        let [scene, lifted, below] = [0.0, 1e-9, 1e-5].map(|below_m| {
            let spot = spot_light(at + below_m * down, down, [30.0, 50.0]);
            lit_by(&room, vec![spot])
        });
        let what = format!("lamp at ({u}, {v})");
        let error = exam.error_against(&exam.unsampled(&lifted)?, &scene, Layer::Direct)?;
        // Lamp and P are rounded by 6e-8 m each, and lit points are at least 2 cm from the lamp.
        exam.record(&what, "direct", error, 2e-5);
        let [truth, sum] =
            [below, scene].map(|scene| with_sum(&scene, VplSum::InstantRadiosity, 24));
        let error = exam.apart([&truth, &sum])?;
        // The VPLs move by 1e-5 m with the lamp, so that those near a corner contribute more or less.
        exam.record(&what, "instant-radiosity", error, 1e-2);
    }
    Ok(())
}

/// A lamp in a box in a room: everything outside the box is black.
fn light_inside_a_box(exam: &mut Examiner) -> Result<()> {
    let mut scene = room();
    let bright = exam.largest(&scene, Layer::Direct)?;
    let size = dvec3(0.3, 0.2, 0.25);
    let centre = dvec3(-0.2, 0.3, -0.1);
    let case = cuboid("case", centre - 0.5 * size, size, COLOURED);
    scene.meshes.push(case.into());
    for at in [DVec3::ZERO, DVec3::splat(0.01), 0.49 * size] {
        scene.lights = vec![point_light(centre + at).into()];
        exam.leaks(&scene, bright)?;
        // The sums ignore visibility, so the box is no obstacle to them.
        exam.sums("", &scene, 24, KERNEL_BOUND)?;
    }
    Ok(())
}

fn light_at_the_camera(exam: &mut Examiner) -> Result<()> {
    let room = room();
    for (what, above_m) in [("no offset", 0.0), ("1 cm", 0.01)] {
        let light = point_light(room.camera.position_m + above_m * DVec3::Y);
        exam.all(what, &lit_by(&room, vec![light]))?;
    }
    Ok(())
}

/// The share of the light's power that the VPLs may lose: exact integrals in f64, with a few roundings for each of at most four thousand
/// texels.
const POWER_BOUND: f64 = 1e-12;

/// f32 resolves directions to 1e-7; the penumbra has this width.
fn penumbra_bound(penumbra_deg: f64) -> f64 {
    2e-7 / penumbra_deg.to_radians()
}

/// The room under a spot.
fn room_with_spot(position_m: DVec3, direction: DVec3, half_angles_deg: [f64; 2]) -> Scene {
    let spot = spot_light(position_m, direction, half_angles_deg);
    lit_by(&room(), vec![spot])
}

/// The target of narrow spots, which are below the ceiling.
const TARGET_M: DVec3 = dvec3(-0.3, -1.0, 0.5);

fn room_with_narrow_spot(half_angles_deg: [f64; 2]) -> Scene {
    let at = dvec3(0.33, 0.81, 0.2);
    room_with_spot(at, TARGET_M - at, half_angles_deg)
}

fn spot_of_half_a_degree(exam: &mut Examiner) -> Result<()> {
    let scene = room_with_narrow_spot([0.1, 0.25]);
    // Close up, the lit spot of 14 mm fills the image.
    let mut close = scene.clone();
    close.camera.position_m = dvec3(-0.1, -0.6, 0.7);
    close.camera.look_at_m = TARGET_M;
    close.camera.lens = Lens::FovY { fov_y_deg: 4.0 };
    let bound = DIRECT_BOUND + penumbra_bound(0.15);
    exam.direct("the spot up close", &close, bound)?;
    exam.sums("the whole room", &scene, 24, KERNEL_BOUND)?;
    exam.bounce("the whole room", &scene)
}

fn narrowest_spot(exam: &mut Examiner) -> Result<()> {
    let scene = room_with_narrow_spot([0.5e-4, 1e-4]);
    lost_power(exam, "", &scene, 24)?;
    exam.sums("the whole room", &scene, 24, KERNEL_BOUND)?;
    exam.bounce("the whole room", &scene)
}

fn wide_spots(exam: &mut Examiner) -> Result<()> {
    for half_angles_deg in [[10.0, 89.5], [89.0, 89.5], [100.0, 179.0], [180.0, 180.0]] {
        let [inner, outer] = half_angles_deg;
        let (at, direction) = (dvec3(0.23, 0.41, 0.17), dvec3(0.3, -0.8, -0.4));
        let scene = room_with_spot(at, direction, half_angles_deg);
        let what = format!("{inner}° to {outer}°");
        let penumbra_deg = if inner < outer { outer - inner } else { 90.0 };
        exam.by_rays(&what, &scene, DIRECT_BOUND + penumbra_bound(penumbra_deg))?;
    }
    Ok(())
}

fn equal_cones(exam: &mut Examiner) -> Result<()> {
    for half_angle_deg in [0.25, 20.0, 90.0] {
        let at = dvec3(0.23, 0.71, 0.17);
        let scene = room_with_spot(at, dvec3(-0.2, -1.0, -0.4) - at, [half_angle_deg; 2]);
        let what = format!("{half_angle_deg}°");
        if half_angle_deg > 1.0 {
            exam.direct(&what, &scene, DIRECT_BOUND)?;
        }
        exam.sums(&what, &scene, 24, KERNEL_BOUND)?;
        exam.bounce(&what, &scene)?;
    }
    Ok(())
}

/// The difference between the power of all VPLs and that of the light: in a closed room every texel hits a surface.
fn lost_power(exam: &mut Examiner, what: &str, scene: &Scene, rsm_size: u32) -> Result<()> {
    let scene = with_sum(scene, VplSum::InstantRadiosity, rsm_size);
    let (_, kept) = exam.render_keeping(&scene)?;
    let vpls = f64_kernels::vpls(&scene.lights[0], &kept.lights[0]);
    let of_vpls: CompensatedSum = vpls.iter().map(|vpl| vpl.incident_power_w[0]).collect();
    let lost = (of_vpls.value() / scene.lights[0].emission()[0] - 1.0).abs();
    exam.record(what, "power of the VPLs", lost, POWER_BOUND);
    Ok(())
}

fn cone_inside_a_texel(exam: &mut Examiner) -> Result<()> {
    let at = dvec3(0.23, 0.71, 0.17);
    for rsm_size in [1, 2, 3, 5] {
        for half_angles_deg in [[7.0, 8.0], [30.0, 30.0], [40.0, 100.0]] {
            let scene = room_with_spot(at, dvec3(-0.21, -1.0, -0.43) - at, half_angles_deg);
            let what = format!("{rsm_size} texels, {}°", half_angles_deg[1]);
            lost_power(exam, &what, &scene, rsm_size)?;
            exam.sums(&what, &scene, rsm_size, KERNEL_BOUND)?;
        }
    }
    Ok(())
}

/// 26 axes: towards the faces, edges and corners of the cube.
fn axes_of_the_cube(exam: &mut Examiner) -> Result<()> {
    let digits = |i: i32| dvec3((i / 9).into(), (i / 3 % 3).into(), (i % 3).into());
    let axes = (0..27).map(|i| digits(i) - DVec3::ONE);
    for axis in axes.filter(|&axis| axis != DVec3::ZERO) {
        for half_angles_deg in [[20.0, 28.0], [60.0, 95.0]] {
            let mut scene = room_with_spot(dvec3(0.23, 0.41, 0.17), axis, half_angles_deg);
            scene.camera.resolution_px = [12, 12];
            scene.camera.lens = Lens::FovY { fov_y_deg: 120.0 };
            let what = format!("axis {axis}, {}°", half_angles_deg[1]);
            lost_power(exam, &what, &scene, 9)?;
            exam.sums(&what, &scene, 9, KERNEL_BOUND)?;
            // A cone that lights nothing in view has no relative error.
            let is_wide = half_angles_deg[1] > 90.0;
            let truth = if is_wide {
                exam.sampled_enough(&scene)?
            } else {
                exam.unsampled(&scene)?
            };
            if largest(values(&truth, Layer::Direct)) > 0.0 {
                let bound = DIRECT_BOUND + penumbra_bound(8.0);
                exam.direct_against(&truth, &what, &scene, bound)?;
            }
            // The camera may not see anything that the narrow cone lights; then the engine may not state an error.
            if is_wide {
                exam.bounce_against(&truth, &what, &scene, TARGET_ERROR)?;
            }
        }
    }
    Ok(())
}

/// A floor, level and tilted, without and with a block on it. Closed form: E·cosθ·k_d/π with k_d = ½.
fn grazing_directional(exam: &mut Examiner) -> Result<()> {
    let (sine, cosine) = f64::to_radians(89.99).sin_cos();
    // Normal and direction are each off by up to 1e-7, divided by a cosine of 1.7e-4.
    let bound = DIRECT_BOUND + 2.0 * 1e-7 / cosine;
    let mut floor_alone = |what: &str, tilt: f64| -> Result<Scene> {
        let turn = DQuat::from_axis_angle(dvec3(0.6, 0.0, 0.8), tilt);
        let plane = [dvec3(-1.0, 0.0, -1.0), 2.0 * DVec3::Z, 2.0 * DVec3::X];
        let floor = grid("floor", plane.map(|v| turn * v), [3, 3], GREY);
        let light = directional_light(turn * dvec3(sine, -cosine, 0.0));
        let eye_m = turn * dvec3(0.2, 1.0, 0.3);
        let mut scene = scene_of(vec![floor], light, eye_m, DVec3::ZERO);
        scene.camera.lens = Lens::FovY { fov_y_deg: 40.0 };
        let frame = exam.render(&scene)?;
        let direct = values(&frame, Layer::Direct);
        let closed = vec![PI * cosine * 0.5 / PI; direct.len()];
        exam.record(what, "direct", error_of(direct, &closed), bound);
        Ok(scene)
    };
    let mut scene = floor_alone("level floor", 0.0)?;
    floor_alone("tilted floor", 0.37)?;
    // The shadow of this block would be 600 m long.
    let block = cuboid(
        "block",
        dvec3(-0.2, 0.0, -0.3),
        dvec3(0.3, 0.4, 0.4),
        COLOURED,
    );
    scene.meshes.push(block.into());
    exam.by_rays("floor and block", &scene, bound)
}

/// As bright as a lamp of 12 W at 1 m, from more than twice the height of a geostationary orbit. The light enters through an open side.
fn room_lit_from_afar() -> Scene {
    let distance_m = 1e8;
    let mut scene = room();
    let corner = DVec3::splat(-1.0);
    let [x, y, z] = DVec3::AXES.map(|axis| 2.0 * axis);
    scene.meshes[0] = quad("floor", corner, z, x, GREY).into();
    let back = quad("back", corner, x, y, COLOURED);
    scene.meshes.push(back.into());
    let towards = dvec3(0.43, 0.61, 0.67).normalize();
    let light = point_light(distance_m * towards);
    scene.lights = vec![amplified(&light, [distance_m * distance_m; 3]).into()];
    scene
}

fn far_light(exam: &mut Examiner) -> Result<()> {
    let scene = room_lit_from_afar();
    exam.direct("1e8 m", &scene, DIRECT_BOUND)?;
    exam.bounce("1e8 m", &scene)
}

/// Scaling the power by a power of two must scale the image by that factor, bit for bit. Rounding stays the same unless a number leaves the
/// range of normal numbers or a small value is compared with a constant.
fn extreme_powers(exam: &mut Examiner) -> Result<()> {
    let room = room();
    for (estimator, scene) in with_each_estimator(&room, 16, 0.1) {
        let frame = exam.render(&scene)?;
        let truth = values(&frame, Layer::Radiance);
        for factor in [2f64.powi(-40), 2f64.powi(40)] {
            let lit = lit_by(&scene, vec![amplified(&scene.lights[0], [factor; 3])]);
            let frame = exam.render(&lit)?;
            let scaled: Vec<f64> = truth.iter().map(|&t| f64::from(t) * factor).collect();
            let error = error_of(values(&frame, Layer::Radiance), &scaled);
            exam.record(&format!("{factor:.0e} times"), estimator, error, 0.0);
        }
    }
    Ok(())
}

fn no_power(exam: &mut Examiner) -> Result<()> {
    let room = room();
    let light = &room.lights[0].light;
    let dark = amplified(light, [0.0; 3]);
    let alone = lit_by(&room, vec![dark.clone()]);
    exam.all_black("alone", &alone)?;
    let is_told = alone.warnings().iter().any(|text| text.contains("light 0"));
    exam.record("", "missing warnings", f64::from(!is_told), 0.0);
    let beside = lit_by(&room, vec![dark, light.clone()]);
    exam.bounce("beside another light", &beside)
}

/// Point lights, spots and parallel light alternate, with powers from 1 to 1/64.
fn sixty_four_lights(exam: &mut Examiner) -> Result<()> {
    let light = |i: u32| {
        let [column, row] = [i % 8, i / 8].map(|n| -0.8 + 0.2 * f64::from(n) + 0.013);
        let at = dvec3(column, 0.6 + 0.1 * column * row, row);
        let down = dvec3(0.2 * row, -1.0, 0.3 * column);
        let light = match i % 3 {
            0 => point_light(at),
            1 => spot_light(at, down, [15.0, 35.0]),
            _ => directional_light(down),
        };
        let [first, last] = [i + 1, 64 - i].map(|place| 1.0 / f64::from(place));
        amplified(&light, [first, 0.5, last])
    };
    let mut scene = lit_by(&room(), (0..64).map(light).collect());
    let corner = DVec3::splat(-1.0);
    scene.meshes[0] = quad("floor", corner, 2.0 * DVec3::Z, 2.0 * DVec3::X, GREY).into();
    let what = "room without walls";
    exam.direct(what, &scene, DIRECT_BOUND)?;
    exam.sums(what, &scene, 8, KERNEL_BOUND)?;
    exam.bounce_against(&exam.sampled(&scene, 32)?, what, &scene, TARGET_ERROR)
}
