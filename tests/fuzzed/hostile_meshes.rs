//! Hostile PLY, STL and MTL files: small files that claim much, and texts on which a careless reader takes time or memory quadratic in their
//! size.

use std::time::Instant;

use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE, assert_says};
use crate::judge::{Bound, TEXT, check_scene, judge, take_turn};
use camlux::Scene;

const SMALL: Bound = Bound {
    constant_bytes: 1 << 20,
    factor: 30,
};

/// Loads a scene with this mesh file and returns the message, empty if it loads.
fn load(name: &'static str, bytes: impl AsRef<[u8]>, bound: Bound) -> String {
    let folder = SceneFolder::new();
    let scene =
        format!("[material.clay]\nkd = 0.5\n[[mesh]]\npath = \"{name}\"\nmaterial = \"clay\"\n");
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{scene}"));
    folder.write(name, &bytes);
    judge(name, bytes.as_ref(), bound, |_| message(&folder))
}

fn message(folder: &SceneFolder) -> String {
    let loaded = Scene::load(&folder.path("scene.toml"));
    let message = loaded.as_ref().err().map(ToString::to_string);
    check_scene(loaded);
    message.unwrap_or_default()
}

fn ply(format: &str, elements: &str) -> String {
    let coordinates = "property float x\nproperty float y\nproperty float z\n";
    let elements = elements.replace("XYZ\n", coordinates);
    format!("ply\nformat {format} 1.0\n{elements}end_header\n")
}

#[test]
fn ply_that_claims_more_than_it_has() {
    let _turn = take_turn();
    let faces = "property list uint int vertex_indices\n";
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for count in ["4294967295", "4294967296", "18446744073709551615"] {
            for elements in [
                format!("element vertex {count}\nXYZ\n"),
                format!("element vertex {count}\nXYZ\nelement face 1\n{faces}"),
                format!("element vertex 0\nXYZ\nelement face {count}\n{faces}"),
                format!("element vertex 0\nXYZ\nelement tristrips {count}\n{faces}"),
                format!("element vertex 0\nXYZ\nelement edge {count}\nproperty int vertex1\n"),
            ] {
                let message = load("scan.ply", ply(format, &elements), SMALL);
                assert_says(&message, &["scan.ply", "ends in"]);
            }
        }
    }
    // Elements without properties take no bytes in the file.
    let count = u64::MAX;
    let elements = format!("element vertex 3\nXYZ\nelement user {count}\n");
    assert_eq!(
        load(
            "scan.ply",
            ply("ascii", &elements) + "0 0 0\n1 0 0\n0 1 0\n",
            SMALL
        ),
        ""
    );
    for name in ["vertex", "face", "tristrips"] {
        let elements = format!("element vertex 0\nXYZ\nelement {name} {count}\n");
        let elements = elements.replace("element vertex 0\nXYZ\nelement vertex", "element vertex");
        assert_says(
            &load("scan.ply", ply("ascii", &elements), SMALL),
            &["scan.ply"],
        );
    }
}

#[test]
fn ply_whose_lists_claim_more_than_they_have() {
    let _turn = take_turn();
    let elements = "element vertex 3\nXYZ\nelement NAME 1\nproperty list uint int vertex_indices\n\
        property list uint float texcoord\n";
    for name in ["face", "tristrips", "other"] {
        let elements = elements.replace("NAME", name);
        let text = ply("ascii", &elements) + "0 0 0\n1 0 0\n0 1 0\n";
        for lists in ["4294967295 0 1 2", "3 0 1 2 4294967295 0 1"] {
            let message = load("scan.ply", format!("{text}{lists}\n"), SMALL);
            assert_says(&message, &["scan.ply"]);
        }
        let mut binary = ply("binary_little_endian", &elements).into_bytes();
        binary.extend([0; 36]);
        binary.extend([0xff; 4]);
        binary.extend([0; 12]);
        assert_says(&load("scan.ply", binary, SMALL), &["scan.ply", "ends in"]);
    }
}

#[test]
fn stl_that_claims_more_than_it_has() {
    let _turn = take_turn();
    for count in [1_u32, 3, 1 << 20, 1 << 31, u32::MAX] {
        let mut bytes = vec![0; 80];
        bytes.extend(count.to_le_bytes());
        bytes.extend([0; 40]);
        let message = load("part.stl", bytes, SMALL);
        assert_says(&message, &["part.stl", "triangles take"]);
    }
}

/// Splitting a polygon takes time quadratic in the number of its corners, unless it is convex.
#[test]
fn polygon_of_a_hundred_thousand_corners() {
    let _turn = take_turn();
    let n = 100_000;
    let elements = "element vertex N\nXYZ\nelement face 1\nproperty list int int vertex_indices\n";
    let head = ply("ascii", &elements.replace('N', &n.to_string())).replace("float", "double");
    let indices: String = (0..n).map(|i| format!(" {i}")).collect();
    let polygon = |height: fn(f64) -> f64| {
        let corner = |i: u32| format!("{i} {} 0\n", height(i.into()));
        let corners: String = (0..n).map(corner).collect();
        load("scan.ply", format!("{head}{corners}{n}{indices}\n"), TEXT)
    };
    assert_eq!(polygon(|x| x * x / 1e5), "");
    // A comb.
    assert_says(
        &polygon(|x| if x == 0.0 { -1.0 } else { x % 2.0 }),
        &["scan.ply", "a face has 100000 corners and is not convex"],
    );
}

