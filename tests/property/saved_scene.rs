//! A saved scene is the same scene again, bit by bit.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use crate::common::scene_folder::assert_says;
use camlux::scene::{
    AreaShape, BayerPattern, Camera, Carrier, ChargeUnit, Direct, Distortion, Encoding, ErrorNorm,
    Filter, FinalGather, IndirectLight, Instance, Intrinsics, Lens, Light, Material, Mesh,
    MetallicRoughness, Pattern, PixelFilter, PixelSampling, PlacedLight, ProjectedImage,
    RsmAverage, Scene, Sensor, SensorNoise, Shadow, Shared, SpotCone, Texels, Texture,
    TextureLookup, TimeOfFlight, Vignetting, VignettingMap, VplSum, Wrap,
};
use glam::{DAffine3, DMat3, DVec3};

/// Saves a scene, loads it again, and compares everything.
#[track_caller]
fn assert_comes_back(scene: &Scene) {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().join("new/one");
    scene.save(&folder).expect("it is saved");
    let again = Scene::load(&folder.join("scene.toml")).expect("it is loaded");
    assert_eq!(again.hash(), scene.hash());
    assert_eq!(again.camera, scene.camera);
    assert_eq!(again.sensor, scene.sensor);
    assert_eq!(again.tof, scene.tof);
    assert_eq!(again.lights, scene.lights);
    assert_eq!(again.materials, scene.materials);
    assert_eq!(again.textures, scene.textures);
    assert_eq!(again.vignetting_map, scene.vignetting_map);
    assert_eq!(again.direct, scene.direct);
    assert_eq!(again.indirect, scene.indirect);
    assert_eq!(again.left_out, Vec::<String>::new());
    assert_eq!(again.meshes.len(), scene.meshes.len());
    for (i, (again, instance)) in again.meshes.iter().zip(&scene.meshes).enumerate() {
        assert_eq!(again.name, instance.name);
        assert_eq!(again.to_world, instance.to_world);
        let mut mesh = Mesh::clone(&again.mesh);
        mesh.name = instance.mesh.name.clone();
        assert_eq!(mesh, *instance.mesh, "mesh {i}");
    }
    for (i, a) in scene.meshes.iter().enumerate() {
        for (j, b) in scene.meshes.iter().enumerate() {
            let shares = again.meshes[i].mesh.ptr_eq(&again.meshes[j].mesh);
            assert_eq!(shares, a.mesh.ptr_eq(&b.mesh), "{i} and {j}");
        }
    }
}

#[test]
fn every_demo_scene_comes_back() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("scenes/ is there") {
        let path = entry.expect("scenes/ can be listed").path();
        if path
            .extension()
            .is_some_and(|extension| extension == "toml")
        {
            println!("{}", path.display());
            let mut scene = Scene::load(&path).unwrap_or_else(|error| panic!("{error}"));
            // No saved scene has what its files held beyond it.
            scene.left_out.clear();
            assert_comes_back(&scene);
            count += 1;
        }
    }
    assert!(count >= 5, "only {count} scenes were found");
}

/// Numbers with all digits.
struct Digits(u64);

impl Digits {
    /// −1 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::from_array([0; 3].map(|_| self.next()))
    }

    fn share(&mut self) -> f64 {
        0.5 * (self.next() + 1.0)
    }
}

fn mesh(digits: &mut Digits, materials: &[u32], has_all: bool) -> Mesh {
    let count = 3 * materials.len();
    let listed = |is_there: bool| if is_there { count } else { 0 };
    Mesh {
        name: "inner".into(),
        positions_m: (0..count).map(|_| 7.0 * digits.vector()).collect(),
        // Of any length.
        normals: (0..listed(has_all))
            .map(|_| 3.0 * digits.vector())
            .collect(),
        texcoords: (0..listed(has_all))
            .map(|_| [digits.next(), -0.0])
            .collect(),
        texcoords_1: (0..listed(has_all)).map(|_| [digits.next(), 9.0]).collect(),
        colors: (0..listed(has_all))
            .map(|_| [0; 3].map(|_| digits.share() as f32))
            .collect(),
        tangents: (0..listed(has_all))
            .map(|_| [0; 4].map(|_| digits.next() as f32))
            .collect(),
        triangles: (0..count as u32)
            .step_by(3)
            .map(|i| [i + 2, i, i + 1])
            .collect(),
        triangle_materials: materials.to_vec(),
    }
}

