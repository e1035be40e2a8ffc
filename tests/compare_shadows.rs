//! V(L,P) of direct light against rays in f64, and against path-traced truth.
//!
//! A pixel lies at a shadow's edge if a ray from the light that passes [`EDGE_TEXELS`] beside P tells another V.

mod gpu;
mod ray_caster;
mod rmse;
mod rooms;
mod truth;

use camlux::{
    Plan, RenderOptions, Scene,
    emission::{EmissionDomain, EmissionFace, Projection},
    intermediates::SurfacePoint,
    output::Layer,
    scene::{Bands, Estimator, Indirect, Light, Mesh, SpotCone},
    twin,
};
use glam::DVec3;
use gpu::{DEMO_SCENES, Gpu, demo_scene};
use ray_caster::{RayCaster, pixel::PixelRay};
use truth::Truth;

/// Texels of the shadow map beside P. The test reads the four around it.
const EDGE_TEXELS: f64 = 1.5;
/// Surfaces nearer to the ray's end than this, over the scene's size, are P's own.
const OWN_SURFACE: f64 = 1e-6;
/// relRMSE where V is right: f32 against f64, measured up to 4.4e-7, the largest for a spot's falloff.
const KERNEL_ERROR: f64 = 1.3e-6;

/// Pixels that the light would light if nothing were in its way, and what the direct layer says of them.
#[derive(Debug, Default)]
struct Shadows {
    pixels: usize,
    at_edges: usize,
    /// Lit, but black: at edges, and elsewhere (acne).
    dark_at_edges: usize,
    acne: usize,
    /// Hidden, but not black: at edges, and elsewhere.
    lit_at_edges: usize,
    leaks: usize,
    /// relRMSE of the direct layer over all pixels, and over those away from edges.
    error: f64,
    error_inside: f64,
}

impl Shadows {
    fn wrong_share_at_edges(&self) -> f64 {
        (self.dark_at_edges + self.lit_at_edges) as f64 / self.pixels as f64
    }
}

/// Renders the direct light of one of the scene's lights and compares it with rays.
fn shadows_of(gpu: &mut Gpu, scene: &Scene, light: &Light) -> Shadows {
    let alone = Scene {
        lights: vec![*light],
        indirect: None,
        ..scene.clone()
    };
    let (frame, kept) = gpu
        .renderer
        .render_with_intermediates(&alone, &mut RenderOptions::default())
        .expect("the scene renders");
    let direct = frame.values(Layer::Direct).expect("every frame has it");
    let rays = LightRays::new(&alone, &kept.lights[0].domain, kept.lights[0].shadow_size);

    let mut shadows = Shadows::default();
    let mut truth = twin::unshadowed_direct(&alone, light, &kept);
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
            shadow_size: shadow_size.into(),
            scene_size_m: (bounds.max_m - bounds.min_m).max_element(),
        }
    }

    /// Origin and direction of the light's ray through a point; direction·1 leads from the origin to the point.
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

    /// Whether a ray beside P is hidden before it meets P's plane, and P is not, or the other way round. A surface that
    /// meets P's at a concave edge is not in its way.
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

#[test]
fn demo_scenes_have_neither_acne_nor_leaks() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        let scene = demo_scene(name, [256, 256]);
        for light in &scene.lights {
            let shadows = shadows_of(&mut gpu, &scene, light);
            println!("{name:14} {:12} {shadows:?}", light.kind());
            assert!(shadows.pixels > 5000, "{name}");
            assert_eq!((shadows.acne, shadows.leaks), (0, 0), "{name}");
            assert!(shadows.error_inside <= KERNEL_ERROR, "{name}");
            // Corners of triangles that lie between texels: measured up to 2 of 50 000 pixels. The knot's triangles are
            // smaller than its texels: 1.7e-3.
            let allowed = if name == "knot" { 5e-3 } else { 1.2e-4 };
            assert!(shadows.wrong_share_at_edges() <= allowed, "{name}");
        }
    }
}

/// f32 loses the digits of a distance of 300 m, but not those of the distance from P to what hides it.
#[test]
fn light_from_afar_makes_no_acne() {
    let scene = demo_scene("cornell", [256, 256]);
    let position_m = DVec3::new(30.0, 290.0, 60.0);
    let light = Light::Spot {
        position_m,
        direction: DVec3::Y - position_m,
        cone: SpotCone {
            inner_half_angle_deg: 0.3,
            outer_half_angle_deg: 0.4,
        },
        power_w: [1.0; 3],
    };
    let shadows = shadows_of(&mut Gpu::open(), &scene, &light);
    println!("from afar: {shadows:?}");
    assert!(shadows.pixels > 5000);
    assert_eq!((shadows.acne, shadows.leaks), (0, 0));
    // Six corners' pixels of 39 000.
    assert!(shadows.wrong_share_at_edges() <= 4.5e-4);
}

