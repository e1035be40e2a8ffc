//! Traces rays on the host: the tracer for devices whose memory is the host's, and that trace with its cores anyway.

use std::sync::Arc;

use glam::Vec3A;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};

use super::collapse::Binary;
use super::lanes::{Lanes, WithLanes, compute};
use super::nodes::build_parameters;
use super::wide::{Met, NOTHING_HIT, Ray, Stack, Visit, WideNodes, WideTree};
use super::{BOX_SLACK, Cutouts, MeshTree, SharedTree, Texel, placed_bounds, rows_of, unit_length};
use crate::parallel::for_each;

/// Rays that a thread takes at a time.
const RAYS_AT_ONCE: usize = 1 << 10;

/// A scene's triangles for rays that the host traces. Hits are numbered as in `RayTree`.
pub(crate) struct HostTracer {
    scene: Arc<WideTree>,
    meshes: Vec<Arc<WideTree>>,
    over_instances: Option<WideNodes>,
    instances: Vec<Placed>,
    /// The scene's triangles, and what holes those with cut-outs have.
    cutouts: Option<(Vec<Texel>, Cutouts)>,
}

/// An instance of a shared mesh.
struct Placed {
    mesh: usize,
    /// Rows of the transform from the scene to the mesh's space.
    to_mesh: [[f32; 4]; 3],
    /// The largest length of the scene's local unit in the mesh's space.
    unit: f32,
    first_hit: u32,
}

/// What rays look for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Find {
    /// The closest triangle.
    Closest,
    /// Any triangle between the ray's ends.
    Any,
}

impl HostTracer {
    pub fn over(scene: &MeshTree, shared: &[SharedTree], cutouts: Option<Cutouts>) -> HostTracer {
        let mut first_hit = scene.triangle_count();
        let mut instances = Vec::new();
        for (mesh, shared) in shared.iter().enumerate() {
            for to_local in &shared.to_local {
                instances.push(Placed {
                    mesh,
                    to_mesh: rows_of(to_local.inverse()),
                    unit: unit_length(to_local) as f32,
                    first_hit,
                });
                first_hit += shared.tree.triangle_count();
            }
        }
        let bounds = placed_bounds(shared);
        let over_instances = (!bounds.is_empty()).then(|| {
            let tree = build_bvh2(&bounds, build_parameters(), &mut Default::default());
            WideNodes::over(&Counted::new(tree), BOX_SLACK)
        });
        HostTracer {
            scene: scene.wide(),
            meshes: shared.iter().map(|shared| shared.tree.wide()).collect(),
            over_instances,
            instances,
            cutouts: cutouts.map(|cutouts| (scene.triangles.clone(), cutouts)),
        }
    }

    /// Writes what each ray hits, with all threads. Results do not depend on their number.
    pub fn trace(&self, find: Find, rays: &[Ray], hits: &mut [u32]) {
        let parts = rays.chunks(RAYS_AT_ONCE).zip(hits.chunks_mut(RAYS_AT_ONCE));
        for_each(parts, |(rays, hits)| {
            compute(Part {
                tracer: self,
                find,
                rays,
                hits,
            });
        });
    }

    #[inline(always)]
    fn closest<L: Lanes>(&self, lanes: L, ray: &Ray, stack: &mut Stack) -> u32 {
        let mut met = Met {
            inverse_t: 1.0 / ray.t_max,
            hit: NOTHING_HIT,
        };
        let is_hole = |triangle: u32, ray: &Ray| self.is_hole(triangle, ray);
        self.scene.closest(lanes, ray, &mut met, 0, &is_hole, stack);
        if let Some(nodes) = &self.over_instances {
            let mut visitor = ClosestOfInstances {
                tracer: self,
                ray,
                met,
            };
            nodes.nearest_first(lanes, ray, 1.0 / met.inverse_t, stack, &mut visitor);
            met = visitor.met;
        }
        met.hit
    }

    #[inline(always)]
    fn any<L: Lanes>(&self, lanes: L, ray: &Ray, stack: &mut Stack) -> u32 {
        let is_hole = |triangle: u32, ray: &Ray| self.is_hole(triangle, ray);
        let is_blocked = self.scene.is_blocked(lanes, ray, &is_hole, stack)
            || self.over_instances.as_ref().is_some_and(|nodes| {
                let mut visitor = AnyOfInstances { tracer: self, ray };
                nodes.in_any_order(lanes, ray, stack, &mut visitor)
            });
        // Only whether something was hit counts.
        if is_blocked { 0 } else { NOTHING_HIT }
    }

