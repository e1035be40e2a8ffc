//! What a scene file means: values, transforms, materials, textures, triangulation, hash and bounds.

mod scene_folder;

use camlux::scene::{Estimator, Indirect, Intrinsics, Lens, Light, Scene, SpotCone};
use glam::{DMat3, DVec3};
use scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE};

/// Positions of a few metres through a rotation: a handful of roundings of 1e-16 each.
const ROUNDING: f64 = 1e-14;

fn load(toml: &str) -> Scene {
    SceneFolder::new().load(toml).unwrap()
}

fn load_obj(obj: &str) -> Scene {
    SceneFolder::new().load_obj(obj).unwrap()
}

#[track_caller]
fn assert_near(actual: DVec3, expected: DVec3, tolerance: f64) {
    let distance = actual.distance(expected);
    assert!(
        distance <= tolerance,
        "{actual} is {distance:e} from {expected}"
    );
}

#[test]
fn every_key_arrives() {
    let scene = load(
        "version = 1
[camera]
resolution = [640, 0x1e0]
position = [0.5, 1, 3]
look_at = [0, 1, 0]
up = [0, 1, 0]
intrinsics_px = { fx = 500, fy = 501.5, cx = 320, cy = 240 }
[sensor]
pixel_pitch_um = [12, 10.0]
exposure_time_s = 1.0e-3
duty_cycle = 0.5
[[light]]
kind = \"spot\"
position = [0, 2, 0]
direction = [0, -1, 0]
inner_half_angle_deg = 20
outer_half_angle_deg = 30
power_w = [1, 2.0, 3]
[[light]]
kind = \"directional\"
direction = [0, -2, 0]
irradiance_w_m2 = 1_000
[material.clay]
kd = [0.75, 0.65, 0.5]
[material.brass]
kd = 0.1
ks = [0.5, 0.25, 0]
shininess = 20
[[mesh]]
path = \"mesh.obj\"
material = \"brass\"
[indirect]
estimator = \"instant-radiosity\"
rsm_size = 64
",
    );
    assert_eq!(scene.camera.resolution_px, [640, 480]);
    assert_eq!(scene.camera.position_m, DVec3::new(0.5, 1.0, 3.0));
    let (fx, fy, cx, cy) = (500.0, 501.5, 320.0, 240.0);
    let intrinsics = Intrinsics { fx, fy, cx, cy };
    assert_eq!(scene.camera.lens, Lens::Intrinsics(intrinsics));
    assert_eq!(scene.sensor.unwrap().pixel_pitch_um, [12.0, 10.0]);
    assert_eq!(
        scene.lights,
        [
            Light::Spot {
                position_m: DVec3::new(0.0, 2.0, 0.0),
                direction: DVec3::new(0.0, -1.0, 0.0),
                cone: SpotCone {
                    inner_half_angle_deg: 20.0,
                    outer_half_angle_deg: 30.0
                },
                power_w: [1.0, 2.0, 3.0],
            },
            Light::Directional {
                direction: DVec3::new(0.0, -2.0, 0.0),
                irradiance_w_m2: [1000.0; 3],
            },
        ]
    );
    let names: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    // In the order of the file, and without the MTL's material, which the override replaces.
    assert_eq!(names, ["clay", "brass"]);
    assert_eq!(scene.materials[1].ks, [0.5, 0.25, 0.0]);
    assert_eq!(scene.materials[1].shininess, 20.0);
    assert_eq!(scene.meshes[0].triangle_materials, [1]);
    assert_eq!(
        scene.indirect,
        Some(Indirect {
            estimator: Estimator::InstantRadiosity,
            rsm_size: 64
        })
    );
}

#[test]
fn scale_then_x_then_y_then_z_then_translate() {
    let toml = format!(
        "{CAMERA}{LIGHT}{MESH}scale = 2\nrotate_deg = [90, 90, 0]\ntranslate = [10, 20, 30]\n"
    );
    let mesh = &load(&toml).meshes[0];
    // Vertex (0, 1, 0): scaled (0, 2, 0), about x to (0, 0, 2), about y to (2, 0, 0), moved. The other order of the
    // rotations would give (10, 20, 32).
    assert_near(mesh.positions_m[2], DVec3::new(12.0, 20.0, 30.0), ROUNDING);
    let toml = toml.replace("[90, 90, 0]", "[0, 90, 90]");
    let mesh = &load(&toml).meshes[0];
    // Vertex (1, 0, 0): scaled (2, 0, 0), about y to (0, 0, -2), about z unmoved.
    assert_near(mesh.positions_m[1], DVec3::new(10.0, 20.0, 28.0), ROUNDING);
}

