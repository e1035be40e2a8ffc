//! Files of compiled pipelines that are damaged, of another driver, or cannot be written. Frames do not depend on them.
//!
//! lavapipe and SwiftShader put nothing but a header into their pipeline caches, and other drivers more.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::common::gpu::{Gpu, demo_scene, plain_sum};
use camlux::{
    Device, DeviceOptions, Fault, RenderOptions, Renderer, Scene, engine_hash, output::Frame,
};

/// What the file has before the driver's bytes: a name, their number and a checksum.
const PREFIX_BYTES: usize = 16 + 8 + 32;
/// Where the driver's bytes have its UUID.
const UUID_BYTE: usize = PREFIX_BYTES + 16;

fn scene() -> Scene {
    plain_sum(demo_scene("cornell_spot", [16, 16]), 8)
}

/// A frame of a new device that keeps its pipelines in a folder, and the bytes that it read from there. Then the device is closed.
fn render_with(folder: &Path, fault: Option<Fault>) -> (Frame, usize) {
    let options = DeviceOptions {
        validation: true,
        ..DeviceOptions::default()
    };
    let device = Device::open(&options).expect("scripts/test installs a driver and the layer");
    device.keep_pipelines_in(folder);
    device.inject(fault);
    let mut renderer = Renderer::new(&device).expect("a renderer");
    let frame = renderer.render(&scene(), &mut RenderOptions::default());
    let read = device.fault_count().pipeline_bytes;
    drop(renderer);
    let messages = device.close().expect("nothing holds the device");
    assert_eq!(messages, [""; 0]);
    (frame.expect("the scene renders"), read)
}

/// The only file in a folder.
#[track_caller]
fn only_file(folder: &Path) -> PathBuf {
    let files = fs::read_dir(folder).expect("a folder");
    let files: Vec<PathBuf> = files.map(|file| file.expect("a file").path()).collect();
    assert_eq!(files.len(), 1, "{files:?}");
    files[0].clone()
}

/// A file with these bytes of a driver, and all else right.
fn file_of(data: &[u8]) -> Vec<u8> {
    let mut hasher = blake3::Hasher::new();
    let checksum = hasher.update(engine_hash().as_bytes()).update(data);
    let checksum = checksum.finalize();
    let length = (data.len() as u64).to_le_bytes();
    [b"camlux pipelines", &length[..], checksum.as_bytes(), data].concat()
}

#[test]
fn a_second_device_reads_what_the_first_wrote() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().join("made on demand");
    let fresh = Gpu::open().render(&scene());
    let (first, read) = render_with(&folder, None);
    assert_eq!(read, 0);
    assert!(first.layers == fresh.layers);
    let written = fs::read(only_file(&folder)).expect("a file");
    assert!(written == file_of(&written[PREFIX_BYTES..]));
    let (second, read) = render_with(&folder, None);
    assert_eq!(read, written.len() - PREFIX_BYTES);
    assert!(second.layers == fresh.layers);
}

#[test]
fn a_bad_file_is_ignored_and_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let (fresh, _) = render_with(folder.path(), None);
    let path = only_file(folder.path());
    let good = fs::read(&path).expect("a file");
    let changed = |byte: usize| {
        let mut bytes = good.clone();
        bytes[byte] ^= 1;
        bytes
    };
    let foreign = file_of(&changed(UUID_BYTE)[PREFIX_BYTES..]);
    for (what, bad) in [
        ("empty", Vec::new()),
        ("truncated before its data", good[..PREFIX_BYTES].to_vec()),
        ("truncated by a byte", good[..good.len() - 1].to_vec()),
        ("a byte too long", [&good[..], b"?"].concat()),
        ("another name", changed(0)),
        ("another length", changed(16)),
        ("a wrong checksum", changed(24)),
        ("a corrupt header", changed(PREFIX_BYTES)),
        ("a corrupt byte at its end", changed(good.len() - 1)),
        ("the UUID of another driver", foreign),
        ("something else", vec![0xff; 100_000]),
    ] {
        fs::write(&path, &bad).expect("a file");
        let (frame, read) = render_with(folder.path(), None);
        assert_eq!(read, 0, "{what}");
        assert!(frame.layers == fresh.layers, "{what}");
        assert_eq!(only_file(folder.path()), path, "{what}");
        let replaced = fs::read(&path).expect("a file");
        assert!(replaced == file_of(&replaced[PREFIX_BYTES..]), "{what}");
        let (_, read) = render_with(folder.path(), None);
        assert_eq!(read, replaced.len() - PREFIX_BYTES, "{what}");
    }
}

#[test]
fn a_folder_that_takes_no_file_costs_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    fs::write(&file, "").expect("a file");
    let fresh = Gpu::open().render(&scene());
    // No system allows either of them, even to the superuser.
    for unwritable in [file.join("folder"), "/proc/camlux".into()] {
        let (frame, read) = render_with(&unwritable, None);
        assert_eq!(read, 0);
        assert!(frame.layers == fresh.layers);
    }
    // A folder in place of the file is left alone.
    let path = folder.path().join("pipelines");
    render_with(&path, None);
    let file = only_file(&path);
    fs::remove_file(&file).expect("a file");
    fs::create_dir_all(file.join("inside")).expect("a folder");
    let (frame, read) = render_with(&path, None);
    assert_eq!(read, 0);
    assert!(frame.layers == fresh.layers);
    assert!(file.join("inside").is_dir());
}

#[test]
fn a_driver_without_memory_for_a_cache_compiles_without_one() {
    let fresh = Gpu::open().render(&scene());
    for (function, is_read) in [
        ("vkCreatePipelineCache", false),
        ("vkGetPipelineCacheData", true),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let fault = Some(Fault::OutOfMemory {
            function: Some(function),
            call: 0,
        });
        let (frame, _) = render_with(folder.path(), fault);
        assert!(frame.layers == fresh.layers, "{function}");
        let files = fs::read_dir(folder.path()).expect("a folder");
        assert_eq!(files.count(), 0, "{function}");
        // And if there is a file.
        render_with(folder.path(), None);
        let path = only_file(folder.path());
        let (frame, read) = render_with(folder.path(), fault);
        assert!(frame.layers == fresh.layers, "{function}");
        assert_eq!(read > 0, is_read, "{function}");
        assert!(path.is_file(), "{function}");
    }
}
