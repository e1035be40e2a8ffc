//! The light that reaches a surface point directly and by bounces.
//!
//! A bounce L–Q–P is sampled in two ways. From P, a direction sampled from f_P's lobes finds Q. From L, an emitted ray finds Q. The first
//! works best if Q is near P, the second if Q is near L. The balance heuristic (Veach & Guibas 1995) combines their samples: a sample of
//! either counts F(Q) / (p_P(Q) + p_L(Q)), where F is the integrand over surface area and the p are the densities of the two ways.
//!
//! With more bounces, the direction from P goes on: Q becomes the next vertex, at which the light of a single bounce is sampled in the same
//! two ways, with other random numbers. So a path of n bounces has n − 1 directions that only one way samples, and a last Q at which the two
//! ways are combined. What surfaces emit is sampled where it arrives: by a direction from a vertex and by a point of an emissive surface.

use std::ops::Range;

use glam::DVec3;
use sobol_burley::sample_4d;

use super::{
    bounces_of,
    brdf::Lobes,
    draws::Draws,
    emissive::EmissiveSides,
    light::{Emitter, Illumination},
    rays::{Hit, Ray, Triangles},
    surface::{Surface, Surfaces},
    view_ray::ViewRay,
};
use crate::{
    Scene,
    model::Phasor,
    scene::{MAX_FREQUENCIES, TimeOfFlight},
};

/// Relative to the scene's size: a surface nearer to a camera than this contains the camera, apart from f64 rounding.
const OWN_SURFACE: f64 = 1e-13;

/// A scene in local space: coordinates of its surfaces are within −1 and 1.
#[derive(Debug)]
pub struct Transport {
    pub surfaces: Surfaces,
    triangles: Triangles,
    emitters: Vec<Emitter>,
    tof: Option<TimeOfFlight>,
    /// Most surfaces that reflect light before P.
    bounces: u32,
    origin_m: DVec3,
    /// A power of two, so that scaling rounds nothing.
    pub metres_per_unit: f64,
}

/// P, seen from C.
#[derive(Debug, Clone, Copy)]
pub struct Receiver {
    /// [Moved](Surface::towards) by the possible rounding error.
    pub surface: Surface,
    /// Unit vector.
    pub to_camera: DVec3,
    /// |PC|
    distance: f64,
    lobes: Lobes,
}

/// A point of a path from C.
#[derive(Debug, Clone, Copy)]
struct Vertex {
    /// Its camera is the vertex before it, but its distance is the path's length to C.
    receiver: Receiver,
    /// Number of vertices before it; 0: P.
    index: u32,
    /// What radiance from here to the vertex before it counts at C, over the density of the path.
    throughput: DVec3,
}

impl Vertex {
    /// The next vertex, at what a direction from this one meets; `None` where the density of the direction is 0.
    fn next(&self, direction: DVec3, met: Surface) -> Option<Vertex> {
        let Receiver {
            surface: p,
            to_camera,
            distance,
            lobes,
        } = &self.receiver;
        let density = lobes.density(direction);
        if density <= 0.0 {
            return None;
        }
        let f_p = p.brdf.eval(direction, p.normal, *to_camera);
        let step = met.position.distance(p.position);
        Some(Vertex {
            receiver: Receiver {
                distance: distance + step,
                ..Receiver::new(met, -direction, step)
            },
            index: self.index + 1,
            throughput: self.throughput * f_p * (p.normal.dot(direction) / density),
        })
    }
}

/// The light of paths that end at C.
#[derive(Debug, Clone, Copy, Default)]
pub struct Arrived {
    /// W/sr/m²
    pub radiance: DVec3,
    /// Z of each frequency of time of flight.
    pub phasors: [Phasor; MAX_FREQUENCIES],
}

