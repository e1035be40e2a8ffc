//! What a frame cost so far.

use crate::{
    Result,
    output::PassTime,
    passes::{
        bounce::BounceStats,
        gather::{GatherStats, ListedVpls},
    },
    vulkan::{PassTimes, Recorder},
};

#[derive(Default)]
pub(crate) struct Cost {
    times: PassTimes,
    pub submissions: u32,
    pub vpl_count: u64,
    pub pairs: u64,
    pub rays: u64,
    /// relRMSE of the indirect light against the true bounce.
    pub estimated_error: Option<f64>,
    /// relRMSE of the indirect light against the sum at every pixel.
    pub estimated_interpolation_error: Option<f64>,
}

impl Cost {
    /// Submits recorded passes, waits for them and counts them in.
    pub fn submit(&mut self, recorder: Recorder) -> Result<()> {
        self.times.extend(recorder.submit()?);
        self.submissions += 1;
        Ok(())
    }

    /// Counts a light's VPLs in.
    pub fn add_vpls(&mut self, listed: Option<ListedVpls>) {
        self.vpl_count += listed.map_or(0, |listed| listed.count().into());
    }

    /// Counts a light's gather in.
    pub fn add_gather(&mut self, gathered: GatherStats) {
        self.pairs += gathered.pairs;
        self.submissions += gathered.submissions;
        self.times.extend(gathered.times);
    }

    /// Counts the rays of the bounce in.
    pub fn add_bounce(&mut self, stats: BounceStats) {
        self.rays += stats.rays;
        self.submissions += stats.submissions;
        self.times.extend(stats.times);
    }

    /// Times of the same pass added up, in the order of first appearance.
    pub fn passes(&self) -> Vec<PassTime> {
        let mut passes: Vec<PassTime> = Vec::new();
        for &(name, milliseconds) in &self.times {
            match passes.iter_mut().find(|pass| pass.name == name) {
                Some(pass) => pass.milliseconds += milliseconds,
                None => passes.push(PassTime { name, milliseconds }),
            }
        }
        passes
    }
}
