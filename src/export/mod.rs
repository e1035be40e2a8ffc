//! Writes a scene to a folder, from which [`Scene::load`] reads the same scene again, bit by bit.

mod images;
mod ply;
mod toml;

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use crate::import::pattern_text;
use crate::output::OutputFile;
use crate::scene::{
    Camera, Carrier, Distortion, Material, Parameter, Parameters, PixelSampling, Profile,
    Reflectance, Scene, Sensor, Texels, TextureLookup, TimeOfFlight,
};
use crate::{Error, Result};
use toml::Toml;

/// Where the parts of a scene are, below its folder.
const MESHES: &str = "meshes";
const TEXTURES: &str = "textures";
const PATTERNS: &str = "patterns";

impl Scene {
    /// Writes `scene.toml` to a folder, with the meshes (PLY), textures (PNG, OpenEXR) and patterns (JSON, OpenEXR) that it names below. The
    /// folder is made if it is missing; files of these names are replaced.
    ///
    /// [`Scene::load`] of `scene.toml` gives a scene with the same [`Scene::hash`] and the same names. Warnings about files that the scene was loaded
    /// from are not kept.
    ///
    /// # Errors
    /// [`Error::Scene`] for a scene that is not valid, [`Error::Output`] if a file cannot be written.
    pub fn save(&self, folder: &Path) -> Result<()> {
        self.validate()?;
        if let Some(PixelSampling { samples: 1, .. }) = self.camera.pixel_sampling {
            let hint = "leave it out for one point in the centre, or give 2 or more";
            let problem = "samples is 1, which no scene file has";
            return Err(Error::scene("camera", problem, hint));
        }
        let mut toml = Toml::default();
        let saved = Saved {
            scene: self,
            folder,
        };
        self.write_camera(&mut toml, saved.vignetting_map()?);
        saved.lights(&mut toml)?;
        saved.textures(&mut toml)?;
        let keys = saved.materials(&mut toml);
        saved.meshes(&mut toml, &keys)?;
        self.write_indirect(&mut toml);
        // Last, so that it names only files that are there.
        OutputFile::create(make_folder(folder)?.join("scene.toml"))?
            .commit_with(toml.text().as_bytes())
    }

    fn write_camera(&self, toml: &mut Toml, vignetting_map: Option<String>) {
        let Camera {
            resolution_px: [width, height],
            position_m,
            look_at_m,
            up,
            lens: _,
            pixel_sampling,
        } = self.camera;
        toml.table("[camera]");
        toml.count_list("resolution", &[width, height]);
        toml.numbers("position", &position_m.to_array());
        toml.numbers("look_at", &look_at_m.to_array());
        toml.numbers("up", &up.to_array());
        toml.lens(&self.camera.lens);
        if let Some(distortion) = self.camera.distortion() {
            let coefficients = match distortion {
                Distortion::Rational(_) => Some(("distortion", &Distortion::RATIONAL[..])),
                Distortion::Fisheye(_) => Some(("fisheye", &Distortion::FISHEYE[..])),
                Distortion::Equirectangular => None,
            };
            if let Some((key, names)) = coefficients {
                toml.named(key, names, distortion.coefficients());
            }
        }
        if let Some(sampling) = pixel_sampling {
            toml.count("samples", sampling.samples.into());
            toml.string("filter", sampling.filter.name());
        }
        if let Some(sensor) = &self.sensor {
            let of_lens = |row: &(&Parameter, _)| Sensor::OF_LENS.contains(&row.0.name);
            let (lens, sensor): (Vec<_>, Vec<_>) =
                sensor.named_values().into_iter().partition(of_lens);
            toml.table("[sensor]");
            toml.parameters(sensor);
            if let Some(noise) = &self.sensor.and_then(|sensor| sensor.noise) {
                toml.table("[sensor.noise]");
                toml.parameters(noise.named_values());
            }
            if lens.iter().any(|(_, value)| value.is_some()) {
                toml.table("[lens]");
                toml.parameters(lens);
                if let Some(file) = vignetting_map {
                    toml.string("vignetting", &file);
                }
            }
        }
        if let Some(tof) = &self.tof {
            write_tof(toml, tof);
        }
    }

