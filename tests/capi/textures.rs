//! Textures in the roles that materials give them.

use crate::host::*;
use camlux::{
    capi::*,
    scene::{Encoding, Lens, MetallicRoughness, Texels, Texture, TextureRole, TextureSource},
};

/// R, G, B, alpha.
const PIXELS: [[u8; 4]; 4] = [
    [128, 160, 250, 255],
    [100, 100, 240, 100],
    [180, 128, 200, 200],
    [128, 110, 255, 150],
];

/// A demo scene without its textures.
fn untextured() -> camlux::Scene {
    let mut scene = engine_scene("textured", [24, 20]);
    // The whole view in few pixels, not a corner of it.
    scene.camera.lens = Lens::FovY { fov_y_deg: 48.0 };
    scene.textures.clear();
    for material in &mut scene.materials {
        material.kd_texture = None;
    }
    scene
}

fn texture(texels: Texels) -> Texture {
    Texture {
        name: "four".into(),
        size_px: [2, 2],
        texels,
    }
}

fn four<C>(pixels: &[C; 16], component: i32) -> camlux_texture {
    init!(camlux_texture {
        width_px: 2,
        height_px: 2,
        channels: 4,
        component: component,
        pixels: pixels.as_ptr().cast(),
    })
}

/// Integers are sRGB as k_d and linear as normals. Alpha is the fourth channel, and linear.
#[test]
fn a_role_decides_how_pixels_are_read() {
    let device = Device::open();
    let renderer = device.renderer();
    let of_8_bits: [u8; 16] = PIXELS.as_flattened().try_into().expect("four pixels");
    let of_16_bits: [u16; 16] = of_8_bits.map(|value| 257 * u16::from(value));
    let real = of_8_bits.map(|value| f32::from(value) / 255.0);
    let rgb = PIXELS.map(|[r, g, b, _]| [r, g, b]).to_vec();
    let rgb_16: Vec<_> = rgb.iter().map(|t| t.map(|v| 257 * u16::from(v))).collect();
    let rgb_real: Vec<_> = rgb
        .iter()
        .map(|t| t.map(|v| f32::from(v) / 255.0))
        .collect();
    let alpha = Texels::U8(PIXELS.map(|p| [p[3]; 3]).to_vec(), Encoding::Linear);
    for (given, [as_kd, as_normals]) in [
        (
            four(&of_8_bits, CAMLUX_COMPONENT_U8),
            [Encoding::Srgb, Encoding::Linear].map(|e| Texels::U8(rgb.clone(), e)),
        ),
        (
            four(&of_16_bits, CAMLUX_COMPONENT_U16),
            [Encoding::Srgb, Encoding::Linear].map(|e| Texels::U16(rgb_16.clone(), e)),
        ),
        (
            four(&real, CAMLUX_COMPONENT_F32),
            [(); 2].map(|()| Texels::F32(rgb_real.clone())),
        ),
    ] {
        let mut expected = untextured();
        let scene = from_arrays(&expected);
        let number = scene.add_texture(&given).expect("it is added");
        assert_eq!(number, 1);
        let plain = renderer.render(&scene).layers();
        for (index, due) in expected.materials.iter_mut().enumerate() {
            due.kd_texture = Some(0.into());
            due.normal_texture = Some(1.into());
            due.alpha_texture = Some(2.into());
            let mut found = scene.material(index as u32);
            found.kd_texture = number;
            found.normal_texture = number;
            found.alpha_texture = number;
            ok(scene.set_material(index as u32, &found));
            let found = scene.material(index as u32);
            assert_eq!((found.kd_texture, found.normal_texture), (number, number));
            assert_eq!(found.alpha_texture, number);
        }
        expected.textures = [as_kd, as_normals, alpha.clone()]
            .map(|texels| texture(texels).into())
            .to_vec();
        let found = renderer.render(&scene).layers();
        assert!(found == engine_frame(&expected));
        assert!(found != plain);
    }
}

