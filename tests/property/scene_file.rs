//! What the keys of a scene file mean.

use std::path::Path;

use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE};
use camlux::scene::{
    AreaShape, Carrier, DEFAULT_TARGET_ERROR, ErrorNorm, FinalGather, IndirectLight, Intrinsics,
    Lens, Light, MeshFile, MeshOptions, RsmAverage, Scene, Shadow, SpotCone, Vignetting, VplSum,
};
use glam::DVec3;

/// A mesh file without a scene file gives what a scene file with it has.
#[test]
fn a_mesh_file_is_read_alone() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.obj");
    let scene = Scene::load(&path.with_extension("toml")).unwrap();
    let file = MeshFile::load(&path, MeshOptions::default()).unwrap();
    assert_eq!(file.materials, scene.materials);
    assert_eq!(file.meshes.len(), 1);
    assert_eq!(file.meshes[0].positions_m, scene.meshes[0].positions_m);
    let counted = |first_material, material| {
        let options = MeshOptions {
            scale: 2.0,
            first_material,
            material,
            ..MeshOptions::default()
        };
        MeshFile::load(&path, options).unwrap()
    };
    let after = counted(3, None);
    assert_eq!(after.materials, scene.materials);
    let theirs = scene.meshes[0].triangle_materials.iter();
    assert!(
        theirs
            .map(|i| i + 3)
            .eq(after.meshes[0].triangle_materials.iter().copied())
    );
    assert_eq!(
        after.meshes[0].positions_m[5],
        2.0 * file.meshes[0].positions_m[5]
    );
    let all_one = counted(0, Some(7));
    assert!(all_one.materials.is_empty());
    assert!(
        all_one.meshes[0]
            .triangle_materials
            .iter()
            .all(|&material| material == 7)
    );
}

fn load(toml: &str) -> Scene {
    SceneFolder::new().load(toml).unwrap()
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
[lens]
f_number = 2.8
vignetting = [-0.25, 0.125, 0]
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
estimator = \"final-gather\"
rsm_size = 64
target_error = 0.05
error_norm = \"local\"
max_ms = 250
max_rays = 5_000_000_000
stderr_layer = true
bounces = 3
",
    );
    assert_eq!(scene.camera.resolution_px, [640, 480]);
    assert_eq!(scene.camera.position_m, DVec3::new(0.5, 1.0, 3.0));
    let (fx, fy, cx, cy) = (500.0, 501.5, 320.0, 240.0);
    let intrinsics = Intrinsics {
        fx,
        fy,
        cx,
        cy,
        skew: 0.0,
    };
    assert_eq!(scene.camera.lens, Lens::Intrinsics(intrinsics));
    assert_eq!(scene.sensor.unwrap().pixel_pitch_um, [12.0, 10.0]);
    assert_eq!(scene.sensor.unwrap().f_number, Some(2.8));
    let vignetting = scene.sensor.unwrap().vignetting;
    assert_eq!(vignetting, Some(Vignetting([-0.25, 0.125, 0.0])));
    let lights = scene.lights.iter().map(|placed| placed.light.clone());
    assert_eq!(
        lights.collect::<Vec<_>>(),
        [
            Light::spot(
                DVec3::new(0.0, 2.0, 0.0),
                DVec3::new(0.0, -1.0, 0.0),
                SpotCone {
                    inner_half_angle_deg: 20.0,
                    outer_half_angle_deg: 30.0
                },
                [1.0, 2.0, 3.0]
            ),
            Light::directional(DVec3::new(0.0, -2.0, 0.0), [1000.0; 3]),
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
        Some(IndirectLight::FinalGather(FinalGather {
            error_norm: ErrorNorm::Local,
            rsm_size: Some(64),
            max_ms: Some(250.0),
            max_rays: Some(5_000_000_000),
            stderr_layer: true,
            bounces: 3,
            ..FinalGather::new(0.05)
        }))
    );
}

#[test]
fn how_shadows_are_found_is_left_to_the_engine_unless_the_file_says() {
    let shadow = |toml: &str| load(&format!("{CAMERA}{LIGHT}{toml}")).direct.shadow;
    assert_eq!(shadow(""), None);
    for named in Shadow::ALL {
        let toml = format!("[direct]\nshadow = \"{}\"\n", named.name());
        assert_eq!(shadow(&toml), Some(named));
    }
}

