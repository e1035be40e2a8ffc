//! Calibrations of lenses.

use camlux::scene::{Distortion, Intrinsics, Lens};

pub struct Calibration {
    pub name: &'static str,
    pub resolution_px: [u32; 2],
    pub lens: Lens,
}

/// A calibration by OpenCV, in whose convention pixel centres are whole numbers: half a pixel is added to the principal point.
fn calibration(
    name: &'static str,
    resolution_px: [u32; 2],
    [fx, fy, cx, cy]: [f64; 4],
    distortion: Distortion,
) -> Calibration {
    Calibration {
        name,
        resolution_px,
        lens: Lens::Distorted {
            intrinsics: Intrinsics {
                fx,
                fy,
                cx: cx + 0.5,
                cy: cy + 0.5,
                skew: 0.0,
            },
            distortion,
        },
    }
}

fn rational(vector: &[f64]) -> Distortion {
    Distortion::from_opencv(vector).expect("a length of OpenCV's")
}

pub fn all() -> Vec<Calibration> {
    published().into_iter().chain(made_up()).collect()
}

/// Lenses with a thin prism, a tilted sensor and skew.
fn made_up() -> [Calibration; 2] {
    let focal_and_centre = [458.654, 457.296, 367.215, 248.375];
    let prism = [
        -0.28, 0.07, 2e-4, -3e-4, 0.01, 0.02, -0.01, 0.002, 0.011, -0.004, -0.007, 0.003,
    ];
    let tilted = [&prism[..], &[0.06, -0.09]].concat();
    let size_px = [752, 480];
    let mut calibrations = [
        calibration("thin prism", size_px, focal_and_centre, rational(&prism)),
        calibration("tilt, skew", size_px, focal_and_centre, rational(&tilted)),
    ];
    if let Lens::Distorted { intrinsics, .. } = &mut calibrations[1].lens {
        intrinsics.skew = 3.5;
    }
    calibrations
}

/// Real lenses.
fn published() -> [Calibration; 6] {
    [
        calibration(
            "Asus ZenPhone AR, colour",
            [1920, 1080],
            [
                1484.120151053405,
                1483.296808359715,
                982.1869163422028,
                543.0569322723705,
            ],
            rational(&[
                0.09370951394834764,
                -0.1640721737187069,
                0.0,
                0.0,
                0.1224192868301668,
                0.0,
                0.0,
                0.0,
            ]),
        ),
        calibration(
            "TUM RGB-D, freiburg1",
            [640, 480],
            [517.306408, 516.469215, 318.643040, 255.313989],
            rational(&[
                0.262383, -0.953104, -0.005358, 0.002628, 1.163314, 0.0, 0.0, 0.0,
            ]),
        ),
        calibration(
            "EuRoC MAV, cam0",
            [752, 480],
            [458.654, 457.296, 367.215, 248.375],
            rational(&[
                -0.28340811,
                0.07395907,
                0.00019359,
                1.76187114e-05,
                0.0,
                0.0,
                0.0,
                0.0,
            ]),
        ),
        calibration(
            "KITTI 2011_09_26, camera 0",
            [1392, 512],
            [984.2439, 980.8141, 690.0, 233.1966],
            rational(&[
                -0.3728755,
                0.2037299,
                0.002219027,
                0.001383707,
                -0.07233722,
                0.0,
                0.0,
                0.0,
            ]),
        ),
        calibration(
            "Azure Kinect, colour",
            [1920, 1080],
            [904.141541, 903.521362, 953.284424, 555.142456],
            rational(&[
                0.722746, -2.885590, 0.000783, -0.000143, 1.632723, 0.602199, -2.719626, 1.565053,
            ]),
        ),
        calibration(
            "TUM VI, cam0 (fisheye, 195 degrees)",
            [512, 512],
            [
                190.97847715128717,
                190.9733070521226,
                254.93170605935475,
                256.8974428996504,
            ],
            Distortion::Fisheye([
                0.0034823894022493434,
                0.0007150348452162257,
                -0.0020532361418706202,
                0.00020293673591811182,
            ]),
        ),
    ]
}
