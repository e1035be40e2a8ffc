//! glTF files that are damaged or need unsupported features: each gives one clear error that names the file.

use crate::common::gltf_file::GltfBuilder;
use crate::common::rows::rows;
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
    rows! { refuses;
        format!("{},{NODE}", mesh(r#","indices":1"#)) => "index 3, but only 3 positions";
        format!("{},{NODE}", mesh(r#","indices":0"#)) => "indices are of type F32";
        format!("{},{NODE}", mesh(r#","indices":7"#)) => "not valid glTF 2.0";
    }
    let absent = r#""meshes":[{"primitives":[{"attributes":{"POSITION":9}}]}]"#;
    refuses(
        &format!("{absent},{NODE}"),
        &["a primitive uses accessor 9, but the file has 2"],
    );
    let scalar = r#""meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1}}]}]"#;
    refuses(
        &format!("{scalar},{NODE}"),
        &["accessor 1 is a SCALAR, of 1 components instead of 3"],
    );
    let twice = r#""nodes":[{"mesh":0,"children":[1]},{"children":[0]}],"scenes":[{"nodes":[0]}]"#;
    refuses(
        &format!("{},{twice}", mesh("")),
        &["node 0 is at two places", "one parent"],
    );
    let light =
        r#""nodes":[{"extensions":{"KHR_lights_punctual":{"light":2}}}],"scenes":[{"nodes":[0]}]"#;
    refuses(light, &["light 2, but the file has 0"]);
    let image = format!(
        r#""images":[{{}}],"textures":[{{"source":0}}],"materials":[{{"normalTexture":{{"index":0}}}}],{},{NODE}"#,
        mesh(r#","material":0"#)
    );
    refuses(&image, &["image 0 has neither"]);
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
    for (extension, says) in [
        ("KHR_draco_mesh_compression", "decompress it"),
        ("EXT_meshopt_compression", "decompress it"),
        ("KHR_texture_basisu", "PNG, JPEG or WebP"),
        ("X_y", "export it without that extension"),
    ] {
        let required = format!(
            r#""extensionsRequired":["{extension}"],{},{NODE}"#,
            mesh("")
        );
        refuses(&required, &[extension, says]);
    }
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
        &[
            "material \"wood\": cannot read image 0",
            "PNG, JPEG or WebP",
        ],
    );
}

/// Compressed data are told apart from missing data, whether the extension is required or not.
#[test]
fn compressed_data_are_refused_by_the_name_of_the_extension() {
    let draco = r#""accessors":[{"componentType":5126,"count":3,"type":"VEC3"}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{}}}}]}]"#;
    let meshopt = r#""accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],"buffers":[{"byteLength":36}],
        "bufferViews":[{"buffer":0,"byteLength":36,"extensions":{"EXT_meshopt_compression":{}}}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}]"#;
    let basis = r#""accessors":[{"componentType":5126,"count":3,"type":"VEC3"}],"images":[{"uri":"a.ktx2"}],
        "textures":[{"extensions":{"KHR_texture_basisu":{"source":0}}}],"materials":[{"normalTexture":{"index":0}}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}]"#;
    for (members, extension, hint) in [
        (draco, "KHR_draco_mesh_compression", "decompress it"),
        (meshopt, "EXT_meshopt_compression", "decompress it"),
        (basis, "KHR_texture_basisu", "PNG, JPEG or WebP"),
    ] {
        let file = format!(r#"{{"asset":{{"version":"2.0"}},{members},{NODE}}}"#);
        refuses_file(
            file.as_bytes(),
            &["room.glb", extension, "camlux does not read", hint],
        );
    }
}

/// A material whose texture has no image keeps its factor.
#[test]
fn a_texture_without_an_image_is_named() {
    let folder = SceneFolder::new();
    let file = format!(
        r#"{{"asset":{{"version":"2.0"}},"accessors":[{{"componentType":5126,"count":3,"type":"VEC3"}}],"textures":[{{}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"material":0}}]}}],{NODE}}}"#
    );
    folder.write(
        "room.gltf",
        file.replace(r#","TEXCOORD_0":1"#, r#","TEXCOORD_0":0"#),
    );
    let message = folder.error(load(&folder, "room.gltf"));
    assert_says(
        &message,
        &["accessor 0 is a VEC3, of 3 components instead of 2"],
    );
    let two = r#""type":"VEC3"},{"componentType":5126,"count":3,"type":"VEC2"}"#;
    folder.write("room.gltf", file.replace(r#""type":"VEC3"}"#, two));
    let scene = load(&folder, "room.gltf").unwrap();
    assert!(scene.materials[0].kd_texture.is_none());
    assert_says(
        &scene.warnings().join("\n"),
        &["a texture without an image"],
    );
}

/// The number of elements without data is bounded by the size of the file.
#[test]
fn elements_without_data_take_no_more_memory_than_the_file_may() {
    let of = |count: u64| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"accessors":[{{"componentType":5126,"count":{count},"type":"VEC3"}}],{},{NODE}}}"#,
            mesh("")
        )
    };
    for count in [100_000_000, u64::MAX] {
        refuses_file(
            of(count).as_bytes(),
            &["accessor 0 has", "elements without data"],
        );
    }
}

const CAMERAS: &str = r#"{"asset":{"version":"2.0"},"cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":1}},
    {"name":"lens","type":"perspective","perspective":{"yfov":0.7,"znear":1}}],"scenes":[{"nodes":[NODES]}],
    "nodes":[{"camera":0},{"camera":0,"name":"left","translation":[1,0,0]},{"camera":1,"name":"right"},{"camera":1,"name":"left"},
    {"camera":0,"scale":[1,1,-1]}]}"#;

/// The camera of these nodes of [`CAMERAS`].
fn camera(nodes: &str, name: &str) -> Result<camlux::scene::Camera, String> {
    let folder = SceneFolder::new();
    folder.write("cameras.gltf", CAMERAS.replace("NODES", nodes));
    let name = match name {
        "" => String::new(),
        name => format!("name = \"{name}\"\n"),
    };
    let camera = format!("[camera]\nresolution = [8, 8]\npath = \"cameras.gltf\"\n{name}");
    let loaded = folder.load(&format!("{camera}{LIGHT}[[mesh]]\npath = \"mesh.obj\"\n"));
    match loaded {
        Ok(scene) => Ok(scene.camera),
        error => Err(folder.error(error)),
    }
}

#[test]
fn cameras_are_found_with_and_without_names() {
    let fov_deg = |nodes: &str, name: &str| match camera(nodes, name).unwrap().lens {
        camlux::scene::Lens::FovY { fov_y_deg } => fov_y_deg.to_radians(),
        other => panic!("{other:?}"),
    };
    let is = |found: f64, due: f64| assert!((found - due).abs() < 1e-9, "{found} {due}");
    // The only one needs no name, whether it has one or not.
    is(fov_deg("0", ""), 0.5);
    is(fov_deg("2", ""), 0.7);
    is(fov_deg("0,2", "node0"), 0.5);
    is(fov_deg("0,1,2", "lens"), 0.7);
    is(fov_deg("0,1,2", "left"), 0.5);
    is(fov_deg("0,1,3", "node3"), 0.7);
    for (nodes, name, says) in [
        ("", "", "cameras.gltf has no camera"),
        ("", "eye", "cameras.gltf has no camera"),
        ("0,1,2", "", "has 3 cameras"),
        ("0,1,2", "", "give the name of one: node0, left, right"),
        (
            "0,1,2",
            "righ",
            "did you mean \"right\"? choose one of: node0, left, right, lens",
        ),
        ("1,3", "left", "has 2 cameras \"left\""),
        ("1,3", "left", "give the name of one: node1, node3"),
        ("2,3", "lens", "give the name of one: right, left"),
        (
            "4",
            "",
            "camera \"node4\" is mirrored by the scale of its node",
        ),
    ] {
        let message = camera(nodes, name).unwrap_err();
        assert_says(&message, &["scene.toml:3", says]);
    }
}

/// Buffers in data URIs of any media type, base64 or not; files by escaped and plain names.
#[test]
fn resources_are_found_in_every_form() {
    use base64::Engine;
    let numbers: Vec<u8> = TRIANGLE
        .as_flattened()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let base64 = base64::engine::general_purpose::STANDARD.encode(&numbers);
    let unpadded = base64.trim_end_matches('=');
    let escaped: String = numbers.iter().map(|byte| format!("%{byte:02x}")).collect();
    let folder = SceneFolder::new();
    folder.write("a b%20.bin", &numbers);
    std::fs::create_dir(folder.path("bin")).unwrap();
    folder.write("bin/a.bin", &numbers);
    let file = |uri: &str| {
        let file = format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":36,"uri":"{uri}"}}],"bufferViews":[{{"buffer":0,"byteLength":36}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],{},{NODE}}}"#,
            mesh("")
        );
        folder.write("room.gltf", file);
        load(&folder, "room.gltf")
    };
    for uri in [
        format!("data:application/octet-stream;base64,{base64}"),
        format!("data:application/gltf-buffer;base64,{base64}"),
        format!("data:;base64,{base64}"),
        format!("DATA:text/plain;charset=utf-8;BASE64,{unpadded}"),
        format!("data:application/octet-stream,{escaped}"),
        "a%20b%2520.bin".into(),
        "a b%20.bin".into(),
        "./bin/a.bin".into(),
        r"bin\\a.bin".into(),
    ] {
        let scene = file(&uri).unwrap_or_else(|error| panic!("{uri}: {error}"));
        assert_eq!(scene.meshes[0].triangles, [[0, 1, 2]], "{uri}");
    }
    for (uri, says) in [
        (
            "https://camlux.example/a.bin",
            "loads nothing from a network",
        ),
        ("none%20.bin", "cannot read none .bin, which it names"),
        ("data:;base64,!!!!", "a data URI cannot be decoded"),
        ("data:nothing", "a data URI cannot be decoded"),
        ("data:;base64,AAAA", "buffer 0 is shorter than its 36 bytes"),
    ] {
        assert_says(&folder.error(file(uri)), &["room.gltf", says]);
    }
}