#[test]
fn every_estimator_has_the_name_by_which_it_is_found_and_the_size_that_is_read() {
    for name in IndirectLight::NAMES {
        assert_eq!(IndirectLight::from_name(name).unwrap().name(), name);
        let toml = format!("[indirect]\nestimator = \"{name}\"\nrsm_size = 8\n");
        let read = load(&format!("{CAMERA}{LIGHT}{toml}")).indirect.unwrap();
        assert_eq!((read.name(), read.rsm_size()), (name, Some(8)));
    }
    assert_eq!(IndirectLight::from_name("path-tracing"), None);
}

#[test]
fn every_estimator_is_read_with_its_keys() {
    let indirect = |keys: &str| {
        let scene = load(&format!("{CAMERA}{LIGHT}[indirect]\n{keys}\n"));
        scene.indirect.unwrap()
    };
    for (keys, expected) in [
        (
            "estimator = \"final-gather\"",
            IndirectLight::final_gather(DEFAULT_TARGET_ERROR),
        ),
        (
            "estimator = \"instant-radiosity\"\nrsm_size = 8",
            IndirectLight::vpl_sum(VplSum::InstantRadiosity, 8),
        ),
        (
            "estimator = \"rsm-average\"\nrsm_size = 8",
            IndirectLight::vpl_sum(VplSum::RsmAverage, 8),
        ),
        (
            "estimator = \"rsm-average\"\nrsm_size = 8\ninterpolation_error = 0.05",
            IndirectLight::RsmAverage(RsmAverage {
                rsm_size: 8,
                interpolation_error: Some(0.05),
            }),
        ),
    ] {
        assert_eq!(indirect(keys), expected);
    }
}

