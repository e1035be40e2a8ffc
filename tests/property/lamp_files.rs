//! Files of measured lamps as programs write them: versions of the standards, types of photometry, symmetries, and what the files hold
//! beyond the pattern.

use std::f64::consts::PI;

use crate::common::rows::rows;
use crate::common::scene_folder::{CAMERA, MESH, SceneFolder, assert_says};
use camlux::{
    Scene,
    model::radiant_intensity,
    scene::{Pattern, PatternIntegral, Profile},
};
use glam::DVec3;

const LIGHT: &str =
    "[[light]]\nkind = \"pattern\"\nposition = [0, 2, 0]\ndirection = [0, -1, 0]\nup = [1, 0, 0]\n";

fn load(name: &str, file: &str) -> Result<Scene, String> {
    let folder = SceneFolder::new();
    folder.write(name, file);
    let light = format!("{LIGHT}pattern = \"{name}\"\nscale = \"file\"\n");
    let scene = folder.load(&format!("{CAMERA}{light}{MESH}"));
    scene.map_err(|error| error.to_string())
}

fn refuses(ies: &str, words: &[&str]) {
    assert_says(&load("a.ies", ies).expect_err(words[0]), words);
}

/// Candela in a direction: γ from straight down, C from +x.
#[track_caller]
fn candela(scene: &Scene, gamma_deg: f64, plane_deg: f64) -> f64 {
    let (gamma, plane) = (gamma_deg.to_radians(), plane_deg.to_radians());
    let towards = DVec3::new(
        gamma.sin() * plane.cos(),
        -gamma.cos(),
        -gamma.sin() * plane.sin(),
    );
    radiant_intensity(&scene.lights[0], towards).unwrap()[0]
}

#[track_caller]
fn axial(name: &str, file: &str) -> f64 {
    candela(&load(name, file).expect("it loads"), 0.0, 0.0)
}

#[track_caller]
fn assert_near(found: f64, due: f64) {
    assert!((found - due).abs() <= 1e-9 * due.abs(), "{found} {due}");
}

fn pattern(scene: &Scene) -> &Pattern {
    match scene.lights[0].lamp().map(|lamp| &lamp.profile) {
        Some(Profile::Measured(pattern)) => pattern,
        other => panic!("{other:?}"),
    }
}

/// 100 cd on the axis, 50 cd at 90 degrees; `third` is the line of the ballast factor.
fn ies(first: &str, third: &str) -> String {
    format!("{first}\n[TEST] none\nTILT=NONE\n1 1000 1 2 1 1 2 0 0 0\n{third}\n0 90\n0\n100 50\n")
}

#[test]
fn the_number_after_the_ballast_factor_has_the_meaning_of_the_version() {
    for (first, third, due) in [
        // A type of generation.
        ("IES:LM-63-2019", "1 1.10000 20", 100.0),
        ("IES:LM-63-2019", "0.5 1.00001 20", 50.0),
        ("ies: lm-63-2019", "1 1.10000 20", 100.0),
        ("\u{feff}IES:LM-63-2019", "1 1.10000 20", 100.0),
        // Reserved.
        ("IESNA:LM-63-2002", "1 1 20", 100.0),
        ("IESNA: LM-63-2002", "1 1 20", 100.0),
        ("IESNA : LM-63-2002", "1 0.5 20", 100.0),
        ("iesna:lm-63-1995", "1 0.5 20", 100.0),
        // A factor.
        ("IESNA91", "1 0.5 20", 50.0),
        ("IESNA:LM-63-1991", "1 0.5 20", 50.0),
        ("IESNA:LM-63-1986", "1 0.5 20", 50.0),
        ("Some lamp", "0.5 0.5 20", 25.0),
    ] {
        let found = axial("a.ies", &ies(first, third));
        assert!((found - due).abs() < 1e-9, "{first}: {found}");
    }
    // A version of the future is not guessed in silence.
    let scene = load("a.ies", &ies("IES:LM-63-2031", "1 1.1 20")).unwrap();
    let warnings = scene.warnings();
    assert_says(&warnings[0], &["unknown version \"IES:LM-63-2031\""]);
}

