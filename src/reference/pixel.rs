//! A pixel: what it sees, and the statistics of its samples.

use glam::DVec3;

use super::draws::Draws;
use super::edge::{SUB_PIXEL_BITS, is_edge};
use super::footprint::{Footprint, drawn_px, receiver_at};
use super::path::{AREA_SAMPLES, Arrived, Receiver, Transport};
use super::view_ray::view_ray;
use crate::{model::Phasor, scene::PixelFilter};

/// Seed for the random numbers of the area light points in a pixel's direct light.
const AREA_SEED: u32 = 0x00a2_ea11;

/// One pixel of a reference.
#[derive(Debug, Clone)]
pub struct Pixel {
    /// P; `None`: background.
    pub point: Option<Receiver>,
    /// 1 + index; 0: background.
    pub instance_id: u32,
    pub material_id: u32,
    /// Depth is along the view axis, range along the ray; infinite for the background.
    pub depth_m: f64,
    pub range_m: f64,
    /// Whether [another surface](is_edge) is so near that rounding might show it instead.
    pub is_edge: bool,
    pub direct: Arrived,
    /// W/(sr·m²)
    pub emission: DVec3,
    /// Present if the camera averages over pixels. P and the values after it are still the centre's.
    pub footprint: Option<(PixelFilter, Footprint)>,
    centre_px: [f64; 2],
    /// Statistics over rounds: of the bands, W/sr/m², and of re and im of each phasor.
    pub indirect: [Moments; 3],
    pub indirect_phasors: Vec<[Moments; 2]>,
}

/// Mean and scatter of the rounds' means.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moments {
    pub mean: f64,
    /// Σ(x − mean)² (Welford 1962).
    scatter: f64,
}

impl Moments {
    /// Adds a value, the `count`-th.
    pub fn add(&mut self, value: f64, count: u32) {
        let before = value - self.mean;
        self.mean += before / f64::from(count);
        self.scatter += before * (value - self.mean);
    }

    /// The moments of `count` values with this mean and this variance of the mean. The variance does not matter for fewer than two values.
    pub fn from_mean(mean: f64, variance_of_mean: f64, count: u32) -> Moments {
        let count = f64::from(count.max(1));
        Moments {
            mean,
            scatter: variance_of_mean * count * (count - 1.0),
        }
    }

    /// Square of the mean's standard error; infinite for fewer than two values.
    pub fn variance_of_mean(&self, count: u32) -> f64 {
        if count < 2 {
            return f64::INFINITY;
        }
        let count = f64::from(count);
        self.scatter / (count * (count - 1.0))
    }
}

impl Pixel {
    /// Computes what a point of the image plane shows.
    pub fn new(transport: &Transport, x_px: f64, y_px: f64) -> Pixel {
        let scene = &transport.surfaces.scene;
        let ray = view_ray(&scene.camera, x_px, y_px);
        let hit = ray.and_then(|ray| transport.seen(&ray));
        let is_edge = is_edge(transport, [x_px, y_px], hit.as_ref(), SUB_PIXEL_BITS);
        let footprint = scene.camera.pixel_sampling.map(|sampling| {
            let footprint = Footprint::of(transport, sampling.filter, [x_px, y_px]);
            (sampling.filter, footprint)
        });
        let background = Pixel {
            point: None,
            instance_id: 0,
            material_id: 0,
            depth_m: f64::INFINITY,
            range_m: f64::INFINITY,
            is_edge,
            direct: footprint.map_or_else(Arrived::default, |(_, footprint)| footprint.direct),
            emission: footprint.map_or(DVec3::ZERO, |(_, footprint)| footprint.emission),
            footprint,
            centre_px: [x_px, y_px],
            indirect: [Moments::default(); 3],
            indirect_phasors: vec![Default::default(); transport.frequency_count()],
        };
        let (Some(ray), Some(hit)) = (ray, hit) else {
            return background;
        };
        let direction = ray.direction;
        let surface = transport.surfaces.at(&hit, direction);
        let receiver = Receiver::new(surface, -direction, hit.distance);
        let [mesh, material] = transport.surfaces.mesh_and_material(hit.triangle);
        let range_m = hit.distance * transport.metres_per_unit;
        Pixel {
            point: Some(receiver),
            instance_id: 1 + mesh,
            material_id: 1 + material,
            depth_m: range_m / ray.per_depth,
            range_m,
            emission: match footprint {
                Some((_, footprint)) => footprint.emission,
                None => surface.emission,
            },
            direct: match footprint {
                Some((_, footprint)) => footprint.direct,
                None => {
                    let seed = mix(x_px as u32, mix(y_px as u32, AREA_SEED));
                    transport.direct(&receiver, 0..AREA_SAMPLES, seed)
                }
            },
            ..background
        }
    }

