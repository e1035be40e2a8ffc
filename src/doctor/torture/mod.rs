//! The torture set: checks the engine's error estimates on light that is hard to find.
//!
//! Each case renders its scene for several target errors. It compares the target error, the estimated error and the upper bound with the
//! true error.

mod openings;
mod rooms;
mod truth;

use std::path::PathBuf;

pub use self::rooms::{Subject, visible_strip};
use self::truth::Truth;
use super::{Case, Examiner, scenes::with_rays};
use crate::{
    Result,
    metrics::CorrectedRmse,
    output::{Frame, FrameStats},
};

pub const CASES: &[Case] = &[
    Case::new(
        "slit_of_a_fifth_of_a_texel",
        "a strip of light between the centres of the map's texels",
        ESTIMATES,
        |exam| estimates(exam, rooms::slit(0.2)),
    ),
    Case::new(
        "slit_of_half_a_texel",
        "a texel's centre is lit or not, and stands for the whole texel",
        ESTIMATES,
        |exam| estimates(exam, rooms::slit(0.5)),
    ),
    Case::new(
        "slit_of_a_texel",
        "chance decides how many columns of texel centres are lit: one or two",
        ESTIMATES,
        |exam| estimates(exam, rooms::slit(1.0)),
    ),
    Case::new(
        "slit_of_two_texels",
        "the lit texels make a strip half as wide again, or half as wide",
        ESTIMATES,
        |exam| estimates(exam, rooms::slit(2.0)),
    ),
    Case::new(
        "slit_of_five_texels",
        "an error of a tenth, the same all over the image",
        ESTIMATES,
        |exam| estimates(exam, rooms::slit(5.0)),
    ),
    Case::new(
        "slit_of_ten_texels",
        "an error of a twentieth, the same all over the image",
        ESTIMATES,
        |exam| estimates(exam, rooms::slit(10.0)),
    ),
    Case::new(
        "light_moved_behind_a_slit",
        "light through a slit of 1.7 texels flickers as its lamp moves",
        "the image's mean is off by no more than its estimate",
        moved_lamp,
    )
    .long(),
    Case::new(
        "keyhole",
        "only two texels of the whole map matter",
        ESTIMATES,
        |exam| estimates(exam, rooms::keyhole()),
    ),
    Case::new(
        "blinds",
        "slits and texels make a pattern that neither has alone",
        ESTIMATES,
        |exam| estimates(exam, rooms::blinds()),
    ),
    Case::new(
        "lit_strip_in_view",
        "a few bright pixels beside the strip carry the error of the image",
        ESTIMATES,
        |exam| estimates(exam, rooms::visible_strip()),
    ),
    Case::new(
        "three_spots_of_half_a_degree",
        "three dots light the room, and no direction from a pixel hits one",
        ESTIMATES,
        |exam| estimates(exam, rooms::three_spots()),
    ),
    Case::new(
        "light_two_millimetres_off_a_wall",
        "half of the light falls on a dot of 2 mm",
        ESTIMATES,
        |exam| estimates(exam, rooms::lamp_off_a_wall()),
    ),
    Case::new(
        "wires_thinner_than_a_pixel",
        "the objects that block the light are smaller than texels of the map and pixels of the image",
        ESTIMATES,
        |exam| estimates(exam, rooms::wires()),
    ),
    Case::new(
        "highlights_as_the_only_light",
        "a lit point shines in one direction, and most samples add nothing",
        ESTIMATES,
        |exam| estimates(exam, rooms::highlights_alone()),
    ),
    Case::new(
        "few_pixels_show_a_surface",
        "an estimate from two hundred pixels is right by luck",
        ESTIMATES,
        |exam| estimates(exam, rooms::few_pixels()),
    ),
    Case::new(
        "room_of_small_objects",
        "neighbouring texels belong to different surfaces",
        ESTIMATES,
        |exam| estimates(exam, rooms::small_objects()),
    ),
    Case::new(
        "lights_ten_thousand_to_one",
        "nearly all power is in the light of which nearly nothing arrives",
        ESTIMATES,
        |exam| estimates(exam, rooms::unequal_lamps()),
    ),
];

const ESTIMATES: &str = "meets target error and upper bound";

