//! The tracers against rays in f64: right everywhere except within rounding of an edge.

use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene, tracers};
use crate::common::instances;
use crate::common::ray_caster::RayCaster;
use crate::common::rooms;
use crate::common::shadows;
use camlux::{
    LocalSpace, RenderOptions, Scene,
    internals::ray_probe::{RayHit, RayPoint, RayProbe},
    scene::{IndirectLight, Mesh, VplSum},
};
use glam::DVec3;

/// Rays per point.
const RAYS: usize = 64;
/// A ray passes an edge if a ray this far beside it gives another result. Relative to the scene's size: corners, ends and
/// products are each rounded to 6e-8 of that, and the errors add up.
const EDGE: f64 = 1e-6;
/// A ray starts and ends on the surfaces nearer to its ends than this, relative to the scene's size.
const OWN_SURFACE: f64 = 3e-6;

/// Gives the same numbers in each run.
struct Random(fastrand::Rng);

impl Random {
    fn index(&mut self, count: usize) -> usize {
        self.0.usize(..count)
    }

    /// Cosine-distributed around a normal.
    fn direction(&mut self, normal: DVec3) -> DVec3 {
        let (radius, angle) = (self.0.f64().sqrt(), std::f64::consts::TAU * self.0.f64());
        let (right, up) = normal.any_orthonormal_pair();
        let (x, y) = (radius * angle.cos(), radius * angle.sin());
        (x * right + y * up + (1.0 - radius * radius).max(0.0).sqrt() * normal).normalize()
    }
}

/// Points that the camera sees and points that the light sees.
fn points_of(gpu: &mut Gpu, scene: &Scene) -> (Vec<RayPoint>, Vec<RayPoint>) {
    let mut scene = scene.clone();
    scene.lights.truncate(1);
    scene.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 32));
    let (_, kept) = gpu
        .renderer
        .render_with_intermediates(&scene, &mut RenderOptions::default())
        .expect("the scene renders");
    let seen = kept.gbuffer.iter().flatten();
    let lit = kept.lights[0]
        .rsm
        .iter()
        .flatten()
        .map(|texel| &texel.point);
    let point = |point: &camlux::internals::SurfacePoint| RayPoint {
        position_m: point.position_m,
        geometric_normal: point.geometric_normal,
    };
    (seen.map(point).collect(), lit.map(point).collect())
}

struct Truth<'s> {
    caster: RayCaster,
    first_triangle: Vec<usize>,
    scene: &'s Scene,
    size_m: f64,
}

impl Truth<'_> {
    fn new(scene: &Scene) -> Truth<'_> {
        let space = LocalSpace::of(scene.bounding_box());
        let mut first_triangle = vec![0];
        for mesh in &scene.meshes {
            let first = first_triangle[first_triangle.len() - 1];
            first_triangle.push(first + mesh.triangles.len());
        }
        Truth {
            caster: RayCaster::new(scene),
            first_triangle,
            scene,
            size_m: space.metres_per_unit,
        }
    }

    fn is_blocked(&self, from: &RayPoint, to: &RayPoint) -> bool {
        let shift = OWN_SURFACE * self.size_m;
        let start = from.position_m + shift * from.geometric_normal;
        let end = to.position_m + shift * to.geometric_normal;
        let hit = self.caster.nearest_in(start, end - start, 0.0, 1.0);
        hit.is_some()
    }

    fn closest(&self, from: DVec3, direction: DVec3) -> Option<RayHit> {
        let hit = self.caster.nearest(from, direction)?;
        Some(RayHit {
            distance_m: hit.distance,
            triangle: self.first_triangle[hit.mesh] + hit.triangle,
        })
    }

    /// Small displacements of a ray's ends: to eight sides, and back and forth along the ray.
    fn sides(&self, direction: DVec3) -> Vec<DVec3> {
        let (right, up) = direction.normalize().any_orthonormal_pair();
        let along = direction.normalize();
        (0..8)
            .map(|i| {
                let angle = f64::from(i) * std::f64::consts::FRAC_PI_4;
                EDGE * self.size_m * (angle.cos() * right + angle.sin() * up)
            })
            .chain([-1.0, 1.0].map(|side| side * EDGE * self.size_m * along))
            .collect()
    }
}

