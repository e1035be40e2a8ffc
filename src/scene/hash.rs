//! A fingerprint of a scene, so that an image can say what it was made from.

use super::{
    Camera, Direct, IndirectLight, Intrinsics, Lens, Light, Material, Mesh, Scene, Sensor, Shadow,
    Shared, Texture,
};

/// Begins every hashed scene; to be changed with the form of the bytes behind it.
const FORM: &[u8] = b"camlux scene 3";

impl Scene {
    /// BLAKE3 in hexadecimal (64 digits) over everything that the image depends on. Names and file paths are left out.
    ///
    /// Equal for two scenes whose values are equal; the order of lights, meshes and materials counts.
    pub fn hash(&self) -> String {
        let Scene {
            camera,
            sensor,
            lights,
            meshes,
            materials,
            textures,
            direct,
            indirect,
        } = self;
        let mut bytes = Bytes(blake3::Hasher::new());
        bytes.0.update(FORM);
        bytes.camera(camera);
        bytes.option(sensor.as_ref(), Bytes::sensor);
        bytes.direct(direct);
        bytes.option(indirect.as_ref(), Bytes::indirect);
        bytes.list(lights, Bytes::light);
        bytes.list(materials, Bytes::material);
        bytes.list(textures, |bytes, texture| {
            bytes.digest(texture, Bytes::texture)
        });
        bytes.list(meshes, |bytes, mesh| bytes.digest(mesh, Bytes::mesh));
        bytes.0.finalize().to_hex().to_string()
    }
}

/// Every list begins with its length and every variant with a tag, so that no two scenes give the same bytes.
/// Structs are taken apart without `..`, so that a new field cannot be forgotten.
struct Bytes(blake3::Hasher);

impl Bytes {
    fn digest<T>(&mut self, value: &Shared<T>, add: impl FnOnce(&mut Bytes, &T)) {
        let digest = value.digest(|value| {
            let mut bytes = Bytes(blake3::Hasher::new());
            add(&mut bytes, value);
            bytes.0.finalize().into()
        });
        self.0.update(&digest);
    }

    fn whole(&mut self, value: u64) {
        self.0.update(&value.to_le_bytes());
    }

    fn indices(&mut self, values: &[u32]) {
        for value in values {
            self.0.update(&value.to_le_bytes());
        }
    }

    fn numbers(&mut self, values: &[f64]) {
        for value in values {
            // -0 and 0 render the same; the sum is 0 for both.
            self.0.update(&(value + 0.0).to_le_bytes());
        }
    }

    fn list<T>(&mut self, items: &[T], item: impl Fn(&mut Self, &T)) {
        self.whole(items.len() as u64);
        for value in items {
            item(self, value);
        }
    }

    fn option<T>(&mut self, value: Option<&T>, some: impl Fn(&mut Self, &T)) {
        self.whole(u64::from(value.is_some()));
        if let Some(value) = value {
            some(self, value);
        }
    }

    fn camera(&mut self, camera: &Camera) {
        let Camera {
            resolution_px,
            position_m,
            look_at_m,
            up,
            lens,
        } = camera;
        self.indices(resolution_px);
        for vector in [position_m, look_at_m, up] {
            self.numbers(&vector.to_array());
        }
        match *lens {
            Lens::FovY { fov_y_deg } => {
                self.whole(0);
                self.numbers(&[fov_y_deg]);
            }
            Lens::Intrinsics(Intrinsics { fx, fy, cx, cy }) => {
                self.whole(1);
                self.numbers(&[fx, fy, cx, cy]);
            }
        }
    }

    fn sensor(&mut self, sensor: &Sensor) {
        let Sensor {
            pixel_pitch_um,
            exposure_time_s,
            duty_cycle,
        } = sensor;
        self.numbers(pixel_pitch_um);
        self.numbers(&[*exposure_time_s, *duty_cycle]);
    }

    fn name(&mut self, name: &str) {
        self.whole(name.len() as u64);
        self.0.update(name.as_bytes());
    }

    fn direct(&mut self, direct: &Direct) {
        let Direct { shadow } = direct;
        self.name(shadow.map_or("chosen", Shadow::name));
    }

    fn indirect(&mut self, indirect: &IndirectLight) {
        self.name(indirect.name());
        let rsm_size = indirect.rsm_size();
        self.option(rsm_size.as_ref(), |bytes, &size| bytes.indices(&[size]));
        for error in [indirect.target_error(), indirect.interpolation_error()] {
            self.option(error.as_ref(), |bytes, &error| bytes.numbers(&[error]));
        }
    }

    fn light(&mut self, light: &Light) {
        let kinds = Light::KINDS.iter();
        let before = kinds.take_while(|&&kind| kind != light.kind());
        self.whole(before.count() as u64);
        for (_, numbers) in light.parameters() {
            self.numbers(&numbers);
        }
    }

    fn material(&mut self, material: &Material) {
        let Material {
            name: _,
            kd,
            ks,
            shininess,
            kd_texture,
        } = material;
        self.numbers(kd);
        self.numbers(ks);
        self.numbers(&[*shininess]);
        self.option(kd_texture.as_ref(), |bytes, &index| {
            bytes.whole(index as u64)
        });
    }

    fn texture(&mut self, texture: &Texture) {
        let Texture {
            name: _,
            size_px,
            linear_rgb,
        } = texture;
        self.indices(size_px);
        self.list(linear_rgb, |bytes, texel| {
            bytes.numbers(&texel.map(f64::from));
        });
    }

    fn mesh(&mut self, mesh: &Mesh) {
        let Mesh {
            name: _,
            positions_m,
            normals,
            texcoords,
            triangles,
            triangle_materials,
        } = mesh;
        self.list(positions_m, |bytes, p| bytes.numbers(&p.to_array()));
        self.list(normals, |bytes, n| bytes.numbers(&n.to_array()));
        self.list(texcoords, |bytes, uv| bytes.numbers(uv));
        self.list(triangles, |bytes, vertices| bytes.indices(vertices));
        self.list(triangle_materials, |bytes, &m| bytes.indices(&[m]));
    }
}