/// Texts of some megabytes. A reader that takes time quadratic in their size takes more than the limit of [`judge`].
#[test]
fn long_meshes_take_no_longer_than_they_are() {
    let _turn = take_turn();
    let n = 100_000;
    let vertices = format!("element vertex {n}\nXYZ\n");
    let points: String = (0..n)
        .map(|i| format!("{} {} 0\n", i % 300, i / 300))
        .collect();
    let indices = |mut index: Box<dyn FnMut(usize) -> usize>| -> String {
        (0..n).map(|i| format!(" {}", index(i))).collect()
    };
    let list = "property list int int vertex_indices\n";
    let of_one = |name: &str, indices: &str| {
        let head = ply("ascii", &format!("{vertices}element {name} 1\n{list}"));
        format!("{head}{points}{n}{indices}\n")
    };
    let all = indices(Box::new(|i| i));
    let same = indices(Box::new(|_| 7));
    let zigzag = indices(Box::new(move |i| if i % 2 == 0 { i } else { n - i }));
    let many: String = (0..2 * n).map(|i| format!("element e{i} 0\n")).collect();
    let properties: String = (0..2 * n).map(|i| format!("property int p{i}\n")).collect();
    let unknown: String = (0..n / 3).map(|i| format!("word{i} 0\n")).collect();
    for (name, text) in [
        ("face", of_one("face", &all)),
        ("same", of_one("face", &same)),
        ("zigzag", of_one("face", &zigzag)),
        ("strip", of_one("tristrips", &all)),
        ("restarts", of_one("tristrips", &" -1".repeat(n))),
        ("elements", ply("ascii", &many)),
        (
            "properties",
            ply("ascii", &format!("{vertices}{properties}")),
        ),
        ("words", ply("ascii", &format!("{unknown}{vertices}"))),
        (
            "comments",
            ply("ascii", &"comment TextureFile a.png\n".repeat(n / 3)),
        ),
        (
            "blank lines",
            ply("ascii", &vertices) + &"\n".repeat(10 * n),
        ),
    ] {
        timed("scan.ply", name, text.as_bytes());
    }
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let corner = |i: usize| format!("vertex {} {} 0\n", i % 300, i / 300);
    let corners: String = (0..n).map(corner).collect();
    for (name, text) in [
        ("facets", format!("solid\n{}", facet.repeat(n / 10))),
        (
            "corners",
            format!("solid\nfacet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n"),
        ),
        ("solids", "solid\n".repeat(n)),
        (
            "one line",
            format!("solid\n{}", facet.repeat(n / 10).replace('\n', " ")),
        ),
        (
            "normals",
            format!("solid\n{}", "facet normal 0 0 1\n".repeat(n)),
        ),
        (
            "loops",
            format!("solid\n{}", "outer loop endloop\n".repeat(n)),
        ),
    ] {
        timed("part.stl", name, text.as_bytes());
    }
    // Corners whose bits differ little, as hash tables dislike them.
    let mut binary = vec![0; 80];
    binary.extend((n as u32 / 5).to_le_bytes());
    for triangle in 0..n / 5 {
        binary.extend([0; 12]);
        for value in (0..9).map(|i| f32::from_bits(0x3f80_0000 + 9 * triangle as u32 + i)) {
            binary.extend(value.to_le_bytes());
        }
        binary.extend([0; 2]);
    }
    timed("part.stl", "near", &binary);
}

fn timed(name: &'static str, what: &str, bytes: &[u8]) {
    let start = Instant::now();
    let message = load(name, bytes, TEXT);
    println!(
        "{name}, {what}: {:.2} s, {message:.80}",
        start.elapsed().as_secs_f64()
    );
}

#[test]
fn long_material_libraries_take_no_longer_than_they_are() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{MESH}"));
    folder.write("mesh.obj", TRIANGLE);
    image::GrayImage::new(2, 2)
        .save(folder.path("wood.png"))
        .unwrap();
    let n = 300_000;
    let white = "newmtl white\nKd 0.5\n";
    for library in [
        format!("{white}map_Kd{} wood.png\n", " -clamp on".repeat(2 * n)),
        format!("{white}map_Kd{} wood.png\n", " -s 1".repeat(2 * n)),
        format!("{white}map_Kd{} wood.png\n", " -s".repeat(n / 10)),
        format!("{white}map_Kd -s{}\n", " 1".repeat(n)),
        format!("{white}map_Kd {}\n", "-s 1 \\\n".repeat(n / 10)),
        format!("{white}map_Kd {}\n", "a\\".repeat(n)),
        format!("{white}{}", "Ke 1 1 1\n".repeat(n / 3)),
        format!(
            "{white}{}",
            (0..n / 10)
                .map(|i| format!("word{i} 1\n"))
                .collect::<String>()
        ),
        format!(
            "{white}{}",
            (0..n / 10)
                .map(|i| format!("newmtl m{i}\n"))
                .collect::<String>()
        ),
        format!("{white}{}", "newmtl white\n".repeat(n / 10)),
    ] {
        folder.write("mesh.mtl", &library);
        let start = Instant::now();
        let message = judge("mesh.mtl", library.as_bytes(), TEXT, |_| message(&folder));
        let beginning: String = library[white.len()..].chars().take(20).collect();
        println!(
            "{beginning:?}: {:.2} s, {message:.80}",
            start.elapsed().as_secs_f64()
        );
    }
}
