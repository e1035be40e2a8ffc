//! How often the true error of an image is above the bound that camlux gives for it: `cargo bench --bench bound -- [FOLDER] [WORD...]`.
//!
//! Renders each scene with several target errors and seeds, and compares every image with a path-traced reference, whose noise is
//! removed. References are kept in `target/bound`. FOLDER: the mesh scenes (`cargo run --release --example generate_scenes -- meshes
//! FOLDER`). WORD: the name of a scene, such as `knot`; a target error, such as 0.05 or, of the range, 5mm; a limit, such as 100ms or 1e6rays; the longer edge of
//! the images, such as 320px; a number of seeds, such as 20seeds; or the number of bounces of images and references, such as 3bounces. Without
//! names, all scenes are rendered; without target errors and limits, those of the list; without a number of bounces, one. `direct` is direct
//! light alone.
//!
//! The times are wall times of frames after the first, on this machine. `foretold` is the time on the device that the renderer predicts for
//! the first frame of a row from the last of the row before, over the time that it takes.
//!
//! The bias is that of the mean over all seeds. With time of flight, the true error is that of the worst quantity, as the target is, and
//! the bias of the bounce's path follows for each frequency, and the rms of the range error of the worst one. With a target of the range,
//! all errors are those of the range; a frame is also over the bound if its light is.

#[path = "shared/two_threads.rs"]
mod two_threads;

