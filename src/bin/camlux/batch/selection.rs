//! Selects the frames of a job that a run works on.

use std::ops::Range;

use crate::counted;

/// `--frames 100..200`: excludes the last one.
pub fn range(text: &str) -> Result<Range<u64>, &'static str> {
    let ends = text.split_once("..");
    let range = ends.and_then(|(first, end)| Some(first.parse().ok()?..end.parse().ok()?));
    let filled = range.filter(|range: &Range<u64>| !range.is_empty());
    filled.ok_or("give FIRST..END, such as 100..200 for frames 100 to 199")
}

/// Share `number` of `count` equal shares, counted from 1.
#[derive(Clone, Copy)]
pub struct Shard {
    pub number: u64,
    pub count: u64,
}

/// `--shard 3/16`
pub fn shard(text: &str) -> Result<Shard, &'static str> {
    let numbers = text.split_once('/');
    let numbers = numbers.and_then(|(number, count)| {
        let (number, count) = (number.parse().ok()?, count.parse().ok()?);
        Some(Shard { number, count })
    });
    let known = numbers.filter(|shard| (1..=shard.count).contains(&shard.number));
    known.ok_or("give I/N with I from 1 to N, such as 3/16")
}

/// The frames of a job of `count` frames that are in the range and belong to the shard.
///
/// # Errors
/// If the range exceeds the number of frames.
pub fn frames(
    range: Option<Range<u64>>,
    shard: Option<Shard>,
    count: u64,
) -> Result<Vec<u64>, String> {
    let range = range.unwrap_or(0..count);
    if range.end > count {
        let frames = counted(count, "frame", "frames");
        return Err(format!(
            "--frames {range:?}: the job has {frames}; end at {count} at most"
        ));
    }
    let is_own = |frame: &u64| shard.is_none_or(|s| frame % s.count == s.number - 1);
    Ok(range.filter(is_own).collect())
}
