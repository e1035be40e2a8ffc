//! The emission tables: sums in closed form, single texels by brute force, frames and rays.

use std::f64::consts::{PI, TAU};

use crate::common::texels::texel_direction;
use camlux::emission::{EmissionDomain, EmissionFace, Projection, TexelEmission};
use camlux::model::{CompensatedSum, direction_to_light, irradiance_facing, radiant_intensity};
use camlux::scene::{AreaShape, BoundingSphere, Light, Profile, SpotCone};
use glam::DVec3;

const SCENE: BoundingSphere = BoundingSphere {
    centre_m: DVec3::new(3.0, -1.0, 2.0),
    radius_m: 2.5,
};

/// Inner and outer half angles, degrees: narrow to wide, with a hard edge, a full ramp or something between.
const CONES: [(f64, f64); 18] = [
    (0.0, 0.001),
    (0.001, 0.001),
    (0.0, 0.25),
    (0.2, 0.25),
    (0.25, 0.25),
    (0.0, 30.0),
    (29.9, 30.0),
    (30.0, 60.0),
    (60.0, 60.0),
    (10.0, 60.1),
    (0.0, 90.0),
    (45.0, 100.0),
    (100.0, 100.0),
    (20.0, 130.0),
    (0.0, 179.5),
    (179.5, 179.5),
    (90.0, 180.0),
    (180.0, 180.0),
];

/// An axis in general position.
const AXIS: DVec3 = DVec3::new(0.3, -1.0, 0.2);

fn spot(inner_half_angle_deg: f64, outer_half_angle_deg: f64, direction: DVec3) -> Light {
    Light::spot(
        DVec3::new(1.0, 2.0, 3.0),
        direction,
        SpotCone {
            inner_half_angle_deg,
            outer_half_angle_deg,
        },
        [6.0, 3.0, 1.5],
    )
}

fn sum_power_w(domain: &EmissionDomain) -> f64 {
    let sum: CompensatedSum = domain
        .texels
        .iter()
        .map(|texel| domain.incident_power_w(texel)[0])
        .collect();
    sum.value()
}

/// Every texel with its face, column and row.
fn placed_texels(
    domain: &EmissionDomain,
) -> impl Iterator<Item = (&EmissionFace, u32, u32, TexelEmission)> {
    let (size, per_face) = (domain.size, domain.size * domain.size);
    domain.texels.iter().zip(0..).map(move |(texel, i)| {
        let face = &domain.faces[(i / per_face) as usize];
        (face, i % size, i % per_face / size, *texel)
    })
}

fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

#[test]
fn point_light_texels_fill_the_sphere() {
    let light = Light::point(DVec3::ZERO, [6.0; 3]);
    for size in [1, 2, 3, 8, 64, 257, 512] {
        let domain = EmissionDomain::new(&light, size, &SCENE);
        assert_eq!(domain.texels.len(), (6 * size * size) as usize);
        // Measured 2.3e-16.
        assert!((domain.total_measure() / (4.0 * PI) - 1.0).abs() < 7e-16);
        assert!((sum_power_w(&domain) / 6.0 - 1.0).abs() < 7e-16);
    }
}

#[test]
fn spot_light_texels_carry_the_power() {
    for (inner, outer) in CONES {
        let light = spot(inner, outer, AXIS);
        let half_sin = (0.5 * f64::to_radians(outer)).sin();
        let solid_angle_sr = 2.0 * TAU * half_sin * half_sin;
        for size in [1, 2, 3, 8, 9, 64] {
            let domain = EmissionDomain::new(&light, size, &SCENE);
            // Edges are shared, so the sums telescope at every size: measured 1.4e-15 each.
            let measure = domain.total_measure() / solid_angle_sr - 1.0;
            let power = sum_power_w(&domain) / 6.0 - 1.0;
            assert!(
                measure.abs() < 4e-15 && power.abs() < 4e-15,
                "{inner} {outer} size {size}: {measure:e} {power:e}"
            );
        }
    }
}

