//! What a sensor counts, against the energy of its pixels.

use crate::common::gpu::{Gpu, assert_is_lit, demo_scene};
use camlux::{
    Scene,
    output::{Frame, Layer},
    scene::{BayerPattern, Sensor, SensorNoise},
};

/// η·λ/(h·c), electrons of a joule, with the constants of CODATA 2018.
const PER_JOULE: f64 = 0.6 * 550e-9 / (6.626_070_15e-34 * 299_792_458.0);
const WEIGHTS: [f64; 3] = [0.5, 1.0, 0.25];
const NOISE: SensorNoise = SensorNoise {
    full_well_e: 1e9,
    dark_e_per_s: 20_000.0,
    read_noise_e: 4.0,
    gain_dn_per_e: 0.5,
    black_level_dn: 100.0,
    bits: 24,
    ..SensorNoise::DEFAULT
};
const EXPOSURE_S: f64 = 1e-3;

fn scene(change: impl Fn(&mut Sensor)) -> Scene {
    let mut scene = demo_scene("cornell", [40, 30]);
    scene.indirect = None;
    let mut sensor = Sensor {
        pixel_pitch_um: [5.0, 5.0],
        exposure_time_s: EXPOSURE_S,
        wavelength_nm: Some(550.0),
        quantum_efficiency: Some(0.6),
        band_weights: WEIGHTS,
        ..Sensor::DEFAULT
    };
    change(&mut sensor);
    scene.sensor = Some(sensor);
    scene
}

fn values(frame: &Frame, layer: Layer) -> Vec<f64> {
    let values = frame.values(layer).expect("the layer is there");
    values.iter().map(|&value| value.into()).collect()
}

/// Electrons that light frees on average, of each pixel and band.
fn expected(frame: &Frame) -> Vec<[f64; 3]> {
    let energies = values(frame, Layer::Energy);
    let (energies, _) = energies.as_chunks::<3>();
    let of_pixel = |energy: &[f64; 3]| [0, 1, 2].map(|b| WEIGHTS[b] * PER_JOULE * energy[b]);
    energies.iter().map(of_pixel).collect()
}

#[track_caller]
fn assert_close(found: &[f64], due: &[f64]) {
    assert_eq!(found.len(), due.len());
    for (found, due) in found.iter().zip(due) {
        // The result is rounded to f32.
        assert!((found - due).abs() <= 6e-8 * due, "{found} for {due}");
    }
}

#[test]
fn each_pixel_counts_the_band_of_its_filter() {
    let mut gpu = Gpu::open();
    for (pattern, rows) in [
        (BayerPattern::Rggb, [[0, 1], [1, 2]]),
        (BayerPattern::Grbg, [[1, 0], [2, 1]]),
        (BayerPattern::Gbrg, [[1, 2], [0, 1]]),
        (BayerPattern::Bggr, [[2, 1], [1, 0]]),
    ] {
        let frame = gpu.render(&scene(|sensor| sensor.bayer = Some(pattern)));
        assert_is_lit(&frame, Layer::RawElectrons);
        let pixels = expected(&frame).into_iter().enumerate();
        let due = pixels.map(|(i, bands)| bands[rows[i / 40 % 2][i % 40 % 2]]);
        assert_close(&values(&frame, Layer::RawElectrons), &Vec::from_iter(due));
        for layer in [
            Layer::Electrons,
            Layer::DigitalNumber,
            Layer::RawDigitalNumber,
        ] {
            assert!(frame.values(layer).is_none(), "{}", layer.name());
        }
    }
}

#[test]
fn a_monochrome_pixel_counts_all_bands() {
    let frame = Gpu::open().render(&scene(|sensor| sensor.monochrome = true));
    let due = expected(&frame).into_iter().map(|bands| bands.iter().sum());
    assert_close(&values(&frame, Layer::RawElectrons), &Vec::from_iter(due));
}

#[test]
fn a_sensor_that_counts_nothing_has_no_such_layers() {
    let frame = Gpu::open().render(&scene(|_| {}));
    assert!(frame.values(Layer::Energy).is_some());
    for layer in [
        Layer::Electrons,
        Layer::DigitalNumber,
        Layer::RawElectrons,
        Layer::RawDigitalNumber,
    ] {
        assert!(frame.values(layer).is_none(), "{}", layer.name());
    }
}

/// Over all pixels and bands of a frame, what readings deviate from their mean, divided by their standard deviation, has mean 0 and
/// variance 1, within three standard errors.
#[test]
fn readings_scatter_as_emva_1288_says() {
    let mut gpu = Gpu::open();
    for is_raw in [false, true] {
        let scene = scene(|sensor| {
            sensor.noise = Some(NOISE);
            sensor.bayer = is_raw.then_some(BayerPattern::Rggb);
        });
        let frame = gpu.render(&scene);
        let (of_electrons, of_numbers) = match is_raw {
            false => (Layer::Electrons, Layer::DigitalNumber),
            true => (Layer::RawElectrons, Layer::RawDigitalNumber),
        };
        let due: Vec<f64> = match is_raw {
            false => expected(&frame).into_flattened(),
            true => {
                let pixels = expected(&frame).into_iter().enumerate();
                let band = |i: usize| [[0, 1], [1, 2]][i / 40 % 2][i % 2];
                pixels.map(|(i, bands)| bands[band(i)]).collect()
            }
        };
        let dark = NOISE.dark_e_per_s * EXPOSURE_S;
        let scaled = values(&frame, of_electrons).into_iter().zip(&due);
        let scaled = scaled.map(|(read, due)| {
            let variance = due + dark + NOISE.read_noise_e.powi(2);
            (read - due - dark) / variance.sqrt()
        });
        let scaled: Vec<f64> = scaled.collect();
        let n = scaled.len() as f64;
        let mean = scaled.iter().sum::<f64>() / n;
        let variance = scaled.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        println!("{n} readings: mean {mean:+.4}, variance {variance:.4}");
        assert!(mean.abs() < 3.0 / n.sqrt(), "{mean}");
        assert!(
            (variance - 1.0).abs() < 3.0 * (2.0 / n).sqrt(),
            "{variance}"
        );
        let numbers = values(&frame, of_numbers);
        for (number, electrons) in numbers.iter().zip(values(&frame, of_electrons)) {
            let exact = NOISE.black_level_dn + NOISE.gain_dn_per_e * electrons;
            assert!((number - exact.max(0.0)).abs() <= 0.5 + 1e-6 * exact.abs());
            assert_eq!(number.fract(), 0.0);
        }
    }
}

#[test]
fn a_layer_asked_for_alone_is_the_same() {
    let mut gpu = Gpu::open();
    let scene = scene(|sensor| sensor.noise = Some(NOISE));
    let whole = gpu.render(&scene);
    let layers = [Layer::DigitalNumber];
    let mut render = |frame_index| {
        gpu.render_with(&scene, |options| {
            options.layers = Some(&layers);
            options.frame_index = Some(frame_index);
        })
    };
    let alone = render(whole.description.key.index);
    assert_eq!(alone.layers.len(), 1);
    let same =
        |a: &Frame, b: &Frame| a.values(Layer::DigitalNumber) == b.values(Layer::DigitalNumber);
    assert!(same(&alone, &whole));
    let next = render(whole.description.key.index + 1);
    assert!(!same(&next, &whole), "two frames have the same noise");
}
