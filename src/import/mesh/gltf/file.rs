//! The files of a glTF model: JSON, buffers and images.

use std::cell::{OnceCell, RefCell};
use std::ops::Range;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::document::Document;
use super::keys::{DISPENSABLE_EXTENSIONS, KNOWN_EXTENSIONS, MEANINGLESS_EXTENSIONS};
use super::surface::Image;
use crate::import::unused::Unused;
use crate::{Error, Result, input_file};

pub(super) struct GltfFile {
    pub path: PathBuf,
    pub document: Document,
    /// What the file holds and camlux does not use.
    pub unused: RefCell<Unused>,
    file_bytes: usize,
    /// The whole .glb file, and where its buffer is.
    glb: Option<(Vec<u8>, Range<usize>)>,
    /// Read when they are used.
    buffers: Vec<OnceCell<Vec<u8>>>,
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
        let file_bytes = bytes.len();
        let error =
            |problem: String, hint: &str| Error::scene(path.display().to_string(), problem, hint);
        let broken = |problem: String| {
            let problem = format!("not valid glTF 2.0: {problem}");
            error(problem, "export it again")
        };
        let (json, glb) = if bytes.starts_with(b"glTF") {
            let (json, buffer) = chunks(&bytes).map_err(broken)?;
            let json = serde_json::from_slice(&bytes[json]);
            (json, buffer.map(|buffer| (bytes, buffer)))
        } else {
            let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
            let json = serde_json::from_slice(text);
            drop(bytes);
            (json, None)
        };
        let json = json.map_err(|error| broken(format!("its JSON cannot be read: {error}")))?;
        let unused = RefCell::default();
        let document = Document::parse(json, &unused).map_err(broken)?;
        let is_unknown = |name: &&String| {
            let allowed = [
                &KNOWN_EXTENSIONS[..],
                &MEANINGLESS_EXTENSIONS,
                &DISPENSABLE_EXTENSIONS,
            ];
            !allowed.concat().contains(&name.as_str())
        };
        if let Some(unknown) = document.extensions_required.iter().find(is_unknown) {
            let problem =
                format!("it requires the extension {unknown}, which camlux does not support");
            return Err(error(problem, remedy(unknown)));
        }
        Ok(GltfFile {
            path: path.to_owned(),
            file_bytes,
            buffers: document.buffers.iter().map(|_| OnceCell::new()).collect(),
            document,
            unused,
            glb,
        })
    }

    pub fn error(&self, problem: impl Into<String>, hint: &str) -> Error {
        Error::scene(self.path.display().to_string(), problem, hint)
    }

    /// The error for a file that breaks the rules of the format.
    pub fn broken(&self, problem: impl std::fmt::Display) -> Error {
        self.error(format!("not valid glTF 2.0: {problem}"), "export it again")
    }

    /// The error for data that an extension compresses.
    pub fn compressed(&self, extension: &str) -> Error {
        let problem = format!("its data are compressed by {extension}, which camlux does not read");
        self.error(problem, remedy(extension))
    }

    /// An element that `user` names by its index. `what`: "accessor".
    pub fn find<'l, T>(
        &self,
        list: &'l [T],
        index: usize,
        what: &str,
        user: &str,
    ) -> Result<&'l T> {
        list.get(index).ok_or_else(|| {
            let count = list.len();
            self.broken(format!(
                "{user} uses {what} {index}, but the file has {count}"
            ))
        })
    }

    /// Counts something that camlux does not use.
    pub fn leave_out(&self, what: &str) {
        self.unused.borrow_mut().add(what);
    }

    /// The bytes of the file and of the buffers that were read.
    pub fn byte_count(&self) -> usize {
        let buffers = self.buffers.iter().filter_map(OnceCell::get);
        self.file_bytes + buffers.map(Vec::len).sum::<usize>()
    }

    /// The content of a URI: embedded data, or a file beside this one.
    fn resource(&self, uri: &str) -> Result<Vec<u8>> {
        let (scheme, rest) = uri.split_once(':').unwrap_or_default();
        if scheme.eq_ignore_ascii_case("data") {
            return embedded(rest)
                .ok_or_else(|| self.error("a data URI cannot be decoded", "export it again"));
        }
        if rest.starts_with("//") {
            let problem = format!("it names {uri}, and camlux loads nothing from a network");
            let hint = "put that file beside this one, and name it by its path";
            return Err(self.error(problem, hint));
        }
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let decoded = String::from_utf8_lossy(&percent_decoded(uri)).into_owned();
        // As it should be written; without the escapes that the format asks for; as other systems write it.
        let names = [decoded.clone(), uri.to_owned(), decoded.replace('\\', "/")];
        let files = names.map(|name| folder.join(name));
        let file = files.iter().find(|file| file.exists()).unwrap_or(&files[0]);
        input_file::read(file).map_err(|error| {
            let problem = format!("cannot read {}, which it names: {error}", file.display());
            self.error(
                problem,
                "put the file there, or export a .glb, which holds all",
            )
        })
    }

    /// The bytes of an image file.
    pub fn image(&self, index: usize, image: &Image) -> Result<Vec<u8>> {
        match (&image.uri, image.view) {
            (_, Some(view)) => Ok(self.view(view, &format!("image {index}"))?.to_vec()),
            (Some(uri), None) => self.resource(uri),
            (None, None) => {
                Err(self.broken(format!("image {index} has neither a uri nor a bufferView")))
            }
        }
    }

    /// The bytes of a buffer view.
    pub fn view(&self, index: usize, user: &str) -> Result<&[u8]> {
        let view = self.find(&self.document.views, index, "bufferView", user)?;
        let bytes = match (self.buffer(view.buffer, index), view.compression) {
            // The buffer may be only a place for the data without the extension.
            (Err(_), Some(extension)) => return Err(self.compressed(extension)),
            (bytes, _) => bytes?,
        };
        let end = view.offset.checked_add(view.length);
        let bytes = end.and_then(|end| bytes.get(view.offset..end));
        bytes.ok_or_else(|| self.broken(format!("bufferView {index} reaches beyond its buffer")))
    }

    fn buffer(&self, index: usize, view: usize) -> Result<&[u8]> {
        let user = format!("bufferView {view}");
        let buffer = self.find(&self.document.buffers, index, "buffer", &user)?;
        let bytes = match (&buffer.uri, &self.glb) {
            (Some(uri), _) => {
                let read = &self.buffers[index];
                match read.get() {
                    Some(bytes) => bytes,
                    None => {
                        let bytes = self.resource(uri)?;
                        read.get_or_init(|| bytes)
                    }
                }
            }
            (None, Some((file, place))) if index == 0 => &file[place.clone()],
            (None, _) => return Err(self.broken(format!("buffer {index} has no data"))),
        };
        bytes.get(..buffer.length).ok_or_else(|| {
            let problem = format!("buffer {index} is shorter than its {} bytes", buffer.length);
            self.error(problem, "the file is truncated: export it again")
        })
    }
}

