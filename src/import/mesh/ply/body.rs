//! The values of a PLY file, text or binary.

use std::io::{BufRead, Read};
use std::path::Path;

use super::header::{Element, Format, Header, Property, Type};
use crate::import::lines::Lines;
use crate::import::words::Words;
use crate::input_file::Stream;
use crate::{Error, Result};

const HINT: &str = "export it again";

pub(super) struct Body<'f> {
    values: Values<'f>,
    file: &'f Path,
    /// The name of the element that is read, and its index.
    element: String,
    index: u64,
}

enum Values<'f> {
    Text(Words<'f>),
    Binary(Stream, Format),
}

impl<'f> Body<'f> {
    pub fn new(lines: Lines<'f>, header: &Header) -> Self {
        Body {
            file: lines.file,
            values: match header.format {
                Format::Text => Values::Text(Words::new(lines)),
                format => Values::Binary(lines.into_stream(), format),
            },
            element: String::new(),
            index: 0,
        }
    }

    /// Begins an element, in a text on a line of its own.
    pub fn begin(&mut self, element: &Element, index: u64) -> Result<()> {
        if index == 0 {
            self.element.clone_from(&element.name);
        }
        self.end_line()?;
        self.index = index;
        Ok(())
    }

    fn end_line(&mut self) -> Result<()> {
        if let Values::Text(words) = &mut self.values
            && !words.is_at_line_end()
        {
            let problem = format!("there are more values than a {} has", self.element);
            let hint = "correct the properties in the header, or write each element on its line";
            return Err(Error::scene(words.here(), problem, hint));
        }
        Ok(())
    }

    /// The next value.
    pub fn value(&mut self, kind: Type) -> Result<f64> {
        match &mut self.values {
            Values::Text(words) => text_value(words, kind),
            Values::Binary(stream, format) => {
                let mut bytes = [0; 8];
                let bytes = &mut bytes[..kind.bytes()];
                if let Err(error) = stream.read_exact(bytes) {
                    let problem = match error.kind() {
                        std::io::ErrorKind::UnexpectedEof => "the file ends in it".into(),
                        _ => format!("cannot be read: {error}"),
                    };
                    return Err(self.error(&problem));
                }
                if *format == Format::BigEndian {
                    bytes.reverse();
                }
                Ok(binary_value(bytes, kind))
            }
        }
    }

    /// Reads a property: a list into `list`, a number to nowhere.
    pub fn list_or_nothing(&mut self, property: &Property, list: &mut Vec<f64>) -> Result<()> {
        match property.length {
            Some(length) => self.list(length, property.kind, list),
            None => self.value(property.kind).map(|_| ()),
        }
    }

    /// Reads a list.
    pub fn list(&mut self, length: Type, kind: Type, values: &mut Vec<f64>) -> Result<()> {
        values.clear();
        let count = self.value(length)?;
        if !(count >= 0.0 && count.fract() == 0.0) {
            return Err(self.error(&format!("a list has {count} values")));
        }
        for _ in 0..count as u64 {
            let value = self.value(kind)?;
            values.push(value);
        }
        Ok(())
    }

    /// The error for the element that is read.
    pub fn error(&self, problem: &str) -> Error {
        let at = match &self.values {
            Values::Text(words) => words.here(),
            Values::Binary(..) => {
                format!("{}: {} {}", self.file.display(), self.element, self.index)
            }
        };
        Error::scene(at, problem, HINT)
    }

    /// Whether the file has more than its elements.
    pub fn has_more(mut self) -> Result<bool> {
        self.end_line()?;
        match &mut self.values {
            Values::Text(words) => Ok(words.next_word()?.is_some()),
            Values::Binary(stream, _) => Ok(stream.fill_buf().is_ok_and(|rest| !rest.is_empty())),
        }
    }
}

/// The next word as a value of this type.
fn text_value(words: &mut Words, kind: Type) -> Result<f64> {
    let value = words.next_number()?;
    let is_wrong = kind.is_whole() && value.fract() != 0.0;
    match is_wrong {
        true => Err(words.error("instead of a whole number", HINT)),
        // The type of the file, so that a text and a binary file are the same mesh.
        false if kind == Type::F32 => Ok(f64::from(value as f32)),
        false => Ok(value),
    }
}

fn binary_value(bytes: &[u8], kind: Type) -> f64 {
    match (kind, bytes) {
        (Type::I8, &[a]) => (a as i8).into(),
        (Type::U8, &[a]) => a.into(),
        (Type::I16, &[a, b]) => i16::from_le_bytes([a, b]).into(),
        (Type::U16, &[a, b]) => u16::from_le_bytes([a, b]).into(),
        (Type::I32, &[a, b, c, d]) => i32::from_le_bytes([a, b, c, d]).into(),
        (Type::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]).into(),
        (Type::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]).into(),
        (_, bytes) => bytes.try_into().map_or(f64::NAN, f64::from_le_bytes),
    }
}
