//! `camlux report`: measures speed against error for every setting that trades one for the other.

mod figures;
mod growth;
mod html;
mod labels;
mod machine;
mod measured;
mod page;
mod pareto;
mod peers;
mod picture;
mod plot;
mod reference_image;
mod results;
mod settings;
mod steps;
mod stopwatch;
mod style;
mod summary;
mod sweep;
mod torture;

use std::path::{Path, PathBuf};

use camlux::output::OutputFile;
use camlux::{Device, Renderer, Scene};

use self::machine::Machine;
use self::measured::{Counts, Measured};
use self::peers::PeerRun;
use self::results::{Peers, Report, SceneReport};
use self::steps::Steps;
use self::stopwatch::Stopwatch;
use self::sweep::{Sweep, SweepOptions};
use crate::options::{DeviceArgs, SizeArgs, warn_of};
use crate::output::create_folder;
use crate::progress::stop_on_signals;
use crate::{Failure, print, tell};

/// Longer edge of the images of a quick report.
const QUICK_SIZE_PX: u32 = 160;

#[derive(clap::Args)]
#[command(after_help = "\
Example:
  camlux report scenes/cornell.toml -o report --quick
What the page shows: docs/report.md")]
pub struct Args {
    /// Scene files
    #[arg(value_name = "SCENE.toml", required = true)]
    pub scenes: Vec<PathBuf>,
    /// Folder for the report; an interrupted one is continued
    #[arg(short, long, value_name = "FOLDER")]
    pub output: PathBuf,
    /// Under a minute a scene: small images, coarse references
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    pub size: SizeArgs,
    #[command(flatten)]
    pub device: DeviceArgs,
    /// Program that renders with other engines: benches/peers/run
    #[arg(long, value_name = "PROGRAM")]
    pub peers: Option<PathBuf>,
    /// Add the torture set of camlux doctor
    #[arg(long)]
    pub torture: bool,
    /// Only measure how time grows with triangles and pixels
    #[arg(long, conflicts_with_all = ["peers", "torture", "stderr"])]
    pub growth: bool,
    /// Relative standard error of references [default: 0.01, quick 0.03]
    #[arg(long, value_name = "SHARE", value_parser = crate::reference::parse_share)]
    pub stderr: Option<f64>,
}

/// A scene and its name in the report.
struct Subject {
    name: String,
    file: PathBuf,
    scene: Scene,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    stop_on_signals();
    // Checks the output path first, so that a long computation does not end in a write error.
    let folder = &args.output;
    create_folder(&folder.join("reference"))?;
    let json_file = OutputFile::create(folder.join("report.json"))?;
    let page_file = OutputFile::create(folder.join("index.html"))?;
    let subjects = load(args)?;
    share_threads()?;

    let device = Device::open(&args.device.options())?;
    let mut renderer = Renderer::new(&device)?;
    let machine = Machine::look(device.info());
    let measured = Measured::new(folder.join("measured"), &machine);
    let mut report = Report {
        machine,
        quick: args.quick,
        measurements: Counts::default(),
        scenes: Vec::new(),
        torture: Vec::new(),
        growth: Vec::new(),
    };
    let steps = Steps::new();
    let scratch = folder.join("timing.exr");
    let sub_pixel_bits = device.info().limits.sub_pixel_bits;
    for subject in &subjects {
        if args.growth {
            let mut stopwatch = Stopwatch::new(&mut renderer, &scratch, &steps, args.quick);
            let rows = growth::rows(subject, &mut stopwatch, &measured)?;
            report.growth.extend(rows);
            continue;
        }
        let stopwatch = Stopwatch::new(&mut renderer, &scratch, &steps, args.quick);
        let scene = examine(args, subject, stopwatch, &measured, sub_pixel_bits)?;
        print(&format!("{}: {}\n", scene.name, summary::summary(&scene)))?;
        report.scenes.push(scene);
    }
    if args.torture {
        let mut settings = crate::torture::settings(&folder.join("reference/torture"));
        if args.quick {
            settings.target_errors = vec![0.1];
        }
        report.torture = torture::rows(&device, settings, &measured)?;
    }
    for scene in &report.scenes {
        let name = |what: &str| format!("{}-{what}", scene.name);
        write_plot(folder, &name("model-error"), figures::model_error(scene)?)?;
        write_plot(folder, &name("kernel-error"), figures::kernel_error(scene)?)?;
        for frequency in 0..scene.reference.range_noise_m.len() {
            let plot = figures::range_error(scene, frequency)?;
            write_plot(folder, &name(&format!("range-error-tof{frequency}")), plot)?;
        }
    }
    let triangles = growth::against_triangles(&report.growth)?;
    write_plot(folder, "growth-triangles", triangles)?;
    let pixels = growth::against_pixels(&report.growth)?;
    write_plot(folder, "growth-pixels", pixels)?;
    report.measurements = measured.counts();
    if let Some(note) = report.measurements.note() {
        tell(&note);
    }
    let page = page::page(&report)?;
    // The pictures would make up most of the JSON, and the page has them.
    for entry in report
        .scenes
        .iter_mut()
        .flat_map(|scene| &mut scene.entries)
    {
        entry.pictures = None;
    }
    let json = serde_json::to_string_pretty(&report)?;
    json_file.commit_with(format!("{json}\n").as_bytes())?;
    page_file.commit_with(page.as_bytes())?;
    tell(&format!("wrote {}", folder.join("index.html").display()));
    Ok(())
}

