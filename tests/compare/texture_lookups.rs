//! Textures that are looked up in other ways than the usual one, against rays in f64, against surfaces without textures, and against the
//! reference.

use crate::common::gpu::{Gpu, demo_scene, distort, radial};
use crate::common::reference_frame::{error_off_edges, reference_frame, values};
use crate::common::rmse::relative_rmse_where;
use crate::common::rooms::{quad, scene_of};
use crate::geometry::{camera_errors, compare, render, with_rsm};
use camlux::{
    Scene,
    hard_cases::scenes::grid,
    output::{Frame, Layer},
    scene::{
        Encoding, Filter, IndirectLight, Light, Material, Mesh, MetallicRoughness, Shadow, Shared,
        Texels, Texture, TextureLookup, Wrap,
    },
};
use glam::DVec3;

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
/// Turned, stretched, and moved to where coordinates are negative.
const TRANSFORM: [[f64; 3]; 2] = [[0.9, 0.4, -1.7], [-0.5, 0.7, -0.9]];

/// A texture of random colours.
fn noise(size_px: [u32; 2], seed: u64) -> Shared<Texture> {
    let random = &mut fastrand::Rng::with_seed(seed);
    let mut texel = || [0; 3].map(|_| random.u8(..));
    Shared::from(Texture {
        name: "noise".into(),
        size_px,
        texels: Texels::U8(
            (0..size_px[0] * size_px[1]).map(|_| texel()).collect(),
            Encoding::Linear,
        ),
    })
}

/// The textured room with one texture on everything.
fn looked_up(lookup: TextureLookup) -> Scene {
    let mut scene = demo_scene("textured", [64, 64]);
    scene.textures = vec![noise([5, 3], 1)];
    for mesh in &mut scene.meshes {
        mesh.texcoords_1 = mesh
            .texcoords
            .iter()
            .map(|[u, v]| [v + 0.3, 0.5 - u])
            .collect();
    }
    for material in &mut scene.materials {
        material.kd_texture = Some(lookup);
    }
    scene
}

fn through_lens(mut scene: Scene) -> Scene {
    distort(&mut scene, radial(-0.1, 0.02));
    scene
}

/// In G-buffers and in reflective shadow maps.
#[test]
fn wraps_transforms_and_sets_are_where_rays_hit() {
    let mut gpu = Gpu::open();
    for (i, wrap_u) in WRAPS.into_iter().enumerate() {
        for (j, wrap_v) in WRAPS.into_iter().enumerate() {
            let lookup = TextureLookup {
                wrap: [wrap_u, wrap_v],
                transform: TRANSFORM,
                texcoord_set: ((i + j) % 2) as u32,
                ..TextureLookup::from(0)
            };
            let what = format!("{lookup:?}");
            let scene = with_rsm(looked_up(lookup), 32);
            compare(&mut gpu, &what, &scene, 0.05);
            let scene = through_lens(scene);
            let (frame, kept) = render(&mut gpu, &scene);
            camera_errors(&scene, &frame, &kept).check(&what, 0.05);
        }
    }
}

/// The number of pixels whose direct light differs by more than rounding.
fn differing(a: &Frame, b: &Frame) -> usize {
    let [a, b] = [a, b].map(|frame| values(frame, Layer::Direct));
    let most = b.iter().copied().fold(0.0, f32::max);
    assert!(most > 0.0, "black images prove nothing");
    let pixels = a.chunks(3).zip(b.chunks(3));
    let is_off = |(a, b): &(&[f32], &[f32])| {
        let mut bands = a.iter().zip(*b);
        bands.any(|(a, b)| (a - b).abs() > 1e-3 * most)
    };
    pixels.filter(is_off).count()
}

