//! Files damaged at random, from fixed seeds. Each loads or is refused with a clear message, within the limits of time and memory.
//! `scripts/fuzz` searches further, guided by coverage.

use std::path::Path;

use crate::common::gltf_file::GltfBuilder;
use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder};
use crate::judge::{Bound, TEXT, check_message, check_scene, judge, take_turn};
use crate::mutate::{self, Random, mend_png};
use crate::scene_text;
use camlux::Scene;
use camlux::metrics::{Comparison, Pixels};
use camlux::output::LayeredImage;
use exr::prelude::*;

/// Deflate expands a byte to at most 1032 bytes, which are 8256 pixels of 1 bit. A pixel takes up to 4 bytes from the decoder, 6 with 16 bits
/// a band, and 12 in the scene.
pub const TEXTURE: Bound = Bound {
    constant_bytes: 2 << 20,
    factor: 8256 * (4 + 6 + 12),
};

/// Valid files of the repository, without the large ones.
pub fn scenes(extension: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let paths = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut paths: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|found| found == extension))
        .collect();
    paths.sort();
    let files = paths.iter().map(|path| std::fs::read(path).unwrap());
    files.filter(|file| file.len() < 10_000).collect()
}

/// Asserts that some inputs load and some do not; otherwise the test would show little.
#[track_caller]
pub fn assert_some_load(loaded: usize, rounds: usize) {
    println!("{loaded} of {rounds} load");
    assert!(
        loaded > rounds / 200 && loaded < rounds,
        "{loaded} of {rounds}"
    );
}

#[test]
fn scene_files() {
    let _turn = take_turn();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/scene.toml");
    let mut seeds = scenes("toml");
    seeds.push(format!("version = 1\n{CAMERA}{LIGHT}[material.clay]\nkd = 0.5\n").into());
    // The meshes that the scenes name take memory, but are not part of the input. Some may name the largest one more than once.
    let bound = Bound {
        constant_bytes: 64 << 20,
        ..TEXT
    };
    let mut random = Random::new(1);
    let rounds = 2000;
    let loads = (0..rounds).filter(|_| {
        let bytes = mutate::text(&mut random, &seeds);
        judge(
            "scene.toml",
            &bytes,
            bound,
            |bytes| match std::str::from_utf8(bytes) {
                Ok(text) => check_scene(Scene::parse(text, &folder)),
                Err(_) => false,
            },
        )
    });
    assert_some_load(loads.count(), rounds);
}

#[test]
fn scene_files_by_grammar() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    let file = folder.path("scene.toml");
    let mut random = Random::new(2);
    let rounds = 6000;
    let loads = (0..rounds).filter(|round| {
        let oddity = [4, 20, 100][round % 3];
        let text = scene_text::scene(&mut random, oddity);
        judge("scene.toml", text.as_bytes(), TEXT, |_| {
            check_scene(Scene::parse(&text, &file))
        })
    });
    assert_some_load(loads.count(), rounds);
}

