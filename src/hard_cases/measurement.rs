//! The measurement of a case.

/// The errors of a case with their bounds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Measurement {
    pub parts: Vec<Part>,
}

/// One error with its bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// The subject of the measurement; empty if the case has only one.
    pub of: String,
    /// The quantity: a layer, or a way to compute it.
    pub quantity: String,
    /// Error relative to the ground truth, unless `quantity` says otherwise; infinite if a value is not finite.
    pub error: f64,
    pub bound: f64,
}

impl Part {
    pub fn is_met(&self) -> bool {
        self.error <= self.bound
    }

    /// The error as a share of its bound, for comparisons.
    fn share(&self) -> f64 {
        if self.error == 0.0 {
            0.0
        } else {
            self.error / self.bound
        }
    }
}

impl Measurement {
    /// Whether every error is within its bound. A case that measures nothing does not pass.
    pub fn is_met(&self) -> bool {
        !self.parts.is_empty() && self.parts.iter().all(Part::is_met)
    }

    /// The part with the largest share of its bound.
    pub fn worst(&self) -> Option<&Part> {
        let by_share = |a: &&Part, b: &&Part| a.share().total_cmp(&b.share());
        self.parts.iter().max_by(by_share)
    }

    /// The worst part of each quantity, ordered by the first occurrence of each quantity.
    pub fn worst_of_each_quantity(&self) -> Vec<&Part> {
        let mut worst: Vec<&Part> = Vec::new();
        for part in &self.parts {
            match worst.iter_mut().find(|w| w.quantity == part.quantity) {
                None => worst.push(part),
                Some(other) if part.share() > other.share() => *other = part,
                Some(_) => {}
            }
        }
        worst
    }
}
