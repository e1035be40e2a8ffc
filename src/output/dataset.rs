//! The descriptions of scenes and frames in a data set: `docs/batch.md`.

use std::collections::HashMap;

use glam::{DQuat, DVec3};
use serde_json::{Map, Value, json};

use super::header::TOF_CONVENTION;
use super::{ExrOptions, Layer, LayerNeed};
use crate::model::PhaseSampling;
use crate::scene::{Intrinsics, Lens, Material, Scene, TimeOfFlight};

/// The format of `dataset.json`.
pub const DATASET_FORMAT: &str = "camlux dataset 1";

/// What all numbers of a data set are relative to.
pub fn dataset_conventions() -> Value {
    json!({
        "length": "m",
        "camera": "position_m and rotation_xyzw take points from the camera's axes (x right, y down, z forward) to the world",
        "mesh": "position_m and rotation_xyzw take points from where the scene file has the mesh to the world",
        "pixels": "x right, y down; the centre of the first is at (0.5, 0.5)",
    })
}

/// The layers that files of this scene have, in the order of the documentation.
pub fn dataset_layers(scene: &Scene, exr: &ExrOptions, has_flow: bool) -> Vec<Layer> {
    let is_made =
        |layer: &Layer| layer.is_made_for(scene) || has_flow && layer.need() == LayerNeed::Sequence;
    let picked = exr.layers.as_deref();
    let layers = Layer::all().filter(|layer| is_made(layer) && layer.is_among(picked));
    layers.collect()
}

/// The names and layers of a scene. `starts_s`: when its phase images begin.
pub fn describe_scene(
    scene: &Scene,
    exr: &ExrOptions,
    has_flow: bool,
    starts_s: Option<Vec<f64>>,
) -> Map<String, Value> {
    let layers = dataset_layers(scene, exr, has_flow)
        .into_iter()
        .map(|layer| {
            let channels = match exr.plain {
                true => layer.plain_channel_names(),
                false => layer.channel_names(),
            };
            let unit = layer.unit_by(scene.tof.as_ref());
            let value = json!({ "channels": channels, "unit": unit });
            (layer.name().to_owned(), value)
        });
    let tof = scene.tof.as_ref();
    object(json!({
        "resolution_px": scene.camera.resolution_px,
        "meshes": scene.meshes.iter().map(|m| &m.name).collect::<Vec<_>>(),
        "materials": scene.materials.iter().map(|m| &m.name).collect::<Vec<_>>(),
        "layers": layers.collect::<Map<_, _>>(),
        "time_of_flight": tof.map(|tof| time_of_flight(scene, tof, starts_s)),
    }))
}

/// How phase images are taken and what they mean, as in the header of each file.
fn time_of_flight(scene: &Scene, tof: &TimeOfFlight, starts_s: Option<Vec<f64>>) -> Value {
    let delays_rad = (0..tof.phase_count).map(|i| PhaseSampling::delay_rad(i, tof.phase_count));
    json!({
        "frequencies_hz": tof.frequencies_hz,
        "contrasts": tof.contrasts,
        "delays_rad": delays_rad.collect::<Vec<f64>>(),
        "phase_offset_deg": tof.phase_offset_deg,
        "band_weights": tof.band_weights,
        "exposure_time_s": scene.sensor.map(|sensor| sensor.exposure_time_s),
        "phase_image_starts_s": starts_s,
        "convention": TOF_CONVENTION,
    })
}

