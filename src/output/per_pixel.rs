//! Work for each pixel on the host, on all its threads.

use crate::parallel::{for_each_at_once, thread_count};

/// Computes `N` values for each pixel.
pub(crate) fn per_pixel<T: Send, const N: usize>(
    values: &mut [T],
    value: impl Fn(usize) -> [T; N] + Sync,
) {
    let (pixels, _) = values.as_chunks_mut::<N>();
    let share = pixels_of_a_thread(pixels.len());
    for_each_at_once(pixels.chunks_mut(share).enumerate(), |(part, pixels)| {
        for (i, pixel) in pixels.iter_mut().enumerate() {
            *pixel = value(part * share + i);
        }
    });
}

/// Pixels per thread. Most of the time goes to memory, whose pages the system may have to clear. The minimum is
/// 16 384 pixels: below it, starting a thread takes longer than its work.
pub(crate) fn pixels_of_a_thread(count: usize) -> usize {
    count.div_ceil(thread_count()).max(1 << 14)
}
