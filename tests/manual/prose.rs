//! The manual is in plain English: phrases that it must not contain, each with a plain replacement.

use crate::pages::pages;

const PHRASES: [(&str, &str); 9] = [
    ("asked for", "requested"),
    ("anew", "again"),
    ("goes by", "uses"),
    ("the host's word", "the host guarantees it"),
    ("in as many", "the same number of"),
    ("nothing of it", "none of it"),
    ("has to see to", "must ensure"),
    ("which it takes for", "as"),
    ("what is there of", "name it"),
];

#[test]
fn phrases_that_one_reads_twice_are_gone() {
    let mut problems = Vec::new();
    for page in pages() {
        for (number, line) in page.prose() {
            let line = line.to_lowercase();
            for (phrase, better) in PHRASES {
                if line.contains(phrase) {
                    problems.push(format!(
                        "{}:{number}: \"{phrase}\": {better}",
                        page.path.display()
                    ));
                }
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}
