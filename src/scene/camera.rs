//! The camera and its lens.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DMat4, DVec2, DVec3};

use super::{Distortion, PixelSampling};

/// A camera. Pixel (0, 0) is the upper left one; its centre is at (0.5, 0.5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Width, height.
    pub resolution_px: [u32; 2],
    /// C, the camera centre.
    pub position_m: DVec3,
    pub look_at_m: DVec3,
    pub up: DVec3,
    pub lens: Lens,
    /// How light is averaged over a pixel; `None`: a pixel shows the point at its centre.
    pub pixel_sampling: Option<PixelSampling>,
}

/// How the camera maps directions to pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// Full vertical field of view, square pixels, principal point in the middle.
    FovY { fov_y_deg: f64 },
    /// As [`Lens::FovY`], with the full horizontal field of view.
    FovX { fov_x_deg: f64 },
    /// All directions: columns are evenly spaced in longitude, 360° from left to right, and rows in latitude, 180° from top to bottom. The view
    /// is in the middle.
    Equirectangular,
    /// Parallel rays along the view, from the plane through the camera's position: the image is this high. Pixels are square, and the position
    /// is in the middle.
    Orthographic { height_m: f64 },
    /// Measured intrinsics.
    Intrinsics(Intrinsics),
    /// Measured intrinsics of a lens with distortion.
    Distorted {
        intrinsics: Intrinsics,
        distortion: Distortion,
    },
}

/// Pinhole intrinsics in pixels: x_px = fx·X/Z + skew·Y/Z + cx, y_px = fy·Y/Z + cy with X right, Y down, Z forward.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Intrinsics {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    pub skew: f64,
}

impl Intrinsics {
    /// The pixel of a point of the image plane, which is given in focal lengths from the principal point.
    pub fn pixel(&self, point: DVec2) -> DVec2 {
        let Intrinsics {
            fx,
            fy,
            cx,
            cy,
            skew,
        } = *self;
        DVec2::new(fx * point.x + skew * point.y + cx, fy * point.y + cy)
    }

    /// The inverse of [`Intrinsics::pixel`].
    pub fn point(&self, x_px: f64, y_px: f64) -> DVec2 {
        let y = (y_px - self.cy) / self.fy;
        DVec2::new((x_px - self.cx - self.skew * y) / self.fx, y)
    }
}

/// The camera's axes, unit vectors in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraBasis {
    pub right: DVec3,
    pub down: DVec3,
    pub forward: DVec3,
}

impl CameraBasis {
    /// Rotates from camera axes (x right, y down, z forward) to the world.
    pub fn matrix(self) -> DMat3 {
        DMat3::from_cols(self.right, self.down, self.forward)
    }
}

impl Lens {
    /// The intrinsics of the lens for an image of this width and height. For [`Lens::Orthographic`], x_px = fx·X + cx and y_px = fy·Y + cy:
    /// fx and fy are pixels per metre.
    pub fn intrinsics_px(&self, resolution_px: [u32; 2]) -> Intrinsics {
        match *self {
            Lens::Intrinsics(intrinsics) | Lens::Distorted { intrinsics, .. } => intrinsics,
            Lens::FovY { fov_y_deg } => {
                square_pixels(resolution_px, focal_px(resolution_px[1], fov_y_deg))
            }
            Lens::FovX { fov_x_deg } => {
                square_pixels(resolution_px, focal_px(resolution_px[0], fov_x_deg))
            }
            Lens::Equirectangular => {
                let [width, height] = resolution_px.map(f64::from);
                Intrinsics {
                    fx: width / TAU,
                    fy: height / PI,
                    cx: 0.5 * width,
                    cy: 0.5 * height,
                    skew: 0.0,
                }
            }
            Lens::Orthographic { height_m } => {
                square_pixels(resolution_px, f64::from(resolution_px[1]) / height_m)
            }
        }
    }
}

/// The focal length with which this many pixels have this field of view.
fn focal_px(size_px: u32, fov_deg: f64) -> f64 {
    0.5 * f64::from(size_px) / (0.5 * fov_deg.to_radians()).tan()
}

/// The intrinsics of square pixels, with the principal point in the middle.
fn square_pixels(resolution_px: [u32; 2], f: f64) -> Intrinsics {
    let [cx, cy] = resolution_px.map(|size_px| 0.5 * f64::from(size_px));
    Intrinsics {
        fx: f,
        fy: f,
        cx,
        cy,
        skew: 0.0,
    }
}

