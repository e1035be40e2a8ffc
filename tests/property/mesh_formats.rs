//! How OBJ, MTL, PLY and STL files of other programs are read: line ends, numbers, colours, textures, strips.

use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE, assert_says};
use camlux::Scene;
use camlux::scene::{Encoding, Mesh, Texels, Wrap};
use glam::DVec3;

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
const CORNERS: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

/// Loads a mesh with a material of the scene file.
fn load(folder: &SceneFolder, name: &str, content: impl AsRef<[u8]>) -> Scene {
    folder.write(name, content);
    let mesh =
        format!("[material.clay]\nkd = 0.5\n[[mesh]]\npath = \"{name}\"\nmaterial = \"clay\"\n");
    let scene = folder.load(&format!("{CAMERA}{LIGHT}{mesh}"));
    scene.unwrap_or_else(|error| panic!("{error}"))
}

fn load_obj(obj: &str) -> Scene {
    let scene = SceneFolder::new().load_obj(obj);
    scene.unwrap_or_else(|error| panic!("{error}"))
}

fn corners(mesh: &Mesh, triangle: usize) -> [DVec3; 3] {
    mesh.triangles[triangle].map(|vertex| mesh.positions_m[vertex as usize])
}

fn colors(mesh: &Mesh, triangle: usize) -> [[f32; 3]; 3] {
    mesh.triangles[triangle].map(|vertex| mesh.colors[vertex as usize])
}

fn warnings(scene: &Scene) -> String {
    scene.warnings().join("\n")
}

#[test]
fn all_line_ends_and_a_byte_order_mark_are_read() {
    let folder = SceneFolder::new();
    for end in ["\r", "\r\n", "\n"] {
        for mark in ["", "\u{feff}"] {
            let with = |text: &str| format!("{mark}{}", text.replace('\n', end));
            folder.write("mesh.mtl", with("newmtl white\nKd 0.5\n"));
            let scene = folder.load_obj(&with(TRIANGLE)).unwrap();
            assert_eq!(corners(&scene.meshes[0], 0), CORNERS);
            let bad = folder.load_obj(&with(&TRIANGLE.replace("f 1 2 3", "f 1 2 9")));
            assert!(folder.error(bad).contains("mesh.obj:6: "));
            for (name, text) in [("a.ply", PLY), ("a.stl", STL)] {
                let scene = load(&folder, name, with(text));
                assert_eq!(corners(&scene.meshes[0], 0), CORNERS, "{name} {end:?}");
            }
        }
    }
}

#[test]
fn numbers_may_lack_digits_before_or_after_the_point() {
    let folder = SceneFolder::new();
    let short = |text: &str| {
        text.replace("1 0 0", "1. .0 -.0")
            .replace("0 1 0", "+0 1.e0 0.")
    };
    for (name, text) in [("a.obj", TRIANGLE), ("a.ply", PLY), ("a.stl", STL)] {
        let scene = load(&folder, name, short(text));
        assert_eq!(corners(&scene.meshes[0], 0), CORNERS, "{name}");
    }
}

/// The header of a binary file may end its lines as Windows does. Its first byte may be a line feed.
#[test]
fn the_body_of_a_binary_ply_begins_after_its_header() {
    let folder = SceneFolder::new();
    for end in ["\n", "\r\n", "\r"] {
        for first in [0.0_f32, f32::from_le_bytes([b'\n', 0, 0, 0])] {
            let header = PLY.split("0 0 0\n").next().unwrap();
            let header = header.replace("ascii", "binary_little_endian");
            let mut file = header.replace('\n', end).into_bytes();
            for value in [first, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
                file.extend(value.to_le_bytes());
            }
            file.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
            let scene = load(&folder, "a.ply", &file);
            let expected = DVec3::new(first.into(), 0.0, 0.0);
            assert_eq!(corners(&scene.meshes[0], 0), [expected, DVec3::X, DVec3::Y]);
            assert!(scene.warnings().is_empty());
            file.push(0);
            let scene = load(&folder, "a.ply", &file);
            assert!(warnings(&scene).contains("what follows the last element"));
        }
    }
    // Only the last line of the header ends as on Windows.
    let (header, body) = PLY.split_once("0 0 0\n").unwrap();
    let mixed = format!("{}\r\n0 0 0\n{body}", header.trim_end());
    let scene = load(&folder, "a.ply", mixed);
    assert_eq!(corners(&scene.meshes[0], 0), CORNERS);
}