/// Compares each texel with a subdivision into cells, which shares nothing with the integrals along the edges.
#[test]
fn spot_light_texels_are_right_one_by_one() {
    const CELLS: u32 = 64;
    for (inner, outer) in CONES {
        let light = spot(inner, outer, AXIS);
        // A hard rim cuts through cells: measured 1.9e-3 of the texel. Otherwise the midpoint rule's error is of second order: 2.4e-5.
        let hard_rim = inner > 0.99 * outer;
        let measure_bound = 4e-3;
        let weighted_bound = if hard_rim { 4e-3 } else { 5e-5 };
        for size in [4, 5] {
            let domain = EmissionDomain::new(&light, size, &SCENE);
            for (face, x, y, texel) in placed_texels(&domain) {
                let (measure, weighted, whole) = subdivided(&light, face, [x, y], size, CELLS);
                let measure_error = (texel.measure - measure).abs() / whole;
                let weighted_error = (texel.measure * texel.falloff - weighted).abs() / whole;
                assert!(
                    measure_error < measure_bound && weighted_error < weighted_bound,
                    "{inner} {outer} ({x}, {y}) of {size}: {measure_error:e} {weighted_error:e}"
                );
            }
        }
    }
}

/// The texel's solid angle inside the cone, that angle weighted by the falloff, and the texel's whole solid angle, from k² cells.
fn subdivided(
    light: &Light,
    face: &EmissionFace,
    [x, y]: [u32; 2],
    size: u32,
    k: u32,
) -> (f64, f64, f64) {
    let lamp = light.lamp().expect("only spot lights are subdivided");
    let Profile::Cone(cone) = lamp.profile else {
        unreachable!("only spot lights are subdivided");
    };
    let axis = lamp.direction.normalize();
    let cells = f64::from(size * k);
    let (mut measure, mut weighted, mut whole) = (0.0, 0.0, 0.0);
    for cell in 0..k * k {
        let u = (2.0 * f64::from(x * k + cell % k) + 1.0) / cells - 1.0;
        let v = 1.0 - (2.0 * f64::from(y * k + cell / k) + 1.0) / cells;
        let direction = face.forward + face.half_extent * (u * face.right + v * face.up);
        let cell_sr = (2.0 * face.half_extent / cells).powi(2) / direction.length().powi(3);
        let theta = angle(axis, direction);
        whole += cell_sr;
        if theta < cone.outer_half_angle_deg.to_radians() {
            measure += cell_sr;
            weighted += cell_sr * cone.falloff(theta);
        }
    }
    (measure, weighted, whole)
}

/// A texel is the sum of four texels of the next finer table. Their quadrature has other pieces, so this bounds the
/// quadrature error itself, which sums over a whole table do not show.
#[test]
fn finer_tables_add_up_to_coarser_ones() {
    for (inner, outer) in CONES {
        let light = spot(inner, outer, AXIS);
        for size in [1, 2, 3, 8] {
            let coarse = EmissionDomain::new(&light, size, &SCENE);
            let fine = EmissionDomain::new(&light, 2 * size, &SCENE);
            let total = coarse.total_measure();
            let integrals = |texel: &TexelEmission| [texel.measure, texel.measure * texel.falloff];
            for (i, texel) in coarse.texels.iter().enumerate() {
                let (size, row) = (size as usize, i / size as usize);
                let first = 4 * row * size + 2 * (i % size);
                let parts = [first, first + 1, first + 2 * size, first + 2 * size + 1]
                    .map(|part| integrals(&fine.texels[part]));
                for (which, whole) in integrals(texel).into_iter().enumerate() {
                    let sum: f64 = parts.iter().map(|part| part[which]).sum();
                    let error = (sum - whole).abs() / total;
                    // Relative to the whole domain: measured 3.5e-15.
                    assert!(
                        error < 1e-14,
                        "{inner} {outer} texel {i} of size {size}: {error:e}"
                    );
                }
            }
        }
    }
}

/// Compares a cone over the whole sphere, by edge integrals, with a point light's table, by triangles.
#[test]
fn a_spot_light_without_a_rim_is_a_point_light() {
    let point = Light::point(DVec3::ZERO, [6.0, 3.0, 1.5]);
    for size in [1, 7, 64] {
        let point = EmissionDomain::new(&point, size, &SCENE);
        let spot = EmissionDomain::new(&spot(180.0, 180.0, AXIS), size, &SCENE);
        assert_eq!(point.texels.len(), spot.texels.len());
        for (point, spot) in point.texels.iter().zip(&spot.texels) {
            let relative = spot.measure / point.measure - 1.0;
            // Relative to a texel, the edges' rounding error grows with size²: measured 6.5e-13 at 64.
            let bound = 2e-15 + 4.8e-16 * f64::from(size * size);
            assert!(relative.abs() < bound, "size {size}: {relative:e}");
            assert!((spot.falloff - 1.0).abs() < 1e-15);
        }
    }
}