/// Limits of the true error divided by the target error: the first holds for 95 % of all rows, the second for every row.
pub const OVER_REQUESTED: f64 = 1.3;
pub const FAR_OVER_REQUESTED: f64 = 2.0;
/// Limit of the true error divided by its upper bound.
pub const OVER_UPPER_BOUND: f64 = 1.1;
/// Limit of |bias| divided by the upper bound. (The true error is no measure here: errors that the light rays of a set have in common move
/// the mean of an image, also where the noise of each pixel is small.)
pub const BIAS_SHARE: f64 = 0.5;
/// A bias is an expectation, and one image is one draw. If it is over [`BIAS_SHARE`], the mean over this many turned images counts.
const BIAS_IMAGES: u32 = 16;
/// Limit of the spread of the image's mean while a lamp moves, divided by the mean estimated error.
const SPREAD_OVER_ESTIMATE: f64 = 1.5;
/// Noise of a sampled reference, divided by the smallest target error.
const TRUTH_NOISE: f64 = 0.25;

/// How the cases of this set are rendered.
#[derive(Debug, Clone)]
pub struct Settings {
    pub target_errors: Vec<f64>,
    /// Edge of the images, pixels.
    pub size_px: u32,
    /// Number of images of each scene. Each is turned by a degree or two, so that maps and samples fall elsewhere. At least 1.
    pub variations: u32,
    /// Folder that stores sampled references; `None`: they are not stored.
    pub truths: Option<PathBuf>,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            target_errors: vec![0.1, 0.05],
            size_px: 32,
            variations: 1,
            truths: None,
        }
    }
}

/// One image compared with the ground truth. Errors are relRMSEs of the indirect light, 1 = 100 %.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    pub requested: f64,
    /// The engine's estimated error; `None`: it has found no light.
    pub estimated: Option<f64>,
    /// The engine's upper bound with a confidence of 95 %.
    pub upper_bound: Option<f64>,
    /// Infinite if the image holds a value that is not finite.
    pub true_error: f64,
    /// Standard error of `true_error`, because the ground truth may have noise. Infinite if the noise hides the error; `true_error` is then
    /// an upper bound.
    pub uncertainty: f64,
    /// Σx/Σt − 1, and its standard error.
    pub bias: f64,
    pub bias_uncertainty: f64,
    /// |bias| beyond the noise of the ground truth, divided by the upper bound; infinite if the engine states no bound. If the image exceeds
    /// [`BIAS_SHARE`], this is the mean over sixteen turned images, unless the settings request variations.
    pub bias_share: f64,
    pub ray_count: u64,
    pub milliseconds: f64,
}

impl Row {
    fn new(requested: f64, frame: &Frame, truth: &Truth) -> Result<Row> {
        let comparison = truth.compare(frame)?;
        let is_sound = comparison.non_finite_image == 0;
        let errors = comparison.errors.filter(|_| is_sound);
        let bias = errors.map_or(f64::INFINITY, |errors| errors.bias);
        let uncorrected = errors.map_or(f64::INFINITY, |errors| errors.rmse);
        let (true_error, uncertainty) = match comparison.noise.map(|noise| noise.rmse) {
            _ if !is_sound => (f64::INFINITY, 0.0),
            None => (uncorrected, 0.0),
            Some(CorrectedRmse::Estimate {
                value,
                standard_error,
            }) => (value, standard_error),
            Some(CorrectedRmse::Below(bound)) => (bound, f64::INFINITY),
            Some(CorrectedRmse::ReferenceIsNoise) => (f64::INFINITY, f64::INFINITY),
        };
        let FrameStats {
            estimated_error,
            estimated_error_upper,
            ray_count,
            wall_milliseconds,
            ..
        } = frame.stats;
        let bias_uncertainty = comparison
            .noise
            .map_or(0.0, |noise| noise.bias_standard_error);
        Ok(Row {
            requested,
            estimated: estimated_error,
            upper_bound: estimated_error_upper,
            true_error,
            uncertainty,
            bias,
            bias_uncertainty,
            bias_share: bias_share(&[(bias, estimated_error_upper)], bias_uncertainty),
            ray_count,
            milliseconds: wall_milliseconds,
        })
    }

    /// The true error minus twice its uncertainty, divided by the upper bound; infinite if the engine states no bound. (If an image is much
    /// better than requested, the noise of the ground truth alone must not count against the bound.)
    pub fn over_upper_bound(&self) -> f64 {
        let at_least = match self.uncertainty {
            f64::INFINITY if self.true_error.is_finite() => 0.0,
            f64::INFINITY => f64::INFINITY,
            uncertainty => self.true_error - 2.0 * uncertainty,
        };
        self.upper_bound
            .map_or(f64::INFINITY, |bound| at_least.max(0.0) / bound)
    }

