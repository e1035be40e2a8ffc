//! The front of a surface: normals decide it, or else the winding. Normal maps follow it, also on mirrored and on shared meshes.

use crate::common::gpu::{Gpu, demo_scene, distort, radial};
use crate::common::reference_frame::{error_off_edges, reference_frame, values};
use crate::common::rooms::scene_of;
use camlux::{
    Scene,
    hard_cases::scenes::grid,
    output::{Frame, Layer},
    scene::{
        Encoding, IndirectLight, Instance, Lens, Light, Mesh, Shadow, Shared, Texels, Texture,
    },
};
use glam::{DAffine3, DMat3, DVec3, Vec3};

/// A map of one normal: the components along u, v and the front's normal.
const MAPPED: DVec3 = DVec3::new(0.302, 0.498, 0.813);

fn map_of(normal: Vec3) -> Shared<Texture> {
    Shared::from(Texture {
        name: "map".into(),
        size_px: [1, 1],
        texels: Texels::F32(vec![(0.5 * normal + 0.5).to_array()]),
    })
}

/// A quad of 2 m in the plane z = 0, u along x and v along y. 288 triangles are enough to be shared on the device.
fn quad(is_clockwise: bool, has_normals: bool) -> Mesh {
    let plane = [DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y];
    let mut quad = grid("quad", plane, [12, 12], 0);
    let texcoord = |p: &DVec3| [0.5 * p.x + 0.5, 0.5 * p.y + 0.5];
    quad.texcoords = quad.positions_m.iter().map(texcoord).collect();
    if is_clockwise {
        quad.triangles
            .iter_mut()
            .for_each(|corners| corners.reverse());
    }
    if has_normals {
        quad.normals = vec![DVec3::Z; quad.positions_m.len()];
    }
    quad
}

/// The quad placed twice, once out of sight, before a camera on the z axis.
fn placed(quad: Mesh, to_world: DMat3, from_behind: bool) -> Scene {
    let side = if from_behind { -1.0 } else { 1.0 };
    let camera_m = DVec3::new(0.1, 0.2, 1.5 * side);
    let light = Light::point(camera_m, [1.0; 3]);
    let mut scene = scene_of(vec![quad], light, camera_m, DVec3::ZERO);
    scene.camera.resolution_px = [8, 8];
    scene.camera.lens = Lens::FovY { fov_y_deg: 30.0 };
    scene.textures = vec![map_of(MAPPED.as_vec3())];
    scene.materials[0].normal_texture = Some(0.into());
    scene.meshes[0].to_world = DAffine3::from_mat3(to_world);
    scene.meshes.push(Instance {
        to_world: DAffine3::from_translation(DVec3::new(0.0, 40.0, 0.0)),
        ..scene.meshes[0].clone()
    });
    scene
}

fn through_lens(mut scene: Scene) -> Scene {
    distort(&mut scene, radial(-0.05, 0.01));
    scene
}

fn assert_normals(what: &str, frame: &Frame, due: DVec3) {
    for normal in values(frame, Layer::Normal).chunks(3) {
        let normal = Vec3::from_slice(normal).as_dvec3();
        assert!(normal.distance(due) < 2e-3, "{what}: {normal} for {due}");
    }
}

/// By the rasteriser, by rays, and in the reference.
#[test]
fn maps_lie_on_the_front_whatever_the_winding() {
    let mut gpu = Gpu::open();
    let placements = [
        DMat3::IDENTITY,
        DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)),
        DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)),
        DMat3::from_rotation_z(0.7) * DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)),
    ];
    let (sine, cosine) = 0.5_f32.sin_cos();
    let tangents = [
        None,
        Some([cosine, sine, 0.0, 1.0]),
        Some([cosine, sine, 0.0, -1.0]),
    ];
    for case in 0..96 {
        let [has_normals, is_clockwise, from_behind] = [1, 2, 4].map(|bit| case & bit != 0);
        let (place, tangent) = (placements[case / 8 % 4], tangents[case / 32]);
        let what = format!(
            "normals {has_normals}, clockwise {is_clockwise}, behind {from_behind}, {place}, {tangent:?}"
        );
        let mut mesh = quad(is_clockwise, has_normals);
        let front = match is_clockwise && !has_normals {
            true => DVec3::NEG_Z,
            false => DVec3::Z,
        };
        let [along_u, along_v] = match tangent {
            None => [DVec3::X, DVec3::Y],
            Some([x, y, z, sign]) => {
                mesh.tangents = vec![[x, y, z, sign]; mesh.positions_m.len()];
                let tangent = Vec3::new(x, y, z).as_dvec3();
                [tangent, f64::from(sign) * front.cross(tangent)]
            }
        };
        let scene = placed(mesh, place, from_behind);
        // All placements are orthogonal: the axes go where points go.
        let on_front = place * (MAPPED.x * along_u + MAPPED.y * along_v + MAPPED.z * front);
        let visible = if from_behind { -1.0 } else { 1.0 };
        let due = on_front.normalize() * (on_front.z * visible).signum();
        assert_normals(
            &format!("reference, {what}"),
            &reference_frame(&scene, 1, 0),
            due,
        );
        assert_normals(&format!("raster, {what}"), &gpu.render(&scene), due);
        let lens = through_lens(scene);
        assert_normals(&format!("rays, {what}"), &gpu.render(&lens), due);
    }
}

