//! The hash changes with everything that the image depends on, and with nothing else.

use crate::common::gather::gather;
use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE};
use camlux::scene::{
    AreaShape, DEFAULT_TARGET_ERROR, Distortion, Encoding, ErrorNorm, Filter, IndirectLight,
    Intrinsics, Lens, Light, MetallicRoughness, PixelFilter, PixelSampling, RsmAverage, Scene,
    Shadow, Shared, SpotCone, Texels, TextureLookup, Vignetting, VignettingMap, VplSum, Wrap,
};
use glam::DVec3;

fn pixel_sampling(samples: u32, filter: PixelFilter) -> Option<PixelSampling> {
    Some(PixelSampling { samples, filter })
}

fn skewed(scene: &Scene, skew: f64) -> Lens {
    let intrinsics = scene.camera.intrinsics_px();
    Lens::Intrinsics(Intrinsics { skew, ..intrinsics })
}

fn tilted(scene: &Scene, index: usize, value: f64) -> Lens {
    let mut coefficients = [0.0; 14];
    coefficients[index] = value;
    Lens::Distorted {
        intrinsics: scene.camera.intrinsics_px(),
        distortion: Distortion::Rational(coefficients),
    }
}

fn map(size_px: [u32; 2], values: [f32; 2]) -> Option<Shared<VignettingMap>> {
    let values = values.into();
    Some(VignettingMap { size_px, values }.into())
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

    let edits: [fn(&mut Scene); 95] = [
        |s| s.lights[0] = area(AreaShape::Disc { radius_m: 0.1 }).into(),
        |s| s.lights[0] = area(AreaShape::Disc { radius_m: 0.2 }).into(),
        |s| {
            s.lights[0] = area(AreaShape::Rectangle { size_m: [0.1, 0.2] }).into();
        },
        |s| s.camera.resolution_px = [6, 8],
        |s| s.camera.position_m.x += 1e-15,
        |s| s.camera.look_at_m.y += 1e-9,
        |s| s.camera.up.z += 1e-9,
        |s| s.camera.lens = Lens::FovY { fov_y_deg: 50.1 },
        |s| s.camera.pixel_sampling = pixel_sampling(16, PixelFilter::Box),
        |s| s.camera.pixel_sampling = pixel_sampling(17, PixelFilter::Box),
        |s| s.camera.pixel_sampling = pixel_sampling(16, PixelFilter::Gaussian),
        |s| s.camera.lens = Lens::FovX { fov_x_deg: 50.0 },
        |s| s.camera.lens = Lens::Equirectangular,
        |s| s.camera.lens = Lens::Orthographic { height_m: 50.0 },
        |s| s.camera.lens = Lens::Orthographic { height_m: 50.1 },
        |s| s.camera.lens = Lens::Intrinsics(s.camera.intrinsics_px()),
        |s| s.camera.lens = skewed(s, 0.1),
        |s| s.camera.lens = tilted(s, 12, 0.0),
        |s| s.camera.lens = tilted(s, 12, 0.1),
        |s| s.camera.lens = tilted(s, 13, 0.1),
        |s| s.sensor = None,
        |s| s.sensor.as_mut().unwrap().pixel_pitch_um[1] = 11.0,
        |s| s.sensor.as_mut().unwrap().exposure_time_s = 2e-3,
        |s| s.sensor.as_mut().unwrap().duty_cycle = 0.4,
        |s| s.sensor.as_mut().unwrap().f_number = Some(2.0),
        |s| s.sensor.as_mut().unwrap().vignetting = Some(Vignetting([0.0; 3])),
        |s| s.sensor.as_mut().unwrap().vignetting = Some(Vignetting([0.0, 0.0, 0.1])),
        |s| s.vignetting_map = map([1, 2], [1.0, 0.5]),
        |s| s.vignetting_map = map([2, 1], [1.0, 0.5]),
        |s| s.vignetting_map = map([2, 1], [1.0, 0.25]),
        |s| s.direct.shadow = Some(Shadow::Map),
        |s| s.direct.shadow = Some(Shadow::Rays),
        |s| s.indirect = None,
        |s| s.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 65)),
        |s| s.indirect = Some(IndirectLight::vpl_sum(VplSum::InstantRadiosity, 64)),
        |s| s.indirect = Some(interpolated_average(0.02)),
        |s| s.indirect = Some(interpolated_average(0.021)),
        |s| s.indirect = Some(IndirectLight::final_gather(0.02)),
        |s| s.indirect = Some(IndirectLight::final_gather(0.021)),
        |s| s.indirect = Some(gather!(0.02, rsm_size = Some(64))),
        |s| s.indirect = Some(gather!(0.02, max_ms = Some(64.0))),
        |s| s.indirect = Some(gather!(0.02, max_rays = Some(64))),
        |s| s.indirect = Some(gather!(0.02, error_norm = ErrorNorm::Local)),
        |s| s.indirect = Some(gather!(0.02, stderr_layer = true)),
        |s| s.indirect = Some(gather!(0.02, bounces = 2)),
        |s| s.lights.push(s.lights[0].clone()),
        |s| s.lights[0] = point([0.0, 1.98, 0.0], [50.0, 50.0, 51.0]).into(),
        |s| s.lights[0] = point([0.0, 1.98, 0.1], [50.0; 3]).into(),
        |s| s.lights[0] = directional(DVec3::Y, 50.0).into(),
        |s| s.lights[0] = directional(DVec3::X, 50.0).into(),
        |s| s.lights[0] = directional(DVec3::Y, 51.0).into(),
        |s| s.lights[0] = spot(DVec3::Y, 1.0, 2.0).into(),
        |s| s.lights[0] = spot(DVec3::Y, 1.0, 3.0).into(),
        |s| s.lights[0] = spot(DVec3::X, 1.0, 2.0).into(),
        |s| s.materials[0].kd[1] = 0.51,
        |s| s.materials[0].ks[2] = 0.01,
        |s| s.materials[0].shininess = 2.0,
        |s| s.materials[0].microfacets = Some(MetallicRoughness::DEFAULT),
        |s| facets(s).metallic = 0.1,
        |s| facets(s).roughness = 0.1,
        |s| facets(s).ior = 1.4,
        |s| facets(s).specular = 0.1,
        |s| s.materials[1].metallic_roughness_texture = Some(0.into()),
        |s| s.materials[0].emission_w_sr_m2[1] = 0.1,
        |s| s.materials[0].emission_w_sr_m2[2] = 0.1,
        |s| s.materials[1].emission_texture = Some(0.into()),
        |s| s.materials[0].is_one_sided = true,
        |s| s.materials[1].normal_texture = Some(0.into()),
        |s| s.materials[1].alpha_texture = Some(0.into()),
        |s| s.materials[1].kd_texture = None,
        |s| s.materials[1].ks_texture = Some(0.into()),
        |s| s.materials[1].shininess_texture = Some(0.into()),
        |s| s.materials[1].alpha_cutoff = 0.4,
        |s| looked_up(s).texcoord_set = 1,
        |s| looked_up(s).transform[0][0] = 1.1,
        |s| looked_up(s).transform[0][1] = 1.0,
        |s| looked_up(s).transform[1][2] = 1.0,
        |s| looked_up(s).wrap[0] = Wrap::Mirror,
        |s| looked_up(s).wrap[0] = Wrap::Clamp,
        |s| looked_up(s).wrap[1] = Wrap::Clamp,
        |s| looked_up(s).filter = Filter::Nearest,
        |s| s.textures[0].size_px = [1, 2],
        |s| s.textures[0].texels = Texels::U8(vec![[9; 3], [9, 9, 10]], Encoding::Srgb),
        |s| s.meshes[0].positions_m[2].x += 1e-12,
        |s| s.meshes[0].normals[2].x += 1e-12,
        |s| s.meshes[0].texcoords[2][0] += 1e-12,
        |s| s.meshes[0].texcoords_1 = vec![[0.0; 2]; 3],
        |s| s.meshes[0].texcoords_1 = vec![[0.0, 0.1]; 3],
        |s| s.meshes[0].colors = vec![[1.0; 3]; 3],
        |s| s.meshes[0].colors = vec![[1.0, 0.9, 1.0]; 3],
        |s| s.meshes[0].tangents = vec![[1.0, 0.0, 0.0, 1.0]; 3],
        |s| s.meshes[0].tangents = vec![[1.0, 0.0, 0.0, -1.0]; 3],
        |s| s.meshes[0].to_world.matrix3.x_axis.x = -1.0,
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

