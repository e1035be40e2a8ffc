//! Makes objects of the classes of scene.py from a scene of the engine.

use std::path::PathBuf;

use camlux::scene::{
    self, Camera, Carrier, Distortion, Lens, Material, Parameter, ParameterValue, Parameters,
    PlacedLight, Profile, Sensor, Shadow, Shared, TextureLookup, TimeOfFlight,
};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::errors::{raised, warn_above};
use crate::mesh::meshes;
use crate::parts::{Pattern, ProjectedImage, Texture, array};

/// Implements `camlux.Scene.load`.
#[pyfunction]
pub fn load_scene(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let loaded = py.detach(|| {
        let scene = camlux::Scene::load(&path)?;
        let warnings = scene.warnings();
        Ok((scene, warnings))
    });
    let (scene, warnings) = loaded.map_err(raised)?;
    // `load`, and what checks its arguments.
    warn_above(py, &warnings, 2)?;
    Classes(py.import("camlux.scene")?).scene(&scene)
}

/// The classes of scene.py.
struct Classes<'py>(Bound<'py, PyModule>);

/// Creates an object of a class from its fields by name.
macro_rules! object {
    ($classes:expr, $class:literal, $($name:ident: $value:expr),* $(,)?) => {{
        let fields = PyDict::new($classes.0.py());
        $(fields.set_item(stringify!($name), $value)?;)*
        $classes.0.getattr($class)?.call((), Some(&fields))
    }};
}

/// The objects for materials; their textures are indices into these.
pub fn materials<'py>(
    py: Python<'py>,
    materials: &[Material],
    textures: Vec<Shared<scene::Texture>>,
) -> PyResult<Bound<'py, PyList>> {
    Classes(py.import("camlux.scene")?).materials(materials, textures)
}

/// The class of lights of a kind. A projector is a light whose pattern is an image.
pub fn light_class(kind: &str) -> String {
    let kind = if kind == "projector" { "pattern" } else { kind };
    let (first, rest) = kind.split_at(1);
    format!("{}{rest}Light", first.to_uppercase())
}

/// A tuple, because Python compares tuples by value.
fn triple(vector: impl Into<[f64; 3]>) -> (f64, f64, f64) {
    vector.into().into()
}

