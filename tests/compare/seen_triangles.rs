//! The layers `id.triangle` and `uv`, against rays in f64 that look through backs and cut-outs.

use crate::common::gpu::{Gpu, distort, radial, tracers};
use crate::common::instances::crowd;
use crate::common::ray_caster::{Hit, RayCaster, pixel::PixelRay};
use camlux::{
    Scene,
    output::{Frame, Layer, LayerData},
    scene::{
        Encoding, Mesh, PixelFilter, PixelSampling, Shadow, Shared, Texels, Texture, TextureLookup,
        Wrap,
    },
};
use glam::DVec3;

const NAMED: [Layer; 4] = [
    Layer::Depth,
    Layer::InstanceId,
    Layer::TriangleId,
    Layer::Texcoord,
];
/// Largest error of a texture coordinate, whose gradient is about 1 over the scene's size: measured up to 2.5e-6.
const UV: f64 = 1e-5;

/// Instances that share meshes, some mirrored; each mesh of several materials, whose triangles alternate. All but the room have texture
/// coordinates. Every third triangle turns its back to the outside.
fn scene() -> Scene {
    let mut scene = crowd([64, 48]);
    (scene.indirect, scene.sensor) = (None, None);
    let count = scene.materials.len() as u32;
    let mut changed: Vec<(Shared<Mesh>, Shared<Mesh>)> = Vec::new();
    for (index, instance) in scene.meshes.iter_mut().enumerate() {
        // Not on each other, where either of two surfaces may be seen.
        instance.to_world.translation.y += 1e-3 * index as f64;
        let known = changed.iter().find(|(old, _)| old.ptr_eq(&instance.mesh));
        if let Some((_, new)) = known {
            instance.mesh = new.clone();
            continue;
        }
        let old = instance.mesh.clone();
        let mesh = &mut instance.mesh;
        let texcoord = |p: &DVec3| [0.4 * p.x - 0.3 * p.y, 0.5 * p.z + 0.2 * p.x];
        if index > 0 {
            mesh.texcoords = mesh.positions_m.iter().map(texcoord).collect();
        }
        for (index, material) in mesh.triangle_materials.iter_mut().enumerate() {
            *material = (*material + index as u32) % count;
        }
        for corners in mesh.triangles.iter_mut().step_by(3) {
            corners.swap(1, 2);
        }
        changed.push((old, instance.mesh.clone()));
    }
    scene
}

fn data(frame: &Frame, layer: Layer) -> Option<&LayerData> {
    let mut layers = frame.layers.iter();
    layers.find_map(|(other, data)| (*other == layer).then_some(data))
}

fn texcoord_at(scene: &Scene, hit: &Hit) -> [f64; 2] {
    let mesh = &scene.meshes[hit.mesh];
    let [b1, b2] = hit.barycentric;
    let weights = [1.0 - b1 - b2, b1, b2];
    let texcoord = |corner: u32| mesh.texcoords.get(corner as usize);
    let corners = mesh.triangles[hit.triangle].map(|corner| *texcoord(corner).unwrap_or(&[0.0; 2]));
    [0, 1].map(|axis| (0..3).map(|i| weights[i] * corners[i][axis]).sum())
}

/// Whether the camera looks through a surface: from behind, or where `is_hole` says that its texture cuts it out.
fn is_passed(scene: &Scene, hit: &Hit, direction: DVec3, is_hole: fn([f64; 2]) -> bool) -> bool {
    let instance = &scene.meshes[hit.mesh];
    let material = &scene.materials[instance.triangle_materials[hit.triangle] as usize];
    let [a, b, c] = instance.triangles[hit.triangle].map(|corner| {
        instance
            .to_world
            .transform_point3(instance.positions_m[corner as usize])
    });
    let handedness = instance.to_world.matrix3.determinant().signum();
    let is_behind = handedness * (b - a).cross(c - a).dot(direction) > 0.0;
    let has_holes = material.alpha_texture.is_some() && !instance.texcoords.is_empty();
    material.is_one_sided && is_behind || has_holes && is_hole(texcoord_at(scene, hit))
}

/// Checks the layers of a frame. `is_hole`: where on surfaces with an alpha texture there is a hole, by texture coordinates.
fn check(what: &str, scene: &Scene, frame: &Frame, is_hole: fn([f64; 2]) -> bool) {
    let caster = RayCaster::new(scene);
    let nearest = |origin_m, direction| {
        let mut from = 0.0;
        loop {
            let hit = caster.nearest_in(origin_m, direction, from, f64::INFINITY)?;
            if !is_passed(scene, &hit, direction, is_hole) {
                return Some(hit);
            }
            from = hit.distance * (1.0 + 1e-12);
        }
    };
    let [width, _] = frame.resolution_px;
    let ids = |layer| frame.ids(layer).expect("it is named");
    let (instances, triangles) = (ids(Layer::InstanceId), ids(Layer::TriangleId));
    let uv = frame.values(Layer::Texcoord).expect("it is named");
    let (mut compared, mut background, mut error) = (0, 0, 0.0_f64);
    for (i, uv) in uv.as_chunks::<2>().0.iter().enumerate() {
        let ray = PixelRay::of_camera(scene, i as u32 % width, i as u32 / width);
        let (hit, is_inside) = ray.cast_by(nearest);
        if !is_inside {
            continue;
        }
        let Some(hit) = hit else {
            assert_eq!((triangles[i], *uv), (0, [0.0; 2]), "{what}: pixel {i}");
            background += 1;
            continue;
        };
        let due = (1 + hit.mesh as u32, 1 + hit.triangle as u32);
        assert_eq!((instances[i], triangles[i]), due, "{what}: pixel {i}");
        let due = texcoord_at(scene, &hit);
        for axis in 0..2 {
            error = error.max((f64::from(uv[axis]) - due[axis]).abs());
        }
        compared += 1;
    }
    println!("{what}: {compared} pixels, {background} of background, uv {error:.1e}");
    assert!(
        2 * compared > instances.len(),
        "{what}: {compared} compared"
    );
    assert!(error < UV, "{what}: {error}");
}

