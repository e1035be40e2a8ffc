//! From images on the device to the frame's layers.

use glam::DVec3;

use crate::{
    Device, LocalSpace, Result,
    output::{Layer, LayerData},
    scene::Camera,
    vulkan::{Buffer, BufferUse, Image, Recorder},
};

/// Copies images to the host: row by row from the top, layer by layer.
pub(crate) fn read_images(device: &Device, images: &[&Image]) -> Result<Vec<Vec<[f32; 4]>>> {
    let buffers = images
        .iter()
        .map(|image| {
            let bytes = image.shape.pixel_count() * size_of::<[f32; 4]>() as u64;
            Buffer::new(device, "readback", bytes, BufferUse::Readback)
        })
        .collect::<Result<Vec<_>>>()?;
    let mut recorder = Recorder::new(device, 1)?;
    recorder.barrier();
    for (image, buffer) in images.iter().zip(&buffers) {
        recorder.copy_from_image(image, buffer);
    }
    recorder.submit()?;
    images
        .iter()
        .zip(&buffers)
        .map(|(image, buffer)| buffer.read(image.shape.pixel_count() as usize))
        .collect()
}

/// The images of a frame on the host.
pub(crate) struct Pixels {
    /// P, local; mesh id.
    pub position_mesh: Vec<[f32; 4]>,
    pub normal_geometric: Vec<[f32; 4]>,
    pub kd_material: Vec<[f32; 4]>,
    pub direct: Vec<[f32; 4]>,
    pub indirect: Option<Vec<[f32; 4]>>,
    pub energy: Option<Vec<[f32; 4]>>,
}

impl Pixels {
    /// The frame's layers.
    pub fn into_layers(
        self,
        camera: &Camera,
        space: &LocalSpace,
    ) -> Result<Vec<(Layer, LayerData)>> {
        let count = self.position_mesh.len();
        let mut position_m = Vec::with_capacity(3 * count);
        let mut depth_m = Vec::with_capacity(count);
        let mut range_m = Vec::with_capacity(count);
        // Differences are taken in local space: in the world's they could cancel.
        let camera_local = (camera.position_m - space.origin_m) / space.metres_per_unit;
        let forward = camera.basis().forward;
        for &[x, y, z, mesh] in &self.position_mesh {
            if mesh == 0.0 {
                position_m.extend([0.0; 3]);
                depth_m.push(f32::INFINITY);
                range_m.push(f32::INFINITY);
                continue;
            }
            let offset = DVec3::from([x, y, z].map(f64::from)) - camera_local;
            position_m.extend(space.to_world([x, y, z]).as_vec3().to_array());
            depth_m.push((offset.dot(forward) * space.metres_per_unit) as f32);
            range_m.push((offset.length() * space.metres_per_unit) as f32);
        }
        let ids = |pixels: &[[f32; 4]]| pixels.iter().map(|pixel| pixel[3] as u32).collect();
        let direct = three(&self.direct);
        let indirect = self.indirect.as_deref().map(three);
        let radiance = match &indirect {
            None => direct.clone(),
            Some(indirect) => direct.iter().zip(indirect).map(|(d, i)| d + i).collect(),
        };

        let mut layers = vec![
            (Layer::Radiance, LayerData::Float(radiance)),
            (Layer::Direct, LayerData::Float(direct)),
        ];
        layers.extend(indirect.map(|values| (Layer::Indirect, LayerData::Float(values))));
        let energy = self.energy.as_deref().map(three);
        layers.extend(energy.map(|values| (Layer::Energy, LayerData::Float(values))));
        layers.extend([
            (Layer::Position, LayerData::Float(position_m)),
            (
                Layer::Normal,
                LayerData::Float(three(&self.normal_geometric)),
            ),
            (Layer::Depth, LayerData::Float(depth_m)),
            (Layer::Range, LayerData::Float(range_m)),
            (Layer::MeshId, LayerData::Id(ids(&self.position_mesh))),
            (Layer::MaterialId, LayerData::Id(ids(&self.kd_material))),
        ]);
        Ok(layers)
    }
}

/// The first three channels of each pixel.
fn three(pixels: &[[f32; 4]]) -> Vec<f32> {
    let mut values = Vec::with_capacity(3 * pixels.len());
    for &[r, g, b, _] in pixels {
        values.extend([r, g, b]);
    }
    values
}
