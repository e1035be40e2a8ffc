//! Many rays from points of surfaces: the kernels of `shaders/trace.wgsl` alone, for tests and benches.

use std::sync::Arc;

use glam::DVec3;

use crate::{
    Device, LocalSpace, RayKernel, Result, Scene,
    geometry::Geometry,
    passes::{rays::RayTriangles, textures::Textures},
    ray_tree::MeshTrees,
    vulkan::{Buffer, BufferUse, CommandPool, Pipelines, TexelList, shaders::RayProbeParameters},
};

/// Points in a row of their image.
const ROW_POINTS: u32 = 512;
/// Workgroups in a row of a dispatch.
const ROW_GROUPS: u32 = 1024;
/// Packets in a workgroup.
const GROUP_PACKETS: u32 = 8;

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayPoint {
    pub position_m: DVec3,
    /// Unit normal of the triangle, on the side that the ray leaves from or arrives at.
    pub geometric_normal: DVec3,
}

/// The closest hit of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    pub distance_m: f64,
    /// Index counted over all meshes of the scene.
    pub triangle: usize,
}

/// Results of rays, and the time they took.
#[derive(Debug, Clone, PartialEq)]
pub struct Probed<T> {
    /// In the order of the rays.
    pub found: Vec<T>,
    pub milliseconds: f64,
}

/// A scene's triangles on the device.
pub struct RayProbe {
    device: Device,
    pipelines: Pipelines,
    commands: CommandPool,
    space: LocalSpace,
    tree: RayTriangles,
    kernel: RayKernel,
}

impl RayProbe {
    /// Uploads a valid scene.
    ///
    /// # Errors
    /// [`Error::NoDevice`](crate::Error::NoDevice) if the device cannot run the kernel; [`Error::Memory`](crate::Error::Memory) and
    /// [`Error::Vulkan`](crate::Error::Vulkan) if the device fails.
    pub fn new(device: &Device, scene: &Scene, kernel: RayKernel) -> Result<RayProbe> {
        let space = LocalSpace::of(scene.bounding_box());
        let commands = CommandPool::new(device);
        let kernel = kernel.checked_for(device.info())?;
        let textures = Arc::new(match scene.has_cutouts() {
            true => Textures::upload(&commands, scene)?,
            false => Textures::default(),
        });
        let by = (kernel, &mut MeshTrees::default());
        let geometry = Geometry::of(scene, None);
        let tree = RayTriangles::of(&commands, scene, &geometry, &space, &textures, by)?;
        Ok(RayProbe {
            device: device.clone(),
            pipelines: Pipelines::new(device),
            commands,
            space,
            tree,
            kernel,
        })
    }

    /// Whether something is between each point and its ends. Every point has the same number of ends, a multiple of 64.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) and [`Error::Vulkan`](crate::Error::Vulkan) if the device fails.
    pub fn any_hit(&self, points: &[RayPoint], ends: &[RayPoint]) -> Result<Probed<bool>> {
        let texel = |end: &RayPoint| {
            let [x, y, z] = self.space.to_local(end.position_m);
            [x, y, z, pack_direction(end.geometric_normal)]
        };
        let ends: Vec<_> = ends.iter().map(texel).collect();
        let rays = ends.len();
        let probed = self.probe("any", points, ends, rays)?;
        Ok(Probed {
            found: probed.found.iter().map(|&is_hit| is_hit == 1).collect(),
            milliseconds: probed.milliseconds,
        })
    }

    /// The closest hit along unit directions. Every point has the same number of directions, a multiple of 64.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) and [`Error::Vulkan`](crate::Error::Vulkan) if the device fails.
    pub fn closest_hit(
        &self,
        points: &[RayPoint],
        directions: &[DVec3],
    ) -> Result<Probed<Option<RayHit>>> {
        let texel = |direction: &DVec3| direction.as_vec3().extend(0.0).to_array();
        let ends: Vec<_> = directions.iter().map(texel).collect();
        let words = 2 * ends.len();
        let probed = self.probe("closest", points, ends, words)?;
        let hit = |words: &[u32]| {
            let triangle = (words[1] as usize).checked_sub(1)?;
            let nearness = f64::from(f32::from_bits(words[0]));
            Some(RayHit {
                distance_m: self.space.metres_per_unit / nearness,
                triangle,
            })
        };
        Ok(Probed {
            found: probed.found.chunks(2).map(hit).collect(),
            milliseconds: probed.milliseconds,
        })
    }

    fn probe(
        &self,
        hit: &str,
        points: &[RayPoint],
        ends: Vec<[f32; 4]>,
        words: usize,
    ) -> Result<Probed<u32>> {
        let texels = |point: &RayPoint| {
            let [x, y, z] = self.space.to_local(point.position_m);
            let [nx, ny, nz] = point.geometric_normal.as_vec3().to_array();
            [[x, y, z, 0.0], [nx, ny, nz, 0.0]]
        };
        let rays = ends.len();
        let points_list: Vec<_> = points.iter().flat_map(texels).collect();
        debug_assert!(points_list.len() <= (2 * ROW_POINTS * 16384) as usize);
        let points_list = TexelList::new(&self.commands, "points", points_list)?;
        let ends = TexelList::new(&self.commands, "ends of rays", ends)?;
        let found = Buffer::new(&self.device, "found", 4 * words as u64, BufferUse::Readback)?;
        let pipeline = self.pipelines.compute(
            "ray_probe",
            &[hit, self.kernel.name(), self.tree.kernel_word()],
        )?;
        let packet_count = rays as u32 / pipeline.module.constant("PACKET_RAYS")?;
        let parameters = RayProbeParameters {
            rays_per_point: (rays / points.len().max(1)) as u32,
            packet_count,
        };
        let groups = packet_count.div_ceil(GROUP_PACKETS);
        let groups = [groups.min(ROW_GROUPS), groups.div_ceil(ROW_GROUPS), 1];
        let mut resources = vec![
            ("points", points_list.resource()),
            ("ends", ends.resource()),
            ("found", crate::vulkan::Resource::Buffer(&found)),
        ];
        resources.extend(self.tree.resources());
        let mut recorder = self.commands.begin()?;
        recorder.pass("ray_probe", |recorder| {
            recorder.dispatch(&pipeline, &resources, &parameters, groups)
        })?;
        let times = recorder.submit()?;
        Ok(Probed {
            found: found.mapped(words)?.to_vec(),
            milliseconds: times.iter().map(|(_, milliseconds)| milliseconds).sum(),
        })
    }
}

/// Same as `pack_direction` of `shaders/hit.wgsl`.
fn pack_direction(direction: DVec3) -> f32 {
    let flat = direction.truncate() / direction.abs().element_sum();
    let sign = |v: f64| if v >= 0.0 { 1.0 } else { -1.0 };
    let folded = if direction.z < 0.0 {
        glam::DVec2::new(
            (1.0 - flat.y.abs()) * sign(flat.x),
            (1.0 - flat.x.abs()) * sign(flat.y),
        )
    } else {
        flat
    };
    let grid = ((folded * 0.5 + 0.5).clamp(glam::DVec2::ZERO, glam::DVec2::ONE) * 4094.0).round();
    (grid.y * 4096.0 + grid.x) as f32
}
