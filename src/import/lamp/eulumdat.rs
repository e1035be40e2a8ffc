//! EULUMDAT files (`.ldt`).

use std::path::Path;

use super::PatternFile;
use super::ies::SIZE;
use crate::import::unused::Unused;
use crate::scene::{Measured, Pattern};
use crate::{Error, Result, input_file};

/// Limits, above what any instrument measures.
const MOST_PLANES: usize = 721;
const MOST_GAMMAS: usize = 721;
/// Line numbers in a file, counted from 1.
const SYMMETRY: usize = 3;
const PLANE_COUNT: usize = 4;
const GAMMA_COUNT: usize = 6;
/// Length and width of the luminous area; its heights follow.
const AREA: std::ops::RangeInclusive<usize> = 16..=17;
const CONVERSION: usize = 24;
const TILT: usize = 25;
const LAMP_SETS: usize = 26;
/// In the lines of a set of lamps: the flux of all its lamps, lm.
const FLUX: usize = LAMP_SETS + 3;
/// Lines per set of lamps.
const LAMP_LINES: usize = 6;
/// Lines of utilisation factors after the lamps.
const FACTOR_LINES: usize = 10;

/// The lines of a file.
struct Lines<'t> {
    file: &'t Path,
    lines: Vec<&'t str>,
}

/// Some makers write a decimal comma.
fn parsed(text: &str) -> Option<f64> {
    let parsed: Option<f64> = text.trim().replace(',', ".").parse().ok();
    parsed.filter(|number| number.is_finite())
}

impl Lines<'_> {
    fn error(&self, line: usize, problem: String) -> Error {
        let at = format!("{}:{line}", self.file.display());
        Error::scene(at, problem, "correct the file, or take another pattern")
    }

    fn number(&self, line: usize, what: &str) -> Result<f64> {
        let Some(text) = self.lines.get(line - 1) else {
            let problem = format!("the file ends before the {what}");
            return Err(self.error(self.lines.len(), problem));
        };
        parsed(text).ok_or_else(|| {
            let text = text.trim();
            let problem = format!("found \"{text}\" instead of a number for the {what}");
            self.error(line, problem)
        })
    }

    fn count(&self, line: usize, what: &str, most: usize) -> Result<usize> {
        match self.number(line, what)? {
            n if n.fract() == 0.0 && (1.0..=most as f64).contains(&n) => Ok(n as usize),
            n => Err(self.error(
                line,
                format!("the {what} is {n}; 1 to {most} are supported"),
            )),
        }
    }

    fn list(&self, first: usize, count: usize, what: &str) -> Result<Vec<f64>> {
        (first..first + count)
            .map(|line| self.number(line, what))
            .collect()
    }

    /// A number that the pattern does not need. `None` if it is missing.
    fn extra(&self, line: usize) -> Option<f64> {
        parsed(self.lines.get(line - 1)?)
    }
}

pub(super) fn parse(text: &str, file: &Path) -> Result<PatternFile> {
    let text = input_file::plain_lines(text);
    // Old systems end a text with this character.
    let text = text.trim_end_matches(|c: char| c == '\u{1a}' || c.is_whitespace());
    let lines = Lines {
        file,
        lines: text.lines().collect(),
    };
    let mut unused = Unused::default();
    let symmetry = lines.number(SYMMETRY, "symmetry")?;
    let plane_count = lines.count(PLANE_COUNT, "number of C planes", MOST_PLANES)?;
    let gamma_count = lines.count(GAMMA_COUNT, "number of intensities of a plane", MOST_GAMMAS)?;
    let conversion = lines.number(CONVERSION, "conversion factor")?;
    let lamp_sets = lines.count(LAMP_SETS, "number of lamp sets", 20)?;
    let first = LAMP_SETS + 1 + LAMP_LINES * lamp_sets + FACTOR_LINES;
    let planes_deg = lines.list(first, plane_count, "angles of the C planes")?;
    let gammas_deg = lines.list(first + plane_count, gamma_count, "angles of gamma")?;
    // Planes that follow from the symmetry are not stored.
    let (multiple, stored) = match symmetry {
        0.0 => (1, 0..plane_count),
        1.0 => (1, 0..1),
        2.0 => (2, 0..plane_count / 2 + 1),
        // From 270 degrees over 0 to 90.
        3.0 => (4, 3 * plane_count / 4..plane_count + plane_count / 4 + 1),
        4.0 => (4, 0..plane_count / 4 + 1),
        _ => {
            let problem = format!("the symmetry is {symmetry}; 0 to 4 are known");
            return Err(lines.error(SYMMETRY, problem));
        }
    };
    if plane_count % multiple != 0 {
        let problem = format!(
            "{plane_count} C planes do not fit symmetry {symmetry}, which needs a multiple of {multiple}"
        );
        return Err(lines.error(PLANE_COUNT, problem));
    }
    let measured_count = stored.len();
    let at = first + plane_count + gamma_count;
    let values = lines.list(at, measured_count * gamma_count, "intensities")?;
    let end = at + values.len();
    let behind = lines.lines.iter().enumerate().skip(end - 1);
    let mut behind = behind.filter(|(_, line)| !line.trim().is_empty());
    if let Some((index, line)) = behind.next() {
        if parsed(line).is_some() {
            let more = 1 + behind.filter(|(_, line)| parsed(line).is_some()).count();
            let problem = format!(
                "the file holds {more} more numbers than its symmetry and its counts of angles state"
            );
            return Err(lines.error(index + 1, problem));
        }
        unused.add(&format!(
            "the text after its numbers, from line {}",
            index + 1
        ));
    }
    if AREA
        .filter_map(|line| lines.extra(line))
        .any(|mm| mm != 0.0)
    {
        unused.add(SIZE);
    }
    if let Some(tilt_deg) = lines.extra(TILT).filter(|&tilt| tilt != 0.0) {
        unused.add(&format!(
            "its tilt of {tilt_deg} degrees during the measurement"
        ));
    }
    if lamp_sets > 1 {
        unused.add("its other sets of lamps (the flux of the first set applies)");
    }
    // The values are cd per 1000 lm of the lamps. A negative number of lamps makes the flux that of the whole luminaire, and leaves the unit.
    let flux_lm = lines.extra(FLUX).filter(|&flux| flux > 0.0);
    let scale = conversion * flux_lm.map_or(1.0, |flux| flux / 1000.0);
    let measured = Measured {
        gammas_deg,
        planes_deg: stored
            .map(|i| match (symmetry, i) {
                (3.0, i) if i >= plane_count => planes_deg[i - plane_count] + 360.0,
                _ => planes_deg[i],
            })
            .collect(),
        intensities: values.into_iter().map(|value| value * scale).collect(),
    };
    Ok(PatternFile {
        pattern: Pattern::of(measured).map_err(|problem| lines.error(first, problem))?,
        unused,
        without_unit: flux_lm.is_none().then(|| {
            let found = lines.lines[FLUX - 1].trim();
            format!(
                "{}:{FLUX}: the flux of the lamps is \"{found}\", so the intensities, which are per 1000 lm, have no unit",
                file.display()
            )
        }),
    })
}