    fn write_indirect(&self, toml: &mut Toml) {
        if let Some(shadow) = self.direct.shadow {
            toml.table("[direct]");
            toml.string("shadow", shadow.name());
        }
        let Some(indirect) = &self.indirect else {
            return;
        };
        toml.table("[indirect]");
        toml.string("estimator", indirect.name());
        toml.parameters(indirect.parameters().named_values());
    }
}

fn write_tof(toml: &mut Toml, tof: &TimeOfFlight) {
    let TimeOfFlight {
        frequencies_hz,
        phase_count,
        contrasts,
        band_weights,
        phase_offset_deg,
        // Written with the lights.
        ambient_lights: _,
        output,
        noise,
    } = tof;
    toml.table("[tof]");
    toml.numbers("frequencies_hz", frequencies_hz);
    toml.count("phases", (*phase_count).into());
    toml.numbers("contrast", contrasts);
    toml.numbers("band", band_weights);
    toml.number("phase_offset_deg", *phase_offset_deg);
    toml.string("output", output.name());
    if let Some(noise) = noise {
        toml.table("[tof.noise]");
        toml.parameters(noise.named_values());
    }
}

/// The parts of a scene with files of their own.
struct Saved<'s> {
    scene: &'s Scene,
    folder: &'s Path,
}

