//! OpenEXR files are read back as written: camlux's own files, and other programs' layouts.

use std::path::Path;

use camlux::output::{Layer, LayeredImage};
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Image,
    ImageAttributes, LayerAttributes, LineOrder, SmallVec, Text, Vec2, WritableImage, f16,
};

const WIDTH: usize = 13;
const HEIGHT: usize = 37;

/// Values that tell pixel and channel apart, exact in 16 bits.
fn value(channel: usize, pixel: usize) -> f32 {
    channel as f32 * 512.0 + pixel as f32
}

/// Writes channels of these names, which must be in alphabetical order. Values are f32, or f16 where the name ends in "half".
fn write(path: &Path, names: &[&str], encoding: Encoding, attributes: LayerAttributes) {
    let channels = names.iter().enumerate().map(|(channel, name)| {
        let values = (0..WIDTH * HEIGHT).map(move |pixel| value(channel, pixel));
        let samples = if name.ends_with("half") {
            FlatSamples::F16(values.map(f16::from_f32).collect())
        } else {
            FlatSamples::F32(values.collect())
        };
        AnyChannel::new(*name, samples)
    });
    let channels = AnyChannels::sort(SmallVec::from_iter(channels));
    let layer = exr::image::Layer::new((WIDTH, HEIGHT), attributes, encoding, channels);
    Image::from_layer(layer).write().to_file(path).unwrap();
}

/// The image of these channels, uncompressed.
fn written(names: &[&str], attributes: LayerAttributes) -> LayeredImage {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    write(&path, names, Encoding::UNCOMPRESSED, attributes);
    LayeredImage::read(&path).unwrap()
}

fn interleaved(channels: &[usize]) -> Vec<f32> {
    let pixels = 0..WIDTH * HEIGHT;
    pixels
        .flat_map(|pixel| channels.iter().map(move |&channel| value(channel, pixel)))
        .collect()
}

#[test]
fn blocks_and_lossless_compressions_do_not_change_the_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let names = ["a.half", "direct.B", "direct.G", "direct.R"];
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
    ] {
        for blocks in [
            Blocks::ScanLines,
            Blocks::Tiles(Vec2(5, 64)),
            Blocks::Tiles(Vec2(16, 8)),
        ] {
            for line_order in [LineOrder::Increasing, LineOrder::Decreasing] {
                let encoding = Encoding {
                    compression,
                    blocks,
                    line_order,
                };
                write(&path, &names, encoding, LayerAttributes::default());
                let image = LayeredImage::read(&path).unwrap();
                assert_eq!(image.resolution_px(), [WIDTH as u32, HEIGHT as u32]);
                let direct = image.values(Layer::Direct).unwrap();
                assert_eq!(direct, interleaved(&[3, 2, 1]), "{encoding:?}");
                assert_eq!(
                    image.layer("a").unwrap().values,
                    interleaved(&[0]),
                    "{encoding:?}"
                );
            }
        }
    }
}

#[test]
fn channels_find_their_layers() {
    let names = "A B G P.X P.Y P.Z R depth.Z id.instance id.material id.x left.direct.R mixed.G mixed.a mixed.z";
    let names: Vec<&str> = names.split(' ').collect();
    let image = written(&names, LayerAttributes::default());
    let layers: Vec<(&str, Vec<&str>)> = image
        .layers()
        .iter()
        .map(|layer| {
            let channels = layer.channel_names.iter().map(String::as_str).collect();
            (layer.name.as_str(), channels)
        })
        .collect();
    assert_eq!(
        layers,
        [
            ("", vec!["R", "G", "B", "A"]),
            ("P", vec!["P.X", "P.Y", "P.Z"]),
            ("depth", vec!["depth.Z"]),
            ("id", vec!["id.x"]),
            ("id.instance", vec!["id.instance"]),
            ("id.material", vec!["id.material"]),
            ("left.direct", vec!["left.direct.R"]),
            ("mixed", vec!["mixed.G", "mixed.a", "mixed.z"]),
        ]
    );
    assert_eq!(image.layer("").unwrap().values, interleaved(&[6, 2, 1, 0]));
    assert_eq!(image.values(Layer::InstanceId).unwrap(), interleaved(&[8]));
    assert!(image.values(Layer::Direct).is_none());
    assert!(image.layer("direct").is_none());
}

