//! Projectors, and maps of all directions: images as lights.

use std::f64::consts::{PI, TAU};

use crate::common::lamps;
use crate::common::rows::rows;
use crate::common::scene_folder::{CAMERA, MESH, SceneFolder, assert_says};
use camlux::{
    emission::EmissionDomain,
    model::{irradiance_facing, radiant_intensity},
    scene::{BoundingSphere, Light, Profile, ProjectedImage, Shared},
};
use glam::DVec3;
use image::{GrayImage, Luma, Rgb, RgbImage};

fn load(folder: &SceneFolder, light: &str) -> Result<Light, String> {
    let scene = folder.load(&format!("{CAMERA}[[light]]\n{light}{MESH}"));
    scene
        .map(|scene| scene.lights[0].light.clone())
        .map_err(|error| error.to_string())
}

fn projected(light: Result<Light, String>) -> Shared<ProjectedImage> {
    match light.map(|light| light.lamp().map(|lamp| lamp.profile.clone())) {
        Ok(Some(Profile::Projected(image))) => image,
        other => panic!("it is a projector: {other:?}"),
    }
}

const PLACE: &str = "position = [0, 2, 0]\ndirection = [0, -1, 0]\nup = [1, 0, 0]\n";

/// Each pixel lights a floor evenly, with its value's share of the flux. Looking down with x up, right is z.
#[test]
fn each_pixel_lights_a_screen_evenly() {
    let light = lamps::projector(DVec3::ZERO, DVec3::NEG_Y, [6.0; 3]);
    let up = light.up().expect("it is one");
    let image = lamps::image();
    let (down, right) = (
        -(up - up.y * DVec3::Y).normalize(),
        DVec3::NEG_Y.cross(up).normalize(),
    );
    let sum: f64 = image.values.iter().map(|&value| f64::from(value)).sum();
    let height_m = 2.0;
    let pixel_m2 = (height_m / image.intrinsics.fx) * (height_m / image.intrinsics.fy);
    for row in 0..3 {
        for column in 0..5 {
            let value = f64::from(image.values[5 * row + column]);
            for (dx, dy) in [(0.5, 0.5), (0.02, 0.9), (0.97, 0.01)] {
                let u = (column as f64 + dx - image.intrinsics.cx) / image.intrinsics.fx;
                let v = (row as f64 + dy - image.intrinsics.cy) / image.intrinsics.fy;
                let floor_m = height_m * (u * right + v * down + DVec3::NEG_Y);
                let cosine = height_m / floor_m.length();
                let found = irradiance_facing(&light, floor_m)[0] * cosine;
                let due = 6.0 * value / sum / pixel_m2;
                assert!(
                    (found - due).abs() < 1e-12 * 6.0,
                    "{column} {row}: {found} {due}"
                );
            }
        }
    }
    assert_eq!(
        radiant_intensity(&light, DVec3::Y).expect("it has one"),
        [0.0; 3]
    );
}

/// For any number of texels, their sum is all of the power, over the solid angle of the image.
#[test]
fn texels_hold_the_image_exactly() {
    let light = lamps::projector(DVec3::ZERO, DVec3::new(0.3, -1.0, 0.2), [3.0; 3]);
    let sphere = BoundingSphere {
        centre_m: DVec3::ZERO,
        radius_m: 1.0,
    };
    let mut measures = Vec::new();
    for size in [1, 4, 7, 64] {
        let domain = EmissionDomain::new(&light, size, &sphere);
        assert_eq!(domain.faces.len(), 1);
        let powers = domain.texels.iter().map(|t| domain.incident_power_w(t)[0]);
        let power_w: f64 = powers.sum();
        assert!((power_w / 3.0 - 1.0).abs() < 1e-13, "{size}: {power_w}");
        measures.push(domain.total_measure());
        // A texel within a pixel has the mean of 1/cos³ there.
        if size == 64 {
            let face = domain.faces[0];
            let mut whole = 0;
            for (i, texel) in domain.texels.iter().enumerate() {
                let corner = |dx: f64, dy: f64| {
                    let u = 2.0 * ((i % 64) as f64 + dx) / 64.0 - 1.0;
                    let v = 1.0 - 2.0 * ((i / 64) as f64 + dy) / 64.0;
                    face.forward + face.half_extent * (u * face.right + v * face.up)
                };
                let intensity =
                    |direction| radiant_intensity(&light, direction).expect("it has one")[0];
                let ends = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
                let ends = ends
                    .map(|(dx, dy)| intensity(corner(dx, dy)) * corner(dx, dy).length().powi(-3));
                let is_whole = ends.iter().all(|end| (end / ends[0] - 1.0).abs() < 1e-9);
                if !is_whole {
                    continue;
                }
                whole += 1;
                let middle = intensity(corner(0.5, 0.5));
                let mean = domain.incident_power_w(texel)[0] / texel.measure;
                assert!((mean / middle - 1.0).abs() < 3e-3, "{i}: {mean} {middle}");
            }
            assert!(whole > 500, "{whole}");
        }
    }
    for measure in &measures {
        assert!((measure / measures[0] - 1.0).abs() < 1e-12, "{measures:?}");
    }
}

