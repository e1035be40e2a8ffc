//! The true indirect light, path-sampled on the CPU in f64. The engine's images are measured against it.
//!
//! It shares the scene with the rest of the engine and, for time of flight, e^{iφ} and the quantities derived from phasors. It shares
//! nothing else with the shaders, the f64 kernels and the rasteriser: it traces rays through a tree of boxes instead of maps and has its
//! own BRDF, lights and camera. The scene is moved to the origin and scaled to a size of about 1, exactly, so that scenes of 1 mm and of
//! 10 km are computed alike.

mod brdf;
mod draws;
mod edge;
mod emissive;
mod footprint;
mod goal;
mod light;
mod path;
mod pixel;
mod placed;
mod pooling;
mod rays;
mod surface;
mod texture;
mod view_ray;

use std::{ops::ControlFlow, path::Path, time::Instant};

use glam::DVec3;
use rayon::prelude::*;

pub use self::goal::Goal;
use self::{
    footprint::DIRECT_SAMPLES,
    path::Transport,
    pixel::{Moments, Pixel},
    pooling::Pooling,
};
use crate::{
    Error, Result, Scene,
    output::{
        Frame, FrameDescription, FrameStats, Layer, LayerData, LayeredImage, PixelPhasors,
        ReferenceSamples, TofCamera, TofQuantity, WantedLayers,
    },
    scene::{
        Bands, Camera, ChargeUnit, Direct, FinalGather, IndirectLight, PixelSampling, TimeOfFlight,
    },
};

/// Paths between two calls of the progress function: a fifth of a second on two cores.
const PATHS_PER_STEP: usize = 1 << 20;

/// A path-sampled image that can be refined without limit.
///
/// Direct light needs no samples if pixels and lights are points; if the camera averages over pixels, it uses 1 024. Indirect light is the
/// mean of rounds. In each round, a pixel gets the points of an Owen-scrambled Sobol' net, which cover the directions evenly. Rounds are
/// independent, so their spread, together with that of the surrounding pixels, gives the standard error of each pixel.
#[derive(Debug)]
pub struct Reference {
    scene: Scene,
    transport: Transport,
    pixels: Vec<Pixel>,
    samples_per_round: u32,
    rounds: u32,
    paths: u64,
    /// Number of the first round; its random numbers depend on it.
    first_round: u32,
    wall_milliseconds: f64,
}

impl Reference {
    /// Finds what each pixel sees and computes its direct light. There is no indirect light before the first round. The number of samples
    /// of a round is a power of two, at most 65 536; other numbers are rounded up. [`Reference::start`] chooses it.
    ///
    /// # Errors
    /// [`Error::Scene`] for an invalid scene, [`Error::Memory`] for an image that is too large.
    pub fn new(scene: &Scene, samples_per_round: u32) -> Result<Reference> {
        scene.validate()?;
        let scene = scene.in_world();
        let start = Instant::now();
        // The engine's method does not change the ground truth, but for the number of bounces. The hash has it, too.
        let bounces = bounces_of(&scene);
        let more = (bounces > 1).then_some(FinalGather {
            bounces,
            ..FinalGather::DEFAULT
        });
        let scene = Scene {
            direct: Direct::default(),
            indirect: more.map(IndirectLight::FinalGather),
            camera: Camera {
                pixel_sampling: scene.camera.pixel_sampling.map(|sampling| PixelSampling {
                    samples: DIRECT_SAMPLES,
                    ..sampling
                }),
                ..scene.camera
            },
            sensor: scene.sensor.filter(|_| scene.tof.is_some()),
            vignetting_map: scene.vignetting_map.clone().filter(|_| scene.tof.is_some()),
            tof: scene.tof.clone().map(|tof| TimeOfFlight {
                output: ChargeUnit::Electrons,
                noise: None,
                ..tof
            }),
            ..scene.into_owned()
        };
        let transport = Transport::new(&scene);
        let [width, height] = scene.camera.resolution_px;
        let count = width as usize * height as usize;
        let mut pixels = Vec::new();
        pixels.try_reserve_exact(count).map_err(|_| Error::Memory {
            what: format!("a reference of {width} x {height} pixels"),
            bytes: (count as u64).saturating_mul(size_of::<Pixel>() as u64),
            problem: "there is not enough host memory".into(),
        })?;
        pixels.par_extend((0..count).into_par_iter().map(|index| {
            let (x, y) = (index % width as usize, index / width as usize);
            Pixel::new(&transport, x as f64 + 0.5, y as f64 + 0.5)
        }));
        Ok(Reference {
            scene,
            transport,
            pixels,
            samples_per_round: samples_per_round.clamp(1, 1 << 16).next_power_of_two(),
            rounds: 0,
            paths: 0,
            first_round: 0,
            wall_milliseconds: start.elapsed().as_secs_f64() * 1e3,
        })
    }

