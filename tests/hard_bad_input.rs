//! Every bad input is refused with a message that says what, where, and how to mend it.

mod scene_folder;

use camlux::scene::{
    Camera, Indirect, Intrinsics, Lens, Light, Material, Mesh, Scene, Sensor, SpotCone, Texture,
};
use glam::DVec3;
use scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE, assert_says};

#[track_caller]
fn refuses_toml(toml: &str, parts: &[&str]) {
    let folder = SceneFolder::new();
    assert_says(&folder.error(folder.load(toml)), parts);
}

#[track_caller]
fn refuses_obj(obj: &str, parts: &[&str]) {
    let folder = SceneFolder::new();
    assert_says(&folder.error(folder.load_obj(obj)), parts);
}

#[track_caller]
fn refuses_mtl(mtl: &str, parts: &[&str]) {
    let folder = SceneFolder::new();
    folder.write("mesh.mtl", mtl);
    assert_says(&folder.error(folder.load_obj(TRIANGLE)), parts);
}

/// A camera block with one line replaced.
fn camera_with(line: &str, replacement: &str) -> String {
    assert!(CAMERA.contains(line));
    format!("{}{LIGHT}", CAMERA.replace(line, replacement))
}

#[test]
fn unreadable_and_invalid_scene_files() {
    let folder = SceneFolder::new();
    let missing = Scene::load(&folder.path("none.toml"));
    assert_says(
        &folder.error(missing),
        &["none.toml: cannot read the scene file", "check the path"],
    );
    refuses_toml(
        "[camera\n",
        &["scene.toml:1: not valid TOML", "correct this line"],
    );
    refuses_toml(
        "[camera]\nup = 1\nup = 2\n",
        &["scene.toml:3", "duplicate key"],
    );
    refuses_toml("", &["scene.toml: the scene file has no \"camera\""]);
    refuses_toml(
        &format!("version = 2\n{CAMERA}{LIGHT}"),
        &["scene.toml:1: scene file version 2 is not known; write version = 1"],
    );
}

#[test]
fn unknown_keys_name_the_nearest_one_and_the_line() {
    for (toml, parts) in [
        (
            format!("{CAMERA}{LIGHT}[meshes]\n"),
            [
                "scene.toml:11: unknown key \"meshes\" in the scene file",
                "did you mean \"mesh\"?",
            ],
        ),
        (
            camera_with("fov_y_deg", "fov"),
            [
                "scene.toml:6: unknown key \"fov\" in [camera]",
                "did you mean \"fov_y_deg\"?",
            ],
        ),
        (
            camera_with(
                "fov_y_deg = 50.0",
                "intrinsics_px = { fx = 1, fy = 1, cx = 1, cz = 1 }",
            ),
            [
                "scene.toml:6: unknown key \"cz\" in intrinsics_px",
                "did you mean \"cy\"?",
            ],
        ),
        (
            format!("{CAMERA}{}", LIGHT.replace("power_w", "power")),
            [
                "scene.toml:10: unknown key \"power\" in [[light]]",
                "did you mean \"power_w\"?",
            ],
        ),
        (
            format!("{CAMERA}{}", LIGHT.replace("point", "pint")),
            [
                "scene.toml:8: unknown kind \"pint\" in [[light]]",
                "did you mean \"point\"?",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}{MESH}scael = 2\n"),
            [
                "scene.toml:13: unknown key \"scael\" in [[mesh]]",
                "did you mean \"scale\"?",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}[material.clay]\nkd = 0.5\nshiny = 2\n"),
            [
                "scene.toml:13: unknown key \"shiny\" in [material.clay]",
                "did you mean \"shininess\"?",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}{MESH}material = \"clai\"\n[material.clay]\nkd = 0.5\n"),
            [
                "scene.toml:13: there is no [material.clai]",
                "did you mean \"clay\"?",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}{MESH}material = \"clay\"\n"),
            [
                "scene.toml:13: there is no [material.clay]",
                "add a [material.clay] table",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}[sensor]\nexposure = 1\n"),
            [
                "scene.toml:12: unknown key \"exposure\" in [sensor]",
                "did you mean \"exposure_time_s\"?",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}[indirect]\nestimater = \"rsm-average\"\n"),
            [
                "scene.toml:12: unknown key \"estimater\" in [indirect]",
                "did you mean \"estimator\"?",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"instant_radiosity\"\nrsm_size = 8\n"),
            [
                "scene.toml:12: unknown estimator \"instant_radiosity\" in [indirect]",
                "did you mean \"instant-radiosity\"?",
            ],
        ),
    ] {
        refuses_toml(&toml, &parts);
    }
}