#[test]
fn projectors_are_read() {
    let folder = SceneFolder::new();
    GrayImage::from_fn(4, 2, |x, y| Luma([(60 * x + 10 * y) as u8]))
        .save(folder.path("grey.png"))
        .unwrap();
    RgbImage::from_pixel(2, 2, Rgb([9, 8, 9]))
        .save(folder.path("colours.png"))
        .unwrap();
    GrayImage::new(2, 2).save(folder.path("black.png")).unwrap();
    let projector = |image: &str, more: &str| {
        let text = format!("kind = \"projector\"\nimage = \"{image}\"\n{PLACE}{more}\n");
        load(&folder, &text)
    };
    let image = projected(projector(
        "grey.png",
        "fov_y_deg = 90\nencoding = \"linear\"\npower_w = 2",
    ));
    let lens = image.intrinsics;
    assert!((lens.fx - 1.0).abs() < 1e-12 && (lens.fy - 1.0).abs() < 1e-12);
    assert_eq!([lens.cx, lens.cy], [2.0, 1.0]);
    assert!((f64::from(image.values[7]) - 190.0 / 255.0).abs() < 1e-7);
    // OpenEXR values are linear and are divided by the largest one.
    let exr = |name: &str, value: fn(usize, usize) -> [f32; 3]| {
        let values = |x, y| <(f32, f32, f32)>::from(value(x, y));
        exr::prelude::write_rgb_file(folder.path(name), 3, 2, values).expect("it is written");
    };
    exr("grey.exr", |x, y| [(x + 4 * y) as f32; 3]);
    exr("colours.exr", |x, _| [1.0, x as f32, 1.0]);
    exr("dark.exr", |x, _| [-(x as f32); 3]);
    let image = projected(projector("grey.exr", "fov_y_deg = 90\npower_w = 2"));
    assert_eq!(
        image.values,
        [0.0, 1.0, 2.0, 4.0, 5.0, 6.0].map(|v: f32| v / 6.0)
    );
    let refuses = |(image, more): &(&str, &str), words: &[&str]| {
        assert_says(&projector(image, more).expect_err(image), words);
    };
    rows! { refuses;
        ("colours.exr", "fov_y_deg = 90\npower_w = 2") =>
            "it is not grey", "set the bands with power_w";
        ("dark.exr", "fov_y_deg = 90\npower_w = 2") =>
            "a pixel is -1", "save finite values of 0 or more";
        ("none.exr", "fov_y_deg = 90\npower_w = 2") => "there is no such file", "check the name";
        ("colours.png", "fov_y_deg = 90\npower_w = 2") =>
            "colours.png is not grey", "save it as a grey image";
        ("black.png", "fov_y_deg = 90\npower_w = 2") =>
            "at least one above 0", "light 0 (projector)";
        ("grey.png", "power_w = 2") => "[[light]] has neither \"fov_y_deg\" nor", "add fov_y_deg";
        ("grey.png", "fov_y_deg = 179\npower_w = 2") =>
            "degrees off the axis", "above the maximum of 84";
        ("grey.png", "fov_y_deg = 90\nencoding = \"gamma\"\npower_w = 2") =>
            "unknown encoding \"gamma\"", "linear";
        ("none.png", "fov_y_deg = 90\npower_w = 2") => "none.png", "cannot read";
    }
}

