//! glTF files, against the same scene as OBJ, bit for bit, and node by node against the format's definitions.

use std::fmt::Write;

use crate::common::gltf_file::GltfBuilder;
use crate::common::gpu::Gpu;
use crate::common::rows::assert_says;
use crate::common::scene_folder::SceneFolder;
use camlux::Scene;
use camlux::scene::{Encoding, Lens, Light, MetallicRoughness, Profile, Texels, TextureLookup};
use glam::{DQuat, DVec3};

const HEAD: &str = "[camera]
resolution = [40, 30]
position = [0.3, 1.0, 3.0]
look_at = [0.0, 0.6, 0.0]
up = [0.0, 1.0, 0.0]
fov_y_deg = 50.0
[indirect]
estimator = \"final-gather\"
target_error = 0.1
[material.clay]
kd = [0.7, 0.5, 0.3]
";
const LIGHT: &str = "[[light]]
kind = \"point\"
position = [0.25, 1.5, 0.5]
power_w = 20.0
";

/// A bent sheet: positions, normals, texture coordinates with v down, triangles.
struct Sheet {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    texcoords: Vec<[f32; 2]>,
    triangles: Vec<[u32; 3]>,
}

fn sheet(height: f32) -> Sheet {
    const STEPS: u32 = 8;
    let places = (0..=STEPS).flat_map(|row| (0..=STEPS).map(move |column| [column, row]));
    let places = places.map(|place| place.map(|step| step as f32 / STEPS as f32));
    let bend = |[u, v]: [f32; 2]| height * (3.1 * u).sin() * (2.7 * v + 0.2).cos();
    let corner = |column: u32, row: u32| row * (STEPS + 1) + column;
    let cells = (0..STEPS).flat_map(|row| (0..STEPS).map(move |column| (column, row)));
    Sheet {
        positions: places
            .clone()
            .map(|[u, v]| [2.0 * u - 1.0, bend([u, v]), 2.0 * v - 1.0])
            .collect(),
        normals: places
            .clone()
            .map(|[u, v]| [-bend([u + 0.1, v]), 1.0, bend([u, v])])
            .collect(),
        texcoords: places.collect(),
        triangles: cells
            .flat_map(|(column, row)| {
                let [a, b] = [corner(column, row), corner(column + 1, row)];
                let [c, d] = [corner(column + 1, row + 1), corner(column, row + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect(),
    }
}

impl Sheet {
    fn obj(&self) -> String {
        let mut text = String::from("mtllib sheet.mtl\nusemtl textured\n");
        // `{:?}` writes an f64 so that it reads back exactly.
        for [x, y, z] in self.positions.iter().map(|p| p.map(f64::from)) {
            writeln!(text, "v {x:?} {y:?} {z:?}").unwrap();
        }
        for [x, y, z] in self.normals.iter().map(|n| n.map(f64::from)) {
            writeln!(text, "vn {x:?} {y:?} {z:?}").unwrap();
        }
        for [u, v] in self.texcoords.iter().map(|t| t.map(f64::from)) {
            writeln!(text, "vt {u:?} {:?}", 1.0 - v).unwrap();
        }
        for [a, b, c] in self.triangles.iter().map(|t| t.map(|corner| corner + 1)) {
            writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}").unwrap();
        }
        text
    }

    /// A primitive; `material` is JSON, such as `,"material":0`.
    fn primitive(&self, builder: &mut GltfBuilder, material: &str) -> String {
        let positions = builder.vec3(&self.positions);
        let normals = builder.vec3(&self.normals);
        let texcoords = builder.vec2(&self.texcoords);
        let indices = builder.indices(&self.triangles);
        format!(
            r#"{{"attributes":{{"POSITION":{positions},"NORMAL":{normals},"TEXCOORD_0":{texcoords}}},"indices":{indices}{material}}}"#
        )
    }
}

fn checkered_png() -> Vec<u8> {
    let texel = |x: u32, y: u32| image::Rgb([40 * x as u8, 60 * y as u8, 200]);
    let mut png = std::io::Cursor::new(Vec::new());
    let picture = image::RgbImage::from_fn(4, 3, texel);
    picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
    png.into_inner()
}

fn load(folder: &SceneFolder, mesh: &str) -> Scene {
    folder.load(&format!("{HEAD}{LIGHT}{mesh}")).unwrap()
}

/// The corners of each triangle of a scene's only mesh. Vertex indices may differ.
fn corners(scene: &Scene) -> Vec<[(DVec3, DVec3, [f64; 2]); 3]> {
    let [mesh] = &scene.meshes[..] else {
        panic!("there is one mesh");
    };
    let vertex = |vertex: u32| {
        let vertex = vertex as usize;
        (
            mesh.positions_m[vertex],
            mesh.normals[vertex],
            mesh.texcoords[vertex],
        )
    };
    mesh.triangles
        .iter()
        .map(|triangle| triangle.map(vertex))
        .collect()
}

#[test]
fn a_scene_is_that_of_the_obj_bit_for_bit() {
    let mut gpu = Gpu::open();
    let folder = SceneFolder::new();
    let sheet = sheet(0.4);
    folder
        .write("sheet.obj", sheet.obj())
        .write("checkered.png", checkered_png())
        .write(
            "sheet.mtl",
            "newmtl textured\nKd 1 1 1\nPr 0.5\nmap_Kd checkered.png\n",
        );
    let mut builder = GltfBuilder::default();
    let image = builder.view(&checkered_png());
    let primitive = sheet.primitive(&mut builder, r#","material":0"#);
    let members = format!(
        r#""images":[{{"bufferView":{image},"mimeType":"image/png"}}],"textures":[{{"source":0}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}},"metallicFactor":0,"roughnessFactor":0.5}},"doubleSided":true}}],
        "meshes":[{{"primitives":[{primitive}]}}],"nodes":[{{"mesh":0}}],"scenes":[{{"nodes":[0]}}],"scene":0"#
    );
    let (json, buffer) = builder.gltf(&members, "a%20buffer.bin");
    folder
        .write("sheet.glb", builder.glb(&members))
        .write("sheet.gltf", json);
    folder.write("a buffer.bin", buffer);
    // The scene file also scales, rotates and moves it.
    let mesh = |name: &str| {
        format!(
            "[[mesh]]\npath = \"{name}\"\nscale = 1.5\nrotate_deg = [10, 20, 30]\ntranslate = [0.1, 0.2, -0.3]\n"
        )
    };
    let mut render = |scene: &Scene| gpu.render(scene);
    let of_obj = load(&folder, &mesh("sheet.obj"));
    let expected = render(&of_obj);
    for name in ["sheet.glb", "sheet.gltf"] {
        let scene = load(&folder, &mesh(name));
        assert_eq!(corners(&scene), corners(&of_obj));
        let frame = render(&scene);
        assert_eq!(frame.layers, expected.layers, "{name}");
    }
}

#[test]
fn nodes_place_meshes_lights_and_cameras() {
    let folder = SceneFolder::new();
    let mut builder = GltfBuilder::default();
    let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0_f32]];
    let positions = builder.vec3(&triangle);
    let indices = builder.indices_u16(&[0, 1, 2]);
    let texcoords = builder.vec2_u16(&[[0, 0], [65535, 0], [0, 65535]]);
    let half = 0.5_f64.sqrt();
    let members = format!(
        r#""extensionsUsed":["KHR_lights_punctual","KHR_texture_transform"],
        "extensions":{{"KHR_lights_punctual":{{"lights":[
            {{"type":"point","intensity":683,"color":[1,0.5,0]}},
            {{"type":"spot","intensity":683,"spot":{{"innerConeAngle":0.5,"outerConeAngle":0.5}}}},
            {{"type":"directional","intensity":1366}}]}}}},
        "cameras":[{{"type":"perspective","name":"lens","perspective":{{"yfov":0.5,"znear":0.1}}}},
            {{"type":"orthographic","orthographic":{{"xmag":1,"ymag":1.5,"znear":0.1,"zfar":1}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{positions},"TEXCOORD_0":{texcoords}}},"indices":{indices}}},
            {{"attributes":{{"POSITION":{positions}}},"mode":6}}, {{"attributes":{{"POSITION":{positions}}},"mode":0}}]}}],
        "nodes":[
            {{"name":"outer","translation":[1,2,3],"rotation":[0,{half},0,{half}],"scale":[2,2,2],"children":[1,2,3]}},
            {{"name":"inner","translation":[0,0,1],"mesh":0}},
            {{"extensions":{{"KHR_lights_punctual":{{"light":0}}}},"translation":[0.5,0,0]}},
            {{"extensions":{{"KHR_lights_punctual":{{"light":1}}}},"camera":0,"name":"both"}},
            {{"matrix":[1,0,0,0, 0,-1,0,0, 0,0,1,0, 5,0,0,1],"mesh":0,"extensions":{{"KHR_lights_punctual":{{"light":2}}}}}},
            {{"camera":1,"name":"flat","translation":[0,1,0]}}, {{"camera":1,"name":"scaled","scale":[2,2,2]}}],
        "scenes":[{{"nodes":[0,4,5,6]}}]"#
    );
    folder.write("room.glb", builder.glb(&members));
    let scene = load(&folder, "[[mesh]]\npath = \"room.glb\"\n");
    let names: Vec<&str> = scene.meshes.iter().map(|mesh| mesh.name.as_str()).collect();
    assert_eq!(names, ["room.glb#inner", "room.glb#node4"]);
    assert!(
        scene.meshes[0].ptr_eq(&scene.meshes[1]),
        "they share a mesh"
    );
    let scene = scene.flattened();
    // Maps x to -z and z to x, scales by 2, and moves.
    let turn = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let placed = |p: DVec3| turn * (2.0 * (p + DVec3::Z)) + DVec3::new(1.0, 2.0, 3.0);
    for (found, corner) in scene.meshes[0].positions_m.iter().zip(triangle) {
        let expected = placed(DVec3::from(corner.map(f64::from)));
        assert!((*found - expected).length() < 1e-6, "{found} {expected}");
    }
    assert_eq!(scene.meshes[0].triangles, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(
        scene.meshes[0].texcoords[..3],
        [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]
    );
    assert_eq!(scene.meshes[1].positions_m[2], DVec3::new(5.0, -2.0, 0.0));

    // The scene file's light comes first, then the nodes' lights. 683 lm are 1 W.
    let four_pi = 4.0 * std::f64::consts::PI;
    let kinds: Vec<&str> = scene.lights.iter().map(|light| light.kind()).collect();
    assert_eq!(kinds[1..], ["point", "spot", "directional"]);
    let [_, point, spot, sun] = &scene.lights[..] else {
        panic!("{:?}", scene.lights);
    };
    let position_m = point.position_m().unwrap();
    let expected = DVec3::new(1.0, 2.0, 2.0);
    assert!((position_m - expected).length() < 1e-6, "{position_m}");
    assert_eq!(point.emission(), [four_pi, 0.5 * four_pi, 0.0]);
    let direction = spot.direction().unwrap();
    assert!((direction - DVec3::NEG_X).length() < 1e-6, "{direction}");
    let Some(Profile::Cone(cone)) = spot.lamp().map(|lamp| &lamp.profile) else {
        panic!("{spot:?}");
    };
    assert!((cone.outer_half_angle_deg - 0.5_f64.to_degrees()).abs() < 1e-5);
    let solid_angle_sr = std::f64::consts::TAU * (1.0 - 0.5_f64.cos());
    assert!((spot.emission()[0] / solid_angle_sr - 1.0).abs() < 1e-6);
    assert_eq!(**sun, Light::directional(DVec3::NEG_Z, [2.0; 3]));

    let of_camera = |name: &str, more: &str| {
        let head = HEAD.split_once("[indirect]").unwrap().1;
        let text = format!(
            "[camera]\nresolution = [8, 8]\npath = \"room.glb\"\nname = \"{name}\"\n{more}[indirect]{head}[[mesh]]\npath = \"room.glb\"\n"
        );
        folder.load(&text)
    };
    for name in ["both", "lens"] {
        let camera = of_camera(name, "samples = 4\n").unwrap().camera;
        assert!((camera.position_m - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-6);
        assert!((camera.look_at_m - DVec3::new(0.0, 2.0, 3.0)).length() < 1e-6);
        let Lens::FovY { fov_y_deg } = camera.lens else {
            panic!("{:?}", camera.lens)
        };
        assert!((fov_y_deg - 0.5_f64.to_degrees()).abs() < 1e-5);
        assert!(camera.pixel_sampling.is_some());
    }
    let flat = of_camera("flat", "").unwrap().camera;
    assert_eq!(flat.lens, Lens::Orthographic { height_m: 3.0 });
    assert_eq!(flat.position_m, DVec3::Y);
    for (name, more, says) in [
        ("bot", "", "did you mean \"both\""),
        ("scaled", "", "is orthographic, and scaled by its node"),
        (
            "flat",
            "height_m = 2\n",
            "\"height_m\" in [camera] comes from the file",
        ),
        (
            "both",
            "fov_y_deg = 50\n",
            "\"fov_y_deg\" in [camera] comes from the file",
        ),
    ] {
        let message = of_camera(name, more).unwrap_err().to_string();
        assert!(message.contains(says), "{message}");
    }
    // Each feature that is not modelled is reported once.
    let warnings = scene.warnings().join("\n");
    assert_eq!(
        warnings.matches("points and lines").count(),
        1,
        "{warnings}"
    );
}

#[test]
fn materials_are_mapped() {
    let folder = SceneFolder::new();
    let mut builder = GltfBuilder::default();
    let mut png = |texel: fn(u32) -> [u8; 4]| {
        let mut png = std::io::Cursor::new(Vec::new());
        let picture = image::RgbaImage::from_fn(2, 1, |x, _| image::Rgba(texel(x)));
        picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
        builder.view(&png.into_inner())
    };
    let leaf = png(|x| [200, 100, 50, if x == 0 { 255 } else { 60 }]);
    let normals = png(|_| [255, 128, 128, 255]);
    let rough = png(|x| [0, if x == 0 { 0 } else { 255 }, 51, 255]);
    let sheet = sheet(0.0).primitive(&mut builder, r#","material":0"#);
    let file = |material: &str| {
        let members = format!(
            r#""images":[{{"bufferView":{leaf},"mimeType":"image/png"}},{{"bufferView":{normals},"mimeType":"image/png"}},{{"bufferView":{rough},"mimeType":"image/png"}}],
            "textures":[{{"source":0}},{{"source":1}},{{"source":2}}],"materials":[{{"name":"leaf",{material}}}],
            "meshes":[{{"primitives":[{sheet}]}}],"nodes":[{{"mesh":0}}],"scenes":[{{"nodes":[0]}}]"#
        );
        folder.write("leaf.glb", builder.glb(&members));
        folder.load(&format!("{HEAD}{LIGHT}[[mesh]]\npath = \"leaf.glb\"\n"))
    };
    let scene = file(
        r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0},"baseColorFactor":[0.5,1,1,1],"metallicFactor":1,"metallicRoughnessTexture":{"index":2}},
        "normalTexture":{"index":1,"scale":0.5},"alphaMode":"MASK","alphaCutoff":0.2"#,
    )
    .unwrap();
    let material = &scene.materials[1];
    assert_eq!(material.name, "leaf");
    assert_eq!(material.kd, [0.5, 1.0, 1.0]);
    let expected = MetallicRoughness {
        metallic: 1.0,
        roughness: 1.0,
        ..MetallicRoughness::DEFAULT
    };
    assert_eq!(material.microfacets, Some(expected));
    let texture = |lookup: Option<TextureLookup>| &scene.textures[lookup.unwrap().texture].texels;
    assert_eq!(texture(material.kd_texture).len(), 2);
    // Roughness in green, metallic in blue, as they are.
    let Texels::U8(facets, Encoding::Linear) = texture(material.metallic_roughness_texture) else {
        panic!("linear bytes")
    };
    assert_eq!(facets[..], [[0, 0, 51], [0, 255, 51]]);
    // 60/255 is above the cutoff of 0.2, so no texel is cut out.
    assert!(material.alpha_texture.is_none());
    let Texels::F32(normals) = texture(material.normal_texture) else {
        panic!("a scaled map of normals")
    };
    // (1, 0, 0) has almost no z part, so halving x hardly turns it.
    assert!(normals[0][0] > 0.95, "{normals:?}");
    let cut = file(r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0}},"alphaMode":"MASK""#)
        .unwrap();
    let Texels::U8(alpha, _) =
        &cut.textures[cut.materials[1].alpha_texture.unwrap().texture].texels
    else {
        panic!("alpha of 8 bits")
    };
    assert_eq!(alpha[..], [[255; 3], [60; 3]]);
    let blended =
        file(r#""alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5]}"#)
            .unwrap();
    let warnings = blended.warnings().join("\n");
    assert_says(&warnings, &["BLEND"]);
    let smooth = file(
        r#""pbrMetallicRoughness":{"roughnessFactor":0.01,"metallicFactor":0},"extensions":{"KHR_materials_ior":{"ior":1.3},
        "KHR_materials_specular":{"specularFactor":0.5}}"#,
    );
    let smooth = smooth.unwrap();
    let expected = MetallicRoughness {
        metallic: 0.0,
        roughness: 0.03,
        ior: 1.3,
        specular: 0.5,
    };
    assert_eq!(smooth.materials[1].microfacets, Some(expected));
    assert_says(&smooth.warnings().join("\n"), &["roughness below 0.03"]);
    let other_set = file(r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1}}"#);
    let message = other_set.unwrap_err().to_string();
    assert_says(&message, &["TEXCOORD_1", "material \"leaf\""]);
}
