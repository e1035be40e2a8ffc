//! Textures arrive as linear reflectance, and each file once.

use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE};
use camlux::scene::{Encoding, Texels};

/// sRGB values of IEC 61966-2-1: 0 and 1, one on the linear part, one on the power part.
#[test]
fn textures_are_decoded_to_linear() {
    let folder = SceneFolder::new();
    // Directories show that map_Kd is relative to the MTL.
    std::fs::create_dir(folder.path("maps")).unwrap();
    let rgb8 = image::RgbImage::from_vec(2, 1, vec![0, 255, 10, 128, 188, 64]).unwrap();
    rgb8.save(folder.path("maps/rgb8.png")).unwrap();
    let grey16 = image::ImageBuffer::<image::Luma<u16>, _>::from_vec(1, 2, vec![32896_u16, 0]);
    grey16
        .unwrap()
        .save(folder.path("maps/grey16.png"))
        .unwrap();
    let grey8 = image::GrayImage::from_pixel(8, 8, image::Luma([128]));
    grey8.save(folder.path("maps/grey8.jpg")).unwrap();

    let decoded = |name: &str| {
        folder.write("mesh.obj", TRIANGLE.replace("mesh.mtl", "maps/mesh.mtl"));
        folder.write("maps/mesh.mtl", format!("newmtl white\nmap_Kd {name}\n"));
        let scene = folder.load(&format!("{CAMERA}{LIGHT}{MESH}")).unwrap();
        assert_eq!(scene.materials[0].kd_texture, Some(0));
        // Kd is absent, so the texture stands alone.
        assert_eq!(scene.materials[0].kd, [1.0; 3]);
        scene.textures.into_iter().next().unwrap()
    };
    // f32 rounding of values up to 1.
    let close = |actual: f32, expected: f64| (f64::from(actual) - expected).abs() < 1e-7;
    let mid = 0.215_860_500_113_899_26;

    let texture = decoded("rgb8.png");
    assert_eq!(texture.size_px, [2, 1]);
    assert!(matches!(&texture.texels, Texels::U8(texels, Encoding::Srgb) if texels.len() == 2));
    let [first, second] = [0, 1].map(|i| texture.texels.reflectance(i));
    assert_eq!(first[..2], [0.0, 1.0]);
    assert!(close(first[2], 10.0 / 255.0 / 12.92), "{first:?}");
    assert!(close(second[0], mid), "{second:?}");

    // 32896 = 128·257: the same grey in 16 bit; rows come from the top.
    let texture = decoded("grey16.png");
    assert_eq!(texture.size_px, [1, 2]);
    assert!(matches!(&texture.texels, Texels::U16(texels, Encoding::Srgb) if texels.len() == 2));
    let [first, second] = [0, 1].map(|i| texture.texels.reflectance(i));
    assert!(first.iter().all(|&value| close(value, mid)));
    assert_eq!(second, [0.0; 3]);

    // An even grey survives JPEG to within one 8-bit step, which is 0.004 here.
    let texture = decoded("grey8.jpg");
    assert!((f64::from(texture.texels.reflectance(9)[1]) - mid).abs() < 0.004);
}

#[test]
fn one_texture_file_is_loaded_once() {
    let folder = SceneFolder::new();
    let image = image::RgbImage::new(2, 2);
    image.save(folder.path("wood.png")).unwrap();
    folder.write(
        "mesh.mtl",
        "newmtl white\nmap_Kd wood.png\nnewmtl dark\nKd 0.5\nmap_Kd ./wood.png\n",
    );
    folder.write("mesh.obj", format!("{TRIANGLE}usemtl dark\nf 1 2 3\n"));
    let scene = folder
        .load(&format!("{CAMERA}{LIGHT}{MESH}{MESH}"))
        .unwrap();
    assert_eq!(scene.textures.len(), 1);
    assert_eq!(scene.materials.len(), 4);
    assert!(scene.materials.iter().all(|m| m.kd_texture == Some(0)));

    let warnings = scene.warnings().join("\n");
    assert!(
        warnings.contains("cannot be seen on mesh \"mesh.obj\""),
        "{warnings}"
    );
}
