//! The plots of a scene: turns its entries into points.

use super::plot::{Plot, Point, metres_text, number_text, percent_text, seconds_text};
use super::results::{Entry, Kind, SceneReport};
use crate::Failure;

const FRAME_TIME: &str = "time of a frame, from the call to the file";

/// Time against the error relative to the reference; SVG. `None` if no entry has such an error.
///
/// # Errors
/// If the SVG cannot be put together.
pub fn model_error(scene: &SceneReport) -> Result<Option<String>, Failure> {
    let points = scene.entries.iter().filter_map(|entry| {
        let error = entry.indirect?;
        Some(Point {
            is_upper_bound: error.is_upper_bound,
            own_estimate: entry.engine.as_ref().and_then(|e| e.estimated_error),
            is_on_front: [entry.is_on_engine_front, entry.is_on_front],
            ..point(entry, error.relative_rmse)
        })
    });
    let plot = Plot {
        x_title: FRAME_TIME,
        x_text: seconds_text,
        y_title: "relRMSE of the indirect light, noise subtracted",
        y_text: percent_text,
        series: series_names(scene),
        points: points.collect(),
        floor: scene.reference.noise_floor,
    };
    plot.into_svg()
}

/// Time against the rounding error of the engine's kernels; SVG. `None` if no entry has such an error.
///
/// # Errors
/// If the SVG cannot be put together.
pub fn kernel_error(scene: &SceneReport) -> Result<Option<String>, Failure> {
    let entries = scene.entries.iter();
    let points =
        entries.filter_map(|entry| Some(point(entry, entry.engine.as_ref()?.kernel_error?)));
    let plot = Plot {
        x_title: FRAME_TIME,
        x_text: seconds_text,
        y_title: "relRMSE against the same formulas in f64",
        y_text: number_text,
        series: series_names(scene),
        points: points.collect(),
        floor: None,
    };
    plot.into_svg()
}

/// Time against the range error of a modulation frequency; SVG. `None` if no entry has such an error.
///
/// # Errors
/// If the SVG cannot be put together.
pub fn range_error(scene: &SceneReport, frequency: usize) -> Result<Option<String>, Failure> {
    let points = scene.entries.iter().filter_map(|entry| {
        let error = entry.time_of_flight.get(frequency)?;
        Some(point(entry, error.range_median_m?))
    });
    let plot = Plot {
        x_title: FRAME_TIME,
        x_text: seconds_text,
        y_title: "median error of the range",
        y_text: metres_text,
        series: series_names(scene),
        points: points.collect(),
        floor: scene.reference.range_noise_m.get(frequency).copied(),
    };
    plot.into_svg()
}

fn point(entry: &Entry, y: f64) -> Point<'_> {
    Point {
        series: &entry.series,
        x: entry.seconds.median,
        x_range: [entry.seconds.min, entry.seconds.max],
        y,
        is_upper_bound: false,
        own_estimate: None,
        is_on_front: [false; 2],
        label: &entry.label,
    }
}

/// The names of the scene's series, in order. The order gives each series its colour in both plots.
pub fn series_names(scene: &SceneReport) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for entry in &scene.entries {
        if !names.contains(&entry.series.as_str()) {
            names.push(&entry.series);
        }
    }
    names
}

/// Marks the entries on the Pareto fronts of time and indirect error: one front of the engine's settings, and one of all entries. An upper
/// bound counts as if it were the error, to its disadvantage.
pub fn mark_fronts(entries: &mut [Entry]) {
    let front = |entries: &[Entry], is_in: fn(&Entry) -> bool| {
        let point = |entry: &Entry| match entry.indirect.filter(|_| is_in(entry)) {
            Some(error) => (entry.seconds.median, error.relative_rmse),
            None => (f64::NAN, f64::NAN),
        };
        super::pareto::front(&entries.iter().map(point).collect::<Vec<_>>())
    };
    for index in front(entries, |entry| entry.kind == Kind::Engine) {
        entries[index].is_on_engine_front = true;
    }
    for index in front(entries, |_| true) {
        entries[index].is_on_front = true;
    }
}
