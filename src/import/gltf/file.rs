//! The files of a glTF model: JSON, buffers and images.

use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as Punctual, Type};
use gltf::json::validation::Checked;
use gltf::json::{self, Root, camera};
use gltf::{Document, Glb, buffer, image};

use crate::{Error, Result, input_file};

/// Extensions that a file may require.
pub(super) const KNOWN_EXTENSIONS: [&str; 2] = ["KHR_lights_punctual", "KHR_mesh_quantization"];

pub(super) struct GltfFile {
    pub path: PathBuf,
    pub document: Document,
    buffers: Vec<Vec<u8>>,
}

impl GltfFile {
    pub fn read(path: &Path, named_at: &str) -> Result<GltfFile> {
        let bytes = input_file::read(path).map_err(|error| {
            let problem = format!("cannot read the mesh {}: {error}", path.display());
            Error::scene(
                named_at,
                problem,
                "correct the path; it is relative to the file that names it",
            )
        })?;
        let broken = |problem: String| {
            let problem = problem.trim_end_matches([' ', ';']);
            let problem = format!("not valid glTF 2.0: {problem}");
            Error::scene(path.display().to_string(), problem, "export it again")
        };
        let (text, blob) = match bytes.starts_with(b"glTF") {
            true => {
                let glb = Glb::from_slice(&bytes).map_err(|error| broken(error.to_string()))?;
                (glb.json, glb.bin)
            }
            false => (bytes.as_slice().into(), None),
        };
        let mut root = Root::from_slice(&text).map_err(|error| broken(error.to_string()))?;
        let mut required = root.extensions_required.iter();
        if let Some(unknown) = required.find(|name| !KNOWN_EXTENSIONS.contains(&name.as_str())) {
            let problem =
                format!("it requires the extension {unknown}, which camlux does not support");
            let hint = "export it without that extension";
            return Err(Error::scene(path.display().to_string(), problem, hint));
        }
        // The crate does not know all of these extensions, and checks its other assumptions too late.
        root.extensions_required.clear();
        if let Some(problem) = missing_part(&root) {
            return Err(broken(problem));
        }
        let document = Document::from_json(root).map_err(|error| broken(error.to_string()))?;
        let mut blob = blob.map(|bytes| bytes.into_owned());
        let mut file = GltfFile {
            path: path.to_owned(),
            document,
            buffers: Vec::new(),
        };
        for index in 0..file.document.buffers().len() {
            let Some(buffer) = file.document.buffers().nth(index) else {
                break;
            };
            let bytes = match buffer.source() {
                buffer::Source::Bin => blob.take(),
                buffer::Source::Uri(uri) => Some(file.resource(uri)?),
            };
            let bytes = bytes
                .filter(|bytes| bytes.len() >= buffer.length())
                .ok_or_else(|| {
                    let problem = format!(
                        "buffer {index} is shorter than its {} bytes",
                        buffer.length()
                    );
                    file.error(problem, "the file is truncated: export it again")
                })?;
            file.buffers.push(bytes);
        }
        Ok(file)
    }

    pub fn error(&self, problem: impl Into<String>, hint: &str) -> Error {
        Error::scene(self.path.display().to_string(), problem, hint)
    }

    /// The content of a URI: embedded data, or a file beside this one.
    fn resource(&self, uri: &str) -> Result<Vec<u8>> {
        if let Some(data) = uri.strip_prefix("data:") {
            let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
            let decoded = encoded.and_then(|encoded| STANDARD.decode(encoded).ok());
            return decoded
                .ok_or_else(|| self.error("a data URI is not base64", "export it again"));
        }
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let file = folder.join(percent_decoded(uri));
        input_file::read(&file).map_err(|error| {
            let problem = format!("cannot read {}, which it names: {error}", file.display());
            self.error(
                problem,
                "put the file there, or export a .glb, which holds all",
            )
        })
    }

    /// The bytes of an image file.
    pub fn image(&self, image: &gltf::Image) -> Result<Vec<u8>> {
        match image.source() {
            image::Source::View { view, .. } => Ok(self.view(&view)?.to_vec()),
            image::Source::Uri { uri, .. } => self.resource(uri),
        }
    }

    pub fn view(&self, view: &buffer::View) -> Result<&[u8]> {
        let buffer = self.buffers.get(view.buffer().index());
        let end = view.offset().checked_add(view.length());
        let bytes = buffer.and_then(|bytes| bytes.get(view.offset()..end?));
        bytes.ok_or_else(|| {
            let problem = format!("buffer view {} reaches beyond its buffer", view.index());
            self.error(problem, "export it again")
        })
    }
}

/// Describes a missing part that the `gltf` crate uses without a check.
fn missing_part(root: &Root) -> Option<String> {
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let mut attributes = primitives.flat_map(|primitive| primitive.attributes.values());
    let count = root.accessors.len();
    if let Some(wrong) = attributes.find(|accessor| accessor.value() >= count) {
        return Some(format!(
            "a primitive uses accessor {}, but the file has {count}",
            wrong.value()
        ));
    }
    let mut images = root.images.iter();
    let has_data = |image: &json::Image| {
        image.uri.is_some() || image.buffer_view.is_some() && image.mime_type.is_some()
    };
    if let Some(index) = images.position(|image| !has_data(image)) {
        return Some(format!(
            "image {index} has neither a uri nor a bufferView with its mimeType"
        ));
    }
    let has_lens = |camera: &json::Camera| match camera.type_ {
        Checked::Valid(camera::Type::Perspective) => camera.perspective.is_some(),
        Checked::Valid(camera::Type::Orthographic) => camera.orthographic.is_some(),
        Checked::Invalid => false,
    };
    if let Some(index) = root.cameras.iter().position(|camera| !has_lens(camera)) {
        return Some(format!("camera {index} has no lens"));
    }
    let lights = root.extensions.as_ref();
    let lights = lights.and_then(|extensions| extensions.khr_lights_punctual.as_ref());
    let lights = lights.map_or(&[][..], |extension| &extension.lights);
    let has_cone = |light: &Punctual| match light.type_ {
        Checked::Valid(Type::Spot) => light.spot.is_some(),
        Checked::Valid(_) => true,
        Checked::Invalid => false,
    };
    if let Some(index) = lights.iter().position(|light| !has_cone(light)) {
        return Some(format!(
            "light {index} has no type, or is a spot light without a cone"
        ));
    }
    let mut of_nodes = root.nodes.iter().filter_map(|node| {
        let extension = node.extensions.as_ref()?.khr_lights_punctual.as_ref()?;
        Some(extension.light.value())
    });
    let wrong = of_nodes.find(|&light| light >= lights.len())?;
    Some(format!(
        "a node uses light {wrong}, but the file has {}",
        lights.len()
    ))
}

/// Decodes escapes such as `%20`, which is a space.
fn percent_decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, behind)) = rest.split_first() {
        let digits = behind
            .get(..2)
            .and_then(|digits| std::str::from_utf8(digits).ok());
        let byte = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        match byte.filter(|_| first == b'%') {
            Some(byte) => {
                bytes.push(byte);
                rest = &behind[2..];
            }
            None => {
                bytes.push(first);
                rest = behind;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
