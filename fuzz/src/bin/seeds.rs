//! Writes small valid files of every kind into the corpus folders: `seeds CORPUS SCENES`.

use std::error::Error;
use std::fs;
use std::path::Path;

use exr::prelude::*;

fn main() -> std::result::Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [corpus, scenes] = &arguments[..] else {
        return Err("usage: seeds CORPUS SCENES".into());
    };
    let corpus = Path::new(corpus);
    for target in [
        "scene_toml",
        "mesh_obj",
        "mesh_gltf",
        "mesh_ply",
        "mesh_stl",
        "materials_mtl",
        "texture",
        "pattern",
        "calibration",
        "exr_image",
    ] {
        fs::create_dir_all(corpus.join(target))?;
    }
    copy_scenes(corpus, Path::new(scenes))?;
    fs::write(corpus.join("mesh_gltf/triangle.gltf"), TRIANGLE_GLTF)?;
    fs::write(corpus.join("mesh_ply/strip.ply"), PLY)?;
    fs::write(corpus.join("mesh_stl/triangle.stl"), STL)?;
    let mut binary = [&[b' '; 80][..], &[1, 0, 0, 0]].concat();
    binary.resize(134, 0);
    fs::write(corpus.join("mesh_stl/binary.stl"), binary)?;
    for (name, seed) in CALIBRATIONS {
        fs::write(corpus.join("calibration").join(name), seed)?;
    }
    textures(&corpus.join("texture"))?;
    images(&corpus.join("exr_image"))
}

const PLY: &str = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 3\nproperty float x\nproperty float y\n\
    property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
    property list uchar int vertex_indices\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n\
    0 0 0 1 2 3\n1 0 0 1 2 3\n0 1 0 1 2 3\n3 0 1 2\n5 0 1 2 -1 0\n";
const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";

/// The first byte chooses the format.
const CALIBRATIONS: [(&str, &str); 5] = [
    (
        "opencv",
        "\0%YAML:1.0\n---\nimage_width: 8\nimage_height: 6\nK: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 8., 0., 4., 0., 8., 3., 0., 0., 1. ]\nD: [0.1, 0, 0, 0]\n",
    ),
    (
        "kalibr",
        "\0cam0:\n  camera_model: pinhole\n  intrinsics: [8, 8, 4, 3]\n  distortion_model: equidistant\n  distortion_coeffs: [0.1, 0, 0, 0]\n  resolution: [8, 6]\n",
    ),
    (
        "transforms",
        "\x01{\"w\": 8, \"h\": 6, \"camera_angle_x\": 0.9, \"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}",
    ),
    (
        "xml",
        "\x02<opencv_storage><image_width>8</image_width><image_height>6</image_height><K type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt><data>8. 0. 4. 0. 8. 3. 0. 0. 1.</data></K></opencv_storage>",
    ),
    ("images", "\x03# images\n1 1 0 0 0 0 0 2 1 a.png\n\n"),
];

/// A triangle with its buffer in the text.
const TRIANGLE_GLTF: &str = r#"{"asset":{"version":"2.0"},
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"materials":[{"pbrMetallicRoughness":{"roughnessFactor":0.5},"alphaMode":"MASK","doubleSided":true,
"emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":20}}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
"nodes":[{"mesh":0,"rotation":[0,0,0,1]}],"scenes":[{"nodes":[0]}]}"#;

/// Copies the repository's scene files, without the large ones.
fn copy_scenes(corpus: &Path, scenes: &Path) -> std::result::Result<(), Box<dyn Error>> {
    for entry in fs::read_dir(scenes)? {
        let path = entry?.path();
        let target = match path.extension().and_then(|extension| extension.to_str()) {
            Some("toml") => "scene_toml",
            Some("obj") => "mesh_obj",
            Some("mtl") => "materials_mtl",
            Some("ies") => "pattern",
            _ => continue,
        };
        if let Some(name) = path.file_name()
            && fs::metadata(&path)?.len() < 4096
        {
            fs::copy(&path, corpus.join(target).join(name))?;
        }
    }
    Ok(())
}

fn textures(folder: &Path) -> std::result::Result<(), Box<dyn Error>> {
    let rgb = image::RgbImage::from_fn(5, 4, |x, y| image::Rgb([x as u8 * 50, y as u8 * 60, 7]));
    rgb.save(folder.join("rgb.png"))?;
    rgb.save(folder.join("rgb.jpg"))?;
    let grey = image::ImageBuffer::from_fn(9, 9, |x, y| image::Luma([(x * 7000 + y) as u16]));
    grey.save(folder.join("grey16.png"))?;
    image::GrayImage::from_pixel(16, 16, image::Luma([9])).save(folder.join("grey.jpg"))?;
    Ok(())
}

fn images(folder: &Path) -> std::result::Result<(), Box<dyn Error>> {
    for (name, compression) in [
        ("none", Compression::Uncompressed),
        ("rle", Compression::RLE),
        ("zip", Compression::ZIP16),
        ("piz", Compression::PIZ),
        ("pxr24", Compression::PXR24),
        ("b44", Compression::B44),
        ("dwaa", Compression::DWAA(None)),
    ] {
        for (form, blocks) in [
            ("lines", Blocks::ScanLines),
            ("tiles", Blocks::Tiles(Vec2(4, 4))),
        ] {
            let values = |offset: usize| (0..48).map(move |i| (i + offset) as f32);
            let channels = [
                AnyChannel::new("direct.B", FlatSamples::F32(values(0).collect())),
                AnyChannel::new("direct.G", FlatSamples::F32(values(9).collect())),
                AnyChannel::new(
                    "direct.R",
                    FlatSamples::F16(values(5).map(f16::from_f32).collect()),
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
            let file = folder.join(format!("{name}_{form}.exr"));
            Image::from_layer(layer).write().to_file(file)?;
        }
    }
    Ok(())
}