use std::{
    env,
    f64::consts::PI,
    fs,
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use camlux::{
    Device, DeviceOptions, RenderOptions, Renderer, Scene,
    metrics::{Comparison, CorrectedRmse, Pixels, range_error_m},
    model::SPEED_OF_LIGHT_M_S,
    output::{
        ExrOptions, Frame, FrameStats, Layer, OutputFile, StopReason, TofQuantity, write_exr,
    },
    reference::{Goal, Reference},
    scene::{DEFAULT_TARGET_ERROR, FinalGather, IndirectLight},
};
use two_threads::Failure;

const SCENES: [&str; 12] = [
    "cornell",
    "cornell_spot",
    "glossy",
    "textured",
    "knot",
    "metals",
    "bumps",
    "leaves",
    "lamp",
    "projector",
    "slit",
    "tof_corner",
];
const MESH_SCENES: [&str; 9] = [
    "blob",
    "clutter",
    "far_light",
    "gear",
    "glossy_head",
    "grass",
    "scan",
    "terrain",
    "two_lights",
];
const TARGET_ERRORS: [f64; 4] = [0.1, 0.05, 0.02, 0.01];
/// With a limit, the target is out of reach.
const LEAST_TARGET: f64 = 0.002;
const SEEDS: u32 = 5;
/// Pixels along the longer edge of the images.
const EDGE_PX: u32 = 128;
/// relRMSE of the references.
const REFERENCE_ERROR: f64 = 0.01;

fn main() -> std::process::ExitCode {
    two_threads::run("bound", report)
}

fn report() -> Result<(), Failure> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    let words: Vec<String> = env::args()
        .skip(1)
        .filter(|word| !word.starts_with('-'))
        .collect();
    let (folders, words): (Vec<_>, Vec<_>) =
        words.into_iter().partition(|word| Path::new(word).is_dir());
    let (mut seeds, mut edge_px, mut bounces) = (SEEDS, EDGE_PX, 1);
    let (mut all_asked, mut names) = (Vec::new(), Vec::new());
    for word in words {
        let number = |unit: &str| word.strip_suffix(unit)?.parse::<f64>().ok();
        let numbers = [number("seeds"), number("px"), number("bounces")];
        match (numbers, Asked::read(&word)) {
            ([Some(count), ..], _) => seeds = count as u32,
            ([_, Some(px), _], _) => edge_px = px as u32,
            ([.., Some(count)], _) => bounces = count as u32,
            (_, Some(asked)) => all_asked.push(asked),
            _ => names.push(word),
        }
    }
    if all_asked.is_empty() {
        all_asked = TARGET_ERRORS.map(Asked::Error).into();
    }
    let scenes = SCENES.map(|name| (name, manifest.join("scenes")));
    let rooms = [("tof_room", manifest.join("tests/data"))];
    let mesh_scenes = MESH_SCENES.map(|name| (name, folders.first().map(PathBuf::from)));
    let mesh_scenes = mesh_scenes
        .into_iter()
        .filter_map(|(name, folder)| Some((name, folder?)));
    let device = Device::open(&DeviceOptions::default())?;
    let mut renderer = Renderer::new(&device)?;
    let mut all = Counts::default();
    println!(
        "{:<14} {:>9} {:>9} {:>7} {:>8} {:>7} {:>7} {:>7} {:>7} {:>8} {:>8}  range, mm; path bias, mm",
        "scene",
        "asked",
        "M rays",
        "ms",
        "foretold",
        "true",
        "worst",
        "claimed",
        "bound",
        "over",
        "bias"
    );
    for (name, folder) in scenes.into_iter().chain(rooms).chain(mesh_scenes) {
        if !names.is_empty() && !names.iter().any(|each| each == name) {
            continue;
        }
        let mut scene = Scene::load(&folder.join(format!("{name}.toml")))?;
        let [width, height] = scene.camera.resolution_px.map(f64::from);
        let scale = f64::from(edge_px) / width.max(height);
        scene.camera.resolution_px = [width, height].map(|px| (scale * px).round() as u32);
        // The estimate is about the light at pixels' centres, not about their samples.
        scene.camera.pixel_sampling = None;
        // The reference has the bounces of the scene, whatever is asked for.
        scene.indirect = Asked::Error(DEFAULT_TARGET_ERROR).indirect(bounces);
        let truth = reference(&scene, name, bounces)?;
        for asked in &all_asked {
            scene.indirect = asked.indirect(bounces);
            if scene.tof.is_none() && matches!(asked, Asked::Range(_)) {
                continue;
            }
            // Later frames have what this one makes.
            let foretold = renderer.foretell_ms(&scene);
            let first = renderer.render(&scene, &mut RenderOptions::default())?;
            let on_device = first.stats.gpu_milliseconds();
            let foretold = foretold.map_or(f64::NAN, |foretold| foretold / on_device);
            let mut counts = Counts::default();
            let mut sums: Option<Vec<Vec<f64>>> = None;
            let mut of_frames = Vec::new();
            let mut range_squares = 0.0;
            for seed in 0..seeds {
                let mut options = RenderOptions {
                    seed,
                    ..Default::default()
                };
                let frame = renderer.render(&scene, &mut options)?;
                let of_light = Judged::of_light(&frame, &truth)?;
                let of_range = Judged::of_range(&frame, &truth)?;
                let asked_range = of_range.filter(|range| range.claimed.is_some());
                counts.add(&frame.stats, [Some(of_light), asked_range]);
                of_frames.push((asked_range.unwrap_or(of_light), frame.stats.clone()));
                range_squares += of_range.map_or(0.0, |range| range.error.powi(2));
                let layers = layers(&truth).into_iter().map(|(layer, _)| {
                    frame.values(layer).map_or_else(Vec::new, |values| {
                        values.iter().copied().map(f64::from).collect()
                    })
                });
                match &mut sums {
                    None => sums = Some(layers.collect()),
                    Some(sums) => {
                        for (sum, layer) in sums.iter_mut().zip(layers) {
                            sum.iter_mut()
                                .zip(layer)
                                .for_each(|(sum, value)| *sum += value);
                        }
                    }
                }
            }
            print_row(name, asked, foretold, &of_frames, &counts);
            let sums = sums.unwrap_or_default();
            let range_mm = scene
                .tof
                .as_ref()
                .map(|_| (range_squares / f64::from(seeds)).sqrt());
            let range = range_mm.map_or(String::new(), |mm| format!("  {mm:>8.2};"));
            println!(
                "{}{range}{}",
                bias(&truth, &sums, seeds),
                path_biases(&scene, &truth, &sums)
            );
            all.join(&counts);
        }
    }
    println!(
        "{} frames: {} over the bound, {} over 1.1 times the bound, {} without a bound, {} missed the target",
        all.frames, all.over, all.far_over, all.unbounded, all.missed
    );
    Ok(())
}

