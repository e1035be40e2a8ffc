//! Every key of the glTF 2.0 specification changes the scene, is named in the warning, or says nothing about what is seen.

use crate::common::gltf_file::GltfBuilder;
use crate::common::scene_folder::{LIGHT, SceneFolder};
use serde_json::{Value, json};

/// What a key does that gets the value beside it.
#[derive(Clone, Copy, PartialEq)]
enum Effect {
    /// The scene, or the error, is another one.
    Changes,
    /// The warning names it so.
    Named(&'static str),
    /// It says nothing about what is seen.
    Nothing,
}
use Effect::{Changes, Named, Nothing};

/// An object of [`model`], the schema's name of its kind, and a value for each key.
struct Object {
    pointer: &'static str,
    kind: &'static str,
    keys: Vec<(&'static str, Value, Effect)>,
}

/// The keys of each kind, as the JSON schema of the specification lists them. `extensions` and `extras` are everywhere.
const SCHEMA: [(&str, &str); 25] = [
    (
        "glTF",
        "extensionsUsed extensionsRequired accessors animations asset buffers bufferViews cameras images materials meshes nodes samplers scene scenes skins textures",
    ),
    ("asset", "copyright generator version minVersion"),
    (
        "accessor",
        "bufferView byteOffset componentType normalized count type max min sparse name",
    ),
    ("accessor.sparse", "count indices values"),
    (
        "accessor.sparse.indices",
        "bufferView byteOffset componentType",
    ),
    ("accessor.sparse.values", "bufferView byteOffset"),
    ("buffer", "uri byteLength name"),
    (
        "bufferView",
        "buffer byteOffset byteLength byteStride target name",
    ),
    ("camera", "orthographic perspective type name"),
    ("camera.perspective", "aspectRatio yfov zfar znear"),
    ("image", "uri mimeType bufferView name"),
    (
        "material",
        "name pbrMetallicRoughness normalTexture occlusionTexture emissiveTexture emissiveFactor alphaMode alphaCutoff doubleSided",
    ),
    (
        "material.pbrMetallicRoughness",
        "baseColorFactor baseColorTexture metallicFactor roughnessFactor metallicRoughnessTexture",
    ),
    ("textureInfo", "index texCoord"),
    ("material.normalTextureInfo", "index texCoord scale"),
    ("mesh", "primitives weights name"),
    ("mesh.primitive", "attributes indices material mode targets"),
    (
        "attributes",
        "POSITION NORMAL TANGENT TEXCOORD_0 TEXCOORD_1 TEXCOORD_2 COLOR_0 COLOR_1 JOINTS_0 WEIGHTS_0 _CUSTOM",
    ),
    (
        "node",
        "camera children skin matrix mesh rotation scale translation weights name",
    ),
    ("sampler", "magFilter minFilter wrapS wrapT name"),
    ("scene", "nodes name"),
    ("texture", "sampler source name"),
    ("KHR_texture_transform", "offset rotation scale texCoord"),
    ("light", "name color intensity type range spot"),
    ("light.spot", "innerConeAngle outerConeAngle"),
];

/// A file with an object of each kind, without its warning's usual line about metallic-roughness.
fn model(folder: &SceneFolder) -> Value {
    let mut builder = GltfBuilder::default();
    let png = |texel: fn(u32) -> [u8; 4]| {
        let mut png = std::io::Cursor::new(Vec::new());
        let picture = image::RgbaImage::from_fn(2, 1, |x, _| image::Rgba(texel(x)));
        picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
        png.into_inner()
    };
    builder.vec3(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
    builder.vec3(&[
        [0.0, 0.0, 1.0],
        [0.0, 0.1, 1.0],
        [0.1, 0.0, 1.0],
        [0.0, 0.0, 1.0],
    ]);
    builder.vec2_u16(&[[0, 0], [65535, 0], [0, 65535], [9, 9]]);
    builder.indices_u16(&[2, 0, 1, 1, 3, 2]);
    builder.vec2(&[[0.0, 0.5], [0.25, 0.0], [0.5, 0.5], [1.0, 1.0]]);
    builder.vec4(&[[1.0, 0.0, 0.0, 1.0]; 4]);
    let places = builder.view(&[1, 3, 0, 0]);
    let values = builder.view(&[0x3f; 24]);
    let leaf = builder.view(&png(|x| [200, 100, 50, if x == 0 { 255 } else { 60 }]));
    folder.write("bumps.png", png(|x| [100 + 50 * x as u8, 128, 200, 255]));
    let members = format!(
        r#""extensionsUsed":["KHR_lights_punctual","KHR_texture_transform"],
        "extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot","spot":{{}}}}]}}}},
        "images":[{{"bufferView":{leaf}}},{{"uri":"bumps.png"}}],"samplers":[{{}},{{"wrapS":33071}}],
        "textures":[{{"source":0,"sampler":0}},{{"source":1}}],
        "materials":[{{"pbrMetallicRoughness":{{"metallicFactor":0,"baseColorTexture":{{"index":0,
            "extensions":{{"KHR_texture_transform":{{}}}}}}}},"normalTexture":{{"index":1}},"alphaMode":"MASK"}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3,"material":0}}]}}],
        "cameras":[{{"type":"perspective","perspective":{{"yfov":0.5,"znear":0.1}}}}],
        "nodes":[{{"mesh":0}},{{"camera":0,"translation":[0,0,3]}},{{"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}},
            {{"mesh":0,"translation":[0,1,0]}}],
        "scenes":[{{"nodes":[0,1,2]}},{{"nodes":[0,1]}}]"#
    );
    let (json, buffer) = builder.gltf(&members, "data.bin");
    folder.write("data.bin", buffer);
    let mut model: Value = serde_json::from_str(&json).unwrap();
    model["accessors"][0]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": places, "componentType": 5121}, "values": {"bufferView": values}});
    model
}

