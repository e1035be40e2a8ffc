//! Lens distortion: `ray_direction` inverts `project`, and an image that folds over is refused.

use crate::common::calibrations;
use crate::common::gpu::{distort, rational};
use crate::common::rooms;
use crate::common::rows::assert_says;
use camlux::scene::{Camera, Distortion, Intrinsics, Lens, Sensor, Vignetting};
use glam::{DMat3, DVec2, DVec3};

fn camera(resolution_px: [u32; 2], lens: Lens) -> Camera {
    Camera {
        resolution_px,
        position_m: DVec3::ZERO,
        look_at_m: DVec3::Z,
        up: -DVec3::Y,
        lens,
        pixel_sampling: None,
    }
}

/// The pixel where a camera that looks along z, with y down, sees a direction, by the formulas of OpenCV's manual.
fn pixel_by_the_manual(camera: &Camera, direction: DVec3) -> DVec2 {
    let DVec3 { x, y, z } = direction;
    let distorted = match camera.distortion().expect("it is distorted") {
        Distortion::Rational(coefficients) => {
            let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y] = coefficients;
            let (x, y) = (x / z, y / z);
            let r2 = x * x + y * y;
            let radial = (1.0 + k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3))
                / (1.0 + k4 * r2 + k5 * r2.powi(2) + k6 * r2.powi(3));
            let x_d = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
            let y_d = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
            let prism = [s1 * r2 + s2 * r2.powi(2), s3 * r2 + s4 * r2.powi(2)];
            let shown = DVec3::new(x_d + prism[0], y_d + prism[1], 1.0);
            let (sin_x, cos_x) = tau_x.sin_cos();
            let (sin_y, cos_y) = tau_y.sin_cos();
            // By rows, as the manual has them.
            let of_rows = |rows: [[f64; 3]; 3]| DMat3::from_cols_array_2d(&rows).transpose();
            let about_y = of_rows([[cos_y, 0.0, -sin_y], [0.0, 1.0, 0.0], [sin_y, 0.0, cos_y]]);
            let about_x = of_rows([[1.0, 0.0, 0.0], [0.0, cos_x, sin_x], [0.0, -sin_x, cos_x]]);
            let r = about_y * about_x;
            let r13 = r.row(0).z;
            let (r23, r33) = (r.row(1).z, r.row(2).z);
            let onto = of_rows([[r33, 0.0, -r13], [0.0, r33, -r23], [0.0, 0.0, 1.0]]);
            let tilted = onto * r * shown;
            tilted.truncate() / tilted.z
        }
        Distortion::Fisheye([k1, k2, k3, k4]) => {
            let r = x.hypot(y);
            let angle = r.atan2(z);
            let shown = angle
                * (1.0
                    + k1 * angle.powi(2)
                    + k2 * angle.powi(4)
                    + k3 * angle.powi(6)
                    + k4 * angle.powi(8));
            DVec2::new(x, y) * if r > 0.0 { shown / r } else { 1.0 }
        }
        Distortion::Equirectangular => DVec2::new(x.atan2(z), (y / direction.length()).asin()),
    };
    let k = camera.intrinsics_px();
    let x_px = k.fx * distorted.x + k.skew * distorted.y + k.cx;
    DVec2::new(x_px, k.fy * distorted.y + k.cy)
}

#[test]
fn rays_are_seen_at_their_pixels() {
    for calibration in calibrations::all() {
        let camera = camera(calibration.resolution_px, calibration.lens);
        let distortion = camera.distortion().expect("it is distorted");
        let [width, height] = camera.resolution_px;
        let mut largest_px: f64 = 0.0;
        let (rows, columns) = ((0..=height).step_by(4), (0..=width).step_by(4));
        for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
            let pixel = DVec2::new(x.into(), y.into());
            let direction = camera.ray_direction(pixel.x, pixel.y);
            let seen = pixel_by_the_manual(&camera, direction);
            largest_px = largest_px.max(seen.distance(pixel));
            let intrinsics = camera.intrinsics_px();
            let projected = intrinsics.pixel(distortion.project(direction));
            largest_px = largest_px.max(projected.distance(pixel));
        }
        println!("{}: {largest_px:e} px", calibration.name);
        assert!(largest_px < 1e-9, "{}: {largest_px}", calibration.name);
    }
}