impl Arrived {
    /// Adds `other`, scaled by `times`.
    pub fn add(&mut self, other: &Arrived, times: f64) {
        self.radiance += times * other.radiance;
        for (own, other) in self.phasors.iter_mut().zip(other.phasors) {
            *own = *own + other * times;
        }
    }
}

impl Receiver {
    /// `distance` is the distance to C.
    pub fn new(surface: Surface, to_camera: DVec3, distance: f64) -> Receiver {
        Receiver {
            surface: surface.towards(to_camera, distance),
            to_camera,
            distance,
            lobes: surface.brdf.lobes(surface.normal, to_camera),
        }
    }
}

/// Points of each area light that its direct light is averaged over.
pub const AREA_SAMPLES: u32 = 1024;

impl Transport {
    pub fn new(scene: &Scene) -> Transport {
        let (origin_m, extent_m) = scene.bounding_box().map_or((DVec3::ZERO, 1.0), |bounds| {
            let half_extent = 0.5 * (bounds.max_m - bounds.min_m);
            (bounds.min_m + half_extent, half_extent.max_element())
        });
        let power = extent_m.log2().ceil().exp2();
        let metres_per_unit = if power.is_normal() { power } else { 1.0 };
        let to_local = |world_m: DVec3| (world_m - origin_m) / metres_per_unit;
        let surfaces = Surfaces::new(scene, to_local);
        let lights = scene.lights.iter();
        let mut emitters: Vec<Emitter> = lights
            .map(|light| Emitter::new(light, to_local, metres_per_unit))
            .collect();
        let mut tof = scene.tof.clone();
        if let Some(sides) = EmissiveSides::of(&surfaces) {
            if let Some(tof) = &mut tof {
                tof.ambient_lights.push(emitters.len());
            }
            emitters.push(Emitter::Surfaces(sides));
        }
        Transport {
            triangles: Triangles::new(&surfaces.triangles),
            surfaces,
            emitters,
            tof,
            bounces: bounces_of(scene),
            origin_m,
            metres_per_unit,
        }
    }

    /// The most light paths of a sample of the indirect light.
    pub fn most_paths(&self) -> u64 {
        (0..=self.last_vertex()).map(|i| self.paths_at(i)).sum()
    }

    /// Light paths from one vertex: its own, and those from lights.
    fn paths_at(&self, vertex: u32) -> u64 {
        1 + self.lights_at(vertex).count() as u64
    }

    /// The last vertex of the longest paths. Emission needs one more than lamps: it is sampled where it arrives.
    fn last_vertex(&self) -> u32 {
        match self.emissive() {
            Some(_) if self.bounces > 1 => self.bounces,
            _ => self.bounces - 1,
        }
    }

    /// The lights whose single bounce a vertex samples, and their indices. Emissive surfaces are among them at P alone. Their points come
    /// as near to later vertices as those to each other, in corners, and there neither of the two ways is good.
    fn lights_at(&self, vertex: u32) -> impl Iterator<Item = (usize, &Emitter)> {
        let lights = self.emitters.iter().enumerate();
        lights.filter(move |(_, emitter)| match emitter {
            Emitter::Surfaces(_) => vertex == 0,
            _ => vertex < self.bounces,
        })
    }

    /// Number of time-of-flight frequencies.
    pub fn frequency_count(&self) -> usize {
        self.tof.as_ref().map_or(0, |tof| tof.frequencies_hz.len())
    }

    /// |LP| + |PC| of the nearest modulated light, metres.
    pub fn shortest_path_m(&self, receiver: &Receiver) -> f64 {
        let is_modulated = |light: usize| self.tof.as_ref().is_some_and(|t| t.is_modulated(light));
        let lights = self.emitters.iter().enumerate();
        let lengths = lights
            .filter(|(light, _)| is_modulated(*light))
            .map(|(_, emitter)| emitter.distance_to(receiver.surface.position));
        let nearest = lengths.fold(f64::INFINITY, f64::min);
        (nearest + receiver.distance) * self.metres_per_unit
    }