fn objects() -> Vec<Object> {
    let object = |pointer, kind, keys: Vec<_>| Object {
        pointer,
        kind,
        keys,
    };
    let gone = Value::Null;
    let of_root = [
        "accessors",
        "asset",
        "buffers",
        "bufferViews",
        "cameras",
        "images",
        "materials",
        "meshes",
        "nodes",
        "scenes",
        "textures",
    ];
    let mut root = of_root.map(|key| (key, Value::Null, Changes)).to_vec();
    root.extend([
        ("samplers", gone.clone(), Changes),
        ("scene", json!(1), Changes),
        ("extensionsUsed", json!([]), Nothing),
        (
            "extensionsRequired",
            json!(["KHR_lights_punctual"]),
            Nothing,
        ),
        (
            "animations",
            json!([{"channels": [], "samplers": []}]),
            Named("animations"),
        ),
        ("skins", json!([{"joints": [0]}]), Named("skins")),
    ]);
    let none = || json!("a note");
    vec![
        object("", "glTF", root),
        object(
            "/asset",
            "asset",
            vec![
                ("copyright", none(), Nothing),
                ("generator", none(), Nothing),
                ("version", json!("1.0"), Changes),
                ("minVersion", json!("2.1"), Changes),
            ],
        ),
        object(
            "/accessors/0",
            "accessor",
            vec![
                ("bufferView", gone.clone(), Changes),
                ("byteOffset", json!(4), Changes),
                ("componentType", json!(5121), Changes),
                ("count", json!(3), Changes),
                ("type", json!("VEC2"), Changes),
                ("max", json!([9, 9, 9]), Nothing),
                ("min", json!([9, 9, 9]), Nothing),
                ("sparse", gone.clone(), Changes),
                ("name", none(), Nothing),
            ],
        ),
        object(
            "/accessors/2",
            "accessor",
            vec![("normalized", json!(false), Changes)],
        ),
        object(
            "/accessors/0/sparse",
            "accessor.sparse",
            vec![
                ("count", json!(2), Changes),
                ("indices", gone.clone(), Changes),
                ("values", gone.clone(), Changes),
            ],
        ),
        object(
            "/accessors/0/sparse/indices",
            "accessor.sparse.indices",
            vec![
                ("bufferView", json!(7), Changes),
                ("byteOffset", json!(1), Changes),
                ("componentType", json!(5123), Changes),
            ],
        ),
        object(
            "/accessors/0/sparse/values",
            "accessor.sparse.values",
            vec![
                ("bufferView", json!(0), Changes),
                ("byteOffset", json!(16), Changes),
            ],
        ),
        object(
            "/buffers/0",
            "buffer",
            vec![
                ("uri", json!("none.bin"), Changes),
                ("byteLength", json!(4), Changes),
                ("name", none(), Nothing),
            ],
        ),
        object(
            "/bufferViews/0",
            "bufferView",
            vec![
                ("buffer", json!(1), Changes),
                ("byteOffset", json!(4), Changes),
                ("byteLength", json!(4), Changes),
                ("byteStride", json!(16), Changes),
                ("target", json!(34962), Nothing),
                ("name", none(), Nothing),
            ],
        ),
        object(
            "/cameras/0",
            "camera",
            vec![
                (
                    "orthographic",
                    json!({"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}),
                    Named("xmag of cameras"),
                ),
                ("perspective", gone.clone(), Changes),
                ("type", json!("orthographic"), Changes),
                ("name", none(), Nothing),
            ],
        ),
        object(
            "/cameras/0/perspective",
            "camera.perspective",
            vec![
                ("aspectRatio", json!(2), Nothing),
                ("yfov", json!(0.6), Changes),
                ("zfar", json!(2), Nothing),
                ("znear", json!(2), Nothing),
            ],
        ),
        object(
            "/images/0",
            "image",
            vec![
                ("bufferView", gone.clone(), Changes),
                ("mimeType", json!("image/jpeg"), Nothing),
                ("name", none(), Nothing),
            ],
        ),
        object(
            "/images/1",
            "image",
            vec![("uri", json!("none.png"), Changes)],
        ),
        object(
            "/materials/0",
            "material",
            vec![
                ("name", none(), Nothing),
                ("pbrMetallicRoughness", gone.clone(), Changes),
                ("normalTexture", gone.clone(), Changes),
                (
                    "occlusionTexture",
                    json!({"index": 0}),
                    Named("occlusionTexture of materials"),
                ),
                (
                    "emissiveTexture",
                    json!({"index": 0}),
                    Named("emissiveTexture of materials"),
                ),
                (
                    "emissiveFactor",
                    json!([1, 0, 0]),
                    Named("emissive surfaces"),
                ),
                ("alphaMode", json!("OPAQUE"), Changes),
                ("alphaCutoff", json!(0.3), Changes),
                ("doubleSided", json!(true), Nothing),
            ],
        ),
        object(
            "/materials/0/pbrMetallicRoughness",
            "material.pbrMetallicRoughness",
            vec![
                ("baseColorFactor", json!([1, 0.5, 1, 1]), Changes),
                ("baseColorTexture", gone.clone(), Changes),
                ("metallicFactor", json!(0.5), Changes),
                ("roughnessFactor", json!(0.5), Changes),
                ("metallicRoughnessTexture", json!({"index": 0}), Changes),
            ],
        ),
        object(
            "/materials/0/pbrMetallicRoughness/baseColorTexture",
            "textureInfo",
            vec![
                ("index", json!(1), Changes),
                ("texCoord", json!(1), Changes),
            ],
        ),
        object(
            "/materials/0/normalTexture",
            "material.normalTextureInfo",
            vec![
                ("index", json!(0), Changes),
                ("texCoord", json!(1), Changes),
                ("scale", json!(0.5), Changes),
            ],
        ),
        object(
            "/meshes/0",
            "mesh",
            vec![
                ("primitives", json!([]), Changes),
                ("weights", json!([1]), Named("weights of meshes")),
                ("name", none(), Nothing),
            ],
        ),
        object(
            "/meshes/0/primitives/0",
            "mesh.primitive",
            vec![
                ("attributes", gone.clone(), Changes),
                ("indices", gone.clone(), Changes),
                ("material", gone.clone(), Changes),
                ("mode", json!(5), Changes),
                (
                    "targets",
                    json!([{"POSITION": 0}]),
                    Named("targets of primitives"),
                ),
            ],
        ),
        object(
            "/meshes/0/primitives/0/attributes",
            "attributes",
            vec![
                ("POSITION", json!(1), Changes),
                ("NORMAL", gone.clone(), Changes),
                ("TANGENT", json!(5), Changes),
                ("TEXCOORD_0", json!(4), Changes),
                ("TEXCOORD_1", json!(4), Named("TEXCOORD_1 of primitives")),
                ("TEXCOORD_2", json!(4), Named("TEXCOORD_2 of primitives")),
                ("COLOR_0", json!(0), Changes),
                ("COLOR_1", json!(0), Named("COLOR_1 of primitives")),
                ("JOINTS_0", json!(5), Named("JOINTS_0 of primitives")),
                ("WEIGHTS_0", json!(5), Named("WEIGHTS_0 of primitives")),
                ("_CUSTOM", json!(5), Named("_CUSTOM of primitives")),
            ],
        ),
        object(
            "/nodes/0",
            "node",
            vec![
                ("camera", json!(0), Changes),
                ("children", json!([3]), Changes),
                ("skin", json!(0), Named("skin of nodes")),
                (
                    "matrix",
                    json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 0, 0, 1]),
                    Changes,
                ),
                ("mesh", gone.clone(), Changes),
                ("rotation", json!([1, 0, 0, 0]), Changes),
                ("scale", json!([1, 2, 1]), Changes),
                ("translation", json!([1, 2, 1]), Changes),
                ("weights", json!([1]), Named("weights of nodes")),
                ("name", none(), Nothing),
            ],
        ),
        object(
            "/samplers/0",
            "sampler",
            vec![
                ("magFilter", json!(9728), Changes),
                ("minFilter", json!(9987), Named("minFilter of samplers")),
                ("wrapS", json!(33071), Changes),
                ("wrapT", json!(33648), Changes),
                ("name", none(), Nothing),
            ],
        ),
        object(
            "/scenes/0",
            "scene",
            vec![("nodes", json!([1]), Changes), ("name", none(), Nothing)],
        ),
        object(
            "/textures/0",
            "texture",
            vec![
                ("sampler", json!(1), Changes),
                ("source", json!(1), Changes),
                ("name", none(), Nothing),
            ],
        ),
        object(
            "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform",
            "KHR_texture_transform",
            vec![
                ("offset", json!([0.1, 0]), Changes),
                ("rotation", json!(1), Changes),
                ("scale", json!([2, 1]), Changes),
                ("texCoord", json!(1), Changes),
            ],
        ),
        object(
            "/extensions/KHR_lights_punctual/lights/0",
            "light",
            vec![
                ("name", none(), Nothing),
                ("color", json!([1, 0, 0]), Changes),
                ("intensity", json!(2), Changes),
                ("type", json!("point"), Changes),
                ("range", json!(2), Named("range of lights")),
                ("spot", gone, Changes),
            ],
        ),
        object(
            "/extensions/KHR_lights_punctual/lights/0/spot",
            "light.spot",
            vec![
                ("innerConeAngle", json!(0.2), Changes),
                ("outerConeAngle", json!(0.7), Changes),
            ],
        ),
    ]
}

