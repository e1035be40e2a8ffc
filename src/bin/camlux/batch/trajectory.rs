//! Trajectory files: a pose per row, as in the TUM RGB-D benchmark, or with the columns that a line of their names gives. Also the images of
//! COLMAP and of transforms.json.

use std::path::Path;

use camlux::glam::{DAffine3, DQuat, DVec3};
use camlux::{image_poses, input_file};

use super::pose::{Aim, Pose};
use crate::{Failure, warn};

/// The columns of a file without a line of names.
const COLUMNS: &str = "t tx ty tz qx qy qz qw";

/// Maximum deviation of a quaternion's length from 1: files have four digits or more.
const LENGTH_TOLERANCE: f64 = 0.01;

/// A column of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Column {
    /// Seconds per unit of the file.
    Time(f64),
    /// Along x, y or z; metres per unit of the file.
    Position(usize, f64),
    /// Component of the quaternion: x, y, z, w.
    Rotation(usize),
    /// Another quantity.
    Other,
}

/// The columns with a meaning, in the order of [`COLUMNS`].
fn usual_columns() -> Vec<Column> {
    let position = (0..3).map(|axis| Column::Position(axis, 1.0));
    let rotation = (0..4).map(Column::Rotation);
    [Column::Time(1.0)]
        .into_iter()
        .chain(position)
        .chain(rotation)
        .collect()
}

fn is_same(a: Column, b: Column) -> bool {
    match (a, b) {
        (Column::Time(_), Column::Time(_)) => true,
        (Column::Position(a, _), Column::Position(b, _)) => a == b,
        _ => a == b && a != Column::Other,
    }
}

/// The poses of a file in the order of its rows. Empty lines are skipped, as is everything after a `#`.
pub fn read(file: &Path, named_at: &str) -> Result<Vec<Pose>, Failure> {
    let name = file.display();
    if let Some(images) = image_poses(file, named_at)? {
        if !images.is_of_one_camera {
            warn(format_args!(
                "{name}: its images are of several cameras, and all frames have the lens of the scene"
            ));
        }
        if let Some(warning) = &images.warning {
            warn(warning);
        }
        let pose = |to_world: &DAffine3| Pose {
            position_m: to_world.translation,
            aim: Some(Aim::Rotation(DQuat::from_mat3(&to_world.matrix3))),
            time_s: None,
        };
        let poses: Vec<Pose> = images.to_world.iter().map(pose).collect();
        return match poses.is_empty() {
            true => Err(format!("{name}: holds no image; give another file").into()),
            false => Ok(poses),
        };
    }
    let bytes = input_file::read(file).map_err(|error| {
        format!("{named_at}: cannot read the trajectory {name}: {error}; correct the path, it is relative to the job file")
    })?;
    let text = String::from_utf8(bytes)
        .map_err(|_| format!("{name}: is not UTF-8 text; write rows of {COLUMNS}"))?;
    let mut poses = Vec::new();
    let mut columns = usual_columns();
    let mut names = COLUMNS.to_owned();
    let mut ignored = None;
    for (index, line) in input_file::plain_lines(&text).lines().enumerate() {
        let place = |problem| format!("{name}:{}: {problem}; write {names}", index + 1);
        let (row, comment) = line.split_once('#').unwrap_or((line, ""));
        let mut words = words_of(row);
        // The line of names may be a comment.
        let is_comment = words.is_empty();
        if is_comment {
            words = words_of(comment);
        }
        if words.is_empty() {
            continue;
        }
        if poses.is_empty() {
            match named_columns(&words, is_comment) {
                Ok(Some(named)) => {
                    ignored = ignored_columns(&words, &named);
                    columns = named;
                    names = words.join(" ");
                    continue;
                }
                Ok(None) => {}
                Err(problem) => return Err(place(problem).into()),
            }
        }
        if !is_comment {
            let pose = pose_of(&words, &columns);
            poses.push(pose.map_err(place)?);
        }
    }
    if let Some(ignored) = ignored {
        warn(format_args!("{name}: camlux ignores the columns {ignored}"));
    }
    if poses.is_empty() {
        Err(format!("{name}: holds no pose; write rows of {names}").into())
    } else {
        Ok(poses)
    }
}

/// The words of a line, separated by commas, semicolons, tabs or blanks.
fn words_of(row: &str) -> Vec<&str> {
    let row = row.trim();
    for separator in [',', ';', '\t'] {
        if row.contains(separator) {
            return row.split(separator).map(str::trim).collect();
        }
    }
    // A unit in brackets belongs to the name before it, even after a blank.
    let (mut words, mut start, mut depth) = (Vec::new(), None, 0);
    for (at, c) in row.char_indices() {
        match c {
            '[' | '(' => depth += 1,
            ']' | ')' => depth -= 1,
            _ => {}
        }
        let next = row[at..].trim_start().chars().next();
        if c.is_whitespace() && depth <= 0 && !matches!(next, Some('[' | '(')) {
            words.extend(start.take().map(|start| &row[start..at]));
        } else if start.is_none() && !c.is_whitespace() {
            start = Some(at);
        }
    }
    words.extend(start.map(|start| &row[start..]));
    words
}