fn render(gpu: &mut Gpu, scene: &Scene) -> Vec<Frame> {
    let tracers = tracers(&gpu.device).into_iter();
    let frames = tracers.map(|tracer| {
        gpu.render_with(scene, |options| {
            options.tracer = Some(tracer);
            options.layers = Some(&NAMED);
        })
    });
    frames.collect()
}

/// By the rasteriser and by rays through a lens, of meshes on the device once and once for each instance.
#[test]
fn pixels_name_the_triangle_that_a_ray_hits() {
    let mut gpu = Gpu::open();
    for shadow in [Shadow::Rays, Shadow::Map] {
        for has_lens in [false, true] {
            for is_one_sided in [false, true] {
                let mut scene = scene();
                scene.direct.shadow = Some(shadow);
                if is_one_sided {
                    for material in scene.materials.iter_mut().step_by(2) {
                        material.is_one_sided = true;
                    }
                }
                if has_lens {
                    distort(&mut scene, radial(-0.08, 0.01));
                }
                for frame in render(&mut gpu, &scene) {
                    let what = format!("{shadow:?}, lens {has_lens}, one-sided {is_one_sided}");
                    check(&what, &scene, &frame, |_| false);
                }
            }
        }
    }
}

#[test]
fn pixels_name_what_shows_through_cut_outs() {
    let mut gpu = Gpu::open();
    let mut scene = scene();
    let whole = render(&mut gpu, &scene).swap_remove(0);
    scene.textures.push(
        Texture {
            name: "alpha".into(),
            size_px: [4, 1],
            texels: Texels::U8(
                [255, 255, 0, 0].map(|value| [value; 3]).to_vec(),
                Encoding::Linear,
            ),
        }
        .into(),
    );
    let alpha = TextureLookup {
        wrap: [Wrap::Repeat; 2],
        ..(scene.textures.len() - 1).into()
    };
    for material in scene.materials.iter_mut().step_by(2) {
        material.alpha_texture = Some(alpha);
        material.alpha_cutoff = 0.5;
    }
    for has_lens in [false, true] {
        if has_lens {
            distort(&mut scene, radial(-0.08, 0.01));
        }
        for frame in render(&mut gpu, &scene) {
            // Where alpha, which is linear between the texels' centres, is below 1/2.
            let ids =
                [&whole, &frame].map(|frame| frame.ids(Layer::TriangleId).expect("it is named"));
            let others = ids[0].iter().zip(ids[1]).filter(|(a, b)| a != b).count();
            assert!(others > 100, "{others} pixels show something through holes");
            check("cut-outs", &scene, &frame, |[u, _]| u.rem_euclid(1.0) > 0.5);
        }
    }
}

/// With samples, the layers are those of the centres. And the image of triangles changes no other layer.
#[test]
fn other_layers_are_the_same() {
    let mut gpu = Gpu::open();
    let mut scene = scene();
    let by_default = gpu.render(&scene);
    let all: Vec<Layer> = by_default.layers.iter().map(|(layer, _)| *layer).collect();
    let and_named = [&all[..], &NAMED[2..]].concat();
    let whole = gpu.render_with(&scene, |options| options.layers = Some(&and_named));
    assert_eq!(whole.layers.len(), all.len() + 2);
    for (layer, due) in &by_default.layers {
        assert!(data(&whole, *layer) == Some(due), "{layer:?}");
    }
    scene.camera.pixel_sampling = Some(PixelSampling {
        samples: 4,
        filter: PixelFilter::Box,
    });
    let sampled = gpu.render_with(&scene, |options| options.layers = Some(&and_named));
    for layer in NAMED {
        assert!(data(&whole, layer) == data(&sampled, layer), "{layer:?}");
    }
}

/// A frame that is repeated is drawn again only if the last one did not have what it needs.
#[test]
fn a_repeated_frame_has_them_too() {
    let mut gpu = Gpu::open();
    let scene = scene();
    let mut render = |layers: Option<&'static [Layer]>| {
        gpu.render_with(&scene, |options| {
            (options.repeat_unchanged, options.layers) = (true, layers);
        })
    };
    let plain = render(None);
    let named = render(Some(&NAMED));
    let again = render(Some(&NAMED));
    let fewer = render(Some(&NAMED[..2]));
    let is_drawn = |frame: &Frame| !frame.stats.passes.is_empty();
    let drawn = [&plain, &named, &again, &fewer].map(is_drawn);
    assert_eq!(drawn, [true, true, false, false]);
    assert!(data(&plain, Layer::Texcoord).is_none());
    for layer in NAMED {
        assert!(data(&named, layer) == data(&again, layer), "{layer:?}");
    }
    let ids = again.ids(Layer::TriangleId).expect("it is named");
    assert!(ids.iter().any(|&id| id > 1));
}