/// `values` promises three channels for this layer, so a layer with a fourth channel is not camlux's.
#[test]
fn a_layer_with_more_channels_is_not_taken_for_ours() {
    let names = ["direct.A", "direct.B", "direct.G", "direct.R"];
    let image = written(&names, LayerAttributes::default());
    assert!(image.values(Layer::Direct).is_none());
    assert_eq!(image.layer("direct").unwrap().channel_names.len(), 4);
}

#[test]
fn texts_and_numbers_of_the_header_are_kept() {
    let mut attributes = LayerAttributes {
        software_name: Some(Text::from("camlux 1")),
        ..LayerAttributes::default()
    };
    for (name, value) in [
        (
            "camlux.scene_hash",
            AttributeValue::Text(Text::from("0a1b")),
        ),
        ("camlux.rsm_size", AttributeValue::I32(48)),
        ("camlux.half", AttributeValue::F64(0.1)),
        ("camlux.pair", AttributeValue::FloatVec2(Vec2(1.0, 2.0))),
    ] {
        attributes.other.insert(Text::from(name), value);
    }
    let image = written(&["R"], attributes);
    assert_eq!(image.attribute("camlux.scene_hash"), Some("0a1b"));
    assert_eq!(image.attribute("camlux.rsm_size"), Some("48"));
    assert_eq!(image.attribute("camlux.half"), Some("0.1"));
    assert_eq!(image.attribute("software"), Some("camlux 1"));
    assert_eq!(image.attribute("camlux.pair"), None);
    assert_eq!(
        image
            .attributes()
            .filter(|(name, _)| name.starts_with("camlux."))
            .count(),
        3
    );
}

#[test]
fn whole_numbers_and_halves_become_floats() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut ids = vec![7_u32; WIDTH * HEIGHT];
    // 2^24 + 1 is the first whole number that f32 cannot hold.
    ids[1] = (1 << 24) + 1;
    let mut halves = vec![f16::from_f32(-0.5); WIDTH * HEIGHT];
    halves[1] = f16::INFINITY;
    halves[2] = f16::NAN;
    let channels = AnyChannels::sort(SmallVec::from_vec(vec![
        AnyChannel::new("depth.Z", FlatSamples::F16(halves)),
        AnyChannel::new("id.instance", FlatSamples::U32(ids)),
    ]));
    let attributes = LayerAttributes::default();
    let encoding = Encoding::UNCOMPRESSED;
    let layer = exr::image::Layer::new((WIDTH, HEIGHT), attributes, encoding, channels);
    Image::from_layer(layer).write().to_file(&path).unwrap();

    let image = LayeredImage::read(&path).unwrap();
    let ids = image.values(Layer::InstanceId).unwrap();
    assert_eq!(ids[..2], [7.0, 16_777_216.0]);
    let depth = image.values(Layer::Depth).unwrap();
    assert_eq!(depth[..2], [-0.5, f32::INFINITY]);
    assert!(depth[2].is_nan());
}

/// `valid` takes precedence over `id.instance`, and that over `depth`. Without any of them, all pixels count.
#[test]
fn surfaces_are_told_by_the_first_layer_that_knows() {
    let count = |names: &[&str]| {
        let surface = written(names, LayerAttributes::default()).surface_pixels();
        assert_eq!(surface.len(), WIDTH * HEIGHT);
        surface.iter().filter(|&&is_surface| is_surface).count()
    };
    let all = WIDTH * HEIGHT;
    // The first channel counts the pixels from 0, so only the first pixel is 0.
    assert_eq!(
        count(&["id.instance", "valid.B"]),
        all,
        "of channel 1, every value is over 0.5"
    );
    assert_eq!(count(&["id.instance"]), all - 1);
    assert_eq!(count(&["depth.Z", "id.instance"]), all, "ids from 512 on");
    assert_eq!(count(&["depth.Z"]), all, "finite");
    assert_eq!(count(&["R"]), all);
}

#[test]
fn total_radiance_is_the_layer_or_the_sum() {
    let parts = ["direct", "indirect", "radiance"];
    let parts = parts.map(|layer| ["B", "G", "R"].map(|band| format!("{layer}.{band}")));
    let parts: Vec<&str> = parts.as_flattened().iter().map(String::as_str).collect();
    let total = |names: &[&str]| written(names, LayerAttributes::default()).total_radiance();
    let red_of_pixel_9 = |total: Option<Vec<f32>>| total.unwrap()[9 * 3];
    let of_sum = total(&parts[..6]);
    assert_eq!(red_of_pixel_9(of_sum), value(2, 9) + value(5, 9));
    assert_eq!(red_of_pixel_9(total(&parts)), value(8, 9));
    assert_eq!(total(&parts[..3]), None);
}

