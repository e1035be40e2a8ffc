//! PLY files that are damaged or contain no mesh: each gives one clear error that names the file.

use crate::common::rows::rows;
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
    refuses(
        "ply\n",
        &["scan.ply: not a whole PLY file", "export it again"],
    );
    refuses("", &["scan.ply: not a PLY file", "give a PLY file"]);
    let changed = |from: &str, to: &str| TRIANGLE.replace(from, to);
    rows! { refuses;
        changed("3 0 1 2\n", "") => "scan.ply:12: the file ends in the middle", "export";
        changed("3 0 1 2", "3 0 1") => "scan.ply:13: the file ends in the middle", "export";
        changed("3 0 1 2", "3 0 1 3") =>
            "scan.ply:13: a face uses vertex 3", "there are 3 vertices";
        changed("3 0 1 2", "3 0 -1 2") =>
            "scan.ply:13: a face uses vertex -1", "there are 3 vertices";
        changed("3 0 1 2", "3 0 1 1.5") =>
            "scan.ply:13: \"1.5\" instead of a whole number", "export";
        changed("0 0 0\n", "0 0 0 7\n") =>
            "scan.ply:10: there are more values than a vertex has", "header";
        changed("1 0 0\n", "nan 0 0\n") =>
            "scan.ply:11: a vertex has a coordinate", "not a finite number";
        changed("1 0 0\n", "1 0 up\n") => "scan.ply:11: \"up\" instead of a number", "export";
        changed("float x", "float a") => "scan.ply:3: its vertices have no x, y and z", "export";
        changed("float x", "floot x") => "scan.ply:4: ", "has the unknown type \"floot\"";
        changed("list uchar int", "list uchar float") =>
            "scan.ply:7: the indices of element \"face\"", "whole numbers";
        changed("vertex_indices", "vertex_indicies") =>
            "scan.ply:7: element \"face\" has no list", "\"vertex_indicies\"";
        changed("vertex 3", "vertex 3000000000") =>
            "scan.ply:13: there are more values than a vertex has", "header";
        changed("vertex 3", "vertex many") => "scan.ply:3: ", "has \"many\" instead of a count";
        changed("ascii", "asci") => "scan.ply:2: ", "did you mean \"ascii\"?";
        changed("float y", "float x") => "scan.ply:5: ", "names a property again";
    }
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

/// A binary file has no lines: its vertices count from 0.
#[test]
fn what_is_wrong_in_a_binary_file_is_named_by_its_index() {
    let header = TRIANGLE.split("end_header\n").next().unwrap();
    let header = header.replace("ascii", "binary_little_endian") + "end_header\n";
    for (corner, face, says) in [
        (1.0_f32, [0, 1, 3], "scan.ply: face 0: a face uses vertex 3"),
        (
            f32::NAN,
            [0, 1, 2],
            "scan.ply: vertex 2: a vertex has a coordinate",
        ),
    ] {
        let mut file = header.clone().into_bytes();
        for value in [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, corner, 0.0_f32] {
            file.extend(value.to_le_bytes());
        }
        file.push(3);
        face.iter()
            .for_each(|index: &i32| file.extend(index.to_le_bytes()));
        let folder = SceneFolder::new();
        folder.write("scan.ply", &file);
        let loaded = folder.load(&format!("{CAMERA}{LIGHT}{MESH}"));
        assert_says(&folder.error(loaded), &[says]);
        folder.write("scan.ply", &file[..file.len() - 13]);
        let loaded = folder.load(&format!("{CAMERA}{LIGHT}{MESH}"));
        let error = folder.error(loaded);
        assert!(
            error.contains("the file ends in it") || corner.is_nan(),
            "{error}"
        );
    }
}
