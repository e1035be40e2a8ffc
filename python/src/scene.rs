//! Converts the classes of scene.py to a scene of the engine.

use std::path::PathBuf;

use camlux::glam::DVec3;
use camlux::scene::{
    self, AreaShape, Camera, Carrier, ChargeUnit, Direct, Distortion, Filter, IndirectLight,
    Intrinsics, Lens, Light, Material, MetallicRoughness, PixelFilter, PixelSampling, PlacedLight,
    Profile, Sensor, SensorNoise, Shadow, Shared, TextureLookup, TimeOfFlight, VignettingMap, Wrap,
};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use crate::arrays::{as_array, numbers};
use crate::attributes::Part;
use crate::dataset::SceneState;
use crate::errors::{ArgumentTypeError, SceneError, raised};
use crate::mesh::Mesh;
use crate::objects::light_class;
use crate::parts::{Pattern, ProjectedImage, Texture};

/// The scene that a `camlux.Scene` describes; its values are not validated yet.
pub fn scene_from(object: &Bound<'_, PyAny>) -> PyResult<camlux::Scene> {
    if let Ok(state) = object.cast::<SceneState>() {
        return Ok(state.get().0.clone());
    }
    let part = Part::new(object.clone(), "scene")?;
    let need = |name: &str, hint: &str| {
        let found = part.part(name)?;
        found.ok_or_else(|| part.error(format_args!("{name} is None"), hint))
    };
    let camera = camera_from(&need("camera", "give a camlux.Camera")?)?;
    let lights = part.parts("lights", "light")?;
    let mut textures = Textures::default();
    let materials = part.parts("materials", "material")?;
    let meshes = part.parts("meshes", "mesh")?;
    let meshes = meshes.iter().map(|mesh| {
        let known = mesh.object.cast::<Mesh>();
        let known = known.map_err(|_| mesh.type_error("is not a camlux.Mesh", "give one"))?;
        Ok(known.get().instance.clone())
    });
    let mut scene = camlux::Scene {
        camera,
        sensor: part
            .part("sensor")?
            .map(|sensor| sensor_from(&sensor))
            .transpose()?,
        vignetting_map: part
            .part("vignetting_map")?
            .map(|map| vignetting_map_from(&map.object))
            .transpose()?,
        tof: part.part("tof")?.map(|tof| tof_from(&tof)).transpose()?,
        lights: lights.iter().map(placed_from).collect::<PyResult<_>>()?,
        meshes: meshes.collect::<PyResult<_>>()?,
        materials: materials
            .iter()
            .map(|material| textures.material(material))
            .collect::<PyResult<_>>()?,
        textures: Vec::new(),
        direct: Direct {
            shadow: part.choice("shadow", &Shadow::ALL, Shadow::name)?,
        },
        left_out: Vec::new(),
        indirect: part
            .part("indirect")?
            .map(|part| indirect_from(&part))
            .transpose()?,
    };
    for (index, material) in scene.materials.iter().enumerate() {
        let contradicts = |role, texture: usize| textures.list[texture].get().0.contradicts(role);
        let encodings = material.validate_encodings(index, contradicts);
        encodings.map_err(raised)?;
    }
    let sources = textures.list.iter().map(|texture| &texture.get().0);
    scene.textures = scene::in_their_roles(sources, &mut scene.materials);
    Ok(scene)
}

fn vignetting_map_from(values: &Bound<'_, PyAny>) -> PyResult<Shared<VignettingMap>> {
    let array = as_array(values)?;
    let &[height, width] = array.shape() else {
        let shape = array.shape();
        return Err(SceneError::new_err(format!(
            "vignetting_map has the shape {shape:?}; give (height, width)"
        )));
    };
    let values: Vec<f64> = numbers(&array, "vignetting_map", "numbers")?;
    let map = VignettingMap {
        size_px: [width as u32, height as u32],
        values: values.into_iter().map(|value| value as f32).collect(),
    };
    Ok(map.into())
}

/// The cameras of a list.
pub fn cameras_from(list: &Bound<'_, PyAny>) -> PyResult<Vec<Camera>> {
    let wrong = |_| ArgumentTypeError::new_err("cameras is not a list of camlux.Camera; give one");
    let cameras = list.try_iter().map_err(wrong)?.enumerate();
    let cameras =
        cameras.map(|(place, camera)| camera_from(&Part::new(camera?, format!("camera {place}"))?));
    cameras.collect()
}