/// An even map emits equally in all directions. A map that is white above the horizon of γ = 90° emits into half of them.
#[test]
fn maps_are_patterns_of_all_directions() {
    let folder = SceneFolder::new();
    GrayImage::from_pixel(8, 4, Luma([200]))
        .save(folder.path("even.png"))
        .unwrap();
    GrayImage::from_fn(360, 1800, |_, y| Luma([if y < 900 { 255 } else { 0 }]))
        .save(folder.path("half.png"))
        .unwrap();
    // Each column is a C plane. Plane 0 is midway between the last and the first column.
    GrayImage::from_fn(4, 3, |x, _| Luma([[255, 0, 0, 0][x as usize]]))
        .save(folder.path("side.png"))
        .unwrap();
    let map = |name: &str| {
        let text = format!(
            "kind = \"pattern\"\npattern = \"{name}\"\nencoding = \"linear\"\n{PLACE}power_w = 1\n"
        );
        load(&folder, &text).expect("it loads")
    };
    let total = |light: &Light| light.lamp().expect("it has a pattern").profile.total();
    assert!((total(&map("even.png")) / (4.0 * PI) - 1.0).abs() < 1e-12);
    assert!((total(&map("half.png")) / TAU - 1.0).abs() < 1e-3);
    // The same in OpenEXR, with values of any size.
    let of_column = |x, _| [(1000 * usize::from(x == 0)) as f32; 3].into();
    exr::prelude::write_rgb_file(folder.path("side.exr"), 4, 3, of_column).expect("it is written");
    assert_eq!(map("side.exr"), map("side.png"));
    let side = map("side.png");
    let at = |towards| radiant_intensity(&side, towards).expect("it has one")[0];
    let peak = at(DVec3::X - DVec3::Z);
    for (towards, due) in [
        (DVec3::X, 0.5 * peak),
        (-DVec3::Z, 0.5 * peak),
        (-DVec3::X - DVec3::Z, 0.0),
        (DVec3::Z, 0.0),
    ] {
        assert!((at(towards) - due).abs() < 1e-12 * peak, "{towards}");
    }
}

/// An even map behind a spot light's opening equals the spot light.
#[test]
fn a_pattern_may_lie_in_an_opening() {
    let folder = SceneFolder::new();
    GrayImage::from_pixel(8, 8, Luma([255]))
        .save(folder.path("even.png"))
        .unwrap();
    let within = |opening: &str| {
        let text =
            format!("kind = \"pattern\"\npattern = \"even.png\"\n{PLACE}{opening}power_w = 3\n");
        load(&folder, &text)
    };
    let spot = "kind = \"spot\"\nposition = [0, 2, 0]\ndirection = [0, -1, 0]\ninner_half_angle_deg = 20\nouter_half_angle_deg = 35\npower_w = 3\n";
    let spot = load(&folder, spot).expect("it loads");
    let opened =
        within("inner_half_angle_deg = 20\nouter_half_angle_deg = 35\n").expect("it loads");
    for gamma_deg in [0.0, 10.0, 19.9, 25.0, 30.0, 34.0, 35.5, 90.0] {
        let (sin, cos) = f64::to_radians(gamma_deg).sin_cos();
        let towards = DVec3::new(0.6 * sin, -cos, 0.8 * sin);
        let [a, b] =
            [&spot, &opened].map(|light| radiant_intensity(light, towards).expect("it has one")[0]);
        let axial = radiant_intensity(&spot, DVec3::NEG_Y).expect("it has one")[0];
        assert!((a - b).abs() < 1e-3 * axial, "{gamma_deg}: {a} {b}");
    }
    // With a sharp edge, the integral is the cone's solid angle.
    let sharp = within("inner_half_angle_deg = 30\nouter_half_angle_deg = 30\n").expect("it loads");
    let total = sharp.lamp().expect("it has a pattern").profile.total();
    let cone = TAU * (1.0 - f64::to_radians(30.0).cos());
    assert!((total / cone - 1.0).abs() < 1e-8);
    for (opening, part) in [
        ("inner_half_angle_deg = 20\n", "give both"),
        (
            "inner_half_angle_deg = 40\nouter_half_angle_deg = 30\n",
            "and inner_half_angle_deg is 40",
        ),
    ] {
        let error = within(opening).expect_err(opening);
        assert!(error.contains(part), "{error}");
    }
}
