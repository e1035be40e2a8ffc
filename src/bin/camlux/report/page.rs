//! The page: one HTML file that needs nothing else, in light and dark.

use std::fmt::Write;

use super::figures;
use super::html::{escape, image, table};
use super::machine::Machine;
use super::numbers::{count, duration, percent, relative_rmse, signed_percent};
use super::picture::{ERROR_RANGE, Pictures};
use super::results::{Entry, ModelError, Report, SceneReport, Seconds, Unsupported};
use super::style::STYLE;
use super::summary::summary;
use crate::Failure;

/// Two dashes: nothing to show in a cell.
const NOTHING: &str = "–";

/// The whole page.
///
/// # Errors
/// Where a plot cannot be drawn.
pub fn page(report: &Report) -> Result<String, Failure> {
    let mut text =
        String::from("<!doctype html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\n");
    text += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
    text += &format!(
        "<title>camlux: speed against error</title>\n<style>{STYLE}</style></head>\n<body>\n"
    );
    text += "<h1>Speed against error</h1>\n";
    text += &machine(&report.machine, report.quick);
    text += HOW_TO_READ;
    for scene in &report.scenes {
        text += &scene_section(scene)?;
    }
    text += "</body>\n</html>\n";
    Ok(text)
}

const HOW_TO_READ: &str = "<p><b>How to read this.</b> A point is a setting. Its time is that of one frame from the call to the \
finished OpenEXR file, with scene, device and pipelines ready: the median of the runs, whiskers from the fastest to the \
slowest. Its error is that of the indirect light over all pixels with a surface but those on edges, which show one of two surfaces by \
chance: relRMSE = √(Σ(x−t)²/Σt²), against the \
path-sampled single bounce; the noise of that truth is subtracted. Where the noise hides the error, the point is hollow and \
stands at what the error is at most. A point below the dashed line of the truth's noise leans on that subtraction. \
The camlux reference is measured by its own spread. <b>final-gather</b> casts rays until its indirect light should have \
the error that was requested; a bar joined to its point is the error as the engine itself estimates it, without the truth. \
<b>Model error</b> is the distance to the truth; \
<b>kernel error</b>, of plain sums only, is the rounding of the device's f32 against the same formulas on the same VPLs in \
f64.</p>\n";

fn machine(machine: &Machine, is_quick: bool) -> String {
    let or_unknown = |text: &Option<String>| text.clone().unwrap_or_else(|| "unknown".into());
    let rows = [
        ("date", machine.date.clone()),
        ("camlux", machine.camlux_version.into()),
        (
            "device",
            format!("{} ({})", machine.device, machine.device_kind),
        ),
        ("driver", machine.driver.clone()),
        ("CPU", or_unknown(&machine.cpu)),
        (
            "cores",
            machine.cores.map_or("unknown".into(), |n| n.to_string()),
        ),
        (
            "LP_NUM_THREADS",
            machine
                .lp_num_threads
                .clone()
                .unwrap_or_else(|| "not set".into()),
        ),
        (
            "load before",
            machine
                .load_before
                .map_or("unknown".into(), |load| format!("{load:.2} processes")),
        ),
        ("system", machine.system.clone()),
        (
            "extent",
            if is_quick {
                "quick".into()
            } else {
                "full".to_owned()
            },
        ),
    ];
    let mut text = String::from("<dl>");
    for (name, value) in rows {
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "<div><dt>{name}</dt><dd>{}</dd></div>",
            escape(&value)
        );
    }
    text + "</dl>\n"
}

fn scene_section(scene: &SceneReport) -> Result<String, Failure> {
    let mut text = format!("<section>\n<h2>{}</h2>\n", escape(&scene.name));
    text += &format!(
        "<p>{}</p>\n<p>{}</p>\n",
        escape(&describe(scene)),
        escape(&summary(scene))
    );
    text += "<figure>";
    text += &match figures::model_error(scene)? {
        Some(svg) => svg,
        None => "<p>No model error to plot: the truth's indirect light is black.</p>".into(),
    };
    text += "<figcaption>Model error against time. Lower left is better.</figcaption></figure>\n<figure>";
    text += &match figures::kernel_error(scene)? {
        Some(svg) => svg,
        None => "<p>No kernel error to plot: the engine's indirect light is black.</p>".into(),
    };
    text += "<figcaption>Kernel error against time: what the rounding of f32 adds.</figcaption></figure>\n";
    text += "<h3>Figures</h3>\n";
    text += &errors_table(&scene.entries);
    text += &requested_table(&scene.entries);
    text += &direct_only(scene);
    text += "<details><summary>Times of the engine's passes</summary>\n";
    text += &passes_table(&scene.entries);
    text += "</details>\n<h3>Pictures</h3>\n";
    text += &pictures(scene);
    text += &notes(scene);
    text += "</section>\n";
    Ok(text)
}

