//! Compares V(L,P) of the direct light with rays in f64, and builds scenes that are difficult for it.
//!
//! A pixel is at a shadow edge if a ray from the light that passes [`EDGE_TEXELS`] beside P gives another V.

use camlux::hard_cases::scenes::cuboid;
use camlux::{
    RenderOptions, Scene,
    emission::{EmissionDomain, EmissionFace, Projection},
    internals::SurfacePoint,
    output::Layer,
    scene::{Light, Mesh, SpotCone},
};
use glam::DVec3;

use super::{
    direct::unshadowed_direct,
    gpu::{Gpu, demo_scene},
    ray_caster::RayCaster,
    rooms,
};

/// Distance of these rays from P, in texels of the shadow map. The engine reads the four texels around P.
const EDGE_TEXELS: f64 = 1.5;
/// The size of the map that stands for rays, if the engine casts them: edges are then 6e-6 of the depth wide. The ends of a ray and the corners
/// of a triangle are rounded to 6e-8 of the scene's size and more.
const RAYS_AS_TEXELS: f64 = (1 << 19) as f64;
/// Surfaces nearer to the ray's end than this, in units of the scene's size, are P's own.
const OWN_SURFACE: f64 = 1e-6;
/// Limit of the relRMSE if V is right: f32 against f64. Measured up to 4.4e-7, the largest for a spot's falloff.
pub const KERNEL_ERROR: f64 = 1.3e-6;

/// Numbers of pixels that the light would reach without occluders, by what the direct layer shows there.
#[derive(Debug, Default)]
pub struct Shadows {
    pub pixels: usize,
    pub at_edges: usize,
    /// Lit, but black: at edges, and elsewhere (acne).
    pub dark_at_edges: usize,
    pub acne: usize,
    /// Hidden, but not black: at edges, and elsewhere.
    pub lit_at_edges: usize,
    pub leaks: usize,
    /// relRMSE of the direct layer over all pixels, and over those away from edges.
    pub error: f64,
    pub error_inside: f64,
}

impl Shadows {
    pub fn wrong_share_at_edges(&self) -> f64 {
        (self.dark_at_edges + self.lit_at_edges) as f64 / self.pixels as f64
    }
}

/// Renders the direct light of one of the scene's lights and compares it with rays.
pub fn shadows_of(gpu: &mut Gpu, scene: &Scene, light: &Light) -> Shadows {
    let alone = Scene {
        lights: vec![light.clone().into()],
        indirect: None,
        vignetting_map: None,
        left_out: Vec::new(),
        ..scene.clone()
    };
    let (frame, kept) = gpu
        .renderer
        .render_with_intermediates(&alone, &mut RenderOptions::default())
        .expect("the scene renders");
    let direct = frame.values(Layer::Direct).expect("every frame has it");
    let rays = LightRays::new(&alone, &kept.lights[0].domain, kept.lights[0].shadow_size);

    let mut shadows = Shadows::default();
    let mut truth = unshadowed_direct(&alone, light, &kept);
    let mut errors = [0.0; 2];
    for ((point, truth), seen) in kept.gbuffer.iter().zip(&mut truth).zip(direct.chunks(3)) {
        let Some(point) = point.as_ref().filter(|_| *truth != [0.0; 3]) else {
            continue;
        };
        let is_lit = rays.reach(point);
        if !is_lit {
            *truth = [0.0; 3];
        }
        let at_edge = rays.is_edge(point, is_lit);
        let seen_lit = seen != [0.0; 3];
        shadows.pixels += 1;
        shadows.at_edges += usize::from(at_edge);
        *match (seen_lit, at_edge) {
            (false, true) => &mut shadows.dark_at_edges,
            (false, false) => &mut shadows.acne,
            (true, true) => &mut shadows.lit_at_edges,
            (true, false) => &mut shadows.leaks,
        } += usize::from(seen_lit != is_lit);
        let squared: f64 = (0..3)
            .map(|band| (f64::from(seen[band]) - truth[band]).powi(2))
            .sum();
        errors[usize::from(at_edge)] += squared;
    }
    let scale: f64 = truth.as_flattened().iter().map(|t| t * t).sum();
    shadows.error = ((errors[0] + errors[1]) / scale).sqrt();
    shadows.error_inside = (errors[0] / scale).sqrt();
    shadows
}

/// The rays of a light in f64.
struct LightRays<'s> {
    caster: RayCaster,
    domain: &'s EmissionDomain,
    shadow_size: f64,
    scene_size_m: f64,
}

