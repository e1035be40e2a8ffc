//! `camlux doctor`: hard cases on the user's own device.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use camlux::doctor::{Case, Examiner, Group, Measurement, Part};
use camlux::output::{OutputFile, PngView, write_png};
use camlux::{Device, RenderOptions, Renderer};

use crate::options::{DeviceArgs, resize};
use crate::output::create_folder;
use crate::{Failure, print, tell};

#[derive(clap::Args)]
pub struct Args {
    /// Only cases, long ones too, whose names contain one of these words
    #[arg(value_name = "WORD")]
    pub words: Vec<String>,
    /// All cases, also those that take long
    #[arg(long)]
    pub all: bool,
    /// Print the tables of docs/hard-cases.md
    #[arg(long)]
    pub markdown: bool,
    /// Leave a picture of the last scene of each case in this folder, as a PNG
    #[arg(long, value_name = "FOLDER")]
    pub pictures: Option<PathBuf>,
    #[command(flatten)]
    pub device: DeviceArgs,
}

impl Args {
    fn picks(&self, case: &Case) -> bool {
        if self.words.is_empty() {
            return self.all || case.is_short;
        }
        self.words
            .iter()
            .any(|word| case.name.contains(word.as_str()))
    }
}

/// Exit code 0 if every case is met but those that are known not to be, else 1.
pub fn run(args: &Args) -> Result<ExitCode, Failure> {
    let picked = |group: Group| group.cases().iter().filter(|case| args.picks(case));
    if !Group::ALL
        .into_iter()
        .any(|group| picked(group).next().is_some())
    {
        return Err(format!(
            "no case has a name with {}; leave it out for all",
            args.words.join(" or ")
        )
        .into());
    }
    let device = Device::open(&args.device.options())?;
    let info = device.info();
    tell(&format!("camlux: {} ({})", info.name, info.driver));
    let mut examiner = Examiner::new(&device)?;
    let mut failed = 0;
    if !args.markdown {
        print(&row(["case", "error", "bound", "", "ms"]))?;
    }
    for group in Group::ALL {
        if args.markdown && picked(group).next().is_some() {
            print(&markdown_head(group))?;
        }
        for case in picked(group) {
            let start = Instant::now();
            let result = examine(case, &mut examiner);
            if let (Some(folder), Ok(_)) = (&args.pictures, &result) {
                write_picture(folder, case, &examiner, &device)?;
            }
            if result.is_err() {
                // What a panic leaves behind is not to be relied on.
                examiner = Examiner::new(&device)?;
            }
            let milliseconds = start.elapsed().as_secs_f64() * 1e3;
            let verdict = Verdict::new(case, &result);
            failed += usize::from(verdict == Verdict::Failed);
            print(&if args.markdown {
                markdown_row(case, &result)
            } else {
                text_row(case, &result, verdict, milliseconds)
            })?;
        }
    }
    if failed == 0 {
        return Ok(ExitCode::SUCCESS);
    }
    tell(&format!(
        "camlux: {failed} of the cases are not met on this device"
    ));
    Ok(ExitCode::FAILURE)
}

/// Pixels of a picture's longer edge; its panels stand side by side.
const PICTURE_PX: f64 = 192.0;

/// The last scene that the case has rendered, larger.
fn write_picture(
    folder: &Path,
    case: &Case,
    examiner: &Examiner,
    device: &Device,
) -> Result<(), Failure> {
    let Some(mut scene) = examiner.last_scene().cloned() else {
        return Ok(());
    };
    let [width, height] = scene.camera.resolution_px.map(f64::from);
    let scale = PICTURE_PX / width.max(height);
    let size_px = [width, height].map(|length| (length * scale).round().max(1.0) as u32);
    scene.camera = resize(scene.camera, size_px);
    let frame = Renderer::new(device)?.render(&scene, &mut RenderOptions::default())?;
    create_folder(folder)?;
    let path = folder.join(format!("{}.png", case.name));
    write_png(
        OutputFile::create(&path)?,
        &frame,
        PngView::for_frame(&frame),
    )?;
    Ok(())
}

/// What was measured, or why nothing was.
type Examination = Result<Measurement, String>;

fn examine(case: &Case, examiner: &mut Examiner) -> Examination {
    match catch_unwind(AssertUnwindSafe(|| case.run(examiner))) {
        Ok(Ok(measured)) => Ok(measured),
        Ok(Err(error)) => Err(error.to_string()),
        Err(_) => Err("panicked".into()),
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Ok,
    KnownIssue,
    Failed,
}

impl Verdict {
    fn new(case: &Case, result: &Examination) -> Verdict {
        let is_met = result.as_ref().is_ok_and(Measurement::is_met);
        match (is_met, case.known_issue) {
            (true, _) => Verdict::Ok,
            (false, Some(_)) => Verdict::KnownIssue,
            (false, None) => Verdict::Failed,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Verdict::Ok => "ok",
            Verdict::KnownIssue => "known issue",
            Verdict::Failed => "FAILED",
        }
    }
}

fn row([case, error, bound, verdict, milliseconds]: [&str; 5]) -> String {
    format!("{case:<52} {error:>9} {bound:>9}  {verdict:<11} {milliseconds:>7}\n")
}

/// The part nearest to its bound; of a case that is not met, a line for each part that is not.
fn text_row(case: &Case, result: &Examination, verdict: Verdict, milliseconds: f64) -> String {
    let worst = result.as_ref().ok().and_then(Measurement::worst);
    let [error, bound] = match worst {
        Some(part) => [number(part.error), number(part.bound)],
        None => ["-".into(), "-".into()],
    };
    let time = format!("{milliseconds:.0}");
    let mut text = row([case.name, &error, &bound, verdict.word(), &time]);
    if let Some(issue) = case.known_issue.filter(|_| verdict == Verdict::KnownIssue) {
        text += &format!("    {issue}\n");
    }
    match result {
        Ok(measured) => {
            for part in measured.parts.iter().filter(|part| !part.is_met()) {
                let Part {
                    of,
                    quantity,
                    error,
                    bound,
                } = part;
                text += &format!("    {of}, {quantity}: {error:.1e} is over {bound:.1e}\n");
            }
        }
        Err(problem) => text += &format!("    {problem}\n"),
    }
    text
}

/// Two digits; 0 and ∞ as they are.
fn number(value: f64) -> String {
    match value {
        0.0 => "0".into(),
        f64::INFINITY => "∞".into(),
        value => format!("{value:.1e}"),
    }
}

fn markdown_head(group: Group) -> String {
    format!(
        "\n## {}\n\n| case | what breaks a naive implementation | what camlux does | error (bound) |\n|---|---|---|---|\n",
        group.name()
    )
}

fn markdown_row(case: &Case, result: &Examination) -> String {
    let errors = match result {
        Ok(measured) => {
            let parts = measured.worst_of_each_quantity().into_iter();
            let texts: Vec<String> = parts
                .map(
                    |Part {
                         quantity,
                         error,
                         bound,
                         ..
                     }| {
                        format!("{quantity} {} ({})", number(*error), number(*bound))
                    },
                )
                .collect();
            texts.join("; ")
        }
        Err(problem) => problem.clone(),
    };
    let issue = match case.known_issue {
        Some(issue) if !result.as_ref().is_ok_and(Measurement::is_met) => {
            format!(" **Known issue**: {issue}.")
        }
        _ => String::new(),
    };
    let name = case.name.replace('_', " ");
    format!(
        "| {name} | {} | {}.{issue} | {errors} |\n",
        case.hazard, case.remedy
    )
}
