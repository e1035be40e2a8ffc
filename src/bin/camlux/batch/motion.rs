//! How something moves from frame to frame: exactly one of `poses`, `keyframes`, a `trajectory` or `random`.

use std::path::Path;

use camlux::Result;
use camlux::glam::{DQuat, DVec3};
use camlux::keys::{Keys, Value};

use super::draws::Draws;
use super::pose::{Aim, Pose};
use super::trajectory::{self, unit_quaternion};
use crate::Failure;

/// The keys that give a motion.
pub const KEYS: [&str; 4] = ["poses", "keyframes", "trajectory", "random"];

pub enum Motion {
    /// One pose per frame.
    Listed(Vec<Pose>),
    /// Sorted by frame. Nothing moves before the first keyframe and after the last one.
    Keyed(Vec<(u32, Pose)>),
    /// Anywhere in a box.
    Random {
        min_m: DVec3,
        max_m: DVec3,
        aim: Option<Aim>,
        /// In any rotation, all equally likely.
        turns: bool,
    },
}

impl Motion {
    /// Reads the motion of one table; `None` if the table has none.
    pub fn read(keys: &mut Keys, folder: &Path) -> std::result::Result<Option<Motion>, Failure> {
        let Some((kind, value)) = keys.take_one(&KEYS)? else {
            return Ok(None);
        };
        Ok(Some(match kind {
            "poses" => Motion::Listed(listed(value)?),
            "keyframes" => Motion::Keyed(keyed(value)?),
            "trajectory" => {
                let file = folder.join(value.text()?);
                Motion::Listed(trajectory::read(&file, &value.at)?)
            }
            _ => random(value)?,
        }))
    }

    /// The pose in a frame of a sequence, or `later` after its beginning, as a fraction of the time to the next frame. Random poses are
    /// drawn for the frame's index in the whole job and stay constant within a frame.
    pub fn pose(&self, frame: u32, later: f64, mut draws: Draws) -> Pose {
        let time = f64::from(frame) + later;
        match self {
            Motion::Listed(poses) => {
                let pose = poses[frame as usize];
                match poses.get(frame as usize + 1) {
                    Some(&next) if later > 0.0 => pose.between(next, later),
                    _ => pose,
                }
            }
            Motion::Keyed(keyframes) => {
                let next = keyframes.partition_point(|&(at, _)| f64::from(at) <= time);
                let (from, pose) = keyframes[next.saturating_sub(1)];
                match keyframes.get(next) {
                    Some(&(to, next)) if time > f64::from(from) => {
                        pose.between(next, (time - f64::from(from)) / f64::from(to - from))
                    }
                    _ => pose,
                }
            }
            &Motion::Random {
                min_m,
                max_m,
                aim,
                turns,
            } => Pose {
                position_m: draws.inside(min_m, max_m),
                aim: aim.or_else(|| turns.then(|| Aim::Rotation(draws.rotation()))),
                time_s: None,
            },
        }
    }
}

fn listed(value: Value) -> Result<Vec<Pose>> {
    let tables = value.filled("list one pose per frame")?.tables()?;
    let poses = tables.into_iter().map(|mut keys| {
        keys.only(&["position", "rotation", "look_at", "up"])?;
        pose(&mut keys)
    });
    poses.collect()
}

fn keyed(value: Value) -> Result<Vec<(u32, Pose)>> {
    let mut keyframes: Vec<(u32, Pose)> = Vec::new();
    for mut keys in value.filled("give two or more")?.tables()? {
        keys.only(&["frame", "position", "rotation", "look_at", "up"])?;
        let frame = keys.need("frame", "frame = 0")?;
        let number = frame.count()?;
        if keyframes.last().is_some_and(|&(last, _)| last >= number) {
            let problem = format!("is {number}, not after the previous keyframe");
            return Err(frame.error(problem, "give increasing frames"));
        }
        keyframes.push((number, pose(&mut keys)?));
    }
    Ok(keyframes)
}

fn pose(keys: &mut Keys) -> Result<Pose> {
    Ok(Pose {
        position_m: keys.need("position", "position = [x, y, z]")?.vec3()?,
        aim: aim(keys)?,
        time_s: None,
    })
}

fn aim(keys: &mut Keys) -> Result<Option<Aim>> {
    match keys.take_one(&["rotation", "look_at"])? {
        Some(("look_at", target)) => Ok(Some(Aim::LookAt {
            target_m: target.vec3()?,
            up: keys.optional("up", Value::vec3)?,
        })),
        Some((_, value)) => {
            keys.refuse("up", "is not allowed beside \"rotation\"", "leave it out")?;
            Ok(Some(Aim::Rotation(rotation(&value)?)))
        }
        None => {
            keys.refuse("up", "needs \"look_at\"", "add look_at")?;
            Ok(None)
        }
    }
}

/// A quaternion.
pub fn rotation(value: &Value) -> Result<DQuat> {
    unit_quaternion(value.numbers()?).map_err(|problem| {
        let problem = format!("is not a rotation: {problem}");
        value.error(problem, "give [x, y, z, w] of length 1")
    })
}

fn random(value: Value) -> Result<Motion> {
    let mut keys = value.table("random")?;
    keys.only(&["min", "max", "turn", "rotation", "look_at", "up"])?;
    let min_m = keys.need("min", "min = [x, y, z]")?.vec3()?;
    let max = keys.need("max", "max = [x, y, z]")?;
    let max_m = max.vec3()?;
    if !min_m.cmple(max_m).all() {
        let problem = format!("is {max_m}, below \"min\" {min_m}");
        return Err(max.error(problem, "give the larger corner"));
    }
    let aim = aim(&mut keys)?;
    if aim.is_some() {
        let problem = "is not allowed beside \"rotation\" or \"look_at\"";
        keys.refuse("turn", problem, "keep one of them")?;
    }
    let turn = keys.optional("turn", |turn| turn.choice(&["any"], |word| word))?;
    Ok(Motion::Random {
        min_m,
        max_m,
        aim,
        turns: turn.is_some(),
    })
}
