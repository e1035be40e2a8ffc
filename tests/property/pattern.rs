//! Measured patterns of lights: files, angles, and integrals against closed forms and quadrature.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::common::lamps;
use crate::common::rows::rows;
use crate::common::scene_folder::{CAMERA, MESH, SceneFolder, assert_says};
use crate::common::texels::texel_direction;
use camlux::{
    emission::EmissionDomain,
    model::radiant_intensity,
    scene::{BoundingSphere, Light, Pattern, PatternAxes, PatternIntegral, Profile},
};
use glam::DVec3;

/// The light of a scene whose pattern is this file.
fn load(name: &str, file: &str, power: &str) -> Result<Light, String> {
    let folder = SceneFolder::new();
    folder.write(name, file);
    load_from(&folder, name, power)
}

fn load_from(folder: &SceneFolder, name: &str, power: &str) -> Result<Light, String> {
    let light = format!(
        "[[light]]\nkind = \"pattern\"\npattern = \"{name}\"\nposition = [0, 2, 0]\ndirection = [0, -1, 0]\nup = [1, 0, 0]\n{power}\n"
    );
    let scene = folder.load(&format!("{CAMERA}{light}{MESH}"));
    scene
        .map(|scene| scene.lights[0].light.clone())
        .map_err(|error| error.to_string())
}

fn pattern_of(name: &str, file: &str) -> Pattern {
    match load(name, file, "power_w = 10") {
        Ok(light) => measured(&light).clone(),
        other => panic!("{other:?}"),
    }
}

fn measured(light: &Light) -> &Pattern {
    match light.lamp().map(|lamp| &lamp.profile) {
        Some(Profile::Measured(pattern)) => pattern,
        other => panic!("{other:?} is not measured"),
    }
}

/// A downlight in the form of the standard's examples: planes from 0 to 90 degrees.
const QUADRANT: &str = "IESNA:LM-63-2002
[TEST] none
[MANUFAC] nobody
[LUMCAT] D-1
TILT=NONE
1 1000 2 5 4 1 2 0.1 0.1 0
1.0 1.0 12
0 22.5 45 67.5 90
0 30 60 90
100 80 60 30 0
100 70 50 20 0
100 60 40 10 0
100 50 30 5 0
";

/// A rotationally symmetric lamp in the standard's first version: no version line, numbers across line ends, a ballast factor.
const ROTATIONAL: &str = "Some lamp, measured long ago
TILT=NONE
1, 800, 1, 3, 1, 1, 1, 0, 0, 0, 0.5, 0.8, 100, 0, 90, 180, 0,
200, 100, 50
";

/// Four different planes over a whole turn.
const WHOLE: &str = "IESNA:LM-63-1995
[TEST] none
TILT=NONE
1 -1 1 3 5 1 2 0 0 0
1 1 10
0 45 90
0 90 180 270 360
10 8 0
10 6 0
10 4 0
10 2 0
10 8 0
";

#[test]
fn ies_files_are_spread_over_all_planes() {
    let pattern = pattern_of("a.ies", QUADRANT);
    assert_eq!(pattern.peak, 200.0);
    let at = |gamma_deg: f64, plane_deg: f64| {
        pattern.intensity(gamma_deg.to_radians(), plane_deg.to_radians())
    };
    // A direction between two angles and two planes, and its mirror images.
    let due = 0.25 * (0.7 + 0.6 + 0.5 + 0.4);
    assert!((at(33.75, 45.0) - 0.25 * (0.7 + 0.5 + 0.6 + 0.4)).abs() < 1e-6);
    for plane_deg in [45.0, 135.0, 225.0, 315.0] {
        assert!((at(33.75, plane_deg) - due).abs() < 1e-6, "{plane_deg}");
    }
    assert_eq!(at(90.5, 10.0), 0.0);

    let pattern = pattern_of("b.IES", ROTATIONAL);
    assert_eq!(pattern.peak, 200.0 * 0.5 * 0.8);
    let at = |gamma_deg: f64, plane_deg: f64| {
        pattern.intensity(f64::to_radians(gamma_deg), f64::to_radians(plane_deg))
    };
    assert!((at(45.0, 77.0) - 0.75).abs() < 1e-6 && (at(135.0, 250.0) - 0.375).abs() < 1e-6);

    let pattern = pattern_of("c.ies", WHOLE);
    let at = |plane_deg: f64| pattern.intensity(FRAC_PI_2 / 2.0, plane_deg.to_radians());
    for (plane_deg, due) in [
        (0.0, 0.8),
        (90.0, 0.6),
        (180.0, 0.4),
        (270.0, 0.2),
        (315.0, 0.5),
    ] {
        assert!((at(plane_deg) - due).abs() < 1e-6, "{plane_deg}");
    }
}

