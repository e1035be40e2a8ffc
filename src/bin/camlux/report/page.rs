//! The page: one HTML file without external parts, for light and dark screens.

use super::figures;
use super::growth;
use super::html::{Column, escape, image, table};
use super::picture::{ERROR_RANGE, Picture, Pictures};
use super::results::{Entry, Kind, PhasorError, Report, SceneReport, Unsupported};
use super::stopwatch::Seconds;
use super::style::{SCRIPT, STYLE};
use super::summary::summary;
use super::torture;
use crate::Failure;
use crate::numbers::{count, duration, length, number, percent, with_uncertainty};

/// The whole page.
///
/// # Errors
/// If a plot or a picture cannot be drawn.
pub fn page(report: &Report) -> Result<String, Failure> {
    let machine = machine(report);
    let scenes = report.scenes.iter().map(scene_section);
    let scenes = scenes.collect::<Result<String, Failure>>()?;
    let torture = torture::section(&report.torture);
    let growth = growth::section(&report.growth)?;
    let how_to_read = if scenes.is_empty() { "" } else { HOW_TO_READ };
    Ok(format!(
        "<!doctype html>
<html lang=\"en\">
<head><meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<title>camlux: speed against error</title>
<style>{STYLE}</style></head>
<body>
<h1>Speed against error</h1>
{machine}{how_to_read}{scenes}{torture}{growth}<script>{SCRIPT}</script>
</body>
</html>
"
    ))
}

const HOW_TO_READ: &str = "<details><summary>How to read the plots</summary><ul>
<li>Each point is one setting. Lower left is better.</li>
<li><b>Time</b> is one frame, from the call to the finished OpenEXR file. Scene, device and pipelines are ready. The point is the median of the runs; \
whiskers reach from the fastest to the slowest.</li>
<li><b>Model error</b> is the relRMSE of the indirect light, √(Σ(x−t)²/Σt²), against the reference, which is path-traced with as many bounces as the scene has. The noise of the reference is \
subtracted. Pixels on edges are left out, since either of two surfaces may show there.</li>
<li>A hollow point is an upper bound: the noise of the reference hides the error. The dashed line is that noise.</li>
<li>The error of the camlux reference is its own standard error.</li>
<li><b>final-gather</b> casts rays until it estimates that the target error is met. The bar joined to a point is that estimate, made without the reference.</li>
<li><b>Kernel error</b>, for plain sums only, is the rounding of the device's f32 against the same formulas in f64.</li>
</ul></details>\n";

fn machine(report: &Report) -> String {
    let machine = &report.machine;
    let or_unknown = |text: Option<String>| text.unwrap_or_else(|| "unknown".into());
    let device = format!("{} ({})", machine.device, machine.device_kind);
    let threads = machine.lp_num_threads.clone();
    let load = machine.load_before;
    let load = load.map(|load| format!("{load:.2} processes"));
    let rows = [
        ("date", machine.date.clone()),
        ("camlux", machine.camlux_version.into()),
        ("device", device),
        ("driver", machine.driver.clone()),
        ("CPU", or_unknown(machine.cpu.clone())),
        ("cores", or_unknown(machine.cores.map(|n| n.to_string()))),
        ("LP_NUM_THREADS", threads.unwrap_or("not set".into())),
        ("load before", or_unknown(load)),
        ("system", machine.system.clone()),
        ("extent", if report.quick { "quick" } else { "full" }.into()),
    ];
    let note = report.measurements.note();
    let note = note.map(|note| {
        (
            "note",
            format!("{note}; the date and load here are not theirs"),
        )
    });
    let rows = rows.into_iter().chain(note).map(|(name, value)| {
        let value = escape(&value);
        format!("<div><dt>{name}</dt><dd>{value}</dd></div>")
    });
    format!("<dl>{}</dl>\n", rows.collect::<String>())
}

fn scene_section(scene: &SceneReport) -> Result<String, Failure> {
    let missing = |error: &str, light: &str| {
        format!("<p>No {error} error to plot: the {light}'s indirect light is black.</p>")
    };
    let model_error = figures::model_error(scene)?;
    let kernel_error = figures::kernel_error(scene)?;
    Ok(format!(
        "<section>
<h2>{}</h2>
<p>{}</p>
<p>{}</p>
<figure>{}<figcaption>Model error against time. Lower left is better.</figcaption></figure>
<details><summary>Kernel error: what the rounding of f32 adds</summary>
<figure>{}</figure></details>
{}<h3>Figures</h3>
{}<p>Without indirect light the engine takes {}.</p>
<details><summary>Times of the engine's passes</summary>
{}</details>
<h3>Pictures</h3>
{}{}</section>
",
        escape(&scene.name),
        escape(&describe(scene)),
        escape(&summary(scene)),
        model_error.unwrap_or_else(|| missing("model", "reference")),
        kernel_error.unwrap_or_else(|| missing("kernel", "engine")),
        time_of_flight(scene)?,
        table(&ERRORS, &scene.entries),
        times(&scene.direct_only),
        table(&PASSES, &scene.entries),
        pictures(scene)?,
        notes(scene),
    ))
}