#[test]
fn any_line_end_a_byte_order_mark_and_the_end_of_an_old_text_are_read() {
    let file = ies("IESNA:LM-63-2002", "1 1 20");
    let ldt = eulumdat(0, &[0.0], &[300.0, 100.0], 3000.0);
    for end in ["\r\n", "\r", "\n"] {
        let ends = |file: &str| format!("\u{feff}{}\u{1a}", file.replace('\n', end));
        assert_near(axial("a.ies", &ends(&file)), 100.0);
        assert_near(axial("a.ldt", &ends(&ldt)), 900.0);
    }
}

#[test]
fn tilt_is_read_from_the_file_itself() {
    let include = |angles: &str| {
        let file = ies("IESNA:LM-63-2002", "1 1 20");
        file.replace("TILT=NONE", &format!("TILT = include\n1\n{angles}"))
    };
    let scene = load("a.ies", &include("3\n0 45 90\n0.95 1.0 0.8")).unwrap();
    assert_near(candela(&scene, 0.0, 0.0), 95.0);
    assert!(scene.warnings()[0].contains("factors of tilted lamps"));
    let scene = load("a.ies", &include("2\n0 90\n1 1")).unwrap();
    assert_near(candela(&scene, 0.0, 0.0), 100.0);
    assert_eq!(scene.warnings(), [""; 0]);
    rows! { refuses;
        include("1\n45\n1") => "no factor for a tilt of 0 degrees";
        include("0\n") => "the number of tilt angles is 0";
        include("1\n0\n1").replace("include\n1\n", "include\n4\n") =>
            "the lamp-to-luminaire geometry is 4";
        include("").replace("= include", "= tilt.tlt") =>
            "a.ies:3: TILT=tilt.tlt names another file, which camlux does not read; write TILT=INCLUDE and the lines of that file";
    }
}

#[test]
fn numbers_beyond_those_that_a_file_states_are_counted() {
    let file = ies("IESNA:LM-63-2002", "1 1 20");
    let error = load("a.ies", &format!("{file}20 10\n5\n")).expect_err("more");
    assert!(
        error.contains("a.ies:9: the file holds 3 more numbers than its counts of angles state"),
        "{error}"
    );
    let ldt = eulumdat(0, &[0.0], &[300.0, 100.0], 3000.0);
    let error = load("a.ldt", &format!("{ldt}\n7\n8\n")).expect_err("more");
    assert_says(&error, &["the file holds 2 more numbers than"]);
    // Text is none, and is named.
    for (name, file) in [("a.ies", file), ("a.ldt", ldt)] {
        let scene = load(name, &format!("{file}the end\n")).expect("it loads");
        assert!(scene.warnings()[0].contains("the text after its numbers, from line"));
    }
}

#[test]
fn what_a_file_holds_beyond_the_pattern_is_named_once() {
    let file = ies("IESNA:LM-63-2002", "1 1 20")
        .replace("2 0 0 0", "2 0.1 0.1 0")
        .replace(
            "[TEST] none",
            "[TEST] none\n[NEARFIELD] 1 2 3\n[MANUFAQ] me\n[_OWN] x\n[MULTIPLIER] 2",
        );
    let scene = load("a.ies", &file).unwrap();
    let warnings = scene.warnings();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    for part in [
        "[NEARFIELD]",
        "the unknown \"MANUFAQ\", perhaps \"MANUFAC\"",
        "\"MULTIPLIER\"",
        "the size of its opening",
    ] {
        assert!(warnings[0].contains(part), "{warnings:?}");
    }
    assert!(!warnings[0].contains("OWN") && !warnings[0].contains("[TEST]"));
}

