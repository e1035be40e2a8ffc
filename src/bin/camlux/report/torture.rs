//! The torture set as a part of the report: checks the engine's estimates of its own error.

use camlux::Device;
use camlux::hard_cases::Examiner;
use camlux::hard_cases::torture::{CASES, Row, Settings};
use serde::{Deserialize, Serialize};

use super::html::table_of_cells;
use super::measured::Measured;
use crate::torture::{HEADS, cells};
use crate::{Failure, print};

/// One image of the set. Errors are shares; JSON has null for unknown or infinite values.
#[derive(Serialize, Deserialize)]
pub struct TortureRow {
    scene: String,
    requested: f64,
    estimated_error: Option<f64>,
    estimated_error_upper: Option<f64>,
    true_error: Option<f64>,
    true_error_standard_error: Option<f64>,
    bias: Option<f64>,
    ray_count: u64,
    milliseconds: f64,
    #[serde(skip)]
    cells: [String; HEADS.len()],
}

impl TortureRow {
    fn new(scene: &str, row: &Row) -> TortureRow {
        let finite = |value: f64| value.is_finite().then_some(value);
        TortureRow {
            scene: scene.into(),
            requested: row.requested,
            estimated_error: row.estimated,
            estimated_error_upper: row.upper_bound,
            true_error: finite(row.true_error),
            true_error_standard_error: finite(row.uncertainty),
            bias: finite(row.bias),
            ray_count: row.ray_count,
            milliseconds: row.milliseconds,
            cells: cells(scene, row),
        }
    }
}

/// Renders the set.
///
/// # Errors
/// Errors of rendering and writing.
pub fn rows(
    device: &Device,
    settings: Settings,
    measured: &Measured,
) -> Result<Vec<TortureRow>, Failure> {
    let inputs = (
        &settings.target_errors,
        settings.size_px,
        settings.variations,
    );
    let measured = measured.group("torture", inputs);
    let mut examiner = Examiner::new(device)?;
    examiner.set_torture(settings);
    let mut rows = Vec::new();
    for case in CASES {
        let of_case: Vec<(TortureRow, [String; HEADS.len()])> =
            measured.obtain(case.name, (), || {
                examiner.examine(case)?;
                let rows = examiner.take_rows();
                let rows = rows.iter().map(|row| {
                    let row = TortureRow::new(case.name, row);
                    let cells = row.cells.clone();
                    (row, cells)
                });
                Ok(rows.collect())
            })?;
        for (row, cells) in of_case {
            print(&format!("torture set, {}\n", cells.join(", ")))?;
            rows.push(TortureRow { cells, ..row });
        }
    }
    Ok(rows)
}

/// Empty unless the set was requested.
pub fn section(rows: &[TortureRow]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let cells = rows.iter().map(|row| row.cells.clone());
    format!(
        "<section>\n<h2>Torture set</h2>\n<p>Scenes that easily fool an error estimate: target, estimate, and true error.</p>\n{}</section>\n",
        table_of_cells(HEADS, cells)
    )
}
