//! The lines of OBJ and MTL files with their line numbers, which `tobj` does not report.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use crate::{Error, Result, input_file};

/// One statement: a keyword and its arguments.
pub(super) struct Line<'t> {
    file: &'t Path,
    number: usize,
    text: Cow<'t, str>,
}

/// Reads a text file that need not be UTF-8: comments and names are often Latin-1.
pub(super) fn read_text(file: &Path, named_at: &str, what: &str) -> Result<String> {
    let bytes = input_file::read(file).map_err(|error| {
        Error::scene(
            named_at,
            format!("cannot read the {what} {}: {error}", file.display()),
            "correct the path; it is relative to the file that names it",
        )
    })?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Returns the same path for the same file, however it is named.
pub(super) fn resolved(file: &Path) -> PathBuf {
    // A file that cannot be resolved cannot be read either, and reading it gives the better message.
    file.canonicalize().unwrap_or_else(|_| file.to_owned())
}

/// Formats a place, such as `mesh.obj:12`.
pub(super) fn place(file: &Path, line: usize) -> String {
    format!("{}:{line}", file.display())
}

/// The statements of a file. A backslash at the end of a line continues it.
pub(super) fn lines<'t>(text: &'t str, file: &'t Path) -> impl Iterator<Item = Line<'t>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut numbered = text.lines().enumerate();
    let statements = std::iter::from_fn(move || {
        let (index, first) = numbered.next()?;
        Some(Line {
            file,
            number: index + 1,
            text: continued(first, numbered.by_ref().map(|(_, line)| line)),
        })
    });
    statements.filter(|line| !line.keyword().is_empty() && !line.keyword().starts_with('#'))
}

/// Joins a line with its continuation lines.
fn continued<'t>(first: &'t str, mut rest: impl Iterator<Item = &'t str>) -> Cow<'t, str> {
    let mut text = Cow::Borrowed(first.trim());
    // Comments are not continued: otherwise a path at the end of a comment would swallow the next line.
    while text.ends_with('\\') && !text.starts_with('#') {
        let text = text.to_mut();
        text.pop();
        text.truncate(text.trim_end().len());
        let Some(next) = rest.next() else {
            let end = text.trim_end_matches(|c: char| c == '\\' || c.is_whitespace());
            text.truncate(end.len());
            break;
        };
        if !text.is_empty() && !next.trim().is_empty() {
            text.push(' ');
        }
        text.push_str(next.trim());
    }
    text
}

impl Line<'_> {
    pub fn number(&self) -> usize {
        self.number
    }

    pub fn at(&self) -> String {
        place(self.file, self.number)
    }

    pub fn keyword(&self) -> &str {
        self.text.split_whitespace().next().unwrap_or_default()
    }

    /// The text after the keyword: a name or a path, which may contain spaces.
    pub fn name(&self) -> Result<&str> {
        let name = self.text.trim()[self.keyword().len()..].trim();
        if name.is_empty() {
            return Err(self.error("names nothing", "write a name after it"));
        }
        Ok(name)
    }

    /// The words after the keyword, without a comment at the end.
    pub fn words(&self) -> impl Iterator<Item = &str> {
        let statement = self.text.split('#').next().unwrap_or_default();
        statement.split_whitespace().skip(1)
    }

    /// The numbers after the keyword. `counts` limits how many there are.
    pub fn numbers(&self, counts: std::ops::RangeInclusive<usize>) -> Result<Vec<f64>> {
        let expected = || {
            format!(
                "write {} to {} finite numbers",
                counts.start(),
                counts.end()
            )
        };
        let number = |word: &str| match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.error(format!("has \"{word}\" instead of a number"), expected())),
        };
        let numbers: Vec<f64> = self.words().map(number).collect::<Result<_>>()?;
        if counts.contains(&numbers.len()) {
            Ok(numbers)
        } else {
            Err(self.error(format!("has {} numbers", numbers.len()), expected()))
        }
    }

    pub fn error(&self, problem: impl AsRef<str>, hint: impl Into<String>) -> Error {
        let problem = format!("\"{}\" {}", self.keyword(), problem.as_ref());
        Error::scene(self.at(), problem, hint)
    }
}
