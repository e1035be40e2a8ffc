//! IES LM-63 files from 1986 to 2019: type C photometry, without tilt.

use std::path::Path;

use crate::scene::{Measured, Pattern};
use crate::{Error, Result};

/// Limit, above what any instrument measures.
const MOST_ANGLES: usize = 100_000;

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
        let number: Option<f64> = word.parse().ok();
        let number = number.filter(|number| number.is_finite());
        number.ok_or_else(|| {
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

    fn error(&self, problem: impl Into<String>) -> Error {
        let at = format!("{}:{}", self.file.display(), self.line);
        Error::scene(at, problem, "correct the file, or take another pattern")
    }
}

pub(super) fn parse(text: &str, file: &Path) -> Result<Pattern> {
    let lines = || {
        text.lines()
            .enumerate()
            .map(|(i, line)| (i + 1, line.trim()))
    };
    let is_tilt = |line: &str| {
        line.get(..5)
            .is_some_and(|word| word.eq_ignore_ascii_case("TILT="))
    };
    let tilt = lines().find(|(_, line)| is_tilt(line));
    let mut numbers = Numbers {
        file,
        words: Box::new(std::iter::empty()),
        line: 1,
    };
    let Some((tilt_line, tilt)) = tilt else {
        return Err(numbers.error("there is no TILT= line, which every IES file needs"));
    };
    numbers.line = tilt_line;
    if !tilt[5..].trim().eq_ignore_ascii_case("NONE") {
        return Err(numbers.error(format!("{tilt} is not supported, only TILT=NONE is")));
    }
    // Some makers separate numbers by commas.
    let words = lines().skip(tilt_line).flat_map(|(line, text)| {
        let words = text.split(|c: char| c.is_whitespace() || c == ',');
        words
            .filter(|word| !word.is_empty())
            .map(move |word| (line, word))
    });
    numbers.words = Box::new(words);

    numbers.next("number of lamps")?;
    numbers.next("lumens of a lamp")?;
    let multiplier = numbers.next("multiplier")?;
    let gamma_count = numbers.count("number of vertical angles")?;
    let plane_count = numbers.count("number of horizontal angles")?;
    let kind = numbers.next("photometric type")?;
    if kind != 1.0 {
        return Err(numbers.error(format!(
            "photometry of type {kind} is not supported, only type 1 (C) is"
        )));
    }
    numbers.list(4, "unit and size of the opening")?;
    let ballast = numbers.next("ballast factor")?;
    // Until 1991 this was the ballast's photometric factor; since then it has another meaning.
    let behind = numbers.next("factor after the ballast factor")?;
    let is_new = text.trim_start().starts_with("IESNA:LM-63");
    let photometric = if is_new { 1.0 } else { behind };
    numbers.next("input power")?;
    let gammas_deg = numbers.list(gamma_count, "vertical angles")?;
    let planes_deg = numbers.list(plane_count, "horizontal angles")?;
    if gamma_count.saturating_mul(plane_count) > MOST_ANGLES * 10 {
        return Err(numbers.error("there are more intensities than any instrument measures"));
    }
    let factor = multiplier * ballast * photometric;
    let candela = numbers.list(gamma_count * plane_count, "candela values")?;
    let intensities = candela.into_iter().map(|value| value * factor).collect();
    let measured = Measured {
        gammas_deg,
        planes_deg,
        intensities,
    };
    Pattern::of(measured).map_err(|problem| numbers.error(problem))
}