impl LightRays<'_> {
    fn new<'s>(scene: &Scene, domain: &'s EmissionDomain, shadow_size: u32) -> LightRays<'s> {
        let bounds = scene.bounding_box().expect("there are surfaces");
        LightRays {
            caster: RayCaster::new(scene),
            domain,
            shadow_size: match shadow_size {
                0 => RAYS_AS_TEXELS,
                size => size.into(),
            },
            scene_size_m: (bounds.max_m - bounds.min_m).max_element(),
        }
    }

    /// Origin and direction of the light's ray through a point; origin + direction is the point.
    fn through(&self, point_m: DVec3, face: &EmissionFace) -> (DVec3, DVec3) {
        let offset_m = point_m - self.domain.origin_m;
        match self.domain.projection {
            Projection::Perspective => (self.domain.origin_m, offset_m),
            Projection::Orthographic => {
                let along_m = face.forward * offset_m.dot(face.forward);
                (point_m - along_m, along_m)
            }
        }
    }

    fn face_of(&self, point_m: DVec3) -> &EmissionFace {
        let depth = |face: &&EmissionFace| (point_m - self.domain.origin_m).dot(face.forward);
        let faces = self.domain.faces.iter();
        faces
            .max_by(|a, b| depth(a).total_cmp(&depth(b)))
            .expect("a light has faces")
    }

    /// V(L,P)
    fn reach(&self, point: &SurfacePoint) -> bool {
        let own_m = OWN_SURFACE * self.scene_size_m;
        let end_m = point.position_m + own_m * point.geometric_normal;
        let (origin_m, direction) = self.through(end_m, self.face_of(end_m));
        let to = 1.0 - own_m / direction.length();
        self.caster
            .nearest_in(origin_m, direction, 0.0, to)
            .is_none()
    }

    /// Whether a ray beside P has another V than P. The ray is hidden if it hits a surface before P's plane; a surface that meets P's at a
    /// concave edge does not hide it.
    fn is_edge(&self, point: &SurfacePoint, is_lit: bool) -> bool {
        let face = self.face_of(point.position_m);
        let depth_m = (point.position_m - self.domain.origin_m).dot(face.forward);
        let spread = match self.domain.projection {
            Projection::Perspective => depth_m,
            Projection::Orthographic => 1.0,
        };
        let texel_m = 2.0 * face.half_extent * spread / self.shadow_size;
        let beside = [-1.0, 0.0, 1.0].map(|step| step * EDGE_TEXELS * texel_m);
        let steps = beside
            .iter()
            .flat_map(|x| beside.iter().map(move |y| *x * face.right + *y * face.up));
        steps.into_iter().any(|step_m| {
            let (origin_m, direction) = self.through(point.position_m + step_m, face);
            let cosine = direction.normalize().dot(point.geometric_normal).abs();
            let plane = (point.position_m - origin_m).dot(point.geometric_normal)
                / direction.dot(point.geometric_normal);
            let is_hidden = self.caster.nearest(origin_m, direction).is_some_and(|hit| {
                let before_plane_m = (plane - hit.distance) * direction.length();
                let adjoins = hit.position_m.distance(point.position_m)
                    < 4.0 * EDGE_TEXELS * texel_m / cosine.max(0.05);
                plane > 0.0 && before_plane_m > OWN_SURFACE * self.scene_size_m && !adjoins
            });
            is_hidden == is_lit
        })
    }
}

/// The Cornell box and a light 300 m away.
pub fn scene_lit_from_afar() -> (Scene, Light) {
    let scene = demo_scene("cornell", [256, 256]);
    let position_m = DVec3::new(30.0, 290.0, 60.0);
    let light = Light::spot(
        position_m,
        DVec3::Y - position_m,
        SpotCone {
            inner_half_angle_deg: 0.3,
            outer_half_angle_deg: 0.4,
        },
        [1.0; 3],
    );
    (scene, light)
}

/// A floor of 4 m with `meshes` on it, lit by a point light and seen from above.
pub fn floor_with(mut meshes: Vec<Mesh>, light_m: DVec3) -> Scene {
    let floor = rooms::floor(2.0);
    meshes.insert(0, floor);
    let light = Light::point(light_m, [10.0; 3]);
    let mut scene = rooms::scene_of(meshes, light, DVec3::new(0.6, 2.2, 1.6), DVec3::ZERO);
    scene.camera.resolution_px = [256, 256];
    scene
}

/// Objects on a floor, with lights that show the line where they touch it.
pub fn contact_lines() -> Vec<(&'static str, Scene)> {
    let block = cuboid(
        "box",
        DVec3::new(-0.3, 0.0, -0.25),
        DVec3::new(0.55, 0.4, 0.5),
        1,
    );
    let wall = cuboid(
        "box",
        DVec3::new(-1.0, 0.0, -0.001),
        DVec3::new(2.0, 1.0, 0.001),
        1,
    );
    let sheet = rooms::quad(
        "sheet",
        DVec3::new(-1.0, 0.0, 0.0),
        2.0 * DVec3::X,
        DVec3::Y,
        1,
    );
    let near_floor = DVec3::new(0.7, 0.01, 0.45);
    [
        ("box", &block, DVec3::new(1.1, 1.3, 0.7)),
        ("box, low light", &block, DVec3::new(1.9, 0.15, 1.2)),
        ("box, light 1 cm above the floor", &block, near_floor),
        ("wall of 1 mm", &wall, DVec3::new(0.3, 0.8, -1.0)),
        (
            "wall of 1 mm, light 1 cm before it",
            &wall,
            DVec3::new(0.3, 0.5, -0.011),
        ),
        ("sheet", &sheet, DVec3::new(0.3, 0.8, -1.0)),
        (
            "sheet, seen from the lit side",
            &sheet,
            DVec3::new(0.3, 0.8, 1.0),
        ),
    ]
    .map(|(what, mesh, light_m)| (what, floor_with(vec![mesh.clone()], light_m)))
    .into()
}

/// The foot of a wall and a light 3 mm above the floor.
pub fn wall_and_low_light() -> Scene {
    let wall = rooms::quad(
        "wall",
        DVec3::new(-1.0, 0.0, 0.0),
        2.0 * DVec3::X,
        DVec3::Y,
        1,
    );
    let mut scene = floor_with(vec![wall], DVec3::new(0.1, 0.003, 0.9));
    scene.camera.position_m = DVec3::new(0.1, 0.1, 0.2);
    scene.camera.look_at_m = DVec3::new(0.1, 0.0, 0.0);
    scene
}