    /// The same reference with other random numbers; call it before the first round. References with different seeds are independent.
    /// [`Reference::new`] uses seed 0, and so do rounds added to a file.
    pub fn with_seed(self, seed: u16) -> Reference {
        Reference {
            first_round: u32::from(seed) << 16,
            ..self
        }
    }

    /// Widens the pixels on [edges](Layer::Edge) for a device that rasterises more coarsely than the usual 8 bits of a pixel:
    /// [`DeviceLimits::sub_pixel_bits`](crate::DeviceLimits::sub_pixel_bits).
    pub fn with_sub_pixel_bits(mut self, bits: u32) -> Reference {
        if bits >= edge::SUB_PIXEL_BITS {
            return self;
        }
        let width = self.scene.camera.resolution_px[0] as usize;
        let transport = &self.transport;
        let pixels = self.pixels.par_iter_mut().enumerate();
        pixels.for_each(|(index, pixel)| {
            let (x, y) = (index % width, index / width);
            pixel.mark_edge(transport, [x as f64 + 0.5, y as f64 + 0.5], bits);
        });
        self
    }

    /// Continues from a file with the image of a [`Reference::frame`]: further rounds add to those of the file.
    ///
    /// The file holds f32, so the result equals an uninterrupted run up to 1e-7 of a value.
    ///
    /// # Errors
    /// [`Error::Scene`] for an invalid scene, [`Error::Input`] for a file that cannot be read or holds no reference of this scene.
    pub fn resume(scene: &Scene, file: &Path) -> Result<Reference> {
        let image = LayeredImage::read(file)?;
        let refuse = |problem: String| Error::Input {
            at: file.display().to_string(),
            problem,
            hint: "name another file, or remove this one to begin again".into(),
        };
        let count = |name: &str| {
            let text = image.attribute(name)?;
            text.parse::<u32>().ok()
        };
        let samples_per_round = count("camlux.samples_per_round").unwrap_or(0);
        if !samples_per_round.is_power_of_two() {
            return Err(refuse("it does not hold a reference".into()));
        }
        let mut reference = Reference::new(scene, samples_per_round)?;
        // Files without the number are older than it.
        let bounces = [count("camlux.bounces").unwrap_or(1), bounces_of(scene)];
        if bounces[0] != bounces[1] {
            return Err(refuse(format!(
                "its bounces are up to {}, and those of the scene up to {}",
                bounces[0], bounces[1]
            )));
        }
        let hash = image.attribute("camlux.scene_hash");
        if hash != Some(reference.scene.hash().as_str()) {
            return Err(refuse(
                "it holds the reference of another scene, or of another resolution".into(),
            ));
        }
        let samples = count("camlux.samples_per_pixel").unwrap_or_default();
        let values = |layer: Layer| {
            let values = image.values(layer);
            let due = layer.channel_names().len() * reference.pixels.len();
            let has_all =
                |values: &&[f32]| values.len() == due && values.iter().all(|v| v.is_finite());
            values
                .filter(has_all)
                .ok_or_else(|| refuse(format!("its layer {} is missing or damaged", layer.name())))
        };
        let rounds = samples / samples_per_round;
        let is_sampled = reference.is_sampled();
        let moments = |mean: Layer, standard_error: Layer| -> Result<Vec<[Moments; 3]>> {
            let channels = mean.channel_names().len();
            let mean = vectors_of(values(mean)?, channels);
            let variance = match rounds {
                0 | 1 => vec![DVec3::ZERO; mean.len()],
                _ => {
                    let standard_error = vectors_of(values(standard_error)?, channels);
                    let pooled: Vec<DVec3> = standard_error.iter().map(|s| s * s).collect();
                    reference.pooling(&is_sampled, rounds).own(&pooled)
                }
            };
            let pixels = mean.iter().zip(variance);
            let of_pixel = |(mean, variance): (&DVec3, DVec3)| {
                std::array::from_fn(|i| Moments::from_mean(mean[i], variance[i], rounds))
            };
            Ok(pixels.map(of_pixel).collect())
        };
        let indirect = moments(Layer::Indirect, Layer::StandardError)?;
        let frequencies = 0..reference.transport.frequency_count();
        let phasors = frequencies.map(|f| {
            let layer = |quantity| Layer::Tof(f as u8, quantity);
            moments(
                layer(TofQuantity::PhasorIndirect),
                layer(TofQuantity::PhasorStandardError),
            )
        });
        let phasors = phasors.collect::<Result<Vec<_>>>()?;
        for (i, pixel) in reference.pixels.iter_mut().enumerate() {
            pixel.indirect = indirect[i];
            let of_frequency = |phasors: &Vec<[Moments; 3]>| [phasors[i][0], phasors[i][1]];
            pixel.indirect_phasors = phasors.iter().map(of_frequency).collect();
        }
        reference.rounds = rounds;
        Ok(reference)
    }

