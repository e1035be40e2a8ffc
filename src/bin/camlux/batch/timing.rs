//! When a frame, or each phase image of a time-of-flight camera, is exposed: `[time]` of a job.

use camlux::keys::{Keys, Value};
use camlux::scene::TimeOfFlight;
use camlux::{Result, Scene};

use crate::Failure;
use crate::numbers::duration;

/// Upper limit per exposure; more samples would make no visible difference.
const MOST_SAMPLES: u32 = 1024;

/// The times of a job's frames. Phase images follow one another; those of one frequency come before those of the next.
#[derive(Debug, Clone, Copy)]
pub struct Timing {
    /// Time from the beginning of one frame to the beginning of the next.
    pub frame_interval_s: f64,
    /// Time after each exposure until the next one begins.
    pub readout_time_s: f64,
    /// Number of times within an exposure at which the scene is rendered.
    pub temporal_samples: u32,
}

impl Timing {
    /// Reads the timing of a job; `None` if the job has none.
    pub fn read(keys: &mut Keys) -> Result<Option<Timing>> {
        let Some(mut time) = keys.table("time")? else {
            return Ok(None);
        };
        time.only(&["frame_interval_s", "readout_time_s", "temporal_samples"])?;
        let interval = time.need("frame_interval_s", "frame_interval_s = 0.033")?;
        let frame_interval_s = interval.number()?;
        if !(frame_interval_s > 0.0 && frame_interval_s.is_finite()) {
            let problem = format!("is {frame_interval_s}");
            return Err(interval.error(problem, "give seconds above 0"));
        }
        let readout = |value: &Value| match value.number()? {
            time_s if (0.0..f64::INFINITY).contains(&time_s) => Ok(time_s),
            time_s => Err(value.error(format!("is {time_s}"), "give seconds, 0 or more")),
        };
        let samples = |value: &Value| match value.count()? {
            count @ 1..=MOST_SAMPLES => Ok(count),
            count => {
                let hint = format!("give 1 to {MOST_SAMPLES}");
                Err(value.error(format!("is {count}"), hint))
            }
        };
        Ok(Some(Timing {
            frame_interval_s,
            readout_time_s: time.optional("readout_time_s", readout)?.unwrap_or(0.0),
            temporal_samples: time.optional("temporal_samples", samples)?.unwrap_or(1),
        }))
    }

    /// Rejects a scene without an exposure, and one whose exposures take longer than a frame.
    pub fn check(&self, scene: &Scene, name: &str) -> std::result::Result<(), Failure> {
        let Some(sensor) = scene.sensor else {
            return Err(format!(
                "[time]: {name} has no exposure; add [sensor] with exposure_time_s, or leave [time] out of the job"
            )
            .into());
        };
        if scene.tof.is_none() && self.readout_time_s > 0.0 {
            return Err(format!(
                "[time]: readout_time_s separates phase images, but {name} has none; leave it out, or add [tof] to the scene"
            )
            .into());
        }
        let (count, what) = match &scene.tof {
            Some(tof) => {
                let count = tof.frequencies_hz.len() as u32 * tof.phase_count;
                (count, format!("{count} phase images of {name} take"))
            }
            None => (1, format!("exposure of {name} takes")),
        };
        let taken_s = f64::from(count) * (sensor.exposure_time_s + self.readout_time_s);
        // Decimal seconds add up with a rounding error.
        if taken_s > self.frame_interval_s * (1.0 + 1e-9) {
            return Err(format!(
                "[time]: the {what} {}, longer than frame_interval_s = {}; \
                 raise frame_interval_s, or shorten the exposure",
                duration(taken_s),
                self.frame_interval_s
            )
            .into());
        }
        Ok(())
    }

    /// Time from the beginning of the frame to the beginning of an exposure, seconds.
    pub fn start_s(&self, tof: &TimeOfFlight, exposure_s: f64, image: Image) -> f64 {
        let before = image.frequency as u32 * tof.phase_count + image.phase;
        f64::from(before) * (exposure_s + self.readout_time_s)
    }

    /// Times of the samples of an exposure that begins at `start_s`, from the beginning of the frame, in frames.
    pub fn samples(&self, start_s: f64, exposure_s: f64) -> impl Iterator<Item = f64> + '_ {
        let count = self.temporal_samples;
        (0..count).map(move |i| {
            let share = (f64::from(i) + 0.5) / f64::from(count);
            (start_s + share * exposure_s) / self.frame_interval_s
        })
    }
}

/// A phase image.
#[derive(Clone, Copy)]
pub struct Image {
    pub frequency: usize,
    /// The index within that frequency.
    pub phase: u32,
}

/// The phase images of a camera, in the order of time.
pub fn images(tof: &TimeOfFlight) -> impl Iterator<Item = Image> + '_ {
    let frequencies = 0..tof.frequencies_hz.len();
    frequencies
        .flat_map(|frequency| (0..tof.phase_count).map(move |phase| Image { frequency, phase }))
}