    /// Adds the light of a path from one of the lights to C.
    fn add_path(&self, sum: &mut Arrived, radiance: DVec3, light: usize, length: f64) {
        sum.radiance += radiance;
        let Some(tof) = self.tof.as_ref().filter(|tof| tof.is_modulated(light)) else {
            return;
        };
        let (seen, length_m) = (
            tof.weighted(radiance.to_array()),
            length * self.metres_per_unit,
        );
        for (phasor, &frequency_hz) in sum.phasors.iter_mut().zip(&tof.frequencies_hz) {
            *phasor = *phasor + Phasor::of_path(seen, length_m, frequency_hz);
        }
    }

    pub fn to_local(&self, world_m: DVec3) -> DVec3 {
        (world_m - self.origin_m) / self.metres_per_unit
    }

    pub fn to_world_m(&self, local: DVec3) -> DVec3 {
        self.origin_m + self.metres_per_unit * local
    }

    /// What the camera sees along a half line: its first hit, but for the backs of one-sided surfaces. A surface that contains the origin does not block it: otherwise rounding would decide where it
    /// blocks.
    pub fn seen(&self, ray: &ViewRay) -> Option<Hit> {
        let ViewRay {
            origin_m,
            direction,
            ..
        } = *ray;
        let start = OWN_SURFACE / direction.length();
        let ray = Ray::half_line(self.to_local(origin_m) + start * direction, direction);
        let is_seen = |hit: &Hit| self.surfaces.is_at(hit) && self.surfaces.is_seen(hit, direction);
        let hit = self.triangles.nearest(&ray, is_seen)?;
        Some(Hit {
            distance: start + hit.distance,
            ..hit
        })
    }

    fn follow(&self, ray: &Ray) -> Option<Surface> {
        let hit = self
            .triangles
            .nearest(ray, |hit| self.surfaces.is_at(hit))?;
        Some(self.surfaces.at(&hit, ray.direction))
    }

    /// L_{P→C} of all lights but the emissive surfaces. For area lights, it uses the given points of a sequence that the seed selects.
    pub fn direct(&self, receiver: &Receiver, points: Range<u32>, seed: u32) -> Arrived {
        let mut arrived = Arrived::default();
        for (index, emitter) in self.emitters.iter().enumerate() {
            if matches!(emitter, Emitter::Surfaces(_)) {
                // Part of the indirect light.
                continue;
            }
            if !emitter.has_area() {
                self.add_direct(&mut arrived, receiver, index, emitter, 1.0);
                continue;
            }
            for point in points.clone() {
                // Two lights share a set of four dimensions.
                let drawn = sample_4d(point, 3, seed ^ (index as u32 / 2)).map(f64::from);
                let place = drawn.as_chunks().0[index % 2];
                let share = f64::from(points.len() as u32).recip();
                if let Some(emitter) = emitter.at_point(place, &self.surfaces) {
                    self.add_direct(&mut arrived, receiver, index, &emitter, share);
                }
            }
        }
        arrived
    }

    fn add_direct(
        &self,
        arrived: &mut Arrived,
        receiver: &Receiver,
        index: usize,
        emitter: &Emitter,
        share: f64,
    ) {
        let surface = &receiver.surface;
        let sent = self.reflected(emitter, surface, receiver.to_camera);
        if let Some((sent, illumination)) = sent
            && self.is_lit(surface, &illumination)
        {
            let length = illumination.length + receiver.distance;
            self.add_path(arrived, share * sent, index, length);
        }
    }

