//! What the numbers of a glTF file mean: accessors, triangles, texture coordinates, tangents, colours, alpha, instances.

use crate::common::gltf_file::GltfBuilder;
use crate::common::scene_folder::{CAMERA, LIGHT, SceneFolder, assert_says};
use camlux::Scene;
use camlux::scene::{Encoding, Filter, Mesh, Texels, Wrap};
use glam::{DVec2, DVec3};

const FLOAT: u32 = 5126;
const SQUARE: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
const NODE: &str = r#""nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}]"#;

fn load(file: &[u8]) -> Scene {
    let folder = SceneFolder::new();
    folder.write("room.glb", file);
    let scene = folder.load(&format!("{CAMERA}{LIGHT}[[mesh]]\npath = \"room.glb\"\n"));
    scene.unwrap_or_else(|error| panic!("{error}"))
}

/// The mesh of a file with one primitive of these members.
fn mesh_of(builder: &GltfBuilder, primitive: &str) -> Mesh {
    let members = format!(r#""meshes":[{{"primitives":[{{{primitive}}}]}}],{NODE}"#);
    Mesh::clone(&load(&builder.glb(&members)).meshes[0].mesh)
}

fn bytes<T: Copy, const N: usize>(values: &[T], convert: fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|&value| convert(value)).collect()
}

/// The normals of the triangles, by their winding.
fn facing(mesh: &Mesh) -> Vec<DVec3> {
    let corner = |vertex: u32| mesh.positions_m[vertex as usize];
    let normal = |&[a, b, c]: &[u32; 3]| (corner(b) - corner(a)).cross(corner(c) - corner(a));
    mesh.triangles.iter().map(normal).collect()
}

#[test]
fn the_triangles_of_strips_and_fans_turn_alike() {
    let mut builder = GltfBuilder::default();
    let zigzag: Vec<[f32; 3]> = (0..7_u8)
        .map(|i| [f32::from(i / 2), f32::from(i % 2), 0.0])
        .collect();
    builder.vec3(&zigzag);
    let strip = mesh_of(&builder, r#""attributes":{"POSITION":0},"mode":5"#);
    assert_eq!(strip.triangles[..2], [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(strip.triangles.len(), 5);
    // The first triangle gives the front.
    assert!(facing(&strip).iter().all(|normal| normal.z < 0.0));

    let mut builder = GltfBuilder::default();
    builder.vec3(&SQUARE);
    let fan = mesh_of(&builder, r#""attributes":{"POSITION":0},"mode":6"#);
    assert_eq!(fan.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert!(facing(&fan).iter().all(|normal| normal.z > 0.0));
}

#[test]
fn a_face_whose_normals_are_zero_is_flat() {
    let mut builder = GltfBuilder::default();
    // In the plane y = 0.
    builder.vec3(&[[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
    builder.vec3(&[[0.0; 3]; 3]);
    let mesh = mesh_of(&builder, r#""attributes":{"POSITION":0,"NORMAL":1}"#);
    let is_up = |normal: &DVec3| (*normal - DVec3::Y).length() < 1e-9;
    assert!(mesh.normals.is_empty() || mesh.normals.iter().all(is_up));
    assert!(facing(&mesh)[0].y > 0.0);
}

#[test]
fn the_lowest_normalised_integers_are_minus_one() {
    let more = r#","normalized":true"#;
    let shorts = bytes(&[-32768_i16, 0, 0, 0, -32767, 0, 0, 0], i16::to_le_bytes);
    let mut builder = GltfBuilder::default();
    builder.vec3(&SQUARE[..2]);
    builder.raw(&shorts, 5122, 2, "VEC4", more);
    builder.raw(
        &bytes(&[-128_i8, 0, 0, 127, -127, 0, 0, 127], i8::to_le_bytes),
        5120,
        2,
        "VEC4",
        more,
    );
    for accessor in [1, 2] {
        let members = format!(
            r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6}}]}}],
            "nodes":[{{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"ROTATION":{accessor}}}}}}}}}],"scenes":[{{"nodes":[0]}}]"#
        );
        let scene = load(&builder.glb(&members));
        let [a, b] = [0, 1].map(|i| scene.meshes[i].to_world.matrix3);
        assert!(a.abs_diff_eq(b, 1e-12), "{accessor}: {a} {b}");
    }
}

