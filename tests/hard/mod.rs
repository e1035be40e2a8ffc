//! The cases of `camlux doctor` as tests: one of each name, under the Khronos validation layer.

use camlux::doctor::{Examiner, Group, Part};

use crate::gpu::Gpu;

/// Runs a case of a group and holds it against its bound.
#[track_caller]
pub fn check(group: Group, name: &str) {
    let case = group.cases().iter().find(|case| case.name == name);
    let case = case.expect("the group has a case of this name");
    let gpu = Gpu::open();
    let mut examiner = Examiner::new(&gpu.device).expect("a renderer");
    let measured = case.run(&mut examiner).expect("the scenes render");
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
    assert!(measured.is_met(), "{name}: {unmet:#?}");
}

/// Every case of the group has a test, and those of known issues, and no others, are ignored.
#[track_caller]
pub fn check_list(group: Group, tests: &[(&str, &str)]) {
    let listed: Vec<(&str, bool)> = tests
        .iter()
        .map(|(name, attributes)| (*name, attributes.contains("known issue")))
        .collect();
    let cases = group.cases().iter();
    let expected: Vec<(&str, bool)> = cases
        .map(|case| (case.name, case.known_issue.is_some()))
        .collect();
    assert_eq!(listed, expected);
}

/// A test for each case of a group, in the group's order; `#[ignore = "known issue: …"]` before those that are not met.
#[macro_export]
macro_rules! hard_cases {
    ($group:expr; $($(#[$attribute:meta])* $name:ident,)*) => {
        $(
            #[test]
            $(#[$attribute])*
            fn $name() {
                hard::check($group, stringify!($name));
            }
        )*

        #[test]
        fn every_case_has_its_test() {
            let tests = [$((stringify!($name), stringify!($($attribute)*)),)*];
            hard::check_list($group, &tests);
        }
    };
}