#[test]
fn missing_keys() {
    for (toml, parts) in [
        (
            camera_with("position = [0, 1, 3]\n", ""),
            [
                "scene.toml:1: [camera] has no \"position\"",
                "add position = [x, y, z]",
            ],
        ),
        (
            camera_with("fov_y_deg = 50.0\n", ""),
            [
                "scene.toml:1: [camera] has neither \"fov_y_deg\" nor \"intrinsics_px\"",
                "add fov_y_deg",
            ],
        ),
        (
            format!("{CAMERA}intrinsics_px = {{ fx = 9, fy = 9, cx = 4, cy = 3 }}\n{LIGHT}"),
            [
                "scene.toml:7: [camera] has both \"fov_y_deg\" and \"intrinsics_px\"",
                "keep one",
            ],
        ),
        (
            camera_with(
                "fov_y_deg = 50.0",
                "intrinsics_px = { fx = 9, fy = 9, cx = 4 }",
            ),
            ["scene.toml:6: intrinsics_px has no \"cy\"", "add all four"],
        ),
        (
            format!("{CAMERA}{}", LIGHT.replace("power_w = 50.0\n", "")),
            [
                "scene.toml:7: [[light]] has no \"power_w\"",
                "add power_w = 50.0",
            ],
        ),
        (
            format!("{CAMERA}[[light]]\n"),
            ["scene.toml:7: [[light]] has no \"kind\"", "\"directional\""],
        ),
        (
            format!("{CAMERA}{LIGHT}[[mesh]]\n"),
            ["scene.toml:11: [[mesh]] has no \"path\"", "add path"],
        ),
        (
            format!("{CAMERA}{LIGHT}[indirect]\nrsm_size = 64\n"),
            [
                "scene.toml:11: [indirect] has no \"estimator\"",
                "\"rsm-average\" or \"instant-radiosity\"",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"rsm-average\"\n"),
            [
                "scene.toml:11: [indirect] has no \"rsm_size\"",
                "add rsm_size = 64",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}[material.clay]\n"),
            ["scene.toml:11: [material.clay] has no \"kd\"", "add kd"],
        ),
        (
            format!("{CAMERA}{LIGHT}[material.clay]\nkd = 0.5\nks = 0.2\n"),
            [
                "scene.toml:11: [material.clay] has no \"shininess\"",
                "add shininess",
            ],
        ),
    ] {
        refuses_toml(&toml, &parts);
    }
}

#[test]
fn wrong_types() {
    for (toml, parts) in [
        (
            camera_with("[8, 6]", "[8.5, 6]"),
            [
                "scene.toml:2: \"resolution\" in [camera] is the array [the number 8.5, the integer 6]",
                "2 whole numbers",
            ],
        ),
        (
            camera_with("[8, 6]", "[-8, 6]"),
            ["scene.toml:2", "2 whole numbers"],
        ),
        (
            camera_with("[0, 1, 3]", "[0, 1]"),
            [
                "scene.toml:3: \"position\" in [camera] is the array",
                "give an array of 3 finite numbers",
            ],
        ),
        (
            camera_with("[0, 1, 3]", "[0, nan, 3]"),
            ["scene.toml:3", "give an array of 3 finite numbers"],
        ),
        (
            camera_with("50.0", "\"50\""),
            [
                "scene.toml:6: \"fov_y_deg\" in [camera] is the string \"50\"",
                "give a finite number",
            ],
        ),
        (
            camera_with("50.0", "1e999"),
            ["scene.toml:6", "give a finite number"],
        ),
        (
            format!("camera = 3\n{LIGHT}"),
            [
                "scene.toml:1: \"camera\" in the scene file is the integer 3",
                "give a table",
            ],
        ),
        (
            format!("{CAMERA}{}", LIGHT.replace("[[light]]", "[light]")),
            [
                "\"light\" in the scene file is a table",
                "[[light]], in double brackets",
            ],
        ),
        (
            format!("{CAMERA}{}", LIGHT.replace("\"point\"", "1")),
            [
                "scene.toml:8: \"kind\" in [[light]] is the integer 1",
                "give a string in quotes",
            ],
        ),
        (
            format!("{CAMERA}{}", LIGHT.replace("50.0", "[1, 2]")),
            [
                "scene.toml:10: \"power_w\" in [[light]]",
                "one finite number or an array [r, g, b]",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}{MESH}flat = 1\n"),
            [
                "scene.toml:13: \"flat\" in [[mesh]] is the integer 1",
                "give true or false",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}{MESH}scale = 0\n"),
            [
                "scene.toml:13: \"scale\" in [[mesh]] is 0",
                "give a number above 0",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"rsm-average\"\nrsm_size = -1\n"),
            [
                "scene.toml:13: \"rsm_size\" in [indirect] is the integer -1",
                "give a whole number from 0",
            ],
        ),
    ] {
        refuses_toml(&toml, &parts);
    }
}