#[test]
fn warnings_name_the_material_and_the_light() {
    let toml = format!(
        "{CAMERA}{}{MESH}[material.mirror]\nkd = [0.1, 0.6, 0.1]\nks = 0.5\nshininess = 9\n[material.clay]\nkd = 1\n",
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
fn warnings_name_what_cannot_be_seen() {
    let folder = SceneFolder::new();
    let assert_warns = |scene: &Scene, says: &[&str]| {
        let warnings = scene.warnings();
        assert_eq!(warnings.len(), says.len(), "{warnings:?}");
        for (warning, part) in warnings.iter().zip(says) {
            assert!(warning.contains(part), "{warning}");
        }
    };
    let scene = folder.load(&format!("{CAMERA}{LIGHT}")).unwrap();
    assert_warns(&scene, &["there is no mesh"]);
    assert_warns(
        &folder.load_obj("# nothing\n").unwrap(),
        &["mesh \"mesh.obj\" has no triangles"],
    );
    let line = TRIANGLE.replace("v 0 1 0", "v 2 0 0");
    assert_warns(
        &folder.load_obj(&line).unwrap(),
        &["no triangle of mesh \"mesh.obj\" has an area"],
    );

    // The triangle (0,0,0), (1,0,0), (0,1,0).
    folder.write("mesh.obj", TRIANGLE);
    let lit_from = |position: &str| {
        let light = LIGHT.replace("[0.0, 1.98, 0.0]", position);
        folder.load(&format!("{CAMERA}{light}{MESH}")).unwrap()
    };
    for position in ["[0.25, 0.25, 0.0]", "[0.0, 0.0, 0.0]", "[0.5, 0.5, 1e-8]"] {
        let says = "light 0 (point) is in a surface of mesh \"mesh.obj\"";
        assert_warns(&lit_from(position), &[says]);
    }
    for position in ["[0.25, 0.25, 1e-4]", "[0.51, 0.51, 0.0]", "[-0.01, 0.5, 0]"] {
        assert_warns(&lit_from(position), &[]);
    }
}

#[test]
fn parse_takes_its_folder_from_the_file_name() {
    let folder = SceneFolder::new();
    let text = format!("{CAMERA}{LIGHT}{MESH}");
    let parsed = Scene::parse(&text, &folder.path("unwritten.toml")).unwrap();
    assert_eq!(parsed.hash(), folder.load(&text).unwrap().hash());
}

#[test]
fn time_of_flight_is_read_with_its_lights() {
    const CAMERA: &str = "[camera]
resolution = [8, 6]
position = [0, 1, 3]
look_at = [0, 1, 0]
up = [0, 1, 0]
fov_y_deg = 50
[sensor]
pixel_pitch_um = [12, 10]
exposure_time_s = 1.0e-3
duty_cycle = 0.5
wavelength_nm = 850
quantum_efficiency = 0.8
";
    let light = |modulated: &str| {
        format!("[[light]]\nkind = \"point\"\nposition = [0, 2, 0]\npower_w = 1\n{modulated}\n")
    };
    let lights = [
        light(""),
        light("modulated = false"),
        light("modulated = true"),
    ]
    .concat();
    let scene = load(&format!(
        "{CAMERA}{lights}[tof]\nfrequencies_mhz = [20, 100.5]\ncontrast = 0.75\nband = \"G\"\n"
    ));
    let photodetector = scene.sensor.unwrap().photodetector().unwrap();
    assert_eq!(photodetector.wavelength_nm, 850.0);
    assert_eq!(photodetector.quantum_efficiency, 0.8);
    let tof = scene.tof.clone().unwrap();
    assert_eq!(tof.frequencies_hz, [20e6, 100.5e6]);
    assert_eq!((tof.phase_count, tof.phase_offset_deg), (4, 0.0));
    assert_eq!(tof.contrasts, [0.75, 0.75]);
    assert_eq!(tof.band_weights, [0.0, 1.0, 0.0]);
    assert_eq!(
        [0, 1, 2].map(|light| tof.is_modulated(light)),
        [true, false, true]
    );

    let all = load(&format!(
        "{CAMERA}{lights}[tof]\nfrequencies_mhz = [20, 100]\ncontrast = [0.5, 0.6]\nband = [0.5, 0.25, 0]\nphases = 3\nphase_offset_deg = -4\n"
    ));
    let tof = all.tof.clone().unwrap();
    assert_eq!(tof.contrasts, [0.5, 0.6]);
    assert_eq!(tof.weighted([2.0, 4.0, 8.0]), 2.0);
    assert_eq!((tof.phase_count, tof.phase_offset_deg), (3, -4.0));
    assert_ne!(all.hash(), scene.hash());
}

/// What a scene file leaves out has the value with which the structs of C begin.
#[test]
fn the_defaults_are_those_of_c() {
    use camlux::capi::{camlux_camera, camlux_sensor, camlux_tof, camlux_tof_noise};
    let scene = load(
        "[camera]\nresolution = [8, 8]\nposition = [0, 0, 0]\nlook_at = [0, 0, 1]\nfov_y_deg = 50\n\
         [[light]]\nkind = \"point\"\nposition = [0, 2, 0]\npower_w = 1\n\
         [sensor]\npixel_pitch_um = [1, 1]\nexposure_time_s = 1\nwavelength_nm = 850\nquantum_efficiency = 0.5\n\
         [tof]\nfrequencies_mhz = [20, 100]\n[tof.noise]\nfull_well_e = 5\n\
         [indirect]\nestimator = \"rsm-average\"\n",
    );
    assert_eq!(scene.camera.up.to_array(), camlux_camera::default().up);
    let sensor = scene.sensor.unwrap();
    assert_eq!(sensor.duty_cycle, camlux_sensor::default().duty_cycle);
    let (tof, of_c) = (scene.tof.unwrap(), camlux_tof::default());
    assert_eq!(tof.contrasts, of_c.contrasts[..2]);
    assert_eq!(tof.band_weights, of_c.band_weights);
    assert_eq!(tof.phase_count, of_c.phase_count);
    let (noise, of_c) = (tof.noise.unwrap(), camlux_tof_noise::default());
    let found = [
        noise.dark_e_per_s,
        noise.read_noise_e,
        noise.gain_dn_per_e,
        noise.black_level_dn,
    ];
    let due = [
        of_c.dark_e_per_s,
        of_c.read_noise_e,
        of_c.gain_dn_per_e,
        of_c.black_level_dn,
    ];
    assert_eq!(found, due);
    assert_eq!((noise.bits, noise.seed), (of_c.bits, of_c.seed));
    assert_eq!(noise.full_well_e, 5.0);
    assert_eq!(scene.indirect.unwrap().rsm_size(), Some(64));
}

/// A camera that looks along +x, with y up: its right is z, its down -y.
#[test]
fn lights_are_placed_relative_to_what_carries_them() {
    let camera = "[camera]\nresolution = [8, 8]\nposition = [1, 2, 3]\nlook_at = [5, 2, 3]\nup = [0, 1, 0]\nfov_y_deg = 50\n";
    let spot = |carrier: &str| {
        format!(
            "[[light]]\nkind = \"spot\"\n{carrier}\nposition = [0.5, 0.25, 0.125]\ndirection = [0, 0, 1]\n\
             inner_half_angle_deg = 20\nouter_half_angle_deg = 30\npower_w = 1\n"
        )
    };
    let mesh = "[material.clay]\nkd = 0.5\n[[mesh]]\npath = \"mesh.obj\"\nmaterial = \"clay\"\nscale = 2\nrotate_deg = [0, 90, 0]\ntranslate = [10, 0, 0]\n";
    let (by_camera, by_mesh) = (
        spot("relative_to = \"camera\""),
        spot("relative_to = \"mesh\"\nmesh = 0"),
    );
    let mut scene = load(&format!("{camera}{by_camera}{by_mesh}{mesh}"));
    let carriers = scene.lights.iter().map(|light| light.relative_to);
    assert_eq!(
        carriers.collect::<Vec<_>>(),
        [Some(Carrier::Camera), Some(Carrier::Mesh(0))]
    );
    // The file's own numbers.
    let position_m = scene.lights[0].position_m();
    assert_eq!(position_m, Some(DVec3::new(0.5, 0.25, 0.125)));
    assert_eq!(scene.lights[0].direction(), Some(DVec3::Z));
    let assert_at = |light: &Light, position_m: [f64; 3], direction: [f64; 3]| {
        let off_m = light.position_m().unwrap() - DVec3::from(position_m);
        let turned = light.direction().unwrap() - DVec3::from(direction);
        assert!(
            off_m.length() < 1e-12 && turned.length() < 1e-12,
            "{light:?}"
        );
    };
    let world = scene.in_world();
    assert_at(&world.lights[0], [1.125, 1.75, 3.5], [1.0, 0.0, 0.0]);
    assert_eq!(world.lights[0].relative_to, None);
    assert_eq!(world.hash(), scene.hash());
    // Scaled by 2, z turned to x and x to -z, then moved by 10 m.
    assert_at(&scene.lights[1], [10.25, 0.5, -1.0], [1.0, 0.0, 0.0]);

    // The camera steps back and looks along -x: its right is -z.
    scene.camera.position_m = DVec3::new(-1.0, 2.0, 3.0);
    scene.camera.look_at_m = DVec3::new(-2.0, 2.0, 3.0);
    let world = scene.in_world();
    assert_at(&world.lights[0], [-1.125, 1.75, 2.5], [-1.0, 0.0, 0.0]);
    assert_at(&scene.lights[1], [10.25, 0.5, -1.0], [1.0, 0.0, 0.0]);
    let quarter = glam::DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2);
    scene.carry_lights(0, quarter, DVec3::Z);
    assert_at(&scene.lights[1], [-0.5, 10.25, 0.0], [0.0, 1.0, 0.0]);
}

#[test]
fn area_lights_are_read() {
    let folder = SceneFolder::new();
    let area =
        "[[light]]\nkind = \"area\"\nposition = [0, 2, 0]\ndirection = [0, -1, 0]\npower_w = 3\n";
    let load = |more: &str| {
        let scene = folder.load(&format!("{CAMERA}{area}{more}\n"));
        scene.map(|scene| scene.lights[0].clone())
    };
    let light = |up, shape| Light::area(2.0 * DVec3::Y, DVec3::NEG_Y, up, shape, [3.0; 3]);
    let rectangle = load("up = [0, 0, -1]\nsize = [0.6, 0.4]").unwrap();
    let size_m = [0.6, 0.4];
    assert_eq!(
        rectangle,
        light(DVec3::NEG_Z, AreaShape::Rectangle { size_m }).into()
    );
    let radius_m = 0.1;
    let disc = load("up = [1, 0, 0]\nradius = 0.1").unwrap();
    assert_eq!(disc, light(DVec3::X, AreaShape::Disc { radius_m }).into());
    // A disc needs no `up`.
    assert!(load("radius = 0.1").is_ok());
    for (more, part) in [
        ("size = [0.6, 0.4]", "has no \"up\""),
        ("up = [0, 0, -1]", "has no \"size\""),
        ("size = [1, 1]\nradius = 1", "conflicts with \"size\""),
        ("radius = -0.1", "light 0 (area): radius"),
        ("up = [0, 2, 0]\nradius = 0.1", "is parallel to direction"),
    ] {
        let error = load(more).expect_err(more).to_string();
        assert!(error.contains(part), "{part} is missing in: {error}");
    }
}
