//! The JSON of a glTF file, as what it describes. Indices are checked where they are used.

use std::cell::RefCell;

use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

use super::keys::{self, KNOWN_EXTENSIONS, MEANINGLESS_EXTENSIONS};
use super::record::{Parsed, Record};
use super::surface::{self, Image, Material, Sampler, Texture};
use crate::import::unused::Unused;
use crate::scene::Lens;

#[derive(Default)]
pub(super) struct Document {
    pub extensions_required: Vec<String>,
    pub buffers: Vec<Buffer>,
    pub views: Vec<View>,
    pub accessors: Vec<Accessor>,
    pub images: Vec<Image>,
    pub samplers: Vec<Sampler>,
    pub textures: Vec<Texture>,
    pub materials: Vec<Material>,
    pub meshes: Vec<Mesh>,
    pub nodes: Vec<Node>,
    pub cameras: Vec<Camera>,
    pub lights: Vec<Punctual>,
    /// The nodes of each scene.
    pub scenes: Vec<Vec<usize>>,
    pub scene: Option<usize>,
}

pub(super) struct Buffer {
    /// `None`: the buffer in a .glb file.
    pub uri: Option<String>,
    pub length: usize,
}

pub(super) struct View {
    pub buffer: usize,
    pub offset: usize,
    pub length: usize,
    pub stride: Option<usize>,
    /// The extension that compresses it.
    pub compression: Option<&'static str>,
}

