//! Sorts the attributes of an OpenEXR header. The `exr` crate keeps them in a map of the standard library, whose order differs from run to
//! run.

use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};

/// Magic number and version.
const PREAMBLE_BYTES: u64 = 8;
/// The bit of the version for several parts, in its second byte.
const HAS_PARTS: u8 = 1 << 4;

/// Sorts the attributes of each part of a finished file by name. Their lengths do not change, so nothing after them moves.
pub(super) fn sort(file: &mut (impl Read + Write + Seek)) -> io::Result<()> {
    let mut preamble = [0; PREAMBLE_BYTES as usize];
    file.rewind()?;
    file.read_exact(&mut preamble)?;
    let mut headers = Vec::new();
    let mut reader = BufReader::new(&mut *file);
    loop {
        let mut attributes = read_attributes(&mut reader)?;
        attributes.sort();
        headers.extend(attributes.concat());
        // Each header ends with an empty name, and so do the headers of several parts.
        if attributes.is_empty() || preamble[5] & HAS_PARTS == 0 {
            break;
        }
        headers.push(0);
    }
    file.seek(SeekFrom::Start(PREAMBLE_BYTES))?;
    file.write_all(&headers)?;
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