fn assert_orthonormal(face: &EmissionFace) {
    let EmissionFace {
        right, up, forward, ..
    } = *face;
    // Cross products of unit vectors; a few roundings.
    assert!(right.distance(forward.cross(up)) < 1e-15, "{face:?}");
    for (a, b) in [(right, up), (up, forward), (forward, right)] {
        assert!(a.dot(b).abs() < 1e-15, "{face:?}");
        assert!((a.length() - 1.0).abs() < 1e-15, "{face:?}");
    }
}

#[test]
fn frames_are_orthonormal_for_every_axis() {
    let axes = [
        DVec3::X,
        DVec3::NEG_X,
        DVec3::Y,
        DVec3::NEG_Y,
        DVec3::Z,
        DVec3::NEG_Z,
        DVec3::new(1e-9, -1.0, 1e-9),
        DVec3::new(1e-12, 1e-12, -1.0),
        DVec3::new(300.0, -200.0, 5.0),
    ];
    for axis in axes {
        for outer in [40.0, 170.0] {
            let domain = EmissionDomain::new(&spot(10.0, outer, axis), 2, &SCENE);
            domain.faces.iter().for_each(assert_orthonormal);
        }
        let light = Light::directional(axis, [1.0; 3]);
        EmissionDomain::new(&light, 2, &SCENE)
            .faces
            .iter()
            .for_each(assert_orthonormal);
    }
    let light = Light::point(DVec3::ZERO, [1.0; 3]);
    let domain = EmissionDomain::new(&light, 2, &SCENE);
    domain.faces.iter().for_each(assert_orthonormal);
    let forward: Vec<DVec3> = domain.faces.iter().map(|face| face.forward).collect();
    assert_eq!(
        forward,
        [
            DVec3::X,
            DVec3::NEG_X,
            DVec3::Y,
            DVec3::NEG_Y,
            DVec3::Z,
            DVec3::NEG_Z
        ]
    );
}

/// Small texels must agree with the light along the ray through their centre. A mirrored table, or the table of
/// another face, would not.
#[test]
fn tables_and_rays_belong_together() {
    let size = 64;
    for (inner, outer) in [(0.0, 50.0), (0.0, 150.0), (0.0, 180.0)] {
        let light = spot(inner, outer, AXIS);
        let domain = EmissionDomain::new(&light, size, &SCENE);
        for (face, x, y, texel) in placed_texels(&domain) {
            let direction = texel_direction(&domain, face, x, y);
            let intensity = radiant_intensity(&light, direction).unwrap()[0];
            let falloff = intensity / domain.axial_intensity[0];
            // The mean over a texel differs from the value in its middle: measured 6.7e-3 at the rim, where the falloff has a kink.
            assert!(
                (texel.falloff - falloff).abs() < 1.4e-2,
                "{outer} ({x}, {y})"
            );
            let rim_distance_rad = outer.to_radians() - angle(direction, AXIS);
            if rim_distance_rad > 4.0 * face.half_extent / f64::from(size) {
                let width = 2.0 * face.half_extent / f64::from(size);
                let solid_angle_sr = width * width / direction.length().powi(3);
                // Second order in the width of a texel: measured 3.5e-4.
                let relative = texel.measure / solid_angle_sr - 1.0;
                assert!(relative.abs() < 7e-4, "{outer} ({x}, {y}): {relative:e}");
            }
        }
    }
}

#[test]
fn faces_that_a_cone_does_not_reach_are_left_out() {
    for (outer, faces) in [(60.0, 1), (61.0, 5), (125.2, 5), (125.3, 6), (180.0, 6)] {
        let light = spot(0.0, outer, DVec3::NEG_Y);
        assert_eq!(
            EmissionDomain::new(&light, 4, &SCENE).faces.len(),
            faces,
            "{outer}"
        );
    }
}

#[test]
fn texels_outside_the_cone_are_exactly_zero() {
    let size = 32;
    for (inner, outer) in CONES {
        let domain = EmissionDomain::new(&spot(inner, outer, AXIS), size, &SCENE);
        for (face, x, y, texel) in placed_texels(&domain) {
            // The half diagonal is at least the angle that it subtends.
            let half_diagonal = 2f64.sqrt() * face.half_extent / f64::from(size);
            let theta = angle(texel_direction(&domain, face, x, y), AXIS);
            if theta > outer.to_radians() + half_diagonal {
                assert_eq!(texel, TexelEmission::default(), "{outer} ({x}, {y})");
            }
        }
    }
}