/// A EULUMDAT file: one line per value, one set of lamps.
fn eulumdat(symmetry: u32, planes: &[f64], gammas: &[f64], intensities: &[f64]) -> String {
    let head = format!(
        "nobody\n1\n{symmetry}\n{}\n90\n{}\n45\nreport\nlamp\nnumber\nfile\ndate\n100\n100\n50\n90\n90\n0\n0\n0\n0\n100\n100\n2,0\n0\n1\n",
        planes.len(),
        gammas.len()
    );
    let lamps = "1\nLED\n1000\n3000K\n80\n10\n";
    let factors = "0.5\n".repeat(10);
    let numbers = planes.iter().chain(gammas).chain(intensities);
    let numbers: String = numbers.map(|number| format!("{number}\n")).collect();
    format!("{head}{lamps}{factors}{numbers}")
}

#[test]
fn eulumdat_files_are_spread_over_all_planes() {
    let planes = [0.0, 90.0, 180.0, 270.0];
    let gammas = [0.0, 45.0, 90.0];
    let at = |pattern: &Pattern, plane_deg: f64| {
        pattern.intensity(FRAC_PI_2 / 2.0, plane_deg.to_radians())
    };
    // Values at 45 degrees of the planes 0, 90, 180, 270, relative to the peak of 20 (10 times the factor 2).
    for (symmetry, intensities, due) in [
        (
            0,
            &[10., 8., 0., 10., 6., 0., 10., 4., 0., 10., 2., 0.][..],
            [0.8, 0.6, 0.4, 0.2],
        ),
        (1, &[10., 8., 0.], [0.8; 4]),
        (
            2,
            &[10., 8., 0., 10., 6., 0., 10., 4., 0.],
            [0.8, 0.6, 0.4, 0.6],
        ),
        // From plane 270 over 0 to 90.
        (
            3,
            &[10., 2., 0., 10., 8., 0., 10., 6., 0.],
            [0.8, 0.6, 0.8, 0.2],
        ),
        (4, &[10., 8., 0., 10., 6., 0.], [0.8, 0.6, 0.8, 0.6]),
    ] {
        let pattern = pattern_of("a.ldt", &eulumdat(symmetry, &planes, &gammas, intensities));
        assert_eq!(pattern.peak, 20.0);
        for (plane_deg, due) in planes.into_iter().zip(due) {
            let found = at(&pattern, plane_deg);
            assert!(
                (found - due).abs() < 1e-6,
                "{symmetry}, {plane_deg}: {found} {due}"
            );
        }
    }
}

fn refuses((name, file): &(&str, String), words: &[&str]) {
    let error = load(name, file, "power_w = 1").expect_err(words[0]);
    assert_says(&error, words);
}

