//! The vignetting of a lens as an image.

use super::validate::Part;
use crate::Result;

/// Relative illumination of a lens, measured: an image of a flat field, divided by its value on the axis. It spans the image of the camera,
/// whatever the resolutions of both. Between the centres of its pixels it is bilinear, and constant from the outer ones to the edges.
#[derive(Debug, Clone, PartialEq)]
pub struct VignettingMap {
    /// Width, height.
    pub size_px: [u32; 2],
    /// Light over that on the axis, from 0 to 100; row by row from the top.
    pub values: Vec<f32>,
}

impl VignettingMap {
    /// What every device reads from one buffer: 128 MiB.
    const MOST_VALUES: usize = 1 << 25;
    /// Places in a map are whole numbers of 31 bits on the device.
    const LONGEST_SIDE_PX: u32 = 1 << 15;
    /// Above it, the values are no ratios but those of the camera that took the image.
    const LARGEST: f32 = 100.0;

    pub(crate) fn validate(&self) -> Result<()> {
        let part = Part("vignetting map".into());
        let [width, height] = self.size_px;
        let count = width as usize * height as usize;
        part.require(
            count > 0 && self.values.len() == count,
            format_args!(
                "it has {} values for {width} x {height} pixels",
                self.values.len()
            ),
            "give one value for each pixel",
        )?;
        part.require(
            count <= Self::MOST_VALUES && width.max(height) <= Self::LONGEST_SIDE_PX,
            format_args!("it has {width} x {height} pixels"),
            "give at most 33554432 pixels in all, and 32768 in a row or column: vignetting is smooth",
        )?;
        let is_ratio = |value: &&f32| (0.0..=Self::LARGEST).contains(*value);
        if let Some(place) = self.values.iter().position(|value| !is_ratio(&value)) {
            let (x, y) = (place % width as usize, place / width as usize);
            return part.require(
                false,
                format_args!("pixel ({x}, {y}) is {}", self.values[place]),
                "give values from 0 to 100: divide the image of the flat field by its value on the axis",
            );
        }
        part.require(
            self.values.iter().any(|&value| value > 0.0),
            "all pixels are 0",
            "give the light over that on the axis",
        )
    }

    /// Light at the centre of a pixel, by its column and row in an image of this resolution, over that on the axis.
    pub fn at(&self, pixel: [u32; 2], resolution_px: [u32; 2]) -> f64 {
        let between = |axis: usize| {
            let [count, pixel, pixels] =
                [self.size_px, pixel, resolution_px].map(|of| i64::from(of[axis]));
            // From the centre of the map's first pixel, in parts of its pixel.
            let (place, parts) = ((2 * pixel + 1) * count - pixels, 2 * pixels);
            let before = place.div_euclid(parts);
            let nearest = |index: i64| index.clamp(0, count - 1) as usize;
            let share = place.rem_euclid(parts) as f64 / parts as f64;
            (nearest(before), nearest(before + 1), share)
        };
        let ((left, right, across), (upper, lower, down)) = (between(0), between(1));
        let value = |x: usize, y: usize| f64::from(self.values[y * self.size_px[0] as usize + x]);
        let row = |y: usize| value(left, y) + across * (value(right, y) - value(left, y));
        row(upper) + down * (row(lower) - row(upper))
    }
}