/// Camera, lights, moved meshes and changed materials of a frame.
///
/// `rotation`: of the camera. `mesh_poses`: index, position and rotation of the meshes that move. `base`: the scene that materials are
/// compared with.
pub fn describe_frame(
    scene: &Scene,
    base: &Scene,
    rotation: DQuat,
    mesh_poses: &[(usize, DVec3, DQuat)],
) -> Map<String, Value> {
    let Intrinsics {
        fx,
        fy,
        cx,
        cy,
        skew,
    } = scene.camera.intrinsics_px();
    let intrinsics_px = json!({ "fx": fx, "fy": fy, "cx": cx, "cy": cy, "skew": skew });
    let meshes = mesh_poses.iter().map(|(mesh, position_m, rotation)| {
        json!({
            "index": mesh,
            "position_m": position_m.to_array(),
            "rotation_xyzw": rotation.to_array(),
        })
    });
    let keys = material_keys(scene);
    let varied_by = |quantity: usize| {
        let value = |material: &Material| one_or_list(material.reflectance()[quantity].values);
        let materials = base.materials.iter().zip(&scene.materials).zip(&keys);
        let varied = materials.filter(|((before, now), _)| value(before) != value(now));
        Map::from_iter(varied.map(|((_, now), key)| (key.clone(), value(now))))
    };
    let mut frame = object(json!({
        "camera": {
            "position_m": scene.camera.position_m.to_array(),
            "rotation_xyzw": rotation.to_array(),
            "look_at_m": scene.camera.look_at_m.to_array(),
            "up": scene.camera.up.to_array(),
            "resolution_px": scene.camera.resolution_px,
            "intrinsics_px": intrinsics_px,
            "samples": scene.camera.pixel_sampling.map_or(1, |sampling| sampling.samples),
            "filter": scene.camera.pixel_sampling.map(|sampling| sampling.filter.name()),
            "distortion": scene.camera.distortion().map(|distortion| json!({
                "model": distortion.model(),
                "coefficients": distortion.coefficients(),
            })),
        },
        "lights": (0..scene.lights.len()).map(|i| describe_light(scene, i)).collect::<Vec<_>>(),
        "meshes": meshes.collect::<Vec<_>>(),
        "materials_kd": {},
    }));
    if let Lens::Orthographic { height_m } = scene.camera.lens {
        frame["camera"]["intrinsics_px"] = Value::Null;
        frame["camera"]["projection"] = "orthographic".into();
        frame["camera"]["height_m"] = height_m.into();
    }
    let names = Material::lambert("", [0.0; 3])
        .reflectance()
        .map(|r| r.name);
    let varied = names.into_iter().enumerate();
    let varied = varied.map(|(quantity, name)| (name, varied_by(quantity)));
    for (name, of_materials) in varied.chain([("texture", varied_textures(scene, base))]) {
        if !of_materials.is_empty() {
            frame.insert(format!("materials_{name}"), Value::Object(of_materials));
        }
    }
    frame
}

/// The key of each material in a manifest: its name, with its index where other materials have the same name.
fn material_keys(scene: &Scene) -> Vec<String> {
    let names = || scene.materials.iter().map(|material| &material.name);
    let mut counts = HashMap::new();
    for name in names() {
        *counts.entry(name).or_insert(0) += 1;
    }
    let key = |(index, name): (usize, &String)| match counts[name] {
        1 => name.clone(),
        _ => format!("{name}#{index}"),
    };
    names().enumerate().map(key).collect()
}

/// The names of the textures of k_d that differ.
fn varied_textures(scene: &Scene, base: &Scene) -> Map<String, Value> {
    let mut names = Map::new();
    let materials = base.materials.iter().zip(&scene.materials);
    for ((before, now), key) in materials.zip(material_keys(scene)) {
        let texture = |scene: &Scene, material: &Material| {
            let lookup = material.kd_texture?;
            scene.textures.get(lookup.texture).cloned()
        };
        let textures = (texture(base, before), texture(scene, now));
        let is_same = match &textures {
            (Some(before), Some(now)) => before.ptr_eq(now),
            (before, now) => before.is_none() && now.is_none(),
        };
        if !is_same {
            let name = textures.1.map(|texture| texture.name.clone());
            names.insert(key, json!(name));
        }
    }
    names
}

fn describe_light(scene: &Scene, index: usize) -> Value {
    let light = &scene.lights[index];
    let mut object = json!({ "kind": light.kind() });
    if let Some(tof) = &scene.tof {
        object["modulated"] = json!(tof.is_modulated(index));
    }
    for (name, numbers) in light.parameters() {
        object[name] = one_or_list(&numbers);
    }
    object
}

fn one_or_list(numbers: &[f64]) -> Value {
    match numbers {
        [number] => json!(number),
        _ => json!(numbers),
    }
}

fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn changed_materials_of_one_name_have_an_entry_each() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.toml");
        let mut base = Scene::load(&file).expect("a scene");
        base.materials = ["wall", "floor", "wall"]
            .map(|name| Material::lambert(name, [0.5; 3]))
            .into();
        let mut changed = base.clone();
        for material in &mut changed.materials {
            material.kd = [0.25; 3];
        }
        let frame = describe_frame(&changed, &base, DQuat::IDENTITY, &[]);
        let of_materials = frame["materials_kd"].as_object().expect("a table");
        let keys: Vec<&String> = of_materials.keys().collect();
        assert_eq!(keys, ["wall#0", "floor", "wall#2"]);
    }
}