/// Counts of the rays, of their hits, and of the wrong ones, at edges (within rounding) and elsewhere.
#[derive(Debug, Default)]
struct Wrong {
    rays: usize,
    hits: usize,
    at_edges: usize,
    elsewhere: usize,
    /// Largest error of a distance, relative to the scene's size.
    worst_distance: f64,
}

fn any_hits(truth: &Truth, points: &[RayPoint], ends: &[RayPoint], found: &[bool]) -> Wrong {
    let mut wrong = Wrong::default();
    for (ray, (end, &found)) in ends.iter().zip(found).enumerate() {
        let from = &points[ray * points.len() / ends.len()];
        // A point below the other's horizon sends it no light.
        let offset = end.position_m - from.position_m;
        if offset.dot(from.geometric_normal) <= 0.0 || offset.dot(end.geometric_normal) >= 0.0 {
            continue;
        }
        wrong.rays += 1;
        wrong.hits += usize::from(found);
        if truth.is_blocked(from, end) == found {
            continue;
        }
        let moved = |point: &RayPoint, by: DVec3| RayPoint {
            position_m: point.position_m + by,
            ..*point
        };
        let sides = truth.sides(offset);
        let is_edge = sides.iter().any(|&a| {
            let mut others = sides.iter().chain([&DVec3::ZERO]);
            others.any(|&b| truth.is_blocked(&moved(from, a), &moved(end, b)) == found)
        });
        if is_edge {
            wrong.at_edges += 1;
        } else {
            wrong.elsewhere += 1;
            println!("from {from:?} to {end:?}: {found}");
        }
    }
    wrong
}

fn closest_hits(
    truth: &Truth,
    points: &[RayPoint],
    directions: &[DVec3],
    found: &[Option<RayHit>],
) -> Wrong {
    let mut wrong = Wrong::default();
    for (ray, (&direction, &found)) in directions.iter().zip(found).enumerate() {
        let from = &points[ray * points.len() / directions.len()];
        let start = from.position_m + OWN_SURFACE * truth.size_m * from.geometric_normal;
        wrong.rays += 1;
        wrong.hits += usize::from(found.is_some());
        let error = |truth_hit: Option<RayHit>| match (truth_hit, found) {
            (None, None) => 0.0,
            (Some(right), Some(found)) => {
                (found.distance_m - right.distance_m).abs() / truth.size_m
            }
            _ => f64::INFINITY,
        };
        // A grazing ray's distance is uncertain by the rounding of the plane's height, divided by the slope.
        let tolerance = |hit: Option<RayHit>| {
            let normal = hit.map_or(direction, |hit| truth.normal(hit.triangle));
            2.0 * OWN_SURFACE / direction.dot(normal).abs().max(1e-9)
        };
        let right = truth.closest(start, direction);
        if error(right) <= tolerance(right) {
            wrong.worst_distance = wrong.worst_distance.max(error(right).min(1.0));
            continue;
        }
        let is_edge = truth.sides(direction).iter().any(|&a| {
            let moved = truth.closest(start + a, direction);
            error(moved) <= tolerance(moved)
        });
        if is_edge {
            wrong.at_edges += 1;
        } else {
            wrong.elsewhere += 1;
            println!("from {from:?} along {direction}: {found:?}, not {right:?}");
        }
    }
    wrong
}

