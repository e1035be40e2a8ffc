//! What a job changes in lights, meshes and materials, frame by frame or step by step.

use std::path::Path;

use camlux::Scene;
use camlux::keys::{Keys, Value};
use camlux::scene::{Bands, Light};

use super::draws::Draws;
use super::job::{index, ordered};
use super::motion::{self, Motion};
use crate::Failure;

/// `[[light]]`
pub struct LightChange {
    index: usize,
    at: String,
    pub motion: Option<Motion>,
    power: Option<Power>,
}

enum Power {
    /// A factor a frame.
    Listed(Vec<f64>),
    /// Evenly between two factors.
    Random(f64, f64),
}

impl LightChange {
    pub fn read(keys: &mut Keys, folder: &Path) -> Result<Self, Failure> {
        let own = ["index", "power_factors", "power_factor_range"];
        keys.only(&[&own[..], &motion::KEYS].concat())?;
        let (index, at) = index(keys)?;
        let power = match keys.take_one(&["power_factors", "power_factor_range"])? {
            None => None,
            Some(("power_factors", factors)) => Some(Power::Listed(numbers(factors)?)),
            Some((_, range)) => {
                let [least, most] = range.numbers()?;
                ordered(keys, [least; 3], [most; 3])?;
                Some(Power::Random(least, most))
            }
        };
        let motion = Motion::read(keys, folder)?;
        Ok(LightChange {
            index,
            at,
            motion,
            power,
        })
    }

    /// How many frames a list gives.
    pub fn listed_count(&self) -> Option<usize> {
        match &self.power {
            Some(Power::Listed(factors)) => Some(factors.len()),
            _ => None,
        }
    }

    pub fn is_random(&self) -> bool {
        matches!(self.power, Some(Power::Random(..)))
    }

    pub fn check(&self, scene: &Scene) -> Result<(), Failure> {
        within(&self.at, "light", self.index, scene.lights.len())
    }

    pub fn apply(&self, scene: &mut Scene, frame: u32, draws: impl Fn(&str) -> Draws) {
        let light = &mut scene.lights[self.index];
        if let Some(motion) = &self.motion {
            let draws = draws(&format!("light {}", self.index));
            *light = motion.pose(frame, draws).light(light);
        }
        match &self.power {
            None => {}
            Some(Power::Listed(factors)) => scale_power(light, factors[frame as usize]),
            Some(Power::Random(least, most)) => {
                let mut draws = draws(&format!("power {}", self.index));
                scale_power(light, draws.between(*least, *most));
            }
        }
    }
}

fn scale_power(light: &mut Light, factor: f64) {
    *light = light.with_emission(light.emission().map(|value| value * factor));
}

/// `[[mesh]]`
pub struct MeshChange {
    pub index: usize,
    at: String,
    pub motion: Motion,
}

impl MeshChange {
    pub fn read(keys: &mut Keys, folder: &Path) -> Result<Self, Failure> {
        keys.only(&[&["index"], &motion::KEYS[..]].concat())?;
        let (index, at) = index(keys)?;
        let motion = Motion::read(keys, folder)?.ok_or_else(|| {
            keys.error(
                "[[mesh]] says nothing of a motion",
                "add poses, keyframes, trajectory or random",
            )
        })?;
        Ok(MeshChange { index, at, motion })
    }

    pub fn check(&self, scene: &Scene) -> Result<(), Failure> {
        within(&self.at, "mesh", self.index, scene.meshes.len())
    }
}

/// `[[material]]`: its k_d drawn for each frame, band by band.
pub struct MaterialChange {
    name: String,
    at: String,
    kd_min: Bands,
    kd_max: Bands,
}

impl MaterialChange {
    pub fn read(keys: &mut Keys) -> Result<Self, Failure> {
        keys.only(&["name", "kd_min", "kd_max"])?;
        let name = keys.need("name", "name = \"white\", as in the scene")?;
        let kd_min = keys.need("kd_min", "kd_min = 0.2")?.bands()?;
        let kd_max = keys.need("kd_max", "kd_max = 0.8")?.bands()?;
        ordered(keys, kd_min, kd_max)?;
        Ok(MaterialChange {
            name: name.text()?.to_owned(),
            at: name.at,
            kd_min,
            kd_max,
        })
    }

