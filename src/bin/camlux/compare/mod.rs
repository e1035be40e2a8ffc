//! `camlux compare`: measures how far an image is from a reference, without the noise of either.

mod json;
mod layers;
mod table;

use std::path::PathBuf;

use camlux::metrics::{Comparison, ZScores};
use camlux::output::{LayeredImage, OutputFile};

use crate::error_map::{self, ErrorMap};
use crate::output::{file_behind, require_extension};
use crate::range_error::RangeErrors;
use crate::{Failure, print, warn};
use layers::LayerPair;

#[derive(clap::Args)]
#[command(after_help = "\
Example:
  camlux compare cornell.exr reference.exr --error-map errors.png
camlux subtracts the reference's noise (its layer stderr) and leaves out its edge pixels: docs/accuracy.md")]
pub struct Args {
    /// OpenEXR image to measure
    #[arg(value_name = "IMAGE.exr")]
    image: PathBuf,
    /// OpenEXR image to compare it with
    #[arg(value_name = "REFERENCE.exr")]
    reference: PathBuf,
    /// Layer to compare, may be repeated; A=B where the names differ [default: all light]
    #[arg(long = "layer", value_name = "NAME[=NAME]")]
    layers: Vec<String>,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Draw errors: blue is too dark, red too bright
    #[arg(long, value_name = "FILE.png")]
    error_map: Option<PathBuf>,
}

/// Both images, and the result for each layer.
struct Report<'run> {
    args: &'run Args,
    resolution_px: [u32; 2],
    /// Pixels that show a surface.
    valid_pixels: usize,
    /// Those of them that are on an edge; `None` if the reference does not mark edges.
    edge_pixels: Option<usize>,
    layers: Vec<LayerReport<'run>>,
}

struct LayerReport<'run> {
    pair: LayerPair<'run>,
    comparison: Comparison,
    /// Includes the pixels on edges, which `comparison` leaves out; `None` if the reference does not mark edges.
    with_edges: Option<Comparison>,
    /// The render's errors divided by the standard errors in its layer stderr.
    stated: Option<ZScores>,
    /// For time of flight.
    range_errors_m: Option<RangeErrors>,
    /// The range errors that the reference's noise alone would cause.
    range_noise_m: Option<RangeErrors>,
}

impl Report<'_> {
    /// Edge pixels divided by pixels that show a surface.
    fn edge_share(&self) -> Option<f64> {
        Some(self.edge_pixels? as f64 / self.valid_pixels.max(1) as f64)
    }
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let map_file = create_map(args)?;
    let image = LayeredImage::read(&args.image)?;
    let reference = LayeredImage::read(&args.reference)?;
    if image.resolution_px() != reference.resolution_px() {
        let [a, b] = [&args.image, &args.reference].map(|path| path.display());
        let [[width, height], [due_width, due_height]] =
            [image.resolution_px(), reference.resolution_px()];
        return Err(format!(
            "{a} has {width} x {height} pixels and {b} has {due_width} x {due_height}; render the image in the reference's size (--size)"
        )
        .into());
    }
    if let Some(differ) = layers::differing_scenes(&image, &reference) {
        warn(format_args!(
            "the headers of the images differ in {differ}; check that both show the same scene"
        ));
    }
    if let Some([found, due]) = layers::differing_bounces(args, &image, &reference) {
        let [a, b] = [&args.image, &args.reference].map(|path| path.display());
        warn(format_args!(
            "{a} has indirect light of up to {found} bounces and {b} of up to {due}; the difference counts as error; give both the same --bounces"
        ));
    }
    let mut valid = reference.surface_pixels();
    for (path, file) in [(&args.image, &image), (&args.reference, &reference)] {
        let held = file.data_pixels();
        let missing = held.iter().filter(|&&is_held| !is_held).count();
        if missing > 0 {
            warn(format_args!(
                "{missing} pixels are outside of the data window of {}; they are left out",
                path.display()
            ));
        }
        for (is_valid, is_held) in valid.iter_mut().zip(held) {
            *is_valid &= is_held;
        }
    }
    let edges = reference.edge_pixels();
    let mut layers = Vec::new();
    for pair in layers::select(args, &image, &reference)? {
        let compare = |edges| Comparison::new(&pair.pixels(&valid, edges));
        let comparison = compare(edges.as_deref())?;
        let with_edges = edges.as_ref().map(|_| compare(None)).transpose()?;
        let non_finite = with_edges.as_ref().unwrap_or(&comparison).non_finite_image;
        if non_finite > 0 {
            warn(format_args!(
                "{non_finite} values of layer {} of {} are not finite numbers; they are left out",
                pair.name(),
                args.image.display()
            ));
        }
        layers.push(LayerReport {
            stated: pair.judge(&valid, edges.as_deref())?,
            range_errors_m: pair.range_errors_m(&valid, edges.as_deref()),
            range_noise_m: pair.range_noise_m(&valid, edges.as_deref()),
            pair,
            comparison,
            with_edges,
        });
    }
    let resolution_px = image.resolution_px();
    if let (Some(file), Some(layer)) = (map_file, layers.first()) {
        let (name, unit) = (&*layer.pair.name(), layer.pair.unit);
        let pixels = layer.pair.pixels(&valid, edges.as_deref());
        let map = ErrorMap::new(resolution_px, &pixels, &layer.comparison).ok_or_else(|| {
            let path = file.path().display();
            format!("{path}: no error map of layer {name}: the reference has no light there; choose another --layer")
        })?;
        error_map::write_png(file, &map, name, unit)?;
    }
    // The same for every layer.
    let edge_pixels = layers.first().map(|layer| layer.comparison.edge_pixels);
    let report = Report {
        args,
        resolution_px,
        valid_pixels: valid.iter().filter(|&&is_valid| is_valid).count(),
        edge_pixels: edges.and(edge_pixels),
        layers,
    };
    if args.json {
        return print(&json::text(&report));
    }
    print(&table::text(&report))?;
    match &args.error_map {
        Some(path) => print(&format!("wrote   {} (error map)\n", path.display())),
        None => Ok(()),
    }
}

fn create_map(args: &Args) -> Result<Option<OutputFile>, Failure> {
    let Some(path) = &args.error_map else {
        return Ok(None);
    };
    require_extension("--error-map", path, "png")?;
    for input in [&args.image, &args.reference] {
        if file_behind(path) == file_behind(input) {
            let path = path.display();
            return Err(format!("--error-map {path} is an input; give it another name").into());
        }
    }
    Ok(Some(OutputFile::create(path)?))
}
