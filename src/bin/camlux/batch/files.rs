//! The files of a frame.

use std::fs::File;
use std::path::Path;

use camlux::Error;
use camlux::output::{
    ExrCompression, ExrOptions, Frame, OutputFile, WrittenExr, write_depth_png, write_exr_files,
    write_npz,
};

use super::frames::Planned;
use super::job::Job;

/// What the layers of a frame are written to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Format {
    #[default]
    Exr,
    /// An archive of numpy.
    Npz,
}

/// How numpy's archives can be packed.
pub const NPZ_COMPRESSIONS: [ExrCompression; 2] = [ExrCompression::None, ExrCompression::Zip];

impl Format {
    pub const ALL: [Format; 2] = [Format::Exr, Format::Npz];

    /// Also the extension of its files.
    pub fn name(self) -> &'static str {
        match self {
            Format::Exr => "exr",
            Format::Npz => "npz",
        }
    }
}

/// Writes the files of a frame as its job says, and warns of values that they cannot hold. `path`: of the whole frame.
pub fn write(
    job: &Job,
    planned: &Planned,
    path: &Path,
    frame: &Frame,
) -> Result<(WrittenExr, Vec<String>), Error> {
    let exr = ExrOptions {
        layers: planned.layers.clone(),
        attributes: planned.attributes(),
        ..job.exr.clone()
    };
    let mut warnings = exr.warnings(frame);
    let mut written = match job.format {
        Format::Exr => write_exr_files(path, frame, &exr)?,
        Format::Npz => {
            let is_compressed = exr.compression != ExrCompression::None;
            write_npz(path, frame, &exr, is_compressed)?
        }
    };
    if job.has_depth_png {
        let path = path.with_extension("depth.png");
        let (bytes, warning) = write_depth_png(OutputFile::create(&path)?, frame)?;
        warnings.extend(warning);
        // One hash of all files, in their order.
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
