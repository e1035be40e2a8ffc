//! Colours of vertices and faces.

/// Turns colours into values from 0 to 1. If all are whole numbers up to 255, and some are above 1, they are 8-bit values.
pub(super) fn as_unit_colors(colors: &mut [[f32; 3]]) {
    let values = || colors.iter().flatten();
    let is_byte = |value: &f32| (0.0..=255.0).contains(value) && value.fract() == 0.0;
    if values().any(|&value| value > 1.0) && values().all(is_byte) {
        for color in colors {
            *color = color.map(|value| value / 255.0);
        }
    }
}
