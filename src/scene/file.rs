//! The scene file, version 1.

use std::path::Path;

use glam::{DMat3, DVec3};

use super::assets::{Assets, MeshRequest, Transform};
use super::validate::{self, ScenePart};
use super::{Direct, Scene, Shared, file_parts};
use crate::keys::{Keys, LineStarts, TomlText, Value, did_you_mean};
use crate::{Error, Result, input_file};

const VERSION: u32 = 1;

impl Scene {
    /// Loads and validates a scene file with the meshes, materials and textures that it names.
    ///
    #[doc = include_str!("../../docs/scene.md")]
    ///
    /// # Errors
    /// [`Error::Scene`] with file and line: a file that is missing or unreadable, text that is not TOML, an unknown or
    /// missing key, a value of the wrong type, and everything that [`Scene::validate`] refuses.
    pub fn load(path: &Path) -> Result<Scene> {
        let unreadable = |problem: String| {
            Error::scene(
                path.display().to_string(),
                format!("cannot read the scene file: {problem}"),
                "check the path and that it is a UTF-8 text file",
            )
        };
        let bytes = input_file::read(path).map_err(|error| unreadable(error.to_string()))?;
        let text = String::from_utf8(bytes).map_err(|error| unreadable(error.to_string()))?;
        Scene::parse(&text, path)
    }

    /// Like [`Scene::load`], for the text of a scene file; `file` gives the name for messages and the folder that
    /// relative paths start from.
    ///
    /// # Errors
    /// Those of [`Scene::load`].
    pub fn parse(text: &str, file: &Path) -> Result<Scene> {
        let lines = LineStarts::new(text);
        let mut keys = TomlText {
            name: "the scene file",
            text,
            file,
            lines: &lines,
        }
        .parse()?;
        keys.only(&[
            "version", "camera", "sensor", "light", "mesh", "material", "direct", "indirect",
        ])?;
        if let Some(version) = keys.take("version") {
            check_version(&version)?;
        }

        let mut places = Places::default();
        let mut camera_keys = keys.need("camera", "a [camera] table")?.table("[camera]")?;
        places.camera = camera_keys.at.clone();
        let camera = file_parts::camera(&mut camera_keys)?;

        let sensor = optional_table(&mut keys, "sensor", &mut places.sensor, file_parts::sensor)?;
        let direct = match keys.take("direct") {
            Some(value) => file_parts::direct(&mut value.table("[direct]")?)?,
            None => Direct::default(),
        };
        let indirect = optional_table(
            &mut keys,
            "indirect",
            &mut places.indirect,
            file_parts::indirect,
        )?;

        let mut lights = Vec::new();
        for mut light_keys in tables(&mut keys, "light")? {
            lights.push(file_parts::light(&mut light_keys)?);
            places.lights.push(light_keys.at);
        }

        let mut assets = Assets::default();
        if let Some(value) = keys.take("material") {
            for (name, value) in value.table("[material]")?.take_all() {
                let mut material_keys = value.table(format!("[material.{name}]"))?;
                let material = file_parts::material(&mut material_keys, name)?;
                assets.add_material(material, material_keys.at);
            }
        }

        let folder = file.parent().unwrap_or(Path::new(""));
        for mut mesh_keys in tables(&mut keys, "mesh")? {
            let request = mesh_request(&mut mesh_keys, folder, &assets)?;
            assets.load_mesh(request)?;
            places.meshes.push(mesh_keys.at);
        }

        let scene = Scene {
            camera,
            sensor,
            lights,
            meshes: assets.meshes.into_iter().map(Shared::from).collect(),
            materials: assets.materials,
            textures: assets.textures.into_iter().map(Shared::from).collect(),
            direct,
            indirect,
        };
        places.file = file.display().to_string();
        places.materials = assets.material_places;
        validate::check(&scene).map_err(|fault| {
            let place = places.of(fault.part);
            fault.into_error(&scene, Some(place))
        })?;
        Ok(scene)
    }
}

/// Where each part of the scene was read.
#[derive(Default)]
struct Places {
    file: String,
    camera: String,
    sensor: String,
    indirect: String,
    lights: Vec<String>,
    meshes: Vec<String>,
    materials: Vec<String>,
}

impl Places {
    fn of(&self, part: ScenePart) -> &str {
        match part {
            // A texture's name is its path already.
            ScenePart::Scene | ScenePart::Texture(_) => &self.file,
            ScenePart::Camera => &self.camera,
            ScenePart::Sensor => &self.sensor,
            ScenePart::Indirect => &self.indirect,
            ScenePart::Light(i) => &self.lights[i],
            ScenePart::Mesh(i) => &self.meshes[i],
            ScenePart::Material(i) => &self.materials[i],
        }
    }
}

fn check_version(value: &Value) -> Result<()> {
    let version = value.count()?;
    if version == VERSION {
        return Ok(());
    }
    Err(Error::scene(
        &value.at,
        format!("scene file version {version} is not known"),
        format!("write version = {VERSION}, or use a newer camlux"),
    ))
}

/// Reads `[key]` where it is there, and notes its place.
fn optional_table<'t, T>(
    keys: &mut Keys<'t>,
    key: &str,
    place: &mut String,
    read: impl Fn(&mut Keys<'t>) -> Result<T>,
) -> Result<Option<T>> {
    let Some(value) = keys.take(key) else {
        return Ok(None);
    };
    let mut table = value.table(format!("[{key}]"))?;
    place.clone_from(&table.at);
    read(&mut table).map(Some)
}

fn tables<'t>(keys: &mut Keys<'t>, key: &str) -> Result<Vec<Keys<'t>>> {
    keys.take(key).map_or(Ok(Vec::new()), Value::tables)
}

fn mesh_request(keys: &mut Keys, folder: &Path, assets: &Assets) -> Result<MeshRequest> {
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
    let material_override = match keys.take("material") {
        Some(value) => Some(named_material(&value, assets)?),
        None => None,
    };
    Ok(MeshRequest {
        path: folder.join(&name),
        name,
        named_at: path.at,
        transform: transform(keys)?,
        material_override,
        flat: keys.take("flat").map_or(Ok(false), |flat| flat.flag())?,
    })
}

fn named_material(value: &Value, assets: &Assets) -> Result<u32> {
    let name = value.text()?;
    assets.material_named(name).ok_or_else(|| {
        let known: Vec<&str> = assets.material_names().collect();
        let hint = if known.is_empty() {
            format!("add a [material.{name}] table")
        } else {
            did_you_mean(name, &known)
        };
        Error::scene(
            &value.at,
            format!("there is no [material.{name}] in this file"),
            hint,
        )
    })
}

fn transform(keys: &mut Keys) -> Result<Transform> {
    let scale = match keys.take("scale") {
        Some(value) => {
            let scale = value.number()?;
            if scale <= 0.0 {
                return Err(Error::scene(
                    value.at,
                    format!("\"scale\" in [[mesh]] is {scale}"),
                    "give a number above 0",
                ));
            }
            scale
        }
        None => 1.0,
    };
    let vector = |value: Option<Value>| value.map_or(Ok(DVec3::ZERO), |value| value.vec3());
    let degrees = vector(keys.take("rotate_deg"))?;
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    Ok(Transform {
        scale,
        rotation: DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x),
        translation_m: vector(keys.take("translate"))?,
    })
}