    /// Number of independent rounds so far.
    pub fn rounds(&self) -> u32 {
        self.rounds
    }

    /// Samples of the indirect light in each pixel so far.
    pub fn samples_per_pixel(&self) -> u32 {
        self.rounds.saturating_mul(self.samples_per_round)
    }

    /// Light paths so far, without those of a file that was continued. From each vertex of a sample, one goes on from the vertex and one
    /// begins at each light. Each takes two rays: one to the next surface, and one to test whether light gets through.
    pub fn paths(&self) -> u64 {
        self.paths
    }

    /// Whether no sample has found indirect light so far.
    fn has_no_indirect_light(&self) -> bool {
        let values = self.pixels.iter().flat_map(|pixel| pixel.indirect);
        self.rounds > 0 && values.into_iter().all(|moments| moments.mean == 0.0)
    }

    /// Estimate of the indirect image's own relRMSE: sqrt(Σσ²/Σt²), with the noise in Σt² subtracted. It is the largest of the values for
    /// the radiance and for the phasors of each frequency. `None` before there are two rounds, and for a scene whose indirect light is
    /// black.
    pub fn relative_standard_error(&self) -> Option<f64> {
        if self.rounds < 2 {
            return None;
        }
        let relative = |moments: &dyn Fn(&Pixel) -> [Moments; 3]| {
            let pixels = self.pixels.iter().zip(self.variances(moments));
            let (variance, square) = pixels.fold((0.0, 0.0), |(sum, square), (pixel, variance)| {
                let mean = DVec3::from(moments(pixel).map(|moments| moments.mean));
                let own = variance.element_sum();
                (sum + own, square + mean.length_squared() - own)
            });
            (square > 0.0).then(|| (variance / square).sqrt())
        };
        let of_bands = relative(&|pixel| pixel.indirect)?;
        let frequencies = 0..self.transport.frequency_count();
        let of_phasors = frequencies.filter_map(|f| relative(&|pixel| pixel.phasor_moments(f)));
        Some(of_phasors.fold(of_bands, f64::max))
    }

    /// Squares of the standard errors of three means, available from two rounds on.
    fn variances(&self, moments: &dyn Fn(&Pixel) -> [Moments; 3]) -> Vec<DVec3> {
        let variance = |moments: Moments| moments.variance_of_mean(self.rounds);
        let pixels = self.pixels.iter();
        let own: Vec<DVec3> = pixels
            .map(|pixel| moments(pixel).map(variance).into())
            .collect();
        let is_sampled = self.is_sampled();
        self.pooling(&is_sampled, self.rounds).pooled(&own)
    }

