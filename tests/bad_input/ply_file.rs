//! PLY files that are damaged or contain no mesh: each gives one clear error that names the file.

use crate::common::scene_folder::{CAMERA, LIGHT, SceneFolder, assert_says};

const TRIANGLE: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const MESH: &str =
    "[material.clay]\nkd = 0.5\n[[mesh]]\npath = \"scan.ply\"\nmaterial = \"clay\"\n";

fn load(file: &str, mesh: &str) -> (SceneFolder, camlux::Result<camlux::Scene>) {
    let folder = SceneFolder::new();
    folder.write("scan.ply", file);
    let loaded = folder.load(&format!("{CAMERA}{LIGHT}{mesh}"));
    (folder, loaded)
}

#[track_caller]
fn refuses(file: &str, parts: &[&str]) {
    let (folder, loaded) = load(file, MESH);
    assert_says(&folder.error(loaded), parts);
}

#[test]
fn a_triangle_loads() {
    let (_, loaded) = load(TRIANGLE, MESH);
    assert_eq!(loaded.unwrap().meshes[0].triangles, [[0, 1, 2]]);
}

#[test]
fn what_is_no_mesh_is_refused() {
    refuses("ply\n", &["scan.ply: not valid PLY", "export it again"]);
    refuses(
        &TRIANGLE.replace("3 0 1 2\n", ""),
        &["scan.ply: not valid PLY"],
    );
    refuses(
        &TRIANGLE.replace("3 0 1 2", "3 0 1 3"),
        &["a face uses vertex 3, but there are 3 vertices"],
    );
    refuses(
        &TRIANGLE.replace("3 0 1 2", "3 0 -1 2"),
        &["a face uses vertex -1, but there are 3 vertices"],
    );
    refuses(&TRIANGLE.replace("float x", "float a"), &["no x, y and z"]);
    refuses(
        &TRIANGLE.replace("list uchar int vertex", "list uchar float vertex"),
        &["scan.ply: not valid PLY"],
    );
    refuses(
        &TRIANGLE.replace("vertex 3", "vertex 3000000000"),
        &["scan.ply: not valid PLY"],
    );
    let (folder, loaded) = load(TRIANGLE, "[[mesh]]\npath = \"scan.ply\"\n");
    assert_says(
        &folder.error(loaded),
        &["scene.toml:12: ", "has no materials", "material = "],
    );
    let (folder, loaded) = load("", &MESH.replace("scan.ply", "other.ply"));
    assert_says(
        &folder.error(loaded),
        &["cannot read the mesh other.ply", "correct the path"],
    );
}