/// What [`Scene::validate`] refuses is reported with the line where there is a file.
#[test]
fn values_out_of_range_are_reported_with_their_line() {
    let spot = "[[light]]\nkind = \"spot\"\nposition = [0, 2, 0]\ndirection = [0, -1, 0]\ninner_half_angle_deg = 40\nouter_half_angle_deg = 30\npower_w = 1\n";
    for (toml, parts) in [
        (
            camera_with("[8, 6]", "[0, 0]"),
            [
                "scene.toml:1, camera: resolution is 0 x 0 pixels",
                "at least 1 x 1",
            ],
        ),
        (
            CAMERA.into(),
            ["scene.toml, scene: there is no light", "add a [[light]]"],
        ),
        (
            format!("{CAMERA}{LIGHT}{}", LIGHT.replace("50.0", "-50.0")),
            [
                "scene.toml:11, light 1 (point): power_w is [-50.0, -50.0, -50.0]",
                "0 or more",
            ],
        ),
        (
            format!("{CAMERA}{spot}"),
            [
                "scene.toml:7, light 0 (spot): inner_half_angle_deg 40 is larger than outer_half_angle_deg 30",
                "no wider",
            ],
        ),
        (
            format!(
                "{CAMERA}[[light]]\nkind = \"directional\"\ndirection = [0, 0, 0]\nirradiance_w_m2 = 1\n"
            ),
            [
                "scene.toml:7, light 0 (directional): direction is [0, 0, 0]",
                "any length but zero",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}[material.clay]\nkd = 1.5\n"),
            [
                "scene.toml:11, material 0 (\"clay\"): kd is [1.5, 1.5, 1.5]",
                "from 0 to 1",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}{MESH}translate = [0, 0, 1e13]\n"),
            [
                "scene.toml:11, mesh 0 (\"mesh.obj\"): vertex 0 is",
                "1e12 m",
            ],
        ),
        (
            format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"rsm-average\"\nrsm_size = 0\n"),
            ["scene.toml:11, indirect: rsm_size is 0", "such as 64"],
        ),
    ] {
        refuses_toml(&toml, &parts);
    }
    refuses_mtl(
        "# first\nnewmtl white\nKd 1 2 0\n",
        &["mesh.mtl:2, material 0 (\"white\"): kd is [1.0, 2.0, 0.0]"],
    );
}

#[test]
fn missing_files() {
    let mesh_named_at = "scene.toml:12: cannot read the mesh other.obj";
    refuses_toml(
        &format!("{CAMERA}{LIGHT}{}", MESH.replace("mesh.obj", "other.obj")),
        &[mesh_named_at, "relative to the file that names it"],
    );
    refuses_obj(
        &TRIANGLE.replace("mesh.mtl", "other.mtl"),
        &[
            "mesh.obj:1: cannot read the material library other.mtl",
            "correct the path",
        ],
    );
    refuses_mtl(
        "newmtl white\nmap_Kd none.png\n",
        &[
            "mesh.mtl:1: cannot read the texture none.png",
            "PNG or JPEG",
        ],
    );
}

#[test]
fn unreadable_texture() {
    let folder = SceneFolder::new();
    folder
        .write("wood.png", "this is no image")
        .write("mesh.mtl", "newmtl white\nmap_Kd wood.png\n");
    assert_says(
        &folder.error(folder.load_obj(TRIANGLE)),
        &[
            "mesh.mtl:1: cannot read the texture wood.png",
            "PNG or JPEG",
        ],
    );
    // The beginning of a PNG, and nothing behind it.
    folder.write("wood.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    assert_says(
        &folder.error(folder.load_obj(TRIANGLE)),
        &["mesh.mtl:1: cannot read the texture wood.png"],
    );
}