/// A floor with one lookup of a texture of 3 x 3 texels, u and v from −1 to 2; and the same floor of 9 x 9 cells without textures, where each
/// cell has the material of the texel that it shows.
fn checked(wrap: [Wrap; 2]) -> [Scene; 2] {
    let shown = |wrap: Wrap| match wrap {
        Wrap::Repeat => [0, 1, 2, 0, 1, 2, 0, 1, 2],
        Wrap::Mirror => [2, 1, 0, 0, 1, 2, 2, 1, 0],
        Wrap::Clamp => [0, 0, 0, 0, 1, 2, 2, 2, 2],
    };
    let kd = |texel: usize| [(1 + texel) as f64 / 10.0, 0.5, (9 - texel) as f64 / 10.0];
    let corner = DVec3::new(-1.03, 0.0, 1.02);
    let edges = [2.07 * DVec3::X, -2.05 * DVec3::Z];
    let light = Light::point(DVec3::new(0.3, 1.4, 0.2), [10.0; 3]);
    let view = |mesh| {
        scene_of(
            vec![mesh],
            light.clone(),
            DVec3::new(0.4, 1.6, 1.1),
            DVec3::ZERO,
        )
    };
    let mut textured = quad("floor", corner, edges[0], edges[1], 0);
    textured.texcoords = vec![[-1.0, -1.0], [2.0, -1.0], [2.0, 2.0], [-1.0, 2.0]];
    let mut textured = view(textured);
    textured.textures = vec![Shared::from(Texture {
        name: "checks".into(),
        size_px: [3, 3],
        texels: Texels::F32((0..9).map(|i| kd(i).map(|kd| kd as f32)).collect()),
    })];
    textured.materials = vec![Material {
        kd_texture: Some(TextureLookup {
            wrap,
            filter: Filter::Nearest,
            ..TextureLookup::from(0)
        }),
        ..Material::lambert("checks", [1.0; 3])
    }];
    let mut cells = grid("floor", [corner, edges[0], edges[1]], [9, 9], 0);
    let materials = (0..81).flat_map(|cell| {
        let column = shown(wrap[0])[cell % 9];
        // Rows of cells go up with v, and those of texels down.
        let row = 2 - shown(wrap[1])[cell / 9];
        [3 * row + column; 2]
    });
    cells.triangle_materials = materials.map(|material| material as u32).collect();
    let mut cells = view(cells);
    cells.materials = (0..9).map(|i| Material::lambert("", kd(i))).collect();
    for scene in [&mut textured, &mut cells] {
        scene.direct.shadow = Some(Shadow::Rays);
    }
    [textured, cells]
}

#[test]
fn nearest_texels_are_cells_of_a_floor() {
    let mut gpu = Gpu::open();
    for wrap_u in WRAPS {
        for wrap_v in WRAPS {
            let scenes = checked([wrap_u, wrap_v]);
            let [found, due] = scenes.each_ref().map(|scene| reference_frame(scene, 1, 0));
            let count = differing(&found, &due);
            assert!(
                count <= 2,
                "reference, {wrap_u:?}, {wrap_v:?}: {count} pixels"
            );
            let [textured, _] = scenes;
            let count = differing(&gpu.render(&textured), &due);
            assert!(count <= 4, "{wrap_u:?}, {wrap_v:?}: {count} pixels");
        }
    }
}

/// Everything that a material can look up, each in its own way.
fn of_all_kinds() -> Scene {
    let mut scene = demo_scene("textured", [28, 28]);
    scene.textures.truncate(2);
    let first = scene.textures.len();
    let bumps = (0..64).map(|i| {
        let (x, y) = ((i % 8) as f32, (i / 8) as f32);
        let normal = glam::Vec3::new(0.4 * (0.8 * x).sin(), 0.4 * (0.8 * y).cos(), 1.0);
        (0.5 * normal.normalize() + 0.5).to_array()
    });
    scene.textures.extend([
        noise([6, 4], 2),
        noise([3, 7], 3),
        Shared::from(Texture {
            name: "bumps".into(),
            size_px: [8, 8],
            texels: Texels::F32(bumps.collect()),
        }),
        noise([4, 4], 4),
    ]);
    for mesh in &mut scene.meshes {
        mesh.texcoords_1 = mesh
            .texcoords
            .iter()
            .map(|[u, v]| [0.7 * v - 0.2, 0.6 * u])
            .collect();
    }
    for (i, material) in scene.materials.iter_mut().enumerate() {
        let wraps = |k: usize| [WRAPS[(i + k) % 3], WRAPS[(i + k + 1) % 3]];
        if let Some(lookup) = &mut material.kd_texture {
            lookup.wrap = wraps(0);
        }
        material.kd = [0.6; 3];
        material.ks = [0.35, 0.3, 0.25];
        material.shininess = 30.0;
        material.ks_texture = Some(TextureLookup {
            wrap: wraps(1),
            transform: TRANSFORM,
            ..first.into()
        });
        material.shininess_texture = Some(TextureLookup {
            wrap: wraps(2),
            texcoord_set: 1,
            ..(first + 1).into()
        });
        material.normal_texture = Some(TextureLookup {
            wrap: wraps(1),
            texcoord_set: 1,
            transform: TRANSFORM,
            ..(first + 2).into()
        });
        material.alpha_texture = Some(TextureLookup {
            wrap: wraps(2),
            transform: TRANSFORM,
            ..(first + 3).into()
        });
        material.alpha_cutoff = 0.3;
    }
    scene.direct.shadow = Some(Shadow::Rays);
    scene
}