/// Plots and figures of each modulation frequency; empty if the scene has none.
fn time_of_flight(scene: &SceneReport) -> Result<String, Failure> {
    let mut text = String::new();
    let mut rows = Vec::new();
    for frequency in 0..scene.reference.range_noise_m.len() {
        let of_frequency = scene.entries.iter().filter_map(|entry| {
            Some(RangeRow {
                name: entry.name(),
                time: times(&entry.seconds),
                error: *entry.time_of_flight.get(frequency)?,
            })
        });
        let of_frequency: Vec<RangeRow> = of_frequency.collect();
        let megahertz = of_frequency
            .first()
            .map_or(0.0, |row| 1e-6 * row.error.frequency_hz);
        let plot = figures::range_error(scene, frequency)?.unwrap_or_default();
        text += &format!(
            "<figure>{plot}<figcaption>Median error of the range at {megahertz} MHz against time. \
             The dashed line is the noise of the reference.</figcaption></figure>\n"
        );
        rows.extend(of_frequency);
    }
    if !rows.is_empty() {
        text += &format!("<h3>Time of flight</h3>\n{}", table(&RANGES, &rows));
    }
    Ok(text)
}

/// A row of the table for one modulation frequency.
struct RangeRow {
    name: String,
    time: String,
    error: PhasorError,
}

const RANGES: [Column<RangeRow>; 6] = [
    ("setting", |row| Some(row.name.clone())),
    ("time (range of the runs)", |row| Some(row.time.clone())),
    ("modulation", |row| {
        Some(format!("{} MHz", 1e-6 * row.error.frequency_hz))
    }),
    ("indirect Z, relRMSE", |row| {
        Some(row.error.indirect?.text())
    }),
    ("range: half within", |row| {
        row.error.range_median_m.map(length)
    }),
    ("range: 99 % within", |row| {
        row.error.range_p99_m.map(length)
    }),
];

fn describe(scene: &SceneReport) -> String {
    let [width, height] = scene.resolution_px;
    let reference = &scene.reference;
    let floor = match reference.noise_floor {
        Some(floor) => format!("its relative noise is {}", percent(floor)),
        None => "its indirect light is black".into(),
    };
    let origin = if reference.was_there {
        "begun for an earlier report, "
    } else {
        ""
    };
    format!(
        "{}: {width} × {height} pixels, {} triangles, lights: {}. Reference: up to {} bounces, {} samples a pixel, {origin}{} of work for this report; {floor}. \
         {} pixels ({}) on edges are left out.",
        scene.file,
        scene.triangles,
        scene.lights.join(", "),
        reference.bounces,
        reference.samples_per_pixel,
        duration(reference.seconds),
        reference.edge_pixels,
        percent(reference.edge_share),
    )
}

/// Every entry with its time and errors; for final gathering also the target error.
const ERRORS: [Column<Entry>; 15] = [
    ("setting", |e| Some(e.name())),
    ("time (range of the runs)", |e| Some(times(&e.seconds))),
    ("indirect relRMSE", |e| Some(e.indirect?.text())),
    ("requested", |e| {
        e.engine.as_ref()?.target_error.map(percent)
    }),
    ("the engine's estimate", |e| {
        e.engine.as_ref()?.estimated_error.map(percent)
    }),
    ("its 95 % bound", |e| {
        e.engine.as_ref()?.estimated_error_upper.map(percent)
    }),
    ("error over stderr (0.8 to 1.25)", |e| {
        e.engine.as_ref()?.stderr_deviation.map(number)
    }),
    ("bias", |e| {
        let error = e.indirect?;
        Some(with_uncertainty(error.bias?, error.bias_uncertainty?))
    }),
    ("mean relative error", |e| {
        e.indirect?.mean_relative_error.map(percent)
    }),
    ("99 % within", |e| e.indirect?.p99.map(percent)),
    ("total relRMSE", |e| Some(e.total?.text())),
    ("kernel error", |e| {
        Some(format!("{:.1e}", e.engine.as_ref()?.kernel_error?))
    }),
    ("VPLs", |e| Some(count(e.engine.as_ref()?.vpl_count as f64))),
    ("rays", |e| Some(count(e.engine.as_ref()?.ray_count as f64))),
    ("front", |e| {
        let fronts = match (e.is_on_engine_front, e.is_on_front) {
            (true, true) => "engine, all",
            (true, false) => "engine",
            (false, true) => "all",
            (false, false) => "",
        };
        Some(fronts.into())
    }),
];