/// The JSON of a valid file with some of everything that is read.
fn gltf_members(builder: &mut GltfBuilder) -> String {
    let positions = builder.vec3(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    let normals = builder.vec3(&[[0.0, 0.0, 1.0]; 4]);
    let texcoords = builder.vec2(&[[0.0; 2], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    let narrow = builder.vec2_u16(&[[0; 2], [65535, 0], [65535, 65535], [0, 65535]]);
    let indices = builder.indices(&[[0, 1, 2], [0, 2, 3]]);
    let strip = builder.indices_u16(&[0, 1, 2, 3]);
    let image = builder.view(&images()[0]);
    let colors = builder.vec4(&[[0.5, 1.0, 0.2, 1.0]; 4]);
    let tangents = builder.vec4(&[[1.0, 0.0, 0.0, -1.0]; 4]);
    let (places, values) = (builder.view(&[1, 2]), builder.view(&[0x3f; 24]));
    let sparse = builder.bare(&format!(
        r#""componentType":5126,"count":4,"type":"VEC3","sparse":{{"count":2,"indices":{{"bufferView":{places},"componentType":5121}},"values":{{"bufferView":{values}}}}}"#
    ));
    format!(
        r#""extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[
        {{"type":"spot","intensity":70,"spot":{{"innerConeAngle":0.1,"outerConeAngle":0.5}}}},
        {{"type":"directional","intensity":9}}]}}}},
        "images":[{{"bufferView":{image},"mimeType":"image/png"}}],"samplers":[{{"wrapS":33071,"wrapT":33648,"magFilter":9728}}],
        "textures":[{{"source":0,"sampler":0}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,"texCoord":1,
            "extensions":{{"KHR_texture_transform":{{"offset":[0.1,0.2],"rotation":0.3,"scale":[2,2]}}}}}},"metallicRoughnessTexture":{{"index":0}}}},
        "normalTexture":{{"index":0,"scale":2}},"alphaMode":"MASK"}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{positions},"NORMAL":{normals},"TEXCOORD_0":{texcoords},
            "TEXCOORD_1":{narrow},"COLOR_0":{colors},"TANGENT":{tangents}}},"indices":{indices},"material":0}},
        {{"attributes":{{"POSITION":{sparse},"TEXCOORD_0":{narrow}}},"indices":{strip},"mode":5}}]}}],
        "cameras":[{{"type":"perspective","name":"eye","perspective":{{"yfov":0.5,"znear":0.1}}}}],
        "nodes":[{{"mesh":0,"children":[1,2],"translation":[0,1,0]}},{{"mesh":0,"rotation":[0,0,1,0],"scale":[2,2,-1],
            "extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":{positions},"ROTATION":{tangents}}}}}}}}},
        {{"camera":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,3,1],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}],
        "scenes":[{{"nodes":[0]}}],"scene":0"#
    )
}

#[test]
fn gltf_files() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    let mut builder = GltfBuilder::default();
    let members = gltf_members(&mut builder);
    let (json, buffer) = builder.gltf(&members, "buffer.bin");
    folder.write("buffer.bin", buffer);
    let [binary, text] = [vec![builder.glb(&members)], vec![json.into_bytes()]];
    let camera = "[camera]\nresolution = [8, 6]\npath = \"room.NAME\"\nname = \"eye\"\n";
    for name in ["glb", "gltf"] {
        let scene = format!("{camera}[[mesh]]\npath = \"room.NAME\"\n").replace("NAME", name);
        folder.write(&format!("{name}.toml"), scene);
    }
    let mut random = Random::new(9);
    let rounds = 4000;
    let loads = (0..rounds).filter(|round| {
        let (name, bytes) = match round % 2 {
            0 => ("glb", mutate::binary(&mut random, &binary)),
            _ => ("gltf", mutate::text(&mut random, &text)),
        };
        judge("room", &bytes, TEXTURE, |bytes| {
            folder.write(&format!("room.{name}"), bytes);
            check_scene(Scene::load(&folder.path(&format!("{name}.toml"))))
        })
    });
    assert_some_load(loads.count(), rounds);
}

#[test]
fn patterns() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    let mut ies = scenes("ies");
    // Types B and A, and a lamp that may hang at other angles.
    for kind in [2, 3] {
        let text = format!(
            "IES:LM-63-2019\n[NEARFIELD] 1\nTILT=INCLUDE\n1\n2\n0 90\n1 0.9\n1 -1 1 3 3 {kind} 2 0 0 0\n1 1.1 9\n-90 0 90\n-90 0 90\n1 2 1\n2 9 2\n1 2 1\n"
        );
        ies.push(text.into());
    }
    // A line for each value, one set of lamps, and planes of a whole turn.
    let head = "nobody\n1\n0\n2\n180\n3\n45\n".to_owned() + &"0\n".repeat(16) + "1\n0\n1\n";
    let ldt = head + &"1\n".repeat(16) + "0\n180\n0\n45\n90\n9\n5\n0\n9\n4\n1\n";
    // Types A and B become up to 130 000 intensities, of which there are a few copies.
    let bound = Bound {
        constant_bytes: 8 << 20,
        ..TEXT
    };
    let mut random = Random::new(5);
    for (name, seeds) in [("lamp.ies", ies), ("lamp.ldt", vec![ldt.into_bytes()])] {
        let light = LIGHT.replace(
            "kind = \"point\"",
            &format!(
                "kind = \"pattern\"\npattern = \"{name}\"\ndirection = [0, -1, 0]\nup = [1, 0, 0]"
            ),
        );
        folder.write("scene.toml", format!("{CAMERA}{light}{MESH}"));
        let rounds = 2000;
        let loads = (0..rounds).filter(|_| {
            let bytes = mutate::text(&mut random, &seeds);
            judge(name, &bytes, bound, |bytes| {
                folder.write(name, bytes);
                check_scene(Scene::load(&folder.path("scene.toml")))
            })
        });
        assert_some_load(loads.count(), rounds);
    }
}

