//! Modulated light: phases that wrap or cancel, paths of many wavelengths, pixels without direct light, and too much light.

use glam::{DVec3, dvec3};

use super::{
    Case, Examiner,
    examiner::{DIRECT_BOUND, TARGET_ERROR, TARGET_SLACK, values},
    scenes::{
        GREY, lit_by, moved, point_light, quad, room, scene_of, two_walls, with_rays, with_tof,
    },
};
use crate::{
    RenderOptions, Result, Scene,
    model::{Phasor, SPEED_OF_LIGHT_M_S, range_m, unambiguous_range_m, wrap_count},
    output::{Frame, Layer, TofQuantity},
    scene::{FinalGather, IndirectLight, SensorNoise},
};

pub const CASES: &[Case] = &[
    Case::new(
        "range_just_below_and_above_its_period",
        "half a path of c/(2f) has the same phase as a path of length 0",
        "the phase is reduced in turns, and wraps are counted",
        period,
    ),
    Case::new(
        "two_lights_in_antiphase",
        "phasors cancel, and a relative error has nothing to be relative to",
        "errors of Z are relative to at least 1 % of the light",
        antiphase,
    ),
    Case::new(
        "pixels_that_see_the_bounce_alone",
        "a multipath error without direct light is 0/0",
        "the range is that of the bounce; there is no multipath error",
        bounce_alone,
    ),
    Case::new(
        "saturated_taps",
        "both taps are full: the phase of their difference is noise",
        "the taps hold a full well, and there is no range",
        saturated,
    ),
    Case::new(
        "modulated_light_50_km_away",
        "f32 keeps a length of 50 km to 4 mm",
        "path lengths are relative to the path by way of the scene's centre; the rest is in f64",
        far_light,
    ),
    Case::new(
        "ten_kilometres_at_100_mhz",
        "the scene is 3 000 waves wide: sines of large angles, a phase that turns from pixel to pixel, a bounce whose light cancels",
        "phases are turns relative to the scene's centre; where the target is out of reach, the estimate says so",
        many_waves,
    ),
];

fn layer(frame: &Frame, quantity: TofQuantity) -> &[f32] {
    values(frame, Layer::Tof(0, quantity))
}

fn phasors(frame: &Frame, quantity: TofQuantity) -> Vec<Phasor> {
    let (pixels, _) = layer(frame, quantity).as_chunks::<2>();
    let phasor = |&[re, im]: &[f32; 2]| Phasor {
        re: re.into(),
        im: im.into(),
    };
    pixels.iter().map(phasor).collect()
}

/// A wall across the view, with the light at the camera.
fn wall(distance_m: f64) -> Scene {
    let corner = dvec3(-1.0, -1.0, 0.0);
    let wall = quad("wall", corner, 2.0 * DVec3::X, 2.0 * DVec3::Y, GREY);
    let camera_m = distance_m * DVec3::Z;
    let mut scene = scene_of(vec![wall], point_light(camera_m), camera_m, DVec3::ZERO);
    scene.camera.resolution_px = [1, 1];
    scene
}

fn period(exam: &mut Examiner) -> Result<()> {
    for frequency_hz in [1e6, 20e6, 200e6] {
        let period_m = unambiguous_range_m(frequency_hz);
        for (what, away_m) in [("2 mm below", -2e-3), ("2 mm above", 2e-3)] {
            let distance_m = period_m + away_m;
            let frame = exam.render(&with_tof(wall(distance_m), &[frequency_hz]))?;
            let range_m = f64::from(layer(&frame, TofQuantity::Range)[0]);
            let wraps = frame.ids(Layer::Tof(0, TofQuantity::Wraps));
            let wraps = wraps.and_then(|ids| ids.first()).copied();
            let due = wrap_count(distance_m, frequency_hz);
            let what = format!("{} MHz, {what}", frequency_hz * 1e-6);
            let off_m = (range_m - (distance_m - f64::from(due) * period_m)).abs();
            // The positions of light and wall are rounded to 6e-8 of the scene's size.
            exam.record(&what, "range, m", off_m, 1e-7 * distance_m + 1e-5);
            let is_wrong = f64::from(u8::from(wraps != Some(due)));
            exam.record(&what, "wrong count of wraps", is_wrong, 0.0);
        }
    }
    Ok(())
}