/// Rhino writes `usemtl` without a name for faces without a material.
#[test]
fn faces_without_a_material_take_that_of_the_scene_file() {
    let folder = SceneFolder::new();
    let scene = load(&folder, "a.obj", TRIANGLE.replace("usemtl white", "usemtl"));
    assert_eq!(corners(&scene.meshes[0], 0), CORNERS);
    let error = folder.error(folder.load_obj(&TRIANGLE.replace("usemtl white", "usemtl")));
    assert!(error.contains("a face has no material"), "{error}");
}

#[test]
fn normals_that_are_no_numbers_make_their_face_flat() {
    for normal in [
        "-1.#IND -1.#IND -1.#IND",
        "nan nan nan",
        "-nan(ind) 0 0",
        "1.#QNAN 0 1",
        "0 0 inf",
    ] {
        let faces = format!("vn 0 1 0\nvn {normal}\nf 1//1 2//1 3//2\nf 1//1 2//1 3//1\n");
        let scene = load_obj(&TRIANGLE.replace("f 1 2 3\n", &faces));
        let mesh = &scene.meshes[0];
        let normals = |triangle: usize| mesh.triangles[triangle].map(|v| mesh.normals[v as usize]);
        assert_eq!(normals(0), [DVec3::Z; 3], "{normal}");
        assert_eq!(normals(1), [DVec3::Y; 3], "{normal}");
        assert!(
            warnings(&scene).contains("normals that are no numbers"),
            "{normal}"
        );
    }
}

#[test]
fn faces_of_fewer_than_three_corners_are_left_out_with_a_warning() {
    let folder = SceneFolder::new();
    let obj = TRIANGLE.replace("f 1 2 3\n", "f\nf 1\nf 1 2\nf 1 2 3\nf 2 1\n");
    let ply = PLY
        .replace("face 1", "face 4")
        .replace("3 0 1 2", "0\n1 1\n3 0 1 2\n2 0 1");
    for (name, text, count) in [("a.obj", obj, 4), ("a.ply", ply, 3)] {
        let scene = load(&folder, name, text);
        assert_eq!(scene.meshes[0].triangles.len(), 1);
        assert_eq!(corners(&scene.meshes[0], 0), CORNERS);
        let says = format!("faces of fewer than three corners ({count} times)");
        assert!(warnings(&scene).contains(&says), "{}", warnings(&scene));
    }
}

#[test]
fn vertex_colours_of_obj_are_read() {
    let obj = |a: &str, b: &str, c: &str| {
        format!("mtllib mesh.mtl\nusemtl white\nv 0 0 0{a}\nv 1 0 0{b}\nv 0 1 0{c}\nf 1 2 3\n")
    };
    let read = |a: &str, b: &str, c: &str| colors(&load_obj(&obj(a, b, c)).meshes[0], 0);
    let due = [[0.5, 0.25, 1.0], [1.0; 3], [0.0; 3]];
    assert_eq!(read(" 0.5 0.25 1", " 1 1 1", " 0 0 0"), due);
    // With a weight, and without a colour.
    assert_eq!(read(" 1 0.5 0.25 1", "", " 0 0 0"), due);
    assert_eq!(
        read("", " 1 0.5 0.25 1", " 0 0 0"),
        [due[1], due[0], due[2]]
    );
    // Whole numbers up to 255.
    assert_eq!(
        read(" 255 0 51", " 0 0 0", " 255 255 255"),
        [[1.0, 0.0, 0.2], [0.0; 3], [1.0; 3]]
    );
    let scene = load_obj(&obj(" 0.5 0.25 3.5", " 1 1 1", ""));
    assert_eq!(colors(&scene.meshes[0], 0)[0], [0.5, 0.25, 1.0]);
    assert!(warnings(&scene).contains("colours of vertices beyond 0 to 1"));
    assert!(load_obj(TRIANGLE).meshes[0].colors.is_empty());
}

