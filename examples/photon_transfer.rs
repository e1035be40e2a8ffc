//! Plots the photon transfer curve of a sensor: the variance of its digital numbers against their mean, from pairs of frames of an evenly
//! lit wall, as EMVA 1288 measures it. The slope is the gain.
//!
//!     cargo run --release --example photon_transfer -- photon_transfer.svg

use std::error::Error;

use camlux::glam::DVec3;
use camlux::output::Layer;
use camlux::scene::{Camera, Direct, Lens, Light, Material, Mesh, Sensor, SensorNoise};
use camlux::{Device, DeviceOptions, RenderOptions, Renderer, Scene};
use plotters::prelude::*;

const NOISE: SensorNoise = SensorNoise {
    full_well_e: 10_500.0,
    dark_e_per_s: 5.0,
    read_noise_e: 2.4,
    gain_dn_per_e: 0.37,
    black_level_dn: 64.0,
    bits: 12,
    ..SensorNoise::DEFAULT
};

/// A wall that fills the view, under parallel light.
fn wall(exposure_time_s: f64) -> Scene {
    let corners = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]].map(|[x, y]| [x, y, 0.0]);
    Scene {
        camera: Camera {
            resolution_px: [100, 100],
            position_m: DVec3::new(0.0, 0.0, 2.0),
            look_at_m: DVec3::ZERO,
            up: DVec3::Y,
            lens: Lens::FovY { fov_y_deg: 20.0 },
            pixel_sampling: None,
        },
        sensor: Some(Sensor {
            pixel_pitch_um: [3.45, 3.45],
            exposure_time_s,
            wavelength_nm: Some(550.0),
            quantum_efficiency: Some(0.6),
            band_weights: [0.0, 1.0, 0.0],
            monochrome: true,
            noise: Some(NOISE),
            ..Sensor::DEFAULT
        }),
        tof: None,
        lights: vec![Light::directional(DVec3::NEG_Z, [1.0; 3]).into()],
        meshes: vec![Mesh::from_slices("wall", &corners, &[[0, 1, 2], [0, 2, 3]], 0).into()],
        materials: vec![Material::lambert("grey", [0.5; 3])],
        textures: Vec::new(),
        direct: Direct::default(),
        indirect: None,
        vignetting_map: None,
        left_out: Vec::new(),
    }
}

/// Mean and variance of two frames of the same wall. Half of their difference's variance has no fixed pattern.
fn mean_and_variance(
    renderer: &mut Renderer,
    scene: &Scene,
    first_index: u32,
) -> camlux::Result<(f64, f64)> {
    let mut frame = |index| {
        let mut options = RenderOptions {
            frame_index: Some(index),
            ..RenderOptions::default()
        };
        let frame = renderer.render(scene, &mut options)?;
        let numbers = frame.values(Layer::RawDigitalNumber).unwrap_or_default();
        Ok::<Vec<f64>, camlux::Error>(numbers.iter().map(|&dn| f64::from(dn)).collect())
    };
    let (first, second) = (frame(first_index)?, frame(first_index + 1)?);
    let n = first.len() as f64;
    let mean = (first.iter().sum::<f64>() + second.iter().sum::<f64>()) / (2.0 * n);
    let pairs = first.iter().zip(&second);
    let squares: f64 = pairs.map(|(a, b)| 0.5 * (a - b).powi(2)).sum();
    Ok((mean, squares / n))
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args()
        .nth(1)
        .ok_or("give the SVG file to write")?;
    let device = Device::open(&DeviceOptions::default())?;
    let mut renderer = Renderer::new(&device)?;
    let mut points = Vec::new();
    for step in 1..=60_u32 {
        points.push(mean_and_variance(
            &mut renderer,
            &wall(6e-5 * f64::from(step)),
            2 * step,
        )?);
    }
    let dark = NOISE.gain_dn_per_e.powi(2) * NOISE.read_noise_e.powi(2) + 1.0 / 12.0;
    let line = |mean: f64| {
        (
            mean,
            NOISE.gain_dn_per_e * (mean - NOISE.black_level_dn) + dark,
        )
    };
    let full_dn = NOISE.black_level_dn + NOISE.gain_dn_per_e * NOISE.full_well_e;

    let page = SVGBackend::new(&path, (640, 400)).into_drawing_area();
    page.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&page)
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(56)
        .build_cartesian_2d(0.0..1.05 * full_dn, 0.0..1.1 * line(full_dn).1)?;
    chart
        .configure_mesh()
        .x_desc("mean, DN")
        .y_desc("variance, DN²")
        .light_line_style(WHITE)
        .draw()?;
    let ends = [line(NOISE.black_level_dn), line(full_dn)];
    chart.draw_series([PathElement::new(ends, BLUE)])?;
    chart.draw_series(
        points
            .iter()
            .map(|&point| Circle::new(point, 3, BLACK.filled())),
    )?;
    page.present()?;
    Ok(())
}