/// Two lights half a wavelength behind each other, so far away that they cancel in the whole scene.
fn antiphase(exam: &mut Examiner) -> Result<()> {
    let frequency_hz = 50e6;
    let half_wave_m = 0.5 * SPEED_OF_LIGHT_M_S / frequency_hz;
    let light = |distance_m: f64| {
        let light = point_light(distance_m * dvec3(0.6, 0.64, 0.48));
        light.with_emission([distance_m * distance_m * 10.0; 3])
    };
    let lights = vec![light(1e5), light(1e5 + half_wave_m)];
    let camera_m = dvec3(1.6, 1.3, 0.9);
    let two_walls = two_walls(lights[0].clone(), camera_m, dvec3(0.2, 0.4, 0.0));
    let scene = with_tof(lit_by(&two_walls, lights), &[frequency_hz]);
    let frame = exam.render(&scene)?;
    let radiance = values(&frame, Layer::Direct);
    let (radiance, _) = radiance.as_chunks::<3>();
    let lit = radiance.iter().map(|&[r, ..]| f64::from(r).powi(2));
    let lit = lit.sum::<f64>().sqrt();
    let direct = phasors(&frame, TofQuantity::PhasorDirect);
    let left = direct.iter().map(|z| z.magnitude().powi(2)).sum::<f64>();
    // Their distances have 24 bits from the scene's centre on. Their irradiances differ by the ratio of the scene's size to 50 km.
    exam.record("", "Z over direct light", left.sqrt() / lit, 1e-4);
    let truth = exam.sampled_enough(&scene)?;
    let scene = with_rays(&scene, TARGET_ERROR);
    exam.bounce_against(&truth, "light", &scene, TARGET_ERROR)?;
    let frame = exam.render(&scene)?;
    let bound = TARGET_SLACK * TARGET_ERROR;
    exam.record("Z", "final-gather", phasor_error(&frame, &truth), bound);
    Ok(())
}

/// relRMSE of Z of the bounce, without the reference's noise and without edges, relative to at least 1 % of the light.
fn phasor_error(frame: &Frame, truth: &Frame) -> f64 {
    let edges = truth.ids(Layer::Edge).unwrap_or_default();
    let found = phasors(frame, TofQuantity::PhasorIndirect);
    let due = phasors(truth, TofQuantity::PhasorIndirect);
    let noise = phasors(truth, TofQuantity::PhasorStandardError);
    let (light, _) = values(truth, Layer::Indirect).as_chunks::<3>();
    let (mut off, mut all, mut least) = (0.0, 0.0, 0.0);
    for i in (0..found.len()).filter(|&i| edges.get(i) == Some(&0)) {
        let variance = noise[i].magnitude().powi(2);
        off += (found[i] + due[i] * -1.0).magnitude().powi(2) - variance;
        all += due[i].magnitude().powi(2) - variance;
        least += (0.01 * f64::from(light[i][0])).powi(2);
    }
    (off.max(0.0) / f64::max(all, least)).sqrt()
}

fn bounce_alone(exam: &mut Examiner) -> Result<()> {
    let scene = with_tof(with_rays(&room(), 0.1), &[20e6]);
    let frame = exam.render(&scene)?;
    let (direct, _) = values(&frame, Layer::Direct).as_chunks::<3>();
    let (indirect, _) = values(&frame, Layer::Indirect).as_chunks::<3>();
    let half_paths = values(&frame, Layer::HalfPath);
    let [range, mpi, amplitude] = [
        TofQuantity::Range,
        TofQuantity::MultipathError,
        TofQuantity::Amplitude,
    ]
    .map(|quantity| layer(&frame, quantity));
    let in_shadow = |i: &usize| direct[*i][0] == 0.0 && indirect[*i][0] > 0.0;
    let shadow: Vec<usize> = (0..direct.len()).filter(in_shadow).collect();
    let is_wrong = |&&i: &&usize| {
        // Light over some Q comes from farther away than half of the straight path.
        let has_range = range[i] > half_paths[i] && f64::from(range[i]) < unambiguous_range_m(20e6);
        !(has_range && mpi[i].is_nan() && amplitude[i] > 0.0)
    };
    let wrong = shadow.iter().filter(is_wrong).count();
    exam.record("in shadow", "wrong pixels", wrong as f64, 0.0);
    let none = f64::from(u8::from(shadow.len() < 20));
    exam.record("in shadow", "too few pixels", none, 0.0);
    Ok(())
}

