//! What a block that is compressed by DWA claims to hold: `exr` makes room for all of it, and ends the program where there is
//! not so much memory.

use exr::block::chunk::{Chunk, CompressedBlock};
use exr::meta::header::Header;
use exr::prelude::Compression;

use super::exr_decode::{Refusal, damaged, explain};

/// Before the data stand eleven numbers of 64 bits: the version, sizes, counts and the kind of entropy coding.
const NUMBERS: usize = 11;
/// Those that say how much is unpacked: bytes of other data, of run lengths and of what these stand for, number of AC and of DC
/// coefficients.
const UNPACKED: [usize; 5] = [1, 6, 7, 8, 9];

/// Refuses a block that claims more than its pixels can have.
pub(super) fn check_block(chunk: &Chunk, header: &Header) -> Result<(), Refusal> {
    if !matches!(
        header.compression,
        Compression::DWAA(_) | Compression::DWAB(_)
    ) {
        return Ok(());
    }
    let block = &chunk.compressed_block;
    let data = match block {
        CompressedBlock::ScanLine(lines) => &lines.compressed_pixels_le,
        CompressedBlock::Tile(tile) => &tile.compressed_pixels_le,
        // Deep data is refused elsewhere.
        _ => return Ok(()),
    };
    let place = header
        .get_block_data_indices(block)
        .and_then(|indices| header.get_absolute_block_pixel_coordinates(indices))
        .map_err(explain)?;
    let pixels = |round: usize| {
        let [width, height] = [place.size.width(), place.size.height()];
        width.next_multiple_of(round) * height.next_multiple_of(round)
    };
    if data.len() == pixels(1) * header.channels.bytes_per_pixel {
        // It is not compressed.
        return Ok(());
    }
    // Coefficients come in blocks of 8 x 8; run lengths may be longer than what they stand for, but not twice.
    let most = 2 * (pixels(8) * header.channels.bytes_per_pixel) as u64;
    let (numbers, _) = data.as_chunks::<8>();
    let numbers: Vec<u64> = numbers
        .iter()
        .take(NUMBERS)
        .map(|&bytes| u64::from_le_bytes(bytes))
        .collect();
    let unpacked = UNPACKED.iter().filter_map(|&index| numbers.get(index));
    match unpacked.max() {
        Some(claimed) if *claimed > most => Err(damaged(format!(
            "a block claims {claimed} values where {most} would be many"
        ))),
        _ => Ok(()),
    }
}
