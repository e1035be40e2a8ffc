//! What the keys of MTL files say: facets, emission, models of illumination.

use crate::common::scene_folder::{SceneFolder, TRIANGLE, assert_says};
use camlux::scene::{Encoding, IndirectLight, MetallicRoughness, Texels, Wrap};

#[test]
fn physically_based_materials_are_facets() {
    let folder = SceneFolder::new();
    let grey = |values: &[u8], [width, height]: [u32; 2]| {
        let mut png = std::io::Cursor::new(Vec::new());
        let picture = image::GrayImage::from_raw(width, height, values.to_vec()).unwrap();
        picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
        png.into_inner()
    };
    folder
        .write("rough.png", grey(&[0, 255], [2, 1]))
        .write("metal.png", grey(&[51, 102], [2, 1]))
        .write("large.png", grey(&[1, 2, 3, 4], [2, 2]));
    let read = |lines: &str| {
        folder.write("mesh.mtl", format!("newmtl white\nKd 0.8 0.5 0.2\n{lines}"));
        folder.load_obj(TRIANGLE)
    };
    let scene = read("Ks 0.5\nNs 9\nPr 0.4\nPm 1\n").unwrap();
    let material = &scene.materials[0];
    let due = MetallicRoughness {
        metallic: 1.0,
        roughness: 0.4,
        ..MetallicRoughness::DEFAULT
    };
    assert_eq!(
        (material.microfacets, material.kd),
        (Some(due), [0.8, 0.5, 0.2])
    );
    assert_eq!(material.ks, [0.0; 3]);
    assert_eq!(scene.warnings().len(), 1, "Ks and Ns are named");
    let scene = read("Pr 0.01\n").unwrap();
    assert_eq!(scene.materials[0].microfacets.unwrap().roughness, 0.03);

    let texels = |lines: &str| {
        let scene = read(lines).unwrap();
        let facets = scene.materials[0].microfacets.unwrap();
        let lookup = scene.materials[0].metallic_roughness_texture.unwrap();
        let texels = Vec::from_iter(scene.textures[lookup.texture].texels.reflectances());
        (facets.roughness, facets.metallic, texels)
    };
    let near = |found: &[[f32; 3]], due: [[f32; 2]; 2]| {
        let pairs = found.iter().zip(due);
        pairs
            .map(|(a, [g, b])| (a[1] - g).abs() + (a[2] - b).abs())
            .sum::<f32>()
            < 1e-4
    };
    let (roughness, metallic, both) = texels("map_Pr rough.png\nmap_Pm metal.png\n");
    assert_eq!((roughness, metallic), (1.0, 1.0));
    assert!(near(&both, [[0.0, 0.2], [1.0, 0.4]]), "{both:?}");
    let (_, metallic, one) = texels("map_Pr rough.png\n");
    assert!(
        metallic == 0.0 && near(&one, [[0.0, 1.0], [1.0, 1.0]]),
        "{one:?}"
    );

    let refused = |lines: &str| read(lines).unwrap_err().to_string();
    let message = refused("map_Pr rough.png\nmap_Pm large.png\n");
    assert!(
        message.contains("images of different sizes; scale one"),
        "{message}"
    );
    let message = refused("map_Pr rough.png\nmap_Pm -s 2 metal.png\n");
    assert!(
        message.contains("have different options; give both"),
        "{message}"
    );
}

/// Ke is a radiance, of materials of both kinds. A map alone, or beside the Ke of 0 that exporters write, is as bright as its texels.
#[test]
fn surfaces_emit_what_ke_and_its_map_say() {
    let folder = SceneFolder::new();
    let texels = image::RgbImage::from_raw(2, 1, vec![10, 20, 30, 200, 100, 50]).unwrap();
    texels.save(folder.path("glow.png")).unwrap();
    let emission = |lines: &str| {
        folder.write("mesh.mtl", format!("newmtl white\nKd 0.5\n{lines}"));
        let scene = folder.load_obj(&TRIANGLE.replace("f 1 2 3", "vt 0 0\nf 1/1 2/1 3/1"));
        let mut scene = scene.unwrap();
        // Without it, a warning says that the surface lights nothing.
        scene.indirect = Some(IndirectLight::final_gather(0.1));
        assert!(
            scene.warnings().is_empty(),
            "{lines}: {}",
            scene.warnings().join("\n")
        );
        let material = &scene.materials[0];
        let texels = material.emission_texture.map(|lookup| {
            assert_eq!(lookup.wrap, [Wrap::Clamp; 2]);
            scene.textures[lookup.texture].texels.clone()
        });
        assert!(!material.is_one_sided);
        (material.emission_w_sr_m2, texels)
    };
    let texels = || {
        let texels = vec![[10, 20, 30], [200, 100, 50]];
        Some(Texels::U8(texels, Encoding::Srgb))
    };
    assert_eq!(emission(""), ([0.0; 3], None));
    assert_eq!(emission("Ke 3 2.5 0\n"), ([3.0, 2.5, 0.0], None));
    assert_eq!(emission("Pr 0.5\nKe 20\n"), ([20.0; 3], None));
    assert_eq!(emission("illum 0\nKe 2\n"), ([2.0; 3], None));
    let map = "map_Ke -clamp on glow.png\n";
    assert_eq!(emission(map), ([1.0; 3], texels()));
    assert_eq!(emission(&format!("Ke 0 0 0\n{map}")), ([1.0; 3], texels()));
    assert_eq!(
        emission(&format!("Ke 0 4 0\n{map}")),
        ([0.0, 4.0, 0.0], texels())
    );
    assert_eq!(emission(&format!("Pr 1\n{map}")), ([1.0; 3], texels()));

    folder.write("mesh.mtl", "newmtl white\nKd 0.5\nKe -1 0 0\n");
    let message = folder.load_obj(TRIANGLE).unwrap_err().to_string();
    assert_says(
        &message,
        &["emission_w_sr_m2 is [-1.0, 0.0, 0.0]", "from 0 to 1e24"],
    );
}

#[test]
fn illumination_models_without_highlights_have_none() {
    let folder = SceneFolder::new();
    let ks = |lines: &str| {
        folder.write("mesh.mtl", format!("newmtl white\nKd 0.1\nKs 0.9\n{lines}"));
        let scene = folder.load_obj(TRIANGLE).unwrap();
        assert!(scene.warnings().is_empty());
        scene.materials[0].ks
    };
    assert_eq!(ks("illum 1\nNs 5\n"), [0.0; 3]);
    assert_eq!(ks("illum 0\n"), [0.0; 3]);
    assert_eq!(ks("illum 2\nNs 5\n"), [0.9; 3]);
    assert_eq!(ks("Ns 5\n"), [0.9; 3]);
}
