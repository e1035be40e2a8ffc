//! From images on the device to the frame's layers.

use std::thread;

use glam::DVec3;

use super::FrameImages;
use crate::{
    Device, LocalSpace, Result,
    output::{Layer, LayerData},
    scene::Camera,
    vulkan::{Buffer, BufferUse, Image, ImageShape, Recorder},
};

/// The way of images of one shape to the host. They go through one buffer, one after the other: to touch fresh memory
/// takes longer than to copy.
pub(crate) struct Readback<'d> {
    device: &'d Device,
    buffer: Buffer,
}

impl<'d> Readback<'d> {
    pub fn new(device: &'d Device, shape: ImageShape) -> Result<Self> {
        let bytes = shape.pixel_count() * size_of::<[f32; 4]>() as u64;
        let buffer = Buffer::new(device, "readback", bytes, BufferUse::Readback)?;
        Ok(Readback { device, buffer })
    }

    /// The pixels of an image: row by row from the top, layer by layer.
    pub fn pixels(&mut self, image: &Image) -> Result<&[[f32; 4]]> {
        let mut recorder = Recorder::new(self.device, 1)?;
        recorder.barrier();
        recorder.copy_from_image(image, &self.buffer);
        recorder.submit()?;
        self.buffer.mapped(image.shape.pixel_count() as usize)
    }
}

/// The layers of a frame.
pub(crate) fn read_layers(
    device: &Device,
    camera: &Camera,
    space: &LocalSpace,
    images: &FrameImages,
) -> Result<Vec<(Layer, LayerData)>> {
    let mut readback = Readback::new(device, images.direct.shape)?;

    let pixels = readback.pixels(&images.gbuffer.position_mesh)?;
    let count = pixels.len();
    let position = per_pixel(count, |i| match pixels[i] {
        [_, _, _, 0.0] => [0.0; 3],
        [x, y, z, _] => space.to_world([x, y, z]).as_vec3().to_array(),
    });
    // Differences are taken in local space: in the world's they could cancel.
    let camera_local = (camera.position_m - space.origin_m) / space.metres_per_unit;
    let forward = camera.basis().forward;
    let distance = |pixel: [f32; 4], length: &dyn Fn(DVec3) -> f64| match pixel {
        [_, _, _, 0.0] => [f32::INFINITY],
        [x, y, z, _] => {
            let offset = DVec3::from([x, y, z].map(f64::from)) - camera_local;
            [(length(offset) * space.metres_per_unit) as f32]
        }
    };
    let depth = per_pixel(count, |i| {
        distance(pixels[i], &|offset| offset.dot(forward))
    });
    let range = per_pixel(count, |i| distance(pixels[i], &DVec3::length));
    let mesh_ids = per_pixel(count, |i| [pixels[i][3] as u32]);

    let mut rgb = |image: &Image| -> Result<Vec<f32>> {
        let pixels = readback.pixels(image)?;
        Ok(per_pixel(count, |i| {
            let [r, g, b, _] = pixels[i];
            [r, g, b]
        }))
    };
    let normal = rgb(&images.gbuffer.normal_geometric)?;
    let direct = rgb(&images.direct)?;
    let indirect = images.indirect.as_ref().map(&mut rgb).transpose()?;
    let energy = images.energy.as_ref().map(&mut rgb).transpose()?;
    let pixels = readback.pixels(&images.gbuffer.kd_material)?;
    let material_ids = per_pixel(count, |i| [pixels[i][3] as u32]);
    let radiance = match &indirect {
        None => direct.clone(),
        Some(indirect) => per_pixel(direct.len(), |i| [direct[i] + indirect[i]]),
    };

    let layers = [
        (Layer::Radiance, Some(LayerData::Float(radiance))),
        (Layer::Direct, Some(LayerData::Float(direct))),
        (Layer::Indirect, indirect.map(LayerData::Float)),
        (Layer::Energy, energy.map(LayerData::Float)),
        (Layer::Position, Some(LayerData::Float(position))),
        (Layer::Normal, Some(LayerData::Float(normal))),
        (Layer::Depth, Some(LayerData::Float(depth))),
        (Layer::Range, Some(LayerData::Float(range))),
        (Layer::MeshId, Some(LayerData::Id(mesh_ids))),
        (Layer::MaterialId, Some(LayerData::Id(material_ids))),
    ];
    let made = |(layer, data): (Layer, Option<LayerData>)| Some((layer, data?));
    Ok(layers.into_iter().filter_map(made).collect())
}

/// `N` values for each of `count` pixels, by as many threads as there are cores: the first touch of the result's pages,
/// which the system has to clear, takes most of the time.
fn per_pixel<T: Copy + Default + Send, const N: usize>(
    count: usize,
    value: impl Fn(usize) -> [T; N] + Sync,
) -> Vec<T> {
    let mut values = vec![T::default(); N * count];
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let share = count.div_ceil(threads).max(1);
    thread::scope(|scope| {
        for (part, values) in values.chunks_mut(N * share).enumerate() {
            let value = &value;
            scope.spawn(move || {
                let (pixels, _) = values.as_chunks_mut::<N>();
                for (i, pixel) in pixels.iter_mut().enumerate() {
                    *pixel = value(part * share + i);
                }
            });
        }
    });
    values
}
