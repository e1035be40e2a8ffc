//! Instances that share a mesh on the device, against the same surfaces where each has its own mesh.

use crate::common::gpu::{Gpu, distort, radial};
use crate::common::instances::crowd;
use crate::common::reference_frame::{error_off_edges, reference_frame};
use crate::common::rmse::relative_rmse_where;
use camlux::{
    Scene,
    output::{Frame, Layer},
    scene::{Encoding, IndirectLight, Material, Mesh, Shared, Texels, Texture},
};

/// Blocks with a texture, a normal map and optionally an alpha texture, which all vary across a face.
fn patterned(has_cutouts: bool) -> Scene {
    let mut scene = crowd([64, 64]);
    let texture = |name: &str, texel: fn(usize) -> [u8; 3]| {
        Shared::from(Texture {
            name: name.into(),
            size_px: [4, 4],
            texels: Texels::U8((0..16).map(texel).collect(), Encoding::Linear),
        })
    };
    let first = scene.textures.len();
    scene.textures.extend([
        texture("checks", |i| {
            [[60, 120, 250], [240, 200, 90]][(i + i / 4) % 2]
        }),
        texture("bumps", |i| [[90, 128, 240], [128, 170, 240]][i % 2]),
        texture("holes", |i| {
            [[255; 3], [0; 3]][usize::from(i % 4 == 1 && i / 4 == 2)]
        }),
    ]);
    let material = scene.materials.len() as u32;
    scene.materials.push(Material {
        kd_texture: Some(first.into()),
        normal_texture: Some((first + 1).into()),
        alpha_texture: has_cutouts.then(|| (first + 2).into()),
        ..Material::lambert("patterned", [0.8; 3])
    });
    let block = scene
        .meshes
        .iter()
        .find(|mesh| mesh.name.starts_with("block"));
    let block = block.expect("a block").mesh.clone();
    let mut patterned = Mesh::clone(&block);
    patterned.triangle_materials.fill(material);
    let patterned = Shared::from(patterned);
    for instance in scene.meshes.iter_mut().filter(|i| i.mesh.ptr_eq(&block)) {
        instance.mesh = patterned.clone();
    }
    scene
}

/// Share of the pixels that show the same mesh in both frames, but whose values differ by more than `bound` times the layer's largest value.
fn differing(shared: &Frame, own: &Frame, layer: Layer, bound: f32) -> f64 {
    let ids = [shared, own].map(|frame| frame.ids(Layer::InstanceId).expect("it is there"));
    let values = [shared, own].map(|frame| frame.values(layer).expect("it is there"));
    let channels = values[0].len() / ids[0].len();
    let largest = values[1].iter().copied().fold(0.0, f32::max);
    let pixels = (0..ids[0].len()).filter(|&pixel| ids[0][pixel] == ids[1][pixel]);
    let is_off = |pixel: &usize| {
        let mut channels = channels * pixel..channels * (pixel + 1);
        channels.any(|i| (values[0][i] - values[1][i]).abs() > bound * largest)
    };
    pixels.filter(is_off).count() as f64 / ids[0].len() as f64
}

pub fn assert_same(gpu: &mut Gpu, what: &str, scene: &Scene) {
    let shared = gpu.render_by_each_tracer(scene);
    let own = gpu.render_by_each_tracer(&scene.flattened());
    for (shared, own) in shared.iter().zip(&own) {
        let ids = [shared, own].map(|frame| frame.ids(Layer::InstanceId).expect("it is there"));
        assert!(
            ids[1].iter().any(|&id| id > 4),
            "{what}: instances are seen"
        );
        let other = ids[0].iter().zip(ids[1]).filter(|(a, b)| a != b).count();
        assert!(other <= 4, "{what}: {other} pixels show another mesh");
        for (layer, bound, share) in [
            (Layer::Position, 2e-6, 1e-3),
            (Layer::Normal, 1e-4, 1e-3),
            (Layer::Direct, 1e-4, 2e-3),
        ] {
            let found = differing(shared, own, layer, bound);
            println!("{what}, {layer:?}: {found}");
            assert!(found <= share, "{what}, {layer:?}: {found}");
        }
        let bounced =
            [shared, own].map(|frame| frame.values(Layer::Indirect).expect("it is there"));
        // The frames' noise differs where a ray beside an edge hits something else.
        let error = relative_rmse_where(bounced[0], bounced[1], |_| true);
        let [a, b] = bounced.map(|values| values.iter().map(|&v| f64::from(v)).sum::<f64>());
        println!("{what}, indirect: {error}, mean {}", a / b);
        assert!(error < 0.1, "{what}: {error}");
        assert!((a / b - 1.0).abs() < 0.01, "{what}: {}", a / b);
    }
}

#[test]
fn shared_meshes_look_like_copies() {
    let mut gpu = Gpu::open();
    let mut scene = crowd([64, 64]);
    scene.indirect = Some(IndirectLight::final_gather(0.05));
    assert_same(&mut gpu, "crowd", &scene);
}

#[test]
fn shared_meshes_keep_textures_bumps_and_cutouts() {
    let mut gpu = Gpu::open();
    for has_cutouts in [false, true] {
        let mut scene = patterned(has_cutouts);
        scene.indirect = Some(IndirectLight::final_gather(0.05));
        assert_same(&mut gpu, &format!("cut-outs: {has_cutouts}"), &scene);
    }
}

#[test]
fn the_reference_places_instances_alike() {
    let mut gpu = Gpu::open();
    let mut scene = patterned(false);
    scene.camera.resolution_px = [32, 32];
    scene.indirect = Some(IndirectLight::final_gather(0.03));
    let truth = reference_frame(&scene, 256, 8);
    let frames = [gpu.render(&scene), gpu.render(&scene.flattened())];
    for (layer, bound) in [
        (Layer::Position, 1e-5),
        // Loose, for pixels that show several triangles.
        (Layer::Normal, 1e-2),
        (Layer::Direct, 1e-4),
        (Layer::Indirect, 0.05),
    ] {
        let [shared, own] = [0, 1].map(|i| error_off_edges(&frames[i], &truth, layer));
        println!("{layer:?}: {shared:.1e} of shared meshes, {own:.1e} of copies");
        assert!(
            shared < bound && shared < 1.5 * own,
            "{layer:?}: {shared}, {own}"
        );
    }
}

#[test]
fn shared_meshes_are_seen_through_lenses() {
    let mut gpu = Gpu::open();
    let mut scene = patterned(false);
    scene.indirect = Some(IndirectLight::final_gather(0.05));
    distort(&mut scene, radial(-0.1, 0.02));
    assert_same(&mut gpu, "lens", &scene);
}
