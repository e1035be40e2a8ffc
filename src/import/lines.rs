//! The lines of text files with their numbers, and the statements of OBJ and MTL files. A file is read as a stream.

use std::borrow::Cow;
use std::io::BufRead;
use std::ops::{Deref, RangeInclusive};
use std::path::{Path, PathBuf};

use crate::input_file::{self, Stream};
use crate::{Error, Result};

/// A longer line is no text.
const MOST_BYTES_OF_A_LINE: usize = 1 << 28;

/// Opens a file that another one names.
pub(super) fn open(file: &Path, named_at: &str, what: &str) -> Result<(Stream, u64)> {
    input_file::stream(file).map_err(|error| {
        Error::scene(
            named_at,
            format!("cannot read the {what} {}: {error}", file.display()),
            "correct the path; it is relative to the file that names it",
        )
    })
}

/// Returns the same path for the same file, however it is named.
pub(super) fn resolved(file: &Path) -> PathBuf {
    // A file that cannot be resolved cannot be read either, and reading it gives the better message.
    file.canonicalize().unwrap_or_else(|_| file.to_owned())
}

/// The file that another file in `folder` names. Backslashes separate folders, on every system, and quotes may enclose the whole.
pub(super) fn named_file(folder: &Path, name: &str) -> PathBuf {
    let inner = name.strip_prefix('"').and_then(|n| n.strip_suffix('"'));
    let name = inner.unwrap_or(name).trim();
    let as_written = folder.join(name);
    match name.contains('\\') && !as_written.exists() {
        true => folder.join(name.replace('\\', "/")),
        false => as_written,
    }
}

/// Formats a place, such as `mesh.obj:12`.
pub(super) fn place(file: &Path, line: usize) -> String {
    format!("{}:{line}", file.display())
}

/// The lines of a text file. A line ends with LF, CR LF or CR. The text need not be UTF-8: comments and names are often Latin-1.
pub(super) struct Lines<'f> {
    pub file: &'f Path,
    stream: Stream,
    /// The line that was read last.
    pub number: usize,
    buffer: Vec<u8>,
    is_after_cr: bool,
    /// Whether a line ended with CR alone.
    has_cr: bool,
}

impl<'f> Lines<'f> {
    pub fn new(file: &'f Path, stream: Stream) -> Self {
        Lines {
            file,
            stream,
            number: 0,
            buffer: Vec::new(),
            is_after_cr: false,
            has_cr: false,
        }
    }

    /// The next line.
    pub fn next_line(&mut self) -> Result<Option<Line<'_>>> {
        self.buffer.clear();
        Ok(self.read_line()?.then(|| self.line(self.number)))
    }

    /// Reads the next line; `false` at the end of the file.
    pub fn next_bytes(&mut self) -> Result<bool> {
        self.buffer.clear();
        self.read_line()
    }

    /// The line that was read last.
    pub fn bytes(&self) -> &[u8] {
        &self.buffer
    }

    pub fn clear(&mut self) {
        self.buffer.clear();
    }

    /// The bytes after the last line. LF after CR ends that line, too, unless other lines end with CR alone.
    pub fn into_stream(mut self) -> Stream {
        let is_open = self.is_after_cr && !self.has_cr;
        if is_open && matches!(self.stream.fill_buf(), Ok([b'\n', ..])) {
            self.stream.consume(1);
        }
        self.stream
    }

    /// The next line that is neither empty nor a comment. A backslash at the end of a line continues it.
    pub fn next_statement(&mut self) -> Result<Option<Line<'_>>> {
        let mut first;
        loop {
            self.buffer.clear();
            if !self.read_line()? {
                return Ok(None);
            }
            first = self.number;
            let text = self.buffer.trim_ascii_start();
            // Comments are not continued: otherwise a path at the end of a comment would swallow the next line.
            if text.starts_with(b"#") {
                continue;
            }
            self.continue_line()?;
            if !self.buffer.trim_ascii_start().is_empty() {
                break;
            }
        }
        Ok(Some(self.line(first)))
    }

    fn continue_line(&mut self) -> Result<()> {
        loop {
            let end = self.buffer.trim_ascii_end().len();
            self.buffer.truncate(end);
            if self.buffer.last() != Some(&b'\\') {
                return Ok(());
            }
            self.buffer.pop();
            let end = self.buffer.trim_ascii_end().len();
            self.buffer.truncate(end);
            self.buffer.push(b' ');
            let start = self.buffer.len();
            if !self.read_line()? {
                // A file that ends with a backslash.
                let is_end = |byte: &u8| *byte == b'\\' || byte.is_ascii_whitespace();
                while self.buffer.last().is_some_and(is_end) {
                    self.buffer.pop();
                }
                return Ok(());
            }
            if self.buffer[start..].trim_ascii().is_empty() {
                self.buffer.truncate(start - 1);
                return Ok(());
            }
        }
    }

    /// Appends a line without its end to the buffer; `false` at the end of the file.
    fn read_line(&mut self) -> Result<bool> {
        let start = self.buffer.len();
        let mut is_any = false;
        loop {
            let file = self.file;
            let refuse = |problem: String, hint: &str| {
                Error::scene(place(file, self.number + 1), problem, hint)
            };
            let found = self.stream.fill_buf();
            let found =
                found.map_err(|error| refuse(format!("cannot be read: {error}"), "try again"))?;
            let is_at_end = found.is_empty();
            let mut skipped = 0;
            if std::mem::take(&mut self.is_after_cr) {
                skipped = usize::from(found.first() == Some(&b'\n'));
                self.has_cr |= skipped == 0;
            }
            let found = &found[skipped..];
            let end = memchr::memchr2(b'\n', b'\r', found);
            let part = &found[..end.unwrap_or(found.len())];
            if self.buffer.len() + part.len() > MOST_BYTES_OF_A_LINE {
                return Err(refuse(
                    "the line has more than 256 MiB".into(),
                    "give a text file",
                ));
            }
            self.buffer.extend_from_slice(part);
            is_any |= !part.is_empty();
            if let Some(end) = end {
                self.is_after_cr = found[end] == b'\r';
                self.stream.consume(skipped + end + 1);
                is_any = true;
                break;
            }
            let part = part.len();
            self.stream.consume(skipped + part);
            if is_at_end {
                break;
            }
        }
        self.number += usize::from(is_any);
        if self.number == 1 && self.buffer[start..].starts_with(b"\xef\xbb\xbf") {
            self.buffer.drain(start..start + 3);
        }
        Ok(is_any)
    }

    fn line(&self, number: usize) -> Line<'_> {
        let text = String::from_utf8_lossy(self.buffer.trim_ascii());
        Line::new(self.file, number, text)
    }
}

