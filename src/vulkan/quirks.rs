//! Driver behaviour that Vulkan does not specify, in one table.

use ash::vk::DriverId;

/// Driver behaviour that Vulkan does not specify.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quirks {
    /// A kernel leaves its loops after this many iterations of all of them together, without an error.
    pub max_loop_iterations: Option<u32>,
    /// A timestamp is taken when the commands before it are flushed, which a barrier causes.
    pub timestamps_need_barriers: bool,
    /// Images are laid out in whole blocks of this many rows; low images in blocks as high as the next power of two.
    pub image_block_rows: u32,
    /// Compiled pipelines are kept in a file: the driver keeps none on the disk itself, and has some in its pipeline caches.
    pub needs_pipeline_file: bool,
}

const NONE: Quirks = Quirks {
    max_loop_iterations: None,
    timestamps_need_barriers: false,
    image_block_rows: 4,
    needs_pipeline_file: true,
};

const QUIRKS: [(DriverId, Quirks); 2] = [
    (
        // LP_MAX_TGSI_LOOP_ITERATIONS of llvmpipe: observed with Mesa 22.3, and assumed for newer versions.
        DriverId::MESA_LLVMPIPE,
        Quirks {
            max_loop_iterations: Some(65_535),
            timestamps_need_barriers: true,
            ..NONE
        },
    ),
    (
        // Observed on an H200 with driver 580: an image of 260 rows takes the memory of 384.
        DriverId::NVIDIA_PROPRIETARY,
        Quirks {
            image_block_rows: 128,
            ..NONE
        },
    ),
];

/// Drivers that keep pipelines on the disk themselves, by their documentation: Mesa (MESA_SHADER_CACHE_DIR), NVIDIA
/// (__GL_SHADER_DISK_CACHE) and AMD. And SwiftShader, whose caches do not outlive their device.
const NEED_NO_PIPELINE_FILE: [DriverId; 12] = [
    DriverId::AMD_OPEN_SOURCE,
    DriverId::AMD_PROPRIETARY,
    DriverId::GOOGLE_SWIFTSHADER,
    DriverId::INTEL_OPEN_SOURCE_MESA,
    DriverId::MESA_AGXV,
    DriverId::MESA_LLVMPIPE,
    DriverId::MESA_NVK,
    DriverId::MESA_PANVK,
    DriverId::MESA_RADV,
    DriverId::MESA_TURNIP,
    DriverId::MESA_V3DV,
    DriverId::NVIDIA_PROPRIETARY,
];

impl Default for Quirks {
    fn default() -> Self {
        NONE
    }
}

impl Quirks {
    pub(super) fn of(driver: DriverId) -> Quirks {
        let known = QUIRKS.iter().find(|(id, _)| *id == driver);
        Quirks {
            needs_pipeline_file: !NEED_NO_PIPELINE_FILE.contains(&driver),
            ..known.map(|(_, quirks)| *quirks).unwrap_or_default()
        }
    }
}
