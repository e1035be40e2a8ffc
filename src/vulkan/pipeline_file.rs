//! A file with compiled pipelines in the user's cache folder.
//!
//! Drivers need not check what they are given, and some crash on damaged data. So a file is read only if it is whole, comes from the same
//! kernels, and belongs to this device and this version of its driver.

use std::{
    env,
    ffi::OsString,
    fs,
    io::Read,
    path::{Path, PathBuf},
};

use ash::vk;

use super::shaders::engine_hash;
use crate::{Error, Result, input_file, output::OutputFile};

/// The file begins with this. Then follow the number of the driver's bytes, the checksum, and these bytes.
const MAGIC: &[u8; 16] = b"camlux pipelines";
const LENGTH_BYTES: usize = size_of::<u64>();
const PREFIX_BYTES: usize = MAGIC.len() + LENGTH_BYTES + blake3::OUT_LEN;
/// `VkPipelineCacheHeaderVersionOne`, with which the driver's bytes begin.
const HEADER_BYTES: usize = 32;
/// All kernels of camlux take a few MB. More is not worth reading.
const MOST_BYTES: u64 = 256 << 20;

/// The file of a device, which need not exist.
#[derive(Debug)]
pub(super) struct PipelineFile {
    path: PathBuf,
    /// How the driver's bytes begin.
    header: [u8; HEADER_BYTES],
}

impl PipelineFile {
    pub fn new(folder: &Path, device: &vk::PhysicalDeviceProperties, driver: &str) -> Self {
        let words = [
            HEADER_BYTES as u32,
            vk::PipelineCacheHeaderVersion::ONE.as_raw() as u32,
            device.vendor_id,
            device.device_id,
        ];
        let mut header = [0; HEADER_BYTES];
        // Vulkan defines the order of the bytes.
        let numbers = words.into_iter().flat_map(u32::to_le_bytes);
        let bytes = numbers.chain(device.pipeline_cache_uuid);
        header
            .iter_mut()
            .zip(bytes)
            .for_each(|(to, byte)| *to = byte);
        // The UUID alone should tell drivers and their versions apart, but not all drivers have kept to that.
        let version = device.driver_version;
        let mut hasher = blake3::Hasher::new();
        hasher.update(&header).update(&version.to_le_bytes());
        hasher.update(driver.as_bytes());
        hasher.update(&usize::BITS.to_le_bytes());
        let hash = &hasher.finalize().to_hex()[..16];
        let uuid = device.pipeline_cache_uuid;
        let uuid: String = uuid.iter().map(|byte| format!("{byte:02x}")).collect();
        let name = format!(
            "{:04x}-{:04x}-{version:08x}-{uuid}-{hash}.pipelines",
            device.vendor_id, device.device_id
        );
        PipelineFile {
            path: folder.join(name),
            header,
        }
    }

    /// The driver's bytes. `None` if there is no such file, or if anything is wrong with it.
    pub fn read(&self) -> Option<Vec<u8>> {
        let (file, file_bytes) = input_file::open(&self.path).ok()?;
        if file_bytes > MOST_BYTES {
            return None;
        }
        let mut bytes = Vec::new();
        file.take(file_bytes).read_to_end(&mut bytes).ok()?;
        let (prefix, data) = bytes.split_at_checked(PREFIX_BYTES)?;
        let is_whole = prefix == &prefix_of(data)[..] && self.is_of_device(data);
        is_whole.then(|| bytes.split_off(PREFIX_BYTES))
    }

    /// Replaces the file. Another process sees the old one or the new one.
    ///
    /// # Errors
    /// If the file cannot be written, or if these are not the bytes of such a device.
    pub fn write(&self, data: &[u8]) -> Result<()> {
        if !self.is_of_device(data) || data.len() as u64 > MOST_BYTES - PREFIX_BYTES as u64 {
            return Err(Error::internal("no pipelines of this device"));
        }
        // If this fails, so does the next call.
        let _ = self.path.parent().map(fs::create_dir_all);
        let file = OutputFile::create(&self.path)?;
        file.commit_with(&[&prefix_of(data), data].concat())
    }

    fn is_of_device(&self, data: &[u8]) -> bool {
        data.starts_with(&self.header)
    }
}

/// Whether these bytes hold more than the header of a cache.
pub(super) fn has_pipelines(data: &[u8]) -> bool {
    data.len() > HEADER_BYTES
}

