//! The cases of `camlux doctor` as tests: one of each name, under the Khronos validation layer.

use camlux::doctor::{Case, Examiner, Part};

use crate::common::gpu::Gpu;

/// What the tests of cases that are not met have before the case's name.
const KNOWN_ISSUE: &str = "known_issue_";

/// Runs one of some cases and holds it against its bound; one of a known issue must not be met.
#[track_caller]
pub fn check(cases: &[Case], test: &str) {
    let name = test.strip_prefix(KNOWN_ISSUE).unwrap_or(test);
    let case = cases.iter().find(|case| case.name == name);
    let case = case.expect("the group has a case of this name");
    let gpu = Gpu::open();
    let mut examiner = Examiner::new(&gpu.device).expect("a renderer");
    let measured = examiner.examine(case).expect("the scenes render");
    let mut unmet = Vec::new();
    for Part {
        of,
        quantity,
        error,
        bound,
    } in &measured.parts
    {
        let line = format!("{of}, {quantity}: {error:.2e} of {bound:.1e}");
        println!("{line}");
        if error > bound {
            unmet.push(line);
        }
    }
    match case.known_issue {
        None => assert!(measured.is_met(), "{name}: {unmet:#?}"),
        Some(_) => assert!(
            !measured.is_met(),
            "{name} is met: it is no known issue any more"
        ),
    }
}

/// Every case of the group has its test, under its own name or that of a known issue.
#[track_caller]
pub fn check_list(cases: &[Case], tests: &[&str]) {
    let expected: Vec<String> = cases
        .iter()
        .map(|case| match case.known_issue {
            None => case.name.into(),
            Some(_) => format!("{KNOWN_ISSUE}{}", case.name),
        })
        .collect();
    assert_eq!(tests, expected);
}

/// A test for each case of a group, in the group's order; `known_issue_` before the names of those that are not met.
macro_rules! hard_cases {
    ($cases:expr; $($name:ident,)*) => {
        $(
            #[test]
            fn $name() {
                $crate::cases::check($cases, stringify!($name));
            }
        )*

        #[test]
        fn every_case_has_its_test() {
            $crate::cases::check_list($cases, &[$(stringify!($name)),*]);
        }
    };
}
