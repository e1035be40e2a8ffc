//! Converts images on the device to the frame's layers.

use glam::DVec3;

use super::{
    BufferPool, DrawnFrame, FrameImages,
    seen_triangles::{Numbering, shows_triangles},
};
use crate::{
    Error, LocalSpace, Result,
    model::Phasor,
    output::{
        FrameDescription, FrameParts, Layer, LayerData, PixelPhasors, SensorReadout, TofCamera,
        WantedLayers, per_pixel, pixels_of_a_thread,
    },
    parallel::for_each_at_once,
    passes::Context,
    plan::{Plan, TofPlan},
    scene::{Camera, TimeOfFlight},
    vulkan::{DeviceLimits, Image, Readback},
};

/// Images of a frame that are no larger together are copied to the host at once: for larger ones, waiting for each takes little of the time.
const MAX_BYTES_AT_ONCE: u64 = 1 << 26;
const PIXEL_BYTES: u64 = 16;

/// Bytes of images that are copied to the host at once, on a device with these limits, and bytes of the buffer for them.
pub(super) fn buffer_bytes(plan: &Plan, limits: Option<&DeviceLimits>) -> u64 {
    let others = [
        plan.indirect.is_some(),
        plan.has_stderr_layer(),
        plan.joule_per_irradiance.is_some(),
        plan.is_emissive,
        plan.pixel_sampling.is_some(),
    ];
    // Those of every frame: positions, materials, normals and direct light.
    let count = 4 + others.into_iter().filter(|&is_there| is_there).count() as u64;
    let phasor_layers =
        plan.tof.map_or(0, TofPlan::pair_count) + plan.bounced_tof().map_or(0, TofPlan::pair_count);
    let pixels: u64 = plan.resolution_px.map(u64::from).iter().product();
    let phasors = u64::from(phasor_layers) * pixels * PIXEL_BYTES;
    let all = count * pixels * PIXEL_BYTES + phasors;
    match all <= bytes_at_once(limits) {
        true => all,
        // Images of phasors are copied together in any case.
        false => phasors.max(pixels * PIXEL_BYTES),
    }
}

fn bytes_at_once(limits: Option<&DeviceLimits>) -> u64 {
    limits.map_or(MAX_BYTES_AT_ONCE, |limits| {
        let most = limits.max_buffer_bytes.min(limits.max_allocation_bytes);
        most.min(MAX_BYTES_AT_ONCE)
    })
}

/// The image that holds a layer in its first three values, if there is one. That of P is in local space, and has the ids of instances, too.
pub(super) fn image_of(images: &FrameImages, layer: Layer) -> Option<&Image> {
    match layer {
        Layer::Radiance => images.radiance.as_ref(),
        Layer::Direct => Some(&images.direct),
        Layer::Indirect => images.indirect.as_ref(),
        Layer::Emission => images.emission.as_ref(),
        Layer::StandardError => images.indirect_stderr.as_ref(),
        Layer::Energy => images.energy.as_ref(),
        Layer::Position => Some(&images.gbuffer.position_instance),
        Layer::Normal => Some(&images.gbuffer.normal_geometric),
        Layer::Albedo => Some(&images.gbuffer.kd_material),
        _ => None,
    }
}

/// Layers that are copies of their images.
const COPIED: [Layer; 4] = [
    Layer::StandardError,
    Layer::Energy,
    Layer::Normal,
    Layer::Albedo,
];