#[test]
fn colours_of_ply_are_read() {
    let folder = SceneFolder::new();
    let with = |kind: &str, names: [&str; 3], values: [&str; 3]| {
        let properties = names
            .map(|name| format!("property {kind} {name}\n"))
            .concat();
        let file = PLY.replace("element face", &format!("{properties}element face"));
        let file = file.replace("0 0 0\n", &format!("0 0 0 {}\n", values[0]));
        let file = file.replace("1 0 0\n", &format!("1 0 0 {}\n", values[1]));
        file.replace("\n0 1 0\n", &format!("\n0 1 0 {}\n", values[2]))
    };
    let rgb = ["red", "green", "blue"];
    for (kind, names, values) in [
        ("uchar", rgb, ["255 0 51", "0 0 0", "255 255 255"]),
        (
            "ushort",
            rgb,
            ["65535 0 13107", "0 0 0", "65535 65535 65535"],
        ),
        ("float", ["r", "g", "b"], ["1 0 .2", "0 0 0", "1 1 1"]),
        (
            "uchar",
            ["Diffuse_Red", "diffuse_green", "diffuse_blue"],
            ["255 0 51", "0 0 0", "255 255 255"],
        ),
        ("float", rgb, ["255 0 51", "0 0 0", "255 255 255"]),
    ] {
        let scene = load(&folder, "a.ply", with(kind, names, values));
        let due = [[1.0, 0.0, 0.2], [0.0; 3], [1.0; 3]];
        assert_eq!(colors(&scene.meshes[0], 0), due, "{kind} {names:?}");
        assert!(scene.warnings().is_empty(), "{}", warnings(&scene));
    }
    // Alpha is nothing to warn of unless it matters.
    for (alpha, is_named) in [("255", false), ("254", true)] {
        let names = ["red", "green", "blue\nproperty uchar alpha"];
        let value = format!("255 0 0 {alpha}");
        let scene = load(&folder, "a.ply", with("uchar", names, [&value; 3]));
        assert_eq!(
            warnings(&scene).contains("\"alpha\" of \"vertex\" (3 times)"),
            is_named
        );
    }
}

#[test]
fn colours_of_faces_become_colours_of_their_corners() {
    let folder = SceneFolder::new();
    let file = PLY
        .replace(
            "end_header",
            "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header",
        )
        .replace("face 1", "face 2")
        .replace("3 0 1 2\n", "3 0 1 2 255 0 0\n3 2 1 0 0 0 255\n");
    let scene = load(&folder, "a.ply", &file);
    let mesh = &scene.meshes[0];
    assert_eq!(colors(mesh, 0), [[1.0, 0.0, 0.0]; 3]);
    assert_eq!(colors(mesh, 1), [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(mesh.positions_m.len(), 6);
    assert!(scene.warnings().is_empty(), "{}", warnings(&scene));
}

#[test]
fn strips_of_triangles_alternate_and_begin_anew_at_minus_one() {
    let folder = SceneFolder::new();
    let strips = "element tristrips 1\nproperty list int int vertex_indices\n";
    let head = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n";
    let vertices = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n";
    let alone = format!("{head}{strips}end_header\n{vertices}9 0 1 2 3 -1 2 3 4 5\n");
    let mesh = &load(&folder, "a.ply", &alone).meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]]);
    // Joined by triangles without area, which are none.
    let joined = alone.replace("9 0 1 2 3 -1 2 3 4 5", "6 0 1 2 2 3 4");
    let mesh = &load(&folder, "a.ply", &joined).meshes[0];
    assert_eq!(
        mesh.triangles,
        [[0, 1, 2], [4, 3, 2]].map(|t: [u32; 3]| t).map(|t| {
            // The parity goes on over what is left out.
            if t == [4, 3, 2] { [3, 2, 4] } else { t }
        })
    );
    let faces = "element face 1\nproperty list uchar int vertex_indices\n";
    let beside = format!("{head}{faces}{strips}end_header\n{vertices}4 0 1 3 2\n4 2 3 4 5\n");
    let mesh = &load(&folder, "a.ply", &beside).meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 3], [0, 3, 2], [2, 3, 4], [4, 3, 5]]);
    let points = format!("{head}end_header\n{vertices}");
    let scene = load(&folder, "a.ply", &points);
    assert!(warnings(&scene).contains("the points of a file without faces"));
}

