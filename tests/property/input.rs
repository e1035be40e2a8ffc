//! OpenEXR files are read back as written: camlux's own files, and other programs' layouts.

use std::path::Path;

use camlux::output::{Layer, LayeredImage};
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Image,
    LayerAttributes, LineOrder, SmallVec, Text, Vec2, WritableImage, f16,
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
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let names = [
        "A",
        "B",
        "G",
        "P.X",
        "P.Y",
        "P.Z",
        "R",
        "depth.Z",
        "id.instance",
        "id.material",
        "id.x",
        "left.direct.R",
        "mixed.G",
        "mixed.a",
        "mixed.z",
    ];
    write(
        &path,
        &names,
        Encoding::UNCOMPRESSED,
        LayerAttributes::default(),
    );
    let image = LayeredImage::read(&path).unwrap();
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
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let names = ["direct.A", "direct.B", "direct.G", "direct.R"];
    write(
        &path,
        &names,
        Encoding::UNCOMPRESSED,
        LayerAttributes::default(),
    );
    let image = LayeredImage::read(&path).unwrap();
    assert!(image.values(Layer::Direct).is_none());
    assert_eq!(image.layer("direct").unwrap().channel_names.len(), 4);
}

#[test]
fn texts_and_numbers_of_the_header_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
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
    write(&path, &["R"], Encoding::UNCOMPRESSED, attributes);
    let image = LayeredImage::read(&path).unwrap();
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
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let count = |names: &[&str]| {
        write(
            &path,
            names,
            Encoding::UNCOMPRESSED,
            LayerAttributes::default(),
        );
        let surface = LayeredImage::read(&path).unwrap().surface_pixels();
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
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let parts = [
        "direct.B",
        "direct.G",
        "direct.R",
        "indirect.B",
        "indirect.G",
        "indirect.R",
    ];
    let total = |names: &[&str]| {
        write(
            &path,
            names,
            Encoding::UNCOMPRESSED,
            LayerAttributes::default(),
        );
        LayeredImage::read(&path).unwrap().total_radiance()
    };
    let red_of_pixel_9 = |total: Option<Vec<f32>>| total.unwrap()[9 * 3];
    assert_eq!(red_of_pixel_9(total(&parts)), value(2, 9) + value(5, 9));
    let mut with_total = parts.to_vec();
    with_total.extend(["radiance.B", "radiance.G", "radiance.R"]);
    assert_eq!(red_of_pixel_9(total(&with_total)), value(8, 9));
    assert_eq!(total(&parts[..3]), None);
}
