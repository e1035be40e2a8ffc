//! PLY files, against the same mesh as OBJ, bit for bit.

use std::fmt::Write;

use crate::common::gpu::Gpu;
use crate::common::scene_folder::{CAMERA, LIGHT, SceneFolder};
use camlux::Scene;

const POSITIONS: [[f32; 3]; 6] = [
    [-1.0, 0.1, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.3, -1.0],
    [-1.0, 0.2, -1.0],
    [0.7, 1.5, -1.0],
    [-0.9, 1.7, -1.0],
];
const NORMALS: [[f32; 3]; 6] = [
    [0.1, 1.0, 0.0],
    [0.0, 1.0, 0.1],
    [0.0, 0.7, 0.7],
    [0.2, 0.7, 0.7],
    [0.0, 0.0, 1.0],
    [0.1, 0.0, 1.0],
];
/// Of every vertex.
const COLOR: [u8; 3] = [200, 150, 100];
/// A floor and a wall.
const FACES: [[u8; 4]; 2] = [[0, 1, 2, 3], [3, 2, 4, 5]];

/// Has elements and properties that are not read, before, between and after those that are.
fn header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment a scan\nelement sensor 1\nproperty list uchar short track\n\
        element vertex 6\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
        property uchar blue\nproperty float nx\nproperty float ny\nproperty float nz\nproperty double s\nproperty double t\n\
        element face 2\nproperty list uchar int vertex_indices\nproperty float quality\nend_header\n"
    )
}

fn binary(format: &str, is_big: bool) -> Vec<u8> {
    let mut file = header(format).into_bytes();
    let mut put = |bytes: &[u8]| match is_big {
        true => file.extend(bytes.iter().rev()),
        false => file.extend(bytes),
    };
    put(&[1]);
    put(&7_i16.to_le_bytes());
    for (position, normal) in POSITIONS.iter().zip(NORMALS) {
        position.iter().for_each(|value| put(&value.to_le_bytes()));
        COLOR.iter().for_each(|&value| put(&[value]));
        normal.iter().for_each(|value| put(&value.to_le_bytes()));
        (0..2).for_each(|_| put(&0.25_f64.to_le_bytes()));
    }
    for face in FACES {
        put(&[4]);
        face.iter()
            .for_each(|&corner| put(&i32::from(corner).to_le_bytes()));
        put(&1_f32.to_le_bytes());
    }
    file
}

fn text() -> String {
    let mut text = header("ascii");
    writeln!(text, "1 7").unwrap();
    for ([x, y, z], [nx, ny, nz]) in POSITIONS.iter().zip(NORMALS) {
        let [r, g, b] = COLOR;
        writeln!(text, "{x} {y} {z} {r} {g} {b} {nx} {ny} {nz} 0.25 0.25").unwrap();
    }
    for [a, b, c, d] in FACES {
        writeln!(text, "4 {a} {b} {c} {d} 1").unwrap();
    }
    text
}

fn obj() -> String {
    let mut obj = String::new();
    let [r, g, b] = COLOR.map(|value| f64::from(value) / 255.0);
    let color = format!(" {r} {g} {b}");
    for (kind, values, more) in [("v", POSITIONS, color.as_str()), ("vn", NORMALS, "")] {
        for [x, y, z] in values.map(|value| value.map(f64::from)) {
            writeln!(obj, "{kind} {x:?} {y:?} {z:?}{more}").unwrap();
        }
    }
    obj.push_str("vt 0.25 0.25\n");
    for [a, b, c, d] in FACES.map(|face| face.map(|corner| corner + 1)) {
        for [a, b, c] in [[a, b, c], [a, c, d]] {
            writeln!(obj, "f {a}/1/{a} {b}/1/{b} {c}/1/{c}").unwrap();
        }
    }
    obj
}

#[test]
fn a_scan_is_the_obj_bit_for_bit() {
    let mut gpu = Gpu::open();
    let folder = SceneFolder::new();
    folder
        .write("scan.obj", obj())
        .write("text.ply", text())
        .write("little.ply", binary("binary_little_endian", false))
        .write("big.ply", binary("binary_big_endian", true));
    let load = |name: &str| -> Scene {
        let mesh = format!(
            "[material.clay]\nkd = 0.6\n[[mesh]]\npath = \"{name}\"\nmaterial = \"clay\"\nscale = 0.9\nrotate_deg = [0, 20, 0]\n"
        );
        folder.load(&format!("{CAMERA}{LIGHT}{mesh}[indirect]\nestimator = \"final-gather\"\ntarget_error = 0.1\n")).unwrap()
    };
    let expected = gpu.render(&load("scan.obj"));
    for name in ["text.ply", "little.ply", "big.ply"] {
        let scene = load(name);
        assert_eq!(scene.meshes[0].triangles.len(), 4);
        assert_eq!(scene.meshes[0].texcoords, [[0.25; 2]; 6]);
        assert_eq!(gpu.render(&scene).layers, expected.layers, "{name}");
        let warnings = scene.warnings();
        assert!(warnings[0].contains("quality"), "{warnings:?}");
    }
}
