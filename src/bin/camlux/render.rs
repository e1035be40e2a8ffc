//! `camlux render`: renders a scene file to image files.

use std::path::PathBuf;
use std::time::Instant;

use camlux::output::{
    ExrCompression, ExrOptions, Frame, Layer, LayerNeed, OutputFile, PngView, write_exr_files,
    write_png,
};
use camlux::{Device, Plan, RenderOptions, Renderer, Scene, Tracer};

use crate::indirect::IndirectArgs;
use crate::options::{DeviceArgs, SizeArgs};
use crate::output::{file_behind, require_extension, with_warnings};
use crate::progress::{ProgressDisplay, stop_on_signals};
use crate::summary::{self, RunSummary};
use crate::{Failure, json, print, tell, tof_picture, warn};

/// Of OpenEXR files, unless another one is requested.
pub const COMPRESSION: ExrCompression = ExrCompression::Rle;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  camlux render scenes/cornell_spot.toml -o cornell.exr --png cornell.png --size 400 400
  camlux render scenes/cornell_spot.toml -o cornell.exr --target-error 0.01 --layers radiance,depth
Layers, scene files, estimators: docs/output.md, docs/scene.md, docs/guides/estimators.md")]
pub struct Args {
    /// Scene file
    #[arg(value_name = "SCENE.toml")]
    pub scene: PathBuf,
    /// OpenEXR file to write
    #[arg(short, long, value_name = "FILE.exr", required_unless_present = "plan")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub size: SizeArgs,
    #[command(flatten)]
    pub indirect: IndirectArgs,
    #[command(flatten)]
    pub device: DeviceArgs,
    /// Write a preview: direct, indirect and total light side by side
    #[arg(long, value_name = "FILE.png", requires = "output")]
    pub png: Option<PathBuf>,
    /// Write statistics as JSON; - is stdout
    #[arg(long, value_name = "FILE.json", requires = "output")]
    pub stats: Option<PathBuf>,
    /// Print the passes; without -o, render nothing
    #[arg(long)]
    pub plan: bool,
    /// Print the time of each pass, counts and the device
    #[arg(short, long)]
    pub verbose: bool,
    /// What traces rays: host, query or kernel [default: the fastest]
    #[arg(long, value_name = "TRACER", value_parser = parse_tracer)]
    pub tracer: Option<Tracer>,
    /// Store light and normals as 16-bit floats
    #[arg(long, requires = "output")]
    pub half: bool,
    /// Write FILE.LAYER.exr for each layer, with channels R, G, B or Y
    #[arg(long, requires = "output")]
    pub plain: bool,
    /// Write a part for each layer, with channels such as R
    #[arg(long, requires = "output", conflicts_with = "plain")]
    pub multipart: bool,
    /// Compression: none, rle, zips, zip or piz [default: rle]
    #[arg(long, value_name = "WAY", value_parser = parse_compression, requires = "output")]
    pub compression: Option<ExrCompression>,
    /// Write only these layers, such as radiance,depth
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = parse_layer, requires = "output")]
    pub layers: Option<Vec<Layer>>,
}

fn parse_tracer(name: &str) -> Result<Tracer, String> {
    let tracer = Tracer::ALL.into_iter().find(|tracer| tracer.name() == name);
    tracer.ok_or_else(|| "the tracers are host, query, kernel".into())
}

fn parse_compression(name: &str) -> Result<ExrCompression, String> {
    let names = || ExrCompression::ALL.map(ExrCompression::name).join(", ");
    ExrCompression::from_name(name).ok_or_else(|| format!("the ways are {}", names()))
}

pub fn parse_layer(name: &str) -> Result<Layer, String> {
    let layer = Layer::from_name(name).filter(|layer| layer.is_rendered());
    layer.ok_or_else(|| format!("the layers are {}", layer_names()))
}

/// Also a layer that only frames of a sequence have.
pub fn parse_layer_of_sequence(name: &str) -> Result<Layer, String> {
    let layer = Layer::from_name(name).filter(|layer| layer.need() == LayerNeed::Sequence);
    layer.map_or_else(|| parse_layer(name), Ok)
}

fn layer_names() -> String {
    let rendered = Layer::all().filter(|layer| layer.is_rendered());
    // There are too many layers of bounces and of time of flight to list them.
    let listed = rendered.filter(|layer| match layer {
        Layer::Bounce(number) => number.get() == 1,
        layer => !matches!(layer, Layer::Tof(..)),
    });
    let names: Vec<String> = listed
        .map(|layer| match layer {
            Layer::Bounce(_) => format!("{} and so on", layer.name()),
            _ => layer.name().into(),
        })
        .collect();
    format!("{}, and with [tof] tof0.range and so on", names.join(", "))
}

