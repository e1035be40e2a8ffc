//! Scenes made in code, and the normal and material at a point of them, in f64.

pub use camlux::hard_cases::scenes::{moved, quad};
use camlux::{
    Scene,
    internals::SurfacePoint,
    scene::{
        Bands, Camera, Direct, Filter, Instance, Lens, Light, Material, Mesh, Texture,
        TextureLookup, Wrap,
    },
};
use glam::{DMat2, DVec2, DVec3};

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
    let instance = &scene.meshes[hit.mesh];
    let mesh = &instance.mesh;
    let corners = mesh.triangles[hit.triangle].map(|corner| corner as usize);
    let [b1, b2] = hit.barycentric;
    let weights = [1.0 - b1 - b2, b1, b2];
    let material = &scene.materials[mesh.triangle_materials[hit.triangle] as usize];
    let look_up = |lookup: TextureLookup| {
        let texcoords = texcoords(mesh, corners, &lookup)?;
        let at = blend(weights, texcoords);
        Some(sample(&scene.textures[lookup.texture], &lookup, at))
    };
    let value = |lookup: Option<TextureLookup>| lookup.and_then(look_up).unwrap_or(DVec3::ONE);
    let color = match mesh.colors[..] {
        [] => DVec3::ONE,
        _ => blend(
            weights,
            corners.map(|i| DVec3::from(mesh.colors[i].map(f64::from))),
        ),
    };
    let front = front_normal(instance, corners, weights);
    let mapped = material.normal_texture.and_then(|lookup| {
        let [along_u, along_v] = map_axes(instance, corners, weights, &lookup, front)?;
        let map = 2.0 * look_up(lookup)? - 1.0;
        let normal = (map.x * along_u + map.y * along_v + map.z.max(0.0) * front).normalize();
        let seen = normal * side_of(front, hit.normal);
        (seen.dot(hit.normal) > 0.01).then_some(seen)
    });
    Surface {
        normal: mapped.unwrap_or(front * side_of(front, hit.normal)),
        kd: (DVec3::from(material.kd) * color * value(material.kd_texture)).to_array(),
        ks: (DVec3::from(material.ks) * value(material.ks_texture)).to_array(),
        shininess: material.shininess * value(material.shininess_texture).x,
    }
}

/// 1 if the visible side is the front, −1 if it is the back.
fn side_of(front: DVec3, visible: DVec3) -> f64 {
    if front.dot(visible) < 0.0 { -1.0 } else { 1.0 }
}

fn blend<T: std::ops::Mul<f64, Output = T> + std::iter::Sum>(weights: [f64; 3], of: [T; 3]) -> T {
    let weighted = of.into_iter().zip(weights);
    weighted.map(|(value, weight)| value * weight).sum()
}

/// The edges of a triangle from its first corner, in world space.
fn edges_m(instance: &Instance, corners: [usize; 3]) -> [DVec3; 2] {
    let [a, b, c] = corners.map(|i| instance.positions_m[i]);
    [b - a, c - a].map(|edge| instance.to_world.transform_vector3(edge))
}

/// The shading normal on the front: the mesh's own normals decide, or else the order of the mesh's corners.
fn front_normal(instance: &Instance, corners: [usize; 3], weights: [f64; 3]) -> DVec3 {
    let to_world = instance.to_world.matrix3;
    let normal_to_world = to_world.inverse().transpose();
    let mesh = &instance.mesh;
    if mesh.normals.is_empty() {
        let [a, b, c] = corners.map(|i| mesh.positions_m[i]);
        return (normal_to_world * (b - a).cross(c - a)).normalize();
    }
    let normals = corners.map(|i| (normal_to_world * mesh.normals[i]).normalize());
    blend(weights, normals).normalize()
}

