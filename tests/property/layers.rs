//! Relations between the layers of a frame: sums, energy, background.

use crate::common::gpu::{DEMO_SCENES, Gpu, assert_is_lit, demo_scene, distort, plain_sum, radial};
use camlux::{
    Scene,
    output::{Frame, Layer},
    scene::{
        Distortion, Encoding, IndirectLight, Intrinsics, Lens, PixelFilter, PixelSampling, Sensor,
        Texels, Texture, Vignetting, VignettingMap,
    },
};

/// A demo scene whose indirect light need not be exact.
fn coarse(name: &str) -> Scene {
    let mut scene = demo_scene(name, [32, 32]);
    scene.indirect = Some(IndirectLight::final_gather(0.2));
    scene
}

fn values(frame: &Frame, layer: Layer) -> &[f32] {
    frame.values(layer).expect("the layer is there")
}

#[test]
fn radiance_is_direct_plus_indirect() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        let frame = gpu.render(&coarse(name));
        assert_is_lit(&frame, Layer::Direct);
        assert_is_lit(&frame, Layer::Indirect);
        let direct = values(&frame, Layer::Direct).iter();
        let sum: Vec<f32> = direct
            .zip(values(&frame, Layer::Indirect))
            .map(|(direct, indirect)| direct + indirect)
            .collect();
        assert!(values(&frame, Layer::Radiance) == sum, "{name}");
    }
}

#[test]
fn without_indirect_light_radiance_is_direct() {
    let mut gpu = Gpu::open();
    let mut scene = coarse("cornell");
    let direct = values(&gpu.render(&scene), Layer::Direct).to_vec();
    scene.indirect = None;
    let frame = gpu.render(&scene);
    assert!(frame.values(Layer::Indirect).is_none());
    assert_is_lit(&frame, Layer::Direct);
    // Both frames use the same plain shadow map: the 16² texels of an RSM would be too few.
    assert_eq!(values(&frame, Layer::Radiance), direct);
    assert_eq!(values(&frame, Layer::Direct), direct);
}

#[test]
fn energy_is_radiance_times_area_duty_cycle_and_exposure() {
    let mut gpu = Gpu::open();
    for indirect in [true, false] {
        let mut scene = coarse("cornell");
        scene.sensor = Some(Sensor {
            pixel_pitch_um: [7.5, 5.0],
            exposure_time_s: 3e-4,
            duty_cycle: 0.4,
            f_number: None,
            wavelength_nm: None,
            quantum_efficiency: None,
            ..Sensor::DEFAULT
        });
        if !indirect {
            scene.indirect = None;
        }
        let frame = gpu.render(&scene);
        assert_is_lit(&frame, Layer::Radiance);
        // 37.5e-12 m² · 0.4 · 3e-4 s
        let joule_per_irradiance = 4.5e-15;
        let radiances = values(&frame, Layer::Radiance).iter();
        for (&radiance, &energy) in radiances.zip(values(&frame, Layer::Energy)) {
            let expected = f64::from(radiance) * joule_per_irradiance;
            // The factor and the product are rounded to f32, each by half an ulp: 1.2e-7.
            let error = (f64::from(energy) - expected).abs();
            assert!(error <= 1.2e-7 * expected, "{energy:e} for {expected:e}");
        }
    }
}

/// Compares every pixel with the cosine from the layers depth and range.
#[test]
fn behind_an_aperture_energy_falls_by_the_fourth_power_of_the_cosine() {
    let mut gpu = Gpu::open();
    for (indirect, distortion) in [(true, false), (false, true)] {
        let mut scene = coarse("cornell");
        if distortion {
            distort(&mut scene, radial(-0.2, 0.05));
        }
        if !indirect {
            scene.indirect = None;
        }
        let plain = gpu.render(&scene);
        scene.sensor.as_mut().expect("the scene has one").f_number = Some(2.0);
        let frame = gpu.render(&scene);
        assert_is_lit(&frame, Layer::Energy);
        let same = [Layer::Radiance, Layer::Depth];
        assert!(
            same.iter()
                .all(|&layer| values(&plain, layer) == values(&frame, layer))
        );
        let (depth, range) = (values(&frame, Layer::Depth), values(&frame, Layer::Range));
        let energies = values(&frame, Layer::Energy).iter();
        let mut least: f64 = 1.0;
        for (i, (&energy, &before)) in energies.zip(values(&plain, Layer::Energy)).enumerate() {
            if before == 0.0 {
                assert_eq!(energy, 0.0);
                continue;
            }
            let cosine = f64::from(depth[i / 3]) / f64::from(range[i / 3]);
            least = least.min(cosine);
            let due = f64::from(before) * std::f64::consts::FRAC_PI_4 / 4.0 * cosine.powi(4);
            assert!(
                (f64::from(energy) / due - 1.0).abs() < 3e-6,
                "{energy} {due}"
            );
        }
        assert!(least < 0.9, "{least}");
    }
}

