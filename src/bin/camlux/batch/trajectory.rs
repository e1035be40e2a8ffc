//! Trajectory files: `t tx ty tz qx qy qz qw` per row, as in the TUM RGB-D benchmark, or separated by commas.

use std::path::Path;

use camlux::glam::{DQuat, DVec3};
use camlux::input_file;

use super::pose::{Aim, Pose};
use crate::Failure;

const COLUMNS: &str = "t tx ty tz qx qy qz qw";

/// Maximum deviation of a quaternion's length from 1: files have four digits or more.
const LENGTH_TOLERANCE: f64 = 0.01;

/// The poses of a file in the order of its rows. Empty lines are skipped, as is everything after a `#`.
pub fn read(file: &Path, named_at: &str) -> Result<Vec<Pose>, Failure> {
    let name = file.display();
    let bytes = input_file::read(file).map_err(|error| {
        format!("{named_at}: cannot read the trajectory {name}: {error}; correct the path, it is relative to the job file")
    })?;
    let text = String::from_utf8(bytes)
        .map_err(|_| format!("{name}: is not UTF-8 text; write rows of {COLUMNS}"))?;
    let mut poses = Vec::new();
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let row = line.split('#').next().unwrap_or_default().trim();
        let words: Vec<&str> = if row.contains(',') {
            row.split(',').map(str::trim).collect()
        } else {
            row.split_whitespace().collect()
        };
        if words.is_empty() || poses.is_empty() && words.join(" ") == COLUMNS {
            continue;
        }
        let place = |problem| format!("{name}:{}: {problem}; write {COLUMNS}", index + 1);
        poses.push(pose_of(&words).map_err(place)?);
    }
    if poses.is_empty() {
        Err(format!("{name}: holds no pose; write rows of {COLUMNS}").into())
    } else {
        Ok(poses)
    }
}

fn pose_of(words: &[&str]) -> Result<Pose, String> {
    let number = |word: &&str| match word.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!(
            "\"{}\" is not a finite number",
            word.escape_debug()
        )),
    };
    let numbers: Vec<f64> = words.iter().map(number).collect::<Result<_, _>>()?;
    let count = numbers.len();
    let [t, x, y, z, qx, qy, qz, qw] = numbers
        .try_into()
        .map_err(|_| format!("a row has {count} values instead of 8"))?;
    Ok(Pose {
        position_m: DVec3::new(x, y, z),
        aim: Some(Aim::Rotation(unit_quaternion([qx, qy, qz, qw])?)),
        time_s: Some(t),
    })
}

/// A rotation from a quaternion that was written with few digits.
pub fn unit_quaternion(xyzw: [f64; 4]) -> Result<DQuat, String> {
    let quaternion = DQuat::from_array(xyzw);
    let length = quaternion.length();
    if (length - 1.0).abs() <= LENGTH_TOLERANCE {
        Ok(quaternion.normalize())
    } else {
        Err(format!(
            "the quaternion {xyzw:?} has length {length:.4} instead of 1"
        ))
    }
}
