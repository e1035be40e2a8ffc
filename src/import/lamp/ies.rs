//! IES LM-63 files of 1986 to 2019. The number after the ballast factor has another meaning in each of their versions.

use std::path::Path;

use super::PatternFile;
use super::types_a_b::{Grid, PolarAxis};
use crate::import::unused::Unused;
use crate::scene::{Measured, Pattern};
use crate::{Error, Result, input_file};

/// Limit, above what any instrument measures.
const MOST_ANGLES: usize = 100_000;

/// Keywords that only describe the lamp or its test.
const DESCRIPTIONS: [&str; 19] = [
    "TEST",
    "TESTLAB",
    "TESTMETHOD",
    "TESTDATE",
    "DATE",
    "ISSUEDATE",
    "MANUFAC",
    "LUMCAT",
    "LUMINAIRE",
    "LAMPCAT",
    "LAMP",
    "BALLAST",
    "BALLASTCAT",
    "DISTRIBUTION",
    "OTHER",
    "MORE",
    "SEARCH",
    "BLOCK",
    "ENDBLOCK",
];
/// Keywords of the standards that say more than a description, and that camlux does not use.
const OTHERS: [&str; 5] = [
    "NEARFIELD",
    "FLASHAREA",
    "COLORCONSTANT",
    "LAMPPOSITION",
    "MAINTCAT",
];

/// What the number after the ballast factor is.
#[derive(Clone, Copy, PartialEq)]
enum AfterBallast {
    /// In 1986 and 1991: the ballast-lamp photometric factor.
    Factor,
    /// In 1995 and 2002: reserved, 1.
    Reserved,
    /// Since 2019: how the file was made.
    GenerationType,
}

/// The meaning of a file's number after the ballast factor, from its first line. Writers differ in blanks and letter case.
fn after_ballast(first_line: &str, unused: &mut Unused) -> AfterBallast {
    let line: String = first_line.split_whitespace().collect();
    let line = line.to_ascii_uppercase();
    if !line.starts_with("IES") {
        return AfterBallast::Factor;
    }
    let Some((_, year)) = line.split_once("LM-63") else {
        return AfterBallast::Factor;
    };
    let year = year.trim_start_matches(|c: char| !c.is_ascii_digit());
    match year.get(..4).unwrap_or(year) {
        "1986" | "86" | "1991" | "91" => AfterBallast::Factor,
        "1995" | "95" | "2002" | "02" => AfterBallast::Reserved,
        "2019" | "19" => AfterBallast::GenerationType,
        _ => {
            let version = first_line.trim();
            unused.add(&format!("the unknown version \"{version}\""));
            AfterBallast::GenerationType
        }
    }
}

/// Keywords in square brackets, above the line TILT=.
fn report_keyword(line: &str, unused: &mut Unused) {
    let Some(keyword) = line.strip_prefix('[') else {
        // Labels of 1986 have no form.
        return;
    };
    let keyword = keyword.split(']').next().unwrap_or_default().trim();
    let upper = keyword.to_ascii_uppercase();
    // An underscore marks keywords of the maker's own.
    if upper.starts_with('_') || DESCRIPTIONS.contains(&upper.as_str()) {
        return;
    }
    if OTHERS.contains(&upper.as_str()) {
        unused.add(&format!("[{upper}]"));
    } else {
        unused.add_unknown(keyword, &[&DESCRIPTIONS[..], &OTHERS].concat());
    }
}

/// The numbers of a file, with their line numbers.
struct Numbers<'t> {
    file: &'t Path,
    words: Box<dyn Iterator<Item = (usize, &'t str)> + 't>,
    line: usize,
}

impl Numbers<'_> {
    fn next(&mut self, what: &str) -> Result<f64> {
        let Some((line, word)) = self.words.next() else {
            return Err(self.error(format!("the file ends before the {what}")));
        };
        self.line = line;
        parsed(word).ok_or_else(|| {
            self.error(format!(
                "found \"{word}\" instead of a number for the {what}"
            ))
        })
    }

    fn count(&mut self, what: &str) -> Result<usize> {
        let number = self.next(what)?;
        if number.fract() != 0.0 || !(1.0..=MOST_ANGLES as f64).contains(&number) {
            return Err(self.error(format!(
                "the {what} is {number}, which camlux does not support"
            )));
        }
        Ok(number as usize)
    }

    fn list(&mut self, count: usize, what: &str) -> Result<Vec<f64>> {
        (0..count).map(|_| self.next(what)).collect()
    }

    /// The factor of TILT=INCLUDE for a lamp that hangs as it was measured, at a tilt of 0.
    fn factor_without_tilt(&mut self, unused: &mut Unused) -> Result<f64> {
        let geometry = self.next("lamp-to-luminaire geometry of TILT=INCLUDE")?;
        if ![1.0, 2.0, 3.0].contains(&geometry) {
            let problem =
                format!("the lamp-to-luminaire geometry is {geometry}, and not 1, 2 or 3");
            return Err(self.error(problem));
        }
        let count = self.count("number of tilt angles")?;
        let angles_deg = self.list(count, "tilt angles")?;
        let factors = self.list(count, "factors of the tilt angles")?;
        let at_0 = angles_deg.iter().position(|&angle| angle == 0.0);
        let Some(at_0) = at_0 else {
            return Err(self.error("TILT=INCLUDE has no factor for a tilt of 0 degrees"));
        };
        let factor = factors[at_0];
        if factors.iter().any(|&other| other != factor) {
            unused.add("the factors of tilted lamps (it takes that of 0 degrees)");
        }
        Ok(factor)
    }

    /// Refuses numbers beyond those that the file states: it would be read wrongly. Other text is only reported.
    fn end(&mut self, unused: &mut Unused) -> Result<()> {
        let Some((line, word)) = self.words.next() else {
            return Ok(());
        };
        self.line = line;
        if parsed(word).is_none() {
            unused.add(&format!("the text after its numbers, from line {line}"));
            return Ok(());
        }
        let more = 1 + self
            .words
            .by_ref()
            .filter(|(_, word)| parsed(word).is_some())
            .count();
        Err(self.error(format!(
            "the file holds {more} more numbers than its counts of angles state"
        )))
    }

    fn error(&self, problem: impl Into<String>) -> Error {
        self.error_with_hint(problem, "correct the file, or take another pattern")
    }

    fn error_with_hint(&self, problem: impl Into<String>, hint: &str) -> Error {
        let at = format!("{}:{}", self.file.display(), self.line);
        Error::scene(at, problem, hint)
    }
}

