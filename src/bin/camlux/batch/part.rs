//! Which of a job's frames a run works on.

use std::str::FromStr;

/// `--frames 100..200`: without the last one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    first: u64,
    end: u64,
}

impl FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = text.split_once("..").and_then(|(first, end)| {
            let (first, end) = (first.parse().ok()?, end.parse().ok()?);
            (first < end).then_some(Range { first, end })
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
pub struct Part {
    pub range: Option<Range>,
    pub shard: Option<Shard>,
}

impl Part {
    pub fn frames(&self, count: u64) -> impl Iterator<Item = u64> {
        let range = self.range.unwrap_or(Range {
            first: 0,
            end: count,
        });
        let shard = self.shard.unwrap_or(Shard {
            number: 1,
            count: 1,
        });
        let frames = range.first..range.end.min(count);
        frames.filter(move |frame| frame % shard.count == shard.number - 1)
    }

    /// Shards have their own, so that each can be written where the others cannot be seen.
    pub fn manifest_name(&self) -> String {
        match self.shard {
            None => "manifest.jsonl".into(),
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
                let part = Part {
                    range: Some("2..30".parse().unwrap()),
                    shard: Some(Shard { number, count: 3 }),
                };
                part.frames(11).collect::<Vec<_>>()
            })
            .collect();
        assert_eq!(frames[..3], [3, 6, 9]);
        frames.sort();
        assert_eq!(frames, (2..11).collect::<Vec<_>>());
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["", "5", "5..5", "6..5", "a..b", "1..=2"] {
            assert!(text.parse::<Range>().is_err(), "{text}");
        }
        for text in ["", "0/4", "5/4", "1", "1/0", "-1/4"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
