//! What a job draws for a material in each frame.

use std::ops::Range;
use std::path::Path;

use camlux::keys::{Keys, Value};
use camlux::scene::{Bands, Material, Shared, Texture, TextureLookup};

use super::draws::Draws;
use crate::Failure;

/// Name that stands for all materials of a scene.
pub const EVERY: &str = "*";
/// The keys besides the name.
const KEYS: [&str; 8] = [
    "kd_min",
    "kd_max",
    "ks_min",
    "ks_max",
    "shininess_min",
    "shininess_max",
    "grey",
    "textures",
];
const REFLECTANCES: &str = "give reflectances from 0 to 1";

/// The textures that a job draws from, and the hash of their files.
#[derive(Default)]
pub struct JobTextures {
    pub textures: Vec<Shared<Texture>>,
    pub hasher: blake3::Hasher,
}

/// The values of one material, or of all: each is drawn evenly between two values.
pub struct MaterialDraws {
    pub name: String,
    kd: Option<[Bands; 2]>,
    ks: Option<[Bands; 2]>,
    shininess: Option<[f64; 2]>,
    /// Whether one draw sets all bands.
    is_grey: bool,
    /// Indices into the textures of the job; empty: the texture stays.
    textures: Range<usize>,
}

impl MaterialDraws {
    /// Reads a `[[material]]` table without its name.
    pub fn read(
        keys: &mut Keys,
        name: String,
        folder: &Path,
        job_textures: &mut JobTextures,
    ) -> Result<Self, Failure> {
        keys.only(&KEYS)?;
        let kd = reflectances(keys, ["kd_min", "kd_max"])?;
        let ks = reflectances(keys, ["ks_min", "ks_max"])?;
        let shininess = between(
            keys,
            ["shininess_min", "shininess_max"],
            |value| match value.number()? {
                exponent if exponent >= 0.0 => Ok([exponent]),
                exponent => Err(value.error(format!("is {exponent}"), "give 0 or more")),
            },
        )?;
        let shininess = shininess.map(|ends| ends.map(|[exponent]| exponent));
        let grey = keys.take("grey");
        let is_grey = grey.as_ref().map(Value::flag).transpose()?.unwrap_or(false);
        if let (Some(grey), None, None) = (&grey, &kd, &ks) {
            let problem = "is given, but no reflectance is drawn";
            Err(grey.error(problem, "add kd_min and kd_max, or remove it"))?;
        }
        let first = job_textures.textures.len();
        if let Some(names) = keys.take("textures") {
            for file in names.filled("list one or more images")?.list()? {
                job_textures.load(&file, folder)?;
            }
        }
        let textures = first..job_textures.textures.len();
        if kd.is_none() && ks.is_none() && shininess.is_none() && textures.is_empty() {
            let hint = "add kd_min and kd_max, ks_min and ks_max, shininess_min and shininess_max, or textures";
            Err(keys.error("[[material]] varies nothing", hint))?;
        }
        Ok(MaterialDraws {
            name,
            kd,
            ks,
            shininess,
            is_grey,
            textures,
        })
    }

    pub fn is_of(&self, material: &Material) -> bool {
        self.name == EVERY || material.name == self.name
    }

    /// Rejects a highlight whose width nothing tells.
    pub fn check(&self, material: &Material) -> Result<(), Failure> {
        if self.ks.is_some() && self.shininess.is_none() && !material.is_specular() {
            Err(format!(
                "[[material]] \"{}\": ks is drawn for \"{}\", which has no shininess; add shininess_min and shininess_max",
                self.name, material.name
            ))?;
        }
        Ok(())
    }

    /// Sets drawn values. `first_texture`: the index of the job's first texture in the scene.
    pub fn apply(
        &self,
        material: &mut Material,
        first_texture: usize,
        draws: impl Fn(&str) -> Draws,
    ) {
        let name = material.name.clone();
        let draws = |quantity: &str| draws(&format!("{quantity} {name}"));
        let bands = |[least, most]: [Bands; 2], mut draws: Draws| match self.is_grey {
            true => {
                let share = draws.between(0.0, 1.0);
                std::array::from_fn(|band| least[band] + share * (most[band] - least[band]))
            }
            false => std::array::from_fn(|band| draws.between(least[band], most[band])),
        };
        if let Some(kd) = self.kd {
            material.kd = bands(kd, draws("kd"));
        }
        if let Some(ks) = self.ks {
            material.ks = bands(ks, draws("ks"));
        }
        if let Some([least, most]) = self.shininess {
            material.shininess = draws("shininess").between(least, most);
        }
        if !self.textures.is_empty() {
            let count = self.textures.len();
            let chosen = draws("texture").between(0.0, count as f64) as usize;
            self.set_texture(material, first_texture, chosen.min(count - 1));
        }
    }

    /// Sets the largest values, and the first texture.
    pub fn apply_brightest(&self, material: &mut Material, first_texture: usize) {
        material.kd = self.kd.map_or(material.kd, |[_, most]| most);
        material.ks = self.ks.map_or(material.ks, |[_, most]| most);
        if !self.textures.is_empty() {
            self.set_texture(material, first_texture, 0);
        }
    }

    /// The texture is looked up as the scene looks up the one that it replaces.
    fn set_texture(&self, material: &mut Material, first_texture: usize, chosen: usize) {
        let texture = first_texture + self.textures.start + chosen;
        let before = material.kd_texture.unwrap_or(texture.into());
        material.kd_texture = Some(TextureLookup { texture, ..before });
    }
}

impl JobTextures {
    fn load(&mut self, named: &Value, folder: &Path) -> Result<(), Failure> {
        let path = folder.join(named.text()?);
        let mut texture = Texture::load(&path, &named.at)?;
        // As the job has it, so that the data set is the same on every machine.
        texture.name = named.text()?.to_owned();
        self.hasher.update(&std::fs::read(&path)?);
        self.textures.push(texture.into());
        Ok(())
    }
}

fn reflectances(keys: &mut Keys, names: [&str; 2]) -> Result<Option<[Bands; 2]>, Failure> {
    between(keys, names, |value| {
        let bands = value.bands()?;
        match bands.iter().all(|band| (0.0..=1.0).contains(band)) {
            true => Ok(bands),
            false => Err(value.error(format!("is {bands:?}"), REFLECTANCES)),
        }
    })
}

/// The two ends of a range; `None` if it is not given.
fn between<const N: usize>(
    keys: &mut Keys,
    [least, most]: [&str; 2],
    read: impl Fn(&Value) -> camlux::Result<[f64; N]>,
) -> Result<Option<[[f64; N]; 2]>, Failure> {
    let (lower, upper) = (keys.take(least), keys.take(most));
    match (lower, upper) {
        (None, None) => Ok(None),
        (Some(lower), Some(upper)) => {
            let ends = [read(&lower)?, read(&upper)?];
            match (0..N).all(|i| ends[0][i] <= ends[1][i]) {
                true => Ok(Some(ends)),
                false => Err(lower.error(format!("is above \"{most}\""), "swap them"))?,
            }
        }
        (Some(one), None) => Err(one.error(format!("has no \"{most}\""), format!("add {most}")))?,
        (None, Some(one)) => Err(one.error(format!("has no \"{least}\""), format!("add {least}")))?,
    }
}
