//! What a case measures.

/// An error beside its bound: of the parts of a case, the one that came nearest to its bound or farthest beyond.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// The part of the case.
    pub what: String,
    /// Relative to the truth, unless `what` names another quantity; infinite where a value is no finite number.
    pub error: f64,
    pub bound: f64,
}

impl Measurement {
    pub(super) fn new(what: impl Into<String>, error: f64, bound: f64) -> Measurement {
        let what: String = what.into(); eprintln!("  DEBUG {what}: {error:.2e} of {bound:.1e}");
        Measurement {
            what,
            error: if error.is_nan() { f64::INFINITY } else { error },
            bound,
        }
    }

    /// Whether the error is within the bound.
    pub fn is_met(&self) -> bool {
        self.error <= self.bound
    }

    /// The one that is the largest share of its bound.
    pub(super) fn worst(parts: impl IntoIterator<Item = Measurement>) -> Measurement {
        let worst = parts.into_iter().max_by(|a, b| {
            let of_bound = |part: &Measurement| match part.error {
                0.0 => 0.0,
                error => error / part.bound,
            };
            of_bound(a).total_cmp(&of_bound(b))
        });
        // A case that measures nothing must not pass.
        worst.unwrap_or_else(|| Measurement::new("nothing", f64::INFINITY, 0.0))
    }

    pub(super) fn prefixed(mut self, prefix: &str) -> Measurement {
        self.what = format!("{prefix}: {}", self.what);
        self
    }
}