/// The textured room with bumps, colours and normals. Its tangents are optional.
fn bumpy(has_tangents: bool) -> Scene {
    let mut scene = demo_scene("textured", [28, 28]);
    let texel = |i: usize| {
        let (x, y) = ((i % 8) as f32, (i / 8) as f32);
        let normal = Vec3::new(0.5 * (0.8 * x).sin(), 0.5 * (0.8 * y).cos(), 1.0);
        let encoded = 0.5 * normal.normalize() + 0.5;
        encoded
            .to_array()
            .map(|value| (value * 65_535.0).round() as u16)
    };
    let index = scene.textures.len();
    scene.textures.push(Shared::from(Texture {
        name: "bumps".into(),
        size_px: [8, 8],
        texels: Texels::U16((0..64).map(texel).collect(), Encoding::Linear),
    }));
    for material in &mut scene.materials {
        material.normal_texture = Some(index.into());
    }
    let random = &mut fastrand::Rng::with_seed(11);
    for instance in &mut scene.meshes {
        *instance = Instance::from(Mesh::clone(&instance.placed()));
        let mesh = &mut ***instance;
        let outwards = |&p: &DVec3| p - DVec3::new(0.1, 0.9, 0.2);
        mesh.normals = mesh.positions_m.iter().map(outwards).collect();
        let count = mesh.positions_m.len();
        mesh.colors = (0..count)
            .map(|_| [0; 3].map(|_| 0.5 + 0.5 * random.f32()))
            .collect();
        if has_tangents {
            let tangent = |n: &DVec3| {
                let [x, y, z] = n.any_orthogonal_vector().normalize().as_vec3().to_array();
                [x, y, z, -1.0]
            };
            mesh.tangents = mesh.normals.iter().map(tangent).collect();
        }
    }
    scene.direct.shadow = Some(Shadow::Rays);
    scene.indirect = Some(IndirectLight::final_gather(TARGET_ERROR));
    scene
}

fn edited(mut scene: Scene, edit: impl Fn(&mut Mesh)) -> Scene {
    scene.meshes.iter_mut().for_each(|instance| edit(instance));
    scene
}

const TARGET_ERROR: f64 = 0.03;

/// Turns every second triangle around.
fn rewound(mesh: &mut Mesh) {
    let triangles = mesh.triangles.iter_mut().step_by(2);
    triangles.for_each(|corners| corners.swap(1, 2));
}

/// Begins every triangle with its last corner.
fn begun_elsewhere(mesh: &mut Mesh) {
    mesh.triangles
        .iter_mut()
        .for_each(|corners| corners.rotate_right(1));
}

/// Lists the vertices in the opposite order.
fn reindexed(mesh: &mut Mesh) {
    let last = mesh.positions_m.len() as u32 - 1;
    mesh.positions_m.reverse();
    mesh.normals.reverse();
    mesh.texcoords.reverse();
    mesh.colors.reverse();
    mesh.tangents.reverse();
    let corners = mesh.triangles.as_flattened_mut().iter_mut();
    corners.for_each(|corner| *corner = last - *corner);
}

/// Mirrors the meshes in their own space, and places them by the same mirror.
fn mirrored_twice(mut scene: Scene) -> Scene {
    for instance in &mut scene.meshes {
        let mesh = &mut ***instance;
        mesh.positions_m.iter_mut().for_each(|p| p.x = -p.x);
        mesh.normals.iter_mut().for_each(|n| n.x = -n.x);
        for [x, _, _, sign] in &mut mesh.tangents {
            (*x, *sign) = (-*x, -*sign);
        }
        instance.to_world = mirror();
    }
    scene
}

fn mirror() -> DAffine3 {
    DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))
}

