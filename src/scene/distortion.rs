//! Lens distortion, with the models and coefficients of OpenCV.

use glam::{DMat2, DVec2, DVec3};

/// The coefficients of a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distortion {
    /// The model of `cv::calibrateCamera` (Brown and Conrady, with a rational radial part): k1 k2 p1 p2 k3 k4 k5 k6.
    Rational([f64; 8]),
    /// The model of `cv::fisheye` (Kannala and Brandt): k1 k2 k3 k4.
    Fisheye([f64; 4]),
}

/// Steps from the principal point to an image point; each starts from the result of the one before.
const STEPS: u32 = 16;
/// Newton iterations per step.
const ITERATIONS: u32 = 20;
/// The precision of the iterations, focal lengths.
const PRECISION: f64 = 1e-14;

impl Distortion {
    /// What OpenCV calls the coefficients of [`Distortion::Rational`].
    pub const RATIONAL: [&str; 8] = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"];
    /// What OpenCV calls the coefficients of [`Distortion::Fisheye`].
    pub const FISHEYE: [&str; 4] = ["k1", "k2", "k3", "k4"];

    /// The name of the model in OpenCV.
    pub fn model(&self) -> &'static str {
        match self {
            Distortion::Rational(_) => "rational",
            Distortion::Fisheye(_) => "fisheye",
        }
    }

    /// The coefficients, in OpenCV's order.
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Distortion::Rational(coefficients) => coefficients,
            Distortion::Fisheye(coefficients) => coefficients,
        }
    }

    /// The image point of a direction in the camera's axes (x right, y down, z forward), focal lengths from the principal point. For
    /// [`Distortion::Rational`], z must be above 0.
    pub fn project(&self, direction: DVec3) -> DVec2 {
        let across = direction.truncate();
        match self {
            Distortion::Rational(coefficients) => rational(coefficients, across / direction.z).0,
            Distortion::Fisheye(k) => {
                let angle = across.length().atan2(direction.z);
                across.normalize_or_zero() * fisheye(k, angle).0
            }
        }
    }

    /// The direction in the camera's axes at an image point: of length 1 for [`Distortion::Fisheye`], otherwise with z = 1. `None` if the
    /// image folds over between the principal point and this point, or if the lens sees nothing that far out.
    pub fn unproject(&self, point: DVec2) -> Option<DVec3> {
        match self {
            Distortion::Rational(coefficients) => {
                let mut undistorted = DVec2::ZERO;
                for step in 1..=STEPS {
                    let aim = point * (f64::from(step) / f64::from(STEPS));
                    undistorted = rational_solved(coefficients, aim, undistorted)?;
                }
                Some(undistorted.extend(1.0))
            }
            Distortion::Fisheye(k) => {
                let radius = point.length();
                let mut angle = 0.0;
                for step in 1..=STEPS {
                    angle = fisheye_solved(k, radius * f64::from(step) / f64::from(STEPS), angle)?;
                }
                let across = point.normalize_or_zero() * angle.sin();
                Some(across.extend(angle.cos()))
            }
        }
    }
}

/// The distorted point and its derivatives.
fn rational(&[k1, k2, p1, p2, k3, k4, k5, k6]: &[f64; 8], point: DVec2) -> (DVec2, DMat2) {
    let DVec2 { x, y } = point;
    let r2 = point.length_squared();
    let above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    let below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
    let radial = above / below;
    // Derivatives by r².
    let above_slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
    let below_slope = k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6);
    let slope = (above_slope - radial * below_slope) / below;
    let distorted = DVec2::new(
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    );
    let mixed = 2.0 * (x * y * slope + p1 * x + p2 * y);
    let by_x = DVec2::new(
        radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
        mixed,
    );
    let by_y = DVec2::new(
        mixed,
        radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
    );
    // Past a pole, the radial part starts again from below. The sign marks such points as folded.
    let derivatives = DMat2::from_cols(by_x, by_y) * below.signum();
    (distorted, derivatives)
}

/// The point that the lens distorts to `aim`, by Newton's method from a point near it; `None` past a fold.
fn rational_solved(coefficients: &[f64; 8], aim: DVec2, near: DVec2) -> Option<DVec2> {
    let mut point = near;
    for _ in 0..ITERATIONS {
        let (distorted, derivatives) = rational(coefficients, point);
        let is_unfolded = derivatives.determinant() > 0.0 && derivatives.x_axis.x > 0.0;
        if !is_unfolded {
            return None;
        }
        let off = aim - distorted;
        point += derivatives.inverse() * off;
        if off.length() <= PRECISION * (1.0 + aim.length()) {
            return Some(point);
        }
    }
    None
}

/// Distance from the principal point at which a fisheye lens shows this angle from the axis, focal lengths, and its derivative.
fn fisheye(&[k1, k2, k3, k4]: &[f64; 4], angle: f64) -> (f64, f64) {
    let a2 = angle * angle;
    let radius = angle * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))));
    let slope = 1.0 + a2 * (3.0 * k1 + a2 * (5.0 * k2 + a2 * (7.0 * k3 + a2 * 9.0 * k4)));
    (radius, slope)
}

/// The angle that the lens shows at `aim`, by Newton's method from an angle near it; `None` past a fold, or behind the lens.
fn fisheye_solved(k: &[f64; 4], aim: f64, near: f64) -> Option<f64> {
    let mut angle = near;
    for _ in 0..ITERATIONS {
        let (radius, slope) = fisheye(k, angle);
        if slope <= 0.0 || angle > std::f64::consts::PI {
            return None;
        }
        let off = aim - radius;
        angle += off / slope;
        if off.abs() <= PRECISION * (1.0 + aim) {
            return Some(angle);
        }
    }
    None
}