#[test]
fn bad_obj_files() {
    let three = "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (statement, parts) in [
        ("v nan 0 0", ["\"v\" has \"nan\" for a number", "finite"]),
        ("v 0 inf 0", ["\"v\" has \"inf\" for a number", "finite"]),
        (
            "v 0 1e999 0",
            ["\"v\" has \"1e999\" for a number", "finite"],
        ),
        ("v 0 0", ["\"v\" has 2 numbers", "3 to 7"]),
        ("v 0 zero 0", ["\"v\" has \"zero\" for a number", "finite"]),
        ("vn 0 nan 1", ["\"vn\" has \"nan\" for a number", "finite"]),
        ("vt nan 1", ["\"vt\" has \"nan\" for a number", "finite"]),
        ("f 1 2 4", ["\"f\" refers to 4 of 3 vertices", "begin at 1"]),
        ("f 1 2 0", ["\"f\" refers to 0 of 3 vertices", "begin at 1"]),
        (
            "f 1 2 -4",
            ["\"f\" refers to -4 of 3 vertices", "begin at 1"],
        ),
        (
            "f 1 2 9223372036854775807",
            ["refers to 9223372036854775807", "begin at 1"],
        ),
        (
            "f 1 2 -9223372036854775808",
            ["refers to -9223372036854775808", "begin at 1"],
        ),
        (
            "f 1 2 99999999999999999999",
            ["refers to 99999999999999999999", "begin at 1"],
        ),
        ("f 1 2 x", ["\"f\" refers to x of 3 vertices", "begin at 1"]),
        (
            "f 1//1 2//1 3//1",
            ["\"f\" refers to 1 of 0 normals", "begin at 1"],
        ),
        (
            "f 1/-1 2/-1 3/-1",
            ["\"f\" refers to -1 of 0 texture coordinates", "begin at 1"],
        ),
        (
            "f 1/1/1/1 2 3",
            ["\"f\" has the corner \"1/1/1/1\"", "v/vt/vn"],
        ),
        ("f /1 2 3", ["\"f\" has the corner \"/1\"", "v/vt/vn"]),
        ("f 1 2", ["\"f\" has 2 corners", "at least three"]),
        ("f", ["\"f\" has 0 corners", "at least three"]),
        (
            "vn 0 0 1\nf 1//1 2 3",
            [
                "mesh.obj:7: \"f\" has corners with and without",
                "same parts",
            ],
        ),
        ("usemtl", ["\"usemtl\" names nothing", "write a name"]),
        (
            "surf 0 1 0 1 1 2 3",
            ["\"surf\" is not a statement", "as polygons"],
        ),
    ] {
        let at = if statement.contains('\n') {
            "mesh.obj:7: "
        } else {
            "mesh.obj:6: "
        };
        refuses_obj(&format!("{three}{statement}\n"), &[at, parts[0], parts[1]]);
    }
    refuses_obj("\u{89}PNG\n", &["mesh.obj:1", "is not a statement"]);
}

/// A star shape: no corner sees all others, so no fan of triangles fills it.
#[test]
fn polygon_that_no_fan_fills() {
    let mut obj = String::from("mtllib mesh.mtl\nusemtl white\n");
    for i in 0..10 {
        let radius = if i % 2 == 0 { 1.0 } else { 0.2 };
        let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 10.0).sin_cos();
        obj += &format!("v {} {} 0\n", radius * cos, radius * sin);
    }
    obj += "f 1 2 3 4 5 6 7 8 9 10\n";
    refuses_obj(
        &obj,
        &["mesh.obj:13: \"f\" is a concave polygon", "triangulate"],
    );
}