fn texture(name: &str, texels: Texels) -> Shared<Texture> {
    Shared::from(Texture {
        name: name.into(),
        size_px: [3, 2],
        texels,
    })
}

/// A scene that has everything that a scene can have, and names that need escapes.
fn scene() -> Scene {
    let mut digits = Digits(5);
    let d = &mut digits;
    let bytes = |i: u8| [i, 40 * i, 255 - i];
    let textures = vec![
        texture(
            "not used",
            Texels::U8((0..6).map(bytes).collect(), Encoding::Srgb),
        ),
        texture(
            "n",
            Texels::U8((0..6).map(bytes).collect(), Encoding::Linear),
        ),
        texture(
            "",
            Texels::U16(
                (0..6).map(|i| [i, 9999 * i, 65_535 - i]).collect(),
                Encoding::Srgb,
            ),
        ),
        texture(
            "\"16\" bits",
            Texels::U16((0..6).map(|i| [i, i + 256, 1]).collect(), Encoding::Linear),
        ),
        texture(
            "ü\n\u{7f}\0",
            Texels::F32((0..6).map(|_| [0; 3].map(|_| d.share() as f32)).collect()),
        ),
    ];
    let lookup = |texture: usize, d: &mut Digits| TextureLookup {
        texture,
        texcoord_set: 1,
        transform: [[d.next(), 1e-7, -0.5], [1e6, d.next(), 1.0 / 3.0]],
        wrap: [Wrap::Mirror, Wrap::Clamp],
        filter: Filter::Nearest,
    };
    let material = |name: &str, d: &mut Digits| Material {
        kd: [0; 3].map(|_| d.share()),
        ..Material::lambert(name, [0.0; 3])
    };
    let materials = vec![
        Material {
            ks: [0.1, 0.0, 1.0 / 3.0],
            shininess: 1e8 / 3.0,
            kd_texture: Some(lookup(2, d)),
            ks_texture: Some(4.into()),
            shininess_texture: Some(3.into()),
            normal_texture: Some(lookup(1, d)),
            alpha_texture: Some(lookup(1, d)),
            alpha_cutoff: 0.1,
            ..material("a \"quoted\" name", d)
        },
        material("", d),
        Material {
            shininess: 3.5,
            ..material("same", d)
        },
        Material {
            microfacets: Some(MetallicRoughness {
                metallic: d.share(),
                roughness: 1.0 / 3.0,
                ior: 1.0 + d.share(),
                specular: d.share(),
            }),
            metallic_roughness_texture: Some(lookup(3, d)),
            ..material("facets", d)
        },
        Material {
            emission_w_sr_m2: [1e20 / 3.0, 0.0, 1e-9],
            emission_texture: Some(lookup(2, d)),
            is_one_sided: true,
            ..material("lamp", d)
        },
        material("same", d),
        material("same 3", d),
        material("same", d),
        material("line\nbreak.and = [\u{7f}]", d),
    ];
    let shared = Shared::from(mesh(d, &[6, 0, 3, 3], true));
    let affine = DAffine3::from_mat3_translation(
        DMat3::from_cols(-d.vector(), 2.0 * d.vector(), d.vector()),
        d.vector(),
    );
    let placed = |mesh: Shared<Mesh>, name: &str, to_world: DAffine3| Instance {
        name: name.into(),
        mesh,
        to_world,
    };
    let meshes = vec![
        placed(shared.clone(), "first", DAffine3::IDENTITY),
        placed(Shared::from(mesh(d, &[5], false)), "\\", DAffine3::IDENTITY),
        placed(shared, "", affine),
        placed(Shared::from(mesh(d, &[], false)), "empty", affine),
    ];
    let planes_rad = vec![0.0, 1.0, d.share() + 2.0, TAU];
    let gammas_rad = vec![0.0, d.share(), 2.0 + d.share(), PI];
    let mut intensities: Vec<f64> = (0..16).map(|_| d.share()).collect();
    intensities.copy_within(0..4, 12);
    let pattern = Pattern {
        gammas_rad,
        planes_rad,
        intensities,
        peak: 1234.5678,
    };
    let image = ProjectedImage {
        size_px: [3, 2],
        intrinsics: Intrinsics {
            fx: 7.0 / 3.0,
            fy: 2.0,
            cx: 1.0,
            cy: 1.1,
            skew: 0.0,
        },
        // The largest is not 1.
        values: (0..6).map(|_| 0.7 * d.share() as f32).collect(),
    };
    let power_w = [d.share(), 1e-9, 1e20];
    let at = |d: &mut Digits| 2.0 * d.vector();
    let lights = vec![
        Light::point(at(d), power_w),
        Light::spot(
            at(d),
            at(d),
            SpotCone {
                inner_half_angle_deg: 10.0 / 3.0,
                outer_half_angle_deg: 20.0 / 3.0,
            },
            power_w,
        ),
        Light::directional(at(d), power_w),
        Light::with_profile(at(d), at(d), at(d), pattern, power_w),
        Light::with_profile(at(d), at(d), at(d), image, power_w),
        Light::area(
            at(d),
            at(d),
            at(d),
            AreaShape::Disc { radius_m: 0.1 },
            power_w,
        ),
        Light::area(
            at(d),
            at(d),
            at(d),
            AreaShape::Rectangle {
                size_m: [0.1, 1.0 / 3.0],
            },
            power_w,
        ),
    ];
    let lights = lights
        .into_iter()
        .enumerate()
        .map(|(index, light)| PlacedLight {
            light,
            relative_to: match index {
                0 => Some(Carrier::Camera),
                4 => Some(Carrier::Mesh(2)),
                6 => Some(Carrier::Mesh(0)),
                _ => None,
            },
        });
    Scene {
        camera: Camera {
            resolution_px: [8, 6],
            position_m: d.vector(),
            look_at_m: d.vector(),
            up: d.vector(),
            lens: Lens::Distorted {
                intrinsics: Intrinsics {
                    fx: 20.0 / 3.0,
                    fy: 7.0,
                    cx: 4.1,
                    cy: 3.0,
                    skew: 1.0 / 3.0,
                },
                distortion: Distortion::Rational([
                    1e-3,
                    -1e-4,
                    0.0,
                    1e-5,
                    0.0,
                    0.0,
                    1.0 / 3e5,
                    0.0,
                    1e-4,
                    0.0,
                    1e-5,
                    0.0,
                    0.0,
                    1e-2 / 3.0,
                ]),
            },
            pixel_sampling: Some(PixelSampling {
                samples: 5,
                filter: PixelFilter::Gaussian,
            }),
        },
        sensor: Some(Sensor {
            pixel_pitch_um: [10.0 / 3.0, 12.0],
            exposure_time_s: 1e-3 / 3.0,
            duty_cycle: 0.3,
            wavelength_nm: Some(850.1),
            quantum_efficiency: Some(0.7),
            f_number: Some(2.8),
            vignetting: Some(Vignetting([-1.0 / 3.0, 0.1, -1e-3])),
            band_weights: [0.3, 1.0, 1.0 / 3.0],
            bayer: Some(BayerPattern::Gbrg),
            monochrome: false,
            noise: Some(SensorNoise {
                full_well_e: 1e4 / 3.0,
                dsnu_e: 0.6,
                prnu: 1.0 / 150.0,
                ..SensorNoise::DEFAULT
            }),
        }),
        tof: Some(TimeOfFlight {
            // Products of a million and a number in MHz would be others.
            frequencies_hz: vec![1e8 / 3.0, 1e8 / 7.0, 19_999_999.999_999_996],
            phase_count: 5,
            contrasts: vec![0.1, 0.2, 0.3],
            band_weights: [1.0 / 3.0, 0.0, 1.0],
            phase_offset_deg: -7.7,
            ambient_lights: vec![1, 2],
            output: ChargeUnit::DigitalNumbers,
            noise: Some(SensorNoise {
                seed: u64::MAX,
                dark_e_per_s: 1.0 / 3.0,
                read_noise_e: 10.0,
                full_well_e: 1e5,
                gain_dn_per_e: 0.04,
                black_level_dn: 3.3,
                bits: 12,
                ..SensorNoise::DEFAULT
            }),
        }),
        lights: lights.collect(),
        meshes,
        materials,
        textures,
        direct: Direct {
            shadow: Some(Shadow::Rays),
        },
        indirect: Some(IndirectLight::FinalGather(FinalGather {
            error_norm: ErrorNorm::Local,
            rsm_size: Some(8),
            max_ms: Some(1e4 / 3.0),
            max_rays: Some(9_007_199_254_740_993),
            stderr_layer: true,
            bounces: 16,
            // Without a target of the range: the camera averages over samples.
            ..FinalGather::new(0.1)
        })),
        vignetting_map: None,
        left_out: Vec::new(),
    }
}