/// A fisheye that is black in the image's corners, and a pinhole whose principal point is off the middle. Compares every pixel with the polynomial in f64.
#[test]
fn a_measured_vignetting_takes_the_place_of_the_cosine() {
    const COEFFICIENTS: [f64; 3] = [-0.6, 0.3, -0.12];
    let mut gpu = Gpu::open();
    let off_axis = |distortion: Option<Distortion>| {
        let intrinsics = Intrinsics {
            // Of the fisheye, in pixels for each radian: its image circle ends before the farthest corner.
            fx: if distortion.is_some() { 9.0 } else { 60.0 },
            fy: if distortion.is_some() { 9.5 } else { 62.0 },
            cx: 19.25,
            cy: 27.5,
            skew: 0.0,
        };
        match distortion {
            None => Lens::Intrinsics(intrinsics),
            Some(distortion) => Lens::Distorted {
                intrinsics,
                distortion,
            },
        }
    };
    let fisheye = Some(Distortion::Fisheye([0.02, 0.0, 0.0, 0.0]));
    for (indirect, distortion, samples) in [
        (true, None, 1),
        (false, None, 1),
        (false, fisheye, 1),
        (true, fisheye, 1),
        (true, None, 3),
        (false, fisheye, 3),
    ] {
        let mut scene = coarse("cornell");
        scene.camera.lens = off_axis(distortion);
        scene.camera.resolution_px = [48, 40];
        if distortion.is_some() {
            // Inside the box, with the floor in the wide part of the image.
            (scene.camera.position_m.z, scene.camera.up.y) = (0.1, -1.0);
        }
        scene.camera.pixel_sampling = (samples > 1).then_some(PixelSampling {
            samples,
            filter: PixelFilter::Box,
        });
        if !indirect {
            scene.indirect = None;
        }
        let plain = gpu.render(&scene);
        let sensor = scene.sensor.as_mut().expect("the scene has one");
        sensor.f_number = Some(2.0);
        sensor.vignetting = Some(Vignetting(COEFFICIENTS));
        let frame = gpu.render(&scene);
        assert!(values(&plain, Layer::Radiance) == values(&frame, Layer::Radiance));
        let (mut lit, mut least) = (0, 1.0f64);
        let energies = values(&frame, Layer::Energy).iter();
        for (i, (&energy, &before)) in energies.zip(values(&plain, Layer::Energy)).enumerate() {
            let pixel = i / 3;
            let [x, y] = [pixel % 48, pixel / 48].map(|place| place as f64 + 0.5);
            let r = (x - 19.25).hypot(y - 27.5) / (0.5 * 48f64.hypot(40.0));
            let [k1, k2, k3] = COEFFICIENTS;
            let factor = 1.0 + k1 * r.powi(2) + k2 * r.powi(4) + k3 * r.powi(6);
            let due = f64::from(before) * std::f64::consts::FRAC_PI_4 / 4.0 * factor;
            // The device has f32 coefficients, and the square of r to a few ulp.
            let error = (f64::from(energy) - due).abs();
            assert!(error <= 3e-6 * due, "{energy:e} {due:e} at {x}, {y}");
            if before > 0.0 {
                (lit, least) = (lit + 1, least.min(factor));
            }
        }
        assert!(lit > 3000 && least < 0.7, "{lit} {least}");
    }
}

/// Maps finer and coarser than the image, and of its size, with steps from black to full light between two pixels. Compares every pixel with
/// the map in f64.
#[test]
fn a_vignetting_map_takes_the_place_of_the_cosine() {
    let mut gpu = Gpu::open();
    let sizes = [[48, 40], [1, 1], [7, 5], [301, 403], [4093, 3]];
    for (case, size_px) in sizes.into_iter().enumerate() {
        let mut scene = coarse("cornell");
        scene.camera.resolution_px = [48, 40];
        scene.camera.pixel_sampling = (case % 2 == 1).then_some(PixelSampling {
            samples: 3,
            filter: PixelFilter::Box,
        });
        if case > 1 {
            scene.indirect = None;
        }
        let plain = gpu.render(&scene);
        scene.sensor.as_mut().expect("the scene has one").f_number = Some(2.0);
        let [width, height] = size_px.map(|px| px as usize);
        let mut texels: Vec<f32> = (0..width * height)
            .map(|i| (i * 7919 % 1009) as f32 / 700.0)
            .collect();
        texels[0] = 1.0;
        let at = |x: f64, pixels: usize, count: usize| {
            let place = x / pixels as f64 * count as f64 - 0.5;
            let of = |index: f64| index.clamp(0.0, count as f64 - 1.0) as usize;
            (
                of(place.floor()),
                of(place.floor() + 1.0),
                place - place.floor(),
            )
        };
        let map = VignettingMap {
            size_px,
            values: texels.clone(),
        };
        scene.vignetting_map = Some(map.clone().into());
        let frame = gpu.render(&scene);
        assert!(values(&plain, Layer::Radiance) == values(&frame, Layer::Radiance));
        let mut lit = 0;
        let energies = values(&frame, Layer::Energy).iter();
        for (i, (&energy, &before)) in energies.zip(values(&plain, Layer::Energy)).enumerate() {
            let [x, y] = [i / 3 % 48, i / 3 / 48];
            let (left, right, across) = at(x as f64 + 0.5, 48, width);
            let (upper, lower, down) = at(y as f64 + 0.5, 40, height);
            let value = |x: usize, y: usize| f64::from(texels[y * width + x]);
            let row = |y| value(left, y) * (1.0 - across) + value(right, y) * across;
            let factor = row(upper) * (1.0 - down) + row(lower) * down;
            let of_model = map.at([x as u32, y as u32], [48, 40]);
            assert!((of_model - factor).abs() < 1e-11, "{of_model} {factor}");
            let unit = f64::from(before) * std::f64::consts::FRAC_PI_4 / 4.0;
            let error = (f64::from(energy) - unit * factor).abs();
            assert!(
                error <= 1e-6 * unit * factor.max(0.2),
                "{energy:e} {:e} at {x}, {y}",
                unit * factor
            );
            lit += i32::from(energy > 0.0);
        }
        assert!(lit > 2500, "{lit}");
    }
}