fn saturated(exam: &mut Examiner) -> Result<()> {
    const FULL_WELL_E: f32 = 1e4;
    let mut scene = with_tof(room(), &[20e6]);
    scene.lights = vec![scene.lights[0].with_emission([1e6; 3]).into()];
    if let Some(tof) = &mut scene.tof {
        tof.noise = Some(SensorNoise {
            seed: 1,
            dark_e_per_s: 0.0,
            read_noise_e: 0.0,
            full_well_e: FULL_WELL_E.into(),
            gain_dn_per_e: 0.1,
            black_level_dn: 0.0,
            bits: 12,
            ..SensorNoise::DEFAULT
        });
    }
    let frame = exam.render(&scene)?;
    let (lit, _) = values(&frame, Layer::Direct).as_chunks::<3>();
    let (taps, _) = layer(&frame, TofQuantity::Taps(0)).as_chunks::<2>();
    let [amplitude, range] =
        [TofQuantity::Amplitude, TofQuantity::Range].map(|quantity| layer(&frame, quantity));
    let is_wrong = |&i: &usize| {
        let is_full = taps[i] == [FULL_WELL_E; 2] && amplitude[i] == 0.0 && range[i].is_nan();
        lit[i][0] > 0.0 && !is_full
    };
    let wrong = (0..lit.len()).filter(is_wrong).count();
    exam.record("lit", "wrong pixels", wrong as f64, 0.0);
    Ok(())
}

/// The largest difference between the range of direct light and half its path, modulo c/(2f); infinite if nothing is lit.
fn worst_range_m(frame: &Frame, frequency_hz: f64) -> f64 {
    let half_paths = values(frame, Layer::HalfPath);
    let direct = phasors(frame, TofQuantity::PhasorDirect);
    let period_m = unambiguous_range_m(frequency_hz);
    let off = direct.iter().zip(half_paths).filter_map(|(z, &half_m)| {
        let off_m = range_m(*z, frequency_hz)? - f64::from(half_m);
        let off_m = off_m.rem_euclid(period_m);
        Some(off_m.min(period_m - off_m))
    });
    off.reduce(f64::max).unwrap_or(f64::INFINITY)
}

fn far_light(exam: &mut Examiner) -> Result<()> {
    let frequency_hz = 100e6;
    let light = point_light(dvec3(3e4, 4e4, 1e3)).with_emission([1e9; 3]);
    let two_walls = two_walls(light, dvec3(1.6, 1.3, 0.9), dvec3(0.2, 0.4, 0.0));
    let scene = with_tof(two_walls, &[frequency_hz]);
    let frame = exam.render(&scene)?;
    // Half a path of 25 km has steps of 2 mm in f32.
    let worst_m = worst_range_m(&frame, frequency_hz);
    exam.record("", "range, m", worst_m, 2e-3);
    let z = Layer::Tof(0, TofQuantity::PhasorDirect);
    let truth = exam.unsampled(&scene)?;
    // At 100 MHz the phase turns by 4 rad/m; positions are rounded to 6e-8 m.
    let error = exam.error_against(&truth, &scene, z)?;
    exam.record("", "direct Z", error, DIRECT_BOUND);
    Ok(())
}

fn many_waves(exam: &mut Examiner) -> Result<()> {
    let frequency_hz = 100e6;
    let light = point_light(dvec3(0.7, 1.1, 0.4)).with_emission([1e9; 3]);
    let two_walls = two_walls(light, dvec3(1.6, 1.3, 0.9), dvec3(0.2, 0.4, 0.0));
    let mut scene = with_tof(moved(&two_walls, 5e3, DVec3::ZERO), &[frequency_hz]);
    let worst_m = worst_range_m(&exam.render(&scene)?, frequency_hz);
    // Positions are rounded to 6e-8 of the scene's size, both in the frame and in the layer that it is compared with.
    exam.record("", "range, m", worst_m, 2e-3);
    scene.indirect = Some(IndirectLight::FinalGather(FinalGather {
        max_rays: Some(2_000_000),
        ..FinalGather::new(TARGET_ERROR)
    }));
    let truth = exam.sampled_enough(&scene)?;
    for seed in 0..4 {
        let mut options = RenderOptions {
            seed,
            ..RenderOptions::default()
        };
        let frame = exam.renderer.render(&scene, &mut options)?;
        let stated = frame.stats.estimated_error_upper.unwrap_or(0.0);
        let error = phasor_error(&frame, &truth) / stated;
        let what = format!("Z of the bounce, seed {seed}");
        exam.record(&what, "true error over its bound", error, 1.1);
    }
    Ok(())
}
