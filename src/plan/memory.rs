//! What a frame holds of the device's memory, pass for pass as `src/frame` makes it.

use super::{GridStep, IndirectPlan, PIXEL_BYTES, Plan};
use crate::{
    Error, Result,
    ray_tree::{max_box_texels, max_triangle_texels},
    scene::Scene,
    vulkan::{DeviceInfo, DeviceKind, ROW_TEXELS},
};

/// Bytes of a pixel of a depth image, of a word, and of what a gather finds at a receiver.
const DEPTH_BYTES: u64 = 4;
const WORD_BYTES: u64 = 4;
const RESULT_BYTES: u64 = 32;
/// Items that one invocation of a compaction takes, and the bytes of their place.
const RUN_ITEMS: u64 = 64;
const RUN_BYTES: u64 = 8;
/// Drivers lay images out in squares of so many pixels along an edge.
const IMAGE_TILE_PX: u64 = 4;
/// Views, uniforms, lengths of lists and other things of a few hundred bytes, each rounded up to a page.
const SMALL_THINGS_BYTES: u64 = 256 << 10;
/// Receivers whose results there is room for.
const MAX_RESULTS: u64 = 1 << 20;
/// What the refinement takes whatever the scene: a sample of pixels.
const REFINEMENT_BYTES: u64 = 256 << 10;
/// By rays also the lattice of up to 16 384 draws and the guide to those of VPLs, both with the ones that they replace.
const DRAWS_BYTES: u64 = (1 << 20) + (256 << 10);

/// Bytes of what is held together, by what they grow with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct MemoryNeed {
    /// With the resolution.
    image: u64,
    /// With `rsm_size` and the number of lights.
    rsm: u64,
    /// With triangles and textures.
    scene: u64,
}

impl MemoryNeed {
    pub fn total(self) -> u64 {
        self.image + self.rsm + self.scene + SMALL_THINGS_BYTES
    }

    fn hint(self) -> &'static str {
        let most = self.image.max(self.rsm).max(self.scene);
        if most == self.image {
            "render a smaller image, or choose another device"
        } else if most == self.rsm {
            "set a smaller rsm_size or use fewer lights, or choose another device"
        } else {
            "simplify the meshes or scale the textures down, or choose another device"
        }
    }
}

impl Plan {
    /// The most bytes of device memory that a frame of the scene holds at a time: an upper bound, but for what the driver adds to
    /// images, and close to what is held (`tests/hard/device_memory.rs`).
    pub fn device_memory_bytes(&self, scene: &Scene) -> u64 {
        self.memory_need(scene).total()
    }

    /// Bytes of the frame's layers, which lie in the host's memory.
    pub fn layer_bytes(&self) -> u64 {
        // Radiance, direct light, positions and normals; depth, range and two numbers.
        let mut words = 4 * 3 + 4;
        words += 3 * u64::from(self.indirect.is_some());
        words += 3 * u64::from(self.joule_per_irradiance.is_some());
        self.pixels() * words * WORD_BYTES
    }

    /// Refuses what all together is more than the device has, before any of it is asked for.
    pub(super) fn check_memory(&self, scene: &Scene, device: &DeviceInfo) -> Result<()> {
        let need = self.memory_need(scene);
        // The host's memory and the device's are one.
        let layers = match device.kind {
            DeviceKind::Cpu | DeviceKind::Integrated => self.layer_bytes(),
            _ => 0,
        };
        let requested = need.total() + layers;
        let limit = device.limits.memory_bytes;
        if requested <= limit {
            return Ok(());
        }
        Err(Error::DeviceLimit {
            what: "the memory of the frame (bytes)".into(),
            requested,
            limit,
            device: device.name.clone(),
            hint: need.hint().into(),
        })
    }

    /// When most is held: while light is gathered, or on the way to the host.
    pub(super) fn memory_need(&self, scene: &Scene) -> MemoryNeed {
        let image = self.image_bytes();
        let specular = u64::from(self.is_specular);
        let indirect = u64::from(self.indirect.is_some());
        // The G-buffer with its depth, and radiance.
        let energy = u64::from(self.joule_per_irradiance.is_some());
        let images = (3 + specular + 1 + indirect + energy) * image;
        // Images go to the host through one buffer.
        let readback = self.pixels() * PIXEL_BYTES;
        MemoryNeed {
            image: images
                + image * DEPTH_BYTES / PIXEL_BYTES
                + self.gathering_bytes().max(readback),
            rsm: u64::from(self.map_sets) * self.map_set_bytes()
                + self
                    .indirect
                    .map_or(0, |indirect| self.vpl_bytes(&indirect)),
            scene: self.scene_bytes(scene),
        }
    }

    /// What the pixels are gathered with, beside the G-buffer and the result.
    fn gathering_bytes(&self) -> u64 {
        let Some(indirect) = self.indirect else {
            return 0;
        };
        self.refinement_bytes(
            indirect.refinement.coarsest_stride,
            indirect.is_final_gather(),
        )
    }

    /// What one light sees: its RSM, and its shadow map.
    pub(super) fn map_set_bytes(&self) -> u64 {
        let faces = self.max_faces();
        let rsm = self.indirect.map_or(0, |indirect| {
            map_bytes(indirect.rsm_size, faces, 3 + u64::from(self.is_specular))
        });
        rsm + self
            .own_map_size()
            .map_or(0, |size| map_bytes(size, faces, 1))
    }

