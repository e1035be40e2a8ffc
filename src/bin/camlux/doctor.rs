//! `camlux doctor`: runs hard cases on the user's own device.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use camlux::hard_cases::{Case, Examiner, GROUPS, Measurement, Part, torture::CASES};
use camlux::output::{OutputFile, PngView, write_png};
use camlux::{Device, RenderOptions, Renderer};

use crate::options::DeviceArgs;
use crate::output::create_folder;
use crate::{Failure, print, tell, torture};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  camlux doctor
  camlux doctor --torture out/torture
The cases: docs/hard-cases.md")]
pub struct Args {
    /// Only cases whose names contain one of these words
    #[arg(value_name = "WORD")]
    pub words: Vec<String>,
    /// All cases, also the long ones
    #[arg(long)]
    pub all: bool,
    /// Print the tables of docs/hard-cases.md
    #[arg(long)]
    pub markdown: bool,
    /// Write a PNG of each case to this folder
    #[arg(long, value_name = "FOLDER")]
    pub pictures: Option<PathBuf>,
    #[command(flatten)]
    pub torture: torture::Args,
    #[command(flatten)]
    pub device: DeviceArgs,
}

impl Args {
    fn picks(&self, case: &Case) -> bool {
        (self.all || case.is_short || !self.words.is_empty()) && self.has_word_of(case)
    }

    fn has_word_of(&self, case: &Case) -> bool {
        let groups = GROUPS.iter();
        let mut groups = groups.filter(|(_, cases)| cases.iter().any(|c| c.name == case.name));
        let group = groups.next().map_or("", |(group, _)| group);
        // The same format as in the documentation.
        let plain = |name: &str| name.to_lowercase().replace([' ', '_'], "");
        let names = [plain(case.name), plain(group)];
        let has = |word: &String| names.iter().any(|name| name.contains(&plain(word)));
        self.words.is_empty() || self.words.iter().any(has)
    }
}

/// Exit code 0 if every case meets its bound, except the cases that are known to fail; else 1.
pub fn run(args: &Args) -> Result<ExitCode, Failure> {
    let settings = args.torture.settings();
    let mut cases = GROUPS.iter().flat_map(|(_, cases)| *cases);
    let is_any = match settings {
        Some(_) => CASES.iter().any(|case| args.has_word_of(case)),
        None => cases.any(|case| args.picks(case)),
    };
    if !is_any {
        let words = args.words.join(" or ");
        return Err(format!("no case and no group of cases has a name with {words}; docs/hard-cases.md lists the names; without a WORD, the default cases run").into());
    }
    let device = Device::open(&args.device.options())?;
    let info = device.info();
    tell(&format!("camlux: {} ({})", info.name, info.driver));
    let mut examiner = Examiner::new(&device)?;
    if let Some(settings) = settings {
        return torture::run(examiner, settings, |case| args.has_word_of(case));
    }
    let mut failed = 0;
    if !args.markdown {
        print(&row(["case", "error", "bound", "", "ms"]))?;
    }
    for (heading, cases) in GROUPS {
        let mut picked = cases.iter().filter(|case| args.picks(case)).peekable();
        if args.markdown && picked.peek().is_some() {
            print(&format!("\n## {heading}\n\n{MARKDOWN_HEAD}"))?;
        }
        for case in picked {
            let start = Instant::now();
            let result = examine(case, &mut examiner);
            match (&result, &args.pictures) {
                (Ok(_), Some(folder)) => write_picture(folder, case, &examiner, &device)?,
                (Ok(_), None) => {}
                // State that a panic leaves behind cannot be relied on.
                (Err(_), _) => examiner = Examiner::new(&device)?,
            }
            let verdict = verdict(case, &result);
            failed += usize::from(verdict == FAILED);
            let time = format!("{:.0}", start.elapsed().as_secs_f64() * 1e3);
            print(&if args.markdown {
                markdown_row(case, &result)
            } else {
                text_row(case, &result, verdict, &time)
            })?;
        }
    }
    if failed == 0 {
        return Ok(ExitCode::SUCCESS);
    }
    tell(&format!(
        "camlux: {failed} of the cases failed on this device"
    ));
    Ok(ExitCode::FAILURE)
}