#[test]
fn what_the_lens_does_not_see_is_at_no_pixel() {
    let intrinsics = Intrinsics {
        fx: 100.0,
        fy: 100.0,
        cx: 40.0,
        cy: 40.0,
        skew: 0.0,
    };
    let lens = |distortion| Lens::Distorted {
        intrinsics,
        distortion,
    };
    // r·(1 - r²/3) has its maximum at r = 1.
    let folding = rational([-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let at = |lens, point: [f64; 3]| camera([80, 80], lens).project(DVec3::from(point));
    let near = at(lens(folding), [0.9, 0.0, 1.0]).expect("it is seen");
    assert!(
        near.distance(DVec2::new(40.0 + 100.0 * 0.9 * (1.0 - 0.27), 40.0)) < 1e-9,
        "{near}"
    );
    assert_eq!(at(lens(folding), [1.2, 0.0, 1.0]), None);
    assert_eq!(at(lens(folding), [0.1, 0.0, -1.0]), None);
    assert_eq!(at(Lens::Intrinsics(intrinsics), [0.1, 0.0, -1.0]), None);
    let pinhole = at(Lens::Intrinsics(intrinsics), [1.0, -1.0, 2.0]);
    assert_eq!(pinhole, Some(DVec2::new(90.0, -10.0)));
    let behind = at(lens(Distortion::Fisheye([0.0; 4])), [1.0, 0.0, -1.0]);
    let due = DVec2::new(40.0 + 100.0 * 0.75 * std::f64::consts::PI, 40.0);
    assert!(behind.expect("a fisheye sees it").distance(due) < 1e-9);
}

#[test]
fn without_coefficients_nothing_is_distorted() {
    let intrinsics = Intrinsics {
        fx: 100.0,
        fy: 90.0,
        cx: 31.0,
        cy: 25.0,
        skew: 0.0,
    };
    let plain = camera([64, 48], Lens::Intrinsics(intrinsics));
    let distorted = camera(
        [64, 48],
        Lens::Distorted {
            intrinsics,
            distortion: Distortion::Rational([0.0; 14]),
        },
    );
    for (x, y) in [(0.5, 0.5), (31.0, 25.0), (63.5, 47.5)] {
        let [a, b] = [&plain, &distorted].map(|camera| camera.ray_direction(x, y));
        assert!((a - b).length() < 1e-15, "{a} {b}");
    }
}

#[test]
fn an_image_that_folds_over_is_refused() {
    let refused = |size_px: u32, distortion| {
        let intrinsics = Intrinsics {
            fx: 100.0,
            fy: 100.0,
            cx: 0.5 * f64::from(size_px),
            cy: 0.5 * f64::from(size_px),
            skew: 0.0,
        };
        let mut scene = rooms::marked_room();
        scene.camera.resolution_px = [size_px; 2];
        scene.camera.lens = Lens::Distorted {
            intrinsics,
            distortion,
        };
        scene.validate().err().map(|error| error.to_string())
    };
    // r·(1 - r²/3) has its maximum, 2/3, at r = 1. The corners of 94 x 94 pixels are 66.5 pixels from the middle.
    let folding = rational([-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(refused(94, folding), None);
    let error = refused(95, folding).expect("the corners are 67.2 pixels off");
    assert!(error.contains("the distorted image folds over"), "{error}");
    // A fisheye has an image circle, outside which it is black.
    assert_eq!(refused(450, Distortion::Fisheye([0.0; 4])), None);
    assert!(refused(100, Distortion::Fisheye([f64::NAN; 4])).is_some());
    // r / (1 - r²) grows without bound up to r = 1. No pixel shows the branch beyond.
    let pole = rational([0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0]);
    assert_eq!(refused(1000, pole), None);
    assert!(refused(100, Distortion::Rational([f64::NAN; 14])).is_some());
    // x + s1·x² has its minimum, -1/2, at x = -1: a thin prism folds one side.
    let prism = |s1: f64| rational([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, s1, 0.0, 0.0, 0.0]);
    assert_eq!(refused(60, prism(0.5)), None);
    assert!(refused(120, prism(0.5)).is_some());
    // The horizon of a sensor tilted by τ is 1/(tan τ) off the axis, less what the tilt takes: cos τ / tan τ + sin τ = 1 / sin τ.
    let tilt = |deg: f64| {
        let mut coefficients = [0.0; 14];
        coefficients[13] = deg.to_radians();
        Distortion::Rational(coefficients)
    };
    let horizon = |deg: f64| (200.0 / deg.to_radians().sin()) as u32;
    assert_eq!(refused(horizon(30.0) - 4, tilt(30.0)), None);
    assert!(refused(horizon(30.0) + 4, tilt(30.0)).is_some());
    assert!(refused(10, tilt(95.0)).is_some());
}

#[test]
fn a_fisheye_has_an_f_number_only_with_a_measured_vignetting() {
    let mut scene = rooms::marked_room();
    scene.sensor = Some(Sensor {
        pixel_pitch_um: [10.0; 2],
        exposure_time_s: 1e-3,
        duty_cycle: 1.0,
        wavelength_nm: None,
        quantum_efficiency: None,
        f_number: Some(2.0),
        ..Sensor::DEFAULT
    });
    let mut said = |distortion| {
        distort(&mut scene, distortion);
        scene.validate().err().map(|error| error.to_string())
    };
    assert_eq!(said(Distortion::Rational([0.0; 14])), None);
    let error = said(Distortion::Fisheye([0.0; 4])).expect("it is refused");
    assert_says(
        &error,
        &["f_number is given for a fisheye lens", "add vignetting"],
    );
    let sensor = scene.sensor.as_mut().expect("it was given");
    sensor.vignetting = Some(Vignetting([-0.2, 0.0, 0.0]));
    assert!(scene.validate().is_ok());
    scene.camera.lens = Lens::Equirectangular;
    assert!(scene.validate().is_ok());
    scene.sensor.as_mut().expect("it was given").vignetting = None;
    let error = scene.validate().expect_err("it is refused").to_string();
    assert_says(&error, &["f_number is given for a panorama"]);
}

/// A vignetting must leave light wherever the lens sees. The corners are at r = 1.
#[test]
fn a_vignetting_is_above_0_where_the_lens_sees() {
    let mut scene = rooms::marked_room();
    let mut refused = |lens, vignetting| {
        scene.camera.resolution_px = [60, 80];
        scene.camera.lens = lens;
        scene.sensor = Some(Sensor {
            pixel_pitch_um: [10.0; 2],
            exposure_time_s: 1e-3,
            f_number: Some(2.0),
            vignetting: Some(Vignetting(vignetting)),
            ..Sensor::DEFAULT
        });
        scene.validate().err().map(|error| error.to_string())
    };
    let plain = Lens::FovY { fov_y_deg: 50.0 };
    assert_eq!(refused(plain, [-0.99, 0.0, 0.0]), None);
    let error = refused(plain, [-1.25, 0.0, 0.0]).expect("the corners have -0.25");
    assert!(
        error.contains("-0.250 in pixel (0, 0)") || error.contains("-0.250 in pixel (59, 79)"),
        "{error}"
    );
    // 1 - 5r² + 6r⁴ is -1/24 at r² = 5/12, and 2 in the corners; 1 - 4r² + 6r⁴ - 2.5r⁶ is least at r² = 0.4648, 1/8 + 0.0003.
    let error = refused(plain, [-5.0, 6.0, 0.0]).expect("it is below 0 between");
    assert!(
        error.contains("vignetting makes the factor -0.042 in pixel"),
        "{error}"
    );
    let (_, pixel) = error.split_once("in pixel (").expect("it names the pixel");
    let (pixel, _) = pixel.split_once(')').expect("it ends");
    let place: Vec<f64> = pixel
        .split(", ")
        .map(|place| place.parse().unwrap())
        .collect();
    let r = (place[0] + 0.5 - 30.0).hypot(place[1] + 0.5 - 40.0) / 50.0;
    assert!((r * r - 5.0 / 12.0).abs() < 0.02, "{pixel}");
    // With a slope of a double root, and with one that is nowhere 0.
    assert_eq!(refused(plain, [-3.0, 3.0, -0.99]), None);
    assert!(refused(plain, [-3.0, 3.0, -1.01]).is_some());
    assert_eq!(refused(plain, [1.0, 1.0, 1.0]), None);
    // The principal point is in the corner: r is 2 in the opposite one, pixel (59, 79).
    let intrinsics = Intrinsics {
        fx: 80.0,
        fy: 80.0,
        cx: 0.0,
        cy: 0.0,
        skew: 0.0,
    };
    let cornered = Lens::Intrinsics(intrinsics);
    assert_eq!(refused(cornered, [-0.2499, 0.0, 0.0]), None);
    let error = refused(cornered, [-0.26, 0.0, 0.0]).expect("1 - 0.26·4");
    assert!(error.contains("-0.040 in pixel (59, 79)"), "{error}");
    // A fisheye of f = 8 px sees π·8 = 25.13 px around the middle, r² = 0.2527; outside, it is black.
    let fisheye = Lens::Distorted {
        intrinsics: Intrinsics {
            fx: 8.0,
            fy: 8.0,
            cx: 30.0,
            cy: 40.0,
            skew: 0.0,
        },
        distortion: Distortion::Fisheye([0.0; 4]),
    };
    assert_eq!(refused(fisheye, [-3.9, 0.0, 0.0]), None);
    assert!(refused(fisheye, [-4.0, 0.0, 0.0]).is_some());
}
