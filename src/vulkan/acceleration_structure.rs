//! Triangles in the acceleration structure of the device's ray tracing hardware (`VK_KHR_acceleration_structure`, `VK_KHR_ray_query`).

use std::sync::Arc;

use ash::{khr::acceleration_structure::Device as Functions, vk};

use super::{Buffer, BufferUse, CommandPool, Device, memory::Kept};
use crate::{Error, Result};

/// Alignment of scratch memory that is enough for every device.
const SCRATCH_ALIGNMENT: u64 = 256;
/// Words of a VkAccelerationStructureInstanceKHR. Every ray sees an instance, from both sides.
const INSTANCE_WORDS: usize = 16;
const MASK_ALL: u32 = 0xff << 24;
const NO_CULLING: u32 = vk::GeometryInstanceFlagsKHR::TRIANGLE_FACING_CULL_DISABLE.as_raw() << 24;

/// Triangles that several instances share, in their own space.
pub(crate) struct InstancedTriangles {
    pub corners: Vec<[[f32; 3]; 3]>,
    /// The first triangles are opaque. The shader confirms hits of the others. Each group is a geometry.
    pub opaque_count: usize,
    /// Rows of the transform to the scene, for each instance.
    pub to_scene: Vec<[[f32; 4]; 3]>,
}

/// Two levels: lists of triangles, and their instances in the scene.
pub(crate) struct AccelerationStructure {
    levels: Arc<Levels>,
}

struct Levels {
    top: Level,
    _bottom: Vec<Level>,
}

impl AccelerationStructure {
    /// Builds the structure and waits. A ray that hits a triangle reports its index in its geometry and the instance's number, counted
    /// over all lists.
    pub fn over(commands: &CommandPool, meshes: &[InstancedTriangles]) -> Result<Self> {
        let device = commands.device();
        let mut bottom = Vec::with_capacity(meshes.len());
        let mut vertices = Vec::with_capacity(meshes.len());
        let mut words: Vec<u32> = Vec::new();
        for mesh in meshes {
            let (build, corners) = bottom_level(commands, mesh)?;
            let reference = build.level.address()?;
            for rows in &mesh.to_scene {
                let number = (words.len() / INSTANCE_WORDS) as u32;
                words.extend(rows.as_flattened().iter().map(|x| x.to_bits()));
                words.extend([
                    MASK_ALL | number,
                    NO_CULLING,
                    reference as u32,
                    (reference >> 32) as u32,
                ]);
            }
            bottom.push(build);
            vertices.push(corners);
        }
        let instance_count = (words.len() / INSTANCE_WORDS) as u32;
        let instances = commands.upload("instances for rays", &words)?;
        let geometry = vk::AccelerationStructureGeometryInstancesDataKHR::default().data(
            vk::DeviceOrHostAddressConstKHR {
                device_address: instances.address(),
            },
        );
        let geometry = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::INSTANCES)
            .geometry(vk::AccelerationStructureGeometryDataKHR {
                instances: geometry,
            });
        let top = Build::new(
            device,
            vk::AccelerationStructureTypeKHR::TOP_LEVEL,
            vec![(geometry, instance_count)],
        )?;

        let mut recorder = commands.begin()?;
        recorder.barrier();
        for build in &bottom {
            recorder.build(functions(device)?, &build.info(), &build.primitive_counts);
        }
        recorder.barrier();
        recorder.build(functions(device)?, &top.info(), &top.primitive_counts);
        recorder.submit()?;
        Ok(AccelerationStructure {
            levels: Arc::new(Levels {
                top: top.level,
                _bottom: bottom.into_iter().map(|build| build.level).collect(),
            }),
        })
    }

    /// The handle that shaders traverse.
    pub(super) fn raw(&self) -> vk::AccelerationStructureKHR {
        self.levels.top.raw
    }

    /// Keeps the structure alive after this object is dropped.
    pub(super) fn keep(&self) -> Kept {
        self.levels.clone()
    }
}

/// The bottom level of a mesh, and the buffer of corners that it is built from.
fn bottom_level(commands: &CommandPool, mesh: &InstancedTriangles) -> Result<(Build, Arc<Buffer>)> {
    let vertices = commands.upload("corners for rays", mesh.corners.as_flattened())?;
    let (opaque, others) = mesh.corners.split_at(mesh.opaque_count);
    let others_at = vertices.address() + size_of_val(opaque) as u64;
    let opaque = triangles(vertices.address(), opaque, vk::GeometryFlagsKHR::OPAQUE);
    let mut geometries = vec![opaque];
    if !others.is_empty() {
        geometries.push(triangles(
            others_at,
            others,
            vk::GeometryFlagsKHR::NO_DUPLICATE_ANY_HIT_INVOCATION,
        ));
    }
    let level = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
    Ok((Build::new(commands.device(), level, geometries)?, vertices))
}

