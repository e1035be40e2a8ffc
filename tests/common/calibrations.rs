//! Published calibrations of real lenses.

use camlux::scene::{Distortion, Intrinsics, Lens};

pub struct Calibration {
    pub name: &'static str,
    pub resolution_px: [u32; 2],
    pub lens: Lens,
}

/// In OpenCV's convention, pixel centres are whole numbers. So half a pixel is added to the published principal points.
pub fn published() -> [Calibration; 6] {
    let calibration = |name, resolution_px, [fx, fy, cx, cy]: [f64; 4], distortion| Calibration {
        name,
        resolution_px,
        lens: Lens::Distorted {
            intrinsics: Intrinsics {
                fx,
                fy,
                cx: cx + 0.5,
                cy: cy + 0.5,
            },
            distortion,
        },
    };
    let rational = Distortion::Rational;
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
            rational([
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
            rational([
                0.262383, -0.953104, -0.005358, 0.002628, 1.163314, 0.0, 0.0, 0.0,
            ]),
        ),
        calibration(
            "EuRoC MAV, cam0",
            [752, 480],
            [458.654, 457.296, 367.215, 248.375],
            rational([
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
            rational([
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
            rational([
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
