//! Image files that are damaged, hostile or of another format: each gives one clear error, without a panic or large allocations.

use std::fs;
use std::path::{Path, PathBuf};

use camlux::output::LayeredImage;
use exr::prelude::*;

/// Writes a valid file of 8 × 6 pixels with the channels `direct.R` (16-bit), `id.instance` and `direct.B`.
fn write_image(path: &Path, encoding: Encoding) {
    let pixels = |offset: usize| move |i: usize| (i + offset) as f32;
    let list = [
        (
            "direct.B",
            FlatSamples::F32((0..48).map(pixels(100)).collect()),
        ),
        (
            "direct.R",
            FlatSamples::F16((0..48).map(pixels(0)).map(f16::from_f32).collect()),
        ),
        ("id.instance", FlatSamples::U32((0..48).collect())),
    ];
    let channels = list.map(|(name, samples)| AnyChannel::new(name, samples));
    let layer = Layer::new(
        (8, 6),
        LayerAttributes::default(),
        encoding,
        AnyChannels::sort(SmallVec::from_vec(channels.to_vec())),
    );
    Image::from_layer(layer).write().to_file(path).unwrap();
}

const UNCOMPRESSED: Encoding = Encoding {
    compression: Compression::Uncompressed,
    blocks: Blocks::ScanLines,
    line_order: LineOrder::Increasing,
};

/// Reads a file with this content. The error must be one line that has the path and these parts.
#[track_caller]
fn assert_refused(content: &[u8], says: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    fs::write(&path, content).unwrap();
    assert_path_refused(&path, says);
}

#[track_caller]
fn assert_path_refused(path: &Path, says: &[&str]) {
    let message = LayeredImage::read(path).expect_err("refused").to_string();
    assert!(
        message.starts_with(&path.display().to_string()),
        "{message}"
    );
    assert_eq!(message.lines().count(), 1, "{message}");
    for part in says {
        assert!(message.contains(part), "{part:?} is missing in: {message}");
    }
}

fn valid_bytes(encoding: Encoding) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    write_image(&path, encoding);
    fs::read(path).unwrap()
}

/// The offset of an attribute's values.
fn attribute_at(bytes: &[u8], name_and_kind: &[u8]) -> usize {
    let at = bytes
        .windows(name_and_kind.len())
        .position(|window| window == name_and_kind);
    // The name and the type are followed by four bytes of size.
    at.unwrap() + name_and_kind.len() + 4
}

/// The file with another image size in its header, which stays consistent.
fn with_size(mut bytes: Vec<u8>, compression: Compression, width: i32, height: i32) -> Vec<u8> {
    let block_rows = compression.scan_lines_per_block() as i32;
    let at = attribute_at(&bytes, b"chunkCount\0int\0");
    bytes[at..at + 4].copy_from_slice(&(1 + (height - 1) / block_rows).to_le_bytes());
    for window in [b"dataWindow\0box2i\0".as_slice(), b"displayWindow\0box2i\0"] {
        let at = attribute_at(&bytes, window);
        bytes[at + 8..at + 12].copy_from_slice(&(width - 1).to_le_bytes());
        bytes[at + 12..at + 16].copy_from_slice(&(height - 1).to_le_bytes());
    }
    bytes
}

#[test]
fn what_is_no_image_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    assert_path_refused(
        &folder.path().join("none.exr"),
        &["no such file", "check the name"],
    );
    assert_path_refused(folder.path(), &["not a file"]);
    assert_refused(b"", &["empty"]);
    assert_refused(
        b"\x89PNG\r\n\x1a\n and more",
        &["not a whole OpenEXR image"],
    );
    assert_refused(b"v/1\x01", &["not a whole OpenEXR image"]);
}

#[cfg(unix)]
#[test]
fn a_pipe_is_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("pipe");
    let made = std::process::Command::new("mkfifo")
        .arg(&path)
        .status()
        .unwrap();
    assert!(made.success());
    assert_path_refused(&path, &["not a file"]);
}

#[test]
fn a_file_that_ends_early_is_refused_wherever_it_ends() {
    let zip = Encoding {
        compression: Compression::ZIP16,
        ..UNCOMPRESSED
    };
    for encoding in [UNCOMPRESSED, zip] {
        let bytes = valid_bytes(encoding);
        for length in 0..bytes.len() {
            assert_refused(&bytes[..length], &["not a whole OpenEXR image"]);
        }
    }
}

