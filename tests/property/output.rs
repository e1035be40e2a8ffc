//! What a written file says about its frame: read back with the `exr` and `image` crates.

use std::fs;
use std::path::Path;

use crate::common::rows::assert_says;
use camlux::output::{
    ExrCompression, ExrOptions, Frame, FrameDescription, FrameStats, Layer, LayerData,
    LayeredImage, OutputFile, PassTime, PngView, write_exr, write_exr_files, write_png,
};
use camlux::scene::{Camera, IndirectLight, Intrinsics, Lens, Light, Sensor, Vignetting, VplSum};
use exr::prelude::{AttributeValue, FlatImage, FlatSamples, Text, read_all_flat_layers_from_file};
use glam::DVec3;

pub const WIDTH: u32 = 7;
pub const HEIGHT: u32 = 5;

fn camera() -> Camera {
    Camera {
        resolution_px: [WIDTH, HEIGHT],
        position_m: DVec3::new(0.5, 1.0, 3.0),
        look_at_m: DVec3::new(0.0, 0.8, -1.0),
        up: DVec3::Y,
        lens: Lens::FovY { fov_y_deg: 50.0 },
        pixel_sampling: None,
    }
}

/// A frame with every layer, whose values tell layer, pixel and channel apart.
pub fn frame() -> Frame {
    let pixels = WIDTH * HEIGHT;
    let layers = Layer::all()
        .zip(1_u32..)
        .map(|(layer, number)| {
            let count = pixels * layer.channel_names().len() as u32;
            let data = if layer.is_id() {
                LayerData::Id((0..count).map(|i| number * 1_000_000 + i).collect())
            } else {
                let scale = if layer == Layer::Energy { 1e-15 } else { 1.0 };
                let value = |i: u32| (number as f32 + i as f32 / 1000.0) * scale;
                LayerData::Float((0..count).map(value).collect())
            };
            (layer, data)
        })
        .collect();
    Frame {
        resolution_px: [WIDTH, HEIGHT],
        layers,
        stats: FrameStats {
            device: "Arc\u{2122} 770".into(),
            driver: "Mesa 22.3.6".into(),
            passes: vec![PassTime {
                name: "gather",
                milliseconds: 2.0,
            }],
            pixel_vpl_pairs: 4_000_000,
            ..FrameStats::default()
        },
        description: FrameDescription {
            reference: None,
            indirect: Some(IndirectLight::vpl_sum(VplSum::InstantRadiosity, 48)),
            lights: vec![Light::point(DVec3::new(0.0, 1.98, 0.1), [50.0, 40.0, 1e-7])],
            camera: camera(),
            sensor: Some(Sensor {
                pixel_pitch_um: [12.0, 10.0],
                exposure_time_s: 1e-3,
                duty_cycle: 0.5,
                f_number: Some(2.5),
                vignetting: Some(Vignetting([-0.1, 1.0 / 3.0, 0.0])),
                wavelength_nm: None,
                quantum_efficiency: None,
                ..Sensor::DEFAULT
            }),
            vignetting_map: None,
            tof: None,
            key: Default::default(),
            scene_hash: "0123abcd".into(),
        },
    }
}

pub fn set(frame: &mut Frame, layer: Layer, values: Vec<f32>) {
    let slot = frame
        .layers
        .iter_mut()
        .find(|(kind, _)| *kind == layer)
        .unwrap();
    slot.1 = LayerData::Float(values);
}

fn write(frame: &Frame, options: &ExrOptions, path: &Path) -> FlatImage {
    write_exr(OutputFile::create(path).unwrap(), frame, options).unwrap();
    let image = read_all_flat_layers_from_file(path).unwrap();
    assert_eq!(image.layer_data.len(), 1, "one part");
    image
}

fn half() -> ExrOptions {
    ExrOptions {
        half: true,
        ..ExrOptions::default()
    }
}

fn only(layers: &[Layer]) -> ExrOptions {
    ExrOptions {
        layers: Some(layers.to_vec()),
        ..ExrOptions::default()
    }
}