    /// One sample of the light that surfaces send to P: by bounces, and what they emit. Its expected value is the indirect light from P to
    /// C. Also returns the number of light paths that it took.
    pub fn indirect(&self, receiver: &Receiver, draws: Draws) -> (Arrived, u64) {
        let mut arrived = Arrived::default();
        let mut vertex = Vertex {
            receiver: *receiver,
            index: 0,
            throughput: DVec3::ONE,
        };
        // After P, a path goes on in proportion to what it still carries.
        let mut carried = 0.0;
        let mut paths = 0;
        loop {
            let draws = draws.at_vertex(vertex.index);
            let onward = self.bounce_at(&vertex, draws, &mut arrived);
            paths += self.paths_at(vertex.index);
            let Some(mut next) = onward.filter(|next| next.index <= self.last_vertex()) else {
                return (arrived, paths);
            };
            let left = next.throughput.max_element();
            if next.index == 1 {
                carried = left;
            }
            let survival = (left / carried).min(1.0);
            // Also ends a path that carries nothing.
            if !(left > 0.0 && draws.onward().survival < survival) {
                return (arrived, paths);
            }
            next.throughput /= survival;
            vertex = next;
        }
    }

    /// Adds one sample of the light that a vertex gets by a single bounce, times the throughput, and of what surfaces emit to it. The vertex
    /// after P leaves the latter out: it is the single bounce at P. Returns the next vertex, if the sampled direction meets one.
    fn bounce_at(&self, vertex: &Vertex, draws: Draws, arrived: &mut Arrived) -> Option<Vertex> {
        let Vertex {
            receiver,
            index: vertex_index,
            throughput,
        } = vertex;
        let at_point = |index: usize, emitter: &Emitter| {
            let has_area = emitter.has_area();
            has_area.then(|| emitter.at_point(draws.area(index), &self.surfaces))?
        };
        let emissive = self.emissive().filter(|_| *vertex_index != 1);
        let p = &receiver.surface;
        let onward = draws.onward();
        let direction = receiver.lobes.sample(onward.lobe, onward.direction);
        let mut next = None;
        if is_above(p, direction) {
            let ray = Ray {
                from_triangle: p.triangle,
                ..Ray::half_line(p.start(), direction)
            };
            if let Some(q) = self.follow(&ray) {
                if let Some((light, sides)) = emissive {
                    let radiance = self.emitted(receiver, &q, sides);
                    self.add_path(arrived, throughput * radiance, light, f64::INFINITY);
                }
                for (index, emitter) in self.lights_at(*vertex_index) {
                    let at_point = at_point(index, emitter);
                    let emitter = at_point.as_ref().unwrap_or(emitter);
                    if let Some((contribution, illumination, length)) =
                        self.bounce(receiver, &q, emitter)
                        && self.is_lit(&q, &illumination)
                    {
                        self.add_path(arrived, throughput * contribution, index, length);
                    }
                }
                next = vertex.next(direction, q);
            }
        }
        if let Some((light, sides)) = emissive
            && let Some(q) = sides.surface_at(draws.own(light), &self.surfaces, p.position)
            && self.is_between_free(p, &q)
        {
            let radiance = self.emitted(receiver, &q, sides);
            self.add_path(arrived, throughput * radiance, light, f64::INFINITY);
        }
        for (index, emitter) in self.lights_at(*vertex_index) {
            let at_point = at_point(index, emitter);
            let emitter = at_point.as_ref().unwrap_or(emitter);
            let ray = emitter.sample(draws.emission(index));
            let Some(q) = self.follow(&ray) else {
                continue;
            };
            if let Some((contribution, _, length)) = self.bounce(receiver, &q, emitter)
                && self.is_between_free(p, &q)
            {
                self.add_path(arrived, throughput * contribution, index, length);
            }
        }
        next
    }

    /// The emissive surfaces, and their index among the lights.
    fn emissive(&self) -> Option<(usize, &EmissiveSides)> {
        let last = self.emitters.len().checked_sub(1)?;
        match &self.emitters[last] {
            Emitter::Surfaces(sides) => Some((last, sides)),
            _ => None,
        }
    }

