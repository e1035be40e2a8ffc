//! The scene's surfaces on the device, and how the three raster passes draw them.

use std::sync::Arc;

use super::{
    Context,
    instances::{self, Instances},
    materials::{Materials, lobe_texel},
    textures::Textures,
};
use crate::{
    Result,
    geometry::{Geometry, GeometrySize, PlacedMesh},
    local_space::LocalSpace,
    plan::{Plan, is_detailed, surface_axis},
    scene::{Mesh, Scene, TextureLookup},
    vulkan::{
        Allocate, Buffer, CommandPool, Device, Recorder, Resource, Target,
        shaders::{self, Draw, Key, View},
    },
};

/// What frames draw.
pub(crate) struct Surfaces {
    pub lists: Arc<SurfaceLists>,
    /// Where the instances of shared meshes are. Only this changes when they move.
    pub instances: Arc<Instances>,
}

/// Vertices, triangles and textures of a scene, in device memory.
pub(crate) struct SurfaceLists {
    positions: Arc<Buffer>,
    indices: Arc<Buffer>,
    normals: Arc<Buffer>,
    texcoords: Arc<Buffer>,
    textures: Arc<Textures>,
    materials: Option<Arc<Materials>>,
    ranges: Vec<Range>,
}

/// Triangles of one mesh and one material.
struct Range {
    first_triangle: u32,
    triangle_count: u32,
    /// The first instance in the list of instances, and the number of instances. For a mesh in the scene's space: 0 and 1.
    instances: [u32; 2],
    is_smooth: bool,
    is_detailed: bool,
    has_cutouts: bool,
    is_one_sided: bool,
    draw: Draw,
}

/// What chooses the kernel that draws triangles.
pub(crate) struct Drawn {
    pub surface: shaders::Surface,
    pub cutout: bool,
    pub one_sided: bool,
}

/// Declares the memory for a scene's surfaces, except their textures.
pub(crate) fn declare(allocate: &impl Allocate, scene: &Scene, plan: &Plan) -> Result<()> {
    let list = |name, count: u64, bytes| allocate.uploaded_buffer(name, count * bytes);
    let GeometrySize {
        vertices,
        triangles,
        shared_instances,
        ..
    } = GeometrySize::of(scene);
    instances::declare(allocate, shared_instances)?;
    list("list of vertices", vertices, 16)?;
    list("list of triangles", triangles, 12)?;
    if plan.is_smooth {
        list("normals", vertices, 16)?;
    }
    if plan.reads_texcoords() {
        list("texture coordinates", vertices, 8)?;
    }
    Ok(())
}

impl SurfaceLists {
    /// Copies a scene's surfaces to the device.
    pub fn upload(
        commands: &CommandPool,
        scene: &Scene,
        plan: &Plan,
        space: &LocalSpace,
        textures: &Arc<Textures>,
        materials: Option<&Arc<Materials>>,
        geometry: &Geometry,
    ) -> Result<SurfaceLists> {
        let mut lists = Lists::default();
        let shading = Shading {
            scene,
            plan,
            textures,
            materials: materials.map(|materials| &**materials),
        };
        for PlacedMesh { index, mesh, .. } in &geometry.placed {
            lists.add(&shading, space, *index, [0, 1], mesh);
        }
        let mut first = 1;
        for shared in &geometry.shared {
            let count = shared.instances.len() as u32;
            // The indices of these instances are in the list of instances.
            lists.add(&shading, &shared.space, 0, [first, count], &shared.mesh);
            first += count;
        }
        Ok(SurfaceLists {
            positions: commands.upload("positions", &lists.positions)?,
            indices: commands.upload("indices", &lists.indices)?,
            normals: commands.upload("normals", &lists.normals)?,
            texcoords: commands.upload("texcoords", &lists.texcoords)?,
            textures: textures.clone(),
            materials: materials.cloned(),
            ranges: lists.ranges,
        })
    }
}

impl Surfaces {
    /// The lists of triangles with their names in the shaders.
    pub fn triangles(&self) -> [(&'static str, Resource<'_>); 2] {
        [
            ("positions", Resource::Buffer(&self.lists.positions)),
            ("indices", Resource::Buffer(&self.lists.indices)),
        ]
    }

