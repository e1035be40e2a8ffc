//! A comparison for people.

use std::fmt::Write;

use camlux::metrics::{Comparison, CorrectedRmse};

use super::{LayerReport, Report};

/// What a row says of a layer, without and with the pixels on edges; `None` where it has nothing to say.
type Cell = fn(&Comparison, Option<&Comparison>) -> Option<String>;

const ROWS: [(&str, Cell); 12] = [
    ("mean of the image", |c, _| Some(number(c.image_mean))),
    ("mean of the reference", |c, _| {
        Some(number(c.reference_mean))
    }),
    ("relative RMSE, as it is", |c, _| {
        Some(percent(c.errors?.rmse))
    }),
    ("  of the noise alone", |c, _| Some(percent(c.noise?.floor))),
    ("  without the noise", |c, _| Some(corrected(c.noise?.rmse))),
    ("  with the edge pixels, as it is", |_, with_edges| {
        Some(percent(with_edges?.errors?.rmse))
    }),
    ("bias", |c, _| {
        let bias = c.errors?.bias;
        Some(match c.noise {
            Some(noise) => with_uncertainty(bias, noise.bias_standard_error),
            None => percent(bias),
        })
    }),
    ("mean relative error, as it is", |c, _| {
        Some(percent(c.errors?.mean_absolute))
    }),
    ("  of the noise alone", |c, _| {
        Some(percent(c.noise?.mean_absolute_floor))
    }),
    ("99 % of the values are within", |c, _| {
        Some(percent(c.errors?.percentile_99))
    }),
    ("z-scores: mean, variance (noise: 0, 1)", |c, _| {
        let scores = c.z_scores?;
        Some(format!("{:.2}, {:.2}", scores.mean, scores.variance))
    }),
    ("not finite: image, reference", |c, _| {
        Some(format!(
            "{}, {}",
            c.non_finite_image, c.non_finite_reference
        ))
    }),
];

/// The comparison as a table, and what has to be said about it.
pub fn text(report: &Report) -> String {
    let [width, height] = report.resolution_px;
    let mut text = String::new();
    let mut line = |content: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", content.trim_end());
    };
    line(format!("image      {}", report.args.image.display()));
    line(format!("reference  {}", report.args.reference.display()));
    line(format!(
        "pixels     {width} x {height}, of which {} show a surface and count",
        report.valid_pixels - report.edge_pixels.unwrap_or(0)
    ));
    if let (Some(count), Some(share)) = (report.edge_pixels, report.edge_share()) {
        line(format!(
            "edges      {count} more ({}) show one of two surfaces by chance and are left out",
            percent(share)
        ));
    }
    line(String::new());
    for row in rows(report) {
        line(row);
    }
    let notes: Vec<String> = report.layers.iter().filter_map(note).collect();
    if !notes.is_empty() {
        line(String::new());
    }
    notes.into_iter().for_each(line);
    text
}

/// The lines of the table, columns aligned.
fn rows(report: &Report) -> Vec<String> {
    let heads: Vec<String> = report
        .layers
        .iter()
        .map(|layer| match layer.unit {
            "" => layer.name.clone(),
            unit => format!("{} [{unit}]", layer.name),
        })
        .collect();
    let mut table = vec![(String::new(), heads)];
    for (label, cell) in ROWS {
        let cells: Vec<Option<String>> = report
            .layers
            .iter()
            .map(|layer| cell(&layer.comparison, layer.with_edges.as_ref()))
            .collect();
        if cells.iter().any(Option::is_some) {
            let cells = cells
                .into_iter()
                .map(|cell| cell.unwrap_or_else(|| "-".into()));
            table.push((label.into(), cells.collect()));
        }
    }
    let widths: Vec<usize> = (0..report.layers.len())
        .map(|column| {
            let widths = table.iter().map(|(_, cells)| cells[column].chars().count());
            widths.max().unwrap_or(0)
        })
        .collect();
    let label_width = ROWS
        .map(|(label, _)| label.len())
        .into_iter()
        .max()
        .unwrap_or(0);
    table
        .into_iter()
        .map(|(label, cells)| {
            let cells = cells.iter().zip(&widths);
            let cells = cells.map(|(cell, width)| format!("  {cell:>width$}"));
            format!("{label:<label_width$}{}", cells.collect::<String>())
        })
        .collect()
}

/// What the numbers of a layer do not say by themselves.
fn note(layer: &LayerReport) -> Option<String> {
    let name = &layer.name;
    let comparison = &layer.comparison;
    if comparison.value_count == 0 {
        return Some(format!("{name}: undefined: there is no value to compare"));
    }
    if comparison.errors.is_none() {
        return Some(format!("{name}: undefined: the reference is black"));
    }
    let noise = comparison.noise?;
    let floor = percent(noise.floor);
    Some(match noise.rmse {
        CorrectedRmse::Estimate { .. } => format!(
            "{name}: noise of {floor} was taken out of the relative RMSE; what is left is an error of the image"
        ),
        CorrectedRmse::Below(_) => format!(
            "{name}: noise of {floor} was taken out of the relative RMSE; what is left is no error that this \
             reference can show"
        ),
        CorrectedRmse::ReferenceIsNoise => {
            format!("{name}: the reference is noise; nothing can be said by it")
        }
    })
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

fn percent(share: f64) -> String {
    format!("{} %", number(share * 100.0))
}

/// Two digits of the uncertainty, and as many of the value as it leaves.
fn with_uncertainty(share: f64, standard_error: f64) -> String {
    let [percent, uncertainty] = [share, standard_error].map(|share| share * 100.0);
    if uncertainty <= 0.0 {
        return self::percent(share);
    }
    let places = (1 - uncertainty.log10().floor() as i32).clamp(0, 6) as usize;
    format!("{percent:.places$} ± {uncertainty:.places$} %")
}

/// Three digits, plain where that takes few zeros.
fn number(value: f64) -> String {
    let scientific = format!("{value:.2e}");
    let exponent = scientific
        .rsplit_once('e')
        .and_then(|(_, exponent)| exponent.parse().ok());
    match exponent {
        _ if value == 0.0 => "0".into(),
        Some(exponent @ -3..=3_i32) => format!("{value:.*}", (2 - exponent).max(0) as usize),
        _ => scientific,
    }
}
