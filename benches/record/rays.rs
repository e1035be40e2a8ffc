//! The rays that the bench traces in a scene.

use camlux::{
    Device, RenderOptions, Renderer, Scene,
    internals::SurfacePoint,
    internals::ray_probe::RayPoint,
    scene::{IndirectLight, VplSum},
};
use glam::DVec3;

use crate::Failure;

/// Distance of neighbouring points in pixels, in both axes.
const PIXEL_STEP: usize = 16;
/// Rays per point, of each kind. The square of a power of two, because the directions are in Morton order.
const RAYS: usize = 256;
const RSM_SIZE: u32 = 64;

/// [`RAYS`] rays of each kind for each point.
pub struct Rays {
    pub points: Vec<RayPoint>,
    /// End points for any hit, spread over the whole RSM. Neighbours in the list are neighbours in the RSM.
    pub ends: Vec<RayPoint>,
    /// Unit directions for the closest hit, cosine-distributed. Neighbours in the list are neighbours on the sphere.
    pub directions: Vec<DVec3>,
}

impl Rays {
    pub fn of(device: &Device, scene: &Scene) -> Result<Rays, Failure> {
        let mut scene = scene.clone();
        scene.lights.truncate(1);
        scene.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, RSM_SIZE));
        let (frame, kept) = Renderer::new(device)?
            .render_with_intermediates(&scene, &mut RenderOptions::default())?;
        let [width, height] = frame.resolution_px.map(|size| size as usize);
        let mut points = Vec::new();
        for y in (PIXEL_STEP / 2..height).step_by(PIXEL_STEP) {
            for x in (PIXEL_STEP / 2..width).step_by(PIXEL_STEP) {
                points.extend(kept.gbuffer[y * width + x].as_ref().map(ray_point));
            }
        }
        let texels: Vec<RayPoint> = morton_order(&kept.lights[0].rsm)
            .map(|texel| ray_point(&texel.point))
            .collect();
        let mut random = Random(fastrand::Rng::with_seed(1));
        let (mut ends, mut directions) = (Vec::new(), Vec::new());
        for point in &points {
            let first = random.0.f64() / RAYS as f64;
            for ray in 0..RAYS {
                let at = (first + ray as f64 / RAYS as f64) * texels.len() as f64;
                ends.push(texels[at as usize]);
                directions.push(random.direction(ray, point.geometric_normal));
            }
        }
        Ok(Rays {
            points,
            ends,
            directions,
        })
    }
}

fn ray_point(point: &SurfacePoint) -> RayPoint {
    RayPoint {
        position_m: point.position_m,
        geometric_normal: point.geometric_normal,
    }
}

/// The texels that show a surface, face by face, each face in Morton order.
fn morton_order<T>(texels: &[Option<T>]) -> impl Iterator<Item = &T> {
    let face_texels = (RSM_SIZE * RSM_SIZE) as usize;
    texels.chunks(face_texels).flat_map(move |face| {
        (0..face.len()).filter_map(move |code| {
            let [x, y] = from_morton(code);
            face[y * RSM_SIZE as usize + x].as_ref()
        })
    })
}

/// The numbers made of the even and of the odd bits.
fn from_morton(code: usize) -> [usize; 2] {
    [0, 1].map(|odd| {
        (0..usize::BITS / 2).fold(0, |bits, bit| bits | (code >> (2 * bit + odd) & 1) << bit)
    })
}

/// Random numbers from a fixed seed.
struct Random(fastrand::Rng);

impl Random {
    /// A direction in the given cell of a grid over the square. The square is mapped to the disc and then to the hemisphere (Shirley &
    /// Chiu 1997).
    fn direction(&mut self, cell: usize, normal: DVec3) -> DVec3 {
        let edge = RAYS.isqrt() as f64;
        let [column, row] = from_morton(cell);
        let a = 2.0 * (column as f64 + self.0.f64()) / edge - 1.0;
        let b = 2.0 * (row as f64 + self.0.f64()) / edge - 1.0;
        let (radius, angle) = if a.abs() > b.abs() {
            (a, std::f64::consts::FRAC_PI_4 * b / a)
        } else {
            (
                b,
                std::f64::consts::FRAC_PI_2 - std::f64::consts::FRAC_PI_4 * a / b,
            )
        };
        let (right, up) = normal.any_orthonormal_pair();
        let (x, y) = (radius * angle.cos(), radius * angle.sin());
        (x * right + y * up + (1.0 - radius * radius).max(0.0).sqrt() * normal).normalize()
    }
}
