//! The pages of the manual and their content.

use std::{
    fs,
    path::{Path, PathBuf},
};

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A Markdown file.
pub struct Page {
    /// Relative to the repository's root.
    pub path: PathBuf,
    pub text: String,
}

/// A fenced block of code.
pub struct Block {
    pub language: String,
    /// Whether the fence has the word `run`.
    pub runs: bool,
    pub code: String,
}

/// All pages, in the order of their names.
pub fn pages() -> Vec<Page> {
    let mut paths = Vec::new();
    for folder in ["", "benches", "docs", "examples", "python", "tests/data"] {
        let is_root = folder.is_empty();
        collect(&root().join(folder), !is_root, &mut paths);
    }
    paths.sort();
    let page = |path: PathBuf| Page {
        text: fs::read_to_string(&path).expect("a page is text"),
        path: path
            .strip_prefix(root())
            .expect("of this repository")
            .into(),
    };
    paths.into_iter().map(page).collect()
}

fn collect(folder: &Path, with_subfolders: bool, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        let is_built = path.ends_with("target") || path.ends_with("node_modules");
        if path.is_dir() && with_subfolders && !is_built {
            collect(&path, true, into);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            into.push(path);
        }
    }
}

impl Page {
    /// Each line that is not within a fenced block, with its number.
    pub fn prose(&self) -> impl Iterator<Item = (usize, &str)> {
        let mut is_code = false;
        let lines = self.text.lines().enumerate().filter(move |(_, line)| {
            let is_fence = line.trim_start().starts_with("```");
            is_code ^= is_fence;
            !is_code && !is_fence
        });
        lines.map(|(index, line)| (index + 1, line))
    }

    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        let mut is_open = false;
        for line in self.text.lines() {
            match line.trim_start().strip_prefix("```") {
                Some(_) if is_open => is_open = false,
                Some(words) => {
                    let mut words = words.split_whitespace();
                    blocks.push(Block {
                        language: words.next().unwrap_or_default().into(),
                        runs: words.any(|word| word == "run"),
                        code: String::new(),
                    });
                    is_open = true;
                }
                None if is_open => {
                    let block = blocks.last_mut().expect("an open block");
                    block.code.push_str(line);
                    block.code.push('\n');
                }
                None => {}
            }
        }
        assert!(!is_open, "{}: a block is not closed", self.path.display());
        blocks
    }

    /// The anchors of its headings, as GitHub makes them.
    pub fn anchors(&self) -> Vec<String> {
        let mut anchors: Vec<String> = Vec::new();
        for (_, line) in self.prose() {
            let Some(title) = line.strip_prefix('#') else {
                continue;
            };
            let title = title.trim_start_matches('#').trim().to_lowercase();
            let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
            let anchor: String = title.chars().filter(kept).collect();
            let anchor = anchor.replace(' ', "-");
            let before = anchors.iter().filter(|other| **other == anchor).count();
            anchors.push(match before {
                0 => anchor,
                count => format!("{anchor}-{count}"),
            });
        }
        anchors
    }
}
