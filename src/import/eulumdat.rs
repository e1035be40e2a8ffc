//! EULUMDAT files (`.ldt`).

use std::path::Path;

use crate::scene::{Measured, Pattern};
use crate::{Error, Result};

/// Limits, above what any instrument measures.
const MOST_PLANES: usize = 721;
const MOST_GAMMAS: usize = 721;
/// Line numbers in a file, counted from 1.
const SYMMETRY: usize = 3;
const PLANE_COUNT: usize = 4;
const GAMMA_COUNT: usize = 6;
const CONVERSION: usize = 24;
const LAMP_SETS: usize = 26;
/// Lines per set of lamps.
const LAMP_LINES: usize = 6;
/// Lines of utilisation factors after the lamps.
const FACTOR_LINES: usize = 10;

pub(super) fn parse(text: &str, file: &Path) -> Result<Pattern> {
    let lines: Vec<&str> = text.lines().collect();
    let error = |line: usize, problem: String| {
        let at = format!("{}:{line}", file.display());
        Error::scene(at, problem, "correct the file, or take another pattern")
    };
    let number = |line: usize, what: &str| -> Result<f64> {
        let Some(text) = lines.get(line - 1) else {
            return Err(error(
                lines.len(),
                format!("the file ends before the {what}"),
            ));
        };
        // Some makers write a decimal comma.
        let parsed: Option<f64> = text.trim().replace(',', ".").parse().ok();
        let parsed = parsed.filter(|number| number.is_finite());
        parsed.ok_or_else(|| {
            error(
                line,
                format!(
                    "found \"{}\" instead of a number for the {what}",
                    text.trim()
                ),
            )
        })
    };
    let count = |line: usize, what: &str, most: usize| -> Result<usize> {
        match number(line, what)? {
            n if n.fract() == 0.0 && (1.0..=most as f64).contains(&n) => Ok(n as usize),
            n => Err(error(
                line,
                format!("the {what} is {n}; 1 to {most} are supported"),
            )),
        }
    };
    let symmetry = number(SYMMETRY, "symmetry")?;
    let plane_count = count(PLANE_COUNT, "number of C planes", MOST_PLANES)?;
    let gamma_count = count(GAMMA_COUNT, "number of intensities of a plane", MOST_GAMMAS)?;
    let conversion = number(CONVERSION, "conversion factor")?;
    let lamp_sets = count(LAMP_SETS, "number of lamp sets", 20)?;
    let first = LAMP_SETS + 1 + LAMP_LINES * lamp_sets + FACTOR_LINES;
    let list = |first: usize, count: usize, what: &str| -> Result<Vec<f64>> {
        (first..first + count)
            .map(|line| number(line, what))
            .collect()
    };
    let planes_deg = list(first, plane_count, "angles of the C planes")?;
    let gammas_deg = list(first + plane_count, gamma_count, "angles of gamma")?;
    // The planes that the file contains. Planes that follow from the symmetry are not stored.
    let (from, measured_count) = match symmetry {
        0.0 => (0, plane_count),
        1.0 => (0, 1),
        2.0 => (0, plane_count / 2 + 1),
        3.0 => (0, plane_count / 2 + 1),
        4.0 => (0, plane_count / 4 + 1),
        _ => {
            return Err(error(
                SYMMETRY,
                format!("the symmetry is {symmetry}; 0 to 4 are known"),
            ));
        }
    };
    if symmetry >= 2.0 && plane_count % 4 != 0 {
        let problem = format!(
            "{plane_count} C planes do not fit symmetry {symmetry}, which needs a multiple of 4"
        );
        return Err(error(PLANE_COUNT, problem));
    }
    let at = first + plane_count + gamma_count;
    let values = list(at, measured_count * gamma_count, "intensities")?;
    let intensities = values.into_iter().map(|value| value * conversion).collect();
    let measured = Measured {
        gammas_deg,
        planes_deg: planes_deg[from..from + measured_count].to_vec(),
        intensities,
    };
    let measured = match symmetry {
        3.0 => about_the_plane_90(measured, &planes_deg),
        _ => measured,
    };
    Pattern::of(measured).map_err(|problem| error(first, problem))
}

/// Handles symmetry about the plane C90–C270: the file has the planes from 270 through 0 to 90 degrees.
fn about_the_plane_90(measured: Measured, planes_deg: &[f64]) -> Measured {
    let Measured {
        gammas_deg,
        intensities,
        ..
    } = measured;
    let count = gammas_deg.len();
    let quarter = planes_deg.len() / 4;
    let half: Vec<&[f64]> = intensities.chunks(count).collect();
    // Plane i of the full circle, mirrored if it is behind C90.
    let of_turn = |i: usize| {
        let turn = planes_deg.len();
        let mirrored = if i > quarter && i < 3 * quarter {
            (turn + 2 * quarter - i) % turn
        } else {
            i
        };
        half[(mirrored + quarter) % turn]
    };
    let whole = (0..planes_deg.len()).flat_map(|i| of_turn(i).to_vec());
    Measured {
        intensities: whole.collect(),
        planes_deg: planes_deg.to_vec(),
        gammas_deg,
    }
}