impl<'py> Classes<'py> {
    fn scene(&self, scene: &camlux::Scene) -> PyResult<Bound<'py, PyAny>> {
        let py = self.0.py();
        let lights = scene.lights.iter().map(|light| self.light(light));
        object!(self, "Scene",
            camera: self.camera(&scene.camera)?,
            lights: PyList::new(py, lights.collect::<PyResult<Vec<_>>>()?)?,
            meshes: PyList::new(py, meshes(py, &scene.meshes)?)?,
            materials: self.materials(&scene.materials, scene.textures.clone())?,
            indirect: scene.indirect.map(|indirect| self.parameters(indirect.parameters())).transpose()?,
            sensor: scene.sensor.map(|sensor| self.sensor(&sensor)).transpose()?,
            vignetting_map: scene.vignetting_map.as_ref().map(|map| {
                let [width, height] = map.size_px.map(|px| px as usize);
                array(py, map.values.clone(), &[height, width])
            }).transpose()?,
            tof: scene.tof.as_ref().map(|tof| self.tof(tof)).transpose()?,
            shadow: scene.direct.shadow.map(Shadow::name),
        )
    }

    fn camera(&self, camera: &Camera) -> PyResult<Bound<'py, PyAny>> {
        let (fov_x_deg, fov_y_deg, intrinsics) = match camera.lens {
            Lens::FovX { fov_x_deg } => (Some(fov_x_deg), None, None),
            Lens::FovY { fov_y_deg } => (None, Some(fov_y_deg), None),
            Lens::Intrinsics(k) | Lens::Distorted { intrinsics: k, .. } => (None, None, Some(k)),
            Lens::Equirectangular | Lens::Orthographic { .. } => (None, None, None),
        };
        let intrinsics = intrinsics.map(
            |k| object!(self, "Intrinsics", fx: k.fx, fy: k.fy, cx: k.cx, cy: k.cy, skew: k.skew),
        );
        let (projection, height_m) = match camera.lens {
            Lens::Equirectangular => (Some("equirectangular"), None),
            Lens::Orthographic { height_m } => (Some("orthographic"), Some(height_m)),
            _ => (None, None),
        };
        let distortion = camera.distortion().filter(|_| projection.is_none());
        let distortion = distortion.map(|distortion| {
            let (class, names) = match distortion {
                Distortion::Equirectangular => ("RationalDistortion", &[][..]),
                Distortion::Rational(_) => ("RationalDistortion", &Distortion::RATIONAL[..]),
                Distortion::Fisheye(_) => ("FisheyeDistortion", &Distortion::FISHEYE[..]),
            };
            let fields = PyDict::new(self.0.py());
            for (name, value) in names.iter().zip(distortion.coefficients()) {
                fields.set_item(name, value)?;
            }
            self.0.getattr(class)?.call((), Some(&fields))
        });
        let [width, height] = camera.resolution_px;
        object!(self, "Camera",
            resolution_px: (width, height),
            position_m: triple(camera.position_m),
            look_at_m: triple(camera.look_at_m),
            up: triple(camera.up),
            fov_x_deg: fov_x_deg,
            fov_y_deg: fov_y_deg,
            intrinsics_px: intrinsics.transpose()?,
            distortion: distortion.transpose()?,
            samples: camera.pixel_sampling.map_or(1, |sampling| sampling.samples),
            filter: camera.pixel_sampling.map(|sampling| sampling.filter.name()),
            projection: projection,
            height_m: height_m,
        )
    }

    fn light(&self, placed: &PlacedLight) -> PyResult<Bound<'py, PyAny>> {
        let py = self.0.py();
        let relative_to = match placed.relative_to {
            Some(Carrier::Camera) => Some("camera"),
            Some(Carrier::Mesh(_)) | None => None,
        };
        let fields = PyDict::new(py);
        for (name, numbers) in placed.parameters() {
            match numbers[..] {
                [number] => fields.set_item(name, number)?,
                _ => fields.set_item(name, PyTuple::new(py, numbers)?)?,
            }
        }
        match placed.lamp().map(|lamp| &lamp.profile) {
            Some(Profile::Measured(pattern)) => {
                fields.set_item("pattern", Bound::new(py, Pattern(pattern.clone()))?)?;
            }
            Some(Profile::Projected(image)) => {
                fields.set_item("pattern", Bound::new(py, ProjectedImage(image.clone()))?)?;
            }
            _ => {}
        }
        fields.set_item("relative_to", relative_to)?;
        let class = self.0.getattr(light_class(placed.kind()))?;
        class.call((), Some(&fields))
    }

    fn materials(
        &self,
        materials: &[Material],
        textures: Vec<Shared<scene::Texture>>,
    ) -> PyResult<Bound<'py, PyList>> {
        let py = self.0.py();
        let textures = textures.into_iter();
        let textures = textures.map(|texture| Bound::new(py, Texture(texture.into())));
        let textures = textures.collect::<PyResult<Vec<_>>>()?;
        let materials = materials.iter().map(|m| self.material(m, &textures));
        PyList::new(py, materials.collect::<PyResult<Vec<_>>>()?)
    }

    fn material(
        &self,
        material: &Material,
        textures: &[Bound<'py, Texture>],
    ) -> PyResult<Bound<'py, PyAny>> {
        // Destructured, so that no field is forgotten.
        let Material {
            name,
            kd,
            ks,
            shininess,
            microfacets,
            metallic_roughness_texture,
            emission_w_sr_m2,
            emission_texture,
            is_one_sided,
            kd_texture,
            ks_texture,
            shininess_texture,
            normal_texture,
            alpha_texture,
            alpha_cutoff,
        } = material;
        let texture = |lookup: &Option<TextureLookup>| {
            let lookup = lookup.map(|lookup| self.lookup(lookup, &textures[lookup.texture]));
            lookup.transpose()
        };
        let facets = microfacets.map(|of| self.parameters(&of));
        object!(self, "Material",
            name: name,
            kd: triple(*kd),
            ks: triple(*ks),
            shininess: *shininess,
            kd_texture: texture(kd_texture)?,
            ks_texture: texture(ks_texture)?,
            shininess_texture: texture(shininess_texture)?,
            normal_texture: texture(normal_texture)?,
            alpha_texture: texture(alpha_texture)?,
            alpha_cutoff: *alpha_cutoff,
            microfacets: facets.transpose()?,
            metallic_roughness_texture: texture(metallic_roughness_texture)?,
            emission_w_sr_m2: triple(*emission_w_sr_m2),
            emission_texture: texture(emission_texture)?,
            one_sided: *is_one_sided,
        )
    }

    /// The texture itself if it is looked up in the usual way.
    fn lookup(
        &self,
        lookup: TextureLookup,
        texture: &Bound<'py, Texture>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if lookup == TextureLookup::from(lookup.texture) {
            return Ok(texture.clone().into_any());
        }
        let TextureLookup {
            texture: _,
            texcoord_set,
            transform,
            wrap: [wrap_u, wrap_v],
            filter,
        } = lookup;
        let [along_u, along_v] = transform.map(triple);
        object!(self, "TextureLookup",
            texture: texture,
            texcoord_set: texcoord_set,
            transform: (along_u, along_v),
            wrap: (wrap_u.name(), wrap_v.name()),
            filter: filter.name(),
        )
    }

    fn tof(&self, tof: &TimeOfFlight) -> PyResult<Bound<'py, PyAny>> {
        object!(self, "TimeOfFlight",
            frequencies_hz: &tof.frequencies_hz,
            phase_count: tof.phase_count,
            contrasts: &tof.contrasts,
            band_weights: triple(tof.band_weights),
            phase_offset_deg: tof.phase_offset_deg,
            ambient_lights: &tof.ambient_lights,
            output: tof.output.name(),
            noise: tof.noise.map(|noise| self.parameters(&noise)).transpose()?,
        )
    }

    fn sensor(&self, sensor: &Sensor) -> PyResult<Bound<'py, PyAny>> {
        let made = self.parameters(sensor)?;
        if let Some(noise) = &sensor.noise {
            made.setattr("noise", self.parameters(noise)?)?;
        }
        Ok(made)
    }

    /// An object of the class whose fields are these parameters.
    fn parameters(&self, parameters: &dyn Parameters) -> PyResult<Bound<'py, PyAny>> {
        let fields = PyDict::new(self.0.py());
        for (Parameter { name, .. }, value) in parameters.named_values() {
            match value {
                None => fields.set_item(name, None::<f64>)?,
                Some(ParameterValue::Number(number)) => fields.set_item(name, number)?,
                Some(ParameterValue::Pair([a, b])) => fields.set_item(name, (a, b))?,
                Some(ParameterValue::Bands(three) | ParameterValue::Coefficients(three)) => {
                    fields.set_item(name, triple(three))?;
                }
                Some(ParameterValue::Count(count)) => fields.set_item(name, count)?,
                Some(ParameterValue::Name(word)) => fields.set_item(name, word)?,
                Some(ParameterValue::Flag(flag)) => fields.set_item(name, flag)?,
            }
        }
        self.0.getattr(parameters.name())?.call((), Some(&fields))
    }
}