#[test]
fn normals_turn_with_the_mesh_and_become_unit_vectors() {
    let folder = SceneFolder::new();
    folder.write(
        "mesh.obj",
        "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 3e-200\nvn 3 0 4\nf 1//1 2//2 3//1\n",
    );
    let toml = format!("{CAMERA}{LIGHT}{MESH}scale = 5\nrotate_deg = [30, 40, 50]\n");
    let mesh = &folder.load(&toml).unwrap().meshes[0];
    let [x, y, z] = [30.0_f64, 40.0, 50.0].map(f64::to_radians);
    let rotation =
        DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
    for (normal, local) in mesh
        .normals
        .iter()
        .zip([DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::Z])
    {
        assert_near(*normal, rotation * local, ROUNDING);
    }
    let flat = folder.load(&format!("{toml}flat = true\n")).unwrap();
    assert!(flat.meshes[0].normals.is_empty());
}

/// f32 would hold 10⁷ + 0.001 as 10⁷; f64 holds it to 2e-9.
#[test]
fn detail_far_from_the_origin_survives() {
    let far = TRIANGLE.replace("v 1 0 0", "v 10000000.001 0 -9999999.999");
    let vertex = load_obj(&far).meshes[0].positions_m[1];
    assert_eq!(vertex, DVec3::new(10000000.001, 0.0, -9999999.999));

    let toml = format!("{CAMERA}{LIGHT}{MESH}translate = [1e7, 0, 0]\nscale = 0.001\n");
    let vertex = load(&toml).meshes[0].positions_m[1];
    assert_eq!(vertex.x - 1e7, 10000000.001 - 1e7);
}

#[test]
fn mtl_values_arrive_and_unused_materials_do_not() {
    let folder = SceneFolder::new();
    folder.write(
        "mesh.mtl",
        "newmtl unused\nKd 7 7 7\nnewmtl my white # 1\nKa 9 9 9\nKd 0.25\nKs .1 .2 .3 # comment\nNs 8\nillum 2\n",
    );
    let obj = TRIANGLE.replace("usemtl white", "usemtl my white # 1");
    let scene = folder.load_obj(&obj).unwrap();
    assert_eq!(scene.materials.len(), 1);
    let material = &scene.materials[0];
    assert_eq!(material.name, "my white # 1");
    assert_eq!(material.kd, [0.25; 3]);
    assert_eq!(material.ks, [0.1, 0.2, 0.3]);
    assert_eq!(material.shininess, 8.0);
}

#[test]
fn several_libraries_and_materials_in_one_mesh() {
    let folder = SceneFolder::new();
    folder
        .write("a b.mtl", "newmtl red\nKd 1 0 0\n")
        .write("c.mtl", "newmtl green\nKd 0 1 0\n");
    let obj = "mtllib mesh.mtl c.mtl\nmtllib a b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0
usemtl red\nf 1 2 3\no other\nusemtl green\nf 1 2 3\nusemtl red\nf -3 -2 -1\n";
    let scene = folder.load_obj(obj).unwrap();
    assert_eq!(scene.meshes.len(), 1);
    assert_eq!(scene.meshes[0].triangle_materials, [0, 1, 0]);
    assert_eq!(scene.materials[0].kd, [1.0, 0.0, 0.0]);
    assert_eq!(scene.materials[1].kd, [0.0, 1.0, 0.0]);
}

