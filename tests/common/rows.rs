//! Tables of wrong inputs and the words of their errors.

/// Asserts that a message contains all parts.
#[track_caller]
pub fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "{part:?} is missing in: {message}");
    }
}

/// Calls `check(&input, &[words])` for each row `input => words;`. A macro, so that a row stays in its line.
macro_rules! rows {
    ($check:expr; $($input:expr => $($words:expr),+;)*) => {
        $($check(&$input, &[$($words),+]);)*
    };
}
pub(crate) use rows;