/// A EULUMDAT file of these intensities at γ = 0 and 90, and of one set of lamps.
fn eulumdat(symmetry: u32, planes: &[f64], intensities: &[f64], flux_lm: f64) -> String {
    let head = format!(
        "nobody\n1\n{symmetry}\n{}\n90\n2\n90\nreport\nlamp\nnumber\nfile\ndate\n100\n100\n50\n0\n0\n0\n0\n0\n0\n100\n100\n1,0\n0\n1\n",
        planes.len(),
    );
    let lamps = format!("1\nLED\n{flux_lm}\n3000K\n80\n10\n");
    let factors = "0.5\n".repeat(10);
    let gammas = [0.0, 90.0];
    let numbers = planes.iter().chain(&gammas).chain(intensities);
    let numbers: String = numbers.map(|number| format!("{number}\n")).collect();
    format!("{head}{lamps}{factors}{numbers}")
}

/// 300 cd/klm of 3000 lm are 900 cd.
#[test]
fn eulumdat_gives_candela_by_the_flux_of_its_lamps() {
    let file = eulumdat(1, &[0.0], &[300.0, 100.0], 3000.0);
    assert_near(axial("a.ldt", &file), 900.0);
    let same = ies("IESNA:LM-63-2002", "1 1 20").replace("100 50", "900 300");
    let [a, b] = [("a.ldt", &file), ("a.ies", &same)].map(|(name, file)| {
        let scene = load(name, file).unwrap();
        [0.0, 30.0, 60.0].map(|gamma| candela(&scene, gamma, 10.0))
    });
    a.iter().zip(b).for_each(|(a, b)| assert_near(*a, b));
    // The flux is that of all lamps. A negative number of lamps makes it that of the luminaire, and keeps cd/klm.
    for lamps in ["2", "-1"] {
        let file = file.replace("\n1\nLED", &format!("\n{lamps}\nLED"));
        assert_near(axial("a.ldt", &file), 900.0);
    }
    // The first of several sets applies.
    let set = "1\nLED\n3000\n3000K\n80\n10\n";
    let two = file.replace(set, &format!("{set}{}", set.replace("3000\n", "1500\n")));
    let two = two.replace("1,0\n0\n1\n", "1,0\n0\n2\n");
    let scene = load("a.ldt", &two).unwrap();
    assert_near(candela(&scene, 0.0, 0.0), 900.0);
    assert!(scene.warnings()[0].contains("other sets of lamps"));
    // Without a flux the intensities are only relative, which power_w allows.
    let error = load("a.ldt", &eulumdat(1, &[0.0], &[300.0, 100.0], 0.0)).expect_err("no flux");
    assert!(
        error.contains("a.ldt:29: the flux of the lamps is \"0\"")
            && error.contains("give power_w"),
        "{error}"
    );
}

#[test]
fn eulumdat_needs_only_the_planes_of_its_symmetry() {
    let planes: Vec<f64> = (0..6).map(|i| 60.0 * f64::from(i)).collect();
    // C0, C60, C120, C180; γ = 0 and 90.
    let values = [10., 1., 10., 2., 10., 3., 10., 4.];
    let scene = load("a.ldt", &eulumdat(2, &planes, &values, 1000.0)).unwrap();
    for (plane_deg, due) in [
        (0.0, 1.0),
        (60.0, 2.0),
        (180.0, 4.0),
        (300.0, 2.0),
        (240.0, 3.0),
    ] {
        let found = candela(&scene, 90.0, plane_deg);
        assert!((found - due).abs() < 1e-6, "{plane_deg}: {found}");
    }
    for symmetry in [3, 4] {
        let error = load("a.ldt", &eulumdat(symmetry, &planes, &values, 1000.0)).expect_err("6");
        assert!(error.contains("needs a multiple of 4"), "{error}");
    }
}