#[test]
fn facets_are_those_of_the_engine() {
    let device = Device::open();
    let renderer = device.renderer();
    let texels = [[9_u8, 128, 250], [9, 255, 51]];
    let source = TextureSource::from_pixels("two".into(), [2, 1], texels.as_flattened(), 3, None)
        .expect("a texture");
    let mut expected = untextured();
    let scene = from_arrays(&expected);
    let given = init!(camlux_texture {
        width_px: 2,
        height_px: 1,
        channels: 3,
        pixels: texels.as_ptr().cast(),
    });
    let number = scene.add_texture(&given).expect("it is added");
    expected.textures = vec![source.in_role(TextureRole::MetallicRoughness)];
    for (index, due) in expected.materials.iter_mut().enumerate() {
        let of = MetallicRoughness {
            metallic: 0.9,
            roughness: 0.7,
            ior: 1.4,
            specular: 0.5,
        };
        (due.ks, due.microfacets) = ([0.0; 3], Some(of));
        due.metallic_roughness_texture = Some(0.into());
        let mut found = scene.material(index as u32);
        assert_eq!(
            (found.roughness, found.ior, found.specular),
            (0.0, 1.5, 1.0)
        );
        found.ks = [0.0; 3];
        (found.roughness, found.metallic) = (of.roughness, of.metallic);
        (found.ior, found.specular) = (of.ior, of.specular);
        found.metallic_roughness_texture = number;
        ok(scene.set_material(index as u32, &found));
        let again = scene.material(index as u32);
        assert_eq!((again.roughness, again.metallic), (0.7, 0.9));
        assert_eq!((again.ior, again.specular), (1.4, 0.5));
        assert_eq!(again.metallic_roughness_texture, number);
    }
    let frame = renderer.render(&scene).layers();
    assert!(frame == engine_frame(&expected));
    let mut wrong = scene.material(0);
    wrong.roughness = 0.01;
    fails(scene.set_material(0, &wrong), SCENE, "roughness is 0.01");
}

#[test]
fn the_emission_and_the_sides_come_back() {
    let scene = from_arrays(&untextured());
    let grey = [200_u8];
    let number = scene.add_texture(&init!(camlux_texture {
        width_px: 1,
        height_px: 1,
        channels: 1,
        pixels: grey.as_ptr().cast(),
    }));
    let number = number.expect("it is added");
    let plain = scene.material(0);
    assert_eq!(plain.emission_w_sr_m2, [0.0; 3]);
    assert_eq!((plain.emission_texture, plain.one_sided), (0, 0));
    let mut given = plain;
    given.emission_w_sr_m2 = [1.0 / 3.0, 2.0, 1e20];
    (given.emission_texture, given.one_sided) = (number, 1);
    ok(scene.set_material(0, &given));
    let found = scene.material(0);
    assert_eq!(found.emission_w_sr_m2, given.emission_w_sr_m2);
    assert_eq!((found.emission_texture, found.one_sided), (number, 1));
    let refused = |change: fn(&mut camlux_material), status, words| {
        let mut wrong = given;
        change(&mut wrong);
        fails(scene.set_material(0, &wrong), status, words);
    };
    refused(|m| m.one_sided = 2, ARGUMENT, "one_sided is 2; give 0 or 1");
    refused(|m| m.emission_texture = 9, SCENE, "emission_texture is 9");
    refused(
        |m| m.emission_w_sr_m2[1] = -1.0,
        SCENE,
        "emission_w_sr_m2 is [",
    );
}

/// Textures of k_s and the shininess, and another cutoff of alpha.
#[test]
fn gloss_and_cutoff_are_those_of_the_engine() {
    let device = Device::open();
    let renderer = device.renderer();
    let greys = [64_u8, 128, 192, 255];
    let source =
        TextureSource::from_pixels("four".into(), [2, 2], &greys, 1, None).expect("a texture");
    let mut expected = untextured();
    for material in &mut expected.materials {
        (material.kd, material.ks, material.shininess) = ([0.3; 3], [0.5; 3], 8.0);
    }
    let scene = from_arrays(&expected);
    let given = init!(camlux_texture {
        width_px: 2,
        height_px: 2,
        channels: 1,
        pixels: greys.as_ptr().cast(),
    });
    let number = scene.add_texture(&given).expect("it is added");
    let roles = [TextureRole::Ks, TextureRole::Shininess, TextureRole::Alpha];
    expected.textures = roles.map(|role| source.in_role(role)).to_vec();
    let plain = renderer.render(&scene).layers();
    for (index, due) in expected.materials.iter_mut().enumerate() {
        (due.ks_texture, due.shininess_texture) = (Some(0.into()), Some(1.into()));
        (due.alpha_texture, due.alpha_cutoff) = (Some(2.into()), 0.2);
        let mut found = scene.material(index as u32);
        assert_eq!((found.ks_texture, found.alpha_cutoff), (0, 0.5));
        (found.ks_texture, found.shininess_texture) = (number, number);
        (found.alpha_texture, found.alpha_cutoff) = (number, 0.2);
        ok(scene.set_material(index as u32, &found));
        let found = scene.material(index as u32);
        assert_eq!([found.ks_texture, found.shininess_texture], [number; 2]);
        assert_eq!(found.alpha_cutoff, 0.2);
    }
    let textured = renderer.render(&scene).layers();
    assert!(textured == engine_frame(&expected));
    assert!(textured != plain);
    let before = scene.material(0);
    let (mut opaque, mut missing) = (before, before);
    (opaque.alpha_cutoff, missing.ks_texture) = (1.5, 2);
    fails(scene.set_material(0, &opaque), SCENE, "alpha_cutoff is 1.5");
    fails(scene.set_material(0, &missing), SCENE, "ks_texture is 2");
}