/// GPU times of the engine's passes, and the parts of each entry's time.
const PASSES: [Column<Entry>; 4] = [
    ("setting", |e| Some(e.name())),
    ("parts", |e| {
        let parts = e.seconds.parts.iter();
        let parts = parts.map(|part| format!("{} {}", part.name, duration(part.seconds)));
        Some(Vec::from_iter(parts).join(", "))
    }),
    ("GPU passes", |e| {
        let passes = e.engine.iter().flat_map(|engine| &engine.gpu_passes);
        let passes = passes.map(|pass| {
            let seconds = pass.milliseconds * 1e-3;
            format!("{} {}", pass.name, duration(seconds))
        });
        Some(Vec::from_iter(passes).join(", "))
    }),
    ("pixel–VPL pairs", |e| {
        let rate = e.engine.as_ref()?.pairs_per_second?;
        Some(format!("{}/s", count(rate)))
    }),
];

/// The median, and the spread if there is one.
fn times(seconds: &Seconds) -> String {
    let [median, min, max] = [seconds.median, seconds.min, seconds.max].map(duration);
    match seconds.runs.len() {
        1 => format!("{median} (1 run)"),
        runs => format!("{median} ({min} to {max} of {runs})"),
    }
}

/// Shows one entry over the reference, with a slider, and its error. Below are all entries to choose from.
fn pictures(scene: &SceneReport) -> Result<String, Failure> {
    let shown = scene.entries.iter().filter_map(|entry| {
        let error = entry.indirect.map_or("–".into(), |error| error.text());
        Some((
            format!("{}: {error}", entry.name()),
            entry.pictures.as_ref()?,
        ))
    });
    let shown: Vec<(String, &Pictures)> = shown.collect();
    let best = scene
        .entries
        .iter()
        .filter(|entry| entry.pictures.is_some());
    let best = best.enumerate().filter_map(|(place, entry)| {
        let error = entry.indirect.filter(|_| entry.kind == Kind::Engine)?;
        Some((place, error.relative_rmse))
    });
    let best = best.min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((first, pictures)) = shown.get(best.map_or(0, |(place, _)| place)) else {
        return Ok(String::new());
    };
    let indirect = |name: &str, pictures: &Pictures| {
        image(&pictures.indirect, &format!("{name}: indirect light"))
    };
    let error = |name: &str, pictures: &Pictures| {
        let error = pictures.error.as_ref();
        let error = error.map(|error| image(error, &format!("{name}: error")));
        error.unwrap_or_default()
    };
    let choices = shown.iter().map(|(name, pictures)| {
        format!(
            "<button type=\"button\">{}{}<span>{}</span></button>\n",
            indirect(name, pictures),
            error(name, pictures),
            escape(name)
        )
    });
    let range = format!("{:.0} %", 100.0 * ERROR_RANGE);
    let bar = image(
        &Picture::of_colors()?,
        "blue is too dark, red is too bright",
    );
    Ok(format!(
        "<div class=\"pictures\"><div class=\"viewer\">
<figure><div class=\"zoom stack\">{}<div class=\"over\">{}</div></div>
<input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"how much of the image covers the reference\">
<figcaption>Left of the slider <b>{}</b>, right of it the reference. Indirect light, in one exposure.</figcaption></figure>
<figure><div class=\"zoom error\">{}</div>
<figcaption>Error x−t over the mean of the reference: <span class=\"scale\">−{range} {bar} +{range}</span>. Click a picture to enlarge it.</figcaption></figure>
</div>
<div class=\"grid\">{}</div></div>
",
        indirect("reference", &scene.reference_pictures),
        indirect(first, pictures),
        escape(first),
        error(first, pictures),
        choices.collect::<String>()
    ))
}

/// Which settings were left out, and the notes of the peers.
fn notes(scene: &SceneReport) -> String {
    let peers = &scene.peers;
    let skipped = scene.skipped.iter();
    let mut notes: Vec<String> = skipped.map(|what| format!("Left out: {what}.")).collect();
    notes.push(format!("Peers: {}.", peers.status));
    notes.extend(peers.about.clone());
    notes.extend(peers.notes.iter().cloned());
    for Unsupported { peer, reason } in &peers.unsupported {
        notes.push(format!("{peer} cannot render this scene: {reason}"));
    }
    for entry in &scene.entries {
        let count = entry.indirect.map_or(0, |error| error.non_finite);
        if count > 0 {
            let name = entry.name();
            notes.push(format!(
                "{name}: {count} values are infinite or NaN and are left out."
            ));
        }
    }
    for name in figures::series_names(scene) {
        // The first entry of a series describes the whole series.
        let of_series = scene.entries.iter().find(|entry| entry.series == name);
        let description = of_series.and_then(|entry| entry.description.as_ref());
        notes.extend(description.map(|text| format!("{name}, first point: {text}")));
    }
    let items = notes
        .iter()
        .map(|note| format!("<li>{}</li>\n", escape(note)));
    format!("<h3>Notes</h3>\n<ul>{}</ul>\n", items.collect::<String>())
}
