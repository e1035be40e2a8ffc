//! Lines of OBJ and MTL files with their places, because `tobj` reports none.

use std::borrow::Cow;
use std::path::Path;

use crate::{Error, Result};

/// One statement: a keyword and what follows it.
pub(super) struct Line<'t> {
    file: &'t Path,
    number: usize,
    text: Cow<'t, str>,
}

/// Reads a file that need not be UTF-8: comments and names are often Latin-1.
pub(super) fn read_text(file: &Path, named_at: &str, what: &str) -> Result<String> {
    let bytes = std::fs::read(file).map_err(|error| {
        Error::scene(
            named_at,
            format!("cannot read the {what} {}: {error}", file.display()),
            "correct the path; it is relative to the file that names it",
        )
    })?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The statements of a file. A backslash at the end of a line continues it.
pub(super) fn lines<'t>(text: &'t str, file: &'t Path) -> impl Iterator<Item = Line<'t>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut numbered = text.lines().enumerate();
    let statements = std::iter::from_fn(move || {
        let (index, first) = numbered.next()?;
        let mut text = Cow::Borrowed(first);
        // A comment is not continued: a path at its end would swallow the next line.
        while let Some(begun) = text.trim().strip_suffix('\\')
            && !begun.starts_with('#')
        {
            let (_, next) = numbered.next().unwrap_or_default();
            text = Cow::Owned(format!("{begun} {next}"));
        }
        Some(Line {
            file,
            number: index + 1,
            text,
        })
    });
    statements.filter(|line| !line.keyword().is_empty() && !line.keyword().starts_with('#'))
}

impl Line<'_> {
    pub fn at(&self) -> String {
        format!("{}:{}", self.file.display(), self.number)
    }

    pub fn keyword(&self) -> &str {
        self.text.split_whitespace().next().unwrap_or_default()
    }

    /// What follows the keyword: a name or a path, which may hold spaces.
    pub fn name(&self) -> Result<&str> {
        let name = self.text.trim()[self.keyword().len()..].trim();
        if name.is_empty() {
            return Err(self.error("names nothing", "write a name behind it"));
        }
        Ok(name)
    }

    /// What follows the keyword, word by word, without a comment at the end.
    pub fn words(&self) -> impl Iterator<Item = &str> {
        let statement = self.text.split('#').next().unwrap_or_default();
        statement.split_whitespace().skip(1)
    }

    /// The numbers behind the keyword, as many as `counts` allows.
    pub fn numbers(&self, counts: std::ops::RangeInclusive<usize>) -> Result<Vec<f64>> {
        let expected = || {
            format!(
                "write {} to {} finite numbers",
                counts.start(),
                counts.end()
            )
        };
        let numbers: Vec<f64> = self
            .words()
            .map(|word| match word.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(number),
                _ => Err(self.error(format!("has \"{word}\" for a number"), expected())),
            })
            .collect::<Result<_>>()?;
        if !counts.contains(&numbers.len()) {
            return Err(self.error(format!("has {} numbers", numbers.len()), expected()));
        }
        Ok(numbers)
    }

    pub fn error(&self, problem: impl AsRef<str>, mend: impl Into<String>) -> Error {
        let problem = format!("\"{}\" {}", self.keyword(), problem.as_ref());
        Error::scene(self.at(), problem, mend)
    }
}
