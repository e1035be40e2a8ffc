//! The OpenEXR header of a frame: what was rendered, with which program, in which units.

use exr::meta::attribute::{AttributeValue, Text};
use exr::meta::header::LayerAttributes;
use glam::{DMat4, DVec3, DVec4};

use super::Layer;
use super::frame::{Frame, FrameDescription};
use crate::{
    model::{FrameKey, PhaseSampling},
    scene::{
        Camera, Intrinsics, Lens, Parameter, ParameterKind, ParameterValue, Parameters,
        PixelSampling, Sensor, SensorNoise, TimeOfFlight,
    },
};

/// A value in the header of an OpenEXR file.
#[derive(Debug, Clone, PartialEq)]
pub enum Attribute {
    /// `string`; non-ASCII characters become question marks.
    Text(String),
    /// `int`
    Int(i32),
    /// `float`, so rounded to f32: readers show a `double` as a list of one.
    Number(f64),
    /// `v2d`
    Vector2([f64; 2]),
    /// `v3d`
    Vector3([f64; 3]),
    /// `m44d`, row by row for row vectors, like the format's own matrices. For column vectors, these are the columns one after the other.
    Matrix4([f64; 16]),
}

impl Attribute {
    fn to_exr(&self) -> AttributeValue {
        match self {
            Attribute::Text(value) => AttributeValue::Text(text(value)),
            Attribute::Int(value) => AttributeValue::I32(*value),
            Attribute::Number(value) => AttributeValue::F32(*value as f32),
            Attribute::Vector2(values) => doubles("v2d", values),
            Attribute::Vector3(values) => doubles("v3d", values),
            Attribute::Matrix4(values) => doubles("m44d", values),
        }
    }
}

impl From<&str> for Attribute {
    fn from(text: &str) -> Self {
        Attribute::Text(text.into())
    }
}

impl From<DVec3> for Attribute {
    fn from(vector: DVec3) -> Self {
        Attribute::Vector3(vector.to_array())
    }
}

fn count(value: u32) -> Attribute {
    Attribute::Int(i32::try_from(value).unwrap_or(i32::MAX))
}

/// A value of a type that the `exr` crate has no variant for.
fn doubles(kind: &str, values: &[f64]) -> AttributeValue {
    AttributeValue::Custom {
        kind: text(kind),
        bytes: values.iter().flat_map(|v| v.to_le_bytes()).collect(),
    }
}