/// The same lamp by its whole turn, by the half from 90 to 270 degrees, and by other halves and turns.
#[test]
fn horizontal_angles_may_begin_anywhere_in_a_turn() {
    let at = |plane_deg: f64| 60.0 + 30.0 * plane_deg.to_radians().sin();
    let file = |first: i32, last: i32, at: &dyn Fn(f64) -> f64| {
        let planes: Vec<i32> = (first..=last).step_by(30).collect();
        let values = planes
            .iter()
            .map(|&plane| format!("100 {}\n", at(plane.into())));
        let (values, angles): (String, Vec<String>) = (
            values.collect(),
            planes.iter().map(i32::to_string).collect(),
        );
        format!(
            "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 {} 1 2 0 0 0\n1 1 9\n0 90\n{}\n{values}",
            planes.len(),
            angles.join(" ")
        )
    };
    // sin C is symmetric about the plane from 90 to 270 degrees.
    for (first, last) in [
        (0, 360),
        (90, 270),
        (-90, 90),
        (-180, 180),
        (90, 450),
        (0, 330),
        (270, 450),
    ] {
        let scene = load("a.ies", &file(first, last, &at)).unwrap();
        for plane in (0..360).step_by(30) {
            let (found, due) = (candela(&scene, 90.0, plane.into()), at(plane.into()));
            assert!(
                (found - due).abs() < 1e-6,
                "{first} {last} {plane}: {found} {due}"
            );
        }
    }
    let at = |plane_deg: f64| 60.0 + 30.0 * (2.0 * plane_deg).to_radians().cos();
    for (first, last) in [(0, 90), (90, 180), (180, 360), (0, 180)] {
        let scene = load("a.ies", &file(first, last, &at)).unwrap();
        for plane in (0..360).step_by(30) {
            let (found, due) = (candela(&scene, 90.0, plane.into()), at(plane.into()));
            assert!(
                (found - due).abs() < 1e-6,
                "{first} {last} {plane}: {found} {due}"
            );
        }
    }
    for (first, last) in [(0, 120), (30, 120), (0, 270), (60, 240)] {
        let error = load("a.ies", &file(first, last, &at)).expect_err("a gap");
        let says = format!("the horizontal angles are from {first} to {last} degrees");
        assert!(error.contains(&says), "{error}");
    }
}

/// Angles of types A and B in the directions of type C, and a file of that type.
fn file_of_type(
    kind: u32,
    vertical: &[f64],
    horizontal: &[f64],
    at: impl Fn(f64, f64) -> f64,
) -> String {
    let list = |numbers: &[f64]| numbers.iter().map(|n| format!("{n}\n")).collect::<String>();
    let values = horizontal
        .iter()
        .flat_map(|&h| vertical.iter().map(move |&v| (v, h)));
    let values: Vec<f64> = values.map(|(v, h)| at(v, h)).collect();
    format!(
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 {} {} {kind} 2 0 0 0\n1 1 9\n{}{}{}",
        vertical.len(),
        horizontal.len(),
        list(vertical),
        list(horizontal),
        list(&values)
    )
}

fn steps(first: f64, last: f64, step: f64) -> Vec<f64> {
    let count = ((last - first) / step).round() as u32;
    (0..=count).map(|i| first + step * f64::from(i)).collect()
}

/// Forward, up and right of a direction of type A (polar axis up) or B (polar axis to the right).
fn direction(kind: u32, vertical_deg: f64, horizontal_deg: f64) -> DVec3 {
    let ((sv, cv), (sh, ch)) = (
        vertical_deg.to_radians().sin_cos(),
        horizontal_deg.to_radians().sin_cos(),
    );
    match kind {
        3 => DVec3::new(cv * ch, sv, cv * sh),
        _ => DVec3::new(ch * cv, ch * sv, sh),
    }
}