/// The same in a folder that is deleted.
fn written(frame: &Frame, options: &ExrOptions) -> FlatImage {
    let folder = tempfile::tempdir().unwrap();
    write(frame, options, &folder.path().join("a.exr"))
}

fn channel_names(image: &FlatImage) -> Vec<String> {
    let channels = &image.layer_data[0].channel_data.list;
    channels
        .iter()
        .map(|channel| channel.name.to_string())
        .collect()
}

fn samples<'image>(image: &'image FlatImage, name: &str) -> &'image FlatSamples {
    let mut channels = image.layer_data[0].channel_data.list.iter();
    &channels
        .find(|channel| channel.name.to_string() == name)
        .unwrap()
        .sample_data
}

fn attribute(image: &FlatImage, name: &str) -> Option<AttributeValue> {
    let attributes = &image.layer_data[0].attributes.other;
    attributes.get(&Text::from(name)).cloned()
}

/// An attribute of a type that the `exr` crate returns as bytes.
fn doubles(image: &FlatImage, name: &str, expected_kind: &str) -> Vec<f64> {
    let Some(AttributeValue::Custom { kind, bytes }) = attribute(image, name) else {
        panic!("{name} is {:?}", attribute(image, name));
    };
    assert_eq!(kind.to_string(), expected_kind, "{name}");
    let (numbers, rest) = bytes.as_chunks();
    assert!(rest.is_empty(), "{name}");
    numbers.iter().map(|&b| f64::from_le_bytes(b)).collect()
}

fn attribute_text(image: &FlatImage, name: &str) -> String {
    match attribute(image, name) {
        Some(AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{name} is {other:?}"),
    }
}

fn file_names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.collect()
}

#[test]
fn every_layer_comes_back_bit_for_bit() {
    let frame = frame();
    let image = written(&frame, &ExrOptions::default());
    assert_eq!(image.layer_data[0].size.0, WIDTH as usize);
    // Channels of a frame, of its bounces, of its electrons, of the samples' depths, of the half path, of a sequence, and of four
    // frequencies with their bounces.
    let of_frequency = 32 + 16 * 2;
    assert_eq!(
        channel_names(&image).len(),
        41 + 16 * 3 + 8 + 2 + 1 + 12 + 4 * of_frequency
    );
    for layer in Layer::all() {
        let names = layer.channel_names();
        for (offset, name) in names.iter().enumerate() {
            let pixels = (WIDTH * HEIGHT) as usize;
            let in_frame = (0..pixels).map(|pixel| pixel * names.len() + offset);
            match samples(&image, name) {
                FlatSamples::F32(values) => {
                    let expected: Vec<f32> =
                        in_frame.map(|i| frame.values(layer).unwrap()[i]).collect();
                    assert_eq!(*values, expected, "{name}");
                }
                FlatSamples::U32(ids) => {
                    let expected: Vec<u32> =
                        in_frame.map(|i| frame.ids(layer).unwrap()[i]).collect();
                    assert_eq!(*ids, expected, "{name}");
                }
                FlatSamples::F16(_) => panic!("{name} is half"),
            }
        }
    }
}

#[test]
fn infinite_depth_of_the_background_is_kept() {
    let mut frame = frame();
    let infinite = vec![f32::INFINITY; (WIDTH * HEIGHT) as usize];
    set(&mut frame, Layer::Depth, infinite);
    let image = written(&frame, &half());
    let FlatSamples::F32(values) = samples(&image, "depth.Z") else {
        panic!("depth is not f32")
    };
    assert!(values.iter().all(|value| *value == f32::INFINITY));
}

