//! Converts images on the device to the frame's layers.

use glam::DVec3;

use super::{BufferPool, FrameImages};
use crate::{
    Device, Error, LocalSpace, Result,
    model::Phasor,
    output::{
        FrameDescription, FrameParts, Layer, LayerData, PixelPhasors, TofCamera, per_pixel,
        pixels_of_a_thread,
    },
    parallel::for_each_at_once,
    scene::{Camera, TimeOfFlight},
    vulkan::{Image, Readback},
};

/// Reads the layers of a frame, or those of a list, into buffers of a pool where they fit. Images that no layer needs are not read.
pub(crate) fn read_layers(
    device: &Device,
    description: &FrameDescription,
    space: &LocalSpace,
    images: &FrameImages,
    mut pool: BufferPool,
    wanted: Option<&[Layer]>,
) -> Result<Vec<(Layer, LayerData)>> {
    let is_wanted = |layer: Layer| wanted.is_none_or(|wanted| wanted.contains(&layer));
    let is_any_wanted = |layers: &[Layer]| layers.iter().any(|&layer| is_wanted(layer));
    let is_of_tof = |layer: &Layer| matches!(layer, Layer::HalfPath | Layer::Tof(..));
    let has_tof = wanted.is_none_or(|wanted| wanted.iter().any(is_of_tof));
    let tof = description.time_of_flight().filter(|_| has_tof);
    let mut readback = Readback::new(device, images.direct.shape)?;

    let (mut geometry, mut paths) = (None, None);
    if tof.is_some() || is_any_wanted(&Geometry::LAYERS) {
        let pixels = readback.pixels(&images.gbuffer.position_mesh)?;
        let camera = &description.camera;
        geometry = Some(Geometry::of(pixels, camera, space, &mut pool));
        paths = tof.map(|camera| Paths::of(pixels, description, camera.tof, space));
    }
    if let (Some(paths), true) = (&mut paths, images.sampled.is_some()) {
        // With samples, the phasors already contain each sample's own path to C.
        paths.to_camera_m.fill(0.0);
    }

    let footprints = images.sampled.as_ref();
    let footprints = footprints.filter(|_| is_any_wanted(&[Layer::MeanDepth, Layer::NearestDepth]));
    let footprints = footprints.map(|sampled| readback.pixels(&sampled.footprint));
    let depths = footprints
        .transpose()?
        .map(|pixels| sample_depths(pixels, space));
    let (mean_depth, nearest_depth) = depths.unzip();

    let material_ids = is_wanted(Layer::MaterialId).then(|| {
        let pixels = readback.pixels(&images.gbuffer.kd_material)?;
        let mut ids = pool.ids(pixels.len());
        per_pixel(&mut ids, |i| [pixels[i][3] as u32]);
        Ok::<_, Error>(ids)
    });
    let material_ids = material_ids.transpose()?;
    let mut rgb = |image: Option<&Image>, is_needed: bool| -> Result<Option<Vec<f32>>> {
        let Some(image) = image.filter(|_| is_needed) else {
            return Ok(None);
        };
        let pixels = readback.pixels(image)?;
        let mut values = pool.floats(3 * pixels.len());
        per_pixel(&mut values, |i| {
            let [r, g, b, _] = pixels[i];
            [r, g, b]
        });
        Ok(Some(values))
    };
    let has_radiance = is_wanted(Layer::Radiance) || tof.is_some();
    let normal = &images.gbuffer.normal_geometric;
    let normal = rgb(Some(normal), is_wanted(Layer::Normal))?;
    let direct = rgb(
        Some(&images.direct),
        has_radiance || is_wanted(Layer::Direct),
    )?;
    let indirect = has_radiance || is_wanted(Layer::Indirect);
    let indirect = rgb(images.indirect.as_ref(), indirect)?;
    let stderr = images.indirect_stderr.as_ref();
    let stderr = rgb(stderr, is_wanted(Layer::StandardError))?;
    let energy = rgb(images.energy.as_ref(), is_wanted(Layer::Energy))?;
    let radiance = direct.as_ref().filter(|_| has_radiance).map(|direct| {
        let mut radiance = pool.floats(direct.len());
        match &indirect {
            None => radiance.copy_from_slice(direct),
            Some(indirect) => per_pixel(&mut radiance, |i| [direct[i] + indirect[i]]),
        }
        radiance
    });

    let (position, in_camera, depth, range, mesh_ids) = match geometry {
        Some(geometry) => (
            Some(geometry.position),
            Some(geometry.in_camera),
            Some(geometry.depth),
            Some(geometry.range),
            Some(geometry.mesh_ids),
        ),
        None => (None, None, None, None, None),
    };
    let float = |values: Option<Vec<f32>>| values.map(LayerData::Float);
    let layers = [
        (Layer::Radiance, float(radiance)),
        (Layer::Direct, float(direct)),
        (Layer::Indirect, float(indirect)),
        (Layer::StandardError, float(stderr)),
        (Layer::Energy, float(energy)),
        (Layer::Position, float(position)),
        (Layer::CameraPosition, float(in_camera)),
        (Layer::Normal, float(normal)),
        (Layer::Depth, float(depth)),
        (Layer::Range, float(range)),
        (Layer::MeanDepth, float(mean_depth)),
        (Layer::NearestDepth, float(nearest_depth)),
        (Layer::InstanceId, mesh_ids.map(LayerData::Id)),
        (Layer::MaterialId, material_ids.map(LayerData::Id)),
    ];
    let made = |(layer, data): (Layer, Option<LayerData>)| Some((layer, data?));
    let mut layers: Vec<_> = layers.into_iter().filter_map(made).collect();
    if let (Some(tof), Some(paths), Some(image)) = (tof, paths, &images.direct_phasors) {
        let mut readback = Readback::new(device, image.shape)?;
        let direct = readback.pixels(image)?;
        let indirect = images.indirect_phasors.as_ref();
        let mut indirect = indirect
            .map(|image| Ok::<_, Error>((Readback::new(device, image.shape)?, image)))
            .transpose()?;
        let indirect = match &mut indirect {
            Some((readback, image)) => readback.pixels(image)?,
            None => &[],
        };
        let has_indirect = images.indirect.is_some();
        add_time_of_flight(&mut layers, tof, &paths, (direct, indirect), has_indirect);
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
    /// |PC|; 0 for the background.
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
        let camera_m = description.camera.position_m;
        let lengths = positions.iter().map(|&[x, y, z, mesh_id]| {
            if mesh_id == 0.0 {
                return (0.0, f64::INFINITY);
            }
            let p_m = space.to_world([x, y, z]);
            let to_camera_m = p_m.distance(camera_m);
            let to_lights_m = modulated.iter().map(|light_m| p_m.distance(*light_m));
            let half_m = 0.5 * (to_camera_m + to_lights_m.fold(f64::INFINITY, f64::min));
            (to_camera_m, half_m)
        });
        let (to_camera_m, half_m) = lengths.unzip();
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
    (direct, indirect): (&[[f32; 4]], &[[f32; 4]]),
    has_indirect: bool,
) {
    let tof = camera.tof;
    let count = paths.half_m.len();
    let radiance = layers.iter().find_map(|(layer, data)| match data {
        LayerData::Float(values) if *layer == Layer::Radiance => Some(values),
        _ => None,
    });
    let (radiance, _) = radiance.map_or(&[][..], |values| values).as_chunks::<3>();
    let seen = |bands: &[f32; 3]| tof.weighted(bands.map(f64::from));
    let radiances: Vec<f64> = radiance.iter().map(seen).collect();
    let half_paths = paths.half_m.iter().map(|&half_m| half_m as f32);
    layers.push((Layer::HalfPath, LayerData::Float(half_paths.collect())));
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
        let parts = FrameParts {
            has_sensor: true,
            has_indirect,
            has_samples: false,
            has_stderr: false,
            tof: FrameParts::of_tof(Some(tof)),
        };
        let made = camera.layers(frequency, &pixels, &radiances, &paths.half_m);
        layers.extend(
            made.into_iter()
                .filter(|(layer, _)| layer.is_made_with(parts)),
        );
    }
}

/// What the image of positions and mesh ids holds: P in the world and in the camera's axes, its distances from the camera (m), and ids.
struct Geometry {
    position: Vec<f32>,
    in_camera: Vec<f32>,
    depth: Vec<f32>,
    range: Vec<f32>,
    mesh_ids: Vec<u32>,
}

impl Geometry {
    const LAYERS: [Layer; 5] = [
        Layer::Position,
        Layer::CameraPosition,
        Layer::Depth,
        Layer::Range,
        Layer::InstanceId,
    ];

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
            mesh_ids: pool.ids(count),
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
            .zip(geometry.mesh_ids.chunks_mut(share));
        for_each_at_once(
            parts,
            |(((((pixels, position), in_camera), depth), range), mesh_ids)| {
                let (position, _) = position.as_chunks_mut::<3>();
                let (in_camera, _) = in_camera.as_chunks_mut::<3>();
                for (i, &[x, y, z, mesh_id]) in pixels.iter().enumerate() {
                    mesh_ids[i] = mesh_id as u32;
                    if mesh_id == 0.0 {
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
                    range[i] = (offset.length() * space.metres_per_unit) as f32;
                }
            },
        );
        geometry
    }
}
