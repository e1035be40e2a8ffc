//! The result of a scene in one line.

use super::results::{Entry, Kind, SceneReport};
use crate::numbers::duration;

/// An error that is small enough for most uses.
const GOOD_ERROR: f64 = 0.05;

/// The smallest error that the engine reaches, and the fastest setting within 5 %.
pub fn summary(scene: &SceneReport) -> String {
    let measured = || {
        scene
            .entries
            .iter()
            .filter_map(|entry| Some((entry, entry.indirect.as_ref()?)))
    };
    let best = measured()
        .filter(|(entry, _)| entry.kind == Kind::Engine)
        .min_by(|(_, a), (_, b)| a.relative_rmse.total_cmp(&b.relative_rmse));
    let Some((best, error)) = best else {
        return "No model error: the indirect light of the reference is black.".into();
    };
    let fastest = |is_in: &dyn Fn(&Entry) -> bool| {
        measured()
            .filter(|(entry, error)| error.relative_rmse <= GOOD_ERROR && is_in(entry))
            .map(|(entry, _)| entry)
            .min_by(|a, b| a.seconds.median.total_cmp(&b.seconds.median))
            .map_or("none".to_owned(), |entry| {
                let time = duration(entry.seconds.median);
                format!("{} in {time}", entry.name())
            })
    };
    format!(
        "Least error of camlux: {} in {} ({}). Fastest below 5 %: {} of camlux, {} of all.",
        error.text(),
        duration(best.seconds.median),
        best.name(),
        fastest(&|entry| entry.kind == Kind::Engine),
        fastest(&|_| true),
    )
}
