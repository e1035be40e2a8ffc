//! Many rays from points of surfaces: the trace pass alone, for tests and benches.

use std::{
    cell::{Cell, RefCell},
    sync::Arc,
    time::{Duration, Instant},
};

use glam::{DVec3, Vec3};

use crate::{
    Device, LocalSpace, Plan, RenderOptions, Renderer, Result, Scene, Tracer,
    geometry::Geometry,
    passes::{
        Context,
        cost::Cost,
        rays::RayTriangles,
        textures::Textures,
        trace::{Find, RayList, kept},
    },
    ray_tree::{MeshTrees, Ray, alpha_textures, corners_of, corners_of_placed},
    vulkan::{CommandPool, Pipelines, Readback},
};

/// Distances by which rays start and end beside surfaces, as in `shaders/shared/ray.wgsl`.
const ORIGIN_SHIFT: f32 = 24.0 * ROUNDING;
const END_SHIFT: f32 = 40.0 * ROUNDING;
const ROUNDING: f32 = 5.9604645e-8;

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayPoint {
    pub position_m: DVec3,
    /// Unit normal of the triangle, on the side that the ray leaves from or arrives at.
    pub geometric_normal: DVec3,
}

/// The closest hit of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    pub distance_m: f64,
    /// Index counted over all meshes of the scene, those that instances share last.
    pub triangle: usize,
}

/// Results of rays, and the time they took.
#[derive(Debug, Clone, PartialEq)]
pub struct Probed<T> {
    /// In the order of the rays.
    pub found: Vec<T>,
    pub milliseconds: f64,
}

/// Rays that a frame traces, in the scene's local space.
pub struct FrameRays {
    find: Find,
    rays: Vec<Ray>,
}

impl FrameRays {
    /// Renders a frame and keeps a sixteenth of its rays: those of which the closest hit counts, and those that anything blocks.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn of(renderer: &mut Renderer, scene: &Scene) -> Result<[FrameRays; 2]> {
        kept::RAYS.set(Some(Vec::new()));
        let frame = renderer.render(scene, &mut RenderOptions::default());
        let kept = kept::RAYS.take().unwrap_or_default();
        frame?;
        Ok([Find::Closest, Find::Any].map(|find| {
            let blocks = kept.iter().filter(|(found, _)| *found == find);
            let rays = blocks.flat_map(|(_, block)| block);
            let exists = |ray: &&Ray| ray.t_max > 0.0;
            FrameRays {
                find,
                rays: rays.filter(exists).copied().collect(),
            }
        }))
    }

    /// Whether the closest hit counts, not any.
    pub fn wants_closest(&self) -> bool {
        self.find == Find::Closest
    }

    /// For each ray: origin, distance of its end in lengths of the direction, direction, and a number that says which triangles it ignores.
    pub fn records(&self) -> &[[f32; 8]] {
        bytemuck::cast_slice(&self.rays)
    }
}

/// A scene's triangles for rays.
pub struct RayProbe {
    device: Device,
    pipelines: Pipelines,
    commands: CommandPool,
    scene: Scene,
    plan: Plan,
    space: LocalSpace,
    triangles: RayTriangles,
    /// For each hit: the triangle's index and its corners in local space.
    hits: Vec<(usize, [DVec3; 3])>,
}

impl RayProbe {
    /// Uploads a valid scene.
    ///
    /// # Errors
    /// [`Error::NoDevice`](crate::Error::NoDevice) if the tracer does not run on the device; [`Error::Memory`](crate::Error::Memory) and
    /// [`Error::Vulkan`](crate::Error::Vulkan) if the device fails.
    pub fn new(device: &Device, scene: &Scene, tracer: Tracer) -> Result<RayProbe> {
        let space = LocalSpace::of(scene.bounding_box());
        let commands = CommandPool::new(device);
        let tracer = tracer.checked_for(device.info())?;
        let mut plan = Plan::new(scene, device.info())?;
        plan.tracer = Some(tracer);
        let textures = Arc::new(match scene.has_cutouts() {
            true => Textures::upload(&commands, scene)?,
            false => Textures::default(),
        });
        let trees = &mut MeshTrees::default();
        let geometry = Geometry::of(scene, None);
        let triangles = RayTriangles::of(
            &commands, scene, &geometry, &space, &textures, tracer, trees,
        )?;
        let mut hits = corners_of_hits(&geometry, &space);
        if tracer == Tracer::Query {
            // Those with cut-outs come last.
            let placed = geometry.placed.iter();
            let alpha = placed.flat_map(|placed| alpha_textures(scene, &placed.mesh));
            let mut has_cutouts: Vec<bool> = alpha.map(|alpha| alpha.is_some()).collect();
            has_cutouts.resize(hits.len(), true);
            let placed = geometry.placed_triangle_count() as usize;
            hits[..placed].sort_by_key(|&(triangle, _)| has_cutouts[triangle]);
        }
        Ok(RayProbe {
            device: device.clone(),
            pipelines: Pipelines::new(device),
            commands,
            scene: scene.clone(),
            plan,
            space,
            triangles,
            hits,
        })
    }