/// sRGB values of IEC 61966-2-1: 0 and 1, one on the linear part, one on the power part.
#[test]
fn textures_are_decoded_to_linear() {
    let folder = SceneFolder::new();
    // Directories show that map_Kd is relative to the MTL.
    std::fs::create_dir(folder.path("maps")).unwrap();
    let rgb8 = image::RgbImage::from_vec(2, 1, vec![0, 255, 10, 128, 188, 64]).unwrap();
    rgb8.save(folder.path("maps/rgb8.png")).unwrap();
    let grey16 = image::ImageBuffer::<image::Luma<u16>, _>::from_vec(1, 2, vec![32896_u16, 0]);
    grey16
        .unwrap()
        .save(folder.path("maps/grey16.png"))
        .unwrap();
    let grey8 = image::GrayImage::from_pixel(8, 8, image::Luma([128]));
    grey8.save(folder.path("maps/grey8.jpg")).unwrap();

    let decoded = |name: &str| {
        folder.write("mesh.obj", TRIANGLE.replace("mesh.mtl", "maps/mesh.mtl"));
        folder.write("maps/mesh.mtl", format!("newmtl white\nmap_Kd {name}\n"));
        let scene = folder.load(&format!("{CAMERA}{LIGHT}{MESH}")).unwrap();
        assert_eq!(scene.materials[0].kd_texture, Some(0));
        // Kd is absent, so the texture stands alone.
        assert_eq!(scene.materials[0].kd, [1.0; 3]);
        scene.textures.into_iter().next().unwrap()
    };
    // f32 rounding of values up to 1.
    let close = |actual: f32, expected: f64| (f64::from(actual) - expected).abs() < 1e-7;
    let mid = 0.215_860_500_113_899_26;

    let texture = decoded("rgb8.png");
    assert_eq!(texture.size_px, [2, 1]);
    let [first, second] = texture.linear_rgb[..] else {
        panic!("two texels")
    };
    assert_eq!(first[..2], [0.0, 1.0]);
    assert!(close(first[2], 10.0 / 255.0 / 12.92), "{first:?}");
    assert!(close(second[0], mid), "{second:?}");

    // 32896 = 128·257: the same grey in 16 bit; rows come from the top.
    let texture = decoded("grey16.png");
    assert_eq!(texture.size_px, [1, 2]);
    assert!(texture.linear_rgb[0].iter().all(|&value| close(value, mid)));
    assert_eq!(texture.linear_rgb[1], [0.0; 3]);

    // An even grey survives JPEG to within one 8-bit step, which is 0.004 here.
    let texture = decoded("grey8.jpg");
    assert!((f64::from(texture.linear_rgb[9][1]) - mid).abs() < 0.004);
}

#[test]
fn one_texture_file_is_loaded_once() {
    let folder = SceneFolder::new();
    let image = image::RgbImage::new(2, 2);
    image.save(folder.path("wood.png")).unwrap();
    folder.write(
        "mesh.mtl",
        "newmtl white\nmap_Kd wood.png\nnewmtl dark\nKd 0.5\nmap_Kd ./wood.png\n",
    );
    folder.write("mesh.obj", format!("{TRIANGLE}usemtl dark\nf 1 2 3\n"));
    let scene = folder
        .load(&format!("{CAMERA}{LIGHT}{MESH}{MESH}"))
        .unwrap();
    assert_eq!(scene.textures.len(), 1);
    assert_eq!(scene.materials.len(), 4);
    assert!(scene.materials.iter().all(|m| m.kd_texture == Some(0)));

    let warnings = scene.warnings().join("\n");
    assert!(
        warnings.contains("cannot be seen on mesh \"mesh.obj\""),
        "{warnings}"
    );
}

#[test]
fn faces_without_normals_stay_flat_beside_smooth_ones() {
    let obj = "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1
vn 0 0.6 0.8\nvn 0 0 0\nf 1//1 2//1 3//1\nf 1 2 4\nf 1//1 2//2 4//1\n";
    let mesh = &load_obj(obj).meshes[0];
    assert_eq!(mesh.triangles.len(), 3);
    assert_eq!(mesh.normals.len(), mesh.positions_m.len());
    let normals = |t: usize| mesh.triangles[t].map(|v| mesh.normals[v as usize]);
    for normal in normals(0) {
        assert_near(normal, DVec3::new(0.0, 0.6, 0.8), ROUNDING);
    }
    // Without normals, and with a zero normal: (1,0,0)×(0,0,1) = (0,-1,0).
    assert_eq!(normals(1), [DVec3::NEG_Y; 3]);
    assert_eq!(normals(2), [DVec3::NEG_Y; 3]);
    let corners = mesh.triangles[2].map(|v| mesh.positions_m[v as usize]);
    assert_eq!(corners, [DVec3::ZERO, DVec3::X, DVec3::Z]);
}

