//! Files of keys and values as trees that know their lines: YAML, of which JSON is a part, and the XML of OpenCV.

use std::borrow::Cow;

use saphyr_parser::{Event, Parser};

use super::{Fault, Read};
use crate::import::unused::shown;

/// Deeper files are no calibrations.
const MOST_LEVELS: usize = 32;

/// A value.
pub(super) struct Node<'t> {
    /// Its key; empty for elements of a list.
    pub key: Cow<'t, str>,
    line: usize,
    content: Content<'t>,
}

enum Content<'t> {
    Text(Cow<'t, str>),
    List(Vec<Node<'t>>),
    Map(Vec<Node<'t>>),
}

impl<'t> Node<'t> {
    /// The tree of a text in YAML or JSON, and in OpenCV's dialect of YAML, whose first line is no YAML.
    pub fn of_yaml(text: &'t str) -> Read<Node<'t>> {
        let (head, rest) = match text.starts_with("%YAML:") {
            true => text.split_at(text.find('\n').unwrap_or(text.len())),
            false => ("", text),
        };
        let lines_before = usize::from(!head.is_empty());
        let rest = rest.strip_prefix('\n').unwrap_or(rest);
        let mut parser = Parser::new_from_str(rest);
        let mut open: Vec<Open> = Vec::new();
        while let Some(event) = parser.next_event() {
            let (event, span) = event.map_err(|error| {
                let problem = format!("not valid YAML: {}", printable(error.info()));
                Fault::new(problem, "correct this line")
                    .on_line(error.marker().line() + lines_before)
            })?;
            let line = span.start.line() + lines_before;
            let done = match event {
                Event::Scalar(text, ..) => Node {
                    key: Cow::Borrowed(""),
                    line,
                    content: Content::Text(text),
                },
                Event::SequenceStart(..) | Event::MappingStart(..) => {
                    if open.len() == MOST_LEVELS {
                        return Err(too_deep(line));
                    }
                    let key = match open.last_mut() {
                        Some(outer) => outer.key_of_next(line)?,
                        None => Cow::Borrowed(""),
                    };
                    let is_map = matches!(event, Event::MappingStart(..));
                    open.push(Open {
                        key,
                        line,
                        is_map,
                        next_key: None,
                        items: Vec::new(),
                    });
                    continue;
                }
                Event::SequenceEnd | Event::MappingEnd => match open.pop() {
                    Some(closed) => closed.into_node()?,
                    None => continue,
                },
                Event::Alias(_) => {
                    let hint = "write the value in its place";
                    return Err(Fault::new("an alias (*) stands for a value", hint).on_line(line));
                }
                // Further documents are not read.
                Event::DocumentEnd => break,
                _ => continue,
            };
            match open.last_mut() {
                Some(outer) => outer.add(done)?,
                None => return Ok(done),
            }
        }
        Err(Fault::new("holds nothing", "give a calibration").on_line(1))
    }

    /// The tree of a text in OpenCV's XML.
    pub fn of_xml(text: &str) -> Read<Node<'_>> {
        let document = roxmltree::Document::parse(text).map_err(|error| {
            let problem = format!("not valid XML: {}", printable(&error.to_string()));
            Fault::new(problem, "correct this line").on_line(error.pos().row as usize)
        })?;
        let mut lines = Lines {
            text,
            offset: 0,
            line: 1,
        };
        let root = of_element(document.root_element(), &mut lines, 0)?;
        if root.key != "opencv_storage" {
            let problem = format!("the root is <{}>", shown(&root.key));
            return Err(root.fault(
                problem,
                "give a file of OpenCV, whose root is <opencv_storage>",
            ));
        }
        Ok(root)
    }

    /// The value of a key; `None` without it.
    pub fn get(&self, key: &str) -> Option<&Node<'t>> {
        self.entries().iter().find(|entry| entry.key == key)
    }

    /// The value of a required key.
    pub fn need(&self, key: &str) -> Read<&Node<'t>> {
        let missing = || self.fault(format!("there is no \"{key}\""), format!("add {key}"));
        self.get(key).ok_or_else(missing)
    }

    /// The values of a table, each with its key; none for other values.
    pub fn entries(&self) -> &[Node<'t>] {
        match &self.content {
            Content::Map(entries) => entries,
            Content::Text(_) | Content::List(_) => &[],
        }
    }

    /// The elements of a list.
    pub fn list(&self) -> Read<&[Node<'t>]> {
        match &self.content {
            Content::List(items) => Ok(items),
            _ => Err(self.error("is no list", "give a list")),
        }
    }

    pub fn text(&self) -> Read<&str> {
        match &self.content {
            Content::Text(text) => Ok(text),
            _ => Err(self.error("is no text", "give a text")),
        }
    }

    /// Whether it is a single word or number.
    pub fn is_word(&self) -> bool {
        match &self.content {
            Content::Text(text) => text.split_whitespace().nth(1).is_none(),
            Content::List(_) | Content::Map(_) => false,
        }
    }

    /// A finite number.
    pub fn number(&self) -> Read<f64> {
        match self.numbers()?[..] {
            [number] => Ok(number),
            ref several => {
                let problem = format!("has {} numbers", several.len());
                Err(self.error(problem, "give one number"))
            }
        }
    }

    /// A whole number of pixels.
    pub fn pixels(&self) -> Read<u32> {
        let number = self.number()?;
        if number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number) {
            return Ok(number as u32);
        }
        Err(self.error(format!("is {number}"), "give a whole number of pixels"))
    }

    /// Numbers of a known count. `due` says which.
    pub fn exactly<const N: usize>(&self, due: &str) -> Read<[f64; N]> {
        let numbers = self.numbers()?;
        let count = numbers.len();
        numbers
            .try_into()
            .map_err(|_| self.error(format!("has {count} numbers"), format!("give {due}")))
    }

    /// The numbers of a list, of a list of rows, of a matrix of OpenCV, or of a text.
    pub fn numbers(&self) -> Read<Vec<f64>> {
        if let Some(data) = self.get("data") {
            let numbers = data.numbers()?;
            if let (Some(rows), Some(columns)) = (self.get("rows"), self.get("cols")) {
                let due = u64::from(rows.pixels()?) * u64::from(columns.pixels()?);
                if due != numbers.len() as u64 {
                    let problem = format!("has {} numbers instead of {due}", numbers.len());
                    return Err(self.error(problem, "correct rows, cols or data"));
                }
            }
            return Ok(numbers);
        }
        let mut numbers = Vec::new();
        self.add_numbers(self, &mut numbers)?;
        Ok(numbers)
    }

    /// `of`: what errors name.
    fn add_numbers(&self, of: &Node, numbers: &mut Vec<f64>) -> Read<()> {
        match &self.content {
            Content::Text(text) => {
                for word in text.split_whitespace() {
                    let number = word.parse().ok().filter(|number: &f64| number.is_finite());
                    numbers.push(number.ok_or_else(|| {
                        let problem = format!("holds \"{}\"", shown(word));
                        Fault {
                            line: Some(self.line),
                            ..of.error(problem, "give finite numbers")
                        }
                    })?);
                }
                Ok(())
            }
            Content::List(items) => items
                .iter()
                .try_for_each(|item| item.add_numbers(of, numbers)),
            Content::Map(_) => Err(of.error("is a table", "give numbers")),
        }
    }

    /// The error of a value, which it names by its key.
    pub fn error(&self, problem: impl AsRef<str>, hint: impl Into<String>) -> Fault {
        self.fault(
            format!("\"{}\" {}", shown(&self.key), problem.as_ref()),
            hint,
        )
    }

    fn fault(&self, problem: impl Into<String>, hint: impl Into<String>) -> Fault {
        Fault::new(problem, hint).on_line(self.line)
    }
}

