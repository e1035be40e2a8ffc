//! Bad values in a scene from slices: each is refused with a message that names the part and the value.

use crate::common::gather::gather;
use crate::common::rows::rows;
use crate::common::scene_folder::assert_says;
use camlux::scene::{
    AreaShape, BayerPattern, Camera, ChargeUnit, Direct, Encoding, IndirectLight, Intrinsics, Lens,
    Light, Material, Mesh, MetallicRoughness, PixelFilter, PixelSampling, RsmAverage, Scene,
    Sensor, SensorNoise, Shadow, Shared, SpotCone, Texels, Texture, TimeOfFlight, Vignetting,
    VignettingMap, VplSum,
};
use glam::DVec3;

fn facets(roughness: f64, ior: f64) -> Option<MetallicRoughness> {
    Some(MetallicRoughness {
        roughness,
        ior,
        ..MetallicRoughness::DEFAULT
    })
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
            pixel_sampling: None,
        },
        sensor: Some(Sensor {
            pixel_pitch_um: [12.0, 12.0],
            exposure_time_s: 1e-3,
            duty_cycle: 0.5,
            f_number: None,
            vignetting: None,
            wavelength_nm: None,
            quantum_efficiency: None,
            ..Sensor::DEFAULT
        }),
        tof: None,
        lights: vec![Light::point(DVec3::Y, [1.0; 3]).into()],
        meshes: vec![
            Mesh::from_slices(
                "floor",
                &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
                &[[0, 1, 2]],
                0,
            )
            .into(),
        ],
        materials: vec![Material::lambert("clay", [0.5; 3])],
        textures: vec![
            Texture {
                name: "wood".into(),
                size_px: [1, 1],
                texels: Texels::F32(vec![[0.5; 3]]),
            }
            .into(),
        ],
        direct: Direct::default(),
        indirect: Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 8)),
        vignetting_map: None,
        left_out: Vec::new(),
    }
}

fn map(width: u32, values: Vec<f32>) -> Option<Shared<VignettingMap>> {
    let size_px = [width, 1];
    Some(VignettingMap { size_px, values }.into())
}

fn pixel_sampling(samples: u32) -> Option<PixelSampling> {
    let filter = PixelFilter::Box;
    Some(PixelSampling { samples, filter })
}

fn tof() -> TimeOfFlight {
    TimeOfFlight {
        frequencies_hz: vec![20e6, 100e6],
        phase_count: 4,
        contrasts: vec![0.75; 2],
        band_weights: [1.0, 0.0, 0.0],
        phase_offset_deg: 0.0,
        ambient_lights: Vec::new(),
        output: ChargeUnit::Electrons,
        noise: None,
    }
}

/// Makes the scene's camera a time-of-flight camera.
fn detects(scene: &mut Scene) -> &mut TimeOfFlight {
    detector(scene, 850.0, 0.8);
    scene.tof.insert(tof())
}

fn noise(scene: &mut Scene) -> &mut SensorNoise {
    detects(scene).noise.insert(SensorNoise {
        seed: 1,
        dark_e_per_s: 0.0,
        read_noise_e: 10.0,
        full_well_e: 1e5,
        gain_dn_per_e: 0.04,
        black_level_dn: 0.0,
        bits: 12,
        ..SensorNoise::DEFAULT
    })
}

/// Makes the scene's sensor one that counts electrons.
fn counts(scene: &mut Scene) -> &mut Sensor {
    detector(scene, 550.0, 0.6);
    let sensor = scene.sensor.as_mut().unwrap();
    sensor.noise = Some(SensorNoise {
        full_well_e: 1e4,
        ..SensorNoise::DEFAULT
    });
    sensor
}

/// Gives the sensor what time of flight needs.
fn detector(scene: &mut Scene, wavelength_nm: f64, quantum_efficiency: f64) {
    let sensor = scene.sensor.as_mut().unwrap();
    sensor.wavelength_nm = Some(wavelength_nm);
    sensor.quantum_efficiency = Some(quantum_efficiency);
}

