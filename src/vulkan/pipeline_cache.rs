//! Compiled pipelines that outlive the process, for drivers that keep none themselves.

use ash::vk;

use super::{
    Device,
    pipeline_file::{PipelineFile, has_pipelines, user_folder},
};

#[cfg(feature = "test-hooks")]
impl Device {
    /// Keeps compiled pipelines in this folder, with any driver. Otherwise tests keep none, so that they leave the user's folder alone.
    #[doc(hidden)]
    pub fn keep_pipelines_in(&self, folder: &std::path::Path) {
        self.faults().keep_pipelines_in(folder);
    }
}

/// A driver's cache of pipelines. It is filled from a file, and written to it when it is dropped. Whatever goes wrong with the file,
/// pipelines are made all the same, so no error leaves this module.
pub(super) struct PipelineCache {
    device: Device,
    pub raw: vk::PipelineCache,
    file: PipelineFile,
    /// What the file held.
    read: Option<blake3::Hash>,
}

impl PipelineCache {
    /// `None` if the driver needs none ([`Quirks`](super::Quirks)), or if there is no folder for it.
    pub fn open(device: &Device) -> Option<PipelineCache> {
        let info = device.info();
        let of_user = || user_folder().filter(|_| info.quirks.needs_pipeline_file);
        let folder = device.faults().pipeline_folder(of_user)?;
        let file = PipelineFile::new(&folder, &device.properties(), &info.driver);
        let create = |data: &[u8]| {
            let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
            // SAFETY: the device is live; the data are empty, or what this driver returned for this device.
            device.call("vkCreatePipelineCache", |device| unsafe {
                device.create_pipeline_cache(&info, None)
            })
        };
        // A driver may refuse what it has written itself.
        let filled = file.read().and_then(|data| {
            let raw = create(&data).ok()?;
            device.faults().note_pipelines(data.len());
            Some((raw, Some(blake3::hash(&data))))
        });
        let (raw, read) = match filled {
            Some(filled) => filled,
            None => (create(&[]).ok()?, None),
        };
        Some(PipelineCache {
            device: device.clone(),
            raw,
            file,
            read,
        })
    }

    /// Writes what the file does not hold yet. Of two processes that end at the same time, the last one decides; what the other has
    /// compiled is then compiled once more.
    fn write(&self) {
        // SAFETY: device and cache are live.
        let data = self.device.call("vkGetPipelineCacheData", |device| unsafe {
            device.get_pipeline_cache_data(self.raw)
        });
        if let Ok(data) = data
            && self.read != Some(blake3::hash(&data))
            // The drivers that tests run on return nothing but a header.
            && (has_pipelines(&data) || cfg!(feature = "test-hooks"))
        {
            // Without a folder to write to, the next process compiles again.
            let _ = self.file.write(&data);
        }
    }
}

impl Drop for PipelineCache {
    fn drop(&mut self) {
        self.write();
        let device = self.device.raw();
        // SAFETY: nothing makes pipelines any more, and those that are made do not need the cache.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}
