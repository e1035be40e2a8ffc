//! The cases of `camlux doctor` as tests, one test per case, under the Khronos validation layer.

use camlux::hard_cases::{Case, Examiner, Part};

use crate::common::gpu::Gpu;

/// Prefix of a test's name if its case is known to miss its bound.
const KNOWN_ISSUE: &str = "known_issue_";

/// Runs the case of this test and checks that it meets its bound. A case with a known issue must miss it.
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

/// Checks that every case of the group has a test, with the prefix if it has a known issue.
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

/// A test for each case of a group, in the group's order. Cases that miss their bound have the prefix `known_issue_`.
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