    fn pooling<'a>(&self, is_sampled: &'a [bool], rounds: u32) -> Pooling<'a> {
        let [width, _] = self.scene.camera.resolution_px;
        Pooling::new(width as usize, is_sampled, rounds)
    }

    fn is_sampled(&self) -> Vec<bool> {
        let pixels = self.pixels.iter();
        pixels.map(Pixel::is_sampled).collect()
    }

    /// Adds a round to every pixel, and reports its progress, 0 to 1. The image does not depend on the number of threads.
    ///
    /// # Errors
    /// [`Error::Cancelled`] when `progress` breaks: the image then stays as before the round.
    pub fn add_round(&mut self, progress: &mut dyn FnMut(f32) -> ControlFlow<()>) -> Result<()> {
        let start = Instant::now();
        let (round, samples) = (self.first_round + self.rounds, self.samples_per_round);
        let transport = &self.transport;
        let mut means = Vec::with_capacity(self.pixels.len());
        let most_paths = samples as usize * self.transport.most_paths() as usize;
        let pixels_per_step = (PATHS_PER_STEP / most_paths).max(1);
        for pixels in self.pixels.chunks(pixels_per_step) {
            let first = means.len();
            means.par_extend(pixels.par_iter().enumerate().map(|(i, pixel)| {
                pixel.sample_round(transport, samples, (first + i) as u32, round)
            }));
            let fraction = means.len() as f32 / self.pixels.len() as f32;
            if progress(fraction).is_break() {
                return Err(Error::Cancelled);
            }
        }
        self.rounds += 1;
        for (pixel, (mean, paths)) in self.pixels.iter_mut().zip(means) {
            pixel.add_round(&mean, self.rounds);
            self.paths += paths;
        }
        self.wall_milliseconds += start.elapsed().as_secs_f64() * 1e3;
        Ok(())
    }

    /// The image so far: the layers of a rendered frame, the pixels on edges and, from two rounds on, the standard error of the indirect
    /// light.
    pub fn frame(&self) -> Frame {
        let indirect = |pixel: &Pixel| pixel.indirect.map(|moments| moments.mean);
        let radiance = |pixel: &Pixel| {
            let indirect = indirect(pixel);
            let direct = pixel.direct.radiance.to_array();
            [0, 1, 2].map(|band| direct[band] + indirect[band] + pixel.emission[band])
        };
        let seen = |pixel: &Pixel| pixel.point.as_ref().map(|point| point.surface);
        let position = |pixel: &Pixel| {
            let local = seen(pixel).map(|surface| surface.position);
            local.map_or([0.0; 3], |p| self.transport.to_world_m(p).to_array())
        };
        let in_camera = |pixel: &Pixel| {
            let camera = &self.scene.camera;
            let basis = camera.basis();
            let local = seen(pixel).map(|surface| surface.position);
            local.map_or([0.0; 3], |p| {
                let offset_m = self.transport.to_world_m(p) - camera.position_m;
                [basis.right, basis.down, basis.forward].map(|axis| offset_m.dot(axis))
            })
        };
        let normal = |pixel: &Pixel| seen(pixel).map_or([0.0; 3], |seen| seen.normal.to_array());
        let mut layers = vec![
            (Layer::Radiance, self.floats(radiance)),
            (
                Layer::Direct,
                self.floats(|pixel| pixel.direct.radiance.to_array()),
            ),
            (Layer::Indirect, self.floats(indirect)),
            (Layer::Position, self.floats(position)),
            (Layer::CameraPosition, self.floats(in_camera)),
            (Layer::Normal, self.floats(normal)),
            (Layer::Depth, self.floats(|pixel| [pixel.depth_m])),
            (Layer::Range, self.floats(|pixel| [pixel.range_m])),
            (Layer::InstanceId, self.ids(|pixel| pixel.instance_id)),
            (Layer::MaterialId, self.ids(|pixel| pixel.material_id)),
            (Layer::Edge, self.ids(|pixel| pixel.is_edge.into())),
        ];
        if self.scene.has_emission() {
            let emission = self.floats(|pixel| pixel.emission.to_array());
            layers.insert(3, (Layer::Emission, emission));
        }
        if self.scene.camera.pixel_sampling.is_some() {
            let depths = |pixel: &Pixel| {
                let footprint = pixel.footprint.as_ref();
                footprint.map_or([f64::INFINITY; 2], |(_, seen)| {
                    [seen.mean_depth_m, seen.nearest_depth_m]
                })
            };
            layers.extend([
                (Layer::MeanDepth, self.floats(|pixel| [depths(pixel)[0]])),
                (Layer::NearestDepth, self.floats(|pixel| [depths(pixel)[1]])),
            ]);
        }
        if self.rounds >= 2 {
            let variances = self.variances(&|pixel| pixel.indirect);
            let values = variances.iter().flat_map(|variance| variance.to_array());
            let standard_error = values.map(|variance| variance.sqrt() as f32).collect();
            layers.insert(3, (Layer::StandardError, LayerData::Float(standard_error)));
        }
        let description = FrameDescription {
            reference: Some(ReferenceSamples {
                samples_per_pixel: self.samples_per_pixel(),
                samples_per_round: self.samples_per_round,
                bounces: bounces_of(&self.scene),
            }),
            indirect: None,
            ..FrameDescription::new(&self.scene, self.scene.hash())
        };
        layers.extend(self.tof_layers(&description, &radiance));
        Frame {
            resolution_px: self.scene.camera.resolution_px,
            layers,
            stats: FrameStats {
                device: "CPU".into(),
                driver: "camlux reference, f64".into(),
                wall_milliseconds: self.wall_milliseconds,
                ..FrameStats::default()
            },
            description,
        }
    }

    /// The layers of a time-of-flight camera.
    fn tof_layers(
        &self,
        description: &FrameDescription,
        radiance: &dyn Fn(&Pixel) -> Bands,
    ) -> Vec<(Layer, LayerData)> {
        let Some(camera) = TofCamera::of(description) else {
            return Vec::new();
        };
        let tof = camera.tof;
        let seen = |pixel: &Pixel| tof.weighted(radiance(pixel));
        let radiances: Vec<f64> = self.pixels.iter().map(seen).collect();
        let half_path = |pixel: &Pixel| {
            let point = pixel.point.as_ref();
            point.map_or(f64::INFINITY, |point| {
                0.5 * self.transport.shortest_path_m(point)
            })
        };
        let half_paths_m: Vec<f64> = self.pixels.iter().map(half_path).collect();
        let half_paths = half_paths_m.iter().map(|&half_path_m| half_path_m as f32);
        let mut layers = vec![(Layer::HalfPath, LayerData::Float(half_paths.collect()))];
        let lens_factors = camera.lens_factors(radiances.len());
        let mut wanted = WantedLayers {
            is_wanted: &|layer| !layer.is_on_request(),
            floats: &mut |values| vec![0.0; values],
        };
        for frequency in 0..tof.frequencies_hz.len() {
            let phasors = self.pixels.iter().map(|pixel| PixelPhasors {
                direct: pixel.direct.phasors[frequency],
                indirect: pixel.indirect_phasor(frequency),
            });
            let phasors: Vec<PixelPhasors> = phasors.collect();
            layers.extend(camera.layers(
                frequency,
                &phasors,
                &radiances,
                &half_paths_m,
                &lens_factors,
                &mut wanted,
            ));
            if self.rounds >= 2 {
                let variances = self.variances(&|pixel| pixel.phasor_moments(frequency));
                let values = variances
                    .iter()
                    .flat_map(|variance| [variance.x, variance.y]);
                let values = values.map(|variance| variance.sqrt() as f32).collect();
                let layer = Layer::Tof(frequency as u8, TofQuantity::PhasorStandardError);
                layers.push((layer, LayerData::Float(values)));
            }
        }
        layers
    }

    fn floats<const N: usize>(&self, value: impl Fn(&Pixel) -> [f64; N]) -> LayerData {
        let values = self.pixels.iter().flat_map(value);
        LayerData::Float(values.map(|value| value as f32).collect())
    }

    fn ids(&self, value: impl Fn(&Pixel) -> u32) -> LayerData {
        LayerData::Id(self.pixels.iter().map(value).collect())
    }
}

/// Most surfaces that reflect light before P. The sums have a single one.
fn bounces_of(scene: &Scene) -> u32 {
    let gather = scene.indirect.as_ref().and_then(IndirectLight::gather);
    gather.map_or(1, |gather| gather.bounces)
}

/// Each pixel of a layer of two or three channels; with two, the third is 0.
fn vectors_of(values: &[f32], channels: usize) -> Vec<DVec3> {
    let value = |pixel: &[f32], i: usize| pixel.get(i).copied().map_or(0.0, f64::from);
    let pixels = values.chunks_exact(channels);
    pixels
        .map(|pixel| DVec3::new(value(pixel, 0), value(pixel, 1), value(pixel, 2)))
        .collect()
}
