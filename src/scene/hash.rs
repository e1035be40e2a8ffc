//! The hash of a scene, so that an image can state what it was made from.

use super::{
    BayerPattern, Camera, Direct, IndirectLight, Intrinsics, Lens, Light, Material, Mesh,
    ParameterValue, Parameters, Pattern, Photodetector, PixelSampling, ProjectedImage, Scene,
    Sensor, SensorNoise, Shadow, Texture, TextureLookup, TimeOfFlight, VignettingMap,
};

/// The beginning of every hashed scene. Change it when the format of the bytes after it changes.
const FORM: &[u8] = b"camlux scene 6";

impl Scene {
    /// BLAKE3 hash in hexadecimal (64 digits) of everything that the image depends on. Names and file paths are left out.
    ///
    /// Equal for two scenes whose values are equal; the order of lights, meshes and materials counts.
    pub fn hash(&self) -> String {
        let world = self.in_world();
        let Scene {
            camera,
            sensor,
            vignetting_map,
            tof,
            lights,
            meshes,
            materials,
            textures,
            direct: Direct { shadow },
            indirect,
            left_out: _,
        } = &*world;
        let mut bytes = Bytes::default();
        bytes.update(FORM);
        bytes.camera(camera);
        bytes.list(sensor.as_slice(), |sensor| {
            let Sensor {
                pixel_pitch_um: [width_um, height_um],
                exposure_time_s,
                duty_cycle,
                wavelength_nm: _,
                quantum_efficiency: _,
                f_number: _,
                vignetting: _,
                band_weights: _,
                bayer: _,
                monochrome: _,
                noise: _,
            } = *sensor;
            [width_um, height_um, exposure_time_s, duty_cycle]
        });
        if let Some(f_number) = sensor.and_then(|sensor| sensor.f_number) {
            bytes.name("f_number");
            bytes.numbers([f_number]);
        }
        if let Some(vignetting) = sensor.and_then(|sensor| sensor.vignetting) {
            bytes.name("vignetting");
            bytes.numbers(vignetting.0);
        }
        if let Some(map) = vignetting_map {
            bytes.name("vignetting_map");
            bytes.update(&map.digest(digest_of_map));
        }
        bytes.name(shadow.map_or("chosen", Shadow::name));
        bytes.name(indirect.map_or("none", |indirect| indirect.name()));
        if let Some(indirect) = indirect {
            // The order in which they were added, so that scenes keep their hash.
            const FIRST: [&str; 8] = [
                "rsm_size",
                "target_error",
                "error_norm",
                "target_range_error_mm",
                "max_ms",
                "max_rays",
                "interpolation_error",
                "stderr_layer",
            ];
            let added = IndirectLight::all_parameters().map(|parameter| parameter.name);
            let added = added.filter(|name| *name != "bounces" && !FIRST.contains(name));
            for name in FIRST.into_iter().chain(added) {
                bytes.parameter(indirect.value(name));
            }
            // The same for scenes of a single bounce.
            if let Some(gather) = indirect.gather().filter(|gather| gather.bounces > 1) {
                bytes.name("bounces");
                bytes.numbers([f64::from(gather.bounces)]);
            }
        }
        bytes.length(lights);
        lights.iter().for_each(|light| bytes.light(light));
        bytes.length(materials);
        materials
            .iter()
            .for_each(|material| bytes.material(material));
        bytes.length(textures);
        for texture in textures {
            bytes.update(&texture.digest(digest_of_texture));
        }
        bytes.length(meshes);
        for mesh in meshes {
            bytes.update(&mesh.digest(digest_of_mesh));
        }
        // Scenes without time of flight keep their hash from before time of flight existed.
        if let Some(tof) = tof {
            bytes.time_of_flight(tof);
            bytes.photodetector(*sensor);
        }
        // The same for sensors whose electrons are not counted.
        if let Some(counting) = sensor.filter(|sensor| sensor.counted_electrons().is_some()) {
            bytes.name("electrons");
            bytes.photodetector(Some(counting));
            bytes.numbers(counting.band_weights);
            bytes.name(counting.bayer.map_or("all", BayerPattern::name));
            bytes.numbers([f64::from(u8::from(counting.monochrome))]);
            bytes.noise(counting.noise);
        }
        // The same for cameras whose pixels are points.
        if let Some(PixelSampling { samples, filter }) = camera.pixel_sampling {
            bytes.name(filter.name());
            bytes.numbers([f64::from(samples)]);
        }
        // The same for meshes that are in world space.
        for (i, instance) in meshes.iter().enumerate() {
            if !instance.is_in_world_space() {
                bytes.name("placed");
                bytes.numbers([i as f64]);
                bytes.numbers(instance.to_world.to_cols_array());
            }
        }
        bytes.finalize().to_hex().to_string()
    }
}