#[test]
fn texture_coordinates_follow_their_corners() {
    let obj = "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 0 1 0
vt 0.25\nvt 0.5 1 0\nvt -1 2\nf 1/3 2/2 3/1\nf 1 2 3\n";
    let mesh = &load_obj(obj).meshes[0];
    assert_eq!(mesh.texcoords.len(), mesh.positions_m.len());
    let first = mesh.triangles[0].map(|v| mesh.texcoords[v as usize]);
    assert_eq!(first, [[-1.0, 2.0], [0.5, 1.0], [0.25, 0.0]]);
}

/// A polyline is no face, a comment or colour no number, a backslash continues a line but no comment.
#[test]
fn obj_statements_beside_triangles() {
    let obj =
        "\u{feff}# \\\nmtllib mesh.mtl\r\n\tusemtl\twhite\nv 0 0 0 0.5\nv 1 0 0 1 0 0\nv 0 1 0 # up
l 1 2 3\np 1\ns off\ng a b\nf 1 2 \\\n 3 # face\n";
    let mesh = &load_obj(obj).meshes[0];
    assert_eq!(mesh.triangles.len(), 1);
    let corners = mesh.triangles[0].map(|v| mesh.positions_m[v as usize]);
    assert_eq!(corners, [DVec3::ZERO, DVec3::X, DVec3::Y]);
}

#[test]
fn comments_that_are_not_utf8() {
    let folder = SceneFolder::new();
    let mut obj = b"# caf\xe9\n".to_vec();
    obj.extend(TRIANGLE.as_bytes());
    folder.write("mesh.obj", obj);
    let scene = folder.load(&format!("{CAMERA}{LIGHT}{MESH}")).unwrap();
    assert_eq!(scene.meshes[0].triangles.len(), 1);
}

/// Whichever corner the file begins with, the triangles cover the polygon once: their areas add up to its area, and
/// none is turned over.
#[test]
fn polygons_are_filled_without_folds() {
    // An arrow head: concave at the fourth corner, area 2·(½·2·1) = 2.
    let arrow = [[0.0, 0.0], [2.0, -1.0], [0.0, 3.0], [-2.0, -1.0]];
    let newell: f64 = (0..4)
        .map(|i| {
            let (a, b) = (arrow[i], arrow[(i + 1) % 4]);
            0.5 * (a[0] * b[1] - b[0] * a[1])
        })
        .sum();
    for start in 0..4 {
        let mut obj = String::from("mtllib mesh.mtl\nusemtl white\n");
        for i in 0..4 {
            let [x, y] = arrow[(start + i) % 4];
            obj += &format!("v {x} {y} 5\n");
        }
        obj += "f 1 2 3 4\n";
        let mesh = &load_obj(&obj).meshes[0];
        assert_eq!(mesh.triangles.len(), 2);
        let areas = mesh.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|v| mesh.positions_m[v as usize]);
            0.5 * (b - a).cross(c - a).z
        });
        let areas: Vec<f64> = areas.collect();
        assert!(areas.iter().all(|&area| area > 0.0), "{start}: {areas:?}");
        assert!((areas.iter().sum::<f64>() - newell).abs() < ROUNDING);
    }
    let convex =
        "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5\n";
    assert_eq!(load_obj(convex).meshes[0].triangles.len(), 3);
}

#[test]
fn warnings_name_the_material_and_the_light() {
    let toml = format!(
        "{CAMERA}{}[material.mirror]\nkd = [0.1, 0.6, 0.1]\nks = 0.5\nshininess = 9\n[material.clay]\nkd = 1\n",
        LIGHT.replace("50.0", "0")
    );
    let warnings = load(&toml).warnings();
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings[0].contains("\"mirror\"") && warnings[0].contains("kd + ks is above 1"));
    assert!(warnings[1].contains("light 0 (point) emits nothing"));
    let toml = format!("{CAMERA}{LIGHT}{MESH}");
    assert_eq!(load(&toml).warnings(), Vec::<String>::new());
}

#[test]
fn parse_takes_its_folder_from_the_file_name() {
    let folder = SceneFolder::new();
    let text = format!("{CAMERA}{LIGHT}{MESH}");
    let parsed = Scene::parse(&text, &folder.path("unwritten.toml")).unwrap();
    assert_eq!(parsed.hash(), folder.load(&text).unwrap().hash());
}

