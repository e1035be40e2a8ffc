//! The ray through a point of the image.

use glam::DVec3;

use crate::scene::{Camera, Distortion, Intrinsics, Lens};

/// A ray through a point of the image plane.
#[derive(Clone, Copy)]
pub struct ViewRay {
    pub origin_m: DVec3,
    /// Of length 1.
    pub direction: DVec3,
    /// Its length per unit of depth.
    pub per_depth: f64,
}

/// `None` outside the image circle of a fisheye lens.
pub fn view_ray(camera: &Camera, x_px: f64, y_px: f64) -> Option<ViewRay> {
    let forward = (camera.look_at_m - camera.position_m).normalize();
    let right = forward.cross(camera.up).normalize();
    let down = forward.cross(right);
    let [width, height] = camera.resolution_px.map(f64::from);
    let in_focal_lengths = |lens: Intrinsics| {
        let y = (y_px - lens.cy) / lens.fy;
        [(x_px - lens.cx - lens.skew * y) / lens.fx, y]
    };
    let [x, y, z] = match camera.lens {
        Lens::Orthographic { height_m } => {
            let per_pixel_m = height_m / height;
            let across_m = (x_px - 0.5 * width) * per_pixel_m * right;
            let down_m = (y_px - 0.5 * height) * per_pixel_m * down;
            return Some(ViewRay {
                origin_m: camera.position_m + across_m + down_m,
                direction: forward,
                per_depth: 1.0,
            });
        }
        Lens::FovY { fov_y_deg } => {
            let half_height = (0.5 * fov_y_deg.to_radians()).tan();
            [
                (2.0 * x_px - width) / height * half_height,
                (2.0 * y_px - height) / height * half_height,
                1.0,
            ]
        }
        Lens::FovX { fov_x_deg } => {
            let half_width = (0.5 * fov_x_deg.to_radians()).tan();
            [
                (2.0 * x_px - width) / width * half_width,
                (2.0 * y_px - height) / width * half_width,
                1.0,
            ]
        }
        Lens::Equirectangular => {
            let azimuth = (x_px / width - 0.5) * std::f64::consts::TAU;
            // From straight down, which is the bottom of the image.
            let polar = (1.0 - y_px / height) * std::f64::consts::PI;
            let across = polar.sin();
            [across * azimuth.sin(), polar.cos(), across * azimuth.cos()]
        }
        Lens::Intrinsics(pinhole) => {
            let [x, y] = in_focal_lengths(pinhole);
            [x, y, 1.0]
        }
        Lens::Distorted {
            intrinsics,
            distortion,
        } => undistorted(distortion, in_focal_lengths(intrinsics))?,
    };
    let direction = x * right + y * down + z * forward;
    let unit = direction.normalize();
    Some(ViewRay {
        origin_m: camera.position_m,
        direction: unit,
        per_depth: unit.dot(forward).recip(),
    })
}

/// Halvings of the interval that contains a radius, enough to reach the last bit.
const HALVINGS: u32 = 60;
/// Most iterations that remove the tangential part.
const ROUNDS: u32 = 50;

/// The direction that a lens shows at an image point. Bisection inverts the radial part and needs no derivatives. Iterations remove the
/// small tangential part and the thin prism.
fn undistorted(distortion: Distortion, [x, y]: [f64; 2]) -> Option<[f64; 3]> {
    Some(match distortion {
        Distortion::Equirectangular => [y.cos() * x.sin(), y.sin(), y.cos() * x.cos()],
        Distortion::Fisheye([k1, k2, k3, k4]) => {
            let shown_at = |angle: f64| {
                let powers = [angle.powi(3), angle.powi(5), angle.powi(7), angle.powi(9)];
                angle + k1 * powers[0] + k2 * powers[1] + k3 * powers[2] + k4 * powers[3]
            };
            let radius = x.hypot(y);
            let angle = first_reaching(radius, std::f64::consts::PI, shown_at)?;
            let (sin, cos) = angle.sin_cos();
            let per_radius = if radius > 0.0 { sin / radius } else { 0.0 };
            [x * per_radius, y * per_radius, cos]
        }
        Distortion::Rational(coefficients) => {
            let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y] = coefficients;
            let [x, y] = untilted([x, y], [tau_x, tau_y]);
            let shown_at = |r: f64| {
                let above = 1.0 + k1 * r.powi(2) + k2 * r.powi(4) + k3 * r.powi(6);
                r * above / (1.0 + k4 * r.powi(2) + k5 * r.powi(4) + k6 * r.powi(6))
            };
            let mut found = [0.0; 2];
            for _ in 0..ROUNDS {
                let [u, v] = found;
                let r2 = u * u + v * v;
                let radially = [
                    x - 2.0 * p1 * u * v - p2 * (r2 + 2.0 * u * u) - s1 * r2 - s2 * r2.powi(2),
                    y - 2.0 * p2 * u * v - p1 * (r2 + 2.0 * v * v) - s3 * r2 - s4 * r2.powi(2),
                ];
                let radius = radially[0].hypot(radially[1]);
                let share = match radius {
                    0.0 => 1.0,
                    _ => first_reaching(radius, 1e3, shown_at)? / radius,
                };
                let next = radially.map(|coordinate| coordinate * share);
                let has_settled = (next[0] - u).hypot(next[1] - v) <= 1e-15 * (1.0 + radius);
                found = next;
                if has_settled {
                    break;
                }
            }
            [found[0], found[1], 1.0]
        }
    })
}

/// Takes a point from a tilted sensor to the plane across the axis, by undoing OpenCV's formula step by step.
fn untilted([x, y]: [f64; 2], [tau_x, tau_y]: [f64; 2]) -> [f64; 2] {
    let ((sin_x, cos_x), (sin_y, cos_y)) = (tau_x.sin_cos(), tau_y.sin_cos());
    // The third column of R(τx, τy), where the axis meets the sensor.
    let [axis_x, axis_y, axis_z] = [-sin_y * cos_x, sin_x, cos_y * cos_x];
    let [x, y] = [(x + axis_x) / axis_z, (y + axis_y) / axis_z];
    let [x, z] = [cos_y * x + sin_y, cos_y - sin_y * x];
    let [y, z] = [cos_x * y - sin_x * z, sin_x * y + cos_x * z];
    [x / z, y / z]
}

/// The first point at which a function that begins at 0 and increases reaches a value. It searches in small steps, and then bisects the last
/// one. `None` if the function decreases before, or ends.
fn first_reaching(value: f64, end: f64, function: impl Fn(f64) -> f64) -> Option<f64> {
    let mut low = 0.0;
    let mut high = (value / 64.0).min(end);
    while function(high) < value {
        if high >= end || function(high) < function(low) {
            return None;
        }
        low = high;
        high = (high + value / 64.0).min(end);
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if function(middle) < value {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}
