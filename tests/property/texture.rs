//! Textures are decoded to linear reflectance, and each file is loaded once.

use crate::common::rows::assert_says;
use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE};
use camlux::scene::{Encoding, Scene, Shared, Texels, Texture, TextureLookup};

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
        assert_eq!(scene.materials[0].kd_texture, Some(0.into()));
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
        .load(&format!("{CAMERA}{LIGHT}{MESH}{MESH}flat = true\n"))
        .unwrap();
    assert_eq!(scene.textures.len(), 1);
    assert_eq!(scene.materials.len(), 4);
    assert!(
        scene
            .materials
            .iter()
            .all(|m| m.kd_texture == Some(0.into()))
    );

    let warnings = scene.warnings().join("\n");
    assert_says(&warnings, &["cannot be seen on mesh \"mesh.obj\""]);
    assert!(!warnings.contains("multiplies"), "{warnings}");

    let mut scene = scene;
    scene.materials[0].kd = [0.0; 3];
    scene.materials[1].ks_texture = Some(0.into());
    scene.materials[2].emission_texture = Some(0.into());
    let warnings = scene.warnings().join("\n");
    for says in [
        "the kd_texture of material \"white\" multiplies kd, which is 0, so it cannot be seen; set kd to 1",
        "multiplies ks, which is 0, so it cannot be seen; set ks to 1",
        "multiplies emission_w_sr_m2, which is 0, so it cannot be seen; set emission_w_sr_m2 to 1",
    ] {
        assert!(warnings.contains(says), "{says}: {warnings}");
    }
}

/// A normal map is linear. In a bump map, grey values are heights, and colours are normals whose slopes -bm multiplies.
#[test]
fn maps_of_normals_are_read() {
    let folder = SceneFolder::new();
    let bluish = image::RgbImage::from_pixel(2, 2, image::Rgb([153, 102, 230]));
    bluish.save(folder.path("normals.png")).unwrap();
    // A ramp of 51/255 = 0.2 per column, which repeats; all rows are equal.
    let ramp = image::GrayImage::from_fn(5, 4, |x, _| image::Luma([51 * x as u8]));
    ramp.save(folder.path("ramp.png")).unwrap();
    folder.write(
        "mesh.obj",
        TRIANGLE.replace("f 1 2 3\n", "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"),
    );
    let load = |line: &str| {
        folder.write("mesh.mtl", format!("newmtl white\nKd 0.5\n{line}\n"));
        let scene = folder.load(&format!("{CAMERA}{LIGHT}{MESH}"));
        scene.map_err(|error| error.to_string())
    };
    let normal = |line: &str, texel: usize| {
        let scene = load(line).unwrap();
        assert_eq!(scene.materials[0].normal_texture, Some(0.into()));
        assert_eq!(scene.materials[0].kd_texture, None);
        let texel = scene.textures[0].texels.reflectance(texel);
        texel.map(|value| 2.0 * f64::from(value) - 1.0)
    };
    let close = |found: [f64; 3], due: [f64; 3]| {
        let length = due.iter().map(|x| x * x).sum::<f64>().sqrt();
        let near = found
            .iter()
            .zip(due)
            .all(|(x, y)| (x - y / length).abs() < 1e-6);
        assert!(near, "{found:?} for {due:?}");
    };
    let as_it_is = [153, 102, 230].map(|value| 2.0 * f64::from(value) / 255.0 - 1.0);
    for line in ["norm normals.png", "map_Bump normals.png"] {
        assert_eq!(
            normal(line, 3).map(|x| (x * 1e6).round()),
            as_it_is.map(|x| (x * 1e6).round())
        );
    }
    let [x, y, z] = as_it_is;
    close(
        normal("map_bump -bm 0.5 normals.png", 0),
        [0.5 * x, 0.5 * y, z],
    );
    // The ramp rises by 0.2 per texel in its middle and falls by 0.6 over two texels at its ends.
    close(normal("bump ramp.png", 2), [-0.2, 0.0, 1.0]);
    close(normal("map_Bump -bm 2 ramp.png", 7), [-0.4, 0.0, 1.0]);
    close(normal("map_Bump ramp.png", 5), [0.3, 0.0, 1.0]);
    for (line, part) in [
        (
            "norm -bm much normals.png",
            "mesh.mtl:3: \"norm\" has a -bm that is not a number",
        ),
        (
            "map_Bump -bm much normals.png",
            "has a -bm that is not a number",
        ),
        ("map_Bump -bm 2", "names no file"),
        (
            "norm normals.png\nmap_Bump ramp.png",
            "mesh.mtl:4: \"map_Bump\" is the second map of normals",
        ),
        ("norm none.png", "none.png"),
    ] {
        let error = load(line).expect_err(line);
        assert!(error.contains(part), "{part} is missing in: {error}");
    }
}