fn ply_with_texture(comments: &str, of_vertex: bool, numbers: bool) -> String {
    let number = if numbers {
        "property int texnumber\n"
    } else {
        ""
    };
    let mut file = PLY.replace(
        "format ascii 1.0\n",
        &format!("format ascii 1.0\n{comments}"),
    );
    if of_vertex {
        file = file.replace(
            "element face",
            "property float s\nproperty float t\nelement face",
        );
        file = file
            .replace("0 0 0\n", "0 0 0 .1 .2\n")
            .replace("1 0 0\n", "1 0 0 .3 .4\n");
        return file.replace("\n0 1 0\n", "\n0 1 0 .5 .6\n");
    }
    let list = format!("property list uchar double texcoord\n{number}end_header");
    let more = if numbers { [" 1", " -1"] } else { [""; 2] };
    file.replace("face 1", "face 2")
        .replace("end_header", &list)
        .replace(
            "3 0 1 2\n",
            &format!(
                "3 0 1 2 6 .1 .2 .3 .4 .5 .6{}\n3 0 1 2 6 .9 .2 .3 .4 .5 .6{}\n",
                more[0], more[1]
            ),
        )
}

#[test]
fn texture_files_of_ply_are_read() {
    let folder = SceneFolder::new();
    std::fs::create_dir(folder.path("tex")).unwrap();
    for name in ["a b.png", "tex/b.png"] {
        image::RgbImage::new(1, 1).save(folder.path(name)).unwrap();
    }
    let of_corner = ply_with_texture("comment TextureFile a b.png\n", false, false);
    let of_vertex = ply_with_texture("comment TextureFile tex\\b.png\n", true, false);
    for (file, count) in [(of_corner, 4), (of_vertex, 3)] {
        let scene = load(&folder, "a.ply", file);
        let mesh = &scene.meshes[0];
        let uv =
            mesh.triangles[0].map(|v| mesh.texcoords[v as usize].map(|x| (x * 1e6).round() / 1e6));
        assert_eq!(uv, [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]]);
        assert_eq!(mesh.positions_m.len(), count);
        // The scene's material stays as it is.
        let [own, textured] = &scene.materials[..] else {
            panic!("{:?}", scene.materials);
        };
        assert_eq!(
            (own.kd_texture, textured.kd_texture),
            (None, Some(0.into()))
        );
        assert_eq!(textured.kd, own.kd);
        assert_eq!(mesh.triangle_materials[0], 1);
        assert!(scene.warnings().is_empty(), "{}", warnings(&scene));
    }
    let both = "comment TextureFile a b.png\ncomment TextureFile tex/b.png\n";
    let scene = load(&folder, "a.ply", ply_with_texture(both, false, true));
    // The second texture, and none.
    assert_eq!(scene.meshes[0].triangle_materials, [2, 0]);
    assert_eq!(scene.materials[2].kd_texture, Some(1.into()));
    let untextured = PLY.replace(
        "element vertex",
        "comment TextureFile a b.png\nelement vertex",
    );
    let scene = load(&folder, "a.ply", untextured);
    assert!(warnings(&scene).contains("comment TextureFile"));
}