#[test]
fn bad_materials_of_meshes() {
    refuses_obj(
        &TRIANGLE.replace("usemtl white", "usemtl whit"),
        &[
            "mesh.obj:2: material \"whit\" is in no MTL file",
            "did you mean \"white\"?",
        ],
    );
    refuses_obj(
        &TRIANGLE.replace("mtllib mesh.mtl", "#"),
        &["mesh.obj:2: material \"white\" is in no MTL file", "mtllib"],
    );
    refuses_obj(
        &TRIANGLE.replace("usemtl white", "#"),
        &[
            "mesh.obj:6: a face has no material",
            "usemtl",
            "material = ",
        ],
    );
    for (mtl, parts) in [
        (
            "newmtl white\n",
            [
                "mesh.mtl:1: material \"white\" has neither Kd nor map_Kd",
                "Kd 0.8",
            ],
        ),
        (
            "newmtl white\nKd 1 1 1\nKs 0.1\n",
            ["mesh.mtl:1: material \"white\" has Ks without Ns", "Ns 20"],
        ),
        (
            "newmtl white\nKd 1 1\n",
            ["mesh.mtl:2: \"Kd\" has two numbers", "one or three"],
        ),
        (
            "newmtl white\nKd\n",
            ["mesh.mtl:2: \"Kd\" has 0 numbers", "1 to 3"],
        ),
        (
            "newmtl white\nKd spectral a.rfl\n",
            ["mesh.mtl:2: \"Kd\" has \"spectral\" for a number", "1 to 3"],
        ),
        (
            "newmtl white\nKd 1 nan 1\n",
            ["mesh.mtl:2: \"Kd\" has \"nan\"", "finite"],
        ),
        (
            "Kd 1 1 1\n",
            ["mesh.mtl:1: \"Kd\" stands before any material", "newmtl"],
        ),
        (
            "newmtl\n",
            ["mesh.mtl:1: \"newmtl\" names nothing", "write a name"],
        ),
        (
            "newmtl white\nKd 1\nnewmtl white\n",
            [
                "mesh.mtl:3: material \"white\" is already defined at",
                "mesh.mtl:1",
            ],
        ),
        (
            "newmtl white\nmap_Kd -s 2 2 2 a.png\n",
            ["mesh.mtl:2: \"map_Kd\" has options", "bake"],
        ),
        (
            "newmtl white\nKd 1\nNs -3\n",
            [
                "mesh.mtl:1, material 0 (\"white\"): shininess is -3",
                "0 or more",
            ],
        ),
    ] {
        refuses_mtl(mtl, &parts);
    }
}

#[test]
fn textured_face_without_texture_coordinates_beside_faces_with_them() {
    let folder = SceneFolder::new();
    image::RgbImage::new(1, 1)
        .save(folder.path("a.png"))
        .unwrap();
    folder.write("mesh.mtl", "newmtl white\nmap_Kd a.png\n");
    let obj = format!("{TRIANGLE}vt 0 0\nf 1/1 2/1 3/1\n");
    assert_says(
        &folder.error(folder.load_obj(&obj)),
        &[
            "mesh.obj:6: a face of the textured material \"white\" has no texture coordinates",
            "vt",
        ],
    );
}

/// A valid scene of one triangle, from slices.
fn scene() -> Scene {
    Scene {
        camera: Camera {
            resolution_px: [8, 6],
            position_m: DVec3::new(0.0, 0.0, 3.0),
            look_at_m: DVec3::ZERO,
            up: DVec3::Y,
            lens: Lens::FovY { fov_y_deg: 50.0 },
        },
        sensor: Some(Sensor {
            pixel_pitch_um: [12.0, 12.0],
            exposure_time_s: 1e-3,
            duty_cycle: 0.5,
        }),
        lights: vec![Light::Point {
            position_m: DVec3::Y,
            power_w: [1.0; 3],
        }],
        meshes: vec![Mesh::from_slices(
            "floor",
            &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            &[[0, 1, 2]],
            0,
        )],
        materials: vec![Material::lambert("clay", [0.5; 3])],
        textures: vec![Texture {
            name: "wood".into(),
            size_px: [1, 1],
            linear_rgb: vec![[0.5; 3]],
        }],
        indirect: Some(Indirect {
            estimator: camlux::scene::Estimator::RsmAverage,
            rsm_size: 8,
        }),
    }
}