impl Saved<'_> {
    /// Writes a file below the folder.
    fn write(&self, part: &str, name: &str, bytes: &[u8]) -> Result<String> {
        let folder = make_folder(&self.folder.join(part))?.to_owned();
        OutputFile::create(folder.join(name))?.commit_with(bytes)?;
        Ok(format!("{part}/{name}"))
    }

    fn vignetting_map(&self) -> Result<Option<String>> {
        let map = self.scene.vignetting_map.as_ref();
        let file = map.map(|map| {
            let bytes = images::grey_exr(map.size_px, &map.values).map_err(internal)?;
            self.write(PATTERNS, "vignetting.exr", &bytes)
        });
        file.transpose()
    }

    fn lights(&self, toml: &mut Toml) -> Result<()> {
        for (index, light) in self.scene.lights.iter().enumerate() {
            toml.table("[[light]]");
            toml.string("kind", light.kind());
            for (name, values) in light.parameters() {
                // Scene files have the units of lengths in no name.
                let key = name.strip_suffix("_m").unwrap_or(name);
                match values[..] {
                    [number] => toml.number(key, number),
                    _ => toml.numbers(key, &values),
                }
            }
            if let Some(lamp) = light.lamp() {
                self.profile(toml, index, &lamp.profile)?;
            }
            if let Some(tof) = &self.scene.tof {
                toml.flag("modulated", tof.is_modulated(index));
            }
            match light.relative_to {
                None => {}
                Some(Carrier::Camera) => toml.string("relative_to", "camera"),
                Some(Carrier::Mesh(mesh)) => {
                    toml.string("moves_with", "mesh");
                    toml.count("mesh", mesh as u64);
                }
            }
        }
        Ok(())
    }

    fn profile(&self, toml: &mut Toml, index: usize, profile: &Profile) -> Result<()> {
        match profile {
            Profile::Measured(pattern) => {
                let text = pattern_text(pattern);
                let file = self.write(PATTERNS, &format!("{index}.json"), text.as_bytes())?;
                toml.string("pattern", &file);
            }
            Profile::Projected(image) => {
                let bytes = images::grey_exr(image.size_px, &image.values).map_err(internal)?;
                let file = self.write(PATTERNS, &format!("{index}.exr"), &bytes)?;
                toml.string("image", &file);
                toml.number("white", 1.0);
                toml.intrinsics(&image.intrinsics);
            }
            // The light's parameters say it all.
            _ => {}
        }
        Ok(())
    }

    fn textures(&self, toml: &mut Toml) -> Result<()> {
        for (index, texture) in self.scene.textures.iter().enumerate() {
            let (extension, encoding) = match &texture.texels {
                Texels::U8(_, encoding) | Texels::U16(_, encoding) => ("png", Some(*encoding)),
                Texels::F32(_) => ("exr", None),
            };
            let bytes = images::of_texture(texture).map_err(internal)?;
            let file = self.write(TEXTURES, &format!("{index}.{extension}"), &bytes)?;
            toml.table("[[texture]]");
            toml.string("path", &file);
            toml.string("name", &texture.name);
            if let Some(encoding) = encoding {
                toml.string("encoding", encoding.name());
            }
        }
        Ok(())
    }

    /// Returns the key of each material: its name, if no other has it.
    fn materials(&self, toml: &mut Toml) -> Vec<String> {
        let mut keys: HashMap<String, usize> = HashMap::new();
        let mut of_materials = Vec::new();
        for (index, material) in self.scene.materials.iter().enumerate() {
            let mut key = material.name.clone();
            // The number makes it another key, unless a name ends in it.
            while keys.contains_key(&key) {
                key = format!("{key} {index}");
            }
            keys.insert(key.clone(), index);
            write_material(toml, &key, material);
            of_materials.push(key);
        }
        of_materials
    }

    fn meshes(&self, toml: &mut Toml, material_keys: &[String]) -> Result<()> {
        let mut files: HashMap<usize, (String, Vec<u32>)> = HashMap::new();
        for instance in &self.scene.meshes {
            let id = instance.mesh.id();
            if !files.contains_key(&id) {
                let materials = ply::materials(&instance.mesh);
                let name = format!("{}.ply", files.len());
                let bytes = ply::bytes(&instance.mesh, &materials);
                let file = self.write(MESHES, &name, &bytes)?;
                files.insert(id, (file, materials));
            }
            let (file, materials) = &files[&id];
            let materials = materials.iter().map(|&m| &material_keys[m as usize][..]);
            toml.table("[[mesh]]");
            toml.string("path", file);
            toml.string("name", &instance.name);
            toml.numbers("to_world", &instance.to_world.to_cols_array());
            toml.strings("materials", materials);
        }
        Ok(())
    }
}

fn write_material(toml: &mut Toml, key: &str, material: &Material) {
    toml.table_of("material", key);
    if material.name != key {
        toml.string("name", &material.name);
    }
    if let Some(microfacets) = &material.microfacets {
        toml.numbers("base_color", &material.kd);
        toml.parameters(microfacets.named_values());
    } else {
        for Reflectance { name, values, .. } in material.reflectance() {
            match values {
                [value] => toml.number(name, *value),
                _ => toml.numbers(name, values),
            }
        }
    }
    // Files of scenes without these stay readable for programs that do not know them.
    if material.is_emissive() {
        toml.numbers("emission_w_sr_m2", &material.emission_w_sr_m2);
    }
    if material.is_one_sided {
        toml.flag("one_sided", true);
    }
    toml.number("alpha_cutoff", material.alpha_cutoff);
    for (role, lookup) in material.textures() {
        let name = role.field();
        if lookup == TextureLookup::from(lookup.texture) {
            toml.count(name, lookup.texture as u64);
        } else {
            toml.lookup(name, &lookup);
        }
    }
}

fn make_folder(folder: &Path) -> Result<&Path> {
    fs::create_dir_all(folder).map_err(|error| Error::Output {
        path: folder.to_owned(),
        problem: format!("cannot create the folder: {error}"),
        hint: "name another folder, or check the permissions".into(),
    })?;
    Ok(folder)
}

/// An image in memory that cannot be encoded.
fn internal(problem: String) -> Error {
    Error::internal(problem)
}