/// The images of a frame that its layers are made from, or those of a list.
struct NeededImages<'i> {
    position_instance: Option<&'i Image>,
    footprints: Option<&'i Image>,
    kd_material: Option<&'i Image>,
    /// For the normal in the camera's axes.
    normal: Option<&'i Image>,
    triangles: Option<&'i Image>,
    direct: Option<&'i Image>,
    indirect: Option<&'i Image>,
    emission: Option<&'i Image>,
    copied: Vec<(Layer, &'i Image)>,
    /// Direct and indirect, of time of flight.
    phasors: [Option<&'i Image>; 2],
    has_radiance: bool,
}

impl<'i> NeededImages<'i> {
    fn new(images: &'i FrameImages, wanted: Option<&[Layer]>) -> NeededImages<'i> {
        let is_wanted = |layer: Layer| layer.is_among(wanted);
        let is_any_wanted = |layers: &[Layer]| layers.iter().any(|&layer| is_wanted(layer));
        let is_of_tof = |layer: &Layer| matches!(layer, Layer::HalfPath | Layer::Tof(..));
        let has_tof = images.direct_phasors.is_some()
            && wanted.is_none_or(|wanted| wanted.iter().any(is_of_tof));
        let has_geometry = has_tof || is_any_wanted(&Geometry::LAYERS);
        let has_radiance = has_tof || is_wanted(Layer::Radiance);
        let has_depths = is_any_wanted(&[Layer::MeanDepth, Layer::NearestDepth]);
        let gbuffer = &images.gbuffer;
        let sampled = images.sampled.as_ref().filter(|_| has_depths);
        let of_light = |layer| image_of(images, layer).filter(|_| has_radiance || is_wanted(layer));
        let counts_electrons = is_any_wanted(&SensorReadout::LAYERS);
        let is_needed = |layer| is_wanted(layer) || layer == Layer::Energy && counts_electrons;
        let copied = COPIED.into_iter().filter(|&layer| is_needed(layer));
        let phasors = [&images.direct_phasors, &images.indirect_phasors];
        NeededImages {
            position_instance: has_geometry.then_some(&gbuffer.position_instance),
            footprints: sampled.map(|sampled| &sampled.footprint),
            kd_material: is_wanted(Layer::MaterialId).then_some(&gbuffer.kd_material),
            normal: is_wanted(Layer::CameraNormal).then_some(&gbuffer.normal_geometric),
            triangles: gbuffer
                .triangles
                .as_ref()
                .filter(|_| shows_triangles(wanted)),
            direct: of_light(Layer::Direct),
            indirect: of_light(Layer::Indirect),
            emission: of_light(Layer::Emission),
            copied: copied
                .filter_map(|layer| Some((layer, image_of(images, layer)?)))
                .collect(),
            phasors: phasors.map(|image| image.as_ref().filter(|_| has_tof)),
            has_radiance,
        }
    }

    fn all(&self) -> Vec<&'i Image> {
        let all = [
            self.position_instance,
            self.footprints,
            self.kd_material,
            self.normal,
            self.triangles,
            self.direct,
            self.indirect,
            self.emission,
        ];
        let copied = self.copied.iter().map(|(_, image)| *image);
        let made = all.into_iter().chain(self.phasors).flatten();
        let mut needed: Vec<&Image> = Vec::new();
        for image in made.chain(copied) {
            if needed.iter().all(|other| !std::ptr::eq(*other, image)) {
                needed.push(image);
            }
        }
        needed
    }
}

/// Records the copies of all images that the wanted layers need. If they are too large, they are copied later, one by one.
pub(super) fn record(context: &Context, images: &FrameImages) -> Result<()> {
    let mut readback = context.readback.borrow_mut();
    let needed = NeededImages::new(images, context.layers).all();
    let limits = &context.device.info().limits;
    let at_once = Readback::bytes(&needed) <= bytes_at_once(Some(limits));
    let needed = if at_once { needed } else { Vec::new() };
    context.record(|recorder| readback.record(recorder, &needed))
}

/// Reads the layers of a frame, or those of a list, into buffers of a pool where they fit. Images that no layer needs are not read.
pub(crate) fn read_layers(
    readback: &mut Readback,
    drawn: &DrawnFrame,
    mut pool: BufferPool,
    wanted: Option<&[Layer]>,
) -> Result<Vec<(Layer, LayerData)>> {
    let DrawnFrame {
        images,
        space,
        geometry: scene_geometry,
        description,
        ..
    } = drawn;
    let is_wanted = |layer: Layer| layer.is_among(wanted);
    let NeededImages {
        position_instance,
        footprints,
        kd_material,
        normal,
        triangles,
        direct,
        indirect,
        emission,
        copied,
        phasors,
        has_radiance,
    } = NeededImages::new(images, wanted);
    let tof = TofCamera::of(description).filter(|_| phasors[0].is_some());

    let (mut geometry, mut paths) = (None, None);
    if let Some(position_instance) = position_instance {
        let pixels = readback.pixels(position_instance)?;
        let camera = &description.camera;
        let mut wanted_geometry = Geometry::LAYERS.into_iter().filter(|&l| is_wanted(l));
        let only_ids = !wanted_geometry.any(|layer| layer != Layer::InstanceId);
        geometry = Some(match only_ids {
            true => Geometry::of_ids(pixels, &mut pool),
            false => Geometry::of(pixels, camera, space, &mut pool),
        });
        paths = tof.map(|camera| Paths::of(pixels, description, camera.tof, space));
    }
    if let (Some(paths), true) = (&mut paths, images.sampled.is_some()) {
        // With samples, the phasors already contain each sample's own path to C.
        paths.to_camera_m.fill(0.0);
    }

    let footprints = footprints.map(|image| readback.pixels(image));
    let depths = footprints
        .transpose()?
        .map(|pixels| sample_depths(pixels, space));
    let (mean_depth, nearest_depth) = depths.unzip();

    let material_ids = kd_material.map(|image| {
        let pixels = readback.pixels(image)?;
        let mut ids = pool.ids(pixels.len());
        per_pixel(&mut ids, |i| [pixels[i][3] as u32]);
        Ok::<_, Error>(ids)
    });
    let material_ids = material_ids.transpose()?;
    let camera_normals = normal.map(|image| {
        let pixels = readback.pixels(image)?;
        let axes = description.camera.basis().matrix();
        let mut normals = pool.floats(3 * pixels.len());
        per_pixel(&mut normals, |i| {
            let [x, y, z, _] = pixels[i].map(f64::from);
            (axes.transpose() * DVec3::new(x, y, z))
                .as_vec3()
                .to_array()
        });
        Ok::<_, Error>(normals)
    });
    let camera_normals = camera_normals.transpose()?;
    let seen_triangles = match (triangles, scene_geometry) {
        (Some(image), Some(geometry)) => {
            let is_by_rays = images.key.is_seen_by_rays;
            let numbering = Numbering::new(geometry, is_by_rays);
            numbering.layers(readback.pixels(image)?, &is_wanted, &mut pool)
        }
        _ => Vec::new(),
    };
    // The usual layer, alone: one sum of what was copied, without layers in between.
    let mut alone = None;
    if let (true, Some(direct), Some(indirect), None) = (has_radiance, direct, indirect, emission)
        && !is_wanted(Layer::Direct)
        && !is_wanted(Layer::Indirect)
        && let (Ok(direct), Ok(indirect)) = (readback.copied(direct), readback.copied(indirect))
    {
        let radiance = alone.insert(pool.floats(3 * direct.len()));
        per_pixel(radiance, |i| {
            [0, 1, 2].map(|band| direct[i][band] + indirect[i][band])
        });
    }
    let [direct, indirect] = [direct, indirect].map(|image| image.filter(|_| alone.is_none()));
    let mut copy = |image: &Image| -> Result<Vec<f32>> {
        let pixels = readback.pixels(image)?;
        let mut values = pool.floats(3 * pixels.len());
        per_pixel(&mut values, |i| {
            let [r, g, b, _] = pixels[i];
            [r, g, b]
        });
        Ok(values)
    };
    let mut layers = Vec::new();
    for (layer, image) in copied {
        layers.push((layer, LayerData::Float(copy(image)?)));
    }
    let direct = direct.map(&mut copy).transpose()?;
    let indirect = indirect.map(&mut copy).transpose()?;
    let emission = emission.map(&mut copy).transpose()?;
    let radiance = direct.as_ref().filter(|_| has_radiance).map(|direct| {
        let mut radiance = pool.floats(direct.len());
        match (&indirect, &emission) {
            (None, None) => radiance.copy_from_slice(direct),
            (Some(other), None) | (None, Some(other)) => {
                per_pixel(&mut radiance, |i| [direct[i] + other[i]]);
            }
            (Some(indirect), Some(emission)) => {
                per_pixel(&mut radiance, |i| [direct[i] + indirect[i] + emission[i]]);
            }
        }
        radiance
    });
    let radiance = radiance.or(alone);

    for (layer, values) in [
        (Layer::Radiance, radiance),
        (Layer::Direct, direct),
        (Layer::Indirect, indirect),
        (Layer::Emission, emission),
        (Layer::MeanDepth, mean_depth),
        (Layer::NearestDepth, nearest_depth),
        (Layer::CameraNormal, camera_normals),
    ] {
        layers.extend(values.map(|values| (layer, LayerData::Float(values))));
    }
    layers.extend(geometry.into_iter().flat_map(Geometry::layers));
    layers.extend(seen_triangles);
    layers.extend(material_ids.map(|ids| (Layer::MaterialId, LayerData::Id(ids))));
    if let Some(readout) = SensorReadout::of(description) {
        let energies = layers.iter().find_map(|(layer, data)| match data {
            LayerData::Float(values) if *layer == Layer::Energy => Some(&values[..]),
            _ => None,
        });
        let mut wanted = WantedLayers {
            is_wanted: &is_wanted,
            floats: &mut |values| pool.floats(values),
        };
        let read = readout.layers(energies.unwrap_or_default(), &mut wanted);
        layers.extend(read);
    }
    layers.sort_by_key(|(layer, _)| *layer);
    if let (Some(tof), Some(paths)) = (tof, paths) {
        let both: Vec<&Image> = phasors.into_iter().flatten().collect();
        readback.copy_missing(&both)?;
        let texels = |image: Option<&Image>| image.map_or(Ok(&[][..]), |i| readback.copied(i));
        let [direct, indirect] = phasors.map(texels);
        let parts = FrameParts {
            has_sensor: true,
            counted: None,
            has_indirect: images.indirect.is_some(),
            bounces: 1,
            has_emission: false,
            has_samples: false,
            has_stderr: false,
            tof: FrameParts::of_tof(Some(tof.tof)),
        };
        let mut wanted = WantedLayers {
            is_wanted: &|layer| is_wanted(layer) && layer.is_made_with(parts),
            floats: &mut |values| pool.floats(values),
        };
        add_time_of_flight(&mut layers, tof, &paths, direct?, indirect?, &mut wanted);
    }
    layers.retain(|(layer, _)| is_wanted(*layer));
    Ok(layers)
}

/// Mean and least depth of each pixel's samples, metres, from the footprints of the pixel_filter pass.
fn sample_depths(footprints: &[[f32; 4]], space: &LocalSpace) -> (Vec<f32>, Vec<f32>) {
    let in_metres = |depth: f64| (depth * space.metres_per_unit) as f32;
    let depths = footprints
        .iter()
        .map(|&[sum, nearest, count, _]| match count {
            0.0 => (f32::INFINITY, f32::INFINITY),
            _ => {
                let mean = f64::from(sum) / f64::from(count);
                (in_metres(mean), in_metres(nearest.into()))
            }
        });
    depths.unzip()
}

/// Path lengths of each pixel for time of flight. They are f64: a wavelength of modulation may be much shorter than the scene.
struct Paths {
    /// |PC|, along the ray; 0 for the background.
    to_camera_m: Vec<f64>,
    /// Half of |LP| + |PC| for the nearest modulated light; infinite for the background.
    half_m: Vec<f64>,
}

impl Paths {
    fn of(
        positions: &[[f32; 4]],
        description: &FrameDescription,
        tof: &TimeOfFlight,
        space: &LocalSpace,
    ) -> Paths {
        let lights = description.lights.iter().enumerate();
        let modulated: Vec<DVec3> = lights
            .filter(|(light, _)| tof.is_modulated(*light))
            .filter_map(|(_, light)| light.position_m())
            .collect();
        let camera = &description.camera;
        let mut lengths = vec![[0.0; 2]; positions.len()];
        per_pixel(&mut lengths, |i| {
            let [x, y, z, instance_id] = positions[i];
            if instance_id == 0.0 {
                return [[0.0, f64::INFINITY]];
            }
            let p_m = space.to_world([x, y, z]);
            let to_camera_m = camera.range_to(p_m - camera.position_m);
            let to_lights_m = modulated.iter().map(|light_m| p_m.distance(*light_m));
            let half_m = 0.5 * (to_camera_m + to_lights_m.fold(f64::INFINITY, f64::min));
            [[to_camera_m, half_m]]
        });
        let (to_camera_m, half_m) = lengths.iter().map(|&[to, half]| (to, half)).unzip();
        Paths {
            to_camera_m,
            half_m,
        }
    }
}

/// Adds the layers of time of flight. The phasors, direct and indirect, lack the paths `to_camera_m`.
fn add_time_of_flight(
    layers: &mut Vec<(Layer, LayerData)>,
    camera: TofCamera,
    paths: &Paths,
    direct: &[[f32; 4]],
    indirect: &[[f32; 4]],
    wanted: &mut WantedLayers,
) {
    let tof = camera.tof;
    let count = paths.half_m.len();
    let radiance = layers.iter().find_map(|(layer, data)| match data {
        LayerData::Float(values) if *layer == Layer::Radiance => Some(values),
        _ => None,
    });
    let (radiance, _) = radiance.map_or(&[][..], |values| values).as_chunks::<3>();
    let seen = |bands: &[f32; 3]| tof.weighted(bands.map(f64::from));
    let mut radiances = vec![0.0; count];
    per_pixel(&mut radiances, |i| [radiance.get(i).map_or(0.0, seen)]);
    let mut half_paths = (wanted.floats)(count);
    per_pixel(&mut half_paths, |i| [paths.half_m[i] as f32]);
    layers.push((Layer::HalfPath, LayerData::Float(half_paths)));
    let lens_factors = camera.lens_factors(count);
    for (frequency, &frequency_hz) in tof.frequencies_hz.iter().enumerate() {
        let at = count * (frequency / 2);
        // If no bounce is modulated, there is no image of its phasors.
        let (direct, indirect) = (&direct[at..], indirect.get(at..).unwrap_or_default());
        let own = |pixel: [f32; 4]| {
            let [re, im] = match (frequency % 2, pixel) {
                (0, [re, im, ..]) | (_, [.., re, im]) => [re, im].map(f64::from),
            };
            Phasor { re, im }
        };
        let mut pixels = vec![PixelPhasors::default(); count];
        per_pixel(&mut pixels, |i| {
            let way_to_camera = Phasor::of_path(1.0, paths.to_camera_m[i], frequency_hz);
            [PixelPhasors {
                direct: own(direct[i]) * way_to_camera,
                indirect: own(indirect.get(i).copied().unwrap_or_default()) * way_to_camera,
            }]
        });
        let half_m = &paths.half_m;
        layers.extend(camera.layers(
            frequency,
            &pixels,
            &radiances,
            half_m,
            &lens_factors,
            wanted,
        ));
    }
}

/// What the image of positions and instance ids holds: P in the world and in the camera's axes, its distances from the camera (m), and ids.
struct Geometry {
    position: Vec<f32>,
    in_camera: Vec<f32>,
    depth: Vec<f32>,
    range: Vec<f32>,
    instance_ids: Vec<u32>,
}

impl Geometry {
    const LAYERS: [Layer; 5] = [
        Layer::Position,
        Layer::CameraPosition,
        Layer::Depth,
        Layer::Range,
        Layer::InstanceId,
    ];

    fn layers(self) -> [(Layer, LayerData); 5] {
        let float = LayerData::Float;
        [
            (Layer::Position, float(self.position)),
            (Layer::CameraPosition, float(self.in_camera)),
            (Layer::Depth, float(self.depth)),
            (Layer::Range, float(self.range)),
            (Layer::InstanceId, LayerData::Id(self.instance_ids)),
        ]
    }

    /// The ids alone.
    fn of_ids(pixels: &[[f32; 4]], pool: &mut BufferPool) -> Geometry {
        let mut instance_ids = pool.ids(pixels.len());
        per_pixel(&mut instance_ids, |i| [pixels[i][3] as u32]);
        Geometry {
            position: Vec::new(),
            in_camera: Vec::new(),
            depth: Vec::new(),
            range: Vec::new(),
            instance_ids,
        }
    }

    fn of(
        pixels: &[[f32; 4]],
        camera: &Camera,
        space: &LocalSpace,
        pool: &mut BufferPool,
    ) -> Geometry {
        let count = pixels.len();
        let mut geometry = Geometry {
            position: pool.floats(3 * count),
            in_camera: pool.floats(3 * count),
            depth: pool.floats(count),
            range: pool.floats(count),
            instance_ids: pool.ids(count),
        };
        // Differences are taken in local space: in world space they could cancel.
        let camera_local = (camera.position_m - space.origin_m) / space.metres_per_unit;
        let basis = camera.basis();
        let share = pixels_of_a_thread(count);
        let parts = pixels
            .chunks(share)
            .zip(geometry.position.chunks_mut(3 * share))
            .zip(geometry.in_camera.chunks_mut(3 * share))
            .zip(geometry.depth.chunks_mut(share))
            .zip(geometry.range.chunks_mut(share))
            .zip(geometry.instance_ids.chunks_mut(share));
        for_each_at_once(
            parts,
            |(((((pixels, position), in_camera), depth), range), instance_ids)| {
                let (position, _) = position.as_chunks_mut::<3>();
                let (in_camera, _) = in_camera.as_chunks_mut::<3>();
                for (i, &[x, y, z, instance_id]) in pixels.iter().enumerate() {
                    instance_ids[i] = instance_id as u32;
                    if instance_id == 0.0 {
                        position[i] = [0.0; 3];
                        in_camera[i] = [0.0; 3];
                        depth[i] = f32::INFINITY;
                        range[i] = f32::INFINITY;
                        continue;
                    }
                    let offset = DVec3::from([x, y, z].map(f64::from)) - camera_local;
                    position[i] = space.to_world([x, y, z]).as_vec3().to_array();
                    let along =
                        [basis.right, basis.down, basis.forward].map(|axis| offset.dot(axis));
                    in_camera[i] = along.map(|units| (units * space.metres_per_unit) as f32);
                    depth[i] = in_camera[i][2];
                    range[i] = match camera.is_orthographic() {
                        true => depth[i],
                        false => (offset.length() * space.metres_per_unit) as f32,
                    };
                }
            },
        );
        geometry
    }
}
