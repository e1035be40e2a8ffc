//! The keys of the glTF 2.0 specification, and of the extensions that camlux reads.

/// A kind of JSON object.
pub(super) struct Kind {
    /// What messages call it: "texCoord of textures". Empty for the whole file.
    pub of: &'static str,
    /// All of its keys in the specification, so that a misspelt one is told apart.
    pub keys: &'static [&'static str],
}

/// Keys without meaning for what is seen:
/// - names, notes of exporters, and what the GPU may do with a buffer;
/// - `min` and `max`, which repeat what the data say;
/// - `mimeType`, because an image says itself what it is;
/// - `aspectRatio`, `znear` and `zfar`: the scene file gives the image's size, and camlux clips nothing;
/// - `extensionsUsed`, whose entries are looked for where they are used.
pub(super) const WITHOUT_MEANING: [&str; 14] = [
    "name",
    "extras",
    "copyright",
    "generator",
    "target",
    "min",
    "max",
    "mimeType",
    "aspectRatio",
    "znear",
    "zfar",
    "extensionsUsed",
    "extensionsRequired",
    "minVersion",
];

/// Extensions that a file may require.
pub(super) const KNOWN_EXTENSIONS: [&str; 8] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "EXT_texture_webp",
    "EXT_mesh_gpu_instancing",
];

/// Extensions that camlux ignores, with a warning, and that a file may require: without a choice of its variants it shows its own materials.
pub(super) const DISPENSABLE_EXTENSIONS: [&str; 1] = ["KHR_materials_variants"];

/// Extensions that say nothing about what is seen. A file may require them too.
pub(super) const MEANINGLESS_EXTENSIONS: [&str; 2] = ["KHR_xmp_json_ld", "KHR_xmp"];

/// Why camlux does not use a key, where that is not plain.
pub(super) fn reason(key: &str) -> &'static str {
    match key {
        "skin" | "targets" | "weights" => " (meshes are in the pose of their vertices)",
        "minFilter" => " (textures have no mip levels, and magFilter alone decides)",
        "range" => " (light has none)",
        "emissiveTexture" => " (its emissiveFactor is 0)",
        _ => "",
    }
}

macro_rules! kinds {
    ($($name:ident $of:literal: $($key:literal)*;)*) => {
        $(pub(super) const $name: Kind = Kind { of: $of, keys: &[$($key),*] };)*
    };
}

kinds! {
    ROOT "": "extensionsUsed" "extensionsRequired" "accessors" "animations" "asset" "buffers" "bufferViews" "cameras" "images"
        "materials" "meshes" "nodes" "samplers" "scene" "scenes" "skins" "textures" "extensions" "extras";
    ASSET "asset": "copyright" "generator" "version" "minVersion" "extensions" "extras";
    ACCESSOR "accessors": "bufferView" "byteOffset" "componentType" "normalized" "count" "type" "max" "min" "sparse" "name" "extensions"
        "extras";
    SPARSE "sparse accessors": "count" "indices" "values" "extensions" "extras";
    SPARSE_INDICES "sparse accessors": "bufferView" "byteOffset" "componentType" "extensions" "extras";
    SPARSE_VALUES "sparse accessors": "bufferView" "byteOffset" "extensions" "extras";
    BUFFER "buffers": "uri" "byteLength" "name" "extensions" "extras";
    VIEW "bufferViews": "buffer" "byteOffset" "byteLength" "byteStride" "target" "name" "extensions" "extras";
    IMAGE "images": "uri" "mimeType" "bufferView" "name" "extensions" "extras";
    SAMPLER "samplers": "magFilter" "minFilter" "wrapS" "wrapT" "name" "extensions" "extras";
    TEXTURE "textures": "sampler" "source" "name" "extensions" "extras";
    TEXTURE_SOURCE "textures": "source" "extensions" "extras";
    TEXTURE_INFO "materials": "index" "texCoord" "scale" "strength" "extensions" "extras";
    TEXTURE_TRANSFORM "KHR_texture_transform": "offset" "rotation" "scale" "texCoord" "extensions" "extras";
    MATERIAL "materials": "name" "extensions" "extras" "pbrMetallicRoughness" "normalTexture" "occlusionTexture" "emissiveTexture"
        "emissiveFactor" "alphaMode" "alphaCutoff" "doubleSided";
    PBR "materials": "baseColorFactor" "baseColorTexture" "metallicFactor" "roughnessFactor" "metallicRoughnessTexture" "extensions"
        "extras";
    EMISSIVE_STRENGTH "KHR_materials_emissive_strength": "emissiveStrength" "extensions" "extras";
    IOR "KHR_materials_ior": "ior" "extensions" "extras";
    SPECULAR "KHR_materials_specular": "specularFactor" "specularTexture" "specularColorFactor" "specularColorTexture" "extensions"
        "extras";
    MESH "meshes": "primitives" "weights" "name" "extensions" "extras";
    PRIMITIVE "primitives": "attributes" "indices" "material" "mode" "targets" "extensions" "extras";
    ATTRIBUTES "primitives": "POSITION" "NORMAL" "TANGENT" "TEXCOORD_0" "TEXCOORD_1" "COLOR_0" "JOINTS_0" "WEIGHTS_0" "extensions" "extras";
    NODE "nodes": "camera" "children" "skin" "matrix" "mesh" "rotation" "scale" "translation" "weights" "name" "extensions" "extras";
    NODE_LIGHT "nodes": "light" "extensions" "extras";
    INSTANCING "nodes": "attributes" "extensions" "extras";
    INSTANCING_ATTRIBUTES "EXT_mesh_gpu_instancing": "TRANSLATION" "ROTATION" "SCALE" "extensions" "extras";
    CAMERA "cameras": "orthographic" "perspective" "type" "name" "extensions" "extras";
    PERSPECTIVE "cameras": "aspectRatio" "yfov" "zfar" "znear" "extensions" "extras";
    ORTHOGRAPHIC "cameras": "xmag" "ymag" "zfar" "znear" "extensions" "extras";
    SCENE "scenes": "nodes" "name" "extensions" "extras";
    LIGHTS "lights": "lights" "extensions" "extras";
    LIGHT "lights": "name" "color" "intensity" "type" "range" "spot" "extensions" "extras";
    SPOT "lights": "innerConeAngle" "outerConeAngle" "extensions" "extras";
}