fn camera_from(part: &Part) -> PyResult<Camera> {
    let samples = part.count("samples")?;
    let filter = part.choice("filter", &PixelFilter::ALL, PixelFilter::name)?;
    let intrinsics = part.part("intrinsics_px")?;
    let intrinsics = intrinsics.map(|k| intrinsics_from(&k)).transpose()?;
    let distortion = part.part("distortion")?;
    let distortion = distortion.map(|d| distortion_from(&d)).transpose()?;
    let fov_deg = ["fov_x_deg", "fov_y_deg"].map(|name| part.optional_number(name));
    let [fov_x_deg, fov_y_deg] = fov_deg;
    let projection = part.choice("projection", &["equirectangular", "orthographic"], |name| {
        name
    })?;
    let height_m = part.optional_number("height_m")?;
    if (projection == Some("orthographic")) != height_m.is_some() {
        return Err(part.error(
            "height_m and projection = \"orthographic\" are not given together",
            "give both, or neither: height_m is the height of the image of an orthographic camera",
        ));
    }
    let lens = match (fov_x_deg?, fov_y_deg?, intrinsics, distortion) {
        (None, None, None, None) if projection.is_some() => match height_m {
            Some(height_m) => Lens::Orthographic { height_m },
            None => Lens::Equirectangular,
        },
        _ if projection.is_some() => {
            return Err(part.error(
                "projection is given with a lens",
                "leave out fov_x_deg, fov_y_deg, intrinsics_px and distortion, or projection",
            ));
        }
        (Some(fov_x_deg), None, None, None) => Lens::FovX { fov_x_deg },
        (None, Some(fov_y_deg), None, None) => Lens::FovY { fov_y_deg },
        (None, None, Some(intrinsics), None) => Lens::Intrinsics(intrinsics),
        (None, None, Some(intrinsics), Some(distortion)) => Lens::Distorted {
            intrinsics,
            distortion,
        },
        _ => {
            return Err(part.error(
                "the lens is missing or ambiguous",
                "give one of fov_x_deg, fov_y_deg, intrinsics_px and projection; distortion needs intrinsics_px",
            ));
        }
    };
    Ok(Camera {
        resolution_px: part.need("resolution_px", "give width and height, such as (400, 300)")?,
        position_m: part.vector("position_m")?,
        look_at_m: part.vector("look_at_m")?,
        up: part.vector("up")?,
        lens,
        pixel_sampling: match samples {
            1 => None,
            samples => Some(PixelSampling {
                samples,
                filter: filter.unwrap_or_default(),
            }),
        },
    })
}

fn intrinsics_from(part: &Part) -> PyResult<Intrinsics> {
    Ok(Intrinsics {
        fx: part.number("fx")?,
        fy: part.number("fy")?,
        cx: part.number("cx")?,
        cy: part.number("cy")?,
        skew: part.number("skew")?,
    })
}

fn distortion_from(part: &Part) -> PyResult<Distortion> {
    fn coefficients<const N: usize>(part: &Part, names: [&str; N]) -> PyResult<[f64; N]> {
        let mut values = [0.0; N];
        for (value, name) in values.iter_mut().zip(names) {
            *value = part.number(name)?;
        }
        Ok(values)
    }
    // A fisheye lens has no tangential coefficients.
    if part.object.hasattr("p1")? {
        Ok(Distortion::Rational(coefficients(
            part,
            Distortion::RATIONAL,
        )?))
    } else {
        Ok(Distortion::Fisheye(coefficients(
            part,
            Distortion::FISHEYE,
        )?))
    }
}

fn placed_from(part: &Part) -> PyResult<PlacedLight> {
    let names = |_: Carrier| "camera";
    Ok(PlacedLight {
        light: light_from(part)?,
        relative_to: part.choice("relative_to", &[Carrier::Camera], names)?,
    })
}

