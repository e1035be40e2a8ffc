//! Sums at few pixels compared with the same sums at every pixel.

use std::{path::Path, time::Instant};

use camlux::{
    Device, RenderOptions, Renderer, Scene,
    output::{Frame, Layer},
    scene::{IndirectLight, RsmAverage},
};

use crate::{Failure, Spread, verdict};

const RSM_SIZE: u32 = 64;
/// Turns of each side, after one for warm-up.
const TURNS: usize = 7;
/// Required ratio of gather times for a target of 1 % in the first scene.
const BAR: f64 = 5.0;
/// Passes that replace the gather at every pixel.
const PASSES: [&str; 7] = [
    "receivers",
    "gather",
    "predict",
    "refine",
    "settle",
    "resolve",
    "appraise",
];

pub fn report(device: &Device) -> Result<(), Failure> {
    println!(
        "sums     rsm-average, 6 x {RSM_SIZE}² texels, with an interpolation error against every pixel; fastest of {TURNS} turns each"
    );
    println!(
        "{:<10} {:>9} {:>6} {:>8} {:>7} {:>18} {:>6} {:>18} {:>6}  bar",
        "scene", "px", "target", "error", "pairs", "gather s", "ratio", "frame s", "ratio"
    );
    let mut renderer = Renderer::new(device)?;
    for (name, edge_px, targets) in [
        ("cornell", 800, &[0.05, 0.02, 0.01, 0.002][..]),
        ("cornell", 200, &[0.01]),
        ("glossy", 400, &[0.01]),
        ("textured", 400, &[0.01]),
        ("knot", 800, &[0.01, 0.002]),
        ("knot", 128, &[0.002]),
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
        let mut scene = Scene::load(&path)?;
        scene.camera.resolution_px = [edge_px; 2];
        for &asked in targets {
            let has_bar = (name, edge_px, asked) == ("cornell", 800, 0.01);
            duel(&mut renderer, &scene, name, asked, has_bar)?;
        }
    }
    Ok(())
}

/// Times of all turns of one side, and its latest frame.
struct Side {
    scene: Scene,
    gather_s: Vec<f64>,
    frame_s: Vec<f64>,
    frame: Option<Frame>,
}

impl Side {
    fn new(scene: &Scene, interpolation_error: Option<f64>) -> Side {
        let mut scene = scene.clone();
        scene.indirect = Some(IndirectLight::RsmAverage(RsmAverage {
            rsm_size: RSM_SIZE,
            interpolation_error,
        }));
        Side {
            scene,
            gather_s: Vec::new(),
            frame_s: Vec::new(),
            frame: None,
        }
    }

    fn turn(&mut self, renderer: &mut Renderer) -> Result<(), Failure> {
        let start = Instant::now();
        let frame = renderer.render(&self.scene, &mut RenderOptions::default())?;
        self.frame_s.push(start.elapsed().as_secs_f64());
        let passes = frame.stats.passes.iter();
        let of_gather = passes.filter(|pass| PASSES.contains(&pass.name));
        let milliseconds: f64 = of_gather.map(|pass| pass.milliseconds).sum();
        self.gather_s.push(1e-3 * milliseconds);
        self.frame = Some(frame);
        Ok(())
    }
}

fn duel(
    renderer: &mut Renderer,
    scene: &Scene,
    name: &str,
    asked: f64,
    has_bar: bool,
) -> Result<(), Failure> {
    let mut sides = [Side::new(scene, None), Side::new(scene, Some(asked))];
    for turn in 0..=TURNS {
        for side in &mut sides {
            side.turn(renderer)?;
            if turn == 0 {
                side.gather_s.clear();
                side.frame_s.clear();
            }
        }
    }
    let [every, few] = &sides;
    let (Some(exact), Some(frame)) = (&every.frame, &few.frame) else {
        return Err("no frame was rendered".into());
    };
    let times =
        |of: fn(&Side) -> &Vec<f64>| [every, few].map(|side| Spread::of(of(side).clone()).min);
    let gather = times(|side| &side.gather_s);
    let whole = times(|side| &side.frame_s);
    let pair = |[every, few]: [f64; 2]| format!("{every:.3} to {few:.3}");
    let ratio = gather[0] / gather[1];
    let error = relative_rmse(frame, exact);
    let bar = format!(
        "≥ {BAR:.0}, ≤ {:.0} % {}",
        100.0 * asked,
        verdict(ratio >= BAR && error <= asked)
    );
    let line = format!(
        "{name:<10} {:>9} {:>6} {:>8} {:>7} {:>18} {ratio:>6.2} {:>18} {:>6.2}  {}",
        format!("{0} x {0}", scene.camera.resolution_px[0]),
        format!("{} %", 100.0 * asked),
        format!("{:.2} %", 100.0 * error),
        format!(
            "{:.1} %",
            100.0 * frame.stats.pixel_vpl_pairs as f64 / exact.stats.pixel_vpl_pairs as f64
        ),
        pair(gather),
        pair(whole),
        whole[0] / whole[1],
        if has_bar { &bar } else { "" },
    );
    println!("{}", line.trim_end());
    Ok(())
}

/// sqrt(Σ(x−t)²/Σt²) of the indirect light.
fn relative_rmse(image: &Frame, truth: &Frame) -> f64 {
    let [image, truth] =
        [image, truth].map(|frame| frame.values(Layer::Indirect).unwrap_or_default());
    let squares = image.iter().zip(truth).map(|(&x, &t)| {
        let (x, t) = (f64::from(x), f64::from(t));
        [(x - t).powi(2), t * t]
    });
    let [error, signal] = squares.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
    (error / signal).sqrt()
}
