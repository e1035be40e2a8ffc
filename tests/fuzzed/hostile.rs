//! Hostile input: small files that claim much, long files on which a careless reader takes time or memory quadratic in their size, and paths
//! that are not regular files.

use std::fs;
use std::path::Path;
use std::time::Instant;

use crate::common::scene_folder::{CAMERA, LIGHT, MESH, MTL, SceneFolder, TRIANGLE, assert_says};
use crate::judge::{Bound, TEXT, check_message, check_scene, device, judge, take_turn};
use crate::mutate::crc32;
use camlux::output::LayeredImage;
use camlux::{Plan, Scene};
use exr::prelude::*;

/// Room for tables and messages, but not for anything that grows with what a file claims.
const SMALL: Bound = Bound {
    constant_bytes: 1 << 20,
    factor: 30,
};
/// Loads a scene with this `mesh.obj` and returns the message, empty if it loads.
fn load_obj(folder: &SceneFolder, obj: impl AsRef<[u8]>, bound: Bound) -> String {
    let obj = obj.as_ref();
    folder.write("mesh.obj", obj);
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{MESH}"));
    judge("mesh.obj", obj, bound, |_| message(folder))
}

fn message(folder: &SceneFolder) -> String {
    let loaded = Scene::load(&folder.path("scene.toml"));
    let message = loaded.as_ref().err().map(ToString::to_string);
    check_scene(loaded);
    let message = message.unwrap_or_default();
    message.replace(&format!("{}/", folder.path("").display()), "")
}

fn parse(text: &str, bound: Bound) -> camlux::Result<Scene> {
    judge("scene.toml", text.as_bytes(), bound, |_| {
        Scene::parse(text, Path::new("scene.toml"))
    })
}

#[test]
fn vertex_of_four_billion_in_a_kilobyte() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    for index in [
        "4294967295",
        "4294967296",
        "-4294967295",
        "18446744073709551616",
    ] {
        let mut obj = String::from(TRIANGLE);
        while obj.len() < 1000 {
            obj += &format!("f 1 2 {index}\n");
        }
        let says = format!("mesh.obj:7: \"f\" refers to {index}, but there are 3 vertices");
        assert_says(&load_obj(&folder, obj, SMALL), &[&says]);
    }
}

/// A PNG of a kilobyte whose header claims `width` x `height` pixels.
fn png(width: u32, height: u32, sample_bits: u8, kind: u8) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |name: &[u8], content: &[u8]| {
        file.extend((content.len() as u32).to_be_bytes());
        let start = file.len();
        file.extend(name);
        file.extend(content);
        file.extend(crc32(&file[start..]).to_be_bytes());
    };
    let size = [width.to_be_bytes(), height.to_be_bytes()].concat();
    chunk(
        b"IHDR",
        &[&size[..], &[sample_bits, kind, 0, 0, 0]].concat(),
    );
    chunk(b"IDAT", &[0; 960]);
    chunk(b"IEND", b"");
    file
}

#[test]
fn texture_of_four_billion_pixels_in_a_kilobyte() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    folder.write("mesh.mtl", "newmtl white\nmap_Kd bomb.png\n");
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{MESH}"));
    // The last ones would take a gigabyte, or 8 MB, before a reader sees that the pixels are missing.
    for (width, height, sample_bits, kind) in [
        (60_000, 60_000, 8, 2),
        (60_000, 60_000, 1, 0),
        (i32::MAX as u32, 1, 8, 6),
        (1, i32::MAX as u32, 16, 2),
        (13_000, 13_000, 8, 2),
        (4_000, 4_000, 1, 3),
        (2_000, 1_000, 8, 2),
    ] {
        let file = png(width, height, sample_bits, kind);
        folder.write("bomb.png", &file);
        let message = judge("bomb.png", &file, SMALL, |_| message(&folder));
        assert_says(&message, &["cannot read the texture", "bomb.png"]);
    }
    // The same for a JPEG: its frame claims 65 535 × 65 535 pixels, but it has only 16 × 16.
    let image = image::RgbImage::from_pixel(16, 16, image::Rgb([1, 2, 3]));
    image.save(folder.path("bomb.jpg")).unwrap();
    let mut file = fs::read(folder.path("bomb.jpg")).unwrap();
    let frame = file
        .windows(2)
        .position(|pair| pair == [0xff, 0xc0])
        .unwrap();
    file[frame + 5..frame + 9].fill(0xff);
    folder.write("bomb.png", &file);
    let message = judge("bomb.png", &file, SMALL, |_| message(&folder));
    assert_says(&message, &["claims 65535 x 65535 pixels"]);
}

