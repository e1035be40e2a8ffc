//! `camlux compare`: how far an image is from a reference, without the noise of either.

mod json;
mod layers;
mod table;

use std::path::{Path, PathBuf};

use camlux::metrics::{Comparison, Pixels};
use camlux::output::{LayeredImage, OutputFile};

use crate::error_map::{self, ErrorMap};
use crate::output::{file_behind, require_extension};
use crate::{Failure, print, warn};
use layers::LayerPair;

#[derive(clap::Args)]
pub struct Args {
    /// OpenEXR image to judge
    #[arg(value_name = "IMAGE.exr")]
    image: PathBuf,
    /// OpenEXR image to judge it by; its layer stderr, if it has one, is taken as the standard error of its indirect light,
    /// and the pixels marked in its layer edge are left out
    #[arg(value_name = "REFERENCE.exr")]
    reference: PathBuf,
    /// Compare this layer; may be given more than once. Without it: indirect, direct and radiance, as far as both have them
    #[arg(long = "layer", value_name = "NAME")]
    layers: Vec<String>,
    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
    /// Also draw where the image is too dark (blue) and too bright (red), for the first layer compared
    #[arg(long, value_name = "FILE.png")]
    error_map: Option<PathBuf>,
}

/// Both images, and what came out for each layer.
struct Report<'run> {
    args: &'run Args,
    resolution_px: [u32; 2],
    /// Those that show a surface.
    valid_pixels: usize,
    /// Those among them that lie on an edge; `None` where the reference does not say.
    edge_pixels: Option<usize>,
    layers: Vec<LayerReport>,
}

struct LayerReport {
    name: String,
    unit: &'static str,
    comparison: Comparison,
    /// With the pixels on edges, which `comparison` leaves out; `None` where the reference does not say which they are.
    with_edges: Option<Comparison>,
}

impl Report<'_> {
    /// Edge pixels over those that show a surface.
    fn edge_share(&self) -> Option<f64> {
        Some(self.edge_pixels? as f64 / self.valid_pixels.max(1) as f64)
    }
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let map_file = args
        .error_map
        .as_deref()
        .map(|path| create_map(path, args))
        .transpose()?;
    let image = LayeredImage::read(&args.image)?;
    let reference = LayeredImage::read(&args.reference)?;
    if image.resolution_px() != reference.resolution_px() {
        let size = |image: &LayeredImage| {
            let [width, height] = image.resolution_px();
            format!("{width} x {height}")
        };
        return Err(format!(
            "{} has {} pixels and {} has {}; render the image in the reference's size (--size)",
            args.image.display(),
            size(&image),
            args.reference.display(),
            size(&reference)
        )
        .into());
    }
    if let Some(differ) = layers::differing_scenes(&image, &reference) {
        warn(format_args!(
            "the headers of the images differ in {differ}: are they of one scene?"
        ));
    }
    let valid = reference.surface_pixels();
    let edges = reference.edge_pixels();
    let pairs = layers::select(args, &image, &reference)?;
    let mut reports = Vec::new();
    for pair in &pairs {
        let comparison = Comparison::new(&pixels(pair, &valid, edges.as_deref()))?;
        let with_edges = match edges {
            Some(_) => Some(Comparison::new(&pixels(pair, &valid, None))?),
            None => None,
        };
        let non_finite = with_edges.as_ref().unwrap_or(&comparison).non_finite_image;
        if non_finite > 0 {
            warn(format_args!(
                "{non_finite} values of layer {} of {} are not finite numbers; they are left out",
                pair.name,
                args.image.display()
            ));
        }
        reports.push(LayerReport {
            name: pair.name.clone(),
            unit: pair.unit,
            comparison,
            with_edges,
        });
    }
    let report = Report {
        args,
        resolution_px: image.resolution_px(),
        valid_pixels: valid.iter().filter(|&&is_valid| is_valid).count(),
        edge_pixels: edges.as_ref().map(|edges| {
            let pairs = valid.iter().zip(edges);
            pairs.filter(|&(&valid, &edge)| valid && edge).count()
        }),
        layers: reports,
    };
    if let (Some(file), Some(pair), Some(layer)) = (map_file, pairs.first(), report.layers.first())
    {
        write_map(
            file,
            pair,
            layer,
            &pixels(pair, &valid, edges.as_deref()),
            report.resolution_px,
        )?;
    }
    print(&if args.json {
        json::text(&report)
    } else {
        table::text(&report)
    })
}

fn pixels<'a>(pair: &'a LayerPair, valid: &'a [bool], edges: Option<&'a [bool]>) -> Pixels<'a> {
    Pixels {
        image: &pair.image,
        reference: &pair.reference,
        image_standard_error: pair.image_standard_error,
        reference_standard_error: pair.reference_standard_error,
        valid,
        edges,
        channels: pair.channels,
    }
}

fn create_map(path: &Path, args: &Args) -> Result<OutputFile, Failure> {
    require_extension("--error-map", path, "png")?;
    for input in [&args.image, &args.reference] {
        if file_behind(path) == file_behind(input) {
            let path = path.display();
            return Err(format!("--error-map {path} is an input; give it another name").into());
        }
    }
    Ok(OutputFile::create(path)?)
}

fn write_map(
    file: OutputFile,
    pair: &LayerPair,
    layer: &LayerReport,
    pixels: &Pixels,
    resolution_px: [u32; 2],
) -> Result<(), Failure> {
    let Some(map) = ErrorMap::new(resolution_px, pixels) else {
        let path = file.path().display();
        return Err(format!(
            "{path}: no error map of layer {}: there is no reference value to relate it to; pick another --layer",
            pair.name
        )
        .into());
    };
    let title = error_map::Title {
        layer: &layer.name,
        reference_mean: layer.comparison.reference_mean,
        unit: layer.unit,
    };
    error_map::write_png(file, &map, &title)
}
