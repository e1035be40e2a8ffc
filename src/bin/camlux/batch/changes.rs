//! What a job changes in camera, lights, meshes and materials, frame by frame or step by step.

use std::path::Path;

use camlux::Scene;
use camlux::keys::{Keys, Value, did_you_mean};

use super::draws::Draws;
use super::light_images::LightImages;
use super::materials::{EVERY, JobTextures, MaterialDraws};
use super::motion::{self, Motion};
use crate::Failure;

/// Hint that shows how to give the index of a light or mesh.
const INDEX: &str = "index = 0, its place in the scene file";

#[derive(Default)]
pub struct Changes {
    pub camera: Option<Motion>,
    /// Each with the index of the light or mesh in the scene file.
    pub lights: Vec<(usize, Motion)>,
    pub meshes: Vec<(usize, Motion)>,
    /// One value per frame.
    pub values: Vec<Change>,
    pub light_images: Vec<LightImages>,
    /// Drawn in each frame.
    pub materials: Vec<MaterialDraws>,
    /// What the materials draw from.
    pub textures: JobTextures,
    /// The whole sequence runs once for each value.
    pub sweeps: Vec<Change>,
    /// What every scene must contain, and the line of the job that names it.
    named: Vec<(String, Named)>,
}

enum Named {
    Light(usize),
    Mesh(usize),
    Material(String),
}

pub enum Change {
    /// Factors of a light's power.
    Power(usize, Values<1>),
    /// k_d of a material, band by band.
    Kd(String, Values<3>),
}

pub enum Values<const N: usize> {
    Listed(Vec<[f64; N]>),
    /// Drawn evenly between two values, each component by itself.
    Random([f64; N], [f64; N]),
}

impl Changes {
    /// Whether frames may differ in the places of meshes, in materials or in textures.
    pub fn moves_surfaces(&self) -> bool {
        let mut changes = self.values.iter().chain(&self.sweeps);
        let is_of_surfaces = |change: &Change| matches!(change, Change::Kd(..));
        !self.meshes.is_empty() || !self.materials.is_empty() || changes.any(is_of_surfaces)
    }

    pub fn read(keys: &mut Keys, folder: &Path) -> Result<Self, Failure> {
        let mut changes = Changes::default();
        if let Some(mut camera) = keys.table("camera")? {
            camera.only(&motion::KEYS)?;
            changes.camera = Motion::read(&mut camera, folder)?;
        }
        for light in keys.tables("light")? {
            changes.read_light(light, folder)?;
        }
        for mut mesh in keys.tables("mesh")? {
            mesh.only(&[&["index"], &motion::KEYS[..]].concat())?;
            let index = changes.index(mesh.need("index", INDEX)?, Named::Mesh)?;
            let motion = Motion::read(&mut mesh, folder)?.ok_or_else(|| {
                let hint = "add poses, keyframes, trajectory or random";
                mesh.error("[[mesh]] has no motion", hint)
            })?;
            changes.meshes.push((index, motion));
        }
        for mut material in keys.tables("material")? {
            let name = material.need(
                "name",
                "name = \"white\", as in the scene; or \"*\" for all",
            )?;
            let name = match name.text()? {
                EVERY => EVERY.to_owned(),
                _ => changes.material(name)?,
            };
            let drawn = MaterialDraws::read(&mut material, name, folder, &mut changes.textures)?;
            changes.materials.push(drawn);
        }
        for sweep in keys.tables("sweep")? {
            changes.read_sweep(sweep)?;
        }
        Ok(changes)
    }

