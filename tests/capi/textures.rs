//! Textures in the roles that materials give them.

use std::ptr::null_mut;

use crate::host::*;
use camlux::{
    RenderOptions, Renderer, Scene,
    capi::*,
    scene::{Encoding, Lens, Texels, Texture, TextureRole, TextureSource},
};

const ARGUMENT: camlux_status = CAMLUX_ERROR_INVALID_ARGUMENT;
const SCENE: camlux_status = CAMLUX_ERROR_SCENE;
/// R, G, B, alpha.
const PIXELS: [[u8; 4]; 4] = [
    [128, 160, 250, 255],
    [100, 100, 240, 100],
    [180, 128, 200, 200],
    [128, 110, 255, 150],
];

/// A demo scene without its textures.
fn untextured() -> Scene {
    let path = scene_file("textured");
    let path = std::path::Path::new(path.to_str().expect("a UTF-8 path"));
    let mut scene = Scene::load(path).expect("a demo scene loads");
    scene.camera.resolution_px = [24, 20];
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

fn add_texture(scene: *mut camlux_scene, texture: &camlux_texture) -> u32 {
    let mut number = 0;
    // SAFETY: a struct of that size, with pixels of its size.
    ok(unsafe { camlux_scene_add_texture(scene, texture, &mut number) });
    number
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

fn material(scene: *mut camlux_scene, index: u32) -> camlux_material {
    let mut found = init!(camlux_material {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_get_material(scene, index, &mut found) });
    found
}

fn set_material(scene: *mut camlux_scene, index: u32, material: &camlux_material) -> camlux_status {
    // SAFETY: a struct of that size.
    unsafe { camlux_scene_set_material(scene, index, material) }
}

/// Integers are sRGB as k_d and linear as normals. Alpha is the fourth channel, and linear.
#[test]
fn a_role_decides_how_pixels_are_read() {
    let device = Device::open();
    let engine = camlux::Device::open(&Default::default()).expect("a device");
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
        let number = add_texture(scene, &given);
        assert_eq!(number, 1);
        let plain = layers_and_release(render(renderer, scene));
        for (index, due) in expected.materials.iter_mut().enumerate() {
            due.kd_texture = Some(0.into());
            due.normal_texture = Some(1.into());
            due.alpha_texture = Some(2.into());
            let mut found = material(scene, index as u32);
            found.kd_texture = number;
            found.normal_texture = number;
            found.alpha_texture = number;
            ok(set_material(scene, index as u32, &found));
            let found = material(scene, index as u32);
            assert_eq!((found.kd_texture, found.normal_texture), (number, number));
            assert_eq!(found.alpha_texture, number);
        }
        expected.textures = [as_kd, as_normals, alpha.clone()]
            .map(|texels| texture(texels).into())
            .to_vec();
        let found = layers_and_release(render(renderer, scene));
        let mut due = Renderer::new(&engine).expect("a renderer");
        let due = due.render(&expected, &mut RenderOptions::default());
        assert!(found == layers_of(&due.expect("the scene renders")));
        assert!(found != plain);
        ok(camlux_scene_release(scene));
    }
    ok(camlux_renderer_release(renderer));
}

/// Textures of k_s and the shininess, and another cutoff of alpha.
#[test]
fn gloss_and_cutoff_are_those_of_the_engine() {
    let device = Device::open();
    let engine = camlux::Device::open(&Default::default()).expect("a device");
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
    let number = add_texture(scene, &given);
    let roles = [TextureRole::Ks, TextureRole::Shininess, TextureRole::Alpha];
    expected.textures = roles.map(|role| source.in_role(role)).to_vec();
    let plain = layers_and_release(render(renderer, scene));
    for (index, due) in expected.materials.iter_mut().enumerate() {
        (due.ks_texture, due.shininess_texture) = (Some(0.into()), Some(1.into()));
        (due.alpha_texture, due.alpha_cutoff) = (Some(2.into()), 0.2);
        let mut found = material(scene, index as u32);
        assert_eq!((found.ks_texture, found.alpha_cutoff), (0, 0.5));
        (found.ks_texture, found.shininess_texture) = (number, number);
        (found.alpha_texture, found.alpha_cutoff) = (number, 0.2);
        ok(set_material(scene, index as u32, &found));
        let found = material(scene, index as u32);
        assert_eq!([found.ks_texture, found.shininess_texture], [number; 2]);
        assert_eq!(found.alpha_cutoff, 0.2);
    }
    let textured = layers_and_release(render(renderer, scene));
    let mut due = Renderer::new(&engine).expect("a renderer");
    let due = due.render(&expected, &mut RenderOptions::default());
    assert!(textured == layers_of(&due.expect("the scene renders")));
    assert!(textured != plain);
    let before = material(scene, 0);
    for (wrong, words) in [
        (
            camlux_material {
                alpha_cutoff: 1.5,
                ..before
            },
            "alpha_cutoff is 1.5",
        ),
        (
            camlux_material {
                ks_texture: 2,
                ..before
            },
            "ks_texture is 2",
        ),
    ] {
        fails(set_material(scene, 0, &wrong), SCENE, words);
    }
    ok(camlux_scene_release(scene));
    ok(camlux_renderer_release(renderer));
}

fn layers_and_release(frame: *mut camlux_frame) -> Vec<(i32, Vec<u32>)> {
    let layers = layers(frame);
    ok(camlux_frame_release(frame));
    layers
}

#[test]
fn an_encoding_that_contradicts_a_role_is_refused() {
    let scene = from_arrays(&untextured());
    let pixels = PIXELS.as_flattened().try_into().expect("four pixels");
    let mut srgb = four(&pixels, CAMLUX_COMPONENT_U8);
    srgb.encoding = CAMLUX_ENCODING_SRGB;
    srgb.name = c"bricks".as_ptr();
    let with_alpha = add_texture(scene, &srgb);
    (srgb.channels, srgb.row_stride_bytes) = (3, 8);
    let without = add_texture(scene, &srgb);
    let before = material(scene, 0);
    // The colours of a cut-out may be sRGB: its alpha is not.
    let fine = camlux_material {
        kd_texture: with_alpha,
        alpha_texture: with_alpha,
        ..before
    };
    ok(set_material(scene, 0, &fine));
    let normals = camlux_material {
        normal_texture: with_alpha,
        ..before
    };
    let words = "the texture of normal_texture is encoded as sRGB";
    fails(set_material(scene, 0, &normals), SCENE, words);
    let alpha = camlux_material {
        alpha_texture: without,
        ..before
    };
    fails(
        set_material(scene, 0, &alpha),
        SCENE,
        "make its encoding linear",
    );
    // SAFETY: structs of their size, with pixels of their size; no index requested.
    unsafe {
        let refused = camlux_scene_add_material(scene, &normals, null_mut());
        fails(refused, SCENE, words);
        // A texture in use cannot take such an encoding.
        srgb.encoding = CAMLUX_ENCODING_DEFAULT;
        ok(camlux_scene_set_texture(scene, without, &srgb));
        ok(set_material(scene, 0, &alpha));
        srgb.encoding = CAMLUX_ENCODING_SRGB;
        let refused = camlux_scene_set_texture(scene, without, &srgb);
        fails(
            refused,
            SCENE,
            "the texture of alpha_texture is encoded as sRGB",
        );
    }
    ok(camlux_scene_release(scene));
}

#[test]
fn zeros_stand_for_no_texture() {
    let scene = from_arrays(&untextured());
    let pixels = PIXELS.as_flattened().try_into().expect("four pixels");
    let texture = four(&pixels, CAMLUX_COMPONENT_U8);
    assert_eq!(add_texture(scene, &texture), 1);
    let mut zeros = camlux_material {
        struct_size: camlux_material::default().struct_size,
        // SAFETY: any bytes are a valid struct.
        ..unsafe { std::mem::zeroed() }
    };
    ok(set_material(scene, 0, &zeros));
    let found = material(scene, 0);
    let numbers = [found.kd_texture, found.normal_texture, found.alpha_texture];
    assert_eq!(numbers, [0; 3]);
    // What stood for none before.
    zeros.normal_texture = u32::MAX;
    fails(set_material(scene, 0, &zeros), SCENE, "or 0 for none");
    // SAFETY: a struct of that size, with pixels of its size.
    let refused = unsafe { camlux_scene_set_texture(scene, 0, &texture) };
    fails(refused, ARGUMENT, "textures count from 1");
    let mut counts = init!(camlux_scene_counts {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_get_counts(scene, &mut counts) });
    assert_eq!(counts.textures, 1);
    ok(camlux_scene_release(scene));
}

/// Also a texture of a file that has two roles, such as the leaf's, whose alpha cuts it out.
#[test]
fn materials_of_a_file_can_be_set_again() {
    let device = Device::open();
    let renderer = device.renderer();
    for name in ["leaves", "bumps"] {
        let frames = [false, true].map(|is_set| {
            let scene = load(name);
            resize(scene, 24, 20);
            let mut counts = init!(camlux_scene_counts {});
            // SAFETY: it points to a struct of that size.
            ok(unsafe { camlux_scene_get_counts(scene, &mut counts) });
            for index in 0..counts.materials {
                if is_set {
                    ok(set_material(scene, index, &material(scene, index)));
                }
            }
            let frame = render(renderer, scene);
            let layers = layers(frame);
            ok(camlux_frame_release(frame));
            ok(camlux_scene_release(scene));
            layers
        });
        assert!(frames[0] == frames[1], "{name}");
    }
    ok(camlux_renderer_release(renderer));
}