const FULL: &str = "[sensor]
pixel_pitch_um = [12, 12]
exposure_time_s = 1e-3
duty_cycle = 0.5
[indirect]
estimator = \"rsm-average\"
rsm_size = 64
[material.clay]
kd = 0.5
";

#[test]
fn hash_changes_with_everything_but_names() {
    let folder = SceneFolder::new();
    let image = image::RgbImage::from_pixel(2, 1, image::Rgb([9, 9, 9]));
    image.save(folder.path("wood.png")).unwrap();
    folder.write("mesh.mtl", "newmtl white\nmap_Kd wood.png\n");
    let obj = "vn 0 0 1\nvt 0 0\nvt 1 0\nf 1/1/1 2/2/1 3/1/1\n";
    folder.write("mesh.obj", TRIANGLE.replace("f 1 2 3\n", obj));
    let scene = folder
        .load(&format!("{CAMERA}{LIGHT}{FULL}{MESH}"))
        .unwrap();
    let hash = scene.hash();
    assert_eq!(hash.len(), 64);

    let mut renamed = scene.clone();
    renamed.meshes[0].name = "other".into();
    renamed.materials[0].name = "other".into();
    renamed.textures[0].name = "other".into();
    assert_eq!(renamed.hash(), hash);
    let mut negative_zero = scene.clone();
    negative_zero.camera.position_m.x = -0.0;
    assert_eq!(negative_zero.hash(), hash);

    let edits: [fn(&mut Scene); 33] = [
        |s| s.camera.resolution_px = [6, 8],
        |s| s.camera.position_m.x += 1e-15,
        |s| s.camera.look_at_m.y += 1e-9,
        |s| s.camera.up.z += 1e-9,
        |s| s.camera.lens = Lens::FovY { fov_y_deg: 50.1 },
        |s| s.camera.lens = Lens::Intrinsics(s.camera.intrinsics_px()),
        |s| s.sensor = None,
        |s| s.sensor.as_mut().unwrap().pixel_pitch_um[1] = 11.0,
        |s| s.sensor.as_mut().unwrap().exposure_time_s = 2e-3,
        |s| s.sensor.as_mut().unwrap().duty_cycle = 0.4,
        |s| s.indirect = None,
        |s| s.indirect.as_mut().unwrap().rsm_size = 65,
        |s| s.indirect.as_mut().unwrap().estimator = Estimator::InstantRadiosity,
        |s| s.lights.push(s.lights[0]),
        |s| s.lights[0] = point([0.0, 1.98, 0.0], [50.0, 50.0, 51.0]),
        |s| s.lights[0] = point([0.0, 1.98, 0.1], [50.0; 3]),
        |s| s.lights[0] = directional(DVec3::Y, 50.0),
        |s| s.lights[0] = directional(DVec3::X, 50.0),
        |s| s.lights[0] = directional(DVec3::Y, 51.0),
        |s| s.lights[0] = spot(DVec3::Y, 1.0, 2.0),
        |s| s.lights[0] = spot(DVec3::Y, 1.0, 3.0),
        |s| s.lights[0] = spot(DVec3::X, 1.0, 2.0),
        |s| s.materials[0].kd[1] = 0.51,
        |s| s.materials[0].ks[2] = 0.01,
        |s| s.materials[0].shininess = 2.0,
        |s| s.materials[1].kd_texture = None,
        |s| s.textures[0].size_px = [1, 2],
        |s| s.textures[0].linear_rgb[1][2] += 0.1,
        |s| s.meshes[0].positions_m[2].x += 1e-12,
        |s| s.meshes[0].normals[2].x += 1e-12,
        |s| s.meshes[0].texcoords[2][0] += 1e-12,
        |s| s.meshes[0].triangles[0] = [1, 0, 2],
        |s| s.meshes[0].triangle_materials[0] = 0,
    ];
    let mut hashes = vec![hash];
    for (i, edit) in edits.iter().enumerate() {
        let mut edited = scene.clone();
        edit(&mut edited);
        let hash = edited.hash();
        assert!(
            !hashes.contains(&hash),
            "edit {i} has the hash of another scene"
        );
        hashes.push(hash);
    }
}