/// The message of a parser, which may quote the file.
fn printable(message: &str) -> String {
    const MOST_CHARACTERS: usize = 200;
    let characters = message.chars().take(MOST_CHARACTERS);
    characters
        .map(|c| if c.is_control() { '?' } else { c })
        .collect()
}

fn too_deep(line: usize) -> Fault {
    let problem = format!("more than {MOST_LEVELS} levels of lists and tables");
    Fault::new(problem, "give a calibration").on_line(line)
}

/// A list or table that is being read.
struct Open<'t> {
    key: Cow<'t, str>,
    line: usize,
    is_map: bool,
    next_key: Option<Cow<'t, str>>,
    items: Vec<Node<'t>>,
}

impl<'t> Open<'t> {
    fn key_of_next(&mut self, line: usize) -> Read<Cow<'t, str>> {
        match (self.is_map, self.next_key.take()) {
            (true, None) => {
                let problem = "a key is no text";
                Err(Fault::new(problem, "give a text as key").on_line(line))
            }
            (_, key) => Ok(key.unwrap_or_default()),
        }
    }

    fn add(&mut self, mut item: Node<'t>) -> Read<()> {
        match item.content {
            Content::Text(key) if self.is_map && self.next_key.is_none() => {
                self.next_key = Some(key);
                return Ok(());
            }
            // They have theirs from `key_of_next`.
            Content::List(_) | Content::Map(_) => {}
            Content::Text(_) => item.key = self.next_key.take().unwrap_or_default(),
        }
        self.items.push(item);
        Ok(())
    }

    fn into_node(self) -> Read<Node<'t>> {
        let content = match self.is_map {
            true => Content::Map(without_repeats(self.items)?),
            false => Content::List(self.items),
        };
        Ok(Node {
            key: self.key,
            line: self.line,
            content,
        })
    }
}

fn without_repeats<'t>(entries: Vec<Node<'t>>) -> Read<Vec<Node<'t>>> {
    let mut keys = std::collections::HashSet::new();
    match entries.iter().find(|entry| !keys.insert(&entry.key)) {
        Some(again) => Err(again.error("is there twice", "remove one of them")),
        None => Ok(entries),
    }
}

/// The line of places in a text that come one after the other.
struct Lines<'t> {
    text: &'t str,
    offset: usize,
    line: usize,
}

impl Lines<'_> {
    fn line_of(&mut self, offset: usize) -> usize {
        let passed = self.text.as_bytes().get(self.offset..offset);
        let breaks = memchr::memchr_iter(b'\n', passed.unwrap_or_default());
        self.line += breaks.count();
        self.offset = self.offset.max(offset);
        self.line
    }
}

fn of_element(element: roxmltree::Node, lines: &mut Lines, level: usize) -> Read<Node<'static>> {
    let line = lines.line_of(element.range().start);
    if level == MOST_LEVELS {
        return Err(too_deep(line));
    }
    let children: Vec<Node> = element
        .children()
        .filter(roxmltree::Node::is_element)
        .map(|child| of_element(child, lines, level + 1))
        .collect::<Read<_>>()?;
    // OpenCV calls elements of lists "_".
    let content = if children.is_empty() {
        Content::Text(element.text().unwrap_or_default().to_owned().into())
    } else if children.iter().all(|child| child.key == "_") {
        Content::List(children)
    } else {
        Content::Map(without_repeats(children)?)
    };
    Ok(Node {
        key: element.tag_name().name().to_owned().into(),
        line,
        content,
    })
}