/// The header claims 1.2e18, 4e9 or 1e9 pixels, but the file has 48. Memory for 4e9 pixels would take 40 GB.
#[test]
fn a_header_cannot_claim_more_pixels_than_its_file_can_hold() {
    let most = i32::MAX / 2 - 1;
    for (width, height) in [(most, most), (65_536, 65_536), (most, 1), (1, most)] {
        for compression in [
            Compression::Uncompressed,
            Compression::ZIP1,
            Compression::PIZ,
        ] {
            let encoding = Encoding {
                compression,
                ..UNCOMPRESSED
            };
            let bytes = with_size(valid_bytes(encoding), compression, width, height);
            assert_refused(&bytes, &[&format!("{width} x {height}"), "cannot hold"]);
        }
    }
    let tiles = Encoding {
        blocks: Blocks::Tiles(Vec2(4, 4)),
        ..UNCOMPRESSED
    };
    let mut bytes = valid_bytes(tiles);
    let at = attribute_at(&bytes, b"tiles\0tiledesc\0");
    bytes[at..at + 8].copy_from_slice(&[0xff, 0xff, 0xff, 0x3f, 0xff, 0xff, 0xff, 0x3f]);
    assert_refused(&bytes, &["not a whole OpenEXR image"]);
}

#[test]
fn what_would_be_misread_is_refused() {
    // A display window of 10^8 pixels around 48.
    let mut bytes = valid_bytes(UNCOMPRESSED);
    let at = attribute_at(&bytes, b"displayWindow\0box2i\0");
    for end in [at + 8, at + 12] {
        bytes[end..end + 4].copy_from_slice(&9_999_i32.to_le_bytes());
    }
    let says = "display window of 10000 x 10000 pixels needs too much memory";
    assert_refused(&bytes, &[says, "save it"]);

    // Only every second pixel of the first channel. The name and its 0 are followed by 4 bytes of type, 4 bytes of flags, x step, y step.
    let mut bytes = valid_bytes(UNCOMPRESSED);
    let at = attribute_at(&bytes, b"channels\0chlist\0") + b"direct.B\0".len() + 8;
    bytes[at] = 2;
    assert_refused(&bytes, &["subsampling not supported", "save it"]);

    let mut bytes = valid_bytes(UNCOMPRESSED);
    let at = attribute_at(&bytes, b"channels\0chlist\0");
    // Rename direct.B to a second direct.R.
    bytes[at + 7] = b'R';
    assert_refused(&bytes, &["direct.R", "twice"]);

    // Set the deep-data flag after the version.
    let mut bytes = valid_bytes(UNCOMPRESSED);
    bytes[5] |= 0b1000;
    let kind = attribute_at(&bytes, b"type\0string\0");
    assert_eq!(&bytes[kind..kind + 13], b"scanlineimage");
    bytes[kind..kind + 13].copy_from_slice(b"deepscanline\0");
    bytes[kind - 4] = 12;
    bytes.remove(kind + 12);
    assert_refused(&bytes, &["deep data"]);
}

/// Two parts with the same channel would be one layer.
#[test]
fn a_channel_that_is_there_twice_is_refused_across_parts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let part = |name: &str, channel: &str| {
        let channel = AnyChannel::new(channel, FlatSamples::F32(vec![1.0; 48]));
        Layer::new(
            (8, 6),
            LayerAttributes::named(name),
            UNCOMPRESSED,
            AnyChannels::sort(SmallVec::from_vec(vec![channel])),
        )
    };
    let image = Image::empty(ImageAttributes::with_size((8, 6)));
    let image = image
        .with_layer(part("light.direct", "R"))
        .with_layer(part("light", "direct.R"));
    image.write().to_file(&path).unwrap();
    assert_path_refused(&path, &["channel light.direct.R is there twice"]);
}

/// Random changes at random bytes give an image or an error, never a panic. The seed is fixed.
#[test]
fn random_damage_gives_an_image_or_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut random = fastrand::Rng::with_seed(1);
    // 30 000 rounds gave no panic, either.
    let rounds = 150;
    let mut refused = 0;
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::DWAA(None),
    ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(4, 4))] {
            let valid = valid_bytes(Encoding {
                compression,
                blocks,
                line_order: LineOrder::Increasing,
            });
            for _ in 0..rounds {
                let mut bytes = valid.clone();
                for _ in 0..=random.usize(..4) {
                    let at = random.usize(..bytes.len());
                    bytes[at] = random.u8(..);
                }
                fs::write(&path, &bytes).unwrap();
                refused += usize::from(LayeredImage::read(&path).is_err());
            }
        }
    }
    // If the damage hits an uncompressed sample or a text, the file is still an image.
    assert!(refused > rounds && refused < 14 * rounds, "{refused}");
}
