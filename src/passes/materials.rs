//! The scene's materials on the device, as `shaders/shared/materials.wgsl` lists them, and the values of vertices that few meshes have.

use super::textures::{Textures, halves_of_first_word};
use crate::{
    Result, Scene,
    geometry::{Geometry, meshes_on_device},
    ray_tree::alpha_cutoff,
    scene::{Material, Mesh, TextureLookup},
    vulkan::{
        Allocate, CommandPool, Resource, TexelList,
        shaders::constants::{
            HAS_COLORS, HAS_ONE_SIDE, HAS_TANGENTS, HAS_VERTICES, MAP_TEXELS, MATERIAL_TEXELS,
        },
    },
};

pub(crate) struct Materials {
    list: TexelList,
    vertex_values: TexelList,
    /// The HAS_ bits of each entry of the list.
    has: Vec<u32>,
    /// For each mesh of the geometry, the first of its entries, which has the scene's first material.
    entries_of_mesh: Vec<u32>,
}

/// Which values of vertices the surfaces of a mesh show, beyond those that every mesh may have.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct VertexValues {
    pub colors: bool,
    pub texcoords_1: bool,
    pub tangents: bool,
}

impl VertexValues {
    /// Those of a mesh of a validated scene.
    pub fn of(scene: &Scene, mesh: &Mesh) -> VertexValues {
        let needs = |is_there: bool, is_such: fn(&Material) -> bool| {
            is_there && scene.has_material(mesh, is_such)
        };
        VertexValues {
            colors: !mesh.colors.is_empty(),
            texcoords_1: needs(!mesh.texcoords_1.is_empty(), |material| {
                let mut textures = material.textures();
                textures.any(|(_, lookup)| lookup.texcoord_set == 1)
            }),
            tangents: needs(!mesh.tangents.is_empty(), |m| m.normal_texture.is_some()),
        }
    }

    pub fn is_any(self) -> bool {
        self != VertexValues::default()
    }

    fn texels_per_vertex(self) -> usize {
        [self.colors, self.texcoords_1, self.tangents]
            .map(usize::from)
            .iter()
            .sum()
    }
}

/// Declares the memory for a scene's materials.
pub(crate) fn declare(allocate: &impl Allocate, scene: &Scene) -> Result<()> {
    let (mut blocks, mut texels) = (2, 0);
    for mesh in meshes_on_device(scene) {
        let values = VertexValues::of(scene, mesh);
        if values.is_any() {
            blocks += 1;
            texels += mesh.triangles.len() + values.texels_per_vertex() * mesh.positions_m.len();
        }
    }
    let entries = (blocks * scene.materials.len()) as u64;
    TexelList::declare(allocate, "materials", u64::from(MATERIAL_TEXELS) * entries)?;
    TexelList::declare(allocate, "values of vertices", texels as u64)
}

/// What a block of entries shares: all materials of the scene, for some of its meshes.
#[derive(Default)]
struct Block {
    has_texcoords: bool,
    values: VertexValues,
    /// The two texels of the shader's VERTICES.
    vertices: [[f32; 4]; 2],
}

impl Materials {
    /// Copies the materials and vertices of a valid scene to the device.
    pub fn upload(
        commands: &CommandPool,
        scene: &Scene,
        geometry: &Geometry,
        textures: &Textures,
    ) -> Result<Materials> {
        let mut blocks = [true, false]
            .map(|has_texcoords| Block {
                has_texcoords,
                ..Block::default()
            })
            .into_iter()
            .collect::<Vec<_>>();
        let mut vertex_values = Vec::new();
        let mut entries_of_mesh = Vec::new();
        let mut first_triangle = 0;
        for mesh in geometry.meshes() {
            let values = VertexValues::of(scene, mesh);
            let has_texcoords = !mesh.texcoords.is_empty();
            let block = match values.is_any() {
                true => blocks.len(),
                false => usize::from(!has_texcoords),
            };
            if values.is_any() {
                blocks.push(Block {
                    has_texcoords,
                    values,
                    vertices: add_vertices(&mut vertex_values, mesh, values, first_triangle),
                });
            }
            entries_of_mesh.push((block * scene.materials.len()) as u32);
            first_triangle += mesh.triangles.len();
        }
        let mut has = Vec::new();
        let mut texels = Vec::new();
        for block in &blocks {
            for material in &scene.materials {
                let (entry, of_entry) = entry(material, block, textures);
                texels.extend(entry);
                has.push(of_entry);
            }
        }
        Ok(Materials {
            list: TexelList::new(commands, "materials", texels)?,
            vertex_values: TexelList::new(commands, "values of vertices", vertex_values)?,
            has,
            entries_of_mesh,
        })
    }

    /// The entry of a material on a mesh, which is the index of the mesh in the geometry.
    pub fn entry(&self, mesh: usize, material: u32) -> u32 {
        self.entries_of_mesh[mesh] + material
    }