/// A geometry and its number of primitives.
type Geometry = (vk::AccelerationStructureGeometryKHR<'static>, u32);

/// Triangles whose corners are stored consecutively from this address on.
fn triangles(address: u64, corners: &[[[f32; 3]; 3]], flags: vk::GeometryFlagsKHR) -> Geometry {
    let count = corners.len() as u32;
    let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
        .vertex_format(vk::Format::R32G32B32_SFLOAT)
        .vertex_data(vk::DeviceOrHostAddressConstKHR {
            device_address: address,
        })
        .vertex_stride(size_of::<[f32; 3]>() as u64)
        .max_vertex((3 * count).max(1) - 1)
        .index_type(vk::IndexType::NONE_KHR);
    let geometry = vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
        .flags(flags);
    (geometry, count)
}

/// A level that is about to be built.
struct Build {
    level: Level,
    kind: vk::AccelerationStructureTypeKHR,
    geometries: Vec<vk::AccelerationStructureGeometryKHR<'static>>,
    primitive_counts: Vec<u32>,
    scratch: Buffer,
}

impl Build {
    fn new(
        device: &Device,
        kind: vk::AccelerationStructureTypeKHR,
        geometries: Vec<Geometry>,
    ) -> Result<Build> {
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        let (geometries, primitive_counts): (Vec<_>, Vec<_>) = geometries.into_iter().unzip();
        let info = build_info(kind, &geometries);
        let on = vk::AccelerationStructureBuildTypeKHR::DEVICE;
        // SAFETY: the device is live, and the geometries have this number of primitives.
        unsafe {
            functions(device)?.get_acceleration_structure_build_sizes(
                on,
                &info,
                &primitive_counts,
                &mut sizes,
            );
        }
        let bytes = sizes.acceleration_structure_size;
        let scratch_bytes = sizes.build_scratch_size + SCRATCH_ALIGNMENT;
        Ok(Build {
            level: Level::new(device, kind, bytes)?,
            kind,
            geometries,
            primitive_counts,
            scratch: Buffer::new(device, "scratch for rays", scratch_bytes, BufferUse::Device)?,
        })
    }

    fn info(&self) -> vk::AccelerationStructureBuildGeometryInfoKHR<'_> {
        build_info(self.kind, &self.geometries)
            .dst_acceleration_structure(self.level.raw)
            .scratch_data(vk::DeviceOrHostAddressKHR {
                device_address: self.scratch.address().next_multiple_of(SCRATCH_ALIGNMENT),
            })
    }
}

fn build_info<'g>(
    kind: vk::AccelerationStructureTypeKHR,
    geometries: &'g [vk::AccelerationStructureGeometryKHR<'static>],
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'g> {
    vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(kind)
        .flags(vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE)
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
        .geometries(geometries)
}

/// One level and its memory.
struct Level {
    device: Device,
    raw: vk::AccelerationStructureKHR,
    _buffer: Buffer,
}

impl Level {
    fn new(device: &Device, kind: vk::AccelerationStructureTypeKHR, bytes: u64) -> Result<Level> {
        let buffer = Buffer::new(device, "acceleration structure", bytes, BufferUse::Device)?;
        let info = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(buffer.raw)
            .size(bytes)
            .ty(kind);
        let functions = functions(device)?;
        // SAFETY: the buffer is live, large enough, and was made for this.
        let raw = device.call("vkCreateAccelerationStructureKHR", |_| unsafe {
            functions.create_acceleration_structure(&info, None)
        })?;
        Ok(Level {
            device: device.clone(),
            raw,
            _buffer: buffer,
        })
    }

    fn address(&self) -> Result<u64> {
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default()
            .acceleration_structure(self.raw);
        let functions = functions(&self.device)?;
        // SAFETY: the structure is live.
        Ok(unsafe { functions.get_acceleration_structure_device_address(&info) })
    }
}

impl Drop for Level {
    fn drop(&mut self) {
        if let Ok(functions) = functions(&self.device) {
            // SAFETY: recorders keep what they name until the device is done with it.
            unsafe { functions.destroy_acceleration_structure(self.raw, None) };
        }
    }
}

fn functions(device: &Device) -> Result<&Functions> {
    let missing = || Error::internal("rays of a device that has none of its own");
    device.acceleration_structures().ok_or_else(missing)
}