fn remedy(extension: &str) -> &'static str {
    match extension {
        "KHR_draco_mesh_compression" => {
            "export it without that extension, or decompress it: gltf-transform copy in.glb out.glb"
        }
        "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "export it without that extension, or decompress it: gltf-transform copy in.glb out.glb"
        }
        "KHR_texture_basisu" | "MSFT_texture_dds" | "EXT_texture_avif" | "EXT_texture_astc" => {
            "export its images as PNG, JPEG or WebP"
        }
        _ => "export it without that extension",
    }
}

/// Where the JSON and the buffer of a .glb file are.
fn chunks(file: &[u8]) -> std::result::Result<(Range<usize>, Option<Range<usize>>), String> {
    let truncated = || "the file is truncated".to_owned();
    let word = |at: usize| {
        let bytes = file.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(bytes))
    };
    let version = word(4).ok_or_else(truncated)?;
    if version != 2 {
        return Err(format!("it is glTF \"{version}\""));
    }
    let whole = word(8).ok_or_else(truncated)? as usize;
    if whole > file.len() {
        return Err(format!(
            "the file is truncated: it has {} of its {whole} bytes",
            file.len()
        ));
    }
    let chunk = |start: usize, kind: &[u8; 4]| {
        let length = word(start).ok_or_else(truncated)? as usize;
        let is_kind = file.get(start + 4..start + 8) == Some(kind);
        let place = start + 8..start + 8 + length;
        match file.get(place.clone()) {
            Some(_) => Ok(is_kind.then_some(place)),
            None => Err(truncated()),
        }
    };
    let json = chunk(12, b"JSON")?.ok_or("its first chunk is no JSON")?;
    let mut start = json.end;
    // A chunk of another kind is to be passed over.
    while start + 8 <= whole {
        if let Some(buffer) = chunk(start, b"BIN\0")? {
            return Ok((json, Some(buffer)));
        }
        let length = word(start).ok_or_else(truncated)? as usize;
        start += 8 + length;
    }
    Ok((json, None))
}

/// The data of a data URI, behind its `data:`.
fn embedded(uri: &str) -> Option<Vec<u8>> {
    let lenient = GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true);
    let (kind, data) = uri.split_once(',')?;
    let is_base64 = kind.to_ascii_lowercase().ends_with(";base64");
    match is_base64 {
        true if data.contains('%') => GeneralPurpose::new(&STANDARD, lenient)
            .decode(percent_decoded(data))
            .ok(),
        true => GeneralPurpose::new(&STANDARD, lenient).decode(data).ok(),
        false => Some(percent_decoded(data)),
    }
}

/// Decodes escapes such as `%20`, which is a space.
fn percent_decoded(uri: &str) -> Vec<u8> {
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
    bytes
}