fn range_target(target_mm: f64) -> IndirectLight {
    gather!(0.02, target_range_error_mm = Some(target_mm))
}

fn interpolated_average(interpolation_error: f64) -> IndirectLight {
    IndirectLight::RsmAverage(RsmAverage {
        rsm_size: 8,
        interpolation_error: Some(interpolation_error),
    })
}

#[test]
fn every_error_in_range_is_taken_and_final_gathering_needs_no_size() {
    let mut scene = scene();
    for error in [0.002, 0.02, 0.5] {
        for indirect in [
            IndirectLight::final_gather(error),
            gather!(error, max_ms = Some(1e-3), max_rays = Some(1)),
            gather!(error, rsm_size = Some(8)),
            interpolated_average(error),
        ] {
            scene.indirect = Some(indirect);
            scene.validate().unwrap();
        }
    }
    for sum in VplSum::ALL {
        scene.indirect = Some(IndirectLight::vpl_sum(sum, 8));
        scene.validate().unwrap();
    }
}

/// Asserts that an edit makes the scene wrong. The message says what is wrong, then, after the semicolon, how to mend it.
fn refuses(edit: &dyn Fn(&mut Scene), words: &[&str]) {
    let mut scene = scene();
    edit(&mut scene);
    let error = scene.validate().expect_err(words[0]).to_string();
    assert_says(&error, words);
    assert_says(&error, &["; "]);
}