#[test]
fn the_reference_looks_up_the_same() {
    assert_looks_up_the_same(
        of_all_kinds(),
        &[
            |material| material.ks_texture = None,
            |material| material.shininess_texture = None,
            |material| material.normal_texture = None,
            |material| material.alpha_texture = None,
        ],
    );
}

/// Some materials are of facets, beside Phong lobes.
#[test]
fn the_reference_looks_facets_up_the_same() {
    let mut scene = of_all_kinds();
    for material in scene.materials.iter_mut().step_by(2) {
        material.ks = [0.0; 3];
        material.ks_texture = None;
        material.metallic_roughness_texture = material.shininess_texture.take();
        material.microfacets = Some(MetallicRoughness {
            metallic: 0.8,
            roughness: 0.9,
            ..MetallicRoughness::DEFAULT
        });
    }
    assert_looks_up_the_same(
        scene,
        &[
            |material| material.metallic_roughness_texture = None,
            |material| material.kd_texture = None,
        ],
    );
}

/// Each of the textures that `forgets` remove matters.
fn assert_looks_up_the_same(mut scene: Scene, forgets: &[fn(&mut Material)]) {
    let mut gpu = Gpu::open();
    scene.indirect = Some(IndirectLight::final_gather(0.03));
    let truth = reference_frame(&scene, 1024, 8);
    let error = |frame: &Frame, layer| error_off_edges(frame, &truth, layer);
    for frame in gpu.render_by_each_tracer(&scene) {
        let layers = [
            Layer::Position,
            Layer::Normal,
            Layer::Direct,
            Layer::Indirect,
        ];
        let [position, normal, direct, indirect] = layers.map(|layer| error(&frame, layer));
        println!("P {position:.1e}, N {normal:.1e}, direct {direct:.1e}, indirect {indirect:.1e}");
        assert!(position < 1e-6 && normal < 1e-4, "{position} {normal}");
        // The exponent of a lobe magnifies the rounding of its normal.
        assert!(direct < 3e-4, "{direct}");
        assert!(indirect < 0.05, "{indirect}");
    }
    for (i, forget) in forgets.iter().enumerate() {
        let mut other = scene.clone();
        other.materials.iter_mut().for_each(forget);
        let other = error(&reference_frame(&other, 1, 0), Layer::Direct);
        assert!(other > 0.01, "without lookup {i}: {other}");
    }
}

/// relRMSE of two frames of one scene.
fn apart(a: &Frame, b: &Frame, layer: Layer) -> f64 {
    relative_rmse_where(values(a, layer), values(b, layer), |_| true)
}

