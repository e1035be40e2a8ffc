//! The files of a glTF model: JSON, buffers and images.

use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::{Document, Gltf, buffer, image};

use crate::{Error, Result, input_file};

/// What is known of an extension that a file cannot be understood without.
const KNOWN_EXTENSIONS: [&str; 1] = ["KHR_lights_punctual"];

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
            let problem = format!("no glTF 2.0: {problem}");
            Error::scene(path.display().to_string(), problem, "export it again")
        };
        let Gltf { document, blob } =
            Gltf::from_slice(&bytes).map_err(|error| broken(error.to_string()))?;
        let mut file = GltfFile {
            path: path.to_owned(),
            document,
            buffers: Vec::new(),
        };
        let mut required = file.document.extensions_required();
        if let Some(unknown) = required.find(|name| !KNOWN_EXTENSIONS.contains(name)) {
            let problem =
                format!("it cannot be read without {unknown}, which camlux does not know");
            return Err(file.error(problem, "export it without that extension"));
        }
        let mut blob = blob;
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
                    let problem =
                        format!("buffer {index} has less than its {} bytes", buffer.length());
                    file.error(problem, "the file is cut; export it again")
                })?;
            file.buffers.push(bytes);
        }
        Ok(file)
    }

    pub fn error(&self, problem: impl Into<String>, hint: &str) -> Error {
        Error::scene(self.path.display().to_string(), problem, hint)
    }

    /// What a URI stands for: data within it, or a file beside this one.
    fn resource(&self, uri: &str) -> Result<Vec<u8>> {
        if let Some(data) = uri.strip_prefix("data:") {
            let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
            let decoded = encoded.and_then(|encoded| STANDARD.decode(encoded).ok());
            return decoded.ok_or_else(|| self.error("a data URI is no base64", "export it again"));
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
            let problem = format!("buffer view {} lies beyond its buffer", view.index());
            self.error(problem, "export it again")
        })
    }
}

/// `%20` is a space.
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