/// A line: a keyword and its arguments.
pub(super) struct Line<'t> {
    file: &'t Path,
    number: usize,
    text: Cow<'t, str>,
    keyword_bytes: usize,
}

/// A few numbers of a line.
pub(super) struct Numbers {
    values: [f64; Numbers::MOST],
    count: usize,
}

impl Numbers {
    const MOST: usize = 8;
}

impl Deref for Numbers {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.values[..self.count]
    }
}

impl<'t> Line<'t> {
    pub fn new(file: &'t Path, number: usize, text: Cow<'t, str>) -> Self {
        let end = text.find(char::is_whitespace);
        Line {
            file,
            number,
            keyword_bytes: end.unwrap_or(text.len()),
            text,
        }
    }
}

impl Line<'_> {
    pub fn number(&self) -> usize {
        self.number
    }

    pub fn at(&self) -> String {
        place(self.file, self.number)
    }

    pub fn keyword(&self) -> &str {
        &self.text[..self.keyword_bytes]
    }

    /// The text after the keyword.
    pub fn rest(&self) -> &str {
        self.text[self.keyword_bytes..].trim()
    }

    /// The text after the keyword: a name or a path, which may contain spaces.
    pub fn name(&self) -> Result<&str> {
        match self.rest() {
            "" => Err(self.error("names nothing", "write a name after it")),
            name => Ok(name),
        }
    }

    /// The words after the keyword, without a comment at the end.
    pub fn words(&self) -> impl Iterator<Item = &str> {
        words(self.rest())
    }

    /// The numbers after the keyword, which are finite. `counts` limits how many there are.
    pub fn numbers(&self, counts: RangeInclusive<usize>) -> Result<Numbers> {
        let numbers = self.numbers_of_any_kind(counts.clone())?;
        match numbers.iter().any(|number| !number.is_finite()) {
            true => Err(self.no_number(|number| number.is_finite(), counts)),
            false => Ok(numbers),
        }
    }

    /// Like [`Line::numbers`], but some may be infinite or not a number.
    pub fn numbers_of_any_kind(&self, counts: RangeInclusive<usize>) -> Result<Numbers> {
        let mut numbers = Numbers {
            values: [0.0; Numbers::MOST],
            count: 0,
        };
        let mut count = 0;
        for word in self.words() {
            let Some(number) = number(word) else {
                return Err(self.no_number(|_| true, counts));
            };
            if let Some(value) = numbers.values.get_mut(count) {
                *value = number;
            }
            count += 1;
        }
        if !counts.contains(&count) {
            let problem = format!("has {count} numbers");
            return Err(self.error(problem, expected(&counts)));
        }
        numbers.count = count;
        Ok(numbers)
    }

    /// The error for the first word that is no such number.
    fn no_number(&self, is_valid: impl Fn(f64) -> bool, counts: RangeInclusive<usize>) -> Error {
        let is_number = |word: &&str| !number(word).is_some_and(&is_valid);
        let word = self.words().find(is_number).unwrap_or_default();
        let problem = format!("has \"{word}\" instead of a number");
        self.error(problem, expected(&counts))
    }

    pub fn error(&self, problem: impl AsRef<str>, hint: impl Into<String>) -> Error {
        let problem = format!("\"{}\" {}", self.keyword(), problem.as_ref());
        Error::scene(self.at(), problem, hint)
    }
}

fn expected(counts: &RangeInclusive<usize>) -> String {
    let (least, most) = (counts.start(), counts.end());
    format!("write {least} to {most} finite numbers")
}

/// The words of a text up to a comment.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    let mut is_comment = false;
    text.split_whitespace().map_while(move |word| {
        let cut = word.find('#').filter(|_| not_a_number(word).is_none());
        match cut {
            _ if is_comment => None,
            None => Some(word),
            Some(0) => None,
            Some(end) => {
                is_comment = true;
                Some(&word[..end])
            }
        }
    })
}

/// Parses a number, which may be written as by printf.
pub(super) fn number(word: &str) -> Option<f64> {
    word.parse().ok().or_else(|| not_a_number(word))
}

/// What Microsoft's printf writes for values that are not finite: `-1.#IND`, `1.#INF00`, `-nan(ind)`.
fn not_a_number(word: &str) -> Option<f64> {
    let rest = word.strip_prefix(['-', '+']).unwrap_or(word);
    let kind = rest.strip_prefix("1.#").or(rest.strip_suffix("(ind)"))?;
    let is_kind = |name: &&str| {
        let beginning = kind.get(..name.len());
        beginning.is_some_and(|kind| kind.eq_ignore_ascii_case(name))
    };
    let kinds = ["IND", "QNAN", "SNAN", "NAN", "INF"];
    kinds.iter().any(is_kind).then_some(f64::NAN)
}