pub(super) struct Accessor {
    pub view: Option<usize>,
    pub offset: usize,
    pub component: Component,
    pub normalized: bool,
    pub count: usize,
    /// "VEC3"
    pub shape: String,
    pub sparse: Option<Sparse>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

/// Elements that differ from those of the view.
pub(super) struct Sparse {
    pub count: usize,
    pub index_view: usize,
    pub index_offset: usize,
    pub index_component: Component,
    pub value_view: usize,
    pub value_offset: usize,
}

pub(super) struct Mesh {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
}

pub(super) struct Primitive {
    /// Names and accessors.
    pub attributes: Vec<(String, usize)>,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    pub mode: usize,
    /// Whether Draco holds its data.
    pub is_draco: bool,
}

pub(super) struct Node {
    pub name: Option<String>,
    pub to_parent: DMat4,
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    pub camera: Option<usize>,
    pub light: Option<usize>,
    /// Accessors of translation, rotation and scale of each instance.
    pub instances: Option<[Option<usize>; 3]>,
}

pub(super) struct Camera {
    pub name: Option<String>,
    pub lens: Lens,
}

/// A light of `KHR_lights_punctual`.
pub(super) struct Punctual {
    pub color: [f64; 3],
    /// Candela, or lux for a directional light.
    pub intensity: f64,
    pub kind: PunctualKind,
}

pub(super) enum PunctualKind {
    Directional,
    Point,
    /// The half angles of its cone, rad.
    Spot {
        inner_rad: f64,
        outer_rad: f64,
    },
}

impl Document {
    pub fn parse(root: Value, unused: &RefCell<Unused>) -> Parsed<Document> {
        let mut root = Record::new(root, &keys::ROOT, String::new(), unused)
            .map_err(|_| "it is no JSON object".to_owned())?;
        let asset = root.record("asset", &keys::ASSET)?;
        let mut asset = root.need("asset", asset)?;
        let version = asset.text("version")?;
        let version = asset.need("version", version)?;
        let least = asset.text("minVersion")?;
        if !version.starts_with("2.") || least.as_ref().is_some_and(|least| least != "2.0") {
            let version = least.unwrap_or(version);
            return Err(format!("it is glTF \"{version}\""));
        }
        let extensions_used = root.texts("extensionsUsed")?;
        let document = Document {
            extensions_required: root.texts("extensionsRequired")?,
            buffers: root.list("buffers", &keys::BUFFER, buffer)?,
            views: root.list("bufferViews", &keys::VIEW, view)?,
            accessors: root.list("accessors", &keys::ACCESSOR, accessor)?,
            images: root.list("images", &keys::IMAGE, surface::image)?,
            samplers: root.list("samplers", &keys::SAMPLER, surface::sampler)?,
            textures: root.list("textures", &keys::TEXTURE, surface::texture)?,
            materials: root.list("materials", &keys::MATERIAL, surface::material)?,
            meshes: root.list("meshes", &keys::MESH, mesh)?,
            nodes: root.list("nodes", &keys::NODE, node)?,
            cameras: root.list("cameras", &keys::CAMERA, camera)?,
            scenes: root.list("scenes", &keys::SCENE, |mut scene| scene.indices("nodes"))?,
            scene: root.index("scene")?,
            lights: match root.extension("KHR_lights_punctual", &keys::LIGHTS)? {
                Some(mut lights) => lights.list("lights", &keys::LIGHT, light)?,
                None => Vec::new(),
            },
        };
        drop(root);
        // Some extensions have no object in the file.
        let mut unused = unused.borrow_mut();
        for name in extensions_used {
            let is_known = [&KNOWN_EXTENSIONS[..], &MEANINGLESS_EXTENSIONS]
                .concat()
                .contains(&name.as_str());
            let kind = format!("the extension {name}");
            if !is_known && !unused.has(&kind) {
                unused.add(&kind);
            }
        }
        Ok(document)
    }
}

fn buffer(mut keys: Record) -> Parsed<Buffer> {
    let length = keys.index("byteLength")?;
    Ok(Buffer {
        uri: keys.text("uri")?,
        length: keys.need("byteLength", length)?,
    })
}

fn view(mut keys: Record) -> Parsed<View> {
    const COMPRESSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
    let (buffer, length) = (keys.index("buffer")?, keys.index("byteLength")?);
    let is_used = |name: &&str| keys.other_extensions().any(|other| other == *name);
    let compression = COMPRESSIONS.into_iter().find(is_used);
    Ok(View {
        buffer: keys.need("buffer", buffer)?,
        offset: keys.index("byteOffset")?.unwrap_or(0),
        length: keys.need("byteLength", length)?,
        stride: keys.index("byteStride")?,
        compression,
    })
}

fn component(keys: &mut Record) -> Parsed<Component> {
    let code = keys.index("componentType")?;
    Ok(match keys.need("componentType", code)? {
        5120 => Component::I8,
        5121 => Component::U8,
        5122 => Component::I16,
        5123 => Component::U16,
        5125 => Component::U32,
        5126 => Component::F32,
        code => return Err(keys.wrong("componentType", &format!("is {code}"))),
    })
}

fn accessor(mut keys: Record) -> Parsed<Accessor> {
    let (count, shape) = (keys.index("count")?, keys.text("type")?);
    let sparse = keys.record("sparse", &keys::SPARSE)?;
    Ok(Accessor {
        view: keys.index("bufferView")?,
        offset: keys.index("byteOffset")?.unwrap_or(0),
        component: component(&mut keys)?,
        normalized: keys.flag("normalized")?.unwrap_or(false),
        count: keys.need("count", count)?,
        shape: keys.need("type", shape)?,
        sparse: sparse.map(self::sparse).transpose()?,
    })
}

fn sparse(mut keys: Record) -> Parsed<Sparse> {
    let count = keys.index("count")?;
    let indices = keys.record("indices", &keys::SPARSE_INDICES)?;
    let values = keys.record("values", &keys::SPARSE_VALUES)?;
    let mut indices = keys.need("indices", indices)?;
    let mut values = keys.need("values", values)?;
    let place = |keys: &mut Record| {
        let view = keys.index("bufferView")?;
        let view = keys.need("bufferView", view)?;
        Ok::<_, String>((view, keys.index("byteOffset")?.unwrap_or(0)))
    };
    let (index_view, index_offset) = place(&mut indices)?;
    let (value_view, value_offset) = place(&mut values)?;
    Ok(Sparse {
        count: keys.need("count", count)?,
        index_view,
        index_offset,
        index_component: component(&mut indices)?,
        value_view,
        value_offset,
    })
}

fn mesh(mut keys: Record) -> Parsed<Mesh> {
    Ok(Mesh {
        name: keys.text("name")?,
        primitives: keys.list("primitives", &keys::PRIMITIVE, primitive)?,
    })
}

fn primitive(mut keys: Record) -> Parsed<Primitive> {
    let attributes = keys.record("attributes", &keys::ATTRIBUTES)?;
    Ok(Primitive {
        attributes: keys.need("attributes", attributes)?.all_indices()?,
        indices: keys.index("indices")?,
        material: keys.index("material")?,
        mode: keys.index("mode")?.unwrap_or(4),
        is_draco: keys
            .other_extensions()
            .any(|name| name == "KHR_draco_mesh_compression"),
    })
}

fn node(mut keys: Record) -> Parsed<Node> {
    let light = match keys.extension("KHR_lights_punctual", &keys::NODE_LIGHT)? {
        Some(mut light) => light.index("light")?,
        None => None,
    };
    let instances = match keys.extension("EXT_mesh_gpu_instancing", &keys::INSTANCING)? {
        None => None,
        Some(mut keys) => match keys.record("attributes", &keys::INSTANCING_ATTRIBUTES)? {
            None => None,
            Some(mut keys) => Some([
                keys.index("TRANSLATION")?,
                keys.index("ROTATION")?,
                keys.index("SCALE")?,
            ]),
        },
    };
    let (translation, rotation, scale) = (
        keys.numbers("translation")?,
        keys.numbers("rotation")?,
        keys.numbers("scale")?,
    );
    let matrix = keys.numbers::<16>("matrix")?;
    let to_parent = match matrix {
        Some(matrix) => DMat4::from_cols_array(&matrix),
        None => DMat4::from_scale_rotation_translation(
            scale.map_or(DVec3::ONE, DVec3::from_array),
            match rotation {
                Some([0.0, 0.0, 0.0, 0.0]) => {
                    return Err(keys.wrong("rotation", "is no rotation: all four numbers are 0"));
                }
                Some(rotation) => DQuat::from_array(rotation).normalize(),
                None => DQuat::IDENTITY,
            },
            translation.map_or(DVec3::ZERO, DVec3::from_array),
        ),
    };
    Ok(Node {
        name: keys.text("name")?,
        to_parent,
        children: keys.indices("children")?,
        mesh: keys.index("mesh")?,
        camera: keys.index("camera")?,
        light,
        instances,
    })
}

fn camera(mut keys: Record) -> Parsed<Camera> {
    let kind = keys.text("type")?;
    let perspective = keys.record("perspective", &keys::PERSPECTIVE)?;
    // Taken too, because a camera's other lens is no part of it.
    let orthographic = keys.record("orthographic", &keys::ORTHOGRAPHIC)?;
    let lens = match keys.need("type", kind)?.as_str() {
        "perspective" => {
            let mut lens = keys.need("perspective", perspective)?;
            let fov_y_rad = lens.number("yfov")?;
            Lens::FovY {
                fov_y_deg: lens.need("yfov", fov_y_rad)?.to_degrees(),
            }
        }
        "orthographic" => {
            let mut lens = keys.need("orthographic", orthographic)?;
            // Like the aspect ratio of a perspective camera, it has no effect.
            lens.number("xmag")?;
            let half_height_m = lens.number("ymag")?;
            Lens::Orthographic {
                height_m: 2.0 * lens.need("ymag", half_height_m)?,
            }
        }
        other => return Err(keys.wrong("type", &format!("is \"{other}\""))),
    };
    Ok(Camera {
        name: keys.text("name")?,
        lens,
    })
}

fn light(mut keys: Record) -> Parsed<Punctual> {
    let kind = keys.text("type")?;
    let spot = keys.record("spot", &keys::SPOT)?;
    let kind = match keys.need("type", kind)?.as_str() {
        "directional" => PunctualKind::Directional,
        "point" => PunctualKind::Point,
        "spot" => {
            let mut spot = keys.need("spot", spot)?;
            PunctualKind::Spot {
                inner_rad: spot.number("innerConeAngle")?.unwrap_or(0.0),
                outer_rad: spot
                    .number("outerConeAngle")?
                    .unwrap_or(std::f64::consts::FRAC_PI_4),
            }
        }
        other => return Err(keys.wrong("type", &format!("is \"{other}\""))),
    };
    Ok(Punctual {
        color: keys.numbers("color")?.unwrap_or([1.0; 3]),
        intensity: keys.number("intensity")?.unwrap_or(1.0),
        kind,
    })
}