/// The bytes of a scene. Lists and names begin with their length, so that no two scenes give the same bytes. Structs are destructured
/// without `..`, so that a new field cannot be forgotten.
#[derive(Default)]
struct Bytes {
    hasher: blake3::Hasher,
    /// Bytes to hash together, which is several times as fast as hashing one number after the other.
    pending: Vec<u8>,
}

/// The number of bytes that are hashed at once.
const BLOCK_BYTES: usize = 64 << 10;

impl Bytes {
    fn update(&mut self, bytes: &[u8]) {
        self.pending.extend_from_slice(bytes);
        if self.pending.len() >= BLOCK_BYTES {
            self.hasher.update(&self.pending);
            self.pending.clear();
        }
    }

    fn finalize(mut self) -> blake3::Hash {
        self.hasher.update(&self.pending);
        self.hasher.finalize()
    }

    fn numbers<const N: usize>(&mut self, numbers: [f64; N]) {
        // -0 and 0 render the same; adding 0 makes both 0.
        let bytes = numbers.map(|number| (number + 0.0).to_le_bytes());
        self.update(bytes.as_flattened());
    }

    fn length<T>(&mut self, items: &[T]) {
        self.numbers([items.len() as f64]);
    }

    fn list<T, const N: usize>(&mut self, items: &[T], numbers_of: impl Fn(&T) -> [f64; N]) {
        self.length(items);
        items.iter().for_each(|item| self.numbers(numbers_of(item)));
    }

    fn name(&mut self, name: &str) {
        self.length(name.as_bytes());
        self.update(name.as_bytes());
    }

    fn parameter(&mut self, value: Option<ParameterValue>) {
        match value {
            None => self.numbers([0.0]),
            Some(ParameterValue::Number(number)) => self.numbers([1.0, number]),
            Some(ParameterValue::Pair([a, b])) => self.numbers([1.0, a, b]),
            Some(ParameterValue::Bands([a, b, c]) | ParameterValue::Coefficients([a, b, c])) => {
                self.numbers([1.0, a, b, c]);
            }
            Some(ParameterValue::Count(count)) => self.numbers([1.0, count as f64]),
            Some(ParameterValue::Name(name)) => self.name(name),
            Some(ParameterValue::Flag(flag)) => self.numbers([1.0, f64::from(flag)]),
        }
    }

    fn camera(&mut self, camera: &Camera) {
        let Camera {
            resolution_px,
            position_m,
            look_at_m,
            up,
            lens,
            // Hashed at the end of the scene's bytes.
            pixel_sampling: _,
        } = *camera;
        self.numbers(resolution_px.map(f64::from));
        for vector in [position_m, look_at_m, up] {
            self.numbers(vector.to_array());
        }
        match lens {
            Lens::FovY { fov_y_deg } => self.numbers([0.0, fov_y_deg]),
            Lens::FovX { fov_x_deg } => self.numbers([3.0, fov_x_deg]),
            Lens::Equirectangular => self.numbers([4.0]),
            Lens::Orthographic { height_m } => self.numbers([5.0, height_m]),
            Lens::Intrinsics(intrinsics) => self.intrinsics(1.0, intrinsics),
            Lens::Distorted {
                intrinsics,
                distortion,
            } => {
                self.intrinsics(2.0, intrinsics);
                let coefficients = distortion.coefficients();
                let (first, prism_tilt) = coefficients.split_at(coefficients.len().min(8));
                first.iter().for_each(|&value| self.numbers([value]));
                // Lenses without these keep their hash from before there were any.
                if !prism_tilt.is_empty() {
                    self.name("prism and tilt");
                    prism_tilt.iter().for_each(|&value| self.numbers([value]));
                }
            }
        }
    }

    fn intrinsics(&mut self, kind: f64, intrinsics: Intrinsics) {
        let Intrinsics {
            fx,
            fy,
            cx,
            cy,
            skew,
        } = intrinsics;
        self.numbers([kind, fx, fy, cx, cy]);
        if skew != 0.0 {
            self.name("skew");
            self.numbers([skew]);
        }
    }

    fn time_of_flight(&mut self, tof: &TimeOfFlight) {
        let TimeOfFlight {
            frequencies_hz,
            phase_count,
            contrasts,
            band_weights,
            phase_offset_deg,
            ambient_lights,
            output,
            noise,
        } = tof;
        self.name("tof");
        self.list(frequencies_hz, |hz| [*hz]);
        self.list(contrasts, |contrast| [*contrast]);
        self.list(ambient_lights, |light| [*light as f64]);
        self.numbers([f64::from(*phase_count), *phase_offset_deg]);
        self.numbers(*band_weights);
        self.name(output.name());
        self.noise(*noise);
    }

    fn photodetector(&mut self, sensor: Option<Sensor>) {
        let photodetector = sensor.and_then(|sensor| sensor.photodetector());
        self.list(photodetector.as_slice(), |photodetector| {
            let Photodetector {
                wavelength_nm,
                quantum_efficiency,
            } = *photodetector;
            [wavelength_nm, quantum_efficiency]
        });
    }

