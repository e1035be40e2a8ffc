//! Bad meshes, material libraries and textures: each is refused with a message that states what is wrong, in which line, and how to mend it.

use crate::common::rows::rows;
use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE, assert_says};

#[track_caller]
fn refuses_obj(obj: &str, parts: &[&str]) {
    let folder = SceneFolder::new();
    assert_says(&folder.error(folder.load_obj(obj)), parts);
}

#[track_caller]
fn refuses_mtl(mtl: &str, parts: &[&str]) {
    let folder = SceneFolder::new();
    folder.write("mesh.mtl", mtl);
    assert_says(&folder.error(folder.load_obj(TRIANGLE)), parts);
}

#[test]
fn missing_files() {
    let folder = SceneFolder::new();
    let toml = format!("{CAMERA}{LIGHT}{}", MESH.replace("mesh.obj", "other.obj"));
    assert_says(
        &folder.error(folder.load(&toml)),
        &[
            "scene.toml:12: cannot read the mesh other.obj",
            "relative to the file that names it",
        ],
    );
    refuses_obj(
        &TRIANGLE.replace("mesh.mtl", "other.mtl"),
        &[
            "mesh.obj:1: cannot read the material library other.mtl",
            "correct the path",
        ],
    );
    refuses_mtl(
        "newmtl white\nmap_Kd none.png\n",
        &[
            "mesh.mtl:2: cannot read the texture none.png",
            "PNG, JPEG or WebP",
        ],
    );
}

/// What a clone holds in place of large files that were not fetched.
#[test]
fn pointers_of_git_lfs_are_named_in_every_format() {
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 7\n";
    for name in ["a.obj", "a.ply", "a.stl", "a.gltf", "a.glb"] {
        let folder = SceneFolder::new();
        folder.write(name, pointer);
        let mesh =
            format!("[material.m]\nkd = 0.5\n[[mesh]]\npath = \"{name}\"\nmaterial = \"m\"\n");
        let error = folder.error(folder.load(&format!("{CAMERA}{LIGHT}{mesh}")));
        assert_says(&error, &[name, "a pointer of Git LFS", "run git lfs pull"]);
    }
    let folder = SceneFolder::new();
    folder
        .write("wood.png", pointer)
        .write("mesh.mtl", "newmtl white\nmap_Kd wood.png\n");
    let error = folder.error(folder.load_obj(TRIANGLE));
    assert_says(&error, &["wood.png", "a pointer of Git LFS"]);
}

#[test]
fn unreadable_texture() {
    let folder = SceneFolder::new();
    folder
        .write("wood.png", "this is no image")
        .write("mesh.mtl", "newmtl white\nmap_Kd wood.png\n");
    assert_says(
        &folder.error(folder.load_obj(TRIANGLE)),
        &[
            "mesh.mtl:2: cannot read the texture wood.png",
            "PNG, JPEG or WebP",
        ],
    );
    // Only the beginning of a PNG.
    folder.write("wood.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    assert_says(
        &folder.error(folder.load_obj(TRIANGLE)),
        &["mesh.mtl:2: cannot read the texture wood.png"],
    );
}

/// Asserts that a statement after three vertices is wrong.
fn refuses_statement(statement: &str, words: &[&str]) {
    let three = "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let line = 6 + statement.matches('\n').count();
    let at = format!("mesh.obj:{line}: ");
    refuses_obj(
        &format!("{three}{statement}\n"),
        &[&[&at[..]], words].concat(),
    );
}

#[test]
fn bad_obj_files() {
    rows! { refuses_statement;
        "v nan 0 0" => "\"v\" has \"nan\" instead of a number", "finite";
        "v 0 inf 0" => "\"v\" has \"inf\" instead of a number", "finite";
        "v 0 1e999 0" => "\"v\" has \"1e999\" instead of a number", "finite";
        "v 0 0" => "\"v\" has 2 numbers", "3 to 7";
        "v 0 zero 0" => "\"v\" has \"zero\" instead of a number", "finite";
        "vn 0 up 1" => "\"vn\" has \"up\" instead of a number", "finite";
        "v 0 0 0 1 1" => "\"v\" has 5 numbers", "colour r g b";
        "vt nan 1" => "\"vt\" has \"nan\" instead of a number", "finite";
        "f 1 2 4" => "\"f\" refers to 4, but there are 3 vertices", "begin at 1";
        "f 1 2 0" => "\"f\" refers to 0, but there are 3 vertices", "begin at 1";
        "f 1 2 -4" => "\"f\" refers to -4, but there are 3 vertices", "begin at 1";
        "f 1 2 9223372036854775807" => "refers to 9223372036854775807", "begin at 1";
        "f 1 2 -9223372036854775808" => "refers to -9223372036854775808", "begin at 1";
        "f 1 2 99999999999999999999" => "refers to 99999999999999999999", "begin at 1";
        "f 1 2 x" => "\"f\" refers to x, but there are 3 vertices", "begin at 1";
        "f 1//1 2//1 3//1" => "\"f\" refers to 1, but there are 0 normals", "begin at 1";
        "f 1/-1 2/-1 3/-1" =>
            "\"f\" refers to -1, but there are 0 texture coordinates", "begin at 1";
        "f 1/1/1/1 2 3" => "\"f\" has the corner \"1/1/1/1\"", "v/vt/vn";
        "f /1 2 3" => "\"f\" has the corner \"/1\"", "v/vt/vn";
        "vn 0 0 1\nf 1//1 2 3" => "mesh.obj:7: \"f\" has corners with and without", "same parts";
    }
    refuses_obj("\u{89}PNG\n", &["mesh.obj:1", "is not a statement"]);
}

