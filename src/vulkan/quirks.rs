//! What drivers do that Vulkan does not say, in one table.

use ash::vk::DriverId;

/// What a driver does that Vulkan does not say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quirks {
    /// A kernel leaves its loops after so many iterations of all of them together, and says nothing.
    pub max_loop_iterations: Option<u32>,
    /// Images are laid out in whole blocks of so many rows.
    pub image_block_rows: u32,
}

const NONE: Quirks = Quirks {
    max_loop_iterations: None,
    image_block_rows: 4,
};

const QUIRKS: [(DriverId, Quirks); 2] = [
    (
        // LP_MAX_TGSI_LOOP_ITERATIONS of llvmpipe: seen with Mesa 22.3, and taken to hold for newer ones.
        DriverId::MESA_LLVMPIPE,
        Quirks {
            max_loop_iterations: Some(65_535),
            ..NONE
        },
    ),
    (
        // Seen on an H100 with driver 580.
        DriverId::NVIDIA_PROPRIETARY,
        Quirks {
            image_block_rows: 32,
            ..NONE
        },
    ),
];

impl Default for Quirks {
    fn default() -> Self {
        NONE
    }
}

impl Quirks {
    pub(super) fn of(driver: DriverId) -> Quirks {
        let known = QUIRKS.iter().find(|(id, _)| *id == driver);
        known.map(|(_, quirks)| *quirks).unwrap_or_default()
    }
}