fn describe(scene: &SceneReport) -> String {
    let [width, height] = scene.resolution_px;
    let truth = &scene.truth;
    let floor = match truth.noise_floor {
        Some(floor) => format!("its noise is {} of its root mean square", percent(floor)),
        None => "its indirect light is black".into(),
    };
    let origin = if truth.was_there {
        "begun in an earlier report, "
    } else {
        ""
    };
    format!(
        "{}: {width} × {height} pixels, {} triangles, lights: {}. Truth: {} samples a pixel, {origin}{} of work in this one; {floor}. \
         {} pixels ({}) lie on edges and are left out.",
        scene.file,
        scene.triangles,
        scene.lights.join(", "),
        truth.samples_per_pixel,
        duration(truth.seconds),
        truth.edge_pixels,
        percent(truth.edge_share),
    )
}

/// Every entry with its time and its errors.
fn errors_table(entries: &[Entry]) -> String {
    let head = [
        "setting",
        "VPLs",
        "time (range of the runs)",
        "indirect relRMSE",
        "bias",
        "mean relative error",
        "99 % within",
        "total relRMSE",
        "kernel error",
        "front",
    ];
    let rows: Vec<Vec<String>> = entries
        .iter()
        .map(|entry| {
            let engine = entry.engine.as_ref();
            let indirect = entry.indirect.as_ref();
            let of = |value: fn(&ModelError) -> Option<f64>, text: fn(f64) -> String| {
                indirect.and_then(value).map_or(NOTHING.into(), text)
            };
            vec![
                format!("{} {}", entry.series, entry.label),
                engine.map_or(NOTHING.into(), |e| count(e.vpl_count as f64)),
                times(&entry.seconds),
                indirect.map_or(NOTHING.into(), relative_rmse),
                indirect.and_then(bias).unwrap_or_else(|| NOTHING.into()),
                of(|error| error.mean_relative_error, percent),
                of(|error| error.p99, percent),
                entry.total.as_ref().map_or(NOTHING.into(), relative_rmse),
                engine
                    .and_then(|e| e.kernel_error)
                    .map_or(NOTHING.into(), |error| format!("{error:.1e}")),
                match (entry.is_on_engine_front, entry.is_on_front) {
                    (true, true) => "engine, all".into(),
                    (true, false) => "engine".into(),
                    (false, true) => "all".into(),
                    (false, false) => String::new(),
                },
            ]
        })
        .collect();
    table(&head, &rows)
}