    fn noise(&mut self, noise: Option<SensorNoise>) {
        self.length(noise.as_slice());
        if let Some(noise) = noise {
            let SensorNoise {
                seed,
                dark_e_per_s,
                read_noise_e,
                full_well_e,
                gain_dn_per_e,
                black_level_dn,
                bits,
                dsnu_e,
                prnu,
            } = noise;
            self.update(&seed.to_le_bytes());
            self.numbers([dark_e_per_s, read_noise_e, full_well_e, gain_dn_per_e]);
            self.numbers([black_level_dn, f64::from(bits)]);
            // Noise without a fixed pattern keeps its hash from before there was one.
            if noise.has_fixed_pattern() {
                self.name("fixed pattern");
                self.numbers([dsnu_e, prnu]);
            }
        }
    }

    fn light(&mut self, light: &Light) {
        self.name(light.kind());
        for (_, numbers) in light.parameters() {
            numbers
                .into_iter()
                .for_each(|number| self.numbers([number]));
        }
        let Some(lamp) = light.lamp() else {
            return;
        };
        if let Some(shape) = lamp.area {
            self.name(shape.name());
        }
        if let Some(digest) = lamp.profile.digest() {
            self.update(&digest);
        }
    }

    fn material(&mut self, material: &Material) {
        for reflectance in material.reflectance() {
            for value in reflectance.values {
                self.numbers([*value]);
            }
        }
        let microfacets = material.microfacets.iter();
        for (_, value) in microfacets.flat_map(Parameters::named_values) {
            let number = value.and_then(ParameterValue::number);
            self.numbers([number.unwrap_or_default()]);
        }
        // Materials without these keep their hash from before there were any.
        if material.is_emissive() {
            self.name("emission");
            self.numbers(material.emission_w_sr_m2);
        }
        if material.is_one_sided {
            self.name("one-sided");
        }
        self.numbers([material.alpha_cutoff]);
        for (role, lookup) in material.textures() {
            let TextureLookup {
                texture,
                texcoord_set,
                transform,
                wrap,
                filter,
            } = lookup;
            self.name(role.field());
            self.numbers([texture as f64, f64::from(texcoord_set)]);
            transform.into_iter().for_each(|row| self.numbers(row));
            self.numbers(wrap.map(|wrap| f64::from(wrap as u8)));
            self.numbers([f64::from(filter as u8)]);
        }
    }
}

pub(super) fn digest_of_pattern(pattern: &Pattern) -> [u8; 32] {
    let Pattern {
        gammas_rad,
        planes_rad,
        intensities,
        peak: _,
    } = pattern;
    let mut bytes = Bytes::default();
    for numbers in [gammas_rad, planes_rad, intensities] {
        bytes.list(numbers, |&number| [number]);
    }
    *bytes.finalize().as_bytes()
}

pub(super) fn digest_of_image(image: &ProjectedImage) -> [u8; 32] {
    let ProjectedImage {
        size_px,
        intrinsics:
            Intrinsics {
                fx,
                fy,
                cx,
                cy,
                // Refused by `ProjectedImage::check`.
                skew: _,
            },
        values,
    } = image;
    let mut bytes = Bytes::default();
    bytes.numbers(size_px.map(f64::from));
    bytes.numbers([*fx, *fy, *cx, *cy]);
    bytes.list(values, |&value| [value.into()]);
    *bytes.finalize().as_bytes()
}

fn digest_of_map(map: &VignettingMap) -> [u8; 32] {
    let VignettingMap { size_px, values } = map;
    let mut bytes = Bytes::default();
    bytes.numbers(size_px.map(f64::from));
    bytes.list(values, |&value| [value.into()]);
    bytes.finalize().into()
}

fn digest_of_texture(texture: &Texture) -> [u8; 32] {
    let Texture {
        name: _,
        size_px,
        texels,
    } = texture;
    let mut bytes = Bytes::default();
    bytes.numbers(size_px.map(f64::from));
    bytes.numbers([texels.len() as f64]);
    texels
        .reflectances()
        .for_each(|texel| bytes.numbers(texel.map(f64::from)));
    bytes.finalize().into()
}

fn digest_of_mesh(mesh: &Mesh) -> [u8; 32] {
    let Mesh {
        name: _,
        positions_m,
        normals,
        texcoords,
        texcoords_1,
        colors,
        tangents,
        triangles,
        triangle_materials,
    } = mesh;
    let mut bytes = Bytes::default();
    bytes.list(positions_m, |position| position.to_array());
    bytes.list(normals, |normal| normal.to_array());
    bytes.list(texcoords, |uv| *uv);
    bytes.list(texcoords_1, |uv| *uv);
    bytes.list(colors, |color| color.map(f64::from));
    bytes.list(tangents, |tangent| tangent.map(f64::from));
    bytes.list(triangles, |vertices| vertices.map(f64::from));
    bytes.list(triangle_materials, |&material| [f64::from(material)]);
    bytes.finalize().into()
}