pub fn run(args: &Args) -> Result<(), Failure> {
    stop_on_signals();
    // Checks the output path first, so that a long computation does not end in a write error.
    let outputs = Outputs::create(args)?;

    let (mut wall, mut start) = (Vec::new(), Instant::now());
    let mut end_step = |name| {
        wall.push((name, start.elapsed().as_secs_f64() * 1e3));
        start = Instant::now();
    };
    let scene = load(args)?;
    let mut warnings = scene.warnings();
    warnings.iter().for_each(warn);
    end_step("load");

    let device = Device::open(&args.device.options())?;
    if args.plan {
        let mut plan = Plan::new(&scene, device.info())?;
        if let Some(tracer) = args.tracer {
            plan.trace_by(tracer, device.info())?;
        }
        let plan = plan.to_string();
        match outputs {
            Some(_) => tell(plan.trim_end()),
            None => print(&format!("{}\n", plan.trim_end()))?,
        }
    }
    let Some(outputs) = outputs else {
        return Ok(());
    };
    let mut renderer = Renderer::new(&device)?;
    end_step("device");

    let mut display = ProgressDisplay::new();
    let mut show = |progress| display.show(progress);
    let layers = layers_to_read(args, &scene);
    let mut options = RenderOptions {
        progress: Some(&mut show),
        layers: layers.as_deref(),
        tracer: args.tracer,
        ..RenderOptions::default()
    };
    let rendered = renderer.render(&scene, &mut options);
    // The bar must be gone before the next line is written.
    drop(display);
    let frame = rendered?;
    end_step("render");

    let mut written = Vec::new();
    let exr_options = ExrOptions {
        half: args.half,
        layers: args.layers.clone(),
        plain: args.plain,
        multipart: args.multipart,
        compression: args.compression.unwrap_or(COMPRESSION),
        ..ExrOptions::default()
    };
    let of_frame = [frame.warnings(), exr_options.warnings(&frame)].concat();
    of_frame.iter().for_each(warn);
    warnings.extend(of_frame);
    let files = write_exr_files(outputs.exr.path(), &frame, &exr_options)?.files;
    written.extend(files.into_iter().map(|path| ("OpenEXR".to_owned(), path)));
    end_step("write_exr");

    if let Some(file) = outputs.png {
        let path = file.path().to_owned();
        let content = match &frame.description.tof {
            Some(tof) => tof_picture::write_png(file, &frame, tof)?,
            None => write_preview(file, &frame)?,
        };
        written.push((content, path));
    }
    end_step("write_png");

    if let Some(file) = &outputs.stats {
        written.push(("JSON".to_owned(), file.path().to_owned()));
    }
    let run = RunSummary {
        scene: &args.scene,
        layers: args.layers.as_deref(),
        half: args.half,
        frame: &frame,
        wall,
        written,
        warnings,
    };
    match outputs.stats {
        Some(file) => file.commit_with(json::text(&run).as_bytes())?,
        None if args.stats.is_some() => print(&json::text(&run))?,
        None => {}
    }
    tell(summary::text(&run, args.verbose).trim_end());
    Ok(())
}

/// The layers that the files show, and those that warnings look at. `None`: all.
fn layers_to_read(args: &Args, scene: &Scene) -> Option<Vec<Layer>> {
    let mut layers = args.layers.clone()?;
    if args.png.is_some() {
        match &scene.tof {
            Some(tof) => layers.extend(tof_picture::layers(tof)),
            None => layers.extend(PngView::SideBySide.panels()),
        }
    }
    Some(with_warnings(&layers, scene))
}

/// Writes the preview of a frame's light. Returns a description of what it shows.
fn write_preview(file: OutputFile, frame: &Frame) -> Result<String, Failure> {
    let view = PngView::for_frame(frame);
    let preview = write_png(file, frame, view)?;
    let white = format!("white = {:.3e} W/sr/m^2", preview.white_radiance);
    Ok(match view {
        PngView::Radiance => format!("radiance, {white}"),
        PngView::SideBySide => format!("direct | indirect | total in one exposure, {white}"),
    })
}

/// The files to write. Each is under construction next to its final name.
struct Outputs {
    /// Only its name is used: plain files have other names.
    exr: OutputFile,
    png: Option<OutputFile>,
    /// `None` also if they go to stdout.
    stats: Option<OutputFile>,
}

impl Outputs {
    /// `None` if nothing is rendered.
    fn create(args: &Args) -> Result<Option<Self>, Failure> {
        let Some(exr) = &args.output else {
            return Ok(None);
        };
        require_extension("--output", exr, "exr")?;
        if let Some(png) = &args.png {
            require_extension("--png", png, "png")?;
        }
        let paths = [Some(exr), args.png.as_ref(), args.stats.as_ref()];
        let paths: Vec<&PathBuf> = paths.into_iter().flatten().collect();
        let files: Vec<PathBuf> = paths.iter().map(|path| file_behind(path)).collect();
        let scene = file_behind(&args.scene);
        for (index, file) in files.iter().enumerate() {
            let path = paths[index].display();
            if files[..index].contains(file) {
                let problem = "is named for two outputs; give each its own name";
                return Err(format!("{path} {problem}").into());
            }
            if *file == scene {
                let problem = "is the scene file; give the output another name";
                return Err(format!("{path} {problem}").into());
            }
        }
        let stats = args.stats.as_ref();
        let stats = stats.filter(|path| path.as_os_str() != "-");
        let create = |path: &PathBuf| OutputFile::create(path);
        Ok(Some(Outputs {
            exr: create(exr)?,
            png: args.png.as_ref().map(create).transpose()?,
            stats: stats.map(create).transpose()?,
        }))
    }
}

fn load(args: &Args) -> Result<Scene, Failure> {
    let mut scene = args.size.load(&args.scene)?;
    let (indirect, note) = args.indirect.apply(scene.indirect)?;
    scene.indirect = indirect;
    if let Some(note) = note {
        tell(&format!("camlux: note: {note}"));
    }
    for layer in args.layers.as_deref().unwrap_or_default() {
        layer.check_made_for(&scene)?;
    }
    Ok(scene)
}