/// The error that was requested, the one that the engine estimates, and the measured one. Empty where none was requested.
fn requested_table(entries: &[Entry]) -> String {
    let requested = entries.iter().filter_map(|entry| {
        let engine = entry.engine.as_ref()?;
        Some((entry, engine, engine.target_error?))
    });
    let rows: Vec<Vec<String>> = requested
        .map(|(entry, engine, requested)| {
            let measured = entry.indirect.as_ref();
            vec![
                format!("{} {}", entry.series, entry.label),
                percent(requested),
                engine.estimated_error.map_or(NOTHING.into(), percent),
                measured.map_or(NOTHING.into(), relative_rmse),
                count(engine.ray_count as f64),
                count(engine.vpl_count as f64),
                duration(entry.seconds.median),
            ]
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let head = [
        "relRMSE of the indirect light",
        "requested",
        "the engine's estimate",
        "measured",
        "rays",
        "VPLs",
        "time",
    ];
    table(&head, &rows)
}

fn bias(error: &ModelError) -> Option<String> {
    Some(signed_percent(error.bias?, error.bias_uncertainty?))
}

/// The median, and the spread where there is one.
fn times(seconds: &Seconds) -> String {
    let median = duration(seconds.median);
    match seconds.runs.len() {
        1 => format!("{median} (1 run)"),
        runs => {
            let (min, max) = (duration(seconds.min), duration(seconds.max));
            format!("{median} ({min} to {max} of {runs})")
        }
    }
}

fn direct_only(scene: &SceneReport) -> String {
    let times = times(&scene.direct_only);
    format!("<p>Without indirect light the engine takes {times}.</p>\n")
}

/// GPU times of the engine's passes, and what the time of each entry is made of.
fn passes_table(entries: &[Entry]) -> String {
    let rows: Vec<Vec<String>> = entries
        .iter()
        .map(|entry| {
            let parts = entry.seconds.parts.iter();
            let parts: Vec<String> = parts
                .map(|part| format!("{} {}", part.name, duration(part.seconds)))
                .collect();
            let engine = entry.engine.as_ref();
            let passes = engine.iter().flat_map(|engine| &engine.gpu_passes);
            let passes: Vec<String> = passes
                .map(|pass| format!("{} {}", pass.name, duration(pass.milliseconds * 1e-3)))
                .collect();
            let rate = engine.and_then(|engine| engine.pairs_per_second);
            vec![
                format!("{} {}", entry.series, entry.label),
                parts.join(", "),
                passes.join(", "),
                rate.map_or(NOTHING.into(), |rate| format!("{}/s", count(rate))),
            ]
        })
        .collect();
    table(
        &["setting", "parts", "GPU passes", "pixel–VPL pairs"],
        &rows,
    )
}

/// The truth, then each entry's indirect light and its error.
fn pictures(scene: &SceneReport) -> String {
    let range = format!("{:.0} %", 100.0 * ERROR_RANGE);
    let bar = image(
        &scene.color_bar.png,
        scene.color_bar.size_px,
        "blue is too dark, red is too bright",
    );
    let mut text = format!(
        "<p>Left the indirect light, all in the exposure of the truth; right its error (x−t), mean of the bands, over the \
        truth's mean: −{range} {bar} +{range} and beyond.</p>\n<div class=\"grid\">"
    );
    let mut add = |name: &str, pictures: &Pictures| {
        text += "<figure>";
        let alternative = format!("{name}: indirect light");
        text += &image(&pictures.indirect, pictures.size_px, &alternative);
        if let Some(error) = &pictures.error {
            text += &image(error, pictures.size_px, &format!("{name}: error"));
        }
        text += &format!("<figcaption>{}</figcaption></figure>\n", escape(name));
    };
    add("truth", &scene.truth_pictures);
    for entry in &scene.entries {
        if let Some(pictures) = &entry.pictures {
            let error = entry
                .indirect
                .as_ref()
                .map_or(NOTHING.into(), relative_rmse);
            add(
                &format!("{} {}: {error}", entry.series, entry.label),
                pictures,
            );
        }
    }
    text + "</div>\n"
}

/// What was left out, and what the peers say.
fn notes(scene: &SceneReport) -> String {
    let peers = &scene.peers;
    let mut notes: Vec<String> = scene
        .skipped
        .iter()
        .map(|what| format!("Left out: {what}."))
        .collect();
    notes.push(format!("Peers: {}.", peers.status));
    notes.extend(peers.about.clone());
    notes.extend(peers.notes.iter().cloned());
    for Unsupported { peer, reason } in &peers.unsupported {
        notes.push(format!("{peer} cannot render this scene: {reason}"));
    }
    for entry in &scene.entries {
        let count = entry.indirect.map_or(0, |error| error.non_finite);
        if count > 0 {
            let Entry { series, label, .. } = entry;
            notes.push(format!(
                "{series} {label}: {count} values are infinite or no numbers, and in no sum."
            ));
        }
    }
    for name in figures::series_names(scene) {
        // One stands for its series.
        let of_series = scene.entries.iter().find(|entry| entry.series == name);
        let description = of_series.and_then(|entry| entry.description.as_ref());
        notes.extend(description.map(|text| format!("{name}, first point: {text}")));
    }
    let items = notes
        .iter()
        .map(|note| format!("<li>{}</li>\n", escape(note)));
    format!("<h3>Notes</h3>\n<ul>{}</ul>\n", items.collect::<String>())
}