/// What a frame is asked for.
enum Asked {
    Error(f64),
    /// Of the range, mm.
    Range(f64),
    Milliseconds(f64),
    Rays(f64),
    Direct,
}

impl Asked {
    fn read(word: &str) -> Option<Asked> {
        let number = |unit: &str| word.strip_suffix(unit)?.parse().ok();
        if word == "direct" {
            return Some(Asked::Direct);
        }
        let limit = number("ms").map(Asked::Milliseconds);
        let limit = limit.or_else(|| number("mm").map(Asked::Range));
        let limit = limit.or_else(|| number("rays").map(Asked::Rays));
        limit.or_else(|| number("").map(Asked::Error))
    }

    fn indirect(&self, bounces: u32) -> Option<IndirectLight> {
        let target = match self {
            Asked::Error(target) => *target,
            Asked::Range(_) => DEFAULT_TARGET_ERROR,
            _ => LEAST_TARGET,
        };
        let mut gather = FinalGather::new(target);
        gather.bounces = bounces;
        match self {
            Asked::Error(_) => (),
            Asked::Range(mm) => gather.target_range_error_mm = Some(*mm),
            Asked::Milliseconds(ms) => gather.max_ms = Some(*ms),
            Asked::Rays(rays) => gather.max_rays = Some(*rays as u64),
            Asked::Direct => return None,
        }
        Some(gather.into())
    }
}

impl std::fmt::Display for Asked {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let text = match self {
            Asked::Error(target) => format!("{} %", 100.0 * target),
            Asked::Range(mm) => format!("{mm} mm"),
            Asked::Milliseconds(ms) => format!("{ms} ms"),
            Asked::Rays(rays) => format!("{rays:e} rays"),
            Asked::Direct => "direct".into(),
        };
        f.pad(&text)
    }
}

/// Frames, and how their true errors compare with their bounds.
#[derive(Default)]
struct Counts {
    frames: u32,
    over: u32,
    far_over: u32,
    unbounded: u32,
    missed: u32,
}

impl Counts {
    fn add(&mut self, stats: &FrameStats, judged: [Option<Judged>; 2]) {
        self.frames += 1;
        let is_limited = stats.stop == Some(StopReason::BudgetSpent);
        self.missed += u32::from(!is_limited && stats.stop != Some(StopReason::TargetMet));
        self.unbounded += u32::from(stats.estimated_error_upper.is_none());
        let is_over = |factor: f64| {
            let mut judged = judged.iter().flatten();
            judged.any(|each| each.error > factor * each.bound.unwrap_or(f64::INFINITY))
        };
        self.over += u32::from(is_over(1.0));
        self.far_over += u32::from(is_over(1.1));
    }

    fn join(&mut self, other: &Counts) {
        self.frames += other.frames;
        self.over += other.over;
        self.far_over += other.far_over;
        self.unbounded += other.unbounded;
        self.missed += other.missed;
    }
}

fn print_row(
    name: &str,
    asked: &Asked,
    foretold: f64,
    frames: &[(Judged, FrameStats)],
    counts: &Counts,
) {
    let count = frames.len() as f64;
    let rms = |of: &dyn Fn(&Judged) -> f64| {
        let squares = frames.iter().map(|(judged, _)| of(judged).powi(2));
        (squares.sum::<f64>() / count).sqrt()
    };
    let rays: u64 = frames.iter().map(|(_, stats)| stats.ray_count).sum();
    let of_frames = frames.iter();
    let milliseconds: f64 = of_frames.map(|(_, stats)| stats.wall_milliseconds).sum();
    let worst = frames.iter().map(|(judged, _)| judged.error);
    let worst = worst.fold(0.0, f64::max);
    let in_unit = |value: f64| match asked {
        Asked::Range(_) => format!("{value:.2} mm"),
        _ => format!("{:.2} %", 100.0 * value),
    };
    print!(
        "{name:<14} {asked:>9} {:>9.2} {:>7.0} {foretold:>8.2} {:>7} {:>7} {:>7} {:>7} {:>8}",
        rays as f64 / count * 1e-6,
        milliseconds / count,
        in_unit(rms(&|judged| judged.error)),
        in_unit(worst),
        in_unit(rms(&|judged| judged.claimed.unwrap_or_default())),
        in_unit(rms(&|judged| judged.bound.unwrap_or_default())),
        format!("{}+{}", counts.over, counts.far_over),
    );
}