/// The directions of a normal map's first two components, or `None` if they are undefined.
fn map_axes(
    instance: &Instance,
    corners: [usize; 3],
    weights: [f64; 3],
    lookup: &TextureLookup,
    front: DVec3,
) -> Option<[DVec3; 2]> {
    let mesh = &instance.mesh;
    let (along_u, along_v) = if mesh.tangents.is_empty() {
        let [a, b, c] = texcoords(mesh, corners, lookup)?;
        let [p1, p2] = edges_m(instance, corners);
        let from_uv = DMat2::from_cols(b - a, c - a);
        if from_uv.determinant() == 0.0 {
            return None;
        }
        // The share of each edge in a step along u and along v.
        let steps = from_uv.inverse();
        let along = |step: DVec2| step.x * p1 + step.y * p2;
        (along(steps.x_axis), along(steps.y_axis))
    } else {
        let vector = |i: usize| {
            let [x, y, z, _] = mesh.tangents[i].map(f64::from);
            let along_u = instance.to_world.transform_vector3(DVec3::new(x, y, z));
            along_u.normalize()
        };
        let along_u: DVec3 = blend(weights, corners.map(vector));
        let sign: f64 = blend(weights, corners.map(|i| f64::from(mesh.tangents[i][3])));
        let mirror = instance.to_world.matrix3.determinant().signum();
        (along_u, sign * mirror * front.cross(along_u))
    };
    let u = (along_u - front * front.dot(along_u)).normalize();
    // Perpendicular to both, on the side to which v grows.
    let v = along_v - front * front.dot(along_v) - u * u.dot(along_v);
    Some([u, v.normalize()])
}

/// The texture's coordinates at the corners.
fn texcoords(mesh: &Mesh, corners: [usize; 3], lookup: &TextureLookup) -> Option<[DVec2; 3]> {
    let of_set = [&mesh.texcoords, &mesh.texcoords_1][lookup.texcoord_set as usize];
    let transformed = |&[u, v]: &[f64; 2]| {
        let [x, y] = lookup.transform.map(|row| row[0] * u + row[1] * v + row[2]);
        DVec2::new(x, y)
    };
    let [a, b, c] = corners.map(|i| of_set.get(i).map(transformed));
    Some([a?, b?, c?])
}

/// The texture at a point; v points up.
fn sample(texture: &Texture, lookup: &TextureLookup, at: DVec2) -> DVec3 {
    let [width, height] = texture.size_px.map(i64::from);
    let texel = |column: i64, row: i64| {
        let column = texel_inside(lookup.wrap[0], column, width);
        let row = texel_inside(lookup.wrap[1], row, height);
        DVec3::from(
            texture
                .texels
                .reflectance(row * width as usize + column)
                .map(f64::from),
        )
    };
    let x = at.x * width as f64;
    let y = (1.0 - at.y) * height as f64;
    if lookup.filter == Filter::Nearest {
        return texel(x.floor() as i64, y.floor() as i64);
    }
    let (x, y) = (x - 0.5, y - 0.5);
    let mut sum = DVec3::ZERO;
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let (column, row) = (x.floor() as i64 + dx, y.floor() as i64 + dy);
        let weight = (1.0 - (x - column as f64).abs()) * (1.0 - (y - row as f64).abs());
        sum += weight * texel(column, row);
    }
    sum
}

/// The texel that stands for one beyond the edges.
fn texel_inside(wrap: Wrap, mut index: i64, count: i64) -> usize {
    // One step at a time.
    while index < 0 || index >= count {
        index = match wrap {
            Wrap::Repeat if index < 0 => index + count,
            Wrap::Repeat => index - count,
            Wrap::Mirror if index < 0 => -1 - index,
            Wrap::Mirror => 2 * count - 1 - index,
            Wrap::Clamp if index < 0 => 0,
            Wrap::Clamp => count - 1,
        };
    }
    index as usize
}

/// A square floor around 0, seen from above.
pub fn floor(half_edge_m: f64) -> Mesh {
    let corner_m = DVec3::new(-half_edge_m, 0.0, -half_edge_m);
    let [x, z] = [DVec3::X, DVec3::Z].map(|axis| 2.0 * half_edge_m * axis);
    quad("floor", corner_m, z, x, 0)
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
        lights: vec![light.into()],
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
        vignetting_map: None,
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
    let light = Light::point(DVec3::new(0.11, -0.07, 0.05), [1.0; 3]);
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