fn light_from(part: &Part) -> PyResult<Light> {
    let kind = kind_of(part, "kind");
    if let Some(mut profile) = Profile::of_kind(&kind) {
        let position_m = part.vector("position_m")?;
        let direction = profile.has_axis().then(|| part.vector("direction"));
        let direction = direction.transpose()?.unwrap_or(DVec3::Z);
        if let Some(numbers) = profile.numbers_mut() {
            part.read(numbers)?;
        }
        let power_w = part.bands("power_w")?;
        return Ok(Light::spot(position_m, direction, profile, power_w));
    }
    Ok(match &*kind {
        "directional" => {
            let direction = part.vector("direction")?;
            Light::directional(direction, part.bands("irradiance_w_m2")?)
        }
        "pattern" => {
            let pattern: Bound<PyAny> = part.need("pattern", "give a camlux.Pattern")?;
            let position_m = part.vector("position_m")?;
            let direction = part.vector("direction")?;
            let up = part.vector("up")?;
            let profile = if let Ok(pattern) = pattern.cast::<Pattern>() {
                Profile::Measured(pattern.get().0.clone())
            } else if let Ok(image) = pattern.cast::<ProjectedImage>() {
                Profile::Projected(image.get().0.clone())
            } else {
                let hint = "give a camlux.Pattern or a camlux.ProjectedImage";
                return Err(part.type_error("pattern is of another class", hint));
            };
            Light::with_profile(position_m, direction, up, profile, part.bands("power_w")?)
        }
        "area" => {
            let direction = part.vector("direction")?;
            let size_m = part.optional("size_m", "give width and height, metres")?;
            let up: Option<[f64; 3]> = part.optional("up", "give three numbers")?;
            let shape = match (size_m, part.optional_number("radius_m")?, up) {
                (Some(size_m), None, Some(_)) => AreaShape::Rectangle { size_m },
                (None, Some(radius_m), _) => AreaShape::Disc { radius_m },
                _ => {
                    return Err(part.error(
                        "its shape is missing or ambiguous",
                        "give size_m=(width, height) and up, or radius_m",
                    ));
                }
            };
            let position_m = part.vector("position_m")?;
            let power_w = part.bands("power_w")?;
            Light::area(position_m, direction, up.map(DVec3::from), shape, power_w)
        }
        _ => {
            let mut classes = Vec::from_iter(Light::KINDS.map(light_class));
            classes.dedup();
            return Err(wrong_class(part, &classes, ""));
        }
    })
}

/// What an object of a scene is, by a variable of its class. Empty for other objects.
fn kind_of(part: &Part, variable: &str) -> String {
    let kind = part.object.getattr(variable);
    kind.and_then(|kind| kind.extract()).unwrap_or_default()
}

fn wrong_class(part: &Part, classes: &[String], or_none: &str) -> PyErr {
    let (last, others) = classes.split_last().expect("there are classes");
    let hint = format!("give a {} or {last}{or_none}", others.join(", "));
    part.type_error(format_args!("is of {}", part.object.get_type()), &hint)
}

/// The textures of a scene, each once.
#[derive(Default)]
struct Textures<'py> {
    list: Vec<Bound<'py, Texture>>,
}

impl<'py> Textures<'py> {
    fn index(&mut self, texture: &Bound<'py, Texture>) -> usize {
        let known = self.list.iter().position(|known| known.is(texture));
        known.unwrap_or_else(|| {
            self.list.push(texture.clone());
            self.list.len() - 1
        })
    }

    /// The lookup of that name, which is a texture or says how one is looked up.
    fn lookup(&mut self, part: &Part<'py>, name: &str) -> PyResult<Option<TextureLookup>> {
        let Some(given) = part.part(name)? else {
            return Ok(None);
        };
        if let Ok(texture) = given.object.cast::<Texture>() {
            return Ok(Some(self.index(texture).into()));
        }
        if !given.object.hasattr("texcoord_set")? {
            let hint = "give a camlux.Texture, a camlux.TextureLookup, or None";
            let problem = format_args!("{name} is of {}", given.object.get_type());
            return Err(part.type_error(problem, hint));
        }
        let given = Part::new(given.object, format!("{}: {name}", part.at))?;
        let texture: Bound<'py, Texture> = given.need("texture", "give a camlux.Texture")?;
        let wrap: [String; 2] =
            given.need("wrap", "give two strings, such as (\"repeat\", \"clamp\")")?;
        let wrap = wrap.map(|word| {
            let known = Wrap::ALL.into_iter().find(|wrap| wrap.name() == word);
            let hint = "give one of: repeat, mirror, clamp";
            known.ok_or_else(|| given.error(format_args!("wrap is \"{word}\""), hint))
        });
        let [wrap_u, wrap_v] = wrap;
        let filter = given.choice("filter", &Filter::ALL, Filter::name)?;
        Ok(Some(TextureLookup {
            texture: self.index(&texture),
            texcoord_set: given.count("texcoord_set")?,
            transform: given.need("transform", "give two rows of three numbers")?,
            wrap: [wrap_u?, wrap_v?],
            filter: filter.unwrap_or_default(),
        }))
    }