/// Against truth that shares no code with the engine, at its 200 x 200 pixels, with the shadow map that the plan gives them.
#[test]
fn direct_light_agrees_with_path_traced_truth() {
    let truth = Truth::read().direct;
    let mut scene = demo_scene("cornell", [200, 200]);
    scene.indirect = None;
    let frame = Gpu::open().render(&scene);
    let direct = frame.values(Layer::Direct).expect("every frame has it");
    // The lower edge of the green wall runs through the centres of the pixels on the image's diagonal: there either surface
    // is right. Everything else counts, shadow edges too.
    let caster = RayCaster::new(&scene);
    let on_edge = |i: &usize| {
        let (x, y) = ((i % 200) as u32, (i / 200) as u32);
        !PixelRay::of_camera(&scene, x, y).cast(&caster).1
    };
    let inside: Vec<usize> = (0..truth.len()).filter(|i| !on_edge(i)).collect();
    let pick = |values: &[f32]| -> Vec<f32> {
        let pixels = inside.iter().flat_map(|&i| &values[3 * i..3 * i + 3]);
        pixels.copied().collect()
    };
    let truth_inside: Vec<Bands> = inside.iter().map(|&i| truth[i]).collect();
    let error = rmse::relative_rmse(&pick(direct), &truth_inside);
    let with_edges = rmse::relative_rmse(direct, &truth);
    println!(
        "{error:.1e} of {} pixels, {with_edges:.1e} of all",
        inside.len()
    );
    assert!(inside.len() > 39_000);
    // The truth's rounding to 16 bit; measured 1.9e-4.
    assert!(error <= 3e-4, "{error:e}");
}

/// An RSM that is fine enough serves the shadow test as well as a map of the light's own.
#[test]
fn shadows_from_the_rsm_are_the_same() {
    let mut gpu = Gpu::open();
    for name in ["cornell", "textured"] {
        let mut scene = demo_scene(name, [64, 64]);
        scene.indirect = None;
        let own = gpu.render(&scene);
        scene.indirect = Some(Indirect {
            estimator: Estimator::RsmAverage,
            rsm_size: 256,
        });
        let shared = gpu.render(&scene);
        let plan = Plan::new(&scene, gpu.device.info()).expect("the scene is valid");
        assert!(plan.lights.iter().all(|light| light.shadow_from_rsm));
        assert_eq!(
            own.values(Layer::Direct),
            shared.values(Layer::Direct),
            "{name}"
        );
    }
}

/// A floor of 4 m and what stands on it, lit by a point light and seen from above.
fn floor_with(mut meshes: Vec<Mesh>, light_m: DVec3) -> Scene {
    let floor = rooms::quad(
        "floor",
        DVec3::new(-2.0, 0.0, -2.0),
        4.0 * DVec3::Z,
        4.0 * DVec3::X,
        0,
    );
    meshes.insert(0, floor);
    let light = Light::Point {
        position_m: light_m,
        power_w: [10.0; 3],
    };
    let mut scene = rooms::scene_of(meshes, light, DVec3::new(0.6, 2.2, 1.6), DVec3::ZERO);
    scene.camera.resolution_px = [256, 256];
    scene
}

/// An upright box from its lowest corner.
fn upright_box(corner: DVec3, size: DVec3, material: u32) -> Mesh {
    let corners: Vec<[f64; 3]> = (0..8)
        .map(|i| DVec3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2).into()))
        .map(|unit| (corner + unit * size).to_array())
        .collect();
    let sides = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    let triangles: Vec<[u32; 3]> = sides
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    Mesh::from_slices("box", &corners, &triangles, material)
}

/// Where things touch, shadows begin at the line of contact, in front of and behind what stands there.
#[test]
fn contact_lines_do_not_leak() {
    let mut gpu = Gpu::open();
    let block = upright_box(DVec3::new(-0.3, 0.0, -0.25), DVec3::new(0.55, 0.4, 0.5), 1);
    let wall = upright_box(
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
    for (what, mesh, light_m) in [
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
    ] {
        let scene = floor_with(vec![mesh.clone()], light_m);
        let shadows = shadows_of(&mut gpu, &scene, &scene.lights[0]);
        println!("{what}: {shadows:?}");
        assert!(shadows.pixels > 1000, "{what}");
        assert_eq!((shadows.acne, shadows.leaks), (0, 0), "{what}");
        assert!(shadows.error_inside <= 3.0 * KERNEL_ERROR, "{what}");
        // Corners between texels: measured up to 2.1e-4, where the light grazes the floor and texels are long.
        assert!(shadows.wrong_share_at_edges() <= 6e-4, "{what}");
    }
}

/// A light 3 mm above a floor sees it in the texels next to those of a wall's foot. The line through both meets the floor
/// behind the light, where it hides nothing.
#[test]
fn the_floor_behind_the_light_hides_nothing() {
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
    let shadows = shadows_of(&mut Gpu::open(), &scene, &scene.lights[0]);
    println!("foot of a wall: {shadows:?}");
    assert!(shadows.pixels > 5000);
    assert_eq!((shadows.dark_at_edges, shadows.lit_at_edges), (0, 0));
    assert_eq!((shadows.acne, shadows.leaks), (0, 0));
}