#[test]
fn what_is_wrong_with_the_file_is_said() {
    let mut builder = GltfBuilder::default();
    builder.vec3(&TRIANGLE);
    let file = builder.glb(&format!("{},{NODE}", mesh("")));
    let cut = &file[..file.len() - 8];
    refuses_file(cut, &["not valid glTF 2.0: the file is truncated"]);
    let mut old = file.clone();
    old[4] = 1;
    rows! { refuses_file;
        old => "it is glTF \"1\"";
        *b"{\"asset\":{\"version\":\"1.0\"}}" => "it is glTF \"1.0\"";
        *b"{\"asset\":{}}" => "asset.version is missing";
        *b"no json" => "its JSON cannot be read", "line 1";
    }
    let of_members =
        |members: &str, says: &[&str]| refuses(members, &[&["not valid glTF 2.0"], says].concat());
    rows! { of_members;
        r#""nodes":7"# => "nodes is not an array";
        r#""nodes":[7]"# => "nodes[0] is no object";
        r#""nodes":[{"mesh":-1}]"# => "nodes[0].mesh is not a whole number";
        r#""nodes":[{"rotation":[0,0,0,0]}]"# => "nodes[0].rotation is no rotation";
        r#""nodes":[{"scale":[1]}]"# => "nodes[0].scale is not an array of 3 numbers";
        r#""materials":[{"alphaMode":"mask"}]"# => "materials[0].alphaMode is \"mask\"";
        r#""nodes":[{"mesh":3}]"# => "node 0 uses mesh 3, but the file has 0";
    }
}