/// A part: its name, data window (position, size) and channels with their values, row by row.
type Part<'a> = (
    &'a str,
    (i32, i32),
    (usize, usize),
    &'a [(&'a str, FlatSamples)],
);

/// Writes parts that share a display window at (10, 20).
fn write_parts(path: &std::path::Path, display: (usize, usize), blocks: Blocks, parts: &[Part]) {
    let mut attributes = ImageAttributes::with_size(display);
    attributes.display_window.position = Vec2(10, 20);
    let mut layers = SmallVec::new();
    for (name, position, size, channels) in parts {
        let channels = channels.iter();
        let channels = channels.map(|(name, samples)| AnyChannel::new(*name, samples.clone()));
        let mut layer = exr::prelude::Layer::new(
            *size,
            LayerAttributes::named(*name),
            Encoding {
                compression: Compression::ZIP16,
                blocks,
                line_order: LineOrder::Increasing,
            },
            AnyChannels::sort(channels.collect()),
        );
        layer.attributes.layer_position = Vec2(10 + position.0, 20 + position.1);
        layers.push(layer);
    }
    let image = Image::from_layers(attributes, layers);
    image.write().to_file(path).unwrap();
}

/// The image is the display window: what the data window lacks is 0 and does not count, what it has beyond is left out.
#[test]
fn data_windows_lie_anywhere_in_the_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(2, 3))] {
        for position in [(0, 0), (1, 2), (-2, -1), (3, 0), (-3, 3), (-1, -1), (9, 9)] {
            for size in [(4, 3), (7, 6), (2, 1)] {
                let value = |x: i32, y: i32| 1.0 + x as f32 + 100.0 * y as f32;
                let at = |i: usize| {
                    let (x, y) = ((i % size.0) as i32, (i / size.0) as i32);
                    value(position.0 + x, position.1 + y)
                };
                let floats: Vec<f32> = (0..size.0 * size.1).map(at).collect();
                let halves = floats.iter().map(|&v| f16::from_f32(v)).collect();
                let channels = [
                    ("G", FlatSamples::F16(halves)),
                    ("R", FlatSamples::F32(floats)),
                ];
                write_parts(&path, (5, 4), blocks, &[("", position, size, &channels)]);
                let image = LayeredImage::read(&path).unwrap();
                assert_eq!(image.resolution_px(), [5, 4]);
                let layer = image.layer("").unwrap();
                let held = image.data_pixels();
                assert_eq!(image.surface_pixels(), held);
                for (i, pixel) in layer.values.chunks(2).enumerate() {
                    let (x, y) = ((i % 5) as i32, (i / 5) as i32);
                    let inside = (position.0..position.0 + size.0 as i32).contains(&x)
                        && (position.1..position.1 + size.1 as i32).contains(&y);
                    let due = if inside { value(x, y) } else { 0.0 };
                    assert_eq!(pixel, [due; 2], "{position:?} {size:?} {x} {y}");
                    assert_eq!(held[i], inside);
                }
            }
        }
    }
}

#[test]
fn parts_are_layers_of_one_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let floats = |value: f32| FlatSamples::F32(vec![value; 6]);
    let direct = [("B", floats(3.0)), ("G", floats(2.0)), ("R", floats(1.0))];
    let named = [("ViewLayer.Combined.R", floats(4.0))];
    let id = [("instance", FlatSamples::U32(vec![7; 6]))];
    let window = [("Z", FlatSamples::F32(vec![5.0; 2]))];
    let parts: [Part; 4] = [
        ("direct", (0, 0), (3, 2), &direct),
        ("ViewLayer.Combined", (0, 0), (3, 2), &named),
        ("id", (0, 0), (3, 2), &id),
        ("far", (1, 0), (1, 2), &window),
    ];
    write_parts(&path, (3, 2), Blocks::ScanLines, &parts);
    let image = LayeredImage::read(&path).unwrap();
    assert_eq!(
        image.values(Layer::Direct).unwrap(),
        [1.0, 2.0, 3.0].repeat(6)
    );
    assert_eq!(image.layer("ViewLayer.Combined").unwrap().values, [4.0; 6]);
    assert_eq!(image.values(Layer::InstanceId).unwrap(), [7.0; 6]);
    assert_eq!(
        image.layer("far").unwrap().values,
        [0.0, 5.0, 0.0, 0.0, 5.0, 0.0]
    );
    // A pixel counts that every part has.
    assert_eq!(
        image.data_pixels(),
        [false, true, false, false, true, false]
    );
}
