//! From images on the device to the frame's layers.

use std::thread;

use glam::DVec3;

use super::{BufferPool, FrameImages};
use crate::{
    Device, LocalSpace, Result,
    output::{Layer, LayerData},
    scene::Camera,
    vulkan::{Image, Readback},
};

/// The layers of a frame, in buffers of a pool as far as they fit.
pub(crate) fn read_layers(
    device: &Device,
    camera: &Camera,
    space: &LocalSpace,
    images: &FrameImages,
    mut pool: BufferPool,
) -> Result<Vec<(Layer, LayerData)>> {
    let mut readback = Readback::new(device, images.direct.shape)?;

    let pixels = readback.pixels(&images.gbuffer.position_mesh)?;
    let count = pixels.len();
    let Geometry {
        position,
        depth,
        range,
        mesh_ids,
    } = Geometry::of(pixels, camera, space, &mut pool);

    let mut rgb = |image: &Image| -> Result<Vec<f32>> {
        let pixels = readback.pixels(image)?;
        let mut values = pool.floats(3 * count);
        per_pixel(&mut values, |i| {
            let [r, g, b, _] = pixels[i];
            [r, g, b]
        });
        Ok(values)
    };
    let normal = rgb(&images.gbuffer.normal_geometric)?;
    let direct = rgb(&images.direct)?;
    let indirect = images.indirect.as_ref().map(&mut rgb).transpose()?;
    let stderr = images.indirect_stderr.as_ref().map(&mut rgb).transpose()?;
    let energy = images.energy.as_ref().map(&mut rgb).transpose()?;
    let pixels = readback.pixels(&images.gbuffer.kd_material)?;
    let mut material_ids = pool.ids(count);
    per_pixel(&mut material_ids, |i| [pixels[i][3] as u32]);
    let mut radiance = pool.floats(direct.len());
    match &indirect {
        None => radiance.copy_from_slice(&direct),
        Some(indirect) => per_pixel(&mut radiance, |i| [direct[i] + indirect[i]]),
    }

    let layers = [
        (Layer::Radiance, Some(LayerData::Float(radiance))),
        (Layer::Direct, Some(LayerData::Float(direct))),
        (Layer::Indirect, indirect.map(LayerData::Float)),
        (Layer::StandardError, stderr.map(LayerData::Float)),
        (Layer::Energy, energy.map(LayerData::Float)),
        (Layer::Position, Some(LayerData::Float(position))),
        (Layer::Normal, Some(LayerData::Float(normal))),
        (Layer::Depth, Some(LayerData::Float(depth))),
        (Layer::Range, Some(LayerData::Float(range))),
        (Layer::InstanceId, Some(LayerData::Id(mesh_ids))),
        (Layer::MaterialId, Some(LayerData::Id(material_ids))),
    ];
    let made = |(layer, data): (Layer, Option<LayerData>)| Some((layer, data?));
    Ok(layers.into_iter().filter_map(made).collect())
}

/// What the image of positions and meshes tells: P, its distances from the camera (m), and ids.
struct Geometry {
    position: Vec<f32>,
    depth: Vec<f32>,
    range: Vec<f32>,
    mesh_ids: Vec<u32>,
}

impl Geometry {
    fn of(
        pixels: &[[f32; 4]],
        camera: &Camera,
        space: &LocalSpace,
        pool: &mut BufferPool,
    ) -> Geometry {
        let count = pixels.len();
        let mut geometry = Geometry {
            position: pool.floats(3 * count),
            depth: pool.floats(count),
            range: pool.floats(count),
            mesh_ids: pool.ids(count),
        };
        // Differences are taken in local space: in the world's they could cancel.
        let camera_local = (camera.position_m - space.origin_m) / space.metres_per_unit;
        let forward = camera.basis().forward;
        let share = pixels_of_a_thread(count);
        let parts = pixels
            .chunks(share)
            .zip(geometry.position.chunks_mut(3 * share))
            .zip(geometry.depth.chunks_mut(share))
            .zip(geometry.range.chunks_mut(share))
            .zip(geometry.mesh_ids.chunks_mut(share));
        for_each_at_once(parts, |((((pixels, position), depth), range), mesh_ids)| {
            let (position, _) = position.as_chunks_mut::<3>();
            for (i, &[x, y, z, mesh_id]) in pixels.iter().enumerate() {
                mesh_ids[i] = mesh_id as u32;
                if mesh_id == 0.0 {
                    position[i] = [0.0; 3];
                    depth[i] = f32::INFINITY;
                    range[i] = f32::INFINITY;
                    continue;
                }
                let offset = DVec3::from([x, y, z].map(f64::from)) - camera_local;
                position[i] = space.to_world([x, y, z]).as_vec3().to_array();
                depth[i] = (offset.dot(forward) * space.metres_per_unit) as f32;
                range[i] = (offset.length() * space.metres_per_unit) as f32;
            }
        });
        geometry
    }
}

/// `N` values for each pixel.
fn per_pixel<T: Send, const N: usize>(values: &mut [T], value: impl Fn(usize) -> [T; N] + Sync) {
    let (pixels, _) = values.as_chunks_mut::<N>();
    let share = pixels_of_a_thread(pixels.len());
    for_each_at_once(pixels.chunks_mut(share).enumerate(), |(part, pixels)| {
        for (i, pixel) in pixels.iter_mut().enumerate() {
            *pixel = value(part * share + i);
        }
    });
}

/// As many threads as there are cores: most of the time goes to memory, whose pages the system may have to clear. Of a small
/// image, to start one would take longer than its work.
fn pixels_of_a_thread(count: usize) -> usize {
    let threads = thread::available_parallelism().map_or(1, usize::from);
    count.div_ceil(threads).max(1 << 14)
}

/// Does all parts at once, the first of them on this thread.
fn for_each_at_once<T: Send>(mut parts: impl Iterator<Item = T>, work: impl Fn(T) + Sync) {
    let first = parts.next();
    thread::scope(|scope| {
        for part in parts {
            let work = &work;
            scope.spawn(move || work(part));
        }
        first.into_iter().for_each(&work);
    });
}
