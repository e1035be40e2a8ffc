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
const SCHEMA: &str = "
glTF: extensionsUsed extensionsRequired accessors animations asset buffers bufferViews cameras images materials meshes nodes samplers scene scenes skins textures
asset: copyright generator version minVersion
accessor: bufferView byteOffset componentType normalized count type max min sparse name
accessor.sparse: count indices values
accessor.sparse.indices: bufferView byteOffset componentType
accessor.sparse.values: bufferView byteOffset
buffer: uri byteLength name
bufferView: buffer byteOffset byteLength byteStride target name
camera: orthographic perspective type name
camera.perspective: aspectRatio yfov zfar znear
image: uri mimeType bufferView name
material: name pbrMetallicRoughness normalTexture occlusionTexture emissiveTexture emissiveFactor alphaMode alphaCutoff doubleSided
material.pbrMetallicRoughness: baseColorFactor baseColorTexture metallicFactor roughnessFactor metallicRoughnessTexture
textureInfo: index texCoord
material.normalTextureInfo: index texCoord scale
mesh: primitives weights name
mesh.primitive: attributes indices material mode targets
attributes: POSITION NORMAL TANGENT TEXCOORD_0 TEXCOORD_1 TEXCOORD_2 COLOR_0 COLOR_1 JOINTS_0 WEIGHTS_0 _CUSTOM
node: camera children skin matrix mesh rotation scale translation weights name
sampler: magFilter minFilter wrapS wrapT name
scene: nodes name
texture: sampler source name
KHR_texture_transform: offset rotation scale texCoord
light: name color intensity type range spot
light.spot: innerConeAngle outerConeAngle
KHR_materials_emissive_strength: emissiveStrength
";

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
            "extensions":{{"KHR_texture_transform":{{}}}}}}}},"normalTexture":{{"index":1}},"alphaMode":"MASK"}},
            {{"emissiveFactor":[1,1,1],"emissiveTexture":{{"index":0}},"extensions":{{"KHR_materials_emissive_strength":{{}}}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3,"material":0}},
            {{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3,"material":1}}]}}],
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

/// Objects of [`model`] by their pointers, with the schema's names of their kinds, and a value for each key. With that value the scene is
/// another one; or the warning has the words after the arrow; or the key says nothing.
const OBJECTS: &str = r#"
/ glTF
    accessors = null
    asset = null
    buffers = null
    bufferViews = null
    cameras = null
    images = null
    materials = null
    meshes = null
    nodes = null
    scenes = null
    textures = null
    samplers = null
    scene = 1
    extensionsUsed = [] -> nothing
    extensionsRequired = ["KHR_lights_punctual"] -> nothing
    animations = [{"channels": [], "samplers": []}] -> animations
    skins = [{"joints": [0]}] -> skins
/asset asset
    copyright = "a note" -> nothing
    generator = "a note" -> nothing
    version = "1.0"
    minVersion = "2.1"
/accessors/0 accessor
    bufferView = null
    byteOffset = 4
    componentType = 5121
    count = 3
    type = "VEC2"
    max = [9, 9, 9] -> nothing
    min = [9, 9, 9] -> nothing
    sparse = null
    name = "a note" -> nothing
/accessors/2 accessor
    normalized = false
/accessors/0/sparse accessor.sparse
    count = 2
    indices = null
    values = null
/accessors/0/sparse/indices accessor.sparse.indices
    bufferView = 7
    byteOffset = 1
    componentType = 5123
/accessors/0/sparse/values accessor.sparse.values
    bufferView = 0
    byteOffset = 16
/buffers/0 buffer
    uri = "none.bin"
    byteLength = 4
    name = "a note" -> nothing
/bufferViews/0 bufferView
    buffer = 1
    byteOffset = 4
    byteLength = 4
    byteStride = 16
    target = 34962 -> nothing
    name = "a note" -> nothing
/cameras/0 camera
    orthographic = {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1} -> xmag of cameras
    perspective = null
    type = "orthographic"
    name = "a note" -> nothing
/cameras/0/perspective camera.perspective
    aspectRatio = 2 -> nothing
    yfov = 0.6
    zfar = 2 -> nothing
    znear = 2 -> nothing
/images/0 image
    bufferView = null
    mimeType = "image/jpeg" -> nothing
    name = "a note" -> nothing
/images/1 image
    uri = "none.png"