    fn read_light(&mut self, mut keys: Keys, folder: &Path) -> Result<(), Failure> {
        let own = [
            "index",
            "power_factors",
            "power_factor_range",
            "images",
            "encoding",
        ];
        keys.only(&[&own[..], &motion::KEYS].concat())?;
        let index = self.index(keys.need("index", INDEX)?, Named::Light)?;
        let factors = match keys.take_one(&["power_factors", "power_factor_range"])? {
            None => None,
            Some(("power_factors", list)) => {
                let list = list.filled("list one per frame")?;
                Some(Values::Listed(factors_of(list)?))
            }
            Some((_, range)) => {
                let [least, most] = range.numbers()?;
                check_factor(&range, least)?;
                Some(Values::between(&keys, [least], [most])?)
            }
        };
        let power = factors.map(|factors| Change::Power(index, factors));
        self.values.extend(power);
        let images = LightImages::read(&mut keys, index, folder)?;
        self.light_images.extend(images);
        let motion = Motion::read(&mut keys, folder)?;
        self.lights.extend(motion.map(|motion| (index, motion)));
        Ok(())
    }

    fn read_sweep(&mut self, mut keys: Keys) -> Result<(), Failure> {
        keys.only(&["light", "power_factors", "material", "kd"])?;
        let sweep = match (keys.take("light"), keys.take("material")) {
            (Some(light), None) => {
                let factors = keys.need("power_factors", "power_factors = [0.5, 1.0, 2.0]")?;
                let light = self.index(light, Named::Light)?;
                Change::Power(light, Values::Listed(factors_of(factors)?))
            }
            (None, Some(material)) => {
                let kd = keys.need("kd", "kd = [0.2, 0.5, [0.8, 0.1, 0.1]]")?;
                let kd: Result<_, _> = kd.list()?.iter().map(Value::bands).collect();
                Change::Kd(self.material(material)?, Values::Listed(kd?))
            }
            _ => Err(keys.error(
                "[[sweep]] must name either a light or a material",
                "write light = 0 with power_factors, or material = \"white\" with kd",
            ))?,
        };
        if sweep.len() == 0 {
            Err(keys.error("[[sweep]] has no values", "list one or more"))?;
        }
        self.sweeps.push(sweep);
        Ok(())
    }

    /// Records that every scene must contain this index of the scene file.
    fn index(&mut self, value: Value, named: fn(usize) -> Named) -> Result<usize, Failure> {
        let index = value.count()? as usize;
        self.named.push((value.at, named(index)));
        Ok(index)
    }

    fn material(&mut self, value: Value) -> Result<String, Failure> {
        let name = value.text()?.to_owned();
        self.named.push((value.at, Named::Material(name.clone())));
        Ok(name)
    }

    /// Rejects a scene that lacks something the job changes, or in which something else moves it.
    pub fn check(&self, scene: &Scene) -> Result<(), Failure> {
        let is_carried = |&light: &usize| {
            let light = scene.lights.get(light);
            light.is_some_and(|light| light.relative_to.is_some())
        };
        if let Some((light, _)) = self.lights.iter().find(|(light, _)| is_carried(light)) {
            Err(format!(
                "[[light]] {light} of this job has a motion, but its scene moves it with relative_to; remove one of them"
            ))?;
        }
        for images in &self.light_images {
            images.check(scene)?;
        }
        for drawn in &self.materials {
            let mut materials = scene.materials.iter().filter(|m| drawn.is_of(m));
            materials.try_for_each(|material| drawn.check(material))?;
        }
        for (at, named) in &self.named {
            let (what, index, count) = match named {
                Named::Light(index) => ("light", index, scene.lights.len()),
                Named::Mesh(index) => ("mesh", index, scene.meshes.len()),
                Named::Material(name) => {
                    check_material(at, name, scene)?;
                    continue;
                }
            };
            if *index >= count {
                Err(format!(
                    "{at}: there is no {what} {index} in a scene of this job, which has {count}; count from 0 in the order of its file"
                ))?;
            }
        }
        Ok(())
    }

