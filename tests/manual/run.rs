//! Runs the blocks of shell commands that are marked to run, page by page, in a folder that looks like the repository.

use std::{
    env, fs,
    process::{Command, Stdio},
};

use crate::pages::{pages, root};

/// The parts of the repository that the folder links to.
const LINKED: [&str; 6] = [
    "benches", "docs", "examples", "include", "scenes", "scripts",
];

fn run(page: &str) {
    let pages = pages();
    let page = pages
        .iter()
        .find(|other| other.path.ends_with(page))
        .expect("the page is there");
    let blocks = page.blocks().into_iter();
    let blocks = blocks.filter(|block| block.language == "sh" && block.runs);
    let script: String = blocks.map(|block| block.code).collect();
    assert!(!script.is_empty(), "no block of the page runs");
    let folder = tempfile::tempdir().expect("a folder");
    for name in LINKED {
        #[cfg(unix)]
        std::os::unix::fs::symlink(root().join(name), folder.path().join(name)).expect("a link");
    }
    fs::create_dir(folder.path().join("out")).expect("a folder");
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_camlux"));
    let programs = program.parent().expect("a folder of programs");
    let path = format!(
        "{}:{}",
        programs.display(),
        env::var("PATH").unwrap_or_default()
    );
    let output = Command::new("bash")
        .args(["-euxo", "pipefail", "-c", &script])
        .current_dir(folder.path())
        .env("PATH", path)
        .stdin(Stdio::null())
        .output()
        .expect("bash starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}

macro_rules! pages_that_run {
    ($($name:ident: $path:literal),* $(,)?) => {
        const RUN: &[&str] = &[$($path),*];
        $(#[test]
        fn $name() {
            run($path);
        })*
    };
}

pages_that_run! {
    readme: "README.md",
    first_scene: "docs/guides/first-scene.md",
    estimators: "docs/guides/estimators.md",
    reading_results: "docs/guides/reading-results.md",
    data_sets: "docs/guides/data-sets.md",
    time_of_flight: "docs/guides/time-of-flight.md",
    checking_accuracy: "docs/guides/checking-accuracy.md",
}

#[test]
fn all_pages_with_blocks_that_run_are_run() {
    let with_blocks = pages().into_iter().filter(|page| {
        let mut blocks = page.blocks().into_iter();
        blocks.any(|block| block.runs && block.language == "sh")
    });
    let with_blocks: Vec<String> = with_blocks
        .map(|page| page.path.display().to_string())
        .collect();
    let mut run: Vec<&str> = RUN.to_vec();
    run.sort();
    assert_eq!(with_blocks, run);
}