/// The hash of the scene of a file, or the error, and the warning about the file.
fn outcome(folder: &SceneFolder, model: &Value) -> (String, String) {
    folder.write("room.gltf", model.to_string());
    let head = "[camera]\nresolution = [8, 8]\npath = \"room.gltf\"\n";
    match folder.load(&format!("{head}{LIGHT}[[mesh]]\npath = \"room.gltf\"\n")) {
        Ok(scene) => {
            let mut warnings = scene.warnings();
            warnings.retain(|warning| warning.contains("room.gltf: camlux ignores"));
            (scene.hash(), warnings.join("\n"))
        }
        Err(error) => (error.to_string(), String::new()),
    }
}

#[test]
fn every_key_of_the_specification_is_used_or_named() {
    let folder = SceneFolder::new();
    let model = model(&folder);
    let (hash, warnings) = outcome(&folder, &model);
    assert!(warnings.contains("modified Phong"), "{hash}");
    let objects = objects();
    for (kind, keys) in SCHEMA {
        for key in keys.split(' ') {
            let mut tried = objects.iter().filter(|object| object.kind == kind);
            let is_tried = tried.any(|object| object.keys.iter().any(|(other, ..)| *other == key));
            assert!(is_tried, "{kind}.{key} is not tried");
        }
    }
    for object in &objects {
        let extras = ("extras", json!({"a": {"extensions": {"B": 1}}}), Nothing);
        let extension = ("extensions", json!({"X_y": {}}), Named("the extension X_y"));
        let unknown = ("nmae", json!(1), Named("nmae"));
        let everywhere = [extras, extension, unknown];
        for (key, value, effect) in object.keys.iter().chain(&everywhere) {
            let mut changed = model.clone();
            let place = changed
                .pointer_mut(object.pointer)
                .expect("the object is there");
            match place.get_mut(key) {
                Some(Value::Object(known)) if *key == "extensions" => {
                    known.insert("X_y".into(), json!({}));
                }
                _ => place[*key] = value.clone(),
            }
            let (other, found) = outcome(&folder, &changed);
            let what = format!("{}/{key}: {other} {found}", object.pointer);
            match effect {
                Changes => assert_ne!(other, hash, "{what}"),
                Named(name) => assert!(other == hash && found.contains(name), "{name}: {what}"),
                Nothing => assert!(other == hash && found == warnings, "{what}"),
            }
        }
    }
}

