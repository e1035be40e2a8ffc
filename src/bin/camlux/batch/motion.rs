//! How something moves from frame to frame: `poses`, `keyframes`, a `trajectory` or `random`, one of them.

use std::path::Path;

use camlux::glam::DVec3;
use camlux::keys::{Keys, Value};

use super::draws::Draws;
use super::pose::{Aim, Pose};
use super::trajectory::{self, unit_quaternion};
use crate::Failure;

/// The keys that say it.
pub const KEYS: [&str; 4] = ["poses", "keyframes", "trajectory", "random"];

#[derive(Debug)]
pub enum Motion {
    /// One pose a frame.
    Listed(Vec<Pose>),
    /// In rising order of frames; before the first and behind the last nothing moves.
    Keyed(Vec<(u32, Pose)>),
    Random(Placement),
}

/// Anywhere in a box.
#[derive(Debug)]
pub struct Placement {
    min_m: DVec3,
    max_m: DVec3,
    aim: PlacementAim,
}

#[derive(Debug)]
enum PlacementAim {
    Kept,
    /// Any rotation, all as likely.
    Any,
    Fixed(Aim),
}

impl Motion {
    /// Reads what one table says of a motion; `None` where it says nothing.
    pub fn read(keys: &mut Keys, folder: &Path) -> Result<Option<Motion>, Failure> {
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
            _ => Motion::Random(placement(value)?),
        }))
    }

    /// The pose in a frame of a sequence; draws are made for the frame of the whole job.
    pub fn pose(&self, frame: u32, mut draws: Draws) -> Pose {
        match self {
            Motion::Listed(poses) => poses[frame as usize],
            Motion::Keyed(keyframes) => {
                let next = keyframes.partition_point(|&(at, _)| at <= frame);
                match (next.checked_sub(1), keyframes.get(next)) {
                    (Some(before), Some(&(to, pose))) => {
                        let (from, first) = keyframes[before];
                        match frame - from {
                            0 => first,
                            passed => first.between(pose, f64::from(passed) / f64::from(to - from)),
                        }
                    }
                    (Some(last), None) => keyframes[last].1,
                    (None, _) => keyframes[0].1,
                }
            }
            Motion::Random(placement) => Pose {
                position_m: draws.inside(placement.min_m, placement.max_m),
                aim: match placement.aim {
                    PlacementAim::Kept => None,
                    PlacementAim::Any => Some(Aim::Rotation(draws.rotation())),
                    PlacementAim::Fixed(aim) => Some(aim),
                },
                time_s: None,
            },
        }
    }
}

fn listed(value: Value) -> Result<Vec<Pose>, Failure> {
    let at = value.at.clone();
    let poses = value.tables()?.into_iter().map(|mut keys| {
        keys.only(&["position", "rotation", "look_at", "up"])?;
        pose(&mut keys)
    });
    let poses = poses.collect::<Result<Vec<_>, Failure>>()?;
    match poses.is_empty() {
        true => Err(format!("{at}: \"poses\" is empty; list one pose a frame").into()),
        false => Ok(poses),
    }
}

fn keyed(value: Value) -> Result<Vec<(u32, Pose)>, Failure> {
    let at = value.at.clone();
    let mut keyframes: Vec<(u32, Pose)> = Vec::new();
    for mut keys in value.tables()? {
        keys.only(&["frame", "position", "rotation", "look_at", "up"])?;
        let frame = keys.need("frame", "frame = 0")?;
        let number = frame.count()?;
        if keyframes.last().is_some_and(|&(last, _)| last >= number) {
            let problem = format!("is {number}, not behind the keyframe before it");
            return Err(frame.error(problem, "give rising frames").into());
        }
        keyframes.push((number, pose(&mut keys)?));
    }
    match keyframes.is_empty() {
        true => Err(format!("{at}: \"keyframes\" is empty; give two or more").into()),
        false => Ok(keyframes),
    }
}

fn pose(keys: &mut Keys) -> Result<Pose, Failure> {
    Ok(Pose {
        position_m: keys.need("position", "position = [x, y, z]")?.vec3()?,
        aim: aim(keys)?,
        time_s: None,
    })
}

fn aim(keys: &mut Keys) -> Result<Option<Aim>, Failure> {
    let up = keys.take("up");
    match (keys.take_one(&["rotation", "look_at"])?, up) {
        (Some(("look_at", target)), up) => Ok(Some(Aim::LookAt {
            target_m: target.vec3()?,
            up: up.as_ref().map(Value::vec3).transpose()?,
        })),
        (Some((_, rotation)), None) => {
            let quaternion = unit_quaternion(rotation.numbers()?).map_err(|problem| {
                rotation.error(
                    format!("cannot be: {problem}"),
                    "give [x, y, z, w] of length 1",
                )
            })?;
            Ok(Some(Aim::Rotation(quaternion)))
        }
        (Some(_), Some(up)) => Err(up
            .error("stands beside \"rotation\"", "leave it out")
            .into()),
        (None, Some(up)) => Err(up.error("stands without \"look_at\"", "add look_at").into()),
        (None, None) => Ok(None),
    }
}

fn placement(value: Value) -> Result<Placement, Failure> {
    let mut keys = value.table("random")?;
    keys.only(&["min", "max", "turn", "rotation", "look_at", "up"])?;
    let min_m = keys.need("min", "min = [x, y, z]")?.vec3()?;
    let max = keys.need("max", "max = [x, y, z]")?;
    let max_m = max.vec3()?;
    if !min_m.cmple(max_m).all() {
        let problem = format!("is {max_m}, below \"min\" {min_m}");
        return Err(max.error(problem, "give the larger corner").into());
    }
    let turn = keys.take("turn");
    let aim = match (turn, aim(&mut keys)?) {
        (None, None) => PlacementAim::Kept,
        (None, Some(aim)) => PlacementAim::Fixed(aim),
        (Some(turn), None) if turn.text()? == "any" => PlacementAim::Any,
        (Some(turn), None) => {
            return Err(keys.unknown_word(&turn, turn.text()?, &["any"]).into());
        }
        (Some(turn), Some(_)) => {
            let problem = "stands beside a direction that is given";
            return Err(turn.error(problem, "keep one of them").into());
        }
    };
    Ok(Placement { min_m, max_m, aim })
}