    fn material(&mut self, part: &Part<'py>) -> PyResult<Material> {
        let ks = part.bands("ks")?;
        let shininess = part.optional_number("shininess")?;
        // A default exponent such as 1 would silently choose a very wide lobe.
        if shininess.is_none() && ks.iter().any(|&ks| ks > 0.0) {
            let problem = format_args!("ks is {ks:?}, but shininess is None");
            return Err(part.error(problem, "set shininess to an exponent such as 20"));
        }
        Ok(Material {
            name: part.text("name")?,
            kd: part.bands("kd")?,
            ks,
            shininess: shininess.unwrap_or(1.0),
            kd_texture: self.lookup(part, "kd_texture")?,
            ks_texture: self.lookup(part, "ks_texture")?,
            shininess_texture: self.lookup(part, "shininess_texture")?,
            normal_texture: self.lookup(part, "normal_texture")?,
            alpha_texture: self.lookup(part, "alpha_texture")?,
            alpha_cutoff: part.number("alpha_cutoff")?,
            microfacets: part.parameters("microfacets", MetallicRoughness::DEFAULT)?,
            metallic_roughness_texture: self.lookup(part, "metallic_roughness_texture")?,
            emission_w_sr_m2: part.bands("emission_w_sr_m2")?,
            emission_texture: self.lookup(part, "emission_texture")?,
            is_one_sided: part.flag("one_sided")?,
        })
    }
}

fn sensor_from(part: &Part) -> PyResult<Sensor> {
    let mut sensor = Sensor {
        noise: part.parameters("noise", SensorNoise::DEFAULT)?,
        ..Sensor::DEFAULT
    };
    part.read(&mut sensor)?;
    Ok(sensor)
}

fn tof_from(part: &Part) -> PyResult<TimeOfFlight> {
    let frequencies_hz: Vec<f64> = part.need("frequencies_hz", "give a list of numbers")?;
    let contrasts: Vec<f64> = match part.number("contrasts") {
        Ok(one) => vec![one; frequencies_hz.len()],
        Err(_) => part.need("contrasts", "give a number, or one for each frequency")?,
    };
    let output = part.choice("output", &ChargeUnit::ALL, ChargeUnit::name)?;
    Ok(TimeOfFlight {
        frequencies_hz,
        phase_count: part.count("phase_count")?,
        contrasts,
        band_weights: part.bands("band_weights")?,
        phase_offset_deg: part.number("phase_offset_deg")?,
        ambient_lights: part.need("ambient_lights", "give a list of indices of lights")?,
        output: output.unwrap_or_default(),
        noise: part.parameters("noise", SensorNoise::DEFAULT)?,
    })
}

fn indirect_from(part: &Part) -> PyResult<IndirectLight> {
    let name = kind_of(part, "estimator");
    let mut indirect = IndirectLight::from_name(&name).ok_or_else(|| {
        let classes = IndirectLight::all().map(|indirect| indirect.parameters().name().into());
        wrong_class(part, &classes, ", or None")
    })?;
    part.read(indirect.parameters_mut())?;
    Ok(indirect)
}

/// Implements `camlux.Scene.validate`.
#[pyfunction]
pub fn validate_scene(scene: &Bound<'_, PyAny>) -> PyResult<()> {
    scene_from(scene)?.validate().map_err(raised)
}

/// Implements `camlux.Scene.save`.
#[pyfunction]
pub fn save_scene(py: Python, scene: &Bound<'_, PyAny>, folder: PathBuf) -> PyResult<()> {
    let scene = scene_from(scene)?;
    py.detach(|| scene.save(&folder)).map_err(raised)
}

/// Implements `camlux.Scene.warnings`.
#[pyfunction]
pub fn scene_warnings(scene: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    let scene = scene_from(scene)?;
    scene.validate().map_err(raised)?;
    Ok(scene.warnings())
}