#[test]
fn scenes_from_slices_are_validated() {
    const NAN: f64 = f64::NAN;
    scene().validate().unwrap();

    let spot = |direction: DVec3, inner: f64, outer: f64, power: f64| {
        Light::spot(
            DVec3::Y,
            direction,
            SpotCone {
                inner_half_angle_deg: inner,
                outer_half_angle_deg: outer,
            },
            [power; 3],
        )
    };
    let intrinsics = |fx, fy, cx| {
        Lens::Intrinsics(Intrinsics {
            fx,
            fy,
            cx,
            cy: 3.0,
            skew: 0.0,
        })
    };
    let down = -DVec3::Y;
    let area = |up: DVec3, shape| Light::area(DVec3::Y, -2.0 * DVec3::Y, up, shape, [1.0; 3]);
    let disc = AreaShape::Disc { radius_m: 0.1 };
    rows! { refuses;
        |s| s.lights[0] = area(DVec3::Y, disc).into() =>
            "light 0 (area): up [0, 1, 0] is parallel to direction";
        |s| {
            let size_m = [-2.0, 1.0];
            s.lights[0] = area(DVec3::X, AreaShape::Rectangle { size_m }).into();
        } => "light 0 (area): size_m is -2";
        |s| {
            let radius_m = NAN;
            s.lights[0] = area(DVec3::X, AreaShape::Disc { radius_m }).into();
        } => "light 0 (area): radius";
        |s| {
            s.lights[0] = area(DVec3::X, disc).into();
            s.direct.shadow = Some(Shadow::Map);
        } => "light 0 (area): a shadow map cannot find the shadows of an area light";
        |s| {
            s.lights[0] = area(DVec3::X, disc).into();
            s.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 8));
        } => "light 0 (area): rsm-average and instant-radiosity";
        |s| s.camera.resolution_px = [8, 0] => "camera: resolution_px is 8 x 0";
        |s| s.camera.resolution_px = [0, 6] => "camera: resolution_px is 0 x 6";
        |s| s.camera.position_m.x = NAN => "camera: position_m is [NaN, 0, 3]";
        |s| s.camera.look_at_m.x = f64::INFINITY => "camera: look_at_m is [inf";
        |s| s.camera.look_at_m = s.camera.position_m => "camera: position_m and look_at_m are both";
        |s| s.camera.up = DVec3::ZERO => "camera: up is [0, 0, 0], which has no direction";
        |s| s.camera.up = DVec3::new(1e-9, 0.0, -2.0) => "is parallel to the view";
        |s| s.camera.pixel_sampling = pixel_sampling(1) => "camera: samples is 1";
        |s| s.camera.pixel_sampling = pixel_sampling(5000) => "camera: samples is 5000";
        |s| s.camera.lens = Lens::FovY { fov_y_deg: 0.0 } => "camera: fov_y_deg is 0";
        |s| s.camera.lens = Lens::FovY { fov_y_deg: 180.0 } => "camera: fov_y_deg is 180";
        |s| s.camera.lens = Lens::FovY { fov_y_deg: NAN } => "camera: fov_y_deg is NaN";
        |s| s.camera.lens = intrinsics(0.0, 9.0, 4.0) => "camera: fx is 0";
        |s| s.camera.lens = intrinsics(9.0, NAN, 4.0) => "camera: fy is NaN";
        |s| s.camera.lens = intrinsics(9.0, 9.0, NAN) => "camera: cx, cy are NaN, 3";
        |s| s.sensor.as_mut().unwrap().pixel_pitch_um[1] = 0.0 =>
            "sensor: pixel_pitch_um height is 0";
        |s| s.sensor.as_mut().unwrap().exposure_time_s = -1.0 => "sensor: exposure_time_s is -1";
        |s| s.sensor.as_mut().unwrap().duty_cycle = 1.01 => "sensor: duty_cycle is 1.01";
        |s| s.sensor.as_mut().unwrap().duty_cycle = NAN => "sensor: duty_cycle is NaN";
        |s| s.tof = Some(tof()) =>
            "tof: the quantum efficiency of the pixels is not known; give the sensor a wavelength_nm and a quantum_efficiency";
        |s| detects(s).frequencies_hz.clear() => "tof: there are 0 frequencies; give 1 to 4";
        |s| detects(s).frequencies_hz[1] = NAN => "tof: frequency 1 is NaN Hz";
        |s| detects(s).phase_count = 2 => "tof: phase_count is 2; give 3 to 8 phase images";
        |s| detects(s).contrasts.truncate(1) => "tof: there are 1 contrasts for 2 frequencies";
        |s| detects(s).contrasts[0] = 1.5 => "tof: contrast 0 is 1.5";
        |s| detects(s).band_weights = [0.0; 3] =>
            "tof: the weights of the bands are [0.0, 0.0, 0.0]";
        |s| detects(s).phase_offset_deg = f64::INFINITY => "tof: phase_offset_deg is inf";
        |s| detects(s).ambient_lights.push(1) => "tof: ambient light 1 is not in the scene";
        |s| {
            detects(s);
            s.lights[0] = Light::Directional {
                direction: DVec3::NEG_Y,
                irradiance_w_m2: [1.0; 3],
            }
            .into();
        } =>
            "tof: light 0 (directional) is modulated, but has no position: its paths have no length; list it in ambient_lights";
        |s| detects(s).output = ChargeUnit::DigitalNumbers =>
            "tof: output is \"dn\", and there is no gain; give the time of flight its noise";
        |s| counts(s).quantum_efficiency = None => "sensor: has only one of wavelength_nm and quantum";
        |s| {
            counts(s).quantum_efficiency = None;
            s.sensor.as_mut().unwrap().wavelength_nm = None;
        } => "sensor: counts electrons, but its quantum efficiency is not known; give a wavelength_nm";
        |s| {
            counts(s).bayer = Some(BayerPattern::Rggb);
            s.sensor.as_mut().unwrap().monochrome = true;
        } => "sensor: has both bayer and monochrome; give one of them";
        |s| counts(s).vignetting = Some(Vignetting([0.0, f64::NAN, 0.0])) => "sensor: vignetting k2 is NaN; give finite coefficients";
        |s| s.vignetting_map = map(2, [1.0; 3].into()) => "vignetting map: it has 3 values for 2 x 1 pixels";
        |s| s.vignetting_map = map(2, [0.5, f32::NAN].into()) => "vignetting map: pixel (1, 0) is NaN";
        |s| s.vignetting_map = map(2, [0.5, -0.5].into()) => "vignetting map: pixel (1, 0) is -0.5";
        |s| s.vignetting_map = map(2, [0.0; 2].into()) => "vignetting map: all pixels are 0";
        |s| s.vignetting_map = map(0, Vec::new()) => "vignetting map: it has 0 values";
        |s| s.vignetting_map = map(40_000, vec![1.0; 40_000]) => "vignetting map: it has 40000 x 1 pixels";
        |s| { s.vignetting_map = map(1, vec![1.0]); s.sensor = None; s.tof = None; } => "vignetting map: it is given without a sensor";
        |s| counts(s).vignetting = Some(Vignetting([0.0; 3])) => "sensor: vignetting is given without an f_number";
        |s| counts(s).band_weights[1] = -1.0 => "sensor: band_weights of G is -1; give a weight from 0";
        |s| counts(s).noise.as_mut().unwrap().prnu = 2.0 => "sensor noise: prnu is 2; give a share";
        |s| counts(s).noise.as_mut().unwrap().dsnu_e = NAN => "sensor noise: dsnu_e is NaN";
        |s| noise(s).full_well_e = -1.0 => "tof noise: full_well_e is -1";
        |s| noise(s).read_noise_e = NAN => "tof noise: read_noise_e is NaN";
        |s| noise(s).bits = 25 => "tof noise: bits is 25";
        |s| noise(s).full_well_e = 0.0 => "tof noise: full_well_e is 0; give a value above 0";
        |s| noise(s).gain_dn_per_e = 0.0 => "tof noise: gain_dn_per_e is 0; give a value above 0";
        |s| noise(s).black_level_dn = 5000.0 =>
            "tof noise: black_level_dn is 5000, but 12 bits hold at most 4095";
        |s| detector(s, 850.0, 0.0) =>
            "sensor: quantum_efficiency is 0; give electrons per photon";
        |s| detector(s, 0.0, 0.8) => "sensor: wavelength_nm is 0";
        |s| detector(s, 850.0, 1.1) => "sensor: quantum_efficiency is 1.1";
        |s| s.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 0)) =>
            "indirect: rsm_size is 0";
        |s| s.indirect = Some(IndirectLight::vpl_sum(VplSum::InstantRadiosity, 0)) =>
            "indirect: rsm_size is 0";
        |s| s.indirect = Some(interpolated_average(0.001)) =>
            "indirect: interpolation_error is 0.001; give a relRMSE from 0.002 to 0.5";
        |s| s.indirect = Some(interpolated_average(NAN)) => "indirect: interpolation_error is NaN";
        |s| s.indirect = Some(gather!(0.02, rsm_size = Some(0))) => "indirect: rsm_size is 0";
        |s| s.indirect = Some(gather!(0.02, max_ms = Some(0.0))) =>
            "indirect: max_ms is 0; give finite milliseconds above 0";
        |s| s.indirect = Some(gather!(0.02, max_ms = Some(f64::INFINITY))) =>
            "indirect: max_ms is inf";
        |s| s.indirect = Some(gather!(0.02, max_ms = Some(NAN))) => "indirect: max_ms is NaN";
        |s| s.indirect = Some(gather!(0.02, max_rays = Some(0))) =>
            "indirect: max_rays is 0; give a number of rays above 0";
        |s| s.indirect = Some(range_target(5.0)) =>
            "indirect: target_range_error_mm is given, but the scene has no time of flight; add [tof] with its frequencies";
        |s| {
            detects(s);
            s.camera.pixel_sampling = pixel_sampling(4);
            s.indirect = Some(range_target(5.0));
        } =>
            "indirect: target_range_error_mm is given, but pixels are averaged over several samples; remove samples from the camera";
        |s| s.indirect = Some(range_target(0.05)) =>
            "indirect: target_range_error_mm is 0.05; give millimetres from 0.1 to 1000, such as 5";
        |s| s.indirect = Some(range_target(NAN)) => "indirect: target_range_error_mm is NaN";
        |s| s.indirect = Some(IndirectLight::final_gather(0.0019)) =>
            "indirect: target_error is 0.0019; give a relRMSE from 0.002 to 0.5";
        |s| s.indirect = Some(IndirectLight::final_gather(0.501)) =>
            "indirect: target_error is 0.501";
        |s| s.indirect = Some(IndirectLight::final_gather(NAN)) => "indirect: target_error is NaN";
        |s| s.lights[0] = spot(DVec3::ZERO, 1.0, 2.0, 1.0).into() =>
            "light 0 (spot): direction is [0, 0, 0]";
        |s| s.lights[0] = spot(down * NAN, 1.0, 2.0, 1.0).into() =>
            "light 0 (spot): direction is [NaN";
        |s| s.lights[0] = spot(down, 3.0, 2.0, 1.0).into() =>
            "inner_half_angle_deg 3 is larger than outer_half_angle_deg 2";
        |s| s.lights[0] = spot(down, -1.0, 2.0, 1.0).into() => "inner_half_angle_deg is -1";
        |s| s.lights[0] = spot(down, NAN, 2.0, 1.0).into() => "inner_half_angle_deg is NaN";
        |s| s.lights[0] = spot(down, 0.0, 0.0, 1.0).into() => "outer_half_angle_deg is 0";
        |s| s.lights[0] = spot(down, 0.0, 181.0, 1.0).into() => "outer_half_angle_deg is 181";
        |s| s.lights[0] = spot(down, 1.0, 2.0, -1.0).into() => "light 0 (spot): power_w is [-1.0";
        |s| s.lights[0] = spot(down, 0.0, 1e-160, 1.0).into() =>
            "give degrees above 0 (1e-4 at least)";
        |s| s.lights[0] = spot(down, 1.0, 2.0, 1e40).into() => "up to 1e24";
        |s| s.materials[0].shininess = 1e39 => "up to 1e9";
        |s| s.meshes[0].texcoords = vec![[0.0, 1e39]; 3] => "within -1e6 and 1e6";
        |s| s.lights[0] = spot(down, 1.0, 2.0, f64::INFINITY).into() =>
            "light 0 (spot): power_w is [inf";
        |s| s.meshes[0].positions_m[1].y = NAN => "mesh 0 (\"floor\"): vertex 1 is [1, NaN, 0]";
        |s| s.meshes[0].positions_m[2].z = f64::INFINITY =>
            "mesh 0 (\"floor\"): vertex 2 is [0, 1, inf]";
        |s| s.meshes[0].to_world.translation.x = NAN => "instance 0: position is [NaN, 0, 0]";
        |s| s.meshes[0].to_world.matrix3.y_axis.z = f64::INFINITY => "instance 0: to_world is";
        |s| s.meshes[0].to_world.matrix3 *= 1e13 => "instance 0: a corner of its box is";
        |s| s.meshes[0].triangles[0][2] = 3 =>
            "mesh 0 (\"floor\"): triangle 0 has vertices [0, 1, 3] of 3";
        |s| s.meshes[0].triangle_materials[0] = 1 => "triangle 0 has material 1 of 1";
        |s| s.meshes[0].triangle_materials.clear() => "0 triangle_materials for 1 triangles";
        |s| s.meshes[0].normals = vec![DVec3::Z] => "1 normals for 3 vertices";
        |s| s.meshes[0].texcoords = vec![[0.0; 2]; 4] => "4 texcoords for 3 vertices";
        |s| s.meshes[0].normals = vec![DVec3::Z, DVec3::ZERO, DVec3::Z] =>
            "normal of vertex 1 is [0, 0, 0]";
        |s| s.meshes[0].normals = vec![DVec3::Z, DVec3::Z, DVec3::NAN] =>
            "normal of vertex 2 is [NaN, NaN, NaN]";
        |s| s.meshes[0].texcoords = vec![[0.0; 2], [0.0, NAN], [0.0; 2]] =>
            "texture coordinate of vertex 1 is [0.0, NaN]";
        |s| s.materials[0].kd[1] = -0.1 => "material 0 (\"clay\"): kd is [0.5, -0.1, 0.5]";
        |s| s.materials[0].ks[2] = 1.1 => "material 0 (\"clay\"): ks is [0.0, 0.0, 1.1]";
        |s| s.materials[0].kd[0] = NAN => "material 0 (\"clay\"): kd is [NaN";
        |s| s.materials[0].shininess = -1.0 => "material 0 (\"clay\"): shininess is -1";
        |s| s.materials[0].shininess = f64::INFINITY => "material 0 (\"clay\"): shininess is inf";
        |s| s.materials[0].microfacets = facets(0.02, 1.5) =>
            "material 0 (\"clay\"): roughness is 0.02", "0.03 to 1: a smoother surface is a mirror";
        |s| s.materials[0].microfacets = facets(NAN, 1.5) => "roughness is NaN";
        |s| s.materials[0].microfacets = facets(0.5, 0.9) => "ior is 0.9", "from 1 to 10";
        |s| (s.materials[0].microfacets, s.materials[0].ks) = (facets(0.5, 1.5), [0.1; 3]) =>
            "has microfacets and ks", "give one of them";
        |s| s.materials[0].metallic_roughness_texture = Some(1.into()) =>
            "metallic_roughness_texture is 1, but the number of textures is 1";
        |s| s.materials[0].emission_w_sr_m2[1] = -1.0 =>
            "material 0 (\"clay\"): emission_w_sr_m2 is [0.0, -1.0, 0.0]", "from 0 to 1e24";
        |s| s.materials[0].emission_w_sr_m2[0] = NAN => "emission_w_sr_m2 is [NaN";
        |s| s.materials[0].emission_w_sr_m2[2] = 1e25 => "emission_w_sr_m2 is [0.0, 0.0, 1e25]";
        |s| s.materials[0].emission_texture = Some(1.into()) =>
            "emission_texture is 1, but the number of textures is 1";
        |s| s.materials[0].normal_texture = Some(1.into()) =>
            "normal_texture is 1, but the number of textures is 1";
        |s| s.materials[0].alpha_texture = Some(1.into()) =>
            "alpha_texture is 1, but the number of textures is 1";
        |s| {
            s.materials[0].alpha_texture = Some(0.into());
            s.meshes[0].texcoords = vec![[0.0; 2]; s.meshes[0].positions_m.len()];
            s.direct.shadow = Some(Shadow::Map);
        } => "a shadow map cannot find the shadows of surfaces with cut-outs";
        |s| s.materials[0].kd_texture = Some(1.into()) =>
            "kd_texture is 1, but the number of textures is 1";
        |s| {
            s.materials[0].normal_texture = Some(0.into());
            s.textures[0].texels = Texels::U8(vec![[200; 3]], Encoding::Srgb);
        } => "the texture of normal_texture is encoded as sRGB";
        |s| s.textures[0].size_px = [2, 1] =>
            "texture 0 (\"wood\"): size_px is 2 x 1, but there are 1 texels";
        |s| {
            s.textures[0] = Texture {
                name: "wood".into(),
                size_px: [0, 0],
                texels: Texels::F32(vec![]),
            }
            .into()
        } => "texture 0 (\"wood\"): size_px is 0 x 0";
        |s| s.textures[0].texels = Texels::F32(vec![[0.5, f32::NAN, 0.5]]) =>
            "texture 0 (\"wood\"): texel 0 is [0.5, NaN, 0.5]";
    }
}