    pub fn over_requested(&self) -> f64 {
        self.true_error / self.requested
    }
}

impl Examiner {
    /// Sets how the cases of the torture set are rendered from now on.
    pub fn set_torture(&mut self, settings: Settings) {
        self.torture = settings;
    }

    /// Returns the images of the torture set since the last call.
    pub fn take_rows(&mut self) -> Vec<Row> {
        std::mem::take(&mut self.rows)
    }
}

/// The mean of images' biases beyond the noise of their ground truth, divided by the mean of their upper bounds.
fn bias_share(images: &[(f64, Option<f64>)], uncertainty: f64) -> f64 {
    let bias: f64 = images.iter().map(|(bias, _)| bias).sum();
    let bounds: Option<f64> = images.iter().map(|(_, bound)| *bound).sum();
    let at_least = (bias.abs() - 2.0 * uncertainty * images.len() as f64).max(0.0);
    bounds.map_or(f64::INFINITY, |bounds| at_least / bounds)
}

/// Measures one row for each target error and variation.
fn estimates(exam: &mut Examiner, subject: Subject) -> Result<()> {
    let settings = exam.torture.clone();
    let subject = subject.resized(settings.size_px);
    let truth = truth_of(exam, &subject, &settings)?;
    for &requested in &settings.target_errors {
        for variation in 0..settings.variations {
            let scene = rooms::varied(&subject.scene, variation);
            let frame = exam.render(&with_rays(&scene, requested))?;
            let mut row = Row::new(requested, &frame, &truth)?;
            if settings.variations == 1 && row.bias_share > BIAS_SHARE {
                let mut images = vec![(row.bias, row.upper_bound)];
                for variation in 1..BIAS_IMAGES {
                    let turned = rooms::varied(&subject.scene, variation);
                    let frame = exam.render(&with_rays(&turned, requested))?;
                    let turned = Row::new(requested, &frame, &truth)?;
                    images.push((turned.bias, turned.upper_bound));
                }
                row.bias_share = bias_share(&images, row.bias_uncertainty);
            }
            let of = asked(requested);
            for (quantity, error, bound) in [
                (
                    "true over target error",
                    row.over_requested(),
                    OVER_REQUESTED,
                ),
                (
                    "true over upper bound",
                    row.over_upper_bound(),
                    OVER_UPPER_BOUND,
                ),
                ("bias over upper bound", row.bias_share, BIAS_SHARE),
            ] {
                exam.record(&of, quantity, error, bound);
            }
            exam.rows.push(row);
        }
    }
    Ok(())
}

/// Measures the spread of the image's mean over twenty positions of the lamp.
fn moved_lamp(exam: &mut Examiner) -> Result<()> {
    const STEPS: u32 = 20;
    let settings = exam.torture.clone();
    for &requested in &settings.target_errors {
        let mut biases = Vec::new();
        let mut estimates = Vec::new();
        for step in 0..STEPS {
            let subject = rooms::moved_lamp(step).resized(settings.size_px);
            let truth = truth_of(exam, &subject, &settings)?;
            let frame = exam.render(&with_rays(&subject.scene, requested))?;
            let row = Row::new(requested, &frame, &truth)?;
            biases.push(row.bias);
            estimates.push(row.estimated.unwrap_or(0.0));
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / f64::from(STEPS);
        let about = mean(&biases);
        let squares: f64 = biases.iter().map(|bias| (bias - about).powi(2)).sum();
        let spread = (squares / f64::from(STEPS - 1)).sqrt();
        let quantity = "spread of the mean over the estimate";
        let over = spread / mean(&estimates);
        exam.record(&asked(requested), quantity, over, SPREAD_OVER_ESTIMATE);
    }
    Ok(())
}

fn asked(requested: f64) -> String {
    format!("{} % target error", 100.0 * requested)
}

/// The ground truth, with a noise well below all target errors.
fn truth_of(exam: &Examiner, subject: &Subject, settings: &Settings) -> Result<Truth> {
    let smallest = settings.target_errors.iter().copied();
    let smallest = smallest.fold(f64::INFINITY, f64::min);
    let folder = settings.truths.as_deref();
    Truth::new(
        subject,
        TRUTH_NOISE * smallest,
        folder,
        exam.sub_pixel_bits(),
    )
}
