//! The scene: camera, sensor, lights, meshes, materials, and options for indirect light.
//!
//! Lengths are in metres, angles in the scene description in degrees, powers in watts. Positions are f64, so that a scene far from the
//! origin keeps its detail. Build a [`Scene`] from slices, or load one with [`Scene::load`].

mod area;
mod bounds;
mod camera;
mod camera_pose;
mod carrier;
mod cone;
mod distortion;
mod emissive_surfaces;
mod hash;
mod indirect;
mod instance;
mod lens_lights;
mod light;
mod material;
mod mesh;
mod mesh_file;
mod metallic_roughness;
mod parameters;
mod pattern;
mod pattern_integral;
mod pixel_sampling;
mod profile;
mod projected_image;
mod sensor;
mod sensor_noise;
mod shared;
mod texels;
mod texture_source;
mod tof;
mod validate;
mod validate_surface;
mod vignetting_map;
mod warnings;

use std::collections::HashSet;

pub use area::AreaShape;
pub use bounds::{BoundingBox, BoundingSphere};
pub use camera::{Camera, CameraBasis, Intrinsics, Lens};
pub use camera_pose::CameraAxes;
pub(crate) use camera_pose::point_ahead;
pub use carrier::{Carrier, PlacedLight};
pub use cone::ConeIntegral;
pub use distortion::Distortion;
pub(crate) use emissive_surfaces::{EmissionPoint, EmissiveSurfaces};

pub use indirect::*;
pub use instance::Instance;
pub use lens_lights::LensLights;
pub use light::{Lamp, Light};
pub(crate) use material::Reflectance;
pub use material::{Filter, Material, Texture, TextureLookup, Wrap};
pub use mesh::Mesh;
pub use mesh_file::{MeshFile, MeshOptions};
pub use metallic_roughness::MetallicRoughness;
pub(crate) use metallic_roughness::SMOOTHEST;
pub use parameters::{Limits, Parameter, ParameterKind, ParameterValue, Parameters};
pub(crate) use pattern::{Measured, place};
pub use pattern::{Pattern, PatternAxes};
pub use pattern_integral::PatternIntegral;
pub use pixel_sampling::{PixelFilter, PixelSampling};
pub use profile::*;
pub use projected_image::ProjectedImage;
pub use sensor::{BayerPattern, CountedElectrons, Photodetector, Sensor, Vignetting};
pub use sensor_noise::SensorNoise;
pub use shared::Shared;
pub use texels::{Encoding, Texels};
pub use texture_source::{Component, TextureRole, TextureSource, in_their_roles};
pub(crate) use tof::MAX_PHASES;
pub use tof::{ChargeUnit, MAX_FREQUENCIES, PHASE_COUNTS, TimeOfFlight};
pub(crate) use validate::Places;
pub use vignetting_map::VignettingMap;

/// Radiometric value per band (R, G, B). A monochrome quantity has the same value three times.
pub type Bands = [f64; 3];

/// Everything that a frame is computed from.
#[derive(Debug, Clone)]
pub struct Scene {
    pub camera: Camera,
    /// `None`: frames have no layers `energy`, `electrons` and `dn`.
    pub sensor: Option<Sensor>,
    /// Measured vignetting as an image, in place of that of the sensor. With its f-number.
    pub vignetting_map: Option<Shared<VignettingMap>>,
    /// How the camera measures path lengths; needs a sensor with a [`Photodetector`].
    pub tof: Option<TimeOfFlight>,
    pub lights: Vec<PlacedLight>,
    /// The placed meshes. Instances that share a mesh store it once.
    pub meshes: Vec<Instance>,
    /// Indexed by [`Mesh::triangle_materials`].
    pub materials: Vec<Material>,
    /// Indexed by [`Material::kd_texture`].
    pub textures: Vec<Shared<Texture>>,
    /// How direct light is computed.
    pub direct: Direct,
    /// `None`: the frame holds direct light only.
    pub indirect: Option<IndirectLight>,
    /// Features of the scene's files that are not modelled, for [`Scene::warnings`].
    pub left_out: Vec<String>,
}

/// A part as warnings name it: by its name, or by its index if it has none.
pub(crate) fn named(kind: &str, index: usize, name: &str) -> String {
    match name {
        "" => format!("{kind} {index}"),
        name => format!("{kind} \"{name}\""),
    }
}

impl Scene {
    /// The meshes, each listed once however often it is placed.
    pub(crate) fn distinct_meshes(&self) -> Vec<&Shared<Mesh>> {
        let mut seen = HashSet::new();
        let meshes = self.meshes.iter().map(|instance| &instance.mesh);
        meshes.filter(|mesh| seen.insert(mesh.id())).collect()
    }

    /// The same scene with a separate mesh in world space for each instance.
    pub fn flattened(&self) -> Scene {
        let mut flattened = self.clone();
        for instance in &mut flattened.meshes {
            *instance = Instance {
                name: std::mem::take(&mut instance.name),
                ..Instance::from(instance.placed())
            };
        }
        flattened
    }

    /// The same surfaces before the same camera, without light and sensor: for layers of geometry alone.
    #[doc(hidden)]
    pub fn geometry(&self) -> Scene {
        Scene {
            camera: Camera {
                pixel_sampling: None,
                ..self.camera
            },
            sensor: None,
            tof: None,
            lights: Vec::new(),
            indirect: None,
            ..self.clone()
        }
    }

    /// Whether a triangle of the mesh has such a material. The scene must be validated.
    pub(crate) fn has_material(&self, mesh: &Mesh, is_such: impl Fn(&Material) -> bool) -> bool {
        let are_such: Vec<bool> = self.materials.iter().map(is_such).collect();
        let mut of_triangles = mesh.triangle_materials.iter();
        // Most scenes have no such material, so their triangles need not be checked.
        are_such.contains(&true) && of_triangles.any(|&material| are_such[material as usize])
    }

    /// Whether no light emits anything.
    pub(crate) fn is_dark(&self) -> bool {
        self.lights.iter().all(|light| light.emission() == [0.0; 3])
    }

    /// Whether a surface emits light. The scene must be validated.
    pub(crate) fn has_emission(&self) -> bool {
        self.meshes
            .iter()
            .any(|instance| self.has_material(&instance.mesh, Material::is_emissive))
    }

    /// Whether the scene has an area light.
    pub(crate) fn has_area_light(&self) -> bool {
        self.lights.iter().any(|light| light.has_area())
    }

    /// Whether a surface has cut-outs. The scene must be validated.
    pub(crate) fn has_cutouts(&self) -> bool {
        self.distinct_meshes().iter().any(|mesh| {
            let cuts = |m: &Material| m.alpha_texture.is_some_and(|lookup| mesh.shows(&lookup));
            self.has_material(mesh, cuts)
        })
    }
}

/// How direct light is computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Direct {
    /// `None`: rays if indirect light casts rays anyway, surfaces have cut-outs or lights have an area; otherwise maps.
    pub shadow: Option<Shadow>,
}

/// How the visibility V(L,P) of direct light is found. See `docs/model.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shadow {
    /// From a map of what the light sees: its RSM if that is fine enough, otherwise a separate shadow map. Not for surfaces with cut-outs
    /// or area lights.
    Map,
    /// By a ray from P to L against all triangles: exact except for rounding.
    Rays,
}

impl Shadow {
    /// Both values, in the order of the documentation.
    pub const ALL: [Shadow; 2] = [Shadow::Map, Shadow::Rays];

    /// The name used in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Shadow::Map => "map",
            Shadow::Rays => "rays",
        }
    }
}