/// The reference uses the same number of threads as lavapipe and the peers if `LP_NUM_THREADS` is set.
fn share_threads() -> Result<(), Failure> {
    let Ok(text) = std::env::var("LP_NUM_THREADS") else {
        return Ok(());
    };
    let count = text.parse().ok().filter(|&count| count > 0);
    let count = count
        .ok_or_else(|| format!("LP_NUM_THREADS is {text:?}; set it to 1 or more, or unset it"))?;
    rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .build_global()
        .map_err(|error| {
            format!("cannot start {count} threads: {error}; lower LP_NUM_THREADS").into()
        })
}

/// Measures one scene: the reference image first, then the engine's settings, the reference's series and the peers against it.
fn examine(
    args: &Args,
    subject: &Subject,
    stopwatch: Stopwatch,
    measured: &Measured,
    sub_pixel_bits: u32,
) -> Result<SceneReport, Failure> {
    let Subject { name, file, scene } = subject;
    let options = SweepOptions::new(args.quick);
    let [width, height] = scene.camera.resolution_px;

    let reference_file = format!("reference/{name}-{width}x{height}.exr");
    let standard_error = args.stderr.unwrap_or(if args.quick { 0.03 } else { 0.01 });
    let (image, reference) = reference_image::obtain(
        scene,
        &args.output,
        reference_file,
        standard_error,
        sub_pixel_bits,
    )?;

    let inputs = (&reference.scene_hash, reference.samples_per_pixel, options);
    let measured = measured.group(&format!("{name}-{width}x{height}"), inputs);
    let (scratch, steps) = (stopwatch.scratch, stopwatch.steps);
    let mut sweep = Sweep {
        stopwatch,
        subject,
        reference: &image,
        measured: &measured,
        options,
    };
    let direct_only = sweep.direct_only()?;
    let (mut entries, skipped) = sweep.settings()?;
    let longest_s = options.longest_reference_s;
    entries.extend(reference_image::series(
        subject, scratch, longest_s, &measured, steps,
    )?);
    let peers = match &args.peers {
        None => Peers {
            status: "not run; --peers PROGRAM adds them".into(),
            ..Peers::default()
        },
        Some(program) => {
            let run = PeerRun {
                program,
                subject,
                folder: args.output.join("peers").join(name),
                is_quick: args.quick,
                reference: &image,
                measured: &measured,
                steps,
            };
            let (of_peers, peers) = run.run()?;
            entries.extend(of_peers);
            peers
        }
    };
    figures::mark_fronts(&mut entries);
    Ok(SceneReport {
        name: name.clone(),
        file: file.to_string_lossy().into_owned(),
        resolution_px: scene.camera.resolution_px,
        triangles: scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum(),
        lights: scene.lights.iter().map(|light| light.kind()).collect(),
        reference,
        direct_only,
        entries,
        skipped,
        peers,
        reference_pictures: image.pictures()?,
    })
}

/// Loads all scenes before the first one is rendered.
fn load(args: &Args) -> Result<Vec<Subject>, Failure> {
    let mut subjects: Vec<Subject> = Vec::new();
    for file in &args.scenes {
        let mut scene = args.size.load(file)?;
        if args.quick && args.size.size_px().is_none() {
            scene.camera = scene.camera.resized(quick_size(scene.camera.resolution_px));
        }
        warn_of(&scene, &file.display());
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        // Two folders may hold scenes of the same name.
        let mut name = stem.to_string();
        let mut number = 1;
        while subjects.iter().any(|subject| subject.name == name) {
            number += 1;
            name = format!("{stem}-{number}");
        }
        let file = file.clone();
        subjects.push(Subject { name, file, scene });
    }
    Ok(subjects)
}

/// The resolution with its longer edge reduced to that of a quick report.
fn quick_size(size_px: [u32; 2]) -> [u32; 2] {
    let longer = size_px[0].max(size_px[1]);
    let scale = (f64::from(QUICK_SIZE_PX) / f64::from(longer)).min(1.0);
    size_px.map(|px| ((f64::from(px) * scale).round() as u32).max(1))
}

fn write_plot(folder: &Path, name: &str, svg: Option<String>) -> Result<(), Failure> {
    let Some(svg) = svg else { return Ok(()) };
    OutputFile::create(folder.join(format!("{name}.svg")))?.commit_with(svg.as_bytes())?;
    Ok(())
}
