//! The words of a text file whose lines have no keywords.

use super::lines::{Lines, number, place};
use crate::{Error, Result};

/// The words of a text file, with the lines that they are on.
pub(super) struct Words<'f> {
    pub lines: Lines<'f>,
    /// Where the next word may begin in the line.
    at: usize,
}

impl<'f> Words<'f> {
    /// The words after the lines that were read.
    pub fn new(mut lines: Lines<'f>) -> Self {
        lines.clear();
        Words { lines, at: 0 }
    }

    /// The next word.
    pub fn next_word(&mut self) -> Result<Option<&[u8]>> {
        while self.is_at_line_end() {
            self.at = 0;
            if !self.lines.next_bytes()? {
                return Ok(None);
            }
        }
        let start = self.at;
        let line = self.lines.bytes();
        let end = line[start..].iter().position(u8::is_ascii_whitespace);
        self.at = end.map_or(line.len(), |end| start + end);
        Ok(Some(&self.lines.bytes()[start..self.at]))
    }

    /// The next word as a number, which may be infinite or not a number.
    pub fn next_number(&mut self) -> Result<f64> {
        match self.next_word()? {
            Some(word) => {
                let found = str::from_utf8(word).ok().and_then(number);
                found.ok_or_else(|| self.error("instead of a number", "export the file again"))
            }
            None => Err(self.at_end()),
        }
    }

    /// Skips blanks. Whether no word follows on the line.
    pub fn is_at_line_end(&mut self) -> bool {
        let rest = &self.lines.bytes()[self.at..];
        let blanks = rest.iter().position(|byte| !byte.is_ascii_whitespace());
        self.at += blanks.unwrap_or(rest.len());
        self.at == self.lines.bytes().len()
    }

    /// Skips what is left of the line.
    pub fn skip_line(&mut self) {
        self.at = self.lines.bytes().len();
    }

    /// The word before, as it can be shown.
    pub fn last_word(&self) -> String {
        let line = self.lines.bytes()[..self.at].trim_ascii_end();
        let start = line.iter().rposition(u8::is_ascii_whitespace);
        String::from_utf8_lossy(&line[start.map_or(0, |start| start + 1)..]).into_owned()
    }

    /// The error for the word before.
    pub fn error(&self, problem: &str, hint: &str) -> Error {
        let problem = format!("\"{}\" {problem}", self.last_word());
        Error::scene(self.here(), problem, hint)
    }

    /// The error where the file ends too early.
    pub fn at_end(&self) -> Error {
        let problem = "the file ends in the middle of its mesh";
        Error::scene(self.here(), problem, "export it again")
    }

    pub fn here(&self) -> String {
        place(self.lines.file, self.lines.number)
    }
}