    pub fn check(&self, scene: &Scene) -> Result<(), Failure> {
        known_material(&self.at, &self.name, scene)
    }

    pub fn apply(&self, scene: &mut Scene, draws: impl Fn(&str) -> Draws) {
        let mut draws = draws(&format!("kd {}", self.name));
        let kd = [0, 1, 2].map(|band| draws.between(self.kd_min[band], self.kd_max[band]));
        set_kd(scene, &self.name, kd);
    }
}

/// `[[sweep]]`: the whole sequence once for each value.
pub struct Sweep {
    at: String,
    what: Swept,
}

enum Swept {
    Power(usize, Vec<f64>),
    Kd(String, Vec<Bands>),
}

impl Sweep {
    pub fn read(keys: &mut Keys) -> Result<Self, Failure> {
        keys.only(&["light", "power_factors", "material", "kd"])?;
        let at = keys.at.clone();
        let what = match (keys.take("light"), keys.take("material")) {
            (Some(light), None) => {
                let factors = keys.need("power_factors", "power_factors = [0.5, 1.0, 2.0]")?;
                Swept::Power(light.count()? as usize, numbers(factors)?)
            }
            (None, Some(material)) => {
                let list = keys
                    .need("kd", "kd = [0.2, 0.5, [0.8, 0.1, 0.1]]")?
                    .list()?;
                let values = list
                    .iter()
                    .map(Value::bands)
                    .collect::<Result<Vec<_>, _>>()?;
                Swept::Kd(material.text()?.to_owned(), values)
            }
            _ => {
                let hint = "write light = 0 with power_factors, or material = \"white\" with kd";
                return Err(keys
                    .error("[[sweep]] has to name a light or a material", hint)
                    .into());
            }
        };
        let sweep = Sweep { at, what };
        match sweep.step_count() {
            0 => Err(keys
                .error("[[sweep]] has no values", "list one or more")
                .into()),
            _ => Ok(sweep),
        }
    }

    pub fn step_count(&self) -> usize {
        match &self.what {
            Swept::Power(_, factors) => factors.len(),
            Swept::Kd(_, values) => values.len(),
        }
    }

    pub fn check(&self, scene: &Scene) -> Result<(), Failure> {
        match &self.what {
            Swept::Power(light, _) => within(&self.at, "light", *light, scene.lights.len()),
            Swept::Kd(name, _) => known_material(&self.at, name, scene),
        }
    }

    pub fn apply(&self, scene: &mut Scene, step: usize) {
        match &self.what {
            Swept::Power(light, factors) => scale_power(&mut scene.lights[*light], factors[step]),
            Swept::Kd(name, values) => set_kd(scene, name, values[step]),
        }
    }
}

fn set_kd(scene: &mut Scene, name: &str, kd: Bands) {
    let named = scene.materials.iter_mut().filter(|m| m.name == name);
    named.for_each(|material| material.kd = kd);
}

fn numbers(value: Value) -> Result<Vec<f64>, Failure> {
    let list = value.list()?;
    Ok(list.iter().map(Value::number).collect::<Result<_, _>>()?)
}

fn within(at: &str, what: &str, index: usize, count: usize) -> Result<(), Failure> {
    match index < count {
        true => Ok(()),
        false => Err(format!(
            "{at}: there is no {what} {index} in a scene of this job, which has {count}; count from 0 in the order of its file"
        )
        .into()),
    }
}

fn known_material(at: &str, name: &str, scene: &Scene) -> Result<(), Failure> {
    let mut names: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    if names.contains(&name) {
        return Ok(());
    }
    names.sort_unstable();
    names.dedup();
    let hint = camlux::keys::did_you_mean(name, &names);
    Err(format!("{at}: no material \"{name}\" in a scene of this job; {hint}").into())
}