/// `map_d`: an alpha channel takes precedence over grey values. An image that cuts nothing out becomes no texture.
#[test]
fn where_a_material_is_comes_from_alpha_or_grey() {
    let folder = SceneFolder::new();
    let leaf = image::RgbaImage::from_fn(3, 1, |x, _| image::Rgba([200, 10, 10, 120 * x as u8]));
    leaf.save(folder.path("leaf.png")).unwrap();
    let grey = image::GrayImage::from_fn(3, 1, |x, _| image::Luma([120 * x as u8]));
    grey.save(folder.path("grey.png")).unwrap();
    let whole = image::GrayImage::from_pixel(2, 2, image::Luma([128]));
    whole.save(folder.path("whole.png")).unwrap();
    folder.write(
        "mesh.obj",
        TRIANGLE.replace("f 1 2 3\n", "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"),
    );
    let load = |line: &str| {
        folder.write("mesh.mtl", format!("newmtl white\nKd 0.5\n{line}\n"));
        let scene = folder.load(&format!("{CAMERA}{LIGHT}{MESH}"));
        scene.map_err(|error| error.to_string())
    };
    for line in ["map_d leaf.png", "map_d grey.png"] {
        let scene = load(line).unwrap();
        assert_eq!(scene.materials[0].alpha_texture, Some(0.into()), "{line}");
        let due = [[0; 3], [120; 3], [240; 3]];
        assert_eq!(
            scene.textures[0].texels,
            Texels::U8(due.into(), Encoding::Linear)
        );
    }
    // One file for both.
    let scene = load("map_Kd leaf.png\nmap_d leaf.png").unwrap();
    let material = &scene.materials[0];
    assert_eq!(
        (material.kd_texture, material.alpha_texture),
        (Some(0.into()), Some(1.into()))
    );
    let scene = load("map_d whole.png").unwrap();
    assert_eq!(
        (scene.materials[0].alpha_texture, scene.textures.len()),
        (None, 0)
    );
    for (line, part) in [
        ("map_d none.png", "mesh.mtl:3: cannot read the texture"),
        ("map_d", "mesh.mtl:3: \"map_d\""),
        (
            "map_d leaf.png\nmap_d grey.png",
            "mesh.mtl:4: \"map_d\" is the second",
        ),
    ] {
        let error = load(line).expect_err(line);
        assert!(error.contains(part), "{part} is missing in: {error}");
    }
}

/// A `[[texture]]` without an encoding: its use decides. With one, every use reads it as it is.
#[test]
fn a_texture_of_the_scene_file_is_read_by_its_use() {
    let folder = SceneFolder::new();
    let pixels = [[200, 10, 10, 0], [100, 20, 250, 255]];
    let image = image::RgbaImage::from_fn(2, 1, |x, _| image::Rgba(pixels[x as usize]));
    image.save(folder.path("leaf.png")).unwrap();
    folder.write("mesh.obj", TRIANGLE);
    folder.write("mesh.mtl", "newmtl white\nKd 0.5\n");
    let texels = |encoding: &str| {
        let texture = format!("[[texture]]\npath = \"leaf.png\"\n{encoding}");
        let material = "[material.leaf]\nkd = 0.5\nks = 0.1\nshininess = 9\nkd_texture = 0\nshininess_texture = 0\nnormal_texture = 0\nalpha_texture = 0\n";
        let scene = folder
            .load(&format!("{CAMERA}{LIGHT}{texture}{material}{MESH}"))
            .unwrap();
        let of_role = scene.materials[0].textures();
        of_role
            .map(|(_, lookup)| scene.textures[lookup.texture].texels.clone())
            .collect::<Vec<_>>()
    };
    let colors = pixels.map(|[r, g, b, _]| [r, g, b]).to_vec();
    let linear = Texels::U8(colors.clone(), Encoding::Linear);
    let [kd, shininess, normals, alpha] = texels("").try_into().unwrap();
    assert_eq!(kd, Texels::U8(colors, Encoding::Srgb));
    assert!((shininess.reflectance(0)[0] - (0.2126 * 200.0 + 7.874) / 255.0).abs() < 1e-6);
    assert_eq!(normals, linear);
    let due = Texels::U8(vec![[0; 3], [255; 3]], Encoding::Linear);
    assert_eq!(alpha, due);
    assert_eq!(texels("encoding = \"linear\"\n"), vec![linear; 4]);
}