/// The columns that a line names; `None` if it is not a line of names.
fn named_columns(words: &[&str], is_comment: bool) -> Result<Option<Vec<Column>>, String> {
    let columns: Vec<Column> = words.iter().map(|word| column_of(word)).collect();
    let named = columns.iter().filter(|column| **column != Column::Other);
    let is_number = |word: &&str| word.parse::<f64>().is_ok();
    // A comment may be any text, also with a word that could be a name.
    let least = if is_comment { 4 } else { 1 };
    if named.count() < least || words.iter().any(is_number) {
        return Ok(None);
    }
    for (i, &column) in columns.iter().enumerate() {
        if columns[..i].iter().any(|&other| is_same(other, column)) {
            let word = words[i].escape_debug();
            return Err(format!("the column \"{word}\" is there twice"));
        }
    }
    for (due, name) in usual_columns().into_iter().zip(COLUMNS.split(' ')) {
        let is_there = columns.iter().any(|&column| is_same(column, due));
        // The times are only recorded.
        if !is_there && !matches!(due, Column::Time(_)) {
            return Err(format!("no column is {name}"));
        }
    }
    Ok(Some(columns))
}

/// The names of the columns without a meaning.
fn ignored_columns(words: &[&str], columns: &[Column]) -> Option<String> {
    let pairs = words.iter().zip(columns);
    let others = pairs.filter(|(_, column)| **column == Column::Other);
    let names: Vec<&str> = others.map(|(word, _)| *word).collect();
    (!names.is_empty()).then(|| names.join(", "))
}

/// Names of the time.
const TIMES: [&str; 5] = ["t", "time", "timestamp", "stamp", "seconds"];

/// The column of a name, as TUM, EuRoC and ROS call it: `qx`, `q_x`, `q_RS_w []`, `p_RS_R_x [m]`, `timestamp [ns]`, `pose.position.x`.
fn column_of(name: &str) -> Column {
    let name = name.trim().trim_matches('"').to_ascii_lowercase();
    let (name, unit) = name.split_at(name.find(['[', '(']).unwrap_or(name.len()));
    let unit = unit.trim_matches(|c: char| "[]() ".contains(c));
    let parts = name.split(['_', '.', '-', ' ']);
    let parts: Vec<&str> = parts.filter(|part| !part.is_empty()).collect();
    let Some((&last, before)) = parts.split_last() else {
        return Column::Other;
    };
    let (before, axis) = match axis_of(last) {
        Some(axis) => (before.to_vec(), Some(axis)),
        // "qx", "tx", "px".
        None => {
            let at = last.len().saturating_sub(1);
            let end = last.get(at..).and_then(axis_of);
            (vec![last.get(..at).unwrap_or_default()], end)
        }
    };
    let is_any = |kinds: &[&str]| before.iter().any(|part| kinds.contains(part));
    if let Some(axis) = axis {
        let is_rotation = is_any(&["q", "quat", "quaternion", "rot", "rotation", "orientation"]);
        let is_position = is_any(&["t", "p", "pos", "position", "trans", "translation"]);
        let metres = match unit {
            "" | "m" | "metres" | "meters" => Some(1.0),
            "cm" => Some(1e-2),
            "mm" => Some(1e-3),
            _ => None,
        };
        return match (axis, metres) {
            _ if is_rotation => Column::Rotation(axis),
            (3, _) if before.is_empty() => Column::Rotation(axis),
            (0..=2, Some(metres)) if is_position || before.is_empty() => {
                Column::Position(axis, metres)
            }
            _ => Column::Other,
        };
    }
    let Some(at) = parts.iter().position(|part| TIMES.contains(part)) else {
        return Column::Other;
    };
    match parts.get(at + 1).copied().unwrap_or(unit) {
        "" | "s" | "sec" | "secs" | "seconds" => Column::Time(1.0),
        "ms" => Column::Time(1e-3),
        "us" | "µs" => Column::Time(1e-6),
        "ns" | "nsec" | "nsecs" => Column::Time(1e-9),
        _ => Column::Other,
    }
}

/// The component that a letter names.
fn axis_of(letter: &str) -> Option<usize> {
    ["x", "y", "z", "w"].iter().position(|axis| *axis == letter)
}

fn pose_of(words: &[&str], columns: &[Column]) -> Result<Pose, String> {
    let number = |(i, word): (usize, &&str)| match word.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ if columns.get(i) == Some(&Column::Other) => Ok(0.0),
        _ => Err(format!(
            "\"{}\" is not a finite number",
            word.escape_debug()
        )),
    };
    let numbers: Vec<f64> = words
        .iter()
        .enumerate()
        .map(number)
        .collect::<Result<_, _>>()?;
    let (count, due) = (numbers.len(), columns.len());
    if count != due {
        return Err(format!("a row has {count} values instead of {due}"));
    }
    let (mut position_m, mut xyzw, mut time_s) = (DVec3::ZERO, [0.0; 4], None);
    for (&column, value) in columns.iter().zip(numbers) {
        match column {
            Column::Time(seconds) => time_s = Some(value * seconds),
            Column::Position(axis, metres) => position_m[axis] = value * metres,
            Column::Rotation(axis) => xyzw[axis] = value,
            Column::Other => {}
        }
    }
    Ok(Pose {
        position_m,
        aim: Some(Aim::Rotation(unit_quaternion(xyzw)?)),
        time_s,
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
