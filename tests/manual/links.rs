//! Links to files, and to headings in them.

use crate::pages::{Page, pages, root};

/// Targets of the links and images of a line.
fn targets(line: &str) -> impl Iterator<Item = &str> {
    let rests = line.match_indices("](").map(|(at, _)| &line[at + 2..]);
    rests.filter_map(|rest| rest.split_once(')').map(|(target, _)| target))
}

fn problem(page: &Page, target: &str, all: &[Page]) -> Option<&'static str> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
    let folder = page.path.parent().expect("a file is in a folder");
    let path = match file {
        "" => root().join(&page.path),
        file => root().join(folder).join(file),
    };
    let Ok(path) = path.canonicalize() else {
        return Some("no such file");
    };
    if anchor.is_empty() {
        return None;
    }
    let is_it = |page: &&Page| {
        root()
            .join(&page.path)
            .canonicalize()
            .is_ok_and(|p| p == path)
    };
    match all.iter().find(is_it) {
        None => Some("an anchor in what is no page"),
        Some(page) if page.anchors().iter().any(|known| known == anchor) => None,
        Some(_) => Some("no such heading"),
    }
}

#[test]
fn links_lead_somewhere() {
    let all = pages();
    assert!(all.len() > 20);
    let mut count = 0;
    let mut problems = Vec::new();
    for page in &all {
        for (number, line) in page.prose() {
            for target in targets(line) {
                count += 1;
                if let Some(problem) = problem(page, target, &all) {
                    problems.push(format!(
                        "{}:{number}: {target}: {problem}",
                        page.path.display()
                    ));
                }
            }
        }
    }
    assert!(count > 200, "{count} links");
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// Checks the pages that the program and the source name.
#[test]
fn pages_that_are_named_exist() {
    let mut problems = Vec::new();
    let mut files = Vec::new();
    for folder in [
        "src",
        "shaders",
        "tests",
        "scripts",
        "examples",
        "include",
        "python/src",
        "python/camlux",
    ] {
        collect(&root().join(folder), &mut files);
    }
    for path in files {
        let Ok(text) = std::fs::read_to_string(&path) else {
            continue;
        };
        for word in text.split(|c: char| !(c.is_alphanumeric() || "/._-".contains(c))) {
            let is_page = word.starts_with("docs/") && word.ends_with(".md");
            if is_page && !root().join(word).exists() {
                problems.push(format!("{}: {word}", path.display()));
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

fn collect(folder: &std::path::Path, into: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        match entry.path() {
            path if path.is_dir() => collect(&path, into),
            path => into.push(path),
        }
    }
}