    #[inline(never)]
    fn is_hole(&self, triangle: u32, ray: &Ray) -> bool {
        let Some((triangles, cutouts)) = &self.cutouts else {
            return false;
        };
        let [a, b, c, numbers] = [0, 1, 2, 3].map(|i| triangles[4 * triangle as usize + i]);
        let [origin, direction] = [ray.origin, ray.direction].map(glam::Vec3::from);
        let [c0, c1, c2] = [a, b, c].map(|[x, y, z, _]| glam::vec3(x, y, z) - origin);
        let weight = |a: glam::Vec3, b: glam::Vec3| (a + b).cross(b - a).dot(direction);
        cutouts.is_hole(
            numbers[1] as u32,
            [weight(c1, c2), weight(c2, c0), weight(c0, c1)],
        )
    }
}

impl Placed {
    /// The same ray in the mesh's space. Distances stay, because the direction is transformed with its length.
    #[inline(always)]
    fn ray_in_mesh(&self, ray: &Ray) -> Ray {
        let [x, y, z] = &self.to_mesh;
        let turned = |row: &[f32; 4], [x, y, z]: [f32; 3]| row[0] * x + row[1] * y + row[2] * z;
        let moved = |row: &[f32; 4]| turned(row, ray.origin) + row[3];
        Ray {
            origin: [moved(x), moved(y), moved(z)],
            t_max: ray.t_max,
            direction: [
                turned(x, ray.direction),
                turned(y, ray.direction),
                turned(z, ray.direction),
            ],
            end_height: self.unit * ray.end_height,
        }
    }
}

struct ClosestOfInstances<'t> {
    tracer: &'t HostTracer,
    ray: &'t Ray,
    met: Met,
}

impl<L: Lanes> Visit<L> for ClosestOfInstances<'_> {
    #[inline(always)]
    fn visit(&mut self, lanes: L, leaf: u32, t_max: &mut f32, stack: &mut Stack) -> bool {
        let placed = &self.tracer.instances[leaf as usize];
        let ray = placed.ray_in_mesh(self.ray);
        let mesh = &self.tracer.meshes[placed.mesh];
        mesh.closest(lanes, &ray, &mut self.met, placed.first_hit, &whole, stack);
        *t_max = 1.0 / self.met.inverse_t;
        false
    }
}

struct AnyOfInstances<'t> {
    tracer: &'t HostTracer,
    ray: &'t Ray,
}

impl<L: Lanes> Visit<L> for AnyOfInstances<'_> {
    #[inline(always)]
    fn visit(&mut self, lanes: L, leaf: u32, _: &mut f32, stack: &mut Stack) -> bool {
        let placed = &self.tracer.instances[leaf as usize];
        let ray = placed.ray_in_mesh(self.ray);
        self.tracer.meshes[placed.mesh].is_blocked(lanes, &ray, &whole, stack)
    }
}

/// Shared meshes have no cut-outs.
fn whole(_: u32, _: &Ray) -> bool {
    false
}

/// Rays that one thread traces.
struct Part<'p> {
    tracer: &'p HostTracer,
    find: Find,
    rays: &'p [Ray],
    hits: &'p mut [u32],
}

impl WithLanes for Part<'_> {
    #[inline(always)]
    fn with<L: Lanes>(self, lanes: L) {
        let mut stack = Vec::with_capacity(256);
        for (ray, hit) in self.rays.iter().zip(self.hits) {
            *hit = match self.find {
                _ if ray.t_max < 0.0 => NOTHING_HIT,
                Find::Closest => self.tracer.closest(lanes, ray, &mut stack),
                Find::Any => self.tracer.any(lanes, ray, &mut stack),
            };
        }
    }
}

/// A binary tree, and the number of items below each node.
struct Counted {
    tree: Bvh2,
    counts: Vec<usize>,
}

impl Counted {
    fn new(tree: Bvh2) -> Counted {
        let mut counts = vec![1; tree.nodes.len()];
        // Parents before their children.
        let mut order = vec![0];
        let mut next = 0;
        while let Some(&index) = order.get(next) {
            let node = &tree.nodes[index];
            if !node.is_leaf() {
                order.extend([0, 1].map(|child| node.first_index as usize + child));
            }
            next += 1;
        }
        for index in order.into_iter().rev() {
            let node = &tree.nodes[index];
            if !node.is_leaf() {
                let first = node.first_index as usize;
                counts[index] = counts[first] + counts[first + 1];
            }
        }
        Counted { tree, counts }
    }
}

