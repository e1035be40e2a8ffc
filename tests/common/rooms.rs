//! Scenes made in code, and the normal and material at a point of them, in f64.

pub use camlux::doctor::scenes::{moved, quad};
use camlux::{
    Scene,
    internals::SurfacePoint,
    scene::{Bands, Camera, Direct, Instance, Lens, Light, Material, Mesh, Texture},
};
use glam::DVec3;

use super::ray_caster::Hit;

/// A surface at the point that a ray hits.
pub struct Surface {
    pub normal: DVec3,
    pub kd: Bands,
    pub ks: Bands,
    pub shininess: f64,
}

/// Shading normal and material where a ray hits.
pub fn surface_at(scene: &Scene, hit: &Hit) -> Surface {
    let mesh = &scene.meshes[hit.mesh];
    let corners = mesh.triangles[hit.triangle].map(|corner| corner as usize);
    let [b1, b2] = hit.barycentric;
    let weights = [1.0 - b1 - b2, b1, b2];
    let mut normal = hit.normal;
    if !mesh.normals.is_empty() {
        let smooth: DVec3 = (0..3)
            .map(|i| weights[i] * mesh.normals[corners[i]].normalize())
            .sum();
        normal = smooth.normalize() * smooth.dot(hit.normal).signum();
    }
    let material = &scene.materials[mesh.triangle_materials[hit.triangle] as usize];
    let mut kd = material.kd;
    if let Some(texture) = material.kd_texture.filter(|_| !mesh.texcoords.is_empty()) {
        let coordinate = |axis: usize| -> f64 {
            (0..3)
                .map(|i| weights[i] * mesh.texcoords[corners[i]][axis])
                .sum()
        };
        let texel = sample(
            &scene.textures[texture.texture],
            coordinate(0),
            coordinate(1),
        );
        kd = std::array::from_fn(|band| kd[band] * texel[band]);
    }
    Surface {
        normal,
        kd,
        ks: material.ks,
        shininess: material.shininess,
    }
}

/// Bilinear lookup that repeats the texture; v points up.
fn sample(texture: &Texture, u: f64, v: f64) -> Bands {
    let [width, height] = texture.size_px.map(i64::from);
    let x = u * width as f64 - 0.5;
    let y = (1.0 - v) * height as f64 - 0.5;
    let mut sum = [0.0; 3];
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let (column, row) = (x.floor() as i64 + dx, y.floor() as i64 + dy);
        let weight = (1.0 - (x - column as f64).abs()) * (1.0 - (y - row as f64).abs());
        let index = row.rem_euclid(height) * width + column.rem_euclid(width);
        let texel = texture.texels.reflectance(index as usize);
        for band in 0..3 {
            sum[band] += weight * f64::from(texel[band]);
        }
    }
    sum
}

/// A scene with one light, a camera of 64 x 64 pixels, and meshes with a material each.
pub fn scene_of(meshes: Vec<Mesh>, light: Light, position_m: DVec3, look_at_m: DVec3) -> Scene {
    let count = meshes.len();
    Scene {
        camera: Camera {
            resolution_px: [64, 64],
            position_m,
            look_at_m,
            up: DVec3::Y,
            lens: Lens::FovY { fov_y_deg: 70.0 },
            pixel_sampling: None,
        },
        sensor: None,
        tof: None,
        carried_lights: Vec::new(),
        lights: vec![light],
        materials: (0..count)
            .map(|i| {
                // All differ, and all are exact in f32.
                let kd = [i % 4, i / 4 % 4, i / 16].map(|digit| (1 + digit) as f64 / 8.0);
                Material::lambert(meshes[i].name.clone(), kd)
            })
            .collect(),
        meshes: meshes.into_iter().map(Instance::from).collect(),
        textures: Vec::new(),
        direct: Direct::default(),
        indirect: None,
        left_out: Vec::new(),
    }
}

/// A closed room of 2 m around a point light off its centre. Just in front of each wall are four markers of different places and sizes. Mesh i
/// has material i.
pub fn marked_room() -> Scene {
    let mut meshes = Vec::new();
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let (n, s, t) = (
                side * axes[axis],
                axes[(axis + 1) % 3],
                axes[(axis + 2) % 3],
            );
            let mut add = |before: f64, at: [f64; 2], size: [f64; 2]| {
                let corner = n * (1.0 - before) + s * at[0] + t * at[1];
                let name = format!("{n} {}", meshes.len());
                let material = meshes.len() as u32;
                meshes.push(quad(&name, corner, s * size[0], t * size[1], material));
            };
            add(0.0, [-1.0, -1.0], [2.0, 2.0]);
            add(0.01, [0.35, 0.15], [0.5, 0.3]);
            add(0.02, [-0.75, 0.45], [0.3, 0.25]);
            add(0.03, [-0.55, -0.85], [0.2, 0.6]);
            add(0.04, [0.15, -0.65], [0.4, 0.35]);
        }
    }
    let light = Light::Point {
        position_m: DVec3::new(0.11, -0.07, 0.05),
        power_w: [1.0; 3],
    };
    scene_of(meshes, light, DVec3::new(-0.8, 0.6, 0.9), DVec3::ZERO)
}

pub fn has_kd(point: &SurfacePoint, kd: Bands) -> bool {
    point.brdf.kd == kd
}

/// Whether a point is on an axis-aligned mesh, within 1e-5 m.
pub fn is_on(mesh: &Mesh, point_m: DVec3) -> bool {
    let min_m = mesh
        .positions_m
        .iter()
        .copied()
        .fold(DVec3::INFINITY, DVec3::min);
    let max_m = mesh
        .positions_m
        .iter()
        .copied()
        .fold(DVec3::NEG_INFINITY, DVec3::max);
    point_m.cmpge(min_m - 1e-5).all() && point_m.cmple(max_m + 1e-5).all()
}
