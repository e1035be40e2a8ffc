//! Measures how the time of final gathering grows with the numbers of triangles and pixels.

use camlux::Scene;
use camlux::scene::{FinalGather, IndirectLight};
use serde::{Deserialize, Serialize};

use super::Subject;
use super::html::{Column, table};
use super::measured::Measured;
use super::plot::{Plot, Point, seconds_text};
use super::stopwatch::{Seconds, Stopwatch};
use crate::Failure;
use crate::numbers::{count, duration, percent};

/// The target error.
const TARGET_ERROR: f64 = 0.02;
/// Edges of the images, relative to those of the scene.
const SCALES: [f64; 4] = [0.25, 0.5, 1.0, 2.0];

/// One timed frame of a scene.
#[derive(Serialize, Deserialize)]
pub struct GrowthRow {
    scene: String,
    triangles: usize,
    resolution_px: [u32; 2],
    seconds: Seconds,
    ray_count: u64,
    estimated_error: Option<f64>,
}

/// Renders a scene in each size.
///
/// # Errors
/// Errors of rendering and writing.
pub fn rows(
    subject: &Subject,
    stopwatch: &mut Stopwatch,
    measured: &Measured,
) -> Result<Vec<GrowthRow>, Failure> {
    let Subject { name, scene, .. } = subject;
    let measured = measured.group("growth", (name, scene.hash(), TARGET_ERROR));
    let in_scene = scene.indirect.as_ref().and_then(IndirectLight::gather);
    let gather = FinalGather {
        bounces: in_scene.map_or(1, |gather| gather.bounces),
        ..FinalGather::new(TARGET_ERROR)
    };
    let row = |scale: f64| {
        let size_px = scene.camera.resolution_px;
        let resolution_px = size_px.map(|px| ((f64::from(px) * scale).round() as u32).max(1));
        let [width, height] = resolution_px;
        let what = format!("{name} {width}x{height}");
        measured.obtain(&what, (), || {
            stopwatch.steps.begin(format!("growth: {what}"))?;
            let scene = Scene {
                camera: scene.camera.resized(resolution_px),
                indirect: Some(IndirectLight::FinalGather(gather)),
                ..scene.clone()
            };
            // The warm-up.
            stopwatch.render(&scene)?;
            let timed = stopwatch.time(&scene)?;
            Ok(GrowthRow {
                scene: name.clone(),
                triangles: scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum(),
                resolution_px,
                seconds: timed.seconds,
                ray_count: timed.frame.stats.ray_count,
                estimated_error: timed.frame.stats.estimated_error,
            })
        })
    };
    SCALES.into_iter().map(row).collect()
}

impl GrowthRow {
    fn size(&self) -> String {
        let [width, height] = self.resolution_px;
        format!("{width} × {height}")
    }

    fn pixels(&self) -> u32 {
        self.resolution_px.iter().product()
    }
}

/// Plots time against triangles, one series for each size; SVG. `None` if there is nothing to draw.
///
/// # Errors
/// If the SVG cannot be put together.
pub fn against_triangles(rows: &[GrowthRow]) -> Result<Option<String>, Failure> {
    let x = |row: &GrowthRow| row.triangles as f64;
    plot("triangles", rows, x, GrowthRow::size)
}

/// Plots time against pixels, one series for each scene.
///
/// # Errors
/// If the SVG cannot be put together.
pub fn against_pixels(rows: &[GrowthRow]) -> Result<Option<String>, Failure> {
    let x = |row: &GrowthRow| f64::from(row.pixels());
    plot("pixels", rows, x, |row| row.scene.clone())
}

fn plot(
    x_title: &str,
    rows: &[GrowthRow],
    x: impl Fn(&GrowthRow) -> f64,
    series: impl Fn(&GrowthRow) -> String,
) -> Result<Option<String>, Failure> {
    let of_rows: Vec<String> = rows.iter().map(series).collect();
    let mut names: Vec<&str> = Vec::new();
    for name in &of_rows {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let labels: Vec<String> = rows
        .iter()
        .map(|row| duration(row.seconds.median))
        .collect();
    let points = rows.iter().zip(&of_rows).zip(&labels);
    let points = points.map(|((row, series), label)| Point {
        series,
        x: x(row),
        x_range: [x(row); 2],
        y: row.seconds.median,
        is_upper_bound: false,
        own_estimate: None,
        is_on_front: [false; 2],
        label,
    });
    let plot = Plot {
        x_title,
        x_text: count,
        y_title: "time of a frame, from the call to the file",
        y_text: seconds_text,
        series: names,
        points: points.collect(),
        floor: None,
    };
    plot.into_svg()
}

/// Empty unless growth was requested.
///
/// # Errors
/// If a plot cannot be drawn.
pub fn section(rows: &[GrowthRow]) -> Result<String, Failure> {
    if rows.is_empty() {
        return Ok(String::new());
    }
    Ok(format!(
        "<section>\n<h2>Growth</h2>\n<p>final-gather at a target error of {}.</p>\n\
        <figure>{}<figcaption>Time against triangles.</figcaption></figure>\n\
        <figure>{}<figcaption>Time against pixels.</figcaption></figure>\n{}</section>\n",
        percent(TARGET_ERROR),
        against_triangles(rows)?.unwrap_or_default(),
        against_pixels(rows)?.unwrap_or_default(),
        table(&COLUMNS, rows),
    ))
}

const COLUMNS: [Column<GrowthRow>; 6] = [
    ("scene", |row| Some(row.scene.clone())),
    ("triangles", |row| Some(row.triangles.to_string())),
    ("pixels", |row| Some(row.size())),
    ("time", |row| Some(duration(row.seconds.median))),
    ("rays", |row| Some(count(row.ray_count as f64))),
    ("the engine's estimate", |row| {
        row.estimated_error.map(percent)
    }),
];
