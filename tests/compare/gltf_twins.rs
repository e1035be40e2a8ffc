//! Files that say the same in other ways show the same pixels.

use crate::common::gltf_file::GltfBuilder;
use crate::common::gpu::Gpu;
use crate::common::scene_folder::SceneFolder;
use camlux::Scene;
use camlux::output::{Frame, Layer};

const HEAD: &str = "[camera]
resolution = [32, 32]
position = [0.0, 0.0, 3.0]
look_at = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
fov_y_deg = 50.0
[[light]]
kind = \"point\"
position = [0.7, 0.5, 1.5]
power_w = 20.0
[[mesh]]
path = \"room.glb\"
";

fn load(file: &[u8]) -> Scene {
    let folder = SceneFolder::new();
    folder.write("room.glb", file);
    folder.load(HEAD).unwrap_or_else(|error| panic!("{error}"))
}

fn visible_pixels(frame: &Frame) -> usize {
    let ids = frame.ids(Layer::InstanceId).expect("it is there");
    ids.iter().filter(|id| **id != 0).count()
}

const SQUARE: [[f32; 3]; 4] = [
    [-1.0, -1.0, 0.1],
    [1.0, -1.0, 0.1],
    [1.0, 1.0, 0.1],
    [-1.0, 1.0, 0.1],
];

/// Without a texture, the factor's alpha alone decides.
#[test]
fn a_surface_below_its_cutoff_is_not_seen() {
    let mut gpu = Gpu::open();
    let mut seen = |material: &str| {
        let mut builder = GltfBuilder::default();
        builder.vec3(&SQUARE);
        let members = format!(
            r#""materials":[{{"pbrMetallicRoughness":{{"baseColorFactor":[0.8,0.8,0.8,0.2]}},{material}}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6,"material":0}}]}}],
            "nodes":[{{"mesh":0}}],"scenes":[{{"nodes":[0]}}]"#
        );
        visible_pixels(&gpu.render(&load(&builder.glb(&members))))
    };
    let whole = seen(r#""alphaMode":"OPAQUE""#);
    assert!(whole > 400, "{whole}");
    assert_eq!(seen(r#""alphaMode":"MASK""#), 0);
    assert_eq!(seen(r#""alphaMode":"MASK","alphaCutoff":0.1"#), whole);
    assert_eq!(seen(r#""alphaMode":"MASK","alphaCutoff":0"#), whole);
}

/// A bent sheet with a normal map and tangents. `mirrored`: its x is negated in the data, and its triangles turn the other way.
fn sheet(builder: &mut GltfBuilder, mirrored: bool, has_tangents: bool) -> String {
    const STEPS: u16 = 6;
    let side = if mirrored { -1.0 } else { 1.0 };
    let places = (0..=STEPS).flat_map(|row| (0..=STEPS).map(move |column| [column, row]));
    let places: Vec<[f32; 2]> = places
        .map(|place| place.map(|step| 2.0 * f32::from(step) / f32::from(STEPS) - 1.0))
        .collect();
    let at = |[x, y]: &[f32; 2]| [side * x, *y, 0.2 * x * x - 0.1 * x * y];
    let positions: Vec<[f32; 3]> = places.iter().map(at).collect();
    let normal = |[x, y]: &[f32; 2]| [side * (0.1 * y - 0.4 * x), 0.1 * x, 1.0];
    let normals: Vec<[f32; 3]> = places.iter().map(normal).collect();
    let texcoords: Vec<[f32; 2]> = places
        .iter()
        .map(|[x, y]| [0.5 + 0.5 * x, 0.5 - 0.5 * y])
        .collect();
    let corner = |column: u16, row: u16| row * (STEPS + 1) + column;
    let cells = (0..STEPS).flat_map(|row| (0..STEPS).map(move |column| (column, row)));
    let indices: Vec<u16> = cells
        .flat_map(|(column, row)| {
            let [a, b] = [corner(column, row), corner(column + 1, row)];
            let [c, d] = [corner(column + 1, row + 1), corner(column, row + 1)];
            match mirrored {
                false => [a, b, c, a, c, d],
                true => [a, c, b, a, d, c],
            }
        })
        .collect();
    let tangents = vec![[side, 0.0, 0.0, side]; positions.len()];
    let (positions, normals) = (builder.vec3(&positions), builder.vec3(&normals));
    let (texcoords, indices) = (builder.vec2(&texcoords), builder.indices_u16(&indices));
    let tangents = match has_tangents {
        true => format!(r#","TANGENT":{}"#, builder.vec4(&tangents)),
        false => String::new(),
    };
    format!(
        r#"{{"attributes":{{"POSITION":{positions},"NORMAL":{normals},"TEXCOORD_0":{texcoords}{tangents}}},"indices":{indices},"material":0}}"#
    )
}

/// The sheet in a file with these nodes.
fn scene_of_sheet(mirrored: bool, has_tangents: bool, nodes: &str) -> Scene {
    let mut builder = GltfBuilder::default();
    let primitive = sheet(&mut builder, mirrored, has_tangents);
    let texel = |x: u32, y: u32| image::Rgb([100 + 40 * x as u8, 90 + 30 * y as u8, 220]);
    let mut png = std::io::Cursor::new(Vec::new());
    let picture = image::RgbImage::from_fn(3, 2, texel);
    picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let image = builder.view(&png.into_inner());
    let members = format!(
        r#""images":[{{"bufferView":{image}}}],"textures":[{{"source":0}}],"materials":[{{"normalTexture":{{"index":0}}}}],
        "meshes":[{{"primitives":[{primitive}]}}],"nodes":[{nodes}],"scenes":[{{"nodes":[0,1]}}]"#
    );
    load(&builder.glb(&members))
}

/// The layers of both frames agree within rounding, but for pixels at the rim of a surface.
#[track_caller]
fn assert_same_pixels(found: &Frame, due: &Frame) {
    for layer in [Layer::Position, Layer::Normal, Layer::Direct] {
        let [found, due] = [found, due].map(|frame| frame.values(layer).expect("it is there"));
        let is_off = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-4 * b.abs().max(0.1);
        let off = found.iter().zip(due).filter(is_off).count();
        assert!(off < 12, "{layer:?}: {off} values differ");
    }
}

/// Normals, their maps and tangents of a node that mirrors are those of the mirrored data.
#[test]
fn a_mirroring_node_shows_the_pixels_of_its_mirrored_twin() {
    let mut gpu = Gpu::open();
    // Far off, so that only one is seen.
    let (plain, mirroring) = (r#"{"mesh":0"#, r#"{"mesh":0,"scale":[-1,1,1]"#);
    let [here, away] = ["}", r#","translation":[0,0,90]}"#];
    let nothing = "{}";
    for has_tangents in [false, true] {
        // Once a copy of the mesh, and once an instance of a mesh that another node places too.
        for is_shared in [false, true] {
            let other = |node: &str| match is_shared {
                true => format!("{node}{away}"),
                false => nothing.to_owned(),
            };
            let twin = scene_of_sheet(
                true,
                has_tangents,
                &format!("{plain}{here},{}", other(plain)),
            );
            let node = format!("{mirroring}{here},{}", other(plain));
            let mirrored = scene_of_sheet(false, has_tangents, &node);
            let [twin, mirrored] = [twin, mirrored].map(|scene| gpu.render(&scene));
            println!("tangents {has_tangents}, shared {is_shared}");
            assert_same_pixels(&mirrored, &twin);
        }
    }
}