    /// Draws every surface as seen from a view. `key` gives the kernel.
    pub fn draw(
        &self,
        recorder: &mut Recorder,
        context: &Context,
        key: impl Fn(Drawn) -> Key,
        target: &Target,
        view: &Buffer,
        more_resources: &[(&str, Resource)],
    ) -> Result<()> {
        let pipelines = context.pipelines;
        let lists = &*self.lists;
        recorder.render(target, |recorder| {
            for range in &lists.ranges {
                let is_textured = range.draw.texture.size[0] > 0;
                let is_detailed = range.is_detailed || range.has_cutouts;
                let key = key(Drawn {
                    surface: surface_axis(range.is_smooth, is_textured, is_detailed),
                    cutout: range.has_cutouts,
                    one_sided: range.is_one_sided,
                });
                let pipeline = pipelines.raster(key, target.colors.len())?;
                let mut resources = vec![
                    ("view", Resource::Buffer(view)),
                    ("normals", Resource::Buffer(&lists.normals)),
                    ("texcoords", Resource::Buffer(&lists.texcoords)),
                ];
                resources.extend(self.triangles());
                resources.push(self.instances.resource());
                resources.extend(lists.textures.resource());
                let materials = lists.materials.iter();
                resources.extend(materials.flat_map(|materials| materials.resources()));
                resources.extend_from_slice(more_resources);
                recorder.bind_raster(&pipeline, &resources)?;
                let triangles = [range.first_triangle, range.triangle_count];
                recorder.draw(&pipeline, &range.draw, triangles, range.instances);
            }
            Ok(())
        })
    }
}

/// The triangles of a mesh in the order in which they are drawn: those of a material become one draw and keep their order.
pub(crate) fn draw_order(mesh: &Mesh) -> Vec<usize> {
    let mut order: Vec<usize> = (0..mesh.triangles.len()).collect();
    order.sort_by_key(|&triangle| mesh.triangle_materials[triangle]);
    order
}

/// Uploads a view to a buffer.
pub(crate) fn upload_view(device: &Device, view: &View) -> Result<Buffer> {
    Buffer::upload(device, "view", std::slice::from_ref(view))
}

#[derive(Default)]
struct Lists {
    positions: Vec<[f32; 4]>,
    indices: Vec<u32>,
    /// One per position if some mesh is smooth, else empty.
    normals: Vec<[f32; 4]>,
    /// One per position if there are textures, else empty.
    texcoords: Vec<[f32; 2]>,
    ranges: Vec<Range>,
    mesh_count: usize,
}

/// What decides how a surface is drawn.
struct Shading<'s> {
    scene: &'s Scene,
    plan: &'s Plan,
    textures: &'s Textures,
    materials: Option<&'s Materials>,
}

impl Lists {
    /// Adds the next mesh of the geometry.
    fn add(
        &mut self,
        shading: &Shading,
        space: &LocalSpace,
        instance_index: usize,
        instances: [u32; 2],
        mesh: &Mesh,
    ) {
        let Shading {
            scene,
            plan,
            textures,
            materials,
        } = *shading;
        let index_in_geometry = self.mesh_count;
        self.mesh_count += 1;
        let first_vertex = self.positions.len() as u32;
        for (i, &position_m) in mesh.positions_m.iter().enumerate() {
            let [x, y, z] = space.to_local(position_m);
            self.positions.push([x, y, z, 0.0]);
            if plan.is_smooth {
                let normal = mesh.normals.get(i).copied().unwrap_or_default();
                let normal = normal.normalize_or_zero().as_vec3();
                self.normals.push(normal.extend(0.0).to_array());
            }
            if plan.reads_texcoords() {
                let texcoord = mesh.texcoords.get(i).copied().unwrap_or_default();
                self.texcoords.push(texcoord.map(|c| c as f32));
            }
        }
        let order = draw_order(mesh);
        for same in
            order.chunk_by(|&a, &b| mesh.triangle_materials[a] == mesh.triangle_materials[b])
        {
            let material_index = mesh.triangle_materials[same[0]];
            let material = &scene.materials[material_index as usize];
            let first_triangle = (self.indices.len() / 3) as u32;
            for &triangle in same {
                let corners = mesh.triangles[triangle];
                self.indices
                    .extend(corners.map(|corner| first_vertex + corner));
            }
            let [material_texel, has] = materials.map_or([0; 2], |materials| {
                materials.texel_and_has(materials.entry(index_in_geometry, material_index))
            });
            let shown = |lookup: &TextureLookup| mesh.shows(lookup);
            self.ranges.push(Range {
                first_triangle,
                triangle_count: same.len() as u32,
                instances,
                is_smooth: !mesh.normals.is_empty(),
                is_detailed: is_detailed(mesh, material),
                has_cutouts: material.alpha_texture.filter(shown).is_some(),
                is_one_sided: material.is_one_sided,
                draw: Draw {
                    kd: material.kd.map(|kd| kd as f32),
                    instance_id: (instance_index + 1) as f32,
                    lobe: lobe_texel(material),
                    material_id: (material_index + 1) as f32,
                    material: material_texel,
                    has,
                    first_vertex,
                    texture: textures.place_of(material.kd_texture.filter(shown)),
                    ..Draw::default()
                },
            });
        }
    }
}