    /// Number of frames in a sequence. Lists give it; without lists, keyframes do. `frames` may use fewer values than a list has.
    pub fn count_frames(&self, keys: &mut Keys) -> Result<u32, Failure> {
        let moved = self.lights.iter().chain(&self.meshes);
        let motions = self.camera.iter().chain(moved.map(|(_, motion)| motion));
        let mut lists: Vec<usize> = self.values.iter().map(Change::len).collect();
        lists.retain(|&length| length > 0);
        let mut is_random = lists.len() < self.values.len() || !self.materials.is_empty();
        lists.extend(self.light_images.iter().map(LightImages::len));
        let mut keyed = None;
        for motion in motions {
            match motion {
                Motion::Listed(poses) => lists.push(poses.len()),
                Motion::Keyed(keyframes) => {
                    let last = keyframes.last().map_or(0, |&(frame, _)| frame);
                    keyed = keyed.max(Some(last.saturating_add(1)));
                }
                Motion::Random { .. } => is_random = true,
            }
        }
        let shortest = lists.iter().copied().min();
        if let Some(requested) = keys.take("frames") {
            let count = requested.count()?;
            return match shortest {
                _ if count == 0 => Err(requested.error("is 0", "give 1 or more"))?,
                Some(length) if (count as usize) > length => {
                    let problem = format!("is {count}, but a list has only {length} frames");
                    Err(requested.error(problem, "give at most that many"))?
                }
                _ => Ok(count),
            };
        }
        match (shortest, lists.iter().copied().max(), keyed) {
            (Some(length), Some(longest), _) if length != longest => {
                let problem = format!("the lists have {length} and {longest} frames");
                Err(keys.error(problem, "give them the same length, or add frames = N"))?
            }
            (Some(length), ..) => Ok(u32::try_from(length)?),
            (None, _, Some(count)) => Ok(count),
            (None, _, None) if is_random => {
                let problem = "the number of random frames is missing";
                Err(keys.error(problem, "add frames = 100"))?
            }
            (None, _, None) => Ok(1),
        }
    }
}

impl Change {
    /// The number of listed values; 0 if they are drawn.
    pub fn len(&self) -> usize {
        match self {
            Change::Power(_, factors) => factors.len(),
            Change::Kd(_, kd) => kd.len(),
        }
    }

    /// Applies the listed value at an index, or a drawn value.
    pub fn apply(&self, scene: &mut Scene, index: usize, draws: impl Fn(&str) -> Draws) {
        match self {
            Change::Power(light, factors) => {
                let [factor] = factors.value(index, draws(&format!("power {light}")));
                let light = &mut scene.lights[*light];
                light.light = light.with_emission(light.emission().map(|value| value * factor));
            }
            Change::Kd(name, values) => {
                let kd = values.value(index, draws(&format!("kd {name}")));
                let named = scene.materials.iter_mut().filter(|m| m.name == *name);
                named.for_each(|material| material.kd = kd);
            }
        }
    }
}

impl<const N: usize> Values<N> {
    fn between(keys: &Keys, least: [f64; N], most: [f64; N]) -> Result<Self, Failure> {
        if (0..N).all(|i| least[i] <= most[i]) {
            Ok(Values::Random(least, most))
        } else {
            Err(keys.error(format!("{least:?} is above {most:?}"), "swap them"))?
        }
    }

    fn len(&self) -> usize {
        match self {
            Values::Listed(values) => values.len(),
            Values::Random(..) => 0,
        }
    }

    fn value(&self, index: usize, mut draws: Draws) -> [f64; N] {
        match self {
            Values::Listed(values) => values[index],
            Values::Random(least, most) => {
                std::array::from_fn(|i| draws.between(least[i], most[i]))
            }
        }
    }
}

fn factors_of(value: Value) -> Result<Vec<[f64; 1]>, Failure> {
    let list = value.list()?;
    let factors = list.iter().map(|value| {
        let factor = value.number()?;
        check_factor(value, factor)?;
        Ok([factor])
    });
    factors.collect()
}

fn check_factor(value: &Value, factor: f64) -> camlux::Result<()> {
    match factor < 0.0 {
        true => Err(value.error(format!("has {factor}"), "give factors of 0 or more")),
        false => Ok(()),
    }
}

fn check_material(at: &str, name: &str, scene: &Scene) -> Result<(), Failure> {
    let mut names: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    if names.contains(&name) {
        return Ok(());
    }
    names.sort_unstable();
    names.dedup();
    let hint = did_you_mean(name, &names);
    Err(format!("{at}: no material \"{name}\" in a scene of this job; {hint}").into())
}
