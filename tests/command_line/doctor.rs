//! `camlux doctor` on fast cases. `tests/hard` runs all cases.

use std::process::{Command, Output};

fn doctor(arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_camlux"));
    program.arg("doctor").args(arguments);
    program.output().expect("the program starts")
}

fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).expect("the table is text")
}

#[test]
fn a_table_of_the_cases_that_are_asked_for() {
    let output = doctor(&["no_triangle_in_view", "receiver_and_vpl_in_one_plane"]);
    assert!(output.status.success());
    let lines: Vec<&str> = stdout(&output).lines().collect();
    assert_eq!(lines.len(), 3, "{lines:#?}");
    assert!(lines[0].starts_with("case "), "{lines:#?}");
    assert!(lines[1].starts_with("receiver_and_vpl_in_one_plane "));
    assert!(lines[2].starts_with("no_triangle_in_view "));
    assert!(lines[1..].iter().all(|line| line.contains("  ok ")));
}

#[test]
fn a_table_for_the_documentation() {
    let output = doctor(&["--markdown", "no_triangle_in_view"]);
    assert!(output.status.success());
    let text = stdout(&output);
    assert!(text.contains("## Geometry"), "{text}");
    assert!(text.contains("| no triangle in view | lists without entries"));
    assert!(!text.contains("## Lights"), "{text}");
}

#[test]
fn a_picture_of_each_case() {
    let folder = tempfile::tempdir().expect("a folder");
    let pictures = folder.path().join("pictures");
    let path = pictures.to_str().expect("its name is text");
    let output = doctor(&["--pictures", path, "receiver_and_vpl_in_one_plane"]);
    assert!(output.status.success(), "{output:?}");
    let picture = pictures.join("receiver_and_vpl_in_one_plane.png");
    let picture = image::open(picture).expect("it is a picture");
    // Direct, indirect and total radiance side by side.
    assert_eq!((picture.width(), picture.height()), (3 * 192, 192));
}

#[test]
fn what_cannot_be_run_is_said() {
    for (arguments, says) in [
        (
            &["no_such_case"][..],
            "no case and no group of cases has a name with no_such_case",
        ),
        (
            &["--torture", "truths", "no_triangle_in_view"],
            "no case and no group of cases has a name with no_triangle_in_view",
        ),
        (&["--device", "99"], "99"),
    ] {
        let output = doctor(arguments);
        assert_eq!(output.status.code(), Some(1));
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(stderr.contains(says), "{stderr}");
        assert!(output.stdout.is_empty());
    }
}

/// The page has a row for each case. `scripts/hard-cases` writes the rows.
#[test]
fn every_case_is_on_the_page() {
    let page = include_str!("../../docs/hard-cases.md");
    for case in camlux::hard_cases::GROUPS
        .iter()
        .flat_map(|(_, cases)| *cases)
    {
        let row = format!("| {} | {} |", case.name.replace('_', " "), case.hazard);
        assert!(page.contains(&row), "run scripts/hard-cases: {}", case.name);
    }
}