#[test]
fn scenes_from_slices_are_validated() {
    const NAN: f64 = f64::NAN;
    scene().validate().unwrap();

    let spot = |direction: DVec3, inner: f64, outer: f64, power: f64| Light::Spot {
        position_m: DVec3::Y,
        direction,
        cone: SpotCone {
            inner_half_angle_deg: inner,
            outer_half_angle_deg: outer,
        },
        power_w: [power; 3],
    };
    let intrinsics = |fx, fy, cx| {
        Lens::Intrinsics(Intrinsics {
            fx,
            fy,
            cx,
            cy: 3.0,
        })
    };
    let down = -DVec3::Y;
    type Edit = Box<dyn Fn(&mut Scene)>;
    let cases: Vec<(Edit, &str)> = vec![
        (
            Box::new(|s| s.camera.resolution_px = [8, 0]),
            "camera: resolution is 8 x 0",
        ),
        (
            Box::new(|s| s.camera.resolution_px = [0, 6]),
            "camera: resolution is 0 x 6",
        ),
        (
            Box::new(|s| s.camera.position_m.x = NAN),
            "camera: position is [NaN, 0, 3]",
        ),
        (
            Box::new(|s| s.camera.look_at_m.x = f64::INFINITY),
            "camera: look_at is [inf",
        ),
        (
            Box::new(|s| s.camera.look_at_m = s.camera.position_m),
            "camera: position and look_at are both",
        ),
        (
            Box::new(|s| s.camera.up = DVec3::ZERO),
            "camera: up is [0, 0, 0], which has no direction",
        ),
        (
            Box::new(|s| s.camera.up = DVec3::new(1e-9, 0.0, -2.0)),
            "is parallel to the view",
        ),
        (
            Box::new(|s| s.camera.lens = Lens::FovY { fov_y_deg: 0.0 }),
            "camera: fov_y_deg is 0",
        ),
        (
            Box::new(|s| s.camera.lens = Lens::FovY { fov_y_deg: 180.0 }),
            "camera: fov_y_deg is 180",
        ),
        (
            Box::new(|s| s.camera.lens = Lens::FovY { fov_y_deg: NAN }),
            "camera: fov_y_deg is NaN",
        ),
        (
            Box::new(move |s| s.camera.lens = intrinsics(0.0, 9.0, 4.0)),
            "camera: intrinsics_px fx is 0",
        ),
        (
            Box::new(move |s| s.camera.lens = intrinsics(9.0, NAN, 4.0)),
            "camera: intrinsics_px fy is NaN",
        ),
        (
            Box::new(move |s| s.camera.lens = intrinsics(9.0, 9.0, NAN)),
            "camera: intrinsics_px cx, cy are NaN, 3",
        ),
        (
            Box::new(|s| s.sensor.as_mut().unwrap().pixel_pitch_um[1] = 0.0),
            "sensor: pixel_pitch_um height is 0",
        ),
        (
            Box::new(|s| s.sensor.as_mut().unwrap().exposure_time_s = -1.0),
            "sensor: exposure_time_s is -1",
        ),
        (
            Box::new(|s| s.sensor.as_mut().unwrap().duty_cycle = 1.01),
            "sensor: duty_cycle is 1.01",
        ),
        (
            Box::new(|s| s.sensor.as_mut().unwrap().duty_cycle = NAN),
            "sensor: duty_cycle is NaN",
        ),
        (
            Box::new(|s| s.indirect.as_mut().unwrap().rsm_size = 0),
            "indirect: rsm_size is 0",
        ),
        (
            Box::new(|s| s.lights.clear()),
            "scene: there is no light; add a [[light]]",
        ),
        (
            Box::new(move |s| s.lights[0] = spot(DVec3::ZERO, 1.0, 2.0, 1.0)),
            "light 0 (spot): direction is [0, 0, 0]",
        ),
        (
            Box::new(move |s| s.lights[0] = spot(down * NAN, 1.0, 2.0, 1.0)),
            "light 0 (spot): direction is [NaN",
        ),
        (
            Box::new(move |s| s.lights[0] = spot(down, 3.0, 2.0, 1.0)),
            "inner_half_angle_deg 3 is larger than outer_half_angle_deg 2",
        ),
        (
            Box::new(move |s| s.lights[0] = spot(down, -1.0, 2.0, 1.0)),
            "inner_half_angle_deg is -1",
        ),
        (
            Box::new(move |s| s.lights[0] = spot(down, NAN, 2.0, 1.0)),
            "inner_half_angle_deg is NaN",
        ),
        (
            Box::new(move |s| s.lights[0] = spot(down, 0.0, 0.0, 1.0)),
            "outer_half_angle_deg is 0",
        ),
        (
            Box::new(move |s| s.lights[0] = spot(down, 0.0, 181.0, 1.0)),
            "outer_half_angle_deg is 181",
        ),
        (
            Box::new(move |s| s.lights[0] = spot(down, 1.0, 2.0, -1.0)),
            "light 0 (spot): power_w is [-1.0",
        ),
        (
            Box::new(move |s| s.lights[0] = spot(down, 1.0, 2.0, f64::INFINITY)),
            "light 0 (spot): power_w is [inf",
        ),
        (
            Box::new(|s| s.meshes[0].positions_m[1].y = NAN),
            "mesh 0 (\"floor\"): vertex 1 is [1, NaN, 0]",
        ),
        (
            Box::new(|s| s.meshes[0].positions_m[2].z = f64::INFINITY),
            "mesh 0 (\"floor\"): vertex 2 is [0, 1, inf]",
        ),
        (
            Box::new(|s| s.meshes[0].triangles[0][2] = 3),
            "mesh 0 (\"floor\"): triangle 0 has vertices [0, 1, 3] of 3",
        ),
        (
            Box::new(|s| s.meshes[0].triangle_materials[0] = 1),
            "triangle 0 has material 1 of 1",
        ),
        (
            Box::new(|s| s.meshes[0].triangle_materials.clear()),
            "0 triangle_materials for 1 triangles",
        ),
        (
            Box::new(|s| s.meshes[0].normals = vec![DVec3::Z]),
            "1 normals for 3 vertices",
        ),
        (
            Box::new(|s| s.meshes[0].texcoords = vec![[0.0; 2]; 4]),
            "4 texcoords for 3 vertices",
        ),
        (
            Box::new(|s| s.meshes[0].normals = vec![DVec3::Z, DVec3::ZERO, DVec3::Z]),
            "normal of vertex 1 is [0, 0, 0]",
        ),
        (
            Box::new(|s| s.meshes[0].normals = vec![DVec3::Z, DVec3::Z, DVec3::NAN]),
            "normal of vertex 2 is [NaN, NaN, NaN]",
        ),
        (
            Box::new(|s| s.meshes[0].texcoords = vec![[0.0; 2], [0.0, NAN], [0.0; 2]]),
            "texture coordinate of vertex 1 is [0.0, NaN]",
        ),
        (
            Box::new(|s| s.materials[0].kd[1] = -0.1),
            "material 0 (\"clay\"): kd is [0.5, -0.1, 0.5]",
        ),
        (
            Box::new(|s| s.materials[0].ks[2] = 1.1),
            "material 0 (\"clay\"): ks is [0.0, 0.0, 1.1]",
        ),
        (
            Box::new(|s| s.materials[0].kd[0] = NAN),
            "material 0 (\"clay\"): kd is [NaN",
        ),
        (
            Box::new(|s| s.materials[0].shininess = -1.0),
            "material 0 (\"clay\"): shininess is -1",
        ),
        (
            Box::new(|s| s.materials[0].shininess = f64::INFINITY),
            "material 0 (\"clay\"): shininess is inf",
        ),
        (
            Box::new(|s| s.materials[0].kd_texture = Some(1)),
            "kd_texture is Some(1) of 1 textures",
        ),
        (
            Box::new(|s| s.textures[0].size_px = [2, 1]),
            "texture 0 (\"wood\"): size_px is 2 x 1, but there are 1 texels",
        ),
        (
            Box::new(|s| {
                s.textures[0] = Texture {
                    name: "wood".into(),
                    size_px: [0, 0],
                    linear_rgb: vec![],
                }
            }),
            "texture 0 (\"wood\"): size_px is 0 x 0",
        ),
        (
            Box::new(|s| s.textures[0].linear_rgb[0][1] = f32::NAN),
            "texture 0 (\"wood\"): texel 0 is [0.5, NaN, 0.5]",
        ),
    ];
    for (edit, expected) in cases {
        let mut scene = scene();
        edit(&mut scene);
        let error = scene.validate().expect_err(expected).to_string();
        assert_says(&error, &[expected, "; "]);
    }
}

#[test]
fn nothing_to_see_is_no_error() {
    let folder = SceneFolder::new();
    let scene = folder.load(&format!("{CAMERA}{LIGHT}")).unwrap();
    assert!(scene.meshes.is_empty());
    assert_eq!(scene.bounding_box(), None);
    assert_eq!(scene.bounding_sphere(), None);

    for obj in ["", "# nothing\n", "v 0 0 0\nl 1 1 1\np 1\n"] {
        let scene = folder.load_obj(obj).unwrap();
        assert_eq!(scene.meshes.len(), 1);
        assert!(scene.meshes[0].triangles.is_empty());
    }
}