/// Textures and colours that darken a surface count, and so do coordinates that are not there.
#[test]
fn warnings_know_lookups_and_colours() {
    let folder = SceneFolder::new();
    folder.write("mesh.obj", TRIANGLE);
    folder.write(
        "mesh.mtl",
        "newmtl white\nKd .7 .7 .7\nKs .5 .5 .5\nNs 10\n",
    );
    let scene = folder.load(&format!("{CAMERA}{LIGHT}{MESH}")).unwrap();
    let is_too_bright = |edit: &dyn Fn(&mut Scene)| {
        let mut scene = scene.clone();
        scene.textures.push(Shared::from(Texture {
            name: "half".into(),
            size_px: [1, 1],
            texels: Texels::F32(vec![[0.5; 3]]),
        }));
        let count = scene.meshes[0].positions_m.len();
        scene.meshes[0].texcoords = vec![[0.0; 2]; count];
        edit(&mut scene);
        scene.validate().unwrap();
        scene.warnings()
    };
    let bright = is_too_bright(&|_| {}).join("\n");
    assert_says(&bright, &["reflects more than it receives"]);
    let half = Some(TextureLookup::from(0));
    let darkens: [&dyn Fn(&mut Scene); 3] = [
        &|scene| scene.materials.iter_mut().for_each(|m| m.ks_texture = half),
        &|scene| scene.materials.iter_mut().for_each(|m| m.kd_texture = half),
        &|scene| {
            let count = scene.meshes[0].positions_m.len();
            scene.meshes[0].colors = vec![[0.6; 3]; count];
        },
    ];
    for darken in darkens {
        assert_eq!(is_too_bright(darken), Vec::<String>::new());
    }
    let of_second_set = Some(TextureLookup {
        texcoord_set: 1,
        ..0.into()
    });
    let hidden = is_too_bright(&|scene| {
        let materials = scene.materials.iter_mut();
        materials.for_each(|m| m.ks_texture = of_second_set);
    });
    let hidden = hidden.join("\n");
    assert_says(&hidden, &["the ks_texture of material", "no second set"]);
}

/// The name of an image file may say another kind, or none.
#[test]
fn the_content_of_an_image_tells_its_kind() {
    let folder = SceneFolder::new();
    let picture =
        image::RgbImage::from_fn(5, 3, |x, y| image::Rgb([40 * x as u8, 80 * y as u8, 9]));
    let encoded = |format: image::ImageFormat| {
        let mut file = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut file, format).unwrap();
        file.into_inner()
    };
    let load = |name: &str, content: &[u8]| {
        folder.write(name, content);
        folder.write("mesh.mtl", format!("newmtl white\nmap_Kd {name}\n"));
        folder.load(&format!("{CAMERA}{LIGHT}{MESH}"))
    };
    let texels = |scene: camlux::Scene| scene.textures[0].texels.clone();
    let due = Texels::U8(picture.as_raw().as_chunks().0.to_vec(), Encoding::Srgb);
    for name in ["a.png", "a.jpg", "a.webp", "a"] {
        for format in [image::ImageFormat::Png, image::ImageFormat::WebP] {
            let scene = load(name, &encoded(format)).unwrap();
            assert_eq!(texels(scene), due, "{name} {format:?}");
        }
    }
    assert!(load("a.png", &encoded(image::ImageFormat::Jpeg)).is_ok());
    for (content, says) in [
        (&b"II*\0\x08\0\0\0"[..], "it is TIFF"),
        (b"MM\0*\0\0\0\x08", "it is TIFF"),
        (b"BM\x36\0\0\0", "it is BMP"),
        (b"GIF89a", "it is GIF"),
        (b"DDS |\0\0\0", "it is DDS"),
        (b"\xabKTX 20\xbb\r\n\x1a\n", "it is KTX2"),
        (b"\x76\x2f\x31\x01\x02\0\0\0", "it is OpenEXR"),
        (b"#?RADIANCE\n", "it is Radiance HDR"),
        (b"\0\0\0\x20ftypavif", "it is AVIF or HEIF"),
        (b"\0\0\x02\0\0\0\0\0\0\0\0\0\x04\0\x04\0\x18\0", "it is TGA"),
        (b"", "it is empty"),
        (b"no image", "it is none of PNG, JPEG and WebP"),
    ] {
        let message = folder.error(load("a.png", content));
        assert_says(&message, &["mesh.mtl:2", says, "PNG, JPEG or WebP"]);
    }
}

/// A few bytes of WebP can state an image of any size in one colour.
#[test]
fn an_image_has_no_more_pixels_than_its_file_may_hold() {
    let folder = SceneFolder::new();
    let even = image::RgbImage::from_pixel(8000, 8000, image::Rgb([9, 9, 9]));
    let mut file = std::io::Cursor::new(Vec::new());
    even.write_to(&mut file, image::ImageFormat::WebP).unwrap();
    let file = file.into_inner();
    // The file must be small for the test to say anything.
    let few = &file[..file.len().min(2000)];
    folder.write("a.webp", few);
    folder.write("mesh.mtl", "newmtl white\nmap_Kd a.webp\n");
    let message = folder.error(folder.load(&format!("{CAMERA}{LIGHT}{MESH}")));
    assert!(message.contains("claims 8000 x 8000 pixels"), "{message}");
}