/// Pixels of a picture's longer edge; its panels are side by side.
const PICTURE_PX: f64 = 192.0;

/// The last scene that the case rendered, at a larger size.
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
    scene.camera = scene.camera.resized(size_px);
    let frame = Renderer::new(device)?.render(&scene, &mut RenderOptions::default())?;
    create_folder(folder)?;
    let file = OutputFile::create(folder.join(format!("{}.png", case.name)))?;
    write_png(file, &frame, PngView::for_frame(&frame))?;
    Ok(())
}

/// The measurement, or why there is none.
type Examination = Result<Measurement, String>;

fn examine(case: &Case, examiner: &mut Examiner) -> Examination {
    match catch_unwind(AssertUnwindSafe(|| examiner.examine(case))) {
        Ok(Ok(measured)) => Ok(measured),
        Ok(Err(error)) => Err(error.to_string()),
        Err(_) => Err("panicked; stderr has its message".into()),
    }
}

const KNOWN_ISSUE: &str = "known issue";
const FAILED: &str = "FAILED";

fn verdict(case: &Case, result: &Examination) -> &'static str {
    match case.known_issue {
        _ if result.as_ref().is_ok_and(Measurement::is_met) => "ok",
        Some(_) => KNOWN_ISSUE,
        None => FAILED,
    }
}

fn row([case, error, bound, verdict, milliseconds]: [&str; 5]) -> String {
    format!("{case:<52} {error:>9} {bound:>9}  {verdict:<11} {milliseconds:>7}\n")
}

/// The part nearest to its bound; for a failed case, one line for each part that misses its bound.
fn text_row(case: &Case, result: &Examination, verdict: &str, milliseconds: &str) -> String {
    let worst = result.as_ref().ok().and_then(Measurement::worst);
    let [error, bound] = worst.map_or(["-".into(), "-".into()], |part| {
        [part.error, part.bound].map(number)
    });
    let mut text = row([case.name, &error, &bound, verdict, milliseconds]);
    if let Some(issue) = case.known_issue.filter(|_| verdict == KNOWN_ISSUE) {
        text += &format!("    {issue}\n");
    }
    match result {
        Ok(measured) => {
            for part in measured.parts.iter().filter(|part| !part.is_met()) {
                let words = [part.of.as_str(), &part.quantity];
                let what = words.into_iter().filter(|word| !word.is_empty());
                let what = what.collect::<Vec<_>>().join(", ");
                let (error, bound) = (part.error, part.bound);
                text += &format!("    {what}: {error:.1e} is over {bound:.1e}\n");
            }
        }
        Err(problem) => text += &format!("    {problem}\n"),
    }
    text
}

/// Two digits; 0 and ∞ are printed as they are.
fn number(value: f64) -> String {
    match value {
        0.0 => "0".into(),
        f64::INFINITY => "∞".into(),
        value => format!("{value:.1e}"),
    }
}

const MARKDOWN_HEAD: &str = "\
| case | what is hard about it | what camlux does | checked | bound | measured |
|---|---|---|---|---|---|
";

fn markdown_row(case: &Case, result: &Examination) -> String {
    let [checked, bounds, errors] = match result {
        Ok(measured) => {
            let parts = measured.worst_of_each_quantity();
            let column = |text: fn(&Part) -> String| {
                let lines: Vec<String> = parts.iter().map(|part| text(part)).collect();
                lines.join("<br>")
            };
            [
                // Wrapped lines would not line up with their numbers.
                column(|part| part.quantity.replace(' ', "\u{a0}")),
                column(|part| number(part.bound)),
                column(|part| number(part.error)),
            ]
        }
        Err(problem) => [problem.clone(), String::new(), String::new()],
    };
    let issue = match case.known_issue {
        Some(issue) if verdict(case, result) == KNOWN_ISSUE => {
            format!(" **Known issue**: {issue}.")
        }
        _ => String::new(),
    };
    let name = case.name.replace('_', " ");
    let (hazard, remedy) = (case.hazard, case.remedy);
    format!("| {name} | {hazard} | {remedy}.{issue} | {checked} | {bounds} | {errors} |\n")
}
