//! Which of a job's frames a run works on.

use std::str::FromStr;

use super::manifest::WHOLE;
use crate::counted;

/// `--frames 100..200`: without the last one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameRange {
    first: u64,
    end: u64,
}

impl FromStr for FrameRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = text.split_once("..").and_then(|(first, end)| {
            let (first, end) = (first.parse().ok()?, end.parse().ok()?);
            (first < end).then_some(FrameRange { first, end })
        });
        parsed.ok_or_else(|| "give FIRST..END, such as 100..200 for frames 100 to 199".into())
    }
}

/// `--shard 3/16`: counted from 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shard {
    number: u64,
    count: u64,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = text.split_once('/').and_then(|(number, count)| {
            let (number, count) = (number.parse().ok()?, count.parse().ok()?);
            (1..=count)
                .contains(&number)
                .then_some(Shard { number, count })
        });
        parsed.ok_or_else(|| "give I/N with I from 1 to N, such as 3/16".into())
    }
}

/// Frames in the range, of which each `count`-th is the shard's.
#[derive(Clone, Copy, Debug, Default)]
pub struct Selection {
    pub range: Option<FrameRange>,
    pub shard: Option<Shard>,
}

impl Selection {
    /// Of a job of so many frames.
    ///
    /// # Errors
    /// Where the range goes beyond them.
    pub fn frames(&self, count: u64) -> Result<impl Iterator<Item = u64> + use<>, String> {
        let range = self.range.unwrap_or(FrameRange {
            first: 0,
            end: count,
        });
        let FrameRange { first, end } = range;
        if end > count {
            return Err(format!(
                "--frames {first}..{end}: the job has {}; end at {count} at most",
                counted(count, "frame", "frames")
            ));
        }
        let shard = self.shard.unwrap_or(Shard {
            number: 1,
            count: 1,
        });
        Ok((first..end).filter(move |frame| frame % shard.count == shard.number - 1))
    }

    /// Shards have their own, so that each can be written where the others cannot be seen.
    pub fn manifest_name(&self) -> String {
        match self.shard {
            None => WHOLE.into(),
            Some(Shard { number, count }) => format!("manifest-{number}-of-{count}.jsonl"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_the_frames() {
        let mut frames: Vec<u64> = (1..=3)
            .flat_map(|number| {
                let selection = Selection {
                    range: Some("2..11".parse().unwrap()),
                    shard: Some(Shard { number, count: 3 }),
                };
                selection.frames(11).unwrap().collect::<Vec<_>>()
            })
            .collect();
        assert_eq!(frames[..3], [3, 6, 9]);
        frames.sort();
        assert_eq!(frames, (2..11).collect::<Vec<_>>());
        let beyond = Selection {
            range: Some("2..12".parse().unwrap()),
            shard: None,
        };
        let error = beyond.frames(11).map(|_| ()).unwrap_err();
        assert!(error.contains("2..12: the job has 11 frames"), "{error}");
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["", "5", "5..5", "6..5", "a..b", "1..=2"] {
            assert!(text.parse::<FrameRange>().is_err(), "{text}");
        }
        for text in ["", "0/4", "5/4", "1", "1/0", "-1/4"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
