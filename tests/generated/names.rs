//! The tables of docs/names.md agree with the C interface, the Python classes and the page of scene files.

use std::{collections::BTreeMap, fs, path::Path};

use crate::layouts::layouts;

fn read(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    fs::read_to_string(path).expect("it is there")
}

/// The words in backticks.
fn names(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// Numbers, words or nothing, whatever language they are written in.
fn value(text: &str) -> Vec<String> {
    let text = text.split(':').next().unwrap_or_default();
    let parts = text.split(|c: char| c == ',' || "{}()[]\"' ".contains(c));
    let parts = parts.filter(|part| !part.is_empty());
    let number = |part: &str| match part.parse::<f64>() {
        Ok(number) => number.to_string(),
        Err(_) => part.to_lowercase(),
    };
    let parts: Vec<String> = parts.map(number).collect();
    // Python's empty tuple.
    if parts.is_empty() {
        vec!["none".into()]
    } else {
        parts
    }
}

/// The modules with the classes of a scene.
pub fn read_python_classes() -> String {
    ["camera", "scene"]
        .map(|module| read(&format!("python/camlux/{module}.py")))
        .concat()
}

/// The attributes of each class of the Python package, with the text of their defaults.
fn python_classes() -> BTreeMap<String, Vec<(String, Option<String>)>> {
    let mut classes = BTreeMap::new();
    let mut class = String::new();
    let mut is_in_text = false;
    for line in read_python_classes().lines() {
        // Docstrings name the attributes, too.
        let quotes = line.matches("\"\"\"").count();
        is_in_text ^= quotes % 2 == 1;
        if is_in_text || quotes > 0 {
            continue;
        }
        if let Some(rest) = line.strip_prefix("class ") {
            let end = rest.find(['(', ':']).unwrap_or(rest.len());
            class = rest[..end].into();
        } else if let Some((name, rest)) = line.trim_start().split_once(": ")
            && line.starts_with("    ")
            && !line.starts_with("     ")
            && name
                .chars()
                .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        {
            let default = rest
                .split_once(" = ")
                .map(|(_, default)| default.to_owned());
            let attributes: &mut Vec<_> = classes.entry(class.clone()).or_default();
            attributes.push((name.to_owned(), default));
        }
    }
    classes
}

#[test]
fn names_and_defaults_are_those_of_the_page() {
    let (page, scene_page) = (read("docs/names.md"), read("docs/scene.md"));
    let (layouts, classes) = (layouts(), python_classes());
    let (mut of_c, mut of_python) = ("", Vec::new());
    let mut count = 0;
    for line in page.lines() {
        if line.starts_with("`camlux_") {
            (of_c, of_python) = (names(line)[0], names(line)[1..].to_vec());
            of_python.pop();
        }
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let [c, begins_with, python, file, default] = cells[..] else {
            continue;
        };
        let (Some(&c), Some(&python)) = (names(c).first(), names(python).first()) else {
            continue;
        };
        count += 1;
        let layout = layouts.iter().find(|layout| layout.name == of_c);
        let layout = layout.unwrap_or_else(|| panic!("no struct {of_c}"));
        let field = layout.fields.iter().find(|field| field.name == c);
        let field = field.unwrap_or_else(|| panic!("{of_c} has no {c}"));
        let first = match (value(&field.first), value(begins_with).len()) {
            // `{0}` stands for all of an array.
            (first, length) if first.len() < length => vec![first[0].clone(); length],
            (first, _) => first,
        };
        assert_eq!(first, value(begins_with), "{of_c}.{c}");

        let attributes = of_python.iter().filter_map(|class| classes.get(*class));
        let mut found = attributes
            .flatten()
            .filter(|(name, _)| name == python)
            .peekable();
        assert!(found.peek().is_some(), "none of {of_python:?} has {python}");
        let due = default.split(" for ").next().unwrap_or_default();
        let is_due = |(_, given): &(String, Option<String>)| match given {
            None => due == "required",
            Some(given) => {
                let given = given.split("  #").next().unwrap_or_default();
                due != "required" && value(given) == value(due)
            }
        };
        assert!(
            found.any(is_due),
            "{of_python:?}.{python} is not {default} by default"
        );

        for key in names(file).into_iter().filter(|key| !key.starts_with('[')) {
            assert!(scene_page.contains(key), "docs/scene.md has no {key}");
        }
    }
    assert!(count > 45, "{count} rows");
}