#[test]
fn formats_that_are_not_read() {
    let folder = SceneFolder::new();
    for name in ["a.dae", "a.FBX", "a.3ds", "a.blend", "mesh", "a.objx"] {
        folder.write(name, TRIANGLE);
        let mesh = MESH.replace("mesh.obj", name);
        let says = format!("scene.toml:12: {name} is in no format that camlux reads");
        assert_says(
            &folder.error(folder.load(&format!("{CAMERA}{LIGHT}{mesh}"))),
            &[&says, ".gltf, .glb, .obj, .ply or .stl"],
        );
    }
    folder.write("MESH.OBJ", TRIANGLE);
    let mesh = MESH.replace("mesh.obj", "MESH.OBJ");
    folder.load(&format!("{CAMERA}{LIGHT}{mesh}")).unwrap();
}

#[test]
fn bad_materials_of_meshes() {
    rows! { refuses_obj;
        TRIANGLE.replace("usemtl white", "usemtl whit") =>
            "mesh.obj:2: material \"whit\" is in no MTL file", "did you mean \"white\"?";
        TRIANGLE.replace("mtllib mesh.mtl", "#") =>
            "mesh.obj:2: material \"white\" is in no MTL file", "mtllib";
        TRIANGLE.replace("usemtl white", "#") =>
            "mesh.obj:6: a face has no material", "usemtl", "material = ";
    }
    rows! { refuses_mtl;
        "newmtl white\n" => "mesh.mtl:1: material \"white\" has neither Kd nor map_Kd", "Kd 0.8";
        "newmtl white\nKd 1 1 1\nKs 0.1\n" =>
            "mesh.mtl:1: material \"white\" has Ks without Ns", "Ns 20";
        "newmtl white\nKd 1 1\n" => "mesh.mtl:2: \"Kd\" has two numbers", "one or three";
        "newmtl white\nKd\n" => "mesh.mtl:2: \"Kd\" has 0 numbers", "1 to 3";
        "newmtl white\nKd spectral a.rfl\n" =>
            "mesh.mtl:2: \"Kd\" has \"spectral\" instead of a number", "1 to 3";
        "newmtl white\nKd 1 nan 1\n" => "mesh.mtl:2: \"Kd\" has \"nan\"", "finite";
        "Kd 1 1 1\n" => "mesh.mtl:1: \"Kd\" stands before any material", "newmtl";
        "newmtl\n" => "mesh.mtl:1: \"newmtl\" names nothing", "write a name";
        "newmtl white\nKd 1\nnewmtl white\n" =>
            "mesh.mtl:3: material \"white\" is already defined at", "mesh.mtl:1";
        "newmtl white\nmap_Kd -scale 2 2 2 a.png\n" =>
            "mesh.mtl:2: \"map_Kd\" has the unknown option \"-scale\"", "-s";
        "newmtl white\nmap_Kd -s much a.png\n" =>
            "mesh.mtl:2: \"map_Kd\" has a -s that is not numbers", "path";
        "newmtl white\nmap_Kd -clamp 1 a.png\n" =>
            "mesh.mtl:2: \"map_Kd\" has a -clamp that is not on or off", "path";
        "newmtl white\nKd 1\nNs -3\n" =>
            "mesh.mtl:1, material 0 (\"white\"): shininess is -3", "0 or more";
    }
    refuses_mtl(
        "# first\nnewmtl white\nKd 1 2 0\n",
        &["mesh.mtl:2, material 0 (\"white\"): kd is [1.0, 2.0, 0.0]"],
    );
}

#[test]
fn textured_face_without_texture_coordinates_beside_faces_with_them() {
    let folder = SceneFolder::new();
    image::RgbImage::new(1, 1)
        .save(folder.path("a.png"))
        .unwrap();
    folder.write("mesh.mtl", "newmtl white\nmap_Kd a.png\n");
    let obj = format!("{TRIANGLE}vt 0 0\nf 1/1 2/1 3/1\n");
    assert_says(
        &folder.error(folder.load_obj(&obj)),
        &[
            "mesh.obj:6: a face of the textured material \"white\" has no texture coordinates",
            "vt",
        ],
    );
}

#[test]
fn nothing_to_see_is_no_error() {
    let folder = SceneFolder::new();
    let scene = folder.load(&format!("{CAMERA}{LIGHT}")).unwrap();
    assert!(scene.meshes.is_empty());
    assert_eq!(scene.bounding_box(), None);
    assert_eq!(scene.bounding_sphere(), None);

    for obj in ["", "# nothing\n", "v 0 0 0\nl 1 1 1\np 1\n"] {
        let scene = folder.load_obj(obj).unwrap();
        assert_eq!(scene.meshes.len(), 1);
        assert!(scene.meshes[0].triangles.is_empty());
    }
}