impl Binary for Counted {
    fn children(&self, node: usize) -> Result<[usize; 2], u32> {
        let node = &self.tree.nodes[node];
        let first = node.first_index as usize;
        match node.is_leaf() {
            true => Err(self.tree.primitive_indices[first]),
            false => Ok([first, first + 1]),
        }
    }

    fn bounds(&self, node: usize) -> [Vec3A; 2] {
        let bounds = &self.tree.nodes[node].aabb;
        [bounds.min, bounds.max]
    }

    fn count(&self, node: usize) -> usize {
        self.counts.get(node).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3, Vec3};

    use super::*;
    use crate::{
        parallel::with_threads,
        ray_tree::{lanes::Plain, slack_of_shared},
    };

    /// Triangles of many sizes, scattered in the space of the scene.
    fn triangles(seed: u64, count: usize) -> Vec<[Vec3; 3]> {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut vector = move |size: f32| {
            let mut unit = || 2.0 * random.f32() - 1.0;
            size * Vec3::new(unit(), unit(), unit())
        };
        let triangle = |index: usize| {
            let at = vector(0.8);
            let size = [0.2, 0.02, 0.002][index % 3];
            [0; 3].map(|_| at + vector(size))
        };
        (0..count).map(triangle).collect()
    }

    fn rays(count: usize, t_max: f32) -> Vec<Ray> {
        let mut random = fastrand::Rng::with_seed(7);
        let mut vector = || [0; 3].map(|_| 2.0 * random.f32() - 1.0);
        let ray = |_| Ray {
            origin: vector(),
            t_max,
            direction: vector(),
            end_height: 0.0,
        };
        (0..count).map(ray).collect()
    }

    fn traced(tracer: &HostTracer, find: Find, rays: &[Ray]) -> Vec<u32> {
        let mut hits = vec![0; rays.len()];
        tracer.trace(find, rays, &mut hits);
        hits
    }

    /// The closest of all triangles, without a tree; the first of several.
    fn closest_of_all(tracer: &HostTracer, ray: &Ray) -> u32 {
        let mut met = Met {
            inverse_t: 1.0 / ray.t_max,
            hit: NOTHING_HIT,
        };
        tracer.scene.closest_of_all(Plain, ray, &mut met);
        met.hit
    }

    #[test]
    fn a_tree_finds_what_all_triangles_have() {
        let corners = triangles(1, 500);
        let tree = MeshTree::of_scene(&corners, &[0; 500], false);
        let tracer = HostTracer::over(&tree, &[], None);
        let rays = rays(3000, 1e30);
        let hits = traced(&tracer, Find::Closest, &rays);
        assert!(hits.iter().filter(|&&hit| hit != NOTHING_HIT).count() > 500);
        for (ray, hit) in rays.iter().zip(&hits) {
            assert_eq!(closest_of_all(&tracer, ray), *hit, "{ray:?}");
        }
        // What is hit within a length of the direction blocks the ray.
        let short: Vec<Ray> = rays.iter().map(|&ray| Ray { t_max: 1.0, ..ray }).collect();
        let closest = traced(&tracer, Find::Closest, &short);
        let any = traced(&tracer, Find::Any, &short);
        let blocked = any.iter().map(|&hit| hit != NOTHING_HIT);
        assert!(blocked.eq(closest.iter().map(|&hit| hit != NOTHING_HIT)));
    }

    #[test]
    fn of_equal_triangles_the_first_is_hit() {
        let one = [Vec3::ZERO, 0.5 * Vec3::X, 0.5 * Vec3::Y];
        let tree = MeshTree::of_scene(&[one; 100], &[0; 100], false);
        let tracer = HostTracer::over(&tree, &[], None);
        let ray = Ray {
            origin: [0.1, 0.1, 0.5],
            t_max: 1e30,
            direction: [0.0, 0.0, -1.0],
            end_height: 0.0,
        };
        assert_eq!(traced(&tracer, Find::Closest, &[ray]), [0]);
    }