/// The attributes of a frame's file. Those under `camlux.` keep every digit of positions and directions; the format's own matrices are
/// f32. `picks`: whether the file has a layer. `further`: names without the prefix, and values.
pub(super) fn attributes(
    frame: &Frame,
    picks: &dyn Fn(Layer) -> bool,
    further: &[(String, Attribute)],
) -> LayerAttributes {
    let FrameDescription {
        indirect,
        reference,
        lights,
        camera,
        sensor,
        vignetting_map,
        tof,
        key,
        scene_hash,
    } = &frame.description;
    let mut header = LayerAttributes {
        software_name: Some(text(concat!("camlux ", env!("CARGO_PKG_VERSION")))),
        exposure: sensor.map(|sensor| sensor.exposure_time_s as f32),
        world_to_camera: Some(matrix(world_to_camera(camera))),
        // No matrix describes a lens that bends lines.
        world_to_normalized_device: camera
            .distortion()
            .is_none()
            .then(|| matrix(world_to_ndc(camera))),
        ..LayerAttributes::default()
    };
    let mut add = |name: &str, value: Attribute| {
        let name = text(&format!("camlux.{name}"));
        header.other.insert(name, value.to_exr());
    };
    add("version", env!("CARGO_PKG_VERSION").into());
    add("scene_hash", scene_hash.as_str().into());
    let stats = &frame.stats;
    add("device", stats.device.as_str().into());
    add("driver", stats.driver.as_str().into());
    let layers = frame.layers.iter().map(|(layer, _)| *layer);
    for layer in layers.filter(|layer| picks(*layer)) {
        let unit = layer.unit_by(frame.description.tof.as_ref());
        add(&format!("unit.{}", layer.name()), unit.into());
    }
    match (indirect, reference) {
        (Some(indirect), _) => {
            add("estimator", indirect.name().into());
            for (parameter, value) in indirect.parameters().named_values() {
                match (parameter.kind, value) {
                    (ParameterKind::Count, Some(ParameterValue::Count(size))) => {
                        add(parameter.name, count(size as u32));
                    }
                    (_, Some(ParameterValue::Name(word))) => add(parameter.name, word.into()),
                    // The file's layers show flags without an attribute. An int has only 31 bits.
                    (_, value) => {
                        if let Some(number) = value.and_then(ParameterValue::number) {
                            add(parameter.name, Attribute::Number(number));
                        }
                    }
                }
            }
            for (name, error) in [
                ("estimated_error", stats.estimated_error),
                ("estimated_error_upper", stats.estimated_error_upper),
                ("estimated_range_error_mm", stats.estimated_range_error_mm),
                (
                    "estimated_range_error_upper_mm",
                    stats.estimated_range_error_upper_mm,
                ),
                (
                    "estimated_interpolation_error",
                    stats.estimated_interpolation_error,
                ),
            ] {
                if let Some(error) = error {
                    add(name, Attribute::Number(error));
                }
            }
            if let Some(stop) = stats.stop {
                add("stop", stop.name().into());
            }
        }
        (None, Some(samples)) => {
            add("estimator", "path-sampled".into());
            add("samples_per_pixel", count(samples.samples_per_pixel));
            add("samples_per_round", count(samples.samples_per_round));
            add("bounces", count(samples.bounces));
        }
        (None, None) => add("estimator", "none".into()),
    }
    if let Some(error) = stats.estimated_area_light_error {
        add("estimated_area_light_error", Attribute::Number(error));
    }
    for (index, light) in lights.iter().enumerate() {
        add(&format!("light.{index}.kind"), light.kind().into());
        for (name, numbers) in light.parameters() {
            let value = match numbers[..] {
                [number] => Attribute::Number(number),
                [x, y] => Attribute::Vector2([x, y]),
                [x, y, z] => Attribute::Vector3([x, y, z]),
                _ => Attribute::Text(format!("{numbers:?}")),
            };
            add(&format!("light.{index}.{name}"), value);
        }
    }
    if let Some(sensor) = sensor {
        // What only the counting of electrons uses.
        const OF_COUNTING: [&str; 2] = ["band_weights", "monochrome"];
        let counts_electrons = sensor.counted_electrons().is_some();
        let rows = sensor.named_values().into_iter();
        let rows = rows.filter(|(row, _)| counts_electrons || !OF_COUNTING.contains(&row.name));
        for (Parameter { name, .. }, value) in rows {
            let is_of_lens = Sensor::OF_LENS.contains(name);
            let part = if is_of_lens { "lens" } else { "sensor" };
            let name = format!("{part}.{name}");
            match value {
                Some(ParameterValue::Pair(numbers)) => add(&name, Attribute::Vector2(numbers)),
                Some(ParameterValue::Bands(numbers) | ParameterValue::Coefficients(numbers)) => {
                    add(&name, Attribute::Vector3(numbers));
                }
                Some(ParameterValue::Name(word)) => add(&name, word.into()),
                Some(ParameterValue::Flag(flag)) => add(&name, Attribute::Int(flag.into())),
                value => {
                    if let Some(number) = value.and_then(ParameterValue::number) {
                        add(&name, Attribute::Number(number));
                    }
                }
            }
        }
        if let Some(map) = vignetting_map {
            let [width, height] = map.size_px;
            let text = format!("image of {width} x {height} pixels");
            add("lens.vignetting", Attribute::Text(text));
        }
        if let Some(noise) = &sensor.noise {
            sensor_noise("sensor", noise, *key, &mut add);
        }
    }
    if let Some(tof) = tof {
        time_of_flight(tof, lights.len(), &mut add);
        if let Some(noise) = &tof.noise {
            sensor_noise("tof", noise, *key, &mut add);
        }
    }
    let Intrinsics {
        fx,
        fy,
        cx,
        cy,
        skew,
    } = camera.intrinsics_px();
    match camera.lens {
        Lens::Orthographic { height_m } => {
            add("camera.projection", "orthographic".into());
            add("camera.height_m", Attribute::Number(height_m));
        }
        _ => add("camera.focal_px", Attribute::Vector2([fx, fy])),
    }
    add("camera.principal_point_px", Attribute::Vector2([cx, cy]));
    if skew != 0.0 {
        add("camera.skew_px", Attribute::Number(skew));
    }
    if let Some(distortion) = camera.distortion() {
        add("camera.distortion_model", distortion.model().into());
        let coefficients = format!("{:?}", distortion.coefficients());
        add("camera.distortion", Attribute::Text(coefficients));
    }
    if let Some(PixelSampling { samples, filter }) = camera.pixel_sampling {
        add("camera.filter", filter.name().into());
        // A reference has its own samples.
        if reference.is_none() {
            add("camera.samples", count(samples));
        }
    }
    add("camera.position_m", camera.position_m.into());
    add("camera.look_at_m", camera.look_at_m.into());
    add("camera.up", camera.up.into());
    let to_world = camera.to_world().to_cols_array();
    add("cameraToWorld", Attribute::Matrix4(to_world));
    for (name, value) in further {
        add(name, value.clone());
    }
    header
}

