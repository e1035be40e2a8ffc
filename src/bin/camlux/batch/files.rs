//! The files of a frame.

use std::path::Path;

use camlux::Error;
use camlux::output::{ExrOptions, Frame, WrittenExr, write_frame_files};

use super::frames::Planned;
use super::job::Job;

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
    write_frame_files(path, frame, job.format, &exr, job.has_depth_png)
}