#[test]
fn half_is_for_radiance_and_normals_and_saturates() {
    let mut frame = frame();
    let mut radiance = vec![0.1; (WIDTH * HEIGHT * 3) as usize];
    // Channel R of the first pixels: above the range, just below the values that round to infinity, below the range, infinite.
    radiance[0] = 1e6;
    radiance[3] = 65_519.0;
    radiance[6] = -1e6;
    radiance[9] = f32::INFINITY;
    set(&mut frame, Layer::Radiance, radiance);
    let image = written(&frame, &half());
    let half_names: Vec<String> = channel_names(&image)
        .into_iter()
        .filter(|name| matches!(samples(&image, name), FlatSamples::F16(_)))
        .filter(|name| !name.starts_with("indirect.1") || name.starts_with("indirect.1."))
        .filter(|name| !matches!(name.as_bytes(), [.., b'2'..=b'9', b'.', _]))
        .collect();
    let expected = "N.X N.Y N.Z N_camera.X N_camera.Y N_camera.Z albedo.B albedo.G albedo.R direct.B direct.G direct.R emission.B emission.G emission.R indirect.1.B indirect.1.G indirect.1.R indirect.B indirect.G indirect.R radiance.B radiance.G radiance.R";
    assert_eq!(half_names.join(" "), expected);
    let FlatSamples::F16(red) = samples(&image, "radiance.R") else {
        panic!("radiance is not half")
    };
    let red: Vec<f32> = red.iter().map(|value| value.to_f32()).collect();
    assert_eq!(red[..4], [65_504.0, 65_504.0, -65_504.0, f32::INFINITY]);
    // Half has 11 significant bits: rounding to nearest is off by at most 2⁻¹¹ of the value.
    assert!((red[4] - 0.1).abs() <= 0.1 / 2048.0, "{}", red[4]);
    let FlatSamples::F32(energy) = samples(&image, "energy.R") else {
        panic!("energy is not f32")
    };
    assert_eq!(
        energy[0],
        frame.values(Layer::Energy).unwrap()[0],
        "an energy of 1e-15 J survives"
    );
}

#[test]
fn picked_layers_are_the_only_ones() {
    let layers = [Layer::Range, Layer::InstanceId, Layer::Direct];
    let image = written(&frame(), &only(&layers));
    assert_eq!(
        channel_names(&image),
        ["direct.B", "direct.G", "direct.R", "id.instance", "range.Z"]
    );
    assert_eq!(attribute_text(&image, "camlux.unit.range"), "m");
    assert!(attribute(&image, "camlux.unit.energy").is_none());
}

#[test]
fn header_tells_how_the_frame_was_made() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let image = write(&frame(), &ExrOptions::default(), &path);
    let expected = [
        ("camlux.unit.radiance", "W/sr/m^2"),
        ("camlux.unit.energy", "J"),
        ("camlux.unit.id.instance", "1"),
        ("camlux.estimator", "instant-radiosity"),
        ("camlux.scene_hash", "0123abcd"),
        ("camlux.version", env!("CARGO_PKG_VERSION")),
        // The format has no encoding for non-ASCII characters.
        ("camlux.device", "Arc? 770"),
        ("camlux.driver", "Mesa 22.3.6"),
        ("camlux.light.0.kind", "point"),
    ];
    for (name, text) in expected {
        assert_eq!(attribute_text(&image, name), text, "{name}");
    }
    assert_eq!(
        attribute(&image, "camlux.rsm_size"),
        Some(AttributeValue::I32(48))
    );
    for absent in [
        "camlux.target_error",
        "camlux.estimated_error",
        "camlux.estimated_error_upper",
        "camlux.stop",
        "camlux.interpolation_error",
        "camlux.estimated_interpolation_error",
    ] {
        assert_eq!(attribute(&image, absent), None, "{absent}");
    }
    assert_eq!(
        attribute(&image, "camlux.sensor.duty_cycle"),
        Some(AttributeValue::F32(0.5))
    );
    assert_eq!(
        attribute(&image, "camlux.lens.f_number"),
        Some(AttributeValue::F32(2.5))
    );
    // All digits, in types that readers show as vectors.
    let intrinsics = camera().intrinsics_px();
    for (name, kind, numbers) in [
        ("camera.position_m", "v3d", &[0.5, 1.0, 3.0][..]),
        ("camera.focal_px", "v2d", &[intrinsics.fx, intrinsics.fy]),
        ("light.0.position_m", "v3d", &[0.0, 1.98, 0.1]),
        ("light.0.power_w", "v3d", &[50.0, 40.0, 1e-7]),
        ("sensor.pixel_pitch_um", "v2d", &[12.0, 10.0]),
        ("lens.vignetting", "v3d", &[-0.1, 1.0 / 3.0, 0.0]),
    ] {
        let name = format!("camlux.{name}");
        assert_eq!(doubles(&image, &name, kind), numbers, "{name}");
    }
    let read = LayeredImage::read(&path).unwrap();
    let position = read.attribute("camlux.camera.position_m");
    assert_eq!(position, Some("[0.5, 1.0, 3.0]"));
    assert_eq!(image.layer_data[0].attributes.exposure, Some(1e-3));
}