/// A whole PNG with as many pixels as its bytes allow must load, although it resembles a decompression bomb.
#[test]
fn texture_of_one_colour_loads_however_well_it_is_packed() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    let side = 3000;
    image::GrayImage::new(side, side)
        .save(folder.path("flat.png"))
        .unwrap();
    folder.write("mesh.mtl", "newmtl white\nmap_Kd flat.png\n");
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{MESH}"));
    let scene = Scene::load(&folder.path("scene.toml")).unwrap();
    assert_eq!(scene.textures[0].size_px, [side, side]);
}

#[test]
fn nesting_of_a_hundred_thousand() {
    let _turn = take_turn();
    let n = 100_000;
    for text in [
        format!("a = {}{}", "[".repeat(n), "]".repeat(n)),
        format!("a = {}", "[".repeat(n)),
        format!("a = {}", "{a = ".repeat(n)),
        format!("a{} = 1", ".a".repeat(n)),
        format!("[a{}]", ".a".repeat(n)),
        format!("[[a{}]]", ".a".repeat(n)),
        format!(
            "[camera]\nresolution = {}1{}",
            "[".repeat(70),
            "]".repeat(70)
        ),
    ] {
        let error = parse(&text, TEXT).expect_err("no scene");
        check_message(&error);
        assert!(error.to_string().starts_with("scene.toml"), "{error}");
    }
}

#[test]
fn resolution_of_four_billion() {
    let _turn = take_turn();
    let toml = |resolution: &str| format!("{}{LIGHT}", CAMERA.replace("8, 6", resolution));
    let scene = parse(&toml("4294967295, 4294967295"), SMALL).expect("a scene of any size loads");
    let error = Plan::new(&scene, &device()).expect_err("no device has that");
    assert_says(
        &error.to_string(),
        &["width (px) is 4294967295", "smaller image"],
    );
    let error = parse(&toml("4294967296, 1"), SMALL).expect_err("not a u32");
    assert_says(
        &error.to_string(),
        &["scene.toml:2", "4294967296", "whole numbers"],
    );
}