#[test]
fn sparse_accessors_and_accessors_without_data_are_read() {
    let mut builder = GltfBuilder::default();
    builder.vec3(&SQUARE);
    let places = builder.view(&[1, 3]);
    let values = builder.view(&bytes(
        &[1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0],
        f32::to_le_bytes,
    ));
    let sparse = format!(
        r#""sparse":{{"count":2,"indices":{{"bufferView":{places},"componentType":5121}},"values":{{"bufferView":{values}}}}}"#
    );
    let of_zeros = format!(r#""componentType":{FLOAT},"count":4,"type":"VEC3",{sparse}"#);
    let (zeros, of_square) = (
        builder.bare(&of_zeros),
        format!(r#""bufferView":0,{of_zeros}"#),
    );
    let replaced = builder.bare(&of_square);
    let plain = builder.bare(&format!(
        r#""componentType":{FLOAT},"count":4,"type":"VEC3""#
    ));
    let positions = |accessor: usize| {
        let primitive = format!(r#""attributes":{{"POSITION":{accessor}}},"mode":6"#);
        mesh_of(&builder, &primitive).positions_m
    };
    let [a, b] = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)];
    let zero = DVec3::ZERO;
    assert_eq!(positions(zeros), [zero, a, zero, b]);
    assert_eq!(positions(replaced), [zero, a, DVec3::new(1.0, 1.0, 0.0), b]);
    assert_eq!(positions(plain), [zero; 4]);
}

fn png(width: u32, texel: fn(u32) -> [u8; 4]) -> Vec<u8> {
    let mut png = std::io::Cursor::new(Vec::new());
    let picture = image::RgbaImage::from_fn(width, 1, |x, _| image::Rgba(texel(x)));
    picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
    png.into_inner()
}

/// A square whose four sets of texture coordinates differ, with this material.
fn textured(material: &str) -> camlux::Result<Scene> {
    let mut builder = GltfBuilder::default();
    builder.vec3(&SQUARE);
    let mut attributes = String::from(r#""POSITION":0"#);
    for set in 0..4_u8 {
        let at = f32::from(set) / 8.0;
        let accessor = builder.vec2(&[[at, 0.0], [1.0, at], [1.0, 1.0], [at, 1.0]]);
        attributes += &format!(r#","TEXCOORD_{set}":{accessor}"#);
    }
    let image = builder.view(&png(2, |x| [200, 100, 50, if x == 0 { 255 } else { 51 }]));
    let members = format!(
        r#""images":[{{"bufferView":{image}}}],"samplers":[{{"wrapS":33071,"wrapT":33648,"magFilter":9728}}],
        "textures":[{{"source":0}},{{"source":0,"sampler":0}}],"materials":[{{"name":"wood",{material}}}],
        "meshes":[{{"primitives":[{{"attributes":{{{attributes}}},"mode":6,"material":0}}]}}],{NODE}"#
    );
    let folder = SceneFolder::new();
    folder.write("room.glb", builder.glb(&members));
    folder.load(&format!("{CAMERA}{LIGHT}[[mesh]]\npath = \"room.glb\"\n"))
}

#[test]
fn textures_use_the_sets_of_texture_coordinates_that_they_name() {
    // Of each set, u of the first corner tells which one it is.
    let first = |texcoords: &[[f64; 2]]| texcoords.first().map(|[u, _]| 8.0 * u);
    for (base, normal) in [(0, 0), (1, 1), (0, 3), (3, 0), (2, 1)] {
        let scene = textured(&format!(
            r#""pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,"texCoord":{base}}}}},"normalTexture":{{"index":0,"texCoord":{normal}}}"#
        ))
        .unwrap();
        let (mesh, material) = (&scene.meshes[0], &scene.materials[0]);
        for (lookup, set) in [
            (material.kd_texture, base),
            (material.normal_texture, normal),
        ] {
            let texcoords = match lookup.unwrap().texcoord_set {
                0 => &mesh.texcoords,
                _ => &mesh.texcoords_1,
            };
            assert_eq!(first(texcoords), Some(f64::from(set)), "{base} {normal}");
        }
    }
    // The extension's set goes before.
    let scene = textured(
        r#""normalTexture":{"index":0,"texCoord":1,"extensions":{"KHR_texture_transform":{"texCoord":2}}}"#,
    )
    .unwrap();
    assert_eq!(first(&scene.meshes[0].texcoords), Some(2.0));
    let warnings = scene.warnings().join("\n");
    for set in [0, 1, 3] {
        assert_says(&warnings, &[&format!("TEXCOORD_{set} of primitives")]);
    }
}

#[test]
fn samplers_say_how_textures_repeat_and_are_filtered() {
    let lookup = |texture: u32| {
        let base =
            format!(r#""pbrMetallicRoughness":{{"baseColorTexture":{{"index":{texture}}}}}"#);
        textured(&base).unwrap().materials[0].kd_texture.unwrap()
    };
    let plain = lookup(0);
    assert_eq!(
        (plain.wrap, plain.filter),
        ([Wrap::Repeat; 2], Filter::Bilinear)
    );
    let other = lookup(1);
    assert_eq!(
        (other.wrap, other.filter),
        ([Wrap::Clamp, Wrap::Mirror], Filter::Nearest)
    );
    assert_eq!(plain.texture, other.texture, "the image is loaded once");
}

/// The specification's transform of (u, v), v downwards, against the one of the scene, v upwards.
#[test]
fn transforms_of_texture_coordinates_are_those_of_the_extension() {
    for (offset, rotation, scale) in [
        ([0.0, 0.0], 0.0, [1.0, 1.0]),
        ([0.3, -0.1], 0.0, [2.0, 0.5]),
        ([0.0, 1.0], std::f64::consts::FRAC_PI_2, [0.5, 0.5]),
        ([0.7, 0.2], 0.4, [-3.0, 1.5]),
    ] {
        let scene = textured(&format!(
            r#""normalTexture":{{"index":0,"extensions":{{"KHR_texture_transform":{{"offset":{offset:?},"rotation":{rotation:?},"scale":{scale:?}}}}}}}"#
        ))
        .unwrap();
        let lookup = scene.materials[0].normal_texture.unwrap();
        for [u, v] in [[0.0, 0.0], [1.0, 0.0], [0.25, 0.7]] {
            // Scaled, turned counterclockwise as seen with v downwards, and moved.
            let scaled = DVec2::new(scale[0] * u, scale[1] * v);
            let turned = DVec2::from_angle(-rotation).rotate(scaled);
            let due = turned + DVec2::from(offset);
            let [found_u, found_v] = lookup.texcoord([u, 1.0 - v]);
            let found = DVec2::new(found_u, 1.0 - found_v);
            assert!(
                found.distance(due) < 1e-12,
                "{offset:?} {rotation}: {found} {due}"
            );
        }
        if rotation > 1.0 {
            // The example of the extension: the lower left quadrant of the image.
            let centre = lookup.texcoord([0.5, 0.5]);
            assert!(DVec2::from(centre).distance(DVec2::new(0.25, 0.25)) < 1e-12);
        }
    }
}

#[test]
fn a_textured_primitive_without_its_texture_coordinates_is_refused() {
    let error = textured(r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":9}}"#)
        .unwrap_err();
    let message = error.to_string();
    assert!(message.contains("\"wood\" has no TEXCOORD_9"), "{message}");
}

/// Tangents as Blender and MikkTSpace write them: +1 where the image is not mirrored on the surface.
#[test]
fn tangents_agree_with_texture_coordinates() {
    for mirrored in [false, true] {
        let u = |x: f32| if mirrored { 1.0 - x } else { x };
        let mut builder = GltfBuilder::default();
        builder.vec3(&SQUARE);
        builder.vec3(&[[0.0, 0.0, 1.0]; 4]);
        // v grows downwards, from y = 1 to y = 0.
        builder.vec2(&SQUARE.map(|[x, y, _]| [u(x), 1.0 - y]));
        let sign = if mirrored { -1.0 } else { 1.0 };
        builder.vec4(&[[sign, 0.0, 0.0, sign]; 4]);
        let image = builder.view(&png(1, |_| [128, 200, 230, 255]));
        let file = |node: &str| {
            let members = format!(
                r#""images":[{{"bufferView":{image}}}],"textures":[{{"source":0}}],"materials":[{{"normalTexture":{{"index":0}}}}],
                "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2,"TANGENT":3}},"mode":6,"material":0}}]}}],
                "nodes":[{{"mesh":0{node}}}],"scenes":[{{"nodes":[0]}}]"#
            );
            load(&builder.glb(&members))
        };
        for node in [
            "",
            r#","scale":[-1,1,1]"#,
            r#","rotation":[0.6,0,0,0.8],"scale":[1,2,-1]"#,
        ] {
            let scene = file(node);
            let mesh = &scene.meshes[0];
            assert_eq!(mesh.tangents.len(), 4);
            for &[x, y, z, sign] in &mesh.tangents {
                let tangent = DVec3::new(x.into(), y.into(), z.into());
                let bitangent = f64::from(sign) * mesh.normals[0].cross(tangent);
                // How u and v grow along both, by the texture coordinates.
                let grows = |along: DVec3, axis: usize| {
                    let corners = 0..mesh.positions_m.len();
                    let terms = corners.map(|corner| {
                        let position = mesh.positions_m[corner] - mesh.positions_m[0];
                        let texcoord = mesh.texcoords[corner][axis] - mesh.texcoords[0][axis];
                        position.dot(along) * texcoord
                    });
                    terms.sum::<f64>()
                };
                assert!(grows(tangent, 0) > 0.5, "{node} {mirrored}");
                assert!(grows(bitangent, 1) > 0.5, "{node} {mirrored}");
            }
        }
    }
}

#[test]
fn colours_of_vertices_are_read_in_every_form() {
    let mut builder = GltfBuilder::default();
    builder.vec3(&SQUARE);
    let floats = [[0.5, 0.25, 1.0_f32]; 4];
    let rgb = builder.vec3(&floats);
    let rgba = builder.vec4(&[[0.5, 0.25, 1.0, 1.0]; 4]);
    let more = r#","normalized":true"#;
    let short = bytes(
        &[[32767_u16, 16383, 65535, 32767]; 4].concat(),
        u16::to_le_bytes,
    );
    let short = builder.raw(&short, 5123, 4, "VEC4", more);
    let byte = builder.raw(&[[128, 64, 255, 255]; 4].concat(), 5121, 4, "VEC4", more);
    for (accessor, has_alpha) in [(rgb, false), (rgba, false), (short, true), (byte, false)] {
        let members = format!(
            r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"COLOR_0":{accessor}}},"mode":6}}]}}],{NODE}"#
        );
        let scene = load(&builder.glb(&members));
        let colors = &scene.meshes[0].colors;
        assert_eq!(colors.len(), 4);
        for (found, due) in colors.iter().flatten().zip(floats.as_flattened()) {
            assert!((found - due).abs() < 0.003, "{accessor}: {colors:?}");
        }
        let warnings = scene.warnings().join("\n");
        assert_eq!(
            warnings.contains("the alpha of COLOR_0"),
            has_alpha,
            "{warnings}"
        );
    }
    // Beside a primitive without colours, which is white.
    let mut builder = GltfBuilder::default();
    builder.vec3(&SQUARE);
    builder.vec3(&floats);
    let both = r#"{"attributes":{"POSITION":0},"mode":6},{"attributes":{"POSITION":0,"COLOR_0":1},"mode":6}"#;
    let members = format!(r#""meshes":[{{"primitives":[{both}]}}],{NODE}"#);
    let scene = load(&builder.glb(&members));
    let colors = &scene.meshes[0].colors;
    assert_eq!([colors[0], colors[4]], [[1.0; 3], floats[0]]);
}

