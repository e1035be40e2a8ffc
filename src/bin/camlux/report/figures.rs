//! The two plots of a scene: from its entries to points and fronts.

use super::axis::Unit;
use super::plot::{Front, Plot, Point, Series};
use super::results::{Entry, Kind, SceneReport};
use crate::Failure;

/// Time against the distance from the truth; SVG. `None` where no entry has such an error.
///
/// # Errors
/// Where the SVG cannot be put together.
pub fn model_error(scene: &SceneReport) -> Result<Option<String>, Failure> {
    let front = |name, is_dashed, is_on: fn(&Entry) -> bool| {
        let mut points: Vec<(f64, f64)> = scene
            .entries
            .iter()
            .filter(|entry| is_on(entry))
            .filter_map(|entry| Some((entry.seconds.median, entry.indirect?.relative_rmse)))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Front {
            name,
            points,
            is_dashed,
        }
    };
    let plot = Plot {
        x_title: "time of a frame, from the call to the file",
        y_title: "relRMSE of the indirect light, noise subtracted",
        y_unit: Unit::Percent,
        series: series(scene, &|entry| {
            let error = entry.indirect?;
            Some(Shown {
                y: error.relative_rmse,
                is_upper_bound: error.is_upper_bound,
                own_estimate: entry.engine.as_ref().and_then(|e| e.estimated_error),
            })
        }),
        fronts: vec![
            front("Pareto front of the engine", false, |entry| {
                entry.is_on_engine_front
            }),
            front("Pareto front of all", true, |entry| entry.is_on_front),
        ],
        floor: scene
            .truth
            .noise_floor
            .map(|floor| (floor, "noise of the truth".into())),
    };
    plot.to_svg()
}

/// Time against the rounding of the engine's kernels; SVG. `None` where no entry has such an error.
///
/// # Errors
/// Where the SVG cannot be put together.
pub fn kernel_error(scene: &SceneReport) -> Result<Option<String>, Failure> {
    let plot = Plot {
        x_title: "time of a frame, from the call to the file",
        y_title: "relRMSE against the same formulas in f64",
        y_unit: Unit::Number,
        series: series(scene, &|entry| {
            Some(Shown {
                y: entry.engine.as_ref()?.kernel_error?,
                is_upper_bound: false,
                own_estimate: None,
            })
        }),
        fronts: Vec::new(),
        floor: None,
    };
    plot.to_svg()
}

/// The names of the scene's series in their order, which gives each its colour in both plots.
pub fn series_names(scene: &SceneReport) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for entry in &scene.entries {
        if !names.contains(&entry.series.as_str()) {
            names.push(&entry.series);
        }
    }
    names
}

/// What a plot shows of an entry beside its time.
struct Shown {
    y: f64,
    is_upper_bound: bool,
    own_estimate: Option<f64>,
}

/// The entries that have an error, by series.
fn series<'a>(scene: &'a SceneReport, error: &dyn Fn(&Entry) -> Option<Shown>) -> Vec<Series<'a>> {
    let points = |name: &str| {
        let entries = scene.entries.iter().filter(|entry| entry.series == name);
        entries
            .filter_map(|entry| {
                let Shown {
                    y,
                    is_upper_bound,
                    own_estimate,
                } = error(entry)?;
                Some(Point {
                    x: entry.seconds.median,
                    x_range: [entry.seconds.min, entry.seconds.max],
                    y,
                    is_upper_bound,
                    own_estimate,
                    label: &entry.label,
                })
            })
            .collect()
    };
    let names = series_names(scene).into_iter();
    names
        .map(|name| Series {
            name,
            points: points(name),
        })
        .filter(|series: &Series| !series.points.is_empty())
        .collect()
}

/// Marks the entries on the Pareto fronts of time and indirect error: of the engine's settings, and of all. A bound counts
/// as if it were the error, which is to its disadvantage.
pub fn mark_fronts(entries: &mut [Entry]) {
    let points = |entries: &[Entry], is_in: &dyn Fn(&Entry) -> bool| -> Vec<(f64, f64)> {
        let point = |entry: &Entry| match entry.indirect.filter(|_| is_in(entry)) {
            Some(error) => (entry.seconds.median, error.relative_rmse),
            None => (f64::NAN, f64::NAN),
        };
        entries.iter().map(point).collect()
    };
    for index in super::pareto::front(&points(entries, &|entry| entry.kind == Kind::Engine)) {
        entries[index].is_on_engine_front = true;
    }
    for index in super::pareto::front(&points(entries, &|_| true)) {
        entries[index].is_on_front = true;
    }
}