#[test]
fn winding_mirroring_and_indices_change_no_pixel() {
    let mut gpu = Gpu::open();
    for has_tangents in [false, true] {
        let scene = bumpy(has_tangents);
        let truth = reference_frame(&scene, 64, 2);
        let frame = gpu.render(&scene);
        for (what, changed) in [
            ("wound", edited(scene.clone(), rewound)),
            ("begun elsewhere", edited(scene.clone(), begun_elsewhere)),
            ("reindexed", edited(scene.clone(), reindexed)),
            ("mirrored", mirrored_twice(scene.clone())),
        ] {
            let error = |changed: &Frame, first: &Frame, layer| {
                let edges = truth.ids(Layer::Edge).expect("a reference has it");
                let [found, due] = [changed, first].map(|frame| values(frame, layer));
                crate::common::rmse::relative_rmse_where(found, due, |pixel| edges[pixel] == 0)
            };
            let layers = [Layer::Normal, Layer::Direct, Layer::Indirect];
            let of_reference = reference_frame(&changed, 64, 2);
            let of_reference = layers.map(|layer| error(&of_reference, &truth, layer));
            let of_frame = gpu.render(&changed);
            let of_frame = layers.map(|layer| error(&of_frame, &frame, layer));
            println!("{what}, tangents {has_tangents}: {of_reference:?} {of_frame:?}");
            assert!(
                of_reference.iter().all(|&e| e < 1e-6),
                "{what}: {of_reference:?}"
            );
            let [normal, direct, indirect] = of_frame;
            // Rounding decides which light paths a final gather samples. Each image meets its target error.
            assert!(
                normal < 1e-5 && direct < 3e-5 && indirect < 2_f64.sqrt() * TARGET_ERROR,
                "{what}: {of_frame:?}"
            );
        }
    }
}

/// What a mirror shows: meshes, lights and camera on the other side of the plane x = 0.
fn in_a_mirror(mut scene: Scene) -> Scene {
    let mirror = mirror();
    for instance in &mut scene.meshes {
        instance.to_world = mirror * instance.to_world;
    }
    for light in &mut scene.lights {
        if let Some(position_m) = light.position_m_mut() {
            position_m.x = -position_m.x;
        }
        if let Some(direction) = light.direction_mut() {
            direction.x = -direction.x;
        }
    }
    for place in [&mut scene.camera.position_m, &mut scene.camera.look_at_m] {
        place.x = -place.x;
    }
    scene
}

/// The image from right to left; `sign` multiplies the first channel.
fn flipped(values: &[f32], width: usize, sign: f32) -> Vec<f32> {
    let rows = values.chunks(3 * width);
    let pixels = rows.flat_map(|row| row.chunks(3).rev());
    pixels
        .flat_map(|pixel| [sign * pixel[0], pixel[1], pixel[2]])
        .collect()
}

#[test]
fn a_mirrored_scene_gives_the_mirrored_image() {
    let mut gpu = Gpu::open();
    for has_tangents in [false, true] {
        let scene = bumpy(has_tangents);
        let twin = in_a_mirror(scene.clone());
        let truth = reference_frame(&scene, 256, 4);
        let edges = truth.ids(Layer::Edge).expect("a reference has it");
        let width = scene.camera.resolution_px[0] as usize;
        let error = |twin: &Frame, frame: &Frame, layer| {
            let sign = if layer == Layer::Normal { -1.0 } else { 1.0 };
            let seen = flipped(values(twin, layer), width, sign);
            let due = values(frame, layer);
            crate::common::rmse::relative_rmse_where(&seen, due, |pixel| edges[pixel] == 0)
        };
        let layers = [Layer::Normal, Layer::Direct, Layer::Indirect];
        let of_reference = reference_frame(&twin, 256, 4);
        let of_reference = layers.map(|layer| error(&of_reference, &truth, layer));
        let frames = [&scene, &twin].map(|scene| gpu.render(scene));
        let of_frame = layers.map(|layer| error(&frames[1], &frames[0], layer));
        let apart = error_off_edges(&frames[0], &truth, Layer::Normal);
        println!("tangents {has_tangents}: {of_reference:?} {of_frame:?} {apart:.1e}");
        let [normal, direct, indirect] = of_reference;
        assert!(
            normal < 1e-6 && direct < 1e-6 && indirect < 0.08,
            "{of_reference:?}"
        );
        let [normal, direct, indirect] = of_frame;
        assert!(
            normal < 1e-5 && direct < 3e-5 && indirect < 0.06,
            "{of_frame:?}"
        );
        assert!(apart < 1e-5, "{apart}");
    }
}