/// The number of triangles, and the cutoff of what is left.
#[test]
fn alpha_is_the_factor_times_the_texture() {
    let opaque = r#""alphaMode":"OPAQUE""#.to_owned();
    let mask = |cutoff: &str| format!(r#""alphaMode":"MASK"{cutoff}"#);
    let below = |cutoff: f64| mask(&format!(r#","alphaCutoff":{cutoff}"#));
    let cases = [
        // Without a texture: the factor against the cutoff.
        (mask(""), "", 0.2, (0, None)),
        (mask(""), "", 0.5, (2, None)),
        (below(0.2), "", 0.3, (2, None)),
        (below(0.0), "", 0.0, (2, None)),
        (below(1.1), "", 1.0, (0, None)),
        (opaque.clone(), "", 0.0, (2, None)),
        // The texels have 255 and 51, which are 1 and 0.2.
        (mask(""), "0", 1.0, (2, Some(0.5))),
        (below(0.1), "0", 0.5, (2, None)),
        (below(0.15), "0", 0.5, (2, Some(0.3))),
        (below(0.0), "0", 1.0, (2, None)),
        (below(0.6), "0", 0.5, (0, None)),
        (below(1.1), "0", 1.0, (0, None)),
        (opaque, "0", 0.1, (2, None)),
    ];
    for (mode, texture, factor, due) in cases {
        let texture = match texture {
            "" => String::new(),
            index => format!(r#","baseColorTexture":{{"index":{index}}}"#),
        };
        let scene = textured(&format!(
            r#""pbrMetallicRoughness":{{"baseColorFactor":[1,1,1,{factor}]{texture}}},{mode}"#
        ))
        .unwrap();
        let cutoff = scene
            .materials
            .first()
            .and_then(|material| material.alpha_texture.map(|_| material.alpha_cutoff));
        let found = (scene.meshes[0].triangles.len(), cutoff);
        assert_eq!(found.0, due.0, "{mode} {texture} {factor}");
        let is_near = match (found.1, due.1) {
            (Some(found), Some(due)) => (found - due).abs() < 1e-12,
            (found, due) => found.is_none() && due.is_none(),
        };
        assert!(is_near, "{mode} {texture} {factor}: {found:?} {due:?}");
    }
    let named = |material: &str| {
        let warnings = textured(material).unwrap().warnings().join("\n");
        warnings.contains("BLEND")
    };
    assert!(!named(r#""alphaMode":"BLEND""#));
    assert!(named(
        r#""alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5]}"#
    ));
    assert!(named(
        r#""alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorTexture":{"index":0}}"#
    ));
}

#[test]
fn instances_of_a_node_are_placed_by_their_attributes() {
    let mut builder = GltfBuilder::default();
    builder.vec3(&SQUARE);
    builder.vec3(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    builder.vec3(&[[2.0, 2.0, 2.0], [1.0, 3.0, 1.0]]);
    let members = r#""extensionsRequired":["EXT_mesh_gpu_instancing"],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":6}]}],
        "nodes":[{"name":"tree","mesh":0,"translation":[10,0,0],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":1,"SCALE":2,"_ID":2}}}}],
        "scenes":[{"nodes":[0]}]"#;
    let scene = load(&builder.glb(members));
    let names: Vec<&str> = scene.meshes.iter().map(|mesh| &*mesh.name).collect();
    assert_eq!(names, ["room.glb#tree[0]", "room.glb#tree[1]"]);
    assert!(scene.meshes[0].ptr_eq(&scene.meshes[1]));
    let corner = |instance: usize| scene.meshes[instance].placed().positions_m[2];
    assert_eq!(corner(0), DVec3::new(13.0, 4.0, 3.0));
    assert_eq!(corner(1), DVec3::new(15.0, 8.0, 6.0));
    let warnings = scene.warnings().join("\n");
    assert_says(&warnings, &["_ID of EXT_mesh_gpu_instancing"]);
}

/// A factor of 1 is 1 cd/m², times the strength of the extension.
#[test]
fn surfaces_emit_the_luminance_of_the_file() {
    const NITS: f64 = 1.0 / 683.0;
    let emission = |members: &str| {
        let scene = textured(members).unwrap();
        let warnings = scene.warnings().join("\n");
        let material = &scene.materials[0];
        let texture = material.emission_texture.map(|lookup| {
            let texels = &scene.textures[lookup.texture].texels;
            let is_srgb = matches!(texels, Texels::U8(_, Encoding::Srgb));
            (lookup.texcoord_set, is_srgb, texels.len())
        });
        (material.emission_w_sr_m2, texture, warnings)
    };
    let (plain, texture, _) = emission(r#""emissiveFactor":[1,0.5,0]"#);
    assert_eq!((plain, texture), ([NITS, 0.5 / 683.0, 0.0], None));
    let strong = r#""emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":683}}"#;
    let (strong, ..) = emission(strong);
    assert_eq!(strong, [1.0, 0.5, 0.0]);
    let (weak, ..) =
        emission(r#""extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":683}}"#);
    assert_eq!(weak, [0.0; 3], "the factor is 0 when absent");

    let texture = |set: u32| format!(r#""emissiveTexture":{{"index":0,"texCoord":{set}}}"#);
    let (_, found, _) = emission(&format!(r#""emissiveFactor":[1,1,1],{}"#, texture(1)));
    assert_eq!(
        found,
        Some((0, true, 2)),
        "the only set of coordinates is the first"
    );
    let (none, found, warnings) = emission(&texture(1));
    assert_eq!((none, found), ([0.0; 3], None));
    assert_says(
        &warnings,
        &["emissiveTexture of materials (its emissiveFactor is 0)"],
    );
    let others = r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1}},"normalTexture":{"index":0,"texCoord":2}"#;
    let third = |set| format!(r#""emissiveFactor":[1,1,1],{},{others}"#, texture(set));
    let (_, found, _) = emission(&third(2));
    assert_eq!(found, Some((1, true, 2)));
    let (bright, found, warnings) = emission(&third(3));
    assert_eq!((bright, found), ([NITS; 3], None));
    assert_says(&warnings, &["an emissiveTexture with a third set"]);

    let message = textured(r#""emissiveFactor":[1,-1,1]"#)
        .unwrap_err()
        .to_string();
    assert_says(
        &message,
        &["material \"wood\"", "emission_w_sr_m2", "from 0 to 1e24"],
    );
}

/// Where a node mirrors, the corners of its triangles turn clockwise, and their front is still their front.
#[test]
fn surfaces_have_one_side_unless_they_are_double_sided() {
    let is_one_sided = |members: &str| textured(members).unwrap().materials[0].is_one_sided;
    assert!(is_one_sided(r#""alphaMode":"OPAQUE""#));
    assert!(is_one_sided(r#""doubleSided":false"#));
    assert!(!is_one_sided(r#""doubleSided":true"#));

    let mut builder = GltfBuilder::default();
    builder.vec3(&SQUARE);
    for (scale, due) in [
        ([1, 1, 1], 1.0),
        ([1, 1, -1], -1.0),
        ([-1, 1, 1], 1.0),
        ([-1, -1, 1], 1.0),
    ] {
        // Once a copy of the mesh, and once an instance of a mesh that another node places too.
        for other in [r#"{"mesh":0}"#, "{}"] {
            let members = format!(
                r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6}}]}}],
                "nodes":[{{"mesh":0,"scale":{scale:?}}},{other}],"scenes":[{{"nodes":[0,1]}}]"#
            );
            let scene = load(&builder.glb(&members));
            assert!(scene.materials[0].is_one_sided, "the default material");
            let fronts = facing(&scene.meshes[0].placed());
            assert!(
                fronts.iter().all(|front| front.z == due),
                "{scale:?}: {fronts:?}"
            );
        }
    }
}

/// A file that is placed twice is read once, and has one warning.
#[test]
fn a_file_that_is_placed_twice_has_one_warning() {
    let mut builder = GltfBuilder::default();
    builder.vec3(&SQUARE);
    let members = format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"COLOR_1":0}},"mode":6}}]}}],{NODE}"#
    );
    let folder = SceneFolder::new();
    folder.write("room.glb", builder.glb(&members));
    let mesh = "[[mesh]]\npath = \"room.glb\"\n";
    let scene = folder.load(&format!(
        "{CAMERA}{LIGHT}{mesh}{mesh}translate = [1, 0, 0]\n"
    ));
    let scene = scene.unwrap();
    assert_eq!(scene.meshes.len(), 2);
    let warnings = scene.warnings().join("\n");
    assert_eq!(warnings.matches("camlux ignores").count(), 1, "{warnings}");
    assert!(warnings.contains("COLOR_1"), "{warnings}");
}