impl Camera {
    /// The intrinsics of the lens at this resolution.
    pub fn intrinsics_px(&self) -> Intrinsics {
        self.lens.intrinsics_px(self.resolution_px)
    }

    /// The camera at another resolution. A field of view, or a height, stays as it is. Measured intrinsics are scaled with the width (fx, cx, skew) and the
    /// height (fy, cy), so that the frame shows the same part of the scene.
    pub fn resized(&self, resolution_px: [u32; 2]) -> Camera {
        let scale =
            |axis: usize| f64::from(resolution_px[axis]) / f64::from(self.resolution_px[axis]);
        let mut resized = Camera {
            resolution_px,
            ..*self
        };
        match &mut resized.lens {
            Lens::FovY { .. }
            | Lens::FovX { .. }
            | Lens::Equirectangular
            | Lens::Orthographic { .. } => {}
            Lens::Intrinsics(intrinsics) | Lens::Distorted { intrinsics, .. } => {
                let Intrinsics {
                    fx,
                    fy,
                    cx,
                    cy,
                    skew,
                } = *intrinsics;
                *intrinsics = Intrinsics {
                    fx: fx * scale(0),
                    fy: fy * scale(1),
                    cx: cx * scale(0),
                    cy: cy * scale(1),
                    skew: skew * scale(0),
                };
            }
        }
        resized
    }

    /// The camera's axes. The camera must be validated.
    pub fn basis(&self) -> CameraBasis {
        let forward = (self.look_at_m - self.position_m).normalize();
        let right = forward.cross(self.up).normalize();
        CameraBasis {
            right,
            down: forward.cross(right),
            forward,
        }
    }

    /// Transform from camera axes (x right, y down, z forward, as for the intrinsics) to the world, for column vectors. The camera must be
    /// validated.
    pub fn to_world(&self) -> DMat4 {
        let CameraBasis {
            right,
            down,
            forward,
        } = self.basis();
        let axes = [right, down, forward].map(|axis| axis.extend(0.0));
        DMat4::from_cols(axes[0], axes[1], axes[2], self.position_m.extend(1.0))
    }

    /// The distortion of the lens; `None` if straight lines stay straight.
    pub fn distortion(&self) -> Option<Distortion> {
        match self.lens {
            Lens::Distorted { distortion, .. } => Some(distortion),
            Lens::Equirectangular => Some(Distortion::Equirectangular),
            Lens::FovY { .. }
            | Lens::FovX { .. }
            | Lens::Orthographic { .. }
            | Lens::Intrinsics(_) => None,
        }
    }

    /// Whether all rays are parallel.
    pub fn is_orthographic(&self) -> bool {
        matches!(self.lens, Lens::Orthographic { .. })
    }

    /// Where the ray through a point of the image plane starts: at the camera's position, unless rays are parallel.
    pub fn ray_origin_m(&self, x_px: f64, y_px: f64) -> DVec3 {
        if !self.is_orthographic() {
            return self.position_m;
        }
        self.position_m + self.basis().matrix() * self.ray_start_m(x_px, y_px)
    }

    /// The same from the camera's position, in its axes.
    pub(crate) fn ray_start_m(&self, x_px: f64, y_px: f64) -> DVec3 {
        match self.is_orthographic() {
            true => self.intrinsics_px().point(x_px, y_px).extend(0.0),
            false => DVec3::ZERO,
        }
    }

    /// How long the ray is to a point at this offset from the camera's position, in the unit of the offset.
    pub(crate) fn range_to(&self, offset: DVec3) -> f64 {
        match self.is_orthographic() {
            true => offset.dot(self.basis().forward),
            false => offset.length(),
        }
    }

    /// Direction through a point of the image plane. Its component along the view axis is 1; if the lens may see what is behind the
    /// camera, its length is 1.
    pub fn ray_direction(&self, x_px: f64, y_px: f64) -> DVec3 {
        let basis = self.basis();
        // Only outside the image circle of a fisheye does a valid camera see nothing.
        let DVec3 { x, y, z } = self.unproject(x_px, y_px).unwrap_or(DVec3::Z);
        basis.forward * z + basis.right * x + basis.down * y
    }

