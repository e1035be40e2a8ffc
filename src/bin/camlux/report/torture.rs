//! The torture set as a part of the report: whether the engine knows how far off its images are.

use camlux::Device;
use camlux::doctor::Examiner;
use camlux::doctor::torture::{CASES, Row, Settings};
use serde::Serialize;

use super::html::table_of_cells;
use crate::torture::{HEADS, cells};
use crate::{Failure, print};

/// An image of the set. Errors are shares; JSON has null for what is unknown or infinite.
#[derive(Serialize)]
pub struct TortureRow {
    scene: &'static str,
    requested: f64,
    estimated_error: Option<f64>,
    estimated_error_upper: Option<f64>,
    true_error: f64,
    true_error_standard_error: f64,
    bias: f64,
    ray_count: u64,
    milliseconds: f64,
    #[serde(skip)]
    cells: [String; HEADS.len()],
}

impl TortureRow {
    fn new(scene: &'static str, row: &Row) -> TortureRow {
        TortureRow {
            scene,
            requested: row.requested,
            estimated_error: row.estimated,
            estimated_error_upper: row.upper_bound,
            true_error: row.true_error,
            true_error_standard_error: row.uncertainty,
            bias: row.bias,
            ray_count: row.ray_count,
            milliseconds: row.milliseconds,
            cells: cells(scene, row),
        }
    }
}

/// Renders the set.
pub fn rows(device: &Device, settings: Settings) -> Result<Vec<TortureRow>, Failure> {
    let mut examiner = Examiner::new(device)?;
    examiner.set_torture(settings);
    let mut rows = Vec::new();
    for case in CASES {
        examiner.examine(case)?;
        for row in examiner.take_rows() {
            let row = TortureRow::new(case.name, &row);
            print(&format!("torture set, {}\n", row.cells.join(", ")))?;
            rows.push(row);
        }
    }
    Ok(rows)
}

/// Nothing where the set was not asked for.
pub fn section(rows: &[TortureRow]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let cells = rows.iter().map(|row| row.cells.clone());
    format!(
        "<section>\n<h2>Torture set</h2>\n<p>Scenes that most easily fool an estimate of the error: what was asked, what the engine says, and what is true.</p>\n{}</section>\n",
        table_of_cells(HEADS, cells)
    )
}
