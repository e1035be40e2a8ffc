//! Commands that the pages name exist, with their options.

use std::{fs, process::Command};

use crate::pages::{Page, pages, root};

/// Commands in code spans and blocks of a page, a line each.
fn commands(page: &Page) -> Vec<String> {
    let spans = page.prose().flat_map(|(_, line)| {
        let is_indented = line.starts_with("    ");
        let spans = line.split('`').skip(1).step_by(2);
        spans
            .map(String::from)
            .chain(is_indented.then(|| line.trim().to_owned()))
    });
    let blocks = page
        .blocks()
        .into_iter()
        .filter(|block| block.language == "sh");
    let lines = blocks.flat_map(|block| {
        let joined = block.code.replace("\\\n", " ");
        joined.lines().map(String::from).collect::<Vec<_>>()
    });
    let without_comment = |line: String| match line.split_once(" #") {
        Some((command, _)) => command.to_owned(),
        None => line,
    };
    spans.chain(lines).map(without_comment).collect()
}

/// The arguments of each call of this program in a line. A call may follow variables and other commands.
fn calls<'l>(line: &'l str, program: &str) -> Vec<Vec<&'l str>> {
    let mut calls = Vec::new();
    for part in line.split(['|', ';', '&', '(', ')']) {
        let mut words = part.split_whitespace();
        while let Some(word) = words.next() {
            let name = word.rsplit('/').next().unwrap_or(word);
            if name == program {
                calls.push(words.by_ref().collect());
            } else if !word.contains('=') {
                break;
            }
        }
    }
    calls
}

fn help(command: &str) -> Option<String> {
    let program = env!("CARGO_BIN_EXE_camlux");
    let output = Command::new(program).args([command, "--help"]).output();
    let output = output.expect("the program starts");
    output
        .status
        .success()
        .then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

#[test]
fn commands_of_the_program_exist_with_their_options() {
    let mut problems = Vec::new();
    let mut count = 0;
    for page in pages() {
        for line in commands(&page) {
            for words in calls(&line, "camlux") {
                let Some(&command) = words.first() else {
                    continue;
                };
                if command.starts_with('-') || !command.chars().all(|c| c.is_ascii_lowercase()) {
                    continue;
                }
                count += 1;
                let at = format!("{}: {line}", page.path.display());
                let Some(help) = help(command) else {
                    problems.push(format!("{at}: no command {command}"));
                    continue;
                };
                for option in words.iter().filter(|word| word.starts_with("--")) {
                    let name = option.split('=').next().unwrap_or(option);
                    let name = name.trim_end_matches([',', '.']);
                    let is_known = |line: &str| {
                        let mut known = line.split([' ', ',']);
                        known.any(|word| word == name)
                    };
                    if !help.lines().any(is_known) {
                        problems.push(format!("{at}: no option {name}"));
                    }
                }
            }
        }
    }
    assert!(count > 50, "{count} commands");
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// Looks up tests in the files of `tests/`, and benches in the manifest.
#[test]
fn tests_and_benches_exist() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).expect("the manifest");
    let mut problems = Vec::new();
    let mut count = 0;
    for page in pages() {
        for line in commands(&page) {
            for words in calls(&line, "cargo") {
                let at = format!("{}: {line}", page.path.display());
                let after = |option: &str| {
                    let place = words.iter().position(|word| *word == option)?;
                    words.get(place + 1).copied()
                };
                if let Some(bench) = after("--bench") {
                    count += 1;
                    if !manifest.contains(&format!("[[bench]]\nname = \"{bench}\"")) {
                        problems.push(format!("{at}: no bench {bench}"));
                    }
                }
                let (Some(&"test"), Some(program)) = (words.first(), after("--test")) else {
                    continue;
                };
                count += 1;
                let folder = root().join("tests").join(program);
                if !folder.exists() {
                    problems.push(format!("{at}: no tests {program}"));
                    continue;
                }
                let place = words.iter().position(|word| *word == program).unwrap_or(0);
                let filters = words[place + 1..].iter();
                let filters =
                    filters.take_while(|word| **word != "--nocapture" && **word != "--ignored");
                for filter in filters.filter(|word| !word.starts_with('-')) {
                    if !is_in(&folder, filter) {
                        problems.push(format!("{at}: no test {filter} in tests/{program}"));
                    }
                }
            }
        }
    }
    assert!(count > 20, "{count} commands");
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// Whether a file of the folder has a test whose path contains the filter.
fn is_in(folder: &std::path::Path, filter: &str) -> bool {
    let (module, name) = filter.split_once("::").unwrap_or(("", filter));
    let files = fs::read_dir(folder).expect("a folder of tests").flatten();
    let mut files = files.map(|file| file.path());
    files.any(|path| {
        let stem = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let text = fs::read_to_string(&path).unwrap_or_default();
        let is_module = module.is_empty() || stem.ends_with(module);
        let name = name.rsplit("::").next().unwrap_or(name);
        // Some tests are made by macros, which name them without `fn`.
        let has_test = text.contains(name);
        is_module && (has_test || (module.is_empty() && stem.contains(name)))
    })
}

#[test]
fn scripts_exist() {
    let mut problems = Vec::new();
    for page in pages() {
        for line in commands(&page) {
            let Some(first) = line.split_whitespace().find(|word| !word.contains('=')) else {
                continue;
            };
            let is_script = ["scripts/", "benches/peers/run", "examples/"]
                .iter()
                .any(|start| first.starts_with(start));
            if is_script && !root().join(first).exists() {
                problems.push(format!("{}: {line}", page.path.display()));
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}
