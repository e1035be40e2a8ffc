//! Radiation patterns of lamps, from files.

mod angles;
mod eulumdat;
mod ies;
mod types_a_b;

use std::f64::consts::{PI, TAU};
use std::path::Path;

pub(crate) use angles::text as pattern_text;

use super::grey_image::{BANDS_OF_LIGHT, GreyImage};
use super::unused::Unused;
use crate::scene::{Encoding, Pattern};
use crate::{Error, Result, input_file};

/// A pattern, and what its file says beyond it.
pub(super) struct PatternFile {
    pub pattern: Pattern,
    pub unused: Unused,
    /// Why the intensities are only relative to each other.
    pub without_unit: Option<String>,
}

/// Reads a file as [`Pattern::load`] does.
pub(super) fn read(path: &Path, encoding: Encoding, named_at: &str) -> Result<PatternFile> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    if matches!(
        extension.to_str(),
        Some("png" | "jpg" | "jpeg" | "webp" | "exr")
    ) {
        let map = GreyImage::load(path, encoding, None, named_at, BANDS_OF_LIGHT)?;
        let pattern = Pattern::of_map(&map)
            .map_err(|problem| Error::scene(named_at, problem, "give another image"))?;
        let path = path.display();
        return Ok(PatternFile {
            pattern,
            unused: map.unused,
            without_unit: Some(format!("{path} is a map, whose values are only ratios")),
        });
    }
    let parse = match extension.to_str() {
        Some("ies") => ies::parse,
        Some("ldt") => eulumdat::parse,
        Some("json") => angles::parse,
        _ => {
            return Err(Error::scene(
                named_at,
                format!("pattern {} has an unknown format", path.display()),
                "give an IES file (.ies), a EULUMDAT file (.ldt), or a map of all directions (.png, .exr)",
            ));
        }
    };
    let bytes = input_file::read(path).map_err(|error| {
        let problem = format!("cannot read the pattern {}: {error}", path.display());
        Error::scene(named_at, problem, "check the path")
    })?;
    // Makers' names come in any encoding; only the ASCII text matters.
    parse(&String::from_utf8_lossy(&bytes), path)
}

impl Pattern {
    /// Reads an IES (`.ies`) or EULUMDAT (`.ldt`) file, or a map of all directions (`.png`, `.jpg`, `.exr`). `named_at` is the line of the
    /// scene file that names it, or the file itself. Also returns a warning of what the file holds and camlux does not use.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) if the file is missing or is no pattern.
    pub fn load(
        path: &Path,
        encoding: Encoding,
        named_at: &str,
    ) -> Result<(Pattern, Option<String>)> {
        let file = read(path, encoding, named_at)?;
        Ok((file.pattern, file.unused.warning(path)))
    }

    /// Converts an equirectangular map: γ runs from 0 at the upper edge to 180° at the lower, C from 0 at the left to 360° at the right.
    /// The values apply at the pixels' centres; each pole gets the mean of the row next to it.
    fn of_map(map: &GreyImage) -> std::result::Result<Pattern, String> {
        let [columns, rows] = map.size_px.map(|size| size as usize);
        let centres = |count: usize, whole: f64| {
            let at = move |i: usize| whole * (i as f64 + 0.5) / count as f64;
            let inside = (0..count).map(at);
            [0.0]
                .into_iter()
                .chain(inside)
                .chain([whole])
                .collect::<Vec<f64>>()
        };
        let value = |column: usize, row: usize| f64::from(map.values[row * columns + column]);
        let pole = |row: usize| (0..columns).map(|c| value(c, row)).sum::<f64>() / columns as f64;
        let of_column = |column: usize| {
            let inside = (0..rows).map(|row| value(column, row));
            let ends = [pole(0), pole(rows - 1)];
            let all = [ends[0]].into_iter().chain(inside).chain([ends[1]]);
            all.collect::<Vec<f64>>()
        };
        // The seam of the map, between its last column and its first.
        let seam = of_column(0).into_iter().zip(of_column(columns - 1));
        let seam: Vec<f64> = seam.map(|(a, b)| 0.5 * (a + b)).collect();
        let planes = (0..columns).map(of_column);
        let planes = [seam.clone()].into_iter().chain(planes).chain([seam]);
        let values = planes.collect::<Vec<_>>().concat();
        let peak = values.iter().copied().fold(0.0, f64::max);
        let pattern = Pattern {
            gammas_rad: centres(rows, PI),
            planes_rad: centres(columns, TAU),
            intensities: values.into_iter().map(|value| value / peak).collect(),
            peak,
        };
        pattern.check().map(|()| pattern)
    }
}