/// Texts of a megabyte on which a careless reader takes time quadratic in their size: hours instead of seconds.
#[test]
fn long_texts_take_no_longer_than_they_are() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    let n = 300_000;
    let spaces = " ".repeat(n);
    for obj in [
        // Continued lines, with and without content.
        format!("{TRIANGLE}f 1 2 3{}", "\\\n".repeat(n)),
        format!("{TRIANGLE}f 1 2 3 {}", "\\".repeat(n)),
        format!("{TRIANGLE}{spaces}{}", "\\\n".repeat(n)),
        format!("{TRIANGLE}# {}\n", "\\\n ".repeat(n)),
        // A name of a hundred kilobytes for ten thousand runs of one face.
        format!(
            "mtllib mesh.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nusemtl {}\n{}",
            "x".repeat(100_000),
            "f 1 2 3\nf 1//1 2//1 3//1\n".repeat(5_000)
        ),
        // Faces of alternating form, so that each face is a run of its own.
        format!(
            "{TRIANGLE}vn 0 0 1\n{}",
            "f 1 2 3\nf 1//1 2//1 3//1\n".repeat(20_000)
        ),
        // A material for each face.
        format!("{TRIANGLE}{}", "usemtl white\nf 1 2 3\n".repeat(20_000)),
        format!("{TRIANGLE}{}", "mtllib mesh.mtl\n".repeat(30_000)),
        // A polygon that no fan fills, although most triangles of each fan do not fold over.
        format!(
            "{TRIANGLE}v 1 1 0\nv 0.5 -1 0\nf{} 2 4 3 1 2 5 3\n",
            " 1".repeat(n)
        ),
        format!("{TRIANGLE}f{}\n", " 1 2".repeat(n)),
        format!("{TRIANGLE}f{}\n", " 1/".repeat(n)),
        format!("{TRIANGLE}{} 1 2 3\n", "f".repeat(n)),
    ] {
        let start = Instant::now();
        let message = load_obj(&folder, &obj, TEXT);
        let beginning: String = obj[TRIANGLE.len()..].chars().take(20).collect();
        println!(
            "{beginning:?}: {:.2} s, {message:.80}",
            start.elapsed().as_secs_f64()
        );
    }
    for toml in [
        format!("{CAMERA}{LIGHT}{}", LIGHT.repeat(10_000)),
        format!("{CAMERA}{LIGHT}{}", "[[mesh]]\n".repeat(n / 3)),
        format!("{CAMERA}{LIGHT}{}", "[[light]]\n".repeat(n / 3)),
        format!("{}\n{CAMERA}", "a = 1\n".repeat(n)),
        (0..n / 3).map(|i| format!("k{i} = 1\n")).collect(),
        format!(
            "{CAMERA}{LIGHT}{MESH}material = \"{0}\"\n[material.{0}b]\nkd = 1\n",
            "a".repeat(n)
        ),
        format!("{CAMERA}{LIGHT}[{}]\n", "x".repeat(n)),
        format!("{}{LIGHT}", CAMERA.replace("8, 6", &"1, ".repeat(n))),
    ] {
        let start = Instant::now();
        let parsed = parse(&toml, TEXT);
        println!(
            "{:.2} s, {:.80}",
            start.elapsed().as_secs_f64(),
            toml.replace('\n', " ")
        );
        check_scene(parsed);
    }
}

#[test]
fn messages_are_one_line_that_can_be_read() {
    let _turn = take_turn();
    let escapes = "\\u001B[2J\\n\\r\\u0007";
    for toml in [
        format!("{CAMERA}{}", LIGHT.replace("point", escapes)),
        format!("{CAMERA}{LIGHT}{MESH}material = \"{escapes}\"\n"),
        format!("{CAMERA}{LIGHT}\"{escapes}\" = 1\n"),
        format!("{CAMERA}{LIGHT}[[mesh]]\npath = \"{escapes}\"\n"),
        format!("{CAMERA}{}", LIGHT.replace("point", &"x".repeat(100_000))),
    ] {
        let error = parse(&toml, TEXT).expect_err("refused");
        check_message(&error);
        assert!(error.to_string().len() < 3000);
    }
    let folder = SceneFolder::new();
    let message = load_obj(&folder, TRIANGLE.replace("white", "\x1b[2J\x07"), SMALL);
    assert_says(
        &message,
        &["material \"\\u{1b}[2J\\u{7}\" is in no MTL file"],
    );
}

/// Asserts that a scene is refused if `name` is not a regular file, without waiting for it or reading it without end.
#[cfg(unix)]
fn refuses_what_is_no_file(name: &str) {
    let folder = SceneFolder::new();
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{MESH}"));
    folder.write("mesh.mtl", "newmtl white\nmap_Kd wood.png\n");
    image::RgbImage::new(2, 2)
        .save(folder.path("wood.png"))
        .unwrap();
    assert_eq!(message(&folder), "");
    let path = folder.path(name);
    let refused = |what: &str, makes: &dyn Fn()| {
        fs::remove_file(&path).unwrap();
        makes();
        let message = judge("none", b"", SMALL, |_| message(&folder));
        assert_says(&message, &["cannot read", name, what]);
        if path.is_dir() {
            fs::remove_dir(&path).unwrap();
            folder.write(name, "");
        }
    };
    refused("not a file", &|| fs::create_dir(&path).unwrap());
    refused("not a file", &|| {
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
    });
    for device in ["/dev/zero", "/dev/null", "/dev/tty"] {
        refused("", &|| std::os::unix::fs::symlink(device, &path).unwrap());
    }
    // A loop: the link leads to itself.
    refused("symbolic links", &|| {
        std::os::unix::fs::symlink(&path, &path).unwrap();
    });
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_neither_waited_for_nor_read_without_end() {
    let _turn = take_turn();
    for name in ["scene.toml", "mesh.obj", "mesh.mtl", "wood.png"] {
        refuses_what_is_no_file(name);
    }
}

/// A sparse file that is far larger than memory.
#[cfg(unix)]
#[test]
fn file_of_eight_terabytes_without_content() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{MESH}"));
    let file = fs::File::create(folder.path("mesh.obj")).unwrap();
    // Not every file system supports this length.
    if file.set_len(1 << 43).is_err() {
        return;
    }
    let message = judge("none", b"", SMALL, |_| message(&folder));
    assert_says(
        &message,
        &["cannot read the mesh", "8796093022208 bytes", "memory"],
    );
}