    /// The first texel of an entry, and its HAS_ bits.
    pub fn texel_and_has(&self, entry: u32) -> [u32; 2] {
        [entry * MATERIAL_TEXELS, self.has[entry as usize]]
    }

    /// The lists with their names in the shaders.
    pub fn resources(&self) -> [(&'static str, Resource<'_>); 2] {
        [
            ("materials", self.list.resource()),
            ("vertex_values", self.vertex_values.resource()),
        ]
    }
}

/// Adds a mesh's triangles and vertices. Returns where they are.
fn add_vertices(
    texels: &mut Vec<[f32; 4]>,
    mesh: &Mesh,
    values: VertexValues,
    first_triangle: usize,
) -> [[f32; 4]; 2] {
    let triangle_0 = texels.len() as f32 - first_triangle as f32;
    texels.extend(mesh.triangles.iter().map(|&[a, b, c]| {
        let [a, b, c] = [a, b, c].map(|corner| corner as f32);
        [a, b, c, 0.0]
    }));
    let vertex_0 = texels.len() as f32;
    for vertex in 0..mesh.positions_m.len() {
        if values.colors {
            let [r, g, b] = mesh.colors[vertex];
            texels.push([r, g, b, 0.0]);
        }
        if values.texcoords_1 {
            let [u, v] = mesh.texcoords_1[vertex].map(|value| value as f32);
            texels.push([u, v, 0.0, 0.0]);
        }
        if values.tangents {
            texels.push(mesh.tangents[vertex]);
        }
    }
    let texcoord = f32::from(u8::from(values.colors));
    let tangent = texcoord + f32::from(u8::from(values.texcoords_1));
    [
        [triangle_0, vertex_0, values.texels_per_vertex() as f32, 0.0],
        [0.0, texcoord, tangent, 0.0],
    ]
}

/// What maps multiply of a material's lobe, as `shaders/shared/brdf.wgsl` stores it.
pub(super) fn lobe_texel(material: &Material) -> [f32; 4] {
    let [r, g, b] = material.ks;
    let texel = match &material.microfacets {
        None => [r, g, b, material.shininess],
        Some(of) => [of.dielectric_reflectance(), of.metallic, 0.0, -of.roughness],
    };
    texel.map(|number| number as f32)
}

/// The texels of a material in a block, and its HAS_ bits.
fn entry(material: &Material, block: &Block, textures: &Textures) -> (Vec<[f32; 4]>, u32) {
    let is_shown = |lookup: &TextureLookup| match lookup.texcoord_set {
        0 => block.has_texcoords,
        _ => block.values.texcoords_1,
    };
    let mut has = 0;
    let mut maps = Vec::new();
    // The order is that of the shader, which has bits for those before alpha.
    let of_lobe = match material.microfacets {
        None => [material.ks_texture, material.shininess_texture],
        Some(_) => [None, material.metallic_roughness_texture],
    };
    let maps_of_material = [
        material.kd_texture,
        of_lobe[0],
        of_lobe[1],
        material.normal_texture,
        material.alpha_texture,
        material.emission_texture,
    ];
    let alpha = maps_of_material.len() - 2;
    for (i, lookup) in maps_of_material.into_iter().enumerate() {
        let Some(lookup) = lookup.filter(is_shown) else {
            maps.extend([[0.0; 4]; MAP_TEXELS as usize]);
            continue;
        };
        let is_alpha = i == alpha;
        has |= if i < alpha { 1 << i } else { 0 };
        has |= HAS_VERTICES * lookup.texcoord_set;
        let place = match is_alpha {
            true => textures.alpha_place_of(Some(lookup)),
            false => textures.place_of(Some(lookup)),
        };
        let [width, height] = place.size;
        let [first, second] = halves_of_first_word(place);
        let [row_u, row_v] = lookup.transform.map(|row| row.map(|value| value as f32));
        maps.extend([
            [width, height, place.words, place.flags].map(|n| n as f32),
            [first, second, 0.0, 0.0],
            [row_u[0], row_u[1], row_u[2], alpha_cutoff(material)],
            [row_v[0], row_v[1], row_v[2], 0.0],
        ]);
    }
    if material.is_one_sided {
        has |= HAS_ONE_SIDE;
    }
    if block.values.colors {
        has |= HAS_COLORS | HAS_VERTICES;
    }
    if block.values.tangents {
        has |= HAS_TANGENTS | HAS_VERTICES;
    }
    let [red, green, blue] = material.kd.map(|kd| kd as f32);
    let mut texels = vec![[red, green, blue, has as f32], lobe_texel(material)];
    texels.extend(maps);
    texels.extend(block.vertices);
    let [red, green, blue] = material.emission_w_sr_m2.map(|radiance| radiance as f32);
    texels.push([red, green, blue, 0.0]);
    (texels, has)
}