#[test]
fn domains_without_extent_do_not_panic() {
    let point_scene = BoundingSphere {
        radius_m: 0.0,
        ..SCENE
    };
    let directional = Light::directional(DVec3::X, [1.0; 3]);
    assert_eq!(
        EmissionDomain::new(&directional, 4, &point_scene).total_measure(),
        0.0
    );
    let lights = [
        directional,
        spot(0.0, 0.0, AXIS),
        spot(20.0, 10.0, AXIS),
        spot(10.0, 20.0, DVec3::ZERO),
        spot(f64::NAN, f64::NAN, AXIS),
    ];
    for light in lights {
        for size in [0, 1, 2] {
            EmissionDomain::new(&light, size, &point_scene);
        }
    }
}

#[test]
fn a_directional_light_covers_the_disc_over_the_scene() {
    let direction = DVec3::new(0.0, -2.0, 1.0);
    let light = Light::directional(direction, [10.0; 3]);
    let disc_m2 = PI * SCENE.radius_m * SCENE.radius_m;
    for size in [1, 2, 3, 8, 64, 512] {
        let domain = EmissionDomain::new(&light, size, &SCENE);
        assert_eq!(domain.projection, Projection::Orthographic);
        // Measured 1.2e-15.
        assert!((domain.total_measure() / disc_m2 - 1.0).abs() < 3e-15);
        assert!((sum_power_w(&domain) / (10.0 * disc_m2) - 1.0).abs() < 3e-15);

        // The plane is in front of the scene, and the depth range ends behind the scene.
        let to_centre_m = SCENE.centre_m - domain.origin_m;
        let depth_m = to_centre_m.dot(domain.faces[0].forward);
        assert!(depth_m > SCENE.radius_m);
        assert!(domain.depth_range_m > depth_m + SCENE.radius_m);
        assert!(to_centre_m.cross(direction).length() < 1e-14);
        assert_eq!(
            texel_direction(&domain, &domain.faces[0], 0, 0),
            domain.faces[0].forward
        );
    }
}

/// The area light with all of its light at one point.
fn point_of(light: &Light, place: [f64; 2]) -> Light {
    let mut point = light.clone();
    let lamp = point.lamp_mut().expect("it is one");
    lamp.position_m = lamp.point_m(place);
    point
}

/// The irradiance straight below an area light, as the mean over its points: π L R²/(R² + h²) for a disc, four times that of a quarter
/// for a rectangle.
#[test]
fn points_of_an_area_make_its_closed_form() {
    let (height_m, power_w) = (0.7, 5.0);
    let light = |shape| {
        Light::area(
            DVec3::new(0.3, height_m, 0.1),
            DVec3::new(0.0, -2.0, 0.0),
            DVec3::new(0.5, 0.3, 1.0),
            shape,
            [power_w; 3],
        )
    };
    let below_m = DVec3::new(0.3, 0.0, 0.1);
    const STEPS: u32 = 600;
    let found = |light: &Light| {
        let step = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
        let places = (0..STEPS * STEPS).map(|i| [step(i % STEPS), step(i / STEPS)]);
        let irradiance = places.map(|place| {
            let point = point_of(light, place);
            let cosine = direction_to_light(&point, below_m).y;
            irradiance_facing(&point, below_m)[0] * cosine
        });
        irradiance.sum::<f64>() / f64::from(STEPS * STEPS)
    };
    let radius_m = 0.4;
    let disc = found(&light(AreaShape::Disc { radius_m }));
    let radiance = power_w / (PI * PI * radius_m * radius_m);
    let due = PI * radiance * radius_m.powi(2) / (radius_m.powi(2) + height_m.powi(2));
    assert!((disc / due - 1.0).abs() < 1e-6, "{disc} for {due}");

    let size_m = [0.9, 0.5];
    let rectangle = found(&light(AreaShape::Rectangle { size_m }));
    let [x, y] = size_m.map(|size_m: f64| 0.5 * size_m / height_m);
    let edge = |a: f64, b: f64| a / a.hypot(1.0) * (b / a.hypot(1.0)).atan();
    let radiance = power_w / (PI * size_m[0] * size_m[1]);
    let due = 4.0 * radiance * 0.5 * (edge(x, y) + edge(y, x));
    assert!(
        (rectangle / due - 1.0).abs() < 1e-6,
        "{rectangle} for {due}"
    );
    // An area light emits nothing backwards.
    let above_m = below_m + 2.0 * DVec3::Y * height_m;
    let point = point_of(&light(AreaShape::Disc { radius_m }), [0.2, 0.6]);
    assert_eq!(irradiance_facing(&point, above_m), [0.0; 3]);
}