#[test]
fn files_that_are_none_are_refused() {
    let ldt = eulumdat(0, &[0.0], &[0.0, 90.0], &[1.0, 0.0]);
    rows! { refuses;
        ("a.txt", QUADRANT.into()) => "give an IES file (.ies), a EULUMDAT file (.ldt), or a map";
        ("a.ies", String::new()) => "a.ies:1: there is no TILT= line";
        ("a.ies", QUADRANT.replace("TILT=NONE", "TILT=lamp.tlt")) =>
            "a.ies:5: TILT=lamp.tlt names another file";
        ("a.ies", QUADRANT.replace("5 4 1 2", "5 4 0 2")) =>
            "photometry of type 0 is not known, only types 1 (C), 2 (B) and 3 (A) are";
        ("a.ies", QUADRANT.replace("5 4 1 2", "5 x 1 2")) =>
            "a.ies:6: found \"x\" instead of a number for the number of horizontal angles";
        ("a.ies", QUADRANT.replace("5 4 1 2", "0 4 1 2")) => "the number of vertical angles is 0";
        ("a.ies", QUADRANT.replace("22.5", "50")) => "the vertical angles do not increase";
        ("a.ies", QUADRANT.replace("0 30 60 90\n100", "0 30 60 80\n100")) =>
            "the horizontal angles are from 0 to 80 degrees";
        ("a.ies", QUADRANT.replace("0 30 60 90\n100", "10 30 60 90\n100")) =>
            "the horizontal angles are from 10 to 90 degrees";
        ("a.ies", QUADRANT.replace("100 50 30 5 0\n", "100 50")) =>
            "the file ends before the candela values";
        ("a.ies", QUADRANT.replace("0 30 60 90\n100", "0 60 30 90\n100")) =>
            "the horizontal angles do not increase";
        ("a.ies", QUADRANT.replace("100 50 30 5 0", "100 50 -30 5 0")) =>
            "must be finite values of 0 or more";
        ("a.ldt", ldt.replacen("nobody\n1\n0\n", "nobody\n1\n7\n", 1)) =>
            "a.ldt:3: the symmetry is 7";
        ("a.ldt", ldt.replacen("nobody\n1\n0\n", "nobody\n1\n4\n", 1)) =>
            "1 C planes do not fit symmetry 4";
        ("a.ldt", ldt.trim_end().rsplit_once('\n').unwrap().0.to_owned()) =>
            "the file ends before the intensities";
        ("a.ldt", ldt.replace("2,0", "two")) =>
            "a.ldt:24: found \"two\" instead of a number for the conversion factor";
    }
    let error = load("a.ies", QUADRANT, "").expect_err("no power");
    assert!(error.contains("scale = \"file\""), "{error}");
    let folder = SceneFolder::new();
    let missing = "[[light]]\nkind = \"pattern\"\npattern = \"none.ies\"\nposition = [0, 2, 0]\ndirection = [0, -1, 0]\nup = [0, 1, 0]\npower_w = 1\n";
    let error = folder
        .load(&format!("{CAMERA}{missing}{MESH}"))
        .expect_err("no file")
        .to_string();
    assert_says(&error, &["scene.toml:9: cannot read the pattern"]);
    folder.write("none.ies", QUADRANT);
    let error = folder
        .load(&format!("{CAMERA}{missing}{MESH}"))
        .expect_err("up")
        .to_string();
    assert!(error.contains("is parallel to direction"), "{error}");
}

/// Looking down with x up, a quarter turn counterclockwise from x is -z.
#[test]
fn planes_turn_counterclockwise_for_one_who_looks_along_the_direction() {
    let axes = PatternAxes::new(-DVec3::Y, DVec3::X + 3.0 * DVec3::Y);
    for (towards, gamma_deg, plane_deg) in [
        (-DVec3::Y, 0.0, 0.0),
        (DVec3::X, 90.0, 0.0),
        (-DVec3::Z, 90.0, 90.0),
        (-DVec3::X - DVec3::Y, 45.0, 180.0),
        (DVec3::Z + DVec3::Y, 135.0, 270.0),
        (DVec3::Y, 180.0, 0.0),
    ] {
        let [gamma, plane] = axes.angles_rad(towards).map(f64::to_degrees);
        assert!((gamma - gamma_deg).abs() < 1e-9, "{towards}: {gamma}");
        let is_pole = gamma_deg == 0.0 || gamma_deg == 180.0;
        assert!(
            is_pole || (plane - plane_deg).abs() < 1e-9,
            "{towards}: {plane}"
        );
    }
}

/// p falls linearly from 1 at γ = 0 to 0 at 90°: ∫ (1 − 2γ/π)·sin γ dγ = 1 − 2/π.
#[test]
fn the_integral_is_the_closed_form() {
    let file = QUADRANT.replace("5 4 1 2", "2 1 1 2").replace(
        "0 22.5 45 67.5 90\n0 30 60 90\n100 80 60 30 0\n100 70 50 20 0\n100 60 40 10 0\n100 50 30 5 0\n",
        "0 90\n0\n100 0\n",
    );
    let pattern = pattern_of("a.ies", &file);
    let due = TAU * (1.0 - 2.0 / PI);
    let total = PatternIntegral::new(&pattern).total();
    assert!((total / due - 1.0).abs() < 1e-14, "{total} {due}");
    // The same light, given by its power and by its file (200 W/sr).
    let Ok(by_power) = load("a.ies", &file, &format!("power_w = {}", 200.0 * due)) else {
        panic!("it loads");
    };
    let by_file = load("a.ies", &file, "scale = \"file\"").expect("it loads");
    for towards in [DVec3::NEG_Y, DVec3::new(1.0, -2.0, 0.5)] {
        let [a, b] = [&by_power, &by_file].map(|light| radiant_intensity(light, towards).unwrap());
        assert!((a[0] / b[0] - 1.0).abs() < 1e-14);
        let gamma = towards.angle_between(DVec3::NEG_Y);
        assert!(
            (b[0] / (200.0 * (1.0 - 2.0 * gamma / PI)) - 1.0).abs() < 1e-12,
            "{b:?}"
        );
    }
}