#[test]
fn background_is_black_and_infinitely_far() {
    let mut gpu = Gpu::open();
    let mut scene = coarse("glossy");
    // From farther away, background surrounds the scene.
    scene.camera.position_m *= 2.0;
    let frame = gpu.render(&scene);
    let ids = frame.ids(Layer::InstanceId).expect("every frame has them");
    let background: Vec<usize> = (0..ids.len()).filter(|&i| ids[i] == 0).collect();
    assert!(background.len() > 100 && background.len() < ids.len() - 100);
    let materials = frame.ids(Layer::MaterialId).expect("every frame has them");
    for &pixel in &background {
        assert_eq!(materials[pixel], 0);
        for layer in [
            Layer::Radiance,
            Layer::Direct,
            Layer::Indirect,
            Layer::Position,
            Layer::Normal,
        ] {
            assert_eq!(
                values(&frame, layer)[3 * pixel..][..3],
                [0.0; 3],
                "{layer:?}"
            );
        }
        for layer in [Layer::Depth, Layer::Range] {
            assert_eq!(values(&frame, layer)[pixel], f32::INFINITY, "{layer:?}");
        }
    }
    let surfaces = (0..ids.len()).filter(|&i| ids[i] != 0);
    for pixel in surfaces {
        let (depth_m, range_m) = (
            values(&frame, Layer::Depth)[pixel],
            values(&frame, Layer::Range)[pixel],
        );
        assert!(0.0 < depth_m && depth_m <= range_m && range_m < 20.0);
        assert!(materials[pixel] > 0);
    }
}

/// A texture of one colour acts as that colour, at each precision and in each encoding.
#[test]
fn an_even_texture_is_a_factor() {
    let mut gpu = Gpu::open();
    let scene = plain_sum(demo_scene("textured", [32, 32]), 32);
    // One sRGB value is on the linear part.
    let in_8_bits = [188, 9, 255];
    let in_16_bits = [40_000, 2_000, 65_535];
    for texels in [
        Texels::F32(vec![[0.5, 0.25, 1.0]; 6]),
        Texels::U8(vec![in_8_bits; 6], Encoding::Srgb),
        Texels::U8(vec![in_8_bits; 6], Encoding::Linear),
        Texels::U16(vec![in_16_bits; 6], Encoding::Srgb),
        Texels::U16(vec![in_16_bits; 6], Encoding::Linear),
    ] {
        let factors = texels.reflectance(0).map(f64::from);
        let (mut textured, mut plain) = (scene.clone(), scene.clone());
        for texture in &mut textured.textures {
            *texture = Texture {
                size_px: [3, 2],
                texels: texels.clone(),
                ..Texture::clone(texture)
            }
            .into();
        }
        for material in &mut plain.materials {
            if material.kd_texture.take().is_some() {
                material.kd = std::array::from_fn(|band| material.kd[band] * factors[band]);
            }
        }
        let [textured, plain] = [&textured, &plain].map(|scene| gpu.render(scene));
        assert_is_lit(&plain, Layer::Radiance);
        let radiances = values(&textured, Layer::Radiance).iter();
        for (textured, plain) in radiances.zip(values(&plain, Layer::Radiance)) {
            // Decoding, and the rounding of two products: measured up to 1.25e-6, on SwiftShader.
            assert!(
                (textured - plain).abs() <= 1.5e-6 * plain,
                "{texels:?}: {textured} {plain}"
            );
        }
    }
}