impl Truth<'_> {
    fn normal(&self, triangle: usize) -> DVec3 {
        let mesh = self
            .first_triangle
            .partition_point(|&first| first <= triangle)
            - 1;
        let first = self.first_triangle[mesh];
        let mesh = &self.scene.meshes[mesh];
        let [a, b, c] = mesh.triangles[triangle - first].map(|i| mesh.positions_m[i as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    }
}

fn assert_is_exact(gpu: &mut Gpu, what: &str, scene: &Scene, point_count: usize) {
    let (seen, lit) = points_of(gpu, scene);
    let flattened = &scene.flattened();
    assert!(!seen.is_empty() && !lit.is_empty(), "{what}");
    let mut random = Random(fastrand::Rng::with_seed(6));
    let mut points: Vec<RayPoint> = (0..point_count)
        .map(|_| seen[random.index(seen.len())])
        .collect();
    points.sort_by(|a, b| a.position_m.x.total_cmp(&b.position_m.x));
    let ends: Vec<RayPoint> = (0..RAYS * point_count)
        .map(|_| lit[random.index(lit.len())])
        .collect();
    let directions: Vec<DVec3> = (0..RAYS * point_count)
        .map(|ray| random.direction(points[ray / RAYS].geometric_normal))
        .collect();
    let truth = Truth::new(flattened);
    for kernel in tracers(&gpu.device) {
        let probe = RayProbe::new(&gpu.device, scene, kernel).expect("a probe");
        let any = probe.any_hit(&points, &ends).expect("rays");
        let wrong = any_hits(&truth, &points, &ends, &any.found);
        println!(
            "{what}, {kernel:?}, any: {wrong:?}, {} ms",
            any.milliseconds
        );
        assert!(
            wrong.rays > 100 && wrong.elsewhere == 0,
            "{what}: {wrong:?}"
        );
        assert!(wrong.at_edges * 500 <= wrong.rays, "{what}: {wrong:?}");
        let closest = probe.closest_hit(&points, &directions).expect("rays");
        let wrong = closest_hits(&truth, &points, &directions, &closest.found);
        println!(
            "{what}, {kernel:?}, closest: {wrong:?}, {} ms",
            closest.milliseconds
        );
        assert!(
            wrong.rays > 100 && wrong.elsewhere == 0,
            "{what}: {wrong:?}"
        );
        assert!(wrong.at_edges * 500 <= wrong.rays, "{what}: {wrong:?}");
    }
}

#[test]
fn demo_scenes_have_exact_rays() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        let scene = demo_scene(name, [128, 128]);
        assert_is_exact(&mut gpu, name, &scene, 1500);
    }
}

#[test]
fn scenes_of_any_size_and_place_have_exact_rays() {
    let mut gpu = Gpu::open();
    for (scale, shift_m) in [(1e-3, DVec3::ZERO), (1e4, DVec3::splat(1e6))] {
        let scene = rooms::moved(&demo_scene("knot", [96, 96]), scale, shift_m);
        assert_is_exact(&mut gpu, &format!("{scale} times"), &scene, 300);
    }
}

/// Instances share ray trees, and are rotated, stretched and mirrored.
#[test]
fn instances_have_exact_rays() {
    let mut gpu = Gpu::open();
    let crowd = instances::crowd([128, 128]);
    assert_is_exact(&mut gpu, "crowd", &crowd, 1500);
    let slabs = instances::slabs([128, 128]);
    assert_is_exact(&mut gpu, "slabs", &slabs, 3000);
    for (scale, shift_m) in [(1e-3, DVec3::ZERO), (1e4, DVec3::splat(1e6))] {
        let scene = rooms::moved(&crowd, scale, shift_m);
        assert_is_exact(&mut gpu, &format!("crowd {scale} times"), &scene, 300);
    }
}

/// Rays that graze a floor at the foot of a wall.
#[test]
fn contact_lines_have_exact_rays() {
    let mut gpu = Gpu::open();
    for (what, scene) in shadows::contact_lines() {
        assert_is_exact(&mut gpu, what, &scene, 300);
    }
    let scene = shadows::wall_and_low_light();
    assert_is_exact(&mut gpu, "a light 3 mm above the floor", &scene, 300);
}

/// Triangles without area are never hit, alone or in a tree, and do not affect other hits.
#[test]
fn triangles_without_area_are_not_hit() {
    let mut gpu = Gpu::open();
    for copies in [1, 200] {
        let mut scene = demo_scene("cornell", [96, 96]);
        let corners = [[0.0, 1.0, 0.0], [0.3, 1.2, 0.1], [0.6, 1.4, 0.2]];
        let triangles: Vec<[u32; 3]> = [[0, 1, 2], [1, 1, 2], [0, 0, 0]].repeat(copies);
        scene
            .meshes
            .push(Mesh::from_slices("lines", &corners, &triangles, 0).into());
        assert_is_exact(&mut gpu, "lines", &scene, 300);
    }
}