    /// What Q emits to P, in the direction of C, over the sum of the densities of directions from P and of points on emissive surfaces.
    fn emitted(&self, receiver: &Receiver, q: &Surface, sides: &EmissiveSides) -> DVec3 {
        let p = &receiver.surface;
        let offset = q.position - p.position;
        let to_q = offset.normalize();
        let area_to_angle = q.geometric_normal.dot(-to_q) / offset.length_squared();
        if q.emission == DVec3::ZERO || !is_above(p, to_q) || area_to_angle <= 0.0 {
            return DVec3::ZERO;
        }
        let from_p = receiver.lobes.density(to_q) * area_to_angle;
        let density = from_p + sides.density(q.triangle);
        let f_p = p.brdf.eval(to_q, p.normal, receiver.to_camera);
        f_p * q.emission * (p.normal.dot(to_q) * area_to_angle / density)
    }

    /// F(Q) / (p_P(Q) + p_L(Q)) with V = 1 on both segments, and |LQ| + |QP| + |PC|; `None` where F is 0. Q is seen from one of its
    /// neighbours on the path and must show the same side to the other one.
    fn bounce(
        &self,
        receiver: &Receiver,
        q: &Surface,
        emitter: &Emitter,
    ) -> Option<(DVec3, Illumination, f64)> {
        let p = &receiver.surface;
        let offset = q.position - p.position;
        let distance_squared = offset.length_squared();
        let distance = distance_squared.sqrt();
        let to_q = offset / distance;
        if !is_above(p, to_q) || q.geometric_normal.dot(-to_q) <= 0.0 {
            return None;
        }
        // L_{Q→P}
        let (radiance, illumination) = self.reflected(emitter, q, -to_q)?;
        // Converts the area at Q to the solid angle at P.
        let area_to_angle = q.geometric_normal.dot(-to_q) / distance_squared;
        let from_p = receiver.lobes.density(to_q) * area_to_angle;
        let from_light = illumination.density * q.geometric_normal.dot(illumination.to_light);
        let f_p = p.brdf.eval(to_q, p.normal, receiver.to_camera);
        let scale = p.normal.dot(to_q) * area_to_angle / (from_p + from_light);
        let length = illumination.length + distance + receiver.distance;
        Some((f_p * radiance * scale, illumination, length))
    }

    /// Radiance of a surface towards a unit direction, from an unobstructed light: f · L_{L→P} · cosθ. `None` where it is 0.
    fn reflected(
        &self,
        emitter: &Emitter,
        surface: &Surface,
        to_viewer: DVec3,
    ) -> Option<(DVec3, Illumination)> {
        let illumination = emitter.illuminate(surface.position)?;
        let to_light = illumination.to_light;
        if surface.brdf.is_black() || !is_above(surface, to_light) {
            return None;
        }
        let f = surface.brdf.eval(to_light, surface.normal, to_viewer);
        let cosine = surface.normal.dot(to_light);
        Some((f * illumination.facing * cosine, illumination))
    }

    /// V(L,P)
    fn is_lit(&self, surface: &Surface, illumination: &Illumination) -> bool {
        self.is_free(&Ray {
            end: illumination.distance,
            from_triangle: surface.triangle,
            ..Ray::half_line(surface.start(), illumination.to_light)
        })
    }

    /// V(P,Q)
    fn is_between_free(&self, p: &Surface, q: &Surface) -> bool {
        let (start, end) = (p.start(), q.start());
        self.is_free(&Ray {
            end: 1.0,
            from_triangle: p.triangle,
            to_triangle: q.triangle,
            ..Ray::half_line(start, end - start)
        })
    }

    fn is_free(&self, ray: &Ray) -> bool {
        self.triangles.is_free(ray, |hit| self.surfaces.is_at(hit))
    }
}

/// Whether a direction is on the surface's side, for both of its normals.
fn is_above(surface: &Surface, direction: DVec3) -> bool {
    surface.normal.dot(direction) > 0.0 && surface.geometric_normal.dot(direction) > 0.0
}
