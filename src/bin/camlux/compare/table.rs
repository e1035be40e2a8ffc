//! The comparison as a table, for readers.

use camlux::metrics::{CorrectedRmse, ZScores};

use super::{LayerReport, Report};
use crate::numbers::{length, number, percent, with_uncertainty};
use crate::range_error::RangeErrors;

/// The cell of a row for one layer; `None` if it is empty.
type Cell = fn(&LayerReport) -> Option<String>;

const ROWS: [(&str, Cell); 15] = [
    ("mean of the image", |l| {
        Some(number(l.comparison.image_mean))
    }),
    ("mean of the reference", |l| {
        Some(number(l.comparison.reference_mean))
    }),
    ("relative RMSE, as it is", |l| {
        Some(percent(l.comparison.errors?.rmse))
    }),
    ("  of the noise alone", |l| {
        Some(percent(l.comparison.noise?.floor))
    }),
    ("  without the noise", |l| {
        Some(corrected(l.comparison.noise?.rmse))
    }),
    ("  with the edge pixels, as it is", |l| {
        Some(percent(l.with_edges.as_ref()?.errors?.rmse))
    }),
    ("bias", |l| {
        let noise = l.comparison.noise;
        let uncertainty = noise.map_or(0.0, |noise| noise.bias_standard_error);
        Some(with_uncertainty(l.comparison.errors?.bias, uncertainty))
    }),
    ("mean relative error, as it is", |l| {
        Some(percent(l.comparison.errors?.mean_absolute))
    }),
    ("  of the noise alone", |l| {
        Some(percent(l.comparison.noise?.mean_absolute_floor))
    }),
    ("99 % of the values are within", |l| {
        Some(percent(l.comparison.errors?.percentile_99))
    }),
    ("error of the range: median, 99 %", |l| {
        Some(median_and_99(l.range_errors_m?))
    }),
    ("  of the reference's noise alone", |l| {
        Some(median_and_99(l.range_noise_m?))
    }),
    ("z-scores: mean, variance (noise: 0, 1)", |l| {
        let scores = l.comparison.z_scores?;
        Some(format!("{:.2}, {:.2}", scores.mean, scores.variance))
    }),
    ("error over its stderr (0.8 to 1.25)", |l| {
        Some(number(l.stated?.deviation()))
    }),
    ("not finite: image, reference", |l| {
        Some(format!(
            "{}, {}",
            l.comparison.non_finite_image, l.comparison.non_finite_reference
        ))
    }),
];

/// The comparison as a table, with notes.
pub fn text(report: &Report) -> String {
    let [width, height] = report.resolution_px;
    let seen = report.valid_pixels - report.edge_pixels.unwrap_or(0);
    let mut lines = vec![
        format!("image      {}", report.args.image.display()),
        format!("reference  {}", report.args.reference.display()),
        format!("pixels     {width} x {height}; {seen} show a surface and are compared"),
    ];
    if let (Some(count), Some(share)) = (report.edge_pixels, report.edge_share()) {
        let share = percent(share);
        lines.push(format!(
            "edges      {count} more ({share}) could show either of two surfaces and are left out"
        ));
    }
    lines.push(String::new());
    lines.extend(rows(report));
    let of_layer = |layer| note(layer).into_iter().chain(note_of_stated(layer));
    let notes: Vec<String> = report.layers.iter().flat_map(of_layer).collect();
    if !notes.is_empty() {
        lines.push(String::new());
    }
    lines.extend(notes);
    let lines = lines.iter().map(|line| format!("{}\n", line.trim_end()));
    lines.collect()
}

/// The lines of the table, columns aligned.
fn rows(report: &Report) -> Vec<String> {
    let head = |layer: &LayerReport| match layer.pair.unit {
        "" => layer.pair.name().into_owned(),
        unit => format!("{} [{unit}]", layer.pair.name()),
    };
    let heads: Vec<String> = report.layers.iter().map(head).collect();
    let mut table = vec![("", heads)];
    for (label, cell) in ROWS {
        let cells: Vec<Option<String>> = report.layers.iter().map(cell).collect();
        if cells.iter().any(Option::is_some) {
            let cells = cells.into_iter().map(|cell| cell.unwrap_or("-".into()));
            table.push((label, cells.collect()));
        }
    }
    let widest = |column: usize| {
        let widths = table.iter().map(|(_, cells)| cells[column].chars().count());
        widths.max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..report.layers.len()).map(widest).collect();
    let label_width = ROWS.iter().map(|(label, _)| label.len()).max().unwrap_or(0);
    let row = |(label, cells): &(&str, Vec<String>)| {
        let cells = cells.iter().zip(&widths);
        let cells = cells.map(|(cell, width)| format!("  {cell:>width$}"));
        format!("{label:<label_width$}{}", cells.collect::<String>())
    };
    table.iter().map(row).collect()
}

/// Notes on a layer that its numbers do not show.
fn note(layer: &LayerReport) -> Option<String> {
    let name = layer.pair.name();
    let comparison = &layer.comparison;
    if comparison.value_count == 0 {
        return Some(format!("{name}: undefined: there is no value to compare"));
    }
    if comparison.errors.is_none() {
        return Some(format!("{name}: undefined: the reference is black"));
    }
    let noise = comparison.noise?;
    let what_is_left = match noise.rmse {
        CorrectedRmse::Estimate { .. } => "an error of the image",
        CorrectedRmse::Below(_) => "too small for this reference to show",
        CorrectedRmse::ReferenceIsNoise => {
            return Some(format!(
                "{name}: undefined: the reference is only noise; give it more samples"
            ));
        }
    };
    let floor = percent(noise.floor);
    Some(format!(
        "{name}: noise of {floor} is subtracted from the relative RMSE; the rest is {what_is_left}"
    ))
}

/// Whether the render's estimate of its own error is right.
fn note_of_stated(layer: &LayerReport) -> Option<String> {
    let deviation = layer.stated?.deviation();
    let verdict = match deviation {
        d if ZScores::CALIBRATED.contains(&d) => "right",
        d if d < *ZScores::CALIBRATED.start() => "too large",
        _ => "too small",
    };
    let deviation = number(deviation);
    Some(format!(
        "{}: the image's layer stderr is {verdict}: the standard deviation of the true errors is {deviation} times it",
        layer.pair.name()
    ))
}

fn median_and_99([median, percentile_99]: RangeErrors) -> String {
    format!("{}, {}", length(median), length(percentile_99))
}

fn corrected(rmse: CorrectedRmse) -> String {
    match rmse {
        CorrectedRmse::Estimate {
            value,
            standard_error,
        } => with_uncertainty(value, standard_error),
        CorrectedRmse::Below(bound) => format!("below {}", percent(bound)),
        CorrectedRmse::ReferenceIsNoise => "undefined".into(),
    }
}
