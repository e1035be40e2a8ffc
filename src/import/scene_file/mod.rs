//! The scene file, version 1.

mod camera;
mod indirect;
mod parts;
mod surfaces;
mod tof;

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine3, DMat3};

use super::mesh::{AsIs, Assets, MeshRequest, Transform};
use crate::keys::{Keys, Value, did_you_mean, read_text};
use crate::scene::{
    Carrier, Parameter, ParameterKind, ParameterValue, Parameters, PlacedLight, Places, Scene,
    SensorNoise, Shared, in_their_roles,
};
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
            "version", "camera", "lens", "sensor", "tof", "light", "mesh", "material", "texture",
            "direct", "indirect",
        ];
        let mut keys = Keys::parse(text, file, "scene file", &known)?;
        let mut places = Places::new(file.display().to_string());

        let camera = keys.need("camera", "a [camera] table")?.table("[camera]")?;
        places.insert_table("camera", 0, &camera);
        let folder = file.parent().unwrap_or(Path::new(""));
        let (camera, warning) = camera::camera(camera, folder)?;
        let mut optional = |key: &'static str| -> Result<Option<Keys>> {
            let table = keys.table(key)?;
            if let Some(table) = &table {
                match key {
                    "lens" => places.insert_keys("sensor", 0, table),
                    _ => places.insert_table(key, 0, table),
                }
            }
            Ok(table)
        };
        let (sensor, lens) = (optional("sensor")?, optional("lens")?);
        let read = match (sensor, lens) {
            (None, None) => None,
            (Some(sensor), lens) => Some(parts::sensor(sensor, lens, folder)?),
            (None, Some(lens)) => {
                let hint = "remove it, or add a [sensor] table";
                return Err(lens.error("[lens] has no effect without [sensor]", hint));
            }
        };
        let sensor = read.as_ref().map(|read| read.sensor);
        let (vignetting_map, of_map) = read.map_or((None, None), |read| {
            (read.vignetting_map.map(Shared::from), read.warning)
        });
        let tof = optional("tof")?;
        let direct = optional("direct")?.map(parts::direct).transpose()?;
        let indirect = optional("indirect")?.map(indirect::from_keys).transpose()?;

        let (mut lights, mut modulated, mut carriers) = (Vec::new(), Vec::new(), Vec::new());
        let mut left_out = Vec::from_iter(warning.into_iter().chain(of_map));
        for (i, light) in keys.tables("light")?.into_iter().enumerate() {
            places.insert_table("light", i, &light);
            let read = parts::light(light, folder)?;
            lights.push(PlacedLight::from(read.light));
            modulated.push(read.modulated);
            let is_in_world = read.is_in_world;
            carriers.extend(read.carrier.map(|carrier| (i, carrier, is_in_world)));
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
        for (i, texture) in keys.tables("texture")?.into_iter().enumerate() {
            places.insert_table("texture", i, &texture);
            assets.textures.push(surfaces::texture(texture, folder)?);
        }
        let mut own = Vec::new();
        if let Some(mut materials) = keys.table("material")? {
            for (name, value) in materials.take_all() {
                let material = value.table(format!("[material.{name}]"))?;
                places.insert_table("material", assets.materials.len(), &material);
                let at = material.at.clone();
                own.push(name.clone());
                let textures = assets.textures.len();
                assets.push_material(surfaces::material(material, name, textures)?, at);
            }
        }
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
        for (light, (carrier, named), is_in_world) in &carriers {
            let light = &mut lights[*light];
            light.relative_to = Some(*carrier);
            if let Carrier::Mesh(mesh) = *carrier {
                let count = transforms.len();
                let transform = transforms.get(mesh).ok_or_else(|| {
                    let problem = format!("is {mesh}, and there are {count} meshes");
                    named.error(problem, "count from 0 in the order of this file")
                })?;
                if *is_in_world {
                    continue;
                }
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

        let textures = in_their_roles(&assets.textures, &mut assets.materials);
        let scene = Scene {
            camera,
            sensor,
            vignetting_map,
            tof,
            lights,
            meshes: assets.meshes,
            materials: assets.materials,
            textures,
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
        "to_world",
        "materials",
        "name",
    ])?;
    let path = keys.need("path", "path = \"mesh.obj\"")?;
    let file = path.text()?.to_owned();
    let as_is = as_is(&mut keys, &file, own)?;
    let name = match &as_is {
        Some(_) => keys.optional("name", |name| Ok(name.text()?.to_owned()))?,
        None => None,
    };
    Ok(MeshRequest {
        path: folder.join(&file),
        name: name.unwrap_or(file),
        as_is,
        named_at: path.at,
        material_override: keys.optional("material", |value| named_material(value, own))?,
        transform: transform(&mut keys)?,
        flat: keys.optional("flat", Value::flag)?.unwrap_or(false),
        is_repeated: false,
    })
}

/// Reads how a mesh that stays as its file has it is placed; `None` for other meshes.
fn as_is(keys: &mut Keys, file: &str, own: &[String]) -> Result<Option<AsIs>> {
    let Some(to_world) = keys.take("to_world") else {
        for key in ["materials", "name"] {
            let problem = "belongs to a mesh with \"to_world\"";
            keys.refuse(key, problem, "add to_world, or remove it")?;
        }
        return Ok(None);
    };
    if !file.to_ascii_lowercase().ends_with(".ply") {
        let hint = "use scale, rotate_deg and translate, or give a PLY file";
        return Err(to_world.error("is for PLY files", hint));
    }
    for key in ["scale", "rotate_deg", "translate", "material", "flat"] {
        let hint = "remove it, or to_world and materials";
        keys.refuse(key, "is not allowed beside \"to_world\"", hint)?;
    }
    let named = keys.need("materials", "materials = [\"white\"]")?.list()?;
    let materials = named.iter().map(|value| named_material(value, own));
    Ok(Some(AsIs {
        to_world: DAffine3::from_cols_array(&to_world.numbers()?),
        materials: materials.collect::<Result<_>>()?,
    }))
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

/// Reads a table whose keys are these parameters.
fn read_parameters(
    mut keys: Keys,
    into: &mut dyn Parameters,
    is_key: impl Fn(&Parameter) -> bool,
) -> Result<()> {
    let known = into.rows().iter().filter(|parameter| is_key(parameter));
    keys.only(&Vec::from_iter(known.map(|parameter| parameter.name)))?;
    into.read(|parameter| match is_key(parameter) {
        true => value_of(parameter, &mut keys),
        false => Ok(None),
    })
}

/// Reads a table of sensor noise.
fn sensor_noise(keys: Keys) -> Result<SensorNoise> {
    let mut noise = SensorNoise::DEFAULT;
    read_parameters(keys, &mut noise, |_| true)?;
    Ok(noise)
}

/// The value of a parameter whose key has its name, if the key is there.
fn value_of(parameter: &Parameter, keys: &mut Keys) -> Result<Option<ParameterValue>> {
    let value = match parameter.example {
        Some(example) => Some(keys.need(parameter.name, example)?),
        None => keys.take(parameter.name),
    };
    let read = |value: Value| match parameter.kind {
        ParameterKind::Number => value.number().map(ParameterValue::Number),
        ParameterKind::Pair => value.numbers().map(ParameterValue::Pair),
        ParameterKind::Bands => value.bands().map(ParameterValue::Bands),
        ParameterKind::Coefficients => value.numbers().map(ParameterValue::Coefficients),
        ParameterKind::Count => Ok(ParameterValue::Count(value.count()?.into())),
        ParameterKind::LargeCount => value.large_count().map(ParameterValue::Count),
        ParameterKind::Flag => value.flag().map(ParameterValue::Flag),
        ParameterKind::Name(names) => value.choice(names, |name| name).map(ParameterValue::Name),
    };
    value.map(read).transpose()
}
