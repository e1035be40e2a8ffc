//! Damages valid files, in ways that suit their content.

/// From a fixed seed: every run tries the same inputs.
pub struct Random(fastrand::Rng);

impl Random {
    pub fn new(seed: u64) -> Self {
        Random(fastrand::Rng::with_seed(seed))
    }

    pub fn below(&mut self, count: usize) -> usize {
        self.0.usize(..count.max(1))
    }

    pub fn pick<'a, T>(&mut self, choices: &'a [T]) -> &'a T {
        &choices[self.below(choices.len())]
    }

    /// A range of up to `most` bytes.
    fn range(&mut self, bytes: &[u8], most: usize) -> std::ops::Range<usize> {
        let start = self.below(bytes.len() + 1);
        let length = self.below(most.min(bytes.len() - start) + 1);
        start..start + length
    }
}

/// Numbers at the limits of what a reader can hold, and words that some readers accept as numbers.
pub const NUMBERS: [&str; 28] = [
    "0",
    "-0",
    "-0.0",
    "1",
    "-1",
    "nan",
    "-nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e309",
    "5e-324",
    "1e-400",
    "1e12",
    "1e24",
    "127",
    "255",
    "65536",
    "2147483647",
    "-2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "0.1e-1e1",
    "0x7fffffff",
];

const PIECES: [&[u8]; 16] = [
    b"\n",
    b"\r\n",
    b"\r",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"\xc3(",
    b"\0",
    b"\\\n",
    b"\\",
    b"#",
    b"\"",
    b"/",
    b"  \t ",
    b"[[",
    b"\xc2\xa0",
    b"\x1b[2J",
];

/// A copy of one of the seeds with one to four changes.
pub fn text(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = random.pick(seeds).clone();
    for _ in 0..=random.below(4) {
        match random.below(4) {
            0 => any(random, &mut bytes, seeds),
            1 => replace_number(random, &mut bytes),
            2 => lines(random, &mut bytes),
            _ => {
                let at = random.below(bytes.len() + 1);
                bytes.splice(at..at, random.pick(&PIECES).iter().copied());
            }
        }
    }
    bytes
}

/// The same for binary files.
pub fn binary(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = random.pick(seeds).clone();
    for _ in 0..=random.below(4) {
        if random.below(2) == 0 {
            any(random, &mut bytes, seeds);
        } else {
            let value =
                *random.pick(&[0_u32, 1, 2, 255, 65_535, 0x7fff_ffff, 0x8000_0000, u32::MAX]);
            let value = if random.below(2) == 0 {
                value.to_be_bytes()
            } else {
                value.to_le_bytes()
            };
            let length = *random.pick(&[1, 2, 4]);
            let at = random.below(bytes.len());
            for (byte, value) in bytes.iter_mut().skip(at).zip(&value[..length]) {
                *byte = *value;
            }
        }
    }
    bytes
}

fn any(random: &mut Random, bytes: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    if bytes.is_empty() {
        return;
    }
    let at = random.below(bytes.len());
    match random.below(7) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.below(256) as u8,
        2 => bytes.truncate(at),
        3 => {
            let range = random.range(bytes, 64);
            bytes.drain(range);
        }
        4 => {
            let range = random.range(bytes, 64);
            let piece = bytes[range.clone()].repeat(1 + random.below(40));
            bytes.splice(range.end..range.end, piece);
        }
        5 => {
            let other = random.pick(seeds).clone();
            let piece = other[random.range(&other, 256)].to_vec();
            bytes.splice(at..at, piece);
        }
        _ => {
            let other = random.pick(seeds).clone();
            bytes.truncate(at);
            bytes.extend(&other[random.below(other.len())..]);
        }
    }
}

fn replace_number(random: &mut Random, bytes: &mut Vec<u8>) {
    let is_part = |byte: &u8| byte.is_ascii_digit() || b"+-.".contains(byte);
    let from = random.below(bytes.len() + 1);
    let Some(start) = bytes[from..].iter().position(is_part).map(|i| from + i) else {
        return;
    };
    let length = bytes[start..]
        .iter()
        .take_while(|byte| is_part(byte))
        .count();
    bytes.splice(start..start + length, random.pick(&NUMBERS).bytes());
}

fn lines(random: &mut Random, bytes: &mut Vec<u8>) {
    let mut lines: Vec<&[u8]> = bytes.split(|&byte| byte == b'\n').collect();
    let (a, b) = (random.below(lines.len()), random.below(lines.len()));
    let mut end: &[u8] = b"\n";
    match random.below(5) {
        0 => lines.swap(a, b),
        1 => {
            lines.remove(a);
        }
        2 => {
            let copies = vec![lines[a]; 1 + random.below(60)];
            lines.splice(b..b, copies);
        }
        3 => end = b"\r\n",
        _ => end = b"\r",
    }
    *bytes = lines.join(end);
}

/// Corrects the checksums of a PNG's chunks. Without this, most damage is refused before it is read.
pub fn mend_png(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(head) = bytes.get(at..at + 4) {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let Some(end) = at
            .checked_add(8)
            .and_then(|start| start.checked_add(length))
        else {
            return;
        };
        if end + 4 > bytes.len() {
            return;
        }
        let sum = crc32(&bytes[at + 4..end]);
        bytes[end..end + 4].copy_from_slice(&sum.to_be_bytes());
        at = end + 4;
    }
}

/// The CRC-32 of ISO 3309, as in the PNG specification, bit by bit.
pub fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |sum, &byte| {
        (0..8).fold(sum ^ u32::from(byte), |sum, _| {
            (sum >> 1) ^ (0xedb8_8320 * (sum & 1))
        })
    })
}