/// A beam of 25 degrees has one face, even if its file continues with zeros. Its texels have the intensities of the pattern.
#[test]
fn a_narrow_beam_has_one_face() {
    let file = WHOLE
        .replace("0 45 90\n", "0 25 90\n")
        .replace("10 8 0", "10 0 0");
    let file = file
        .replace("10 6 0", "8 0 0")
        .replace("10 4 0", "6 0 0")
        .replace("10 2 0", "4 0 0");
    let mut light = load("a.ies", &file, "power_w = 3").expect("it loads");
    let pattern = measured(&light);
    assert!((pattern.widest_rad().to_degrees() - 25.0).abs() < 1e-12);
    *light.position_m_mut().expect("it has one") = DVec3::ZERO;
    let sphere = BoundingSphere {
        centre_m: DVec3::ZERO,
        radius_m: 1.0,
    };
    for size in [1, 5, 16] {
        let domain = EmissionDomain::new(&light, size, &sphere);
        assert_eq!(domain.faces.len(), 1);
        let powers = domain.texels.iter().map(|t| domain.incident_power_w(t)[0]);
        assert!((powers.sum::<f64>() - 3.0).abs() < 1e-11);
        let cap = TAU * (1.0 - f64::to_radians(25.0).cos());
        assert!((domain.total_measure() / cap - 1.0).abs() < 1e-12);
        // A texel's mean is near the intensity in its middle.
        for (i, texel) in domain.texels.iter().enumerate().filter(|_| size == 16) {
            let direction =
                texel_direction(&domain, &domain.faces[0], i as u32 % 16, i as u32 / 16);
            let [intensity] = [radiant_intensity(&light, direction).unwrap()[0]];
            let mean = domain.axial_intensity[0] * texel.falloff;
            let is_whole = direction.angle_between(DVec3::NEG_Y) < f64::to_radians(22.0);
            assert!(
                !is_whole || (mean - intensity).abs() < 0.03 * domain.axial_intensity[0],
                "{i}"
            );
        }
    }
}

/// Compares each texel with a sum over a fine grid in it, and all texels with the whole.
#[test]
fn texels_hold_the_pattern_exactly() {
    let light = lamps::measured(DVec3::ZERO, DVec3::new(0.3, -1.0, 0.2), [1.0; 3]);
    let pattern = measured(&light);
    let sphere = BoundingSphere {
        centre_m: DVec3::ZERO,
        radius_m: 1.0,
    };
    let axes = light.lamp().expect("it is one").axes();
    for size in [1, 3, 8] {
        let domain = EmissionDomain::new(&light, size, &sphere);
        assert_eq!(domain.faces.len(), 5, "none is behind 110 degrees");
        let power_w: f64 = domain
            .texels
            .iter()
            .map(|t| domain.incident_power_w(t)[0])
            .sum();
        assert!((power_w - 1.0).abs() < 1e-12, "{power_w}");
        let end = pattern.gammas_rad[4];
        let cap = TAU * (1.0 - end.cos());
        assert!((domain.total_measure() / cap - 1.0).abs() < 1e-12);
        // The centres of finer texels are quadrature points of this texel.
        let parts = 240 / size;
        let fine = EmissionDomain {
            size: size * parts,
            ..domain.clone()
        };
        for (face_index, face) in domain.faces.iter().enumerate() {
            for (x, y) in (0..size).flat_map(|y| (0..size).map(move |x| (x, y))) {
                let texel = domain.texels[((face_index as u32 * size + y) * size + x) as usize];
                let (mut sum, mut area) = (0.0, 0.0);
                for (i, j) in (0..parts).flat_map(|j| (0..parts).map(move |i| (i, j))) {
                    let direction = texel_direction(&fine, face, x * parts + i, y * parts + j);
                    let edge = 2.0 / f64::from(size * parts);
                    let solid_angle = edge * edge / direction.length().powi(3);
                    let [gamma, plane] = axes.angles_rad(direction);
                    let within = if gamma <= end { solid_angle } else { 0.0 };
                    area += within;
                    sum += within * pattern.intensity(gamma, plane);
                }
                let of_texel = texel.falloff * texel.measure;
                let bound = 4e-4 * 4.0 / f64::from(size * size);
                assert!(
                    (of_texel - sum).abs() < bound,
                    "{face_index} {x} {y}: {of_texel} {sum}"
                );
                assert!((texel.measure - area).abs() < 20.0 * bound);
            }
        }
    }
}