    /// Looks for edges at the distance from the point that a device needs if it rasterises to this number of bits of a pixel.
    pub fn mark_edge(&mut self, transport: &Transport, [x_px, y_px]: [f64; 2], bits: u32) {
        let camera = &transport.surfaces.scene.camera;
        let ray = view_ray(camera, x_px, y_px);
        let hit = ray.and_then(|ray| transport.seen(&ray));
        self.is_edge = is_edge(transport, [x_px, y_px], hit.as_ref(), bits);
    }

    /// Whether the pixel reflects light.
    pub fn is_sampled(&self) -> bool {
        match &self.footprint {
            Some((_, footprint)) => footprint.has_receiver,
            None => self.receiver().is_some(),
        }
    }

    /// P, if it reflects light.
    fn receiver(&self) -> Option<Receiver> {
        self.point.filter(|p| !p.surface.brdf.is_black())
    }

    /// Mean of a round of samples of the indirect radiance, and the number of light paths that they took. It depends only on these
    /// arguments.
    pub fn sample_round(
        &self,
        transport: &Transport,
        samples: u32,
        index: u32,
        round: u32,
    ) -> (Arrived, u64) {
        let mut mean = Arrived::default();
        let mut paths = 0;
        if !self.is_sampled() {
            return (mean, paths);
        }
        let centre = self.receiver();
        let seed = mix(index, round);
        for sample in 0..samples {
            let draws = Draws::new(sample, seed);
            let drawn = |filter: PixelFilter| {
                let at_px = drawn_px(filter, self.centre_px, draws.footprint());
                let (receiver, _) = receiver_at(transport, at_px)?;
                (!receiver.surface.brdf.is_black()).then_some(receiver)
            };
            let receiver = match self.footprint {
                Some((filter, _)) => drawn(filter),
                None => centre,
            };
            let Some(receiver) = receiver else {
                continue;
            };
            let (arrived, taken) = transport.indirect(&receiver, draws);
            mean.add(&arrived, 1.0 / f64::from(samples));
            paths += taken;
        }
        (mean, paths)
    }

    /// Moments of re and im of the indirect light's phasor.
    pub fn phasor_moments(&self, frequency: usize) -> [Moments; 3] {
        let [re, im] = self.indirect_phasors[frequency];
        [re, im, Moments::default()]
    }

    /// Z of the indirect light.
    pub fn indirect_phasor(&self, frequency: usize) -> Phasor {
        let [re, im] = self.indirect_phasors[frequency].map(|moments| moments.mean);
        Phasor { re, im }
    }

    /// Adds the mean of a round, the `count`-th.
    pub fn add_round(&mut self, mean: &Arrived, count: u32) {
        for (moments, mean) in self.indirect.iter_mut().zip(mean.radiance.to_array()) {
            moments.add(mean, count);
        }
        for ([re, im], mean) in self.indirect_phasors.iter_mut().zip(mean.phasors) {
            re.add(mean.re, count);
            im.add(mean.im, count);
        }
    }
}

/// Mixes two numbers well into one: multiplications and shifts with constants of SplitMix64 and MurmurHash3.
pub fn mix(a: u32, b: u32) -> u32 {
    let mut bits = (u64::from(a) << 32 | u64::from(b)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits ^= bits >> 33;
    bits = bits.wrapping_mul(0xff51_afd7_ed55_8ccd);
    bits ^= bits >> 33;
    bits as u32
}