    /// Whether something is between each point and its ends. Every point has the same number of ends.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) and [`Error::Vulkan`](crate::Error::Vulkan) if the device fails.
    pub fn any_hit(&self, points: &[RayPoint], ends: &[RayPoint]) -> Result<Probed<bool>> {
        let rays = ends.iter().enumerate().map(|(ray, end)| {
            let origin = self.beside(&points[ray * points.len() / ends.len()], ORIGIN_SHIFT);
            Ray {
                origin: origin.to_array(),
                t_max: 1.0,
                direction: (self.beside(end, END_SHIFT) - origin).to_array(),
                end_height: 0.0,
            }
        });
        let probed = self.probe(Find::Any, &rays.collect::<Vec<_>>())?;
        Ok(Probed {
            found: probed.found.iter().map(|&hit| hit != u32::MAX).collect(),
            milliseconds: probed.milliseconds,
        })
    }

    /// The closest hit along unit directions. Every point has the same number of directions.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) and [`Error::Vulkan`](crate::Error::Vulkan) if the device fails.
    pub fn closest_hit(
        &self,
        points: &[RayPoint],
        directions: &[DVec3],
    ) -> Result<Probed<Option<RayHit>>> {
        let rays = directions.iter().enumerate().map(|(ray, direction)| {
            let point = &points[ray * points.len() / directions.len()];
            Ray {
                origin: self.beside(point, ORIGIN_SHIFT).to_array(),
                t_max: 1e30,
                direction: direction.as_vec3().to_array(),
                end_height: 0.0,
            }
        });
        let rays: Vec<Ray> = rays.collect();
        let probed = self.probe(Find::Closest, &rays)?;
        let hit = |(ray, &hit): (&Ray, &u32)| {
            let &(triangle, [a, b, c]) = self.hits.get(hit as usize)?;
            let [origin, direction] = [ray.origin, ray.direction].map(|v| Vec3::from(v).as_dvec3());
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let distance = normal.dot(a - origin) / normal.dot(direction);
            Some(RayHit {
                distance_m: self.space.metres_per_unit * distance,
                triangle,
            })
        };
        Ok(Probed {
            found: rays.iter().zip(&probed.found).map(hit).collect(),
            milliseconds: probed.milliseconds,
        })
    }

    /// The triangle that each ray of a frame hits, counted as in [`RayHit`]. Rays that anything blocks have 0 for one that is blocked.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) and [`Error::Vulkan`](crate::Error::Vulkan) if the device fails.
    pub fn trace(&self, rays: &FrameRays) -> Result<Probed<Option<usize>>> {
        let probed = self.probe(rays.find, &rays.rays)?;
        let triangle = |&hit: &u32| match rays.find {
            Find::Closest => Some(self.hits.get(hit as usize)?.0),
            Find::Any => (hit != u32::MAX).then_some(0),
        };
        Ok(Probed {
            found: probed.found.iter().map(triangle).collect(),
            milliseconds: probed.milliseconds,
        })
    }

    /// A point beside its surface, local.
    fn beside(&self, point: &RayPoint, shift: f32) -> Vec3 {
        let normal = point.geometric_normal.as_vec3();
        Vec3::from(self.space.to_local(point.position_m))
            + shift * normal.abs().element_sum() * normal
    }

    fn probe(&self, find: Find, rays: &[Ray]) -> Result<Probed<u32>> {
        let mut plan = self.plan.clone();
        plan.rays_at_once = rays.len() as u32;
        let cost = RefCell::new(Cost::new(Duration::MAX, &self.pipelines, None));
        let list = RefCell::new(RayList::for_plan(&self.device, &plan)?);
        let context = Context {
            device: &self.device,
            pipelines: &self.pipelines,
            commands: &self.commands,
            scene: &self.scene,
            plan: &plan,
            space: &self.space,
            stays_on_device: false,
            layers: None,
            seed: 0,
            modulation: None,
            cost: &cost,
            ends_early: &Cell::new(false),
            rays: &list,
            readback: &RefCell::new(Readback::new(&self.device)),
            recorded: &RefCell::default(),
        };
        RayList::upload(&context, rays)?;
        let start = Instant::now();
        self.triangles.trace(&context, find, 0..rays.len() as u32)?;
        context.finish()?;
        let wall_milliseconds = start.elapsed().as_secs_f64() * 1e3;
        let traced = |(pass, _): &&(&str, f64)| *pass == "trace";
        let times = cost.borrow().times().clone();
        let milliseconds: f64 = times.iter().filter(traced).map(|(_, ms)| ms).sum();
        Ok(Probed {
            found: RayList::read_hits(&context, rays.len() as u32)?,
            milliseconds: if milliseconds > 0.0 {
                milliseconds
            } else {
                wall_milliseconds
            },
        })
    }
}

/// The triangles in the order in which hits are numbered.
fn corners_of_hits(geometry: &Geometry, space: &LocalSpace) -> Vec<(usize, [DVec3; 3])> {
    let in_f64 = |corners: [Vec3; 3]| corners.map(Vec3::as_dvec3);
    let placed = corners_of_placed(geometry, space).into_iter().map(in_f64);
    let shared = geometry.shared.iter().flat_map(|mesh| {
        let corners = corners_of(&mesh.mesh, &mesh.space);
        mesh.instances.iter().flat_map(move |instance| {
            let to_local = mesh.to_local(instance, space);
            let corners: Vec<_> = corners.iter().map(|&corners| in_f64(corners)).collect();
            let moved = corners.into_iter();
            moved.map(move |corners| corners.map(|corner| to_local.transform_point3(corner)))
        })
    });
    placed.chain(shared).enumerate().collect()
}