#[test]
fn stl_text_and_binary_are_the_same_mesh() {
    let folder = SceneFolder::new();
    let text = format!(
        "{}solid b\nfacet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 0 1 0\nvertex 1e0 1 -0\nendloop\nendfacet\nendsolid",
        STL.to_uppercase()
    );
    let mut binary = b"solid of a program that begins its header like a text".to_vec();
    binary.resize(80, b' ');
    binary.extend(2_u32.to_le_bytes());
    for triangle in [
        [0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0],
        [0, 0, 1, 1, 0, 0, 0, 1, 0, 1, 1, 0],
    ] {
        for value in triangle {
            binary.extend((value as f32).to_le_bytes());
        }
        binary.extend([0, 0]);
    }
    for (content, more) in [
        (text.into_bytes(), ""),
        (binary.clone(), ""),
        (
            [&binary[..], b"end"].concat(),
            "3 bytes after the last triangle",
        ),
    ] {
        let scene = load(&folder, "a.STL", content);
        let mesh = &scene.meshes[0];
        // Two corners are shared.
        assert_eq!(mesh.positions_m.len(), 4);
        assert_eq!(mesh.triangles, [[0, 1, 2], [1, 2, 3]]);
        assert!(mesh.normals.is_empty());
        let warnings = warnings(&scene);
        assert!(
            warnings.contains("normals that oppose") && warnings.contains(more),
            "{warnings}"
        );
    }
    binary[132] = 7;
    let warnings = warnings(&load(&folder, "a.stl", binary));
    assert_says(&warnings, &["attribute bytes of triangles"]);
}

#[test]
fn maps_of_mtl_have_options_blanks_and_backslashes() {
    let folder = SceneFolder::new();
    std::fs::create_dir(folder.path("my tex")).unwrap();
    let red = image::RgbImage::from_pixel(1, 1, image::Rgb([255, 0, 0]));
    red.save(folder.path("my tex/red wood.png")).unwrap();
    let read = |line: &str| {
        let mtl = format!("newmtl white\nKd 0.5\nKs 0.2\nNs 20\n{line}\n");
        folder.write("mesh.mtl", mtl);
        let obj = TRIANGLE.replace("f 1 2 3", "vt 0 0\nf 1/1 2/1 3/1");
        let scene = folder.load_obj(&obj);
        scene.unwrap_or_else(|error| panic!("{line}: {error}"))
    };
    for line in [
        "map_Kd my tex/red wood.png",
        "map_Kd my tex\\red wood.png",
        "map_kd \"my tex\\red wood.png\"",
        "MAP_KD   my tex/red wood.png   # a comment",
        "map_Kd -clamp off my tex/red wood.png",
    ] {
        let lookup = read(line).materials[0].kd_texture.expect(line);
        assert!(lookup.is_direct() && lookup.wrap == [Wrap::Repeat; 2]);
    }
    let path = "my tex\\red wood.png";
    let scene = read(&format!("map_Kd -o 0.25 -0.5 0 -s 2 3 1 -clamp on {path}"));
    let lookup = scene.materials[0].kd_texture.unwrap();
    assert_eq!(lookup.transform, [[2.0, 0.0, 0.25], [0.0, 3.0, -0.5]]);
    assert_eq!(lookup.wrap, [Wrap::Clamp; 2]);
    let scene = read(&format!("map_Ks -s 4 {path}\nmap_Ns {path}"));
    let material = &scene.materials[0];
    let ks = material.ks_texture.unwrap();
    assert_eq!(ks.transform, [[4.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(material.ks, [0.2; 3]);
    assert!(matches!(
        scene.textures[ks.texture].texels,
        Texels::U8(_, Encoding::Srgb)
    ));
    // The brightness of red by BT.709, not decoded.
    let factor = &scene.textures[material.shininess_texture.unwrap().texture];
    assert!((factor.texels.reflectance(0)[0] - 0.2126).abs() < 1e-6);
}

/// `map_Pr` and `map_Pm` become one texture: roughness in green, metallic in blue.
#[test]
fn repeated_meshes_have_one_warning_a_file() {
    let folder = SceneFolder::new();
    folder.write("mesh.mtl", "newmtl white\nKd 0.5\nKa 1 1 1\n");
    folder.write("mesh.obj", format!("{TRIANGLE}l 1 2\n"));
    let moved = format!("{MESH}translate = [1, 0, 0]\n");
    let scene = folder.load(&format!("{CAMERA}{LIGHT}{MESH}{moved}{MESH}flat = true\n"));
    let scene = scene.unwrap();
    let warnings = scene.warnings();
    let ignored = warnings.iter().filter(|w| w.contains("camlux ignores"));
    assert_eq!(ignored.count(), 2, "{warnings:#?}");
}