/// Files change while they are read. Each read loads or is refused.
#[test]
fn files_that_change_while_they_are_read() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    let toml = format!("{CAMERA}{LIGHT}{MESH}");
    folder.write("scene.toml", &toml);
    let long = format!("{TRIANGLE}{}", "v 0 0 0\nf 1 2 3\n".repeat(2000));
    let image = layered_image(Compression::ZIP16);
    let bound = Bound {
        constant_bytes: 64 << 20,
        factor: 0,
    };
    let is_done = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !is_done.load(std::sync::atomic::Ordering::Relaxed) {
                folder.write("mesh.obj", &long).write("mesh.mtl", MTL);
                folder.write("a.exr", &image);
                for (name, length) in [("mesh.obj", 1000), ("mesh.mtl", 12), ("a.exr", 600)] {
                    let file = fs::OpenOptions::new().write(true).open(folder.path(name));
                    file.unwrap().set_len(length).unwrap();
                }
            }
        });
        let reads = || {
            for _ in 0..300 {
                check_scene(Scene::load(&folder.path("scene.toml")));
                if let Err(error) = LayeredImage::read(folder.path("a.exr")) {
                    check_message(&error);
                }
            }
        };
        judge("none", b"", bound, |_| reads());
        is_done.store(true, std::sync::atomic::Ordering::Relaxed);
    });
}

fn layered_image(compression: Compression) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let values = FlatSamples::F16(
        (0..64 * 64)
            .map(|i| f16::from_f32((i % 64) as f32))
            .collect(),
    );
    let channels = AnyChannels::sort(SmallVec::from_vec(vec![AnyChannel::new(
        "direct.R", values,
    )]));
    let encoding = Encoding {
        compression,
        ..Encoding::UNCOMPRESSED
    };
    let layer = Layer::new((64, 64), LayerAttributes::default(), encoding, channels);
    Image::from_layer(layer).write().to_file(&path).unwrap();
    fs::read(&path).unwrap()
}

/// A DWA block begins with the numbers of its coefficients. `exr` allocates what is claimed, and a claim of 10^17 would end the program.
#[test]
fn dwa_block_that_claims_more_than_its_pixels() {
    let _turn = take_turn();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let valid = layered_image(Compression::DWAA(None));
    // A block has 32 lines, and the second block ends the file. Its length precedes it. It begins with the version, sizes and counts of
    // 8 bytes each.
    let numbers = (4..valid.len() - 88).rev().find(|&at| {
        let length = u32::from_le_bytes(valid[at - 4..at].try_into().unwrap());
        length as usize == valid.len() - at
    });
    let numbers = numbers.expect("a block that is compressed");
    let mut refused = 0;
    for index in 1..10 {
        for claim in [1_u64 << 20, 1 << 33, 1 << 57, i64::MAX as u64, u64::MAX] {
            let mut bytes = valid.clone();
            let at = numbers + 8 * index;
            bytes[at..at + 8].copy_from_slice(&claim.to_le_bytes());
            fs::write(&path, &bytes).unwrap();
            let read = judge("image.exr", &bytes, SMALL, |_| LayeredImage::read(&path));
            let error = read.expect_err("that is too much");
            assert_says(&error.to_string(), &["not a whole OpenEXR image"]);
            refused += 1;
        }
    }
    assert_eq!(refused, 45);
    fs::write(&path, &valid).unwrap();
    assert!(LayeredImage::read(&path).is_ok());
}