#[test]
fn the_header_has_the_requested_error_and_the_estimated_one() {
    let mut frame = frame();
    let mut errors = |indirect, stats| {
        (frame.description.indirect, frame.stats) = (Some(indirect), stats);
        let image = written(&frame, &ExrOptions::default());
        let is_sum = attribute(&image, "camlux.rsm_size").is_some();
        assert_eq!(is_sum, indirect.rsm_size().is_some());
        [
            "camlux.target_error",
            "camlux.estimated_error",
            "camlux.estimated_error_upper",
            "camlux.interpolation_error",
            "camlux.estimated_interpolation_error",
        ]
        .map(|name| {
            attribute(&image, name).map(|value| match value {
                AttributeValue::F32(error) => error,
                _ => panic!("{name} is {value:?}"),
            })
        })
    };
    let estimated = FrameStats {
        estimated_error: Some(0.015),
        estimated_error_upper: Some(0.025),
        ..FrameStats::default()
    };
    assert_eq!(
        errors(IndirectLight::final_gather(0.1), estimated),
        [Some(0.1), Some(0.015), Some(0.025), None, None]
    );
    let estimated = FrameStats {
        estimated_interpolation_error: Some(0.015),
        ..FrameStats::default()
    };
    let interpolated = IndirectLight::RsmAverage(camlux::scene::RsmAverage {
        rsm_size: 48,
        interpolation_error: Some(0.1),
    });
    assert_eq!(
        errors(interpolated, estimated),
        [None, None, None, Some(0.1), Some(0.015)]
    );
}

#[test]
fn header_matrices_take_points_to_their_pixels() {
    let skewed = Lens::Intrinsics(Intrinsics {
        skew: 1.5,
        ..camera().intrinsics_px()
    });
    header_matrices_fit(skewed);
    let image = header_matrices_fit(Lens::Orthographic { height_m: 0.75 });
    let projection = attribute_text(&image, "camlux.camera.projection");
    assert_eq!(projection, "orthographic");
    let height_m = attribute(&image, "camlux.camera.height_m");
    assert_eq!(height_m, Some(AttributeValue::F32(0.75)));
    assert_eq!(attribute(&image, "camlux.camera.focal_px"), None);
}