#[test]
fn an_encoding_that_contradicts_a_role_is_refused() {
    let scene = from_arrays(&untextured());
    let pixels = PIXELS.as_flattened().try_into().expect("four pixels");
    let mut srgb = four(&pixels, CAMLUX_COMPONENT_U8);
    srgb.encoding = CAMLUX_ENCODING_SRGB;
    srgb.name = c"bricks".as_ptr();
    let with_alpha = scene.add_texture(&srgb).expect("it is added");
    (srgb.channels, srgb.row_stride_bytes) = (3, 8);
    let without = scene.add_texture(&srgb).expect("it is added");
    let before = scene.material(0);
    // The colours of a cut-out may be sRGB: its alpha is not.
    let mut fine = before;
    (fine.kd_texture, fine.alpha_texture) = (with_alpha, with_alpha);
    ok(scene.set_material(0, &fine));
    let (mut normals, mut alpha) = (before, before);
    (normals.normal_texture, alpha.alpha_texture) = (with_alpha, without);
    let words = "the texture of normal_texture is encoded as sRGB";
    fails(scene.set_material(0, &normals), SCENE, words);
    let refused = scene.set_material(0, &alpha);
    fails(refused, SCENE, "make its encoding linear");
    fails(scene.add_material(&normals).unwrap_err(), SCENE, words);
    // A texture in use cannot take such an encoding.
    srgb.encoding = CAMLUX_ENCODING_DEFAULT;
    ok(scene.set_texture(without, &srgb));
    ok(scene.set_material(0, &alpha));
    srgb.encoding = CAMLUX_ENCODING_SRGB;
    let words = "the texture of alpha_texture is encoded as sRGB";
    fails(scene.set_texture(without, &srgb), SCENE, words);
}

#[test]
fn zeros_stand_for_no_texture() {
    let scene = from_arrays(&untextured());
    let pixels = PIXELS.as_flattened().try_into().expect("four pixels");
    let texture = four(&pixels, CAMLUX_COMPONENT_U8);
    assert_eq!(scene.add_texture(&texture).expect("it is added"), 1);
    let mut zeros = camlux_material {
        struct_size: camlux_material::default().struct_size,
        // SAFETY: any bytes are a valid struct.
        ..unsafe { std::mem::zeroed() }
    };
    ok(scene.set_material(0, &zeros));
    let found = scene.material(0);
    let numbers = [found.kd_texture, found.normal_texture, found.alpha_texture];
    assert_eq!(numbers, [0; 3]);
    // What stood for none before.
    zeros.normal_texture = u32::MAX;
    fails(scene.set_material(0, &zeros), SCENE, "or 0 for none");
    let refused = scene.set_texture(0, &texture);
    fails(refused, ARGUMENT, "textures count from 1");
    assert_eq!(scene.counts().textures, 1);
}

/// Also a texture of a file that has two roles, such as the leaf's, whose alpha cuts it out.
#[test]
fn materials_of_a_file_can_be_set_again() {
    let device = Device::open();
    let renderer = device.renderer();
    for name in ["leaves", "bumps"] {
        let frames = [false, true].map(|is_set| {
            let scene = load_at(name, [24, 20]);
            for index in 0..scene.counts().materials {
                if is_set {
                    ok(scene.set_material(index, &scene.material(index)));
                }
            }
            renderer.render(&scene).layers()
        });
        assert!(frames[0] == frames[1], "{name}");
    }
}
