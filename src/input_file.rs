//! Opens input files. Pipes and devices are refused, because they may never end.

use std::borrow::Cow;
use std::fs::{self, File};
use std::io::{Error, ErrorKind, Read, Result};
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

/// Reads the whole of a file. Data that is appended meanwhile is left out.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let (file, file_bytes) = open(path)?;
    if file_bytes > MOST_BYTES {
        let problem = format!("it has {file_bytes} bytes, more than memory holds");
        return Err(Error::new(ErrorKind::FileTooLarge, problem));
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(file_bytes).unwrap_or(usize::MAX))?;
    file.take(file_bytes).read_to_end(&mut bytes)?;
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
