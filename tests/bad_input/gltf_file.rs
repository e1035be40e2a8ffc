//! glTF files that are damaged or need unsupported features: each gives one clear error that names the file.

use crate::common::gltf_file::GltfBuilder;
use crate::common::scene_folder::{CAMERA, LIGHT, SceneFolder, assert_says};

const TRIANGLE: [[f32; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
const NODE: &str = r#""nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}]"#;

fn load(folder: &SceneFolder, name: &str) -> camlux::Result<camlux::Scene> {
    folder.load(&format!("{CAMERA}{LIGHT}[[mesh]]\npath = \"{name}\"\n"))
}

#[track_caller]
fn refuses_file(file: &[u8], parts: &[&str]) {
    let folder = SceneFolder::new();
    folder.write("room.glb", file);
    assert_says(&folder.error(load(&folder, "room.glb")), parts);
}

/// Asserts that a file with a triangle and these JSON members is refused.
#[track_caller]
fn refuses(members: &str, parts: &[&str]) {
    let mut builder = GltfBuilder::default();
    builder.vec3(&TRIANGLE);
    builder.indices_u16(&[0, 1, 3]);
    refuses_file(&builder.glb(members), &[&["room.glb"], parts].concat());
}

/// A valid mesh whose primitive also has these members.
fn mesh(more: &str) -> String {
    format!(r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}{more}}}]}}]"#)
}

#[test]
fn a_triangle_loads() {
    let folder = SceneFolder::new();
    let mut builder = GltfBuilder::default();
    builder.vec3(&TRIANGLE);
    folder.write("room.glb", builder.glb(&format!("{},{NODE}", mesh(""))));
    let scene = load(&folder, "room.glb").unwrap();
    assert_eq!(scene.meshes[0].triangles, [[0, 1, 2]]);
}

#[test]
fn files_that_are_none() {
    let folder = SceneFolder::new();
    assert_says(
        &folder.error(load(&folder, "none.gltf")),
        &[
            "scene.toml:12: cannot read the mesh none.gltf",
            "correct the path",
        ],
    );
    for file in [
        &b"no json"[..],
        b"glTF",
        b"",
        b"{}",
        b"{\"asset\":{\"version\":\"1.0\"}}",
    ] {
        refuses_file(file, &["room.glb"]);
    }
    refuses_file(
        b"{\"asset\":{\"version\":\"2.0\"}}",
        &["has no scene", "export one"],
    );
    // A file cut off in the middle of its buffer.
    let mut builder = GltfBuilder::default();
    builder.vec3(&TRIANGLE);
    let file = builder.glb(&format!("{},{NODE}", mesh("")));
    refuses_file(&file[..file.len() - 8], &["room.glb"]);
}

#[test]
fn parts_that_are_missing_or_beyond() {
    refuses(
        &format!("{},{NODE}", mesh(r#","indices":1"#)),
        &["index 3, but only 3 positions"],
    );
    refuses(
        &format!("{},{NODE}", mesh(r#","indices":0"#)),
        &["indices are of type F32"],
    );
    refuses(
        &format!("{},{NODE}", mesh(r#","indices":7"#)),
        &["not valid glTF 2.0"],
    );
    let absent = r#""meshes":[{"primitives":[{"attributes":{"POSITION":9}}]}]"#;
    refuses(
        &format!("{absent},{NODE}"),
        &["accessor 9, but the file has 2"],
    );
    let scalar = r#""meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1}}]}]"#;
    refuses(
        &format!("{scalar},{NODE}"),
        &["accessor 1 has 1 components instead of 3"],
    );
    let twice = r#""nodes":[{"mesh":0,"children":[1]},{"children":[0]}],"scenes":[{"nodes":[0]}]"#;
    refuses(
        &format!("{},{twice}", mesh("")),
        &["node 0 is at two places", "one parent"],
    );
    let light =
        r#""nodes":[{"extensions":{"KHR_lights_punctual":{"light":2}}}],"scenes":[{"nodes":[0]}]"#;
    refuses(light, &["light 2, but the file has 0"]);
    let image = r#""images":[{}],"scenes":[{"nodes":[]}]"#;
    refuses(image, &["image 0 has neither"]);
}

#[test]
fn what_is_not_known() {
    let required = format!(
        r#""extensionsRequired":["KHR_draco_mesh_compression"],"extensionsUsed":["KHR_draco_mesh_compression"],{},{NODE}"#,
        mesh("")
    );
    refuses(
        &required,
        &[
            "requires the extension KHR_draco_mesh_compression",
            "export it without",
        ],
    );
    let textured = format!(
        r#""images":[{{"uri":"none.png"}}],"textures":[{{"source":0}}],
        "materials":[{{"name":"wood","pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],{},{NODE}"#,
        mesh(r#","material":0"#)
    );
    refuses(
        &textured,
        &["cannot read none.png, which it names", "export a .glb"],
    );
    let data = textured.replace("none.png", "data:image/png;base64,AAAA");
    refuses(
        &data,
        &["material \"wood\": cannot read image 0", "PNG or JPEG"],
    );
}