fn facets(scene: &mut Scene) -> &mut MetallicRoughness {
    let facets = &mut scene.materials[0].microfacets;
    facets.get_or_insert(MetallicRoughness::DEFAULT)
}

fn looked_up(scene: &mut Scene) -> &mut TextureLookup {
    let lookup = scene.materials[1].kd_texture.as_mut();
    lookup.expect("the material has a texture")
}

/// The hash includes the target error, whether the file gives it or not.
#[test]
fn hash_is_of_the_target_error_in_force() {
    let folder = SceneFolder::new();
    let hash = |target_error: &str| {
        let indirect = format!("[indirect]\nestimator = \"final-gather\"\n{target_error}\n");
        let scene = folder.load(&format!("{CAMERA}{LIGHT}{indirect}{MESH}"));
        scene.unwrap().hash()
    };
    let written = format!("target_error = {DEFAULT_TARGET_ERROR}");
    assert_eq!(hash(""), hash(&written));
    assert_ne!(hash(""), hash("target_error = 0.021"));
}

fn interpolated_average(error: f64) -> IndirectLight {
    IndirectLight::RsmAverage(RsmAverage {
        rsm_size: 64,
        interpolation_error: Some(error),
    })
}

fn point(position_m: [f64; 3], power_w: [f64; 3]) -> Light {
    Light::point(position_m.into(), power_w)
}

fn directional(direction: DVec3, irradiance: f64) -> Light {
    Light::directional(direction, [irradiance; 3])
}

fn area(shape: AreaShape) -> Light {
    Light::area(DVec3::Y, DVec3::NEG_Y, DVec3::X, shape, [50.0; 3])
}

fn spot(direction: DVec3, inner_half_angle_deg: f64, outer_half_angle_deg: f64) -> Light {
    Light::spot(
        DVec3::new(0.0, 1.98, 0.0),
        direction,
        SpotCone {
            inner_half_angle_deg,
            outer_half_angle_deg,
        },
        [50.0; 3],
    )
}