/materials/0 material
    name = "a note" -> nothing
    pbrMetallicRoughness = null
    normalTexture = null
    occlusionTexture = {"index": 0} -> occlusionTexture of materials
    emissiveTexture = {"index": 0} -> emissiveTexture of materials (its emissiveFactor is 0)
    emissiveFactor = [1, 0, 0]
    alphaMode = "OPAQUE"
    alphaCutoff = 0.3
    doubleSided = true
/materials/1 material
    emissiveFactor = null
    emissiveTexture = null
/materials/1/extensions/KHR_materials_emissive_strength KHR_materials_emissive_strength
    emissiveStrength = 2
/materials/0/pbrMetallicRoughness material.pbrMetallicRoughness
    baseColorFactor = [1, 0.5, 1, 1]
    baseColorTexture = null
    metallicFactor = 0.5
    roughnessFactor = 0.5
    metallicRoughnessTexture = {"index": 0}
/materials/0/pbrMetallicRoughness/baseColorTexture textureInfo
    index = 1
    texCoord = 1
/materials/0/normalTexture material.normalTextureInfo
    index = 0
    texCoord = 1
    scale = 0.5
/meshes/0 mesh
    primitives = []
    weights = [1] -> weights of meshes
    name = "a note" -> nothing
/meshes/0/primitives/0 mesh.primitive
    attributes = null
    indices = null
    material = null
    mode = 5
    targets = [{"POSITION": 0}] -> targets of primitives
/meshes/0/primitives/0/attributes attributes
    POSITION = 1
    NORMAL = null
    TANGENT = 5
    TEXCOORD_0 = 4
    TEXCOORD_1 = 4 -> TEXCOORD_1 of primitives
    TEXCOORD_2 = 4 -> TEXCOORD_2 of primitives
    COLOR_0 = 0
    COLOR_1 = 0 -> COLOR_1 of primitives
    JOINTS_0 = 5 -> JOINTS_0 of primitives
    WEIGHTS_0 = 5 -> WEIGHTS_0 of primitives
    _CUSTOM = 5 -> _CUSTOM of primitives
/nodes/0 node
    camera = 0
    children = [3]
    skin = 0 -> skin of nodes
    matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 0, 0, 1]
    mesh = null
    rotation = [1, 0, 0, 0]
    scale = [1, 2, 1]
    translation = [1, 2, 1]
    weights = [1] -> weights of nodes
    name = "a note" -> nothing
/samplers/0 sampler
    magFilter = 9728
    minFilter = 9987 -> minFilter of samplers
    wrapS = 33071
    wrapT = 33648
    name = "a note" -> nothing
/scenes/0 scene
    nodes = [1]
    name = "a note" -> nothing
/textures/0 texture
    sampler = 1
    source = 1
    name = "a note" -> nothing
/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform KHR_texture_transform
    offset = [0.1, 0]
    rotation = 1
    scale = [2, 1]
    texCoord = 1
/extensions/KHR_lights_punctual/lights/0 light
    name = "a note" -> nothing
    color = [1, 0, 0]
    intensity = 2
    type = "point"
    range = 2 -> range of lights
    spot = null
/extensions/KHR_lights_punctual/lights/0/spot light.spot
    innerConeAngle = 0.2
    outerConeAngle = 0.7
"#;

fn objects() -> Vec<Object> {
    let mut objects: Vec<Object> = Vec::new();
    for line in OBJECTS.trim().lines() {
        let Some(key) = line.strip_prefix("    ") else {
            let (pointer, kind) = line.split_once(' ').expect("pointer and kind");
            objects.push(Object {
                pointer: pointer.trim_end_matches('/'),
                kind,
                keys: Vec::new(),
            });
            continue;
        };
        let (key, value) = key.split_once(" = ").expect("a key and a value");
        let (value, effect) = match value.split_once(" -> ") {
            None => (value, Changes),
            Some((value, "nothing")) => (value, Nothing),
            Some((value, name)) => (value, Named(name)),
        };
        let value = serde_json::from_str(value).expect("JSON");
        let object = objects.last_mut().expect("an object before its keys");
        object.keys.push((key, value, effect));
    }
    objects
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
    assert_eq!(hash.len(), 64, "{hash}");
    let objects = objects();
    for (kind, keys) in SCHEMA.lines().filter_map(|line| line.split_once(": ")) {
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
