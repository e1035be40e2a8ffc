//! The scene file, version 1.

mod indirect;
mod parts;
mod tof;

use std::collections::HashMap;
use std::path::Path;

use glam::DMat3;

use super::mesh::{Assets, MeshRequest, Transform};
use crate::keys::{Keys, Value, did_you_mean, read_text};
use crate::scene::{Carrier, PlacedLight, Places, Scene, Shared};
use crate::{Error, Result};

impl Scene {
    /// Loads and validates a scene file with the meshes, materials and textures that it names.
    ///
    #[doc = include_str!("../../../docs/scene.md")]
    ///
    /// # Errors
    /// [`Error::Scene`] with file and line: a missing or unreadable file, text that is not TOML, an unknown or missing key, a value of the
    /// wrong type, and everything that [`Scene::validate`] refuses.
    pub fn load(path: &Path) -> Result<Scene> {
        Scene::parse(&read_text(path, "scene file")?, path)
    }

    /// Like [`Scene::load`], for the text of a scene file. `file` gives the name for messages and the folder for relative paths.
    ///
    /// # Errors
    /// The same as for [`Scene::load`].
    pub fn parse(text: &str, file: &Path) -> Result<Scene> {
        let known = [
            "version", "camera", "lens", "sensor", "tof", "light", "mesh", "material", "direct",
            "indirect",
        ];
        let mut keys = Keys::parse(text, file, "scene file", &known)?;
        let mut places = Places::new(file.display().to_string());

        let camera = keys.need("camera", "a [camera] table")?.table("[camera]")?;
        places.insert_table("camera", 0, &camera);
        let folder = file.parent().unwrap_or(Path::new(""));
        let camera = parts::camera(camera, folder)?;
        let mut optional = |key: &'static str| -> Result<Option<Keys>> {
            let table = keys.table(key)?;
            if let Some(table) = &table {
                places.insert_table(key, 0, table);
            }
            Ok(table)
        };
        let mut sensor = optional("sensor")?.map(parts::sensor).transpose()?;
        if let Some(lens) = optional("lens")? {
            let sensor = sensor.as_mut().ok_or_else(|| {
                lens.error(
                    "[lens] has no effect without [sensor]",
                    "remove it, or add a [sensor] table",
                )
            })?;
            sensor.f_number = Some(parts::f_number(lens)?);
        }
        let tof = optional("tof")?;
        let direct = optional("direct")?.map(parts::direct).transpose()?;
        let indirect = optional("indirect")?.map(indirect::from_keys).transpose()?;

        let (mut lights, mut modulated, mut carriers) = (Vec::new(), Vec::new(), Vec::new());
        let mut left_out = Vec::new();
        for (i, light) in keys.tables("light")?.into_iter().enumerate() {
            places.insert_table("light", i, &light);
            let read = parts::light(light, folder)?;
            lights.push(PlacedLight::from(read.light));
            modulated.push(read.modulated);
            carriers.extend(read.carrier.map(|carrier| (i, carrier)));
            let is_new = |warning: &String| !left_out.contains(warning);
            left_out.extend(read.warning.filter(is_new));
        }
        if let (None, Some(Some(modulated))) = (&tof, modulated.iter().find(|m| m.is_some())) {
            let hint = "remove it, or add a [tof] table";
            return Err(modulated.error("has no effect without [tof]", hint));
        }
        let mut tof = tof
            .map(|keys| tof::from_keys(keys, &modulated))
            .transpose()?;

