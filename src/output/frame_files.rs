//! The files of a frame of a data set.

use std::fs::File;
use std::path::Path;

use super::{
    ExrCompression, ExrOptions, Frame, OutputFile, WrittenExr, write_depth_png, write_exr_files,
    write_npz,
};
use crate::error::{Error, Result};

/// What the layers of a frame are written to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum FileFormat {
    #[default]
    Exr,
    /// An archive of numpy.
    Npz,
}

impl FileFormat {
    pub const ALL: [FileFormat; 2] = [FileFormat::Exr, FileFormat::Npz];

    /// Also the extension of its files.
    pub fn name(self) -> &'static str {
        match self {
            FileFormat::Exr => "exr",
            FileFormat::Npz => "npz",
        }
    }

    /// How its files can be packed.
    pub fn compressions(self) -> &'static [ExrCompression] {
        match self {
            FileFormat::Exr => &ExrCompression::ALL,
            FileFormat::Npz => &[ExrCompression::None, ExrCompression::Zip],
        }
    }

    /// How they are if nobody says it.
    pub fn usual_compression(self) -> ExrCompression {
        match self {
            FileFormat::Exr => ExrCompression::Rle,
            FileFormat::Npz => ExrCompression::None,
        }
    }
}

/// Writes the files of a frame, and warns of values that they cannot hold. `path`: of the whole frame. `has_depth_png`: with a PNG of its
/// depth beside it. The hash is of all files, in their order.
///
/// # Errors
/// [`Error::Output`] when a file cannot be written, or when the frame lacks a layer.
pub fn write_frame_files(
    path: &Path,
    frame: &Frame,
    format: FileFormat,
    exr: &ExrOptions,
    has_depth_png: bool,
) -> Result<(WrittenExr, Vec<String>)> {
    let mut warnings = exr.warnings(frame);
    let mut written = match format {
        FileFormat::Exr => write_exr_files(path, frame, exr)?,
        FileFormat::Npz => {
            let is_compressed = exr.compression != ExrCompression::None;
            write_npz(path, frame, exr, is_compressed)?
        }
    };
    if has_depth_png {
        let path = path.with_extension("depth.png");
        let (bytes, warning) = write_depth_png(OutputFile::create(&path)?, frame)?;
        warnings.extend(warning);
        let mut hasher = blake3::Hasher::new();
        for path in &written.files {
            let hashed = File::open(path).and_then(|file| hasher.update_reader(file).map(|_| ()));
            hashed.map_err(|error| Error::Output {
                path: path.clone(),
                problem: format!("it cannot be read again: {error}"),
                hint: "check the disk".into(),
            })?;
        }
        hasher.update(&bytes);
        written.blake3 = hasher.finalize().to_hex().to_string();
        written.bytes = hasher.count();
        written.files.push(path);
    }
    Ok((written, warnings))
}