/// The calibrations of the repository; each is read by its format, and by that of the others.
#[test]
fn calibrations() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    let files = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/calibrations");
    let read = |name: &str| std::fs::read(files.join(name)).unwrap();
    for name in ["cameras.txt", "cameras.bin"] {
        folder.write(name, read(&format!("colmap/{name}")));
    }
    let seeds = |names: &[&str]| names.iter().map(|name| read(name)).collect::<Vec<_>>();
    let yaml = ["brown.yaml", "stereo.yaml", "sensor.yaml", "camchain.yaml"];
    let mut random = Random::new(17);
    for (name, seeds) in [
        ("cam.yaml", seeds(&yaml)),
        (
            "cam.json",
            seeds(&["tilted.json", "nerf.json", "fisheye.json"]),
        ),
        ("cam.xml", seeds(&["prism.xml"])),
        ("images.txt", seeds(&["colmap/images.txt"])),
        ("images.bin", seeds(&["colmap/images.bin"])),
        ("cameras.bin", seeds(&["colmap/cameras.bin"])),
    ] {
        let keys = match name {
            "images.txt" | "images.bin" => "name = \"8.png\"\n",
            "cameras.bin" => "name = \"5\"\nposition = [0, 1, 3]\nlook_at = [0, 1, 0]\n",
            "cam.json" => "resolution = [8, 6]\n",
            _ => "position = [0, 1, 3]\nlook_at = [0, 1, 0]\n",
        };
        let scene = format!("[camera]\npath = \"{name}\"\n{keys}{LIGHT}{MESH}");
        folder.write("scene.toml", scene);
        let rounds = 1000;
        let loads = (0..rounds).filter(|_| {
            let bytes = match name.ends_with(".bin") {
                true => mutate::binary(&mut random, &seeds),
                false => mutate::text(&mut random, &seeds),
            };
            judge(name, &bytes, TEXT, |bytes| {
                folder.write(name, bytes);
                check_scene(Scene::load(&folder.path("scene.toml")))
            })
        });
        assert_some_load(loads.count(), rounds);
    }
}

/// PNG, JPEG and WebP of several kinds.
pub fn images() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let rgb = image::RgbImage::from_fn(20, 9, |x, y| image::Rgb([x as u8 * 12, y as u8 * 20, 7]));
    let grey = image::ImageBuffer::from_fn(9, 9, |x, y| image::Luma([(x * 7000 + y) as u16]));
    let rgba = image::RgbaImage::from_pixel(3, 3, image::Rgba([1, 2, 3, 4]));
    let names = [
        "a.png", "a.jpg", "grey.png", "rgba.png", "grey.jpg", "rgb.webp",
    ]
    .map(|n| folder.path().join(n));
    rgb.save(&names[0]).unwrap();
    rgb.save(&names[1]).unwrap();
    grey.save(&names[2]).unwrap();
    rgba.save(&names[3]).unwrap();
    image::GrayImage::from_pixel(16, 16, image::Luma([9]))
        .save(&names[4])
        .unwrap();
    rgb.save(&names[5]).unwrap();
    names.map(|name| std::fs::read(name).unwrap()).into()
}

#[test]
fn textures() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    folder.write("mesh.mtl", "newmtl white\nmap_Kd texture\n");
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{MESH}"));
    let seeds = images();
    let mut random = Random::new(5);
    let rounds = 3000;
    let loads = (0..rounds).filter(|round| {
        let mut bytes = mutate::binary(&mut random, &seeds);
        if round % 3 > 0 {
            mend_png(&mut bytes);
        }
        judge("texture", &bytes, TEXTURE, |bytes| {
            folder.write("texture", bytes);
            check_scene(Scene::load(&folder.path("scene.toml")))
        })
    });
    assert_some_load(loads.count(), rounds);
}