    #[test]
    fn triangles_at_the_fixed_end_are_ignored() {
        let lamp = [
            Vec3::new(-0.5, -0.5, 0.5),
            Vec3::new(0.5, -0.5, 0.5),
            Vec3::new(0.0, 0.5, 0.5),
        ];
        let tree = MeshTree::of_scene(&[lamp], &[0], false);
        let tracer = HostTracer::over(&tree, &[], None);
        let to_lamp = |end_height: f32, direction: [f32; 3]| Ray {
            origin: [0.0; 3],
            t_max: 1.0,
            direction,
            end_height,
        };
        let just_beyond = [0.0, 0.0, 0.5 + 1e-6];
        let rays = [
            to_lamp(0.0, just_beyond),
            to_lamp(2e-6, just_beyond),
            to_lamp(2e-6, [0.0, 0.0, 0.6]),
        ];
        assert_eq!(traced(&tracer, Find::Any, &rays), [0, NOTHING_HIT, 0]);
        let from_lamp = |end_height: f32| Ray {
            origin: [0.0, 0.0, 0.5 + 1e-6],
            t_max: 1e30,
            direction: [0.0, 0.0, -1.0],
            end_height,
        };
        let rays = [from_lamp(0.0), from_lamp(2e-6)];
        assert_eq!(traced(&tracer, Find::Closest, &rays), [0, NOTHING_HIT]);
    }

    #[test]
    fn rays_that_are_none_hit_nothing() {
        let tree = MeshTree::of_scene(&triangles(2, 50), &[0; 50], false);
        let tracer = HostTracer::over(&tree, &[], None);
        for find in [Find::Any, Find::Closest] {
            let hits = traced(&tracer, find, &rays(100, -1.0));
            assert!(hits.iter().all(|&hit| hit == NOTHING_HIT));
        }
        let empty = HostTracer::over(&MeshTree::of_scene(&[], &[], false), &[], None);
        assert_eq!(traced(&empty, Find::Closest, &rays(1, 1e30)), [NOTHING_HIT]);
    }

    /// Instances are hit where copies in the scene's space would be.
    #[test]
    fn instances_are_hit_like_copies() {
        let own = triangles(3, 300);
        let to_local: Vec<DAffine3> = (0..4)
            .map(|i| {
                let turn = DAffine3::from_rotation_y(f64::from(i))
                    * DAffine3::from_scale(DVec3::new(0.7, 0.8, -0.4));
                DAffine3::from_translation(DVec3::splat(0.3 * f64::from(i) - 0.5)) * turn
            })
            .collect();
        let mesh = MeshTree::of_mesh(&own, slack_of_shared(&to_local));
        let scene = MeshTree::of_scene(&triangles(4, 20), &[0; 20], true);
        let shared = SharedTree {
            tree: &mesh,
            first_place: 20,
            to_local: to_local.clone(),
        };
        let instanced = HostTracer::over(&scene, &[shared], None);
        let placed = to_local.iter().flat_map(|to_local| {
            let moved = |corner: Vec3| to_local.transform_point3(corner.as_dvec3()).as_vec3();
            own.iter().map(move |corners| corners.map(moved))
        });
        let copies: Vec<_> = triangles(4, 20).into_iter().chain(placed).collect();
        let tree = MeshTree::of_scene(&copies, &vec![0; copies.len()], false);
        let copied = HostTracer::over(&tree, &[], None);
        let rays = rays(4000, 1e30);
        let [a, b] = [&instanced, &copied].map(|tracer| traced(tracer, Find::Closest, &rays));
        assert!(
            a.iter()
                .filter(|&&hit| hit != NOTHING_HIT && hit >= 20)
                .count()
                > 200
        );
        // Rounding moves edges.
        assert!(a.iter().zip(&b).filter(|(a, b)| a != b).count() <= 2);
    }

    /// Neither the number of threads nor a refit changes what rays hit.
    #[test]
    fn hits_depend_on_triangles_alone() {
        let count = 20_000;
        let corners = triangles(5, count);
        let moved = |&[a, b, c]: &[Vec3; 3]| [a, b, c].map(|at| at + 0.002 * (20.0 * at.x).sin());
        let moved: Vec<[Vec3; 3]> = corners.iter().map(moved).collect();
        let rays = rays(3000, 1e30);
        let cutouts = vec![0; count];
        let hits = |tree: &MeshTree| {
            let tracer = HostTracer::over(tree, &[], None);
            [Find::Closest, Find::Any].map(|find| traced(&tracer, find, &rays))
        };
        let found = |threads: usize| {
            with_threads(threads, || {
                let mut tree = MeshTree::of_scene(&corners, &cutouts, false);
                let before = hits(&tree);
                assert!(tree.refit_scene(&moved, &cutouts, false));
                (before, hits(&tree))
            })
        };
        let (before, refitted) = found(1);
        assert_ne!(before, refitted);
        let built = hits(&MeshTree::of_scene(&moved, &cutouts, false));
        assert_eq!(refitted, built);
        for threads in [2, 5] {
            assert_eq!(found(threads), (before.clone(), refitted.clone()));
        }
    }
}