    /// The position of a point in the image, pixels; `None` if the lens does not see it. It may be outside the image.
    pub fn project(&self, point_m: DVec3) -> Option<DVec2> {
        let intrinsics = self.intrinsics_px();
        let CameraBasis {
            right,
            down,
            forward,
        } = self.basis();
        let offset_m = point_m - self.position_m;
        let direction = DVec3::from([right, down, forward].map(|axis| offset_m.dot(axis)));
        let on_pixels = |point| intrinsics.pixel(point);
        let Some(distortion) = self.distortion() else {
            let per_point = match self.is_orthographic() {
                true => 1.0,
                false => direction.z,
            };
            let is_ahead = direction.z > 0.0;
            return is_ahead.then(|| on_pixels(direction.truncate() / per_point));
        };
        if !distortion.sees_behind() && direction.z <= 0.0 {
            return None;
        }
        let point = distortion.project(direction);
        // Beyond a fold, the formula gives points that the lens does not show.
        let seen = distortion.unproject(point)?.normalize();
        let is_seen = seen.distance(direction.normalize()) < 1e-6;
        is_seen.then(|| on_pixels(point))
    }

    /// Half the diagonal of the image.
    pub(crate) fn half_diagonal_px(&self) -> f64 {
        let [width, height] = self.resolution_px.map(f64::from);
        0.5 * width.hypot(height)
    }

    /// The square of a point's distance from the principal point over half the diagonal of the image.
    pub(crate) fn squared_radius(&self, place_px: DVec2) -> f64 {
        let Intrinsics { cx, cy, .. } = self.intrinsics_px();
        ((place_px - DVec2::new(cx, cy)) / self.half_diagonal_px()).length_squared()
    }

    /// The direction where the line from the principal point to a point outside the image circle leaves the circle.
    pub(crate) fn direction_at_circle(&self, x_px: f64, y_px: f64) -> DVec3 {
        let DVec2 { x, y } = self.last_seen_px(DVec2::new(x_px, y_px));
        self.unproject(x, y).unwrap_or(DVec3::Z)
    }

    /// The last point that the lens sees on the line from the principal point to a point that it does not see.
    fn last_seen_px(&self, place_px: DVec2) -> DVec2 {
        let Intrinsics { cx, cy, .. } = self.intrinsics_px();
        let DVec2 { x, y } = place_px;
        let place = |share: f64| DVec2::new(cx + share * (x - cx), cy + share * (y - cy));
        place(halve(|share| {
            let DVec2 { x, y } = place(share);
            self.unproject(x, y).is_some()
        }))
    }

    /// The point farthest from the principal point, of those in the image that the lens sees.
    pub(crate) fn farthest_seen_px(&self) -> DVec2 {
        let last_seen_px = |[x, y]: [f64; 2]| match self.unproject(x, y) {
            Some(_) => DVec2::new(x, y),
            None => self.last_seen_px(DVec2::new(x, y)),
        };
        let seen = self.border_px().into_iter().map(last_seen_px);
        let distance = |place: &DVec2| self.squared_radius(*place);
        seen.max_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or_default()
    }

    /// The share of the image's border that is outside the image circle of a fisheye lens, and black.
    pub(crate) fn unseen_border(&self) -> f64 {
        let border = self.border_px();
        let is_unseen = |place: &&[f64; 2]| self.unproject(place[0], place[1]).is_none();
        border.iter().filter(is_unseen).count() as f64 / border.len() as f64
    }

    /// Points on the border of the image, among them its corners.
    fn border_px(&self) -> Vec<[f64; 2]> {
        let [width, height] = self.resolution_px.map(f64::from);
        let along = |length: f64| (0..=32).map(move |step| length * f64::from(step) / 32.0);
        let rows = along(width).flat_map(|x| [[x, 0.0], [x, height]]);
        let columns = along(height).flat_map(|y| [[0.0, y], [width, y]]);
        rows.chain(columns).collect()
    }

    /// Like [`Camera::ray_direction`], in the camera's axes; `None` outside the image circle of a fisheye lens, and where the distorted image
    /// [folds over](Distortion::unproject).
    pub(crate) fn unproject(&self, x_px: f64, y_px: f64) -> Option<DVec3> {
        if self.is_orthographic() {
            return Some(DVec3::Z);
        }
        let point = self.intrinsics_px().point(x_px, y_px);
        match self.distortion() {
            None => Some(point.extend(1.0)),
            Some(distortion) => distortion.unproject(point),
        }
    }
}

/// The share of a line, to 1e-6 of it, up to which something is true. It is true at 0 and false at 1.
pub(super) fn halve(is_true: impl Fn(f64) -> bool) -> f64 {
    const HALVINGS: u32 = 20;
    let (mut inside, mut outside) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let share = 0.5 * (inside + outside);
        match is_true(share) {
            true => inside = share,
            false => outside = share,
        }
    }
    inside
}