    fn pixels(&self) -> u64 {
        self.resolution_px.map(u64::from).iter().product()
    }

    /// Of an image of the camera's size.
    fn image_bytes(&self) -> u64 {
        let [width, height] = self.resolution_px;
        image_bytes(width.into(), height.into())
    }

    /// Vertices, triangles and textures for the raster passes and for rays. What lies in an image lies in a buffer, too, from
    /// which it was copied.
    fn scene_bytes(&self, scene: &Scene) -> u64 {
        let vertices: u64 = scene
            .meshes
            .iter()
            .map(|m| m.positions_m.len() as u64)
            .sum();
        let triangles: u64 = scene.meshes.iter().map(|m| m.triangles.len() as u64).sum();
        let mut vertex_bytes = 16;
        vertex_bytes += 16 * u64::from(self.is_smooth) + 8 * u64::from(self.is_textured);
        let mut bytes = vertices * vertex_bytes + triangles * 3 * WORD_BYTES;
        let mut texels = 0;
        for texture in scene.textures.iter().filter(|_| self.is_textured) {
            let [width, height] = texture.size_px.map(u64::from);
            texels += width * height;
            bytes += image_bytes(width, height) + width * height * PIXEL_BYTES;
        }
        if self.has_rays() {
            bytes += texel_list_bytes(max_triangle_texels(triangles));
            bytes += texel_list_bytes(max_box_texels(triangles));
        }
        if self.has_final_gather() {
            let materials = 2 * 3 * scene.materials.len() as u64;
            bytes += texel_list_bytes(4 * triangles);
            bytes += texel_list_bytes(materials) + texel_list_bytes(texels);
        }
        bytes
    }

    /// The lists of what the RSMs' texels send.
    fn vpl_bytes(&self, indirect: &IndirectPlan) -> u64 {
        let size = indirect.rsm_size;
        let faces = self.max_faces();
        let texels = u64::from(faces) * u64::from(size) * u64::from(size);
        let is_bounce = indirect.is_final_gather();
        let lists = self.lights.len() as u64;
        let members = match (self.is_specular, is_bounce) {
            (false, _) => 3,
            (true, true) => 5,
            (true, false) => 3 + 5,
        };
        let rows = lists * texels.div_ceil(ROW_TEXELS);
        let mut bytes = members * image_bytes(ROW_TEXELS, rows);
        // The tables of the emission, and the places of the lists.
        bytes += lists * texels * 8
            + texels.div_ceil(RUN_ITEMS) * RUN_BYTES * (1 + u64::from(is_bounce));
        if is_bounce {
            // Ranges and shares of tiles of 64 texels, twice while the pilot teaches them.
            bytes += 4 * texel_list_bytes(lists * texels.div_ceil(64));
            bytes += texel_list_bytes(lists * 32);
        }
        bytes
    }

    /// What the refinement holds beside the G-buffer and the result.
    fn refinement_bytes(&self, coarsest_stride: u32, is_noisy: bool) -> u64 {
        let images = 1 + u64::from(self.is_specular) + u64::from(is_noisy);
        let steps = GridStep::all(coarsest_stride).into_iter();
        let items = steps.map(|step| u64::from(step.pixel_count(self.resolution_px)));
        let most = items.clone().max().unwrap_or_default();
        let candidates = items.skip(1).max().unwrap_or_default();
        let mut bytes = images * self.image_bytes();
        bytes += candidates * WORD_BYTES + list_bytes(most) + most.min(MAX_RESULTS) * RESULT_BYTES;
        if is_noisy {
            bytes += self.smoothing_bytes(coarsest_stride) + DRAWS_BYTES;
        }
        bytes + REFINEMENT_BYTES
    }

    /// The light on the lattice of which every pixel is gathered.
    pub(super) fn smoothing_bytes(&self, coarsest_stride: u32) -> u64 {
        let stride = (coarsest_stride / 2).max(1);
        let [columns, rows] = self.resolution_px.map(|px| u64::from(px.div_ceil(stride)));
        columns * rows * RESULT_BYTES
    }
}

fn image_bytes(width: u64, height: u64) -> u64 {
    let [width, height] = [width, height].map(|px| px.next_multiple_of(IMAGE_TILE_PX));
    width * height * PIXEL_BYTES
}

/// Images with a layer for each face, and the depth that these use in turn.
fn map_bytes(size: u32, faces: u32, images: u64) -> u64 {
    let face = image_bytes(size.into(), size.into());
    u64::from(faces) * images * face + face * DEPTH_BYTES / PIXEL_BYTES
}

/// A list in an image, and the buffer from which it is copied.
fn texel_list_bytes(texels: u64) -> u64 {
    let rows = texels.max(1).div_ceil(ROW_TEXELS);
    image_bytes(ROW_TEXELS, rows) + rows * ROW_TEXELS * PIXEL_BYTES
}

/// A list of so many pixels at most, and what it is compacted with.
fn list_bytes(items: u64) -> u64 {
    items * WORD_BYTES + items.div_ceil(RUN_ITEMS) * RUN_BYTES
}