/// The reference image of a scene, from its file if there is one.
fn reference(scene: &Scene, name: &str, bounces: u32) -> Result<Frame, Failure> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/bound");
    fs::create_dir_all(&folder)?;
    let edge_px = scene.camera.resolution_px.into_iter().max();
    let size = match edge_px {
        Some(px) if px != EDGE_PX => format!("_{px}px"),
        _ => String::new(),
    };
    let more = match bounces {
        1 => String::new(),
        count => format!("_{count}bounces"),
    };
    let path = folder.join(format!("{name}{size}{more}.exr"));
    let goal = Goal::StandardError(REFERENCE_ERROR);
    let go_on = &mut |_| ControlFlow::Continue(());
    let kept = Reference::resume(scene, &path);
    let mut reference = match kept {
        Ok(reference) => reference,
        Err(_) => Reference::start(scene, goal, go_on)?,
    };
    if !reference.meets(goal) {
        while !reference.meets(goal) {
            reference.add_round(go_on)?;
        }
        let file = OutputFile::create(&path)?;
        write_exr(file, &reference.frame(), &ExrOptions::default())?;
    }
    Ok(reference.frame())
}

/// What the target is about, with its layer of standard errors: light, and Z of each frequency.
fn layers(frame: &Frame) -> Vec<(Layer, Layer)> {
    let of_frequency = |frequency| {
        let layer = |quantity| Layer::Tof(frequency, quantity);
        (
            layer(TofQuantity::PhasorIndirect),
            layer(TofQuantity::PhasorStandardError),
        )
    };
    let phasors = (0..u8::MAX).map(of_frequency);
    let phasors = phasors.take_while(|&(layer, _)| frame.values(layer).is_some());
    [(Layer::Indirect, Layer::StandardError)]
        .into_iter()
        .chain(phasors)
        .collect()
}

/// Pixels that show a surface, and those on edges.
fn seen(frame: &Frame) -> [Vec<bool>; 2] {
    [Layer::InstanceId, Layer::Edge].map(|layer| frame.mask(layer))
}

fn compare(image: &[f32], truth: &Frame, of: (Layer, Layer)) -> Result<Comparison, Failure> {
    let [valid, edges] = seen(truth);
    let reference = truth.values(of.0).ok_or("the reference lacks a layer")?;
    Ok(Comparison::new(&Pixels {
        image,
        reference,
        image_standard_error: None,
        reference_standard_error: truth.values(of.1),
        valid: &valid,
        edges: Some(&edges),
        channels: reference.len() / valid.len(),
    })?)
}

/// A true error, and what the engine says of it.
#[derive(Clone, Copy)]
struct Judged {
    error: f64,
    claimed: Option<f64>,
    bound: Option<f64>,
}

impl Judged {
    /// What `target_error` is about.
    fn of_light(frame: &Frame, truth: &Frame) -> Result<Judged, Failure> {
        let stats = &frame.stats;
        let all = layers(truth);
        let count = match stats.estimated_range_error_mm {
            Some(_) => 1,
            None => all.len(),
        };
        Ok(Judged {
            error: true_error(frame, truth, &all[..count])?,
            claimed: stats.estimated_error,
            bound: stats.estimated_error_upper,
        })
    }

