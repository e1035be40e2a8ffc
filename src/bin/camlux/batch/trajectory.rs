//! Trajectory files: `t tx ty tz qx qy qz qw` per row, as the TUM RGB-D benchmark has them, or with commas between.

use std::path::Path;

use camlux::glam::{DQuat, DVec3};
use camlux::input_file;

use super::pose::{Aim, Pose};
use crate::Failure;

const COLUMNS: [&str; 8] = ["t", "tx", "ty", "tz", "qx", "qy", "qz", "qw"];

/// By as much the length of a quaternion may differ from 1: files have four digits or more.
const LENGTH_TOLERANCE: f64 = 0.01;

/// The poses of a file in the order of its rows. Empty lines and what follows a `#` are comments.
pub fn read(file: &Path, named_at: &str) -> Result<Vec<Pose>, Failure> {
    let bytes = input_file::read(file).map_err(|error| {
        format!(
            "{named_at}: cannot read the trajectory {}: {error}; correct the path, it is relative to the job file",
            file.display()
        )
    })?;
    let text = String::from_utf8(bytes).map_err(|_| {
        format!(
            "{}: is no text; write rows of {}",
            file.display(),
            COLUMNS.join(" ")
        )
    })?;
    let poses = parse(&text, file)?;
    if poses.is_empty() {
        let columns = COLUMNS.join(" ");
        return Err(format!("{}: holds no pose; write rows of {columns}", file.display()).into());
    }
    Ok(poses)
}

fn parse(text: &str, file: &Path) -> Result<Vec<Pose>, String> {
    let mut poses = Vec::new();
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let row = line.split('#').next().unwrap_or_default().trim();
        if row.is_empty() {
            continue;
        }
        let words: Vec<&str> = if row.contains(',') {
            row.split(',').map(str::trim).collect()
        } else {
            row.split_whitespace().collect()
        };
        if poses.is_empty() && words == COLUMNS {
            continue;
        }
        let pose = pose_of(&words).map_err(|problem| {
            let columns = COLUMNS.join(" ");
            format!(
                "{}:{}: {problem}; write {columns}",
                file.display(),
                index + 1
            )
        })?;
        poses.push(pose);
    }
    Ok(poses)
}

fn pose_of(words: &[&str]) -> Result<Pose, String> {
    let numbers: Vec<f64> = words
        .iter()
        .map(|word| match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(format!(
                "\"{}\" is not a finite number",
                word.escape_debug()
            )),
        })
        .collect::<Result<_, _>>()?;
    let count = numbers.len();
    let [t, tx, ty, tz, qx, qy, qz, qw] = <[f64; 8]>::try_from(numbers)
        .map_err(|_| format!("a row has {count} values instead of 8"))?;
    Ok(Pose {
        position_m: DVec3::new(tx, ty, tz),
        aim: Some(Aim::Rotation(unit_quaternion([qx, qy, qz, qw])?)),
        time_s: Some(t),
    })
}

/// A rotation from numbers of a few digits.
pub fn unit_quaternion(xyzw: [f64; 4]) -> Result<DQuat, String> {
    let quaternion = DQuat::from_array(xyzw);
    let length = quaternion.length();
    if (length - 1.0).abs() <= LENGTH_TOLERANCE {
        return Ok(quaternion.normalize());
    }
    Err(format!(
        "the quaternion {xyzw:?} has length {length:.4} instead of 1"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_comments_and_commas() {
        let text = "# made by hand\nt,tx,ty,tz,qx,qy,qz,qw\n\n1.5, 1,2,3, 0,0,0,1 # end\n2 4 5 6 0 0 1 0\r\n";
        let poses = parse(text, "a.csv".as_ref()).unwrap();
        let seen: Vec<_> = poses
            .iter()
            .map(|pose| (pose.time_s, pose.position_m))
            .collect();
        let expected = [
            (Some(1.5), DVec3::new(1.0, 2.0, 3.0)),
            (Some(2.0), DVec3::new(4.0, 5.0, 6.0)),
        ];
        assert_eq!(seen, expected);
        assert_eq!(
            poses[1].aim,
            Some(Aim::Rotation(DQuat::from_xyzw(0.0, 0.0, 1.0, 0.0)))
        );
    }

    #[test]
    fn bad_rows_are_named() {
        for (row, says) in [
            ("1 2 3", "a row has 3 values instead of 8"),
            ("1 2 3 4 5 6 7 8 9", "a row has 9 values"),
            ("1 2 x 4 0 0 0 1", "\"x\" is not a finite number"),
            ("1 2 inf 4 0 0 0 1", "\"inf\" is not"),
            ("1,2,,4,0,0,0,1", "\"\" is not"),
            ("1 2 3 4 0 0 0 0", "has length 0.0000 instead of 1"),
            ("1 2 3 4 0 0 0 1.1", "has length 1.1000"),
        ] {
            let text = format!("# first\n0 0 0 0 0 0 0 1\n{row}\n");
            let error = parse(&text, "a.txt".as_ref()).unwrap_err();
            assert!(
                error.starts_with("a.txt:3: ") && error.contains(says),
                "{error}"
            );
        }
    }
}
