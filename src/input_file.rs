//! Opens input files. Pipes and devices are refused, because they may never end.

use std::borrow::Cow;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Error, ErrorKind, Read, Result, Take};
use std::path::Path;

/// Opens a file for reading and returns it with its length in bytes.
pub fn open(path: &Path) -> Result<(File, u64)> {
    // Checked before opening, because opening a pipe waits for a writer.
    let refuse_others = |metadata: &fs::Metadata| {
        if metadata.is_file() {
            return Ok(());
        }
        let problem = "it is not a file, but a folder, a pipe or a device";
        Err(Error::new(ErrorKind::InvalidInput, problem))
    };
    refuse_others(&fs::metadata(path)?)?;
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    refuse_others(&metadata)?;
    Ok((file, metadata.len()))
}

/// Limit on the length. A length without content costs nothing, and some systems promise memory that they do not have.
const MOST_BYTES: u64 = 1 << 40;

/// A file that is read from its beginning to its end, so that it is never in memory as a whole.
pub type Stream = BufReader<Take<File>>;

/// Opens a file to be read once, with its length in bytes. Data that is appended meanwhile is left out.
pub fn stream(path: &Path) -> Result<(Stream, u64)> {
    const BUFFER_BYTES: usize = 1 << 16;
    let (file, file_bytes) = open(path)?;
    if file_bytes > MOST_BYTES {
        let problem = format!("it has {file_bytes} bytes, more than memory holds");
        return Err(Error::new(ErrorKind::FileTooLarge, problem));
    }
    let mut stream = BufReader::with_capacity(BUFFER_BYTES, file.take(file_bytes));
    // A clone whose large files were not fetched has such text in their place.
    if stream.fill_buf()?.starts_with(b"version https://git-lfs") {
        let problem = "it is a pointer of Git LFS, not the file: run git lfs pull";
        return Err(Error::new(ErrorKind::InvalidData, problem));
    }
    Ok((stream, file_bytes))
}

/// Reads the whole of a file. Data that is appended meanwhile is left out.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let (mut stream, file_bytes) = stream(path)?;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(file_bytes).unwrap_or(usize::MAX))?;
    stream.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The text without a byte order mark, and with `\n` at the end of each line: files also have `\r\n`, and `\r` alone.
pub fn plain_lines(text: &str) -> Cow<'_, str> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if text.contains('\r') {
        text.replace("\r\n", "\n").replace('\r', "\n").into()
    } else {
        text.into()
    }
}