fn header_matrices_fit(lens: Lens) -> FlatImage {
    let camera = Camera { lens, ..camera() };
    let mut frame = frame();
    frame.description.camera = camera;
    let image = written(&frame, &ExrOptions::default());
    let attributes = &image.layer_data[0].attributes;
    // The format multiplies row vectors from the left.
    let transform = |point: DVec3, m: [f64; 16]| -> [f64; 4] {
        let point = [point.x, point.y, point.z, 1.0];
        std::array::from_fn(|column| (0..4).map(|row| point[row] * m[4 * row + column]).sum())
    };
    // 3 m along the view axis, seen in a pixel right of and above the centre.
    let [x_px, y_px] = [5.25, 1.5];
    let point = camera.ray_origin_m(x_px, y_px) + camera.ray_direction(x_px, y_px) * 3.0;

    let [x, y, _, w] = transform(
        point,
        attributes
            .world_to_normalized_device
            .unwrap()
            .map(f64::from),
    );
    // f32 matrices have entries around 1: errors of a few times 2⁻²⁴ each, divided by w = 3.
    let tolerance = 1e-6;
    assert!(
        (x / w - x_px / f64::from(WIDTH)).abs() < tolerance,
        "{}",
        x / w
    );
    assert!(
        (y / w - (1.0 - y_px / f64::from(HEIGHT))).abs() < tolerance,
        "{}",
        y / w
    );

    let [x, y, z, _] = transform(point, attributes.world_to_camera.unwrap().map(f64::from));
    assert!((z - 3.0).abs() < 3.0 * tolerance, "z forward: {z}");
    assert!(x > 0.0 && y > 0.0, "x right, y up: {x} {y}");

    let to_world = doubles(&image, "camlux.cameraToWorld", "m44d");
    let to_world = to_world.try_into().unwrap();
    let [x, y, z, _] = transform(DVec3::new(x, -y, z), to_world);
    assert!(
        (DVec3::new(x, y, z) - point).length() < 10.0 * tolerance,
        "there and back"
    );
    image
}

#[test]
fn failed_write_leaves_nothing_and_keeps_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut frame = frame();
    frame.layers.retain(|(layer, _)| *layer != Layer::Energy);
    let output = OutputFile::create(&path).unwrap();
    let error = write_exr(output, &frame, &only(&[Layer::Energy])).unwrap_err();
    assert!(error.to_string().contains("no layer energy"), "{error}");
    assert!(file_names(folder.path()).is_empty());

    fs::write(&path, "old").unwrap();
    set(&mut frame, Layer::Depth, vec![1.0; 3]);
    let output = OutputFile::create(&path).unwrap();
    let error = write_exr(output, &frame, &ExrOptions::default()).unwrap_err();
    assert_says(&error.to_string(), &["layer depth has 3 values"]);
    let output = OutputFile::create(&path).unwrap();
    let error = write_png(output, &frame, PngView::Radiance).unwrap_err();
    assert_says(&error.to_string(), &["layer depth has 3 values"]);
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(file_names(folder.path()), ["a.exr"]);
}

#[test]
fn layer_names_are_unique_and_found_again() {
    for layer in Layer::all() {
        assert_eq!(Layer::from_name(layer.name()), Some(layer));
        let prefix = layer.name();
        assert!(
            layer
                .channel_names()
                .iter()
                .all(|channel| channel.starts_with(prefix)),
            "{prefix}"
        );
    }
    assert_eq!(Layer::from_name("Radiance"), None);
}

#[test]
fn pair_rate_is_that_of_the_gather_pass() {
    let mut stats = frame().stats;
    // 4 million pairs in 2 ms.
    assert_eq!(stats.pairs_per_second(), Some(2e9));
    stats.passes.clear();
    assert_eq!(stats.pairs_per_second(), None);
}

/// The `exr` crate keeps attributes in a map whose order differs each time.
#[test]
fn the_same_frame_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let frame = frame();
    let pixels = |image: &FlatImage| format!("{:?}", image.layer_data[0].channel_data);
    let uncompressed = pixels(&write(&frame, &ExrOptions::default(), &path));
    for compression in ExrCompression::ALL {
        let options = ExrOptions {
            compression,
            attributes: vec![("said".into(), "by the caller".into())],
            ..ExrOptions::default()
        };
        let image = write(&frame, &options, &path);
        let said = attribute(&image, "camlux.said");
        assert_eq!(said, Some(AttributeValue::Text("by the caller".into())));
        assert!(pixels(&image) == uncompressed, "{}", compression.name());
        let bytes = fs::read(&path).unwrap();
        for _ in 0..3 {
            let written = write_exr_files(&path, &frame, &options).unwrap();
            assert!(fs::read(&path).unwrap() == bytes, "{}", compression.name());
            assert_eq!(written.blake3, blake3::hash(&bytes).to_hex().as_str());
            assert_eq!(written.bytes, bytes.len() as u64);
        }
    }
}
