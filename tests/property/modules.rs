//! docs/architecture.md gives the order of the library's modules. Each module uses only those before it.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// The names in backticks of the paragraph of `docs/architecture.md` that gives the order.
fn written_order() -> Vec<String> {
    let text = read(&Path::new(ROOT).join("docs/architecture.md"));
    let start = text.find("**Module order.**").expect("the paragraph");
    let paragraph = text[start..].split("\n\n").next().unwrap_or_default();
    let names = paragraph.split('`').skip(1).step_by(2);
    names.map(String::from).collect()
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A file without its comments, and without the tests at its end.
fn code_of(path: &Path) -> String {
    let text = read(path);
    let code = text.split("#[cfg(test)]\nmod tests").next();
    let lines = code.unwrap_or_default().lines();
    lines
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("\n")
}

/// The code of each module under `src`, by name, without the program.
fn modules() -> BTreeMap<String, String> {
    let mut modules = BTreeMap::new();
    let mut open = vec![Path::new(ROOT).join("src")];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).expect("the folder is readable") {
            let path = entry.expect("the folder is readable").path();
            let inner = path.strip_prefix(Path::new(ROOT).join("src"));
            let top = inner.expect("it lies in src").iter().next();
            let module = top.and_then(|top| top.to_str()).expect("an ASCII name");
            let module = module.trim_end_matches(".rs");
            if ["bin", "lib"].contains(&module) || path.ends_with("tests.rs") {
                continue;
            }
            if path.is_dir() {
                open.push(path);
            } else {
                *modules.entry(module.into()).or_insert_with(String::new) += &code_of(&path);
            }
        }
    }
    modules
}

fn identifier(text: &str) -> &str {
    let text = text.trim_start();
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_');
    &text[..end.unwrap_or(text.len())]
}

/// The first names of the paths that follow each `prefix`: of one path, or of every path in braces.
fn names_after<'t>(text: &'t str, prefix: &str) -> BTreeSet<&'t str> {
    let mut names = BTreeSet::new();
    for (at, _) in text.match_indices(prefix) {
        let rest = &text[at + prefix.len()..];
        if !rest.starts_with('{') {
            names.insert(identifier(rest));
            continue;
        }
        let mut depth = 0;
        for (i, c) in rest.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                break;
            }
            if depth == 1 && (c == '{' || c == ',') {
                names.insert(identifier(&rest[i + 1..]));
            }
        }
    }
    names.remove("");
    names
}

#[test]
fn modules_use_those_before_them_alone() {
    let order = written_order();
    let modules = modules();
    let written: BTreeSet<&String> = order.iter().collect();
    assert_eq!(written, modules.keys().collect(), "modules and their order");
    let place = |name: &str| order.iter().position(|module| module == name);

    // Names that the library re-exports at its root belong to a module.
    let root = code_of(&Path::new(ROOT).join("src/lib.rs"));
    let mut homes = BTreeMap::new();
    for module in &order {
        for name in names_after(&root, &format!("pub use {module}::")) {
            homes.insert(name, module.as_str());
        }
    }

    let mut edges = BTreeSet::new();
    for (module, code) in &modules {
        for name in names_after(code, "crate::") {
            let used = homes.get(name).copied().unwrap_or(name);
            if used != module && !["ash", "glam"].contains(&used) {
                edges.insert((module.as_str(), used));
            }
        }
    }
    // These edges check the parser above: names in braces, and names of the root.
    for edge in [("frame", "passes"), ("capi", "frame"), ("plan", "scene")] {
        assert!(edges.contains(&edge), "{edge:?} is not found");
    }
    let backward: Vec<_> = edges
        .iter()
        .filter(|(module, used)| place(used).is_none() || place(used) >= place(module))
        .collect();
    assert!(backward.is_empty(), "(module, what it uses): {backward:?}");
}