#[test]
fn a_misspelt_key_is_named_with_the_nearest() {
    let folder = SceneFolder::new();
    let mut model = model(&folder);
    let pbr = &mut model["materials"][0]["pbrMetallicRoughness"];
    pbr["basecolorTexture"] = pbr["baseColorTexture"].take();
    model["meshes"][0]["primitives"][0]["attributes"]["TEXCORD_1"] = json!(4);
    let (_, warnings) = outcome(&folder, &model);
    for says in [
        "the unknown \"basecolorTexture\", perhaps \"baseColorTexture\"",
        "the unknown \"TEXCORD_1\", perhaps \"TEXCOORD_1\"",
    ] {
        assert!(warnings.contains(says), "{warnings}");
    }
}

/// Also in what is not read, and where `extensionsUsed` does not list them.
#[test]
fn extensions_are_named_wherever_they_are_with_their_number() {
    let folder = SceneFolder::new();
    let mut model = model(&folder);
    model["materials"][0]["extensions"] = json!({"KHR_materials_unlit": {}});
    model["materials"][0]["occlusionTexture"] =
        json!({"index": 0, "extensions": {"X_inner": {}, "KHR_texture_transform": {}}});
    model["nodes"][0]["extensions"] = json!({"KHR_node_visibility": {"visible": false}});
    model["nodes"][1]["extensions"] = json!({"KHR_node_visibility": {"visible": true}});
    model["extensionsUsed"] = json!(["X_listed", "KHR_materials_unlit"]);
    let (_, warnings) = outcome(&folder, &model);
    let line = &warnings;
    for (name, count) in [
        ("KHR_materials_unlit", 1),
        ("X_inner", 1),
        ("KHR_node_visibility (2 times)", 1),
        ("X_listed", 1),
        ("KHR_texture_transform", 0),
    ] {
        let found = line.matches(&format!("the extension {name}")).count();
        assert_eq!(found, count, "{name}: {line}");
    }
    assert_eq!(warnings.matches("room.gltf: camlux ignores").count(), 1);
}
