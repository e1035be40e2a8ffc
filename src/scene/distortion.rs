//! Lens distortion, with the models and coefficients of OpenCV.

use glam::{DMat2, DMat3, DVec2, DVec3};

/// The coefficients of a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distortion {
    /// The model of `cv::calibrateCamera` (Brown and Conrady, with a rational radial part, a thin prism and a tilted sensor): k1 k2 p1 p2 k3 k4
    /// k5 k6 s1 s2 s3 s4 τx τy. The tilts are radians.
    Rational([f64; 14]),
    /// The model of `cv::fisheye` (Kannala and Brandt): k1 k2 k3 k4.
    Fisheye([f64; 4]),
    /// Longitude and latitude, radians, as the two coordinates: all directions.
    Equirectangular,
}

/// Steps from the principal point to an image point; each starts from the result of the one before.
const STEPS: u32 = 16;
/// Newton iterations per step.
const ITERATIONS: u32 = 20;
/// The precision of the iterations, focal lengths.
const PRECISION: f64 = 1e-14;

impl Distortion {
    /// What OpenCV calls the coefficients of [`Distortion::Rational`].
    pub const RATIONAL: [&str; 14] = [
        "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y",
    ];
    /// What OpenCV calls the coefficients of [`Distortion::Fisheye`].
    pub const FISHEYE: [&str; 4] = ["k1", "k2", "k3", "k4"];

    /// The lengths of OpenCV's vectors for [`Distortion::Rational`].
    pub const LENGTHS: [usize; 5] = [4, 5, 8, 12, 14];

    /// [`Distortion::Rational`] from OpenCV's vector; `None` unless it has one of its [lengths](Distortion::LENGTHS).
    pub fn from_opencv(vector: &[f64]) -> Option<Distortion> {
        let mut coefficients = [0.0; 14];
        Self::LENGTHS.contains(&vector.len()).then(|| {
            coefficients[..vector.len()].copy_from_slice(vector);
            Distortion::Rational(coefficients)
        })
    }

    /// Whether it may show what is behind the camera. Such a lens has no cos⁴ vignetting.
    pub fn sees_behind(&self) -> bool {
        matches!(self, Distortion::Fisheye(_) | Distortion::Equirectangular)
    }

    /// The name of the model, in OpenCV if it has it.
    pub fn model(&self) -> &'static str {
        match self {
            Distortion::Rational(_) => "rational",
            Distortion::Fisheye(_) => "fisheye",
            Distortion::Equirectangular => "equirectangular",
        }
    }

    /// The coefficients, in OpenCV's order: of [`Distortion::Rational`] 8, 12 or 14, as many as are not 0.
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Distortion::Rational(coefficients) => {
                let are_zero = |from: usize| coefficients[from..].iter().all(|&value| value == 0.0);
                let length = [8, 12].into_iter().find(|&length| are_zero(length));
                &coefficients[..length.unwrap_or(14)]
            }
            Distortion::Fisheye(coefficients) => coefficients,
            Distortion::Equirectangular => &[],
        }
    }

    /// The image point of a direction in the camera's axes (x right, y down, z forward), focal lengths from the principal point. For
    /// [`Distortion::Rational`], z must be above 0.
    pub fn project(&self, direction: DVec3) -> DVec2 {
        let across = direction.truncate();
        match self {
            Distortion::Rational(coefficients) => {
                let point = rational(coefficients, across / direction.z).0;
                Tilt::of(coefficients).map_or(point, |tilt| tilt.tilted(point))
            }
            Distortion::Fisheye(k) => {
                let angle = across.length().atan2(direction.z);
                across.normalize_or_zero() * fisheye(k, angle).0
            }
            Distortion::Equirectangular => DVec2::new(
                direction.x.atan2(direction.z),
                direction.y.atan2(direction.x.hypot(direction.z)),
            ),
        }
    }

    /// The direction in the camera's axes at an image point: of length 1 if the model [sees behind](Distortion::sees_behind), otherwise
    /// with z = 1. `None` if the
    /// image folds over between the principal point and this point, or if the lens sees nothing that far out.
    pub fn unproject(&self, point: DVec2) -> Option<DVec3> {
        match self {
            Distortion::Rational(coefficients) => {
                let point = match Tilt::of(coefficients) {
                    None => point,
                    Some(tilt) => tilt.untilted(point)?,
                };
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
            Distortion::Equirectangular => {
                let ((sin_x, cos_x), (sin_y, cos_y)) = (point.x.sin_cos(), point.y.sin_cos());
                Some(DVec3::new(cos_y * sin_x, sin_y, cos_y * cos_x))
            }
        }
    }
}

/// A sensor that is not parallel to the lens. It moves points along straight lines through the principal point, which stays.
struct Tilt(DMat3);

impl Tilt {
    /// `None` without a tilt.
    fn of(&[.., tau_x, tau_y]: &[f64; 14]) -> Option<Tilt> {
        let is_tilted = tau_x != 0.0 || tau_y != 0.0;
        // OpenCV's angles turn against glam's.
        is_tilted.then(|| Tilt(DMat3::from_rotation_y(-tau_y) * DMat3::from_rotation_x(-tau_x)))
    }

    /// Where a point is on the tilted sensor.
    fn tilted(&self, point: DVec2) -> DVec2 {
        let (axis, turned) = (self.0.z_axis, self.0 * point.extend(1.0));
        axis.z * turned.truncate() / turned.z - axis.truncate()
    }

    /// The inverse of [`Tilt::tilted`]; `None` behind the horizon of the sensor's plane.
    fn untilted(&self, point: DVec2) -> Option<DVec2> {
        let axis = self.0.z_axis;
        let turned = ((point + axis.truncate()) / axis.z).extend(1.0);
        let point = self.0.transpose() * turned;
        (point.z > 0.0).then(|| point.truncate() / point.z)
    }
}

/// The distorted point before the tilt, and its derivatives.
fn rational(coefficients: &[f64; 14], point: DVec2) -> (DVec2, DMat2) {
    let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, ..] = *coefficients;
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
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + r2 * s2),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + r2 * s4),
    );
    let mixed = 2.0 * (x * y * slope + p1 * x + p2 * y);
    // Of the thin prism, by r².
    let prism = DVec2::new(s1 + 2.0 * r2 * s2, s3 + 2.0 * r2 * s4);
    let by_x = DVec2::new(
        radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
        mixed,
    ) + 2.0 * x * prism;
    let by_y = DVec2::new(
        mixed,
        radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
    ) + 2.0 * y * prism;
    // Past a pole, the radial part starts again from below. The sign marks such points as folded.
    let derivatives = DMat2::from_cols(by_x, by_y) * below.signum();
    (distorted, derivatives)
}

/// The point that the lens distorts to `aim`, by Newton's method from a point near it; `None` past a fold.
fn rational_solved(coefficients: &[f64; 14], aim: DVec2, near: DVec2) -> Option<DVec2> {
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