    /// Of the range, mm, of the worst frequency; `None` without time of flight. Nothing is claimed without a target for it.
    fn of_range(frame: &Frame, truth: &Frame) -> Result<Option<Judged>, Failure> {
        let stats = &frame.stats;
        let Some(tof) = &frame.description.tof else {
            return Ok(None);
        };
        let [valid, edges] = seen(truth);
        let mut worst_m: f64 = 0.0;
        for (frequency, &hz) in tof.frequencies_hz.iter().enumerate() {
            let layer = |quantity| Layer::Tof(frequency as u8, quantity);
            let of = |frame: &Frame, quantity| {
                let values = frame.values(layer(quantity)).map(<[f32]>::to_vec);
                values.ok_or("a frame lacks phasors")
            };
            let error_m = range_error_m(
                &of(frame, TofQuantity::Phasor)?,
                &of(truth, TofQuantity::Phasor)?,
                &of(truth, TofQuantity::PhasorStandardError)?,
                hz,
                |pixel| valid[pixel] && !edges[pixel],
            );
            worst_m = worst_m.max(error_m);
        }
        Ok(Some(Judged {
            error: 1e3 * worst_m,
            claimed: stats.estimated_range_error_mm,
            bound: stats.estimated_range_error_upper_mm,
        }))
    }
}

/// relRMSE without the noise of the reference; of the worst quantity.
fn true_error(frame: &Frame, truth: &Frame, of: &[(Layer, Layer)]) -> Result<f64, Failure> {
    let mut worst: f64 = 0.0;
    for &of in of {
        // Direct light alone.
        let Some(image) = frame.values(of.0) else {
            return Ok(0.0);
        };
        let comparison = compare(image, truth, of)?;
        let error = comparison.noise.map(|noise| noise.rmse);
        worst = worst.max(match error {
            Some(CorrectedRmse::Estimate { value, .. }) => value,
            // Noise hides it.
            _ => 0.0,
        });
    }
    Ok(worst)
}

/// The pixels of a layer that count: sums over all seeds, and what the reference has.
fn counted<'p>(
    truth: &'p Frame,
    layer: Layer,
    sums: &'p [f64],
) -> impl Iterator<Item = (&'p [f64], &'p [f32])> {
    let [valid, edges] = seen(truth);
    let due = truth.values(layer).unwrap_or_default();
    let channels = due.len() / valid.len();
    let pixels = sums.chunks_exact(channels).zip(due.chunks_exact(channels));
    let pixels = pixels.enumerate();
    pixels.filter_map(move |(pixel, pair)| (valid[pixel] && !edges[pixel]).then_some(pair))
}

/// The bias of the light of the mean image.
fn bias(truth: &Frame, sums: &[Vec<f64>], seeds: u32) -> String {
    let Some(of_light) = sums.first() else {
        return String::new();
    };
    let pixels = counted(truth, Layer::Indirect, of_light);
    let [sum, due] = pixels.fold([0.0; 2], |all, (sum, due)| {
        let due = due.iter().copied().map(f64::from);
        [all[0] + sum.iter().sum::<f64>(), all[1] + due.sum::<f64>()]
    });
    let bias = sum / f64::from(seeds) / due - 1.0;
    format!(" {:>8}", format!("{:+.2} %", 100.0 * bias))
}

/// The bias of the bounce's path in the mean image, mm, for each frequency.
fn path_biases(scene: &Scene, truth: &Frame, sums: &[Vec<f64>]) -> String {
    let mut text = String::new();
    for ((layer, _), sum) in layers(truth).into_iter().zip(sums) {
        let Layer::Tof(frequency, _) = layer else {
            continue;
        };
        let turn = counted(truth, layer, sum).map(|(sum, due)| {
            let due = [due[0], due[1]].map(f64::from);
            // Im and Re of sum · conj(due).
            [
                sum[1] * due[0] - sum[0] * due[1],
                sum[0] * due[0] + sum[1] * due[1],
            ]
        });
        let [im, re] = turn.fold([0.0; 2], |all, each| [all[0] + each[0], all[1] + each[1]]);
        let tof = scene.tof.as_ref();
        let hz = tof.map_or(f64::NAN, |tof| tof.frequencies_hz[usize::from(frequency)]);
        let path_m = im.atan2(re) * SPEED_OF_LIGHT_M_S / (2.0 * PI * hz);
        text += &format!("  {:+.2}", 1e3 * path_m);
    }
    text
}