/// Images of 8 × 6 pixels in seven compressions, each as scan lines and as tiles.
fn layered_images() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut files = Vec::new();
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::DWAA(None),
    ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(4, 4))] {
            let values = || (0..48).map(|i| i as f32);
            let channels = [
                AnyChannel::new("direct.B", FlatSamples::F32(values().collect())),
                AnyChannel::new("direct.G", FlatSamples::F32(values().collect())),
                AnyChannel::new(
                    "direct.R",
                    FlatSamples::F16(values().map(f16::from_f32).collect()),
                ),
                AnyChannel::new("id.instance", FlatSamples::U32((0..48).collect())),
            ];
            let encoding = Encoding {
                compression,
                blocks,
                line_order: LineOrder::Increasing,
            };
            let layer = Layer::new(
                (8, 6),
                LayerAttributes::default(),
                encoding,
                AnyChannels::sort(SmallVec::from_vec(channels.to_vec())),
            );
            Image::from_layer(layer).write().to_file(&path).unwrap();
            files.push(std::fs::read(&path).unwrap());
        }
    }
    // Two parts, of which one is a window of the image.
    let part = |name: &str, size: (usize, usize)| {
        let values = vec![1.0; size.0 * size.1];
        let channel = AnyChannel::new("Y", FlatSamples::F32(values));
        let encoding = Encoding {
            compression: Compression::ZIP16,
            ..Encoding::UNCOMPRESSED
        };
        let channels = AnyChannels::sort(SmallVec::from_vec(vec![channel]));
        Layer::new(size, LayerAttributes::named(name), encoding, channels)
    };
    let mut window = part("b", (3, 2));
    window.attributes.layer_position = Vec2(4, 3);
    let image = Image::empty(ImageAttributes::with_size((8, 6)));
    let image = image.with_layer(part("a", (8, 6))).with_layer(window);
    image.write().to_file(&path).unwrap();
    for _ in 0..4 {
        files.push(std::fs::read(&path).unwrap());
    }
    files
}

/// The memory that a byte of the file may take (see `exr_decode.rs`). Memory for all values as f32, which may be 16-bit floats in the file, is
/// allocated at once, and the current block is in memory twice.
fn image_bound(bytes: &[u8]) -> Bound {
    let name = b"compression\0compression\0";
    let at = bytes.windows(name.len()).position(|window| window == name);
    let kind = at.and_then(|at| bytes.get(at + name.len() + 4));
    let has_many_zeros = matches!(kind, Some(8 | 9));
    let bytes_per_byte = if has_many_zeros {
        64 * 2 * 1032
    } else {
        1032 * 4 / 3
    };
    Bound {
        // A display window may be 64 MiB larger than its data, and which of its pixels count takes half of that, if they are half floats.
        constant_bytes: 256 << 20,
        factor: 4 * bytes_per_byte,
    }
}

#[test]
fn images_to_compare() {
    let _turn = take_turn();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let seeds = layered_images();
    let mut random = Random::new(6);
    let rounds = 4000;
    let reads = (0..rounds).filter(|_| {
        let bytes = mutate::binary(&mut random, &seeds);
        std::fs::write(&path, &bytes).unwrap();
        let bound = image_bound(&bytes);
        judge("image.exr", &bytes, bound, |_| {
            match LayeredImage::read(&path) {
                Ok(image) => {
                    compare_with_itself(&image);
                    true
                }
                Err(error) => {
                    check_message(&error);
                    false
                }
            }
        })
    });
    assert_some_load(reads.count(), rounds);
}

fn compare_with_itself(image: &LayeredImage) {
    let valid = image.surface_pixels();
    for layer in image.layers() {
        let pixels = Pixels {
            image: &layer.values,
            reference: &layer.values,
            image_standard_error: None,
            reference_standard_error: None,
            valid: &valid,
            edges: None,
            channels: layer.channel_names.len(),
        };
        let comparison = Comparison::new(&pixels).expect("every layer has all pixels");
        assert!(comparison.errors.is_none_or(|errors| errors.rmse == 0.0));
    }
}