fn point(position_m: [f64; 3], power_w: [f64; 3]) -> Light {
    Light::Point {
        position_m: position_m.into(),
        power_w,
    }
}

fn directional(direction: DVec3, irradiance: f64) -> Light {
    Light::Directional {
        direction,
        irradiance_w_m2: [irradiance; 3],
    }
}

fn spot(direction: DVec3, inner_half_angle_deg: f64, outer_half_angle_deg: f64) -> Light {
    Light::Spot {
        position_m: DVec3::new(0.0, 1.98, 0.0),
        direction,
        cone: SpotCone {
            inner_half_angle_deg,
            outer_half_angle_deg,
        },
        power_w: [50.0; 3],
    }
}

const SOLID: &str =
    "mtllib mesh.mtl\nusemtl white\nv 9 9 9\nv 0 0 0\nv 4 0 0\nv 4 2 0\nv 0 2 0\nv 1 1 3
f 2 3 4 5\nf 2 3 6\nf 4 5 6\n";

#[test]
fn bounding_box_holds_used_vertices_only() {
    let mut scene = load_obj(SOLID);
    scene.meshes[0].positions_m.push(DVec3::splat(99.0));
    let bounds = scene.bounding_box().unwrap();
    assert_eq!(bounds.min_m, DVec3::ZERO);
    assert_eq!(bounds.max_m, DVec3::new(4.0, 2.0, 3.0));
    assert_eq!(bounds.centre_m(), DVec3::new(2.0, 1.0, 1.5));
}

#[test]
fn bounding_sphere_turns_with_the_scene_and_ignores_order_and_tessellation() {
    let folder = SceneFolder::new();
    folder.write("mesh.obj", SOLID);
    folder.write("other.obj", TRIANGLE);
    let other = "[[mesh]]\npath = \"other.obj\"\n";
    let load = |toml: String| folder.load(&format!("{CAMERA}{LIGHT}{toml}")).unwrap();
    let sphere = load(format!("{MESH}{other}")).bounding_sphere().unwrap();

    let swapped = load(format!("{other}{MESH}")).bounding_sphere().unwrap();
    assert_near(swapped.centre_m, sphere.centre_m, ROUNDING);
    assert!((swapped.radius_m - sphere.radius_m).abs() < ROUNDING);

    let turn = "rotate_deg = [17, 29, -71]\n";
    let turned = load(format!("{MESH}{turn}{other}{turn}"));
    let turned = turned.bounding_sphere().unwrap();
    let [x, y, z] = [17.0_f64, 29.0, -71.0].map(f64::to_radians);
    let rotation =
        DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
    assert_near(turned.centre_m, rotation * sphere.centre_m, ROUNDING);
    assert!((turned.radius_m - sphere.radius_m).abs() < ROUNDING);

    // At 10⁷ m a position is rounded to 2e-9 m, and so may be the centre.
    let far = "translate = [1e7, 1e7, 0]\n";
    let moved = load(format!("{MESH}{far}{other}{far}"));
    let moved = moved.bounding_sphere().unwrap();
    let expected = sphere.centre_m + DVec3::new(1e7, 1e7, 0.0);
    assert_near(moved.centre_m, expected, 4e-9);
    assert!((moved.radius_m - sphere.radius_m).abs() < 8e-9);

    folder.write(
        "other.obj",
        TRIANGLE.replace("f 1 2 3", "v 0.25 0.25 0\nf 1 2 4\nf 2 3 4\nf 3 1 4"),
    );
    let cut = load(format!("{MESH}{other}")).bounding_sphere().unwrap();
    assert_near(cut.centre_m, sphere.centre_m, ROUNDING);
}

#[test]
fn bounding_sphere_of_a_quad_and_of_no_area() {
    let quad = "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4\n";
    let sphere = load_obj(quad).bounding_sphere().unwrap();
    assert_near(sphere.centre_m, DVec3::new(1.0, 1.0, 0.0), ROUNDING);
    assert!((sphere.radius_m - 2.0_f64.sqrt()).abs() < ROUNDING);

    let line = TRIANGLE.replace("v 0 1 0", "v 2 0 0");
    let sphere = load_obj(&line).bounding_sphere().unwrap();
    assert_near(sphere.centre_m, DVec3::X, ROUNDING);
    assert!((sphere.radius_m - 1.0).abs() < ROUNDING);
}