/// Transformed coordinates of a mesh are as good as a transform of the lookup, and a second set is as good as a first. Normal maps follow.
#[test]
fn transforms_and_sets_are_other_coordinates() {
    let mut gpu = Gpu::open();
    let bumps = of_all_kinds().materials[0]
        .normal_texture
        .expect("it is there")
        .texture;
    let mut plain = of_all_kinds();
    plain.indirect = Some(IndirectLight::final_gather(0.05));
    for material in &mut plain.materials {
        let kd_texture = Some(bumps.into());
        *material = Material {
            kd_texture,
            normal_texture: kd_texture,
            ..Material::lambert("", [0.9; 3])
        };
    }
    let mut due = plain.clone();
    for mesh in &mut due.meshes {
        let transformed = |&[u, v]: &[f64; 2]| TRANSFORM.map(|[a, b, c]| a * u + b * v + c);
        mesh.texcoords = mesh.texcoords.iter().map(transformed).collect();
        mesh.texcoords_1.clear();
    }
    let mut by_transform = plain.clone();
    let mut by_set = plain;
    for (mesh, due) in by_set.meshes.iter_mut().zip(&due.meshes) {
        mesh.texcoords_1 = due.texcoords.clone();
    }
    for (transformed, other) in by_transform.materials.iter_mut().zip(&mut by_set.materials) {
        for lookup in [&mut transformed.kd_texture, &mut transformed.normal_texture] {
            lookup.as_mut().expect("it is there").transform = TRANSFORM;
        }
        for lookup in [&mut other.kd_texture, &mut other.normal_texture] {
            lookup.as_mut().expect("it is there").texcoord_set = 1;
        }
    }
    let layers = [Layer::Normal, Layer::Direct, Layer::Indirect];
    let [reference, frame] = [reference_frame(&due, 64, 2), gpu.render(&due)];
    for (what, scene) in [("transform", by_transform), ("set", by_set)] {
        let of_reference = reference_frame(&scene, 64, 2);
        let of_reference = layers.map(|layer| apart(&of_reference, &reference, layer));
        let found = gpu.render(&scene);
        let found = layers.map(|layer| apart(&found, &frame, layer));
        println!("{what}: {of_reference:?} {found:?}");
        assert!(
            of_reference.iter().all(|&e| e < 1e-6),
            "{what}: {of_reference:?}"
        );
        let [normal, direct, indirect] = found;
        // Rounding decides which light paths a final gather samples. Each image meets its target error.
        assert!(
            normal < 1e-3 && direct < 1e-3 && indirect < 2_f64.sqrt() * 0.05,
            "{what}: {found:?}"
        );
    }
}

/// Textures whose coordinates a mesh lacks are not applied: neither colours nor holes.
#[test]
fn textures_without_coordinates_are_not_applied() {
    let mut gpu = Gpu::open();
    let mut bare = of_all_kinds();
    bare.indirect = Some(IndirectLight::final_gather(0.05));
    for material in &mut bare.materials {
        *material = Material {
            kd: material.kd,
            ks: material.ks,
            shininess: material.shininess,
            ..Material::lambert("", [0.0; 3])
        };
    }
    let frame = gpu.render(&bare);
    for set in [1, 0] {
        let mut scene = of_all_kinds();
        scene.indirect = bare.indirect;
        for material in &mut scene.materials {
            for lookup in [
                &mut material.kd_texture,
                &mut material.ks_texture,
                &mut material.shininess_texture,
                &mut material.normal_texture,
                &mut material.alpha_texture,
            ] {
                let lookup = lookup.as_mut();
                lookup
                    .into_iter()
                    .for_each(|lookup| lookup.texcoord_set = set);
            }
        }
        for mesh in &mut scene.meshes {
            let mesh: &mut Mesh = mesh;
            [&mut mesh.texcoords, &mut mesh.texcoords_1][set as usize].clear();
        }
        let truth = reference_frame(&scene, 1, 0);
        let found = gpu.render(&scene);
        let by_lens = gpu.render(&through_lens(scene));
        for layer in [Layer::Position, Layer::Normal, Layer::Direct] {
            let error = error_off_edges(&found, &truth, layer);
            assert!(error < 3e-5, "set {set}, {layer:?}: {error}");
            let error = apart(&found, &frame, layer);
            assert!(error < 1e-6, "set {set}, {layer:?}: {error}");
        }
        let error = apart(&found, &frame, Layer::Indirect);
        assert!(error < 0.02, "set {set}: {error}");
        let of_lens = gpu.render(&through_lens(bare.clone()));
        let error = apart(&by_lens, &of_lens, Layer::Direct);
        assert!(error < 1e-6, "set {set} through a lens: {error}");
    }
}