        let mut assets = Assets::default();
        assets.left_out.extend(left_out);
        if let Some(mut materials) = keys.table("material")? {
            for (name, value) in materials.take_all() {
                let material = value.table(format!("[material.{name}]"))?;
                places.insert_table("material", assets.materials.len(), &material);
                let at = material.at.clone();
                assets.push_material(parts::material(material, name)?, at);
            }
        }
        let own: Vec<String> = assets.materials.iter().map(|m| m.name.clone()).collect();
        let mut transforms = Vec::new();
        let mut of_files = Vec::new();
        let mut requests = Vec::new();
        for mesh in keys.tables("mesh")? {
            let at = mesh.at.clone();
            requests.push((at, mesh_request(mesh, folder, &own)?));
        }
        let mut counts = HashMap::new();
        for (_, request) in &requests {
            *counts.entry(request.key(0)).or_insert(0) += 1;
        }
        for (at, mut request) in requests {
            request.is_repeated = counts[&request.key(0)] > 1;
            let transform = request.transform;
            of_files.extend(assets.load_mesh(request)?);
            // One file may contain several meshes.
            let loaded = transforms.len()..assets.meshes.len();
            for i in loaded.clone() {
                places.insert("mesh", i, at.clone());
            }
            transforms.extend(loaded.map(|_| transform));
        }
        for (light, (carrier, named)) in &carriers {
            let light = &mut lights[*light];
            light.relative_to = Some(*carrier);
            if let Carrier::Mesh(mesh) = *carrier {
                let count = transforms.len();
                let transform = transforms.get(mesh).ok_or_else(|| {
                    let problem = format!("is {mesh}, and there are {count} meshes");
                    named.error(problem, "count from 0 in the order of this file")
                })?;
                let Transform {
                    scale,
                    rotation,
                    translation_m,
                } = *transform;
                light.place_by_mesh(scale, rotation, translation_m);
            }
        }

        if let Some(tof) = &mut tof {
            // Parallel light cannot be modulated, because its paths have no length.
            let parallel = of_files
                .iter()
                .enumerate()
                .filter(|(_, light)| light.position_m().is_none());
            tof.ambient_lights
                .extend(parallel.map(|(i, _)| lights.len() + i));
        }
        lights.extend(of_files.into_iter().map(PlacedLight::from));

        let scene = Scene {
            camera,
            sensor,
            tof,
            lights,
            meshes: assets.meshes,
            materials: assets.materials,
            textures: assets.textures.into_iter().map(Shared::from).collect(),
            direct: direct.unwrap_or_default(),
            indirect,
            left_out: assets.left_out,
        };
        for (i, at) in assets.material_places.into_iter().enumerate() {
            places.insert("material", i, at);
        }
        scene.validate_read(&places)?;
        Ok(scene)
    }
}

/// Reads a `[[mesh]]` table. `own`: the names of the scene file's own materials.
fn mesh_request(mut keys: Keys, folder: &Path, own: &[String]) -> Result<MeshRequest> {
    keys.only(&[
        "path",
        "scale",
        "rotate_deg",
        "translate",
        "material",
        "flat",
    ])?;
    let path = keys.need("path", "path = \"mesh.obj\"")?;
    let name = path.text()?.to_owned();
    Ok(MeshRequest {
        path: folder.join(&name),
        name,
        named_at: path.at,
        material_override: keys.optional("material", |value| named_material(value, own))?,
        transform: transform(&mut keys)?,
        flat: keys.optional("flat", Value::flag)?.unwrap_or(false),
        is_repeated: false,
    })
}

fn named_material(value: &Value, own: &[String]) -> Result<u32> {
    let name = value.text()?;
    if let Some(index) = own.iter().position(|own| own == name) {
        return Ok(index as u32);
    }
    let known: Vec<&str> = own.iter().map(String::as_str).collect();
    let hint = if known.is_empty() {
        format!("add a [material.{name}] table")
    } else {
        did_you_mean(name, &known)
    };
    let problem = format!("there is no [material.{name}] in this file");
    Err(Error::scene(&value.at, problem, hint))
}

fn transform(keys: &mut Keys) -> Result<Transform> {
    let scale = keys.optional("scale", |value| match value.number()? {
        scale if scale > 0.0 => Ok(scale),
        scale => Err(value.error(format!("is {scale}"), "give a number above 0")),
    })?;
    let degrees = keys
        .optional("rotate_deg", Value::vec3)?
        .unwrap_or_default();
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    Ok(Transform {
        scale: scale.unwrap_or(1.0),
        rotation: DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x),
        translation_m: keys.optional("translate", Value::vec3)?.unwrap_or_default(),
    })
}