/// What a file has before the driver's bytes.
fn prefix_of(data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u64).to_le_bytes();
    let mut hasher = blake3::Hasher::new();
    // The pipelines of other kernels are never asked for again, and would stay in the file for ever.
    hasher.update(engine_hash().as_bytes());
    hasher.update(data);
    [&MAGIC[..], &length, hasher.finalize().as_bytes()].concat()
}

/// camlux's folder for what can be made again. `None` if the environment names no place for it.
pub(super) fn user_folder() -> Option<PathBuf> {
    folder_of(env::var_os("XDG_CACHE_HOME"), env::var_os("HOME"))
}

/// By the XDG base directory specification, which ignores relative paths.
fn folder_of(caches: Option<OsString>, home: Option<OsString>) -> Option<PathBuf> {
    let absolute = |path: Option<OsString>| path.map(PathBuf::from).filter(|p| p.is_absolute());
    let caches = absolute(caches).or_else(|| Some(absolute(home)?.join(".cache")))?;
    Some(caches.join("camlux"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device() -> vk::PhysicalDeviceProperties {
        vk::PhysicalDeviceProperties {
            vendor_id: 0x106b,
            device_id: 7,
            driver_version: 10_203,
            pipeline_cache_uuid: [5; vk::UUID_SIZE],
            ..Default::default()
        }
    }

    /// A device's file in a folder, and bytes of its driver.
    fn file_in(folder: &Path) -> (PipelineFile, Vec<u8>) {
        let file = PipelineFile::new(folder, &device(), "a driver 1.2.3");
        let data = [&file.header[..], b"compiled"].concat();
        (file, data)
    }

    #[test]
    fn what_was_written_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let (file, data) = file_in(&folder.path().join("made/on/demand"));
        assert_eq!(file.read(), None);
        file.write(&data).expect("a file");
        assert_eq!(file.read().as_ref(), Some(&data));
        let more = [&data[..], b"more"].concat();
        file.write(&more).expect("a file");
        assert_eq!(file.read(), Some(more));
        file.write(b"no header").expect_err("no data of the device");
    }

    #[test]
    fn any_damage_is_found() {
        let folder = tempfile::tempdir().expect("a folder");
        let (file, data) = file_in(folder.path());
        file.write(&data).expect("a file");
        let whole = fs::read(&file.path).expect("a file");
        for index in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[index] ^= 1;
            fs::write(&file.path, &damaged).expect("a file");
            assert_eq!(file.read(), None, "byte {index}");
            fs::write(&file.path, &whole[..index]).expect("a file");
            assert_eq!(file.read(), None, "{index} bytes");
        }
        fs::write(&file.path, [&whole[..], b"?"].concat()).expect("a file");
        assert_eq!(file.read(), None);
    }

    #[test]
    fn files_of_other_devices_are_ignored() {
        let folder = tempfile::tempdir().expect("a folder");
        let (own, data) = file_in(folder.path());
        own.write(&data).expect("a file");
        let mut others = [device(); 4];
        others[0].vendor_id += 1;
        others[1].device_id += 1;
        others[2].pipeline_cache_uuid[15] += 1;
        others[3].driver_version += 1;
        for other in others {
            let other = PipelineFile::new(folder.path(), &other, "a driver 1.2.3");
            assert_ne!(other.path, own.path);
            fs::copy(&own.path, &other.path).expect("a copy");
            let has_own_header = other.header == own.header;
            assert_eq!(other.read().is_some(), has_own_header);
        }
        let other = PipelineFile::new(folder.path(), &device(), "a driver 1.2.4");
        assert_ne!(other.path, own.path);
    }

    #[test]
    fn a_file_that_is_too_large_is_not_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, _) = file_in(folder.path());
        let file = fs::File::create(&path.path).expect("a file");
        // It takes no space on the disk.
        file.set_len(MOST_BYTES + 1).expect("a length");
        assert_eq!(path.read(), None);
    }

    #[test]
    fn the_folder_is_where_the_user_keeps_caches() {
        let [caches, home] = ["/caches", "/home/user"].map(|path| Some(OsString::from(path)));
        let at = |path: &str| Some(PathBuf::from(path));
        assert_eq!(folder_of(caches, home.clone()), at("/caches/camlux"));
        for none in [None, Some("".into()), Some("relative".into())] {
            let found = folder_of(none.clone(), home.clone());
            assert_eq!(found, at("/home/user/.cache/camlux"));
            assert_eq!(folder_of(None, none), None);
        }
    }
}