fn parsed(word: &str) -> Option<f64> {
    let number: Option<f64> = word.parse().ok();
    number.filter(|number| number.is_finite())
}

/// What a line `TILT=...` says, whatever its blanks and letter case.
fn tilt_of(line: &str) -> Option<&str> {
    let (keyword, value) = line.split_once('=')?;
    let is_tilt = keyword.trim().eq_ignore_ascii_case("TILT");
    is_tilt.then(|| value.trim())
}

pub(super) fn parse(text: &str, file: &Path) -> Result<PatternFile> {
    let text = input_file::plain_lines(text);
    // Old systems end a text with this character.
    let text = text.trim_end_matches(|c: char| c == '\u{1a}' || c.is_whitespace());
    let lines = || {
        text.lines()
            .enumerate()
            .map(|(i, line)| (i + 1, line.trim()))
    };
    let mut unused = Unused::default();
    let mut numbers = Numbers {
        file,
        words: Box::new(std::iter::empty()),
        line: 1,
    };
    let Some((tilt_line, tilt)) = lines().find_map(|(i, line)| Some((i, tilt_of(line)?))) else {
        return Err(numbers.error("there is no TILT= line, which every IES file needs"));
    };
    numbers.line = tilt_line;
    let mut head = lines()
        .take(tilt_line - 1)
        .filter(|(_, line)| !line.is_empty());
    let first_line = head.next().map_or("", |(_, line)| line);
    let after_ballast = after_ballast(first_line, &mut unused);
    report_keyword(first_line, &mut unused);
    for (_, line) in head {
        report_keyword(line, &mut unused);
    }
    // Some makers separate numbers by commas.
    let words = lines().skip(tilt_line).flat_map(|(line, text)| {
        let words = text.split(|c: char| c.is_whitespace() || c == ',');
        words
            .filter(|word| !word.is_empty())
            .map(move |word| (line, word))
    });
    numbers.words = Box::new(words);
    let of_tilt = match tilt {
        tilt if tilt.eq_ignore_ascii_case("NONE") => 1.0,
        tilt if tilt.eq_ignore_ascii_case("INCLUDE") => numbers.factor_without_tilt(&mut unused)?,
        other => {
            return Err(numbers.error_with_hint(
                format!("TILT={other} names another file, which camlux does not read"),
                "write TILT=INCLUDE and the lines of that file below it, or TILT=NONE for a lamp that hangs as it was measured",
            ));
        }
    };

    numbers.next("number of lamps")?;
    numbers.next("lumens of a lamp")?;
    let multiplier = numbers.next("multiplier")?;
    let gamma_count = numbers.count("number of vertical angles")?;
    let plane_count = numbers.count("number of horizontal angles")?;
    let kind = numbers.next("photometric type")?;
    let polar_axis = match kind {
        1.0 => None,
        2.0 => Some(PolarAxis::Horizontal),
        3.0 => Some(PolarAxis::Vertical),
        _ => {
            return Err(numbers.error(format!(
                "photometry of type {kind} is not known, only types 1 (C), 2 (B) and 3 (A) are"
            )));
        }
    };
    numbers.next("type of units")?;
    let size = numbers.list(3, "size of the opening")?;
    if size.iter().any(|&length| length != 0.0) {
        unused.add(SIZE);
    }
    let ballast = numbers.next("ballast factor")?;
    let behind = numbers.next("number after the ballast factor")?;
    if after_ballast == AfterBallast::Reserved && behind != 1.0 {
        unused.add(&format!(
            "the number {behind} after the ballast factor, which its version of the standard reserves"
        ));
    }
    let photometric = match after_ballast {
        AfterBallast::Factor => behind,
        AfterBallast::Reserved | AfterBallast::GenerationType => 1.0,
    };
    numbers.next("input power")?;
    let gammas_deg = numbers.list(gamma_count, "vertical angles")?;
    let planes_deg = numbers.list(plane_count, "horizontal angles")?;
    if gamma_count.saturating_mul(plane_count) > MOST_ANGLES * 10 {
        return Err(numbers.error("there are more intensities than any instrument measures"));
    }
    let factor = of_tilt * multiplier * ballast * photometric;
    let candela = numbers.list(gamma_count * plane_count, "candela values")?;
    numbers.end(&mut unused)?;
    let intensities: Vec<f64> = candela.into_iter().map(|value| value * factor).collect();
    let pattern = match polar_axis {
        None => Pattern::of(Measured {
            gammas_deg,
            planes_deg,
            intensities,
        }),
        Some(polar_axis) => Grid::new(polar_axis, gammas_deg, planes_deg, intensities)
            .and_then(|grid| grid.pattern()),
    };
    Ok(PatternFile {
        pattern: pattern.map_err(|problem| numbers.error(problem))?,
        unused,
        without_unit: None,
    })
}

/// What the warning says of a file that gives its lamp a size.
pub(super) const SIZE: &str = "the size of its opening (a lamp with a pattern is a point)";
