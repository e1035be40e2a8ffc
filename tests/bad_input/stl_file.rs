//! STL files that are damaged: each gives one clear error that names the file.

use crate::common::scene_folder::{CAMERA, LIGHT, SceneFolder, assert_says};

const TEXT: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
const MESH: &str =
    "[material.clay]\nkd = 0.5\n[[mesh]]\npath = \"part.stl\"\nmaterial = \"clay\"\n";

#[track_caller]
fn refuses(file: impl AsRef<[u8]>, parts: &[&str]) {
    let folder = SceneFolder::new();
    folder.write("part.stl", file);
    let loaded = folder.load(&format!("{CAMERA}{LIGHT}{MESH}"));
    assert_says(&folder.error(loaded), parts);
}

#[test]
fn what_is_no_mesh_is_refused() {
    refuses("", &["part.stl", "not an STL file: it is empty"]);
    refuses(
        TEXT.replace("vertex 1 0 0", "vertex 1 0 up"),
        &["part.stl:5: \"up\" instead of a number"],
    );
    refuses(
        TEXT.replace("vertex 1 0 0", "vertex 1 0 inf"),
        &["part.stl:5: a vertex has a coordinate", "finite"],
    );
    refuses(
        TEXT.replace("outer", "inner"),
        &["part.stl:3: \"inner\" is no word of STL", "endloop"],
    );
    refuses(
        TEXT.split("endloop").next().unwrap(),
        &["part.stl:6: the file ends in the middle of its mesh"],
    );
    let mut binary = vec![0; 84];
    binary[80] = 2;
    binary.extend([0; 50]);
    refuses(
        &binary,
        &["part.stl: its 2 triangles take 184 bytes, but it has 134"],
    );
    binary[80] = 1;
    binary[96..100].copy_from_slice(&f32::INFINITY.to_le_bytes());
    refuses(
        &binary,
        &["part.stl: triangle 0 has a coordinate", "finite"],
    );
    refuses(&binary[..50], &["part.stl: not an STL file"]);
    let folder = SceneFolder::new();
    folder.write("part.stl", TEXT);
    let loaded = folder.load(&format!("{CAMERA}{LIGHT}[[mesh]]\npath = \"part.stl\"\n"));
    assert_says(
        &folder.error(loaded),
        &["scene.toml:12: ", "has no materials", "material = "],
    );
}