#[test]
fn a_scene_with_everything_comes_back() {
    assert_comes_back(&scene());
}

#[test]
fn variants_come_back() {
    let edits: [fn(&mut Scene); 11] = [
        |s| s.indirect = None,
        |s| s.indirect = Some(IndirectLight::vpl_sum(VplSum::InstantRadiosity, 8)),
        |s| {
            s.indirect = Some(IndirectLight::RsmAverage(RsmAverage {
                rsm_size: 8,
                interpolation_error: Some(0.1),
            }));
        },
        |s| s.direct.shadow = None,
        |s| s.tof = None,
        |s| {
            s.tof = None;
            s.sensor = None;
        },
        |s| {
            s.camera.lens = Lens::FovY {
                fov_y_deg: 100.0 / 3.0,
            };
            s.sensor.as_mut().unwrap().vignetting = None;
        },
        |s| {
            s.sensor.as_mut().unwrap().vignetting = None;
            let map = VignettingMap {
                size_px: [3, 2],
                values: vec![0.0, 1.0, 0.3, f32::MIN_POSITIVE, 100.0, 1.0 / 3.0],
            };
            s.vignetting_map = Some(map.into());
        },
        |s| s.camera.lens = Lens::Equirectangular,
        |s| {
            s.camera.lens = Lens::Orthographic {
                height_m: 10.0 / 3.0,
            };
        },
        |s| {
            s.camera.pixel_sampling = None;
            if let Some(IndirectLight::FinalGather(gather)) = &mut s.indirect {
                gather.target_range_error_mm = Some(2.5);
            }
        },
    ];
    for edit in edits {
        let mut scene = scene();
        // A sum has no area lights.
        scene.lights.truncate(5);
        edit(&mut scene);
        assert_comes_back(&scene);
    }
}

#[test]
fn what_cannot_be_saved_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("a file");
    let message = scene().save(&file.join("scene")).unwrap_err().to_string();
    assert_says(&message, &["file", "cannot create the folder"]);
    let mut wrong = scene();
    wrong.materials[0].kd[1] = 2.0;
    let message = wrong.save(folder.path()).unwrap_err().to_string();
    assert_says(&message, &["material 0", "kd is"]);
    assert!(!folder.path().join("scene.toml").exists());
    let mut one = scene();
    one.camera.pixel_sampling = Some(PixelSampling {
        samples: 1,
        filter: PixelFilter::Box,
    });
    if one.validate().is_ok() {
        let message = one.save(folder.path()).unwrap_err().to_string();
        assert_says(&message, &["camera", "samples is 1"]);
    }
}