/// A beam that is symmetric about its axis is the same lamp in each type of photometry. Linear interpolation over 1 degree alone is off by
/// 20 · 1000 cd · (1°)²/8 = 0.8 cd in each angle.
#[test]
fn a_round_beam_is_the_same_in_each_type_of_photometry() {
    let beam = |gamma: f64| 1000.0 * gamma.cos().max(0.0).powi(20);
    let of_c = file_of_type(1, &steps(0.0, 90.0, 1.0), &[0.0], |v, _| {
        beam(v.to_radians())
    });
    let of_c = load("a.ies", &of_c).unwrap();
    let flux = |scene: &Scene| pattern(scene).peak * PatternIntegral::new(pattern(scene)).total();
    let due_lm = flux(&of_c);
    // ∫ cosⁿ over a half space is 2π/(n + 1).
    assert!((due_lm / (1000.0 * 2.0 * PI / 21.0) - 1.0).abs() < 3e-3);
    for kind in [2, 3] {
        for first in [-90.0, 0.0] {
            let angles = steps(first, 90.0, 1.0);
            let file = file_of_type(kind, &angles, &angles, |v, h| {
                beam(direction(kind, v, h).x.clamp(-1.0, 1.0).acos())
            });
            let scene = load("a.ies", &file).expect("it loads");
            let found_lm = flux(&scene);
            assert!(
                (found_lm / due_lm - 1.0).abs() < 1e-3,
                "{kind}: {found_lm} {due_lm}"
            );
            for plane in (0..360).step_by(17) {
                for gamma in [0.0, 3.0, 10.5, 20.0, 45.0, 89.0] {
                    let plane = f64::from(plane);
                    let (found, due) =
                        (candela(&scene, gamma, plane), candela(&of_c, gamma, plane));
                    assert!(
                        (found - due).abs() < 2.0,
                        "{kind}, {gamma}, {plane}: {found} {due}"
                    );
                }
            }
        }
    }
}

/// `up` is V = 90, and H = 90 is on the right of one who looks along the direction. Seen from there C turns the other way.
#[test]
fn types_a_and_b_keep_up_and_right() {
    let angles = steps(-90.0, 90.0, 10.0);
    for kind in [2, 3] {
        let file = file_of_type(kind, &angles, &angles, |v, h| {
            let towards = direction(kind, v, h);
            100.0 + 50.0 * towards.y + 20.0 * towards.z
        });
        let scene = load("a.ies", &file).expect("it loads");
        for (gamma, plane) in [
            (0.0, 0.0),
            (30.0, 0.0),
            (30.0, 90.0),
            (40.0, 180.0),
            (60.0, 270.0),
            (50.0, 35.0),
        ] {
            let (sin_gamma, plane_rad) = (f64::to_radians(gamma).sin(), f64::to_radians(plane));
            let due = 100.0 + sin_gamma * (50.0 * plane_rad.cos() - 20.0 * plane_rad.sin());
            let found = candela(&scene, gamma, plane);
            assert!(
                (found - due).abs() < 0.7,
                "{kind}, {gamma}, {plane}: {found} {due}"
            );
        }
        // Behind its axis nothing was measured.
        assert_eq!(candela(&scene, 120.0, 40.0), 0.0);
    }
    rows! { refuses;
        file_of_type(3, &[0.0, 100.0], &[0.0, 90.0], |_, _| 1.0) =>
            "the vertical angles are not all within -90 and 90 degrees";
        file_of_type(2, &[0.0, 90.0], &[0.0], |_, _| 1.0) =>
            "the horizontal angles do not increase, or are fewer than two";
        file_of_type(4, &[0.0, 90.0], &[0.0], |_, _| 1.0) => "photometry of type 4 is not known";
    }
}

/// A map of all directions holds only ratios.
#[test]
fn the_values_of_a_map_are_no_candela() {
    let folder = SceneFolder::new();
    image::GrayImage::from_pixel(8, 4, image::Luma([128]))
        .save(folder.path("map.png"))
        .unwrap();
    let light = format!("{LIGHT}pattern = \"map.png\"\nscale = \"file\"\n");
    let error = folder
        .load(&format!("{CAMERA}{light}{MESH}"))
        .expect_err("no unit");
    assert!(
        error
            .to_string()
            .contains("is a map, whose values are only ratios"),
        "{error}"
    );
}
