//! Sorts the attributes of an OpenEXR header. The `exr` crate keeps them in a map of the standard library, whose order differs from run to
//! run.

use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};

/// Magic number and version.
const PREAMBLE_BYTES: u64 = 8;

/// Sorts the attributes of a finished one-part file by name. Their lengths do not change, so nothing after them moves.
pub(super) fn sort(file: &mut (impl Read + Write + Seek)) -> io::Result<()> {
    file.seek(SeekFrom::Start(PREAMBLE_BYTES))?;
    let mut attributes = read_attributes(&mut BufReader::new(&mut *file))?;
    attributes.sort();
    file.seek(SeekFrom::Start(PREAMBLE_BYTES))?;
    file.write_all(&attributes.concat())?;
    file.flush()
}

/// The bytes of each attribute in the file: name, type, length, value.
fn read_attributes(reader: &mut impl BufRead) -> io::Result<Vec<Vec<u8>>> {
    let mut attributes = Vec::new();
    loop {
        let mut bytes = Vec::new();
        reader.read_until(0, &mut bytes)?;
        // An empty name ends the header.
        if bytes.len() <= 1 {
            return Ok(attributes);
        }
        reader.read_until(0, &mut bytes)?;
        let mut length = [0; 4];
        reader.read_exact(&mut length)?;
        bytes.extend(length);
        let length = u64::from(u32::from_le_bytes(length));
        if reader.take(length).read_to_end(&mut bytes)? as u64 != length {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        attributes.push(bytes);
    }
}
