//! Hard cases: `src/hard_cases/sums.rs`.
#![cfg(feature = "reference")]

use crate::common::gpu::{Gpu, gather_kernels};

hard_cases! {
    camlux::hard_cases::sums::CASES;
    vpls_shuffled,
    lights_in_another_order,
    one_light_as_sixteen,
    tiles_of_every_size,
    submissions_of_every_length,
    dim_band_beside_a_bright_one,
    half_floats_saturate_and_say_so,
}

/// Checks the gather kernels that `tiles_of_every_size` compares.
#[test]
fn the_gather_kernels_run() {
    gather_kernels(&Gpu::open().device);
}