/// Adds the convention, too, because the data is useless without it.
fn time_of_flight(tof: &TimeOfFlight, light_count: usize, add: &mut dyn FnMut(&str, Attribute)) {
    let TimeOfFlight {
        frequencies_hz,
        phase_count,
        contrasts,
        band_weights,
        phase_offset_deg,
        ambient_lights: _,
        output,
        noise: _,
    } = tof;
    for (i, &frequency_hz) in frequencies_hz.iter().enumerate() {
        add(
            &format!("tof{i}.frequency_hz"),
            Attribute::Number(frequency_hz),
        );
        add(&format!("tof{i}.contrast"), Attribute::Number(contrasts[i]));
        for phase in 0..*phase_count {
            let delay_rad = PhaseSampling::delay_rad(phase, *phase_count);
            add(
                &format!("tof{i}.phase{phase}.delay_rad"),
                Attribute::Number(delay_rad),
            );
        }
    }
    add("tof.band_weights", Attribute::Vector3(*band_weights));
    add("tof.phase_offset_deg", Attribute::Number(*phase_offset_deg));
    add("tof.output", output.name().into());
    for light in 0..light_count {
        let is_modulated = i32::from(tof.is_modulated(light));
        add(
            &format!("light.{light}.modulated"),
            Attribute::Int(is_modulated),
        );
    }
    add("tof.convention", TOF_CONVENTION.into());
}

/// Adds the noise of a sensor, and what its random numbers depend on.
fn sensor_noise(
    of: &str,
    noise: &SensorNoise,
    key: FrameKey,
    add: &mut dyn FnMut(&str, Attribute),
) {
    for (parameter, value) in noise.named_values() {
        let name = format!("{of}.noise.{}", parameter.name);
        match value {
            // An int has only 31 bits.
            Some(seed) if parameter.kind == ParameterKind::LargeCount => {
                add(&name, seed.to_string().as_str().into());
            }
            _ => {
                if let Some(number) = value.and_then(ParameterValue::number) {
                    add(&name, Attribute::Number(number));
                }
            }
        }
    }
    let FrameKey {
        index,
        camera,
        seed,
    } = key;
    add(&format!("{of}.noise.frame"), count(index));
    add(&format!("{of}.noise.camera"), count(camera));
    add(&format!("{of}.noise.render_seed"), count(seed));
}

/// Defines phasors, phase images and the range of time of flight, for readers of files.
pub const TOF_CONVENTION: &str = "Z = sum over paths of L*exp(+i*2*pi*f*d/c); A, B = (Q +- K*Re(Q_Z*exp(+i*(offset + delay))))/2 electrons; K*Q_Z*exp(+i*offset) = 2/N*sum of (A - B)*exp(-i*delay); range = c*arg(Z*exp(+i*offset))/(4*pi*f), arg from 0 to 2*pi; in DN, A and B are gain*electrons + black level";

/// The OpenEXR attribute `worldToCamera`, whose camera has x right, y up, z forward. Column vectors.
fn world_to_camera(camera: &Camera) -> DMat4 {
    let y_up_from_y_down = DMat4::from_scale(DVec3::new(1.0, -1.0, 1.0));
    y_up_from_y_down * camera.to_world().inverse()
}

/// The OpenEXR attribute `worldToNDC`: x and y go from 0 at the left and bottom edge of the image to 1 at the right and top edge. Column
/// vectors.
fn world_to_ndc(camera: &Camera) -> DMat4 {
    let Intrinsics {
        fx,
        fy,
        cx,
        cy,
        skew,
    } = camera.intrinsics_px();
    let [width, height] = camera.resolution_px.map(f64::from);
    // x = (fx·X/Z + skew·Y/Z + cx)/width, y = 1 − (cy − fy·Y/Z)/height. The format does not use z; 1/Z keeps the matrix invertible. An
    // orthographic camera does not divide by Z: its z is Z.
    let middle = [cx / width, 1.0 - cy / height];
    let [along_z, constant] = match camera.is_orthographic() {
        true => [DVec4::Z, DVec4::new(middle[0], middle[1], 0.0, 1.0)],
        false => [DVec4::new(middle[0], middle[1], 0.0, 1.0), DVec4::Z],
    };
    let ndc_from_camera = DMat4::from_cols(
        DVec4::new(fx / width, 0.0, 0.0, 0.0),
        // Y points up here.
        DVec4::new(-skew / width, fy / height, 0.0, 0.0),
        along_z,
        constant,
    );
    ndc_from_camera * world_to_camera(camera)
}

/// Converts to the format's layout: rows for row vectors, which are the columns for column vectors.
fn matrix(column_vectors: DMat4) -> [f32; 16] {
    column_vectors.to_cols_array().map(|value| value as f32)
}

/// The format's strings have no encoding; every reader agrees on ASCII.
fn text(value: &str) -> Text {
    let ascii = value.replace(|c: char| !c.is_ascii() || c.is_control(), "?");
    Text::new_or_none(ascii).unwrap_or_default()
}
